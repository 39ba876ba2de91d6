"""What drives and loads the reducer over time: profiles of input speed and output torque, and the nominal motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import Polynomial

from tolalloc.exceptions import InputError
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.reducer.design import Reducer

BLENDS = {"linear": Polynomial([0, 1]), "step": Polynomial([0, 0, 3, -2])}
"""From 0 to 1 between two given times: along a straight line, or by the cubic that starts and ends level."""


_OverTime = Float[np.ndarray, " time"]
_Piece = tuple[Int[np.ndarray, " time"], _OverTime, _OverTime, _OverTime, _OverTime]
"""The piece of a profile that each time lies in: number, first value, rise to the last, length, share gone."""


@dataclass(frozen=True)
class SpeedProfile:
    """A quantity over time: given at some times, blended in between, held before the first and after the last.

    Raises
    ------
    InputError
        Times that do not increase, or not one finite value for each.
    """

    times: tuple[float, ...]  # Increasing times [s]
    values: tuple[float, ...]  # The quantity at these times [rad/s or N·m]
    # ``linear``, or ``step`` for the cubic 3s² − 2s³ whose slope vanishes at both ends
    blend: Literal["linear", "step"] = "linear"

    def __post_init__(self) -> None:
        if not self.times or not np.all(np.isfinite(self.times)) or np.any(np.diff(self.times) <= 0.0):
            raise InputError.at("profile", "times", self.times, "one or more increasing times")
        if len(self.values) != len(self.times) or not np.all(np.isfinite(self.values)):
            raise InputError.at("profile", "values", self.values, "one finite value per time")

    @classmethod
    def constant(cls, value: float) -> SpeedProfile:
        """Return the profile that keeps one value [rad/s or N·m]."""
        return cls((0.0,), (value,))

    def at(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Return the quantity at the times [rad/s or N·m]."""
        _, first, rise, _, share = self._piece(time)
        return np.asarray(first + rise * BLENDS[self.blend](share))

    def slope(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Return the derivative by time, at a corner the one that follows [rad/s² or N·m/s]."""
        _, _, rise, length, share = self._piece(time)
        slope = rise * BLENDS[self.blend].deriv()(share) / length
        return np.asarray(np.where(time < self.times[0], 0.0, slope))

    def integral(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Return the integral from time 0 to the times [rad or N·m·s]."""
        return np.asarray(self._from_first(time) - self._from_first(np.zeros(1)))

    def _from_first(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        times, values = np.array(self.times), np.array(self.values)
        whole = np.diff(times) * (values[:-1] + values[1:]) / 2  # both blends are even about the middle
        (number, first, rise, length, share), blend = self._piece(time), BLENDS[self.blend]
        inside = length * (first * share + rise * blend.integ()(share))
        before = np.concatenate([[0.0], np.cumsum(whole)])[number]
        return np.asarray(before + inside + values[0] * np.minimum(time - times[0], 0.0))

    def _piece(self, time: Float[np.ndarray, " time"]) -> _Piece:
        """Return the piece of each time; the last one starts at the last time and does not rise."""
        times, values = np.array(self.times), np.array(self.values)
        number = np.maximum(np.searchsorted(times, time, side="right") - 1, 0)
        length = np.append(np.diff(times), 1.0)[number]
        share = np.maximum(time - times[number], 0.0) / length
        return number, values[number], np.append(np.diff(values), 0.0)[number], length, share


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Nominal motion and load at equally spaced times."""

    time: Float[np.ndarray, " time"]  # Times, the first one 0 [s]
    # θc and its derivatives [rad, rad/s, rad/s²]
    carrier_angle: Float[np.ndarray, " time"]
    carrier_speed: Float[np.ndarray, " time"]
    carrier_acceleration: Float[np.ndarray, " time"]
    # Torque on the carrier; negative resists the positive direction of rotation [N·m]
    torque: Float[np.ndarray, " time"]

    @property
    def step(self) -> float:
        """Time from one step to the next [s]."""
        return float(self.time[1] - self.time[0])


def motion_of(
    reducer: Reducer,
    input_speed: SpeedProfile,
    output_torque: SpeedProfile,
    duration: float,
    steps: int,
    angle: float = 0.0,
) -> Motion:
    """Return the nominal motion under an input speed and an output torque.

    The reducer's ratio makes the carrier's speed; input speed [rad/s], torque on the carrier [N·m], duration of all
    steps [s], θc at time 0 [rad].

    Raises
    ------
    InputError
        A duration that is not positive, or no step.
    """
    if not 0.0 < duration < np.inf:
        raise InputError.at("motion", "duration", duration, "a positive time")
    if steps < 1:
        raise InputError.at("motion", "steps", steps, "1 or more")
    time = np.linspace(0.0, duration, steps + 1)
    return Motion(
        time=time,
        carrier_angle=angle + input_speed.integral(time) / reducer.ratio,
        carrier_speed=input_speed.at(time) / reducer.ratio,
        carrier_acceleration=input_speed.slope(time) / reducer.ratio,
        torque=output_torque.at(time),
    )


def nominal_acceleration(at: Positions, motion: Motion) -> Float[np.ndarray, "time coordinate"]:
    """Return the acceleration of every coordinate's part in the nominal motion [m/s², rad/s²].

    Crank axes run on the circle of radius a_sp with the carrier, disc centres on that of radius e with the crank; the
    sun's centre rests. Cranks turn with −zc·θc, discs and carrier with θc.
    """
    reducer, coordinates = at.reducer, at.coordinates
    speed, acceleration, stage = motion.carrier_speed, motion.carrier_acceleration, reducer.cycloid_stage
    crank_speed = -float(stage.disc_teeth)  # per carrier speed
    nominal = np.zeros((motion.time.size, coordinates.count))

    def on_circle(radius: float, direction: np.ndarray, per_carrier: float) -> np.ndarray:
        along, towards = radius * per_carrier * acceleration, radius * (per_carrier * speed) ** 2
        cosine, sine = np.cos(direction), np.sin(direction)
        return np.stack([-along * sine - towards * cosine, along * cosine - towards * sine], axis=1)

    for crank in range(coordinates.crank_count):
        own = coordinates.planet(crank)
        nominal[:, own : own + 2] = on_circle(reducer.crank_circle_radius, at.crank_position(crank), 1.0)
        nominal[:, own + 2] = crank_speed * acceleration
    for disc in range(coordinates.disc_count):
        own = coordinates.disc(disc)
        nominal[:, own : own + 2] = on_circle(stage.eccentricity, at.disc_direction(disc), crank_speed)
        nominal[:, own + 2] = acceleration
    nominal[:, coordinates.carrier + 2] = acceleration
    return nominal
