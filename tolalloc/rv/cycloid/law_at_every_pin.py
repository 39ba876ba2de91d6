"""Loaded contact by the force law of every single pin, the rotation bracketed until the torques balance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq

from tolalloc.exceptions import InputError
from tolalloc.rv.cycloid.clearance import Gap, gap_of
from tolalloc.rv.cycloid.contact_stiffness import ContactStiffness, contact_stiffness
from tolalloc.rv.cycloid.loaded_contact import LoadedContact, PressedDiscs, loaded
from tolalloc.rv.cycloid.mesh import normals
from tolalloc.rv.cycloid.solvers.contact_law import LAWS, pin_forces
from tolalloc.units import MICROMETRE


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
    return loaded(discs, f"{law} law at every pin", phase, deflection, force.reshape(angles.shape))
