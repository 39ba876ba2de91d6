"""What changes between two designs that were tried on the same random units: shares and quantiles, with intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.capability.monte_carlo import CONFIDENCE, proportion

_RESAMPLES = 1000
"""Resamples of the units behind the interval of a quantile's change [-]."""
_BATCH, _UNITS_AT_ONCE = 50, 2**20
"""Resamples at a time, and units of all of them unless one alone has more, for the sake of memory [-]."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change with its two-sided 95 % interval."""

    estimate: float
    low: float
    high: float


def share_change(before: Bool[np.ndarray, " unit"], after: Bool[np.ndarray, " unit"]) -> Change:
    """Return how the share of good units changes [-].

    Only units that are good once and bad once count. The interval takes the exact one of either kind at half the error
    each, so it holds its 95 % at least, with no unit between the two as well.
    """
    units = before.size
    gained, lost = int(np.count_nonzero(after & ~before)), int(np.count_nonzero(before & ~after))
    up, down = proportion(units, units - gained), proportion(units, units - lost)
    return Change(estimate=(gained - lost) / units, low=up.low - down.high, high=up.high - down.low)


def quantile_change(
    before: Float[np.ndarray, " unit"],
    after: Float[np.ndarray, " unit"],
    share: float,
    generator: np.random.Generator,
) -> Change:
    """Return how a quantile of the units with both answers changes [unit of the output].

    The interval is that of the bootstrap over units, each with both its values; with fewer than some ten units beyond
    the quantile it is too narrow.
    """
    from scipy.stats import bootstrap

    def change(first: np.ndarray, second: np.ndarray, axis: int = -1) -> np.ndarray:
        return np.asarray(np.quantile(second, share, axis=axis) - np.quantile(first, share, axis=axis))

    both = np.isfinite(before) & np.isfinite(after)
    pair = (before[both], after[both])
    estimate = float(change(*pair))
    if np.array_equal(*pair):
        return Change(estimate=estimate, low=estimate, high=estimate)
    found = bootstrap(
        pair,
        change,
        paired=True,
        vectorized=True,
        n_resamples=_RESAMPLES,
        batch=max(1, min(_BATCH, _UNITS_AT_ONCE // both.size)),
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=generator,
    ).confidence_interval
    return Change(estimate=estimate, low=float(found.low), high=float(found.high))
