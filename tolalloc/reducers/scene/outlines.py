"""How large every part is drawn: what the reducer states, and by one rule what it leaves open."""

from __future__ import annotations

from math import pi, sin
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, profile_points
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.rolling_bearing import RollingBearing

_BORE, _JOURNAL = 0.155, 0.103
"""Radii of a disc's bore and of a journal over that of the pin circle, where no bearing is stated; an assumption."""
_HOUSING, _LAND = 1.17, 0.05
"""Outer radius of the ring of pins, and least material between drawn features, both over that of the pin circle."""
_POINTS = 22
"""Points of a tooth [-]."""


def outlines(reducer: Reducer) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return radii and counts [mm, -] with names for the picture, and what of them is an assumption of the drawing."""
    stage, first, dimensions = reducer.cycloid_stage, reducer.first_stage, reducer.friction_dimensions
    circle, crank_circle = stage.pin_circle_radius, reducer.crank_circle_radius
    root = stage.pin_circle_radius - stage.eccentricity - stage.pin_radius
    land = _LAND * circle
    room = min(crank_circle * sin(pi / reducer.crank_count), root - crank_circle, crank_circle) - land
    journal, bore = _rings(dimensions.crank_disc_bearing, room, circle)
    shaft, carrier_bore = _rings(dimensions.crank_carrier_bearing, room, circle)
    lengths = {
        "pin_circle_radius": circle,
        "pin_radius": stage.pin_radius,
        "eccentricity": stage.eccentricity,
        "crank_circle_radius": crank_circle,
        "module": first.module,
        "bore_radius": bore,
        "journal_radius": journal,
        "carrier_bore_radius": carrier_bore,
        "shaft_radius": min(shaft, max(journal - stage.eccentricity, 0.4 * journal)),
        "disc_hole_radius": max(min(crank_circle - bore - land, 0.3 * circle), 0.2 * land),
        "carrier_radius": min(crank_circle + carrier_bore + land, root - stage.eccentricity),
        "housing_radius": _HOUSING * circle + stage.pin_radius,
    }
    counts = {
        "crank_count": reducer.crank_count,
        "disc_count": reducer.disc_count,
        "pin_count": stage.pin_count,
        "disc_teeth": stage.disc_teeth,
        "sun_teeth": first.sun_teeth,
        "planet_teeth": first.planet_teeth,
        "pressure_angle": float(first.pressure_angle),
    }
    stated = {"housing": False, "bearings of the cranks": dimensions.crank_disc_bearing is not None}
    open_names = [name for name, known in stated.items() if not known]
    assumed = f"drawn by a rule, as the reducer file does not state them: outlines of {', '.join(open_names)}, carrier"
    return {name: float(length / MILLIMETRE) for name, length in lengths.items()} | counts, (assumed,)


def _rings(bearing: RollingBearing | None, room: float, circle: float) -> tuple[float, float]:
    """Return the radii of the inner and the outer raceway, at most as large as there is room [m]."""
    inner, outer = _JOURNAL * circle, _BORE * circle
    if bearing is not None:
        inner, outer = ((bearing.pitch_diameter + sign * bearing.diameter) / 2 for sign in (-1.0, 1.0))
    shrunk = min(1.0, room / outer)
    return inner * shrunk, outer * shrunk


def tooth(reducer: Reducer) -> dict[str, list[Any]]:
    """Return one tooth space of a disc, counter-clockwise from tip to tip about its root at angle 0.

    ``exact`` and ``modified`` are points of the profile without and with the tooth modification [mm], ``normal`` the
    unit vector into the disc [-]; the last point is left out, as it is the next space's first.
    """
    stage = reducer.cycloid_stage
    exact, modified = ToothProfile(stage=stage), ToothProfile(stage=stage, modification=reducer.modification)
    # Points stand dense where the tooth bends most; those of a space begin at the tip before it.
    flank = -profile_points(exact, _POINTS).angle[: _POINTS // 2 + 1][::-1]

    def around(flank_values: Float[np.ndarray, "point 2"]) -> list[Any]:
        # The flank turns clockwise from the root; the other one is its mirror image.
        return list(np.concatenate([flank_values[::-1], flank_values[1:] * (1.0, -1.0)])[:-1].tolist())

    return {
        "exact": around(exact.points(flank) / MILLIMETRE),
        "modified": around(modified.points(flank) / MILLIMETRE),
        "normal": around(exact.normals(flank)),
    }
