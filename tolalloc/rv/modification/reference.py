"""The optimum without chance, and the last steps from where a search has stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from tolalloc.rv.modification.problem import Evaluation, ModificationProblem
from tolalloc.rv.modification.result import SearchResult, Tally
from tolalloc.units import MILLIMETRE

_FIRST, _POINTS, _LEVELS = 33, 9, 24  # the last points are 32·4²³ times closer than the bounds, which is rounding
_REACHES = 0.05 * (-0.25) ** np.arange(6)  # first sizes of the simplices, to either side in turn, per range [-]

Values = Callable[[Float[np.ndarray, "n p"]], Float[np.ndarray, "n p"]]
"""Values of points on n lines."""


def reference(problem: ModificationProblem) -> SearchResult:
    """Return the optimum of a problem: for each equidistant amount the best shift, and of these the best.

    Parameters
    ----------
    problem
        What is searched.

    Notes
    -----
    Both searches narrow a grid down around its best point, by comparison alone. So kinks, bounds and corners of the
    constraints need no care, and an optimum is missed only if it hides between the points of the first grid, 33 × 33.
    """
    tally = Tally(problem)

    def best_by_shift(equidistants: Float[np.ndarray, "1 p"]) -> Float[np.ndarray, "1 p"]:
        def merit(shifts: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "n p"]:
            amounts = np.stack(np.broadcast_arrays(equidistants.T, shifts), axis=-1)
            return tally(amounts.reshape(-1, 2)).merit.reshape(shifts.shape)

        bounds = np.repeat([[problem.lower[1]], [problem.upper[1]]], equidistants.size, axis=1)
        return _smallest(merit, *bounds)[np.newaxis]

    _smallest(best_by_shift, problem.lower[:1], problem.upper[:1])
    return tally.result("reference", None)


def _smallest(
    values: Values, lower: Float[np.ndarray, " n"], upper: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the smallest value on each of n lines."""
    rows = np.arange(lower.size)
    for points in (_FIRST, *[_POINTS] * (_LEVELS - 1)):
        share = np.linspace(0, 1, points)
        places = np.outer(lower, 1 - share) + np.outer(upper, share)
        found = values(places)
        at = found.argmin(axis=1)
        lower, upper = places[rows, np.maximum(at - 1, 0)], places[rows, np.minimum(at + 1, points - 1)]
    return np.asarray(found[rows, at])


def polish(problem: ModificationProblem, result: SearchResult) -> SearchResult:
    """Return the optimum that is reached downhill from a result.

    Parameters
    ----------
    problem
        What was searched.
    result
        Where it begins; the answer is never worse, and its history goes on.

    Notes
    -----
    Sequential quadratic programming follows the constraints; simplices of Nelder and Mead, each begun smaller than the
    one before, need no derivative and take what kinks have left.
    """
    tally, lower, upper = Tally(problem), problem.lower / MILLIMETRE, problem.upper / MILLIMETRE
    tally(result.amounts[np.newaxis])

    def evaluate(genes: Float[np.ndarray, " 2"]) -> Evaluation:
        return tally(np.clip(genes, lower, upper)[np.newaxis] * MILLIMETRE)

    minimize(
        lambda genes: evaluate(genes).objective[0] / MILLIMETRE,
        result.amounts / MILLIMETRE,
        method="SLSQP",
        bounds=np.stack([lower, upper], axis=-1),
        constraints={"type": "ineq", "fun": lambda genes: evaluate(genes).constraints[0] / MILLIMETRE},
        options={"ftol": 1e-15, "maxiter": 50},
    )
    for reach in _REACHES:
        start = tally.best / MILLIMETRE
        corners = np.array([[0, 0], [reach, 0], [0, reach]]) * (upper - lower)
        minimize(
            lambda genes: evaluate(genes).merit[0] / MILLIMETRE,
            start,
            method="Nelder-Mead",
            options={"initial_simplex": start + corners, "xatol": 1e-9, "fatol": 1e-13},
        )
    polished = tally.result(f"{result.algorithm}, polished", result.seed)
    return replace(polished, history=result.history.then(polished.history))
