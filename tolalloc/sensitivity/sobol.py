"""Sobol indices of all outputs from one Saltelli design that grows until the ranking is stable.

SALib's traps and the guards against them: seed 0 means unseeded, so seeds are positive; one NaN makes every index zero
and ``conf`` is a multiple of a standard deviation, so `tolalloc.sensitivity.saltelli` estimates, drops blocks with a
failed sample whole, counts them, and keeps the resamples, from which intervals are percentiles; the design is held
whole, so `tolalloc.sensitivity.saltelli` gives the same samples in chunks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.exceptions import InputError
from tolalloc.models import Evaluation, Response
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.ranking import Resampled, grow_until_stable
from tolalloc.sensitivity.saltelli import SaltelliDesign, SaltelliIndices, saltelli_indices
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis, overall_ranking

_HALF_STEP = 2.0**-31
"""Half the step of the scrambled points, which stands for a point of exactly 0: its normal deviate is infinite [-]."""


class FactorGroup(StrEnum):
    """Whose share of the variance an index is."""

    SOURCE = "source"
    """One source; the sources must be independent."""
    BLOCK = "block"
    """Sources that depend on each other, together; one source where it depends on no other."""


@dataclass
class _Answers:
    """Answers of the blocks so far; only new blocks are evaluated."""

    experiment: Experiment[Response]
    design: SaltelliDesign
    blocks: int = 0
    parts: list[Evaluation] = field(default_factory=list)

    def up_to(self, blocks: int) -> Evaluation:
        """Return the answers of the first blocks."""
        for uniform in self.design.chunks(self.blocks, blocks):
            standard = self.experiment.errors.standard_values(np.maximum(uniform, _HALF_STEP))
            self.parts.append(self.experiment.response(self.experiment.deviations(standard)))
        self.blocks = blocks
        joined = Evaluation(
            values=np.concatenate([part.values for part in self.parts]),
            status=np.concatenate([part.status for part in self.parts]),
        )
        self.parts = [joined]
        return joined


def sobol_indices(
    experiment: Experiment[Response],
    effort: SobolEffort,
    factor_group: FactorGroup = FactorGroup.SOURCE,
    ranked: tuple[str, ...] = (),
) -> SobolAnalysis:
    """Return the indices of all outputs, with as many blocks as the order of the first places needs.

    Parameters
    ----------
    effort
        Blocks, from a first number doubled up to a limit, and what stops them.
    factor_group
        Whether each source has an index, or each block of sources that depend on each other.
    ranked
        Outputs that count in the ranking over all, which is the one that must become stable; all of them if empty.

    Raises
    ------
    InputError
        An index per source is asked for although sources are correlated.
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
    factor_groups, counted = _factor_groups(errors, factor_group), ranked or outputs
    design = SaltelliDesign(
        factor_groups=factor_groups, seed=seeds.child("sample").integer(), second_order=effort.second_order
    )
    answers, steps = _Answers(experiment, design), list[SaltelliIndices]()

    def resampled(blocks: int) -> Resampled:
        steps.append(
            saltelli_indices(
                answers.up_to(blocks),
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
        samples=answers.blocks * design.samples_per_block,
    )


def _groups(errors: ErrorModel, factor_groups: tuple[str, ...]) -> tuple[str, ...]:
    """Return the tolerance group of each factor group: the tolerance that it shares with others, or itself."""
    group_of = {source.name: source.group for source in errors.sources if source.group}
    return tuple(group_of.get(name, name) for name in factor_groups)


def _factor_groups(errors: ErrorModel, factor_group: FactorGroup) -> tuple[str, ...]:
    """Return the name of the factor group of each column."""
    correlated = [" + ".join(block) for block in errors.blocks if len(block) > 1]
    if factor_group is FactorGroup.SOURCE and correlated:
        raise InputError(
            f"Sobol indices: {'; '.join(correlated)} are correlated; a Sobol index per source would share their "
            "variance arbitrarily; rank blocks or ask for Shapley effects."
        )
    return errors.block_of_column
