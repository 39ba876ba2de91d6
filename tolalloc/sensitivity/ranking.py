"""How far a ranking can be trusted, from draws of the errors of its indices; a design grown until it is stable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import norm, rankdata

from tolalloc.capability.indices import require_share
from tolalloc.exceptions import InputError

AtSources = Float[np.ndarray, " source"]
"""A number of every source."""
Resamples = Float[np.ndarray, "resample source"]
"""The same from every resample."""
Ends = Float[np.ndarray, "2 source"]
"""Lower and upper end of the interval of each."""
_CONFIDENCE = 0.9
"""Share of resamples that makes an order count, and that an interval holds [-]."""
_TAILS = (1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """Two sources that follow each other in the ranking."""

    # Positions of the two sources [-]
    before: int
    after: int
    probability: float  # Share of resamples in which they have this order [-]
    separated: bool  # Whether that share reaches 0.9
    # Blocks that would have to be added to tell them apart, 0 if they are, none if they are equal or have few [-]
    more_blocks: int | None


@dataclass(frozen=True, kw_only=True)
class SourceRanking:
    """Sources by their total index."""

    sources: tuple[str, ...]  # Names, in the order of all arrays
    # Total index, and draws from its error, those of a row together [-]
    total: AtSources
    total_resamples: Resamples
    blocks: int  # Saltelli blocks used [-]
    drives: tuple[str, ...] = ()  # Of a ranking over several outputs: the one for which each source has that index
    # Index that a source may have where too few blocks show it, else 0 [-]
    unseen: AtSources | float = 0.0
    few: frozenset[int] = frozenset()  # Positions of sources that fewer blocks show [-]

    @property
    def total_interval(self) -> Ends:
        """90 % interval of the total indices [-]."""
        return share_interval(self.total_resamples, self.unseen)

    @property
    def order(self) -> list[int]:
        """Positions of the sources, largest total index first."""
        return [int(at) for at in np.argsort(-self.total, kind="stable")]

    @property
    def rank_interval(self) -> Ends:
        """90 % interval of each source's rank, `tolalloc.sensitivity.ranking.rank_interval` [-]."""
        return rank_interval(self.total_resamples).astype(float)

    @property
    def neighbours(self) -> tuple[Neighbours, ...]:
        """Sources that follow each other, largest total index first, and what would tell them apart.

        The blocks to add are an extrapolation: they take the difference for the true one, and its distribution for a
        normal one whose variance falls with one over the blocks.

        References
        ----------
        One-sided normal quantile z with N′ = N·(z·σ/Δ)², from σ² ∝ 1/N; Efron & Tibshirani 1993, ch. 6.
        """
        found = []
        for leading, following in pairwise(self.order):
            apart = self.total_resamples[:, leading] - self.total_resamples[:, following]
            difference, deviation = float(self.total[leading] - self.total[following]), float(apart.std(ddof=1))
            probability = float(((apart > 0).mean() + (apart >= 0).mean()) / 2)
            separated, more = probability >= _CONFIDENCE, None
            if difference > 0 and not self.few & {leading, following}:
                needed = self.blocks * (float(norm.ppf(_CONFIDENCE)) * deviation / difference) ** 2
                more = max(1, int(np.ceil(needed)) - self.blocks)
            found.append(
                Neighbours(
                    before=leading,
                    after=following,
                    probability=probability,
                    separated=separated,
                    more_blocks=0 if separated else more,
                )
            )
        return tuple(found)

    def among_first(self, count: int) -> AtSources:
        """Return the share of resamples in which each source is among the first ``count`` [-]."""
        _require_places(count, len(self.sources))
        return np.asarray((rankdata(-self.total_resamples, "ordinal", axis=1) <= count).mean(axis=0))


def share_interval(resamples: Resamples, unseen: AtSources | float = 0.0) -> Ends:
    """Return the `percentile_interval` of shares of a variance, which lie within 0 and 1 [-]."""
    return np.asarray(np.clip(percentile_interval(resamples, unseen), 0.0, 1.0))


def percentile_interval(resamples: Resamples, unseen: AtSources | float = -np.inf) -> Ends:
    """Return the two-sided 90 % interval of every index, from 0 to what is unseen if that is given and more [-].

    References
    ----------
    Efron & Tibshirani 1993, ch. 13: the quantiles 5 % and 95 % of the resamples. For 100 resamples or more.
    What is unseen: `tolalloc.sensitivity.saltelli.unseen`.

    Examples
    --------
    >>> percentile_interval(np.linspace(0.0, 1.0, 101)[:, np.newaxis])[:, 0].round(3).tolist()
    [0.05, 0.95]
    """
    low, high = np.quantile(resamples, _TAILS, axis=0)
    return np.array([np.where(unseen > high, 0.0, low), np.maximum(high, unseen)])


def rank_interval(resamples: Resamples) -> Int[np.ndarray, "2 source"]:
    """Return the two-sided 90 % interval of every rank, of whole ranks that some resample has; equals share theirs [-].

    Quantiles 5 % and 95 % of the ranks of draws from the errors, inverse of their distribution: Hall & Miller 2009,
    Annals of Statistics 37, 3929–3959.

    Examples
    --------
    One resample of a hundred with another order lies outside.

    >>> rank_interval(np.array([[0.2, 0.5]] * 99 + [[0.6, 0.5]])).tolist()
    [[2, 1], [2, 1]]
    """
    ends = zip(("min", "max"), _TAILS, strict=True)
    return np.array(
        [np.quantile(rankdata(-resamples, way, axis=1), at, axis=0, method="inverted_cdf") for way, at in ends], int
    )


def indistinguishable_from_zero(resamples: Resamples) -> Bool[np.ndarray, " source"]:
    """Return which indices are, with one-sided 95 % confidence, indistinguishable from 0: no negative share is read.

    Quantile of 5 % of the draws ≤ 0: Efron & Tibshirani 1993, ch. 13; for 100 resamples or more.
    """
    return np.asarray(np.quantile(resamples, 1 - 0.95, axis=0) <= 0)


def _require_places(count: int, sources: int) -> None:
    """Raise unless so many sources exist."""
    if not 1 <= count <= sources:
        raise InputError.at("ranking", "number of first sources", count, f"1 to {sources}")


Resampled = tuple[AtSources, Resamples]
"""Indices of the sources, and the same from resamples [-]."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """One number of blocks on the way to a stable order."""

    blocks: int  # Number of blocks [-]
    first: tuple[int, ...]  # Positions of the first sources, largest index first [-]
    probability: float  # Share of resamples whose first sources are these in this order [-]


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """How the order settled as the blocks grew."""

    history: tuple[Step, ...]  # One step per number of blocks
    probability: float  # Share of resamples that was asked for [-]

    @property
    def stable(self) -> bool:
        """Whether the last step reached the probability asked for."""
        return self.history[-1].probability >= self.probability


def until_converged(
    resampled: Callable[[int], Resampled],
    groups: Sequence[str],
    count: int,
    *,
    start: int,
    limit: int,
    probability: float = 0.9,
) -> Convergence:
    """Double the blocks until the order of the first sources is stable.

    Stops at n = start·2ᵏ blocks where a share of the resamples ≥ probability has the order of the estimate (own
    derivation).

    Parameters
    ----------
    resampled
        Gives the indices for a number of blocks.
    groups
        Group of each source; sources of one group may change places.
    count
        How many of the first sources must keep their order [-].
    start, limit
        First and largest number of blocks [-].

    Notes
    -----
    Sources of one group share a tolerance, such as the pitch of both discs: their indices are often equal, so that
    no number of blocks would settle an order between them. Looking several times makes a stop by chance likelier than
    one look does; the history shows whether the order was the same before.

    Examples
    --------
    Two sources of one group may change places, so that the first look at 64 blocks settles it.

    >>> same = (np.array([0.5, 0.5]), np.array([[0.6, 0.4], [0.4, 0.6]]))
    >>> until_converged(lambda blocks: same, ["pitch", "pitch"], 2, start=64, limit=64).stable
    True
    >>> until_converged(lambda blocks: same, ["a", "b"], 2, start=64, limit=64).stable
    False
    """
    require_share("ranking", "confidence", probability)
    if not 2 <= start <= limit:
        raise InputError.at("ranking", "first number of blocks", start, f"2 to the limit {limit}")
    history, names = list[Step](), np.array(list(groups))
    blocks = start
    while blocks <= limit:
        indices, resamples = resampled(blocks)
        _require_places(count, indices.size)
        first = np.argsort(-indices, kind="stable")[:count]
        same = (names[np.argsort(-resamples, axis=1, kind="stable")[:, :count]] == names[first]).all(axis=1)
        history.append(Step(blocks=blocks, first=tuple(first.tolist()), probability=float(same.mean())))
        if history[-1].probability >= probability:
            break
        blocks *= 2
    return Convergence(history=tuple(history), probability=probability)
