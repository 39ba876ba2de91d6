"""What an engine leaves over time, and the static model at the same angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, kw_only=True)
class TimeSeries:
    """A reducer over time.

    Parameters
    ----------
    time
        Equally spaced times [s].
    carrier_angle
        θc of the nominal motion [rad].
    input_speed, input_acceleration
        Of the sun gear, as prescribed [rad/s, rad/s²].
    output_speed, output_acceleration
        Of the carrier [rad/s, rad/s²].
    transmission_error
        Carrier rotation beyond θc, output side [rad].
    input_torque
        On the sun gear, positive where it drives [N·m].
    output_torque
        On the carrier; negative resists the rotation [N·m].
    pin_forces
        Normal force between every pin and every disc [N].
    """

    time: Float[np.ndarray, " time"]
    carrier_angle: Float[np.ndarray, " time"]
    input_speed: Float[np.ndarray, " time"]
    input_acceleration: Float[np.ndarray, " time"]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]
    input_torque: Float[np.ndarray, " time"]
    output_torque: Float[np.ndarray, " time"]
    pin_forces: Float[np.ndarray, "time disc pin"]

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "time disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.pin_forces > 0).sum(axis=2))


@dataclass(frozen=True, kw_only=True)
class AtRest:
    """The static model at carrier angles of the steady part, under its torque.

    Parameters
    ----------
    steps
        Numbers of the time steps with these angles [-].
    transmission_error
        Carrier rotation beyond θc, output side [rad].
    pin_forces
        Normal force between every pin and every disc [N].
    seconds
        Computing time [s].
    """

    steps: Int[np.ndarray, " angle"]
    transmission_error: Float[np.ndarray, " angle"]
    pin_forces: Float[np.ndarray, "angle disc pin"]
    seconds: float
