"""The command ``tolalloc mount``: which measured part goes where, and how it is turned there."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, shown_progress, tell, write_report
from tolalloc.cli.options import ReducerOption, TestTorqueOption, named_reducer


def mount(
    parts: Annotated[Path, typer.Argument(help="CSV: columns part, kind, error, value, unit (µm or arcsec).")],
    reducer: ReducerOption = None,
    torque: TestTorqueOption = None,
    starts: Annotated[int, typer.Option(help="Mountings from which several units are improved.")] = 4,
    seed: Annotated[int, typer.Option(help="Seed of every random number.")] = 1,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Build the units with the least peak-to-peak from measured parts: who goes where, turned how far."""
    # The report's libraries take half a second to import; a misspelt option need not wait for them.
    from tolalloc.assembly.mounting import mount as mounted
    from tolalloc.assembly.mounting import prepare_mounting
    from tolalloc.reports.folder import require_usable

    request = prepare_mounting(parts, named_reducer(reducer, out), torque, starts, seed)
    require_usable(out)
    announce_compilation()
    with shown_progress() as progress:
        answer = mounted(request, progress)
    write_report(answer, out)
    fittings, units = answer.tables["fittings"], answer.tables["units"]
    tell(answer, as_json, (fittings, f"{parts.stem}: who goes where"), (units, "Unit by unit"))
