"""Units whose parts press each other before any torque acts: forces of the pins, and what turning them takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from tolalloc.rv.cycloid.mesh import pin_angles
from tolalloc.rv.equivalent.hysteresis import BACKLASH, TURN_ANGLES
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import forces

SLIDING_FRICTION = 0.05
"""Coefficient of a disc that slides on pins in their half grooves, oil between them; an assumption [-]."""

PRELOAD_ASSUMPTION = f"no-load friction torque: discs sliding on pins alone, coefficient {SLIDING_FRICTION:g}"


@dataclass(frozen=True, kw_only=True)
class Preload:
    """What presses in a unit without torque: under the 0.01 % of the rated torque at which backlash is read."""

    pin_force: Float[np.ndarray, " sample"]  # Largest force of a pin over one output turn [N]
    friction_torque: Float[np.ndarray, " sample"]  # Largest of the pins over the turn, at the output [N·m]
    status: UInt8[np.ndarray, " sample"]  # Worst status of the turn [-]


def preload(model: EquivalentModel, errors: Float[np.ndarray, "sample column"]) -> Preload:
    """Return what presses in every unit without torque.

    A disc turns against the housing about its pole, so at a pin it slides with the output speed times the distance of
    contact and pole, R_p·√S − r_rp; friction torque µ·ΣF·(R_p·√S − r_rp).
    """
    reducer, stage = model.reducer, model.reducer.cycloid_stage
    torque = -BACKLASH * reducer.load.rated_torque
    solved = model.at_torque(torque).equilibria(errors, torque, TURN_ANGLES)
    found = forces(solved).pins
    crank, apart = -stage.disc_teeth * TURN_ANGLES, 2.0 * np.pi / reducer.disc_count
    angle = np.stack([pin_angles(stage, -(crank + apart * disc)) for disc in range(reducer.disc_count)], axis=1)
    root = np.sqrt(1.0 + stage.shortening**2 - 2.0 * stage.shortening * np.cos(angle))
    lever = stage.pin_circle_radius * root - stage.pin_radius
    return Preload(
        pin_force=np.asarray(found.max(axis=(1, 2, 3))),
        friction_torque=SLIDING_FRICTION * np.einsum("sadp,adp->sa", found, lever).max(axis=1),
        status=np.asarray(solved.status.max(axis=1)),
    )
