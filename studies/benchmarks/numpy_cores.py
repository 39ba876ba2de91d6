"""The NumPy kernel on all cores: in one process with threads in the BLAS, or in a process per core."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache, partial
from math import pi
from multiprocessing import get_context
from multiprocessing.pool import Pool
from threading import Barrier
from typing import NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float
from numpy_kernel import NumpyKernel
from threadpoolctl import threadpool_limits

from tolalloc.reducers.reducer.files import load_reducer

ANGLES = 936
TRIAL_ANGLES = 48
TORQUE = -1.0  # N·m
CORES = os.cpu_count() or 1
_REST = 0.3  # seconds in which the threads of the last measurement stop waiting for work
_BATCHES = (512, 1024, 2048)

Errors = Float[np.ndarray, "sample column"]
Curves = Float[np.ndarray, "sample angle"]
Answer = TypeVar("Answer")


class Arrangement(NamedTuple):
    """How NumPy is laid on the cores."""

    processes: int
    blas_threads: int
    batch: int


def timed(work: Callable[[], Answer]) -> tuple[float, Answer]:
    """Return how long something took [s], and its answer."""
    time.sleep(_REST)
    start = time.perf_counter()
    answer = work()
    return time.perf_counter() - start, answer


@lru_cache
def numpy_kernel(angles: int) -> NumpyKernel:
    """Return the NumPy kernel for the first of the 936 angles; every process has its own."""
    return NumpyKernel(load_reducer("rv20e_liu2020"), 2 * pi * np.arange(ANGLES)[:angles] / ANGLES)


def _share(angles: int, batch: int, errors: Errors) -> Curves:
    kernel = numpy_kernel(angles)
    kernel.batch = batch
    return kernel.curves(errors, TORQUE)


def _start(barrier: Barrier) -> None:
    threadpool_limits(1, "blas")
    for angles in (ANGLES, TRIAL_ANGLES):
        numpy_kernel(angles)
    barrier.wait()


@contextmanager
def numpy_workers() -> Iterator[Pool]:
    """Give a process per core with all tables made; they wait without work while others are measured."""
    context = get_context("spawn")  # the threads of numba and the BLAS do not outlive a fork
    barrier = context.Barrier(CORES + 1)
    with context.Pool(CORES, _start, (barrier,)) as workers:
        barrier.wait()
        yield workers


def numpy_curves(workers: Pool, arrangement: Arrangement, angles: int, errors: Errors) -> Curves:
    """Return the NumPy kernel's curves at the first of the 936 angles [rad]."""
    share = partial(_share, angles, arrangement.batch)
    if arrangement.processes == 1:
        with threadpool_limits(arrangement.blas_threads, "blas"):
            return share(errors)
    turns = -(-len(errors) // (arrangement.processes * arrangement.batch))  # equal shares end together
    return np.concatenate(workers.map(share, np.array_split(errors, arrangement.processes * turns), chunksize=1))


def trial(workers: Pool, errors: Errors) -> dict[Arrangement, float]:
    """Return the rate of every arrangement, tried at a few angles, in curves of 936 angles [1/s]."""
    arrangements = {Arrangement(1, threads, batch) for threads in (1, CORES) for batch in _BATCHES[1:]}
    arrangements |= {Arrangement(CORES, 1, batch) for batch in _BATCHES}
    rates = {}
    for arrangement in sorted(arrangements):
        units = errors[np.arange(arrangement.processes * arrangement.batch) % len(errors)]
        solve = partial(numpy_curves, workers, arrangement, TRIAL_ANGLES, units)
        rates[arrangement] = len(units) * TRIAL_ANGLES / ANGLES / min(timed(solve)[0] for _ in range(3))
        print(f"trial of NumPy, {arrangement}: {rates[arrangement]:.0f} curves/s", file=sys.stderr, flush=True)
    return rates
