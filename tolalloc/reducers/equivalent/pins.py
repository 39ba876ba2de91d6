"""Contact of disc teeth and housing pins: unilateral springs and the errors of teeth, pins and housing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.contact_stiffness import contact_stiffness
from tolalloc.reducers.cycloid.mesh import normals
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.springs import SpringGroup, harmonic_columns, harmonic_waves, vector_columns
from tolalloc.reducers.reducer.design import Reducer

Terms = dict[str, list[tuple[int, float]]]
"""Column → the entries of a table that it moves, and by how much each [m/m or -]."""


@dataclass(frozen=True, kw_only=True)
class PinContact:
    """Contact of every disc with every pin at a batch of carrier angles; compression is minus the gap."""

    # Compression per displacement x, y and rotation of the disc [m/m, m/m, m/rad]
    by_disc: Float[np.ndarray, "angle disc 3 pin"]
    # Compression per radial and tangential deviation of the pin's place [m/m]
    by_pin: Float[np.ndarray, "angle disc 2 pin"]
    # Compression per pitch and run-out deviation of the tooth that the pin meets [m/m]
    by_tooth: Float[np.ndarray, "angle disc 2 pin"]
    tooth: Int[np.ndarray, "angle disc pin"]  # Which tooth that is, counted from 0 at the disc's zero direction [-]
    # θ_b, where on the disc the contact is, in the disc's own frame [rad]
    tooth_angle: Float[np.ndarray, "angle disc pin"]
    stiffness: Float[np.ndarray, "angle disc pin"]  # Contact stiffness of the pin at this tooth [N/m]
    # ln(λ/1 m) of the logarithmic law, `tolalloc.reducers.cycloid.contact_stiffness.contact_stiffness` [-]
    log_length: Float[np.ndarray, "angle disc pin"]


def pin_contact(at: Positions) -> PinContact:
    """Return the contacts of all discs, theory page equations (13)–(18).

    A tooth reaches from one root to the next. Its number follows from the contact's place on the disc, so it is tracked
    through the whole turn; at a root, where it changes, a pitch deviation has no effect.
    """
    stage, teeth = at.reducer.cycloid_stage, at.reducer.cycloid_stage.disc_teeth
    direction = np.stack([at.disc_direction(disc) for disc in range(at.reducer.disc_count)], axis=1)[..., np.newaxis]
    pin_angle = at.pin_direction - direction
    cosine, sine, into = np.cos(pin_angle), np.sin(pin_angle), normals(stage.shortening, pin_angle)
    normal = direction + np.arctan2(into.towards_tangent, into.towards_crank)
    # Contact point Q seen from the disc's centre, axes along and across the crank direction.
    along = stage.pin_circle_radius * cosine + stage.pin_radius * into.towards_crank - stage.eccentricity
    across = stage.pin_circle_radius * sine + stage.pin_radius * into.towards_tangent
    radius = np.hypot(along, across)
    # Unwrapped, so that a whole pin pitch of crank angle is a whole tooth; rounding must not change the tooth.
    turned = np.arctan2(across, along) - np.arctan2(sine, cosine) + at.pin_direction + direction / teeth
    contact, log_length = contact_stiffness(stage, at.reducer.stiffness, pin_angle)
    return PinContact(
        by_disc=np.stack([-np.cos(normal), -np.sin(normal), stage.disc_pitch_radius * into.lever], axis=2),
        by_pin=np.stack([-into.along_radius, -into.across_radius], axis=2),
        by_tooth=np.stack(
            [
                (into.towards_crank * across - into.towards_tangent * along) / radius,
                -(into.towards_crank * along + into.towards_tangent * across) / radius,
            ],
            axis=2,
        ),
        tooth=np.floor(turned * teeth / (2 * np.pi) + 1e-9).astype(np.int64) % teeth,
        tooth_angle=turned,
        stiffness=contact,
        log_length=log_length,
    )


def pin_terms(reducer: Reducer, orders: tuple[int, ...]) -> Terms:
    """Return what each column adds to the pins: entries 0, zp, 2zp … are radial, tangential and radius deviations.

    Outward, counter-clockwise or material added is positive unless said otherwise [m]. For all pins alike:
    ``pin.diameter`` d_k, ``housing.groove.radius`` r_k (a larger groove lets the pin sink),
    ``modification.equidistant`` Δr_rp and ``modification.shift`` Δr_p. Along the ring: ``housing.runout`` radial,
    ``housing.pitch`` tangential. One pin k alone: ``each_pin.position.{k}`` with x radial and y tangential,
    ``each_pin.diameter.{k}``, ``each_pin.groove.{k}``.
    """
    pins = reducer.cycloid_stage.pin_count
    radial, tangential, radius = (range(first, first + pins) for first in (0, pins, 2 * pins))
    terms: Terms = {
        "pin.diameter": [(entry, 1.0) for entry in radius],
        "housing.groove.radius": [(entry, -1.0) for entry in radius],
        "modification.equidistant": [(entry, -1.0) for entry in radius],
        "modification.shift": [(entry, -1.0) for entry in radial],
    }
    waves = harmonic_waves(2 * np.pi * np.arange(pins) / pins, orders)
    for name, entries in (("housing.runout", radial), ("housing.pitch", tangential)):
        for column, wave in zip(harmonic_columns(name, orders), waves.T, strict=True):
            terms[column] = list(zip(entries, (float(value) for value in wave), strict=True))
    for pin in range(pins):
        terms[f"each_pin.diameter.{pin + 1}"] = [(radius[pin], 1.0)]
        terms[f"each_pin.groove.{pin + 1}"] = [(radius[pin], -1.0)]
        x, y = vector_columns(f"each_pin.position.{pin + 1}")
        terms |= {x: [(radial[pin], 1.0)], y: [(tangential[pin], 1.0)]}
    return terms


def wave_terms(disc: int, orders: tuple[int, ...]) -> Terms:
    """Return the harmonic deviations of a disc's teeth: ``disc{j}.pitch`` along the arc, ``disc{j}.runout`` outward."""
    names = (*harmonic_columns(f"disc{disc + 1}.pitch", orders), *harmonic_columns(f"disc{disc + 1}.runout", orders))
    return {name: [(entry, 1.0)] for entry, name in enumerate(names)}


def tooth_terms(reducer: Reducer, disc: int) -> Terms:
    """Return the deviations of single teeth t: ``disc{j}.each_tooth.pitch.{t}``, ``disc{j}.each_tooth.runout.{t}``."""
    names = (
        f"disc{disc + 1}.each_tooth.{kind}.{tooth + 1}"
        for kind in ("pitch", "runout")
        for tooth in range(reducer.cycloid_stage.disc_teeth)
    )
    return {name: [(entry, 1.0)] for entry, name in enumerate(names)}


def tilt_terms(disc: int) -> Terms:
    """Return the tilt of a disc, ``disc{j}.tilt``, which turns with it [rad]."""
    return {name: [(entry, 1.0)] for entry, name in enumerate(vector_columns(f"disc{disc + 1}.tilt"))}


def dense_rows(at: Positions) -> SpringGroup:
    """Return the pin contacts with all columns but the tilt as one plain spring group: large, for proofs only."""
    contact, reducer = pin_contact(at), at.reducer
    angles, discs, pins = contact.stiffness.shape
    stage, coordinates = reducer.cycloid_stage, at.coordinates
    displacement = np.zeros((angles, discs, pins, coordinates.count))
    columns: dict[str, Float[np.ndarray, "angle disc pin"]] = {}
    own_pin = np.concatenate([contact.by_pin, np.ones((angles, discs, 1, pins))], axis=2)
    for name, terms in pin_terms(reducer, at.orders).items():
        column = columns.setdefault(name, np.zeros((angles, discs, pins)))
        for entry, factor in terms:
            column[:, :, entry % pins] += factor * own_pin[:, :, entry // pins, entry % pins]
    for disc in range(discs):
        first = coordinates.disc(disc)
        displacement[:, disc, :, first : first + 3] = np.swapaxes(contact.by_disc[:, disc], 1, 2)
        waves = harmonic_waves(contact.tooth_angle[:, disc], at.orders)
        for entry, name in enumerate(wave_terms(disc, at.orders)):
            column = columns.setdefault(name, np.zeros((angles, discs, pins)))
            column[:, disc] = contact.by_tooth[:, disc, entry // waves.shape[2]] * waves[..., entry % waves.shape[2]]
        for entry, name in enumerate(tooth_terms(reducer, disc)):
            column = columns.setdefault(name, np.zeros((angles, discs, pins)))
            met = contact.tooth[:, disc] == entry % stage.disc_teeth
            column[:, disc] = np.where(met, contact.by_tooth[:, disc, entry // stage.disc_teeth], 0.0)
    return SpringGroup(
        name="pin contact",
        stiffness_name="pin_contact",
        displacement=displacement.reshape(angles, discs * pins, coordinates.count),
        error=np.stack(list(columns.values()), axis=-1).reshape(angles, discs * pins, len(columns)),
        columns=tuple(columns),
        stiffness=contact.stiffness.reshape(angles, discs * pins),
        contact="unilateral",
    )
