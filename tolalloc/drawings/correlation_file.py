"""Correlations from the user's CSV or XLSX file: a list of groups, or a square matrix."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from itertools import combinations, permutations
from pathlib import Path

from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.sources import Source
from tolalloc.drawings.table_file import read_table_file
from tolalloc.exceptions import InputError, UnknownNameError

LIST_HEADERS = ("sources", "correlation", "note")

Row = tuple[str, list[str]]
"""Where a row stands, for messages, and its cells."""


def load_correlations(path: Path | str, sources: Sequence[Source]) -> Correlation:
    """Return the correlations between sources from a CSV (UTF-8) or XLSX file.

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
    rows = _read(Path(path))
    names = tuple(source.name for source in sources)
    is_list = bool(set(LIST_HEADERS[1:]) & set(rows[0][1]))
    pairs = _pairs_of_list(rows, names) if is_list else _pairs_of_matrix(rows, names)
    correlation = Correlation(pairs=pairs, origin=str(path))
    correlation.require_sound(sources)
    return correlation


def _read(path: Path) -> list[Row]:
    """Return the rows with their places, the header first."""
    rows = read_table_file(path)
    if len(rows) < 2:
        raise InputError(f"{path}: the table has no rows below its header; a list or a matrix is needed.")
    return [(f"{path}, row {number}", list(cells)) for number, cells in rows]


def _pairs_of_list(rows: Sequence[Row], names: Sequence[str]) -> tuple[Pair, ...]:
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
        correlation = _number(row["correlation"], f"{place} ({row['sources'] or 'no sources'})")
        pairs += [
            Pair(one=one, other=other, correlation=correlation, place=place)
            for one, other in combinations(_group(row["sources"], names, place), 2)
        ]
    return tuple(pairs)


def _group(text: str, names: Sequence[str], place: str) -> list[str]:
    """Return the sources that the patterns of a cell name, in the order of the tolerance table."""
    patterns = text.replace(";", " ").split()
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise UnknownNameError.among(place, "source", pattern, names)
    group = [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
    if len(group) < 2:
        raise InputError.at(place, "sources", text, "two or more different sources")
    return group


def _pairs_of_matrix(rows: Sequence[Row], names: Sequence[str]) -> tuple[Pair, ...]:
    """Return the pairs of a matrix, each in both orders, so that one that is not symmetric is found."""
    place, (_, *header) = rows[0]
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
    values = {
        (one, other): (_number(cell, f"{place} ({one} with {other})"), place)
        for place, (one, *cells) in rows[1:]
        for other, cell in zip(header, cells, strict=True)
    }
    for name in header:
        value, place = values[name, name]
        if value != 1.0:
            raise InputError.at(f"{place} ({name})", "value on the diagonal", value, "1")
    return tuple(
        Pair(one=one, other=other, correlation=values[one, other][0], place=values[one, other][1])
        for one, other in permutations(header, 2)
    )


def _number(text: str, place: str) -> float:
    """Return a cell as a number."""
    try:
        return float(text)
    except ValueError:
        raise InputError.at(place, "correlation", text, "a number from -1 to 1 with a decimal point") from None
