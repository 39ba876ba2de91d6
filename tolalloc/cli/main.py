"""The command line: ``run``, ``rank``, ``allocate``, ``check``, ``te``, ``contact``, ``modify`` and others."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

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
from tolalloc.cli.contact import asked_reducer, contact_answer
from tolalloc.cli.costs import costs
from tolalloc.cli.diagnose import diagnose
from tolalloc.cli.identify import identify
from tolalloc.cli.mount import mount
from tolalloc.cli.rank import rank
from tolalloc.cli.simulate import simulate
from tolalloc.cli.study_script import load_study
from tolalloc.cli.transmission_error import as_table, attribution_table, unit_answer
from tolalloc.drawing.unit_file import load_unit
from tolalloc.exceptions import TolallocError
from tolalloc.rv.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.study.definition import Study, prepare
from tolalloc.units import MICROMETRE

if TYPE_CHECKING:
    from tolalloc.report.document import Document
    from tolalloc.rv.cycloid.tooth_profile import ToothProfile
    from tolalloc.rv.modification.rotated_profile import Metric

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


@app.command()
def te(
    reducer: Annotated[str, typer.Option(help="Preset name or TOML file.")] = "rv20e",
    unit: Annotated[str, typer.Option(help="Shipped unit (exact, table4 of an RV-20E) or TOML file.")] = "exact",
    torque: Annotated[
        float | None, typer.Option(help="Torque on the carrier [N·m], negative against the rotation.")
    ] = None,
    stiffness: Annotated[str, typer.Option(help="Identified stiffness: shipped name or TOML file.")] = "",
    attributed: Annotated[bool, typer.Option("--attribute", help="Show which source makes which order.")] = False,
    as_json: AsJson = False,
) -> None:
    """Transmission error of one built unit over one output turn."""
    design = load_reducer(reducer)
    if stiffness:
        design = with_stiffness(design, load_identified_stiffness(stiffness))
    announce_compilation()
    answer = unit_answer(design, load_unit(unit), design.torque_on_carrier(torque, "tolalloc te"), attributed)
    if as_json:
        print_json(answer)
    else:
        screen.print(as_table(answer))
        for warning in answer["warnings"]:
            screen.print(warning, style="yellow", markup=False)
        if attributed:
            screen.print(attribution_table(answer))


@app.command()
def contact(
    reducer: Annotated[str, typer.Option(help="Preset name or TOML file.")] = "rv40e",
    torque: Annotated[
        float | None, typer.Option(help="Torque on the carrier [N·m]; the rated one unless given.")
    ] = None,
    width: Annotated[float | None, typer.Option(help="Loaded face width [mm].")] = None,
    support: Annotated[
        float | None, typer.Option(help="Distance of two supports between which the pins bend [mm].")
    ] = None,
    law: Annotated[str, typer.Option(help="Contact law: logarithmic (Hertz), constant, table2.")] = "logarithmic",
    exact: Annotated[bool, typer.Option("--exact", help="Exact distances even for a small modification.")] = False,
    phases: Annotated[int, typer.Option(help="Phases of the crank within one pin pitch.")] = 72,
    profile: Annotated[Path | None, typer.Option(help="Write the tooth profile to this new .csv or .dxf file.")] = None,
    points: Annotated[int, typer.Option(help="Points per tooth of that file.")] = 200,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Clearance, backlash, pins in contact, forces and pressure of the modified teeth, without errors."""
    _require_writable(out, profile, points)
    design = asked_reducer(load_reducer(reducer), width, support)
    announce_compilation("cycloid")
    found = contact_answer(design, torque, law, exact, phases)
    # The report's libraries take half a second to import, and only these lines need them.
    from tolalloc.rv.teeth.contact import contact_document
    from tolalloc.rv.teeth.contact_tables import contact_table, profile_table

    document = contact_document(found)
    _write_asked(document, out, found.profile, profile, points)
    if as_json:
        print_json(document.summary)
        return
    print_table(profile_table(found), f"{design.name}: profile and clearance")
    print_table(contact_table(found), f"{design.name}: {found.torque:g} N·m on the carrier")
    say(document)


@app.command()
def modify(
    method: Annotated[str, typer.Argument(help="song2019 (towards a rotated profile) or li2018 (least gap).")],
    reducer: Annotated[str, typer.Option(help="Preset name or TOML file.")] = "rv40e",
    radial_um: Annotated[float, typer.Option("--radial", help="Least clearance at tip and root [µm].")] = 15.0,
    rotation: Annotated[float, typer.Option(help="song2019: rotation of the profile to come close to [rad].")] = 0.005,
    metric: Annotated[str, typer.Option(help="song2019: same_angle, normal or nearest.")] = "same_angle",
    negative: Annotated[bool, typer.Option("--negative-shift", help="song2019: a negative shift.")] = False,
    require_gap: Annotated[
        bool, typer.Option("--require-gap", help="song2019: no interference after closing.")
    ] = False,
    torque: Annotated[float | None, typer.Option(help="Torque on the carrier [N·m]; rated unless given.")] = None,
    seeds: Annotated[int, typer.Option(help="Searches of each algorithm.")] = 8,
    seed: Annotated[int, typer.Option(help="First seed.")] = 1,
    profile: Annotated[Path | None, typer.Option(help="Write the tooth profile to this new .csv or .dxf file.")] = None,
    points: Annotated[int, typer.Option(help="Points per tooth of that file.")] = 200,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Choose equidistant and shift amount by a published method, beside a sure reference and other algorithms."""
    from tolalloc.rv.modification.study import ModificationStudy, choose

    study = ModificationStudy(
        method=method,
        radial_clearance=radial_um * MICROMETRE,
        rotation=rotation,
        metric=cast("Metric", metric),
        shift_sign=-1 if negative else 1,
        require_gap=require_gap,
        seeds=seeds,
        seed=seed,
    )
    _require_writable(out, profile, points)
    design = load_reducer(reducer)
    asked = design.torque_on_carrier(design.load.rated_torque if torque is None else torque, "tolalloc modify")
    announce_compilation("cycloid")
    with UnitProgress("searches") as progress:
        results = choose(study, design, asked, progress)
    from tolalloc.rv.modification.answer import algorithms_table, delivered_table, modification_document

    document = modification_document(results)
    _write_asked(document, out, results.assessment.profile, profile, points)
    if as_json:
        print_json(document.summary)
        return
    print_table(algorithms_table(results), f"{design.name}: {method}")
    print_table(delivered_table(results), "What the amounts deliver")
    say(document)


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


def _require_writable(out: Path | None, file: Path | None, points: int) -> None:
    """Refuse a report or a profile that could not be written, before anything long runs."""
    from tolalloc.report.folder import require_usable
    from tolalloc.rv.teeth.profile_files import require_profile_file

    if out:
        require_usable(out)
    if file:
        require_profile_file(file, points)


def _write_asked(document: Document, out: Path | None, teeth: ToothProfile, file: Path | None, points: int) -> None:
    """Write the report and the profile that were asked for."""
    from tolalloc.cli.document_script import written
    from tolalloc.rv.teeth.profile_files import write_profile

    if out:
        written(out, lambda: document)
    if file:
        made = write_profile(teeth, points, file)
        messages.print(
            f"Profile: {file}, {made.per_tooth} points per tooth, chord error at most "
            f"{made.chord_error / MICROMETRE:.2g} µm.",
            markup=False,
            soft_wrap=True,
        )


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
