"""The commands that ask a study: ``run`` and its short names ``rank`` and ``allocate``."""

from __future__ import annotations

from collections.abc import Callable, Container
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolalloc.cli.console import AsJson, announce_kernel, note, print_json, print_table, say, shown_progress, tell
from tolalloc.cli.options import parameters_of, taking
from tolalloc.exceptions import InputError, StoppedError
from tolalloc.study.script import load_study

if TYPE_CHECKING:
    from tolalloc.running.chunks import Mapper
    from tolalloc.study.answer import Answer
    from tolalloc.study.study import Run, Study

Script = Annotated[Path, typer.Argument(help="Python script that defines study = Study(...).")]
Quick = Annotated[bool, typer.Option("--quick", help="Small samples, wide intervals; every stage is real.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Solve all units again, cached or not.")]
Scheduler = Annotated[
    str,
    typer.Option(help="Workers that solve the units: 'local' for one per core, or the address of a Dask scheduler."),
]
Verbose = Annotated[bool, typer.Option("--verbose", help="Print every sentence of the report.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Also print the report as report.pdf, with an installed browser.")]

_ROWS = 16  # of an answer's first table that are printed
_WARNINGS = 2
"""Warnings of all answers together that are said where the report holds them all [-]."""


@dataclass(frozen=True, kw_only=True)
class _Way:
    """How a study is run: the options that ``run``, ``rank`` and ``allocate`` share, in the order of their help."""

    quick: Quick = False
    seconds: Annotated[
        float | None,
        typer.Option(help="Approximate time for ranking and allocation together, at an assumed rate [s]."),
    ] = None
    seed: Annotated[int | None, typer.Option(help="Seed of every random number, instead of the study's.")] = None
    out: Annotated[
        Path | None,
        typer.Option(help="Run folder, new or empty; the next one of runs/NAME, runs/NAME-2, … unless given."),
    ] = None
    fresh: Fresh = False
    scheduler: Scheduler = ""
    pdf: Pdf = False
    paper: Annotated[str, typer.Option(help="Paper of --pdf: A4 or Letter.")] = "A4"
    verbose: Verbose = False
    as_json: AsJson = False

    def study(self, script: Path) -> Study:
        """Return the study of a script with what the command line changes."""
        study = load_study(script)
        if self.seed is not None:
            study = replace(study, seed=self.seed)
        if self.quick:
            study = study.with_effort("quick")
        return study if self.seconds is None else study.with_effort(replace(study.effort, seconds=self.seconds))


def _going(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that has the options of `_Way` behind its own."""
    *own, _ = parameters_of(command)

    @wraps(command)
    def asked(**given: Any) -> None:
        command(**{one.name: given.pop(one.name) for one in own if one.name in given}, way=_Way(**given))

    return taking(asked, (*own, *parameters_of(_Way)))


@_going
def run(
    script: Script,
    only: Annotated[str, typer.Option(help="Questions to answer, such as ranking,allocation; all unless given.")] = "",
    *,
    way: _Way,
) -> None:
    """Run a study: every question once, one folder, one report."""
    _run(way.study(script), tuple(kind.strip() for kind in only.split(",") if kind.strip()), "", way)


@_going
def rank(script: Script, *, way: _Way) -> None:
    """Rank the errors that drive outputs, orders and rejects: short for run --only ranking."""
    _run(way.study(script), ("ranking",), "-rank", way)


@_going
def allocate(
    script: Script,
    limit: Annotated[float | None, typer.Option(help="New first limit of the study, in its unit.")] = None,
    yield_target: Annotated[
        float | None, typer.Option("--yield", help="New share of units that must keep the first limit.")
    ] = None,
    grades: Annotated[
        bool, typer.Option("--grades", help="Only zones of ISO 286 grades and preferred numbers.")
    ] = False,
    *,
    way: _Way,
) -> None:
    """Find the cheapest drawing that keeps every limit, verified: short for run --only allocation."""
    from tolalloc.study.questions import Allocation, questions_of

    study = _with_first_limit(way.study(script), limit, yield_target)
    if grades:
        own = questions_of(("allocation",), study.questions, "tolalloc allocate")[0]
        graded = replace(own, grades=True) if isinstance(own, Allocation) else own
        study = replace(study, questions=(*(q for q in study.questions if q.kind != "allocation"), graded))
    _run(study, ("allocation",), "-allocate", way)


def _with_first_limit(study: Study, limit: float | None, yield_target: float | None) -> Study:
    """Return the study with another first limit or yield."""
    if limit is None and yield_target is None:
        return study
    if not study.limits:
        raise InputError(f"study {study.name}: it has no limits that --limit or --yield could change.")
    leading, own = next(((name, own) for name, own in study.limits.items() if own), ("", None))
    if own is None:
        return study
    if limit is not None and own.upper is None:
        raise InputError.at("tolalloc allocate", "--limit", limit, f"left out: {leading} has no upper limit to change")
    changed = own if limit is None else replace(own, upper=limit)
    if yield_target is not None:
        from tolalloc.allocation.space.requirement import AtYield

        changed = replace(changed, show=AtYield(target=yield_target))
    return replace(study, limits={**study.limits, leading: changed})


def _places(named: Path | None, name: str) -> tuple[Path, Path | None]:
    """Return the folder of a run and the last finished one before it: where none is named, the next numbered in runs.

    So a study runs again after an edit.
    """
    from tolalloc.reports.finished_run import finished
    from tolalloc.reports.folder import RUNS, numbered

    if named:
        return named, None
    *earlier, folder = numbered(RUNS / name)
    last = finished(earlier)[-1:]
    return folder, last[0].folder if last else None


def _tell_changes(before: Path, folder: Path) -> None:
    """Say what changed since the run before; nothing where one of the two is no ranking and no allocation."""
    from tolalloc.reports.tellers.comparison import ComparisonTeller
    from tolalloc.running.progress import SILENT
    from tolalloc.study.inquiries.compare import Compare

    with suppress(InputError):
        asked = Compare(first=before, second=folder)
        found = asked.solve(asked.prepare(), SILENT)
        for sentence in ComparisonTeller(found.result, found.header).since:
            say(sentence)


def _run(study: Study, kinds: tuple[str, ...], ending: str, way: _Way) -> None:
    """Run some questions of a study, write its folder, named after it unless given, and say the answers."""
    from tolalloc.reports.pdf import require_printable, write_pdf
    from tolalloc.study.questions import questions_of
    from tolalloc.study.study import cache_beside
    from tolalloc.study.study import run as run_study

    folder, before = _places(way.out, f"{study.name}{ending}")
    paper = way.paper if way.pdf else ""
    questions = questions_of(kinds, study.questions, f"study {study.name}")
    if paper:
        require_printable(paper)
    announce_kernel(study.model)
    try:
        with solvers(way.scheduler) as solved_by, shown_progress() as progress:
            found = run_study(study, folder, questions, progress, fresh=way.fresh, solved_by=solved_by)
    except KeyboardInterrupt:
        kept = cache_beside(folder).folder
        what = f"Solved units are kept in {kept}; the same command continues from there."
        raise StoppedError(
            f"Stopped: no report was written. {what if kept.is_dir() else 'Nothing was kept.'}"
        ) from None
    if paper:
        with shown_progress() as progress:
            progress.begin("printing")
            write_pdf(folder / "report.html", folder / "report.pdf", paper)
        note(f"Printed: {folder / 'report.pdf'}")
    if way.as_json:
        print_json({"folder": str(folder), **found.document.summary})
    else:
        _tell_answers(found, way)
        if before:
            _tell_changes(before, folder)
    for returned in sorted(folder.glob("*_allocated.*")):
        if returned.suffix != ".toml":  # what its heads mean
            note(f"Your table with the new zones: {returned}")
    note(f"Report: {folder / 'report.html'}")


def solvers(scheduler: str) -> AbstractContextManager[Mapper]:
    """Return what solves the units: this process, or the workers of a scheduler."""
    if not scheduler:
        return nullcontext(map)
    from tolalloc.running.workers import workers_at

    return workers_at(scheduler)


def _tell_answers(found: Run, way: _Way) -> None:
    """Print the answers in short, what is better done before first, or in full; and the first of their warnings."""
    # What has a table to show, such as a drawing, comes first.
    answers = sorted(found.answers.values(), key=lambda own: own.teller.headline_table is None)
    unsaid, first = set[str](), tuple(sentence for own in answers for sentence in own.teller.before)
    if not way.verbose:
        for sentence in first:
            say(sentence)
    for answer in answers:
        if way.verbose or not answer.teller.headline:
            _show(answer)
        else:
            _show_headline(answer, first)
            unsaid.update(answer.warnings)
    warnings = [warning for warning in found.document.warnings if warning in unsaid]
    for warning in warnings[:_WARNINGS]:
        say(warning, warns=True)
    if (more := len(warnings) - _WARNINGS) > 0:
        say(f"{more} more {'note' if more == 1 else 'notes'} in the report, or with --verbose.", warns=True)


def _show_headline(answer: Answer[Any], said: Container[str]) -> None:
    """Print the first sentences of an answer but those that were said, and its one table."""
    for sentence in answer.teller.headline:
        if sentence not in said:
            say(sentence)
    if table := answer.teller.headline_table:
        print_table(*table)


def _show(answer: Answer[Any]) -> None:
    """Print the first table of an answer, its sentences and its warnings."""
    tables = []
    if answer.tables:
        frame = answer.to_frame()
        columns = [column for column in answer.teller.shown if column in frame.columns] or list(frame.columns[:6])
        part = f", first {_ROWS} of {len(frame)} rows" if len(frame) > _ROWS else ""
        tables = [(frame[columns].head(_ROWS), f"{answer.header.name}: {answer.kind}{part}")]
    tell(answer, False, *tables)
