"""The RV reducer with centre gear and hollow shaft: the motor's pinion drives a gear whose second toothing is the sun.

The centre gear turns in the support of the sun. Its rotation, which is given without one, is a coordinate more, and the
mesh of the pinion a spring group more; all behind the sun is the RV reducer as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.equivalent.interfaces import Interface, clearance_source, eccentricity_source
from tolalloc.reducers.equivalent.springs import AtAngles, Positions, SpringGroup, SpringRows, turned, vector_columns
from tolalloc.reducers.families.centre_gear.design import CentreGearRecord, CentreGearReducer
from tolalloc.reducers.families.family import Place, ReducerFamily, first_tooth
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.reducer.design import Reducer


def centre_mesh(at: Positions) -> SpringGroup:
    """Return the spring of input pinion and centre gear along its line of action, theory page equation (101).

    The pinion stands at the right of the centre gear and turns against it. ``pinion.eccentricity`` turns with the
    pinion, ``centre.eccentricity``, of the outer toothing against the bearing, with the centre gear [m].

    δ = n·(ε_pinion − x_sun − ε_centre) − r_b4·θs, n at π/2 + α in the housing [m]; involute spur gears in mesh. Of an
    eccentricity it makes the waves of theory page equation (102), exactly. What moves the pinion's axis in the housing
    turns the output by a constant angle, so it is no source.

    Own derivation, as liu2020's of sun and planets.
    """
    gear, sun = CentreGearReducer.of(at.reducer).centre_gear, at.coordinates.input
    line_of_action = np.pi / 2 + gear.pressure_angle
    normal, rows = np.array([np.cos(line_of_action), np.sin(line_of_action)]), SpringRows(at, 1)
    rows.displacement[:, 0, sun : sun + 3] = [*-normal, -gear.base_radius]
    rows.add(0, vector_columns("pinion.eccentricity"), normal @ turned(at.pinion_angle))
    rows.add(0, vector_columns("centre.eccentricity"), -normal @ turned(at.sun_angle))
    return rows.group("centre gear mesh", "centre_mesh", ("centre.mesh",))


CENTRE_MESH = Interface(
    rows=centre_mesh,
    stiffness="centre_mesh",
    called="centre gear mesh",
    is_mesh=True,
    sources=(
        eccentricity_source("pinion"),
        eccentricity_source("centre", with_part=("sun", "outer.eccentricity")),
        clearance_source("centre.mesh", first_stage=True),
    ),
)


def _places(reducer: Reducer) -> Iterator[Place]:
    yield from RV.places(reducer)
    yield Place(id="centre", label="outer toothing of the centre gear", part="centre")
    yield Place(id="centre.mesh", label="mesh of input pinion and centre gear", part="centre")
    yield Place(id="pinion", label="input pinion", part="pinion")


def _axes(reducer: Reducer) -> dict[str, str]:
    return RV.axes(reducer) | {"centre": "centre.eccentricity", "pinion": "pinion.eccentricity"}


def _outlines(reducer: Reducer) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return what the picture of an RV reducer needs, and pinion and centre gear with its hollow shaft [mm, -]."""
    outline, assumed = RV.outlines(reducer)
    gear = CentreGearReducer.of(reducer).centre_gear
    outline |= {
        "centre_teeth": gear.teeth,
        "pinion_teeth": gear.pinion_teeth,
        "centre_module": float(gear.module / MILLIMETRE),
        "centre_pressure_angle": float(gear.pressure_angle),
        # The tube through the sun leaves a web of twice its module below the roots of the teeth.
        "hollow_radius": outline["module"] * (outline["sun_teeth"] / 2 - 3.25),
        "disc_hole_radius": max(outline["disc_hole_radius"], outline["module"] * outline["sun_teeth"] / 2),
    }
    return outline, (f"{assumed[0]}, hollow shaft", *assumed[1:])


def _turning(reducer: Reducer) -> dict[str, tuple[Callable[[Positions], AtAngles], float]]:
    gear = CentreGearReducer.of(reducer).centre_gear
    return {
        "centre": (lambda at: at.sun_angle, 0.0),
        "pinion": (lambda at: at.pinion_angle, first_tooth(gear.teeth, gear.pinion_teeth, 0.0)),
    }


CENTRE_GEAR: ReducerFamily = replace(
    RV,
    name="RV centre gear",
    interfaces=(RV.interfaces[0], CENTRE_MESH, *RV.interfaces[1:]),
    places=_places,
    axes=_axes,
    outlines=_outlines,
    record=CentreGearRecord,
    turning=_turning,
    new=replace(
        RV.new,
        presets=("rv27c",),
        table="rv27c_drawing",
        diameter=136.0,
        schema="rv-centre-gear",
        title="RV reducer with centre gear",
    ),
)
"""An RV reducer whose sun is the second toothing of a centre gear; one mesh more, upstream of the sun."""
