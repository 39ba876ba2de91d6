"""The ring of pins where it gives against the housing, theory page equations (106) and (107).

Every contact normal of a disc passes through its pole. So a ring that moves as a rigid body is felt by all pins of
a disc alike, as if the disc moved the other way: the contact of pins and teeth keeps its rows, and with them its
solver, and only the springs that hold the discs know of the ring.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.equivalent.springs import Positions, SpringGroup
from tolalloc.reducers.reducer.housing import ANGLES, RING, ways_of


def ring_motion(at: Positions) -> Float[np.ndarray, "angle disc 2 way"]:
    """Return how far the ring goes at the pins of every disc, x and y, per way that it has [m/m or m/rad].

    w_j = u + (θ + t·τ)·ẑ×p_j + z_j·τ with the pole p_j = e·zp(cos β_j, sin β_j), the height z_j of the disc, the tilt τ
    and the turn t per tilt, each along and across the housing's direction; theory page equation (106), own derivation,
    for a rigid ring and small motions.
    """
    stage, housing, discs = at.reducer.cycloid_stage, at.reducer.housing, range(at.reducer.disc_count)
    cosine, sine = np.cos(housing.direction), np.sin(housing.direction)
    along, across = np.array([cosine, sine]), np.array([-sine, cosine])
    pole = stage.eccentricity * stage.pin_count
    found = np.zeros((at.carrier_angle.size, at.reducer.disc_count, 2, len(at.coordinates.ring)))
    for disc in discs:
        direction, height = at.disc_direction(disc), at.plane(disc)
        turn = pole * np.stack([-np.sin(direction), np.cos(direction)], axis=-1)
        moved = {
            "along": along,
            "across": across,
            "turn": turn,
            "tilt_along": height * along + housing.turn_per_tilt_along * turn,
            "tilt_across": height * across + housing.turn_per_tilt_across * turn,
        }
        for number, way in enumerate(at.coordinates.ring):
            found[:, disc, :, number] = moved[way]
    return found


def on_ring(groups: list[SpringGroup], at: Positions) -> list[SpringGroup]:
    """Return spring groups whose discs are where the ring is and where they are on it, x_j + w_j.

    Theory page equation (106), linear: displacements of the rows [m/m or m/rad] gain those of the ring.
    """
    coordinates, moved = at.coordinates, ring_motion(at)
    first = coordinates.count - len(coordinates.ring)
    found = []
    for group in groups:
        displacement = group.displacement.copy()
        for disc in range(coordinates.disc_count):
            own = coordinates.disc(disc)
            displacement[:, :, first:] += displacement[:, :, own : own + 2] @ moved[:, disc]
        found.append(replace(group, displacement=displacement))
    return found


def ring_supports(at: Positions) -> list[SpringGroup]:
    """Return what holds the ring, one spring for each way that it has, at the pin circle where it is an angle.

    δ = u, R_p·θ, R_p·τ [m], theory page equation (107), own derivation; the ring is rigid, K [N/m] its mounting's.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> reducer = load_reducer("rv20e_liu2020")
    >>> reducer = replace(reducer, stiffness=replace(reducer.stiffness, ring_turn=4e9))
    >>> (own,) = ring_supports(Positions(reducer, np.zeros(1)))
    >>> own.name, round(float(own.displacement[0, 0, -1]), 3)
    ('ring turn', 0.052)
    """
    coordinates, radius = at.coordinates, at.reducer.cycloid_stage.pin_circle_radius
    found = []
    for way, stiffness in ways_of(at.reducer.stiffness).items():
        lever = radius if way in ANGLES else 1.0
        displacement = np.zeros((at.carrier_angle.size, 1, coordinates.count))
        displacement[:, 0, coordinates.of_ring(way)] = lever
        group = SpringGroup(
            name=f"ring {way.replace('_', ' ')}",
            stiffness_name=f"{RING}{way}",
            displacement=displacement,
            error=np.zeros((at.carrier_angle.size, 1, 0)),
            columns=(),
            stiffness=np.full((at.carrier_angle.size, 1), stiffness),
        )
        found.append(group)
    return found
