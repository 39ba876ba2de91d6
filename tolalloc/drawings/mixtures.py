"""Mixed batches and measured parts as distributions."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import (
    BELOW_ONE,
    LEVELS,
    NORMAL,
    NUMBER,
    Marginal,
    Numbers,
    ndtr,
    ndtri,
)

_MOST_BATCHES = 20
"""Most batches of a mixture that are believed [-]."""


@dataclass(frozen=True, kw_only=True)
class Batch:
    """One batch of a mixture."""

    weight: float  # Share of all parts; the weights are taken relative to their sum [-]
    shift: float  # Mean off the middle of the zone, 0 for a position [half zone]
    spread: float  # σ over that of Cp = 1 [-]


def parsed_batches(text: str) -> tuple[Batch, ...]:
    """Return batches such as ``0.7:-0.3:0.8 0.3:0.5:0.6``: weight, shift and spread.

    Raises
    ------
    ValueError
        The text does not read like that.
    """
    batches = []
    for item in text.split():
        match = re.fullmatch(rf"({NUMBER}):(-?{NUMBER}):({NUMBER})", item)
        if match is None:
            raise ValueError("the batches must read like '0.7:-0.3:0.8 0.3:0.5:0.6' (weight:shift:spread)")
        batch = Batch(weight=float(match[1]), shift=float(match[2]), spread=float(match[3]))
        if not 1e-6 <= batch.weight <= 1e6 or abs(batch.shift) > 2 or not 0.01 <= batch.spread <= 10:
            raise ValueError(f"the batch {item} must have a weight from 1e-6 to 1e6, shift -2 to 2, spread 0.01 to 10")
        batches.append(batch)
    if len(batches) > _MOST_BATCHES:
        raise ValueError(f"a mixture must have {_MOST_BATCHES} batches or less: {len(batches)}")
    return tuple(batches)


def batches_text(batches: tuple[Batch, ...]) -> str:
    """Return batches as a tolerance table writes them."""
    return " ".join(f"{batch.weight!r}:{batch.shift!r}:{batch.spread!r}" for batch in batches)


@dataclass(frozen=True)
class Mixture:
    """Parts from several batches, each with a mean and a spread of its own, of one common distribution.

    Notes
    -----
    The base is normal for sizes, Rayleigh for the radius of a position. The quantile has no closed form: it is
    interpolated between the probabilities of fixed values. The values are the quantiles of the batches, so that a
    narrow batch is resolved as well as a wide one, and a grid over all of them.
    """

    base: Marginal
    batches: tuple[Batch, ...]
    reach: float = 1.0

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        values, levels = self._table
        return np.asarray(ndtr(np.interp(value, values, levels, left=-np.inf, right=np.inf)))

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities [half zone]."""
        values, levels = self._table
        return np.asarray(np.interp(ndtri(probability), levels, values))

    @cached_property
    def _table(self) -> tuple[Float[np.ndarray, " value"], Float[np.ndarray, " value"]]:
        """Values [half zone] and, for the probability of each, the standard normal number [-]."""
        own = self.base.quantile(ndtr(LEVELS[:: max(1, len(self.batches) // 2)])) / self.base.reach
        spans = np.concatenate([batch.shift + batch.spread * own for batch in self.batches])
        values = np.unique(np.concatenate([spans, np.linspace(spans.min(), spans.max(), LEVELS.size)]))
        total, below = sum(batch.weight for batch in self.batches), np.zeros(values.size)
        for batch in self.batches:
            reached = self.base.probability((values - batch.shift) * (self.base.reach / batch.spread))
            below += batch.weight / total * reached
        # Rounding near 0 and 1 leaves values of equal probability, which no quantile can tell apart.
        below, first = np.unique(np.maximum.accumulate(below), return_index=True)
        inside = (below > 0.0) & (below < 1.0)
        return values[first][inside], ndtri(below[inside])


@dataclass(frozen=True)
class Folded:
    """Magnitude of a number that is distributed symmetrically around 0."""

    symmetric: Marginal

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1 [own unit]."""
        return self.symmetric.reach

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities [own unit]."""
        from_zero = np.minimum(0.5 + 0.5 * probability, BELOW_ONE)
        return np.asarray(np.maximum(self.symmetric.quantile(from_zero), 0.0))

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        return np.asarray(np.maximum(2.0 * self.symmetric.probability(value) - 1.0, 0.0))


def smoothed(values: Float[np.ndarray, " part"], width: float) -> Mixture:
    """Return the distribution of measured values, each widened to a normal one of this σ [half zone].

    Notes
    -----
    The values are drawn together around their mean by as much as the widening spreads them, so that mean and standard
    deviation stay the measured ones.

    References
    ----------
    Silverman, Density estimation for statistics and data analysis, 1986, section 6.4.1.
    """
    shrink = 1.0 / sqrt(1.0 + (width / float(values.std())) ** 2)
    places = values.mean() + shrink * (values - values.mean())
    spread = shrink * width * NORMAL.reach
    return Mixture(NORMAL, tuple(Batch(weight=1.0, shift=float(place), spread=spread) for place in places))


def smoothing_width(values: Float[np.ndarray, " part"]) -> float:
    """Return Silverman's width for the smoothing of measured values [unit of the values].

    References
    ----------
    Silverman, Density estimation for statistics and data analysis, 1986, equation 3.31.
    """
    deviation, middle_half = float(values.std()), float(np.subtract(*np.quantile(values, [0.75, 0.25]))) / 1.349
    return float(0.9 * (min(deviation, middle_half) or deviation) * values.size**-0.2)


def smoothed_magnitude(values: Float[np.ndarray, " part"]) -> Folded:
    """Return the distribution of measured radii [largest radius].

    Notes
    -----
    They are smoothed as deviations are and then mirrored at 0, so that none becomes negative. The mean square stays the
    measured one; mean and standard deviation do as far as no part lies within the smoothing width of 0.
    """
    batches = smoothed(values, smoothing_width(values)).batches
    return Folded(Mixture(NORMAL, batches + tuple(replace(batch, shift=-batch.shift) for batch in batches)))
