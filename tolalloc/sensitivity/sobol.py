"""Sobol indices of all outputs from one Saltelli design that grows until the ranking is stable.

SALib's traps and the guards against them: seed 0 means unseeded, so seeds are positive; one NaN makes every index zero
and ``conf`` is a multiple of a standard deviation, so `tolalloc.sensitivity.saltelli` estimates, drops blocks with a
failed sample whole, counts them, and keeps the resamples, from which intervals are percentiles; the design is held
whole, so `tolalloc.sensitivity.saltelli` gives the same samples in chunks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.models.model import Evaluation, Response
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.ranking import Resampled, grow_until_stable
from tolalloc.sensitivity.saltelli import SaltelliDesign, SaltelliIndices, saltelli_indices
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis, SolvedDesign, overall_ranking

_HALF_STEP = 2.0**-31
"""Half the step of the scrambled points, which stands for a point of exactly 0: its normal deviate is infinite [-]."""


def sobol_indices(
    experiment: Experiment[Response],
    effort: SobolEffort,
    ranked: tuple[str, ...] = (),
    factor_groups: tuple[str, ...] = (),
    further: Response | None = None,
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
    further
        Response of the outputs that count, which is asked alone after the first number of blocks: no other output needs
        a stable order. All outputs are asked for in all blocks unless it is given.

    Raises
    ------
    SolveError
        Too many blocks hold a failed sample, or no output varies.

    Notes
    -----
    Correlations act between the columns of one block only, so exchanging all its independent uniform numbers exchanges
    the block and nothing else. A sample without one of its outputs is a failed one for all that were asked for.

    References
    ----------
    Saltelli et al. 2010 (first order), Jansen 1999 (total), Saltelli 2002 (second order), as SALib implements them;
    groups of dependent inputs: Jacques, Lavergne & Devictor 2006.
    """
    errors, outputs = experiment.errors, experiment.response.outputs
    counted, sample = ranked or outputs, experiment.seeds.child("sample").integer()
    design = SaltelliDesign(
        factor_groups=factor_groups or errors.block_of_column, seed=sample, second_order=effort.second_order
    )
    blocks = _Blocks(experiment, design, effort, counted, further or experiment.response)
    growth = grow_until_stable(
        blocks.resampled,
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
        indices=blocks.indices,
        growth=growth,
        samples=blocks.answers.status.size,
        blocks_of_others=blocks.steps[0 if further else -1].blocks,
        solved=SolvedDesign(design=design, answers=replace(blocks.answers, values=blocks.answers.values[:, :1])),
    )


class _Blocks:
    """Blocks that are solved when they are first asked for."""

    def __init__(
        self,
        experiment: Experiment[Response],
        design: SaltelliDesign,
        effort: SobolEffort,
        counted: tuple[str, ...],
        further: Response,
    ) -> None:
        self.experiment, self.design, self.effort, self.counted = experiment, design, effort, counted
        self.further = further
        self.kept = [experiment.response.outputs.index(name) for name in further.outputs]
        self.answers: Evaluation
        self.steps = list[SaltelliIndices]()

    def resampled(self, blocks: int) -> Resampled:
        """Return the indices of the ranking over all outputs that count."""
        if self.steps:
            start = self.steps[-1].blocks + self.steps[-1].dropped
            more = solved(self.experiment, self.further, self.design.chunks(start, blocks))
            self.answers = joined([self.answers, more])
            self.steps.append(self._indices(self.answers))
        else:
            first = solved(self.experiment, self.experiment.response, self.design.chunks(0, blocks))
            self.answers = replace(first, values=first.values[:, self.kept])
            self.steps.append(self._indices(first))
        outputs = self.experiment.response.outputs if len(self.steps) == 1 else self.further.outputs
        ranking = overall_ranking(self.design.names, outputs, self.counted, self.steps[-1])
        return ranking.total, ranking.total_resamples

    @property
    def indices(self) -> SaltelliIndices:
        """Indices of all outputs, each from all blocks in which it was asked for."""
        return self.steps[0] if len(self.steps) == 1 else self.steps[-1].instead_of(self.steps[0], self.kept)

    def _indices(self, answers: Evaluation) -> SaltelliIndices:
        return saltelli_indices(
            answers,
            len(self.design.names),
            self.experiment.seeds.child("resamples"),
            second_order=self.effort.second_order,
            resamples=self.effort.resamples,
            largest_failed_share=self.experiment.largest_failed_share,
        )


def solved(
    experiment: Experiment[Response], response: Response, chunks: Iterable[Float[np.ndarray, "sample column"]]
) -> Evaluation:
    """Return what a response says of the samples of a design, uniform numbers chunk by chunk."""
    errors = experiment.errors
    standard = (errors.standard_values(np.maximum(uniform, _HALF_STEP)) for uniform in chunks)
    return joined([response(experiment.deviations(own)) for own in standard])


def joined(parts: Sequence[Evaluation]) -> Evaluation:
    """Return the answers of several parts together."""
    return Evaluation(
        values=np.concatenate([part.values for part in parts]), status=np.concatenate([part.status for part in parts])
    )


def _groups(errors: ErrorModel, factor_groups: tuple[str, ...]) -> tuple[str, ...]:
    """Return the tolerance group of each factor group: the tolerance that it shares with others, or itself."""
    group_of = {source.name: source.group for source in errors.sources if source.group}
    return tuple(group_of.get(name, name) for name in factor_groups)
