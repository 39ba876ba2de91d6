"""Readings of a test bench: columns of a file, cleaned of what no reducer does, every repair counted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi, sqrt
from pathlib import Path
from sys import float_info

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.linalg import solveh_banded

from tolalloc.drawings.heads import split_header
from tolalloc.drawings.table_file import TextTable, believed_number, read_text_table
from tolalloc.exceptions import Faults, InputError
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE, MICRORADIAN

MISSING = ("", "nan", "na", "n/a", "-", "inf", "+inf", "-inf")
"""What instruments write where they have no number."""


FEWEST = 3
"""Fewest readings of a curve and levels of a loop; the mean takes one away [-]."""


_SMALL_ANGLES = {
    "arcsec": ARCSECOND,
    "arcmin": ARCMINUTE,
    "deg": DEGREE,
    "rad": 1.0,
    "µrad": MICRORADIAN,
    "urad": MICRORADIAN,
}
ANGLE, TORQUE = "angle", "torque"
TRANSMISSION_ERROR, TWIST, PEAK_TO_PEAK = "transmission error", "twist", "peak_to_peak"
UNITS = {
    ANGLE: {"deg": DEGREE, "rad": 1.0, "arcmin": ARCMINUTE},
    TORQUE: {"N·m": 1.0, "Nm": 1.0},
    **dict.fromkeys((TRANSMISSION_ERROR, TWIST, PEAK_TO_PEAK), _SMALL_ANGLES),
}
"""Column that a file may hold, by its header without unit → unit as written → factor to SI [-]."""

READINGS = 936
"""Angles of a resampled curve; order 80 has 12 of them per period, and the spline errs by 1e-4 of its amplitude [-]."""

FULL = 2 * READINGS
"""Most readings that keep their own angles [-].

With less than two readings between knots the spline all but interpolates, and where readings fall between knots it
amplifies their noise.
"""

WRAPPED = 24
"""Knot spacings that a whole turn is continued beyond its ends; a reading's influence falls to 0.4 per spacing [-]."""

TURN = 2.0 * pi

BACKWARD_SHARE = 0.01
"""Largest share of steps against the direction of rotation, each no longer than the median step [-]."""

SMALLEST_COVER = 0.1
"""Smallest part of a turn: of the slowest order, one per turn, less shows next to nothing [turn]."""

# A turn is 6.28 rad, so below 7 "degrees" stands at most one turn and its run-out in radians; in degrees it would be
# a fiftieth of a turn, which is refused anyway, so that the check costs nothing and only finds the better sentence.
# Few readings are more likely a short piece.
RADIANS_SPAN, RADIANS_READINGS = 7.0, 50

# More than 50 "radians" would be eight turns of the carrier, longer than a bench turns; in degrees it is the shortest
# piece that is of use. From 36 to 50 both can be true, and the header is believed.
DEGREES_SPAN = 50.0

MISSING_SHARE = 0.05
"""Largest share of readings without a number; an instrument that loses more is not trusted with the rest [-]."""

SAME_ANGLE = 1e-9
"""Angles this close are one angle: rounding of several turns to one, far below any encoder [rad]."""

LARGEST_RANGE = DEGREE
"""Largest range of errors and twists that is believed: reducers stay far below it, wrong units do not [rad]."""

SAME_TORQUE = 1e-9
"""Torques this close, over the largest, are one torque [-]."""


@dataclass(frozen=True, kw_only=True)
class RawReadings:
    """Readings in the order of the file; not a number where the instrument gave none."""

    path: Path  # Where they were read
    header: str  # Header of the column that they are taken along, as in the file
    factor: float  # SI units per unit of that column [-]
    row: Int[np.ndarray, " reading"]  # Line of each reading as counted in the file [-]
    along: Float[np.ndarray, " reading"]  # Angle or torque at which each was taken [rad or N·m]
    values: Float[np.ndarray, " reading"]  # What the instrument showed [rad]
    averaged: Float[np.ndarray, " reading"]  # Readings that each value is the mean of [-]

    def chosen(self, which: np.ndarray) -> RawReadings:
        """Return the readings that a mask or a list of positions names, in its order."""
        own = {name: getattr(self, name)[which] for name in ("row", "along", "values", "averaged")}
        return replace(self, **own)


def read_column(table: TextTable, name: str) -> tuple[str, float, Float[np.ndarray, " row"]]:
    """Return header, factor to SI, and values in SI units of one column; not a number where a cell holds none.

    Raises
    ------
    InputError
        The column is missing or there twice, its unit is missing or unknown, or a cell holds text.
    """
    wanted = name.replace("_", " ")
    headers = [own for own in table.headers if split_header(own)[0].lower().replace("_", " ") == wanted]
    known = UNITS[name]
    units = " or ".join(known)
    if not headers:
        raise InputError(
            f"{table.path}: the column {name!r} with its unit in square brackets ({units}) is missing; the "
            f"columns are {', '.join(map(repr, table.headers))}."
        )
    if len(headers) > 1:
        raise InputError(f"{table.path}: the column {name!r} stands there {len(headers)} times; allowed is once.")
    return (headers[0], *column_readings(table, headers[0], known))


def column_readings(
    table: TextTable, header: str, known: Mapping[str, float]
) -> tuple[float, Float[np.ndarray, " row"]]:
    """Return factor to SI, and values in SI units of the column below a header; not a number where a cell holds none.

    Known are units as they may be written, with their factors to SI.

    Raises
    ------
    InputError
        Its unit is missing or unknown, or a cell holds text.
    """
    unit, units = split_header(header)[1], " or ".join(known)
    if unit not in known:
        raise InputError.at(table.path, f"the unit of column {header!r}", unit, f"{units} in square brackets")
    position, factor = table.headers.index(header), known[unit]
    values, faults = np.full(len(table.rows), np.nan), Faults()
    allowed = "a number with a decimal point, or nothing where the instrument gave none"
    for number, (row, cells) in enumerate(zip(table.rows, table.cells, strict=True)):
        if cells[position].lower() not in MISSING:
            with faults.kept():
                place = f"{table.path}, row {row}"
                values[number] = factor * believed_number(place, header, cells[position], float_info.max, allowed)
    faults.require_none()
    return factor, values


def load_readings(path: Path, along: str, values: str) -> RawReadings:
    """Return the two columns of a file in SI units; columns of other names are not read.

    Taken along `ANGLE` or `TORQUE` are `TRANSMISSION_ERROR` or `TWIST`; lines that start with # are comments.

    Raises
    ------
    InputError
        The file, row, column and value that are not allowed; also a column whose values are all equal.
    """
    table = read_text_table(path)
    header, factor, places = read_column(table, along)
    value_header, value_factor, shown = read_column(table, values)
    for name, column, unit in ((header, places, factor), (value_header, shown, value_factor)):
        require_moving(path, name, column[np.isfinite(column)] / unit)
    return RawReadings(
        path=path,
        header=header,
        factor=factor,
        row=np.array(table.rows),
        along=places,
        values=shown,
        averaged=np.ones(len(table.rows)),
    )


def require_moving(path: Path, header: str, values: Float[np.ndarray, " reading"]) -> None:
    """Raise if all readings of a column, in its own unit, are equal."""
    if values.size > 1 and np.ptp(values) == 0:
        raise InputError(
            f"{path}: all {values.size} values of column {header!r} are {values[0]:.6g}; an instrument that does not "
            "move is no measurement."
        )


def require_torque(file: Path, torque: float) -> None:
    """Raise if a column of the file says that another torque was on the carrier; 5 % are believed to be the brake's."""
    table = read_text_table(file)
    if not any(split_header(header)[0].lower() == TORQUE for header in table.headers):
        return
    header, _, values = read_column(table, TORQUE)
    taken = values[np.isfinite(values)]
    if taken.size and abs(taken.mean() - torque) > 0.05 * abs(torque):
        allowed = f"{torque:g} within 5%, the torque of the prediction"
        raise InputError.at(file, f"the mean of {header!r}", float(f"{taken.mean():.4g}"), allowed)


def counted(number: int, what: str) -> str:
    """Return a number and a noun in singular or plural."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def require_readings(readings: RawReadings, what: str) -> None:
    """Raise unless enough readings are left for a shape."""
    if readings.along.size < FEWEST:
        raise InputError.at(readings.path, f"the number of {what}s", readings.along.size, f"{FEWEST} or more")


@dataclass(frozen=True, kw_only=True)
class Cleaned:
    """Clean readings."""

    # Angles or torques, ascending; resampled angles equally spaced but for gaps of the readings [rad or N·m]
    along: Float[np.ndarray, " reading"]
    values: Float[np.ndarray, " reading"]  # Readings without their mean, or the spline at resampled angles [rad]
    # Standard deviation of one of these over that of a reading of the instrument, root mean square; resampled, its
    # square is near angles over readings [-]
    noise_factor: float
    repairs: tuple[str, ...] = ()  # What was mended, a sentence each


def resampled(
    angle: Float[np.ndarray, " reading"], values: Float[np.ndarray, " reading"], *, whole_turn: bool
) -> Cleaned:
    """Return a dense curve at `READINGS` angles, the knots of the spline.

    There are about as many values as the spline has coefficients, so that the curve weighs as much afterwards as its
    readings did. Angles in gaps are left out: where no reading stands before the next angle, and where the value would
    be less certain than a reading.

    Angles ascend strictly, angles and values are in rad; over a whole turn the curve closes after 2π.
    """
    length = 2.0 * pi if whole_turn else float(angle[-1] - angle[0])
    spacing, wrap = length / READINGS, WRAPPED if whole_turn else 0
    grid = angle[0] + spacing * np.arange(-wrap, READINGS + wrap + 1)
    if wrap:
        before, after = angle > angle[0] + length - wrap * spacing, angle < angle[0] + wrap * spacing
        values = np.concatenate([values[before], values, values[after]])
        angle = np.concatenate([angle[before] - length, angle, angle[after] + length])
    gaps = np.flatnonzero(np.diff(angle) > 2.0 * spacing) + 1
    pieces = [
        _piece(own, shown, grid, grid[wrap : wrap + READINGS])
        for own, shown in zip(np.split(angle, gaps), np.split(values, gaps), strict=True)
    ]
    angles, smooth, variance = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    sure = variance <= 1.0
    return Cleaned(along=angles[sure], values=smooth[sure], noise_factor=float(np.sqrt(variance[sure].mean())))


def _piece(
    angle: Float[np.ndarray, " reading"],
    values: Float[np.ndarray, " reading"],
    grid: Float[np.ndarray, " knot"],
    wanted: Float[np.ndarray, " angle"],
) -> tuple[Float[np.ndarray, " value"], Float[np.ndarray, " value"], Float[np.ndarray, " value"]]:
    """Return angles, values and variances between two gaps; one cubic across a gap would bend both sides."""
    nothing = np.empty(0)
    # A knot only where a reading stands before the next one: then every coefficient has its reading.
    starts = grid[np.unique(np.searchsorted(grid[1:], angle, side="right"))]
    inner = starts[(starts > angle[0]) & (starts < angle[-1])]
    knots = np.concatenate([np.repeat(angle[0], 4), inner, np.repeat(angle[-1], 4)])
    angles = np.intersect1d(starts[(starts >= angle[0]) & (starts < angle[-1])], wanted)
    if angle.size < inner.size + 4 or angles.size == 0:
        return nothing, nothing, nothing
    try:
        spline = make_lsq_spline(angle, values, knots, k=3)
        return angles, np.asarray(spline(angles)), _variance(angle, knots, angles)
    except np.linalg.LinAlgError:  # few readings, and where one basis function is all but 0
        return nothing, nothing, nothing


def _variance(
    angle: Float[np.ndarray, " reading"], knots: Float[np.ndarray, " knot"], angles: Float[np.ndarray, " angle"]
) -> Float[np.ndarray, " angle"]:
    """Return the variance of the spline over that of a reading: the diagonal of A·(BᵀB)⁻¹·Aᵀ.

    B holds the basis functions at the readings, A at the angles. Wrapped readings are copies, but no value feels both a
    reading and its copy.
    """
    basis = BSpline.design_matrix(angle, knots, 3)
    wanted = BSpline.design_matrix(angles, knots, 3).toarray()
    gram = (basis.T @ basis).tocsr()
    size = gram.shape[0]
    bands = np.zeros((4, size))
    for offset in range(4):
        bands[3 - offset, offset:] = gram.diagonal(offset)
    return np.asarray(np.einsum("ij,ji->i", wanted, solveh_banded(bands, wanted.T)))


def in_stated_unit(readings: RawReadings) -> tuple[RawReadings, str]:
    """Refuse angles that look as if the header named the wrong unit; nothing is repaired."""
    require_readings(readings, "reading")
    span = float(np.ptp(readings.along)) / readings.factor
    if readings.factor == DEGREE and span < RADIANS_SPAN and readings.along.size > RADIANS_READINGS:
        wrong, right = "deg", "radians"
    elif readings.factor == 1.0 and span > DEGREES_SPAN:
        wrong, right = "rad", "degrees"
    else:
        return readings, ""
    raise InputError(
        f"{readings.path}: the {readings.along.size} angles under {readings.header!r} span {span:.4g} {wrong}, which "
        f"looks like {right}; state the unit they were written in."
    )


def _median_step(readings: RawReadings) -> float:
    """Return the median length of the steps that are not 0 [rad]."""
    steps = np.abs(np.diff(readings.along))
    return float(np.median(steps[steps > 0.0])) if steps.any() else 0.0


def _direction(readings: RawReadings) -> float:
    """Return 1 where most steps go up, −1 where most go down."""
    return -1.0 if np.sign(np.diff(readings.along)).sum() < 0 else 1.0


def carried_on(readings: RawReadings) -> tuple[RawReadings, str]:
    """Count angles on that an encoder starts anew after each turn."""
    direction, median = _direction(readings), _median_step(readings)
    passes = np.abs(direction * np.diff(readings.along) + TURN) <= 5.0 * median  # a few readings may be lost there
    if not passes.any() or median > TURN / 20.0:  # with steps that long nothing can be told
        return readings, ""
    turns = np.concatenate([[0.0], np.cumsum(passes)])
    times = "once" if passes.sum() == 1 else f"{passes.sum()} times"
    along = readings.along + direction * TURN * turns
    return replace(readings, along=along), f"angles that start anew {times} counted on"


def upwards(readings: RawReadings) -> tuple[RawReadings, str]:
    """Turn round angles that run downwards."""
    if _direction(readings) < 0:
        return readings.chosen(np.arange(readings.along.size)[::-1]), "angles run downwards: turned round"
    return readings, ""


def without_ends(readings: RawReadings, start_stop: float) -> tuple[RawReadings, str]:
    """Leave out what stands within an angle [rad] from either end."""
    low, high = float(readings.along.min()) + start_stop, float(readings.along.max()) - start_stop
    inside = (readings.along >= low) & (readings.along <= high)
    out = int((~inside).sum())
    require_readings(readings.chosen(inside), "reading")
    return readings.chosen(inside), f"{counted(out, 'reading')} of start and stop left out" if out else ""


def in_order(readings: RawReadings) -> tuple[RawReadings, str]:
    """Sort angles of which a few step back a little; refuse those that turn back."""
    steps, median = np.diff(readings.along), _median_step(readings)
    back = steps < 0
    count = int(back.sum())
    if count == 0:
        return readings, ""
    if count > BACKWARD_SHARE * steps.size or steps.min() < -1.01 * median:
        # Readings that were turned round stand in the reverse order of the file.
        pairs = np.flatnonzero(back)
        rows = np.maximum(readings.row[pairs], readings.row[pairs + 1])
        row = int(rows.min())
        raise InputError.at(
            f"{readings.path}, row {row}",
            readings.header,
            float(f"{readings.along[readings.row == row][0] / readings.factor:.9g}"),
            f"one direction of rotation, in which {count} of {steps.size} steps go back; up to {BACKWARD_SHARE:.0%} "
            "are sorted where none is longer than the median step; give each direction a file of its own",
        )
    order = np.argsort(readings.along, kind="stable")
    return readings.chosen(order), f"{counted(count, 'reading')} out of order sorted"


def turns_covered(angle: Float[np.ndarray, " reading"]) -> int:
    """Return how many whole turns ascending angles cover; the gap at the end may be half a step too wide."""
    return int((angle[-1] - angle[0] + 1.5 * float(np.median(np.diff(angle)))) // TURN)


def whole_turns(readings: RawReadings) -> tuple[RawReadings, str]:
    """Keep whole turns from the middle, folded onto one; a piece of a turn is kept as it is and noted."""
    require_readings(readings, "reading")
    angle = readings.along
    span, turns = float(angle[-1] - angle[0]), turns_covered(angle)
    if turns == 0:
        if span < SMALLEST_COVER * TURN:
            covered, allowed = (
                float(f"{span / TURN:.3g}"),
                f"{SMALLEST_COVER:g} or more, in the unit that the header states",
            )
            raise InputError.at(readings.path, "the part of a turn that its angles cover", covered, allowed)
        return readings, f"covers {span / TURN:.3g} of a turn"
    # The first reading kept is the nearest to where the turns begin, the last ends half a step before it comes again,
    # so that a closing reading at 360° is not there twice and the seam has the width of a step.
    first = int(np.argmin(np.abs(angle - ((angle[0] + angle[-1]) / 2.0 - turns * pi))))
    end = angle[first] + turns * TURN - 0.5 * float(np.median(np.diff(angle)))
    inside = np.flatnonzero((angle >= angle[first]) & (angle < end))
    out = angle.size - inside.size
    sentences = [f"{counted(out, 'reading')} beyond {counted(turns, 'whole turn')} left out"] if out else []
    kept = readings.chosen(inside)
    if turns > 1:
        kept = replace(kept, along=np.mod(kept.along, TURN))
        kept = kept.chosen(np.argsort(kept.along, kind="stable"))
        sentences.append(f"{kept.along.size} readings of {turns} turns folded onto one")
    return kept, "; ".join(sentences)


Step = Callable[[RawReadings], tuple[RawReadings, str]]
"""One kind of repair: the mended readings, and what was done, empty for nothing."""


def clean_curve(readings: RawReadings, offset: float = 0.0, start_stop: float = 0.0) -> Cleaned:
    """Return a transmission error curve with ascending angles: whole turns folded onto one, or a piece of a turn.

    An offset [rad] is added to every angle, an angle of start and stop [rad] left out at each end.

    Raises
    ------
    InputError
        Readings that cannot be mended without a guess.
    """
    readings, repairs = _in_turn(
        readings,
        (
            without_missing,
            in_stated_unit,
            carried_on,
            upwards,
            lambda one: without_ends(one, start_stop),
            in_order,
            lambda one: without_repeats(one, SAME_ANGLE),
        ),
    )
    require_readings(readings, "reading")
    closes = turns_covered(readings.along) > 0
    # Turns may fall on one another when they are folded.
    readings, more = _in_turn(readings, (whole_turns, lambda one: without_repeats(one, SAME_ANGLE)))
    repairs += more
    angle, values = readings.along + offset, readings.values
    factor = sqrt(float(np.mean(1.0 / readings.averaged)))
    if angle.size > FULL:
        dense = resampled(angle, values, whole_turn=closes)
        angle, values, factor = dense.along, dense.values, factor * dense.noise_factor
        repairs += (f"{readings.along.size} readings resampled to {angle.size} by a least-squares cubic spline",)
        if angle.size < READINGS:
            repairs += (f"{counted(READINGS - angle.size, 'angle')} of {READINGS} in gaps of the readings left out",)
    return Cleaned(along=angle, values=_without_mean(readings, values), noise_factor=factor, repairs=repairs)


def clean_loop(readings: RawReadings) -> Cleaned:
    """Return a torque–twist loop with ascending torques, both branches averaged where they share a torque.

    Raises
    ------
    InputError
        Readings that cannot be mended without a guess.
    """
    readings, repairs = _in_turn(
        readings,
        (
            without_missing,
            without_zero_torque,
            lambda one: (one.chosen(np.argsort(one.along, kind="stable")), ""),  # a loop goes up and down by nature
            lambda one: without_repeats(one, SAME_TORQUE * np.abs(one.along).max(initial=0.0)),
        ),
    )
    require_readings(readings, "torque")
    return Cleaned(
        along=readings.along,
        values=_without_mean(readings, readings.values),
        noise_factor=sqrt(float(np.mean(1.0 / readings.averaged))),
        repairs=repairs,
    )


def _in_turn(readings: RawReadings, steps: tuple[Step, ...]) -> tuple[RawReadings, tuple[str, ...]]:
    repairs = []
    for step in steps:
        readings, repair = step(readings)
        repairs.append(repair)
    return readings, tuple(repair for repair in repairs if repair)


def _without_mean(readings: RawReadings, values: Float[np.ndarray, " reading"]) -> Float[np.ndarray, " reading"]:
    """Return the values less their mean, or refuse a range that no reducer has."""
    if np.ptp(values) > LARGEST_RANGE:
        span, allowed = (
            np.ptp(values) / DEGREE,
            f"up to {LARGEST_RANGE / DEGREE:g} deg, in the unit that the header states",
        )
        raise InputError.at(readings.path, "the range of its values", f"{span:.3g} deg", allowed)
    return np.asarray(values - values.mean())


def without_missing(readings: RawReadings) -> tuple[RawReadings, str]:
    """Leave out readings without a number."""
    there = np.isfinite(readings.along) & np.isfinite(readings.values)
    missing = int((~there).sum())
    if missing > MISSING_SHARE * there.size:
        raise InputError(
            f"{readings.path}: {missing} of {there.size} readings have no number, the first in row "
            f"{readings.row[~there][0]}; allowed is up to {MISSING_SHARE:.0%}."
        )
    return readings.chosen(there), f"{counted(missing, 'reading')} without a number left out" if missing else ""


def without_repeats(readings: RawReadings, tolerance: float) -> tuple[RawReadings, str]:
    """Average readings at one angle or torque, which must be ascending; the tolerance has its unit."""
    new = np.concatenate([[True], np.diff(readings.along) > tolerance])
    repeats = int((~new).sum())
    if repeats == 0:
        return readings, ""
    group = np.cumsum(new) - 1
    averaged = np.bincount(group, readings.averaged)
    values = np.bincount(group, readings.values * readings.averaged) / averaged
    what = "torque" if "torque" in readings.header.lower() else "angle"
    return (
        replace(readings.chosen(new), values=values, averaged=averaged),
        f"{counted(repeats, 'reading')} with a repeated {what} averaged",
    )


def without_zero_torque(readings: RawReadings) -> tuple[RawReadings, str]:
    """Leave out readings at a torque of exactly 0, where no pin carries and any twist inside the play is true."""
    loaded = readings.along != 0.0
    out = int((~loaded).sum())
    return readings.chosen(loaded), f"{counted(out, 'reading')} at a torque of 0 left out" if out else ""
