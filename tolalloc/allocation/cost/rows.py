"""Rows of the tables of this room: text in, checked records out, each with its place in the file."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import Record, validated
from tolalloc.uncertainty.table_file import read_text_table, split_header
from tolalloc.uncertainty.tolerance_cells import typed_cells

Row = TypeVar("Row", bound=Record)


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
    headers = tuple(split_header(header)[0] for header in table.headers)
    for header in headers:
        if header not in kind.model_fields:
            raise UnknownNameError.among(path, "column", header, kind.model_fields)
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
