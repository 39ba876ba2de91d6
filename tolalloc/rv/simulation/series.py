"""What an engine leaves over time, and the static model at the same angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, kw_only=True)
class TimeSeries:
    """A reducer over time."""

    time: Float[np.ndarray, " time"]  # Equally spaced times [s]
    carrier_angle: Float[np.ndarray, " time"]  # θc of the nominal motion [rad]
    # Of the sun gear, as prescribed [rad/s, rad/s²]
    input_speed: Float[np.ndarray, " time"]
    input_acceleration: Float[np.ndarray, " time"]
    # Of the carrier [rad/s, rad/s²]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]  # Carrier rotation beyond θc, output side [rad]
    input_torque: Float[np.ndarray, " time"]  # On the sun gear, positive where it drives [N·m]
    output_torque: Float[np.ndarray, " time"]  # On the carrier; negative resists the rotation [N·m]
    pin_forces: Float[np.ndarray, "time disc pin"]  # Normal force between every pin and every disc [N]

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "time disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.pin_forces > 0).sum(axis=2))


@dataclass(frozen=True, kw_only=True)
class AtRest:
    """The static model at carrier angles of the steady part, under its torque."""

    steps: Int[np.ndarray, " angle"]  # Numbers of the time steps with these angles [-]
    transmission_error: Float[np.ndarray, " angle"]  # Carrier rotation beyond θc, output side [rad]
    pin_forces: Float[np.ndarray, "angle disc pin"]  # Normal force between every pin and every disc [N]
    seconds: float  # Computing time [s]
