"""A table file as the user wrote it, CSV or a workbook: its rows with their numbers, and numbers as people write them.

Of a workbook, what a reader of values would silently miss is refused.
"""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import date, time, timedelta
from enum import StrEnum
from io import BytesIO, StringIO
from math import nan
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin
from unicodedata import normalize
from zipfile import ZipFile

from tolalloc.drawings.heads import MOST_TITLES, Heads, office_words, split_header
from tolalloc.exceptions import Faults, InputError, TolallocError, UnknownNameError
from tolalloc.reading.file_content import read_bytes, read_text, require_believable, require_table
from tolalloc.reading.files import Record, validated
from tolalloc.reading.units import (
    COST_UNITS,
    WITH_UNIT,
    currency_in,
    in_cost_units,
    is_unit,
    shown_number,
    usual_signs,
)

_LARGEST_CONTENT = 16 * 2**20
"""Largest content of a workbook when unpacked, all parts together [B]."""
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}([.,]\d{3})+")
"""Text that is a thousand times as large where its sign separates thousands."""
_TRUE_MINUS = re.compile(r"\u2212\s*[\d.,]+(?:[eE][+-]?\d+)?")
"""Number behind a true minus, as word processors write it."""
_MOST_CELLS = 100_000
"""Most cells of the rectangle from the first cell to the last one [-]."""


_BLANKS, _UNSEEN = re.compile(r"[\u00a0\u2007\u2009\u202f]"), re.compile(r"[\u200b-\u200d\u2060\ufeff\u00ad]")
"""Blanks of other widths, and signs that nobody sees."""
DATA = Path(__file__).parent / "data"
NumberedRow = tuple[int, tuple[str, ...]]
"""Row as an editor counts it, from 1, and its cells."""
_DECIMAL = re.compile(r"[+-]?\d*[.,]\d+([eE][+-]?\d+)?", re.ASCII)
"""Number with one decimal sign, whichever."""
_APOSTROPHE = re.compile(r"^'(?=[=+\-@])")
"""What `tolalloc.reading.files.no_formula` writes before a text."""
_ANY = Heads()
_SETTING = re.compile(r"#\s*setting:\s*(.+?)\s*=\s*(\S+?)\s*[;,\t]*")
Row = TypeVar("Row", bound=Record)


class DateText(str):
    """Date or time of a workbook, into which a spreadsheet turns numbers: kept in a note, refused elsewhere."""


class AmbiguousText(str):
    """Text that is another number where its sign separates thousands: no matter in a note, refused as a number."""


def is_workbook(path: Path) -> bool:
    """Return whether a table is a workbook, by its ending."""
    return path.suffix.lower() in (".xlsx", ".xlsm")


def sheet_texts(path: Path, sheet: str, heads: Heads) -> list[tuple[str, ...]]:
    """Return the cells of the named sheet as text, of the first one unless named; whole numbers without decimals.

    Titles above the head may be merged. A number is followed by the unit that its format
    shows, and per cent are per cent.

    Raises
    ------
    InputError
        The file is missing, no workbook, or larger than is believed; or the sheet is not there or hidden, or has
        merged cells, an error, or a formula whose value was not kept.
    """
    content = read_bytes(path, "a workbook (XLSX)")
    require_table(path, content, is_workbook=True)
    try:
        _require_small(path, content)
        # Values do not say which cells were formulas, and formulas do not say their values.
        values, formulas = (_loaded(path, content, data_only, sheet) for data_only in (True, False))
        texts = _texts(path, values, formulas)
        heads.require_in(path, texts)
        _require_plain_cells(path, values, 1 + heads.row_in(texts), texts)
    except TolallocError:
        raise
    except Exception as error:  # whatever the libraries raise on a damaged file: of zlib, XML, types, indices
        if b"purl.oclc.org/ooxml" in _part(content, "xl/workbook.xml"):
            allowed = "an Excel workbook (*.xlsx): save it as that one"
            raise InputError(f"{path}: it is a Strict Open XML workbook; allowed is {allowed}.") from None
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: not a complete workbook (XLSX); is the file truncated? ({reason}).") from None
    return texts


def hidden_cells(path: Path, sheet: str = "") -> tuple[str, ...]:
    """Return a sentence each for hidden rows and hidden columns, which are read too."""
    from openpyxl.utils import get_column_letter

    loaded = _loaded(path, read_bytes(path, "a workbook (XLSX)"), data_only=True, sheet=sheet)
    rows = [str(at) for at, row in loaded.row_dimensions.items() if row.hidden]
    columns = [
        f"{at} to {get_column_letter(column.max)}" if column.max > column.min else at
        for at, column in loaded.column_dimensions.items()
        if column.hidden
    ]
    return tuple(
        f"{path.name}: {what} of the sheet are read like the others: {', '.join(found)}"
        for what, found in (("hidden rows", rows), ("hidden columns", columns))
        if found
    )


def write_changed(path: Path, sheet: str, changes: Mapping[tuple[int, int], str], colour: str, written: Path) -> None:
    """Write a workbook again with other texts or numbers in some cells, marked by a colour.

    A cell that held text holds text; pictures and charts are lost.

    Parameters
    ----------
    path, sheet
        The workbook, and its sheet, the first unless named.
    changes
        Row and column of a cell, from 0 → what stands there now.
    colour
        Red, green and blue, two hexadecimal digits each.
    written
        The new file.
    """
    from openpyxl import load_workbook
    from openpyxl.styles import PatternFill

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pictures and rules that are lost
        content = BytesIO(read_bytes(path, "a workbook (XLSX)"))
        book = load_workbook(content, keep_vba=path.suffix.lower() == ".xlsm")
    page = book[sheet] if sheet else book.worksheets[0]
    for (row, column), text in changes.items():
        cell = page.cell(row + 1, column + 1)
        cell.value = _as_before(text, cell)
        cell.fill = PatternFill("solid", fgColor=colour)
    book.save(written)


def _as_before(text: str, cell: Any) -> str | float:
    """Return a text as the value of a cell that held one, or the number that it is in the unit of its format."""
    was_text = isinstance(cell.value, str) and not cell.value.startswith("=")
    try:
        value = plain_number(text.replace(",", "."))
    except ValueError:
        return text
    return text if was_text else value / 100.0 if "%" in str(cell.number_format) else value


def _require_small(path: Path, content: bytes) -> None:
    """Raise if a workbook unpacks to more than is believed; no part gives more than the archive says of it."""
    with ZipFile(BytesIO(content)) as archive:
        size = sum(part.file_size for part in archive.infolist())
        # A cell with a value has four of these marks, two elements with their ends.
        if size <= _LARGEST_CONTENT and sum(archive.read(part).count(b"<") for part in archive.infolist()) <= (
            4 * _MOST_CELLS
        ):
            return
    raise InputError(
        f"{path}: the workbook unpacks to {size / 2**20:.3g} MB; allowed are {_LARGEST_CONTENT // 2**20} MB and "
        f"{_MOST_CELLS} cells."
    )


def _part(content: bytes, name: str) -> bytes:
    """Return a part of a workbook, nothing where there is none or it is damaged."""
    with suppress(Exception), ZipFile(BytesIO(content)) as archive:
        return archive.read(name)
    return b""


def _loaded(path: Path, content: bytes, data_only: bool, sheet: str) -> Any:
    """Return the named one of the sheets that have cells, the first unless named."""
    from openpyxl import load_workbook

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what is lost on writing it again, which nobody does
        sheets = load_workbook(BytesIO(content), data_only=data_only, keep_links=False, rich_text=data_only).worksheets
    named = {own.title: own for own in sheets}
    if sheet and sheet not in named:
        shown = [repr(title) for title, own in named.items() if own.sheet_state == "visible"]
        raise InputError.at(path, "sheet", sheet, f"one of {', '.join(shown)}")
    return named[sheet] if sheet else sheets[0]


def _texts(path: Path, values: Any, formulas: Any) -> list[tuple[str, ...]]:
    """Return the cells as text; a row whose first text begins with # is a comment, as a line of a CSV file."""
    place = f"{path}, sheet {values.title!r}"
    if values.sheet_state != "visible":
        raise InputError(f"{place}: the sheet is hidden; allowed is a table in a sheet that is shown.")
    rows, columns = values.max_row, values.max_column
    if rows * columns > _MOST_CELLS:
        raise InputError(
            f"{place}: its last cell is in row {rows}, column {columns}; allowed are {_MOST_CELLS} cells in all."
        )
    require_believable(path, 1, columns, rows * columns)
    return [
        () if _is_comment(pair[0]) else tuple(_text(path, cell, written) for cell, written in zip(*pair, strict=True))
        for pair in zip(
            values.iter_rows(max_row=rows, max_col=columns),
            formulas.iter_rows(max_row=rows, max_col=columns),
            strict=True,
        )
    ]


def _is_comment(cells: Iterable[Any]) -> bool:
    """Return whether the first text of a row begins with #, and is no error such as #N/A."""
    first = next((cell for cell in cells if cell.value is not None and str(cell.value).strip()), None)
    return first is not None and first.data_type != "e" and _plain(str(first.value)).startswith("#")


def _require_plain_cells(path: Path, values: Any, first: int, texts: Sequence[tuple[str, ...]]) -> None:
    """Raise if cells are merged from the first row of the table on, or struck out in a row that is no comment."""
    for where in values.merged_cells.ranges:
        if where.max_row >= first:
            place = f"{path}, sheet {values.title!r}"
            raise InputError(f"{place}: the cells {where} are merged; allowed is one value in each cell.")
    cells = (cell for row in values.iter_rows(min_row=first) if any(texts[row[0].row - 1]) for cell in row)
    if struck := list(dict.fromkeys(cell.row for cell in cells if cell.value is not None and cell.font.strike)):
        said = f"rows {', '.join(map(str, struck))} are" if len(struck) > 1 else f"row {struck[0]} is"
        raise InputError(f"{path}, {said} struck out; delete what does not count, or remove the strike from what does.")


def _text(path: Path, cell: Any, written: Any) -> str:
    """Return the text of a cell, or say that it has no value."""
    value = cell.value
    if cell.data_type == "e":
        raise InputError.at(f"{path}, row {cell.row}", f"cell {cell.coordinate}", value, "a value and no error")
    if value is None and written.data_type == "f":
        allowed = "a value, or a formula whose value was kept (open the workbook and save it)"
        raise InputError.at(f"{path}, row {cell.row}", f"cell {cell.coordinate}", written.value, allowed)
    if isinstance(value, str) and _GROUPED.fullmatch(value.strip()):
        return AmbiguousText(value.strip())
    if isinstance(value, date | time | timedelta):
        return DateText(str(value).removesuffix(" 00:00:00"))
    if isinstance(value, int | float) and not isinstance(value, bool):
        return shown_number(value, str(cell.number_format))
    return "" if value is None else _plain("".join(map(_marked, value)) if isinstance(value, list) else str(value))


def _marked(run: Any) -> str:
    """Return a run of letters of one font, marked where it is raised, lowered or struck out: a footnote is no digit."""
    font = getattr(run, "font", None)
    mark = ("^" if font.vertAlign else "") + ("~" if font.strike else "") if font else ""
    return f"{mark}{run}"


def _plain(cell: str) -> str:
    """Return a cell with the keyboard's blanks and accents, and its minus where a number has a true one."""
    cell = normalize("NFC", _UNSEEN.sub("", _BLANKS.sub(" ", cell))).strip()
    negative = "-" + cell[1:].lstrip()
    is_number = _TRUE_MINUS.fullmatch(cell) or (cell[:1] == "\u2212" and WITH_UNIT.fullmatch(negative))
    return negative if is_number else cell


def read_table_file(path: Path, heads: Heads = _ANY, sheet: str = "") -> tuple[NumberedRow, ...]:
    """Return the cells of a CSV or XLSX file as text, the header first, blank rows left out.

    Every row is filled up to the length of the first: Excel leaves out separators behind the last cell. A true minus
    before a number is a minus. Of a workbook the named sheet is read, the first unless named.

    Raises
    ------
    InputError
        The file is missing, no table, or without that sheet; or cells stand under no header.
    """
    if is_workbook(path):
        rows = _under_headers(path, _without_titles(sheet_texts(path, sheet, heads), heads), "each needs one")
        kinds = [heads.kind(name) for name in rows[0][1]] if rows else []
        rows = rows[:1] + [_with_points(path, number, cells, kinds) for number, cells in rows[1:]]
    elif sheet:
        raise InputError.at(path, "sheet", sheet, "none, since only a workbook (XLSX) has sheets")
    else:
        rows = _records(path, heads)
    if not rows:
        raise InputError(f"{path}: the table is empty; a header and rows are needed.")
    width = len(rows[0][1])
    full = [(*cells, *[""] * width)[:width] for _, cells in rows]
    used = [at for at in range(width) if any(cells[at] for cells in full)]  # a sheet may begin in its second column
    (first, header), *others = (
        (number, tuple(cells[at] for at in used)) for (number, _), cells in zip(rows, full, strict=True)
    )
    if again := [number for number, cells in others if heads.known and cells == header]:
        raise InputError(f"{path}, row {again[0]}: the header is repeated here; allowed is one table with one header.")
    return _with_units(path, ((first, tuple(map(heads.meant, header))), *others), heads)


def _with_units(path: Path, rows: tuple[NumberedRow, ...], heads: Heads) -> tuple[NumberedRow, ...]:
    """Return a table whose first row states the units of its columns with these in its heads."""
    if len(rows) < 2 or not heads.known:
        return rows
    (first, header), (number, cells), *others = rows
    units = [cell.strip("[]()").strip() for cell in cells]
    named = [unit for head, unit in zip(header, units, strict=True) if split_header(head)[0] in heads.needed]
    if not any(units) or not all(is_unit(unit) for unit in units if unit) or {*named} - {"", "-"}:
        return rows
    found = list[str]()
    for head, unit in zip(header, units, strict=True):
        name, stated = split_header(head)
        if stated and unit and usual_signs(unit) != stated:
            raise InputError.at(f"{path}, row {number}", name, unit, f"{stated} as in the head {head}")
        is_said = unit not in ("", "-") and not stated and name in heads.known and name != "unit"
        found.append(f"{name} [{unit}]" if is_said else head)
    return ((first, tuple(found)), *others)


def _without_titles(rows: Sequence[tuple[str, ...]], heads: Heads) -> list[tuple[str, ...]]:
    """Return rows in which those above the first with all names are blank, so that the others keep their numbers."""
    first = heads.row_in(rows)
    return [()] * first + list(rows[first:])


def _records(path: Path, heads: Heads = _ANY) -> list[NumberedRow]:
    """Return the records of a CSV file; what separates them is seen from the header, # starts a comment."""
    text = read_text(path, "a table in CSV")
    lines, separator = csv_lines(text, heads)
    rows, so_far = list[tuple[str, ...]](), 0
    try:
        for record in csv.reader(lines, delimiter=separator, strict=True):
            rows.append(tuple(_plain(_APOSTROPHE.sub("", cell.strip())) for cell in record))
            so_far += len(record)
            require_believable(path, len(rows), len(record), so_far)
    except csv.Error as error:
        said = f"a quotation mark is not closed, or not doubled within a cell ({error})"
        if "field larger" in str(error):
            said = f"a cell is too long; allowed are {csv.field_size_limit()} characters"
        raise InputError(f"{path}, row {len(rows) + 1}: {said}.") from None
    heads.require_in(path, rows)
    hint = "numbers have a decimal point, and " if separator == "," else ""
    kept = _under_headers(path, _without_titles(rows, heads), f"{hint}cells are separated by {separator!r}")
    if kept and len(kept[-1][1]) < len(kept[0][1]) and not text.endswith("\n"):
        number, cells = kept[-1]
        raise InputError(
            f"{path}, row {number}: {len(cells)} of {len(kept[0][1])} cells are there; is the file truncated?"
        )
    if separator == "," or not kept:
        return kept
    return kept[:1] + _with_decimal_points(path, kept[1:], [heads.kind(name) for name in kept[0][1]], bool(heads.known))


def csv_lines(text: str, heads: Heads = _ANY) -> tuple[list[str], str]:
    """Return the lines of a CSV file with blank ones for comments, and what separates its cells by its header."""
    lines = _without_comments(StringIO(text))
    roughly = [[own.strip(' "') for own in re.split(r"[;,\t|]", line.strip())] for line in lines[:MOST_TITLES]]
    at = heads.row_in(roughly)
    header = lines[at] if at else next((line for line in lines if line.strip()), "")
    return lines, next((mark for mark in ";\t|" if mark in header), ",")


def _without_comments(lines: Iterable[str]) -> list[str]:
    """Return lines with those blank that begin with #, unless within quotation marks."""
    found, is_quoted = list[str](), False
    for line in lines:
        found.append(line if is_quoted or not line.startswith("#") else "")
        is_quoted ^= found[-1].count('"') % 2 == 1
    return found


def _under_headers(path: Path, rows: Sequence[tuple[str, ...]], hint: str) -> list[NumberedRow]:
    """Return the rows that are not blank without the columns behind the last header, in which no cell may stand."""
    kept = [(number, cells) for number, cells in enumerate(rows, start=1) if any(cells)]
    if not kept:
        return []
    header = kept[0][1]
    width = max(at for at, name in enumerate(header, start=1) if name)
    for number, cells in kept:
        if any(cells[width:]) and len(cells) > len(header):
            raise InputError(f"{path}, row {number}: {len(cells)} cells stand under {width} headers; {hint}.")
        if any(cells[width:]):
            at = next(at for at in range(width, len(cells)) if cells[at])
            raise InputError(
                f"{path}, row {number}: column {at + 1} has {cells[at]!r} under an empty header; allowed is a name."
            )
    return [(number, cells[:width]) for number, cells in kept]


def _with_points(path: Path, number: int, cells: Sequence[str], kinds: Sequence[str]) -> NumberedRow:
    """Return a row of a workbook whose numbers, where they were kept as text, have decimal points."""
    found = list[str]()
    for cell, kind in zip(cells, (*kinds, *["number"] * len(cells)), strict=False):
        if isinstance(cell, AmbiguousText) and kind == "number":
            allowed = "a number as Excel keeps it, since as text it may separate thousands"
            raise InputError.at(f"{path}, row {number}", "a number kept as text", cell, allowed)
        if isinstance(cell, DateText) and kind != "words":
            allowed = "what was typed before the workbook made a date or time of it (format the cell as text first)"
            raise InputError.at(f"{path}, row {number}", "a cell", cell, allowed)
        found.append(_with_point(cell) if kind == "number" else cell)
    return number, tuple(found)


def _with_point(cell: str) -> str:
    """Return a number that may have a decimal comma, with or without ± and a unit, with a point."""
    return cell.replace(",", ".") if _DECIMAL.fullmatch(cell) or WITH_UNIT.fullmatch(cell) else cell


def _with_decimal_points(
    path: Path, rows: Sequence[NumberedRow], kinds: Sequence[str], is_careful: bool
) -> list[NumberedRow]:
    """Return rows whose numbers may have decimal commas with points; refused is what may separate thousands.

    A careful reader asks for one number at least whose sign can only be the decimal one.
    """
    numbers = [at for at, kind in enumerate(kinds) if kind == "number"]
    decimals = {
        cells[at]: number
        for number, cells in rows
        for at in numbers
        if at < len(cells) and _DECIMAL.fullmatch(cells[at])
    }
    grouped = {cell: number for cell, number in decimals.items() if _GROUPED.fullmatch(cell)}
    both = any("," in cell for cell in decimals) and any("." in cell for cell in decimals)
    if grouped and (both or (is_careful and len(grouped) == len(decimals))):
        cell, number = next(iter(grouped.items()))
        allowed = "decimal commas or decimal points in the whole file, and nothing between thousands"
        if not both:
            allowed = f"a number that shows what its sign means, such as {cell}0 or {re.sub('[.,]', '', cell)}"
        raise InputError.at(f"{path}, row {number}", "a cell", cell, allowed)
    return [
        (number, tuple(_with_point(cell) if at in numbers else cell for at, cell in enumerate(cells)))
        for number, cells in rows
    ]


def setting_line(name: str, value: float) -> str:
    """Return the comment by which a table states a setting that belongs to the drawing, as `stated_settings` reads."""
    return f"# setting: {name} = {value!r}"


def stated_settings(path: Path) -> dict[str, float]:
    """Return the settings that comments of a CSV file state, units in their names; a workbook states none.

    Raises
    ------
    InputError
        A setting that is stated twice, or whose value is no number.
    """
    found: dict[str, float] = {}
    if is_workbook(path):
        return found
    for number, line in enumerate(read_text(path, "a table in CSV").splitlines(), start=1):
        match = _SETTING.fullmatch(line.strip().strip('"'))
        if match is None:
            continue
        place, (name, text) = f"{path}, row {number}", match.groups()
        if name in found:
            raise InputError(f"{place}: setting {name!r} is stated twice; each has one value.")
        found[name] = number_at(place, f"setting {name}", text)
    return found


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """Cells of a CSV file as text, numbers with a decimal point."""

    # Where it was read, and the first line that is not a comment
    path: Path
    headers: tuple[str, ...]
    # Line of each row as counted in the file [-], and its cells, as many as there are headers
    rows: tuple[int, ...]
    cells: tuple[tuple[str, ...], ...]


def read_text_table(path: Path) -> TextTable:
    """Return the cells of a CSV file; lines that start with # are comments.

    Raises
    ------
    InputError
        The file is missing, not text, without a row, or a row has too few or too many cells.
    """
    rows = _records(path)
    if len(rows) < 2:
        raise InputError(f"{path}: the table has no rows; a line of headers and one row or more are needed.")
    (_, headers), *others = rows
    for row, cells in others:
        if len(cells) < len(headers):
            raise InputError(
                f"{path}, row {row}: {len(cells)} of {len(headers)} cells are there; the columns must be of equal "
                "length, and a cell without a number is left empty between its separators."
            )
    return TextTable(
        path=path, headers=headers, rows=tuple(row for row, _ in others), cells=tuple(cells for _, cells in others)
    )


def read_rows(path: Path, kind: type[Row], named_by: str, units: Mapping[str, str]) -> tuple[tuple[str, Row], ...]:
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
    require_units(path, stated, units)
    rows, faults = [], Faults()
    for number, texts in zip(table.rows, table.cells, strict=True):
        cells = dict(zip(headers, texts, strict=True))
        place = f"{path}, row {number} ({cells[named_by] or f'no {named_by}'})"
        with faults.kept():
            rows.append((place, validated(kind, typed_cells(kind, cells, place), place)))
    faults.require_none()
    return tuple(rows)


def require_units(path: Path, stated: Sequence[tuple[str, str]], units: Mapping[str, str]) -> None:
    """Raise if the header of a column states another unit than the one it has, empty where it has none.

    A currency is a cost unit like any other, three letters as in EUR or its sign; it is one for the whole file.
    """
    for name, unit in stated:
        known = units.get(name, "")
        priced = known.startswith(COST_UNITS)
        if unit and known not in (unit, in_cost_units(unit) if priced else unit):
            allowed = f"{known}; numbers are not converted" if known else "none"
            allowed = f"a currency such as EUR, or {allowed}" if priced else allowed
            raise InputError.at(path, f"the unit of column {name}", unit, allowed)
    _ = stated_currency(path, stated, units)


def stated_currency(path: Path, stated: Sequence[tuple[str, str]], units: Mapping[str, str]) -> str:
    """Return the currency that headers of costs state, empty where none does; a second one is an InputError."""
    first = ""
    for name, unit in stated:
        own = currency_in(unit) if units.get(name, "").startswith(COST_UNITS) else ""
        if first and own and own != first:
            raise InputError.at(path, f"the currency of column {name}", own, f"{first} as in the columns before it")
        first = first or own
    return first


def require_columns(path: Path | str, headers: tuple[str, ...], kind: type[Record]) -> None:
    """Raise unless a record knows each column, each is there once, and none that it needs is missing."""
    for at, name in enumerate(headers, start=1):
        if not name:
            raise InputError(f"{path}: the header of column {at} is empty; allowed is the name of a column.")
        if name not in kind.model_fields:
            raise UnknownNameError.among(path, "column", name, kind.model_fields)
        if headers.count(name) > 1:
            raise InputError(f"{path}: the column {name!r} is there twice; each has one.")
    required = [name for name, field in kind.model_fields.items() if field.is_required()]
    for name in required:
        if name not in headers:
            raise InputError(f"{path}: the column {name!r} is missing; needed are {', '.join(required)}.")


def typed_cells(kind: type[Record], row: Mapping[str, object], place: str) -> dict[str, object]:
    """Return the cells of a row that are not empty, text as the type that its field asks for."""
    stated = {name: cell.strip() if isinstance(cell, str) else cell for name, cell in row.items()}
    typed, faults = dict[str, object](), Faults()
    for name, cell in stated.items():
        if cell not in ("", None):
            with faults.kept():
                hint = kind.model_fields[name].annotation
                typed[name] = _typed(hint, name, cell, place) if isinstance(cell, str) else cell
    faults.require_none()
    return typed


def plain_number(text: str) -> float:
    """Return the number that a cell shows; with ``_`` or digits of another script it is a ValueError."""
    if "_" in text or not text.isascii():
        raise ValueError(f"{text!r} is no plain number")
    return float(text)


def number_at(place: str, field: str, text: str, allowed: str = "a number with a decimal point") -> float:
    """Return the number that a cell shows, or raise with its place."""
    try:
        return plain_number(text)
    except ValueError:
        raise InputError.at(place, field, text, allowed) from None


def believed_number(place: str, field: str, text: str, largest: float, allowed: str = "") -> float:
    """Return the number that a cell shows, no further from 0 than is believed, or raise with its place."""
    try:
        value = plain_number(text)
    except ValueError:
        value = nan
    if not abs(value) <= largest:
        raise InputError.at(place, field, text, allowed or f"a number from {-largest:g} to {largest:g}")
    return value


def usual_word(text: str) -> str:
    """Return a word as the fields have it."""
    return office_words("cells").get(text.strip().lower(), text)


def _typed(annotation: object, header: str, value: str, place: str) -> object:
    """Return the text of a cell as the type of its field."""
    if annotation is int:
        number = value.rstrip("x× ")
        if not (number.isascii() and number.isdecimal() and len(number) < 10):
            raise InputError.at(place, header, value, "a whole number, 1 or more")
        return int(number)
    if annotation is bool:
        if value.lower() not in ("yes", "no", "true", "false", "ja", "nein", "wahr", "falsch"):
            raise InputError.at(place, header, value, "yes or no")
        return value.lower() in ("yes", "true", "ja", "wahr")
    if annotation is float or float in get_args(annotation):
        return number_at(place, header, value)
    words: tuple[str, ...] = get_args(annotation) if get_origin(annotation) is Literal else ()
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        words = tuple(annotation)
    if words:
        spelt = {word.lower(): word for word in words}
        value = spelt.get(usual_word(value).lower(), value)
        if value not in words:
            more = "; a truncated one is written as its distribution with sorted = yes" if value == "truncated" else ""
            raise InputError.at(place, header, value, "one of " + ", ".join(words) + more)
        return words[words.index(value)]
    return value
