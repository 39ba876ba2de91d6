"""Where journals, bores and pins of a reducer with manufacturing errors stand, and its teeth and pins that follow."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.reducers.cycloid.contact_stiffness import contact_stiffness
from tolalloc.reducers.cycloid.solvers import LAWS
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.multibody.solvers.pin_forces import Mesh
from tolalloc.reducers.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class PartErrors:
    """Deviations of points of the parts, in the frames of the parts as they stand at the carrier angle 0."""

    journal: Float[np.ndarray, "crank disc 2"]  # Of crank journals, turning with the crankshaft [m]
    disc_bore: Float[np.ndarray, "disc crank 2"]  # Of the bores in the discs [m]
    carrier_bore: Float[np.ndarray, "crank 2"]  # Of the bores in the carrier [m]
    carrier: Float[np.ndarray, " 2"]  # Of the carrier's bearing in the housing [m]
    pin: Float[np.ndarray, "pin 2"]  # Of pins, radially outward and tangentially [m]
    pin_radius: Float[np.ndarray, " pin"]  # Of the effective radius of pins [m]


def part_errors(reducer: Reducer, errors: Mapping[str, float]) -> PartErrors:
    """Return the deviations that columns of the equivalent model stand for [m].

    Known are ``crank{i}.journal{j}.eccentricity``, ``disc{j}.bore{i}.position``, ``carrier.bore{i}.position``,
    ``carrier.assembly``, ``each_pin.position.{k}`` (x radial, y tangential), ``each_pin.diameter.{k}``,
    ``pin.diameter`` and ``housing.groove.radius``.

    Raises
    ------
    InputError
        Another column.
    """
    cranks, discs, pins = reducer.crank_count, reducer.disc_count, reducer.cycloid_stage.pin_count
    found = PartErrors(
        journal=np.zeros((cranks, discs, 2)),
        disc_bore=np.zeros((discs, cranks, 2)),
        carrier_bore=np.zeros((cranks, 2)),
        carrier=np.zeros(2),
        pin=np.zeros((pins, 2)),
        pin_radius=np.zeros(pins),
    )
    places = {
        r"crank(\d+)\.journal(\d+)\.eccentricity\.([xy])": (found.journal, 1.0),
        r"disc(\d+)\.bore(\d+)\.position\.([xy])": (found.disc_bore, 1.0),
        r"carrier\.bore(\d+)\.position\.([xy])": (found.carrier_bore, 1.0),
        r"carrier\.assembly\.([xy])": (found.carrier, 1.0),
        r"each_pin\.position\.(\d+)\.([xy])": (found.pin, 1.0),
        r"each_pin\.diameter\.(\d+)": (found.pin_radius, 1.0),
        r"pin\.diameter": (found.pin_radius, 1.0),
        r"housing\.groove\.radius": (found.pin_radius, -1.0),  # a larger groove lets the pins sink
    }
    for name, value in errors.items():
        for pattern, (place, sign) in places.items():
            match = re.fullmatch(pattern, name)
            at = tuple("xy".index(part) if part in "xy" else int(part) - 1 for part in match.groups()) if match else ()
            if match and all(0 <= index < size for index, size in zip(at, place.shape, strict=False)):
                place[at] += sign * value
                break
        else:
            raise InputError.at(
                f"virtual prototype of {reducer.name}", "error column", name, "one of a journal, bore, carrier or pin"
            )
    return found


_TABULATED = 1801  # angles of the contact's stiffness along a tooth


def mesh_of(reducer: Reducer, errors: PartErrors) -> Mesh:
    """Return the teeth and pins of a reducer whose pins deviate.

    Raises
    ------
    InputError
        A rotation modification.
    """
    stiffness, stage = reducer.stiffness, reducer.cycloid_stage
    if reducer.modification.rotation != 0.0:
        raise InputError.at(
            f"virtual prototype of {reducer.name}", "rotation modification", reducer.modification.rotation, "0"
        )
    ground = ToothProfile(stage=stage, modification=reducer.modification).ground
    angle = Positions(reducer, np.zeros(1)).pin_direction
    deviation = errors.pin[:, 0] + 1j * errors.pin[:, 1]
    contact, log_length = contact_stiffness(stage, stiffness, np.linspace(0.0, np.pi, _TABULATED))
    return Mesh(
        teeth=float(stage.disc_teeth),
        circle=ground.pin_circle_radius,
        pin=ground.pin_radius,
        eccentricity=stage.eccentricity,
        # Teeth stand so that each disc fits the pins where its own journal points.
        offset=-2 * np.pi * np.arange(reducer.disc_count) / reducer.disc_count / stage.disc_teeth,
        place=(stage.pin_circle_radius + deviation) * np.exp(1j * angle),
        angle=angle,
        radius=stage.pin_radius + errors.pin_radius,
        law=LAWS[stiffness.pin_contact_law],
        stiffness=contact,
        log_length=log_length,
    )
