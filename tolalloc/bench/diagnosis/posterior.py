"""Errors of a unit after its curve is read: a population that says what is known of them and what is not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.bench.diagnosis.bridge import LogDensity, Moves, bridge
from tolalloc.bench.diagnosis.half_turn import half_turn, has_half_turn
from tolalloc.bench.diagnosis.problem import CurveProblem
from tolalloc.bench.diagnosis.search import Explanation

_DRAWN = 8192
"""Units, and as many with all signs turned, that give the mean and spread of the columns to under a percent [-]."""


@dataclass(frozen=True, kw_only=True)
class SampleEffort:
    """How much sampling around an explanation may compute.

    Parameters
    ----------
    particles
        Size of the population [-].
    weight
        Weight of the readings in the normal distribution that the population starts from [-].
    settling
        Moves at the end [-].
    """

    particles: int = 512
    weight: float = 0.01
    settling: int = 20


def posterior(
    problem: CurveProblem, explanation: Explanation, generator: np.random.Generator, effort: SampleEffort
) -> Float[np.ndarray, "particle column"]:
    """Return standard normal numbers drawn from all errors near the explanation that the curve allows [-].

    Parameters
    ----------
    problem
        Curve and sources.
    explanation
        Where the population starts.
    generator
        Random numbers.
    effort
        How much may be computed.
    """
    return bridge(
        explanation.neighbourhood(effort.weight),
        lambda numbers: -0.5 * (numbers**2).sum(axis=1) - problem.misfit(numbers),
        effort.particles,
        generator,
        Moves(settling=effort.settling),
    )


def with_twins(
    problem: CurveProblem, deviations: Float[np.ndarray, "particle column"], generator: np.random.Generator
) -> Float[np.ndarray, "particle column"]:
    """Return the population with each unit exchanged for its twin with the probability that it is the twin.

    Parameters
    ----------
    problem
        Curve and sources, and the reducer that may have a half turn.
    deviations
        Columns [m, angles rad].
    generator
        Random numbers.

    Notes
    -----
    The drawings weigh unit and twin, and so do their curves: where the half turn does not hold, for example where an
    axis is tilted, the twin does not explain the curve and is not taken.
    """
    columns = problem.errors.columns
    if not has_half_turn(problem.kernel.model.reducer, columns):
        return deviations
    turned = deviations @ half_turn(columns, problem.kernel.model.reducer).T
    prior = _drawings(problem, generator)
    likelier = prior(turned) - prior(deviations) + problem.misfit_of(deviations) - problem.misfit_of(turned)
    twin = np.log(generator.random(len(deviations))) < -np.logaddexp(0.0, -likelier)
    return np.where(twin[:, np.newaxis], turned, deviations)


def _drawings(problem: CurveProblem, generator: np.random.Generator) -> LogDensity:
    """Return the density of the errors by their drawings, each distribution a normal one of its mean and spread."""
    numbers = generator.standard_normal((_DRAWN, problem.size))
    drawn = problem.deviations(np.concatenate([numbers, -numbers]))
    mean, spread = drawn.mean(axis=0), drawn.std(axis=0)
    inverse = np.linalg.pinv(problem.errors.normal_correlation)

    def density(deviations: Float[np.ndarray, "particle column"]) -> Float[np.ndarray, " particle"]:
        standard = (deviations - mean) / spread
        return np.asarray(-0.5 * np.einsum("sc,cd,sd->s", standard, inverse, standard))

    return density
