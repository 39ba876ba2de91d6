"""Contact of disc teeth and housing pins: unilateral springs and the errors of teeth, pins and housing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.equivalent.kinematics import Positions
from tolalloc.equivalent.springs import SpringGroup
from tolalloc.reducer.stiffness import pin_contact_table2

HARMONICS = (1, 2, 4)
"""Orders of the pitch and run-out deviations, those that liu2020 prints in Table 4."""


@dataclass(frozen=True)
class PinGeometry:
    """Directions of one disc's contact with every pin, on the nominal profile.

    Parameters
    ----------
    towards_crank, towards_tangent
        cos a and sin a: the normal from the pin into the disc, seen from the crank direction [-].
    outward, tangential
        cos κ and sin κ: the same normal seen from the pin's radius [-].
    disc_angle
        θ_b, angle of the contact point in the disc's own frame [rad].
    normal_on_radius, normal_on_tangent
        n·e_r and n·e_t at the contact point, about the disc's centre [-].
    stiffness
        Contact stiffness of the pin at this tooth [N/m].
    """

    towards_crank: Float[np.ndarray, "angle pin"]
    towards_tangent: Float[np.ndarray, "angle pin"]
    outward: Float[np.ndarray, "angle pin"]
    tangential: Float[np.ndarray, "angle pin"]
    disc_angle: Float[np.ndarray, "angle pin"]
    normal_on_radius: Float[np.ndarray, "angle pin"]
    normal_on_tangent: Float[np.ndarray, "angle pin"]
    stiffness: Float[np.ndarray, "angle pin"]


def pin_geometry(at: Positions, disc: int) -> PinGeometry:
    """Return the contact directions of one disc, theory page equations (13)–(16)."""
    stage, constant = at.reducer.cycloid_stage, at.reducer.stiffness.pin_contact
    shortening = stage.shortening
    direction = at.disc_direction(disc)[:, np.newaxis]
    pin_angle = at.pin_direction[np.newaxis, :] - direction
    cosine, sine = np.cos(pin_angle), np.sin(pin_angle)
    root = np.sqrt(1 + shortening**2 - 2 * shortening * cosine)
    towards_crank, towards_tangent = (shortening - cosine) / root, -sine / root
    # Contact point Q seen from the disc's centre, axes along and across the crank direction.
    along = stage.pin_circle_radius * cosine + stage.pin_radius * towards_crank - stage.eccentricity
    across = stage.pin_circle_radius * sine + stage.pin_radius * towards_tangent
    radius = np.hypot(along, across)
    if at.reducer.stiffness.pin_contact_law == "table2":
        stiffness = pin_contact_table2(
            constant, shortening, stage.pin_count, stage.pin_circle_radius, stage.pin_radius, pin_angle
        )
    else:
        stiffness = np.full_like(pin_angle, constant)
    return PinGeometry(
        towards_crank=towards_crank,
        towards_tangent=towards_tangent,
        outward=(1 - shortening * cosine) / root,
        tangential=shortening * sine / root,
        disc_angle=np.arctan2(across, along) + direction * (1 + 1 / stage.disc_teeth),
        normal_on_radius=(towards_crank * along + towards_tangent * across) / radius,
        normal_on_tangent=(-towards_crank * across + towards_tangent * along) / radius,
        stiffness=stiffness,
    )


def harmonic_columns(name: str) -> tuple[str, ...]:
    """Return the column names of a deviation along a ring: cosine and sine amplitude of each order."""
    return tuple(f"{name}.{wave}{order}" for order in HARMONICS for wave in ("cos", "sin"))


def _waves(angle: Float[np.ndarray, "..."]) -> Float[np.ndarray, "... wave"]:
    """Return the cosine and sine of every order at the angles."""
    return np.stack([wave(order * angle) for order in HARMONICS for wave in (np.cos, np.sin)], axis=-1)


def pin_contact(at: Positions) -> SpringGroup:
    """Return one unilateral spring per disc and pin; compression is minus the gap, equations (17)–(18).

    Notes
    -----
    Lengths, outward or material added positive unless said otherwise [m]: ``housing.pitch`` (tangential,
    counter-clockwise) and ``housing.runout`` of the pin positions, ``housing.groove.radius`` r_k (a larger groove
    lets the pin sink), ``pin.diameter`` d_k, ``modification.equidistant`` Δr_rp, ``modification.shift``
    Δr_p, ``disc{j}.pitch`` along the arc and ``disc{j}.runout`` of the teeth.
    """
    discs, pins = at.reducer.disc_count, at.reducer.cycloid_stage.pin_count
    angles, waves = at.carrier_angle.size, 2 * len(HARMONICS)
    shared = ("pin.diameter", "housing.groove.radius", "modification.equidistant", "modification.shift")
    columns = [*shared, *harmonic_columns("housing.runout"), *harmonic_columns("housing.pitch")]
    first_disc_column = len(columns)
    displacement = np.zeros((angles, discs * pins, at.coordinates.count))
    gap = np.zeros((angles, discs * pins, first_disc_column + discs * 2 * waves))
    stiffness = np.zeros((angles, discs * pins))
    housing_waves = _waves(at.pin_direction)
    for disc in range(discs):
        geometry, rows = pin_geometry(at, disc), slice(disc * pins, (disc + 1) * pins)
        normal_angle = at.disc_direction(disc)[:, np.newaxis] + np.arctan2(
            geometry.towards_tangent, geometry.towards_crank
        )
        plate = at.coordinates.disc(disc)
        displacement[:, rows, plate] = -np.cos(normal_angle)
        displacement[:, rows, plate + 1] = -np.sin(normal_angle)
        displacement[:, rows, plate + 2] = -at.reducer.cycloid_stage.disc_pitch_radius * geometry.towards_tangent
        gap[:, rows, 0:3] = (-1.0, 1.0, 1.0)
        gap[:, rows, 3] = -geometry.outward
        gap[:, rows, 4 : 4 + waves] = geometry.outward[..., np.newaxis] * housing_waves
        gap[:, rows, 4 + waves : 4 + 2 * waves] = geometry.tangential[..., np.newaxis] * housing_waves
        disc_waves, start = _waves(geometry.disc_angle), first_disc_column + disc * 2 * waves
        gap[:, rows, start : start + waves] = geometry.normal_on_tangent[..., np.newaxis] * disc_waves
        gap[:, rows, start + waves : start + 2 * waves] = geometry.normal_on_radius[..., np.newaxis] * disc_waves
        stiffness[:, rows] = geometry.stiffness
        columns += [*harmonic_columns(f"disc{disc + 1}.pitch"), *harmonic_columns(f"disc{disc + 1}.runout")]
    return SpringGroup(
        name="pin contact",
        displacement=displacement,
        error=-gap,
        columns=tuple(columns),
        stiffness=stiffness,
        contact="unilateral",
    )
