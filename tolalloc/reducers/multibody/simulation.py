"""Run the virtual prototype of a reducer over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reducers.dynamics.properties import Damping, Inertia
from tolalloc.reducers.dynamics.simulation import Progress, untold
from tolalloc.reducers.multibody.drive import TimeCourse
from tolalloc.reducers.multibody.part_errors import mesh_of, part_errors
from tolalloc.reducers.multibody.prototype import assemble, reference_places
from tolalloc.reducers.multibody.solvers.pin_forces import Mesh, fill_pin_forces
from tolalloc.reducers.multibody.system import System, engine
from tolalloc.reducers.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class PrototypeAnswer:
    """What the virtual prototype does."""

    time: Float[np.ndarray, " time"]  # Times of the answers [s]
    # Of the sun, as prescribed [rad/s, rad]
    input_speed: Float[np.ndarray, " time"]
    input_angle: Float[np.ndarray, " time"]
    # Of the carrier [rad/s, rad/s², rad]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    output_angle: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]  # Carrier angle beyond the sun's over the ratio [rad]
    input_torque: Float[np.ndarray, " time"]  # On the sun, positive where it drives [N·m]
    output_torque: Float[np.ndarray, " time"]  # On the carrier, as prescribed [N·m]
    pin_forces: Float[np.ndarray, "time disc pin"]  # Normal force of every pin [N]
    kinetic_energy: Float[np.ndarray, " time"]  # Of all bodies but the sun [J]


_RESIDUAL = 1e-2
"""Unbalanced force or moment at which a time step is solved, above the rounding in the stiffest bearings [N, N·m]."""


@dataclass(frozen=True, kw_only=True)
class TimeSteps:
    """Times of a simulation.

    At a spectral radius of 0.9 a start with parts that do not fit by 1 µm left strongly damped rigid bearings swinging
    from step to step for good; at 0.5 and below it did not.
    """

    duration: float  # Simulated time [s]
    step: float = 1e-4  # Step of the integration [s]
    output_step: float = 1e-3  # Time between answers [s]
    spectral_radius: float = 0.5  # What the generalised-α method leaves of the fastest vibrations in one step [-]

    def __post_init__(self) -> None:
        if not 0 < self.step <= self.output_step <= self.duration < float("inf"):
            raise InputError(
                f"virtual prototype: step {self.step!r} s, output step {self.output_step!r} s and duration "
                f"{self.duration!r} s are not in this order; allowed are numbers above 0 that do not fall."
            )
        if not 0.0 <= self.spectral_radius <= 1.0:
            raise InputError.at("virtual prototype", "spectral radius", self.spectral_radius, "0 to 1")


def _settings(steps: TimeSteps) -> Any:
    settings = engine().SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = steps.duration
    integration.numberOfSteps = max(round(steps.duration / steps.step), 1)
    # The engine's own tolerances lie below the rounding of the forces in stiff bearings, so that it would never stop.
    integration.newton.relativeTolerance = 1e-6
    integration.newton.absoluteTolerance = _RESIDUAL
    integration.generalizedAlpha.spectralRadius = steps.spectral_radius
    integration.verboseMode = 0
    settings.show.computationTime = False
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = steps.output_step
    return settings


def _run(prototype: System, steps: TimeSteps, progress: Progress) -> None:
    def before_step(_system: Any, time: float) -> bool:
        progress(min(time / steps.duration, 1.0))
        return True

    prototype.content.SetPreStepUserFunction(before_step)
    exudyn = engine()
    exudyn.config.printToConsole = False  # its remarks are for those who build its models
    try:
        prototype.content.SolveDynamic(_settings(steps), showHints=False)
    except exudyn.SolverError as failed:
        raise SolveError(
            "virtual prototype: the multibody engine found no solution of a time step; a shorter step may help."
        ) from failed
    finally:
        exudyn.config.printToConsole = True
    progress(1.0)


def _answer(
    prototype: System, reducer: Reducer, inertia: Inertia, mesh: Mesh, sun_speed: TimeCourse, load: TimeCourse
) -> PrototypeAnswer:
    stored = prototype.content.GetSensorStoredData
    time = stored(prototype.carrier_acceleration)[:, 0]
    moved, speed = (np.stack([stored(part[kind])[:, 1:] for part in prototype.parts], axis=1) for kind in (0, 1))
    first_disc = 1 + reducer.crank_count
    moved[:, :, :2] += reference_places(reducer)
    pin_forces = np.empty((time.size, reducer.disc_count, mesh.place.size))
    fill_pin_forces(mesh, moved[:, first_disc:].reshape(time.size, -1), pin_forces)
    bodies = (
        [(inertia.carrier, inertia.carrier_moment)]
        + [(inertia.planet, inertia.planet_moment)] * reducer.crank_count
        + [(inertia.disc, inertia.disc_moment)] * reducer.disc_count
    )
    weight = np.array([(mass, mass, moment) for mass, moment in bodies])
    input_angle = np.array([sun_speed.integral(at) for at in time])
    gears = reducer.first_stage.sun_teeth / reducer.first_stage.planet_teeth
    on_cranks = sum(stored(gear)[:, 1] for gear in prototype.gears)
    return PrototypeAnswer(
        time=time,
        input_speed=np.array([sun_speed.at(at) for at in time]),
        input_angle=input_angle,
        output_speed=speed[:, 0, 2],
        output_acceleration=stored(prototype.carrier_acceleration)[:, 3],
        output_angle=moved[:, 0, 2],
        transmission_error=moved[:, 0, 2] - input_angle / reducer.ratio,
        input_torque=-gears * np.asarray(on_cranks),
        output_torque=np.array([load.at(at) for at in time]),
        pin_forces=pin_forces,
        kinetic_energy=np.asarray((weight * speed**2).sum(axis=(1, 2)) / 2),
    )


def simulate_prototype(
    reducer: Reducer,
    inertia: Inertia,
    damping: Damping,
    speed: TimeCourse,
    torque: TimeCourse,
    steps: TimeSteps,
    errors: Mapping[str, float] | None = None,
    progress: Progress = untold,
) -> PrototypeAnswer:
    """Return what the virtual prototype of a reducer does, from rest at the carrier angle 0.

    Of the nominal design count the stiffness of bearings and pin contacts and the modification; its first stage is
    ideal gears, so that the sun's mass does not count. Damping is that of all bearings alike, and by the carrier's
    inertia of how its speed leaves the nominal one; contacts of pins and teeth have none. The speed is the sun's
    [rad/s], the torque that on the carrier, negative against the rotation [N·m]. Errors are columns of
    `tolalloc.reducers.multibody.part_errors.part_errors` [m]; progress is told which share is done.

    Raises
    ------
    InputError
        The engine is not installed, or a design, damping or error that the prototype does not know.
    SolveError
        A time step without a solution.
    """
    engine()
    if damping.interfaces:
        raise InputError.at("virtual prototype", "interface with its own damping", [*damping.interfaces], "none")
    found = part_errors(reducer, errors or {})
    mesh = mesh_of(reducer, found)
    prototype = assemble(reducer, inertia, damping, found, mesh, speed, torque)
    _run(prototype, steps, progress)
    answer = _answer(prototype, reducer, inertia, mesh, speed, torque)
    if not np.isfinite(answer.transmission_error).all():
        raise SolveError("virtual prototype: the simulation left finite numbers; a shorter step may help.")
    return answer
