"""Bearings: crank journal in disc bore, crankshaft in carrier, carrier in housing."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.equivalent.kinematics import Positions
from tolalloc.equivalent.springs import SpringGroup, turned, vector_columns


def _lever(radius: float, direction: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle 2"]:
    """Return the movement, per radian of its part, of a point at a radius and direction [m/rad]."""
    return radius * np.stack([-np.sin(direction), np.cos(direction)], axis=-1)


def crank_disc(at: Positions) -> SpringGroup:
    """Return two springs per crank journal and disc bore, theory page equations (8) and (9).

    Notes
    -----
    ``crank{i}.journal{j}.eccentricity`` turns with the crankshaft, ``disc{j}.bore{i}.position`` with
    the disc, that is with the carrier angle [m].
    """
    reducer, coordinates = at.reducer, at.coordinates
    pairs = [(crank, disc) for disc in range(reducer.disc_count) for crank in range(reducer.crank_count)]
    angles = at.carrier_angle.size
    displacement = np.zeros((angles, 2 * len(pairs), coordinates.count))
    error = np.zeros((angles, 2 * len(pairs), 4 * len(pairs)))
    columns: list[str] = []
    for number, (crank, disc) in enumerate(pairs):
        rows = slice(2 * number, 2 * number + 2)
        planet, plate = coordinates.planet(crank), coordinates.disc(disc)
        displacement[:, rows, planet : planet + 2] = np.eye(2)
        displacement[:, rows, planet + 2] = _lever(reducer.cycloid_stage.eccentricity, at.disc_direction(disc))
        displacement[:, rows, plate : plate + 2] = -np.eye(2)
        displacement[:, rows, plate + 2] = -_lever(reducer.crank_circle_radius, at.crank_position(crank))
        error[:, rows, 4 * number : 4 * number + 2] = turned(at.crank_angle)
        error[:, rows, 4 * number + 2 : 4 * number + 4] = -turned(at.carrier_angle)
        columns += vector_columns(f"crank{crank + 1}.journal{disc + 1}.eccentricity")
        columns += vector_columns(f"disc{disc + 1}.bore{crank + 1}.position")
    return SpringGroup(
        name="crank–disc bearing",
        displacement=displacement,
        error=error,
        columns=tuple(columns),
        stiffness=np.full((angles, 2 * len(pairs)), reducer.stiffness.crank_disc_bearing),
    )


def crank_carrier(at: Positions) -> SpringGroup:
    """Return two springs per crankshaft bearing in the carrier, theory page equations (10) and (11).

    Notes
    -----
    ``carrier.bore{i}.position`` turns with the carrier [m].
    """
    reducer, coordinates = at.reducer, at.coordinates
    angles, cranks = at.carrier_angle.size, reducer.crank_count
    displacement = np.zeros((angles, 2 * cranks, coordinates.count))
    error = np.zeros((angles, 2 * cranks, 2 * cranks))
    columns: list[str] = []
    for crank in range(cranks):
        rows = slice(2 * crank, 2 * crank + 2)
        planet, carrier = coordinates.planet(crank), coordinates.carrier
        displacement[:, rows, planet : planet + 2] = np.eye(2)
        displacement[:, rows, carrier : carrier + 2] = -np.eye(2)
        displacement[:, rows, carrier + 2] = -_lever(reducer.crank_circle_radius, at.crank_position(crank))
        error[:, rows, rows] = -turned(at.carrier_angle)
        columns += vector_columns(f"carrier.bore{crank + 1}.position")
    return SpringGroup(
        name="crank–carrier bearing",
        displacement=displacement,
        error=error,
        columns=tuple(columns),
        stiffness=np.full((angles, 2 * cranks), reducer.stiffness.crank_carrier_bearing),
    )


def carrier_support(at: Positions) -> SpringGroup:
    """Return the two springs of the carrier's bearing in the housing, theory page equation (12).

    Notes
    -----
    ``carrier.assembly`` is (a_cx, a_cy), fixed in the housing [m].
    """
    angles, carrier = at.carrier_angle.size, at.coordinates.carrier
    displacement = np.zeros((angles, 2, at.coordinates.count))
    displacement[:, [0, 1], [carrier, carrier + 1]] = 1.0
    return SpringGroup(
        name="carrier bearing",
        displacement=displacement,
        error=np.broadcast_to(-np.eye(2), (angles, 2, 2)),
        columns=vector_columns("carrier.assembly"),
        stiffness=np.full((angles, 2), at.reducer.stiffness.carrier_bearing),
    )
