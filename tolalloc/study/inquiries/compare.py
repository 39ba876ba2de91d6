"""Two finished studies side by side."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tolalloc.reports.finished_run import Comparison, common_currency, read_run
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Word


@dataclass(frozen=True, kw_only=True)
class Compare(Inquiry[Comparison]):
    """Two finished studies side by side: answers, rankings, zones."""

    word: ClassVar[str] = "compare"
    by_position: ClassVar[int] = 2

    first: Annotated[Path, Word("Folder of a finished run, A.")]
    second: Annotated[Path, Word("Folder of another one, B.")]

    def prepare(self) -> Comparison:
        """Return what both folders say."""
        return Comparison(first=read_run(Path(self.first)), second=read_run(Path(self.second)))

    def solve(self, prepared: Comparison, progress: Progress) -> Answer[Comparison]:  # noqa: ARG002
        """Return both side by side, with their currency where they have one in common."""
        names = ", ".join(run.name for run in prepared.runs)
        header = Header(name=names, model="", currency=common_currency(prepared.runs))
        return Answer(kind="comparison", header=header, result=prepared)


INQUIRY = Compare
