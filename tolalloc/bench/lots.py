"""A lot of parts or units: gauge readings against the processes that a drawing states, and the drawing of the lot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from math import ceil, sqrt
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.bench.readings import column_readings
from tolalloc.capability.indices import ControlLimits, control_limits, holm
from tolalloc.drawings.distributions import RAYLEIGH, Distribution, ndtr, ndtri
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.fields import UNITS
from tolalloc.drawings.measured_parts import LARGEST_DEVIATION
from tolalloc.drawings.seeds import SamplingDesign, SeedTree, require_seed, uniform_chunks
from tolalloc.drawings.sources import Source, known_as, limited_measure
from tolalloc.drawings.table_file import TextTable, read_table_file, read_text_table, split_header
from tolalloc.drawings.zones import Feature, ZoneMapping
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.units import MICROMETRE

CONFIDENCE = 0.95
"""Of every interval [-]."""
FOUND = 0.95
"""Probability with which a shift is found that is called detectable [-]."""
FEWEST_READINGS = 5
"""Fewest readings of a column; the spread of fewer is hardly known [-]."""
LEVELS = (0.001, 0.5)
"""Smallest and largest false-alarm rate that is believed [-]."""
MOST_NEXT = 10_000
"""Most parts of the next sample [-]."""
WORDS = ("part", "unit", "note")
"""Columns of a file of readings that are no readings, and are not read."""
FAR = 10.0
"""Reading over half its zone from which on a slip of its unit is likelier than a bad part [-]."""

_POINTS = 2**15
"""Parts of a process of which simulated lots are drawn [-]."""
_LOTS = (2**14, 2**18)
"""Fewest and most simulated lots of one process [-]."""
_DRAWN = 2**25
"""Readings of simulated lots of one process from which on there are fewer lots [-]."""
_BEYOND = 20
"""Simulated lots that are expected beyond the strictest level of a test [-]."""
_CAPABILITY, _SHIFT = (0.1, 10.0), 1.0
"""Smallest and largest Cp, and largest shift, that a tolerance table takes [-, half zone]."""
_CHUNK = 2**21
"""Readings of simulated lots that are held at once [-]."""
_WRITTEN = 4
"""Decimals of Cp and shift in the table of a lot [-]."""


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


_GAUGES = {Feature.SIZE: Gauge.DEVIATION, Feature.POSITION: Gauge.RADIUS}
_ENDINGS = {
    ".x": (Gauge.X, 1.0),
    ".y": (Gauge.Y, 1.0),
    ".radius": (Gauge.RADIUS, 1.0),
    ".diameter": (Gauge.RADIUS, 0.5),
}
"""End of the head of a position's column → what its gauge shows, and the part of a reading that this is [-]."""


@dataclass(frozen=True, kw_only=True)
class GaugedColumn:
    """The readings of one column."""

    header: str  # As in the file
    source: Source
    gauge: Gauge
    values: Float[np.ndarray, " row"]  # Deviation from nominal, radius or total deviation; NaN where none was taken [m]

    @property
    def name(self) -> str:
        """The source, and which coordinate of it."""
        return f"{self.source.name}.{self.gauge}" if self.gauge in (Gauge.X, Gauge.Y) else self.source.name

    @cached_property
    def taken(self) -> Float[np.ndarray, " reading"]:
        """The readings that were taken [m]."""
        return np.asarray(self.values[np.isfinite(self.values)])


@dataclass(frozen=True, kw_only=True)
class NormalLaw:
    """Of normal readings: z = (x̄ − μ)·√n/σ is normal, t = (x̄ − μ)·√n/s Student's, (n − 1)·s²/σ² is χ².

    Examples
    --------
    A mean of 25 parts that is 0.6 σ off is three standard errors off:

    >>> law = NormalLaw(parts=25)
    >>> round(law.shift_probability(0.6), 4), [round(end, 3) for end in (*law.t_ends, *law.s_ends)]
    (0.0027, [-2.064, 2.064, 0.719, 1.281])
    """

    parts: int  # Of a lot [-]

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
        return float(2.0 * ndtr(-abs(shift) * sqrt(self.parts)))

    def spread_probability(self, ratio: float) -> float:
        """Return the probability that s/σ lies as far out as one, twice the smaller tail [-]."""
        from scipy import special

        freedom = self.parts - 1
        square = freedom * ratio**2
        return float(min(1.0, 2.0 * min(special.chdtr(freedom, square), special.chdtrc(freedom, square))))


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

    @cached_property
    def t_ends(self) -> tuple[float, float]:
        """Ends between which (x̄ − μ)·√n/s lies with probability `CONFIDENCE` [-]."""
        return _ends(self.means / np.maximum(self.deviations, np.finfo(float).tiny) * sqrt(self.parts))

    @cached_property
    def s_ends(self) -> tuple[float, float]:
        """Ends between which s/σ lies with probability `CONFIDENCE` [-]."""
        return _ends(self.deviations)

    @cached_property
    def square_ends(self) -> tuple[float, float]:
        """Ends between which the root mean square of a lot over that of the process lies so [-]."""
        squares = (self.centre + self.means) ** 2 + self.deviations**2 * (self.parts - 1) / self.parts
        return _ends(np.sqrt(squares / (1.0 + self.centre**2)))

    @cached_property
    def noise(self) -> tuple[float, float]:
        """Variance of s/σ, and its covariance with (x̄ − μ)/σ [-]."""
        both = np.cov(self.means, self.deviations)
        return float(both[1, 1]), float(both[0, 1])

    @cached_property
    def _sorted(self) -> tuple[Float[np.ndarray, " lot"], Float[np.ndarray, " lot"]]:
        return np.sort(self.means), np.sort(self.deviations)

    def shift_probability(self, shift: float) -> float:
        """Return the probability that (x̄ − μ)/σ lies as far out as one, twice the smaller tail [-]."""
        return _tail(self._sorted[0], shift)

    def spread_probability(self, ratio: float) -> float:
        """Return the probability that s/σ lies as far out as one, twice the smaller tail [-]."""
        return _tail(self._sorted[1], ratio)


_TAILS = ((1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0)
"""Probabilities at the ends of every interval [-]."""


def _tail(lots: Float[np.ndarray, " lot"], value: float) -> float:
    """Return twice the smaller share of lots, ascending, as far out as a value, which counts as one of them."""
    below = int(np.searchsorted(lots, value, side="right"))
    above = lots.size - int(np.searchsorted(lots, value, side="left"))
    return min(1.0, 2.0 * (min(below, above) + 1) / (lots.size + 1))


def _ends(lots: Float[np.ndarray, " lot"]) -> tuple[float, float]:
    """Return the quantiles between which a share `CONFIDENCE` of simulated lots lies [unit of the lots]."""
    low, high = np.quantile(lots, _TAILS)
    return float(low), float(high)


@dataclass(frozen=True, kw_only=True)
class StatedProcess:
    """One reading of a drawing's process, and what lots of it do."""

    # Of one reading [m]
    mean: float
    deviation: float
    law: NormalLaw | SimulatedLaw  # Of mean and standard deviation of a lot, in units of that

    @property
    def is_normal(self) -> bool:
        """Whether its readings are normal, so that nothing is simulated."""
        return isinstance(self.law, NormalLaw)

    def mean_interval(self, mean: float, deviation: float) -> tuple[float, float]:
        """Return where the mean of the process lies that made a lot, x̄ − t·s/√n for both ends of t [m].

        Exact for normal readings; others are taken to be distributed in the form of the drawing's process.
        """
        (low, high), unit = self.law.t_ends, deviation / sqrt(self.law.parts)
        return mean - high * unit, mean - low * unit

    def deviation_interval(self, deviation: float) -> tuple[float, float]:
        """Return where the standard deviation of the process lies that made a lot [m]; as `mean_interval`."""
        low, high = self.law.s_ends
        return deviation / high, deviation / low


class Lots:
    """Simulated lots of the drawing's processes, drawn once for all sources that are distributed alike.

    Parameters
    ----------
    tests
        Tests that are made of the lot [-].
    level
        False-alarm rate of all of them together [-].
    seed
        Seed of the random numbers [-].
    """

    def __init__(self, tests: int, level: float, seed: int) -> None:
        least, most = _LOTS
        self.count = min(max(least, ceil(2 * _BEYOND * tests / level)), most)
        self._seeds = SeedTree(seed).child("lot")
        self._parts: dict[tuple[ZoneMapping, Gauge], Float[np.ndarray, " part"]] = {}
        self._drawn: dict[tuple[ZoneMapping, Gauge, int], StatedProcess] = {}

    def process(self, source: Source, gauge: Gauge, parts: int) -> StatedProcess:
        """Return what the process of a source makes of lots of so many parts."""
        mapping, gauge = source.zone_mapping, Gauge.X if gauge is Gauge.Y else gauge
        key = (mapping, gauge, parts)
        if key not in self._drawn:
            own = self._normal(mapping, gauge, parts)
            self._drawn[key] = own or self._simulated(replace(source, zone=1.0, middle=0.0, each=1), gauge, parts)
        unit = self._drawn[key]
        middle = source.middle if gauge is Gauge.DEVIATION else 0.0
        return replace(unit, mean=middle + unit.mean * source.zone, deviation=unit.deviation * source.zone)

    @staticmethod
    def _normal(mapping: ZoneMapping, gauge: Gauge, parts: int) -> StatedProcess | None:
        """Return a process of normal readings per unit of zone, nothing where they are not normal."""
        if gauge is Gauge.DEVIATION and mapping.distribution is Distribution.NORMAL and not mapping.sorted:
            mean, deviation = mapping.shift / 2.0, 1.0 / (2.0 * mapping.base.reach * mapping.cp)
        elif gauge in (Gauge.X, Gauge.Y) and mapping.marginal == RAYLEIGH:
            mean, deviation = 0.0, mapping.wave_deviation
        else:
            return None
        return StatedProcess(mean=mean, deviation=deviation, law=NormalLaw(parts=parts))

    def _simulated(self, source: Source, gauge: Gauge, parts: int) -> StatedProcess:
        """Return a process per unit of zone, its lots drawn at random from its parts."""
        key = (source.zone_mapping, gauge)
        if key not in self._parts:
            self._parts[key] = self._readings(source, gauge)
        readings = self._parts[key]
        mean, deviation = float(readings.mean()), float(readings.std())
        generator = self._seeds.child("lots", str(parts)).generator()
        count = max(_LOTS[0], min(self.count, _DRAWN // parts))
        means, deviations = np.empty(count), np.empty(count)
        step = max(1, _CHUNK // parts)
        for start in range(0, count, step):
            stop = min(start + step, count)
            lots = readings[generator.integers(readings.size, size=(stop - start, parts))]
            means[start:stop], deviations[start:stop] = lots.mean(axis=1), lots.std(axis=1, ddof=1)
        law = SimulatedLaw(
            parts=parts, centre=mean / deviation, means=(means - mean) / deviation, deviations=deviations / deviation
        )
        return StatedProcess(mean=mean, deviation=deviation, law=law)

    def _readings(self, source: Source, gauge: Gauge) -> Float[np.ndarray, " part"]:
        """Return what the gauge shows of parts of a process, per unit of zone."""
        seeds, width = self._seeds.child("parts"), len(source.columns)
        uniform = np.concatenate(list(uniform_chunks(SamplingDesign.SOBOL, seeds, _POINTS, width)))
        columns = source.standard_values(uniform)
        return columns[:, 0] * source.lever if gauge in (Gauge.X, Gauge.Y) else _gauged(source, columns)


def _gauged(source: Source, columns: Float[np.ndarray, "part column"]) -> Float[np.ndarray, " part"]:
    """Return what a gauge shows of a feature: deviation from nominal, radius, or total deviation over a turn [m]."""
    shown = limited_measure(source, columns)
    if source.feature is Feature.SIZE:
        return shown + source.middle
    return shown / 2.0 if source.feature is Feature.POSITION else shown


def drawn_lot(sources: Sequence[Source], parts: int, generator: np.random.Generator) -> tuple[GaugedColumn, ...]:
    """Return gauge readings of random parts of the drawing's processes, every source by itself."""
    found = list[GaugedColumn]()
    for source in (replace(own, each=1) for own in sources):
        gauge = _GAUGES.get(source.feature, Gauge.RANGE)
        uniform = generator.random((parts, len(source.columns)))
        values = _gauged(source, source.standard_values(uniform) * source.zone + source.middles)
        head = f"{source.name}.radius" if gauge is Gauge.RADIUS else source.name
        found.append(GaugedColumn(header=f"{head} [µm]", source=source, gauge=gauge, values=values))
    return tuple(found)


@dataclass(frozen=True, kw_only=True)
class MeasuredProcess:
    """What a lot shows of one column, beside what the drawing states of it."""

    column: GaugedColumn
    stated: StatedProcess
    # Mean and sample standard deviation, and where those of the process lie with 95 % confidence [m]
    mean: float
    deviation: float
    mean_interval: tuple[float, float]
    deviation_interval: tuple[float, float]
    # Probability of a mean, and of a standard deviation, as far out under the drawing's process [-]
    shift_probability: float
    spread_probability: float
    next: ControlLimits  # Of the next sample
    # Whether mean and spread are other than the drawing's, at the false-alarm rate of all columns together
    mean_moved: bool = False
    spread_moved: bool = False

    @property
    def name(self) -> str:
        """The source, and which coordinate of it."""
        return self.column.name

    @property
    def probability(self) -> float:
        """The smaller of both p values [-]."""
        return min(self.shift_probability, self.spread_probability)

    @property
    def moved(self) -> bool:
        """Whether the process is not the drawing's."""
        return self.mean_moved or self.spread_moved

    @property
    def named_shift(self) -> bool:
        """Whether its mean is named as moved: not where a wider spread alone explains it."""
        low, high = self.mean_interval
        return self.mean_moved and not (self.spread_moved and low <= self.stated.mean <= high)

    @property
    def shift(self) -> tuple[float, float, float]:
        """Mean less the drawing's, over the drawing's σ, with the ends of its interval [-]."""
        one, low, high = ((own - self.stated.mean) / self.stated.deviation for own in (self.mean, *self.mean_interval))
        return one, low, high

    @property
    def spread(self) -> tuple[float, float, float]:
        """Standard deviation over the drawing's, with the ends of its interval [-]."""
        one, low, high = (own / self.stated.deviation for own in (self.deviation, *self.deviation_interval))
        return one, low, high


@dataclass(frozen=True, kw_only=True)
class LotCapability:
    """How the parts of one source keep their zone, and its row in the table of the lot."""

    source: Source  # As the drawing states it
    row: Source  # As the lot shows it
    parts: int  # [-]
    # Capability with 95 % intervals [-]
    cp: float
    cp_interval: tuple[float, float]
    cpk: float
    cpk_interval: tuple[float, float]
    outside: int  # Parts outside the zone [-]
    far: int  # Parts so far outside that their unit is doubted [-]
    clipped: bool  # Whether Cp or shift is beyond what a table takes, and the row has the limit instead


@dataclass(frozen=True, kw_only=True)
class LotRequest:
    """What a lot is asked."""

    path: Path  # File of the readings
    drawing: Drawing  # That the parts were made to
    columns: tuple[GaugedColumn, ...]
    level: float  # False-alarm rate over all columns [-]
    next_parts: int | None  # Of the next sample; as many as were measured now if None [-]
    seed: int  # Of simulated lots [-]


@dataclass(frozen=True, kw_only=True)
class LotResult:
    """What a lot shows."""

    stated: Drawing  # What the parts were made to
    drawing: Drawing  # The same with Cp and shift of the lot
    processes: tuple[MeasuredProcess, ...]  # One per column, in the order of the file
    capabilities: tuple[LotCapability, ...]  # One per source
    rows: int  # Measured parts or units [-]
    level: float  # False-alarm rate over all columns [-]
    lots: int  # Simulated lots of a process that is not normal, fewer where lots are very large [-]

    @property
    def moved(self) -> tuple[MeasuredProcess, ...]:
        """The processes that are not the drawing's, the surest first."""
        found = [own for own in self.processes if own.moved]
        return tuple(sorted(found, key=lambda own: own.probability))

    @property
    def detectable(self) -> float:
        """Shift of a normal process, over its σ, that is found with probability `FOUND` in the smallest sample [-].

        By Bonferroni's level of m tests, (z(1 − α/(2m)) + z(0.95))/√n; NaN where no process is normal.
        """
        parts = [own.stated.law.parts for own in self.processes if own.stated.is_normal]
        if not parts:
            return float("nan")
        tests = 2 * len(self.processes)
        return float((ndtri(1.0 - self.level / (2.0 * tests)) + ndtri(FOUND)) / sqrt(min(parts)))


def prepare_lot(path: Path, drawing: Drawing, level: float, next_parts: int | None, seed: int) -> LotRequest:
    """Return the lot of a file, everything checked.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, column and value that are not allowed, or the argument.
    """
    least, most = LEVELS
    if not least <= level <= most:
        raise InputError.of_argument("lot", "false_alarms", level, f"{least:g} to {most:g}")
    if next_parts is not None and not 2 <= next_parts <= MOST_NEXT:
        raise InputError.of_argument("lot", "next_parts", next_parts, f"2 to {MOST_NEXT}")
    require_seed("lot", seed)
    columns = load_lot(path, drawing.sources)
    return LotRequest(path=path, drawing=drawing, columns=columns, level=level, next_parts=next_parts, seed=seed)


def load_lot(path: Path, sources: Sequence[Source]) -> tuple[GaugedColumn, ...]:
    """Return the columns of a file of readings, one row per measured part or unit.

    A column is headed by its source and a unit, ``disc1.pitch [µm]``; that of a position says what the gauge shows, one
    of ``.x`` and ``.y``, ``.radius`` or ``.diameter``. Cells may be empty. Of like features a row has one.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, column and value that are not allowed; all such of one file together.
    """
    table, faults, columns = _table(path), Faults(), list[GaugedColumn]()
    for header in table.headers:
        if header.lower() in WORDS:
            continue
        with faults.kept():
            columns.append(_column(table, header, sources))
    faults.require_none()
    if not columns:
        raise InputError(f"{path}: no column holds readings; allowed are heads such as 'disc1.pitch [µm]'.")
    _require_together(table, columns)
    return tuple(columns)


def _table(path: Path) -> TextTable:
    """Return the cells of a CSV file, or of the first sheet of a workbook."""
    if path.suffix.lower() not in (".xlsx", ".xlsm"):
        return read_text_table(path)
    (_, headers), *others = read_table_file(path)
    if not others:
        raise InputError(f"{path}: the table has no rows; a line of headers and one row or more are needed.")
    rows, cells = zip(*others, strict=True)
    return TextTable(path=path, headers=headers, rows=rows, cells=cells)


def _column(table: TextTable, header: str, sources: Sequence[Source]) -> GaugedColumn:
    """Return the readings below one header."""
    path = table.path
    source, gauge, part = _meant(path, header, sources)
    if table.headers.count(header) > 1:
        raise InputError(f"{path}: the column {header!r} is there twice; each has one.")
    if source.zone == 0.0:
        raise InputError.at(path, f"the zone of {source.name}", 0, "a zone above 0 on the drawing of what is measured")
    if source.systematic:
        allowed = "a source without, since a total deviation does not tell its waves from the random ones"
        raise InputError.at(path, f"systematic of {source.name}", "stated on the drawing", allowed)
    known = {unit: factor * MICROMETRE for unit, factor in UNITS.items()}
    factor, shown = column_readings(table, header, known)
    values, largest, faults = shown * part, LARGEST_DEVIATION * MICROMETRE, Faults()
    least = -largest if gauge.has_sign else 0.0
    for at in np.flatnonzero((shown < least) | (shown > largest)):
        with faults.kept():
            allowed = f"{least / MICROMETRE:,.0f} to {LARGEST_DEVIATION:,.0f} µm"
            raise InputError.at(f"{path}, row {table.rows[at]}", header, float(f"{shown[at] / factor:.9g}"), allowed)
    faults.require_none()
    column = GaugedColumn(header=header, source=source, gauge=gauge, values=values)
    if column.taken.size < FEWEST_READINGS:
        allowed = f"{FEWEST_READINGS} or more"
        raise InputError.at(path, f"the number of readings of {header!r}", column.taken.size, allowed)
    if np.ptp(column.taken) == 0.0:
        same = f"{column.taken[0] / part / factor:.6g}"
        raise InputError(f"{path}: every reading of {header!r} is {same}; allowed are readings that differ.")
    return column


def _meant(path: Path, header: str, sources: Sequence[Source]) -> tuple[Source, Gauge, float]:
    """Return the source of a header, what its gauge shows, and the part of a reading that this is."""
    name = split_header(header)[0]
    known = {own.name: own for own in sources} | {own.own_id: own for own in sources if own.own_id}
    base, dot, tail = name.rpartition(".")
    ending = _ENDINGS.get(f".{tail}") if dot else None
    if name not in known and ending and base in known and known[base].feature is Feature.POSITION:
        return known[base], *ending
    if name not in known:
        raise UnknownNameError.among(path, "the source of a column", name, known_as(sources))
    source = known[name]
    if source.feature is Feature.POSITION:
        allowed = f"{name}.radius or {name}.diameter, or both {name}.x and {name}.y"
        raise InputError.at(path, "the column of a position", header, allowed)
    return source, _GAUGES.get(source.feature, Gauge.RANGE), 1.0


def _require_together(table: TextTable, columns: Sequence[GaugedColumn]) -> None:
    """Raise unless each source has one column, or both coordinates in the same rows."""
    faults = Faults()
    for source, own in _by_source(columns):
        gauges = sorted(column.gauge for column in own)
        heads = ", ".join(column.header for column in own)
        with faults.kept():
            if gauges not in ([Gauge.X, Gauge.Y], *([one] for one in Gauge if one not in (Gauge.X, Gauge.Y))):
                what = f"what is measured of {source.name}"
                raise InputError.at(table.path, what, heads, "radius, diameter, or x with y")
        if gauges == [Gauge.X, Gauge.Y]:
            single = np.isfinite(own[0].values) != np.isfinite(own[1].values)
            for at in np.flatnonzero(single):
                with faults.kept():
                    place = f"{table.path}, row {table.rows[at]}"
                    raise InputError(f"{place}: {source.name} has one coordinate; allowed are both, or none.")
    faults.require_none()


def _by_source(columns: Iterable[GaugedColumn]) -> list[tuple[Source, list[GaugedColumn]]]:
    """Return every source with its columns, in their order."""
    found: dict[str, tuple[Source, list[GaugedColumn]]] = {}
    for column in columns:
        found.setdefault(column.source.name, (column.source, []))[1].append(column)
    return list(found.values())


def judge_lot(request: LotRequest, lots: Lots | None = None) -> LotResult:
    """Return which processes moved, how the parts keep their zones, and the drawing of the lot.

    Every column is tested for its mean and for its spread against the process that the drawing states, all tests
    together at one false-alarm rate by Holm's procedure. Lots that were simulated for the same drawing may be given.
    """
    tests = 2 * len(request.columns)
    lots = lots or Lots(tests, request.level, request.seed)
    found = [_measured(column, lots, request.next_parts) for column in request.columns]
    rejected = holm([p for own in found for p in (own.shift_probability, own.spread_probability)], request.level)
    processes = tuple(
        replace(own, mean_moved=bool(rejected[2 * at]), spread_moved=bool(rejected[2 * at + 1]))
        for at, own in enumerate(found)
    )
    capabilities = tuple(_capability(source, own, lots) for source, own in _by_source(request.columns))
    return LotResult(
        stated=request.drawing,
        drawing=request.drawing.with_sources([own.row for own in capabilities], request.path.name),
        processes=processes,
        capabilities=capabilities,
        rows=max(column.values.size for column in request.columns),
        level=request.level,
        lots=lots.count,
    )


def _measured(column: GaugedColumn, lots: Lots, next_parts: int | None) -> MeasuredProcess:
    """Return what a column shows."""
    values = column.taken
    stated = lots.process(column.source, column.gauge, values.size)
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    limits = control_limits(stated.mean, stated.deviation, next_parts or values.size)
    if not column.gauge.has_sign:  # no radius lies below zero
        limits = replace(limits, mean=(max(limits.mean[0], 0.0), limits.mean[1]))
    return MeasuredProcess(
        column=column,
        stated=stated,
        mean=mean,
        deviation=deviation,
        mean_interval=stated.mean_interval(mean, deviation),
        deviation_interval=stated.deviation_interval(deviation),
        shift_probability=stated.law.shift_probability((mean - stated.mean) / stated.deviation),
        spread_probability=stated.law.spread_probability(deviation / stated.deviation),
        next=limits,
    )


def _plain(source: Source) -> Source:
    """Return a source at Cp 1, without shift and sorting; normal where Cp and shift do not say its distribution."""
    plain = replace(source, cp=1.0, shift=0.0, sorted=False)
    if source.distribution not in (Distribution.MIXTURE, Distribution.EMPIRICAL):
        return plain
    return replace(plain, distribution=Distribution.NORMAL, batches=(), measured=None)


def _capability(source: Source, columns: Sequence[GaugedColumn], lots: Lots) -> LotCapability:
    """Return the capability of a source and its row in the table of the lot.

    Notes
    -----
    Cp is that of a tolerance table: of a size the σ at Cp 1 over s, which is zone/(6·s) for normal deviations; of a
    radius or total deviation the root mean square at Cp 1 over that of the lot, so that a place that is off for all
    parts widens it too. Cpk is the distance of the mean from the nearer limit over 3·s; its interval by the spread of
    both to first order, σ² = 1/(9n) + Cpk²·Var(s/σ) ± ⅔·Cpk·Cov, for normal readings Bissell's.

    References
    ----------
    Bissell, How reliable is your capability index?, Appl. Stat. 39, 1990, 331–340.
    """
    values = columns[0].taken if len(columns) == 1 else np.hypot(columns[0].taken, columns[1].taken)
    gauge = columns[0].gauge if len(columns) == 1 else Gauge.RADIUS
    plain, half = _plain(source), source.zone / 2.0
    unit = lots.process(plain, gauge, values.size)
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    if gauge is Gauge.DEVIATION:
        cp, ends = unit.deviation / deviation, unit.law.s_ends
        upper, lower = source.middle + half - mean, mean - source.middle + half
    else:
        ends = unit.law.square_ends if isinstance(unit.law, SimulatedLaw) else unit.law.s_ends
        cp = sqrt((unit.mean**2 + unit.deviation**2) / float((values**2).mean()))
        upper, lower = (half if gauge is Gauge.RADIUS else source.zone) - mean, float("inf")
    cpk = min(upper, lower) / (3.0 * deviation)
    spread, common = unit.law.noise
    sign = 1.0 if upper <= lower else -1.0
    variance = 1.0 / (9.0 * values.size) + cpk**2 * spread + sign * 2.0 / 3.0 * cpk * common
    off = float(ndtri(0.5 + CONFIDENCE / 2.0)) * sqrt(max(variance, 0.0))
    row, clipped = _row(plain, cp, mean)
    limit = source.zone if gauge is Gauge.RANGE else half
    from_middle = np.abs(values - source.middle) if gauge is Gauge.DEVIATION else values
    return LotCapability(
        source=source,
        row=row,
        parts=values.size,
        cp=cp,
        cp_interval=(cp * ends[0], cp * ends[1]),
        cpk=cpk,
        cpk_interval=(cpk - off, cpk + off),
        outside=int((from_middle > limit * (1.0 + 1e-9)).sum()),
        far=int((from_middle > FAR * limit).sum()),
        clipped=clipped,
    )


def _row(plain: Source, cp: float, mean: float) -> tuple[Source, bool]:
    """Return the row of a lot with this Cp and, of a size, this mean [m], and whether a table takes neither of them."""
    least, most = _CAPABILITY
    written = round(min(max(cp, least), most), _WRITTEN)
    row = replace(plain, cp=written)
    clipped = not least <= cp <= most
    if plain.feature is not Feature.SIZE:
        return row, clipped
    # Half the zone is the unit of a shift; a distribution that starts at a limit has a mean without any.
    shift = 2.0 * ((mean - plain.middle) / plain.zone - row.zone_mapping.moments[0])
    return (
        replace(row, shift=round(min(max(shift, -_SHIFT), _SHIFT), _WRITTEN)),
        clipped or abs(shift) > _SHIFT,
    )
