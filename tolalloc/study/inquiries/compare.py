"""Two finished studies side by side."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tolalloc.exceptions import InputError
from tolalloc.reports.finished_run import Comparison, common_currency, finished, read_run
from tolalloc.reports.folder import RUNS
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Word


@dataclass(frozen=True, kw_only=True)
class Compare(Inquiry[Comparison]):
    """Show two finished studies side by side: answers, rankings, zones; the last two in folder runs unless named."""

    word: ClassVar[str] = "compare"
    example: ClassVar[str] = "tolalloc compare runs/mine runs/other"
    by_position: ClassVar[int] = 2

    first: Annotated[Path | None, Word("Folder of a finished run, A; the last but one in runs unless given.")] = None
    second: Annotated[Path | None, Word("Folder of another one, B; the last one in runs unless given.")] = None

    def prepare(self) -> Comparison:
        """Return what both folders say."""
        if self.first and self.second:
            return Comparison(first=read_run(self.first), second=read_run(self.second))
        if self.first or self.second:
            raise InputError(f"{self.called}: one folder is named; name two, or none for the last two runs in {RUNS}.")
        places = sorted(RUNS.glob("*/manifest.json"), key=lambda path: path.stat().st_mtime)
        found = finished(path.parent for path in places)[-2:]
        if len(found) < 2:
            raise InputError(f"{self.called}: {RUNS} holds {len(found)} finished runs; name two folders, A and B.")
        return Comparison(first=found[0], second=found[1])

    def solve(self, prepared: Comparison, progress: Progress) -> Answer[Comparison]:  # noqa: ARG002
        """Return both side by side, with their currency where they have one in common."""
        names = ", ".join(run.name for run in prepared.runs)
        header = Header(name=names, model="", currency=common_currency(prepared.runs))
        return Answer(kind="comparison", header=header, result=prepared)
