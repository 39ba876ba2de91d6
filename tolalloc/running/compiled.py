"""How the kernel's functions are compiled and shared among threads: no interpreter's lock, no reordered sums.

numba keeps a compiled function until its own file changes, although functions from other files are built into it. So
what is kept stands in a folder named after a digest of all rooms named ``solvers``, where every compiled function
lives: a change in any of their files compiles all anew. The folder stands where `NUMBA_CACHE_DIR` says, else in the
package, else in the user's cache, else among the temporary files: the first of these that can be written.

Threads are the interpreter's own, each calling compiled functions that hold no lock. A parallel loop of numba's was no
faster here, and took as long to compile as all that it calls.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import numba as nb
import numpy as np
from numba.misc.appdirs import AppDirs

from tolalloc.exceptions import InputError

_HERE = Path(__file__)
_FILES = [_HERE, _HERE.with_name("compiled_parts.py"), *sorted(_HERE.parents[1].glob("**/solvers/*.py"))]
_DIGEST = hashlib.sha256(b"".join(path.read_bytes() for path in _FILES)).hexdigest()
_PLACE = "NUMBA_CACHE_DIR"
"""Variable of the environment that names the folder of compiled functions."""


def _place() -> Path | None:
    """Return the folder that compiled functions are kept in; nothing where no folder can be written."""
    folder = f"compiled-{_DIGEST[:16]}"
    if stated := str(nb.config.CACHE_DIR):
        if not _can_be_written(Path(stated) / folder):
            raise InputError.at("environment", _PLACE, stated, "a folder that can be written, or nothing")
        return Path(stated).absolute() / folder
    for usual in (_HERE.parents[1] / "__pycache__", Path(AppDirs("tolalloc", False).user_cache_dir)):
        if _can_be_written(usual / folder):
            return usual / folder
    place = _temporary_folder()
    where = f"in {place}" if place else "nowhere, and again in every run"
    if sys.stderr and parent_process() is None:  # workers need not say it again
        sys.stderr.write(
            "Neither the package's folder nor a home can be written: what is compiled for this machine is kept "
            f"{where}; {_PLACE} may name another folder.\n"
        )
    return place and place / folder


def _can_be_written(folder: Path) -> bool:
    """Return whether a folder, made if need be, takes files."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _temporary_folder() -> Path | None:
    """Return a folder of this user alone among the temporary ones: what is kept is code, and is run as it is read."""
    user = "" if sys.platform == "win32" else f"-{os.getuid()}"
    try:
        own = Path(tempfile.gettempdir()) / f"tolalloc{user}"
        if not _is_ours(own):  # somebody else has made it
            own = Path(tempfile.mkdtemp(prefix="tolalloc-"))
            atexit.register(shutil.rmtree, own, ignore_errors=True)
    except OSError:
        return None
    return own


def _is_ours(folder: Path) -> bool:
    """Return whether a folder, made if need be, belongs to this user, and nobody else can look into it."""
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except FileExistsError:  # a file, or a link to nowhere
        return False
    found = folder.lstat()  # a link is none of ours
    if sys.platform == "win32":  # temporary folders are each user's own
        return stat.S_ISDIR(found.st_mode)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077


KEPT = _place()
"""Folder that compiled functions are kept in; nothing where none can be written."""


def is_kept(module: str) -> bool:
    """Return whether functions of this version of a module were compiled on this machine before."""
    return KEPT is not None and any(KEPT.glob(f"*/{module}.*.nbi"))


def processor() -> dict[str, str]:
    """Return what tells the processor from others: as numba tells what it has kept, and what NumPy makes use of."""
    from numba.core.registry import cpu_target

    told = cpu_target.target_context.codegen().magic_tuple()
    numpy = np.show_config(mode="dicts")["SIMD Extensions"]
    known = dict(zip(("kind", "name", "features"), map(str, told), strict=True))
    return known | {"NumPy's features": ",".join(numpy["baseline"] + numpy.get("found", []))}


def _compiled(function: Callable[..., Any], **options: bool) -> Any:
    whole = _new(function, {"nogil": True, "error_model": "numpy"} | options)
    if KEPT is not None:
        _keep(whole, KEPT)
        if hasattr(whole, "part"):
            _keep(whole.part, KEPT / "parts")
    return whole


def _new(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    try:
        from tolalloc.running.compiled_parts import Whole
    except (AttributeError, ImportError):  # numba has moved what parts stand on: compiling takes longer without them
        return nb.njit(**options)(function)
    return Whole(function, options, _wait_for)


def _keep(dispatcher: Any, folder: Path) -> None:
    """Keep in a folder what is compiled."""
    others = nb.config.CACHE_DIR
    nb.config.CACHE_DIR = str(folder)  # read while caching is enabled only
    try:
        dispatcher.enable_caching()
    finally:
        nb.config.CACHE_DIR = others


def jit(function: Callable[..., Any]) -> Any:
    """Compile a function when it is first called."""
    return _compiled(function, _nrt=True)  # said, because else the caller's choice would hold


def jit_in_place(function: Callable[..., Any]) -> Any:
    """Compile a function that makes no array, returns none and calls none that does, without counting references.

    Taking an array out of a record counts a reference up and down, atomically; many small functions spent half of
    their time so. numba refuses to make an array here, but not to return a view, which its owner would not outlive.
    """
    return _compiled(function, _nrt=False)


def jit_within(function: Callable[..., Any]) -> Any:
    """Compile a function in place as a part of every one that calls it, for innermost loops."""
    return _compiled(function, _nrt=False, forceinline=True)


_elsewhere: dict[str, subprocess.Popen[bytes]] = {}


def compile_elsewhere(modules: Iterable[str], *command: str) -> None:
    """Let a second process, ``python -m command``, compile functions of these modules, where there is a core for it.

    Whatever calls one of the functions first waits for the process to end, and compiles what it has not kept.
    """
    if thread_count() > 1:
        nowhere = subprocess.DEVNULL
        process = subprocess.Popen([sys.executable, "-m", *command], stdin=nowhere, stdout=nowhere, stderr=nowhere)
        _elsewhere.update(dict.fromkeys(modules, process))


def _wait_for(module: str) -> None:
    if module in _elsewhere:
        _elsewhere[module].wait()


_threads = int(nb.config.NUMBA_NUM_THREADS)


def thread_count() -> int:
    """Return how many threads of the process share the work; at first one for each core."""
    return _threads


def use_threads(count: int) -> None:
    """Let this many threads of the process share the work."""
    global _threads
    _threads = count


def in_threads(work: Callable[[slice], None], samples: int, size: int) -> None:
    """Do some work on all samples, at most ``size`` of them at a time, the threads sharing the parts."""
    parts = [slice(start, min(start + size, samples)) for start in range(0, samples, size)]
    if min(_threads, len(parts)) <= 1:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(min(_threads, len(parts))) as pool:
        for _ in pool.map(work, parts):
            pass  # raises what the work raised
