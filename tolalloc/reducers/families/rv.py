"""The RV reducer: sun and planets, then cranks, discs and pins."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sin
from typing import Any

from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.equivalent.interfaces import (
    CARRIER_SUPPORT,
    CRANK_CARRIER,
    CRANK_DISC,
    GEAR_MESH,
    PIN_SOURCES,
    SUN_SUPPORT,
)
from tolalloc.reducers.families.family import HOUSING_PLACES, NewRows, Place, ReducerFamily
from tolalloc.reducers.reducer.bearings import RollingBearing
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.records import ReducerRecord


def _places(reducer: Reducer) -> Iterator[Place]:
    cranks, discs = range(1, reducer.crank_count + 1), range(1, reducer.disc_count + 1)
    yield from HOUSING_PLACES
    for disc in discs:
        yield Place(id=f"disc{disc}", label=f"disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.teeth", label=f"teeth of disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.bores", label=f"pattern of the bores of disc {disc}", part=f"disc{disc}")
        for crank in cranks:
            yield Place(id=f"disc{disc}.bore{crank}", label=f"bore {crank} of disc {disc}", part=f"disc{disc}")
    for crank in cranks:
        yield Place(id=f"crank{crank}", label=f"crankshaft {crank}", part=f"crank{crank}")
        for disc in discs:
            label = f"journal {disc} of crankshaft {crank}"
            yield Place(id=f"crank{crank}.journal{disc}", label=label, part=f"crank{crank}")
    yield Place(id="carrier", label="carrier", part="carrier")
    for crank in cranks:
        yield Place(id=f"carrier.bore{crank}", label=f"bore {crank} of the carrier", part="carrier")
    yield Place(id="sun", label="sun gear", part="sun")
    yield Place(id="sun.teeth", label="teeth of the sun gear", part="sun")
    for crank in cranks:
        yield Place(id=f"planet{crank}", label=f"planet gear {crank}", part=f"planet{crank}")
        yield Place(id=f"planet{crank}.teeth", label=f"teeth of planet gear {crank}", part=f"planet{crank}")
        yield Place(id=f"mesh{crank}", label=f"mesh of sun and planet {crank}", part=f"planet{crank}")


def _axes(reducer: Reducer) -> dict[str, str]:
    cranks, discs = range(1, reducer.crank_count + 1), range(1, reducer.disc_count + 1)
    found = {"sun": "sun.eccentricity"}
    found |= {f"planet{crank}": f"planet{crank}.eccentricity" for crank in cranks}
    found |= {f"carrier.bore{crank}": f"carrier.bore{crank}.position" for crank in cranks}
    for disc in discs:
        found |= {f"disc{disc}.bore{crank}": f"disc{disc}.bore{crank}.position" for crank in cranks}
        found |= {f"crank{crank}.journal{disc}": f"crank{crank}.journal{disc}.eccentricity" for crank in cranks}
    return found


_BORE, _JOURNAL = 0.155, 0.103
"""Radii of a disc's bore and of a journal over that of the pin circle, where no bearing is stated; an assumption."""
_HOUSING, _LAND = 1.17, 0.05
"""Outer radius of the ring of pins, and least material between drawn features, both over that of the pin circle."""


def _outlines(reducer: Reducer) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return radii and counts [mm, -] with names for the picture, and what of them is an assumption of the drawing."""
    stage, first, dimensions = reducer.cycloid_stage, reducer.gears, reducer.friction_dimensions
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
    assumed = f"outlines of {', '.join(open_names)} and carrier are schematic: the reducer file gives none"
    return {name: float(length / MILLIMETRE) for name, length in lengths.items()} | counts, (assumed,)


def _rings(bearing: RollingBearing | None, room: float, circle: float) -> tuple[float, float]:
    """Return the radii of the inner and the outer raceway, at most as large as there is room [m]."""
    inner, outer = _JOURNAL * circle, _BORE * circle
    if bearing is not None:
        inner, outer = ((bearing.pitch_diameter + sign * bearing.diameter) / 2 for sign in (-1.0, 1.0))
    shrunk = min(1.0, room / outer)
    return inner * shrunk, outer * shrunk


RV = ReducerFamily(
    name="RV",
    interfaces=(SUN_SUPPORT, GEAR_MESH, CRANK_DISC, CRANK_CARRIER, CARRIER_SUPPORT),
    contact_sources=PIN_SOURCES,
    record=ReducerRecord,
    limited=(CRANK_DISC,),
    rate=500.0,
    places=_places,
    identified=("crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing"),  # as liu2020
    axes=_axes,
    outlines=_outlines,
    new=NewRows(
        presets=("rv20e", "rv40e", "rv80e", "rv110e", "rv160e"),
        cranks=(2, 3, 4),
        discs=(1, 2, 3),
        table="rv20e_drawing",
        diameter=104.0,
        lost_motion=1.0,
        priced=("disc?.bore?.position", "crank?.journal?.eccentricity", "pin.diameter"),
        schema="reducer",
        title="Reducer",
        stiffer="crank_disc_bearing",
    ),
)
"""Two stages: sun and planets, then cranks, discs and pins; a further spring group is its function, record and name."""
