"""zhang2025's way to allocate: a genetic algorithm, which knows no bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from tolalloc.allocation.space.problem import AllocationProblem
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError
from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.tolerances import AngularAllocation, angular_problem, requirements_of


@dataclass(frozen=True, kw_only=True)
class GeneticAllocation:
    """Best design of one run.

    Parameters
    ----------
    tolerances
        Tolerance of every part about its own axes [rad].
    total
        Cost of tolerances and effort [cost units].
    gap
        Total over the lower bound that the convex program proves, minus one [-].
    """

    tolerances: Float[np.ndarray, "part 3"]
    total: float
    gap: float


class _Searched(Problem):  # type: ignore[misc]
    """The allocation as pymoo sees it; each feature has one process."""

    def __init__(self, problem: AllocationProblem) -> None:
        self.allocation, self.made = problem, [feature.processes[0] for feature in problem.features]
        super().__init__(
            n_var=len(self.made),
            n_obj=1,
            n_ieq_constr=len(problem.stacks),
            xl=np.array([process.minimum for process in self.made]),
            xu=np.array([process.maximum for process in self.made]),
        )

    def _evaluate(self, x: Float[np.ndarray, "design gene"], out: dict[str, object], *_: object, **__: object) -> None:
        costs = sum(process.total(zones) for process, zones in zip(self.made, x.T, strict=True))
        out["F"] = costs + x**2 @ self.allocation.losses
        violations = [stack.load(x, np.empty((len(x), 0))) - stack.budget for stack in self.allocation.stacks]
        out["G"] = np.reshape(violations, (-1, len(x))).T / self.allocation.scales


def genetic_allocation(
    plan: AssemblyPlan,
    allocation: AngularAllocation,
    seeds: SeedTree,
    population: int = 100,
    generations: int = 300,
) -> GeneticAllocation:
    """Return the best tolerances that a run finds for the gains of an allocation.

    Parameters
    ----------
    plan
        What is assembled.
    allocation
        The allocation that the run is held against.
    seeds
        Node of the seed tree.
    population, generations
        Designs of a generation, and generations [-].

    Raises
    ------
    SolveError
        The run came across no tolerances that keep all limits.

    Notes
    -----
    Tournaments prefer what keeps the limits, then what violates them less, then what is cheaper (Deb 2000). The source
    names the algorithm and no more, so the operators are pymoo's: simulated binary crossover and polynomial mutation.

    References
    ----------
    Deb 2000, Comput. Methods Appl. Mech. Eng. 186:311–338.
    """
    errors = allocation.gains.errors
    problem = angular_problem(plan, errors)
    found = minimize(
        _Searched(problem),
        GA(pop_size=population),
        ("n_gen", generations),
        seed=seeds.integer(),
        copy_algorithm=False,
    )
    if found.X is None:
        raise SolveError(f"Genetic search: none of {generations} generations of {population} keeps all limits.")
    cost = problem.cost(found.X, np.zeros(len(found.X), dtype=int))
    total = cost + requirements_of(plan).effort_price * errors.noise_effort
    return GeneticAllocation(
        tolerances=found.X.reshape(-1, 3) * ARCSECOND, total=total, gap=total / allocation.bound - 1
    )
