"""What a virtual prototype answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, kw_only=True)
class PrototypeAnswer:
    """What the virtual prototype does.

    Parameters
    ----------
    time
        Times of the answers [s].
    input_speed
        Of the sun, as prescribed [rad/s].
    input_angle
        Of the sun, as prescribed [rad].
    output_speed
        Of the carrier [rad/s].
    output_acceleration
        Of the carrier [rad/s²].
    output_angle
        Of the carrier [rad].
    transmission_error
        Carrier angle beyond the sun's over the ratio [rad].
    input_torque
        On the sun, positive where it drives [N·m].
    output_torque
        On the carrier, as prescribed [N·m].
    pin_forces
        Normal force of every pin [N].
    kinetic_energy
        Of all bodies but the sun [J].
    """

    time: Float[np.ndarray, " time"]
    input_speed: Float[np.ndarray, " time"]
    input_angle: Float[np.ndarray, " time"]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    output_angle: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]
    input_torque: Float[np.ndarray, " time"]
    output_torque: Float[np.ndarray, " time"]
    pin_forces: Float[np.ndarray, "time disc pin"]
    kinetic_energy: Float[np.ndarray, " time"]

    @property
    def input_power(self) -> Float[np.ndarray, " time"]:
        """Power that the sun brings in [W]."""
        return np.asarray(self.input_torque * self.input_speed)

    @property
    def output_power(self) -> Float[np.ndarray, " time"]:
        """Power that the carrier gives away, positive against a resisting torque [W]."""
        return np.asarray(-self.output_torque * self.output_speed)

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "time disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.pin_forces > 0).sum(axis=2))
