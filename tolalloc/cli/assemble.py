"""The command ``tolalloc assemble``: what to turn at every step, what it leaves, and what tolerances cost then."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, shown_progress, tell, write_report


def assemble(
    chain: Annotated[str, typer.Argument(help="Datum flow chain: shipped name or TOML file.")],
    measured: Annotated[
        Path | None, typer.Option(help="CSV: columns part, 'x [arcsec]', 'y [arcsec]', 'z [arcsec]'.")
    ] = None,
    precision: Annotated[
        float | None, typer.Option(help="Weight of the final angles against effort, in place of the chain's.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of every random number.")] = 1,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Turn parts while they are assembled: how far, what that leaves, and which angular tolerances are cheapest."""
    # The report's libraries take half a second to import; a misspelt option need not wait for them.
    from tolalloc.assembly.adjustment import assemble as assembled
    from tolalloc.assembly.adjustment import prepare_assembly
    from tolalloc.reports.folder import require_usable

    request = prepare_assembly(chain, measured, precision, seed)
    require_usable(out)
    if request.plan.reducer:
        announce_compilation()
    with shown_progress("assemblies") as progress:
        answer = assembled(request, progress)
    write_report(answer, out)
    listed, steps = answer.tables["steps"], []
    said = [name for name in ("step [-]", "mount", "measure") if name in listed]
    for (step, *done), rows in listed.groupby(said, sort=False):
        work = ", ".join(f"{verb} {what}" for verb, what in zip(said[1:], done, strict=True))
        steps.append((rows.drop(columns=said), f"Step {step}: {work}, turn about own axes"))
    name, datum = request.name or request.plan.name, request.plan.chain.datum
    final = f"{name}: final angles against {datum}, before and after adjusting"
    tell(answer, as_json, *steps, (answer.characteristics, final))
