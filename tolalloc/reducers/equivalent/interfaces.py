"""Every interface but the pins: support of the sun gear, sun–planet meshes, and all bearings."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.springs import (
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


def _lever(radius: float, direction: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle 2"]:
    """Return the movement, per radian of its part, of a point at a radius and direction [m/rad]."""
    return radius * np.stack([-np.sin(direction), np.cos(direction)], axis=-1)


def _tilted(height: float, direction: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle 2 2"]:
    """Return how far a point at a height moves, per tilt (x, y) of its part, which has turned [m/rad]."""
    return turned(direction) @ (height * np.array([[0.0, 1.0], [-1.0, 0.0]]))


def crank_disc(at: Positions) -> SpringGroup:
    """Return two springs per crank journal and disc bore, theory page equations (8) and (9).

    Journals turn with the crankshaft, bores with the disc, that is with the carrier angle:
    ``crank{i}.journal{j}.eccentricity`` and ``disc{j}.bore{i}.position`` [m]. Angles [rad], equation (29):
    ``crank{i}.journal{j}.phase`` (the journal turned on its crankshaft), ``disc{j}.bores.rotation`` (the pattern of the
    bores against the teeth), ``crank{i}.tilt``, ``disc{j}.bore{i}.tilt`` and ``carrier.tilt``, the last fixed in the
    housing as the carrier's assembly error is.
    """
    reducer, coordinates = at.reducer, at.coordinates
    eccentricity, angles = reducer.cycloid_stage.eccentricity, at.carrier_angle.size
    pairs = [(crank, disc) for disc in range(reducer.disc_count) for crank in range(reducer.crank_count)]
    displacement = np.zeros((angles, 2 * len(pairs), coordinates.count))
    columns: dict[str, Float[np.ndarray, "angle row"]] = {}

    def add(names: tuple[str, ...], rows: slice, moved: Float[np.ndarray, "angle 2 column"]) -> None:
        for at_column, name in enumerate(names):
            column = columns.setdefault(name, np.zeros((angles, 2 * len(pairs))))
            column[:, rows] = moved[:, :, at_column]

    for number, (crank, disc) in enumerate(pairs):
        rows, plane = slice(2 * number, 2 * number + 2), at.plane(disc)
        planet, plate = coordinates.planet(crank), coordinates.disc(disc)
        journal, bore = f"crank{crank + 1}.journal{disc + 1}", f"disc{disc + 1}.bore{crank + 1}"
        crank_turn = _lever(eccentricity, at.disc_direction(disc))
        disc_turn = _lever(reducer.crank_circle_radius, at.crank_position(crank))
        displacement[:, rows, planet : planet + 2] = np.eye(2)
        displacement[:, rows, planet + 2] = crank_turn
        displacement[:, rows, plate : plate + 2] = -np.eye(2)
        displacement[:, rows, plate + 2] = -disc_turn
        add(vector_columns(f"{journal}.eccentricity"), rows, turned(at.crank_angle))
        add(vector_columns(f"{bore}.position"), rows, -turned(at.carrier_angle))
        add((f"{journal}.phase",), rows, crank_turn[..., np.newaxis])
        add((f"disc{disc + 1}.bores.rotation",), rows, -disc_turn[..., np.newaxis])
        add(vector_columns(f"crank{crank + 1}.tilt"), rows, _tilted(plane, at.crank_angle))
        add(vector_columns(f"{bore}.tilt"), rows, -_tilted(plane, at.carrier_angle))
        add(vector_columns("carrier.tilt"), rows, _tilted(plane, np.zeros(angles)))
    group = SpringGroup(
        name="crank–disc bearing",
        stiffness_name="crank_disc_bearing",
        displacement=displacement,
        error=np.stack(list(columns.values()), axis=-1),
        columns=tuple(columns),
        stiffness=np.full((angles, 2 * len(pairs)), reducer.stiffness.crank_disc_bearing),
    )
    journals = tuple(f"crank{crank + 1}.journal{disc + 1}" for crank, disc in pairs)
    return with_play(group, reducer.clearances.crank_disc_bearing, journals)


def crank_carrier(at: Positions) -> SpringGroup:
    """Return two springs per crankshaft bearing in the carrier, theory page equations (10) and (11).

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
    group = SpringGroup(
        name="crank–carrier bearing",
        stiffness_name="crank_carrier_bearing",
        displacement=displacement,
        error=error,
        columns=tuple(columns),
        stiffness=np.full((angles, 2 * cranks), reducer.stiffness.crank_carrier_bearing),
    )
    bores = tuple(f"carrier.bore{crank + 1}" for crank in range(cranks))
    return with_play(group, reducer.clearances.crank_carrier_bearing, bores)


def carrier_support(at: Positions) -> SpringGroup:
    """Return the two springs of the carrier's bearing in the housing, theory page equation (12).

    ``carrier.assembly`` is (a_cx, a_cy), fixed in the housing [m].
    """
    angles, carrier = at.carrier_angle.size, at.coordinates.carrier
    displacement = np.zeros((angles, 2, at.coordinates.count))
    displacement[:, [0, 1], [carrier, carrier + 1]] = 1.0
    group = SpringGroup(
        name="carrier bearing",
        stiffness_name="carrier_bearing",
        displacement=displacement,
        error=np.broadcast_to(-np.eye(2), (angles, 2, 2)),
        columns=vector_columns("carrier.assembly"),
        stiffness=np.full((angles, 2), at.reducer.stiffness.carrier_bearing),
    )
    return with_play(group, at.reducer.clearances.carrier_bearing, ("carrier",))
