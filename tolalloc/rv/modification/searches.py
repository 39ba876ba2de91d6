"""Evolutionary searches for the two amounts: pymoo's differential evolution, genetic algorithm and CMA-ES."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from jaxtyping import Float
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.constraints.as_penalty import ConstraintsAsPenalty
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from tolalloc.drawing.seeds import SeedTree
from tolalloc.exceptions import UnknownNameError
from tolalloc.rv.modification.problem import ModificationProblem
from tolalloc.rv.modification.reference import polish, reference
from tolalloc.rv.modification.result import SearchResult, Spread, Tally
from tolalloc.units import MILLIMETRE

GENERATIONS = 400
"""Generations of a search unless told otherwise, assumed [-]."""

_PENALTY = 10.0  # objective per violation, more than any constraint is worth, so the optimum stays where it is [-]


class _Genes(Problem):  # type: ignore[misc]
    """Genes are the amounts in millimetres, which makes them, objective and constraints of order one."""

    def __init__(self, tally: Tally) -> None:
        self.tally, problem = tally, tally.problem
        rows = problem.constraints(problem.lower[np.newaxis]).shape[1]
        lower, upper = problem.lower / MILLIMETRE, problem.upper / MILLIMETRE
        super().__init__(n_var=2, n_obj=1, n_ieq_constr=rows, xl=lower, xu=upper)

    def _evaluate(self, x: Float[np.ndarray, "n 2"], out: dict[str, object], *_: object, **__: object) -> None:
        evaluation = self.tally(x * MILLIMETRE)
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

    Parameters
    ----------
    problem
        What is searched.
    algorithm
        One of `ALGORITHMS`.
    seed
        Seed, 0 like every other [-].
    generations
        Largest number of generations; CMA-ES ends sooner if its restarts have converged [-].

    Raises
    ------
    UnknownNameError
        No such algorithm.
    """
    if algorithm not in ALGORITHMS:
        raise UnknownNameError.among("search", "algorithm", algorithm, ALGORITHMS)
    tally = Tally(problem)
    genes: Problem = _Genes(tally)
    if algorithm == "CMA-ES":  # which has no constraints of its own
        genes = ConstraintsAsPenalty(genes, penalty=_PENALTY)
    own = SeedTree(seed).child("modification", algorithm).integer()
    minimize(genes, ALGORITHMS[algorithm](), ("n_gen", generations), seed=own, copy_algorithm=False)
    return tally.result(algorithm, seed)


def spread(
    problem: ModificationProblem,
    algorithm: str,
    seeds: Iterable[int],
    generations: int = GENERATIONS,
    polished: bool = False,
) -> Spread:
    """Return the answers of one algorithm from many seeds, beside the reference.

    Parameters
    ----------
    problem
        What is searched.
    algorithm
        One of `ALGORITHMS`.
    seeds
        Seeds [-].
    generations
        Largest number of generations of each [-].
    polished
        Whether each answer is polished.
    """
    results = [search(problem, algorithm, seed, generations) for seed in seeds]
    if polished:
        results = [polish(problem, result) for result in results]
    return Spread(results=tuple(results), reference=reference(problem))
