"""Users' tables: text in, checked records out, each with its place in the file; or one sentence on what is wrong."""

from __future__ import annotations

import csv
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Literal, TypeVar, get_args, get_origin

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import Record, validated

DATA = Path(__file__).parent / "data"
"""Shipped tables."""

NumberedRow = tuple[int, tuple[str, ...]]
"""Row as an editor counts it, from 1, and its cells."""


def read_table_file(path: Path) -> tuple[NumberedRow, ...]:
    """Return the cells of a CSV (UTF-8) or XLSX file as text, the header first, blank rows left out.

    Every row is filled up to the length of the first.

    Raises
    ------
    InputError
        The file is missing, or no complete table; a row that is longer than the first is an error.
    """
    try:
        rows = _sheet(path) if path.suffix.lower() in (".xlsx", ".xlsm") else _records(path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (OSError, zipfile.BadZipFile, KeyError, ValueError, csv.Error) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"{path}: not a complete table in CSV (UTF-8) or XLSX; is the file truncated? ({reason})."
        ) from None
    kept = [(number, cells) for number, cells in enumerate(rows, start=1) if any(cells)]
    if not kept:
        raise InputError(f"{path}: the table is empty, or the file truncated; a header and rows are needed.")
    width = len(kept[0][1])
    for number, cells in kept:
        if any(cells[width:]):
            raise InputError(
                f"{path}: not a complete table in CSV (UTF-8) or XLSX; is the file truncated? (row {number} has "
                f"{len(cells)} cells under {width} headers)."
            )
    return tuple((number, (*cells, *[""] * width)[:width]) for number, cells in kept)


def _records(path: Path) -> list[tuple[str, ...]]:
    """Return the records of a CSV file."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        return [tuple(cell.strip() for cell in row) for row in csv.reader(file, strict=True)]


def _sheet(path: Path) -> list[tuple[str, ...]]:
    """Return the first sheet of a workbook, whole numbers without decimals."""
    from openpyxl import load_workbook

    book = load_workbook(path, read_only=True, data_only=True)
    try:
        sheet = book.worksheets[0]
        sheet.reset_dimensions()  # what a program noted there need not be true
        rows = list(sheet.iter_rows(values_only=True))
    finally:
        book.close()
    whole = ((int(cell) if isinstance(cell, float) and cell.is_integer() else cell for cell in row) for row in rows)
    return [tuple("" if cell is None else str(cell).strip() for cell in row) for row in whole]


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """Cells of a CSV file as text."""

    # Where it was read, and the first line that is not a comment
    path: Path
    headers: tuple[str, ...]
    # Line of each row as counted in the file [-], and its cells, as many as there are headers
    rows: tuple[int, ...]
    cells: tuple[tuple[str, ...], ...]


def read_text_table(path: Path) -> TextTable:
    """Return the cells of a CSV file, separated by commas or semicolons; lines that start with # are comments.

    Raises
    ------
    InputError
        The file is missing, not text, without a row, or a row has too few or too many cells.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a table in CSV (UTF-8) ({error}).") from None
    numbered = [(row, line) for row, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if len(numbered) < 2:
        raise InputError(f"{path}: the table has no rows; a line of headers and one row or more are needed.")
    separator = ";" if ";" in numbered[0][1] else ","
    first, *others = [(row, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))])
                      for row, line in numbered]  # fmt: skip
    width = len(first[1])
    for row, cells in others:
        if len(cells) < width:
            raise InputError(
                f"{path}, row {row}: {len(cells)} of {width} cells are there; the columns must be of equal length, "
                "and a cell without a number is left empty between its separators."
            )
        if any(cells[width:]):  # nothing behind a closing separator is how some programs end their rows
            raise InputError(
                f"{path}, row {row}: {len(cells)} cells stand under {width} headers; numbers have a decimal point, and "
                f"cells are separated by {separator!r}."
            )
    return TextTable(
        path=path,
        headers=tuple(first[1]),
        rows=tuple(row for row, _ in others),
        cells=tuple(tuple(cells[:width]) for _, cells in others),
    )


def split_header(header: str) -> tuple[str, str]:
    """Return name and unit of a header such as ``disc1.tilt.x [µrad]``; the unit is empty where none is stated."""
    match = re.fullmatch(r"(.*?)\s*\[(.*)\]", header)
    if match is None:
        return header, ""
    # Both characters for µ and both dots are typed, and look alike.
    return match[1], match[2].strip().replace("\u03bc", "µ").replace("\u22c5", "·")


Row = TypeVar("Row", bound=Record)


def read_rows(
    path: Path, kind: type[Row], named_by: str, units: Mapping[str, str] = MappingProxyType({})
) -> tuple[tuple[str, Row], ...]:
    """Return the rows of a CSV file, each behind the place that messages name: file, row, and the field `named_by`.

    The headers are the fields of the record, with or without a unit in brackets. Numbers are never converted, so a
    field for which a unit is given may state no other.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    table = read_text_table(path)
    stated = [split_header(header) for header in table.headers]
    headers = tuple(name for name, _ in stated)
    require_columns(path, headers, kind)
    for name, unit in stated:
        known = units.get(name, unit)
        if unit and unit != known:
            raise InputError.at(path, f"the unit of column {name}", unit, f"{known}; numbers are not converted")
    rows = []
    for number, texts in zip(table.rows, table.cells, strict=True):
        cells = dict(zip(headers, texts, strict=True))
        place = f"{path}, row {number} ({cells[named_by] or f'no {named_by}'})"
        rows.append((place, validated(kind, typed_cells(kind, cells, place), place)))
    return tuple(rows)


def require_columns(path: Path | str, headers: tuple[str, ...], kind: type[Record]) -> None:
    """Raise unless a record knows each column, each is there once, and none that it needs is missing.

    Raises
    ------
    InputError, UnknownNameError
        The column.
    """
    for name in headers:
        if name not in kind.model_fields:
            raise UnknownNameError.among(path, "column", name, kind.model_fields)
        if headers.count(name) > 1:
            raise InputError(f"{path}: the column {name!r} is there twice; each has one.")
    required = [name for name, field in kind.model_fields.items() if field.is_required()]
    for name in required:
        if name not in headers:
            raise InputError(f"{path}: the column {name!r} is missing; needed are {', '.join(required)}.")


def typed_cells(kind: type[Record], row: Mapping[str, object], place: str) -> dict[str, object]:
    """Return the cells of a row that are not empty, text as the type that its field asks for.

    Raises
    ------
    InputError
        The field and value that are not allowed.
    """
    stated = {name: cell.strip() if isinstance(cell, str) else cell for name, cell in row.items()}
    return {
        name: _typed(kind.model_fields[name].annotation, name, cell, place) if isinstance(cell, str) else cell
        for name, cell in stated.items()
        if cell not in ("", None)
    }


def _typed(annotation: object, header: str, value: str, place: str) -> object:
    """Return the text of a cell as the type of its field."""
    if annotation is int:
        if not value.isdecimal():
            raise InputError.at(place, header, value, "a whole number, 1 or more")
        return int(value)
    if annotation is bool:
        answers = {"yes": True, "no": False, "true": True, "false": False}
        if value.lower() not in answers:
            raise InputError.at(place, header, value, "yes or no")
        return answers[value.lower()]
    if annotation is float or float in get_args(annotation):
        try:
            return float(value)
        except ValueError:
            raise InputError.at(place, header, value, "a number with a decimal point") from None
    words: tuple[str, ...] = get_args(annotation) if get_origin(annotation) is Literal else ()
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        words = tuple(annotation)
    if words:
        if value not in words:
            more = "; a truncated one is written as its distribution with sorted = yes" if value == "truncated" else ""
            raise InputError.at(place, header, value, "one of " + ", ".join(words) + more)
        return words[words.index(value)]
    return value
