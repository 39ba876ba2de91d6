"""Matrix products on one thread: the same bits on every machine, and no waiting where other processes hold the cores.

The threads of a BLAS library spin while they wait for each other. On cores that are taken that cost a hundred times the
product itself; the sizes here never need a second thread.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

from threadpoolctl import ThreadpoolController


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    """Return the libraries that are loaded; looking for them takes a millisecond."""
    return ThreadpoolController()


def blas_libraries() -> str:
    """Return which BLAS libraries are loaded, with their versions; each works on one thread here."""
    found = [own for own in _libraries().info() if own["user_api"] == "blas"]
    return ", ".join(sorted({f"{own['internal_api']} {own['version']}" for own in found})) or "none that is known"


def one_blas_thread() -> AbstractContextManager[Any]:
    """Return a context in which matrix products use one thread."""
    context: AbstractContextManager[Any] = _libraries().limit(limits=1, user_api="blas")
    return context
