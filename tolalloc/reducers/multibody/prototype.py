"""A reducer as rigid bodies, bearings, pin contacts and an ideal first stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.dynamics.properties import Damping, Inertia
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.multibody.drive import TimeCourse
from tolalloc.reducers.multibody.part_errors import PartErrors
from tolalloc.reducers.multibody.solvers.pin_forces import Mesh
from tolalloc.reducers.multibody.system import System, engine
from tolalloc.reducers.reducer.design import Reducer

RIGID = 1e13
"""Stiffness of a bearing that yields 0.01 arcsec at the output of an RV-40E under its rated torque, and whose force is
still far above its own rounding [N/m]."""


def with_rigid_bearings(reducer: Reducer) -> Reducer:
    """Return the reducer with bearings that do not yield, as joints of a rigid-body model do not."""
    rigid = replace(reducer.stiffness, crank_disc_bearing=RIGID, crank_carrier_bearing=RIGID, carrier_bearing=RIGID)
    return replace(reducer, stiffness=rigid)


def reference_places(reducer: Reducer) -> Float[np.ndarray, "body 2"]:
    """Return the centres of carrier, cranks and discs at the carrier angle 0 [m]."""
    at = Positions(reducer, np.zeros(1))
    turns = [at.crank_position(crank)[0] for crank in range(reducer.crank_count)]
    turns += [at.disc_direction(disc)[0] for disc in range(reducer.disc_count)]
    radius = [reducer.crank_circle_radius] * reducer.crank_count
    radius += [reducer.cycloid_stage.eccentricity] * reducer.disc_count
    return np.array([(0.0, 0.0), *((r * np.cos(a), r * np.sin(a)) for r, a in zip(radius, turns, strict=True))])


def assemble(
    reducer: Reducer,
    inertia: Inertia,
    damping: Damping,
    errors: PartErrors,
    mesh: Mesh,
    speed: TimeCourse,
    torque: TimeCourse,
) -> System:
    """Return a reducer in the engine, at rest at the carrier angle 0."""
    exudyn, bearings = engine(), damping.stiffness_proportional
    new = System(exudyn, exudyn.SystemContainer().AddSystem())
    stiffness, places = reducer.stiffness, reference_places(reducer)
    ground = new.content.AddObject(exudyn.itemInterface.ObjectGround())
    carrier = new.body(places[0], inertia.carrier, inertia.carrier_moment)
    first_disc = 1 + reducer.crank_count
    cranks = [new.body(place, inertia.planet, inertia.planet_moment) for place in places[1:first_disc]]
    discs = [new.body(place, inertia.disc, inertia.disc_moment) for place in places[first_disc:]]
    support = [(carrier[1], np.zeros(2)), (ground, errors.carrier)]
    new.bearing(support, stiffness.carrier_bearing, bearings)
    carrier_rotation, gears = new.rotation(carrier[0]), []
    for i, crank in enumerate(cranks):
        axis = places[1 + i]
        pair = [(crank[1], np.zeros(2)), (carrier[1], axis + errors.carrier_bore[i])]
        new.bearing(pair, stiffness.crank_carrier_bearing, bearings)
        for j, disc in enumerate(discs):
            journal = places[first_disc + j] + errors.journal[i, j]
            pair = [(crank[1], journal), (disc[1], axis + errors.disc_bore[j, i])]
            new.bearing(pair, stiffness.crank_disc_bearing, bearings)
        gear = new.first_stage(reducer, new.rotation(crank[0]), carrier_rotation, speed)
        gears.append(new.moment_sensor(gear))
    reference = np.column_stack([places[first_disc:], np.zeros(len(discs))]).ravel()
    new.pin_contacts([node for node, _ in discs], reference, mesh)
    new.output(reducer, carrier_rotation, speed, torque, damping.mass_proportional * inertia.carrier_moment)
    nodes = [node for node, _ in (carrier, *cranks, *discs)]
    parts = tuple((new.sensor(node, "Coordinates"), new.sensor(node, "Coordinates_t")) for node in nodes)
    acceleration = new.sensor(carrier[0], "Coordinates_tt")
    new.content.Assemble()
    return replace(new, parts=parts, carrier_acceleration=acceleration, gears=tuple(gears))
