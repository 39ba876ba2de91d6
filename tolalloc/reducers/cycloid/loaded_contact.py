"""Pins and teeth under torque: rotation, forces, loaded zone and pressure, at every phase of the pins."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
from jaxtyping import Float, Int

from tolalloc.exceptions import InputError
from tolalloc.reducers.cycloid.clearance import FLANK, Clearance, Gap, clearance_of, gap_of
from tolalloc.reducers.cycloid.contact_stiffness import peak_pressure
from tolalloc.reducers.cycloid.mesh import normals, pin_angles
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.reducer.design import Reducer

PAIR_SHARE = 0.55
"""Share of the torque on the more loaded disc of a pair, Li Lixing's assumption [-]."""

_HALVINGS = 45  # from a quarter of a degree down to rounding


@dataclass(frozen=True, kw_only=True)
class LoadedContact:
    """Discs pressed against the pins, at phases that divide the pin pitch."""

    method: str  # How it was found
    phase: Float[np.ndarray, " phase"]  # Angle from the crank direction of disc 1 to the next pin [rad]
    pin_angle: Float[np.ndarray, "phase disc pin"]  # Angle φ of the pins from their disc's crank direction [rad]
    # Clearance after the first contact, with a pin at every angle, before the load [m]
    gap: Float[np.ndarray, "phase disc pin"]
    # δ_max = r_d·rotation under the load, what a pin with the longest lever yields [m]
    deflection: Float[np.ndarray, " phase"]
    # Force and Hertz's peak pressure of every pin, torque of the pins on each disc [N, Pa, N·m]
    force: Float[np.ndarray, "phase disc pin"]
    pressure: Float[np.ndarray, "phase disc pin"]
    torque: Float[np.ndarray, "phase disc"]
    # First and last angle at which a pin would carry; where two places touch first, pins between may be free [rad]
    zone: Float[np.ndarray, "phase 2"]

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "phase disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.force > 0).sum(axis=2))

    @property
    def most_loaded(self) -> float:
        """Angle of the pin under the largest force of all phases [rad]."""
        return float(self.pin_angle.ravel()[np.argmax(self.force)])

    @property
    def most_pressed(self) -> float:
        """Angle of the pin under the largest pressure of all phases [rad]."""
        return float(self.pin_angle.ravel()[np.argmax(self.pressure)])


@dataclass(frozen=True, kw_only=True)
class PressedDiscs:
    """Discs of a reducer that share a torque, ready to be pressed against their pins."""

    reducer: Reducer  # Nominal design; its contact law, bending of the pins and modification are used
    torque: float  # Torque of the pins on all discs together [N·m]
    discs: int = 1  # Number of discs that share it [-]
    # Whether clearances are exact distances; by default where the modification is too large for the formula
    exact: bool | None = None

    def __post_init__(self) -> None:
        if not self.torque > 0:
            raise InputError.at(self.reducer.name, "torque on the discs", self.torque, "above 0 N·m")

    @cached_property
    def profile(self) -> ToothProfile:
        """The ground profile."""
        return ToothProfile(stage=self.reducer.cycloid_stage, modification=self.reducer.modification)

    @cached_property
    def clearance(self) -> Clearance:
        """What the modification leaves, and where the first pin touches."""
        return clearance_of(self.profile, self.exact)

    def pin_angles(self, phase: Float[np.ndarray, " phase"]) -> Float[np.ndarray, "phase disc pin"]:
        """Return φ of every pin from its disc's crank direction [rad]."""
        stage = self.reducer.cycloid_stage
        turned = 2 * pi * np.arange(self.discs) / self.discs
        return np.stack([pin_angles(stage, phase - direction) for direction in turned], axis=1)


def default_phases(reducer: Reducer, count: int = 72) -> Float[np.ndarray, " phase"]:
    """Return equally spaced phases over one pin pitch, the first with a pin in the crank direction [rad]."""
    return 2 * pi / reducer.cycloid_stage.pin_count * np.arange(count) / count


def _zones(gap: Gap, rotation: Float[np.ndarray, " phase"], contact: float) -> Float[np.ndarray, "phase 2"]:
    """Return the first and the last angle of compression, tabulated and then bisected for all phases at once [rad]."""
    table = np.sort(np.append(FLANK, contact))  # a light load may press nothing but the first contact
    shape = (rotation.size, table.size)
    pressed = gap(np.broadcast_to(table, shape), np.broadcast_to(rotation[:, np.newaxis], shape)) <= 0
    pressed[:, table == contact] = True
    first, last = pressed.argmax(axis=1), table.size - 1 - pressed[:, ::-1].argmax(axis=1)
    edges = []
    for own, outer in ((first, np.maximum(first - 1, 0)), (last, np.minimum(last + 1, table.size - 1))):
        inside, outside = table[own], table[outer]
        for _ in range(_HALVINGS):
            middle = (inside + outside) / 2
            there = gap(middle, rotation) <= 0
            inside, outside = np.where(there, middle, inside), np.where(there, outside, middle)
        edges.append(inside)
    return np.stack(edges, axis=1)


def loaded(
    discs: PressedDiscs,
    method: str,
    phase: Float[np.ndarray, " phase"],
    deflection: Float[np.ndarray, " phase"],
    force: Float[np.ndarray, "phase disc pin"],
) -> LoadedContact:
    """Return the contact whose deflection and forces a method has found.

    Phases are angles from the crank direction of disc 1 to the next pin [rad], deflections δ_max [m], forces those of
    the pins [N].
    """
    reducer, stage, closed, angles = (
        discs.reducer,
        discs.reducer.cycloid_stage,
        discs.clearance,
        discs.pin_angles(phase),
    )
    gap, lever = gap_of(discs.profile, closed.exact), normals(stage.shortening, angles).lever
    rotations = closed.rotation + deflection / stage.disc_pitch_radius
    return LoadedContact(
        method=method,
        phase=phase,
        pin_angle=angles,
        gap=gap(angles, closed.rotation),
        deflection=deflection,
        force=force,
        pressure=peak_pressure(stage, reducer.contact_modulus, angles, force),
        torque=stage.disc_pitch_radius * (lever * force).sum(axis=2),
        zone=_zones(gap, rotations, closed.first_contact),
    )
