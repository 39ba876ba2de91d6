"""The optimum without chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.rv.modification.problem import Amounts, EvaluatedAmounts, ModificationProblem
from tolalloc.rv.reducer.design import Modification
from tolalloc.units import MICROMETRE

_FIRST, _POINTS, _LEVELS = 33, 9, 24  # the last points are 32·4²³ times closer than the bounds, which is rounding

Values = Callable[[Float[np.ndarray, "n p"]], Float[np.ndarray, "n p"]]
"""Values of points on n lines."""


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The best of all points that were evaluated."""

    amounts: Float[np.ndarray, " 2"]  # Δr_rp and Δr_p [m]
    objective: float  # Objective there [m]
    violation: float  # By how much the constraints are missed there [m]
    evaluations: int  # Points that were evaluated [-]

    @property
    def modification(self) -> Modification:
        """The amounts as a tooth modification."""
        return Modification(equidistant=float(self.amounts[0]), shift=float(self.amounts[1]))

    @property
    def status(self) -> str:
        """One sentence: whether the answer can be used."""
        if self.violation == 0:
            return f"met every constraint; best of {self.evaluations} points"
        missed = f"{self.violation / MICROMETRE:.4g} µm"
        return f"no point of {self.evaluations} met the constraints; the one that misses them least, by {missed}"


class BestPoint:
    """Evaluates points of a problem, counts them and keeps the best.

    Attributes
    ----------
    amounts
        Best amounts up to now [m].
    objective, violation
        Objective and missed constraints there [m].
    evaluations
        Points that were evaluated [-].
    """

    def __init__(self, problem: ModificationProblem) -> None:
        self.problem = problem
        self.amounts, self.evaluations = np.full(2, np.nan), 0
        self._merit = self.objective = self.violation = np.inf

    def __call__(self, amounts: Amounts) -> EvaluatedAmounts:
        """Return points evaluated."""
        evaluated = self.problem.evaluate(amounts)
        at = int(evaluated.merit.argmin())
        if evaluated.merit[at] < self._merit:
            self.amounts, self._merit = amounts[at].copy(), float(evaluated.merit[at])
            self.objective, self.violation = float(evaluated.objective[at]), float(evaluated.violation[at])
        self.evaluations += len(amounts)
        return evaluated


def reference(problem: ModificationProblem) -> Optimum:
    """Return the optimum of a problem: for each equidistant amount the best shift, and of these the best.

    Notes
    -----
    Both searches narrow a grid down around its best point, by comparison alone. So kinks, bounds and corners of the
    constraints need no care, and an optimum is missed only if it hides between the points of the first grid, 33 × 33.
    """
    best = BestPoint(problem)

    def best_by_shift(equidistants: Float[np.ndarray, "1 p"]) -> Float[np.ndarray, "1 p"]:
        def merit(shifts: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "n p"]:
            amounts = np.stack(np.broadcast_arrays(equidistants.T, shifts), axis=-1)
            return best(amounts.reshape(-1, 2)).merit.reshape(shifts.shape)

        bounds = np.repeat([[problem.lower[1]], [problem.upper[1]]], equidistants.size, axis=1)
        return _smallest(merit, *bounds)[np.newaxis]

    _smallest(best_by_shift, problem.lower[:1], problem.upper[:1])
    return Optimum(
        amounts=best.amounts, objective=best.objective, violation=best.violation, evaluations=best.evaluations
    )


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
