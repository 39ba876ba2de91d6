"""The command ``tolalloc rank``: what drives the outputs of a study's reducer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, UnitProgress, announce_compilation, print_json, print_table, say
from tolalloc.cli.study_script import load_study


def rank(
    script: Annotated[Path, typer.Argument(help="Python script that defines study = Study(...).")],
    quick: Annotated[bool, typer.Option("--quick", help="Small samples, wide intervals; every stage is real.")] = False,
    seed: Annotated[int | None, typer.Option(help="Seed of every random number, instead of the study's.")] = None,
    out: Annotated[Path | None, typer.Option(help="Report folder, new or empty; runs/NAME-rank unless given.")] = None,
    as_json: AsJson = False,
) -> None:
    """Which error drives which requirement, which order and the units out of the limit, and how sure that is."""
    study = load_study(script)
    asked = study if seed is None else replace(study, seed=seed)
    # The report's libraries take half a second to import; a misspelt script need not wait for them.
    from tolalloc.cli.document_script import written
    from tolalloc.report.document import Document
    from tolalloc.study.ranking import rank as ranked

    announce_compilation()
    shown = []

    def build() -> Document:
        with UnitProgress() as progress:
            answer = ranked(asked, progress, quick=quick)
        shown.append(answer.ranking)
        return answer.document

    document = written(out or Path("runs") / f"{study.name}-rank", build)
    if as_json:
        print_json(document.summary)
        return
    columns = ["source", "contribution [%]", "total index ST [-]", "ST low 5 % [-]", "ST high 95 % [-]", "zone [µm]"]
    print_table(shown[0][columns].head(12), f"{study.name}: what drives the peak-to-peak")
    say(document)
