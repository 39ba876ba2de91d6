"""How far the work has come: what a person is shown, and what the manifest keeps of statuses and times."""

from __future__ import annotations

import ctypes
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import UInt8

_OF_THE_HEAP = 2**20
"""Size up to which memory comes from the heap, where what is freed between what is kept stays [bytes]."""
_MMAP_THRESHOLD = -3
"""The C library's name of that size."""


@runtime_checkable
class Progress(Protocol):
    """What shows a person how far the work has come."""

    def begin(self, stage: str, units: int = 0, counted: str = "") -> None:
        """Begin a stage of so many units, 0 where nobody knows, or of other things that are counted."""

    def advance(self, units: int) -> None:
        """So many more units are solved."""

    def tell(self, sentence: str) -> None:
        """Say what is known already, before the work is done."""


class Silent:
    """Progress that nobody is shown, as in a script or a notebook."""

    def begin(self, stage: str, units: int = 0, counted: str = "") -> None:
        """Begin a stage."""

    def advance(self, units: int) -> None:
        """So many more units are solved."""

    def tell(self, sentence: str) -> None:
        """Say what is known already."""


SILENT = Silent()
"""Whom functions tell of their stages where nobody listens."""


@dataclass
class RunRecord:
    """What the manifest says of the run itself: statuses and times per stage."""

    progress: Progress  # Told of every stage and every chunk of units
    outcomes: Mapping[int, str]  # Status → outcome in words; the model's own
    statuses: Counter[int] = field(default_factory=Counter)
    stages: dict[str, dict[str, float]] = field(default_factory=dict)
    # What is done before the first stage, once everything that can be refused has been
    opening: Callable[[], None] | None = None

    @contextmanager
    def stage(self, name: str, expected: int = 0) -> Iterator[None]:
        """Time a stage and count its units, of which so many are expected; 0 where nobody knows."""
        if self.opening:
            opening, self.opening = self.opening, None
            opening()
        self.progress.begin(name, expected)
        _give_back()
        units, start = sum(self.statuses.values()), time.perf_counter()
        yield
        _give_back()
        seconds, solved = time.perf_counter() - start, sum(self.statuses.values()) - units
        self.stages[name] = {
            "seconds": round(seconds, 3),
            "units": solved,
            "units per second": round(solved / seconds, 1),
        }

    def observe(self, status: UInt8[np.ndarray, " sample"]) -> None:
        """Count the statuses of one chunk."""
        counts = np.bincount(status)
        self.statuses.update({int(value): int(counts[value]) for value in np.flatnonzero(counts)})
        self.progress.advance(status.size)

    @property
    def counts(self) -> dict[str, int]:
        """Outcome → number of units [-]."""
        return {sentence: self.statuses[status] for status, sentence in self.outcomes.items()}


def _give_back() -> None:
    """Give freed memory back to the system, now and as soon as it is freed: Linux's C library keeps 100 MiB of it."""
    if sys.platform == "linux" and hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        library.mallopt(_MMAP_THRESHOLD, _OF_THE_HEAP)
        library.malloc_trim(0)
