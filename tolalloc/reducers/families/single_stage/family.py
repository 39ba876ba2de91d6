"""The single-stage cycloid drive: an eccentric input shaft, discs against a ring of pins, output pins in their holes.

The disc turns as an RV reducer's does; in place of crankshafts n pins of the output stand in n holes of every disc,
whose walls push them: one-sided contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tolalloc.drawings.zones import Characteristic
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.equivalent.interfaces import CARRIER_SUPPORT, PIN_SOURCES, Interface, clearance_source, lever
from tolalloc.reducers.equivalent.sources import ErrorSource, Nominal
from tolalloc.reducers.equivalent.springs import Positions, SpringGroup, SpringRows, support, turned, vector_columns
from tolalloc.reducers.families.family import HOUSING_PLACES, NewRows, Place, ReducerFamily
from tolalloc.reducers.families.single_stage.design import OutputPins, SingleStageRecord, SingleStageReducer
from tolalloc.reducers.reducer.design import Reducer

_STANDS_OFF = Characteristic("coaxiality", "shaft offset is toleranced as coaxiality")


def _pins_of(reducer: Reducer) -> OutputPins:
    return SingleStageReducer.of(reducer).output_pins


def shaft_support(at: Positions) -> SpringGroup:
    """Return the two springs of the input shaft's bearings, theory page equation (89).

    ``shaft.assembly`` is (a_x, a_y), fixed in the housing [m]; δ = X − a_x, Y − a_y [m], alike in every direction, own
    derivation, as liu2020's of the sun.
    """
    return support(at, at.coordinates.input, "shaft bearing", "shaft_support", "shaft")


SHAFT_SUPPORT = Interface(
    rows=shaft_support,
    stiffness="shaft_support",
    symbol="K_i",
    sources=(
        ErrorSource(name="shaft.assembly", fixed=True, characteristic=_STANDS_OFF, shape="vector", place="shaft"),
    ),
)


def eccentric_bearing(at: Positions) -> SpringGroup:
    """Return two springs per eccentric of the shaft in the bore of its disc, theory page equation (90).

    ``shaft.journal{j}.eccentricity`` turns with the shaft, ``disc{j}.bore.position`` with the disc [m]. The shaft's
    rotation is given, so it moves no eccentric.

    δ = X − x_d + ε_journal − ε_bore, Y likewise [m], linear; own derivation.
    """
    discs, shaft = at.reducer.disc_count, at.coordinates.input
    rows, journals = SpringRows(at, 2 * discs), tuple(f"shaft.journal{disc + 1}" for disc in range(discs))
    for disc, journal in enumerate(journals):
        pair, plate = slice(2 * disc, 2 * disc + 2), at.coordinates.disc(disc)
        rows.displacement[:, pair, shaft : shaft + 2] = np.eye(2)
        rows.displacement[:, pair, plate : plate + 2] = -np.eye(2)
        rows.add(pair, vector_columns(f"{journal}.eccentricity"), turned(at.crank_angle))
        rows.add(pair, vector_columns(f"disc{disc + 1}.bore.position"), -turned(at.carrier_angle))
    places = tuple(f"{journal}.eccentricity" for journal in journals)
    return rows.group("eccentric bearing", "eccentric_bearing", journals, places=places)


ECCENTRIC_BEARING = Interface(
    rows=eccentric_bearing,
    stiffness="eccentric_bearing",
    symbol="K_e",
    called="eccentric bearing",
    sources=(
        ErrorSource(name="shaft.journal{j}.eccentricity", shape="vector", place="shaft.journal{j}"),
        ErrorSource(name="disc{j}.bore.position", shape="vector", place="disc{j}.bore"),
        clearance_source("shaft.journal{j}"),
    ),
)


def output_pins(at: Positions) -> SpringGroup:
    """Return the contact of every output pin with the wall of its hole in every disc, theory page equation (91).

    A pin in a hole is a bearing of clearance R_h − r_o whose pin stands off by the eccentricity, against the direction
    of the disc's centre: it touches where it lies further off than the clearance, on one side. ``output.pin.position``
    turns with the carrier, ``disc{j}.hole.position`` with the disc; ``disc{j}.hole.radius`` widens the hole,
    ``output.pin.radius`` narrows the gap [m].

    δ = x_carrier − x_disc + a·(θca − θd)·(−sin P, cos P) − e·(cos β_j, sin β_j) + errors [m]; walls exactly round,
    displacements small beside the hole.

    Own derivation; the gap of one pin is the hole's radius less the pin's and the eccentricity.
    """
    pins, discs = _pins_of(at.reducer), at.reducer.disc_count
    carrier, offset = at.coordinates.carrier, "output.offset"
    elements = list(np.ndindex(discs, pins.count))
    rows, with_carrier = SpringRows(at, 2 * len(elements)), turned(at.carrier_angle)
    for element, (disc, pin) in enumerate(elements):
        pair, plate = slice(2 * element, 2 * element + 2), at.coordinates.disc(disc)
        moved, direction = lever(pins.circle_radius, at.crank_position(pin)), at.disc_direction(disc)
        rows.displacement[:, pair, carrier : carrier + 2] = np.eye(2)
        rows.displacement[:, pair, carrier + 2] = moved
        rows.displacement[:, pair, plate : plate + 2] = -np.eye(2)
        rows.displacement[:, pair, plate + 2] = -moved
        rows.add(pair, (offset,), -np.stack([np.cos(direction), np.sin(direction)], axis=-1)[..., np.newaxis])
        rows.add(pair, vector_columns(f"output.pin.position.{pin + 1}"), with_carrier)
    for element, (disc, pin) in enumerate(elements):
        pair = slice(2 * element, 2 * element + 2)
        rows.add(pair, vector_columns(f"disc{disc + 1}.hole.position.{pin + 1}"), -with_carrier)
    return rows.group(
        "output pin",
        "output_pin",
        contact="play",
        clearance=pins.hole_radius - pins.pin_radius,
        clearance_columns=tuple(f"disc{disc + 1}.hole.radius.{pin + 1}" for disc, pin in elements),
        clearance_terms={
            f"output.pin.radius.{pin + 1}": [(disc * pins.count + pin, -1.0) for disc in range(discs)]
            for pin in range(pins.count)
        },
        constants={offset: at.reducer.cycloid_stage.eccentricity},
    )


OUTPUT_PINS = Interface(
    rows=output_pins,
    stiffness="output_pin",
    symbol="K_o",
    called="output pin",
    sources=(
        ErrorSource(name="output.pin.position", shape="vector", each="output pin", place="output.pins"),
        ErrorSource(name="disc{j}.hole.position", shape="vector", each="output pin", place="disc{j}.holes"),
        ErrorSource(
            name="disc{j}.hole.radius",
            each="output pin",
            place="disc{j}.holes",
            nominal=Nominal(said="its hole radius", of=lambda reducer: _pins_of(reducer).hole_radius),
        ),
        ErrorSource(
            name="output.pin.radius",
            each="output pin",
            place="output.pins",
            nominal=Nominal(said="its output pin radius", of=lambda reducer: _pins_of(reducer).pin_radius),
        ),
    ),
)


def _places(reducer: Reducer) -> Iterator[Place]:
    discs = range(1, reducer.disc_count + 1)
    yield from HOUSING_PLACES
    for disc in discs:
        yield Place(id=f"disc{disc}", label=f"disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.teeth", label=f"teeth of disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.holes", label=f"holes of disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.bore", label=f"bore of disc {disc}", part=f"disc{disc}")
    yield Place(id="shaft", label="input shaft", part="shaft")
    for disc in discs:
        yield Place(id=f"shaft.journal{disc}", label=f"eccentric {disc} of the shaft", part="shaft")
    yield Place(id="carrier", label="output with its pins", part="carrier")
    yield Place(id="output.pins", label="output pins", part="carrier")


def _axes(reducer: Reducer) -> dict[str, str]:
    """Return the axes as the picture names them: holes are the discs' bores, output pins stand in the carrier's."""
    pins, discs = range(1, _pins_of(reducer).count + 1), range(1, reducer.disc_count + 1)
    found = {f"carrier.bore{pin}": f"output.pin.position.{pin}" for pin in pins}
    for disc in discs:
        found[f"shaft.journal{disc}"] = f"shaft.journal{disc}.eccentricity"
        found |= {f"disc{disc}.bore{pin}": f"disc{disc}.hole.position.{pin}" for pin in pins}
    return found


def _outlines(reducer: Reducer) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return radii and counts [mm, -] with names for the picture, and what of them is an assumption of the drawing."""
    stage, pins = reducer.cycloid_stage, _pins_of(reducer)
    circle, root = stage.pin_circle_radius, stage.pin_circle_radius - stage.eccentricity - stage.pin_radius
    bore = 0.8 * (pins.circle_radius - pins.hole_radius)
    lengths = {
        "pin_circle_radius": circle,
        "pin_radius": stage.pin_radius,
        "eccentricity": stage.eccentricity,
        "crank_circle_radius": pins.circle_radius,
        "carrier_bore_radius": pins.pin_radius,
        "bore_radius": pins.hole_radius,
        "disc_hole_radius": bore,
        "journal_radius": 0.8 * bore,
        "shaft_radius": 0.4 * bore,
        "carrier_radius": min(pins.circle_radius + 1.5 * pins.pin_radius, root - stage.eccentricity),
        "housing_radius": 1.17 * circle + stage.pin_radius,
    }
    counts = {
        "output_pin_count": pins.count,
        "crank_count": 0,
        "disc_count": reducer.disc_count,
        "pin_count": stage.pin_count,
        "disc_teeth": stage.disc_teeth,
    }
    assumed = "outlines of housing, carrier, shaft and its bore are schematic: the reducer file gives none"
    return {name: float(length / MILLIMETRE) for name, length in lengths.items()} | counts, (assumed,)


SINGLE_STAGE = ReducerFamily(
    name="single stage",
    interfaces=(SHAFT_SUPPORT, ECCENTRIC_BEARING, OUTPUT_PINS, CARRIER_SUPPORT),
    contact_sources=PIN_SOURCES,
    record=SingleStageRecord,
    limited=(ECCENTRIC_BEARING, OUTPUT_PINS),
    rate=100.0,
    places=_places,
    identified=("eccentric_bearing",),
    axes=_axes,
    outlines=_outlines,
    new=NewRows(
        presets=("cd29",),
        cranks=(),
        discs=(1, 2, 3),
        table="cd29_drawing",
        diameter=80.0,
        lost_motion=2.0,
        priced=("disc?.hole.position", "shaft.journal?.eccentricity", "pin.diameter"),
        schema="single-stage",
        title="Single-stage drive",
        stiffer="eccentric_bearing",
    ),
)
"""One stage: shaft, discs, pins of the housing and of the output."""
