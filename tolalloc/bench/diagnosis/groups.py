"""Columns that a curve does not tell apart, and what it tells of them together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True, kw_only=True)
class Group:
    """Columns that are uncertain together.

    Parameters
    ----------
    columns, sources
        Their names, and the names of their sources.
    alone
        Standard deviation of each over its standard deviation by the drawing [-].
    combination
        The unit sum of columns, each over its standard deviation by the drawing, that is known best [-].
    value, together
        Mean and standard deviation of that sum; by the drawings it has mean 0 and standard deviation 1 [-].
    """

    columns: tuple[str, ...]
    sources: tuple[str, ...]
    alone: Float[np.ndarray, " column"]
    combination: Float[np.ndarray, " column"]
    value: float
    together: float


def groups(
    numbers: Float[np.ndarray, "particle column"],
    columns: tuple[str, ...],
    source_of_column: tuple[str, ...],
    link: float = 0.9,
) -> tuple[Group, ...]:
    """Return the groups of columns whose errors replace one another in the curve.

    Parameters
    ----------
    numbers
        Standard normal numbers that the curve allows, near one explanation [-].
    columns, source_of_column
        Names of the columns and of their sources.
    link
        Correlation, of either sign, that links two columns [-].
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
            Group(
                columns=tuple(columns[column] for column in at),
                sources=sources,
                alone=numbers[:, at].std(axis=0),
                combination=vector[:, 0],
                value=float(numbers[:, at].mean(axis=0) @ vector[:, 0]),
                together=float(np.sqrt(max(value[0], 0.0))),
            )
        )
    return tuple(found)
