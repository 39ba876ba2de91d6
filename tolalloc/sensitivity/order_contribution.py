"""What drives each order of the output turn: shares of the variance of a wave, which has a cosine and a sine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.sensitivity.ranking import percentile_interval
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis


@dataclass(frozen=True, kw_only=True)
class OrderContribution:
    """Generalised Sobol indices of the wave of every order.

    Parameters
    ----------
    orders
        Orders of the output turn [-].
    sources
        Names, in the order of all arrays.
    first, total
        Share of the wave's variance that a source gives alone, and in which it takes part; NaN for a wave that does
        not vary [-].
    first_resamples, total_resamples
        The same from bootstrap resamples of the blocks [-].
    deviation
        Root of the sum of the variances of cosine and sine, the standard deviation of the wave [output].
    """

    orders: tuple[int, ...]
    sources: tuple[str, ...]
    first: Float[np.ndarray, "order source"]
    total: Float[np.ndarray, "order source"]
    first_resamples: Float[np.ndarray, "order resample source"]
    total_resamples: Float[np.ndarray, "order resample source"]
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
