"""The commands that are asked of studies and their folders, as functions of ``ta``: check, what if, series.

A study is given as such or as the path of its script.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from tolalloc.exceptions import InputError, TolallocError
from tolalloc.models.model import is_fast
from tolalloc.reading.plugins import plugin_versions
from tolalloc.reports.finished_run import FinishedRun, Member, common_currency, read_run
from tolalloc.reports.folder import numbered
from tolalloc.reports.header import Header
from tolalloc.reports.tellers.check import Checked, CheckedTime
from tolalloc.running.chunks import Mapper
from tolalloc.running.progress import SILENT, Progress
from tolalloc.study.answer import Answer
from tolalloc.study.prepared import Prepared
from tolalloc.study.problem import Effort
from tolalloc.study.questions import Difference
from tolalloc.study.script import StudyScript, load_script
from tolalloc.study.study import Study, run

InForce = Callable[[], AbstractContextManager[None]]
"""Lets imports find the modules of one study, and none of another one."""
_CHECKED = 1000
"""Random units that a check examines [-]."""
_JUDGED = 256
"""Those of them whose limited outputs are solved where a check may take its time [-]."""


def _with_modules(study: Study | StudyScript | str | Path) -> tuple[Study, InForce]:
    """Return a study, read if its script is given, and what lets imports find its modules."""
    if isinstance(study, Study):
        return study, nullcontext
    if isinstance(study, StudyScript):
        return study.study, study.in_force
    if not isinstance(study, str | Path):
        raise InputError.at("study", "study", study, "ta.Study(...) or the path of a script")
    script = load_script(Path(study))
    return script.study, script.in_force


def check(study: Study | str | Path, *, timed: bool = False, script: str = "") -> Answer[Checked]:
    """Check a study's names, units and bounds; no question is asked.

    Parameters
    ----------
    study
        The study, or the script that defines it; a script is a program, and is run to read it.
    timed
        Whether a few units are solved to say about how long each question takes here.
    script
        Where the study was read, if it was; the given path itself is.

    Raises
    ------
    InputError, UnknownNameError
        What is wrong with the study.
    """
    asked, in_force = _with_modules(study)
    script = script if isinstance(study, Study) else str(study)
    header, kinds = Header(name=asked.name, model=""), tuple(question.kind for question in asked.questions)
    with in_force():
        if not any(question.reads for question in asked.questions):
            return Answer(kind="check", header=header, result=Checked(script=script, questions=kinds))
        prepared = Prepared(study=asked)
        model, errors, space = prepared.model, prepared.errors, prepared.space
        # Whatever is wrong is found before units are solved.
        header, requirements = replace(header, model=model.name, currency=prepared.currency), prepared.requirements
        if requirements and is_fast(model):
            prepared.require_answers(_CHECKED)
        result = Checked(
            script=script,
            questions=kinds,
            model=model,
            errors=errors,
            space=space,
            requirements=requirements,
            notes=prepared.notes,
            examined=model.examined(prepared.random_units(_CHECKED)),
            times=_times(prepared) if timed else (),
            missed=prepared.missed,
            kept=prepared.kept_limits(_JUDGED) if timed else None,
        )
    return Answer(kind="check", header=header, result=result)


def _times(prepared: Prepared) -> tuple[CheckedTime, ...]:
    """Return about how long the questions take at the quick effort and at the study's own."""
    from tolalloc.study.duration import durations

    study = prepared.study
    efforts = [study.with_effort("quick"), *([] if study.quick else [study])]
    return tuple(own for asked in efforts for own in durations(replace(prepared, study=asked)))


def whatif(
    study: Study | str | Path,
    zones: Mapping[str, float],
    *,
    units: int = 1024,
    progress: Progress | None = None,
) -> Answer[Any]:
    """Show what other zones do to cost, yield and quantiles: both drawings on the same random units.

    Parameters
    ----------
    study
        The study, or the script that defines it.
    zones
        Source, or a pattern of several as ``disc*.pitch``, and its full zone [µm].
    units
        Random units of either drawing [-].
    progress
        Told how far the work has come; silent unless given.

    Raises
    ------
    InputError, UnknownNameError
        What is wrong with the study or the zones.
    """
    asked, in_force = _with_modules(study)
    with in_force():
        return asked.ask(Difference(zones=zones, units=units), progress=progress)


def series(
    studies: Iterable[Study | StudyScript | str | Path],
    folder: str | Path = "runs",
    effort: Literal["quick", "full"] | Effort | None = None,
    progress: Progress | None = None,
    *,
    fresh: bool = False,
    solved_by: Mapper = map,
    told: Callable[[Member], None] | None = None,
) -> Answer[tuple[Member, ...]]:
    """Run many studies, a product series or a grid of limits, and show all answers in one table.

    Parameters
    ----------
    studies
        Studies, or the scripts that define them, each of a name of its own.
    folder
        Folder of all run folders; finished ones in it are not run again.
    effort
        ``quick``, ``full`` or numbers; each study's own if none is given.
    progress
        Told how far the work has come; silent unless given.
    fresh
        Whether everything is solved again.
    solved_by
        What solves the units; this process unless given.
    told
        Told of every study when it is done.

    Raises
    ------
    InputError
        Two studies of one name, or a script that cannot be read.
    """
    read = [_with_modules(study) for study in studies]
    known = [(study.with_effort(effort), in_force) for study, in_force in read]
    names = [study.name for study, _ in known]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"series: {names.count(name)} studies are named {name!r}; each needs a name of its own.")
    members = []
    for study, in_force in known:
        members.append(_member(study, in_force, Path(folder), progress or SILENT, fresh, solved_by))
        if told:
            told(members[-1])
    header = Header(name="series", model="", currency=common_currency(own.found for own in members if own.found))
    return Answer(kind="series", header=header, result=tuple(members))


def _member(
    study: Study, in_force: InForce, folder: Path, progress: Progress, fresh: bool, solved_by: Mapper
) -> Member:
    """Return what becomes of a study, run while its own modules are in force; one that is finished is read.

    Where its folder holds an answer to an earlier state of the study, or it is to begin afresh, the new answer has the
    next numbered folder. A study that cannot be run does not stop the others.
    """
    *earlier, own = numbered(folder / study.name)
    try:
        with in_force():
            current = () if fresh else (found for last in reversed(earlier) if (found := finished_run(study, last)))
            finished = next(iter(current), None)
            if finished is None:
                if earlier and not fresh and (unknown := Prepared(study=study).unknown):
                    progress.tell(f"{study.name} is run again: {unknown}.")
                run(study, own, progress=progress, fresh=fresh, solved_by=solved_by)
        found = finished or read_run(own)
        return Member(name=study.name, folder=found.folder, found=found)
    except TolallocError as error:
        return Member(name=study.name, folder=own, fault=str(error))


def finished_run(study: Study, folder: Path) -> FinishedRun | None:
    """Return what the folder says if it answers just this study at this effort."""
    with suppress(InputError):
        found = read_run(folder)
        manifest, asked = found.manifest, [question.kind for question in study.questions]
        same = manifest.get("study hash") == Prepared(study=study).digest != "" and manifest.get("questions") == asked
        of_these = plugin_versions().items() <= manifest.get("versions", {}).items()
        if same and of_these and manifest.get("quick") == study.quick:
            return found
    return None
