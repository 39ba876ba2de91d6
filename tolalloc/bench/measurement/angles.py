"""Angles of a curve as the instrument gave them: unit, direction, order, start and stop, whole turns.

Each function returns the mended readings and one sentence that counts what was done, empty for nothing.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.bench.measurement.readings import RawReadings, counted, require_readings
from tolalloc.exceptions import InputError
from tolalloc.reading.units import DEGREE

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
            raise InputError.at(
                readings.path,
                "the part of a turn that its angles cover",
                float(f"{span / TURN:.3g}"),
                f"{SMALLEST_COVER:g} or more, in the unit that the header states",
            )
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
