"""Chunks of units given to the workers of a Dask scheduler: few long tasks, the same bits as in this process."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError, in_short
from tolalloc.running.chunks import one_thread
from tolalloc.running.compiled import thread_count
from tolalloc.running.result_cache import code_digest

LOCAL = "local"
"""What stands for workers on this machine, one per core."""
_PATIENCE = 20
"""Time that a scheduler has to answer [s]."""
AHEAD = 3
"""Chunks per worker that are under way, so that neither workers nor the scheduler's memory wait for each other [-]."""


@dataclass(frozen=True, kw_only=True)
class Workers:
    """A mapper, as `tolalloc.running.chunks.map_chunks` takes it, whose chunks the workers of a scheduler solve.

    A worker that is lost has its chunks solved by another one; a chunk that is solved twice has the same bits, because
    it follows from what it is sent alone. Answers are taken in the order of the chunks, in whatever order they arrive.
    """

    client: Any  # Connection to the scheduler, a `distributed.Client`

    def __call__(
        self,
        solve: Callable[[Float[np.ndarray, "chunk column"]], Any],
        chunks: Iterable[Float[np.ndarray, "chunk column"]],
    ) -> Iterator[Any]:
        """Yield the answers in the order of the chunks."""
        under_way: deque[Any] = deque()
        for chunk in chunks:
            if len(under_way) >= AHEAD * max(len(self.client.nthreads()), 1):
                yield self._taken(under_way.popleft())
            under_way.append(self.client.submit(solve, chunk, pure=False))
        while under_way:
            yield self._taken(under_way.popleft())

    @staticmethod
    def _taken(future: Any) -> Any:
        from distributed.scheduler import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise SolveError(f"The workers that solved a chunk of units were lost again and again ({error}).") from None


@contextmanager
def workers_at(address: str) -> Iterator[Workers]:
    """Give the workers of a scheduler at an address, or those of this machine at ``local``."""
    try:
        from distributed import Client, LocalCluster
        from distributed.comm import get_address_host_port
    except ImportError:
        raise InputError("workers: Dask is not installed; pip install 'tolalloc[distributed]'.") from None
    if address != LOCAL:
        try:
            full = address if "://" in address else f"tcp://{address}"
            get_address_host_port(full, strict=True)  # a client of no address hangs when it is closed
            client = Client(full, timeout=_PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            allowed = f"'{LOCAL}' or the address of a scheduler that answers ({in_short(str(error))})"
            raise InputError.of_argument("workers", "scheduler", address, allowed) from None
        with client:
            yield _prepared(client, address)
        return
    cluster = LocalCluster(n_workers=thread_count(), threads_per_worker=1, dashboard_address=":0", silence_logs=40)
    with cluster, Client(cluster, set_as_default=False) as client:
        yield _prepared(client, address)


def _prepared(client: Any, address: str) -> Workers:
    """Return the workers with one thread each, once all are known to have this version of the package."""
    found = client.run(code_digest)
    if not found:
        raise InputError.of_argument("workers", "scheduler", address, "a scheduler that has workers; start some first")
    others = [worker for worker, digest in found.items() if digest != code_digest()]
    if others:
        raise InputError(f"workers: the worker {others[0]} has another version of tolalloc; install the same one.")
    client.register_plugin(_one_thread_plugin())
    return Workers(client=client)


def _one_thread_plugin() -> Any:
    """Return what gives every worker one thread, those that come later too."""
    from distributed import WorkerPlugin

    class OneThread(WorkerPlugin):  # type: ignore[misc]
        """One thread a worker: the workers share the cores."""

        name = "tolalloc-one-thread"

        def setup(self, worker: Any) -> None:  # noqa: ARG002
            one_thread()

    return OneThread()
