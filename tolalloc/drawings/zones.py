"""From a drawing's zone to the distribution of the columns: the one place where that mapping stands.

The measure that the drawing limits (deviation, radius, total deviation over a turn) lies inside the zone
for 99.73 % of parts at Cp = 1, whatever the feature, and for all parts where the distribution ends there; a Cp of 1.33
divides the spread by 1.33.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from math import degrees, radians, sqrt

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import (
    ABOVE_ZERO,
    BELOW_ONE,
    INSIDE_AT_CP_1,
    NUMBER,
    RAYLEIGH,
    Distribution,
    Marginal,
    Placed,
    Sorted,
    moments,
    ndtri,
)

Spectrum = tuple[tuple[int, float], ...]
"""Order of the turn and relative amplitude, one pair per harmonic."""

Systematic = tuple[tuple[int, float, float], ...]
"""Order of the turn, amplitude and direction of a wave that all parts share [-, m, rad]."""

KNOWN_RANGES: Mapping[Spectrum, float] = {
    ((1, 9.2), (2, 4.3), (4, 1.0)): 67.76217971395965,
    ((1, 8.0), (2, 2.2), (4, 1.2)): 57.25566583259496,
    ((1, 8.7), (2, 3.6), (4, 0.5)): 62.60801259484705,
    ((1, 7.2), (2, 2.7), (4, 0.7)): 51.73762561814405,
    ((1, 2.0), (2, 1.0), (4, 0.5)): 15.333466179989557,
}
"""Spectra of the shipped tables → `integrated_range_quantile`, so that reading them does not import scipy.stats."""

FEWEST_TEETH, MOST_TEETH = 4, 400
"""Teeth between which a random spectrum is believed; their spectrum has half as many orders [-]."""

HIGHEST_ORDER, MOST_ORDERS = 100, 20
"""Highest order and most orders of a spectrum that are believed, as the range over a turn takes memory by both [-]."""

SMALLEST_AMPLITUDE, LARGEST_AMPLITUDE = 1e-6, 1e6
"""Relative amplitudes between which the ratio of two is a number that computes well [-]."""


def _is_believed(amplitude: float) -> bool:
    return SMALLEST_AMPLITUDE <= amplitude <= LARGEST_AMPLITUDE


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


@dataclass(frozen=True)
class Characteristic:
    """What a drawing writes for a source, where its feature alone does not say it."""

    name: str  # Such as ``parallelism``
    assumed: str  # What is taken for granted by it, in words


TILT = Characteristic(
    "parallelism",
    "a tilt is toleranced as parallelism over its length, with half of the zone, by which it leans to either side",
)
ROTATION = Characteristic("position", "a rotation of a pattern is toleranced as the position of its features")
PHASE = Characteristic("position", "a phase of a journal is toleranced as its position about the axis")


def parsed_spectrum(text: str) -> tuple[Spectrum, int]:
    """Return a spectrum such as ``1:9.2 2:4.3 random:1.0/40`` and the number of its random teeth, or 0.

    Notes
    -----
    Independent deviations of Z teeth with standard deviation σ are white noise: both waves of every order up to
    (Z − 1)/2 have the variance 2σ²/Z. Of order Z/2, for an even number, the teeth see one wave only, in what phase
    depends on where the angle is counted from; both get σ²/Z. The mean of all teeth is no deviation of pitch or
    run-out and is left out. The random part adds to a named order in quadrature.
    """
    amplitudes: dict[int, float] = {}
    teeth, random = 0, 0.0
    for item in text.split():
        if pair := re.fullmatch(rf"([0-9]{{1,9}}):({NUMBER})", item):
            order, amplitude = int(pair[1]), float(pair[2])
            if not 1 <= order <= HIGHEST_ORDER or not _is_believed(amplitude) or order in amplitudes:
                raise ValueError(
                    f"the spectrum's {item} must be an order from 1 up to {HIGHEST_ORDER}, each once, with "
                    f"{SMALLEST_AMPLITUDE:g} to {LARGEST_AMPLITUDE:g} of it"
                )
            amplitudes[order] = amplitude
        elif (noise := re.fullmatch(rf"random:({NUMBER})/([0-9]{{1,9}})", item)) and not teeth:
            random, teeth = float(noise[1]), int(noise[2])
            if not _is_believed(random) or not FEWEST_TEETH <= teeth <= MOST_TEETH:
                raise ValueError(
                    f"the spectrum's {item} must have {SMALLEST_AMPLITUDE:g} to {LARGEST_AMPLITUDE:g} of it on "
                    f"{FEWEST_TEETH} to {MOST_TEETH} teeth"
                )
        else:
            raise ValueError(
                "the spectrum must read like '1:9.2 2:4.3 4:1.0' (order:amplitude), with at most one random part like "
                "'random:1.0/40' (standard deviation/teeth)"
            )
    if len(amplitudes) > MOST_ORDERS:
        raise ValueError(f"the spectrum must have {MOST_ORDERS} orders or less: {len(amplitudes)}")
    if teeth and max(amplitudes, default=0) > teeth // 2:
        raise ValueError(f"the spectrum's highest order must be {teeth // 2} or less, all that {teeth} teeth see")
    for order in range(1, teeth // 2 + 1):
        variance = random**2 * (1.0 if 2 * order == teeth else 2.0) / teeth
        amplitudes[order] = sqrt(amplitudes.get(order, 0.0) ** 2 + variance)
    return tuple(sorted(amplitudes.items()) if teeth else amplitudes.items()), teeth


def parsed_systematic(text: str) -> Systematic:
    """Return systematic waves such as ``2:5.0@30``, order:amplitude@direction, in the unit of the text and rad.

    A wave is amplitude·cos(order·(θ − direction)), half as high as its indicator reading.
    """
    found: dict[int, tuple[float, float]] = {}
    for item in text.split():
        wave = re.fullmatch(rf"([0-9]{{1,9}}):({NUMBER})@(-?{NUMBER})", item)
        if wave is None or int(wave[1]) in found:
            raise ValueError(
                f"systematic must read like '2:5.0@30' (order:amplitude@direction in degrees), each order once: {item}"
            )
        found[int(wave[1])] = (float(wave[2]), radians(float(wave[3])))
    return tuple((order, *wave) for order, wave in found.items())


def systematic_text(systematic: Systematic, unit: float) -> str:
    """Return systematic waves as a tolerance table writes them, their amplitudes over a unit."""
    return " ".join(
        f"{order}:{round(amplitude / unit, 9)!r}@{round(degrees(direction), 9)!r}"
        for order, amplitude, direction in systematic
    )


def spectrum_text(spectrum: Spectrum) -> str:
    """Return a spectrum as a tolerance table writes it."""
    return " ".join(f"{order}:{amplitude!r}" for order, amplitude in spectrum)


@lru_cache(maxsize=64)
def harmonic_range_quantile(spectrum: Spectrum, teeth: int = 0, base: Marginal = RAYLEIGH) -> float:
    """Return the 99.73 % quantile of the range over a turn of random harmonics of this spectrum.

    An order's wave is its relative amplitude times a random one of the base, at any phase; the range is taken over the
    whole turn, or at the teeth if there are any. One order has a closed form; several are integrated over a fixed Sobol
    sequence, of 2¹⁴ points or, at teeth, 2¹⁵. Its standard error is below a hundredth of the quantile.
    """
    if len(spectrum) == 1 and not teeth:
        return 2.0 * base.reach * spectrum[0][1]
    if base == RAYLEIGH and not teeth and spectrum in KNOWN_RANGES:
        return KNOWN_RANGES[spectrum]
    return integrated_range_quantile(spectrum, teeth, base)


def integrated_range_quantile(spectrum: Spectrum, teeth: int, base: Marginal) -> float:
    """Return the quantile over a fixed Sobol sequence."""
    from scipy.stats import qmc

    uniform = qmc.Sobol(2 * len(spectrum), rng=np.random.default_rng(1)).random_base2(15 if teeth else 14)
    turn = _waves_over_turn(spectrum, teeth)
    columns = ndtri(uniform) if base == RAYLEIGH else _isotropic(base, uniform)
    weights = np.repeat([amplitude for _, amplitude in spectrum], 2)
    ranges = [np.ptp((part * weights) @ turn, axis=1) for part in np.split(columns, columns.shape[0] // 2048)]
    return float(np.quantile(np.concatenate(ranges), INSIDE_AT_CP_1))


def _waves_over_turn(spectrum: Spectrum, teeth: int) -> Float[np.ndarray, "column point"]:
    """Return the cosine and sine of every order at every tooth or on fine points of one turn."""
    points = teeth or 96 * max(order for order, _ in spectrum)
    turn = 2 * np.pi * np.arange(points) / points
    return np.concatenate([np.stack([np.cos(order * turn), np.sin(order * turn)]) for order, _ in spectrum])


def _vectors(
    magnitude: Float[np.ndarray, "sample vector"], uniform: Float[np.ndarray, "sample vector"]
) -> Float[np.ndarray, "sample column"]:
    """Return both components of vectors at any phase."""
    phase = 2 * np.pi * uniform
    pairs = np.stack([magnitude * np.cos(phase), magnitude * np.sin(phase)], axis=-1)
    return pairs.reshape(uniform.shape[0], -1)


def _isotropic(magnitude: Marginal, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
    """Return both components of vectors of random magnitude at any phase, for independent uniform numbers in (0, 1).

    A vector's two normal numbers give its direction, the probability of their length, Rayleigh's, its magnitude:
    vectors whose normal numbers are correlated point alike, however the axes lie.
    """
    normal = ndtri(uniform).reshape(uniform.shape[0], -1, 2)
    length = np.hypot(normal[..., 0], normal[..., 1])
    share = np.clip(-np.expm1(-(length**2) / 2.0), ABOVE_ZERO, BELOW_ONE)
    direction = normal / np.maximum(length, ABOVE_ZERO)[..., np.newaxis]
    return np.asarray((direction * magnitude.quantile(share)[..., np.newaxis]).reshape(uniform.shape))


@dataclass(frozen=True, kw_only=True)
class ZoneMapping:
    """Distribution of a source's columns per unit of zone.

    A size spreads around the middle of its zone; a one-sided distribution starts at the lower limit. The radius of a
    position and the amplitudes of harmonics start at zero, at any phase. Bounded amplitudes of several orders fill the
    zone where all orders are at their largest.
    """

    # As in `tolalloc.drawings.sources.Source` [-]
    feature: Feature
    distribution: Distribution
    base: Marginal  # The distribution with its parameters
    cp: float
    shift: float
    spectrum: Spectrum
    teeth: int
    sorted: bool

    @cached_property
    def amplitudes(self) -> Float[np.ndarray, " order"]:
        """Relative amplitudes; a position is one vector of amplitude 1 [-]."""
        return np.array([amplitude for _, amplitude in self.spectrum]) if self.spectrum else np.ones(1)

    @cached_property
    def extent(self) -> float:
        """Diameter or range that is as large as the zone at Cp = 1 [unit of the base]."""
        if self.distribution.form.is_bounded or not self.spectrum:
            return 2.0 * float(self.amplitudes.sum()) * self.base.reach
        return harmonic_range_quantile(self.spectrum, self.teeth, self.base)

    @cached_property
    def unsorted(self) -> Marginal:
        """Deviation [half zone], or magnitude [unit of the base], before parts are sorted out."""
        if self.feature is not Feature.SIZE:
            return self.base
        if self.distribution.form.is_one_sided:
            return Placed(self.base, self.shift - 1.0, 2.0 / (self.base.reach * self.cp))
        return Placed(self.base, self.shift, 1.0 / (self.base.reach * self.cp))

    @cached_property
    def marginal(self) -> Marginal:
        """Deviation [half zone], or magnitude [unit of the base]."""
        return Sorted(self.unsorted, *self.limits) if self.sorted else self.unsorted

    @property
    def limits(self) -> tuple[float, float]:
        """Where the zone ends [unit of the marginal]."""
        return (-1.0, 1.0) if self.feature is Feature.SIZE else (0.0, self.base.reach * self.cp)

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation of the deviation from the middle, or of the magnitude, per unit of zone [-]."""
        mean, deviation = moments(self.marginal)
        unit = 2.0 if self.feature is Feature.SIZE else self.extent * self.cp
        return mean / unit, deviation / unit

    @property
    def inside(self) -> float:
        """Share of parts inside the zone before any are sorted out, for sizes and single vectors [-]."""
        low, high = self.unsorted.probability(np.array(self.limits))
        return float(high - low) if self.feature is Feature.SIZE else float(high)

    @property
    def wave_deviation(self) -> float:
        """σ of a component of a normal vector per unit of relative amplitude and of zone [-]."""
        return 1.0 / (self.extent * self.cp)

    def standard_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return the columns' deviations per unit of zone for independent uniform numbers in (0, 1)."""
        if self.feature is Feature.SIZE:
            return np.asarray(self.marginal.quantile(uniform) / 2.0)
        if self.marginal == RAYLEIGH:  # the normal numbers are the vectors
            return np.asarray(ndtri(uniform) * (self.wave_deviation * np.repeat(self.amplitudes, 2)))
        return _isotropic(self.marginal, uniform) * np.repeat(self.amplitudes / (self.extent * self.cp), 2)

    def at_limit(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return deviations per unit of zone whose limited measure is exactly the zone, at random phases."""
        if self.feature is Feature.SIZE:
            return np.where(uniform < 0.5, -0.5, 0.5)
        if self.feature is Feature.POSITION:
            return _vectors(np.full(uniform[:, 0::2].shape, 0.5), uniform[:, 0::2])
        columns = _vectors(np.broadcast_to(self.amplitudes, uniform[:, 0::2].shape), uniform[:, 0::2])
        return np.asarray(
            columns / np.ptp(columns @ _waves_over_turn(self.spectrum, self.teeth), axis=1)[:, np.newaxis]
        )
