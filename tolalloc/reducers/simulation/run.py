"""A reducer driven through a speed and a torque profile, and the static model at the same angles."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import RPM
from tolalloc.reducers.dynamics.motion import ASSUMPTIONS, Damping, Motion
from tolalloc.reducers.dynamics.prototype import TimeCourse, TimeSteps, simulate_prototype
from tolalloc.reducers.dynamics.simulation import simulate as simulate_model
from tolalloc.reducers.dynamics.speeds import modes
from tolalloc.reducers.equivalent.answers import Status
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.simulation.answer import AtRest, SimulationAnswer, TimeSeries
from tolalloc.reducers.simulation.request import INTEGRATORS, PROTOTYPE_RADIUS, PreparedSimulation
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress

MOST_ANGLES = 5000
"""Angles at which the static model is asked beside the simulation [-]."""
MODE_ANGLES = 200
"""Angles at which natural frequencies are looked for [-]."""


def simulate(prepared: PreparedSimulation, progress: Progress) -> SimulationAnswer:
    """Return what a reducer does over time, and the static model at the same angles.

    The simulated milliseconds are told as progress.

    Raises
    ------
    SolveError
        A time step or an angle without equilibrium.
    """
    asked, motion = prepared.asked, prepared.motion
    progress.begin(f"in motion, {asked.engine}")
    start = time.perf_counter()
    simulated = _prototype if asked.engine == "exudyn" else _equivalent
    series = simulated(prepared, motion, _milliseconds(asked.duration, progress))
    seconds = time.perf_counter() - start
    count = round(prepared.crank_turns * prepared.crank_turn / motion.step)
    steady = slice(motion.time.size - count, motion.time.size)
    progress.begin("at rest")
    at_rest = _at_rest(prepared, motion, steady)
    return SimulationAnswer(
        header=Header(
            name=prepared.unit.name,
            model=prepared.reducer.name,
            conditions={
                "input speed [rpm]": prepared.speed / RPM,
                "torque on the carrier [N·m]": prepared.torque,
                "engine": asked.engine,
            },
            assumptions=_assumptions(prepared),
        ),
        reducer=prepared.reducer,
        engine=asked.engine,
        speed=prepared.speed,
        torque=prepared.torque,
        series=series,
        steady=steady,
        crank_turns=prepared.crank_turns,
        at_rest=at_rest,
        natural_frequency=_natural_frequency(prepared, motion, steady),
        seconds=seconds,
    )


def _milliseconds(duration: float, progress: Progress) -> Callable[[float], None]:
    """Return what turns the share of the time that is simulated into further milliseconds."""
    told = 0

    def tell(share: float) -> None:
        nonlocal told
        new = int(1e3 * duration * share + 1e-6) - told
        if new > 0:
            progress.advance(new)
            told += new

    return tell


def _damping(prepared: PreparedSimulation) -> Damping:
    return Damping(mass_proportional=prepared.mass_damping, stiffness_proportional=prepared.asked.damping)


def _equivalent(prepared: PreparedSimulation, motion: Motion, tell: Callable[[float], None]) -> TimeSeries:
    """Simulate the equivalent model."""
    asked, every = prepared.asked, np.arange(motion.time.size)
    given = (prepared.inertia, _damping(prepared), INTEGRATORS[asked.engine])
    found = simulate_model(prepared.model, prepared.errors, motion, *given, every, tell)
    failed = np.flatnonzero(found.status[0] != Status.CONVERGED)
    if failed.size:
        outcome = Status(int(found.status[0, failed[0]])).sentence
        raise SolveError(f"unit {prepared.unit.name}: no motion from {motion.time[failed[0]]:.4g} s on: {outcome}.")
    return _series(
        prepared,
        motion,
        output_speed=found.output_speed[0],
        output_acceleration=found.output_acceleration[0],
        transmission_error=found.transmission_error[0],
        input_torque=found.input_torque[0],
        pin_forces=found.pin_forces[0],
    )


def _prototype(prepared: PreparedSimulation, motion: Motion, tell: Callable[[float], None]) -> TimeSeries:
    """Simulate the virtual prototype."""
    asked = prepared.asked
    found = simulate_prototype(
        prepared.reducer,
        prepared.inertia,
        _damping(prepared),
        TimeCourse.step(prepared.speed, 0.0, asked.ramp),
        TimeCourse.step(prepared.torque, asked.ramp, prepared.loaded),
        TimeSteps(duration=asked.duration, step=motion.step, output_step=motion.step, spectral_radius=PROTOTYPE_RADIUS),
        prepared.prototype_errors,
        tell,
    )
    if found.time.size != motion.time.size:
        raise SolveError(f"virtual prototype: {found.time.size} answers in {motion.time.size} time steps.")
    return _series(
        prepared,
        motion,
        output_speed=found.output_speed,
        output_acceleration=found.output_acceleration,
        transmission_error=found.transmission_error,
        input_torque=found.input_torque,
        pin_forces=found.pin_forces,
    )


def _series(prepared: PreparedSimulation, motion: Motion, **found: np.ndarray) -> TimeSeries:
    """Return what an engine found beside what drove it."""
    ratio = prepared.reducer.ratio
    return TimeSeries(
        time=motion.time,
        carrier_angle=motion.carrier_angle,
        input_speed=motion.carrier_speed * ratio,
        input_acceleration=motion.carrier_acceleration * ratio,
        output_torque=motion.torque,
        **found,
    )


def _at_rest(prepared: PreparedSimulation, motion: Motion, steady: slice) -> AtRest:
    """Return the static model at some angles of the steady part."""
    steps = np.arange(motion.time.size)[steady]
    steps = steps[:: -(-steps.size // MOST_ANGLES)]
    start = time.perf_counter()
    found = prepared.model.equilibria(prepared.errors, prepared.torque, motion.carrier_angle[steps])
    pins, worst = forces(found).pins[0], Status(int(found.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"unit {prepared.unit.name}: no equilibrium at rest at some angle: {worst.sentence}.")
    return AtRest(
        steps=steps,
        transmission_error=found.transmission_error[0],
        pin_forces=pins,
        seconds=time.perf_counter() - start,
    )


def _natural_frequency(prepared: PreparedSimulation, motion: Motion, steady: slice) -> float | None:
    """Return the lowest natural frequency over the steady part [Hz]."""
    angle = motion.carrier_angle[steady]
    try:
        found = modes(
            prepared.model,
            prepared.errors[0],
            prepared.torque,
            prepared.inertia,
            angle[:: -(-angle.size // MODE_ANGLES)],
        )
    except InputError:  # springs that are not linear have no natural frequency
        return None
    return float(found.frequency.min())


def _assumptions(prepared: PreparedSimulation) -> tuple[str, ...]:
    """Return what no source prints."""
    asked = prepared.asked
    prototype = asked.engine == "exudyn"
    damped = "the carrier's rotation alone" if prototype else "every part"
    stiffened = "bearings" if prototype else "meshes and bearings"
    return (
        *prepared.reducer.assumptions,
        *prepared.unit.assumptions,
        *(
            (f"{asked.pin_stiffness:g} N/m at every pin contact, in place of the reducer's own law",)
            if asked.pin_stiffness is not None
            else ()
        ),
        *ASSUMPTIONS,
        f"the carrier turns {asked.output_inertia:g} kg·m² besides its own",
        f"damping: {asked.damping:g} s times the stiffness of {stiffened} and {prepared.mass_damping:.3g} 1/s times "
        f"the mass of {damped}, on the deviation from the nominal motion; none in pin contacts",
        "speed and load rise by the cubic 3s² − 2s³, the load in half the time of the speed and after it",
        "no friction, no lubricant film",
        *(
            ("the first stage does not yield, in the prototype and in the static model beside it",)
            if asked.engine == "exudyn"
            else ()
        ),
    )
