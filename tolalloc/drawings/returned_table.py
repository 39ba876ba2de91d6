"""A user's own table with the zones of another drawing: the same columns, rows and words, changed cells marked."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from types import MappingProxyType

from tolalloc.drawings.fields import cell_of
from tolalloc.drawings.heads import Heads, split_header
from tolalloc.drawings.sources import Source, by_row
from tolalloc.drawings.table_file import csv_lines, is_workbook, sheet_texts, write_changed
from tolalloc.drawings.tolerance_table import heads_file, heads_of, heads_text
from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import read_text

_CHANGED = ("plus", "minus", "cost", "process", "grade")
"""Columns of which a drawing may change the cells."""
_NUMBER = re.compile(r"[+-]?\d*[.,]?\d+(?:[eE][+-]?\d+)?")
_COMMA = re.compile(r"\d,\d")
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
        heads = heads_of(self.path, self.columns)
        if is_workbook(self.path) or heads.called:
            return True
        return csv_lines(read_text(self.path, "a table in CSV"), heads)[1] != ","

    @property
    def returned_name(self) -> str:
        """Name of the file in which it comes back."""
        return f"{self.path.stem}_allocated{self.path.suffix}"

    def written(self, before: Sequence[Source], drawn: Sequence[Source], folder: Path) -> Path:
        """Write the table with what is drawn in place of what it has into a folder, and return its path.

        Of a workbook changed cells are yellow; pictures and charts of it are lost. Numbers stand with the decimal sign
        of the table, and behind ± where they stood so. Heads of an office's stand in a TOML file beside it again.

        Raises
        ------
        InputError
            A deviation that the table's columns cannot say, such as that of a fit in a table without lower deviations.
        """
        heads, path = heads_of(self.path, self.columns), folder / self.returned_name
        if is_workbook(self.path):
            texts = sheet_texts(self.path, self.sheet, heads)
            write_changed(self.path, self.sheet, _changes(texts, heads, before, drawn), _FILL, path)
        else:
            text = read_text(self.path, "a table in CSV")
            path.write_text(_returned(text, heads, before, drawn), encoding="utf-8-sig", newline="")
        if heads.called:
            heads_file(path).write_text(heads_text(heads.called), encoding="utf-8")
        return path


def _returned(text: str, heads: Heads, before: Sequence[Source], drawn: Sequence[Source]) -> str:
    """Return the text of a CSV file with other cells; lines in which nothing changes stay as they are."""
    lines, separator = csv_lines(text, heads)
    reader = csv.reader(lines, delimiter=separator)
    rows, ends = [], []
    for row in reader:
        rows.append(row)
        ends.append(reader.line_num)
    changes, raw = _changes(rows, heads, before, drawn), text.splitlines(keepends=True)
    written = list[str]()
    for at, (row, start, end) in enumerate(zip(rows, [0, *ends], ends, strict=False)):
        own = {column: cell for (line, column), cell in changes.items() if line == at}
        if not own:
            written += raw[start:end]
            continue
        out = StringIO(newline="")
        cells = [own.get(column, cell) for column, cell in enumerate(row)]
        csv.writer(out, delimiter=separator, lineterminator="\n").writerow(cells)
        written.append(out.getvalue())
    return "".join([*written, *raw[ends[-1] if ends else 0 :]])


def _changes(rows: Cells, heads: Heads, before: Sequence[Source], drawn: Sequence[Source]) -> Changes:
    """Return what stands in the cells that are drawn otherwise."""
    first = heads.row_in(rows)
    names = [split_header(heads.meant(cell))[0] for cell in rows[first]]
    was, known = _by_name(before), _by_name(drawn)
    told = [[cell.strip() for cell in row] for row in rows[first + 1 :]]
    numbers = [at for at, cell in enumerate(rows[first]) if heads.kind(cell) == "number"]
    comma = any(_COMMA.search(row[at]) for row in told for at in numbers if at < len(row))
    found = dict[tuple[int, int], str]()
    for at, cells in enumerate(told, start=first + 1):
        texts = dict(zip(names, cells, strict=False))
        name = next((own for own in (texts.get("id", ""), texts.get("source", "")) if own in known), "")
        if name:
            changed = _changed(texts, was.get(name, known[name]), known[name])
            found |= {(at, names.index(head)): text.replace(".", ",") if comma else text for head, text in changed}
    return found


def _by_name(sources: Sequence[Source]) -> dict[str, Source]:
    """Return what a table may call the rows of sources → what it writes there."""
    return {
        name: row
        for row, members in by_row(sources)
        for name in (row.own_id, row.name, *(own.name for own in members))
        if name
    }


def _changed(texts: Mapping[str, str], before: Source, drawn: Source) -> Iterator[tuple[str, str]]:
    """Yield the columns of a row whose cells change, with the new text, numbers with a decimal point."""
    values = {name: cell_of(drawn, name) for name in _CHANGED if cell_of(before, name) != cell_of(drawn, name)}
    if not texts.get("minus") and {"plus", "minus"} & {*values}:
        plus, minus = cell_of(drawn, "plus"), cell_of(drawn, "minus")
        assert isinstance(plus, int | float)
        assert isinstance(minus, int | float)
        old = texts.get("plus", "")
        if abs(plus + minus) <= 1e-9 * abs(plus):
            number = _NUMBER.search(old) if "±" in old else None
            values = {name: value for name, value in values.items() if name not in ("plus", "minus")}
            yield "plus", f"{old[: number.start()]}{plus:.7g}" if number else f"± {plus:.7g}"
        elif "minus" in texts:  # an empty cell beside a fit
            values |= {"plus": plus, "minus": minus}
        else:
            both = f"{plus:+.7g}/{minus:+.7g}"
            raise InputError.at(f"returned table ({before.own_id or before.name})", "plus", both, "± one number alone")
    for name, value in values.items():
        if name in texts and value is not None:
            yield name, value if isinstance(value, str) else f"{value:.7g}"
