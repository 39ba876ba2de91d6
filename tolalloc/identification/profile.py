"""Profile likelihood: how much worse the best fit gets as one parameter is held at each value between its bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.stats import f as fisher_f

from tolalloc.identification.gauss_newton import gauss_newton
from tolalloc.identification.information import LEVEL, Information
from tolalloc.identification.prediction import Prediction, Predictor
from tolalloc.identification.problem import IdentificationProblem

BOX_POINTS, NEAR_POINTS, NEAR = 13, 21, 4.0
"""Values at which a parameter is held: evenly between its bounds, and within so many standard errors of its best."""


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Profile of one parameter.

    Parameters
    ----------
    coordinate
        Values at which it was held, bounds included [-].
    rise
        Twice the rise of the objective above its least [-].
    threshold
        Rise at which the 95 % interval ends [-].
    """

    coordinate: Float[np.ndarray, " value"]
    rise: Float[np.ndarray, " value"]
    threshold: float

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the 95 % interval: where the rise crosses the threshold, or the bound [-]."""
        inside = np.flatnonzero(self.rise <= self.threshold)
        if inside.size == 0:  # the least lies between two values and is narrower than their distance
            at = float(self.coordinate[self.rise.argmin()])
            return at, at
        return self._crossing(int(inside[0]), -1), self._crossing(int(inside[-1]), 1)

    def _crossing(self, at: int, side: int) -> float:
        """Return where the straight line to the next value outwards crosses the threshold."""
        outer = at + side
        if not 0 <= outer < self.rise.size:
            return float(self.coordinate[at])
        share = (self.threshold - self.rise[at]) / (self.rise[outer] - self.rise[at])
        return float(self.coordinate[at] + share * (self.coordinate[outer] - self.coordinate[at]))

    @property
    def open_ends(self) -> tuple[bool, bool]:
        """Whether the interval reaches the lower and the upper bound."""
        return bool(self.rise[0] <= self.threshold), bool(self.rise[-1] <= self.threshold)

    @property
    def is_identified(self) -> bool:
        """Whether the readings keep the parameter away from at least one of its bounds."""
        return not all(self.open_ends)


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


def profile(
    problem: IdentificationProblem, best: Float[np.ndarray, " parameter"], place: int, found: Information
) -> Profile:
    """Return the profile of one parameter, the others fitted anew at each of its values.

    Parameters
    ----------
    problem
        The data, their noise widened by the variance factor; a stand-in should predict.
    best
        Where the objective is least [-].
    place
        Position of the parameter [-].
    found
        What the readings say to first order: where to look.

    Notes
    -----
    The threshold is that of the F distribution with one and (readings − parameters) degrees of freedom, which is χ²'s
    3.84 for many readings. Theory page, equation (41).
    """
    values = _values(problem.lower[place], problem.upper[place], best[place], found.standard_errors[place])
    others = [item for at, item in enumerate(problem.parameters) if at != place]
    objective = np.empty(values.size)
    middle = int(np.searchsorted(values, best[place]))
    for order in (range(middle, values.size), range(middle - 1, -1, -1)):
        start = np.delete(best, place)  # each fit begins where its neighbour ended
        for at in order:
            held = problem.of(others, _Held(problem.predictor, place, float(values[at])))
            own = problem.parameters[place].prior
            known = 0.5 * (values[at] / own) ** 2
            if others:
                fitted = gauss_newton(held, start[np.newaxis])
                start, objective[at] = fitted.coordinates, fitted.objective + known
            else:
                objective[at] = held.objectives(np.empty((1, 0)))[0] + known
    return Profile(
        coordinate=values,
        rise=2.0 * (objective - objective.min()),
        threshold=float(fisher_f.ppf(LEVEL, 1, problem.freedom)),
    )


def _values(lower: float, upper: float, best: float, standard_error: float) -> Float[np.ndarray, " value"]:
    """Return the values at which a coordinate is held: its bounds, its best, the box, and densely around the best."""
    box = np.linspace(lower, upper, BOX_POINTS)
    reach = min(NEAR * standard_error, upper - lower)
    near = best + reach * np.linspace(-1.0, 1.0, NEAR_POINTS)
    return np.unique(np.concatenate([box, near[(near > lower) & (near < upper)], [best]]))
