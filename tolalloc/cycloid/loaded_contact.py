"""Pins and teeth under torque: rotation, forces, loaded zone and pressure, at every phase of the pins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import brentq

from tolalloc.cycloid.clearance import Clearance, Gap, clearance_of, gap_of
from tolalloc.cycloid.contact_stiffness import ContactStiffness, contact_stiffness, peak_pressure
from tolalloc.cycloid.mesh import flank_angle, normals, pin_angles
from tolalloc.cycloid.solvers.contact_law import LAWS, LINEAR, pin_forces
from tolalloc.cycloid.tooth_profile import ToothProfile
from tolalloc.exceptions import InputError, SolveError
from tolalloc.reducer.design import Reducer
from tolalloc.units import MICROMETRE

PAIR_SHARE = 0.55
"""Share of the torque on the more loaded disc of a pair, Li Lixing's assumption [-]."""

_ITERATIONS = 500
_HALVINGS = 52  # from 180° down to rounding


@dataclass(frozen=True, kw_only=True)
class LoadedContact:
    """Discs pressed against the pins, at phases that divide the pin pitch.

    Parameters
    ----------
    method
        How it was found.
    phase
        Angle from the crank direction of disc 1 to the next pin [rad].
    pin_angle
        Angle φ of the pins from their disc's crank direction [rad].
    gap
        Clearance after the first contact, with a pin at every angle, before the load [m].
    deflection
        δ_max = r_d·rotation under the load, what a pin with the longest lever yields [m].
    force
        Pin forces [N].
    pressure
        Hertz's peak pressure of every pin [Pa].
    torque
        Torque of the pins on each disc [N·m].
    zone
        First and last angle at which a pin would carry [rad].
    iterations
        Steps of Li Lixing's iteration; 0 where a bracket was searched [-].
    exact
        Whether the clearances are exact distances.
    """

    method: str
    phase: Float[np.ndarray, " phase"]
    pin_angle: Float[np.ndarray, "phase disc pin"]
    gap: Float[np.ndarray, "phase disc pin"]
    deflection: Float[np.ndarray, " phase"]
    force: Float[np.ndarray, "phase disc pin"]
    pressure: Float[np.ndarray, "phase disc pin"]
    torque: Float[np.ndarray, "phase disc"]
    zone: Float[np.ndarray, "phase 2"]
    iterations: int
    exact: bool

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
    """Discs of a reducer that share a torque, ready to be pressed against their pins.

    Parameters
    ----------
    reducer
        Nominal design; its contact law, bending of the pins and modification are used.
    torque
        Torque of the pins on all discs together [N·m].
    discs
        Number of discs that share it [-].
    exact
        Whether clearances are exact distances; by default where the modification is too large for the formula.
    """

    reducer: Reducer
    torque: float
    discs: int = 1
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
        """Return φ of every pin from its disc's crank direction [rad].

        Parameters
        ----------
        phase
            Angles from the crank direction of disc 1 to the next pin [rad].
        """
        stage = self.reducer.cycloid_stage
        turned = 2 * pi * np.arange(self.discs) / self.discs
        return np.stack([pin_angles(stage, phase - direction) for direction in turned], axis=1)


def default_phases(reducer: Reducer, count: int = 72) -> Float[np.ndarray, " phase"]:
    """Return equally spaced phases over one pin pitch, the first with a pin in the crank direction [rad]."""
    return 2 * pi / reducer.cycloid_stage.pin_count * np.arange(count) / count


def _zones(gap: Gap, rotation: Float[np.ndarray, " phase"], flank: float) -> Float[np.ndarray, "phase 2"]:
    """Return where compression begins and ends around the first contact, by bisection of all phases at once [rad]."""
    edges = []
    for end in (0.0, pi):
        inside, outside = np.full(rotation.size, flank), np.full(rotation.size, end)
        whole = gap(outside, rotation) <= 0
        for _ in range(_HALVINGS):
            middle = (inside + outside) / 2
            pressed_there = gap(middle, rotation) <= 0
            inside, outside = np.where(pressed_there, middle, inside), np.where(pressed_there, outside, middle)
        edges.append(np.where(whole, end, inside))
    return np.stack(edges, axis=1)


@dataclass(frozen=True)
class _Press:
    """All pins of one phase: from a deflection to compressions and forces."""

    discs: PressedDiscs
    gap: Gap
    closing: float
    pin_angle: Float[np.ndarray, " pin"]

    @cached_property
    def lever(self) -> Float[np.ndarray, " pin"]:
        stage = self.discs.reducer.cycloid_stage
        return np.asarray(stage.disc_pitch_radius * normals(stage.shortening, self.pin_angle).lever)

    @cached_property
    def contact(self) -> ContactStiffness:
        return contact_stiffness(self.discs.reducer.cycloid_stage, self.discs.reducer.stiffness, self.pin_angle)

    def rotation(self, deflection: float) -> float:
        return self.closing + deflection / self.discs.reducer.cycloid_stage.disc_pitch_radius

    def forces(self, deflection: float) -> Float[np.ndarray, " pin"]:
        compression, force = -self.gap(self.pin_angle, self.rotation(deflection)), np.empty(self.pin_angle.size)
        law = LAWS[self.discs.reducer.stiffness.pin_contact_law]
        pin_forces(law, self.contact.stiffness, self.contact.log_length, compression, force)
        return force

    def surplus(self, deflection: float) -> float:
        return float(self.lever @ self.forces(deflection)) - self.discs.torque

    def balanced(self) -> float:
        """Return the deflection at which the torques balance [m]."""
        deepest, deflection = self.discs.reducer.cycloid_stage.pin_radius, MICROMETRE
        while self.surplus(deflection) < 0:
            if deflection >= deepest:
                largest = self.surplus(deepest) + self.discs.torque
                raise InputError(
                    f"{self.discs.reducer.name}: torque {self.discs.torque:.6g} N·m on the discs is beyond any "
                    f"contact: pins would be pressed in by more than their radius; allowed is below {largest:.3g} N·m."
                )
            deflection = min(2 * deflection, deepest)
        return float(brentq(self.surplus, 0.0, deflection, xtol=1e-18, rtol=1e-13))


def pressed(discs: PressedDiscs, phase: Float[np.ndarray, " phase"]) -> LoadedContact:
    """Return the contact of every pin by the reducer's own law, the rotation bracketed until the torques balance.

    Parameters
    ----------
    discs
        What is pressed.
    phase
        Angles from the crank direction of disc 1 to the next pin [rad].

    Raises
    ------
    InputError
        The torque would press a pin in by more than its radius.

    Notes
    -----
    Theory page equation (37). All discs turn by the same angle; a single one carries the whole torque.
    """
    closed, angles = discs.clearance, discs.pin_angles(phase)
    gap = gap_of(discs.profile, closed.exact)
    presses = [_Press(discs, gap, closed.rotation, own) for own in angles.reshape(phase.size, -1)]
    deflection = np.array([press.balanced() for press in presses])
    force = np.stack([press.forces(depth) for press, depth in zip(presses, deflection, strict=True)])
    law = discs.reducer.stiffness.pin_contact_law
    return _answer(discs, f"{law} law at every pin", phase, deflection, force.reshape(angles.shape))


def pressed_linear(
    discs: PressedDiscs, phase: Float[np.ndarray, " phase"], deflection: float | None = None
) -> LoadedContact:
    """Return the contact by Li Lixing's method: forces in proportion to the compressions.

    Parameters
    ----------
    discs
        What is pressed.
    phase
        Angles from the crank direction of disc 1 to the next pin [rad].
    deflection
        δ_max where it is known [m]; otherwise it is iterated until it is the approach under the largest force, by the
        reducer's law with the curvature at φ0.

    Raises
    ------
    InputError
        The deflection reaches no pin.
    SolveError
        The iteration does not settle.

    Notes
    -----
    Theory page equation (36): F_i = F_max·(δ_max·S_i − gap_i)/δ_max with F_max from the balance of torques.

    References
    ----------
    xi2015, equations (5)–(7); Li Lixing (1984).
    """
    stage, angles = discs.reducer.cycloid_stage, discs.pin_angles(phase)
    gap, closed = gap_of(discs.profile, discs.clearance.exact), discs.clearance
    lever, distance = normals(stage.shortening, angles).lever, gap(angles, closed.rotation)

    def shares(depth: Float[np.ndarray, " phase"]) -> Float[np.ndarray, "phase disc pin"]:
        return np.asarray(np.maximum(lever - distance / depth[:, np.newaxis, np.newaxis], 0.0))

    def largest_force(depth: Float[np.ndarray, " phase"]) -> Float[np.ndarray, " phase"]:
        moment = stage.disc_pitch_radius * (shares(depth) * lever).sum(axis=(1, 2))
        if not (moment > 0).all():
            raise InputError(
                f"{discs.reducer.name}: a deflection of {depth.min() / MICROMETRE:.3g} µm reaches no pin; "
                "allowed is a larger torque or smaller clearance."
            )
        return np.asarray(discs.torque / moment)

    if deflection is not None:
        depth = np.full(phase.size, deflection)
        method = "Li Lixing's linear method, deflection given"
        return _answer(discs, method, phase, depth, largest_force(depth)[:, np.newaxis, np.newaxis] * shares(depth))
    force = np.full(phase.size, discs.torque / (stage.disc_pitch_radius * stage.pin_count / 4))
    for iteration in range(1, _ITERATIONS + 1):
        depth = _approach(discs.reducer, force)
        new = largest_force(depth)
        if np.abs(new - force).max() <= 1e-13 * new.max():
            found = _answer(
                discs, "Li Lixing's linear method", phase, depth, new[:, np.newaxis, np.newaxis] * shares(depth)
            )
            return replace(found, iterations=iteration)
        force = 0.5 * (force + new)  # the plain iteration swings from too many pins to too few
    raise SolveError(f"{discs.reducer.name}: Li Lixing's iteration did not settle in {_ITERATIONS} steps.")


def _approach(reducer: Reducer, force: Float[np.ndarray, " phase"]) -> Float[np.ndarray, " phase"]:
    """Return how far pin and tooth at φ0 approach each other under forces [m]."""
    stage, stiffness = reducer.cycloid_stage, reducer.stiffness
    contact = contact_stiffness(stage, stiffness, np.array([flank_angle(stage)]))
    if LAWS[stiffness.pin_contact_law] == LINEAR:
        return np.asarray(force / contact.stiffness)
    scale = 2 * contact.stiffness
    return np.asarray(force / scale * (np.log(scale / force) + contact.log_length))


def _answer(
    discs: PressedDiscs,
    method: str,
    phase: Float[np.ndarray, " phase"],
    deflection: Float[np.ndarray, " phase"],
    force: Float[np.ndarray, "phase disc pin"],
) -> LoadedContact:
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
        iterations=0,
        exact=closed.exact,
    )
