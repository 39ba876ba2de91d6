"""What commands print: answers on standard output; notes, warnings and how far the work has come on standard error."""

from __future__ import annotations

import json
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, redirect_stdout
from contextvars import ContextVar
from dataclasses import dataclass, field
from math import isnan
from pathlib import Path
from threading import Event, RLock, Thread
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

from tolalloc.reports.wording import signed, true_minus

if TYPE_CHECKING:
    import pandas as pd
    from rich.progress import TaskID

    from tolalloc.running.progress import Progress
    from tolalloc.study.answer import Answer

_ANSWERS: ContextVar[TextIO | None] = ContextVar("answers", default=None)
"""Where answers to a program go while nothing else shall go there."""
_PAUSE = 5.0
"""Time to the first line of a stage in a log; each further one comes after twice the time [s]."""
_SHORT = 2.0
"""Stages that solve nothing and take less are not worth a line [s]."""
AsJson = Annotated[bool, typer.Option("--json", help="Print machine-readable output only.")]
ReportFolder = Annotated[Path | None, typer.Option(help="Write a report into this folder, new or empty.")]
_BETWEEN = 3
"""Blanks between two columns [characters]."""
_ROOM_FOR_BARS = 110
"""Characters of a line from which a moving bar leaves room for its numbers [-]."""
_NARROWEST = 40
"""Characters of a line below which nothing is broken [-]."""
_UNIT = re.compile(r"(?<=\d) (?=(?:%|µm|mm|N|N·m|s|units|arcmin|arcsec|K)(?![^\W\d_]))")
_JOINED = "\u00a0"
"""Blank between a number and its unit, which are not parted at the end of a line."""


def shown_progress(counted: str = "units") -> AbstractContextManager[Progress]:
    """Return what shows how many units, or other things, every stage has solved."""
    return Bars(counted) if sys.stderr.isatty() else Lines(counted)


@dataclass
class _Stage:
    """How far one stage has come."""

    name: str
    expected: int  # Units of the whole stage; 0 where nobody knows [-]
    counted: str
    units: int = 0
    began: float = field(default_factory=lambda: time.perf_counter())

    @property
    def seconds(self) -> float:
        """Time since it began [s]."""
        return time.perf_counter() - self.began

    @property
    def known(self) -> int:
        """Units of the whole stage; 0 where nobody knows, as where it has solved all that were expected and goes on."""
        return self.expected if self.units < self.expected else 0

    def solved(self, *, over: bool = False) -> str:
        """Return what is done, at which rate, and what is left at this rate; nothing before the first unit."""
        if not self.units:
            return ""
        of = f" of {self.known:,}" if self.known and not over else ""
        rate = self.units / max(self.seconds, 1e-9)
        at_rate = f"{rate:,.0f}" if rate >= 10 else f"{rate:.2g}"
        said = f"{self.units:,}{of} {self.counted}, {at_rate} {self.counted}/s"
        left = (self.known - self.units) / rate
        return f"{said}, {f'{left:.0f} s' if left < 100 else f'{left / 60:.0f} min'} left" if of else said


class Lines:
    """Lines while a stage works, whether or not units are done, each after twice the time, and one when it ends."""

    def __init__(self, counted: str) -> None:
        self._counted = counted
        self._stage: _Stage | None = None
        self._told, self._pause = 0.0, _PAUSE
        self._lock, self._over = RLock(), Event()
        self._clock = Thread(target=self._keep_telling, daemon=True, name="progress")

    def __enter__(self) -> Lines:
        self._told = time.perf_counter()
        self._clock.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._over.set()
        self._end("stopped" if kind else "done", short=kind is KeyboardInterrupt)

    def begin(self, stage: str, units: int = 0, counted: str = "") -> None:
        """Begin a stage of so many units, or of what is counted; the one before is finished."""
        self._end("done")
        with self._lock:
            self._stage, self._pause = _Stage(stage, units, counted or self._counted), _PAUSE

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        with self._lock:
            if self._stage:
                self._stage.units += units
        self._tell_at_times()

    def tell(self, sentence: str) -> None:
        """Say what is known already; the stage that found it is finished."""
        self._end("done")
        note(sentence)

    def _keep_telling(self) -> None:
        """Tell how far it is where nothing is solved for long, as while functions are compiled."""
        while not self._over.wait(1.0):
            self._tell_at_times()

    def _tell_at_times(self) -> None:
        with self._lock:
            if self._stage and time.perf_counter() - self._told >= self._pause:
                self._tell(self._stage, "so far")
                self._pause *= 2

    def _end(self, how: str, *, short: bool = False) -> None:
        with self._lock:
            if self._stage and (short or self._stage.units or self._stage.seconds >= _SHORT):
                self._tell(self._stage, how)
            self._stage = None

    def _tell(self, stage: _Stage, how: str) -> None:
        self._told = time.perf_counter()
        solved = stage.solved(over=how != "so far")
        typer.echo(f"{stage.name}: {how}, {stage.seconds:.1f} s" + (f", {solved}" if solved else ""), err=True)


class Bars:
    """A moving bar per stage with what is done, its rate, and the time that is left where it is known."""

    def __init__(self, counted: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
        from rich.table import Column

        console = Console(stderr=True)
        bar = (BarColumn(bar_width=24),) if console.width >= _ROOM_FOR_BARS else ()
        self._bar = Progress(
            SpinnerColumn(table_column=Column(no_wrap=True, min_width=1)),
            TextColumn("{task.description:<24}", markup=False, table_column=Column(no_wrap=True, min_width=24)),
            *bar,
            TimeElapsedColumn(table_column=Column(no_wrap=True, min_width=7)),
            TextColumn("{task.fields[solved]}", markup=False, table_column=Column(overflow="fold")),
            console=console,
        )
        self._counted = counted
        self._task: TaskID | None = None
        self._stage = _Stage("", 0, counted)

    def __enter__(self) -> Bars:
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._end(stopped=kind is not None)
        self._bar.stop()

    def begin(self, stage: str, units: int = 0, counted: str = "") -> None:
        """Begin a stage of so many units, or of what is counted; the one before is finished."""
        self._end()
        self._stage = _Stage(stage, units, counted or self._counted)
        self._task = self._bar.add_task(stage, total=units or None, solved="")

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        if self._task is None:
            return
        self._stage.units += units
        if not self._stage.known:  # all that were expected are done, and it goes on: a full bar would say that it ends
            next(own for own in self._bar.tasks if own.id == self._task).total = None
        self._bar.update(self._task, completed=self._stage.units, solved=self._stage.solved())

    def tell(self, sentence: str) -> None:
        """Say what is known already, above the bars; the stage that found it is finished."""
        self._end()
        self._bar.console.print(sentence, markup=False, highlight=False)

    def _end(self, *, stopped: bool = False) -> None:
        if self._task is None:
            return
        stage = self._stage
        if stopped:
            self._bar.update(self._task, total=stage.known or 1, completed=stage.units if stage.known else 0)
            self._bar.stop_task(self._task)
        elif stage.units or stage.seconds >= _SHORT:
            self._bar.update(self._task, total=1, completed=1, solved=stage.solved(over=True))
        else:
            self._bar.remove_task(self._task)
        self._task = None


def note(sentence: str, *, dim: bool = False) -> None:
    """Tell something beside the answer, on standard error."""
    typer.secho(_broken(sentence, sys.stderr), dim=dim or None, err=True)


def announce_compilation() -> None:
    """Say what the next minute is spent on where the kernel of this version has not run on this machine before."""
    from tolalloc.running.compiled import is_kept

    if not is_kept("turn"):
        note("Compiling the kernel for this machine: some twenty seconds, once.", dim=True)


def announce_kernel(model: object) -> None:
    """Say the same of the kernel of a study's model; a user's own model has none."""
    from tolalloc.models.function_model import FunctionModel

    if isinstance(model, FunctionModel):  # the room of reducers takes a second to load
        return
    from tolalloc.reducers.choice import ReducerChoice
    from tolalloc.reducers.equivalent.compiled_ahead import compile_ahead

    if isinstance(model, ReducerChoice):
        announce_compilation()
        compile_ahead(model.reducer.disc_count)


def print_json(answer: dict[str, Any]) -> None:
    """Print an answer for a program."""
    (_ANSWERS.get() or sys.stdout).write(json.dumps(answer, ensure_ascii=False, indent=2) + "\n")


@contextmanager
def answers_alone() -> Iterator[None]:
    """Keep standard output for the answer to a program: what a user's script or function prints goes to the errors."""
    token = _ANSWERS.set(sys.stdout)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _ANSWERS.reset(token)


def print_table(frame: pd.DataFrame, title: str) -> None:
    """Print a table for a person; words are wrapped where the screen is narrow, numbers never.

    Columns that do not stand beside the others follow in a table of their own, with the first column again.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console, names = Console(), [str(name) for name in frame.columns]
    rows = [list(map(_cell, row, names)) for row in frame.itertuples(index=False)]
    cells = [[row[column] for row in rows] for column in range(len(names))]
    words = [word for text in (names[0], *cells[0]) for word in text.split()]
    first = max(map(len, words), default=1)
    widths = [max(map(len, (" ", *name.split(), *own))) for name, own in zip(names, cells, strict=True)]
    for number, columns in enumerate(_side_by_side(widths[1:], console.width - first)):
        heading = escape(title if number == 0 else f"{title}, continued")
        table = Table(title=heading, title_justify="left", box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
        shown = [0, *columns]
        least = [first, *(widths[column] for column in columns)]
        most = [max(map(len, (names[column], *cells[column]))) for column in shown]
        room = console.width - _BETWEEN * len(columns)
        named = _widened(least, [most[0], *least[1:]], room)  # a head may have several lines, a name had better not
        for column, width in zip(shown, _widened(named, most, room), strict=True):
            table.add_column(escape(names[column]), justify="right" if column else "left", width=width)
        for row in rows:
            table.add_row(escape(row[0]), *(escape(row[column]) for column in columns))
        console.print(table)


def _side_by_side(widths: list[int], room: int) -> list[list[int]]:
    """Return the columns behind the first one, numbered from 1, in groups that stand side by side."""
    groups: list[list[int]] = [[]]
    left = room
    for column, width in enumerate(widths, start=1):
        if groups[-1] and width + _BETWEEN > left:
            groups.append([])
            left = room
        groups[-1].append(column)
        left -= width + _BETWEEN
    return groups


def _widened(least: list[int], most: list[int], room: int) -> list[int]:
    """Return widths of columns [characters]: none below its least, what room is left to those that have less than most.

    rich, left to itself, takes from columns in proportion and then cuts the last one.
    """
    widths = list(least)
    for _ in range(room - sum(least)):
        wanting = [at for at, width in enumerate(widths) if width < most[at]]
        if not wanting:
            break
        widths[max(wanting, key=lambda at: most[at] - widths[at])] += 1
    return widths


def _cell(value: object, name: str) -> str:
    """Return a cell with four significant digits and a true minus; what is not there stays empty.

    A share just below all is not rounded up to all.
    """
    if isinstance(value, float):
        if name.endswith("[%]") and value < 100.0 <= float(f"{value:.4g}"):
            return "99.99"
        return "" if isnan(value) else signed(f"{value:.4g}")
    return true_minus(str(value))


def tell(answer: Answer[Any], as_json: bool, *tables: tuple[pd.DataFrame, str]) -> None:
    """Print an answer: its summary for a program; titled tables, its sentences and its warnings for a person."""
    if as_json:
        print_json(answer.summary)
        return
    for frame, title in tables:
        print_table(frame, title)
    for sentence in answer.sentences:
        say(sentence)
    for warning in answer.warnings:
        say(warning, warns=True)


def say(sentence: str, *, warns: bool = False) -> None:
    """Print a sentence, or several lines, on a screen broken between words and never inside one."""
    typer.secho(_broken(sentence, sys.stdout), fg="yellow" if warns else None)


def _broken(text: str, stream: TextIO) -> str:
    """Return lines that fit a screen, what follows of a line under its beginning; as they are where it is no screen."""
    if not stream.isatty():
        return text
    width = max(shutil.get_terminal_size().columns, _NARROWEST)
    return "\n".join(_filled(line, width) for line in text.splitlines())


def _filled(line: str, width: int) -> str:
    """Return a line in as many as it needs; a number and its unit stay together."""
    indent = line[: len(line) - len(line.lstrip())]
    filled = textwrap.fill(
        _UNIT.sub(_JOINED, line.strip()),
        width,
        initial_indent=indent,
        subsequent_indent=indent + indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return filled.replace(_JOINED, " ")


def write_report(answer: Answer[Any], out: Path | None, progress: Progress) -> None:
    """Write the report on an answer into a folder, if one was asked for."""
    if out:
        progress.begin("report")
        progress.tell(f"Report: {answer.save(out) / 'report.html'}")
