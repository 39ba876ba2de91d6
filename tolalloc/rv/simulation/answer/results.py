"""What a simulation in time leaves, whichever engine made it, and the numbers of its steady part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.rv.reducer.design import Reducer
from tolalloc.units import ARCSECOND, DEGREE


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


@dataclass(frozen=True, kw_only=True)
class SimulationResults:
    """A simulated reducer.

    Parameters
    ----------
    reducer
        Nominal design as simulated.
    engine
        Who integrated.
    unit
        Name of the unit.
    speed
        Input speed that is reached [rad/s].
    load
        Torque that resists the carrier's rotation at the end [N·m].
    series
        Over the whole time.
    steady
        Time steps of the last whole crank turns under constant speed and load.
    crank_turns
        How many these are [-].
    at_rest
        The static model beside it.
    natural_frequency
        Lowest natural frequency over the steady part; none where springs are not linear [Hz].
    seconds
        Computing time of the simulation [s].
    assumptions
        What no source prints.
    """

    reducer: Reducer
    engine: str
    unit: str
    speed: float
    load: float
    series: TimeSeries
    steady: slice
    crank_turns: int
    at_rest: AtRest
    natural_frequency: float | None
    seconds: float
    assumptions: tuple[str, ...]

    @property
    def step(self) -> float:
        """Time step [s]."""
        return float(self.series.time[1] - self.series.time[0])

    @property
    def pin_pass(self) -> float:
        """How often per second a disc passes a pin [Hz]."""
        stage = self.reducer.cycloid_stage
        return self.speed / (2 * np.pi) / self.reducer.ratio * stage.disc_teeth * stage.pin_count

    @property
    def span(self) -> float:
        """Carrier angle over which the steady part goes [rad]."""
        return self.crank_turns * 2 * np.pi / self.reducer.cycloid_stage.disc_teeth

    @property
    def output_speed(self) -> float:
        """Mean speed of the carrier in the steady part [rad/s]."""
        return float(self.series.output_speed[self.steady].mean())

    @property
    def ratio(self) -> float:
        """Mean input speed over mean output speed in the steady part [-]."""
        return float(self.series.input_speed[self.steady].mean() / self.output_speed)

    @property
    def input_power(self) -> float:
        """Mean power that the sun gear brings in [W]."""
        return float((self.series.input_torque * self.series.input_speed)[self.steady].mean())

    @property
    def output_power(self) -> float:
        """Mean power that the carrier gives away [W]."""
        return float(-(self.series.output_torque * self.series.output_speed)[self.steady].mean())

    @property
    def transmission_error(self) -> Float[np.ndarray, " angle"]:
        """Transmission error where the static model has its own [rad]."""
        return np.asarray(self.series.transmission_error[self.at_rest.steps])

    @property
    def peak_to_peak(self) -> tuple[float, float]:
        """Peak-to-peak transmission error in motion and at rest, at the same angles [rad]."""
        return float(np.ptp(self.transmission_error)), float(np.ptp(self.at_rest.transmission_error))

    @property
    def difference(self) -> Float[np.ndarray, " angle"]:
        """What motion adds to the transmission error [rad]."""
        return np.asarray(self.transmission_error - self.at_rest.transmission_error)

    @property
    def largest_force(self) -> tuple[float, float]:
        """Largest force of a pin in motion and at rest, at the same angles [N]."""
        return float(self.series.pin_forces[self.at_rest.steps].max()), float(self.at_rest.pin_forces.max())

    @property
    def contacts(self) -> tuple[tuple[int, int], ...]:
        """Least and most pins that carry in the steady part, disc by disc [-]."""
        counts = self.series.pins_in_contact[self.steady]
        return tuple(zip(counts.min(axis=0).tolist(), counts.max(axis=0).tolist(), strict=True))

    @property
    def contacts_at_rest(self) -> tuple[tuple[int, int], ...]:
        """The same in the static model [-]."""
        counts = (self.at_rest.pin_forces > 0).sum(axis=2)
        return tuple(zip(counts.min(axis=0).tolist(), counts.max(axis=0).tolist(), strict=True))

    @property
    def arcseconds(self) -> tuple[Float[np.ndarray, " angle"], ...]:
        """Carrier angle [deg], transmission error in motion and at rest [arcsec]."""
        angle = self.series.carrier_angle[self.at_rest.steps] / DEGREE
        return angle, self.transmission_error / ARCSECOND, self.at_rest.transmission_error / ARCSECOND
