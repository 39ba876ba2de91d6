"""Sobol indices of all outputs from one Saltelli design that grows until the ranking is stable.

SALib's traps and the guards against them: seed 0 means unseeded, so seeds are positive; one NaN makes every index zero
and ``conf`` is a multiple of a standard deviation, so `tolalloc.sensitivity.saltelli` estimates, drops blocks with a
failed sample whole, counts them, and keeps the resamples, from which intervals are percentiles; the design is held
whole, so `tolalloc.sensitivity.saltelli` gives the same samples in chunks.
"""

from __future__ import annotations

import numpy as np

from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.models import Evaluation, Response
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.ranking import Resampled, grow_until_stable
from tolalloc.sensitivity.saltelli import SaltelliDesign, SaltelliIndices, saltelli_indices
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis, overall_ranking

_HALF_STEP = 2.0**-31
"""Half the step of the scrambled points, which stands for a point of exactly 0: its normal deviate is infinite [-]."""


def sobol_indices(
    experiment: Experiment[Response],
    effort: SobolEffort,
    ranked: tuple[str, ...] = (),
    factor_groups: tuple[str, ...] = (),
) -> SobolAnalysis:
    """Return the indices of all outputs, with as many blocks as the order of the first places needs.

    Sources that depend on each other have one index together: a share of each alone would be arbitrary.

    Parameters
    ----------
    effort
        Blocks, from a first number doubled up to a limit, and what stops them.
    ranked
        Outputs that count in the ranking over all, which is the one that must become stable; all of them if empty.
    factor_groups
        Name of what every column belongs to, such as its dimension of the drawing; independent of each other. The
        sources, or blocks of dependent ones, unless given.

    Raises
    ------
    SolveError
        Too many blocks hold a failed sample, or no output varies.

    Notes
    -----
    Correlations act between the columns of one block only, so exchanging all its independent uniform numbers exchanges
    the block and nothing else. A sample without one of its outputs is a failed one for all of them.

    References
    ----------
    Saltelli et al. 2010 (first order), Jansen 1999 (total), Saltelli 2002 (second order), as SALib implements them;
    groups of dependent inputs: Jacques, Lavergne & Devictor 2006.
    """
    errors, seeds, outputs = experiment.errors, experiment.seeds, experiment.response.outputs
    counted, sample = ranked or outputs, seeds.child("sample").integer()
    design = SaltelliDesign(
        factor_groups=factor_groups or errors.block_of_column, seed=sample, second_order=effort.second_order
    )
    answers, steps = list[Evaluation](), list[SaltelliIndices]()

    def resampled(blocks: int) -> Resampled:
        solved = steps[-1].blocks + steps[-1].dropped if steps else 0
        for uniform in design.chunks(solved, blocks):
            standard = errors.standard_values(np.maximum(uniform, _HALF_STEP))
            answers.append(experiment.response(experiment.deviations(standard)))
        answers[:] = [
            Evaluation(
                values=np.concatenate([part.values for part in answers]),
                status=np.concatenate([part.status for part in answers]),
            )
        ]
        steps.append(
            saltelli_indices(
                answers[0],
                len(design.names),
                seeds.child("resamples"),
                second_order=effort.second_order,
                resamples=effort.resamples,
                largest_failed_share=experiment.largest_failed_share,
            )
        )
        ranking = overall_ranking(design.names, outputs, counted, steps[-1])
        return ranking.total, ranking.total_resamples

    growth = grow_until_stable(
        resampled,
        _groups(errors, design.names),
        min(effort.places, len(design.names)),
        start=effort.start,
        limit=effort.limit,
        probability=effort.probability,
    )
    return SobolAnalysis(
        outputs=outputs,
        ranked=counted,
        sources=design.names,
        indices=steps[-1],
        growth=growth,
        samples=answers[0].status.size,
    )


def _groups(errors: ErrorModel, factor_groups: tuple[str, ...]) -> tuple[str, ...]:
    """Return the tolerance group of each factor group: the tolerance that it shares with others, or itself."""
    group_of = {source.name: source.group for source in errors.sources if source.group}
    return tuple(group_of.get(name, name) for name in factor_groups)
