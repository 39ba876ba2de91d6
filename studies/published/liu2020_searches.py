"""The searches that liu2020 compares: its improved particle swarm, the plain one and a genetic algorithm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import UnknownNameError
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.running.progress import Progress
from tolalloc.wings.bench.identification import STARTS, IdentificationResult
from tolalloc.wings.bench.least_squares import NAME as GAUSS_NEWTON
from tolalloc.wings.bench.least_squares import Batch, IdentificationProblem, Identified, gauss_newton, starts
from tolalloc.wings.bench.parameters import BIAS
from tolalloc.wings.bench.prediction import KernelPredictor, Surrogate

from .liu2020_swarm import ImprovedPSO
from .search_history import History, quartiles

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

    def __init__(self, problem: IdentificationProblem) -> None:
        self.identification = problem
        self.batches: list[Batch] = []
        super().__init__(n_var=len(problem.parameters), n_obj=1, xl=problem.lower, xu=problem.upper)

    def _evaluate(self, x: Float[np.ndarray, "n p"], out: dict[str, object], *_: object, **__: object) -> None:
        objectives = self.identification.objectives(x)
        self.batches.append((x.copy(), objectives))
        out["F"] = objectives


def search(
    problem: IdentificationProblem, algorithm: str, seed: int, begin: Callable[[], Algorithm] | None = None
) -> Identified:
    """Return the best point that an algorithm comes across.

    Parameters
    ----------
    problem
        What is minimised; a surrogate should predict, as thousands of points are asked for.
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
    own = SeedTree(seed).child("identification", algorithm).integer()
    genes = _Coordinates(problem)
    minimize(genes, (begin or ALGORITHMS[algorithm])(), ("n_gen", GENERATIONS), seed=own, copy_algorithm=False)
    return Identified.among(genes.batches, algorithm, f"{GENERATIONS} generations done")


@dataclass(frozen=True, kw_only=True)
class MethodRuns:
    """One method from many seeds.

    Parameters
    ----------
    runs
        One for each seed, on the surrogate.
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

    @property
    def histories(self) -> list[History]:
        """Least objective after so many evaluations of every run."""
        return [History(evaluations=run.evaluated, best=run.least) for run in self.runs]

    def evaluations_until(self, objective: float) -> Float[np.ndarray, " seed"]:
        """Return after how many evaluations each run was at or below an objective; infinite if never [-]."""
        found = []
        for run in self.runs:
            there = np.flatnonzero(run.least <= objective)
            found.append(float(run.evaluated[there[0]]) if there.size else np.inf)
        return np.array(found)

    @property
    def summary(self) -> dict[str, Any]:
        """The runs for a program, units in the names."""
        return {
            "method": self.method,
            "objectives [-]": [float(value) for value in self.objectives],
            "evaluations [-]": [run.evaluations for run in self.runs],
            "objective of the best on the model [-]": self.on_model,
        }


def on_polynomials(answer: IdentificationResult) -> IdentificationProblem:
    """Return the problem of an identification, predicted by its polynomials."""
    fitted = tuple(item for item in answer.parameters if item.name != BIAS)
    return IdentificationProblem(
        parameters=answer.parameters,
        data=answer.data,
        predictor=Surrogate(answer.parameters, fitted, answer.polynomial, answer.data),
        weight=np.ones(len(answer.measurements.units)),
    )


def compare(answer: IdentificationResult, seeds: int, progress: Progress) -> tuple[MethodRuns, ...]:
    """Return every method's runs from many seeds on the same polynomials; the best of each is put to the model.

    Parameters
    ----------
    answer
        A finished identification.
    seeds
        Number of seeds, from 1 [-].
    progress
        Told of every method.
    """
    quick = on_polynomials(answer)
    parameters, data = answer.parameters, answer.data
    kernel = KernelPredictor(answer.reducer, parameters, answer.measurements, data, progress.advance)
    model = quick.of(parameters, kernel)
    methods = []
    for name in (GAUSS_NEWTON, *ALGORITHMS):
        progress.begin(f"{name}, {seeds} seeds")
        runs = []
        for seed in range(1, 1 + seeds):
            if name == GAUSS_NEWTON:  # from random starts, as every other method
                begin = starts(quick, STARTS + 1, SeedTree(seed).child("identification", name))[1:]
                runs.append(gauss_newton(quick, begin))
            else:
                runs.append(search(quick, name, seed))
        best = min(runs, key=lambda run: run.objective)
        on_model = float(model.objectives(best.coordinates[np.newaxis])[0])
        methods.append(MethodRuns(runs=tuple(runs), on_model=on_model))
    return tuple(methods)


def methods_section(methods: tuple[MethodRuns, ...], readings: int) -> Section:
    """Return how the methods compare over many seeds."""
    return Section(
        heading="Methods",
        paragraphs=(
            "All methods minimise the same objective on the same polynomials, Gauss–Newton from eight random starts "
            "for each seed; the last column puts the best answer of each to the model itself.",
        ),
        figures=(_convergence_figure(methods),),
        tables=(("methods", methods_table(methods, readings)),),
    )


def _least(methods: tuple[MethodRuns, ...]) -> float:
    return max(min(float(item.objectives.min()) for item in methods), np.finfo(float).tiny)


def methods_table(methods: tuple[MethodRuns, ...], readings: int) -> pd.DataFrame:
    """Return how every method did over its seeds."""
    least = _least(methods)
    near = least * (1 + 1e-4) ** 2
    rows = []
    for item in methods:
        until = item.evaluations_until(near)
        off = np.sqrt(item.objectives / least) - 1
        rows.append(
            {
                "method": item.method,
                "seeds [-]": len(item.runs),
                "evaluations [-]": float(np.median([run.evaluations for run in item.runs])),
                "S above the least, median [-]": float(np.median(off)),
                "S above the least, worst [-]": float(off.max()),
                "within 1e-4 of the least [-]": float((off <= 1e-4).mean()),
                "evaluations until then, median [-]": float(np.median(until))
                if np.isfinite(np.median(until))
                else "never",
                "residual of the best on the model, over noise [-]": float(np.sqrt(2 * item.on_model / readings)),
            }
        )
    return pd.DataFrame(rows)


def _convergence_figure(methods: tuple[MethodRuns, ...]) -> Figure:
    """Draw S above its least after so many evaluations: median and quartiles of the seeds."""
    least, series = _least(methods), []
    for item in methods:
        most = max(run.evaluations for run in item.runs)
        first = max(int(run.evaluated[0]) for run in item.runs)
        at = np.unique(np.geomspace(max(first, 1), most, 120).astype(int))
        band = np.maximum(np.sqrt(quartiles(item.histories, at) / least) - 1, 1e-9)
        series.append(
            Series(
                label=item.method,
                kind="line",
                x=[float(value) for value in at],
                y=list(band[1]),
                low=list(band[0]),
                high=list(band[2]),
            )
        )
    return Figure(
        name="convergence",
        title=f"Distance of S from its least: median and quartiles of {len(methods[0].runs)} seeds",
        x_label="evaluations of all units [-]",
        y_label="S over its least, less 1 [-]",
        series=tuple(series),
        logarithmic=True,
        logarithmic_x=True,
    )
