"""The searches that liu2020 compares: its improved particle swarm, the plain one and a genetic algorithm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from tolalloc.bench.identification.problem import IdentificationProblem
from tolalloc.bench.identification.result import Identified, Tally
from tolalloc.bench.identification.swarm import ImprovedPSO
from tolalloc.drawing.seeds import SeedTree
from tolalloc.exceptions import UnknownNameError

GENERATIONS = 100
"""Iterations of the swarms and generations of the genetic algorithm, as liu2020 prints them [-]."""

ALGORITHMS: dict[str, Callable[[], Algorithm]] = {
    "improved particle swarm": lambda: ImprovedPSO(pop_size=20),
    "particle swarm": lambda: PSO(pop_size=20),
    "genetic algorithm": lambda: GA(pop_size=100),
}
"""Name → a new algorithm of liu2020's size; what else pymoo sets is assumed."""


class _Coordinates(Problem):  # type: ignore[misc]
    """The coordinates are the genes: they are of order one already."""

    def __init__(self, problem: IdentificationProblem, tally: Tally) -> None:
        self.identification, self.tally = problem, tally
        super().__init__(n_var=len(problem.parameters), n_obj=1, xl=problem.lower, xu=problem.upper)

    def _evaluate(self, x: Float[np.ndarray, "n p"], out: dict[str, object], *_: object, **__: object) -> None:
        objectives = self.identification.objectives(x)
        self.tally.add(x, objectives)
        out["F"] = objectives


def search(
    problem: IdentificationProblem, algorithm: str, seed: int, begin: Callable[[], Algorithm] | None = None
) -> Identified:
    """Return the best point that an algorithm comes across.

    Parameters
    ----------
    problem
        What is minimised; a stand-in should predict, as thousands of points are asked for.
    algorithm
        One of `ALGORITHMS`.
    seed
        Seed, 0 like every other [-].
    begin
        Makes the algorithm with other settings than those of `ALGORITHMS`.

    Raises
    ------
    UnknownNameError
        No such algorithm.
    """
    if algorithm not in ALGORITHMS:
        raise UnknownNameError.among("search", "algorithm", algorithm, ALGORITHMS)
    tally = Tally(problem)
    own = SeedTree(seed).child("identification", algorithm).integer()
    genes = _Coordinates(problem, tally)
    minimize(genes, (begin or ALGORITHMS[algorithm])(), ("n_gen", GENERATIONS), seed=own, copy_algorithm=False)
    return tally.result(algorithm, seed, f"{GENERATIONS} generations done")
