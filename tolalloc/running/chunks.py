"""The one interface behind which an executor stands: samples in chunks, answers in their order, with the same bits.

Matrix products use one thread: the threads of a BLAS library spin while they wait for each other, which on cores that
are taken costs a hundred times the product itself, and the sizes here never need a second thread.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any, TypeVar, cast

import numpy as np
from jaxtyping import Float
from threadpoolctl import ThreadpoolController

Answer = TypeVar("Answer")

Mapper = Callable[..., Iterable[Any]]
"""Applies a function to chunks and yields the answers in order: ``map``, or the ``map`` of a process pool."""

SAMPLES_AT_ONCE = 1024


def map_chunks(
    solve: Callable[[Float[np.ndarray, "chunk column"]], Answer],
    x: Float[np.ndarray, "sample column"],
    mapper: Mapper = map,
) -> Iterator[tuple[slice, Answer]]:
    """Yield the rows of each chunk and its answer, in the order of the samples.

    ``map`` solves in this process, its threads sharing each chunk. The ``map`` of a
    `concurrent.futures.ProcessPoolExecutor` started with `one_thread`, or of another executor that keeps the order,
    gives the same bits: a sample's answer does not depend on its chunk. What solves a chunk must be picklable then.
    """
    rows = [slice(start, start + SAMPLES_AT_ONCE) for start in range(0, x.shape[0], SAMPLES_AT_ONCE)]
    yield from zip(rows, mapper(solve, (x[part] for part in rows)), strict=True)


def one_thread() -> None:
    """Make a worker process use one thread: pass it as the initializer of the pool, one process per core."""
    from tolalloc.running.compiled import use_threads

    use_threads(1)


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
    return cast("AbstractContextManager[Any]", _libraries().limit(limits=1, user_api="blas"))
