"""Units whose parts press each other before any torque acts: forces of the pins, and what turning them takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from tolalloc.reducers.equivalent.friction import sliding_ways
from tolalloc.reducers.equivalent.hysteresis import BACKLASH, TURN_ANGLES
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces

PRELOAD_ASSUMPTION = "friction torque of the pins without load: discs sliding on pins alone, largest over the turn"


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
    reducer = model.reducer
    torque = -BACKLASH * reducer.load.rated_torque
    solved = model.at_torque(torque).equilibria(errors, torque, TURN_ANGLES)
    found = forces(solved).pins
    ways = sliding_ways(reducer, TURN_ANGLES)
    return Preload(
        pin_force=np.asarray(found.max(axis=(1, 2, 3))),
        friction_torque=reducer.friction.pins * np.einsum("sadp,adp->sa", found, ways).max(axis=1),
        status=np.asarray(solved.status.max(axis=1)),
    )
