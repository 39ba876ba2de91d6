"""How far the work has come, on standard error: moving bars on a terminal, plain lines in a log."""

from __future__ import annotations

import sys
import time
from contextlib import AbstractContextManager
from types import TracebackType
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from rich.progress import TaskID

    from tolalloc.running.progress import Progress

_BETWEEN = 5.0
"""Time between two lines of one stage in a log [s]."""


def shown_progress(counted: str = "units") -> AbstractContextManager[Progress]:
    """Return what shows how many units, or other things, every stage has solved."""
    return Bars(counted) if sys.stderr.isatty() else Lines(counted)


class Lines:
    """A line every few seconds while a stage works, and one when it ends."""

    def __init__(self, counted: str) -> None:
        self._counted, self._stage = counted, ""
        self._began = self._told = self._units = 0.0

    def __enter__(self) -> Lines:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end("stopped" if kind else "done")

    def begin(self, stage: str) -> None:
        """Begin a stage; the one before is finished."""
        self._end("done")
        self._stage, self._units = stage, 0
        self._began = self._told = time.perf_counter()

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        self._units += units
        if self._stage and time.perf_counter() - self._told >= _BETWEEN:
            self._tell("so far")

    def _end(self, how: str) -> None:
        if self._stage:
            self._tell(how)
        self._stage = ""

    def _tell(self, how: str) -> None:
        self._told = time.perf_counter()
        took = self._told - self._began
        solved = f"{self._units:.0f} {self._counted} in " if self._units else ""
        rate = f", {self._units / took:.0f} {self._counted}/s" if self._units and took > 0 else ""
        typer.echo(f"{self._stage}: {how}, {solved}{took:.1f} s{rate}", err=True)


class Bars:
    """A moving bar per stage with the number of solved units, or of other things, and their rate."""

    def __init__(self, counted: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description:<24}", markup=False),
            BarColumn(bar_width=24),
            TextColumn(f"{{task.fields[counted]:>8.0f}} {counted}"),
            TextColumn(f"{{task.fields[rate]:>7.1f}} {counted}/s"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._task: TaskID | None = None
        self._began, self._units = 0.0, 0

    def __enter__(self) -> Bars:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()
        self._bar.stop()

    def begin(self, stage: str) -> None:
        """Begin a stage; the one before is finished."""
        self._end()
        self._task = self._bar.add_task(stage, total=None, rate=0.0, counted=0)
        self._began, self._units = time.perf_counter(), 0

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        if self._task is None:
            return
        self._units += units
        rate = self._units / max(time.perf_counter() - self._began, 1e-9)
        self._bar.update(self._task, counted=self._units, rate=rate)

    def _end(self) -> None:
        if self._task is not None:
            self._bar.update(self._task, total=1, completed=1)
