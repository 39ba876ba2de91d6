"""Processes that a drawing states, and what mean and standard deviation of lots of them do, seen through a gauge."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from math import ceil, hypot, inf, isinf, sqrt

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import RAYLEIGH, Distribution, ndtr
from tolalloc.drawings.seeds import SamplingDesign, SeedTree
from tolalloc.drawings.sources import Source, limited_measure
from tolalloc.drawings.zones import Feature, ZoneMapping

CONFIDENCE = 0.95
"""Of every interval [-]."""
_POINTS = 2**15
"""Parts of a process of which simulated lots are drawn [-]."""
_LOTS = (2**14, 2**18)
"""Fewest and most simulated lots of one process [-]."""
_DRAWN = 2**25
"""Readings of simulated lots of one process from which on there are fewer lots [-]."""
_BEYOND = 20
"""Simulated lots that are expected beyond the strictest level of a test [-]."""
_CHUNK = 2**21
"""Readings of simulated lots that are held at once [-]."""

_TAILS = ((1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0)
"""Probabilities at the ends of every interval [-]."""


class Gauge(StrEnum):
    """What the gauge of a column shows."""

    DEVIATION = "deviation"
    X = "x"
    Y = "y"
    RADIUS = "radius"
    RANGE = "total deviation"

    @property
    def has_sign(self) -> bool:
        """Whether its readings lie on both sides of zero."""
        return self in (Gauge.DEVIATION, Gauge.X, Gauge.Y)


@dataclass(frozen=True, kw_only=True)
class GaugeError:
    """How the values of a column err by their gauge, normally and independently of the parts."""

    deviation: float = 0.0  # Standard deviation of one value [m]
    freedom: float = inf  # Degrees of freedom with which it is known, from repeat readings; infinite if stated [-]

    def __truediv__(self, length: float) -> GaugeError:
        """Return it in another unit of length [m]."""
        return replace(self, deviation=self.deviation / length)


EXACT = GaugeError()
"""A gauge that does not err."""


@dataclass(frozen=True, kw_only=True)
class NormalLaw:
    """Of normal readings: z = (x̄ − μ)·√n/σ is normal, t = (x̄ − μ)·√n/s Student's, (n − 1)·s²/σ² is χ²."""

    parts: int  # Of a lot [-]
    seen: float = 1.0  # Standard deviation of a reading over that of the process, above 1 by a gauge that errs [-]

    @property
    def t_ends(self) -> tuple[float, float]:
        """Ends between which (x̄ − μ)·√n/s lies with probability `CONFIDENCE` [-]."""
        from scipy import special

        low, high = (float(special.stdtrit(self.parts - 1, end)) for end in _TAILS)
        return low, high

    @property
    def s_ends(self) -> tuple[float, float]:
        """Ends between which s/σ lies with probability `CONFIDENCE` [-]."""
        from scipy import special

        low, high = (sqrt(float(special.chdtri(self.parts - 1, 1.0 - end)) / (self.parts - 1)) for end in _TAILS)
        return low, high

    @property
    def noise(self) -> tuple[float, float]:
        """Variance of s/σ, 1/(2(n − 1)) to first order, and its covariance with (x̄ − μ)/σ, 0 [-]."""
        return 1.0 / (2.0 * (self.parts - 1)), 0.0

    def shift_probability(self, shift: float) -> float:
        """Return the probability that (x̄ − μ)/σ lies as far out as one, twice the smaller tail [-]."""
        return float(2.0 * ndtr(-abs(shift / self.seen) * sqrt(self.parts)))

    def spread_probability(self, ratio: float) -> float:
        """Return the probability that s/σ lies as far out as one, twice the smaller tail [-]."""
        from scipy import special

        freedom = self.parts - 1
        square = freedom * (ratio / self.seen) ** 2
        return float(min(1.0, 2.0 * min(special.chdtr(freedom, square), special.chdtrc(freedom, square))))

    def process_ends(self, ratio: float) -> tuple[float, float]:
        """Return where the standard deviation of the process lies if that of a lot's readings is one, both over σ [-].

        >>> [round(end, 3) for end in NormalLaw(parts=25, seen=1.25).process_ends(1.25)]
        [0.625, 1.569]
        """
        low, high = self.s_ends
        least, most = ((ratio / end) ** 2 - (self.seen**2 - 1.0) for end in (high, low))
        return sqrt(max(least, 0.0)), sqrt(max(most, 0.0))


@dataclass(frozen=True, kw_only=True)
class SimulatedLaw:
    """Of readings of any distribution, by lots that were simulated.

    References
    ----------
    Davison & Hinkley, Bootstrap methods and their application, 1997, equation 4.11: the lot itself is one of those that
    lie as far out, so that no p value is too small.
    """

    parts: int  # Of a lot [-]
    centre: float  # Mean of a reading over its σ [-]
    means: Float[np.ndarray, " lot"]  # (x̄ − μ)/σ of every lot [-]
    deviations: Float[np.ndarray, " lot"]  # s/σ of every lot [-]
    # Standard deviation of the gauge over σ in every lot: one number if it is stated, else as repeat readings leave it
    # open [-]
    gauge: Float[np.ndarray, " lot"] = field(default_factory=lambda: np.zeros(1))

    @cached_property
    def _pivots(self) -> Float[np.ndarray, " lot"]:
        """Standard deviation of the readings of a lot over that of all of them [-]."""
        return np.asarray(self.deviations / np.hypot(1.0, self.gauge))

    @cached_property
    def t_ends(self) -> tuple[float, float]:
        """Ends between which (x̄ − μ)·√n/s lies with probability `CONFIDENCE` [-]."""
        return _ends(self.means / np.maximum(self.deviations, np.finfo(float).tiny) * sqrt(self.parts))

    @cached_property
    def s_ends(self) -> tuple[float, float]:
        """Ends between which s/σ lies with probability `CONFIDENCE` [-]."""
        return _ends(self._pivots)

    @cached_property
    def square_ends(self) -> tuple[float, float]:
        """Ends between which the root mean square of a lot over that of the process lies so [-]."""
        return _ends(self._roots)

    @cached_property
    def _roots(self) -> Float[np.ndarray, " lot"]:
        squares = (self.centre + self.means) ** 2 + self.deviations**2 * (self.parts - 1) / self.parts
        return np.asarray(np.sqrt(squares / (1.0 + self.centre**2 + self.gauge**2)))

    def process_ends(self, ratio: float) -> tuple[float, float]:
        """Return where the standard deviation of the process lies if that of a lot's readings is one, both over σ [-].

        A generalized interval: quantiles of (s/q)² − g², q and g of every simulated lot.

        References
        ----------
        Weerahandi, Generalized confidence intervals, J. Am. Stat. Assoc. 88, 1993, 899–905.
        """
        return _ends(np.sqrt(np.maximum((ratio / self._pivots) ** 2 - self.gauge**2, 0.0)))

    def root_ends(self, ratio: float) -> tuple[float, float]:
        """Return the same for root mean squares, over σ too [-]."""
        return _ends(np.sqrt(np.maximum((ratio / self._roots) ** 2 - self.gauge**2, 0.0)))

    @cached_property
    def noise(self) -> tuple[float, float]:
        """Variance of s/σ, and its covariance with (x̄ − μ)/σ [-]."""
        seen = np.hypot(1.0, self.gauge)
        both = np.cov(self.means / seen, self._pivots)
        return float(both[1, 1]), float(both[0, 1])

    @cached_property
    def _sorted(self) -> tuple[Float[np.ndarray, " lot"], Float[np.ndarray, " lot"]]:
        return np.sort(self.means), np.sort(self.deviations)

    def shift_probability(self, shift: float) -> float:
        """Return the probability that (x̄ − μ)/σ lies as far out as one, twice the smaller tail [-]."""
        return two_sided(shift, self._sorted[0])

    def spread_probability(self, ratio: float) -> float:
        """Return the probability that s/σ lies as far out as one, twice the smaller tail [-]."""
        return two_sided(ratio, self._sorted[1])


def two_sided(value: float, lots: Float[np.ndarray, " lot"], above: Float[np.ndarray, " lot"] | None = None) -> float:
    """Return twice the smaller share of lots, ascending, as far out as a value, which counts as one of them [-].

    Lots that are as large may be other ones, as many, than those that are as small.
    """
    smaller = int(np.searchsorted(lots, value, side="right"))
    larger = lots.size - int(np.searchsorted(lots if above is None else above, value, side="left"))
    return min(1.0, 2.0 * (min(smaller, larger) + 1) / (lots.size + 1))


def _ends(lots: Float[np.ndarray, " lot"]) -> tuple[float, float]:
    """Return the quantiles between which a share `CONFIDENCE` of simulated lots lies [unit of the lots]."""
    low, high = np.quantile(lots, _TAILS)
    return float(low), float(high)


@dataclass(frozen=True, kw_only=True)
class GaugedProcess:
    """One reading of a drawing's process, and what lots of it do."""

    # Of one reading [m]
    mean: float
    deviation: float
    law: NormalLaw | SimulatedLaw  # Of mean and standard deviation of a lot, in units of that
    error: GaugeError = EXACT  # Of the gauge through which lots are seen

    @property
    def is_normal(self) -> bool:
        """Whether its readings are normal, so that nothing is simulated."""
        return isinstance(self.law, NormalLaw)

    @property
    def seen(self) -> float:
        """Standard deviation of its readings, that of the gauge included [m]."""
        return hypot(self.deviation, self.error.deviation)

    def mean_interval(self, mean: float, deviation: float) -> tuple[float, float]:
        """Return where the mean of the process lies that made a lot, x̄ − t·s/√n for both ends of t [m].

        Exact for normal readings; others are taken to be distributed in the form of the drawing's process.
        """
        (low, high), unit = self.law.t_ends, deviation / sqrt(self.law.parts)
        return mean - high * unit, mean - low * unit

    def deviation_interval(self, deviation: float) -> tuple[float, float]:
        """Return where the standard deviation of the process lies that made a lot [m]; as `mean_interval`.

        That of the lot is of its readings; what the gauge adds is taken off.
        """
        if self.error != EXACT:
            least, most = self.law.process_ends(deviation / self.deviation)
            return least * self.deviation, most * self.deviation
        low, high = self.law.s_ends
        return deviation / high, deviation / low


class Lots:
    """Simulated lots of the drawing's processes, drawn once for all sources that are distributed alike.

    They are as many as tests of a lot with one false-alarm rate, the level, ask for.
    """

    def __init__(self, tests: int, level: float, seed: int) -> None:
        least, most = _LOTS
        self.count = min(max(least, ceil(2 * _BEYOND * tests / level)), most)
        self._seeds = SeedTree(seed).child("lot")
        self._parts: dict[tuple[ZoneMapping, Gauge], Float[np.ndarray, " part"]] = {}
        self._drawn: dict[tuple[ZoneMapping, Gauge, int, GaugeError], GaugedProcess] = {}

    def process(self, source: Source, gauge: Gauge, parts: int, error: GaugeError = EXACT) -> GaugedProcess:
        """Return what the process of a source makes of lots of so many parts, seen through a gauge."""
        mapping, gauge = source.zone_mapping, Gauge.X if gauge is Gauge.Y else gauge
        key = (mapping, gauge, parts, error / source.zone)
        if key not in self._drawn:
            alike = replace(source, zone=1.0, middle=0.0, each=1)
            self._drawn[key] = self._normal(*key) or self._simulated(alike, *key[1:])
        unit = self._drawn[key]
        middle = source.middle if gauge is Gauge.DEVIATION else 0.0
        mean, deviation = middle + unit.mean * source.zone, unit.deviation * source.zone
        return replace(unit, mean=mean, deviation=deviation, error=error)

    @staticmethod
    def _normal(mapping: ZoneMapping, gauge: Gauge, parts: int, error: GaugeError) -> GaugedProcess | None:
        """Return a process of normal readings per unit of zone, nothing where their distribution is not known."""
        if not isinf(error.freedom):
            return None
        if gauge is Gauge.DEVIATION and mapping.distribution is Distribution.NORMAL and not mapping.sorted:
            mean, deviation = mapping.shift / 2.0, 1.0 / (2.0 * mapping.base.reach * mapping.cp)
        elif gauge in (Gauge.X, Gauge.Y) and mapping.marginal == RAYLEIGH:
            mean, deviation = 0.0, mapping.wave_deviation
        else:
            return None
        return GaugedProcess(
            mean=mean, deviation=deviation, law=NormalLaw(parts=parts, seen=hypot(1.0, error.deviation / deviation))
        )

    def _simulated(self, source: Source, gauge: Gauge, parts: int, error: GaugeError) -> GaugedProcess:
        """Return a process per unit of zone, its lots drawn at random from its parts and read by its gauge."""
        key = (source.zone_mapping, gauge)
        if key not in self._parts:
            self._parts[key] = self._readings(source, gauge)
        readings = self._parts[key]
        mean, deviation = float(readings.mean()), float(readings.std())
        generator = self._seeds.child("lots", str(parts)).generator()
        count = max(_LOTS[0], min(self.count, _DRAWN // parts))
        means, deviations, errors = np.empty(count), np.empty(count), _drawn_errors(error, count, generator)
        step = max(1, _CHUNK // parts)
        for start in range(0, count, step):
            stop = min(start + step, count)
            lots = readings[generator.integers(readings.size, size=(stop - start, parts))]
            if error != EXACT:
                lots = lots + errors[start:stop, np.newaxis] * generator.standard_normal(lots.shape)
            means[start:stop], deviations[start:stop] = lots.mean(axis=1), lots.std(axis=1, ddof=1)
        law = SimulatedLaw(
            parts=parts,
            centre=mean / deviation,
            means=(means - mean) / deviation,
            deviations=deviations / deviation,
            gauge=errors / deviation,
        )
        return GaugedProcess(mean=mean, deviation=deviation, law=law)

    def _readings(self, source: Source, gauge: Gauge) -> Float[np.ndarray, " part"]:
        """Return what the gauge shows of parts of a process, per unit of zone."""
        seeds, width = self._seeds.child("parts"), len(source.columns)
        uniform = np.concatenate(list(seeds.uniform_chunks(_POINTS, width, SamplingDesign.SOBOL)))
        columns = source.standard_values(uniform)
        return columns[:, 0] * source.lever if gauge in (Gauge.X, Gauge.Y) else gauged(source, columns)


def gauged(source: Source, columns: Float[np.ndarray, "part column"]) -> Float[np.ndarray, " part"]:
    """Return what a gauge shows of a feature: deviation from nominal, radius, or total deviation over a turn [m]."""
    shown = limited_measure(source, columns)
    if source.feature is Feature.SIZE:
        return shown + source.middle
    return shown / 2.0 if source.feature is Feature.POSITION else shown


def _drawn_errors(error: GaugeError, lots: int, generator: np.random.Generator) -> Float[np.ndarray, " lot"]:
    """Return standard deviations of a gauge that its repeat readings do not refute, √(ν·s²/χ²) with ν of them [m]."""
    if error == EXACT:
        return np.zeros(lots)
    if isinf(error.freedom):
        return np.full(lots, error.deviation)
    return np.asarray(error.deviation * np.sqrt(error.freedom / generator.chisquare(error.freedom, lots)))
