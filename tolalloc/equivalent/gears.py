"""First stage: the support of the sun gear and the sun–planet meshes."""

from __future__ import annotations

import numpy as np

from tolalloc.equivalent.kinematics import Positions
from tolalloc.equivalent.springs import SpringGroup, turned, vector_columns


def sun_support(at: Positions) -> SpringGroup:
    """Return the two support springs of the sun gear, theory page equation (6).

    Notes
    -----
    ``sun.assembly`` is (a_SX, a_SY), fixed in the housing [m].
    """
    angles = at.carrier_angle.size
    displacement = np.zeros((angles, 2, at.coordinates.count))
    displacement[:, [0, 1], [at.coordinates.sun, at.coordinates.sun + 1]] = 1.0
    return SpringGroup(
        name="sun support",
        displacement=displacement,
        error=np.broadcast_to(-np.eye(2), (angles, 2, 2)),
        columns=vector_columns("sun.assembly"),
        stiffness=np.full((angles, 2), at.reducer.stiffness.sun_support),
    )


def gear_mesh(at: Positions) -> SpringGroup:
    """Return one spring per sun–planet mesh along its line of action, theory page equation (7).

    Notes
    -----
    ``sun.eccentricity`` turns with the sun, ``planet{i}.eccentricity`` with its crankshaft [m].
    """
    reducer, coordinates = at.reducer, at.coordinates
    angles, cranks = at.carrier_angle.size, reducer.crank_count
    displacement = np.zeros((angles, cranks, coordinates.count))
    error = np.zeros((angles, cranks, 2 + 2 * cranks))
    sun_turned, crank_turned = turned(at.sun_angle), turned(at.crank_angle)
    for crank in range(cranks):
        line_of_action = at.crank_position(crank) + np.pi / 2 - reducer.first_stage.pressure_angle
        normal = np.stack([np.cos(line_of_action), np.sin(line_of_action)], axis=-1)
        planet = coordinates.planet(crank)
        displacement[:, crank, coordinates.sun : coordinates.sun + 2] = normal
        displacement[:, crank, planet : planet + 2] = -normal
        displacement[:, crank, planet + 2] = reducer.planet_base_radius
        error[:, crank, 0:2] = np.einsum("ai,aij->aj", normal, sun_turned)
        error[:, crank, 2 + 2 * crank : 4 + 2 * crank] = -np.einsum("ai,aij->aj", normal, crank_turned)
    planets = [name for crank in range(cranks) for name in vector_columns(f"planet{crank + 1}.eccentricity")]
    return SpringGroup(
        name="gear mesh",
        displacement=displacement,
        error=error,
        columns=(*vector_columns("sun.eccentricity"), *planets),
        stiffness=np.full((angles, cranks), reducer.stiffness.gear_mesh),
    )
