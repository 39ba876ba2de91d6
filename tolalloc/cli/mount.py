"""The command ``tolalloc mount``: which measured part goes where, and how it is turned there."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, UnitProgress, announce_compilation, print_json, print_table, say


def mount(
    parts: Annotated[Path, typer.Argument(help="CSV: columns part, kind, error, value, unit (µm or arcsec).")],
    reducer: Annotated[str, typer.Option(help="Preset name or TOML file.")] = "rv20e",
    torque: Annotated[
        float | None, typer.Option(help="Torque on the carrier [N·m], negative against the rotation.")
    ] = None,
    starts: Annotated[int, typer.Option(help="Mountings from which several units are improved.")] = 4,
    seed: Annotated[int, typer.Option(help="Seed of every random number.")] = 1,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Build the units with the least peak-to-peak from measured parts: who goes where, turned how far."""
    # The report's libraries take half a second to import; a misspelt option need not wait for them.
    from tolalloc.assembly.mounting.answer import fitting_table, mounting_document, unit_table
    from tolalloc.assembly.mounting.study import MountingStudy, prepare_mounting
    from tolalloc.assembly.mounting.study import mount as mounted
    from tolalloc.cli.document_script import written
    from tolalloc.report.folder import require_usable

    asked = MountingStudy(parts=parts, reducer=reducer, torque_nm=torque, starts=starts, seed=seed)
    prepared = prepare_mounting(asked)
    if out:
        require_usable(out)
    announce_compilation()
    with UnitProgress() as progress:
        results = mounted(prepared, progress)
    document = mounting_document(results)
    if out:
        written(out, lambda: document)
    if as_json:
        print_json(document.summary)
        return
    print_table(fitting_table(results), f"{parts.stem}: who goes where")
    print_table(unit_table(results), "Unit by unit")
    say(document)
