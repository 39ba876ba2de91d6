"""Sobol indices of all outputs from one Saltelli design that grows until the ranking is stable.

Points and estimates are SALib's (`tolalloc.sensitivity.saltelli`). Its traps and the guards against them: seed 0 is no
seed, so seeds are positive; one NaN makes every index zero, so blocks with a failed sample are dropped whole and
counted; ``conf`` takes the blocks of a Sobol' sequence for independent, so intervals come from replicates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.linear_function import LinearLaw
from tolalloc.exceptions import ConstantOutputError, InputError, UnknownNameError
from tolalloc.models.model import Evaluation, Response, Samples
from tolalloc.sensitivity.effort import LARGEST, SobolEffort
from tolalloc.sensitivity.ranking import (
    AtSources,
    Convergence,
    Ends,
    Resampled,
    Resamples,
    SourceRanking,
    indistinguishable_from_zero,
    share_interval,
    until_converged,
)
from tolalloc.sensitivity.saltelli import REPLICATES, SaltelliDesign, SaltelliIndices, drawn, saltelli_indices
from tolalloc.sensitivity.surrogate.control_variate import CheapAnswers
from tolalloc.sensitivity.surrogate.regression import Regression


@dataclass(frozen=True, kw_only=True)
class SourceIndices(SourceRanking):
    """Indices of every source for one output; a block of dependent sources counts as one source, named "a + b"."""

    # First-order index, and draws from its error [-]
    first: AtSources
    first_resamples: Resamples
    # Positions of the two sources of every pair, their second-order index, and the same from the resamples; no pairs
    # unless asked for [-]
    pairs: tuple[tuple[int, int], ...]
    second: Float[np.ndarray, " pair"]
    second_resamples: Float[np.ndarray, "resample pair"]

    @classmethod
    def of_linear(cls, law: LinearLaw, groups: tuple[str, ...]) -> SourceIndices:
        """Return the indices of a linear output without an error, by the group of every column.

        Sᵢ = STᵢ = Σ slope²·variance of the group's columns over that of all, correlations in the group included [-].
        """
        of_group = dict.fromkeys(groups, 0.0)
        for group, variance in zip(groups, law.variances.tolist(), strict=True):
            of_group[group] += variance
        share = np.array(list(of_group.values())) / law.variances.sum()
        exact = np.tile(share, (2, 1))
        return cls(
            sources=tuple(of_group),
            total=share,
            total_resamples=exact,
            blocks=0,
            first=share,
            first_resamples=exact,
            pairs=(),
            second=np.empty(0),
            second_resamples=np.empty((2, 0)),
        )

    @property
    def first_interval(self) -> Ends:
        """90 % interval of the first-order indices [-]."""
        return share_interval(self.first_resamples, self.unseen)

    @property
    def second_interval(self) -> Float[np.ndarray, "2 pair"]:
        """90 % interval of the second-order indices [-]."""
        one, other = np.reshape(self.pairs, (-1, 2)).astype(int).T
        unseen = np.broadcast_to(self.unseen, len(self.sources))
        return share_interval(self.second_resamples, np.minimum(unseen[one], unseen[other]))

    @property
    def first_is_zero(self) -> Bool[np.ndarray, " source"]:
        """Which first-order indices are indistinguishable from 0 and must not be printed as a negative share."""
        return indistinguishable_from_zero(self.first_resamples)


@dataclass(frozen=True, kw_only=True)
class SalibArrays:
    """A problem as SALib specifies it, its samples and their answers, for SALib's own analysis and plots."""

    problem: dict[str, Any]  # Columns as uniform numbers in [0, 1], sources as their groups
    samples: Samples  # These numbers, as `SALib.sample.sobol` draws them [-]
    outputs: Float[np.ndarray, " sample"]  # The leading output [output]
    second_order: bool  # Whether the design has the BA samples

    @property
    def for_sobol(self) -> dict[str, Any]:
        """What `SALib.analyze.sobol.analyze` takes, as in ``analyze(**ranking.result.to_salib().for_sobol)``."""
        return {"problem": self.problem, "Y": self.outputs, "calc_second_order": self.second_order}


@dataclass(frozen=True, kw_only=True)
class SobolAnalysis:
    """Indices of all outputs from the same samples."""

    outputs: tuple[str, ...]  # Names of the outputs with their units
    ranked: tuple[str, ...]  # Those among them that count in the ranking over all
    followed: tuple[str, ...]  # Those among them that all blocks were asked for, the one whose order settled first
    sources: tuple[str, ...]  # Names of the groups of columns: sources, blocks of dependent ones, or dimensions
    indices: SaltelliIndices  # Indices of all outputs
    convergence: Convergence  # How the order of the first places settled; one step for a fixed number of blocks
    samples: int  # Samples evaluated [-]
    first_blocks: int  # Saltelli blocks used for the other outputs, and for the groups that came out small [-]
    together: SourceIndices | None = None  # Indices of the followed output with the small groups as one, `OTHERS`
    # What the indices of the followed output come from, where it is kept: the design, and the output block by block
    solved: tuple[SaltelliDesign, Evaluation] | None = None

    @property
    def blocks(self) -> int:
        """Saltelli blocks used for the followed output [-]."""
        return self.indices.blocks

    @property
    def small(self) -> frozenset[int]:
        """Positions of the groups that further blocks took together [-]."""
        known = self.together.sources if self.together else self.sources
        return frozenset(at for at, name in enumerate(self.sources) if name not in known)

    @property
    def dropped(self) -> int:
        """Saltelli blocks dropped because one of their samples failed [-]."""
        return self.indices.dropped

    @property
    def constant(self) -> tuple[str, ...]:
        """Outputs that do not vary and have no indices."""
        return tuple(name for name, varies in zip(self.outputs, self.indices.varies, strict=True) if not varies)

    @cached_property
    def overall(self) -> SourceRanking:
        """The ranking over those outputs that count and vary: the total index of a source is its largest one."""
        varying = np.flatnonzero(self.indices.varies & np.isin(self.outputs, self.ranked))
        total = self.indices.total[varying]
        return SourceRanking(
            sources=self.sources,
            total=total.max(axis=0),
            total_resamples=self.indices.total_resamples[varying].max(axis=0),
            blocks=self.blocks,
            drives=tuple(self.outputs[varying[at]] for at in total.argmax(axis=0)),
            unseen=self.indices.unseen[varying].max(axis=0),
        )

    def position(self, output: str | int) -> int:
        """Return the position of an output [-]."""
        if isinstance(output, str):
            if output not in self.outputs:
                raise UnknownNameError.among("Sobol indices", "output", output, self.outputs)
            return self.outputs.index(output)
        if not 0 <= output < len(self.outputs):
            raise InputError.at("Sobol indices", "output", output, f"0 to {len(self.outputs) - 1}")
        return output

    def to_salib(self) -> SalibArrays:
        """Return the design and its answers as SALib takes them; blocks with a failed sample are left out whole."""
        assert self.solved is not None
        design, answers = self.solved
        size = design.samples_per_block
        whole = np.repeat(answers.good.reshape(-1, size).all(axis=1), size)
        return SalibArrays(
            problem=design.problem,
            samples=np.concatenate(list(design.chunks(0, whole.size // size)))[whole],
            outputs=answers.values[whole, 0],
            second_order=design.second_order,
        )

    def narrowed(self, output: str | int) -> float:
        """Return the median over all sources of how wide an interval is over that without a control variate [-]."""
        return float(np.median(self.indices.narrowed[self.position(output)]))

    def of(self, output: str | int) -> SourceIndices:
        """Return the indices of one output."""
        at = self.position(output)
        followed = self.outputs[at] in self.followed
        blocks, few = (self.blocks, self.small) if followed else (self.first_blocks, frozenset[int]())
        return _indices_of(self.indices, at, self.outputs[at], self.sources, blocks, few)


def _indices_of(
    found: SaltelliIndices,
    at: int,
    output: str,
    sources: tuple[str, ...],
    blocks: int,
    few: frozenset[int] = frozenset(),
) -> SourceIndices:
    """Return the indices at one place, of an output from so many blocks."""
    if not found.varies[at]:
        raise ConstantOutputError(f"Sobol indices: {output} is the same for all samples; no source can be ranked.")
    kinds = ("first", "total", "second")
    own = {name: getattr(found, name)[at] for name in (*kinds, *(f"{kind}_resamples" for kind in kinds), "unseen")}
    return SourceIndices(sources=sources, pairs=found.pairs, blocks=blocks, few=few, **own)


@dataclass(frozen=True, kw_only=True)
class OrderContribution:
    """Generalised Sobol indices of the wave of every order."""

    orders: tuple[float, ...]  # Orders of the output turn [-]
    sources: tuple[str, ...]  # Names, in the order of all arrays
    # Share of the wave's variance that a source gives alone, and in which it takes part; NaN for a wave that does not
    # vary [-]
    first: Float[np.ndarray, "order source"]
    total: Float[np.ndarray, "order source"]
    # The same as draws from their errors [-]
    first_resamples: Float[np.ndarray, "order resample source"]
    total_resamples: Float[np.ndarray, "order resample source"]
    unseen: Float[np.ndarray, "order source"]  # Share that a source may have where too few blocks show it, else 0 [-]
    # Root of the sum of the variances of cosine and sine, the standard deviation of the wave [output]
    deviation: Float[np.ndarray, " order"]

    @property
    def first_interval(self) -> Float[np.ndarray, "order 2 source"]:
        """90 % interval of the shares that the sources give alone [-]."""
        return np.stack([share_interval(*own) for own in zip(self.first_resamples, self.unseen, strict=True)])

    @property
    def total_interval(self) -> Float[np.ndarray, "order 2 source"]:
        """90 % interval of the shares in which the sources take part [-]."""
        return np.stack([share_interval(*own) for own in zip(self.total_resamples, self.unseen, strict=True)])


def order_contribution(analysis: SobolAnalysis, waves: Mapping[float, Sequence[str | int]]) -> OrderContribution:
    """Return what each source adds to the wave of each order, from the samples of an analysis.

    Parameters
    ----------
    analysis
        Indices of outputs among which are the waves.
    waves
        Order → output of the cosine and of the sine, in the same unit.

    Notes
    -----
    The index of a vector is Σ V_o·S_o / Σ V_o over its components o [-], theory page equation (44). It does not depend
    on where the turn begins, which the indices of cosine and sine alone do. Without a replicate the components have
    their own variances.

    References
    ----------
    Lamboni, Monod & Makowski 2011; Gamboa, Janon, Klein & Lagnoux 2014, eq. (2.2): the trace of the covariance.

    Examples
    --------
    A wave whose cosine and sine are the same sum has the shares of that sum, 1/5 and 4/5.

    >>> from tolalloc.drawings.seeds import SeedTree
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "min": 1, "max": 60, "cost": 1}
    >>> rows = [{"id": "a", "plus": 3, "minus": -3, **row}, {"id": "b", "plus": 6, "minus": -6, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> y = ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("y [mm]",)).bound(errors, "")
    >>> experiment = Experiment.of(y, errors, SeedTree(1))
    >>> found = sobol_indices(experiment, SobolEffort(start=4096, limit=4096, places=1))
    >>> order_contribution(found, {1: (0, 0)}).total.round(2).tolist()
    [[0.2, 0.8]]
    """
    if not waves:
        raise InputError("Contribution to orders: no order is given.")
    found = analysis.indices
    pairs = np.array([[analysis.position(output) for output in pair] for pair in waves.values()])
    variance = np.concatenate([found.variance[:, np.newaxis], found.variance_left_out], axis=1)[pairs]
    first, total = (
        _of_waves(np.concatenate([estimate[:, np.newaxis], left_out], axis=1)[pairs], variance)
        for estimate, left_out in ((found.first, found.first_left_out), (found.total, found.total_left_out))
    )
    return OrderContribution(
        orders=tuple(waves),
        sources=analysis.sources,
        first=first[:, 0],
        total=total[:, 0],
        first_resamples=drawn(first, found.weights),
        total_resamples=drawn(total, found.weights, positive=True),
        unseen=_of_waves(found.unseen[pairs][:, :, np.newaxis], variance[:, :, :1])[:, 0],
        deviation=np.sqrt(variance[:, :, 0].sum(axis=1)),
    )


def _of_waves(
    indices: Float[np.ndarray, "order 2 row source"], variance: Float[np.ndarray, "order 2 row"]
) -> Float[np.ndarray, "order row source"]:
    """Return the index of every wave from those of its cosine and sine [-]."""
    weights = variance[:, :, :, np.newaxis]
    # A cosine or sine that does not vary has no index and no weight.
    parts = np.multiply(weights, indices, out=np.zeros_like(indices), where=weights > 0).sum(axis=1)
    whole = weights.sum(axis=1)
    # Blocks without variance have the index 0, as for a single output; a wave that never varies has none.
    shares = np.divide(parts, whole, out=np.zeros_like(parts), where=whole > 0)
    shares[whole[:, 0, 0] == 0] = np.nan
    return np.asarray(shares)


OTHERS = "all others"
"""Name of the groups of columns that further blocks exchange together."""
_HALF_STEP = 2.0**-31
"""Half the step of the scrambled points, which stands for a point of exactly 0: its normal deviate is infinite [-]."""


def sobol_indices(
    experiment: Experiment[Response],
    effort: SobolEffort,
    ranked: tuple[str, ...] = (),
    factor_groups: tuple[str, ...] = (),
    further: Callable[[tuple[str, ...]], Response] | None = None,
    cheap: Regression | None = None,
) -> SobolAnalysis:
    """Return the indices of all outputs, with as many blocks as the order of the first places needs.

    Sources that depend on each other have one index together: a share of each alone would be arbitrary. The first
    number of blocks tells all groups of columns apart and parts the eight largest of the first output that counts from
    the rest; further blocks are for their order alone and exchange all others together.

    Parameters
    ----------
    effort
        Blocks, from a first number doubled up to a limit, and what stops them.
    ranked
        Outputs that count in the ranking over all; all of them if empty. The order of the first one that varies must
        become stable.
    factor_groups
        Name of what every column belongs to, such as its dimension of the drawing; independent of each other. The
        sources, or blocks of dependent ones, unless given.
    further
        Response of some outputs by their names, asked after the first number of blocks for the one whose order must
        become stable. All outputs are asked for in all blocks unless it is given.
    cheap
        Model of some of the outputs, learnt from units of other random numbers, as a control variate.

    Notes
    -----
    Correlations act between the columns of one block only, so exchanging all its independent uniform numbers exchanges
    the block and nothing else. A sample without one of its outputs is a failed one for all that were asked for.

    References
    ----------
    Saltelli et al. 2010 (first order), Jansen 1999 (total), Saltelli 2002 (second order), as SALib implements them;
    groups of dependent inputs: Jacques, Lavergne & Devictor 2006; control variates: Lavenberg & Welch 1981.

    Examples
    --------
    A sum with σ of 1 and 2 has the total indices 1/5 and 4/5.

    >>> from tolalloc.drawings.seeds import SeedTree
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "min": 1, "max": 60, "cost": 1}
    >>> rows = [{"id": "a", "plus": 3, "minus": -3, **row}, {"id": "b", "plus": 6, "minus": -6, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> y = ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("y [mm]",)).bound(errors, "")
    >>> experiment = Experiment.of(y, errors, SeedTree(1))
    >>> found = sobol_indices(experiment, SobolEffort(start=4096, limit=4096, places=1))
    >>> found.of(0).total.round(2).tolist()
    [0.2, 0.8]
    """
    errors, outputs = experiment.errors, experiment.response.outputs
    counted, sample = ranked or outputs, experiment.seeds.child("sample").integer()
    design = SaltelliDesign(
        factor_groups=factor_groups or errors.block_of_column,
        seed=sample,
        second_order=effort.second_order,
        columns=errors.columns,
        replicates=min(REPLICATES, effort.start),
    )
    further = further or (lambda _: experiment.response)
    blocks = _Blocks(experiment=experiment, design=design, effort=effort, counted=counted, further=further, cheap=cheap)
    shared = {source.name: source.dimension for source in errors.sources}  # the tolerance that a source may share
    convergence = until_converged(
        blocks.resampled,
        tuple(shared.get(name, name) for name in design.names),
        min(effort.places, len(design.names)),
        start=effort.start,
        limit=effort.limit,
        probability=effort.probability,
    )
    return SobolAnalysis(
        outputs=outputs,
        ranked=counted,
        followed=blocks.followed.outputs,
        sources=design.names,
        indices=blocks.indices,
        convergence=convergence,
        samples=blocks.samples,
        first_blocks=blocks.first.blocks,
        together=blocks.together,
        solved=(blocks.design, replace(blocks.answers, values=blocks.answers.values[:, :1])),
    )


_CHEAP_TIMES = 16
"""Blocks of a cheap model over those that it corrects, at least [-]."""
_CHEAP_SAMPLES = 2**16
"""Samples of a cheap model at least, with which its own indices err by some 1e-4 where it is smooth [-]."""


@dataclass(kw_only=True)
class _Blocks:
    """Blocks that are solved when they are first asked for."""

    experiment: Experiment[Response]
    design: SaltelliDesign
    effort: SobolEffort
    counted: tuple[str, ...]
    further: Callable[[tuple[str, ...]], Response]
    cheap: Regression | None
    samples: int = 0
    first: SaltelliIndices = field(init=False)  # Of all outputs and groups, from the first number of blocks
    last: SaltelliIndices | None = None  # Of the followed outputs and the groups of the present design
    leading: int = 0  # Position of the first output that counts and varies
    followed: Response = field(init=False)  # What is asked of further blocks
    answers: Evaluation = field(init=False)  # Its outputs in all blocks of the design

    def __post_init__(self) -> None:
        self.names, self.outputs = self.design.names, self.experiment.response.outputs

    def resampled(self, blocks: int) -> Resampled:
        """Return the indices of the output whose order must become stable."""
        if not self.samples:
            self._begin(blocks)
        else:
            if self.last is None:
                self._part()
            start = self.answers.status.size // self.design.samples_per_block
            more = solved(self.experiment, self.followed, self.design.chunks(start, blocks))
            self.samples += more.status.size
            self.answers = Evaluation.joined([self.answers, more])
            self.last = self._indices(self.answers, self.followed.outputs)
        found = self.indices
        return found.total[self.leading], found.total_resamples[self.leading]

    @property
    def indices(self) -> SaltelliIndices:
        """Indices of all outputs and groups, each from all blocks that tell it."""
        if self.last is None:
            return self.first
        there = {self.names.index(name): at for at, name in enumerate(self.design.names) if name in self.names}
        return self.first.with_part(self.last, self._places, there)

    @property
    def together(self) -> SourceIndices | None:
        """Indices of the followed output with the small groups as one; none where all are told apart."""
        if self.last is None or self.design.names == self.names:
            return None
        leading = self.outputs[self.leading]
        at = self.followed.outputs.index(leading)
        return _indices_of(self.last, at, leading, self.design.names, self.last.blocks)

    @property
    def _places(self) -> list[int]:
        return [self.outputs.index(name) for name in self.followed.outputs]

    def _begin(self, blocks: int) -> None:
        """Solve the first blocks, which tell all groups apart for all outputs."""
        found = solved(self.experiment, self.experiment.response, self.design.chunks(0, blocks))
        self.samples = found.status.size
        self.first = self._indices(found, self.outputs)
        varying = [at for at in map(self.outputs.index, self.counted) if self.first.varies[at]]
        if not varying:
            raise ConstantOutputError(
                "Sobol indices: every output is the same for all samples, so no source can be ranked."
            )
        self.leading = varying[0]
        self.followed = self.further((self.outputs[self.leading],))
        self.answers = replace(found, values=found.values[:, self._places])

    def _part(self) -> None:
        """Part the largest groups from the rest, which is one group from here on.

        The samples A and B are the same for any groups, and so are those in which a group that is in both designs is
        exchanged: only those of the rest are solved.
        """
        total = self.first.total[self.leading]
        if self.effort.second_order or total.size <= LARGEST + 1:
            return
        largest = {self.names[at] for at in np.argsort(-total, kind="stable")[:LARGEST]}
        groups = tuple(own if own in largest else OTHERS for own in self.design.factor_groups)
        before, self.design = self.design, replace(self.design, factor_groups=groups)
        size, places = before.samples_per_block, {own: at for at, own in enumerate(before.columns_of_names, start=1)}
        blocks = self.answers.status.size // size
        more = solved(self.experiment, self.followed, self.design.chunks(0, blocks, only=OTHERS))
        self.samples += more.status.size
        order = [0, *(places.get(own, size) for own in self.design.columns_of_names), size - 1]
        values, status = (
            np.concatenate([known.reshape(blocks, size, -1), new.reshape(blocks, 1, -1)], axis=1)[:, order]
            for known, new in ((self.answers.values, more.values), (self.answers.status, more.status))
        )
        self.answers = Evaluation(values=values.reshape(-1, values.shape[2]), status=status.reshape(-1))

    def _indices(self, answers: Evaluation, outputs: tuple[str, ...]) -> SaltelliIndices:
        blocks = answers.status.size // self.design.samples_per_block
        return saltelli_indices(
            answers,
            len(self.design.names),
            self.experiment.seeds.child("resamples"),
            replicates=self.design.replicates,
            second_order=self.effort.second_order,
            resamples=self.effort.resamples,
            largest_failed_share=self.experiment.largest_failed_share,
            control=self._control(blocks, outputs),
        )

    def _control(self, blocks: int, outputs: tuple[str, ...]) -> CheapAnswers | None:
        """Return what a cheap model says of so many blocks and of many others; a constant of outputs it has not."""
        if self.cheap is None:
            return None
        needed = max(_CHEAP_TIMES * blocks, _CHEAP_SAMPLES // self.design.samples_per_block)
        other = replace(self.design, seed=self.experiment.seeds.child("cheap").integer())
        answers = []
        for design, count in ((self.design, blocks), (other, 1 << (needed - 1).bit_length())):
            known = solved(self.experiment, self.cheap, design.chunks(0, count)).values
            own = self.cheap.outputs
            places = [own.index(name) if name in own else known.shape[1] for name in outputs]
            answers.append(np.column_stack([known, np.zeros(len(known))])[:, places])
        return CheapAnswers(own=answers[0], many=answers[1])


def solved(experiment: Experiment[Response], response: Response, chunks: Iterable[Samples]) -> Evaluation:
    """Return what a response says of the samples of a design, uniform numbers chunk by chunk."""
    errors = experiment.errors
    standard = (errors.standard_values(np.maximum(uniform, _HALF_STEP)) for uniform in chunks)
    return Evaluation.joined([response(experiment.deviations(own)) for own in standard])
