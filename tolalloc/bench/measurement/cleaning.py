"""From readings as the instrument gave them to clean curves and loops; every repair is counted in a sentence.

What cannot be mended without a guess is refused in one sentence that names the file and the row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np
from jaxtyping import Float

from tolalloc.bench.measurement.angles import (
    carried_on,
    in_order,
    in_stated_unit,
    turns_covered,
    upwards,
    whole_turns,
    without_ends,
)
from tolalloc.bench.measurement.readings import RawReadings, counted, require_readings
from tolalloc.bench.measurement.resampling import FULL, READINGS, Cleaned, resampled
from tolalloc.exceptions import InputError
from tolalloc.reading.units import DEGREE

MISSING_SHARE = 0.05
"""Largest share of readings without a number; an instrument that loses more is not trusted with the rest [-]."""

SAME_ANGLE = 1e-9
"""Angles this close are one angle: rounding of several turns to one, far below any encoder [rad]."""

LARGEST_RANGE = DEGREE
"""Largest range of errors and twists that is believed: reducers stay far below it, wrong units do not [rad]."""

SAME_TORQUE = 1e-9
"""Torques this close, over the largest, are one torque [-]."""


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
        raise InputError.at(
            readings.path,
            "the range of its values",
            f"{np.ptp(values) / DEGREE:.3g} deg",
            f"up to {LARGEST_RANGE / DEGREE:g} deg, in the unit that the header states",
        )
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
