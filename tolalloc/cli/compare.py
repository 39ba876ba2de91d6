"""The command ``tolalloc compare``: two finished studies side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, tell


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
    own = [(answer.to_frame(name), name) for name in ("rankings", "zones")]
    if not answer.differing.empty:
        own.insert(0, (answer.differing, "answers that differ"))
    tell(answer, as_json, *own)
