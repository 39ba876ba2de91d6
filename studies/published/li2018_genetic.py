"""li2018's genetic algorithm: bits, scaled fitness, roulette, one-point crossover, mixed penalty with extrapolation.

The source prints N, p_m and the generations, and names the rest; how each name is read is assumed. The formulas of its
"two-point exterior-difference mixed penalty" are lost; it is read as sequential unconstrained minimisation: constraints
become penalties with a factor r that falls from search to search, and the optima of two searches give away that at
r → 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.selection import Selection
from pymoo.core.survival import Survival
from pymoo.operators.crossover.pntx import SinglePointCrossover
from pymoo.operators.mutation.bitflip import BitflipMutation
from pymoo.optimize import minimize

from tolalloc.drawings.seeds import SeedTree
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.modification import Amounts, ModificationProblem

from .modification_searches import Recorder, SearchResult

Bits = Bool[np.ndarray, "n bit"]


@dataclass(frozen=True, kw_only=True)
class BinarySettings:
    """How the algorithm is run; population, generations and mutation are li2018's, all else is assumed.

    Parameters
    ----------
    population, generations
        Individuals N, and generations of all rounds together [-].
    mutation
        Probability p_m that a bit flips [-].
    crossover
        Probability p_c that two parents exchange what stands after a point [-].
    bits
        Bits per amount [-].
    favour
        C: children of the best individual where the mean one has 1 [-].
    rounds
        Penalty factors, one after another [-].
    penalty
        First penalty factor r [mm²].
    fall
        c: ratio of a penalty factor to the one before [-].
    """

    population: int = 50
    generations: int = 500
    mutation: float = 0.001
    crossover: float = 0.8
    bits: int = 16
    favour: float = 2.0
    rounds: int = 10
    penalty: float = 1e-5
    fall: float = 0.1


LI2018 = BinarySettings()
"""Settings of the source."""


@dataclass(frozen=True, kw_only=True)
class BinaryCode:
    """Both amounts as bits, the equidistant first, the most significant bit first.

    Parameters
    ----------
    lower, upper
        Amounts of all bits 0 and of all bits 1 [m].
    bits
        Bits per amount [-].
    """

    lower: Float[np.ndarray, " 2"]
    upper: Float[np.ndarray, " 2"]
    bits: int

    def amounts(self, code: Bits) -> Amounts:
        """Return the amounts of codes [m]."""
        whole = code.reshape(-1, 2, self.bits) @ (1 << np.arange(self.bits)[::-1])
        return np.asarray(self.lower + whole / (2**self.bits - 1) * (self.upper - self.lower))

    def code(self, amounts: Amounts) -> Bits:
        """Return the codes nearest to amounts [m]."""
        share = np.clip((amounts - self.lower) / (self.upper - self.lower), 0, 1)
        whole = np.rint(share * (2**self.bits - 1)).astype(int)
        return np.asarray(whole[:, :, np.newaxis] >> np.arange(self.bits)[::-1] & 1, bool).reshape(len(amounts), -1)


def scaled_fitness(value: Float[np.ndarray, " n"], favour: float) -> Float[np.ndarray, " n"]:
    """Return f′ = a·f + b of the fitness f = largest value − value [mm].

    a and b keep the mean and make the largest f′ ``favour`` times the mean; what becomes negative counts as 0.
    """
    fitness = value.max() - value
    mean, largest = fitness.mean(), fitness.max()
    if not largest > mean:  # all alike
        return np.ones_like(fitness)
    slope = (favour - 1) * mean / (largest - mean)
    return np.asarray(np.maximum(slope * (fitness - mean) + mean, 0.0))


def mixed_penalty(margin: Float[np.ndarray, "n c"], factor: float) -> Float[np.ndarray, " n"]:
    """Return Σ r/g over the constraints g that are met, plus Σ g²/√r over the violated ones [mm].

    Parameters
    ----------
    margin
        Constraints g, not negative where met [mm].
    factor
        Penalty factor r [mm²].
    """
    inside = factor / np.where(margin > 0, margin, np.inf)
    outside = np.minimum(margin, 0.0) ** 2 / np.sqrt(factor)
    return np.asarray((inside + outside).sum(axis=-1))


def extrapolated(last: Amounts, now: Amounts, fall: float) -> Amounts:
    """Return the optimum at r → 0 from those at two penalty factors of ratio c, one after the other [m].

    Both parts of the penalty keep its optimum away from the constrained one in proportion to √r.
    """
    root = np.sqrt(fall)
    return np.asarray((now - root * last) / (1 - root))


class _Penalized(Problem):  # type: ignore[misc]
    def __init__(self, recorder: Recorder, code: BinaryCode, factor: float) -> None:
        self.recorder, self.code, self.factor = recorder, code, factor
        super().__init__(n_var=2 * code.bits, n_obj=1, xl=False, xu=True, vtype=bool)

    def _evaluate(self, x: Bits, out: dict[str, object], *_: object, **__: object) -> None:
        evaluation = self.recorder(self.code.amounts(x))
        penalty = mixed_penalty(evaluation.constraints / MILLIMETRE, self.factor)
        out["F"] = evaluation.objective / MILLIMETRE + penalty


class _Roulette(Selection):  # type: ignore[misc]
    def __init__(self, favour: float) -> None:
        super().__init__()
        self.favour = favour

    def _do(
        self, _: Problem, pop: Population, select: int, parents: int, random_state: np.random.Generator, **__: object
    ) -> Int[np.ndarray, "select parent"]:
        fitness = scaled_fitness(pop.get("F")[:, 0], self.favour)
        return random_state.choice(len(pop), (select, parents), p=fitness / fitness.sum())


class _Children(Survival):  # type: ignore[misc]
    """The children take their parents' place; they stand behind them."""

    def __init__(self) -> None:
        super().__init__(filter_infeasible=False)

    def _do(self, _: Problem, pop: Population, n_survive: int, **__: object) -> Population:
        return pop[-n_survive:]


def _algorithm(settings: BinarySettings, first: Bits) -> Algorithm:
    return GA(
        pop_size=settings.population,
        sampling=first,
        selection=_Roulette(settings.favour),
        crossover=SinglePointCrossover(prob=settings.crossover),
        mutation=BitflipMutation(prob_var=settings.mutation),
        survival=_Children(),
        eliminate_duplicates=False,
    )


def binary_search(problem: ModificationProblem, seed: int, settings: BinarySettings = LI2018) -> SearchResult:
    """Return the best point that li2018's algorithm comes across.

    Notes
    -----
    The "two-point exterior-difference mixed penalty" is read as a sequence of unconstrained searches with a falling
    penalty factor, each begun from the last one's population with the two-point extrapolation of the optimum in place
    of its worst individual.
    """
    recorder, seeds = Recorder(problem), SeedTree(seed).child("modification", "binary")
    code = BinaryCode(lower=problem.lower, upper=problem.upper, bits=settings.bits)
    first = seeds.generator().random((settings.population, 2 * settings.bits)) < 0.5
    optima: list[Amounts] = []
    for number in range(settings.rounds):
        last = minimize(
            _Penalized(recorder, code, settings.penalty * settings.fall**number),
            _algorithm(settings, first),
            ("n_gen", settings.generations // settings.rounds),
            seed=seeds.child(str(number)).integer(),
        ).pop
        first, value = last.get("X").astype(bool), last.get("F")[:, 0]
        optima.append(code.amounts(first[[value.argmin()]]))
        if number > 0:
            first[value.argmax()] = code.code(extrapolated(optima[-2], optima[-1], settings.fall))[0]
    return recorder.result("binary genetic algorithm", seed)
