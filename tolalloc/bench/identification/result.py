"""What a method found, how it got there, and with how many evaluations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.bench.identification.problem import IdentificationProblem
from tolalloc.rv.modification.history import History


@dataclass(frozen=True, kw_only=True)
class Identified:
    """Answer of one run of one method.

    Parameters
    ----------
    method
        Name of the method.
    seed
        Seed of the run; none if nothing is random [-].
    coordinates
        Where the least objective was found [-].
    objective
        Half the weighted sum of squares there [-].
    history
        Least objective after so many evaluations of all readings.
    status
        Why it ended.
    """

    method: str
    seed: int | None
    coordinates: Float[np.ndarray, " parameter"]
    objective: float
    history: History
    status: str

    @property
    def evaluations(self) -> int:
        """How often all readings were predicted [-]."""
        return int(self.history.evaluations[-1])


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One method from many seeds.

    Parameters
    ----------
    runs
        One for each seed, on the stand-in.
    on_model
        Objective of the best run's answer on the model itself [-].
    """

    runs: tuple[Identified, ...]
    on_model: float

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.runs[0].method

    @property
    def objectives(self) -> Float[np.ndarray, " seed"]:
        """Least objective of every run [-]."""
        return np.array([run.objective for run in self.runs])

    def evaluations_until(self, objective: float) -> Float[np.ndarray, " seed"]:
        """Return after how many evaluations each run was at or below an objective; infinite if never [-]."""
        found = []
        for run in self.runs:
            there = np.flatnonzero(run.history.best <= objective)
            found.append(float(run.history.evaluations[there[0]]) if there.size else np.inf)
        return np.array(found)


class Tally:
    """Counts evaluations and keeps the best point.

    Parameters
    ----------
    problem
        What is minimised.

    Attributes
    ----------
    best
        Coordinates of the least objective so far [-].
    objective
        The least objective so far [-].
    """

    def __init__(self, problem: IdentificationProblem) -> None:
        self.best = problem.start
        self.objective = np.inf
        self._counts: list[int] = []
        self._history: list[float] = []

    def add(self, coordinates: Float[np.ndarray, "point parameter"], objectives: Float[np.ndarray, " point"]) -> None:
        """Count a batch of points."""
        at = int(objectives.argmin())
        if objectives[at] < self.objective:
            self.best, self.objective = coordinates[at].copy(), float(objectives[at])
        self._counts.append(objectives.size)
        self._history.append(self.objective)

    def result(self, method: str, seed: int | None, status: str) -> Identified:
        """Return the best point and the way to it."""
        return Identified(
            method=method,
            seed=seed,
            coordinates=self.best,
            objective=self.objective,
            history=History(evaluations=np.cumsum(self._counts), best=np.array(self._history)),
            status=status,
        )
