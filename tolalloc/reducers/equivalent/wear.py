"""Wear of flanks and pins by Archard's law, with the forces and slidings of the equilibria over a duty cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, pi

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.cycloid.tooth_profile import path_curvature, pole_distance
from tolalloc.reducers.equivalent.friction import sliding_ways
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.equivalent.model import EquivalentModel, Errors
from tolalloc.reducers.equivalent.outputs import Solved, angles_of_pins
from tolalloc.reducers.equivalent.perfect import PHASES, perfect_reducer
from tolalloc.reducers.load_case import LoadCase, require_duty
from tolalloc.reducers.reducer.design import Reducer, thermal_shift
from tolalloc.reducers.reducer.form import LARGEST_FREE, FlankForm, PartForm, Points

STEP = 1.0 * MICROMETRE
"""Largest wear in one step of the hours, of a flank or across a pin; what halving it changes is on page validation."""

_TOGETHER = 8
"""Neighbouring phases of a pin pitch whose mean is one point of the worn form: nine points a pin pitch [-]."""


@dataclass(frozen=True, kw_only=True)
class DutyPhase:
    """Part of the hours under one load."""

    torque: float  # On the carrier [N·m]
    disc_temperature: float  # Of the discs less that of the ring [K]
    turns: float  # Of the output in an hour of the whole cycle [1/h]


@dataclass(frozen=True, kw_only=True)
class _Step:
    """Some of the hours, and the flanks within them."""

    hours: float  # [h]
    start: PartForm | None
    middle: PartForm | None


@dataclass(frozen=True, kw_only=True)
class Wear:
    """What a duty cycle has taken off the flanks of all discs and off the pins, of the reducer with exact parts.

    Theory page equations (97) to (99). Flanks are common to all units; a unit's pins wear by its own forces, `aged`.
    """

    hours: float  # [h]
    angle: Float[np.ndarray, " point"]  # φ of the points of a tooth space, 0 in its middle, equally spaced [rad]
    depth: Float[np.ndarray, " point"]  # Off the flanks along their normal there, mean of the discs [m]
    pin_depth: float  # Off the radius of a pin, the same all around it [m]
    volume: float  # Off the flanks of all discs; the pins have lost as much [m³]
    form: PartForm | None  # Of the worn parts, as `tolalloc.reducers.reducer.design.Reducer` has it
    phases: tuple[DutyPhase, ...]
    steps: tuple[_Step, ...]

    def aged(self, model: EquivalentModel, errors: Errors) -> Errors:
        """Return the errors of units whose pins are worn by the units' own forces [m].

        Every pin loses on its radius what theory page equation (99) says of the forces at the angles of an output turn,
        step by step with the flanks of that step; pins stay round (assumed). NaN where a unit has no equilibrium.
        """
        pins = range(1, model.reducer.cycloid_stage.pin_count + 1)
        columns = [model.columns.index(f"each_pin.diameter.{pin}") for pin in pins]
        worn = errors.copy()
        for step in self.steps:
            middle = worn.copy()
            middle[:, columns] -= step.hours * self._pin_depths(model.with_form(step.start), worn)
            # Half the hours, but all that a radius loses counts twice on the diameter.
            worn[:, columns] -= 2.0 * step.hours * self._pin_depths(model.with_form(step.middle), middle)
        return worn

    def _pin_depths(self, model: EquivalentModel, errors: Errors) -> Float[np.ndarray, "sample pin"]:
        """Return what an hour takes off the radius of every pin of every unit [m]."""
        stage, shift = model.reducer.cycloid_stage, model.columns.index("modification.shift")
        ways = np.abs(sliding_ways(model.reducer, TURN_ANGLES))
        work = np.zeros((len(errors), stage.pin_count))
        for phase in self.phases:
            own = errors.copy()
            own[:, shift] += thermal_shift(stage, phase.disc_temperature)
            solved = Solved.of(model.at_torque(phase.torque).equilibria(own, phase.torque, TURN_ANGLES))
            turn = np.einsum("sadp,adp->sp", solved.forces.pins, ways) * 2.0 * pi / TURN_ANGLES.size
            work += phase.turns * turn
        return work * pin_depth_per_work(model.reducer)


def flank_depth_per_force(reducer: Reducer, angle: Float[np.ndarray, "*angles"]) -> Float[np.ndarray, "*angles"]:
    """Return what one pass of a pin takes off a flank at φ over the force that it has there [m/N].

    k/b·|1 − r_rp/(R_p·√S)|/(1 + r_rp·κ), φ [rad]: Archard's k·p·s with the time that the contact needs to pass the
    point; how the pressure is spread over the contact does not matter.

    References
    ----------
    Theory page equation (97): Archard (1953) for k·F·s; own derivation.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = flank_depth_per_force(load_reducer("rv20e"), np.radians([0.0, 46.0, 180.0]))
    >>> (1e6 * 1e6 * 500.0 * found).round(3).tolist()  # a million passes under 500 N: root, flank, tip [µm]
    [0.001, 0.01, 0.016]
    """
    stage = reducer.cycloid_stage
    rolling = stage.pin_radius / (stage.pin_circle_radius * pole_distance(stage.shortening, angle))
    bend = 1.0 + stage.pin_radius * path_curvature(stage, angle)
    return np.asarray(reducer.friction.wear / stage.face_width * np.abs(1.0 - rolling) / bend)


def pin_depth_per_work(reducer: Reducer) -> float:
    """Return what a pin loses on its radius over ΣF·s of the discs along it [1/N].

    k/(2π·r_rp·b·discs): it turns slowly against its groove, so that it stays round, and discs wear it alike (assumed).

    References
    ----------
    Theory page equation (99): Archard (1953); own derivation.
    """
    stage = reducer.cycloid_stage
    area = 2.0 * pi * stage.pin_radius * stage.face_width * reducer.disc_count
    return reducer.friction.wear / area


@lru_cache(maxsize=32)  # every question about the same drawing asks again
def wear_of(
    reducer: Reducer,
    cases: tuple[LoadCase, ...],
    hours: float,
    torque: float | None = None,
    disc_temperature: float = 0.0,
    step: float = STEP,
) -> Wear:
    """Return the wear of a reducer with exact parts over hours of a duty cycle.

    Theory page equations (97) to (99). Forces follow from the parts as they are worn, in steps of the midpoint rule; k
    is constant, and uncertain by powers of ten.

    Parameters
    ----------
    reducer
        Its modification is the one in force.
    cases
        Load cases, of which those that state a speed make the duty cycle, each with its share of the time.
    hours
        Hours of turning [h].
    torque, disc_temperature
        What a load case has that states none; the test torque unless given [N·m, K].
    step
        Largest wear in one step [m].

    References
    ----------
    Archard (1953); own derivation.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = wear_of(load_reducer("rv20e"), (LoadCase("rated", torque=-167, speed=15),), 6000)
    >>> round(1e6 * float(found.depth.max()), 2), round(1e6 * found.pin_depth, 2)  # off flanks, off pins' radius [µm]
    (2.27, 0.12)
    """
    duty = require_duty(f"wear of {reducer.name}", cases)
    default = reducer.load.test_torque if torque is None else torque
    together = sum(case.share for case in duty)
    phases = tuple(
        DutyPhase(
            torque=default if case.torque is None else case.torque,
            disc_temperature=disc_temperature if case.disc_temperature is None else case.disc_temperature,
            turns=60.0 * case.speed * case.share / together,  # type: ignore[operator]  # it states one
        )
        for case in duty
    )
    return _worn(reducer, phases, hours, step)


def _worn(reducer: Reducer, phases: tuple[DutyPhase, ...], hours: float, step: float) -> Wear:
    count = reducer.cycloid_stage.pin_count * PHASES // _TOGETHER
    angle = 2.0 * pi / count * (np.arange(count) + 0.5 - 0.5 / _TOGETHER)
    depth, pins, volume = np.zeros(count), 0.0, 0.0
    first, across, _ = _rates(reducer, phases, angle, depth, pins)
    most = hours * max(float(first.max()), 2.0 * across)
    if most > LARGEST_FREE:
        fitting = hours * LARGEST_FREE / most
        allowed = f"up to {fitting:.3g} of this duty, which wear {LARGEST_FREE / MICROMETRE:g} µm off"
        raise InputError.at(f"wear of {reducer.name}", "hours", hours, allowed)
    number = max(ceil(most / step), 1)
    own, steps = hours / number, list[_Step]()
    for _ in range(number if hours else 0):
        flank, round_pin, _ = _rates(reducer, phases, angle, depth, pins)
        middle = depth + own / 2.0 * flank, pins + own / 2.0 * round_pin
        steps.append(_Step(hours=own, start=_form(reducer, angle, depth), middle=_form(reducer, angle, middle[0])))
        flank, round_pin, lost = _rates(reducer, phases, angle, *middle)
        depth, pins, volume = depth + own * flank, pins + own * round_pin, volume + own * lost
    return Wear(
        hours=hours,
        angle=angle,
        depth=depth,
        pin_depth=pins,
        volume=volume,
        form=_form(reducer, angle, depth),
        phases=phases,
        steps=tuple(steps),
    )


def _form(reducer: Reducer, angle: Points, depth: Points) -> PartForm | None:
    """Return the form of a reducer's parts with worn flanks, as it is where nothing is worn."""
    if not depth.any():
        return reducer.form
    worn = FlankForm(spaces=1, angle=tuple(angle.tolist()), deviation=tuple((-depth).tolist()))
    return replace(reducer.form or PartForm(), worn=worn)


def _rates(
    reducer: Reducer, phases: Sequence[DutyPhase], angle: Points, depth: Points, pins: float
) -> tuple[Points, float, float]:
    """Return what an hour takes off the flanks and off the pins' radius, and the volume off all flanks [m, m, m³]."""
    stage = reducer.cycloid_stage
    flank, work = np.zeros(depth.size), 0.0
    for phase in phases:
        # Pins that are thinner by so much are teeth that are ground by so much larger ones.
        warm = reducer.with_warmer_discs(phase.disc_temperature)
        modification = replace(warm.modification, equidistant=warm.modification.equidistant + 2.0 * pins)
        worn = replace(warm, modification=modification, form=_form(reducer, angle, depth))
        solved = perfect_reducer(worn, phase.torque)
        if solved.equilibria.status.any():
            raise SolveError(f"Wear of {reducer.name}: no equilibrium under {phase.torque:g} N·m.")
        at, force = _force_over_flank(solved)
        # All pins pass every tooth space once within an output turn.
        passes = phase.turns * stage.pin_count
        flank += passes * (flank_depth_per_force(reducer, at) * force).reshape(-1, _TOGETHER).mean(axis=1)
        ways = np.abs(sliding_ways(reducer, solved.equilibria.carrier_angle))
        work += phase.turns * 2.0 * pi * float((solved.forces.pins * ways).sum(axis=(2, 3)).mean())
    return flank, work / stage.pin_count * pin_depth_per_work(reducer), work * reducer.friction.wear


def _force_over_flank(solved: Solved) -> tuple[Float[np.ndarray, " phase"], Float[np.ndarray, " phase"]]:
    """Return φ from 0, and the force of a pin there, mean of the discs [rad, N].

    Within a pin pitch of the crank the pins together are at every phase of a turn of φ once.
    """
    reducer = solved.equilibria.reducer
    count = reducer.cycloid_stage.pin_count * PHASES
    at = np.rint(angles_of_pins(reducer, solved.equilibria.carrier_angle) * count / (2.0 * pi)).astype(int) % count
    force = np.bincount(at.ravel(), solved.forces.pins[0].ravel(), count)
    return 2.0 * pi * np.arange(count) / count, force / reducer.disc_count
