"""The first resonance of what the output turns, and the speeds at which orders of the transmission error meet it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import pi, sqrt

from tolalloc.exceptions import SolveError
from tolalloc.reading.units import RPM
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.perfect import exact_unit
from tolalloc.reducers.reducer.design import Reducer

_STEP = 0.02
"""Change of the torque over itself between which the stiffness is taken [-]."""
_MULTIPLES, _OF_INPUT = 6, 2
"""Multiples of pins and teeth, and of the turns of the input, that a train makes as orders [-]."""


def orders_of(reducer: Reducer) -> tuple[float, ...]:
    """Return the orders of the output's turn that a train makes: 1, 2, multiples of teeth, pins and input turns [-].

    What stands in the housing makes multiples of the teeth, what turns with disc or carrier those of the pins, what
    turns with the sun those of its turns; own derivation.
    """
    stage = reducer.cycloid_stage
    teeth = {own * number for own in (stage.disc_teeth, stage.pin_count) for number in range(1, _MULTIPLES + 1)}
    return tuple(sorted({1, 2, *teeth, *(abs(reducer.ratio) * number for number in range(1, _OF_INPUT + 1))}))


@dataclass(frozen=True, kw_only=True)
class Resonance:
    """One inertia on the torsional stiffness of a reducer whose input is held."""

    frequency: float  # [Hz]
    stiffness: float  # Torque per twist under the torque [N·m/rad]
    ratio: float  # Turns of the input per turn of the output [-]

    def input_speed(self, order: float) -> float:
        """Return the speed of the input at which waves per output turn meet it, theory page equation (108) [rpm]."""
        return abs(self.ratio) * 2 * pi * self.frequency / order / RPM

    def met(self, orders: Iterable[float], fastest: float) -> dict[float, float]:
        """Return the orders that meet it up to a speed of the input, and where, slowest first [rpm]."""
        speeds = {order: self.input_speed(order) for order in orders}
        return {order: speed for order, speed in sorted(speeds.items(), key=lambda own: own[1]) if speed <= fastest}


def resonance_of(reducer: Reducer, torque: float, inertia: float) -> Resonance:
    """Return the first resonance of an inertia at the output [kg·m²] under a torque on the carrier [N·m].

    f = √(k/J)/(2π) [Hz], theory page equation (108), own derivation, k = ΔT/Δθ of exact parts, 2 % about the torque, so
    that play is closed and any contact law has a stiffness. The input is held; masses inside are left out: they are
    small beside an inertia that matters.

    Raises
    ------
    SolveError
        Exact parts have no equilibrium under the torque, or do not twist further under more of it.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = resonance_of(load_reducer("rv160e"), -1568.0, 13.1)
    >>> round(found.frequency, 1), round(found.input_speed(162))  # [Hz, rpm]
    (52.7, 2985)
    """
    model = EquivalentModel(reducer).at_torque(torque)
    less, more = (
        float(model.equilibria(exact_unit(model), level, TURN_ANGLES).transmission_error.mean())
        for level in (torque * (1 - _STEP), torque * (1 + _STEP))
    )
    if not (more - less) * torque > 0:  # nor where one of them is not a number
        raise SolveError(f"reducer {reducer.name}: exact parts have no stiffness under {torque:g} N·m.")
    stiffness = 2 * _STEP * torque / (more - less)
    return Resonance(frequency=sqrt(stiffness / inertia) / (2 * pi), stiffness=stiffness, ratio=reducer.ratio)
