"""A user's own table with the zones of another drawing: the same columns, rows and words, changed cells marked."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import StringIO
from math import isclose
from pathlib import Path
from types import MappingProxyType

from tolalloc.drawings.fields import cell_of
from tolalloc.drawings.heads import Heads, split_header
from tolalloc.drawings.sources import Source, by_row
from tolalloc.drawings.table_file import is_workbook, sheet_texts, write_changed
from tolalloc.drawings.tolerance_table import heads_of
from tolalloc.reading.file_content import read_text

_CHANGED = ("plus", "minus", "cost", "process")
"""Columns of which a drawing may change the cells."""
_SAME = 1e-9
"""Relative difference up to which a number stays."""
_NUMBER = re.compile(r"[+-]?\d*[.,]?\d+(?:[eE][+-]?\d+)?")
_FILL = "FFFF99"
"""Colour of a changed cell, a light yellow."""

Cells = Sequence[Sequence[str]]
Changes = Mapping[tuple[int, int], str]
"""Row and column of a cell, from 0 → what stands there now."""


@dataclass(frozen=True, kw_only=True)
class TableFile:
    """Where a user's table stands and how its heads are read."""

    path: Path
    sheet: str = ""  # Of a workbook, the first unless named
    columns: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))  # Head → column that it is

    @property
    def is_own(self) -> bool:
        """Whether it is laid out otherwise than a written tolerance table, so that it is worth returning."""
        if is_workbook(self.path) or heads_of(self.path, self.columns).called:
            return True
        return _separator(read_text(self.path, "a table in CSV")) != ","

    def written(self, sources: Sequence[Source], folder: Path) -> Path:
        """Write the table with the zones, costs and processes of sources into a folder, and return its path.

        Of a workbook changed cells are yellow; pictures and charts of it are lost. Numbers that were written with a
        decimal comma, or behind ±, are again.
        """
        heads, path = heads_of(self.path, self.columns), folder / f"{self.path.stem}_allocated{self.path.suffix}"
        if is_workbook(self.path):
            texts = sheet_texts(self.path, self.sheet, heads)
            write_changed(self.path, self.sheet, _changes(texts, heads, sources), _FILL, path)
        else:
            text = read_text(self.path, "a table in CSV")
            rows = [*csv.reader(StringIO(text), delimiter=_separator(text))]
            for (row, column), own in _changes(rows, heads, sources).items():
                rows[row][column] = own
            out = StringIO(newline="")
            csv.writer(out, delimiter=_separator(text), lineterminator="\n").writerows(rows)
            path.write_text(out.getvalue(), encoding="utf-8-sig", newline="")
        return path


def _separator(text: str) -> str:
    """Return what separates the cells of a CSV file, as its reader sees it."""
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    return next((mark for mark in ";\t|" if mark in first), ",")


def _changes(rows: Cells, heads: Heads, sources: Sequence[Source]) -> Changes:
    """Return what stands in the cells that the sources change."""
    first = heads.row_in(rows)
    names = [split_header(heads.meant(cell))[0] for cell in rows[first]]
    known = {key: row for row, members in by_row(sources) for key in (row.own_id, *_names(row, members)) if key}
    found = dict[tuple[int, int], str]()
    for at, cells in enumerate(rows[first + 1 :], start=first + 1):
        texts = dict(zip(names, cells, strict=False))
        if own := known.get(texts.get("id", "").strip()) or known.get(texts.get("source", "").strip()):
            found |= {(at, names.index(name)): text for name, text in _changed(texts, own)}
    return found


def _names(row: Source, members: Sequence[Source]) -> tuple[str, ...]:
    """Return what a table may call the row of sources."""
    return (row.name, *(own.name for own in members))


def _changed(texts: Mapping[str, str], source: Source) -> Iterator[tuple[str, str]]:
    """Yield the columns of a row whose cells change, with the new text in the manner of the old one."""
    for name in _CHANGED:
        old, new = texts.get(name, "").strip(), cell_of(source, name)
        if isinstance(new, str) and name in texts and new not in ("", old):
            yield name, new
        if not isinstance(new, int | float) or name not in texts:
            continue
        number = _NUMBER.search(old)
        if number and isclose(float(number[0].replace(",", ".")), float(new), rel_tol=_SAME, abs_tol=1e-12):
            continue
        if not number and not new:
            continue
        yield name, _in_manner_of(old, float(new))


def _in_manner_of(old: str, value: float) -> str:
    """Return a number as another one is written: with its decimal sign, and behind what stands before it."""
    text = f"{value:.7g}"
    text = text.replace(".", ",") if "," in old else text
    number = _NUMBER.search(old)
    return f"{old[: number.start()]}{text}{old[number.end() :]}" if number and "±" in old else text
