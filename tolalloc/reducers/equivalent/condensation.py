"""Spring rows condensed, angle by angle, onto the few coordinates that the nonlinear contacts touch.

Geometry and bilateral stiffness do not depend on the errors. So everything but pin contact and play is
eliminated once per angle and reducer; what is left for each sample is a small convex problem.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.interfaces import PinContact, pin_contact
from tolalloc.reducers.equivalent.ring import on_ring, ring_supports
from tolalloc.reducers.equivalent.springs import AtAngles, Coordinates, Positions, SpringGroup, harmonic_waves
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.housing import ANGLES

_ANGLES_AT_ONCE = 64


class CondensedAngles(NamedTuple):
    """What the contact solvers need at each angle. Retained coordinates are lengths, the discs' (x, y, r_d·θ) first."""

    # Condensed stiffness of the retained coordinates, one zero eigenvalue [N/m]
    stiffness: Float[np.ndarray, "angle retained retained"]
    # Force on them per value of the spring rows and, last, per torque [N/m, last N/(N·m)]
    load: Float[np.ndarray, "angle load retained"]
    carrier_by_retained: Float[np.ndarray, "angle retained"]  # Carrier rotation per retained coordinate [rad/m]
    # Carrier rotation at fixed retained coordinates per value and, last, per torque [rad/m, last rad/(N·m)]
    carrier_by_load: Float[np.ndarray, "angle load"]
    # Compression of every bilateral row per retained coordinate [m/m]
    row_by_retained: Float[np.ndarray, "angle row retained"]
    row_by_load: Float[np.ndarray, "angle row load"]  # Per value and torque [last m/(N·m)]
    row_stiffness: Float[np.ndarray, "angle row"]  # Stiffness of the bilateral rows [N/m]
    # Compression x, y of every element with play, as for the rows [m/m]
    play_by_retained: Float[np.ndarray, "angle element 2 retained"]
    play_by_load: Float[np.ndarray, "angle load element 2"]
    play_stiffness: Float[np.ndarray, "angle element"]  # Stiffness of the elements with play [N/m]
    contact_by_disc: Float[np.ndarray, "angle disc 3 pin"]  # Pin compression per displacement of its disc [m/m]
    # Displacement x, y of a disc's pole, through which all contact normals pass, per its rotation coordinate [m/m]
    pole_by_rotation: Float[np.ndarray, "angle disc 2"]
    # Pin compression per deviation: pin radial and tangential, harmonic amplitudes of the disc's pitch and run-out,
    # pitch and run-out of the tooth met [m/m]; before these the form of flank and pin, if the reducer has one [m]
    contact_by_error: Float[np.ndarray, "angle disc deviation pin"]
    tooth: Int[np.ndarray, "angle disc pin"]  # Number of the tooth that each pin meets [-]
    # Stiffness of each pin contact [N/m] and L of the logarithmic law [m]
    contact_stiffness: Float[np.ndarray, "angle contact"]
    contact_log_length: Float[np.ndarray, "angle contact"]
    turn: Float[np.ndarray, "angle 2"]  # Cosine and sine of the carrier angle [-]


def bilateral_groups(at: Positions) -> list[SpringGroup]:
    """Return all spring groups but the pin contact."""
    groups = family_of(at.reducer).groups(at)
    return [*on_ring(groups, at), *ring_supports(at)] if at.coordinates.ring else groups


def rotation_scale(reducer: Reducer, coordinates: Coordinates) -> Float[np.ndarray, " coordinate"]:
    """Return the lever by which each coordinate is divided so that all are lengths [m or 1].

    Own derivation: x = ℓ·θ with ℓ = r_b2, r_d, a_sp or a, and R_p; any lever gives the same equilibrium.
    """
    scale = np.ones(coordinates.count)
    if coordinates.input_turns:
        scale[coordinates.input + 2] = 1 / reducer.sun_base_radius
    for crank in range(reducer.crank_count):
        scale[coordinates.planet(crank) + 2] = 1 / reducer.planet_base_radius
    for disc in range(reducer.disc_count):
        scale[coordinates.disc(disc) + 2] = 1 / reducer.cycloid_stage.disc_pitch_radius
    scale[coordinates.carrier + 2] = 1 / reducer.carrier_radius
    for way in set(coordinates.ring) & set(ANGLES):
        scale[coordinates.of_ring(way)] = 1 / reducer.cycloid_stage.pin_circle_radius
    return scale


def retained_coordinates(
    reducer: Reducer, coordinates: Coordinates, groups: list[SpringGroup]
) -> Int[np.ndarray, " retained"]:
    """Return the coordinates that pins or elements with play touch, the discs' first."""
    disc = np.arange(coordinates.disc(0), coordinates.disc(reducer.disc_count))
    touched = [np.any(group.displacement != 0.0, axis=(0, 1)) for group in groups if group.contact == "play"]
    others = np.flatnonzero(np.any(touched, axis=0)) if touched else np.array([], np.int64)
    return np.concatenate([disc, np.setdiff1d(others, disc)])


def _elements(
    groups: list[SpringGroup], scale: Float[np.ndarray, " coordinate"], angles: int, loads: int
) -> tuple[
    Float[np.ndarray, "angle element 2 coordinate"],
    Float[np.ndarray, "angle element 2 load"],
    Float[np.ndarray, "angle element"],
]:
    """Return displacement, error and stiffness of all elements with play; a mesh's second direction is zero."""
    displacement, error, stiffness = [], [], []
    first = 0
    for group in groups:
        last = first + len(group.columns)
        if group.contact == "play":
            rows = group.stiffness.shape[1] // len(group.clearance_columns)
            for row in range(0, group.stiffness.shape[1], rows):
                moved, disturbed = np.zeros((angles, 2, scale.size)), np.zeros((angles, 2, loads))
                moved[:, :rows] = group.displacement[:, row : row + rows] * scale
                disturbed[:, :rows, first:last] = group.error[:, row : row + rows]
                displacement.append(moved)
                error.append(disturbed)
                stiffness.append(group.stiffness[:, row])
        first = last
    if not stiffness:
        return np.zeros((angles, 0, 2, scale.size)), np.zeros((angles, 0, 2, loads)), np.zeros((angles, 0))
    return np.stack(displacement, axis=1), np.stack(error, axis=1), np.stack(stiffness, axis=1)


def _contact_by_error(contact: PinContact, orders: tuple[int, ...]) -> Float[np.ndarray, "angle disc deviation pin"]:
    """Return the pin compressions per deviation, in the order of `CondensedAngles.contact_by_error`."""
    waves = np.moveaxis(harmonic_waves(contact.tooth_angle, orders), -1, 2)
    harmonic = (contact.by_tooth[:, :, :, np.newaxis] * waves[:, :, np.newaxis]).reshape(
        *waves.shape[:2], 2 * waves.shape[2], -1
    )
    return np.concatenate([contact.by_pin, harmonic, contact.by_form, contact.by_tooth], axis=2)


def _condense_some(at: Positions) -> CondensedAngles:
    """Return the condensed model at a few angles; memory grows with their number."""
    reducer, coordinates, angles = at.reducer, at.coordinates, at.carrier_angle.size
    scale, groups, contact = rotation_scale(reducer, coordinates), bilateral_groups(at), pin_contact(at)
    size, loads = coordinates.count, sum(len(group.columns) for group in groups) + 1
    rows, errors, stiffnesses, first = [], [], [], 0
    for group in groups:
        if group.contact == "bilateral":
            error = np.zeros((angles, group.stiffness.shape[1], loads))
            error[:, :, first : first + len(group.columns)] = group.error
            rows.append(group.displacement * scale)
            errors.append(error)
            stiffnesses.append(group.stiffness)
        first += len(group.columns)
    row, error, row_stiffness = (np.concatenate(parts, axis=1) for parts in (rows, errors, stiffnesses))
    weighted = np.swapaxes(row * row_stiffness[..., np.newaxis], 1, 2)
    stiffness, load = weighted @ row, -(weighted @ error)
    rotation = coordinates.carrier + 2
    load[:, rotation, -1] = scale[rotation]
    retained = retained_coordinates(reducer, coordinates, groups)
    rest = np.setdiff1d(np.arange(size), retained)
    # Displacement of all coordinates per retained coordinate and per load, the retained ones fixed.
    by_retained, by_load = np.zeros((angles, size, retained.size)), np.zeros((angles, size, loads))
    by_retained[:, retained] = np.eye(retained.size)
    solved = np.linalg.solve(
        stiffness[:, rest[:, np.newaxis], rest],
        np.concatenate([-stiffness[:, rest[:, np.newaxis], retained], load[:, rest]], axis=2),
    )
    by_retained[:, rest], by_load[:, rest] = solved[..., : retained.size], solved[..., retained.size :]
    condensed = stiffness[:, retained] @ by_retained
    moved, disturbed, play_stiffness = _elements(groups, scale, angles, loads)
    direction = np.stack([at.disc_direction(disc) for disc in range(reducer.disc_count)], axis=1)
    lever = np.array([1.0, 1.0, 1 / reducer.cycloid_stage.disc_pitch_radius])[:, np.newaxis]
    return CondensedAngles(
        stiffness=0.5 * (condensed + np.swapaxes(condensed, 1, 2)),
        load=np.swapaxes(load[:, retained] - stiffness[:, retained] @ by_load, 1, 2),
        carrier_by_retained=by_retained[:, rotation] * scale[rotation],
        carrier_by_load=by_load[:, rotation] * scale[rotation],
        row_by_retained=row @ by_retained,
        row_by_load=row @ by_load + error,
        row_stiffness=row_stiffness,
        play_by_retained=moved @ by_retained[:, np.newaxis],
        play_by_load=np.ascontiguousarray(np.moveaxis(moved @ by_load[:, np.newaxis] + disturbed, -1, 1)),
        play_stiffness=play_stiffness,
        contact_by_disc=contact.by_disc * lever,
        pole_by_rotation=np.stack([-np.sin(direction), np.cos(direction)], axis=2),
        contact_by_error=_contact_by_error(contact, at.orders),
        tooth=contact.tooth,
        contact_stiffness=contact.stiffness.reshape(angles, -1),
        contact_log_length=contact.log_length.reshape(angles, -1),
        turn=np.stack([np.cos(at.carrier_angle), np.sin(at.carrier_angle)], axis=1),
    )


def condense(reducer: Reducer, orders: tuple[int, ...], angle: AtAngles) -> CondensedAngles:
    """Return the condensed model of a reducer at the carrier angles.

    S = K_dd − K_dr·K_rr⁻¹·K_rd [N/m], F = L_d − K_dr·K_rr⁻¹·L_r, N per error [m]: theory page, equations (19) to (21),
    exact as these stiffnesses do not depend on the errors; own derivation, static condensation of liu2020's equations.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = condense(load_reducer("rv20e_liu2020"), (1, 2, 4), np.zeros(1))
    >>> whole = np.linalg.eigvalsh(found.stiffness[0])  # of two discs; the mechanism turns without resistance
    >>> whole.size, bool(abs(whole[0]) < 1e-9 * whole[-1])
    (6, True)
    """
    whole: CondensedAngles | None = None
    for start in range(0, angle.size, _ANGLES_AT_ONCE):
        part = _condense_some(Positions(reducer, angle[start : start + _ANGLES_AT_ONCE], orders))
        if whole is None:
            whole = CondensedAngles(*(np.empty((angle.size, *field.shape[1:]), field.dtype) for field in part))
        for field, own in zip(whole, part, strict=True):
            field[start : start + _ANGLES_AT_ONCE] = own
    assert whole is not None
    return whole
