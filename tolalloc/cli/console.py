"""Talking to a person: progress on standard error, answers on standard output, errors in one sentence.

Sentences are printed plainly; rich draws tables and progress, and is imported there.
"""

from __future__ import annotations

import json
import sys
import time
from math import isnan
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    import pandas as pd
    from rich.progress import TaskID

    from tolalloc.report.answer import Answer

AsJson = Annotated[bool, typer.Option("--json", help="Print machine-readable output only.")]
ReportFolder = Annotated[Path | None, typer.Option(help="Write a report into this folder, new or empty.")]


def note(sentence: str, *, dim: bool = False) -> None:
    """Tell something beside the answer, on standard error."""
    typer.secho(sentence, dim=dim or None, err=True)


def announce_compilation(room: str = "equivalent") -> None:
    """Say what the next minute is spent on where a room of this version has not run on this machine before."""
    from tolalloc.compiled import is_kept

    module, lasts = {"equivalent": ("turn", "about a minute"), "cycloid": ("distance", "some seconds")}[room]
    if not is_kept(module):
        note(f"Compiling the kernel for this machine: {lasts}, once.", dim=True)


def print_json(answer: dict[str, Any]) -> None:
    """Print an answer for a program."""
    sys.stdout.write(json.dumps(answer, ensure_ascii=False, indent=2) + "\n")


def print_table(frame: pd.DataFrame, title: str) -> None:
    """Print a table for a person."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title))
    for number, name in enumerate(frame.columns):
        table.add_column(escape(str(name)), justify="left" if number == 0 else "right", no_wrap=number == 0)
    for row in frame.itertuples(index=False):
        table.add_row(*(escape(_cell(value)) for value in row))
    Console().print(table)


def _cell(value: object) -> str:
    """Return a cell with four significant digits; what is not there stays empty."""
    if isinstance(value, float):
        return "" if isnan(value) else f"{value:.4g}"
    return str(value)


def tell(answer: Answer, as_json: bool, *tables: tuple[pd.DataFrame, str]) -> None:
    """Print an answer: its summary for a program; titled tables, its sentences and its warnings for a person."""
    if as_json:
        print_json(answer.summary)
        return
    for frame, title in tables:
        print_table(frame, title)
    for sentence in answer.sentences:
        typer.echo(sentence)
    for warning in answer.warnings:
        typer.secho(warning, fg="yellow")


def write_report(answer: Answer, out: Path | None) -> None:
    """Write the report on an answer into a folder, if one was asked for."""
    if out:
        note(f"Report: {answer.save(out) / 'report.html'}")


class UnitProgress:
    """A line per stage with the number of solved units, or of other things, and their rate."""

    def __init__(self, counted: str = "units") -> None:
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
