"""The commands that are also functions of ``ta``, ``check``, ``whatif``, ``series``; and ``export-problem``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolalloc.cli.console import (
    AsJson,
    ReportFolder,
    announce_compilation,
    announce_kernel,
    note,
    print_json,
    say,
    shown_progress,
    tell,
    write_report,
)
from tolalloc.cli.run import Fresh, Quick, Scheduler, Script, solvers
from tolalloc.exceptions import InputError, StoppedError
from tolalloc.reading.named_fields import whole
from tolalloc.study.script import load_script, load_study

if TYPE_CHECKING:
    from tolalloc.reports.finished_run import Member

Timed = Annotated[
    bool, typer.Option("--time", help="Solve a few units and estimate how long each question takes here.")
]


def check(script: Script, timed: Timed = False, as_json: AsJson = False) -> None:
    """Check a study's names, units and bounds: the script is run, but no question is answered."""
    from tolalloc.study.commands import check as checked

    study = load_study(script)
    if timed:
        announce_kernel(study.model)
    with shown_progress() as progress:
        progress.begin("check")
        answer = checked(study, timed=timed, script=str(script))
    if as_json:
        print_json(answer.summary)
    else:
        say("\n".join(answer.sentences))  # in one piece: a check that is stopped says nothing rather than half


def whatif(
    script: Script,
    zones: Annotated[
        list[str],
        typer.Argument(
            help="Zones as SOURCE=µm, or with their unit: pin.diameter=3 'disc*.pitch=10' housing=0.02mm.",
            metavar="zone...",
        ),
    ],
    units: Annotated[int, typer.Option(help="Random units for each drawing.")] = 1024,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Show what other zones do to cost, yield and quantiles: both drawings on the same random units."""
    from tolalloc.reports.folder import require_usable
    from tolalloc.study.commands import whatif as changed

    require_usable(out)
    study = load_study(script)
    announce_kernel(study.model)
    wanted = dict(_zone(text) for text in zones)
    with shown_progress() as progress:
        answer = changed(study, wanted, units=units, progress=progress)
        write_report(answer, out, progress)
    tell(
        answer, as_json, (answer.to_frame("changes"), "What changes"), (answer.to_frame("changed zones"), "Which zones")
    )


def export_problem(
    script: Script,
    out: Annotated[Path, typer.Option(help="Folder to write, new or empty.")],
    rows: Annotated[int, typer.Option(help="Random units in points.csv, and of the yield.")] = 2000,
) -> None:
    """Write a study as files for another tolerance program: tables, sampled points or formula, expected answers."""
    from tolalloc.study.exported_problem import export_problem as exported

    whole("a whole number from 10 to 1,000,000", 10, 10**6).check("tolalloc export-problem", "--rows", rows)
    study = load_study(script)
    announce_kernel(study.model)
    with shown_progress() as progress:
        said = exported(study, out, rows, progress)
    say(f"{out}: {said} Begin with README.md.")


def series(
    scripts: Annotated[list[Path], typer.Argument(help="Study scripts, each with a study of a different name.")],
    quick: Quick = False,
    out: Annotated[Path, typer.Option(help="Folder for all run folders; finished runs in it are not repeated.")] = Path(
        "runs"
    ),
    fresh: Fresh = False,
    scheduler: Scheduler = "",
    as_json: AsJson = False,
) -> None:
    """Run many studies, a product series or a grid of limits, and show all answers in one table."""
    from tolalloc.study.commands import series as run_series

    done: list[Member] = []

    def told(member: Member) -> None:
        done.append(member)
        note(f"{len(done)} of {len(scripts)}: {member.name}, {member.verdict}")

    read = [load_script(script) for script in scripts]
    announce_compilation()
    try:
        with solvers(scheduler) as solved_by, shown_progress() as progress:
            answer = run_series(
                read, out, "quick" if quick else None, progress, fresh=fresh, solved_by=solved_by, told=told
            )
    except KeyboardInterrupt:
        raise StoppedError(
            f"Stopped after {len(done)} of {len(scripts)} studies; the same command continues with the others."
        ) from None
    tell(answer, as_json, *answer.teller.terminal)


def _zone(text: str) -> tuple[str, float]:
    """Return pattern and zone [µm] of one argument, whose number may have a decimal comma and a unit.

    Refused is 1,000: it may mean one or a thousand.
    """
    pattern, separator, stated = text.partition("=")
    match = re.fullmatch(
        r"\s*(?![1-9]\d{0,2},\d{3}(?!\d))(\d+(?:[.,]\d*)?|[.,]\d+)(e[-+]?\d+)?\s*(µm|μm|um|mm)?\s*",
        stated,
        re.ASCII | re.IGNORECASE,
    )
    if match is None:
        allowed = "SOURCE=µm, such as pin.diameter=3, or with its unit as in housing=0.02mm"
        raise InputError.at("whatif", "zone", text if separator else f"{text} without =", allowed)
    number, power, unit = match.groups()
    return pattern.strip(), float(number.replace(",", ".") + (power or "")) * (
        1000.0 if (unit or "").lower() == "mm" else 1.0
    )
