"""Running a study from its definition to its run folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tolalloc.progress import Progress, Record
from tolalloc.report.folder import claimed, require_usable
from tolalloc.report.results import StudyResults
from tolalloc.rv.equivalent.status import OUTCOMES
from tolalloc.study.definition import Study, prepare
from tolalloc.study.effort import QUICK
from tolalloc.study.run_folder import write_run
from tolalloc.study.stages import run_stages


def run_study(study: Study, folder: Path, progress: Progress, *, quick: bool = False) -> StudyResults:
    """Run a study and write its folder; on any error nothing is written.

    Parameters
    ----------
    study
        What is asked for.
    folder
        Run folder, new or empty.
    progress
        Told how far the work has come.
    quick
        Replace the study's effort by a small one.

    Raises
    ------
    TolallocError
        One sentence on what is wrong.
    """
    require_usable(folder)
    if quick:
        study = replace(study, effort=QUICK)
    prepared, record = prepare(study), Record(progress, OUTCOMES)
    with claimed(folder):
        results = run_stages(prepared, record, quick)
        write_run(folder, prepared, results, record)
    return results
