"""Closed forms of a cost through the points of a shop, and which of them predicts best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from itertools import product

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.model import ClosedForm, Combined, Exponential, Reciprocal, ReciprocalPower
from tolalloc.allocation.cost.points import Points, ShopPoints
from tolalloc.exceptions import InputError

FORMS: tuple[type[ClosedForm], ...] = (Reciprocal, ReciprocalPower, Exponential, Combined)

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

    Raises
    ------
    InputError
        There are fewer points than the simplest form needs, or every form would have to rise with the zone.

    Notes
    -----
    For a given exponent and scale the fixed cost and the factor are a linear problem with both at least 0, solved
    exactly; only exponent and scale are searched, from several starts. A form needs one point more than it has
    parameters. A form that would have to rise is left out.
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

    Raises
    ------
    InputError
        As `fits`.

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
    """The closed forms through the points of one process of a shop.

    Parameters
    ----------
    process
        Its name, with the kind of callout if it is for one alone.
    points
        Zones [µm] and costs.
    forms
        Every form that the points suffice for.
    best
        The form that is taken.
    """

    process: str
    points: Points
    forms: tuple[CostFit, ...]
    best: CostFit


def shop_fits(shop: ShopPoints) -> tuple[ShopFit, ...]:
    """Return the fits of every process of a shop, each alone for a kind of callout where it is priced so.

    Raises
    ------
    InputError
        As `fits`.
    """
    return tuple(
        ShopFit(
            process=process if feature is None else f"{process}, {feature}",
            points=points,
            forms=fits(points),
            best=best_fit(points),
        )
        for (process, feature), points in shop.items()
    )
