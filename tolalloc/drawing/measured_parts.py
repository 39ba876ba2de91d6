"""Measured parts behind an empirical distribution, and which distribution comes nearest to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy import stats

from tolalloc.drawing.distributions import RAYLEIGH, Distribution
from tolalloc.units import MICROMETRE


@dataclass(frozen=True, kw_only=True)
class FittedDistribution:
    """A distribution fitted to measured parts by maximum likelihood.

    Parameters
    ----------
    distribution
        Normal (for radii: normal on each axis), lognormal or Weibull; the latter two start at the lower limit.
    shape
        Shape, 0 for a normal distribution [-].
    scale
        σ of the normal, median of the lognormal, scale of the Weibull distribution [m].
    log_likelihood
        Logarithm of the likelihood, with densities per µm [-].
    aic
        Akaike's information criterion; the smaller the better [-].
    distance
        Kolmogorov and Smirnov's largest distance from the measured shares [-].
    """

    distribution: Distribution
    shape: float
    scale: float
    log_likelihood: float
    aic: float
    distance: float


@dataclass(frozen=True, kw_only=True)
class MeasuredFit:
    """What the measured parts say about the process.

    Parameters
    ----------
    parts
        Number of measured parts [-].
    mean, deviation
        Mean and sample standard deviation of the deviations or radii [m].
    cp
        How many times the spread fits into the zone; for radii that of a normal deviation on each axis [-].
    cpk
        Distance of the mean from the nearer limit, for radii from the largest one, over 3σ [-].
    fits
        Fitted distributions, the best by Akaike's criterion first; a distribution that starts at the lower limit is
        left out where a part is at or below it.
    """

    parts: int
    mean: float
    deviation: float
    cp: float
    cpk: float
    fits: tuple[FittedDistribution, ...]

    @property
    def best(self) -> FittedDistribution:
        """The fitted distribution with the smallest criterion."""
        return self.fits[0]


@dataclass(frozen=True, kw_only=True)
class MeasuredParts:
    """Measured parts and the zone that they were made to.

    Parameters
    ----------
    path
        Where they were read.
    values
        Deviations from the nominal size, or radii of a position [m].
    are_radii
        Whether the values are radii.
    zone, middle
        Width and middle of the zone that they were made to [m].

    Notes
    -----
    At another zone the parts are assumed to deviate in proportion to it. The path stays out of the text of a record, so
    that a digest of the same parts in another folder is the same.
    """

    path: Path = field(repr=False)
    values: tuple[float, ...]
    are_radii: bool
    zone: float
    middle: float

    @property
    def relative(self) -> Float[np.ndarray, " part"]:
        """Deviations from the middle, or radii, over half the zone [-]."""
        return (np.array(self.values) - self.middle) / (self.zone / 2.0)

    @property
    def sentence(self) -> str:
        """What the distribution follows, and what was assumed."""
        fit = self.fit
        return (
            f"as {fit.parts} measured parts of {self.path.name} (Cp {fit.cp:.3g}, Cpk {fit.cpk:.3g}, nearest to "
            f"{fit.best.distribution.value}), smoothed, assumed to scale with the zone from the "
            f"{self.zone / MICROMETRE:.3g} µm that they were made to"
        )

    @cached_property
    def fit(self) -> MeasuredFit:
        """What the parts say about the process."""
        values, half = np.array(self.values), self.zone / 2.0
        mean, deviation = float(values.mean()), float(values.std(ddof=1))
        if self.are_radii:
            cp = half / (RAYLEIGH.reach * float(np.sqrt((values**2).mean() / 2.0)))
            nearest = half - mean
        else:
            cp, nearest = half / (3.0 * deviation), half - abs(mean - self.middle)
        fits = [_fitted(Distribution.NORMAL, stats.rayleigh if self.are_radii else stats.norm, values, self.are_radii)]
        above = values if self.are_radii else values - (self.middle - half)
        if above.min() > 0.0:
            fits.append(_fitted(Distribution.LOGNORMAL, stats.lognorm, above, True))
            fits.append(_fitted(Distribution.WEIBULL, stats.weibull_min, above, True))
        return MeasuredFit(
            parts=values.size,
            mean=mean,
            deviation=deviation,
            cp=cp,
            cpk=nearest / (3.0 * deviation),
            fits=tuple(sorted(fits, key=lambda fit: fit.aic)),
        )


def _fitted(
    distribution: Distribution, family: stats.rv_continuous, values: Float[np.ndarray, " part"], starts_at_zero: bool
) -> FittedDistribution:
    """Return a family of scipy.stats fitted to the values [m], its start held at zero or free."""
    lengths = values / MICROMETRE
    start = {"floc": 0.0} if starts_at_zero else {}
    found: Sequence[float] = family.fit(lengths, **start)
    log_likelihood = float(family.logpdf(lengths, *found).sum())
    return FittedDistribution(
        distribution=distribution,
        shape=float(found[0]) if len(found) > 2 else 0.0,
        scale=float(found[-1]) * MICROMETRE,
        log_likelihood=log_likelihood,
        aic=2.0 * (len(found) - len(start)) - 2.0 * log_likelihood,
        distance=float(stats.kstest(lengths, family.cdf, args=found).statistic),
    )
