"""Bounded Gauss–Newton steps with the exact derivatives of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares

from tolalloc.bench.identification.prediction import Prediction
from tolalloc.bench.identification.problem import IdentificationProblem
from tolalloc.drawings.seeds import SeedTree

NAME = "Gauss–Newton"

_STEPS = 40

Batch = tuple[Float[np.ndarray, "point parameter"], Float[np.ndarray, " point"]]
"""Points that were tried together, and the objective at each [-]."""


@dataclass(frozen=True, kw_only=True)
class Identified:
    """Answer of one run of one method, and how it got there."""

    method: str  # Name of the method
    seed: int | None  # Seed of the run; none if nothing is random [-]
    coordinates: Float[np.ndarray, " parameter"]  # Where the least objective was found [-]
    objective: float  # Half the weighted sum of squares there [-]
    evaluated: Int[np.ndarray, " batch"]  # How often all readings were predicted up to the end of each batch [-]
    least: Float[np.ndarray, " batch"]  # Least objective until then [-]
    status: str  # Why it ended

    @classmethod
    def among(cls, batches: Sequence[Batch], method: str, seed: int | None, status: str) -> Identified:
        """Return the best of all points that a method tried."""
        coordinates, objective, least = np.zeros(batches[0][0].shape[1]), np.inf, []
        for points, objectives in batches:
            at = int(objectives.argmin())
            if objectives[at] < objective:
                coordinates, objective = points[at], float(objectives[at])
            least.append(objective)
        return cls(
            method=method,
            seed=seed,
            coordinates=coordinates,
            objective=objective,
            evaluated=np.cumsum([objectives.size for _, objectives in batches]),
            least=np.array(least),
            status=status,
        )

    @property
    def evaluations(self) -> int:
        """How often all readings were predicted [-]."""
        return int(self.evaluated[-1])

    def after(self, before: Identified) -> Identified:
        """Return the answer with the way of the run that it started from."""
        return replace(
            self,
            evaluated=np.concatenate([before.evaluated, before.evaluated[-1] + self.evaluated]),
            least=np.concatenate([before.least, self.least]),
        )


def starts(problem: IdentificationProblem, count: int, seeds: SeedTree) -> Float[np.ndarray, "start parameter"]:
    """Return the reducer as it was given, then random points inside the bounds, in all so many."""
    scattered = seeds.generator().random((count - 1, len(problem.parameters)))
    return np.concatenate([problem.start[np.newaxis], problem.lower + scattered * (problem.upper - problem.lower)])


def gauss_newton(
    problem: IdentificationProblem, start: Float[np.ndarray, "start parameter"], seed: int | None = None
) -> Identified:
    """Return the least objective that any start leads to.

    One row for each start; the seed that they came from is for the record.

    Raises
    ------
    SolveError
        A unit has no equilibrium on the way.

    References
    ----------
    Branch, Coleman and Li 1999, the trust region with bounds that SciPy implements.
    """
    batches: list[Batch] = []
    status, least = "", np.inf
    for row in start:
        begun = len(batches)
        converged = _descend(problem, row, batches)
        reached = min(float(objectives[0]) for _, objectives in batches[begun:])
        if reached < least:
            least, status = reached, "converged" if converged else f"stopped after {_STEPS} steps"
    return Identified.among(batches, NAME, seed, status)


def _descend(problem: IdentificationProblem, start: Float[np.ndarray, " parameter"], batches: list[Batch]) -> bool:
    """Add the points that one start leads to, and return whether they converged."""
    predicted = _remembered(problem, batches)
    inside = 1e-6 * (problem.upper - problem.lower)  # the method walks in the interior
    found = least_squares(
        lambda at: problem.residuals(predicted(at), at),
        np.clip(start, problem.lower + inside, problem.upper - inside),
        jac=lambda at: problem.jacobian(predicted(at)),
        bounds=(problem.lower, problem.upper),
        x_scale=problem.upper - problem.lower,
        ftol=1e-8,
        xtol=1e-6,
        gtol=1e-8,
        max_nfev=_STEPS,
    )
    return bool(found.status > 0)


def _remembered(
    problem: IdentificationProblem, batches: list[Batch]
) -> Callable[[Float[np.ndarray, " parameter"]], Prediction]:
    """Return the predictor with its last answer kept: the solver asks for residuals and derivatives at one point."""
    last: list[Prediction] = []

    def predicted(coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        if not last or not np.array_equal(coordinates, batches[-1][0][0]):
            last[:] = [problem.predictor(coordinates)]
            own = problem.residuals(last[0], coordinates)
            batches.append((coordinates[np.newaxis].copy(), np.array([0.5 * own @ own])))
        return last[0]

    return predicted
