"""The run folder: made only where nothing can be lost, filled once the work is finished."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from shutil import Error as MoveError
from shutil import move, rmtree

from tolalloc.exceptions import RunFolderError

RUNS = Path("runs")
"""Where runs stand whose folder nobody names."""
_UNFINISHED = ".unfinished"
"""How the name of a folder ends that is being filled."""


def require_usable(folder: Path | None) -> None:
    """Raise unless the folder is new or empty, or none is wanted."""
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


def numbered(first: Path) -> list[Path]:
    """Return the folders that runs of one name have taken or are filling, and last the next one that is free."""
    found = [first]
    while found[-1].is_file() or (found[-1].is_dir() and any(found[-1].iterdir())) or _is_being_filled(found[-1]):
        found.append(first.with_name(f"{first.name}-{len(found) + 1}"))
    return found


@contextmanager
def claimed(folder: Path) -> Iterator[Path]:
    """Give a folder beside the wanted one to fill, which takes its place once the work inside has succeeded.

    The wanted folder is made before anything long runs; if the work fails, nothing of either is left. What a killed
    process of this machine left beside the same folder is cleared.
    """
    require_usable(folder)
    named, folder = folder, folder.absolute()  # what is run inside may go to another folder
    new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _clear_left(folder)
        beside = folder.with_name(f".{folder.name}-{_machine()}-{os.getpid()}-{token_hex(4)}{_UNFINISHED}")
        beside.mkdir()
    except OSError as error:
        raise RunFolderError(
            f"{named}: the run folder cannot be made ({error.strerror}); name another (--out)."
        ) from None
    try:
        yield beside
        require_usable(folder)
        if new:
            with suppress(FileNotFoundError):  # an empty folder may be cleared away meanwhile
                folder.rmdir()
            beside.rename(folder)
        else:  # it may be a disk of its own, or where someone stands
            _move_all(beside, folder)
            beside.rmdir()
    except BaseException as error:
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(named)  # a full disk does not say where it is
        rmtree(beside, ignore_errors=True)
        if new and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise


def _move_all(beside: Path, folder: Path) -> None:
    """Move what stands in one folder into an empty one, the manifest last; where that fails nothing is left there."""
    try:
        for path in sorted(beside.iterdir(), key=lambda path: path.name == "manifest.json"):
            move(path, folder / path.name)
    except BaseException as error:
        for path in folder.iterdir():
            if path.is_dir() and not path.is_symlink():
                rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
        if isinstance(error, MoveError):  # of a folder, with what happened to each of its files and no other word
            raise OSError(0, str(error.args[0][0][-1])) from None
        raise


def _clear_left(folder: Path) -> None:
    """Remove what processes of this machine that are no more left unfinished beside a folder."""
    for path, process in _unfinished(folder):
        if _is_gone(process):
            rmtree(path, ignore_errors=True)


def _is_being_filled(folder: Path) -> bool:
    """Return whether a living process of this machine seems to fill a folder; its number may be another's."""
    return any(not _is_gone(process) for _, process in _unfinished(folder))


def _unfinished(folder: Path) -> list[tuple[Path, int]]:
    """Return what processes of this machine have begun beside a folder, each with the number of its process."""
    written = re.compile(rf"\.{re.escape(folder.name)}-{re.escape(_machine())}-(\d+)-\w+{re.escape(_UNFINISHED)}")
    above = folder.absolute().parent
    found = [(path, written.fullmatch(path.name)) for path in (above.iterdir() if above.is_dir() else ())]
    return [(path, int(name[1])) for path, name in found if name]


def _is_gone(process: int) -> bool:
    """Return whether a process has ended; where that cannot be asked nothing is said to have."""
    try:
        if os.name == "posix":
            os.kill(process, 0)  # asks and does no more
    except OSError as error:  # it has ended, or is somebody else's
        return isinstance(error, ProcessLookupError)
    return False


def _machine() -> str:
    """Return the name of this machine; several may fill one folder."""
    return re.sub(r"\W", "_", platform.node()) or "machine"
