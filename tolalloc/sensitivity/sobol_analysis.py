"""What a Sobol analysis says: the indices of every output, and one ranking over those that count."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.sensitivity.growth import Growth
from tolalloc.sensitivity.ranking import SourceRanking, indistinguishable_from_zero, percentile_interval
from tolalloc.sensitivity.saltelli import SaltelliIndices


@dataclass(frozen=True, kw_only=True)
class SobolIndices(SourceRanking):
    """Indices of every source for one output; a block of dependent sources counts as one source, named "a + b".

    Parameters
    ----------
    first, first_resamples
        First-order index, and the same from bootstrap resamples of the blocks [-].
    pairs, second, second_resamples
        Positions of the two sources of every pair, their second-order index, and the same from the resamples; no pairs
        unless asked for [-].
    dropped
        Saltelli blocks dropped because one of their samples failed [-].
    samples
        Samples evaluated [-].
    """

    first: Float[np.ndarray, " source"]
    first_resamples: Float[np.ndarray, "resample source"]
    pairs: tuple[tuple[int, int], ...]
    second: Float[np.ndarray, " pair"]
    second_resamples: Float[np.ndarray, "resample pair"]
    dropped: int
    samples: int

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
class OverallRanking(SourceRanking):
    """One ranking over all outputs: the total index of a source is its largest one over the outputs that vary.

    Parameters
    ----------
    drives
        Output for which each source has that index.
    """

    drives: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class SobolAnalysis:
    """Indices of all outputs from the same samples.

    Parameters
    ----------
    outputs
        Names of the outputs with their units.
    ranked
        Those among them that count in the ranking over all.
    sources
        Names of the sources, or of the blocks of dependent ones.
    indices
        Indices of all outputs.
    growth
        How the order of the first places settled; one step for a fixed number of blocks.
    samples
        Samples evaluated [-].
    """

    outputs: tuple[str, ...]
    ranked: tuple[str, ...]
    sources: tuple[str, ...]
    indices: SaltelliIndices
    growth: Growth
    samples: int

    @property
    def blocks(self) -> int:
        """Saltelli blocks used [-]."""
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
    def overall(self) -> OverallRanking:
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
        at, found = self.position(output), self.indices
        if not found.varies[at]:
            raise SolveError(f"Sobol indices: {self.outputs[at]} is the same for all samples; no source can be ranked.")
        none = np.empty((len(found.first), 1 + found.first_resamples.shape[1], 0))
        return SobolIndices(
            sources=self.sources,
            first=found.first[at],
            total=found.total[at],
            first_resamples=found.first_resamples[at],
            total_resamples=found.total_resamples[at],
            pairs=() if found.second is None else found.pairs,
            second=(none[:, 0] if found.second is None else found.second)[at],
            second_resamples=(none[:, 1:] if found.second_resamples is None else found.second_resamples)[at],
            blocks=found.blocks,
            dropped=found.dropped,
            samples=self.samples,
        )


def overall_ranking(
    sources: tuple[str, ...], outputs: tuple[str, ...], ranked: tuple[str, ...], indices: SaltelliIndices
) -> OverallRanking:
    """Return the ranking over those outputs that count and vary.

    Parameters
    ----------
    sources, outputs
        Names, in the order of the indices.
    ranked
        Outputs that count.
    indices
        Indices of all outputs.

    Raises
    ------
    SolveError
        None of them varies.
    """
    varying = np.flatnonzero(indices.varies & np.isin(outputs, ranked))
    if not varying.size:
        raise SolveError("Sobol indices: every output is the same for all samples, so no source can be ranked.")
    total = indices.total[varying]
    return OverallRanking(
        sources=sources,
        total=total.max(axis=0),
        total_resamples=indices.total_resamples[varying].max(axis=0),
        blocks=indices.blocks,
        drives=tuple(outputs[varying[at]] for at in total.argmax(axis=0)),
    )
