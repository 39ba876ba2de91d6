"""Correlations between sources: same spindle, same fixture, pins of one lot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.sparse.csgraph import connected_components

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.uncertainty.sources import Source

_ROUNDING = 1e-10
"""Eigenvalue of a correlation matrix above whose negative it counts as zero [-]."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two correlated sources.

    Parameters
    ----------
    one, other
        Names of the sources; the first column of one goes with the first of the other, and so on.
    correlation
        Of the standard normal numbers behind the columns; for normal sources that of the columns themselves [-].
    """

    one: str
    other: str
    correlation: float


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """All correlations of an error model, as a Gaussian copula: every source keeps its own distribution.

    Parameters
    ----------
    pairs
        Correlated pairs; all other pairs are independent.
    origin
        File that they come from, for messages.
    """

    pairs: tuple[Pair, ...] = ()
    origin: str = "correlations"

    def among(self, sources: Sequence[Source]) -> tuple[Pair, ...]:
        """Return the pairs whose sources both vary and whose correlation is not zero."""
        varying = {source.name for source in sources if source.zone > 0.0}
        return tuple(pair for pair in self.pairs if pair.correlation and {pair.one, pair.other} <= varying)

    def require_sound(self, sources: Sequence[Source]) -> None:
        """Raise unless the pairs name sources of equal shape and all correlations can hold together.

        Raises
        ------
        InputError, UnknownNameError
            The pair that is not allowed.
        """
        shapes = {source.name: len(source.columns) for source in sources}
        for pair in self.pairs:
            place = f"{self.origin}, {pair.one} with {pair.other}"
            for name in (pair.one, pair.other):
                if name not in shapes:
                    raise UnknownNameError.among(self.origin, "source", name, shapes)
            if not -1 <= pair.correlation <= 1:
                raise InputError.at(place, "correlation", pair.correlation, "-1 to 1")
            if pair.one == pair.other or shapes[pair.one] != shapes[pair.other]:
                raise InputError.at(
                    place,
                    "columns",
                    f"{shapes[pair.one]} and {shapes[pair.other]}",
                    "two different sources with equally many columns, such as two bores or two diameters",
                )
        least = float(np.linalg.eigvalsh(self.source_matrix(sources)).min(initial=1.0))
        if least < -_ROUNDING:
            raise InputError.at(
                self.origin,
                "least eigenvalue of the correlation matrix",
                f"{least:.3g}",
                "0 or more; the correlations contradict each other",
            )

    def source_matrix(self, sources: Sequence[Source]) -> Float[np.ndarray, "source source"]:
        """Return the correlation matrix of the varying sources [-]."""
        names = [source.name for source in sources if source.zone > 0.0]
        matrix = np.eye(len(names))
        for pair in self.among(sources):
            one, other = names.index(pair.one), names.index(pair.other)
            matrix[one, other] = matrix[other, one] = pair.correlation
        return matrix

    def blocks(self, sources: Sequence[Source]) -> tuple[tuple[str, ...], ...]:
        """Return the varying sources in sets that are independent of each other, in the order of the sources."""
        names = [source.name for source in sources if source.zone > 0.0]
        labels = connected_components(self.source_matrix(sources) != 0.0, directed=False)[1]
        members: dict[int, list[str]] = {}
        for name, label in zip(names, labels, strict=True):
            members.setdefault(int(label), []).append(name)
        return tuple(tuple(block) for block in members.values())
