"""First stage: the support of the sun gear and the sun–planet meshes."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.rv.equivalent.kinematics import Positions
from tolalloc.rv.equivalent.springs import (
    SpringGroup,
    harmonic_columns,
    harmonic_waves,
    turned,
    vector_columns,
    with_play,
)


def sun_support(at: Positions) -> SpringGroup:
    """Return the two support springs of the sun gear, theory page equation (6).

    ``sun.assembly`` is (a_SX, a_SY), fixed in the housing [m].
    """
    angles = at.carrier_angle.size
    displacement = np.zeros((angles, 2, at.coordinates.count))
    displacement[:, [0, 1], [at.coordinates.sun, at.coordinates.sun + 1]] = 1.0
    return SpringGroup(
        name="sun support",
        stiffness_name="sun_support",
        displacement=displacement,
        error=np.broadcast_to(-np.eye(2), (angles, 2, 2)),
        columns=vector_columns("sun.assembly"),
        stiffness=np.full((angles, 2), at.reducer.stiffness.sun_support),
    )


def _along_line_of_action(
    at: Positions, crank: int
) -> tuple[dict[str, Float[np.ndarray, " angle"]], Float[np.ndarray, "angle 2"]]:
    """Return what every error column of one mesh adds to its compression, and the direction of the line of action.

    Pitch deviations, counter-clockwise about their own gear, lie along the pitch circle, so cos α of them along the
    line of action. The teeth in mesh stand at P_i seen from the sun's centre and opposite to it seen from the planet's;
    there a planet's tooth that is ahead moves against the line of action, which compresses as the sun's does.
    """
    alpha, position = at.reducer.first_stage.pressure_angle, at.crank_position(crank)
    line_of_action = position + np.pi / 2 - alpha
    normal = np.stack([np.cos(line_of_action), np.sin(line_of_action)], axis=-1)
    columns: dict[str, Float[np.ndarray, " angle"]] = {}
    for part, turn, met, sign in (
        ("sun", at.sun_angle, position, 1.0),
        (f"planet{crank + 1}", at.crank_angle, position + np.pi, -1.0),
    ):
        eccentric = sign * np.einsum("ai,aij->aj", normal, turned(turn))
        waves = np.cos(alpha) * harmonic_waves(met - turn, at.orders)
        columns |= dict(zip(vector_columns(f"{part}.eccentricity"), eccentric.T, strict=True))
        columns |= dict(zip(harmonic_columns(f"{part}.pitch", at.orders), waves.T, strict=True))
    columns[f"mesh{crank + 1}.deviation"] = np.ones_like(position)
    return columns, normal


def gear_mesh(at: Positions) -> SpringGroup:
    """Return one spring per sun–planet mesh along its line of action, theory page equation (7).

    ``sun.eccentricity`` and ``sun.pitch`` turn with the sun, ``planet{i}.eccentricity`` and ``planet{i}.pitch`` with
    the crankshaft; ``mesh{i}.deviation`` is what the pair adds along its line of action (tooth thickness) [m].
    """
    reducer, coordinates, cranks = at.reducer, at.coordinates, at.reducer.crank_count
    angles = at.carrier_angle.size
    displacement = np.zeros((angles, cranks, coordinates.count))
    meshes = []
    for crank in range(cranks):
        columns, normal = _along_line_of_action(at, crank)
        planet = coordinates.planet(crank)
        displacement[:, crank, coordinates.sun : coordinates.sun + 2] = normal
        displacement[:, crank, planet : planet + 2] = -normal
        displacement[:, crank, planet + 2] = reducer.planet_base_radius
        meshes.append(columns)
    names = tuple(dict.fromkeys(name for columns in meshes for name in columns))
    nothing = np.zeros(angles)
    error = np.stack([np.stack([columns.get(name, nothing) for name in names], -1) for columns in meshes], axis=1)
    group = SpringGroup(
        name="gear mesh",
        stiffness_name="gear_mesh",
        displacement=displacement,
        error=error,
        columns=names,
        stiffness=np.full((angles, cranks), reducer.stiffness.gear_mesh),
    )
    return with_play(group, reducer.clearances.gear_mesh, tuple(f"mesh{crank + 1}" for crank in range(cranks)))
