"""Cost models through points of a shop: straight lines, or a monotone spline that is convex where it can be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.closed_forms import Expression
from tolalloc.allocation.cost.points import Points

ROUNDING = 1e-9
"""Relative difference of slopes up to which it is rounding, such as on one straight line [-]."""

OUTER_ERROR = 1e-6
"""Largest share of its cost by which the convex form of a spline lies below the spline [-]."""


@dataclass(frozen=True)
class Tabulated:
    """Cost on straight lines between points; the first and the last line go on beyond them.

    Raises
    ------
    InputError
        Points that rise with the zone.
    """

    points: Points  # The points, falling

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

    def expression(self, zone: Expression) -> Expression | None:
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

    points: Points  # The points, falling

    def __post_init__(self) -> None:
        self.points.require_falling()

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

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

    def expression(self, zone: Expression) -> Expression | None:
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


def convex_slopes(
    secants: Float[np.ndarray, " piece"], slopes: Float[np.ndarray, " point"]
) -> Float[np.ndarray, " point"]:
    """Return slopes that make the spline convex, or the given ones where none do.

    Parameters
    ----------
    secants
        Slopes of the straight lines between neighbouring points, 0 or below [cost units per unit of the zone].
    slopes
        Slopes at the points to stay close to [cost units per unit of the zone].

    Notes
    -----
    A cubic with end slopes −x and −y over a secant −m is convex where x + 2y ≤ 3m ≤ 2x + y. Given an interval of y,
    those of x that leave a choice are an interval too; so the intervals are found from the last point to the first, and
    the slopes inside them from the first to the last.
    """
    falls = -secants
    intervals = [(0.0, np.inf)]
    for fall in falls[::-1]:
        least, most = intervals[-1]
        if least > fall * (1 + ROUNDING):
            return slopes
        intervals.append(((3 * fall - min(most, fall)) / 2, 3 * fall - 2 * least))
    intervals.reverse()
    chosen = [float(np.clip(-slopes[0], *intervals[0]))]
    for fall, (least, most), wanted in zip(falls, intervals[1:], -slopes[1:], strict=True):
        least, most = max(least, 3 * fall - 2 * chosen[-1]), min(most, (3 * fall - chosen[-1]) / 2)
        chosen.append(float(np.clip(wanted, least, most)))
    return -np.array(chosen)


def _highest(
    touched: Float[np.ndarray, " line"],
    costs: Float[np.ndarray, " line"],
    slopes: Float[np.ndarray, " line"],
    zone: Expression,
) -> Expression:
    """Return the highest of the lines with these slopes through these points, for every zone."""
    import cvxpy as cp

    flat = cp.reshape(zone, (1, zone.size), order="C")
    heights = np.outer(costs - slopes * touched, np.ones(zone.size))
    return cp.reshape(cp.max(slopes[:, np.newaxis] @ flat + heights, axis=0), zone.shape, order="C")
