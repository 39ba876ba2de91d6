"""Prices of a shop at some tolerances, cost models through them, and closed forms fitted to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from itertools import pairwise, product
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.allocation.cost.model import (
    ClosedForm,
    Exponential,
    Expression,
    PowerExponential,
    Reciprocal,
    ReciprocalPower,
)
from tolalloc.drawings.fields import LARGEST_ZONE, SMALLEST_COST, SMALLEST_ZONE, UNITS
from tolalloc.drawings.heads import split_header
from tolalloc.drawings.table_file import read_rows, read_text_table, stated_currency
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import Record
from tolalloc.reading.units import COST_UNITS

MOST_POINTS = 200
"""Most prices of one process; a fit leaves out each of them in turn, and a workbook's formula names all [-]."""


@dataclass(frozen=True, kw_only=True)
class Points:
    """Zones and what they cost, the smallest zone first."""

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
    unit: Literal["µm", "um", "mm", "in", "inch"]
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
    """
    prices: dict[tuple[str, Feature | None], list[tuple[float, float]]] = {}
    for place, row in read_rows(path, ShopPrice, "process", _UNITS):
        zone = row.tolerance * UNITS[row.unit]
        if zone > LARGEST_ZONE:
            raise InputError.at(place, "tolerance", f"{row.tolerance:g} {row.unit}", f"{LARGEST_ZONE:.0f} µm or less")
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

    >>> float(Tabulated(Points(zones=(10.0, 20.0), costs=(8.0, 5.0))).value(np.array(15.0)))
    6.5
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

    Notes
    -----
    The slopes at the points are those of Fritsch and Butland, moved as little as it takes to make the spline convex
    where the points allow that; theirs alone seldom are, even through points of a convex curve.

    References
    ----------
    F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
    SIAM J. Sci. Stat. Comput. 5 (1984).

    Examples
    --------
    >>> curve = Spline(Points(zones=(10.0, 20.0, 40.0), costs=(8.0, 5.0, 4.0)))
    >>> round(float(curve.value(np.array(15.0))), 3), curve.is_convex
    (6.188, True)
    """

    points: Points  # The points, falling

    def __post_init__(self) -> None:
        self.points.require_falling()

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

        zones, costs = np.array(self.points.zones), np.array(self.points.costs)
        monotone = PchipInterpolator(zones, costs)(zones, 1)
        return CubicHermiteSpline(zones, costs, _convex_slopes(np.diff(costs) / np.diff(zones), monotone))

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


def _convex_slopes(
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

    Examples
    --------
    >>> _convex_slopes(np.array([-3.0, -1.0]), np.array([-3.5, -1.5, -0.2]))
    array([-3.5, -2. , -0.2])
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


FORMS: tuple[type[ClosedForm], ...] = (Reciprocal, ReciprocalPower, Exponential, PowerExponential)

_BOUNDS = {"exponent": (0.05, 10.0), "scale": (0.02, 100.0)}
"""Bounds of what bends a curve, the scale over the middle zone of the points [-]."""

_STARTS = {"exponent": (0.3, 1.0, 2.5), "scale": (0.15, 0.6, 2.5, 10.0)}
"""Where the search for them starts [-]."""

_EXACT = 1e-6
"""Relative error below which forms are equally good [-]."""


@dataclass(frozen=True, kw_only=True)
class CostFit:
    """A closed form through points, and how well it keeps to them."""

    model: ClosedForm  # The form with the parameters of the smallest relative errors
    errors: Float[np.ndarray, " point"]  # Relative error of the cost at every point [-]
    unseen: Float[np.ndarray, " point"]  # The same where the point was left out of the fit [-]
    # Zones between which there are points; beyond them the form is a guess [unit of the zone]
    smallest: float
    largest: float

    @property
    def rms(self) -> float:
        """Root-mean-square relative error [-]."""
        return _rms(self.errors)

    @property
    def largest_error(self) -> float:
        """Largest relative error [-]."""
        return float(np.abs(self.errors).max())

    @property
    def leave_one_out(self) -> float:
        """Root-mean-square relative error at points left out of the fit [-]."""
        return _rms(self.unseen)


def fits(points: Points) -> tuple[CostFit, ...]:
    """Return every closed form that the points suffice for, fitted to the smallest squares of relative errors.

    Least Σ (c(tᵢ)/cᵢ − 1)² of c(t) = A + B/t, A + B/tᵏ, A + B·exp(−t/T), A + B/tᵏ·exp(−t/T) [cost units] (own
    derivation); valid from the smallest to the largest zone of the points.

    Notes
    -----
    For a given exponent and scale the fixed cost and the factor are a linear problem with both at least 0, solved
    exactly; only exponent and scale are searched, from several starts. A form needs one point more than it has
    parameters. A form that would have to rise is left out.

    Examples
    --------
    >>> points = Points(zones=(10.0, 20.0, 40.0), costs=(5.0, 3.5, 2.75))
    >>> (fit,) = fits(points)
    >>> round(fit.model.fixed, 6), round(fit.model.factor, 6)
    (2.0, 30.0)
    """
    count, fewest = len(points.zones), _parameters(Reciprocal) + 1
    if count < fewest:
        raise InputError.at(points.place, "number of points for a fit", count, f"{fewest} or more")
    found = [_fit(form, points) for form in FORMS if count > _parameters(form)]
    falling = tuple(fit for fit in found if fit is not None)
    if not falling:
        raise InputError(
            f"{points.place}: the costs do not fall between zones of {points.zones[0]:g} and {points.zones[-1]:g}; "
            "allowed are costs that a falling curve can follow."
        )
    return falling


@lru_cache(maxsize=256)
def best_fit(points: Points) -> CostFit:
    """Return the form with the fewest parameters that predicts as well as the best one.

    Notes
    -----
    As well as the best one: its mean square error at points left out is within one standard error of the smallest.

    References
    ----------
    T. Hastie, R. Tibshirani, J. Friedman, The Elements of Statistical Learning, 2nd ed., Springer (2009), section 7.10.
    """
    candidates = fits(points)
    best = min(candidates, key=lambda fit: fit.leave_one_out)
    squares = best.unseen**2
    allowed = squares.mean() + squares.std(ddof=1) / np.sqrt(squares.size) + _EXACT**2
    good = [fit for fit in candidates if fit.leave_one_out**2 <= allowed]
    return min(good, key=lambda fit: (_parameters(type(fit.model)), fit.leave_one_out))


def _rms(errors: Float[np.ndarray, " point"]) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _parameters(form: type[ClosedForm]) -> int:
    return len(fields(form))


def _bending(form: type[ClosedForm]) -> tuple[str, ...]:
    """Return the parameters that are not linear."""
    return tuple(item.name for item in fields(form) if item.name in _BOUNDS)


def _fit(form: type[ClosedForm], points: Points) -> CostFit | None:
    """Return the fit, or None where the form would have to rise."""
    middle = float(np.exp(np.log(points.zones).mean()))
    zones, costs = np.array(points.zones) / middle, np.array(points.costs)
    grid = [
        dict(zip(_bending(form), start, strict=True)) for start in product(*(_STARTS[name] for name in _bending(form)))
    ]
    starts = [model for model in (_searched(form, zones, costs, start) for start in grid) if model is not None]
    if not starts:
        return None
    model = min(starts, key=lambda model: _rms(_errors(model, zones, costs)))
    unseen = np.empty_like(costs)
    for left_out in range(costs.size):
        kept = np.arange(costs.size) != left_out
        start = {name: getattr(model, name) for name in _bending(form)}
        again = _searched(form, zones[kept], costs[kept], start)
        if again is None:  # one point alone makes the curve fall
            return None
        unseen[left_out] = _errors(again, zones, costs)[left_out]
    return CostFit(
        model=model.rescaled(1.0 / middle),
        errors=_errors(model, zones, costs),
        unseen=unseen,
        smallest=points.zones[0],
        largest=points.zones[-1],
    )


def _errors(
    model: ClosedForm, zones: Float[np.ndarray, " point"], costs: Float[np.ndarray, " point"]
) -> Float[np.ndarray, " point"]:
    return np.asarray(model.value(zones) / costs - 1.0)


def _searched(
    form: type[ClosedForm],
    zones: Float[np.ndarray, " point"],
    costs: Float[np.ndarray, " point"],
    start: Mapping[str, float],
) -> ClosedForm | None:
    """Return the best form around exponent and scale of the start, or None where it would have to rise."""

    def bent(logs: Float[np.ndarray, " parameter"]) -> ClosedForm:
        return form(factor=1.0, **dict(zip(start, np.exp(logs).tolist(), strict=True)))

    def residuals(logs: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, " point"]:
        unit = bent(logs).value(zones)
        fixed, factor = _linear(unit, costs)
        return np.asarray((fixed + factor * unit) / costs - 1.0)

    logs = np.log(list(start.values()))
    if start:
        from scipy.optimize import least_squares

        lower, upper = np.log([_BOUNDS[name] for name in start]).T
        inside = np.clip(logs, lower, upper)  # a result at its bound is rounded when it is started from again
        tight = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
        logs = least_squares(residuals, inside, jac="3-point", bounds=(lower, upper), **tight).x
    unit = bent(logs).value(zones)
    fixed, factor = _linear(unit, costs)
    return replace(bent(logs), fixed=fixed, factor=factor) if factor * np.ptp(unit) > _EXACT * costs.max() else None


def _linear(unit: Float[np.ndarray, " point"], costs: Float[np.ndarray, " point"]) -> tuple[float, float]:
    """Return fixed cost and factor of the part that falls, both 0 or above, with the smallest relative errors."""
    from scipy.optimize import nnls

    columns = np.stack([1.0 / costs, unit / unit.max() / costs], axis=1)
    (fixed, factor), _ = nnls(columns, np.ones_like(costs))
    return float(fixed), float(factor / unit.max())


@dataclass(frozen=True, kw_only=True)
class ShopFit:
    """The closed forms through the points of one process of a shop."""

    process: str  # Its name, with the kind of callout if it is for one alone
    points: Points  # Zones [µm] and costs
    forms: tuple[CostFit, ...]  # Every form that the points suffice for
    best: CostFit  # The form that is taken


def shop_fits(shop: ShopPoints) -> tuple[ShopFit, ...]:
    """Return the fits of every process of a shop, each alone for a kind of callout where it is priced so."""
    return tuple(
        ShopFit(
            process=process if feature is None else f"{process}, {feature}",
            points=points,
            forms=fits(points),
            best=best_fit(points),
        )
        for (process, feature), points in shop.items()
    )
