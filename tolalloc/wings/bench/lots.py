"""A lot of parts or units: gauge readings against the processes that a drawing states, and the drawing of the lot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot, inf, isnan, sqrt
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.capability.conformity import COVERAGE
from tolalloc.capability.indices import ControlLimits, control_limits, holm
from tolalloc.drawings.distributions import Distribution, ndtri
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.fields import UNITS
from tolalloc.drawings.heads import split_header
from tolalloc.drawings.measured_parts import LARGEST_DEVIATION
from tolalloc.drawings.qdas_file import FILE_NAME, SHORT, VALID, qdas_number, read_characteristics
from tolalloc.drawings.sources import Source, known_as
from tolalloc.drawings.table_file import TextTable, is_workbook, read_table_file, read_text_table
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.units import MICROMETRE, usual_signs
from tolalloc.wings.bench.lot_orders import LotCurves, LotOrder, judged_orders, predicted_orders, with_sources
from tolalloc.wings.bench.processes import (
    CONFIDENCE,
    EXACT,
    Gauge,
    GaugedProcess,
    GaugeError,
    Lots,
    NormalLaw,
    SimulatedLaw,
    gauged,
)
from tolalloc.wings.bench.readings import column_readings

FOUND = 0.95
"""Probability with which a shift is found that is called detectable [-]."""
FEWEST_READINGS = 5
"""Fewest readings of a column; the spread of fewer is hardly known [-]."""
WORDS = ("part", "unit", "note")
"""Columns of a file of readings that are no readings, and are not read."""
ERROR = "gauge"
"""What stands in such a column where a row states the standard deviations of the gauges."""
FAR = 10.0
"""Reading over half its zone from which on a slip of its unit is likelier than a bad part [-]."""

_CAPABILITY, _SHIFT = (0.1, 10.0), 1.0
"""Smallest and largest Cp, and largest shift, that a tolerance table takes [-, half zone]."""
_WRITTEN = 4
"""Decimals of Cp and shift in the table of a lot [-]."""


_LENGTHS = {unit: factor * MICROMETRE for unit, factor in UNITS.items()}
"""Unit of a column as written → factor to metres [m]."""
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
    # Deviation from nominal, radius or total deviation, the mean where a part was read again; NaN where none was taken
    # [m]
    values: Float[np.ndarray, " row"]
    error: GaugeError = EXACT  # Of such a value by its gauge

    @property
    def name(self) -> str:
        """The source, and which coordinate of it."""
        return f"{self.source.name}.{self.gauge}" if self.gauge in (Gauge.X, Gauge.Y) else self.source.name

    @cached_property
    def taken(self) -> Float[np.ndarray, " reading"]:
        """The readings that were taken [m]."""
        return np.asarray(self.values[np.isfinite(self.values)])


def drawn_lot(sources: Sequence[Source], parts: int, generator: np.random.Generator) -> tuple[GaugedColumn, ...]:
    """Return gauge readings of random parts of the drawing's processes, every source by itself."""
    found = list[GaugedColumn]()
    for source in (replace(own, each=1) for own in sources):
        gauge = _GAUGES.get(source.feature, Gauge.RANGE)
        uniform = generator.random((parts, len(source.columns)))
        values = gauged(source, source.standard_values(uniform) * source.zone + source.middles)
        head = f"{source.name}.radius" if gauge is Gauge.RADIUS else source.name
        found.append(GaugedColumn(header=f"{head} [µm]", source=source, gauge=gauge, values=values))
    return tuple(found)


@dataclass(frozen=True, kw_only=True)
class MeasuredProcess:
    """What a lot shows of one column, beside what the drawing states of it."""

    column: GaugedColumn
    stated: GaugedProcess
    # Mean and standard deviation without what the gauge adds; where those of the process lie with 95 % confidence [m]
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
    def gauge_share(self) -> float:
        """Part of the variance of its readings that the gauge makes [-]."""
        return float(self.column.error.deviation**2 / self.column.taken.var(ddof=1))

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
    curves: LotCurves | None = None  # Of units of the lot; None where none were measured


@dataclass(frozen=True, kw_only=True)
class LotResult:
    """What a lot shows."""

    request: LotRequest  # What was asked
    drawing: Drawing  # The drawing of the parts with Cp and shift of the lot
    processes: tuple[MeasuredProcess, ...]  # One per column, in the order of the file
    capabilities: tuple[LotCapability, ...]  # One per source
    rows: int  # Measured parts or units [-]
    lots: int  # Simulated lots of a process that is not normal, fewer where lots are very large [-]
    orders: tuple[LotOrder, ...] = ()  # Of the curves

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
        normal = [own.stated for own in self.processes if own.stated.is_normal]
        if not normal:
            return float("nan")
        tests = 2 * len(self.processes) + len(self.orders)
        errors = ndtri(1.0 - self.request.level / (2.0 * tests)) + ndtri(FOUND)
        return max(float(errors * (own.seen / own.deviation) / sqrt(own.law.parts)) for own in normal)


def prepare_lot(
    path: Path, drawing: Drawing, level: float, next_parts: int | None, seed: int, curves: LotCurves | None = None
) -> LotRequest:
    """Return the lot of a file, everything checked.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, column and value that are not allowed, or the argument.
    """
    drawing = drawing.with_sources(_measured_places(path, drawing.sources))
    columns = load_lot(path, drawing.sources)
    return LotRequest(
        path=path, drawing=drawing, columns=columns, level=level, next_parts=next_parts, seed=seed, curves=curves
    )


def _measured_places(path: Path, sources: Sequence[Source]) -> list[Source]:
    """Return a row for each place that a file has readings of, and those for several without these."""
    heads = [split_header(header)[0] for header in _table(path, sources).headers]
    names = {name for head in heads for name in (head, head.rpartition(".")[0])} - {own.name for own in sources}
    found = list[Source]()
    for row in sources:
        own = row.at_places(sorted(names))
        if len(own) == row.places:
            found += own
        elif own:
            found.append(replace(row, places=max(row.places - len(own), 0)))
            found += (one.alone for one in own)
    return found


def load_lot(path: Path, sources: Sequence[Source]) -> tuple[GaugedColumn, ...]:
    """Return the columns of a file of readings, one row per measured part or unit.

    A column is headed by its source and a unit, ``disc1.pitch [µm]``; that of a position says what the gauge shows, one
    of ``.x`` and ``.y``, ``.radius`` or ``.diameter``. Cells may be empty. Of like features a row has one.

    Rows with one name in the column ``part`` are readings of one part. A row with the word ``gauge`` in one of the
    columns `WORDS` states the standard deviation of each gauge.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, column and value that are not allowed; all such of one file together.
    """
    (table, stated), faults, columns = _apart(_table(path, sources)), Faults(), list[GaugedColumn]()
    for header in table.headers:
        if header.lower() in WORDS:
            continue
        with faults.kept():
            columns.append(_column(table, header, sources))
    faults.require_none()
    if not columns:
        raise InputError(f"{path}: no column holds readings; allowed are heads such as 'disc1.pitch [µm]'.")
    _require_together(table, columns)
    names = next((own for own in table.headers if own.lower() == "part"), "")
    parts = [cells[table.headers.index(names)] for cells in table.cells] if names else []
    for at, column in enumerate(columns):
        with faults.kept():
            columns[at] = _without_gauge(path, column, parts, stated)
    faults.require_none()
    return tuple(columns)


def _apart(table: TextTable) -> tuple[TextTable, TextTable | None]:
    """Return the readings of a table, and the row that states the gauges, if it is there."""
    words = [at for at, header in enumerate(table.headers) if header.lower() in WORDS]
    stated = [any(cells[at].strip().lower() == ERROR for at in words) for cells in table.cells]
    if not any(stated):
        return table, None
    if sum(stated) > 1:
        raise InputError.at(table.path, f"the number of rows {ERROR!r}", sum(stated), "1")
    at = stated.index(True)
    rows, cells = table.rows[at], table.cells[at]
    rest = replace(table, rows=table.rows[:at] + table.rows[at + 1 :], cells=table.cells[:at] + table.cells[at + 1 :])
    return rest, replace(table, rows=(rows,), cells=(cells,))


def _without_gauge(path: Path, column: GaugedColumn, names: Sequence[str], stated: TextTable | None) -> GaugedColumn:
    """Return a column part by part, with what its gauge adds to it; unchanged where nothing is known of the gauge.

    The variance of one reading is stated, or pooled from parts that were read again, Σ(y − ȳ)²/Σ(r − 1); a mean of r of
    them has 1/r of it, and parts with different r the mean of that, to first order.
    """
    known, of_row = _stated(column, stated), [name or f"\n{at}" for at, name in enumerate(names)]
    place = {name: at for at, name in enumerate(dict.fromkeys(of_row))}  # in the order of the file, for x and y alike
    if not known and len(place) == len(of_row):
        return column
    part = np.array([place[name] for name in of_row]) if of_row else np.arange(column.values.size)
    taken = np.isfinite(column.values)
    times = np.bincount(part, taken)
    with np.errstate(invalid="ignore"):
        values = np.bincount(part, np.where(taken, column.values, 0.0)) / times
    values[times == 0] = np.nan
    freedom, apart = float((times[times > 0] - 1).sum()), (column.values - values[part])[taken]
    if not known and not freedom:
        return replace(column, values=values)
    one = known or sqrt(float((apart**2).sum()) / freedom)
    error = GaugeError(
        deviation=one * sqrt(float((1.0 / times[times > 0]).mean())), freedom=inf if known or not one else freedom
    )
    column = replace(column, values=values, error=error)
    if column.taken.size < FEWEST_READINGS:
        what = f"the number of parts of {column.header!r}"
        raise InputError.at(path, what, column.taken.size, f"{FEWEST_READINGS} or more")
    spread = float(column.taken.std())
    if error.deviation >= spread:
        what, length = f"the standard deviation by the gauge of {column.header!r}", MICROMETRE
        allowed = f"less than that of the parts as they were read, {spread / length:.3g} µm"
        raise InputError.at(path, what, f"{error.deviation / length:.3g} µm", allowed)
    return column


def _stated(column: GaugedColumn, stated: TextTable | None) -> float:
    """Return the standard deviation of a reading by the row that states it, else by the tolerance table [m].

    0 where neither does. The table's is that of what its zone limits, of a position a diameter.
    """
    if stated is None:
        return column.source.uncertainty / COVERAGE * (0.5 if column.source.feature is Feature.POSITION else 1.0)
    factor, (shown,) = column_readings(stated, column.header, _LENGTHS)
    if not (np.isnan(shown) or 0.0 < shown <= LARGEST_DEVIATION * MICROMETRE):
        place, value = f"{stated.path}, row {stated.rows[0]}", float(f"{shown / factor:.9g}")
        raise InputError.at(place, f"the gauge of {column.header!r}", value, "above 0, or empty")
    part = 0.5 if split_header(column.header)[0].endswith(".diameter") else 1.0
    return 0.0 if np.isnan(shown) else float(shown) * part


def _table(path: Path, sources: Sequence[Source]) -> TextTable:
    """Return the cells of a CSV file, of the first sheet of a workbook, or of a measuring room's file (Q-DAS)."""
    if FILE_NAME.fullmatch(path.name):
        return _of_measuring_room(path, sources)
    if not is_workbook(path):
        return read_text_table(path)
    (_, headers), *others = read_table_file(path)
    if not others:
        raise InputError(f"{path}: the table has no rows; a line of headers and one row or more are needed.")
    rows, cells = zip(*others, strict=True)
    return TextTable(path=path, headers=headers, rows=rows, cells=cells)


def _of_measuring_room(path: Path, sources: Sequence[Source]) -> TextTable:
    """Return the valid values of a Q-DAS file below the short names, else the names, of its characteristics.

    Those of one name, such as like places, stand in one column. Of a position a value is a diameter, of any other
    feature an actual size, as far from nominal as it deviates.
    """
    positions = {name for own in sources if own.feature is Feature.POSITION for name in (own.name, own.own_id) if name}
    columns = dict[str, list[str]]()
    for at, own in read_characteristics(path).items():
        name = own.fields.get(SHORT) or (own.names or (str(at),))[-1]
        where, unit = f"{path}, characteristic {name}", usual_signs(own.fields.get("K2142", ""))
        if unit not in UNITS:
            raise InputError.at(where, "the unit (K2142)", unit, "µm, um or mm")
        nominal = 0.0 if name in positions else qdas_number(own.fields.get("K2101", "") or "0")
        head = f"{name}.diameter [{unit}]" if name in positions else f"{name} [{unit}]"
        values = [(qdas_number(text) - nominal, text) for text, attribute in own.values if attribute == VALID]
        columns.setdefault(head, []).extend(text if isnan(value) else f"{value:.9g}" for value, text in values)
    count = max(map(len, columns.values()), default=0)
    cells = zip(*(own + [""] * (count - len(own)) for own in columns.values()), strict=True)
    return TextTable(path=path, headers=tuple(columns), rows=tuple(range(1, count + 1)), cells=tuple(cells))


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
    factor, shown = column_readings(table, header, _LENGTHS)
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
        raise UnknownNameError.among(path, "source of column", name, known_as(sources))
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
    together at one false-alarm rate by Holm's procedure; so are the orders of curves. Lots that were simulated for the
    same drawing may be given.
    """
    curves, tests = request.curves, 2 * len(request.columns)
    lots = lots or Lots(tests + len(curves.orders if curves else ()), request.level, request.seed)
    found = [_measured(column, lots, request.next_parts) for column in request.columns]
    orders = judged_orders(curves, predicted_orders(curves, lots.count, request.seed)) if curves else ()
    probabilities = [p for own in found for p in (own.shift_probability, own.spread_probability)]
    rejected = holm([*probabilities, *(own.probability for own in orders)], request.level)
    processes = tuple(
        replace(own, mean_moved=bool(rejected[2 * at]), spread_moved=bool(rejected[2 * at + 1]))
        for at, own in enumerate(found)
    )
    capabilities = tuple(_capability(source, own, lots) for source, own in _by_source(request.columns))
    return LotResult(
        request=request,
        drawing=request.drawing.with_sources([own.row for own in capabilities], request.path.name),
        processes=processes,
        capabilities=capabilities,
        rows=max(column.values.size for column in request.columns),
        lots=lots.count,
        orders=with_sources(curves, orders, rejected[tests:].tolist(), request.seed) if curves else (),
    )


def _measured(column: GaugedColumn, lots: Lots, next_parts: int | None) -> MeasuredProcess:
    """Return what a column shows."""
    values = column.taken
    stated = lots.process(column.source, column.gauge, values.size, column.error)
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    limits = control_limits(stated.mean, stated.seen, next_parts or values.size)
    if not column.gauge.has_sign:  # no radius lies below zero
        limits = replace(limits, mean=(max(limits.mean[0], 0.0), limits.mean[1]))
    return MeasuredProcess(
        column=column,
        stated=stated,
        mean=mean,
        deviation=_taken_off(deviation, column.error.deviation),
        mean_interval=stated.mean_interval(mean, deviation),
        deviation_interval=stated.deviation_interval(deviation),
        shift_probability=stated.law.shift_probability((mean - stated.mean) / stated.deviation),
        spread_probability=stated.law.spread_probability(deviation / stated.deviation),
        next=limits,
    )


def _taken_off(whole: float, error: float) -> float:
    """Return what is left of a root mean square without what the gauge adds [m]."""
    return sqrt(whole**2 - error**2) if error else whole


def _plain(source: Source) -> Source:
    """Return a source at Cp 1, without shift and sorting; normal where Cp and shift do not say its distribution."""
    plain = replace(source, cp=1.0, shift=0.0, sorted=False)
    if source.distribution not in (Distribution.MIXTURE, Distribution.EMPIRICAL):
        return plain
    return replace(plain, distribution=Distribution.NORMAL, batches=(), measured=None)


def _capability(source: Source, columns: Sequence[GaugedColumn], lots: Lots) -> LotCapability:
    """Return the capability of a source and its row in the table of the lot.

    Cp is that of a tolerance table: of a size the σ at Cp 1 over s, which is zone/(6·s) for normal deviations; of a
    radius or total deviation the root mean square at Cp 1 over that of the lot, so that a place that is off for all
    parts widens it too. Cpk is the distance of the mean from the nearer limit over 3·s; its interval by the spread of
    both to first order, σ² = 1/(9n) + Cpk²·Var(s/σ) ± ⅔·Cpk·Cov, for normal readings Bissell's. Where a gauge
    errs the readings spread r times as much as the parts, which gives the terms r², r⁴ and r³, and what repeat readings
    leave open of its variance e² adds Cpk²·(e/s)⁴/(2ν) (own derivation).

    References
    ----------
    Bissell, How reliable is your capability index?, Appl. Stat. 39, 1990, 331–340.
    """
    values = columns[0].taken if len(columns) == 1 else np.hypot(columns[0].taken, columns[1].taken)
    gauge = columns[0].gauge if len(columns) == 1 else Gauge.RADIUS
    plain, half, error = _plain(source), source.zone / 2.0, _error_of(columns)
    unit = lots.process(plain, gauge, values.size, error)
    mean, deviation = _of_parts(values, error, together=len(columns) > 1)
    ratio = float(values.std(ddof=1)) / deviation  # 1 unless the gauge errs
    if gauge is Gauge.DEVIATION:
        cp, ends = unit.deviation / deviation, unit.law.s_ends
        upper, lower = source.middle + half - mean, mean - source.middle + half
    else:
        ends = unit.law.square_ends if isinstance(unit.law, SimulatedLaw) else unit.law.s_ends
        cp = sqrt((unit.mean**2 + unit.deviation**2) / (float((values**2).mean()) - error.deviation**2))
        upper, lower = (half if gauge is Gauge.RADIUS else source.zone) - mean, float("inf")
    cpk = min(upper, lower) / (3.0 * deviation)
    spread, common = unit.law.noise
    sign = 1.0 if upper <= lower else -1.0
    variance = ratio**2 / (9.0 * values.size) + cpk**2 * spread * ratio**4
    variance += sign * 2.0 / 3.0 * cpk * common * ratio**3
    variance += cpk**2 * (error.deviation / deviation) ** 4 / (2.0 * error.freedom)
    off = float(ndtri(0.5 + CONFIDENCE / 2.0)) * sqrt(max(variance, 0.0))
    row, clipped = _row(plain, cp, mean)
    limit = source.zone if gauge is Gauge.RANGE else half
    from_middle = np.abs(values - source.middle) if gauge is Gauge.DEVIATION else values
    return LotCapability(
        source=source,
        row=row,
        parts=values.size,
        cp=cp,
        cp_interval=_cp_interval(unit, values, gauge) if error != EXACT else (cp * ends[0], cp * ends[1]),
        cpk=cpk,
        cpk_interval=(cpk - off, cpk + off),
        outside=int((from_middle > limit * (1.0 + 1e-9)).sum()),
        far=int((from_middle > FAR * limit).sum()),
        clipped=clipped,
    )


def _error_of(columns: Sequence[GaugedColumn]) -> GaugeError:
    """Return how values of a source err: of radii from two coordinates, what their mean square gains."""
    if len(columns) == 1:
        return columns[0].error
    both = [own.error for own in columns]
    return GaugeError(deviation=hypot(*(own.deviation for own in both)), freedom=min(own.freedom for own in both))


def _of_parts(values: Float[np.ndarray, " part"], error: GaugeError, *, together: bool) -> tuple[float, float]:
    """Return mean and standard deviation of the parts behind their readings [m].

    Radii from two coordinates are all too wide by the share of their root mean square, which is exact for Rayleigh's
    distribution; all else errs about its true value.
    """
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    if not together:
        return mean, _taken_off(deviation, error.deviation)
    root = sqrt(float((values**2).mean()))
    share = _taken_off(root, error.deviation) / root
    return mean * share, deviation * share


def _cp_interval(unit: GaugedProcess, values: Float[np.ndarray, " part"], gauge: Gauge) -> tuple[float, float]:
    """Return the interval of Cp without what the gauge adds; infinite where it may be all that was seen [-]."""
    if gauge is Gauge.DEVIATION or isinstance(unit.law, NormalLaw):
        whole, (least, most) = 1.0, unit.law.process_ends(float(values.std(ddof=1)) / unit.deviation)
    else:
        whole = hypot(1.0, unit.law.centre)
        least, most = unit.law.root_ends(sqrt(float((values**2).mean())) / unit.deviation)
    return whole / most if most else inf, whole / least if least else inf


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
    return (replace(row, shift=round(min(max(shift, -_SHIFT), _SHIFT), _WRITTEN)), clipped or abs(shift) > _SHIFT)
