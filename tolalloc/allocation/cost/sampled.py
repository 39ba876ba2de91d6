"""Cost models through points, and the cost of several callouts that are made together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cvxpy as cp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from tolalloc.allocation.cost.closed_forms import Reciprocal
from tolalloc.allocation.cost.convex_slopes import ROUNDING, convex_slopes
from tolalloc.allocation.cost.model import CostModel
from tolalloc.allocation.cost.points import Points

OUTER_ERROR = 1e-6
"""Largest share of its cost by which the convex form of a spline lies below the spline [-]."""


@dataclass(frozen=True)
class Tabulated:
    """Cost on straight lines between points; the first and the last line go on beyond them.

    Parameters
    ----------
    points
        The points, falling.

    Raises
    ------
    InputError
        Points that rise with the zone.
    """

    points: Points

    def __post_init__(self) -> None:
        self.points.require_falling()

    @cached_property
    def _slopes(self) -> Float[np.ndarray, " line"]:
        return np.diff(self.points.costs) / np.diff(self.points.zones)

    def _line(self, zone: Float[np.ndarray, "*zones"]) -> np.ndarray:
        """Return the line of each zone; a point itself belongs to the line behind it."""
        behind = np.searchsorted(self.points.zones, zone, side="right")
        return np.asarray(np.clip(behind - 1, 0, self._slopes.size - 1))

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        line = self._line(zone)
        start, cost = np.array(self.points.zones)[line], np.array(self.points.costs)[line]
        return np.asarray(cost + self._slopes[line] * (zone - start))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone, at a point to its right [cost units per unit of the zone]."""
        return np.asarray(self._slopes[self._line(zone)])

    def expression(self, zone: cp.Expression) -> cp.Expression | None:
        """Return the cost as the highest of the lines, or None where their slopes do not increase."""
        if np.diff(self._slopes, append=0.0).min() < ROUNDING * self._slopes.min():
            return None
        return _highest(np.array(self.points.zones[:-1]), np.array(self.points.costs[:-1]), self._slopes, zone)

    def rescaled(self, unit: float) -> Tabulated:
        """Return the same cost as a function of zone / unit."""
        return Tabulated(self.points.rescaled(unit))


@dataclass(frozen=True)
class Spline:
    """Cost on a monotone cubic spline through points; the tangents at both ends go on beyond them.

    Parameters
    ----------
    points
        The points, falling.

    Raises
    ------
    InputError
        Points that rise with the zone.

    Notes
    -----
    The slopes at the points are those of Fritsch and Butland, moved as little as it takes to make the spline convex
    where the points allow that; theirs alone seldom are, even through points of a convex curve.

    References
    ----------
    F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
    SIAM J. Sci. Stat. Comput. 5 (1984).
    """

    points: Points

    def __post_init__(self) -> None:
        self.points.require_falling()

    @cached_property
    def _curve(self) -> CubicHermiteSpline:
        zones, costs = np.array(self.points.zones), np.array(self.points.costs)
        monotone = PchipInterpolator(zones, costs)(zones, 1)
        return CubicHermiteSpline(zones, costs, convex_slopes(np.diff(costs) / np.diff(zones), monotone))

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        inside = np.clip(zone, self.points.zones[0], self.points.zones[-1])
        return np.asarray(self._curve(inside) + self.slope(zone) * (zone - inside))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        inside = np.clip(zone, self.points.zones[0], self.points.zones[-1])
        return np.asarray(np.minimum(self._curve(inside, 1), 0.0))  # above 0 it is rounding

    def expression(self, zone: cp.Expression) -> cp.Expression | None:
        """Return the cost as the highest of many tangents, or None where the spline is not convex.

        Notes
        -----
        Between tangents at a distance h the highest of them lies at most max(f″)·h²/8 below the spline; every piece has
        so many that this stays within `OUTER_ERROR` of its lowest cost. So the expression is a lower bound on the cost.
        """
        zones = np.array(self.points.zones)
        lengths, cubic, square = np.diff(zones), self._curve.c[0], self._curve.c[1]
        bends = np.stack(
            [2 * square, 2 * square + 6 * cubic * lengths]
        )  # f″ at both ends, between them a straight line
        if (bends * lengths).min() < ROUNDING * self.slope(zones).min():
            return None
        largest = np.maximum(bends.max(axis=0), 0.0)
        steps = np.ceil(lengths * np.sqrt(largest / (8 * OUTER_ERROR * np.array(self.points.costs[1:])))).astype(int)
        pieces = zip(zones[:-1], zones[1:], np.maximum(steps, 1), strict=True)
        touched = np.unique(np.concatenate([np.linspace(start, end, count + 1) for start, end, count in pieces]))
        return _highest(touched, self.value(touched), self.slope(touched), zone)

    def rescaled(self, unit: float) -> Spline:
        """Return the same cost as a function of zone / unit."""
        return Spline(self.points.rescaled(unit))


def made_together(models: Sequence[CostModel], ratios: Sequence[float]) -> CostModel:
    """Return the cost of several callouts that change together, as simple as it can be said.

    Parameters
    ----------
    models
        Cost of each callout as a function of its own zone.
    ratios
        Zone of each callout over the common variable [unit of the zone per unit of the variable].
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
    """Cost of several callouts that are made in the same way and change together.

    Parameters
    ----------
    models
        Cost of each callout as a function of its own zone.
    ratios
        Zone of each callout over the common variable [unit of the zone per unit of the variable].
    """

    models: tuple[CostModel, ...]
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

    def expression(self, zone: cp.Expression) -> cp.Expression | None:
        """Return the cost as a convex expression, or None where a part is not convex."""
        parts = [part.expression(zone) for part in self._parts]
        convex = [part for part in parts if part is not None]
        return sum(convex) if len(convex) == len(parts) else None

    def rescaled(self, unit: float) -> SumOfCosts:
        """Return the same cost as a function of variable / unit."""
        return replace(self, ratios=tuple(ratio * unit for ratio in self.ratios))


def _highest(
    touched: Float[np.ndarray, " line"],
    costs: Float[np.ndarray, " line"],
    slopes: Float[np.ndarray, " line"],
    zone: cp.Expression,
) -> cp.Expression:
    """Return the highest of the lines with these slopes through these points, for every zone."""
    flat = cp.reshape(zone, (1, zone.size), order="C")
    heights = np.outer(costs - slopes * touched, np.ones(zone.size))
    return cp.reshape(cp.max(slopes[:, np.newaxis] @ flat + heights, axis=0), zone.shape, order="C")
