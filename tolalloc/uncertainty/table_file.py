"""A user's table in CSV or XLSX as text, or one sentence on what is wrong with the file as a whole."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pandas as pd

from tolalloc.exceptions import InputError


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
