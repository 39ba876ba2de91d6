"""What a diagnosis answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.bench.diagnosis.groups import Group

IMPLAUSIBLE = 0.001
"""Probability of residuals as large, were the model true, below which a curve is not explained [-]."""

TAILS = (0.025, 0.975)
"""Shares below the ends of the intervals [-]."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """How the curve is explained.

    Parameters
    ----------
    carrier_angle
        Angles of the readings that were used [rad].
    measured, fitted
        Readings, and mean curve of the errors that they allow, each without its mean [rad].
    band
        95 % interval of those curves [rad].
    chi_square, freedom
        Mean sum of squared residuals in standard deviations, and what it would be on average, were the model true [-].
    explained
        Whether residuals as large have a probability of `IMPLAUSIBLE` or more.
    """

    carrier_angle: Float[np.ndarray, " angle"]
    measured: Float[np.ndarray, " angle"]
    fitted: Float[np.ndarray, " angle"]
    band: Float[np.ndarray, "2 angle"]
    chi_square: float
    freedom: int
    explained: bool


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """What the curve of a unit tells of its parts.

    Parameters
    ----------
    sources, columns
        Names of the sources and of their columns.
    deviations
        Columns of units that have this curve, all equally likely [m, angles rad].
    reading_mean, reading_interval
        What the gauge of each source would show, mean and 95 % interval [m].
    dominant_probability
        Probability that each source is the dominant one; 0 for all where the curve is not explained [-].
    named
        Fewest sources that contain the dominant one at the level asked for, likeliest first; none where the curve is
        not explained.
    twins
        Pairs of sources that no curve tells apart: a unit turned by half a turn is the same reducer.
    groups
        Columns that this curve does not tell apart, and what it tells of them together; for one of two twins.
    fit
        Measured and fitted curve.
    evaluations, failed
        Curves solved, and those among them that failed [-].
    """

    sources: tuple[str, ...]
    columns: tuple[str, ...]
    deviations: Float[np.ndarray, "particle column"]
    reading_mean: Float[np.ndarray, " source"]
    reading_interval: Float[np.ndarray, "2 source"]
    dominant_probability: Float[np.ndarray, " source"]
    named: tuple[str, ...]
    twins: tuple[tuple[str, str], ...]
    groups: tuple[Group, ...]
    fit: Fit
    evaluations: int
    failed: int

    @property
    def column_mean(self) -> Float[np.ndarray, " column"]:
        """Mean of every column [m, angles rad]."""
        return np.asarray(self.deviations.mean(axis=0))

    @property
    def column_interval(self) -> Float[np.ndarray, "2 column"]:
        """95 % interval of every column [m, angles rad]."""
        return np.asarray(np.quantile(self.deviations, TAILS, axis=0))
