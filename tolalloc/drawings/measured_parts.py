"""Measured parts behind an empirical distribution: their files, what they say of the process, and what they leave open.

Files are tables of deviations or of mean and standard deviation (CSV), and those of measuring rooms (Q-DAS, AQDEF).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import (
    NORMAL,
    RAYLEIGH,
    Distribution,
    Marginal,
    smoothed,
    smoothed_magnitude,
)
from tolalloc.drawings.heads import split_header
from tolalloc.drawings.qdas_file import (
    FILE_NAME,
    NAME,
    NUMBER,
    SHORT,
    VALID,
    Characteristic,
    qdas_number,
    read_characteristics,
)
from tolalloc.drawings.table_file import TextTable, plain_number, read_text_table
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.units import MICROMETRE, usual_signs

FEWEST_PARTS, MOST_PARTS = 20, 1_000_000
LARGEST_DEVIATION = 1e6
"""Largest deviation that is believed, as large as a zone may be [µm]."""

_FACTORS = {"µm": 1.0, "um": 1.0, "mm": 1000.0}
_SUMMARY = ("mean", "sigma", "parts")
"""Columns of a file that has a mean and a standard deviation instead of single parts."""
_LAYOUTS = {Feature.SIZE: (("deviation",), _SUMMARY), Feature.POSITION: (("x", "y"), ("radius",))}
_FAR = 10.0
"""Standard deviations, or halves of a zone, from which on measured parts are doubted [-]."""
_QUARTILES = 1.349
"""Distance of the quartiles of a normal distribution [σ]."""
_FINEST = 1e-3
"""Spread below which no gauge tells parts apart [half zone]; assumption."""
_SAME = 1e-4
"""Difference of nominal sizes or limits up to which they are the same: a tenth of a micrometre [mm]."""


@dataclass(frozen=True, kw_only=True)
class FittedDistribution:
    """A distribution fitted to measured parts by maximum likelihood."""

    # Normal (for radii: normal on each axis), lognormal or Weibull; the latter two start at the lower limit
    distribution: Distribution
    shape: float  # Shape, 0 for a normal distribution [-]
    scale: float  # σ of the normal, median of the lognormal, scale of the Weibull distribution [m]
    aic: float  # Akaike's information criterion, with densities per µm; the smaller the better [-]
    distance: float  # Kolmogorov and Smirnov's largest distance from the measured shares [-]


@dataclass(frozen=True, kw_only=True)
class MeasuredFit:
    """What the measured parts say about the process."""

    # Mean and sample standard deviation of the deviations or radii [m]
    mean: float
    deviation: float
    cpk: float  # Distance of the mean from the nearer limit, for radii from the largest one, over 3σ [-]
    # Fitted distributions, the best by Akaike's criterion first; a distribution that starts at the lower limit is left
    # out where a part is at or below it
    fits: tuple[FittedDistribution, ...]

    @property
    def best(self) -> FittedDistribution:
        """The fitted distribution with the smallest criterion."""
        return self.fits[0]


@dataclass(frozen=True)
class StatedProcess:
    """Mean and standard deviation of measured parts whose single values nobody kept."""

    # Mean of the deviations from the nominal size, and their sample standard deviation [m]
    mean: float
    deviation: float
    parts: int  # Number of measured parts [-]


@dataclass(frozen=True, kw_only=True)
class MeasuredParts:
    """Measured parts and the zone that they were made to.

    Notes
    -----
    At another zone the parts are assumed to deviate in proportion to it. The path stays out of the text of a record, so
    that a digest of the same parts in another folder is the same.

    The process is assumed to be normal, of a position on each axis, with the parts' mean and standard deviation, unless
    the parts refute that with an error of 1 % (Anderson & Darling 1954); then they are smoothed.

    References
    ----------
    T. W. Anderson, D. A. Darling, A test of goodness of fit, J. Am. Stat. Assoc. 49 (1954) 765–769.
    """

    path: Path = field(repr=False)  # Where they were read
    values: tuple[float, ...]  # Deviations from the nominal size, or radii of a position; none where stated [m]
    are_radii: bool  # Whether the values are radii
    # Width and middle of the zone that they were made to [m]
    zone: float
    middle: float
    characteristic: str = ""  # Which one of several of the file they are, as the table names it
    stated: StatedProcess | None = None  # What the file states in place of single parts
    left_out: int = 0  # Values of the file that it marks as not valid [-]

    @property
    def relative(self) -> Float[np.ndarray, " part"]:
        """Deviations from the middle, or radii, over half the zone [-]."""
        return (np.array(self.values) - self.middle) / (self.zone / 2.0)

    @property
    def parts(self) -> int:
        """Number of measured parts [-]."""
        return self.stated.parts if self.stated else len(self.values)

    @cached_property
    def is_normal(self) -> bool:
        """Whether the process is taken for normal, on each axis for a position."""
        return self.stated is not None or not _is_refuted(self.relative, self.are_radii)

    @cached_property
    def cp(self) -> float:
        """How many times the spread fits into the zone; for radii that of a normal deviation on each axis [-].

        Half the zone over 3s, with the sample standard deviation s; of radii over 3.44·√(Σr²/2n).
        """
        if self.stated:
            return self.zone / 2.0 / (NORMAL.reach * self.stated.deviation)
        own = self.relative
        if self.are_radii:
            return 1.0 / (RAYLEIGH.reach * sqrt(float((own**2).mean()) / 2.0))
        return 1.0 / (NORMAL.reach * float(own.std(ddof=1)))

    @cached_property
    def shift(self) -> float:
        """Mean off the middle of the zone; none for radii, which have any direction [half zone]."""
        if self.are_radii:
            return 0.0
        return (self.stated.mean - self.middle) / (self.zone / 2.0) if self.stated else float(self.relative.mean())

    @property
    def smoothed(self) -> Marginal:
        """Distribution of the parts themselves, smoothed [half zone]."""
        own = self.relative
        return smoothed_magnitude(own) if self.are_radii else smoothed(own)

    @property
    def doubt(self) -> str:
        """What is hardly meant of them: parts far outside, or far from all others; nothing where all may be meant."""
        off = abs(self.fit.mean - self.middle) if not self.are_radii else self.fit.mean
        if off > _FAR * self.zone / 2.0:
            return (
                f"its measured parts lie {off / self.zone:,.3g} zones from the middle on average, as if sizes were "
                "read as deviations, or deviations as sizes"
            )
        own = self.relative
        spread = float(np.subtract(*np.quantile(own, [0.75, 0.25]))) / _QUARTILES if own.size else 0.0
        far = np.abs(own - np.median(own)) > _FAR * max(spread, _FINEST) if own.size else own
        if not far.any():
            return ""
        worst = (float(own[far][np.abs(own[far]).argmax()]) * self.zone / 2.0 + self.middle) / MICROMETRE
        return f"{int(far.sum())} of its {self.parts} measured parts lie far from all others, one at {worst:+,.4g} µm"

    @property
    def sentence(self) -> str:
        """What the distribution follows, and what was assumed."""
        fit, shape = self.fit, "smoothed, because they are not normal"
        if self.is_normal:
            shape = "taken for normal on each axis" if self.are_radii else "taken for normal"
        nearest = f", nearest to {fit.best.distribution.value}" if fit.fits else ""
        which = f" ({self.characteristic})" if self.characteristic else ""
        left_out = f", {self.left_out} values that the file marks as not valid left out" if self.left_out else ""
        return (
            f"as {self.parts} measured parts of {self.path.name}{which} (Cp {self.cp:.3g}, Cpk {fit.cpk:.3g}{nearest})"
            f"{left_out}, {shape}, assumed to scale with the zone from the "
            f"{self.zone / MICROMETRE:.3g} µm that they were made to"
        )

    @cached_property
    def fit(self) -> MeasuredFit:
        """What the parts say about the process."""
        from scipy import stats

        half, values, fits = self.zone / 2.0, np.array(self.values), list[FittedDistribution]()
        if self.stated:
            mean, deviation = self.stated.mean, self.stated.deviation
        else:
            mean, deviation = float(values.mean()), float(values.std(ddof=1))
            normal = stats.rayleigh if self.are_radii else stats.norm
            fits.append(_fitted(Distribution.NORMAL, normal, values, self.are_radii))
            above = values if self.are_radii else values - (self.middle - half)
            if above.min() > 0.0:
                fits.append(_fitted(Distribution.LOGNORMAL, stats.lognorm, above, True))
                fits.append(_fitted(Distribution.WEIBULL, stats.weibull_min, above, True))
        return MeasuredFit(
            mean=mean,
            deviation=deviation,
            cpk=(half - (mean if self.are_radii else abs(mean - self.middle))) / (3.0 * deviation),
            fits=tuple(sorted(fits, key=lambda fit: fit.aic)),
        )


def _is_refuted(relative: Float[np.ndarray, " part"], are_radii: bool) -> bool:
    """Return whether parts of a normal process look like these with a probability below 1 %.

    Notes
    -----
    Anderson and Darling's A² of deviations with mean and σ unknown exceeds 1.035/(1 + 0.75/n + 2.25/n²) with 1 %, that
    of squared radii, which are exponential, 1.959/(1 + 0.6/n).

    References
    ----------
    M. A. Stephens in D'Agostino & Stephens, Goodness-of-fit techniques (1986), tables 4.7 and 4.14.
    """
    from scipy import stats

    count = relative.size
    if are_radii:
        squares = np.sort(relative**2)
        logs = stats.expon.logcdf(squares / squares.mean()), stats.expon.logsf(squares / squares.mean())
        largest = 1.959 / (1.0 + 0.6 / count)
    else:
        scores = np.sort((relative - relative.mean()) / relative.std(ddof=1))
        logs = stats.norm.logcdf(scores), stats.norm.logsf(scores)
        largest = 1.035 / (1.0 + 0.75 / count + 2.25 / count**2)
    weights = 2.0 * np.arange(1, count + 1) - 1.0
    return bool(-count - weights @ (logs[0] + logs[1][::-1]) / count > largest)


def _fitted(
    distribution: Distribution, family: Any, values: Float[np.ndarray, " part"], starts_at_zero: bool
) -> FittedDistribution:
    """Return a family of scipy.stats fitted to the values [m], its start held at zero or free."""
    from scipy import stats

    lengths = values / MICROMETRE
    start = {"floc": 0.0} if starts_at_zero else {}
    found: Sequence[float] = family.fit(lengths, **start)
    return FittedDistribution(
        distribution=distribution,
        shape=float(found[0]) if len(found) > 2 else 0.0,
        scale=float(found[-1]) * MICROMETRE,
        aic=2.0 * (len(found) - len(start)) - 2.0 * float(family.logpdf(lengths, *found).sum()),
        distance=float(stats.kstest(lengths, family.cdf, args=found).statistic),
    )


@dataclass(frozen=True, kw_only=True)
class MadeTo:
    """What a row of the table says of the feature that was measured."""

    feature: Feature
    # Width and middle of the zone that the parts were made to, and the nominal size, 0 where the row states none [m]
    zone: float
    middle: float
    nominal: float = 0.0
    is_tilt: bool = False  # Whether half the zone is stated and measured, by which an axis leans in any direction


def named_file(text: str) -> tuple[str, str]:
    """Return the file that a table names, and the characteristic of a Q-DAS file behind a colon."""
    found = FILE_NAME.fullmatch(text)
    return (found[1], (found[2] or "").strip()) if found else (text, "")


def load_measured_parts(path: Path, made_to: MadeTo, characteristic: str = "") -> MeasuredParts:
    """Return the parts of a file.

    A CSV file has a column ``deviation [µm]`` for a size, or one row of ``mean [µm]``, ``sigma [µm]``, ``parts``; of a
    position ``x [µm]`` and ``y [µm]`` or ``radius [µm]``; all from the nominal place. A file of Q-DAS (AQDEF)
    ends in ``.dfq``, or in ``.dfd`` with its values in the ``.dfx`` beside it; one of several characteristics is named
    by its number (K2001) or its name (K2002).

    Raises
    ------
    InputError, UnknownNameError
        The file, row, column or field and value that are not allowed, or there are too few parts.
    """
    if FILE_NAME.fullmatch(path.name):
        return _of_characteristic(path, characteristic, made_to)
    table = read_text_table(path)
    names = tuple(split_header(header)[0] for header in table.headers)
    layouts = _LAYOUTS[made_to.feature]
    if names not in layouts:
        written = {name: name if name == "parts" else f"{name} [µm]" for layout in layouts for name in layout}
        allowed = " or ".join(" and ".join(written[name] for name in layout) for layout in layouts)
        raise InputError.at(path, f"columns for feature {made_to.feature.value}", ", ".join(table.headers), allowed)
    if names == _SUMMARY:
        return _stated(table, made_to)
    columns = [_column(table, at) for at in range(len(names))]
    values = np.hypot(columns[0], columns[1]) if len(columns) == 2 else np.array(columns[0])
    if names == ("radius",) and values.size and values.min() < 0.0:
        row = table.rows[int(values.argmin())]
        raise InputError.at(f"{path}, row {row}", table.headers[0], f"{values.min():g} µm", "0 or more")
    return _measured(path, values, made_to)


def _measured(path: Path, values: Float[np.ndarray, " part"], made_to: MadeTo, **more: Any) -> MeasuredParts:
    """Return parts with these deviations or radii [µm], which must be enough and differ."""
    if values.size < FEWEST_PARTS:
        raise InputError.at(path, "number of measured parts", values.size, f"{FEWEST_PARTS} or more")
    if np.ptp(values) == 0.0:
        raise InputError.at(path, "every measured part", f"{values[0]:g} µm", "parts that differ from each other")
    return _made(path, made_to, tuple((values * MICROMETRE).tolist()), **more)


def _made(path: Path, made_to: MadeTo, values: tuple[float, ...] = (), **more: Any) -> MeasuredParts:
    """Return parts of a feature, with these deviations or radii [m]."""
    are_radii = made_to.feature is Feature.POSITION
    return MeasuredParts(
        path=path, values=values, are_radii=are_radii, zone=made_to.zone, middle=made_to.middle, **more
    )


def _stated(table: TextTable, made_to: MadeTo) -> MeasuredParts:
    """Return parts whose mean and standard deviation alone are known."""
    if len(table.cells) != 1:
        raise InputError.at(table.path, "rows with mean, sigma and parts", len(table.cells), "1 of them")
    (mean,), (deviation,) = _column(table, 0), _column(table, 1)
    where, written = f"{table.path}, row {table.rows[0]}", table.cells[0]
    if not deviation > 0.0:
        raise InputError.at(where, table.headers[1], written[1], "a standard deviation above 0")
    count = int(written[2]) if written[2].isascii() and written[2].isdecimal() and len(written[2]) < 10 else 0
    if not FEWEST_PARTS <= count <= MOST_PARTS:
        allowed = f"the number of parts behind mean and sigma, {FEWEST_PARTS} to {MOST_PARTS}"
        raise InputError.at(where, "parts", written[2], allowed)
    return _made(table.path, made_to, stated=StatedProcess(mean * MICROMETRE, deviation * MICROMETRE, count))


def _column(table: TextTable, at: int) -> list[float]:
    """Return a column [µm]."""
    header = table.headers[at]
    unit = split_header(header)[1]
    if unit not in _FACTORS:
        raise InputError.at(table.path, f"the unit of column {header!r}", unit, "µm, um or mm in square brackets")
    values, faults = [], Faults()
    for row, cells in zip(table.rows, table.cells, strict=True):
        value = _number(cells[at]) * _FACTORS[unit]
        if not (isfinite(value) and abs(value) <= LARGEST_DEVIATION):
            with faults.kept():
                allowed = f"a number from {-LARGEST_DEVIATION:.0f} to {LARGEST_DEVIATION:.0f} µm"
                raise InputError.at(f"{table.path}, row {row}", header, cells[at], allowed)
        values.append(value)
    faults.require_none()
    return values


def _of_characteristic(path: Path, name: str, made_to: MadeTo) -> MeasuredParts:
    """Return the parts of one characteristic of a Q-DAS file, whose unit, nominal size and limits must be the row's."""
    if path.suffix.lower() == ".dfx":
        allowed = f"{path.with_suffix('.dfd').name}, which describes the values in it"
        raise InputError.at(path, "measured", path.name, allowed)
    own = _named(path, name, read_characteristics(path))
    where = f"{path}, characteristic {' '.join(own.names) or '1'}"
    unit = usual_signs(own.fields.get("K2142", ""))
    if unit not in _FACTORS:
        raise InputError.at(where, "the unit (K2142)", unit, "µm, um or mm")
    nominal = _nominal(where, own, _FACTORS[unit], made_to)
    _require_limits(where, own, _FACTORS[unit], nominal, made_to)
    values, faults, valid = list[float](), Faults(), [text for text, attribute in own.values if attribute == VALID]
    for text in valid:
        deviation = qdas_number(text) * _FACTORS[unit] - nominal
        if not abs(deviation) <= LARGEST_DEVIATION:
            with faults.kept():
                allowed = f"a number within {LARGEST_DEVIATION:,.0f} µm of the nominal size"
                raise InputError.at(where, "a value (K0001)", text, allowed)
        values.append(deviation)
    faults.require_none()
    found = np.array(values)
    if made_to.feature is Feature.POSITION:
        if found.size and found.min() < 0.0:
            raise InputError.at(where, "a position (K0001)", f"{found.min():g} µm", "a diameter, 0 or more")
        found = found if made_to.is_tilt else found / 2.0
    return _measured(path, found, made_to, characteristic=name, left_out=len(own.values) - len(valid))


def _named(path: Path, name: str, found: dict[int, Characteristic]) -> Characteristic:
    """Return the characteristic of a number or name; the only one where none is named."""
    if not found:
        raise InputError(f"{path}: it has no measured values; a line of values or fields K0001 are needed.")
    known = [" ".join(own.names) or str(at) for at, own in found.items()]
    if not name:
        if len(found) > 1:
            allowed = f"{path.name}:NAME with the number or name of one of {', '.join(known[:10])}"
            raise InputError.at(path, "measured", path.name, allowed)
        return next(iter(found.values()))
    for key in (NUMBER, NAME, SHORT):
        meant = [own for own in found.values() if own.fields.get(key) == name]
        if len(meant) > 1:
            raise InputError(
                f"{path}: {len(meant)} characteristics are called {name!r}; name one by its number (K2001)."
            )
        if meant:
            return meant[0]
    raise UnknownNameError.among(path, "characteristic", name, [own for each in found.values() for own in each.names])


def _number(text: str) -> float:
    """Return a number with a decimal point, not a number where it is none."""
    try:
        return plain_number(text)
    except ValueError:
        return float("nan")


def _nominal(where: str, own: Characteristic, factor: float, made_to: MadeTo) -> float:
    """Return the nominal size of a characteristic [µm]; a position has none."""
    if made_to.feature is Feature.POSITION:
        return 0.0
    written = own.fields.get("K2101", "")
    nominal = qdas_number(written) * factor
    row = made_to.nominal / MICROMETRE
    if not isfinite(nominal):
        raise InputError.at(where, "the nominal size (K2101)", written, "a number, from which the parts deviate")
    if row and abs(nominal - row) > 1e3 * _SAME:
        allowed = f"the {row / 1e3:g} mm of the row"
        raise InputError.at(where, "the nominal size (K2101)", f"{nominal / 1e3:g} mm", allowed)
    return nominal


def _require_limits(where: str, own: Characteristic, factor: float, nominal: float, made_to: MadeTo) -> None:
    """Raise if the file states other limits than those that the row says the parts were made to."""
    is_size = made_to.feature is Feature.SIZE
    half = made_to.zone / 2.0
    ends = {
        "lower": (("K2112", "K2110"), (made_to.middle - half) / MICROMETRE if is_size else None),
        "upper": (
            ("K2113", "K2111"),
            (made_to.middle + half if is_size or made_to.is_tilt else made_to.zone) / MICROMETRE,
        ),
    }
    for side, ((allowance, limit), expected) in ends.items():
        written = next((key for key in (allowance, limit) if own.fields.get(key)), "")
        if not written or expected is None:
            continue
        found = qdas_number(own.fields[written]) * factor - (nominal if written == limit else 0.0)
        if not isfinite(found):
            raise InputError.at(where, f"the {side} limit ({written})", own.fields[written], "a number")
        if abs(found - expected) > 1e3 * _SAME:
            allowed = f"{expected:+g} µm, as the row has it (measured_zone states another zone that they were made to)"
            raise InputError.at(where, f"the {side} limit ({written})", f"{found:+g} µm from nominal", allowed)
