"""NSGA-II for two objectives, NSGA-III for more, on real and integer genes together."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.operators.selection.tournament import TournamentSelection
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding
from pymoo.operators.survival.rank_and_crowding.metrics import get_crowding_function
from pymoo.optimize import minimize
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from pymoo.util.ref_dirs import get_reference_directions
from scipy.stats import qmc

from tolalloc.allocation.front.pareto_problem import Genes, Objectives, ParetoProblem, SearchedDesigns, spread_over
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.checkpoint import CachedAnswers, Checkpoint

_MARGIN = 0.49
"""How far the operators may leave the range of an integer gene, so that its ends are drawn as often as the rest [-]."""


class _Searched(Problem):  # type: ignore[misc]
    """The problem as pymoo sees it: everything is made small, one constraint sums up all violations, all is kept."""

    def __init__(self, problem: ParetoProblem, checkpoint: Checkpoint | None) -> None:
        self.searched, genes = problem, problem.genes
        self.asked: list[Float[np.ndarray, "design gene"]] = []
        self.signs = np.array([objective.sign for objective in problem.objectives])
        bounds = np.array([genes.lower, genes.upper, genes.integer]).tolist()
        identity = repr((genes.names, bounds, problem.objectives, problem.constraints))
        self.cached = CachedAnswers(self._ask, identity, checkpoint)
        margin = _MARGIN * genes.integer
        super().__init__(
            n_var=genes.lower.size,
            n_obj=self.signs.size,
            n_ieq_constr=1,
            xl=genes.lower - margin,
            xu=genes.upper + margin,
        )

    def answers(self, designs: Float[np.ndarray, "design gene"]) -> Objectives:
        """Return the objectives of every design, each asked for once."""
        numbers, count = self.cached(designs), self.signs.size
        return Objectives(
            values=numbers[:, :count], violation=numbers[:, count:-1], status=numbers[:, -1].astype(np.uint8)
        )

    def _ask(self, designs: Float[np.ndarray, "design gene"]) -> Float[np.ndarray, "design number"]:
        answers = self.searched(designs)
        return np.column_stack([answers.values, answers.violation, answers.status])

    def _evaluate(self, x: Float[np.ndarray, "design gene"], out: dict[str, object], *_: object, **__: object) -> None:
        self.asked.append(x)
        answers = self.answers(x)
        out["F"], out["G"] = answers.values * self.signs, answers.total_violation[:, np.newaxis]


def _less_violating(
    population: Population, pairs: Int[np.ndarray, "pair 2"], random_state: np.random.Generator, **_: object
) -> Int[np.ndarray, "pair 1"]:
    """Return the less violating one of each pair, or either of equals.

    pymoo's own tournament of NSGA-III draws its ties between violating designs from a generator without a seed.
    """
    violation = population.get("CV")[:, 0][pairs]
    equal = violation[:, 0] == violation[:, 1]
    winner = np.where(equal, random_state.integers(0, 2, len(pairs)), np.argmin(violation, axis=1))
    return np.take_along_axis(pairs, winner[:, np.newaxis], axis=1)


def reference_directions(objectives: int, population: int) -> Float[np.ndarray, "direction objective"]:
    """Return the finest regular lattice of Das & Dennis (1998) with no more directions than the population has designs.

    >>> reference_directions(2, 3)
    array([[0. , 1. ],
           [0.5, 0.5],
           [1. , 0. ]])
    """
    partitions = 1
    while comb(partitions + objectives, objectives - 1) <= population:
        partitions += 1
    return np.asarray(get_reference_directions("das-dennis", objectives, n_partitions=partitions))


def _first_population(
    genes: Genes, known: Float[np.ndarray, "known gene"], population: int, seeds: SeedTree
) -> Float[np.ndarray, "design gene"]:
    """Return known designs, evenly picked if there are too many, and a space-filling rest."""
    first = known[spread_over(len(known), population)] if len(known) else known
    reach = genes.upper - genes.lower + 2 * _MARGIN * genes.integer
    fill = qmc.LatinHypercube(genes.lower.size, rng=seeds.generator()).random(population - len(first))
    return genes.rounded(np.concatenate([first, genes.lower - _MARGIN * genes.integer + fill * reach]))


def _algorithm(objectives: int, population: int, **options: Any) -> Algorithm:
    if objectives == 2:
        # Distances that are renewed after every removal leave a more even front than the original's.
        return NSGA2(pop_size=population, survival=RankAndCrowding(crowding_func="pcd"), **options)
    return NSGA3(
        reference_directions(objectives, population),
        pop_size=population,
        selection=TournamentSelection(func_comp=_less_violating),
        **options,
    )


def search(
    problem: ParetoProblem,
    known: Float[np.ndarray, "known gene"],
    seeds: SeedTree,
    population: int = 80,
    generations: int = 100,
    checkpoint: Checkpoint | None = None,
) -> SearchedDesigns:
    """Return every design that a search has asked for, in that order.

    Parameters
    ----------
    known
        Genes of designs known to be good, part of the first generation, possibly none.
    population, generations
        Designs of a generation and number of generations, the first among them [-].
    checkpoint
        Where the answers are kept, so that an interrupted search goes on with the same bits.

    Notes
    -----
    A generation forgets good designs where its front is crowded; the front of all designs never gets worse.

    References
    ----------
    Deb, Pratap, Agarwal & Meyarivan 2002, IEEE Trans. Evol. Comput. 6:182–197; Deb & Jain 2014, ibid. 18:577–601;
    distances between neighbours renewed after every removal: Kukkonen & Deb 2006, CEC, 1179–1186.
    """
    count = len(problem.objectives)
    if count < 2:
        raise InputError.at("Pareto search", "number of objectives", count, "2 or more")
    if population < count + 1 or generations < 1:
        raise InputError.at(
            "Pareto search", "population and generations", (population, generations), f"{count + 1} and 1, or more"
        )
    searched = _Searched(problem, checkpoint)

    def rounded(_: Problem, designs: Population, **__: object) -> Population:
        return designs.set("X", problem.genes.rounded(np.array([design.X for design in designs])))

    minimize(
        searched,
        _algorithm(
            count,
            population,
            sampling=_first_population(problem.genes, known, population, seeds.child("fill")),
            repair=rounded,
        ),
        ("n_gen", generations),
        seed=seeds.child("genetic").integer(),
        copy_algorithm=False,
    )
    searched.cached.write()
    designs = np.concatenate(searched.asked)
    return SearchedDesigns(problem=problem, designs=designs, answers=searched.answers(designs))


def best_front(found: SearchedDesigns, number: int) -> SearchedDesigns:
    """Return allowed designs that no other one beats, in the order of the first objective, possibly none.

    Where there are more than the number [-], those in the densest places are left out.

    Pareto order and thinning as `nondominated` and `thinned`: Deb et al. 2002; Kukkonen & Deb 2006.
    """
    allowed = found.at(np.flatnonzero(found.answers.kept))
    front = allowed.at(np.flatnonzero(nondominated(allowed.losses)))
    few = front.at(thinned(front.losses, number))
    return few.at(np.argsort(few.losses[:, 0], kind="stable"))


def nondominated(losses: Float[np.ndarray, "design objective"]) -> Bool[np.ndarray, " design"]:
    """Return which designs no other one beats in one objective without losing in another; equal ones stay both.

    Beaten by b: bᵢ ≤ aᵢ in every objective and bᵢ < aᵢ in one. Sorted as by Deb, Pratap, Agarwal & Meyarivan 2002, IEEE
    Trans. Evol. Comput. 6, 182–197.

    Examples
    --------
    >>> nondominated(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 4.0]]))
    array([ True,  True, False])
    """
    front = np.zeros(len(losses), bool)
    front[NonDominatedSorting().do(losses, only_non_dominated_front=True)] = True
    return front


def thinned(losses: Float[np.ndarray, "design objective"], number: int) -> Int[np.ndarray, " kept"]:
    """Return the positions of at most so many designs of a front, those in the densest places left out one by one.

    References
    ----------
    Kukkonen & Deb 2006, CEC, 1179–1186, for two objectives; Kukkonen & Deb 2006, PPSN IX, 553–562, for more.

    Examples
    --------
    Of two neighbours one is left out, the ends stay.

    >>> thinned(np.array([[0.0, 4.0], [2.0, 2.0], [2.1, 1.9], [4.0, 0.0]]), 3).tolist()
    [0, 1, 3]
    """
    if len(losses) <= number:
        return np.arange(len(losses))
    crowding = get_crowding_function("pcd" if losses.shape[1] == 2 else "mnn")
    distance = crowding.do(losses, n_remove=len(losses) - number)
    return np.asarray(np.sort(np.argsort(-distance, kind="stable")[:number]))
