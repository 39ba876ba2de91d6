"""Users' tables as text, or one sentence on what is wrong with the file as a whole."""

from __future__ import annotations

import csv
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from tolalloc.exceptions import InputError

DATA = Path(__file__).parent / "data"
"""Shipped tables."""


def read_table_file(path: Path) -> pd.DataFrame:
    """Return the cells of a CSV (UTF-8) or XLSX file as text, the header as first row, blank rows left out.

    The index counts the rows as an editor does, from 0.

    Raises
    ------
    InputError
        The file is missing, or no complete table; a row that is longer than the first is an error.
    """
    try:
        if path.suffix.lower() in (".xlsx", ".xlsm"):
            frame = pd.read_excel(path, header=None, dtype=str, keep_default_na=False)
        else:
            frame = pd.read_csv(
                path, header=None, dtype=str, keep_default_na=False, skip_blank_lines=False, encoding="utf-8-sig"
            )
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (OSError, zipfile.BadZipFile, ValueError) as error:  # pandas' own errors are ValueErrors
        reason = " ".join(str(error).split())
        raise InputError(
            f"{path}: not a complete table in CSV (UTF-8) or XLSX; is the file truncated? ({reason})."
        ) from None
    text = frame.fillna("").map(lambda cell: str(cell).strip())
    kept = text[(text != "").any(axis=1)]
    if kept.empty:
        raise InputError(f"{path}: the table is empty; a header and rows are needed.")
    return kept


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """Cells of a CSV file as text.

    Parameters
    ----------
    path
        Where it was read.
    headers
        First line that is not a comment.
    rows
        Line of each row as counted in the file [-].
    cells
        Cells row by row, as many as there are headers.
    """

    path: Path
    headers: tuple[str, ...]
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
