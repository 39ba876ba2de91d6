"""The command line: ``run``, ``rank``, ``allocate``, ``check``, ``te``, ``contact``, ``modify`` and others."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.allocate import allocate
from tolalloc.cli.assemble import assemble
from tolalloc.cli.console import (
    AsJson,
    ReportFolder,
    UnitProgress,
    announce_compilation,
    messages,
    print_json,
    print_table,
    say,
    screen,
)
from tolalloc.cli.contact import contact
from tolalloc.cli.costs import costs
from tolalloc.cli.diagnose import diagnose
from tolalloc.cli.identify import identify
from tolalloc.cli.modify import modify
from tolalloc.cli.mount import mount
from tolalloc.cli.rank import rank
from tolalloc.cli.simulate import simulate
from tolalloc.cli.study_script import load_study
from tolalloc.cli.transmission_error import te
from tolalloc.exceptions import TolallocError
from tolalloc.study.definition import Study, prepare
from tolalloc.units import MICROMETRE

app = typer.Typer(
    help="Which drawing tolerance of an RV reducer drives its transmission error, and which tolerances are cheapest.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # rich's own markup would swallow [mm]
    add_completion=False,
    pretty_exceptions_enable=False,
)

Script = Annotated[Path, typer.Argument(help="Python script that defines study = Study(...).")]


@app.command()
def run(
    script: Script,
    quick: Annotated[bool, typer.Option("--quick", help="Small samples, wide intervals; every stage is real.")] = False,
    seed: Annotated[int | None, typer.Option(help="Seed of every random number, instead of the study's.")] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder, new or empty; runs/NAME unless given.")] = None,
    as_json: AsJson = False,
) -> None:
    """Run a study and write its report."""
    study = load_study(script)
    _run(study if seed is None else replace(study, seed=seed), quick, out, as_json)


def _run(study: Study, quick: bool, out: Path | None, as_json: bool) -> None:
    # The report's libraries take half a second to import; the other commands need not wait for them.
    from tolalloc.study.run import run_study
    from tolalloc.study.run_folder import summary

    announce_compilation()
    folder = out or Path("runs") / study.name
    with UnitProgress() as progress:
        results = run_study(study, folder, progress, quick=quick)
    if as_json:
        print_json({"folder": str(folder), **summary(results)})
        return
    allocation, limit = results.allocation, results.limit
    chosen = allocation.chosen
    screen.print(
        f"{'Met' if chosen.met else 'NOT met'}: {chosen.achieved.estimate:.2%} of {chosen.achieved.units} fresh units "
        f"keep {limit:g}″ (95 % interval {chosen.achieved.low:.2%}…{chosen.achieved.high:.2%})."
    )
    screen.print(
        f"Cost {chosen.cost:.2f} cost units, {allocation.saving:.1%} below all zones scaled alike "
        f"({allocation.by_hand.cost:.2f})."
    )
    for warning in results.warnings:
        screen.print(warning, style="yellow", markup=False)
    screen.print(f"Report: {folder / 'report.html'}", soft_wrap=True)


@app.command()
def check(script: Script, as_json: AsJson = False) -> None:
    """Check a study's names, units and bounds without running it."""
    study = load_study(script)
    prepared = prepare(study)
    space = prepared.space
    if as_json:
        content = {
            "study": study.name,
            "reducer": prepared.reducer.name,
            "sources": len(space.errors.sources),
            "varying": len(space.errors.active),
            "groups": list(space.groups),
            "limit_arcsec": study.limit_arcsec,
            "yield_target": study.yield_target,
        }
        print_json(content)
        return
    screen.print(f"{script}: study {study.name} is in order.", soft_wrap=True)
    screen.print(
        f"{prepared.reducer.name}: {len(space.errors.active)} of {len(space.errors.sources)} sources vary, in "
        f"{len(space.groups)} groups; limit {study.limit_arcsec:g}″ at {study.yield_target:.2%}."
    )
    for source in space.errors.active:
        span = f"may become {source.minimum / MICROMETRE:.3g}…{source.maximum / MICROMETRE:.3g} µm"
        screen.print(f"  {source.name}: {source.mapping}; {'locked' if source.locked else span}", soft_wrap=True)
    for sentence in space.errors.correlation.mappings(space.errors.sources):
        screen.print(f"  {sentence}", soft_wrap=True, markup=False)


app.command()(te)
app.command()(contact)
app.command()(modify)
app.command()(rank)
app.command()(allocate)
app.command()(costs)
app.command()(identify)
app.command()(diagnose)
app.command()(assemble)
app.command()(mount)
app.command()(simulate)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a finished run, A.")],
    second: Annotated[Path, typer.Argument(help="Folder of another one, B.")],
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Two finished studies side by side: answers, rankings, zones."""
    from tolalloc.cli.document_script import written
    from tolalloc.study.comparison import Comparison, comparison_document, ranking_table, zones_table
    from tolalloc.study.run_folder import read_run

    comparison = Comparison(first=read_run(first), second=read_run(second))
    document = comparison_document(comparison)
    if out:
        written(out, lambda: document)
    if as_json:
        print_json(document.summary)
        return
    print_table(ranking_table(comparison), "Which error drives it")
    print_table(zones_table(comparison), "Zones and costs")
    say(document)


def main() -> None:
    """Run the command line; an error that a user can mend becomes one sentence and exit code 2."""
    try:
        app()
    except TolallocError as error:
        messages.print(f"Error: {error}", soft_wrap=True, markup=False, highlight=False)
        raise SystemExit(2) from None


def run_script() -> None:
    """Run the study of the calling script, with the options of ``tolalloc run``."""
    sys.argv = [sys.argv[0], "run", *sys.argv]
    main()


if __name__ == "__main__":
    main()
