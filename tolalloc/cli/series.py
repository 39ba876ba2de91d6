"""The command ``tolalloc series``: many studies, one table of answers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, announce_compilation, note, shown_progress, tell
from tolalloc.cli.run import Fresh, Quick, Scheduler, solvers
from tolalloc.cli.study_script import load_script
from tolalloc.exceptions import StoppedError


def series(
    scripts: Annotated[list[Path], typer.Argument(help="Study scripts, each with a study of its own name.")],
    quick: Quick = False,
    out: Annotated[Path, typer.Option(help="Folder of all run folders; finished ones in it are not run again.")] = Path(
        "runs"
    ),
    fresh: Fresh = False,
    scheduler: Scheduler = "",
    as_json: AsJson = False,
) -> None:
    """Run many studies, a product series or a grid of limits, and tell all answers in one table."""
    from tolalloc.reports.finished_run import common_currency
    from tolalloc.reports.header import Header
    from tolalloc.study.answer import Answer
    from tolalloc.study.series import run_series

    read = [load_script(script) for script in scripts]
    asked = [(own.study.with_effort("quick") if quick else own.study, own.in_force) for own in read]
    announce_compilation()
    members = []
    try:
        with solvers(scheduler) as solved_by, shown_progress() as progress:
            for member in run_series(asked, out, progress, fresh=fresh, solved_by=solved_by):
                members.append(member)
                note(f"{len(members)} of {len(asked)}: {member.name}, {member.verdict}")
    except KeyboardInterrupt:
        raise StoppedError(
            f"Stopped after {len(members)} of {len(asked)} studies; the same command goes on with the others."
        ) from None
    currency = common_currency(member.found for member in members if member.found)
    header = Header(name="series", model="", currency=currency)
    answer = Answer(kind="series", header=header, result=tuple(members))
    tell(answer, as_json, *answer.teller.terminal)
