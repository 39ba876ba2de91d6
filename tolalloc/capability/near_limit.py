"""Shares of units beyond a limit, from those solved near it and some of all others, whatever predicts which are near.

N units are drawn. A prediction, made before, calls each of them near a limit or far from it. The first M are solved
whatever it says, of the others the near ones alone. With the shares p_n and p_f of units that are near or far and lie
beyond the limit, as many near ones as K_n ~ B(N, p_n) and as many far ones as K_f ~ B(M, p_f) are found there.

Nothing is believed of the prediction: what is said of p = p_n + p_f holds however p is parted. A bad prediction only
leaves more units to solve, or far ones beyond the limit, each of which weighs more than N/M near ones.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.monte_carlo import CONFIDENCE, Yield, allowed_rejections, proportion

_CAUTION = 2.0
"""What a far unit beyond a limit weighs over the N/M units that it stands for. With 1, units of which the prediction
knows nothing would be judged by M of them; from 2 to 16 the same is shown within a percent [-]."""
_PARTS = 60
"""Ways to part a share into near and far ones that are tried [-]."""
_LEAST_PART = 1e-3
"""The smallest of them that is not zero, over the share [-]."""
_ROUNDING = 1e-6
_EVEN_ODDS = 0.5


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """How many units were drawn, and how many of them were solved whatever was predicted."""

    # Numbers of units [-]
    units: int
    whatever: int

    @property
    def stands_for(self) -> float:
        """Number of drawn units for each of those that were solved whatever was predicted, N/M [-]."""
        return self.units / self.whatever

    @property
    def weight(self) -> float:
        """What a far unit beyond a limit weighs where a near one weighs one [-]."""
        return _CAUTION * self.stands_for if self.whatever < self.units else 1.0

    def allowed(self, target: float, confidence: float) -> float:
        """Return what may lie beyond a limit for a yield to be shown with one-sided confidence, −1 if nothing may [-].

        The largest weight at which a design just at the target is called good with no more than the error that is left,
        however its share is parted.
        """
        if self.whatever == self.units:
            return float(allowed_rejections(self.units, target, confidence))
        if confidence <= _EVEN_ODDS:
            return self.units * (1.0 - target)
        return _allowed(self, target, confidence)

    def interval(self, weight: float, near: int, far: int) -> Yield:
        """Return the yield with its intervals, of the weight and the number of near and far units beyond the limit [-].

        Far units may only lower the yield, so the near ones alone bound it from above.
        """
        if self.whatever == self.units:
            return proportion(self.units, near + far)
        tail = (1 - CONFIDENCE) / 2
        return Yield(
            estimate=1.0 - near / self.units - far / self.whatever,
            low=1.0 - _largest(self, weight, tail),
            high=proportion(self.units, near).high,
            bound=1.0 - _largest(self, weight, 1 - CONFIDENCE),
            units=self.units,
            rejected=near + far,
        )

    def probability_of_no_more(self, weight: float, share: float) -> float:
        """Return the largest probability, over all parts of a share, that no more weight lies beyond the limit [-].

        With K_f = j the near units are among N − j others, M − j of them with a probability of p_n/(1 − p_f), the rest
        with p_n; p_n for all of them makes the probability larger.
        """
        from scipy.stats import binom

        far = np.append(0.0, np.geomspace(_LEAST_PART * share, share, _PARTS))[:, np.newaxis]
        near = np.maximum(share - far, 0.0)
        many = np.arange(int(weight // self.weight) + 1)
        left = np.floor(weight - self.weight * many + _ROUNDING / 2)
        found = (binom.pmf(many, self.whatever, far) * binom.cdf(left, self.units - many, near)).sum(axis=1)
        return float(found.max())


@lru_cache(maxsize=256)
def _allowed(drawn: Drawn, target: float, confidence: float) -> float:
    share = 1.0 - target
    weights = range(int(np.ceil(drawn.units * share)) + 1)
    return float(bisect_right(weights, 1 - confidence, key=lambda own: drawn.probability_of_no_more(own, share)) - 1)


@lru_cache(maxsize=4096)
def _largest(drawn: Drawn, weight: float, error: float) -> float:
    """Return the largest share at which so little weight has a probability above the error, by halving [-]."""
    low, high = 0.0, 1.0
    while high - low > 1e-4 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if drawn.probability_of_no_more(weight, middle) <= error else (middle, high)
    return high


def largest_first(values: Float[np.ndarray, " value"], count: int) -> Int[np.ndarray, " largest"]:
    """Return where so many of the largest values stand, the largest first; without sorting all of many.

    Order statistics x₍₁₎ ≥ x₍₂₎ ≥ … ≥ x₍count₎; of equals the earlier one leads: David & Nagaraja 2003,
    Order Statistics.
    """
    if count >= values.size:
        return np.argsort(-values, kind="stable")
    found = np.sort(np.argpartition(-values, count)[:count])
    return np.asarray(found[np.argsort(-values[found], kind="stable")])


@dataclass(frozen=True, kw_only=True)
class SolvedUnits:
    """Which of the solved units were predicted to be near a limit, and which were solved whatever was predicted."""

    drawn: Drawn  # Of how many they were
    near: Bool[np.ndarray, " solved"]
    whatever: Bool[np.ndarray, " solved"]

    @classmethod
    def all_of(cls, units: int) -> SolvedUnits:
        """Return units of which all were solved and nothing was predicted."""
        every = np.ones(units, bool)
        return cls(drawn=Drawn(units=units, whatever=units), near=every, whatever=every)

    @cached_property
    def stand_for(self) -> Float[np.ndarray, " solved"]:
        """How many drawn units each of them stands for [-]."""
        return np.where(self.near, 1.0, self.drawn.stands_for)

    @cached_property
    def weights(self) -> Float[np.ndarray, " solved"]:
        """What each of them weighs beyond a limit [-]."""
        return np.where(self.near, 1.0, self.drawn.weight)

    def kept_excess(self, excess: Float[np.ndarray, " solved"], target: float, confidence: float) -> float:
        """Return how far units lie beyond a limit if those furthest beyond it are left out [unit of the excess].

        As many as the yield allows with one-sided confidence; at one half the estimate itself counts. A unit without an
        answer lies infinitely far beyond. Infinite where even a sample with nothing beyond the limit shows nothing.
        """
        allowed = self.drawn.allowed(target, confidence)
        if allowed < 0:
            return np.inf
        furthest = largest_first(excess, int(allowed) + 2)  # each of them weighs one or more
        weights = self.weights if confidence > _EVEN_ODDS else self.stand_for
        left_out = int(np.searchsorted(np.cumsum(weights[furthest]), allowed, side="right"))
        return float(excess[furthest[min(left_out, furthest.size - 1)]])

    def least_excess(self, excess: Float[np.ndarray, " solved"], target: float, confidence: float) -> float:
        """Return how far the share that a yield leaves lies beyond a limit at least [unit of the excess].

        With one-sided confidence; the other end of `kept_excess`. Far units may only add to what lies beyond, so the
        near ones alone bound it; plain units bound it, too. The better of both counts, each with half of the error: of
        units near several limits few may be near this one. Minus infinity where so few units say nothing.
        """
        from scipy.stats import binom

        samples = [(self.drawn.units, self.near), (self.drawn.whatever, self.whatever)]
        samples = samples if self.drawn.whatever < self.drawn.units else samples[:1]
        found = [-np.inf]
        for units, own in samples:
            passed = int(binom.ppf(1 - (1 - confidence) / len(samples), units, 1.0 - target))
            if np.count_nonzero(own) > passed:
                found.append(float(excess[own][largest_first(excess[own], passed + 1)[-1]]))
        return max(found)

    def yield_of(self, is_beyond: Bool[np.ndarray, " solved"]) -> Yield:
        """Return the yield if these units lie beyond the limits."""
        near, far = int(np.count_nonzero(is_beyond & self.near)), int(np.count_nonzero(is_beyond & ~self.near))
        return self.drawn.interval(float(self.weights[is_beyond].sum()), near, far)
