"""What data fix of a parameter without a parabola: profiles, units drawn anew, and units left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq

from tolalloc.drawings.seeds import SeedTree
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.wings.bench.information import Information
from tolalloc.wings.bench.least_squares import IdentificationProblem, gauss_newton
from tolalloc.wings.bench.parameters import Parameter
from tolalloc.wings.bench.prediction import AllReadings, Prediction, Predictor, Surrogate

BOX_POINTS, NEAR_POINTS, NEAR = 13, 17, 4.0
"""Values at which a parameter is held: evenly between its bounds, and within so many standard errors of its best."""

RESAMPLES = 400

FEWEST_UNITS = 5
"""Units below which neither a bootstrap nor leaving one out says anything [-]."""


@dataclass(frozen=True, kw_only=True)
class ParameterProfile:
    """How much worse the best fit gets as one parameter is held at each value between its bounds."""

    coordinate: Float[np.ndarray, " value"]  # Values at which it was held, bounds and ends of the interval included [-]
    rise: Float[np.ndarray, " value"]  # Twice the rise of the objective above its least [-]
    threshold: float  # Rise at which the 95 % interval ends [-]
    interval: tuple[float, float]  # Where the rise crosses the threshold to either side of the least, or the bound [-]

    def widened(self, interval: Float[np.ndarray, " 2"]) -> ParameterProfile:
        """Return the profile with an interval that holds another one, cut at the bounds."""
        low, high = np.clip(interval, self.coordinate[0], self.coordinate[-1])
        return replace(self, interval=(min(self.interval[0], float(low)), max(self.interval[1], float(high))))

    @property
    def is_identified(self) -> bool:
        """Whether the readings keep the parameter away from at least one of its bounds."""
        return bool(self.interval[0] > self.coordinate[0] or self.interval[1] < self.coordinate[-1])


@dataclass(frozen=True)
class _Held:
    """A predictor with one coordinate held."""

    predictor: Predictor
    place: int
    at: float

    def _whole(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point all_parameters"]:
        return np.insert(coordinates, self.place, self.at, axis=1)

    def __call__(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        found = self.predictor(self._whole(coordinates[np.newaxis])[0])
        return replace(found, by_coordinate=np.delete(found.by_coordinate, self.place, axis=1))

    def values(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point datum"]:
        return self.predictor.values(self._whole(coordinates))


class _HeldFits:
    """Least objectives with one coordinate held, each begun where its nearest neighbour ended."""

    def __init__(self, problem: IdentificationProblem, best: Float[np.ndarray, " parameter"], place: int) -> None:
        self._problem, self._place = problem, place
        self._others = [item for at, item in enumerate(problem.parameters) if at != place]
        self._ended = {float(best[place]): np.delete(best, place)}
        self.objective: dict[float, float] = {}
        self(float(best[place]))

    def __call__(self, at: float) -> float:
        """Return the least objective with the coordinate held at a value."""
        if at not in self.objective:
            held = self._problem.of(self._others, _Held(self._problem.predictor, self._place, at))
            known = 0.5 * (at / self._problem.parameters[self._place].prior) ** 2
            if self._others:
                nearest = min(self._ended, key=lambda other: abs(other - at))
                fitted = gauss_newton(held, self._ended[nearest][np.newaxis])
                self._ended[at], self.objective[at] = fitted.coordinates, fitted.objective + known
            else:
                self.objective[at] = float(held.objectives(np.empty((1, 0)))[0]) + known
        return self.objective[at]


def profile(
    problem: IdentificationProblem, best: Float[np.ndarray, " parameter"], place: int, found: Information
) -> ParameterProfile:
    """Return the profile of one parameter, the others fitted anew at each of its values.

    The noise of the problem is widened by the variance factor, and a surrogate should predict. What was found to first
    order says where to look, and the threshold.

    Theory page, equation (41), coordinates and rise [-]: needs no parabola, but normal noise.
    """
    lower, upper, middle = float(problem.lower[place]), float(problem.upper[place]), float(best[place])
    reach = NEAR * float(np.sqrt(found.covariance[place, place]))
    box = np.linspace(lower, upper, BOX_POINTS)
    near = middle + reach * np.linspace(-1.0, 1.0, NEAR_POINTS)
    values = np.unique(np.concatenate([box, near[(near > lower) & (near < upper)], [middle]]))
    fits = _HeldFits(problem, best, place)
    for at in sorted(values, key=lambda value: abs(value - middle)):
        fits(float(at))
    ends = tuple(_crossing(fits, values, found.threshold, side) for side in (-1, 1))
    held = np.array(sorted(fits.objective))
    rise = 2.0 * (np.array([fits.objective[float(at)] for at in held]) - min(fits.objective.values()))
    return ParameterProfile(coordinate=held, rise=rise, threshold=found.threshold, interval=(ends[0], ends[1]))


def _crossing(fits: _HeldFits, values: Float[np.ndarray, " value"], threshold: float, side: int) -> float:
    """Return where the rise crosses the threshold beyond the outermost value inside, or the bound."""
    least = min(fits.objective.values())

    def beyond(at: float) -> float:
        return 2.0 * (fits(at) - least) - threshold

    inside = [float(at) for at in values if beyond(float(at)) <= 0.0]
    inner = min(inside) if side < 0 else max(inside)
    outward = values[values < inner] if side < 0 else values[values > inner]
    if outward.size == 0:
        return inner
    outer = float(outward.max() if side < 0 else outward.min())
    return float(brentq(beyond, inner, outer, xtol=1e-4 * abs(outer - inner)))


@dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """One parameter as the answer states it."""

    parameter: Parameter  # Which one
    # Most probable if the bounds count as an even distribution: next to the least objective where the data say much,
    # the middle of the bounds where they say nothing [as parameter]
    value: float
    uncertainty: float  # Its standard uncertainty, of the logarithm but for the bias [-, arcsec]
    interval: tuple[float, float]  # 95 % profile interval [as parameter]
    identified: bool  # Whether the interval keeps away from at least one bound
    on_bound: bool  # Whether the least objective stands on a bound


def estimates(
    parameters: Sequence[Parameter], found: Information, written: Information, profiles: Sequence[ParameterProfile]
) -> tuple[ParameterEstimate, ...]:
    """Return all parameters.

    Found and profiles are what the readings say around the least objective; written is the same where readings and
    bounds together put the parameters.
    """
    deviations = np.sqrt(np.diag(written.covariance))
    return tuple(
        ParameterEstimate(
            parameter=item,
            value=item.value(float(written.coordinates[at])),
            uncertainty=float(deviations[at]),
            interval=(item.value(own.interval[0]), item.value(own.interval[1])),
            identified=own.is_identified,
            on_bound=bool(found.on_bound[at]),
        )
        for at, (item, own) in enumerate(zip(parameters, profiles, strict=True))
    )


def as_stiffness(
    estimated: Sequence[ParameterEstimate], written: Information, source: str, notes: Sequence[str]
) -> IdentifiedStiffness | None:
    """Return the stiffnesses for a stiffness file; none if no stiffness was asked for.

    The written covariance links them: what is fixed is often a combination.
    """
    places = [at for at, item in enumerate(estimated) if item.parameter.is_stiffness]
    if not places:
        return None
    covariance = written.covariance
    spread = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(spread, spread)
    np.fill_diagonal(correlation, 1.0)
    chosen = [estimated[at] for at in places]
    return IdentifiedStiffness(
        source=source,
        values={item.parameter.name: item.value for item in chosen},
        standard_uncertainty={item.parameter.name: item.value * item.uncertainty for item in chosen},
        correlation=correlation[np.ix_(places, places)],
        notes=tuple(notes),
    )


def bootstrap(
    problem: IdentificationProblem, best: Float[np.ndarray, " parameter"], seeds: SeedTree
) -> Float[np.ndarray, "resample parameter"]:
    """Return the least coordinates for units drawn with replacement, each fit begun at the best [-]."""
    units = problem.data.units
    drawn = seeds.generator().integers(0, units.size, (RESAMPLES, units.size))
    rows = []
    for draw in drawn:
        weight = np.bincount(units[draw], minlength=problem.weight.size).astype(float)
        rows.append(gauss_newton(replace(problem, weight=weight), best[np.newaxis]).coordinates)
    return np.array(rows)


@dataclass(frozen=True, kw_only=True)
class ParameterChoice:
    """One choice of what is fitted, judged by the units that it has not seen."""

    parameters: tuple[Parameter, ...]  # What is fitted; nothing is the reducer as it was given
    left: Float[np.ndarray, " datum"]  # Residual of every reading after the fit to all units [rad]
    unseen: Float[np.ndarray, " datum"]  # Residual of every reading after the fit to all units but its own [rad]
    data: AllReadings  # The readings

    @property
    def by_unit(self) -> Float[np.ndarray, " unit"]:
        """Mean squared unseen residual over noise of each unit [-]."""
        square = (self.unseen / self.data.noise) ** 2
        return np.array([square[self.data.unit == unit].mean() for unit in self.data.units])

    @property
    def score(self) -> float:
        """Root of the mean over units of the squared unseen residual over noise [-]."""
        return float(np.sqrt(self.by_unit.mean()))

    def rms(self, kind: str, *, unseen: bool) -> float:
        """Return the root-mean-square residual of one kind of reading, of seen or of unseen units [rad]."""
        values = (self.unseen if unseen else self.left)[self.data.rows(kind)]
        return float(np.sqrt((values**2).mean()))


def judged(problem: IdentificationProblem, surrogate: Surrogate, parameters: Sequence[Parameter]) -> ParameterChoice:
    """Return how well a choice of parameters predicts units that it has not seen; the rest keeps the reducer's value.

    The surrogate holds polynomials of at least these parameters. What a fit leaves [rad] is compared by theory page
    equation (42), `simplest`.
    """
    own = tuple(parameters)
    asked, data = problem.of(own, replace(surrogate, parameters=own)), problem.data
    everywhere = _left(asked, _fit(asked))
    unseen = np.empty(data.measured.size)
    for unit in data.units:
        weight = problem.weight.copy()
        weight[unit] = 0.0
        rows = data.unit == unit
        unseen[rows] = _left(asked, _fit(replace(asked, weight=weight)))[rows]
    return ParameterChoice(parameters=own, left=everywhere, unseen=unseen, data=data)


def _fit(problem: IdentificationProblem) -> Float[np.ndarray, " parameter"]:
    """Return the least coordinates, from the reducer as given."""
    return gauss_newton(problem, problem.start[np.newaxis]).coordinates if problem.parameters else problem.start


def _left(problem: IdentificationProblem, coordinates: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, " datum"]:
    """Return what a fit leaves of every reading, δ of liu2020: predicted less measured [rad]."""
    return np.asarray(problem.predictor.values(coordinates[np.newaxis])[0] - problem.data.measured)


def simplest(choices: Sequence[ParameterChoice]) -> ParameterChoice:
    """Return the choice with the fewest parameters that is as good as the best within a standard error.

    Theory page equation (42) [-]: differences of squared residuals are taken unit by unit, so what all choices of the
    same data share cancels.
    """
    best = min(choices, key=lambda item: item.score)
    good = []
    for item in choices:
        worse = item.by_unit - best.by_unit
        error = worse.std(ddof=1) / np.sqrt(worse.size) if worse.size > 1 else 0.0
        if worse.mean() <= error:
            good.append(item)
    return min(good, key=lambda item: (len(item.parameters), item.score))
