"""The run folder: made only where nothing can be lost, filled once the work is finished."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import move, rmtree
from tempfile import mkdtemp

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
def claimed(folder: Path) -> Iterator[Path]:
    """Give a folder beside the wanted one to fill, which takes its place once the work inside has succeeded.

    The wanted folder is made before anything long runs; if the work fails, nothing of either is left.

    Raises
    ------
    RunFolderError
        Something is in the way, or the folder cannot be made.
    """
    require_usable(folder)
    new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        beside = Path(mkdtemp(prefix=f".{folder.name}-", suffix=".unfinished", dir=folder.absolute().parent))
    except OSError as error:
        raise RunFolderError(
            f"{folder}: the run folder cannot be made ({error.strerror}); name another (--out)."
        ) from None
    try:
        yield beside
        beside.chmod(0o777 & ~_umask())  # a temporary folder is its owner's alone
        require_usable(folder)
        if new:
            folder.rmdir()
            beside.rename(folder)
        else:  # it may be a disk of its own, or where someone stands
            for path in sorted(beside.iterdir(), key=lambda path: path.name == "manifest.json"):
                move(path, folder / path.name)
            beside.rmdir()
    except BaseException:
        rmtree(beside, ignore_errors=True)
        if new and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise


def _umask() -> int:
    """Return what this process takes away from the rights of new files, which can be read only by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
