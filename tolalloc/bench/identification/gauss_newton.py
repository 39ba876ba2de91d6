"""Bounded Gauss–Newton steps with the exact derivatives of the model."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from tolalloc.bench.identification.prediction import Prediction
from tolalloc.bench.identification.problem import IdentificationProblem
from tolalloc.bench.identification.result import Identified, Tally
from tolalloc.drawing.seeds import SeedTree

NAME = "Gauss–Newton"

_STEPS = 40


class _Evaluations:
    """Residuals and derivatives of one and the same prediction; the solver asks for them one after the other."""

    def __init__(self, problem: IdentificationProblem, tally: Tally) -> None:
        self._problem, self._tally = problem, tally
        self._at = np.full(len(problem.parameters), np.nan)
        self._prediction: Prediction | None = None

    def _predict(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        if self._prediction is None or not np.array_equal(coordinates, self._at):
            self._prediction, self._at = self._problem.predictor(coordinates), coordinates.copy()
            own = self._problem.residuals(self._prediction, coordinates)
            self._tally.add(coordinates[np.newaxis], np.array([0.5 * own @ own]))
        return self._prediction

    def residuals(self, coordinates: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, " row"]:
        return self._problem.residuals(self._predict(coordinates), coordinates)

    def jacobian(self, coordinates: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, "row parameter"]:
        return self._problem.jacobian(self._predict(coordinates))


def starts(problem: IdentificationProblem, count: int, seeds: SeedTree) -> Float[np.ndarray, "start parameter"]:
    """Return the reducer as it was given, then random points inside the bounds.

    Parameters
    ----------
    problem
        What is minimised.
    count
        Number of starts [-].
    seeds
        Node of the seed tree.
    """
    scattered = seeds.generator().random((count - 1, len(problem.parameters)))
    return np.concatenate([problem.start[np.newaxis], problem.lower + scattered * (problem.upper - problem.lower)])


def gauss_newton(
    problem: IdentificationProblem, start: Float[np.ndarray, "start parameter"], seed: int | None = None
) -> Identified:
    """Return the least objective that any start leads to.

    Parameters
    ----------
    problem
        What is minimised.
    start
        Coordinates to begin at, one row for each start [-].
    seed
        Seed that the starts came from, for the record [-].

    Raises
    ------
    SolveError
        A unit has no equilibrium on the way.

    References
    ----------
    Branch, Coleman and Li 1999, the trust region with bounds that SciPy implements.
    """
    tally = Tally(problem)
    inside = 1e-6 * (problem.upper - problem.lower)  # the method walks in the interior
    status = ""
    for row in start:
        before, evaluations = tally.objective, _Evaluations(problem, tally)
        found = least_squares(
            evaluations.residuals,
            np.clip(row, problem.lower + inside, problem.upper - inside),
            jac=evaluations.jacobian,
            bounds=(problem.lower, problem.upper),
            x_scale=problem.upper - problem.lower,
            ftol=1e-8,
            xtol=1e-6,
            gtol=1e-8,
            max_nfev=_STEPS,
        )
        if tally.objective < before:
            status = "converged" if found.status > 0 else f"stopped after {_STEPS} steps"
    return tally.result(NAME, seed, status)
