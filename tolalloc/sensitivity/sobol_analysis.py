"""What a Sobol analysis says: the indices of every output, one ranking over those that count, and shares of waves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.ranking import Growth, SourceRanking, indistinguishable_from_zero, percentile_interval
from tolalloc.sensitivity.saltelli import SaltelliDesign, SaltelliIndices


@dataclass(frozen=True, kw_only=True)
class SobolIndices(SourceRanking):
    """Indices of every source for one output; a block of dependent sources counts as one source, named "a + b"."""

    # First-order index, and the same from bootstrap resamples of the blocks [-]
    first: Float[np.ndarray, " source"]
    first_resamples: Float[np.ndarray, "resample source"]
    # Positions of the two sources of every pair, their second-order index, and the same from the resamples; no pairs
    # unless asked for [-]
    pairs: tuple[tuple[int, int], ...]
    second: Float[np.ndarray, " pair"]
    second_resamples: Float[np.ndarray, "resample pair"]
    dropped: int  # Saltelli blocks dropped because one of their samples failed [-]
    samples: int  # Samples evaluated [-]

    @property
    def first_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % percentile interval of the first-order indices [-]."""
        return percentile_interval(self.first_resamples)

    @property
    def second_interval(self) -> Float[np.ndarray, "2 pair"]:
        """90 % percentile interval of the second-order indices [-]."""
        return percentile_interval(self.second_resamples)

    @property
    def first_is_zero(self) -> Bool[np.ndarray, " source"]:
        """Which first-order indices are indistinguishable from 0 and must not be printed as a negative share."""
        return indistinguishable_from_zero(self.first_resamples)


@dataclass(frozen=True, kw_only=True)
class SolvedDesign:
    """A Saltelli design whose samples are solved."""

    design: SaltelliDesign  # Which samples they are
    answers: Evaluation  # The first output, block by block


@dataclass(frozen=True, kw_only=True)
class SobolAnalysis:
    """Indices of all outputs from the same samples."""

    outputs: tuple[str, ...]  # Names of the outputs with their units
    ranked: tuple[str, ...]  # Those among them that count in the ranking over all
    sources: tuple[str, ...]  # Names of the sources, or of the blocks of dependent ones
    indices: SaltelliIndices  # Indices of all outputs
    growth: Growth  # How the order of the first places settled; one step for a fixed number of blocks
    samples: int  # Samples evaluated [-]
    blocks_of_others: int  # Saltelli blocks used for outputs that do not count [-]
    solved: SolvedDesign | None = None  # What the indices of the first output come from, where it is kept

    @property
    def blocks(self) -> int:
        """Saltelli blocks used for the outputs that count [-]."""
        return self.indices.blocks

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
        """The ranking over all outputs."""
        return overall_ranking(self.sources, self.outputs, self.ranked, self.indices)

    def position(self, output: str | int) -> int:
        """Return the position of an output [-].

        Raises
        ------
        UnknownNameError, InputError
            There is no such output.
        """
        if isinstance(output, str):
            if output not in self.outputs:
                raise UnknownNameError.among("Sobol indices", "output", output, self.outputs)
            return self.outputs.index(output)
        if not 0 <= output < len(self.outputs):
            raise InputError.at("Sobol indices", "output", output, f"0 to {len(self.outputs) - 1}")
        return output

    def of(self, output: str | int) -> SobolIndices:
        """Return the indices of one output.

        Raises
        ------
        SolveError
            The output is the same for all samples.
        """
        at, counts = self.position(output), self.outputs[self.position(output)] in self.ranked
        blocks = self.blocks if counts else self.blocks_of_others
        return indices_of(self.indices, at, self.outputs[at], self.sources, blocks, self.samples)


def indices_of(
    found: SaltelliIndices, at: int, output: str, sources: tuple[str, ...], blocks: int, samples: int
) -> SobolIndices:
    """Return the indices at one place, of an output from so many blocks of an analysis with so many samples [-].

    Raises
    ------
    SolveError
        The output is the same for all samples.
    """
    if not found.varies[at]:
        raise SolveError(f"Sobol indices: {output} is the same for all samples; no source can be ranked.")
    return SobolIndices(
        sources=sources,
        first=found.first[at],
        total=found.total[at],
        first_resamples=found.first_resamples[at],
        total_resamples=found.total_resamples[at],
        pairs=found.pairs,
        second=found.second[at],
        second_resamples=found.second_resamples[at],
        blocks=blocks,
        dropped=found.dropped,
        samples=samples,
    )


def overall_ranking(
    sources: tuple[str, ...], outputs: tuple[str, ...], ranked: tuple[str, ...], indices: SaltelliIndices
) -> SourceRanking:
    """Return the ranking over those outputs that count and vary: the total index of a source is its largest one.

    Raises
    ------
    SolveError
        None of them varies.
    """
    varying = np.flatnonzero(indices.varies & np.isin(outputs, ranked))
    if not varying.size:
        raise SolveError("Sobol indices: every output is the same for all samples, so no source can be ranked.")
    total = indices.total[varying]
    return SourceRanking(
        sources=sources,
        total=total.max(axis=0),
        total_resamples=indices.total_resamples[varying].max(axis=0),
        blocks=indices.blocks,
        drives=tuple(outputs[varying[at]] for at in total.argmax(axis=0)),
    )


@dataclass(frozen=True, kw_only=True)
class OrderContribution:
    """Generalised Sobol indices of the wave of every order."""

    orders: tuple[int, ...]  # Orders of the output turn [-]
    sources: tuple[str, ...]  # Names, in the order of all arrays
    # Share of the wave's variance that a source gives alone, and in which it takes part; NaN for a wave that does not
    # vary [-]
    first: Float[np.ndarray, "order source"]
    total: Float[np.ndarray, "order source"]
    # The same from bootstrap resamples of the blocks [-]
    first_resamples: Float[np.ndarray, "order resample source"]
    total_resamples: Float[np.ndarray, "order resample source"]
    # Root of the sum of the variances of cosine and sine, the standard deviation of the wave [output]
    deviation: Float[np.ndarray, " order"]

    @property
    def first_interval(self) -> Float[np.ndarray, "order 2 source"]:
        """90 % percentile interval of the shares that the sources give alone [-]."""
        return np.stack([percentile_interval(own) for own in self.first_resamples])

    @property
    def total_interval(self) -> Float[np.ndarray, "order 2 source"]:
        """90 % percentile interval of the shares in which the sources take part [-]."""
        return np.stack([percentile_interval(own) for own in self.total_resamples])


def order_contribution(analysis: SobolAnalysis, waves: Mapping[int, tuple[str | int, str | int]]) -> OrderContribution:
    """Return what each source adds to the wave of each order, from the samples of an analysis.

    Parameters
    ----------
    analysis
        Indices of outputs among which are the waves.
    waves
        Order → output of the cosine and of the sine, in the same unit.

    Notes
    -----
    The index of a vector is Σ V_o·S_o / Σ V_o over its components o. It does not depend on where the turn begins, which
    the indices of cosine and sine alone do. Resamples weigh the components with their own variances.

    References
    ----------
    Lamboni, Monod & Makowski 2011; Gamboa, Janon, Klein & Lagnoux 2014, eq. (2.2): the trace of the covariance.
    """
    if not waves:
        raise InputError("Contribution to orders: no order is given.")
    found = analysis.indices
    pairs = np.array([[analysis.position(output) for output in pair] for pair in waves.values()])
    variance = np.concatenate([found.variance[:, np.newaxis], found.variance_resamples], axis=1)[pairs]
    first, total = (
        _of_waves(np.concatenate([estimate[:, np.newaxis], resamples], axis=1)[pairs], variance)
        for estimate, resamples in ((found.first, found.first_resamples), (found.total, found.total_resamples))
    )
    return OrderContribution(
        orders=tuple(waves),
        sources=analysis.sources,
        first=first[:, 0],
        total=total[:, 0],
        first_resamples=first[:, 1:],
        total_resamples=total[:, 1:],
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
    # A resample without variance has the index 0, as for a single output; a wave that never varies has none.
    shares = np.divide(parts, whole, out=np.zeros_like(parts), where=whole > 0)
    shares[whole[:, 0, 0] == 0] = np.nan
    return np.asarray(shares)
