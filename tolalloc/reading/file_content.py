"""The one door through which users' files are read: what is no file of a believable size is refused unread."""

from __future__ import annotations

import re
import stat
from pathlib import Path

from tolalloc.exceptions import InputError

LARGEST_FILE = 32 * 2**20
"""Largest file that is read [B]; a million readings of two columns take about 20 MB."""

MOST_COLUMNS, MOST_CELLS = 4000, 2_000_000
"""Largest table that is read, a million readings of two columns; workbooks have a limit of their own [-]."""

_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
"""Characters that no page, workbook or terminal shows."""
_KINDS = (
    (b"\xd0\xcf\x11\xe0", "an Excel 97–2003 workbook (XLS)"),
    (b"PK\x03\x04", "a workbook or an archive under another ending"),
    (b"%PDF", "a PDF"),
)
"""How files begin that are taken for tables, and what they are."""
_ARCHIVES = {
    b"opendocument.spreadsheet": "an OpenDocument spreadsheet (ODS)",
    b"xl/workbook.bin": "a binary workbook (XLSB)",
    b"Index/Document.iwa": "a Numbers spreadsheet",
}
_OFFICES = {"UTF-16": "utf-16", "Windows-1252": "cp1252"}
"""How spreadsheets save a CSV file that is not UTF-8 → codec of Python."""


def is_file(path: Path) -> bool:
    """Return whether a path leads to a file; one that no file can have, such as a name too long, leads nowhere."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_bytes(path: Path, what: str) -> bytes:
    """Return the content of a file, which messages call by what it should be.

    Raises
    ------
    InputError
        The file is missing, cannot be read, is none (a folder, a device, a pipe), or is larger than is believed.
    """
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):  # a pipe would be waited for, a device never ends
            raise InputError(f"{path}: cannot be read as {what}; allowed is a file, and this is a folder or device.")
        if found.st_size > LARGEST_FILE:
            raise InputError(f"{path}: cannot be read as {what}; allowed are {LARGEST_FILE // 2**20} MB at most.")
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as {what} ({getattr(error, 'strerror', error)}).") from None


def require_table(path: Path, content: bytes, is_workbook: bool) -> None:
    """Raise if a file that should be a table, or a workbook (XLSX), is one of another kind.

    Raises
    ------
    InputError
        The kind of file, and how it is saved as one that is read.
    """
    start = content[:512].lstrip().lower()
    found = next((kind for mark, kind in _KINDS if content.startswith(mark)), "")
    found = next((kind for mark, kind in _ARCHIVES.items() if found and mark in content), found)
    if start.startswith((b"<html", b"<!doctype html", b"<table")):
        found = "a web page"
    if start.startswith(b"<?xml"):
        found = "a file in XML"
    if found and not (is_workbook and found == _KINDS[1][1]):
        raise InputError(
            f"{path}: this is {found}, which is not read; open it in Excel or LibreOffice, save it as Excel workbook "
            "(*.xlsx) or as CSV UTF-8, and name that file."
        )


def read_text(path: Path, what: str) -> str:
    """Return the text of a file in UTF-8, its lines ended as Python ends them; a table also as offices save it.

    Raises
    ------
    InputError
        As of `read_bytes`; also text that is not UTF-8, or a control character.
    """
    content = read_bytes(path, f"{what} (UTF-8)")
    if what.endswith("CSV"):
        require_table(path, content, is_workbook=False)
    encoding = _OFFICES.get(_encoding(content), "utf-8-sig") if what.endswith("CSV") else "utf-8-sig"
    try:
        text = content.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        other = "UTF-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "Windows-1252 (cp1252)"
        row = content[: error.start].count(b"\n") + 1
        kind = what.split()[-1]
        raise InputError(
            f"{path}: cannot be read as {what} (UTF-8), row {row} looks like {other}; save it as {kind} UTF-8."
        ) from None
    if found := _CONTROL.search(text):
        row = text.count("\n", 0, found.start()) + 1
        sign = f"the control character {found[0]!r}"
        raise InputError(f"{path}: cannot be read as {what} (UTF-8), row {row} holds {sign}; allowed is text.")
    return text


def _encoding(content: bytes) -> str:
    """Return how a text that is not UTF-8 is most likely written; nothing where it is UTF-8, also a damaged one."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "UTF-16"
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return "Windows-1252" if content.decode("utf-8", "ignore").isascii() else ""
    return ""


def other_encoding(path: Path) -> str:
    """Return the encoding in which a table that is not UTF-8 is read; nothing where it is."""
    return _encoding(read_bytes(path, "a table in CSV"))


def require_believable(path: Path, row: int, columns: int, cells: int) -> None:
    """Raise if a table is larger than is believed, so that none takes the memory of a machine."""
    if columns > MOST_COLUMNS or cells > MOST_CELLS:
        raise InputError(
            f"{path}, row {row}: the table is too large, with {columns} columns and {cells} cells so far; allowed are "
            f"{MOST_COLUMNS} columns and {MOST_CELLS} cells."
        )
