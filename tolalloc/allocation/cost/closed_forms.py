"""Cost models in closed form: a fixed cost, and a part that falls with the zone."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import isfinite, log
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError

Expression = Any
"""Expression of cvxpy, which is imported when a program is made."""


@dataclass(frozen=True, kw_only=True)
class _FallingCost:
    """Parameters that all closed forms have.

    Raises
    ------
    InputError
        A parameter with which the cost would not fall with the zone.
    """

    fixed: float = 0.0  # What the feature costs however wide its zone, a [cost units]
    factor: float  # What the falling part is multiplied by, b [cost units × (unit of the zone)ⁿ]

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name == "fixed" and not (isfinite(value) and value >= 0):
                raise InputError.at("cost model", name, value, "a finite number, 0 or above")
            if name != "fixed" and not (isfinite(value) and value > 0):
                raise InputError.at("cost model", name, value, "a finite number above 0, so that the cost falls")


@dataclass(frozen=True, kw_only=True)
class Reciprocal(_FallingCost):
    """Cost a + b/t."""

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor / zone)

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-self.factor / zone**2)

    def expression(self, zone: Expression) -> Expression:
        """Return the cost as a convex expression."""
        import cvxpy as cp

        return self.fixed + self.factor * cp.inv_pos(zone)

    def rescaled(self, unit: float) -> Reciprocal:
        """Return the same cost as a function of zone / unit."""
        return replace(self, factor=self.factor / unit)


@dataclass(frozen=True, kw_only=True)
class ReciprocalPower(_FallingCost):
    """Cost a + b·t⁻ⁿ."""

    exponent: float  # n [-]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor * zone**-self.exponent)

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-self.exponent * self.factor * zone ** (-self.exponent - 1.0))

    def expression(self, zone: Expression) -> Expression:
        """Return the cost as a convex expression.

        Notes
        -----
        Through the logarithm, as solvers take powers by a rational exponent that is only close to n.
        """
        import cvxpy as cp

        return self.fixed + cp.exp(log(self.factor) - self.exponent * cp.log(zone))

    def rescaled(self, unit: float) -> ReciprocalPower:
        """Return the same cost as a function of zone / unit."""
        return replace(self, factor=self.factor * unit**-self.exponent)


def reciprocal_squared(*, fixed: float = 0.0, factor: float) -> ReciprocalPower:
    """Return the cost a + b/t²."""
    return ReciprocalPower(fixed=fixed, factor=factor, exponent=2.0)


@dataclass(frozen=True, kw_only=True)
class Exponential(_FallingCost):
    """Cost a + b·exp(−t/s)."""

    scale: float  # s, the change of the zone that divides the falling part by e [unit of the zone]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor * np.exp(-zone / self.scale))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-self.factor / self.scale * np.exp(-zone / self.scale))

    def expression(self, zone: Expression) -> Expression:
        """Return the cost as a convex expression."""
        import cvxpy as cp

        return self.fixed + self.factor * cp.exp(-zone / self.scale)

    def rescaled(self, unit: float) -> Exponential:
        """Return the same cost as a function of zone / unit."""
        return replace(self, scale=self.scale / unit)


@dataclass(frozen=True, kw_only=True)
class Combined(_FallingCost):
    """Cost a + b·t⁻ⁿ·exp(−t/s).

    References
    ----------
    W. Michael, J. N. Siddall, The optimization problem with optimal tolerance assignment and full acceptance,
    J. Mech. Des. 103 (1981).
    """

    exponent: float  # n [-]
    scale: float  # s [unit of the zone]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor * zone**-self.exponent * np.exp(-zone / self.scale))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-(self.value(zone) - self.fixed) * (self.exponent / zone + 1.0 / self.scale))

    def expression(self, zone: Expression) -> Expression:
        """Return the cost as a convex expression."""
        import cvxpy as cp

        return self.fixed + cp.exp(log(self.factor) - self.exponent * cp.log(zone) - zone / self.scale)

    def rescaled(self, unit: float) -> Combined:
        """Return the same cost as a function of zone / unit."""
        return replace(self, factor=self.factor * unit**-self.exponent, scale=self.scale / unit)


ClosedForm = Reciprocal | ReciprocalPower | Exponential | Combined


def stacked(costs: Sequence[ClosedForm]) -> ClosedForm:
    """Return costs of one form as one whose parameters are columns, so that a row of zones belongs to each.

    >>> stacked([Reciprocal(factor=1.0), Reciprocal(factor=2.0)]).value(np.array([[1.0, 2.0], [1.0, 2.0]]))
    array([[1. , 0.5],
           [2. , 1. ]])
    """
    made = copy(costs[0])
    for name in vars(made):
        object.__setattr__(made, name, np.array([[getattr(cost, name)] for cost in costs]))  # each is checked already
    return made
