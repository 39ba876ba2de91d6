"""From a study to what drives its outputs, with the confidence of every answer."""

from __future__ import annotations

from dataclasses import replace

from tolalloc.capability.indices import Limits
from tolalloc.drawing.seeds import SeedTree
from tolalloc.progress import Progress, Record
from tolalloc.report.answer import Header
from tolalloc.rv.model import ReducerModel
from tolalloc.rv.response.kernel import PEAK_TO_PEAK
from tolalloc.sensitivity.answer import RankingAnswer
from tolalloc.sensitivity.answer import rank as ranked
from tolalloc.study.definition import Study, prepare
from tolalloc.study.effort import QUICK


def rank(study: Study, progress: Progress, *, quick: bool = False) -> RankingAnswer:
    """Return what drives the outputs of a study's reducer at the zones of its tolerance table.

    Parameters
    ----------
    study
        What is asked for; its limit, target and other limits are the requirements.
    progress
        Told how far the work has come.
    quick
        Replace the study's effort by a small one.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    SolveError
        Too many units failed.
    """
    prepared = prepare(replace(study, effort=QUICK) if quick else study)
    model = ReducerModel(kernel=prepared.kernel, identified=prepared.identified)
    neglected = ", ".join(prepared.neglected)
    return ranked(
        model,
        prepared.space.errors,
        {PEAK_TO_PEAK: Limits(upper=study.limit_arcsec), **study.other_limits},
        study.yield_target,
        prepared.study.effort.ranking,
        SeedTree(study.seed).child("rank"),
        study.largest_failed_share,
        Record(progress, model.outcomes),
        Header(
            name=study.name,
            model=model.name,
            seed=study.seed,
            quick=quick,
            digest=prepared.hash,
            assumptions=(f"not in the tolerance table and taken as exact: {neglected}",) if neglected else (),
        ),
    )
