"""Torque against twist: lost motion, backlash, torsional stiffness, and the error in both directions of rotation.

Without friction the loop is one curve, measured with the torque in either direction; its width is the play of pins,
bearings and meshes and the elastic twist.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer

LOST_MOTION, BACKLASH = 0.03, 1e-4
"""Torque over rated torque at which the loop's width is read; 3 % by custom, 0.01 % for zero is an assumption."""

LOOP_ASSUMPTION = (
    "lost motion and backlash without friction, so the loop is one curve; backlash: width at ±0.01 % of rated torque"
)

LOOP_ANGLES = 2.0 * np.pi * np.arange(180) / 180
"""Angles of one output turn at which a loop is read unless asked otherwise [rad]."""

TURN_ANGLES = 2.0 * np.pi * np.arange(23) / 23
"""Angles of one output turn at which outputs of many units are read [rad].

23 is prime, so no usual number of pins or teeth divides it and every angle is another phase of both: at 20 angles all
of 40 pins would be met at one phase of the crank.
"""


@dataclass(frozen=True, kw_only=True)
class HysteresisLoop:
    """Twist of the carrier against torque, the sun held."""

    torque: Float[np.ndarray, " level"]  # Torques on the carrier, ascending and symmetrical about 0 [N·m]
    twist: Float[np.ndarray, "sample level angle"]  # Transmission error at each torque, output side [rad]

    def _at(self, torque: float) -> Float[np.ndarray, "sample angle"]:
        return self.twist[:, int(np.argmin(np.abs(self.torque - torque)))]

    def width(self, share: float) -> Float[np.ndarray, "sample angle"]:
        """Return the twist between both directions of `LOST_MOTION`, `BACKLASH` or 1 times the rated torque [rad]."""
        torque = share * self.torque[-1]
        return np.asarray(self._at(torque) - self._at(-torque))

    @property
    def lost_motion(self) -> Float[np.ndarray, " sample"]:
        """Width of the loop at ±3 % of rated torque, mean over the turn [rad]."""
        return np.asarray(self.width(LOST_MOTION).mean(axis=1))

    @property
    def backlash(self) -> Float[np.ndarray, " sample"]:
        """Width of the loop as the torque goes to zero, mean over the turn [rad]."""
        return np.asarray(self.width(BACKLASH).mean(axis=1))

    @property
    def torsional_stiffness(self) -> Float[np.ndarray, " sample"]:
        """Torque over twist between 3 % and 100 % of rated torque, mean of both directions and the turn [N·m/rad]."""
        rated, low = self.torque[-1], LOST_MOTION * self.torque[-1]
        twist = self.width(1.0).mean(axis=1) - self.lost_motion
        return np.asarray(2.0 * (rated - low) / twist)


READ = (BACKLASH, LOST_MOTION, 1.0)
"""Torques over rated torque from which all numbers of a loop are read; more of them only draw it."""

DRAWN = (BACKLASH, LOST_MOTION, 0.1, 0.25, 0.5, 0.75, 1.0)
"""Torques over rated torque at which a loop is drawn."""


def loop_torques(reducer: Reducer, shares: Sequence[float]) -> Float[np.ndarray, " level"]:
    """Return the torques at shares of the rated one in both directions, ascending [N·m]."""
    return np.asarray(reducer.load.rated_torque * np.array([*(-share for share in reversed(shares)), *shares]))


def hysteresis_loop(
    model: EquivalentModel,
    errors: Float[np.ndarray, "sample column"],
    carrier_angle: Float[np.ndarray, " angle"],
    shares: Sequence[float] = READ,
) -> HysteresisLoop:
    """Return torque against twist at shares of the rated torque in both directions and at the carrier angles [rad]."""
    torque = loop_torques(model.reducer, shares)
    twist = [
        model.at_torque(level).equilibria(errors, level, carrier_angle).transmission_error for level in torque.tolist()
    ]
    return HysteresisLoop(torque=torque, twist=np.stack(twist, axis=1))


def both_directions(
    model: EquivalentModel,
    errors: Float[np.ndarray, "sample column"],
    torque: float,
    carrier_angle: Float[np.ndarray, " angle"] | None = None,
) -> tuple[Float[np.ndarray, "sample angle"], Float[np.ndarray, "sample angle"]]:
    """Return the transmission error while turning counter-clockwise and clockwise against a torque [rad].

    What reversing adds is the second minus the first. The sign of the torque does not matter, as it resists both ways.
    """
    forward, backward = (
        model.at_torque(torque).equilibria(errors, resisting, carrier_angle).transmission_error
        for resisting in (-abs(torque), abs(torque))
    )
    return forward, backward
