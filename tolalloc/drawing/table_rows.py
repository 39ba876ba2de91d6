"""Rows of users' tables: text in, checked records out, each with its place in the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, TypeVar

from tolalloc.drawing.table_file import read_text_table, split_header
from tolalloc.drawing.tolerance_cells import typed_cells
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import Record, validated


class TableRow(Record):
    """Base of the rows; the fields are the column headers without their unit."""

    units: ClassVar[Mapping[str, str]] = {}
    """Field → unit that its header may state; numbers are never converted, so every other unit is refused."""


Row = TypeVar("Row", bound=TableRow)


def read_rows(path: Path, kind: type[Row], named_by: str) -> tuple[tuple[str, Row], ...]:
    """Return the rows of a CSV file, each behind the place that messages name.

    Parameters
    ----------
    path
        The file; the headers are the fields of the record, with or without a unit in brackets.
    kind
        Record of a row.
    named_by
        Field that names a row for a reader.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    table = read_text_table(path)
    stated = [split_header(header) for header in table.headers]
    headers = tuple(name for name, _ in stated)
    for name, unit in stated:
        if name not in kind.model_fields:
            raise UnknownNameError.among(path, "column", name, kind.model_fields)
        if headers.count(name) > 1:
            raise InputError(f"{path}: the column {name!r} is there twice; each has one.")
        known = kind.units.get(name, unit)
        if unit and unit != known:
            raise InputError.at(path, f"the unit of column {name}", unit, f"{known}; numbers are not converted")
    required = [name for name, field in kind.model_fields.items() if field.is_required()]
    for name in required:
        if name not in headers:
            raise InputError(f"{path}: the column {name!r} is missing; needed are {', '.join(required)}.")
    rows = []
    for number, texts in zip(table.rows, table.cells, strict=True):
        cells = dict(zip(headers, texts, strict=True))
        place = f"{path}, row {number} ({cells[named_by] or f'no {named_by}'})"
        rows.append((place, validated(kind, typed_cells(kind, cells, place), place)))
    return tuple(rows)
