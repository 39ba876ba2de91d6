"""Cost of a zone: closed forms, costs made of other costs, and processes with the zones that they can hold."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError

Expression = Any
"""Expression of cvxpy; the program that wants a cost as one hands cvxpy over, which is loaded for that alone."""


@dataclass(frozen=True, kw_only=True)
class _FallingCost:
    """Parameters that all closed forms have."""

    fixed: float = 0.0  # What the feature costs however wide its zone, a [cost units]
    factor: float  # What the falling part is multiplied by, b [cost units × (unit of the zone)ⁿ]

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name == "fixed" and not (isfinite(value) and value >= 0):
                raise InputError.at("cost model", name, value, "a finite number, 0 or above")
            if name != "fixed" and not (isfinite(value) and value > 0):
                raise InputError.at("cost model", name, value, "a finite number above 0, so that the cost falls")

    @property
    def is_convex(self) -> bool:
        """Whether the cost is a convex function of the zone: all closed forms are."""
        return True


@dataclass(frozen=True, kw_only=True)
class Reciprocal(_FallingCost):
    """Cost a + b/t [cost units] of a zone t above 0, theory page equation (51).

    References
    ----------
    K. W. Chase, W. H. Greenwood, Design issues in mechanical tolerance analysis, Manuf. Rev. 1 (1988) 50–59.

    Examples
    --------
    >>> float(Reciprocal(fixed=2.0, factor=30.0).value(np.array(10.0)))
    5.0
    """

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor / zone)

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-self.factor / zone**2)

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as a convex expression."""
        return self.fixed + cvx.multiply(self.factor, cvx.inv_pos(zone))

    def rescaled(self, unit: float) -> Reciprocal:
        """Return the same cost as a function of zone / unit."""
        return replace(self, factor=self.factor / unit)


@dataclass(frozen=True, kw_only=True)
class ReciprocalPower(_FallingCost):
    """Cost a + b·t⁻ⁿ [cost units] of a zone t above 0, theory page equation (51).

    References
    ----------
    G. H. Sutherland, B. Roth, Mechanism design: accounting for manufacturing tolerances and costs in function
    generating problems, J. Eng. Ind. 97 (1975) 283–286; n = 2: M. F. Spotts, Allocation of tolerances to minimize cost
    of assembly, J. Eng. Ind. 95 (1973) 762–764.

    Examples
    --------
    >>> float(ReciprocalPower(fixed=2.0, factor=30.0, exponent=0.5).value(np.array(9.0)))
    12.0
    """

    exponent: float  # n [-]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor * zone**-self.exponent)

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-self.exponent * self.factor * zone ** (-self.exponent - 1.0))

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as a convex expression.

        Notes
        -----
        Through the logarithm, as solvers take powers by a rational exponent that is only close to n.
        """
        return self.fixed + cvx.exp(np.log(self.factor) - cvx.multiply(self.exponent, cvx.log(zone)))

    def rescaled(self, unit: float) -> ReciprocalPower:
        """Return the same cost as a function of zone / unit."""
        return replace(self, factor=self.factor * unit**-self.exponent)


@dataclass(frozen=True, kw_only=True)
class Exponential(_FallingCost):
    """Cost a + b·exp(−t/s) [cost units] of a zone t, theory page equation (51).

    References
    ----------
    F. H. Speckhart, Calculation of tolerance based on a minimum cost approach, J. Eng. Ind. 94 (1972) 447–453.

    Examples
    --------
    >>> round(float(Exponential(fixed=2.0, factor=30.0, scale=10.0).value(np.array(10.0))), 3)
    13.036
    """

    scale: float  # s, the change of the zone that divides the falling part by e [unit of the zone]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor * np.exp(-zone / self.scale))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-self.factor / self.scale * np.exp(-zone / self.scale))

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as a convex expression."""
        return self.fixed + cvx.multiply(self.factor, cvx.exp(-zone / self.scale))

    def rescaled(self, unit: float) -> Exponential:
        """Return the same cost as a function of zone / unit."""
        return replace(self, scale=self.scale / unit)


@dataclass(frozen=True, kw_only=True)
class PowerExponential(_FallingCost):
    """Cost a + b·t⁻ⁿ·exp(−t/s) [cost units] of a zone t above 0, theory page equation (51).

    References
    ----------
    W. Michael, J. N. Siddall, The optimization problem with optimal tolerance assignment and full acceptance,
    J. Mech. Des. 103 (1981).

    Examples
    --------
    >>> round(float(PowerExponential(fixed=2.0, factor=30.0, exponent=0.5, scale=9.0).value(np.array(9.0))), 3)
    5.679
    """

    exponent: float  # n [-]
    scale: float  # s [unit of the zone]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.fixed + self.factor * zone**-self.exponent * np.exp(-zone / self.scale))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(-(self.value(zone) - self.fixed) * (self.exponent / zone + 1.0 / self.scale))

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as a convex expression."""
        falling = cvx.multiply(self.exponent, cvx.log(zone)) + zone / self.scale
        return self.fixed + cvx.exp(np.log(self.factor) - falling)

    def rescaled(self, unit: float) -> PowerExponential:
        """Return the same cost as a function of zone / unit."""
        return replace(self, factor=self.factor * unit**-self.exponent, scale=self.scale / unit)


ClosedForm = Reciprocal | ReciprocalPower | Exponential | PowerExponential


def stacked(costs: Sequence[ClosedForm]) -> ClosedForm:
    """Return costs of one form as one whose parameters are columns, so that a row of zones belongs to each.

    cᵢ(tᵢ) by its own form for every row i (own derivation) [cost units]; nothing is approximated.

    >>> stacked([Reciprocal(factor=1.0), Reciprocal(factor=2.0)]).value(np.array([[1.0, 2.0], [1.0, 2.0]]))
    array([[1. , 0.5],
           [2. , 1. ]])
    """
    made = copy(costs[0])
    for name in vars(made):
        object.__setattr__(made, name, np.array([[getattr(cost, name)] for cost in costs]))  # each is checked already
    return made


@runtime_checkable
class CostModel(Protocol):
    """Cost of a feature as a decreasing function of its zone, in the unit of its parameters until it is `rescaled`."""

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        ...

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        ...

    @property
    def is_convex(self) -> bool:
        """Whether the cost is a convex function of the zone."""
        ...

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return a convex cost as an expression of scalar or vector zones, made with cvxpy."""
        ...

    def rescaled(self, unit: float) -> CostModel:
        """Return the same cost as a function of zone / unit."""
        ...


@dataclass(frozen=True, kw_only=True)
class Process:
    """One way to make a feature."""

    name: str  # Name of the process
    cost: CostModel  # Cost of the feature made in this way
    # Smallest and largest zone that it can hold [unit of the zone]
    minimum: float
    maximum: float
    # Fixed cost of making the feature in this way, such as that of leaving today's process [cost units]
    change: float = 0.0

    def __post_init__(self) -> None:
        place = f"process {self.name}"
        if not 0 < self.minimum <= self.maximum < np.inf:
            raise InputError.at(
                place, "min and max", (self.minimum, self.maximum), "two numbers above 0, the smaller one first"
            )
        slopes = self.cost.slope(np.linspace(self.minimum, self.maximum, 33))
        if not np.all(slopes <= 0):
            raise InputError.at(
                place, "cost", f"growing with the zone between {self.minimum:g} and {self.maximum:g}", "a falling cost"
            )

    def total(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost with the fixed part [cost units]."""
        return np.asarray(self.cost.value(zone) + self.change)

    def rescaled(self, unit: float) -> Process:
        """Return the same process with zones counted in another unit [old unit]."""
        return replace(self, cost=self.cost.rescaled(unit), minimum=self.minimum / unit, maximum=self.maximum / unit)


@dataclass(frozen=True, kw_only=True)
class Weighted:
    """A cost model times a number, such as a price that may be off by a fifth."""

    model: CostModel  # The cost model
    weight: float  # The number, above 0 [-]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.weight * self.model.value(zone))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(self.weight * self.model.slope(zone))

    @property
    def is_convex(self) -> bool:
        """Whether the cost is a convex function of the zone."""
        return self.model.is_convex

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as a convex expression."""
        return self.weight * self.model.expression(zone, cvx)

    def rescaled(self, unit: float) -> Weighted:
        """Return the same cost as a function of zone / unit."""
        return Weighted(model=self.model.rescaled(unit), weight=self.weight)

    @property
    def alone(self) -> CostModel:
        """The same as a closed form of its own, where the model is one: the parameters a and b times the number."""
        if not isinstance(self.model, ClosedForm):
            return self
        return replace(self.model, fixed=self.weight * self.model.fixed, factor=self.weight * self.model.factor)


def by_form(costs: Sequence[CostModel]) -> list[tuple[list[int], CostModel]]:
    """Return where costs of one closed form stand, with all of them as one of columns, the others each for itself.

    >>> [places for places, _ in by_form([Reciprocal(factor=1.0), Exponential(factor=1.0, scale=1.0)] * 2)]
    [[0, 2], [1, 3]]
    """
    plain = [cost.alone if isinstance(cost, Weighted) else cost for cost in costs]
    together: dict[object, list[int]] = defaultdict(list)
    for at, cost in enumerate(plain):
        together[type(cost) if isinstance(cost, ClosedForm) else at].append(at)
    found = []
    for places in together.values():
        closed = [cost for cost in (plain[at] for at in places) if isinstance(cost, ClosedForm)]
        found.append((places, stacked(closed) if closed else plain[places[0]]))
    return found


def made_together(models: Sequence[CostModel], ratios: Sequence[float]) -> CostModel:
    """Return the cost of several callouts that change together, as simple as it can be said; see `SumOfCosts`.

    c(s) = Σ cᵢ(zoneᵢ·s) over the scale s (own derivation) [cost units], exact.

    >>> made_together([Reciprocal(factor=1.0), Reciprocal(factor=2.0)], [0.5, 1.0])
    Reciprocal(fixed=0.0, factor=4.0)
    """
    own = [model.rescaled(ratio) for model, ratio in zip(models, ratios, strict=True)]
    reciprocal = [model for model in own if isinstance(model, Reciprocal)]
    if len(reciprocal) == len(own):
        return Reciprocal(
            fixed=sum(model.fixed for model in reciprocal), factor=sum(model.factor for model in reciprocal)
        )
    return SumOfCosts(models=tuple(models), ratios=tuple(ratios))


@dataclass(frozen=True, kw_only=True)
class SumOfCosts:
    """Cost of several callouts that are made in the same way and change together: Σ costᵢ(ratioᵢ·x)."""

    models: tuple[CostModel, ...]  # Cost of each callout as a function of its own zone
    # Zone of each callout over the common variable [unit of the zone per unit of the variable]
    ratios: tuple[float, ...]

    @cached_property
    def _parts(self) -> tuple[CostModel, ...]:
        """Costs as functions of the common variable."""
        return tuple(model.rescaled(ratio) for model, ratio in zip(self.models, self.ratios, strict=True))

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(np.sum([part.value(zone) for part in self._parts], axis=0))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the common variable [cost units per unit of the variable]."""
        return np.asarray(np.sum([part.slope(zone) for part in self._parts], axis=0))

    @property
    def is_convex(self) -> bool:
        """Whether every part is a convex function of its zone."""
        return all(part.is_convex for part in self._parts)

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as a convex expression."""
        return sum(part.expression(zone, cvx) for part in self._parts)

    def rescaled(self, unit: float) -> SumOfCosts:
        """Return the same cost as a function of variable / unit."""
        return replace(self, ratios=tuple(ratio * unit for ratio in self.ratios))
