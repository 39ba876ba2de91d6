"""Talking to a person: progress on standard error, answers on standard output, errors in one sentence."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from tolalloc.compiled import is_kept

screen = Console()
messages = Console(stderr=True)


def announce_compilation(room: str = "equivalent") -> None:
    """Say what the next minute is spent on where a room of this version has not run on this machine before."""
    module, lasts = {"equivalent": ("turn", "about a minute"), "cycloid": ("distance", "some seconds")}[room]
    if not is_kept(module):
        messages.print(f"Compiling the kernel for this machine: {lasts}, once.", style="dim")


class UnitProgress:
    """A line per stage with the number of solved units, or of other things, and their rate."""

    def __init__(self, counted: str = "units") -> None:
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description:<24}"),
            BarColumn(bar_width=24),
            TextColumn(f"{{task.completed:>8.0f}} {counted}"),
            TextColumn(f"{{task.fields[rate]:>7.1f}} {counted}/s"),
            TimeElapsedColumn(),
            console=messages,
        )
        self._task: TaskID | None = None
        self._began, self._units = 0.0, 0

    def __enter__(self) -> UnitProgress:
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
        self._task = self._bar.add_task(stage, total=None, rate=0.0)
        self._began, self._units = time.perf_counter(), 0

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        if self._task is None:
            return
        self._units += units
        rate = self._units / max(time.perf_counter() - self._began, 1e-9)
        self._bar.update(self._task, advance=units, rate=rate)

    def _end(self) -> None:
        if self._task is not None:
            self._bar.update(self._task, total=max(self._units, 1), completed=max(self._units, 1))
