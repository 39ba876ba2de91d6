"""The one interface behind which an executor stands: samples in chunks, answers in the order of the samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

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

    Parameters
    ----------
    solve
        Function of one chunk; picklable where the mapper sends it to other processes.
    x
        All samples.
    mapper
        ``map`` solves in this process, its threads sharing each chunk. The ``map`` of a
        `concurrent.futures.ProcessPoolExecutor` started with `one_thread`, or of another executor that keeps the order,
        gives the same bits: a sample's answer does not depend on its chunk.
    """
    rows = [slice(start, start + SAMPLES_AT_ONCE) for start in range(0, x.shape[0], SAMPLES_AT_ONCE)]
    yield from zip(rows, mapper(solve, (x[part] for part in rows)), strict=True)


def one_thread() -> None:
    """Make a worker process use one thread: pass it as the initializer of the pool, one process per core."""
    from tolalloc.running.compiled import use_threads

    use_threads(1)
