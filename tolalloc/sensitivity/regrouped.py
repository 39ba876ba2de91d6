"""Indices of other groups of columns, such as the dimensions of a drawing, from blocks that are solved already."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tolalloc.capability.experiment import Experiment
from tolalloc.models.model import Evaluation, Response
from tolalloc.sensitivity.saltelli import saltelli_indices
from tolalloc.sensitivity.sobol import solved
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis, SobolIndices, indices_of


def regrouped(
    experiment: Experiment[Response], analysis: SobolAnalysis, factor_groups: tuple[str, ...]
) -> SobolIndices:
    """Return the indices of the first output of an analysis by other groups of the columns, from the same blocks.

    The samples A and B are the same for any groups, and so are those in which columns are exchanged that are a group
    here and there: only those of new groups are solved, and a group that is in both has the same indices in both.

    Parameters
    ----------
    experiment
        That of the analysis; its response may answer the first output alone.
    analysis
        Indices by independent groups of the columns, with their samples.
    factor_groups
        Name of what every column belongs to, independent of each other.

    Raises
    ------
    SolveError
        Too many blocks hold a failed sample, or the output does not vary.
    """
    assert analysis.solved is not None
    before, answers = analysis.solved.design, analysis.solved.answers
    design = replace(before, factor_groups=factor_groups, second_order=False)
    blocks, size = answers.status.size // before.samples_per_block, before.samples_per_block
    places = {columns: at + 1 for at, columns in enumerate(before.columns_of_names)}
    new = tuple(
        name for name, columns in zip(design.names, design.columns_of_names, strict=True) if columns not in places
    )
    values, status = (own.reshape(blocks, size) for own in (answers.values[:, 0], answers.status))
    if new:
        more = solved(experiment, experiment.response, design.chunks(0, blocks, only=new))
        values = np.concatenate([values, more.values[:, 0].reshape(blocks, -1)], axis=1)
        status = np.concatenate([status, more.status.reshape(blocks, -1)], axis=1)
    added = iter(range(size, size + len(new)))
    order = [0, *(places[own] if own in places else next(added) for own in design.columns_of_names), size - 1]
    together = Evaluation(values=values[:, order].reshape(-1, 1), status=status[:, order].reshape(-1))
    found = saltelli_indices(
        together,
        len(design.names),
        experiment.seeds.child("resamples"),
        largest_failed_share=experiment.largest_failed_share,
        resamples=analysis.indices.total_resamples.shape[1],
    )
    return indices_of(found, 0, analysis.outputs[0], design.names, found.blocks, together.status.size)
