"""Errors that explain a curve: scouts find the neighbourhoods, damped Gauss–Newton steps climb down in each.

Around the best explanation a population says what is known of the errors and what is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import chi2

from tolalloc.bench.diagnosis.bridge import Neighbourhood, bridge
from tolalloc.bench.diagnosis.problem import CurveProblem
from tolalloc.drawings.seeds import SeedTree

_DAMPINGS = 10.0 ** np.arange(-2, 3)
"""Dampings tried in each step, over the one that did best before [-]."""

_WIDER = 3.0
"""Weight of the readings in one neighbourhood over that in the next wider one [-]."""

_VAIN = 3
"""Searches in vain, each in a wider neighbourhood, that end an attempt [-]."""

_ENOUGH, _LEAST = 0.05, 0.001
"""Plausibility with which an attempt ends once nothing better was found nearby, and with which the attempts end [-]."""

_SAME_DEPTH = 2.0
"""Objectives this close belong to one neighbourhood, whose kinks leave many small minima [-]."""


@dataclass(frozen=True, kw_only=True)
class DiagnosisEffort:
    """How much a diagnosis may compute."""

    angles: int = 240  # Most readings of a turn that are used [-]
    scouts: int = 320  # Particles led from the drawings' distribution to one that knows the curve roughly [-]
    rough: float = 1.0  # Error of a reading for the scouts, over the spread of the curves that the drawings allow [-]
    climbers: int = 16  # Scouts from which steps are taken [-]
    attempts: int = 5  # Most attempts from fresh scouts [-]
    nearby: int = 8  # Most searches around the best so far in each attempt [-]
    particles: int = 512  # Size of the population that is sampled around the explanation [-]
    weight: float = 0.01  # Weight of the readings in the normal distribution that the population starts from [-]
    settling: int = 20  # Moves of the population at the end [-]
    judged: int = 128  # Sampled units whose dominant source is looked for [-]


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """The errors that explain a curve best."""

    numbers: Float[np.ndarray, " column"]  # Standard normal numbers [-]
    # What the readings tell of them nearby: sum of squared derivatives [-]
    information: Float[np.ndarray, "column column"]
    objective: float  # Half the sum of squares of residuals and numbers [-]
    # Probability of residuals at least as large, were the model true; and were the noise twice as large as stated [-]
    plausible: float
    plausible_at_twice: float

    def neighbourhood(self, weight: float) -> Neighbourhood:
        """Return what would be known if the model were linear and the readings had this weight [-]."""
        return Neighbourhood(centre=self.numbers, precision=weight * self.information + np.eye(self.numbers.size))


def explain(problem: CurveProblem, seeds: SeedTree, effort: DiagnosisEffort) -> Explanation:
    """Return the best explanation of some attempts.

    They end early with one that is plausible, or with the second of two that would not be plausible even at twice the
    noise: such a curve is no near miss, and three more attempts would only repeat that.
    """
    everywhere = Neighbourhood(centre=np.zeros(problem.size), precision=np.eye(problem.size))
    rough = _rough_weight(problem, everywhere, seeds.child("spread").generator(), effort)
    found: list[Explanation] = []
    for number in range(effort.attempts):
        found.append(_attempt(problem, everywhere, rough, seeds.child(str(number)), effort))
        plausible = max(one.plausible for one in found) >= _LEAST
        hopeless = len(found) > 1 and max(one.plausible_at_twice for one in found) < _LEAST
        if plausible or hopeless:
            break
    return min(found, key=lambda one: one.objective)


def _attempt(
    problem: CurveProblem, everywhere: Neighbourhood, rough: float, seeds: SeedTree, effort: DiagnosisEffort
) -> Explanation:
    """Search among all errors, then around the best so far, in a wider neighbourhood after each search in vain."""
    best, vain = _search(problem, everywhere, rough, seeds.child("first").generator(), effort), 0
    for number in range(effort.nearby):
        near, weight = best.neighbourhood(_WIDER ** (1 - vain) * rough), max(_WIDER ** (2 - vain), 1.0) * rough
        one = _search(problem, near, weight, seeds.child(str(number)).generator(), effort)
        vain = 0 if one.objective < best.objective - _SAME_DEPTH else vain + 1
        best = min(best, one, key=lambda found: found.objective)
        if vain == _VAIN or (vain > 0 and best.plausible >= _ENOUGH):
            break
    return best


def _rough_weight(
    problem: CurveProblem, everywhere: Neighbourhood, generator: np.random.Generator, effort: DiagnosisEffort
) -> float:
    """Return the weight of the readings, were they as wrong as the curves of all allowed errors differ [-]."""
    curves = problem.curves(problem.deviations(everywhere.drawn(64, generator)))
    spread = float(np.nanstd(curves)) * effort.rough
    return min(1.0, float(np.diag(problem.readings.covariance).mean()) / spread**2)


def _search(
    problem: CurveProblem, start: Neighbourhood, weight: float, generator: np.random.Generator, effort: DiagnosisEffort
) -> Explanation:
    """Lead scouts from the start towards the curve, taken with this weight, and climb from some of them."""
    rough = weight
    scouts = bridge(
        start,
        lambda numbers: -0.5 * (numbers**2).sum(axis=1) - rough * problem.misfit(numbers),
        effort.scouts,
        generator,
        most=10,
    )
    climbers = scouts[generator.permutation(effort.scouts)[: effort.climbers]]
    while weight < 1.0:
        climbers, weight = climb(problem, climbers, weight, 2), 4.0 * weight
    objective = problem.misfit(climbers) + 0.5 * (climbers**2).sum(axis=1)
    best = climb(problem, climbers[np.argsort(objective)[: max(effort.climbers // 4, 1)]], 1.0, 6)
    misfit = problem.misfit(best)
    objective = misfit + 0.5 * (best**2).sum(axis=1)
    first = int(np.argmin(objective))
    _, slope = problem.linearised(best[first : first + 1])
    information = slope[0].T @ slope[0]
    fitted = float(np.trace(np.linalg.solve(information + np.eye(problem.size), information)))
    freedom = max(problem.readings.freedom - fitted, 1.0)
    return Explanation(
        numbers=best[first],
        information=information,
        objective=float(objective[first]),
        plausible=float(chi2.sf(2.0 * misfit[first], freedom)),
        plausible_at_twice=float(chi2.sf(2.0 * misfit[first] / 4.0, freedom)),
    )


def climb(
    problem: CurveProblem, numbers: Float[np.ndarray, "sample column"], weight: float, steps: int
) -> Float[np.ndarray, "sample column"]:
    """Return the samples after some damped Gauss–Newton steps, each with the best of several dampings.

    The weight is that of the readings against what is known of the errors; below 1 the valleys are wide.
    """
    samples, damping = np.arange(len(numbers)), np.ones(len(numbers))
    objective = weight * problem.misfit(numbers) + 0.5 * (numbers**2).sum(axis=1)
    for _ in range(steps):
        residual, slope = problem.linearised(numbers)
        across = slope.transpose(0, 2, 1)
        value, vector = np.linalg.eigh(weight * across @ slope)
        pull = vector.transpose(0, 2, 1) @ (weight * across @ residual[:, :, None] + numbers[:, :, None])
        tried = damping[:, np.newaxis] * _DAMPINGS
        step = pull[:, np.newaxis, :, 0] / (value[:, np.newaxis] + 1.0 + tried[:, :, np.newaxis])
        to = numbers[:, np.newaxis] - (vector[:, np.newaxis] @ step[..., np.newaxis])[..., 0]
        misfit = problem.misfit(to.reshape(-1, problem.size)).reshape(tried.shape)
        reached = weight * misfit + 0.5 * (to**2).sum(axis=2)
        best = reached.argmin(axis=1)
        better = reached[samples, best] < objective
        numbers = np.where(better[:, np.newaxis], to[samples, best], numbers)
        objective = np.where(better, reached[samples, best], objective)
        damping = np.clip(np.where(better, tried[samples, best], 30.0 * damping), 1e-6, 1e9)
    return numbers


def posterior(
    problem: CurveProblem, explanation: Explanation, generator: np.random.Generator, effort: DiagnosisEffort
) -> Float[np.ndarray, "particle column"]:
    """Return standard normal numbers drawn from all errors near the explanation that the curve allows [-]."""
    return bridge(
        explanation.neighbourhood(effort.weight),
        lambda numbers: -0.5 * (numbers**2).sum(axis=1) - problem.misfit(numbers),
        effort.particles,
        generator,
        settling=effort.settling,
    )
