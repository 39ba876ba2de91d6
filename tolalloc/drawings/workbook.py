"""A sheet of a user's workbook as text; what a reader of values would silently miss is refused."""

from __future__ import annotations

import re
import warnings
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import read_bytes, require_believable

_LARGEST_CONTENT = 16 * 2**20
"""Largest content of a workbook when unpacked, all parts together [B]."""
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}([.,]\d{3})+")
"""Text that is a thousand times as large where its sign separates thousands."""
_MOST_CELLS = 100_000
"""Most cells of the rectangle from the first cell to the last one [-]."""


class AmbiguousText(str):
    """Text that is another number where its sign separates thousands: no matter in a note, refused as a number."""

    __slots__ = ()


def sheet_texts(path: Path, sheet: str = "") -> list[tuple[str, ...]]:
    """Return the cells of the named sheet as text, of the first one unless named; whole numbers without decimals.

    Raises
    ------
    InputError
        The file is missing, no workbook, or larger than is believed; or the sheet is not there or hidden, or has
        merged cells, an error, or a formula whose value was not kept.
    """
    content = read_bytes(path, "a workbook (XLSX)")
    try:
        _require_small(path, content)
        # Values do not say which cells were formulas, and formulas do not say their values.
        values, formulas = (_loaded(path, content, data_only, sheet) for data_only in (True, False))
        texts = _texts(path, values, formulas)
    except InputError:
        raise
    except Exception as error:  # whatever the libraries raise on a damaged file: of zlib, XML, types, indices
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: not a complete workbook (XLSX); is the file truncated? ({reason}).") from None
    return texts


def hidden_cells(path: Path, sheet: str = "") -> tuple[str, ...]:
    """Return a sentence for the hidden rows and one for the hidden columns of a sheet, which are read too."""
    loaded = _loaded(path, read_bytes(path, "a workbook (XLSX)"), data_only=True, sheet=sheet)
    rows = [str(at) for at, row in loaded.row_dimensions.items() if row.hidden]
    columns = [at for at, column in loaded.column_dimensions.items() if column.hidden]
    return tuple(
        f"{path.name}: hidden {what} of the sheet are read like the others: {', '.join(found)}"
        for what, found in (("rows", rows), ("columns", columns))
        if found
    )


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


def _loaded(path: Path, content: bytes, data_only: bool, sheet: str) -> Any:
    """Return the named one of the sheets that have cells, the first unless named."""
    from openpyxl import load_workbook

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what is lost on writing it again, which nobody does
        sheets = load_workbook(BytesIO(content), data_only=data_only, keep_links=False).worksheets
    named = {own.title: own for own in sheets}
    if sheet and sheet not in named:
        shown = [repr(title) for title, own in named.items() if own.sheet_state == "visible"]
        raise InputError.at(path, "sheet", sheet, f"one of {', '.join(shown)}")
    return named[sheet] if sheet else sheets[0]


def _texts(path: Path, values: Any, formulas: Any) -> list[tuple[str, ...]]:
    """Return the cells as text."""
    place = f"{path}, sheet {values.title!r}"
    if values.sheet_state != "visible":
        raise InputError(f"{place}: the sheet is hidden; allowed is a table in a sheet that is shown.")
    if values.merged_cells.ranges:
        where = next(iter(values.merged_cells.ranges))
        raise InputError(f"{place}: the cells {where} are merged; allowed is one value in each cell.")
    rows, columns = values.max_row, values.max_column
    if rows * columns > _MOST_CELLS:
        raise InputError(
            f"{place}: its last cell is in row {rows}, column {columns}; allowed are {_MOST_CELLS} cells in all."
        )
    require_believable(path, 1, columns, rows * columns)
    return [
        tuple(_text(path, cell, written) for cell, written in zip(*pair, strict=True))
        for pair in zip(
            values.iter_rows(max_row=rows, max_col=columns),
            formulas.iter_rows(max_row=rows, max_col=columns),
            strict=True,
        )
    ]


def _text(path: Path, cell: Any, written: Any) -> str:
    """Return the text of a cell, or say that it has no value."""
    value = cell.value
    if cell.data_type == "e":
        raise InputError.at(f"{path}, row {cell.row}", f"cell {cell.coordinate}", value, "a value and no error")
    if value is None and written.data_type == "f":
        allowed = "a value, or a formula whose value was kept (open the workbook and save it)"
        raise InputError.at(f"{path}, row {cell.row}", f"cell {cell.coordinate}", written.value, allowed)
    if isinstance(value, str) and _THOUSANDS.fullmatch(value.strip()):
        return AmbiguousText(value.strip())
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return "" if value is None else str(value).strip()
