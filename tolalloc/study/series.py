"""Many studies, such as a product series or a grid of limits: run one after the other, answered in one table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.running.chunks import Mapper
from tolalloc.running.progress import Progress
from tolalloc.study.finished_run import FinishedRun, read_run
from tolalloc.study.prepared import Prepared
from tolalloc.study.study import Study, run

_NUMBERS = {
    "cost [cost units]": "cost [cost units]",
    "lower bound [cost units]": "bound [cost units]",
    "yield [-]": "yield [-]",
}
"""Number in a summary → column of the table."""


InForce = Callable[[], AbstractContextManager[None]]
"""Lets imports find the modules of one study, and none of another one."""


@dataclass(frozen=True, kw_only=True)
class Member:
    """One study of a series and what became of it.

    Parameters
    ----------
    name
        Its name.
    folder
        Its run folder.
    found
        What the folder says; none if it could not be run.
    fault
        Why it could not be run, in a sentence.
    """

    name: str
    folder: Path
    found: FinishedRun | None = None
    fault: str = ""

    @property
    def row(self) -> dict[str, object]:
        """Its row in the table of answers."""
        if self.found is None:
            return {"study": self.name, "answer": f"not run: {self.fault}"}
        summary = self.found.summary
        met = ("met" if summary["met"] else "NOT met") if "met" in summary else "ranked"
        first = str(self.found.ranking["source"].iloc[0]) if len(self.found.ranking) else ""
        numbers = {column: float(summary[name]) for name, column in _NUMBERS.items() if summary.get(name) is not None}
        return {"study": self.name, "answer": met, **numbers, "largest driver": first, "folder": self.folder.name}


@dataclass(frozen=True, kw_only=True)
class SeriesAnswer(Answer):
    """What became of every study of a series."""

    kind: ClassVar[str] = "series"

    members: tuple[Member, ...]

    @property
    def title(self) -> str:
        """What it is."""
        return f"A series of {len(self.members)} studies"

    @property
    def subtitle(self) -> str:
        """Which ones."""
        return ", ".join(member.name for member in self.members)

    @property
    def sentences(self) -> tuple[str, ...]:
        """How many have an answer."""
        done = [member for member in self.members if member.found]
        judged = [member for member in done if member.found and "met" in member.found.summary]
        met = sum(bool(member.found and member.found.summary["met"]) for member in judged)
        kept = f"; of {len(judged)} allocations {met} keep their limits" if judged else ""
        return (f"{len(done)} of {len(self.members)} studies have an answer{kept}.",)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Which could not be run, and why."""
        return tuple(f"{member.name}: {member.fault}" for member in self.members if member.fault)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """One table."""
        return (Section(heading="Answers", tables=(("answers", self.table),), unfolded=True),)

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row per study."""
        return pd.DataFrame([member.row for member in self.members])

    @property
    def summary(self) -> dict[str, Any]:
        """The table for a program."""
        return {"studies": [member.row for member in self.members]}


def run_series(
    studies: Iterable[tuple[Study, InForce]],
    folder: Path,
    progress: Progress,
    *,
    fresh: bool = False,
    solved_by: Mapper = map,
) -> Iterator[Member]:
    """Yield what becomes of every study, each in a folder of its own name; one that is finished there is read.

    A study is run while its own modules are in force. Where its folder holds an answer to an earlier state of the
    study, or it is to begin afresh, the new answer has the next numbered folder. A study that cannot be run does not
    stop the others. All share the solved units beside their folders.

    Raises
    ------
    InputError
        Two studies of one name.
    """
    known = tuple(studies)
    names = [study.name for study, _ in known]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"series: {names.count(name)} studies are named {name!r}; each needs a name of its own.")
    for study, in_force in known:
        *earlier, own = _folders(folder / study.name)
        try:
            with in_force():
                current = () if fresh else (found for own in reversed(earlier) if (found := _finished(study, own)))
                finished = next(iter(current), None)
                if finished is None:
                    run(study, own, progress=progress, fresh=fresh, solved_by=solved_by)
            found = finished or read_run(own)
            yield Member(name=study.name, folder=found.folder, found=found)
        except TolallocError as error:
            yield Member(name=study.name, folder=own, fault=str(error))


def _folders(first: Path) -> list[Path]:
    """Return the folders that a study has, and last the next one that is new or empty."""
    found = [first]
    while found[-1].is_file() or (found[-1].is_dir() and any(found[-1].iterdir())):
        found.append(first.with_name(f"{first.name}-{len(found) + 1}"))
    return found


def _finished(study: Study, folder: Path) -> FinishedRun | None:
    """Return what the folder says if it answers just this study at this effort."""
    with suppress(InputError):
        found = read_run(folder)
        manifest, asked = found.manifest, [question.kind for question in study.questions]
        same = manifest.get("study hash") == Prepared(study=study).digest and manifest.get("questions") == asked
        if same and manifest.get("quick") == study.quick:
            return found
    return None
