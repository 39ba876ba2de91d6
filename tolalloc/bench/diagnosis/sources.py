"""What a population of units says of the sources: which one dominates, and which ones the curve does not tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from tolalloc.bench.diagnosis.problem import CurveProblem
from tolalloc.exceptions import SolveError


def reductions(
    problem: CurveProblem, deviations: Float[np.ndarray, "unit column"], largest_failed_share: float = 0.01
) -> Float[np.ndarray, "unit source"]:
    """Return by how much each unit's peak-to-peak falls when one source is put in the middle of its zone [arcsec].

    The readings of the problem play no part.

    Raises
    ------
    SolveError
        A larger share of the units has a curve that failed.
    """
    owner, middle = np.array(problem.errors.source_of_column), problem.deviations(np.zeros((1, problem.size)))
    names = list(dict.fromkeys(problem.errors.source_of_column))
    cases = [deviations, *(np.where(owner == name, middle, deviations) for name in names)]
    evaluation = problem.kernel(np.concatenate(cases))
    values = np.where(evaluation.good, evaluation.values[:, 0], np.nan).reshape(len(cases), -1)
    fall = (values[0] - values[1:]).T
    good = np.isfinite(fall).all(axis=1)
    if (~good).mean() > largest_failed_share:
        raise SolveError(f"{(~good).sum()} of {good.size} units have a curve that failed to solve.")
    return np.asarray(fall[good])


def dominant(fall: Float[np.ndarray, "unit source"]) -> Int[np.ndarray, " unit"]:
    """Return the position of the source without which each unit's peak-to-peak falls most [-]."""
    return np.asarray(fall.argmax(axis=1))


def named_set(probability: Float[np.ndarray, " source"], level: float) -> tuple[int, ...]:
    """Return the fewest sources that contain the dominant one with the probability asked for, likeliest first."""
    order = np.argsort(-probability, kind="stable")
    needed = int(np.searchsorted(np.cumsum(probability[order]), level - 1e-12)) + 1
    return tuple(order[:needed].tolist())


@dataclass(frozen=True, kw_only=True)
class InseparableColumns:
    """Columns that a curve does not tell apart, and what it tells of them together."""

    # Their names, and the names of their sources
    columns: tuple[str, ...]
    sources: tuple[str, ...]
    alone: Float[np.ndarray, " column"]  # Standard deviation of each over its standard deviation by the drawing [-]
    # The unit sum of columns, each over its standard deviation by the drawing, that is known best [-]
    combination: Float[np.ndarray, " column"]
    value: float  # Mean and standard deviation of that sum [-]
    together: float  # By the drawings it has mean 0 and standard deviation 1 [-]


def groups(
    numbers: Float[np.ndarray, "particle column"],
    columns: tuple[str, ...],
    source_of_column: tuple[str, ...],
    link: float = 0.9,
) -> tuple[InseparableColumns, ...]:
    """Return the columns whose errors replace one another in the curve.

    The numbers are standard normal ones that the curve allows, near one explanation; a correlation of either sign
    beyond the link [-] puts two columns together.
    """
    linked = np.abs(np.corrcoef(numbers.T)) >= link
    count, label = connected_components(linked, directed=False)
    found = []
    for at in (np.flatnonzero(label == number) for number in range(count)):
        sources = tuple(dict.fromkeys(source_of_column[column] for column in at))
        if len(sources) < 2:
            continue
        value, vector = np.linalg.eigh(np.cov(numbers[:, at].T))
        found.append(
            InseparableColumns(
                columns=tuple(columns[column] for column in at),
                sources=sources,
                alone=numbers[:, at].std(axis=0),
                combination=vector[:, 0],
                value=float(numbers[:, at].mean(axis=0) @ vector[:, 0]),
                together=float(np.sqrt(max(value[0], 0.0))),
            )
        )
    return tuple(found)
