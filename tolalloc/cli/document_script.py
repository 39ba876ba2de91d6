"""Writing a report into a new folder, for commands with ``--out``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tolalloc.cli.console import messages
from tolalloc.report.document import Document
from tolalloc.report.folder import claimed
from tolalloc.report.writer import write_document


def _nothing(folder: Path) -> None:
    """Add nothing to a report's folder."""


def written(folder: Path, build: Callable[[], Document], add: Callable[[Path], None] = _nothing) -> Document:
    """Claim a folder, then make the report and write it.

    Parameters
    ----------
    folder
        New or empty folder.
    build
        Makes the report; nothing stays behind if that fails.
    add
        Adds more files to the written report.

    Raises
    ------
    RunFolderError
        Something is in the way.
    """
    with claimed(folder):
        document = build()
        write_document(document, folder)
        add(folder)
    messages.print(f"Report: {folder / 'report.html'}", soft_wrap=True, markup=False)
    return document
