"""Workers of a scheduler: their speed beside two threads, the scheduler's memory, and a simulation of many of them.

    python studies/benchmarks/fleet.py [--units 100000] [--json]

A scheduler and two workers, a process each, solve random RV-20E units, peak-to-peak. Measured are the seconds of a
chunk on a worker, those that this process spends on one (chunks that nobody solves, sent there and back), and
the largest memory of the scheduler. More workers than two cores hold are simulated from these two times: chunks
are handed out one after the other, three a worker are under way, their answers are taken in order.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Thread
from typing import Any

import numpy as np
import psutil
from distributed import Client

sys.path.insert(0, str(Path(__file__).parents[2]))

import tolalloc as ta
from tests.builders import prepared
from tolalloc.drawings.seeds import SeedTree
from tolalloc.running.chunks import SAMPLES_AT_ONCE
from tolalloc.running.compiled import use_threads
from tolalloc.running.workers import AHEAD, workers_at

WORKERS = 2
PORT = 8799
ADDRESS = f"tcp://127.0.0.1:{PORT}"
SIMULATED = (2, 4, 8, 16, 32, 64, 128, 256)
MEBIBYTE = 2**20


@contextmanager
def running(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a module of the interpreter while the block runs."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-m", *words], **quiet) as process:
        try:
            yield process
        finally:
            process.terminate()


@contextmanager
def largest_memory(process: int) -> Iterator[list[int]]:
    """Watch the resident memory of a process [byte]."""
    seen, done = [psutil.Process(process).memory_info().rss], Event()

    def watch() -> None:
        while not done.wait(0.05):
            seen[0] = max(seen[0], psutil.Process(process).memory_info().rss)

    watcher = Thread(target=watch)
    watcher.start()
    try:
        yield seen
    finally:
        done.set()
        watcher.join()


def nothing(chunk: np.ndarray) -> np.ndarray:
    """Return an answer as large as that of a solved chunk."""
    return chunk[:, :2].copy()


def taken(start: float) -> float:
    """Return the time since a moment [s]."""
    return time.perf_counter() - start


def simulated(workers: int, chunks: int, task: float, serial: float) -> float:
    """Return the efficiency of so many workers [-]."""
    now, ends, free = 0.0, deque[float](), [0.0] * workers
    for _ in range(chunks):
        if len(ends) >= AHEAD * workers:
            now = max(now, ends.popleft())
        now += serial  # of sending this chunk and taking another one's answer
        first = min(range(workers), key=free.__getitem__)
        free[first] = max(free[first], now) + task
        ends.append(free[first])
    return chunks * task / (workers * max(now, *ends))


def measured(units: int) -> dict[str, Any]:
    """Return times and memory of a real scheduler with two workers."""
    study = prepared()
    uniform = np.concatenate([*SeedTree(5).uniform_chunks(units, len(study.errors.columns))])
    x = study.errors.deviations(study.errors.standard_values(uniform), study.errors.zones)
    reading = (ta.PEAK_TO_PEAK,)
    study.model.reading(reading)(x[:SAMPLES_AT_ONCE])
    with ExitStack() as stack:
        place = Path(stack.enter_context(TemporaryDirectory()))
        own = ("distributed.cli.dask_scheduler", "--port", str(PORT), "--no-dashboard", "--no-show")
        scheduler = stack.enter_context(running(*own))
        for _ in range(WORKERS):
            where = ("--local-directory", str(place), "--nthreads", "1", "--no-dashboard")
            stack.enter_context(running("distributed.cli.dask_worker", ADDRESS, *where))
        with Client(ADDRESS, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(WORKERS, timeout=60)
        workers = stack.enter_context(workers_at(ADDRESS))
        mapped = study.model.mapped(workers).reading(reading)
        mapped(x[: 8 * SAMPLES_AT_ONCE])
        parts = [x[first : first + SAMPLES_AT_ONCE] for first in range(0, units, SAMPLES_AT_ONCE)]
        start = time.perf_counter()
        list(workers(nothing, parts))
        serial = taken(start) / len(parts)
        before = psutil.Process(scheduler.pid).memory_info().rss
        with largest_memory(scheduler.pid) as most:
            start = time.perf_counter()
            mapped(x)
            by_workers = taken(start)
    use_threads(WORKERS)
    start = time.perf_counter()
    study.model.reading(reading)(x)
    by_threads = taken(start)
    use_threads(1)
    start = time.perf_counter()
    study.model.reading(reading)(x[: 8 * SAMPLES_AT_ONCE])
    task = taken(start) / 8
    return {
        "units": units,
        "chunks": len(parts),
        "bytes of a chunk": int(parts[0].nbytes),
        "workers [s]": by_workers,
        "threads [s]": by_threads,
        "a chunk on one thread [s]": task,
        "a chunk in this process [s]": serial,
        "scheduler before [MiB]": before / MEBIBYTE,
        "scheduler, most [MiB]": most[0] / MEBIBYTE,
        "simulated efficiency": {own: simulated(own, 100 * own, task, serial) for own in SIMULATED},
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--units", type=int, default=100_000, help="units that are solved")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    if asked.units < 8 * SAMPLES_AT_ONCE:
        parser.error(f"--units is {asked.units}; allowed is {8 * SAMPLES_AT_ONCE} or more.")
    found = measured(asked.units)
    if asked.json:
        print(json.dumps(found, indent=2))
        return
    for name, value in found.items():
        print(f"{name}: {value}" if not isinstance(value, float) else f"{name}: {value:.4g}")
    print(f"two workers over two threads: {found['threads [s]'] / found['workers [s]']:.2f}")


if __name__ == "__main__":
    main()
