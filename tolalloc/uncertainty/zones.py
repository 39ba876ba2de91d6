"""From a drawing's zone to the distribution of the columns: the one place where that mapping stands.

The measure that the drawing limits (deviation, radius, total deviation over a turn) lies inside the zone
for 99.73 % of parts at Cp = 1, whatever the feature; a Cp of 1.33 divides the spread by 1.33.
"""

from __future__ import annotations

from enum import StrEnum
from functools import lru_cache
from math import log, sqrt

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri
from scipy.stats import qmc

INSIDE_AT_CP_1 = 0.9973
_RADIUS_QUANTILE = sqrt(-2.0 * log(1.0 - INSIDE_AT_CP_1))

Spectrum = tuple[tuple[int, float], ...]
"""Order of the turn and relative amplitude, one pair per harmonic."""


class Feature(StrEnum):
    """Kind of drawing callout, which says how a zone is read and which columns it moves."""

    SIZE = "size"
    POSITION = "position"
    PITCH = "pitch"
    RUNOUT = "runout"

    @property
    def zone_meaning(self) -> str:
        """How the number on the drawing is read."""
        return {
            Feature.SIZE: "full width between the limits",
            Feature.POSITION: "diameter of the round zone of the axis",
            Feature.PITCH: "total cumulative pitch deviation, highest minus lowest over a turn",
            Feature.RUNOUT: "full indicator reading over a turn",
        }[self]


class Distribution(StrEnum):
    """Shape of the deviation inside its zone."""

    NORMAL = "normal"
    UNIFORM = "uniform"


@lru_cache(maxsize=64)
def harmonic_range_quantile(spectrum: Spectrum) -> float:
    """Return the 99.73 % quantile of the range over a turn of random harmonics of this spectrum.

    Parameters
    ----------
    spectrum
        Each order's cosine and sine amplitudes are normal with its relative amplitude as σ [-].

    Notes
    -----
    One order has the closed form 2·3.44·σ; several are integrated over 2¹⁴ points of a fixed Sobol sequence.
    """
    if len(spectrum) == 1:
        return 2.0 * _RADIUS_QUANTILE * spectrum[0][1]
    waves = ndtri(qmc.Sobol(2 * len(spectrum), rng=np.random.default_rng(1)).random_base2(14))
    weights = np.repeat([amplitude for _, amplitude in spectrum], 2)
    return float(np.quantile(np.ptp((waves * weights) @ _waves_over_turn(spectrum), axis=1), INSIDE_AT_CP_1))


def _waves_over_turn(spectrum: Spectrum) -> Float[np.ndarray, "column point"]:
    """Return the cosine and sine of every order on fine points of one turn."""
    points = 96 * max(order for order, _ in spectrum)
    turn = 2 * np.pi * np.arange(points) / points
    return np.concatenate([np.stack([np.cos(order * turn), np.sin(order * turn)]) for order, _ in spectrum])


def standard_deviation_per_zone(feature: Feature, cp: float, spectrum: Spectrum) -> float:
    """Return σ of a normal deviation over the zone; for harmonics, per unit of relative amplitude [-]."""
    if feature is Feature.SIZE:
        return 1.0 / (6.0 * cp)
    if feature is Feature.POSITION:
        return 1.0 / (2.0 * _RADIUS_QUANTILE * cp)
    return 1.0 / (harmonic_range_quantile(spectrum) * cp)


def standard_values(
    feature: Feature,
    distribution: Distribution,
    cp: float,
    shift: float,
    spectrum: Spectrum,
    uniform: Float[np.ndarray, "sample column"],
) -> Float[np.ndarray, "sample column"]:
    """Return the columns' deviations per unit of zone for uniform random numbers in (0, 1).

    Parameters
    ----------
    feature, distribution, cp, shift, spectrum
        As in `tolalloc.uncertainty.sources.Source`.
    uniform
        Independent uniform numbers, as many as the source has columns [-].

    Notes
    -----
    Uniform distribution: a size anywhere in its zone; for vectors and harmonics the magnitude anywhere up to
    the largest that the zone admits, at any phase.
    """
    if distribution is Distribution.NORMAL:
        weights = np.repeat([amplitude for _, amplitude in spectrum], 2) if spectrum else np.ones(1)
        scale = standard_deviation_per_zone(feature, cp, spectrum) * weights
        return np.asarray(ndtri(uniform) * scale + shift / 2.0)
    if feature is Feature.SIZE:
        return uniform - 0.5 + shift / 2.0
    amplitudes = np.array([amplitude for _, amplitude in spectrum]) if spectrum else np.ones(1)
    magnitude = uniform[:, 0::2] * amplitudes / (2.0 * amplitudes.sum())
    phase = 2 * np.pi * uniform[:, 1::2]
    return np.stack([magnitude * np.cos(phase), magnitude * np.sin(phase)], axis=-1).reshape(uniform.shape)


def at_limit(
    feature: Feature, spectrum: Spectrum, uniform: Float[np.ndarray, "sample column"]
) -> Float[np.ndarray, "sample column"]:
    """Return deviations per unit of zone whose limited measure is exactly the zone, at random phases.

    Parameters
    ----------
    feature, spectrum
        As in `tolalloc.uncertainty.sources.Source`.
    uniform
        Independent uniform numbers, as many as the source has columns [-].
    """
    if feature is Feature.SIZE:
        return np.where(uniform < 0.5, -0.5, 0.5)
    phase = 2 * np.pi * uniform[:, 0::2]
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=-1)
    if feature is Feature.POSITION:
        return np.asarray(0.5 * waves.reshape(uniform.shape))
    waves *= np.array([amplitude for _, amplitude in spectrum])[:, np.newaxis]
    columns = waves.reshape(uniform.shape)
    return np.asarray(columns / np.ptp(columns @ _waves_over_turn(spectrum), axis=1)[:, np.newaxis])
