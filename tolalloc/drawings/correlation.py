"""What varies together: correlated sources of a table or file, and jointly normal columns that stand on no drawing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, zip_longest
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import ndtri
from tolalloc.drawings.sources import Source, known_as, meant
from tolalloc.drawings.table_file import DATA, number_at, read_table_file
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import shipped_or_path

_ALLOWED = "a number from -1 to 1 with a decimal point"
_ROUNDING = 1e-10
"""Eigenvalue of a correlation matrix above whose negative it counts as zero [-]."""
LIST_HEADERS = ("sources", "correlation", "note")
Row = tuple[str, list[str]]
"""Where a row stands, for messages, and its cells."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two correlated sources of a tolerance table, made on one spindle, in one fixture, or from one lot."""

    # Names of the sources; like columns of both go together, x with x and cos1 with cos1
    one: str
    other: str
    # Of the standard normal numbers behind the columns; for normal sources that of the columns themselves, for others
    # near it [-]
    correlation: float
    place: str = field(default="correlations", repr=False)  # Where it stands, for messages

    @property
    def called(self) -> str:
        """What messages call it."""
        return f"{self.place}, {self.one} with {self.other}"


def _varying(sources: Sequence[Source]) -> list[str]:
    """Return the names of the sources with a zone."""
    return [source.name for source in sources if source.zone > 0.0]


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """All correlations of an error model, as a Gaussian copula: every source keeps its own distribution."""

    pairs: tuple[Pair, ...] = ()  # Correlated pairs; all other pairs are independent
    origin: str = field(default="correlations", repr=False)  # Where all of them stand, for messages

    def among(self, sources: Sequence[Source]) -> tuple[Pair, ...]:
        """Return the pairs whose sources both vary and whose correlation is not zero."""
        varying = {*_varying(sources)}
        return tuple(pair for pair in self.pairs if pair.correlation and {pair.one, pair.other} <= varying)

    def require_sound(self, sources: Sequence[Source]) -> None:
        """Raise unless the pairs name sources with like columns and all correlations can hold together.

        Raises
        ------
        InputError, UnknownNameError
            The pair that is not allowed.
        """
        known = {source.name: source for source in sources}
        seen: dict[frozenset[str], Pair] = {}
        for pair in self.pairs:
            _require_allowed(pair, known)
            first = seen.setdefault(frozenset((pair.one, pair.other)), pair)
            if abs(first.correlation - pair.correlation) > _ROUNDING:
                allowed = f"one value for both orders of a pair, and {first.place} says {first.correlation:g}"
                raise InputError.at(pair.called, "correlation", pair.correlation, allowed)
        self._require_no_contradiction(sources)

    def _require_no_contradiction(self, sources: Sequence[Source]) -> None:
        """Raise if no random numbers can have these correlations."""
        matrix = self.source_matrix(sources)
        values, vectors = np.linalg.eigh(matrix)
        if values.size and values[0] < -_ROUNDING:
            # The eigenvalue is the sum of these parts; the most negative one is the pair that asks for too much.
            parts = np.triu(matrix * np.outer(vectors[:, 0], vectors[:, 0]), 1)
            one, other = (int(at) for at in np.unravel_index(parts.argmin(), parts.shape))
            names, what = _varying(sources), "least eigenvalue of the correlation matrix"
            allowed = (
                f"0 or more; the correlations contradict each other, above all {matrix[one, other]:g} of "
                f"{names[one]} with {names[other]}"
            )
            raise InputError.at(self.origin, what, float(f"{values[0]:.3g}"), allowed)

    def source_matrix(self, sources: Sequence[Source]) -> Float[np.ndarray, "source source"]:
        """Return the correlation matrix of the varying sources [-]."""
        names = _varying(sources)
        matrix = np.eye(len(names))
        for pair in self.among(sources):
            one, other = names.index(pair.one), names.index(pair.other)
            matrix[one, other] = matrix[other, one] = pair.correlation
        return matrix

    def blocks(self, sources: Sequence[Source], tied: Sequence[tuple[str, str]] = ()) -> tuple[tuple[str, ...], ...]:
        """Return the varying sources in sets that are independent of each other, in the order of the sources.

        Pairs that depend on each other otherwise than by a correlation may be given as tied.
        """
        members = {name: {name} for name in _varying(sources)}
        for one, other in (*((pair.one, pair.other) for pair in self.among(sources)), *tied):
            joined = members[one] | members[other]
            members |= dict.fromkeys(joined, joined)
        ordered = (tuple(name for name in members if name in block) for block in members.values())
        return tuple(dict.fromkeys(ordered))

    def mappings(self, sources: Sequence[Source]) -> tuple[str, ...]:
        """Return a sentence for every set of sources that depend on each other: which they are, and how strongly."""
        matrix, names, sentences = self.source_matrix(sources), _varying(sources), list[str]()
        for block in (block for block in self.blocks(sources) if len(block) > 1):
            pairs: dict[float, list[str]] = {}
            for one, other in combinations(block, 2):
                correlation = float(matrix[names.index(one), names.index(other)])
                pairs.setdefault(correlation, []).append(f"{one} with {other}")
            if len(pairs) == 1:
                sentences.append(f"{', '.join(block)}: correlation {next(iter(pairs)):g} of each with each")
            else:
                parts = [f"{value:g} ({', '.join(own)})" for value, own in pairs.items() if value]
                sentences.append(f"{', '.join(block)}: correlation {', '.join(parts)}")
        return tuple(sentences)


def _require_allowed(pair: Pair, known: Mapping[str, Source]) -> None:
    """Raise unless a pair names two sources with like columns, and a correlation."""
    for name in (pair.one, pair.other):
        if name not in known:
            raise UnknownNameError.among(pair.place, "source", name, known)
    if not -1 <= pair.correlation <= 1:
        raise InputError.at(pair.called, "correlation", pair.correlation, "-1 to 1")
    if pair.one == pair.other:
        raise InputError.at(pair.called, "pair", pair.one, "two different sources")
    columns = zip_longest(known[pair.one].columns, known[pair.other].columns, fillvalue="nothing")
    for one, other in columns:
        if one.removeprefix(pair.one) != other.removeprefix(pair.other):
            allowed = "like columns of both sources, as two diameters, two bores or two pitches of the same orders have"
            raise InputError.at(pair.called, "columns", f"{one} with {other}", allowed)


def symmetric_root(matrix: Float[np.ndarray, "row row"]) -> Float[np.ndarray, "row row"]:
    """Return the symmetric root of a covariance; Cholesky's does not exist where something is fully correlated."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


@dataclass(frozen=True, kw_only=True, eq=False)
class CorrelatedSource:
    """Columns that no drawing limits, common to all units: jointly normal, independent of every other source."""

    # What a report calls it, and the columns that it moves
    name: str
    columns: tuple[str, ...]
    covariance: Float[np.ndarray, "column column"]  # Covariance of the columns, singular or zero if need be [column²]

    @cached_property
    def factor(self) -> Float[np.ndarray, "column column"]:
        """The symmetric root of the covariance."""
        return symmetric_root(self.covariance)

    def standard_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return correlated columns for independent uniform numbers in (0, 1)."""
        return np.asarray(ndtri(uniform) @ self.factor.T)

    @property
    def mapping(self) -> str:
        """Sentence that says which distribution it has."""
        deviation = np.sqrt(np.diag(self.covariance))
        spread = ", ".join(f"{value:.2g} ({name})" for name, value in zip(self.columns, deviation, strict=True))
        return f"jointly normal, σ = {spread}; the same for all units of a reducer"


def load_correlations(path: Path | str, sources: Sequence[Source]) -> Correlation:
    """Return the correlations between sources from a CSV (UTF-8) or XLSX file, or a shipped one by its name.

    Parameters
    ----------
    path
        A list with the columns ``sources``, ``correlation`` and, if wanted, ``note``, or a square matrix. In the list
        every row is a group: two or more names or patterns such as ``disc1.bore*.position``, separated by blanks or
        semicolons, each two of which have this correlation. The matrix has the names in its header and in its first
        column, in the same order.
    sources
        The rows of the tolerance table.

    Raises
    ------
    InputError, UnknownNameError
        The file, row and value that are not allowed.
    """
    file = shipped_or_path(path, DATA, ".correlations.csv", "correlation")
    rows = [(f"{file}, row {number}", [*cells]) for number, cells in read_table_file(file)]
    if len(rows) < 2:
        raise InputError(f"{file}: the table has no rows below its header; a list or a matrix is needed.")
    is_list = bool(set(LIST_HEADERS[1:]) & set(rows[0][1]))
    pairs = _pairs_of_list(rows, sources) if is_list else _pairs_of_matrix(rows, sources)
    correlation = Correlation(pairs=pairs, origin=str(path))
    correlation.require_sound(sources)
    return correlation


def _pairs_of_list(rows: Sequence[Row], sources: Sequence[Source]) -> tuple[Pair, ...]:
    """Return the pairs of all groups."""
    place, header = rows[0]
    for cell in header:
        if cell not in LIST_HEADERS:
            raise UnknownNameError.among(place, "column", cell, LIST_HEADERS)
    for needed in LIST_HEADERS[:2]:
        if header.count(needed) != 1:
            raise InputError.at(place, f"number of columns {needed!r}", header.count(needed), "1")
    pairs = []
    for place, cells in rows[1:]:
        row = dict(zip(header, cells, strict=True))
        where = f"{place} ({row['sources'] or 'no sources'})"
        value = number_at(where, "correlation", row["correlation"], _ALLOWED)
        group = combinations(_group(row["sources"], sources, place), 2)
        pairs += [Pair(one=one, other=other, correlation=value, place=place) for one, other in group]
    return tuple(pairs)


def _group(text: str, sources: Sequence[Source], place: str) -> list[str]:
    """Return the sources that the patterns of a cell name, in the order of the tolerance table."""
    patterns = text.replace(";", " ").split()
    for pattern in patterns:
        if not meant(pattern, sources):
            raise UnknownNameError.among(place, "source", pattern, known_as(sources))
    named = {name for pattern in patterns for name in meant(pattern, sources)}
    group = [source.name for source in sources if source.name in named]
    if len(group) < 2:
        raise InputError.at(place, "sources", text, "two or more different sources")
    return group


def _pairs_of_matrix(rows: Sequence[Row], sources: Sequence[Source]) -> tuple[Pair, ...]:
    """Return the pairs of a matrix, each in both orders, so that one that is not symmetric is found."""
    place, (_, *header) = rows[0]
    names = known_as(sources)
    for name in header:
        if name not in names:
            raise UnknownNameError.among(place, "column", name, (*names, *LIST_HEADERS))
    if len(set(header)) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise InputError.at(place, "column", twice, "each source once")
    below = [cells[0] for _, cells in rows[1:]]
    if below != header:
        raise InputError(
            f"{rows[-1][0]}: the matrix is not square with the same names down and across; down are "
            f"{', '.join(below)}, across are {', '.join(header)}."
        )
    own = {source.own_id: source.name for source in sources if source.own_id}
    pairs = {
        (one, other): Pair(
            one=own.get(one, one),
            other=own.get(other, other),
            correlation=number_at(f"{place} ({one} with {other})", "correlation", cell, _ALLOWED),
            place=place,
        )
        for place, (one, *cells) in rows[1:]
        for other, cell in zip(header, cells, strict=True)
    }
    for name in header:
        if (diagonal := pairs.pop((name, name))).correlation != 1.0:
            raise InputError.at(f"{diagonal.place} ({name})", "value on the diagonal", diagonal.correlation, "1")
    return tuple(pairs.values())
