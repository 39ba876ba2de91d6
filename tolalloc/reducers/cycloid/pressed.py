"""Loaded contact by Li Lixing's linear method and by the contact law at every pin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.cycloid.clearance import Gap, gap_of
from tolalloc.reducers.cycloid.contact_stiffness import contact_stiffness
from tolalloc.reducers.cycloid.loaded_contact import LoadedContact, PressedDiscs, loaded
from tolalloc.reducers.cycloid.mesh import flank_angle, normals
from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.cycloid.solvers.contact_law import pin_forces
from tolalloc.reducers.reducer.design import Reducer

_ITERATIONS = 500
_SHORTEST = 1e-6  # lever below which a pin at tip or root carries no torque [-]


def pressed_linear(
    discs: PressedDiscs, phase: Float[np.ndarray, " phase"], deflection: float | None = None
) -> LoadedContact:
    """Return the contact by Li Lixing's method: forces in proportion to the compressions.

    Without a deflection δ_max [m] it is iterated until it is the approach under the largest force, by the reducer's
    law with the curvature at φ0.

    Theory page equation (36): F_i = F_max·(δ_max·S_i − gap_i)/δ_max with F_max from the balance of torques.

    Raises
    ------
    InputError
        The deflection reaches no pin.
    SolveError
        The iteration does not settle.

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
        return np.asarray(discs.torque / (stage.disc_pitch_radius * (shares(depth) * lever).sum(axis=(1, 2))))

    nearest = np.where(lever > _SHORTEST, distance / np.maximum(lever, _SHORTEST), np.inf).min(axis=(1, 2))
    if deflection is not None:
        if deflection <= nearest.max():
            raise InputError(
                f"{discs.reducer.name}: a deflection of {deflection / MICROMETRE:.3g} µm reaches no pin; "
                f"allowed is above {nearest.max() / MICROMETRE:.3g} µm."
            )
        depth = np.full(phase.size, deflection)
        method = "Li Lixing's linear method, deflection given"
    else:
        depth = _iterated(discs, nearest, largest_force)
        method = "Li Lixing's linear method"
    force = largest_force(depth)[:, np.newaxis, np.newaxis] * shares(depth)
    return loaded(discs, method, phase, depth, force)


def _iterated(
    discs: PressedDiscs,
    nearest: Float[np.ndarray, " phase"],
    largest_force: Callable[[Float[np.ndarray, " phase"]], Float[np.ndarray, " phase"]],
) -> Float[np.ndarray, " phase"]:
    """Return the deflections that are the approach under their own largest force [m].

    The plain iteration swings from too many pins to too few, or to none; so the mean of old and new is taken, and the
    middle of what brackets the answer where that mean leaves it and at every third step, as the mean may creep.
    """
    low, high = nearest, np.full(nearest.size, np.inf)
    lever = discs.reducer.cycloid_stage.disc_pitch_radius
    depth = nearest + _approach(discs.reducer, np.full(nearest.size, discs.torque / lever))
    for step in range(1, _ITERATIONS + 1):
        wanted = _approach(discs.reducer, largest_force(depth))
        if (np.abs(wanted - depth) <= 1e-13 * depth).all() or (high - low <= 1e-15 * depth).all():
            return np.asarray(depth)
        low, high = np.where(wanted > depth, depth, low), np.where(wanted > depth, high, depth)
        mean, middle = 0.5 * (depth + wanted), 0.5 * (low + np.minimum(high, 4 * depth))
        depth = np.where((low < mean) & (mean < high) & (step % 3 != 0), mean, middle)
    raise SolveError(f"{discs.reducer.name}: Li Lixing's iteration did not settle in {_ITERATIONS} steps.")


def _approach(reducer: Reducer, force: Float[np.ndarray, " phase"]) -> Float[np.ndarray, " phase"]:
    """Return how far pin and tooth at φ0 approach each other under forces [m]."""
    stage, stiffness = reducer.cycloid_stage, reducer.stiffness
    contact, log_length = contact_stiffness(stage, stiffness, np.array([flank_angle(stage)]))
    if LAWS[stiffness.pin_contact_law] == LINEAR:
        return np.asarray(force / contact)
    scale = 2 * contact
    return np.asarray(force / scale * (np.log(scale / force) + log_length))


@dataclass(frozen=True)
class _Balance:
    """Pins of all phases, pressed by a deflection of the discs."""

    discs: PressedDiscs
    pin_angle: Float[np.ndarray, "phase pin"]  # Angle φ of the pins of all discs [rad]

    @cached_property
    def _gap(self) -> Gap:
        return gap_of(self.discs.profile, self.discs.clearance.exact)

    @cached_property
    def _lever(self) -> Float[np.ndarray, "phase pin"]:
        stage = self.discs.reducer.cycloid_stage
        return np.asarray(stage.disc_pitch_radius * normals(stage.shortening, self.pin_angle).lever)

    @cached_property
    def _contact(self) -> tuple[Float[np.ndarray, "phase pin"], Float[np.ndarray, "phase pin"]]:
        reducer = self.discs.reducer
        return contact_stiffness(reducer.cycloid_stage, reducer.stiffness, self.pin_angle)

    def forces(
        self, deflection: Float[np.ndarray, " some"], phase: Int[np.ndarray, " some"]
    ) -> Float[np.ndarray, "some pin"]:
        """Return the forces of all pins at some phases, each under its own deflection [N]."""
        reducer, (contact, log_length) = self.discs.reducer, self._contact
        rotation = self.discs.clearance.rotation + deflection / reducer.cycloid_stage.disc_pitch_radius
        angles = self.pin_angle[phase]
        compression = -self._gap(angles, np.repeat(rotation[:, np.newaxis], angles.shape[1], axis=1))
        law, force = LAWS[reducer.stiffness.pin_contact_law], np.empty(compression.size)
        pin_forces(law, contact[phase].ravel(), log_length[phase].ravel(), compression.ravel(), force)
        return force.reshape(compression.shape)

    def torque(
        self, deflection: Float[np.ndarray, " some"], phase: Int[np.ndarray, " some"]
    ) -> Float[np.ndarray, " some"]:
        """Return the torques of the pins on the discs [N·m]."""
        return np.asarray((self._lever[phase] * self.forces(deflection, phase)).sum(axis=1))

    def deflection(self) -> Float[np.ndarray, " phase"]:
        """Return the deflections at which the torques balance [m].

        Raises
        ------
        InputError
            A pin would be pressed in by more than its radius.
        """
        from scipy.optimize import elementwise

        wanted, deepest = self.discs.torque, self.discs.reducer.cycloid_stage.pin_radius
        phase = np.arange(len(self.pin_angle))
        high, short = np.full(phase.size, MICROMETRE), phase
        while (short := short[self.torque(high[short], short) < wanted]).size:
            if high[short].max() >= deepest:
                raise InputError(
                    f"{self.discs.reducer.name}: torque {wanted:.6g} N·m on the discs is beyond any contact: pins "
                    f"would be pressed in by more than their radius; allowed is below "
                    f"{self.torque(high[short], short).min():.3g} N·m."
                )
            high[short] = np.minimum(2 * high[short], deepest)
        found = elementwise.find_root(
            lambda depth, at: self.torque(depth, at) - wanted,
            (np.zeros(phase.size), high),
            args=(phase,),
            tolerances={"xrtol": 1e-13},
        )
        return np.asarray(found.x)


def pressed(discs: PressedDiscs, phase: Float[np.ndarray, " phase"]) -> LoadedContact:
    """Return the contact of every pin by the reducer's own law, the rotation bracketed until the torques balance.

    Theory page equation (37). All discs turn by the same angle; a single one carries the whole torque.

    Raises
    ------
    InputError
        The torque would press a pin in by more than its radius.
    """
    angles = discs.pin_angles(phase)
    balance = _Balance(discs, angles.reshape(phase.size, -1))
    deflection, law = balance.deflection(), discs.reducer.stiffness.pin_contact_law
    force = balance.forces(deflection, np.arange(phase.size))
    return loaded(discs, f"{law} law at every pin", phase, deflection, force.reshape(angles.shape))
