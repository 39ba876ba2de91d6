"""Many studies, such as a product series or a grid of limits: run one after the other, answered in one table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, suppress
from pathlib import Path

from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reports.finished_run import FinishedRun, Member, read_run
from tolalloc.running.chunks import Mapper
from tolalloc.running.progress import Progress
from tolalloc.study.prepared import Prepared
from tolalloc.study.study import Study, run

InForce = Callable[[], AbstractContextManager[None]]
"""Lets imports find the modules of one study, and none of another one."""


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
