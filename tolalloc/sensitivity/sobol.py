"""Sobol indices per source through SALib, with the confidence of the ranking that they give.

SALib's traps and the guards against them: one NaN makes every index zero, so blocks with a failed sample
are dropped whole and counted; seed 0 means unseeded, so seeds are positive; its ``conf`` is a multiple of
a standard deviation, so intervals are percentiles of the kept resamples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from SALib.analyze import sobol as sobol_analysis
from SALib.sample import sobol as sobol_sample

from tolalloc.exceptions import SolveError
from tolalloc.response.interface import Response
from tolalloc.uncertainty.seeds import SeedTree
from tolalloc.uncertainty.sources import ErrorModel

INTERVAL = (0.05, 0.95)
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
        return np.asarray(np.quantile(self.first_resamples, INTERVAL, axis=0))

    @property
    def total_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % percentile interval of the total indices [-]."""
        return np.asarray(np.quantile(self.total_resamples, INTERVAL, axis=0))

    @property
    def order(self) -> list[int]:
        """Positions of the sources, largest total index first."""
        return [int(at) for at in np.argsort(-self.total, kind="stable")]

    @property
    def rank_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % percentile interval of each source's rank over the resamples, 1 for the largest [-]."""
        ranks = np.argsort(np.argsort(-self.total_resamples, axis=1, kind="stable"), axis=1) + 1
        return np.asarray(np.quantile(ranks, INTERVAL, axis=0, method="inverted_cdf").astype(float))

    def among_first(self, count: int) -> Float[np.ndarray, " source"]:
        """Return the share of resamples in which each source is among the first ``count`` [-]."""
        ranks = np.argsort(np.argsort(-self.total_resamples, axis=1, kind="stable"), axis=1)
        return np.asarray((ranks < count).mean(axis=0))


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
    size = len(names) + 2
    whole = evaluation.good.reshape(blocks, size).all(axis=1)
    dropped = int(np.count_nonzero(~whole))
    if dropped > LARGEST_DROPPED_SHARE * blocks:
        raise SolveError(
            f"Sobol indices: {dropped} of {blocks} blocks hold a failed sample; allowed is "
            f"{LARGEST_DROPPED_SHARE:.0%}, because more would bias the indices."
        )
    y = evaluation.values[:, 0].reshape(blocks, size)[whole].ravel()
    if np.ptp(y) == 0.0:
        raise SolveError("Sobol indices: the output is the same for all samples, so no source can be ranked.")
    result: dict[str, Any] = sobol_analysis.analyze(
        problem,
        y,
        calc_second_order=False,
        num_resamples=_RESAMPLES,
        keep_resamples=True,
        seed=seeds.child("resamples").integer(),
    )
    return SobolIndices(
        sources=names,
        first=np.asarray(result["S1"]),
        total=np.asarray(result["ST"]),
        first_resamples=np.asarray(result["S1_conf_all"]),
        total_resamples=np.asarray(result["ST_conf_all"]),
        blocks=blocks - dropped,
        dropped=dropped,
        samples=x.shape[0],
    )
