"""The command ``tolalloc allocate``: the cheapest drawing that keeps every requirement, with its certificate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, UnitProgress, announce_compilation, print_json, print_table, say
from tolalloc.cli.study_script import load_study


def allocate(
    script: Annotated[Path, typer.Argument(help="Python script that defines study = Study(...).")],
    limit: Annotated[float | None, typer.Option(help="Largest peak-to-peak [arcsec], instead of the study's.")] = None,
    yield_target: Annotated[
        float | None, typer.Option("--yield", help="Share of units that must keep a limit, instead of the study's.")
    ] = None,
    grades: Annotated[
        bool, typer.Option("--grades", help="Zones of ISO 286 grades and preferred numbers alone.")
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Small samples, wide intervals; every stage is real.")] = False,
    seed: Annotated[int | None, typer.Option(help="Seed of every random number, instead of the study's.")] = None,
    checkpoint: Annotated[
        Path | None, typer.Option(help="File that keeps the search for the front; an interrupted run goes on from it.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Report folder, new or empty; runs/NAME-allocate unless given.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Cheapest zones, processes and tooth modification for every requirement, verified, as a drawing table."""
    study = load_study(script)
    asked = replace(
        study,
        limit_arcsec=study.limit_arcsec if limit is None else limit,
        yield_target=study.yield_target if yield_target is None else yield_target,
        grades=grades or study.grades,
        seed=study.seed if seed is None else seed,
    )
    # The report's libraries take half a second to import; a misspelt script need not wait for them.
    from tolalloc.allocation.answer.document import allocation_document
    from tolalloc.allocation.answer.drawing import drawing_table, write_drawing
    from tolalloc.allocation.answer.results import AllocationResults
    from tolalloc.cli.document_script import written
    from tolalloc.report.document import Document
    from tolalloc.study.allocation import allocate_study

    announce_compilation()
    made: list[AllocationResults] = []

    def build() -> Document:
        with UnitProgress() as progress:
            made.append(allocate_study(asked, progress, quick=quick, checkpoint=checkpoint))
        return allocation_document(made[0])

    document = written(
        out or Path("runs") / f"{study.name}-allocate", build, lambda folder: write_drawing(made[0], folder)
    )
    if as_json:
        print_json(document.summary)
        return
    columns = ["source", "zone before [µm]", "zone [µm]"]
    columns += [*(["grade"] if asked.grades else []), "process", "share of variance [%]", "cost [cost units]"]
    print_table(drawing_table(made[0])[columns], f"{study.name}: what to write on the drawing")
    say(document)
