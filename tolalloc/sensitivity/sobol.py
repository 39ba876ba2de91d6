"""Sobol indices per source on SALib's design, with the confidence of the ranking that they give.

SALib's traps and the guards against them: seed 0 means unseeded, so seeds are positive; one NaN makes every index zero
and ``conf`` is a multiple of a standard deviation, so `tolalloc.sensitivity.saltelli` estimates, drops blocks with a
failed sample whole, counts them, and keeps the resamples, from which intervals are percentiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from SALib.sample import sobol as sobol_sample

from tolalloc.response.interface import Response
from tolalloc.sensitivity.ranking import Neighbours, among_first, neighbours, percentile_interval, rank_interval
from tolalloc.sensitivity.saltelli import saltelli_indices
from tolalloc.uncertainty.error_model import ErrorModel
from tolalloc.uncertainty.seeds import SeedTree

LARGEST_DROPPED_SHARE = 0.05
_RESAMPLES = 400


@dataclass(frozen=True, kw_only=True)
class SobolIndices:
    """Indices of every source for one output.

    Parameters
    ----------
    sources
        Names, in the order of all arrays.
    first, total
        First-order and total index [-].
    first_resamples, total_resamples
        The same from bootstrap resamples of the blocks [-].
    blocks, dropped
        Saltelli blocks used, and blocks dropped because one of their samples failed [-].
    samples
        Samples evaluated [-].
    """

    sources: tuple[str, ...]
    first: Float[np.ndarray, " source"]
    total: Float[np.ndarray, " source"]
    first_resamples: Float[np.ndarray, "resample source"]
    total_resamples: Float[np.ndarray, "resample source"]
    blocks: int
    dropped: int
    samples: int

    @property
    def first_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % percentile interval of the first-order indices [-]."""
        return percentile_interval(self.first_resamples)

    @property
    def total_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % percentile interval of the total indices [-]."""
        return percentile_interval(self.total_resamples)

    @property
    def order(self) -> list[int]:
        """Positions of the sources, largest total index first."""
        return [int(at) for at in np.argsort(-self.total, kind="stable")]

    @property
    def rank_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % percentile interval of each source's rank over the resamples, 1 for the largest [-]."""
        return rank_interval(self.total_resamples).astype(float)

    @property
    def neighbours(self) -> tuple[Neighbours, ...]:
        """Sources that follow each other, largest total index first, and what would tell them apart."""
        return neighbours(self.total, self.total_resamples, self.blocks)

    def among_first(self, count: int) -> Float[np.ndarray, " source"]:
        """Return the share of resamples in which each source is among the first ``count`` [-]."""
        return among_first(self.total_resamples, count)


def sobol_indices(
    response: Response, errors: ErrorModel, zones: Float[np.ndarray, " source"], seeds: SeedTree, blocks: int
) -> SobolIndices:
    """Return first-order and total indices with one group per source.

    Parameters
    ----------
    response
        What answers; its columns are those of the error model and its first output is analysed.
    errors
        The sources, independent of each other.
    zones
        Zones of the active sources [m].
    seeds
        Node of the seed tree.
    blocks
        Base samples, a power of two; the response is called (sources + 2) times as often [-].

    Raises
    ------
    SolveError
        More than 5 % of the blocks hold a failed sample.

    References
    ----------
    Saltelli et al. 2010 (first order), Jansen 1999 (total), as SALib implements them.
    """
    problem = {
        "num_vars": len(errors.columns),
        "names": list(errors.columns),
        "groups": list(errors.source_of_column),
        "bounds": [[0.0, 1.0]] * len(errors.columns),
    }
    names = tuple(dict.fromkeys(errors.source_of_column))
    uniform = sobol_sample.sample(problem, blocks, calc_second_order=False, seed=seeds.child("sample").integer())
    tiny = np.finfo(float).tiny
    x = errors.deviations(errors.standard_values(np.clip(uniform, tiny, 1 - 1e-16)), zones)
    evaluation = response(x)
    found = saltelli_indices(
        evaluation,
        len(names),
        seeds.child("resamples"),
        resamples=_RESAMPLES,
        largest_dropped_share=LARGEST_DROPPED_SHARE,
    )
    found.require_varying(0)
    return SobolIndices(
        sources=names,
        first=found.first[0],
        total=found.total[0],
        first_resamples=found.first_resamples[0],
        total_resamples=found.total_resamples[0],
        blocks=found.blocks,
        dropped=found.dropped,
        samples=x.shape[0],
    )
