"""The commands that ask a study: ``run`` and its short names ``rank`` and ``allocate``."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolalloc.cli.console import AsJson, announce_kernel, note, print_json, print_table, say, shown_progress, tell
from tolalloc.exceptions import InputError, StoppedError
from tolalloc.study.script import load_study

if TYPE_CHECKING:
    from tolalloc.running.chunks import Mapper
    from tolalloc.study.answer import Answer
    from tolalloc.study.study import Study

Script = Annotated[Path, typer.Argument(help="Python script that defines study = Study(...).")]
Quick = Annotated[bool, typer.Option("--quick", help="Small samples, wide intervals; every stage is real.")]
Seconds = Annotated[
    float | None,
    typer.Option(help="About how long ranking and allocation may take together, by a stated rate [s]."),
]
Seed = Annotated[int | None, typer.Option(help="Seed of every random number, instead of the study's.")]
Out = Annotated[
    Path | None, typer.Option(help="Run folder, new or empty; the next one of runs/NAME, runs/NAME-2, … unless given.")
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Solve again what runs beside this one have solved and kept.")]

Scheduler = Annotated[
    str,
    typer.Option(help="Workers that solve the units: 'local' for one per core, or the address of a Dask scheduler."),
]
Verbose = Annotated[bool, typer.Option("--verbose", help="Say everything that the report says in sentences.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Print the report as report.pdf too, by an installed browser.")]
Paper = Annotated[str, typer.Option(help="Paper of --pdf: A4 or Letter.")]

_ROWS = 16  # of an answer's first table that are printed
_WARNINGS = 2
"""Warnings of all answers together that are said where the report holds them all [-]."""


def run(
    script: Script,
    only: Annotated[str, typer.Option(help="Some of the questions, as ranking,allocation; all unless given.")] = "",
    quick: Quick = False,
    seconds: Seconds = None,
    seed: Seed = None,
    out: Out = None,
    fresh: Fresh = False,
    scheduler: Scheduler = "",
    pdf: Pdf = False,
    paper: Paper = "A4",
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Run a study: every question once, one folder, one report."""
    study = _asked(script, quick, seconds, seed)
    kinds = tuple(kind.strip() for kind in only.split(",") if kind.strip())
    _run(
        study,
        kinds,
        _Place.of(out, study.name),
        _Way(fresh, scheduler, paper if pdf else "", verbose, as_json),
    )


def rank(
    script: Script,
    quick: Quick = False,
    seconds: Seconds = None,
    seed: Seed = None,
    out: Out = None,
    fresh: Fresh = False,
    scheduler: Scheduler = "",
    pdf: Pdf = False,
    paper: Paper = "A4",
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Tell which error drives which output, which order and the rejects: short for run --only ranking."""
    study = _asked(script, quick, seconds, seed)
    place = _Place.of(out, f"{study.name}-rank")
    _run(study, ("ranking",), place, _Way(fresh, scheduler, paper if pdf else "", verbose, as_json))


def allocate(
    script: Script,
    limit: Annotated[
        float | None, typer.Option(help="First limit of the study, in its unit, instead of its own.")
    ] = None,
    yield_target: Annotated[
        float | None, typer.Option("--yield", help="Share of units that must keep the first limit, instead of its own.")
    ] = None,
    grades: Annotated[
        bool, typer.Option("--grades", help="Zones of ISO 286 grades and preferred numbers alone.")
    ] = False,
    quick: Quick = False,
    seconds: Seconds = None,
    seed: Seed = None,
    out: Out = None,
    fresh: Fresh = False,
    scheduler: Scheduler = "",
    pdf: Pdf = False,
    paper: Paper = "A4",
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Find the cheapest drawing that keeps every limit, verified: short for run --only allocation."""
    from tolalloc.study.questions import Allocation, questions_of

    study = _with_first_limit(_asked(script, quick, seconds, seed), limit, yield_target)
    if grades:
        own = questions_of(("allocation",), tuple(study.questions), "tolalloc allocate")[0]
        graded = replace(own, grades=True) if isinstance(own, Allocation) else own
        study = replace(study, questions=(*(q for q in study.questions if q.kind != "allocation"), graded))
    place = _Place.of(out, f"{study.name}-allocate")
    _run(study, ("allocation",), place, _Way(fresh, scheduler, paper if pdf else "", verbose, as_json))


def _asked(script: Path, quick: bool, seconds: float | None, seed: int | None) -> Study:
    """Return the study of a script with what the command line changes."""
    study = load_study(script)
    if seed is not None:
        study = replace(study, seed=seed)
    if quick:
        study = study.with_effort("quick")
    return study if seconds is None else study.with_effort(replace(study.effort, seconds=seconds))


def _with_first_limit(study: Study, limit: float | None, yield_target: float | None) -> Study:
    """Return the study with another first limit or yield.

    Raises
    ------
    InputError
        The study has no limits, or the first one has two sides.
    """
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


@dataclass(frozen=True)
class _Way:
    """How a run goes and what it gives beside its folder."""

    fresh: bool
    scheduler: str  # Whose workers solve the units; empty for this process
    paper: str  # On which the report is printed; empty if it is not
    verbose: bool  # Whether every sentence is said
    as_json: bool


@dataclass(frozen=True)
class _Place:
    """Where a run is written, and the run before it."""

    folder: Path
    before: Path | None  # The last finished run of the same name; none where a folder was named

    @classmethod
    def of(cls, named: Path | None, name: str) -> _Place:
        """Return the named folder; else the next numbered one in runs, so that the study runs again after an edit."""
        from tolalloc.reports.finished_run import finished
        from tolalloc.reports.folder import RUNS, numbered

        if named:
            return cls(named, None)
        *earlier, folder = numbered(RUNS / name)
        last = finished(earlier)[-1:]
        return cls(folder, last[0].folder if last else None)

    def tell_changes(self) -> None:
        """Say what changed since the run before; nothing where one of the two is no ranking and no allocation."""
        from tolalloc.reports.tellers.comparison import ComparisonTeller
        from tolalloc.running.progress import SILENT
        from tolalloc.study.inquiries.compare import Compare

        if self.before:
            with suppress(InputError):
                asked = Compare(first=self.before, second=self.folder)
                found = asked.solve(asked.prepare(), SILENT)
                for sentence in ComparisonTeller(found.result, found.header).since:
                    say(sentence)


def _run(study: Study, kinds: tuple[str, ...], place: _Place, way: _Way) -> None:
    """Run some questions of a study, write its folder and say the answers."""
    from tolalloc.reports.pdf import require_printable, write_pdf
    from tolalloc.study.questions import questions_of
    from tolalloc.study.study import cache_beside
    from tolalloc.study.study import run as run_study

    folder = place.folder
    questions = questions_of(kinds, tuple(study.questions), f"study {study.name}")
    if way.paper:
        require_printable(way.paper)
    announce_kernel(study.model)
    try:
        with solvers(way.scheduler) as solved_by, shown_progress() as progress:
            found = run_study(study, folder, questions, progress, fresh=way.fresh, solved_by=solved_by)
    except KeyboardInterrupt:
        kept = cache_beside(folder).folder
        what = f"Solved units are kept in {kept}; the same command goes on from there."
        raise StoppedError(
            f"Stopped: no report was written. {what if kept.is_dir() else 'Nothing was kept.'}"
        ) from None
    if way.paper:
        with shown_progress() as progress:
            progress.begin("printing")
            write_pdf(folder / "report.html", folder / "report.pdf", way.paper)
        note(f"Printed: {folder / 'report.pdf'}")
    if way.as_json:
        print_json({"folder": str(folder), **found.document.summary})
    else:
        # What has a table to show, such as a drawing, comes first.
        answers = sorted(found.answers.values(), key=lambda own: own.teller.headline_table is None)
        unsaid = set[str]()
        for answer in answers:
            if way.verbose or not answer.teller.headline:
                _show(answer)
            else:
                _show_headline(answer)
                unsaid.update(answer.warnings)
        warnings = [warning for warning in found.document.warnings if warning in unsaid]
        for warning in warnings[:_WARNINGS]:
            say(warning, warns=True)
        if (more := len(warnings) - _WARNINGS) > 0:
            say(f"{more} more {'note' if more == 1 else 'notes'} in the report, or with --verbose.", warns=True)
        place.tell_changes()
    note(f"Report: {folder / 'report.html'}")


def solvers(scheduler: str) -> AbstractContextManager[Mapper]:
    """Return what solves the units: this process, or the workers of a scheduler."""
    if not scheduler:
        return nullcontext(map)
    from tolalloc.running.workers import workers_at

    return workers_at(scheduler)


def _show_headline(answer: Answer[Any]) -> None:
    """Print the first sentences of an answer, and its one table."""
    for sentence in answer.teller.headline:
        say(sentence)
    if table := answer.teller.headline_table:
        print_table(*table)


def _show(answer: Answer[Any]) -> None:
    """Print the first table of an answer, its sentences and its warnings."""
    tables = []
    if answer.tables:
        frame = answer.to_frame()
        columns = [column for column in answer.shown if column in frame.columns] or list(frame.columns[:6])
        part = f", first {_ROWS} of {len(frame)} rows" if len(frame) > _ROWS else ""
        tables = [(frame[columns].head(_ROWS), f"{answer.header.name}: {answer.kind}{part}")]
    tell(answer, False, *tables)
