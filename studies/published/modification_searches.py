"""Searches for the two modification amounts: pymoo's algorithms, what each seed found, and polishing what it left."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.constraints.as_penalty import ConstraintsAsPenalty
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from scipy.optimize import minimize as minimize_downhill

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import UnknownNameError
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.modification import (
    Amounts,
    BestPoint,
    EvaluatedAmounts,
    ModificationProblem,
    Optimum,
    reference,
)

from .search_history import History, quartiles

REACHED = 1e-6 * MILLIMETRE
"""Largest difference from the reference's amounts at which a search has reached it [m]."""

GENERATIONS = 400
"""Generations of a search unless told otherwise, assumed [-]."""

_PENALTY = 10.0  # objective per violation, more than any constraint is worth, so the optimum stays where it is [-]


_REACHES = 0.05 * (-0.25) ** np.arange(6)  # first sizes of the simplices, to either side in turn, per range [-]


@dataclass(frozen=True, kw_only=True)
class SearchResult(Optimum):
    """Answer of one search: the best point that it came across.

    Parameters
    ----------
    algorithm
        How it was searched.
    seed
        Seed of the search; None where there is no chance in it [-].
    history
        The way there.
    """

    algorithm: str
    seed: int | None
    history: History


class Recorder(BestPoint):
    """The best point, and the way of the search to it."""

    def __init__(self, problem: ModificationProblem) -> None:
        super().__init__(problem)
        self._counts: list[int] = []
        self._history: list[float] = []

    def __call__(self, amounts: Amounts) -> EvaluatedAmounts:
        """Return points evaluated."""
        evaluated = super().__call__(amounts)
        self._counts.append(len(amounts))
        self._history.append(self.objective if self.violation == 0 else np.inf)
        return evaluated

    def result(self, algorithm: str, seed: int | None, before: History | None = None) -> SearchResult:
        """Return the best point and the way to it, after another search's if one is given."""
        history = History(evaluations=np.cumsum(self._counts), best=np.array(self._history))
        if before is not None:
            history = before.then(history)
        return SearchResult(
            amounts=self.amounts,
            objective=self.objective,
            violation=self.violation,
            evaluations=int(history.evaluations[-1]),
            algorithm=algorithm,
            seed=seed,
            history=history,
        )


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Answers of one algorithm from many seeds.

    Parameters
    ----------
    results
        One for each seed.
    reference
        The sure optimum.
    """

    results: tuple[SearchResult, ...]
    reference: Optimum

    @property
    def amounts(self) -> Float[np.ndarray, "seed 2"]:
        """Amounts of each seed [m]."""
        return np.array([result.amounts for result in self.results])

    @property
    def reached(self) -> Bool[np.ndarray, " seed"]:
        """Whether both amounts are within `REACHED` of the reference's; a flat optimum asks for objectives instead."""
        return np.asarray((np.abs(self.amounts - self.reference.amounts) <= REACHED).all(axis=-1))

    @property
    def share(self) -> float:
        """Share of the seeds that reached the reference [-]."""
        return float(self.reached.mean())

    def band(self, evaluations: Int[np.ndarray, " n"]) -> Float[np.ndarray, "3 n"]:
        """Return lower quartile, median and upper quartile of the best objective after so many evaluations [m]."""
        return quartiles([result.history for result in self.results], evaluations)


class _Genes(Problem):  # type: ignore[misc]
    """Genes are the amounts in millimetres, which makes them, objective and constraints of order one."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder, problem = recorder, recorder.problem
        rows = problem.constraints(problem.lower[np.newaxis]).shape[1]
        lower, upper = problem.lower / MILLIMETRE, problem.upper / MILLIMETRE
        super().__init__(n_var=2, n_obj=1, n_ieq_constr=rows, xl=lower, xu=upper)

    def _evaluate(self, x: Float[np.ndarray, "n 2"], out: dict[str, object], *_: object, **__: object) -> None:
        evaluation = self.recorder(x * MILLIMETRE)
        out["F"], out["G"] = evaluation.objective / MILLIMETRE, -evaluation.constraints / MILLIMETRE


class _CMAES(CMAES):  # type: ignore[misc]
    """CMA-ES on pymoo's generator; left alone it seeds NumPy's global one, and by the clock if the seed is 0."""

    def _setup(self, problem: Problem, **kwargs: object) -> None:
        super()._setup(problem, **kwargs)
        self.options |= {"seed": np.nan, "randn": lambda *shape: self.random_state.standard_normal(shape)}


def _differential_evolution() -> Algorithm:
    """Return DE/rand/1/bin as song2019 sets it, without jitter and without the mutation that pymoo adds to it."""
    return DE(pop_size=10, variant="DE/rand/1/bin", CR=0.3, F=0.4, jitter=False, prob_mut=0.0)


ALGORITHMS: dict[str, Callable[[], Algorithm]] = {
    "differential evolution": _differential_evolution,
    "genetic algorithm": lambda: GA(pop_size=40),
    "CMA-ES": lambda: _CMAES(sigma=0.25, restarts=2),
}
"""Name → a new algorithm; sizes of the genetic algorithm and of CMA-ES are assumed."""


def search(problem: ModificationProblem, algorithm: str, seed: int, generations: int = GENERATIONS) -> SearchResult:
    """Return the best point that an evolutionary algorithm comes across.

    CMA-ES ends before the last generation if its restarts have converged.

    Raises
    ------
    UnknownNameError
        No such algorithm.
    """
    if algorithm not in ALGORITHMS:
        raise UnknownNameError.among("search", "algorithm", algorithm, ALGORITHMS)
    recorder = Recorder(problem)
    genes: Problem = _Genes(recorder)
    if algorithm == "CMA-ES":  # which has no constraints of its own
        genes = ConstraintsAsPenalty(genes, penalty=_PENALTY)
    own = SeedTree(seed).child("modification", algorithm).integer()
    minimize(genes, ALGORITHMS[algorithm](), ("n_gen", generations), seed=own, copy_algorithm=False)
    return recorder.result(algorithm, seed)


def polish(problem: ModificationProblem, result: SearchResult) -> SearchResult:
    """Return the optimum that is reached downhill from a result, never worse, with the history going on.

    Notes
    -----
    Sequential quadratic programming follows the constraints; simplices of Nelder and Mead, each begun smaller than the
    one before, need no derivative and take what kinks have left.
    """
    recorder, lower, upper = Recorder(problem), problem.lower / MILLIMETRE, problem.upper / MILLIMETRE
    recorder(result.amounts[np.newaxis])

    def evaluate(genes: Float[np.ndarray, " 2"]) -> EvaluatedAmounts:
        return recorder(np.clip(genes, lower, upper)[np.newaxis] * MILLIMETRE)

    minimize_downhill(
        lambda genes: evaluate(genes).objective[0] / MILLIMETRE,
        result.amounts / MILLIMETRE,
        method="SLSQP",
        bounds=np.stack([lower, upper], axis=-1),
        constraints={"type": "ineq", "fun": lambda genes: evaluate(genes).constraints[0] / MILLIMETRE},
        options={"ftol": 1e-15, "maxiter": 50},
    )
    for reach in _REACHES:
        start = recorder.amounts / MILLIMETRE
        corners = np.array([[0, 0], [reach, 0], [0, reach]]) * (upper - lower)
        minimize_downhill(
            lambda genes: evaluate(genes).merit[0] / MILLIMETRE,
            start,
            method="Nelder-Mead",
            options={"initial_simplex": start + corners, "xatol": 1e-9, "fatol": 1e-13},
        )
    return recorder.result(f"{result.algorithm}, polished", result.seed, result.history)


def spread(problem: ModificationProblem, algorithm: str, seeds: Iterable[int]) -> Spread:
    """Return the answers of one algorithm from many seeds, beside the reference."""
    return Spread(results=tuple(search(problem, algorithm, seed) for seed in seeds), reference=reference(problem))
