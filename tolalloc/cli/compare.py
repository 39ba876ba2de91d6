"""The command ``tolalloc compare``: two finished studies side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, print_json, print_table, say


def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a finished run, A.")],
    second: Annotated[Path, typer.Argument(help="Folder of another one, B.")],
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Two finished studies side by side: answers, rankings, zones."""
    from tolalloc.study.comparison import ComparisonAnswer
    from tolalloc.study.finished_run import read_run

    answer = ComparisonAnswer.of(read_run(first), read_run(second))
    if out:
        answer.save(out)
    if as_json:
        print_json(answer.summary)
        return
    for name in ("ranking", "zones"):
        if name in answer.tables:
            print_table(answer.to_frame(name), name)
    say(answer.document)
