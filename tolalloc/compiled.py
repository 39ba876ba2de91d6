"""How the kernel's functions are compiled: without the interpreter's lock, without reordered sums, kept on disc.

numba keeps a compiled function until its own file changes, although functions from other files are built into it. So
what is kept stands in a folder named after a digest of all rooms named ``solvers``, where every compiled function
lives: a change in any of their files compiles all anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba as nb
from numba import get_num_threads as thread_count
from numba import prange

__all__ = ["is_kept", "jit", "parallel_jit", "prange", "thread_count", "use_threads"]

_HERE = Path(__file__)
_FILES = [_HERE, *sorted(_HERE.parent.glob("**/solvers/*.py"))]
_DIGEST = hashlib.sha256(b"".join(path.read_bytes() for path in _FILES)).hexdigest()
_KEPT = _HERE.parent / "__pycache__" / f"compiled-{_DIGEST[:16]}"


def is_kept(module: str) -> bool:
    """Return whether functions of this version of a module were compiled on this machine before."""
    return any(_KEPT.glob(f"*/{module}.*.nbi"))


def _compile(function: Callable[..., Any], parallel: bool) -> Any:
    others = nb.config.CACHE_DIR
    nb.config.CACHE_DIR = str(_KEPT)  # read while decorating only
    try:
        return nb.njit(cache=True, nogil=True, error_model="numpy", parallel=parallel)(function)
    finally:
        nb.config.CACHE_DIR = others


def use_threads(count: int) -> None:
    """Let the loops of `parallel_jit` functions use this many threads of the process."""
    nb.set_num_threads(count)


def jit(function: Callable[..., Any]) -> Any:
    """Compile a function for one thread."""
    return _compile(function, parallel=False)


def parallel_jit(function: Callable[..., Any]) -> Any:
    """Compile a function whose `numba.prange` loops share their turns among the threads.

    The loop's number is unsigned to the threads and signed to the rest; pass ``np.int64(number)`` on, or all that
    is called is compiled twice.
    """
    return _compile(function, parallel=True)
