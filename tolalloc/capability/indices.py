"""Capability of a characteristic: indices, parts per million, intervals that assume no distribution, control limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, lgamma, sqrt
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.exceptions import InputError

MILLION = 1e6


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a characteristic, one of which may be absent."""

    # Limits, none for an open side [unit of the characteristic]
    lower: float | None = None
    upper: float | None = None

    def __post_init__(self) -> None:
        if self.lower is None and self.upper is None:
            raise InputError("A limit needs a lower side, an upper side or both.")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise InputError.at("limit", "upper", self.upper, f"a number above the lower one, {self.lower}")

    @property
    def turned(self) -> tuple[tuple[Literal[1, -1], float], ...]:
        """The limited sides, the upper one first, each with the sign that makes larger worse."""
        upper: tuple[tuple[Literal[1, -1], float], ...] = () if self.upper is None else ((1, self.upper),)
        lower: tuple[tuple[Literal[1, -1], float], ...] = () if self.lower is None else ((-1, self.lower),)
        return (*upper, *lower)

    def excess(self, values: Float[np.ndarray, "*unit"], *, relative: bool = False) -> Float[np.ndarray, "side *unit"]:
        """Return how far values lie beyond each limit, negative inside [unit of the characteristic, or of the limit].

        Relative values are over the limit, where that is not 0.
        """
        scales = [(abs(limit) or 1.0) if relative else 1.0 for _, limit in self.turned]
        return np.stack([sign * (values - limit) / by for (sign, limit), by in zip(self.turned, scales, strict=True)])

    def side(self, sign: int) -> Limits:
        """Return the limit of one side, the upper one for 1."""
        return Limits(upper=self.upper) if sign > 0 else Limits(lower=self.lower)

    def kept_by(self, sample: Float[np.ndarray, " unit"]) -> Bool[np.ndarray, " unit"]:
        """Return which values keep the limits; one that is not a number does not."""
        return np.asarray((sample >= self._low) & (sample <= self._high))

    def outside(self, sample: Float[np.ndarray, " unit"]) -> int:
        """Return how many values lie beyond a limit."""
        return int(np.count_nonzero((sample < self._low) | (sample > self._high)))

    def distance(self, mean: float) -> float:
        """Return the distance of a mean from the nearer limit, negative beyond it [unit of the characteristic]."""
        return min(self._high - mean, mean - self._low)

    def normal_share_outside(self, mean: float, deviation: float) -> float:
        """Return the share of a normal distribution beyond the limits [-]."""
        from scipy.stats import norm

        return float(norm.cdf((self._low - mean) / deviation) + norm.sf((self._high - mean) / deviation))

    @property
    def width(self) -> float | None:
        """Distance between the limits, none if a side is open [unit of the characteristic]."""
        return None if self.lower is None or self.upper is None else self.upper - self.lower

    @property
    def _low(self) -> float:
        return -np.inf if self.lower is None else self.lower

    @property
    def _high(self) -> float:
        return np.inf if self.upper is None else self.upper


@dataclass(frozen=True, kw_only=True)
class Capability:
    """Capability of a sample."""

    mean: float  # Mean of the sample [unit of the characteristic]
    deviation_overall: float  # Standard deviation of the whole sample [unit of the characteristic]
    # (U − L) / 6σ and min(U − μ, μ − L) / 3σ; ``pp`` is none if a side is open [-]
    pp: float | None
    ppk: float
    # Units beyond the limits per million if the characteristic is normal with the sample's mean and overall deviation;
    # the only figure here besides the indices that assumes a normal distribution [-]
    normal_ppm: float


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate with its two-sided interval, in its own unit."""

    estimate: float
    # Ends of the interval, infinite where a sample is too small to bound that side
    low: float
    high: float


def capability(sample: Float[np.ndarray, " unit"], limits: Limits) -> Capability:
    """Return the capability of a sample.

    Notes
    -----
    The deviation of the whole sample has the divisor n − 1. The indices read as yields only for a normal distribution.

    References
    ----------
    ISO 22514-2, indices Pp and Ppk; Montgomery 2012, Statistical Quality Control, ch. 8.
    """
    if sample.size < 2 or not np.isfinite(sample).all():
        raise InputError.at("capability", "sample", f"{sample.size} values", "at least 2 values, all finite")
    mean, overall = float(sample.mean()), float(sample.std(ddof=1))
    if not np.ptp(sample):
        raise InputError("Capability: the sample does not vary, so no index can be given.")
    width, distance = limits.width, limits.distance(mean)
    return Capability(
        mean=mean,
        deviation_overall=overall,
        pp=None if width is None else width / (6 * overall),
        ppk=distance / (3 * overall),
        normal_ppm=MILLION * limits.normal_share_outside(mean, overall),
    )


def wilson_interval(units: int, accepted: int, confidence: float = 0.95) -> Interval:
    """Return a yield with its two-sided Wilson interval, which covers on average as stated, not at every yield.

    References
    ----------
    Wilson 1927, (p + z²/2n ± z·√(p·(1 − p)/n + z²/4n²)) / (1 + z²/n).

    Examples
    --------
    >>> found = wilson_interval(100, 95)
    >>> round(found.low, 4), round(found.high, 4)
    (0.8882, 0.9785)
    """
    from scipy.stats import norm

    require_share("Wilson interval", "confidence", confidence)
    if units < 1 or not 0 <= accepted <= units:
        raise InputError.at("Wilson interval", "accepted", accepted, f"0 to {units} units")
    z, share = float(norm.isf((1 - confidence) / 2)), accepted / units
    centre = share + z**2 / (2 * units)
    half = z * float(np.sqrt(share * (1 - share) / units + z**2 / (4 * units**2)))
    scale = 1 + z**2 / units
    return Interval(
        estimate=share,
        # Rounding must not leave the ends of an extreme yield just off 0 and 1.
        low=max(0.0, (centre - half) / scale) if accepted else 0.0,
        high=min(1.0, (centre + half) / scale) if accepted < units else 1.0,
    )


def quantile_interval(sample: Float[np.ndarray, " unit"], share: float, confidence: float = 0.95) -> Interval:
    """Return a quantile of independent values with the interval of two order statistics, half of the doubt each side.

    References
    ----------
    David & Nagaraja 2003, Order Statistics, ch. 7: P(X₍ᵣ₎ ≤ q < X₍ₛ₎) = P(r ≤ B < s) with B binomial (n, share).

    Examples
    --------
    The median of 1 to 100 lies between the 40th and the 61st value with 95 % confidence.

    >>> found = quantile_interval(np.arange(1.0, 101.0), 0.5)
    >>> found.estimate, found.low, found.high
    (50.5, 40.0, 61.0)
    """
    from scipy.stats import binom

    require_share("quantile interval", "share", share)
    require_share("quantile interval", "confidence", confidence)
    if sample.size < 1 or not np.isfinite(sample).all():
        raise InputError.at("quantile interval", "sample", f"{sample.size} values", "at least 1 value, all finite")
    units, tail = sample.size, (1 - confidence) / 2
    low = int(binom.ppf(tail, units, share))
    high = int(binom.isf(tail, units, share)) + 1
    ordered = np.sort(sample)
    return Interval(
        estimate=float(np.quantile(sample, share)),
        low=float(ordered[low - 1]) if low >= 1 else -np.inf,
        high=float(ordered[high - 1]) if high <= units else np.inf,
    )


@dataclass(frozen=True, kw_only=True)
class ControlLimits:
    """Between which mean and standard deviation of a sample lie while its process is the one that is known."""

    parts: int  # Of the sample [-]
    # [unit of the characteristic]
    mean: tuple[float, float]
    deviation: tuple[float, float]


def c4(parts: int) -> float:
    """Return the mean of s over σ of normal samples, c4 = √(2/(n − 1))·Γ(n/2)/Γ((n − 1)/2) [-].

    References
    ----------
    ISO 7870-2:2013, table of constants; any handbook of statistics has the formula.

    Examples
    --------
    >>> round(c4(5), 4), round(c4(25), 4)
    (0.94, 0.9896)
    """
    return sqrt(2.0 / (parts - 1)) * exp(lgamma(parts / 2.0) - lgamma((parts - 1) / 2.0))


def control_limits(mean: float, deviation: float, parts: int) -> ControlLimits:
    """Return the limits of x̄ and s charts at ±3σ of a process that is known, B5·σ…B6·σ = (c4 ∓ 3·√(1 − c4²))·σ.

    For normal readings 99.73 % of the means lie between them; for radii and total deviations nearly so.

    References
    ----------
    ISO 7870-2:2013, Shewhart control charts, the process parameters given.

    Examples
    --------
    Of five parts with σ = 1, A = 3/√5 = 1.342 and B6 = 1.964:

    >>> own = control_limits(0.0, 1.0, 5)
    >>> [round(one, 3) for one in (*own.mean, *own.deviation)]
    [-1.342, 1.342, 0.0, 1.964]
    """
    centre, reach = c4(parts), 3.0 * sqrt(max(1.0 - c4(parts) ** 2, 0.0))
    off = 3.0 * deviation / sqrt(parts)
    return ControlLimits(
        parts=parts,
        mean=(mean - off, mean + off),
        deviation=(max(centre - reach, 0.0) * deviation, (centre + reach) * deviation),
    )


def holm(probabilities: Sequence[float], level: float) -> Bool[np.ndarray, " test"]:
    """Return which hypotheses are rejected, at most one of them wrongly so with probability `level`, however dependent.

    The smallest p value is held against level/m, the next against level/(m − 1), up to the first that is above.

    References
    ----------
    Holm, A simple sequentially rejective multiple test procedure, Scand. J. Stat. 6, 1979, 65–70.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03, 0.005], 0.05).tolist()
    [True, False, False, True]
    """
    values = np.asarray(probabilities, dtype=float)
    order = np.argsort(values, kind="stable")
    kept = values[order] <= level / (values.size - np.arange(values.size))
    rejected = np.zeros(values.size, dtype=bool)
    rejected[order[np.logical_and.accumulate(kept)]] = True
    return rejected


def require_share(place: str, field: str, value: float) -> None:
    """Raise unless a value lies between 0 and 1."""
    if not 0 < value < 1:
        raise InputError.at(place, field, value, "a number between 0 and 1")
