"""Measured parts behind an empirical distribution, and which distribution comes nearest to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import RAYLEIGH, Distribution
from tolalloc.drawings.table_file import TextTable, plain_number, read_text_table, split_header
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import Faults, InputError
from tolalloc.reading.units import MICROMETRE

FEWEST_PARTS = 20
LARGEST_DEVIATION = 1e6
"""Largest deviation that is believed, as large as a zone may be [µm]."""

_FACTORS = {"µm": 1.0, "um": 1.0, "mm": 1000.0}
_LAYOUTS = {Feature.SIZE: (("deviation",),), Feature.POSITION: (("x", "y"), ("radius",))}


@dataclass(frozen=True, kw_only=True)
class FittedDistribution:
    """A distribution fitted to measured parts by maximum likelihood."""

    # Normal (for radii: normal on each axis), lognormal or Weibull; the latter two start at the lower limit
    distribution: Distribution
    shape: float  # Shape, 0 for a normal distribution [-]
    scale: float  # σ of the normal, median of the lognormal, scale of the Weibull distribution [m]
    log_likelihood: float  # Logarithm of the likelihood, with densities per µm [-]
    aic: float  # Akaike's information criterion; the smaller the better [-]
    distance: float  # Kolmogorov and Smirnov's largest distance from the measured shares [-]


@dataclass(frozen=True, kw_only=True)
class MeasuredFit:
    """What the measured parts say about the process."""

    parts: int  # Number of measured parts [-]
    # Mean and sample standard deviation of the deviations or radii [m]
    mean: float
    deviation: float
    cp: float  # How many times the spread fits into the zone; for radii that of a normal deviation on each axis [-]
    cpk: float  # Distance of the mean from the nearer limit, for radii from the largest one, over 3σ [-]
    # Fitted distributions, the best by Akaike's criterion first; a distribution that starts at the lower limit is left
    # out where a part is at or below it
    fits: tuple[FittedDistribution, ...]

    @property
    def best(self) -> FittedDistribution:
        """The fitted distribution with the smallest criterion."""
        return self.fits[0]


@dataclass(frozen=True, kw_only=True)
class MeasuredParts:
    """Measured parts and the zone that they were made to.

    Notes
    -----
    At another zone the parts are assumed to deviate in proportion to it. The path stays out of the text of a record, so
    that a digest of the same parts in another folder is the same.
    """

    path: Path = field(repr=False)  # Where they were read
    values: tuple[float, ...]  # Deviations from the nominal size, or radii of a position [m]
    are_radii: bool  # Whether the values are radii
    # Width and middle of the zone that they were made to [m]
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
        from scipy import stats

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
    distribution: Distribution, family: Any, values: Float[np.ndarray, " part"], starts_at_zero: bool
) -> FittedDistribution:
    """Return a family of scipy.stats fitted to the values [m], its start held at zero or free."""
    from scipy import stats

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


def load_measured_parts(path: Path, feature: Feature, zone: float, middle: float) -> MeasuredParts:
    """Return the parts of a CSV file, which were made to a zone of this width and middle [m].

    It has a column ``deviation [µm]`` for a size, and ``x [µm]`` and ``y [µm]`` or ``radius [µm]`` for a position; all
    from the nominal place.

    Raises
    ------
    InputError
        The file, row, column and value that are not allowed, or there are too few parts.
    """
    table = read_text_table(path)
    names = tuple(split_header(header)[0] for header in table.headers)
    layouts = _LAYOUTS[feature]
    if names not in layouts:
        allowed = " or ".join(" and ".join(f"{name} [µm]" for name in layout) for layout in layouts)
        raise InputError.at(path, f"columns for feature {feature.value}", ", ".join(table.headers), allowed)
    if len(table.cells) < FEWEST_PARTS:
        raise InputError.at(path, "number of measured parts", len(table.cells), f"{FEWEST_PARTS} or more")
    columns = [_column(table, at) for at in range(len(names))]
    values = np.hypot(columns[0], columns[1]) if len(columns) == 2 else np.array(columns[0])
    if names == ("radius",) and values.min() < 0.0:
        row = table.rows[int(values.argmin())]
        raise InputError.at(f"{path}, row {row}", table.headers[0], f"{values.min():g} µm", "0 or more")
    if np.ptp(values) == 0.0:
        raise InputError.at(path, "every measured part", f"{values[0]:g} µm", "parts that differ from each other")
    return MeasuredParts(
        path=path,
        values=tuple((values * MICROMETRE).tolist()),
        are_radii=feature is Feature.POSITION,
        zone=zone,
        middle=middle,
    )


def _column(table: TextTable, at: int) -> list[float]:
    """Return a column [µm]."""
    header = table.headers[at]
    unit = split_header(header)[1]
    if unit not in _FACTORS:
        raise InputError.at(table.path, f"the unit of column {header!r}", unit, "µm, um or mm in square brackets")
    values, faults = [], Faults()
    for row, cells in zip(table.rows, table.cells, strict=True):
        try:
            value = plain_number(cells[at]) * _FACTORS[unit]
        except ValueError:
            value = float("nan")
        if not (isfinite(value) and abs(value) <= LARGEST_DEVIATION):
            with faults.kept():
                allowed = f"a number from {-LARGEST_DEVIATION:.0f} to {LARGEST_DEVIATION:.0f} µm"
                raise InputError.at(f"{table.path}, row {row}", header, cells[at], allowed)
        values.append(value)
    faults.require_none()
    return values
