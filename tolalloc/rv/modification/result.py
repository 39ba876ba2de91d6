"""What a search for the amounts found, how it got there, and how the answers of many seeds scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.rv.modification.history import History, quartiles
from tolalloc.rv.modification.problem import Amounts, Evaluation, ModificationProblem
from tolalloc.rv.reducer.design import Modification
from tolalloc.units import MICROMETRE, MILLIMETRE

REACHED = 1e-6 * MILLIMETRE
"""Largest difference from the reference's amounts at which a search has reached it [m]."""


@dataclass(frozen=True, kw_only=True)
class SearchResult:
    """Answer of one search.

    Parameters
    ----------
    algorithm
        How it was searched.
    seed
        Seed of the search; None where there is no chance in it [-].
    amounts
        Δr_rp and Δr_p [m].
    objective
        Objective there [m].
    violation
        By how much the constraints are missed there [m].
    history
        The way there.
    """

    algorithm: str
    seed: int | None
    amounts: Float[np.ndarray, " 2"]
    objective: float
    violation: float
    history: History

    @property
    def evaluations(self) -> int:
        """Points that were evaluated [-]."""
        return int(self.history.evaluations[-1])

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


class Tally:
    """Evaluates points of a problem, counts them and keeps the best.

    Parameters
    ----------
    problem
        What is searched.

    Attributes
    ----------
    best
        Best amounts up to now [m].
    """

    def __init__(self, problem: ModificationProblem) -> None:
        self.problem = problem
        self._merit = self._objective = self._violation = np.inf
        self.best = np.full(2, np.nan)
        self._counts: list[int] = []
        self._history: list[float] = []

    def __call__(self, amounts: Amounts) -> Evaluation:
        """Return points evaluated.

        Parameters
        ----------
        amounts
            Pairs of amounts [m].
        """
        evaluation = self.problem.evaluate(amounts)
        at = int(evaluation.merit.argmin())
        if evaluation.merit[at] < self._merit:
            self.best, self._merit = amounts[at].copy(), float(evaluation.merit[at])
            self._objective, self._violation = float(evaluation.objective[at]), float(evaluation.violation[at])
        self._counts.append(len(amounts))
        self._history.append(self._objective if self._violation == 0 else np.inf)
        return evaluation

    def result(self, algorithm: str, seed: int | None) -> SearchResult:
        """Return the best point and the way to it."""
        return SearchResult(
            algorithm=algorithm,
            seed=seed,
            amounts=self.best,
            objective=self._objective,
            violation=self._violation,
            history=History(evaluations=np.cumsum(self._counts), best=np.array(self._history)),
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
    reference: SearchResult

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
