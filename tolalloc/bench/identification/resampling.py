"""What other units would have said: bootstrap over units, and each unit left out in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from tolalloc.bench.identification.data import AllReadings
from tolalloc.bench.identification.gauss_newton import gauss_newton
from tolalloc.bench.identification.parameters import Parameter
from tolalloc.bench.identification.prediction import StandIn
from tolalloc.bench.identification.problem import IdentificationProblem
from tolalloc.drawings.seeds import SeedTree

RESAMPLES = 400
FEWEST_UNITS = 5
"""Units below which neither a bootstrap nor leaving one out says anything [-]."""


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
    noise: Float[np.ndarray, " datum"]  # Standard deviation of every reading [rad]
    unit: Int[np.ndarray, " datum"]  # Unit of every reading [-]

    @property
    def name(self) -> str:
        """What is fitted, in symbols."""
        return " + ".join(item.symbol for item in self.parameters) or "nothing (the reducer as given)"

    @property
    def by_unit(self) -> Float[np.ndarray, " unit"]:
        """Mean squared unseen residual over noise of each unit [-]."""
        square = (self.unseen / self.noise) ** 2
        return np.array([square[self.unit == unit].mean() for unit in np.unique(self.unit)])

    @property
    def score(self) -> float:
        """Root of the mean over units of the squared unseen residual over noise [-]."""
        return float(np.sqrt(self.by_unit.mean()))

    def rms(self, data: AllReadings, kind: str, *, unseen: bool) -> float:
        """Return the root-mean-square residual of one kind of reading, of seen or of unseen units [rad]."""
        values = (self.unseen if unseen else self.left)[data.rows(kind)]
        return float(np.sqrt((values**2).mean()))


def judged(problem: IdentificationProblem, stand_in: StandIn, parameters: Sequence[Parameter]) -> ParameterChoice:
    """Return how well a choice of parameters predicts units that it has not seen; the rest keeps the reducer's value.

    The stand-in holds polynomials of at least these parameters.
    """
    own = tuple(parameters)
    asked, data = problem.of(own, replace(stand_in, parameters=own)), problem.data
    everywhere = _left(asked, _fit(asked))
    unseen = np.empty(data.measured.size)
    for unit in data.units:
        weight = problem.weight.copy()
        weight[unit] = 0.0
        rows = data.unit == unit
        unseen[rows] = _left(asked, _fit(replace(asked, weight=weight)))[rows]
    return ParameterChoice(parameters=own, left=everywhere, unseen=unseen, noise=data.noise, unit=data.unit)


def _fit(problem: IdentificationProblem) -> Float[np.ndarray, " parameter"]:
    """Return the least coordinates, from the reducer as given."""
    return gauss_newton(problem, problem.start[np.newaxis]).coordinates if problem.parameters else problem.start


def _left(problem: IdentificationProblem, coordinates: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, " datum"]:
    """Return what a fit leaves of every reading, δ of liu2020: predicted less measured [rad]."""
    return np.asarray(problem.predictor.values(coordinates[np.newaxis])[0] - problem.data.measured)


def simplest(choices: Sequence[ParameterChoice]) -> ParameterChoice:
    """Return the choice with the fewest parameters that is as good as the best within a standard error.

    Notes
    -----
    Differences of squared residuals are taken unit by unit, so what all choices of the same data share cancels.
    """
    best = min(choices, key=lambda item: item.score)
    good = []
    for item in choices:
        worse = item.by_unit - best.by_unit
        error = worse.std(ddof=1) / np.sqrt(worse.size) if worse.size > 1 else 0.0
        if worse.mean() <= error:
            good.append(item)
    return min(good, key=lambda item: (len(item.parameters), item.score))
