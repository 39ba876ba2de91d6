"""The run folder: made only where nothing can be lost, filled once the work is finished."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tolalloc.exceptions import RunFolderError


def require_usable(folder: Path | None) -> None:
    """Raise unless the folder is new or empty, or none is wanted.

    Raises
    ------
    RunFolderError
        Something is in the way.
    """
    if folder is None:
        return
    if folder.is_file():
        raise RunFolderError(f"{folder}: is a file; the run needs a folder that is new or empty (--out).")
    if folder.is_dir() and any(folder.iterdir()):
        raise RunFolderError(
            f"{folder}: the run folder is not empty; allowed is a new or empty one (--out), "
            "so that nothing is overwritten."
        )
    above = next(parent for parent in folder.absolute().parents if parent.exists())
    if not above.is_dir() or not os.access(above, os.W_OK):
        raise RunFolderError(f"{folder}: the run folder cannot be made in {above}; name another (--out).")


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Make the folder before anything long runs; if the work inside fails, take it away again.

    Raises
    ------
    RunFolderError
        Something is in the way, or the folder cannot be made.
    """
    require_usable(folder)
    new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunFolderError(
            f"{folder}: the run folder cannot be made ({error.strerror}); name another (--out)."
        ) from None
    try:
        yield
    except BaseException:
        if new and not any(folder.iterdir()):
            folder.rmdir()
        raise
