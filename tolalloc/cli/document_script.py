"""Writing a report into a new folder: for commands with ``--out`` and for scripts that are a study of their own."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from tolalloc.cli.console import announce_compilation, messages, say
from tolalloc.exceptions import TolallocError
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


def run_document(name: str, build: Callable[[bool], Document]) -> None:
    """Run a script that makes one report, with the options ``--out`` and ``--quick``.

    Parameters
    ----------
    name
        Name of the study and of its folder below ``runs``.
    build
        Makes the report from whether it should be quick.
    """
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs") / name, help="folder, new or empty")
    parser.add_argument("--quick", action="store_true", help="fewer seeds, wider bands")
    options = parser.parse_args()
    announce_compilation("cycloid")
    try:
        document = written(options.out, lambda: build(options.quick))
    except TolallocError as error:
        messages.print(f"Error: {error}", soft_wrap=True, markup=False, highlight=False)
        raise SystemExit(2) from None
    say(document)
