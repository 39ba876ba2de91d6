"""Which source dominates a unit: the one without which its peak-to-peak would fall most."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from tolalloc.bench.diagnosis.problem import CurveProblem
from tolalloc.exceptions import SolveError


def reductions(
    problem: CurveProblem, deviations: Float[np.ndarray, "unit column"], largest_failed_share: float = 0.01
) -> Float[np.ndarray, "unit source"]:
    """Return by how much each unit's peak-to-peak falls when one source is put in the middle of its zone [arcsec].

    Parameters
    ----------
    problem
        Model and sources; the readings play no part.
    deviations
        Columns of the units [m, angles rad].
    largest_failed_share
        Largest share of units that may be left out because a curve of theirs failed [-].

    Raises
    ------
    SolveError
        More of them failed.
    """
    owner, middle = np.array(problem.errors.source_of_column), problem.deviations(np.zeros((1, problem.size)))
    names = list(dict.fromkeys(problem.errors.source_of_column))
    cases = [deviations, *(np.where(owner == name, middle, deviations) for name in names)]
    evaluation = problem.kernel(np.concatenate(cases))
    values = np.where(evaluation.good, evaluation.values[:, 0], np.nan).reshape(len(cases), -1)
    fall = (values[0] - values[1:]).T
    good = np.isfinite(fall).all(axis=1)
    if (~good).mean() > largest_failed_share:
        raise SolveError(f"{(~good).sum()} of {good.size} units have a curve that failed to solve.")
    return np.asarray(fall[good])


def dominant(fall: Float[np.ndarray, "unit source"]) -> Int[np.ndarray, " unit"]:
    """Return the position of the source without which each unit's peak-to-peak falls most [-]."""
    return np.asarray(fall.argmax(axis=1))


def named_set(probability: Float[np.ndarray, " source"], level: float) -> tuple[int, ...]:
    """Return the fewest sources that contain the dominant one with the probability asked for, likeliest first."""
    order = np.argsort(-probability, kind="stable")
    needed = int(np.searchsorted(np.cumsum(probability[order]), level - 1e-12)) + 1
    return tuple(order[:needed].tolist())
