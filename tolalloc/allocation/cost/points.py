"""Prices of a shop at some tolerances, the file that they stand in, and cost models through them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.allocation.cost.model import Expression
from tolalloc.drawings.fields import LARGEST_ZONE, SMALLEST_COST, SMALLEST_ZONE, UNITS
from tolalloc.drawings.table_file import read_rows, read_text_table, split_header, stated_currency
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import Record
from tolalloc.reading.units import COST_UNITS

MOST_POINTS = 200
"""Most prices of one process; a fit leaves out each of them in turn, and a workbook's formula names all [-]."""


@dataclass(frozen=True, kw_only=True)
class Points:
    """Zones and what they cost, the smallest zone first.

    Raises
    ------
    InputError
        Fewer than two zones, not in order, or a number that is not above 0.
    """

    zones: tuple[float, ...]  # Zones, ascending; equal ones are the same zone priced more than once [unit of the zone]
    costs: tuple[float, ...]  # Their costs [cost units]
    place: str = "cost points"  # Where the points stand, for messages

    def __post_init__(self) -> None:
        if len(self.zones) != len(self.costs) or len(set(self.zones)) < 2:
            raise InputError.at(
                self.place, "zones and costs", (self.zones, self.costs), "two zones or more, each with its cost"
            )
        for name in ("zones", "costs"):
            wrong = [value for value in getattr(self, name) if not (isfinite(value) and value > 0)]
            if wrong:
                raise InputError.at(self.place, name, wrong[0], "a finite number above 0")
        if list(self.zones) != sorted(self.zones):
            raise InputError.at(self.place, "zones", self.zones, "zones in ascending order")

    @classmethod
    def sorted(cls, zones: Sequence[float], costs: Sequence[float], place: str) -> Points:
        """Return points that are given in any order."""
        order = sorted(range(len(zones)), key=lambda at: (zones[at], -costs[at]))
        return cls(zones=tuple(zones[at] for at in order), costs=tuple(costs[at] for at in order), place=place)

    def require_falling(self) -> None:
        """Raise an InputError of two points that contradict each other unless the cost falls with the zone."""
        for (zone, cost), (wider, dearer) in pairwise(zip(self.zones, self.costs, strict=True)):
            if zone == wider:
                raise InputError(
                    f"{self.place}: a zone of {zone:g} costs {cost:g} and {dearer:g}; allowed is one cost per zone."
                )
            if dearer > cost:
                raise InputError(
                    f"{self.place}: a zone of {zone:g} costs {cost:g} and a zone of {wider:g} costs {dearer:g}; "
                    "allowed are costs that fall with the zone."
                )

    def rescaled(self, unit: float) -> Points:
        """Return the same points with zones counted in another unit [old unit]."""
        return Points(zones=tuple(zone / unit for zone in self.zones), costs=self.costs, place=self.place)


class ShopPrice(Record):
    """One row; the fields are the column headers without their unit."""

    process: Annotated[str, Field(min_length=1)]
    feature: Feature | None = None
    tolerance: Annotated[float, Field(ge=SMALLEST_ZONE)]
    unit: Literal["µm", "um", "mm"]
    cost: Annotated[float, Field(ge=SMALLEST_COST, le=1e9)]
    note: str = ""


ShopPoints = Mapping[tuple[str, Feature | None], Points]
"""Process and feature, or None for every feature → points in micrometres."""


_UNITS = {"cost": COST_UNITS, "tolerance": "unit"}


def currency_of_prices(path: Path) -> str:
    """Return the currency that the header of a shop's prices states, empty where it states none."""
    return stated_currency(path, [split_header(header) for header in read_text_table(path).headers], _UNITS)


def load_shop_points(path: Path) -> ShopPoints:
    """Return the points of a CSV file with the columns process, tolerance [unit], unit and cost [cost units].

    A column ``feature`` may say for which kind of callout a price is; without it the price is for every kind.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed, or a process with less than two tolerances.
    """
    prices: dict[tuple[str, Feature | None], list[tuple[float, float]]] = {}
    for place, row in read_rows(path, ShopPrice, "process", _UNITS):
        zone = row.tolerance * UNITS[row.unit]
        if zone > LARGEST_ZONE:
            raise InputError.at(place, "tolerance", f"{row.tolerance:g} {row.unit}", f"{LARGEST_ZONE:g} µm or less")
        prices.setdefault((row.process, row.feature), []).append((zone, row.cost))
    found = {}
    for (process, feature), pairs in prices.items():
        if len(pairs) > MOST_POINTS:
            raise InputError.at(path, f"number of prices of process {process}", len(pairs), f"{MOST_POINTS} or less")
        zones, costs = zip(*pairs, strict=True)
        found[process, feature] = Points.sorted(zones, costs, f"{path} ({process}, zones in µm)")
    return found


def points_of(points: ShopPoints, process: str, feature: Feature, place: str) -> Points:
    """Return the points of a process for a kind of callout [µm], those for every kind where it has none of its own."""
    found = points.get((process, feature)) or points.get((process, None))
    if found is None:
        known = [name for name, kind in points if kind in (feature, None)]
        raise UnknownNameError.among(place, f"process for feature {feature}", process, known)
    return found


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

    @property
    def is_convex(self) -> bool:
        """Whether the slopes of the lines increase."""
        return bool(np.diff(self._slopes, append=0.0).min() >= ROUNDING * self._slopes.min())

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as the highest of the lines."""
        return _highest(np.array(self.points.zones[:-1]), np.array(self.points.costs[:-1]), self._slopes, zone, cvx)

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

    @cached_property
    def _bends(self) -> Float[np.ndarray, "2 piece"]:
        """Second derivative at both ends of every piece, between them a straight line [cost units per unit²]."""
        lengths, cubic, square = np.diff(self.points.zones), self._curve.c[0], self._curve.c[1]
        return np.stack([2 * square, 2 * square + 6 * cubic * lengths])

    @property
    def is_convex(self) -> bool:
        """Whether no piece of the spline bends downwards."""
        zones = np.array(self.points.zones)
        return bool((self._bends * np.diff(zones)).min() >= ROUNDING * self.slope(zones).min())

    def expression(self, zone: Expression, cvx: Any) -> Expression:
        """Return the cost as the highest of many tangents.

        Notes
        -----
        Between tangents at a distance h the highest of them lies at most max(f″)·h²/8 below the spline; every piece has
        so many that this stays within `OUTER_ERROR` of its lowest cost. So the expression is a lower bound on the cost.
        """
        zones = np.array(self.points.zones)
        lengths = np.diff(zones)
        largest = np.maximum(self._bends.max(axis=0), 0.0)
        steps = np.ceil(lengths * np.sqrt(largest / (8 * OUTER_ERROR * np.array(self.points.costs[1:])))).astype(int)
        pieces = zip(zones[:-1], zones[1:], np.maximum(steps, 1), strict=True)
        touched = np.unique(np.concatenate([np.linspace(start, end, count + 1) for start, end, count in pieces]))
        return _highest(touched, self.value(touched), self.slope(touched), zone, cvx)

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
    cvx: Any,
) -> Expression:
    """Return the highest of the lines with these slopes through these points, for every zone."""
    flat = cvx.reshape(zone, (1, zone.size), order="C")
    heights = np.outer(costs - slopes * touched, np.ones(zone.size))
    return cvx.reshape(cvx.max(slopes[:, np.newaxis] @ flat + heights, axis=0), zone.shape, order="C")
