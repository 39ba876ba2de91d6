"""Simulation of the equivalent model in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from tolalloc.reducers.dynamics.motion import Motion
from tolalloc.reducers.dynamics.properties import Damping, Inertia, Integrator
from tolalloc.reducers.dynamics.solvers.stepping import Parts, State, StepRecord, advance
from tolalloc.reducers.dynamics.tables import Steps
from tolalloc.reducers.equivalent.model import EquivalentModel

Progress = Callable[[float], None]
"""Told which share of the time is simulated [-]."""


def untold(share: float) -> None:
    """Tell nobody."""


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """Samples over time; from a step that found no equilibrium on, not a number and its status."""

    # Times and nominal carrier angles θc [s, rad]
    time: Float[np.ndarray, " time"]
    carrier_angle: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, "sample time"]  # Carrier rotation beyond θc, output side [rad]
    # Of the carrier, nominal motion included [rad/s, rad/s²]
    output_speed: Float[np.ndarray, "sample time"]
    output_acceleration: Float[np.ndarray, "sample time"]
    # Torque that drives the sun gear; times its speed it is the input power. The sun's own inertia is not in it [N·m].
    input_torque: Float[np.ndarray, "sample time"]
    # Number of pins that carry load, `tolalloc.reducers.equivalent.answers.Status`, unbalanced over largest force [-]
    pins_in_contact: UInt16[np.ndarray, "sample time disc"]
    status: UInt8[np.ndarray, "sample time"]
    residual: Float[np.ndarray, "sample time"]
    # At the times asked for: deviations q from the nominal motion, in the order of
    # `tolalloc.reducers.equivalent.kinematics.Coordinates`, and their derivatives [m, rad, and per s, per s²]
    displacement: Float[np.ndarray, "sample observed coordinate"]
    velocity: Float[np.ndarray, "sample observed coordinate"]
    acceleration: Float[np.ndarray, "sample observed coordinate"]
    pin_forces: Float[np.ndarray, "sample observed disc pin"]  # Normal force between every pin and every disc there [N]


def _record(steps: Steps, samples: int, observe: Int[np.ndarray, " observed"]) -> StepRecord:
    reducer, times, size = steps.reducer, steps.motion.time.size, steps.coordinates.count
    slot = np.full(times, -1)
    slot[observe] = np.arange(observe.size)
    curve, whole = (samples, times), (samples, observe.size, size)
    return StepRecord(
        rotation=np.empty(curve),
        speed=np.empty(curve),
        acceleration=np.empty(curve),
        input_torque=np.empty(curve),
        touching=np.empty((*curve, reducer.disc_count), np.uint16),
        status=np.empty(curve, np.uint8),
        residual=np.empty(curve),
        slot=slot,
        coordinate=np.empty(whole),
        velocity=np.empty(whole),
        second=np.empty(whole),
        pin_force=np.empty((samples, observe.size, reducer.disc_count, reducer.cycloid_stage.pin_count)),
    )


def simulate(
    model: EquivalentModel,
    errors: Float[np.ndarray, "sample column"],
    motion: Motion,
    inertia: Inertia,
    damping: Damping,
    integrator: Integrator,
    observe: Int[np.ndarray, " observed"] | None = None,
    progress: Progress = untold,
) -> Simulated:
    """Return what every sample does over time.

    M·q̈ + C·q̇ + ∂V(q, θc)/∂q = f − M·a, with V the energy of the static model, f the torque on the carrier and a the
    acceleration of the nominal motion; the sun's rotation is prescribed. At time 0 every sample is in the equilibrium
    of the static model, its deviations have no velocity and the acceleration −a that follows.

    Errors are deviations in the order of the model's columns [m, angles rad]. The whole state is given at the steps
    with the numbers to observe, each once.

    Raises
    ------
    InputError
        Damping of an interface that is not there or has play.
    """
    steps = Steps(model=model, motion=motion, inertia=inertia, damping=damping, integrator=integrator)
    columns, coordinates, samples = model.error_columns, steps.coordinates, errors.shape[0]
    chosen = np.array([], np.int64) if observe is None else observe
    record, rotation = _record(steps, samples, chosen), coordinates.carrier + 2
    nothing = np.zeros((4, samples, coordinates.count))
    state = State(nothing[0], nothing[1], nothing[2], nothing[3], np.zeros(samples, np.uint8))
    scale, given = steps.scale, np.ascontiguousarray(errors)
    parts = Parts(
        steps.mass, steps.retained, rotation, float(scale[rotation]), steps.played_meshes, steps.sun_base_radius
    )
    own = (columns.layout, columns.map, model.design, given)
    for first, angles, tables in steps.parts():
        advance(first, angles, tables, parts, integrator, motion.step, *own, state, record)
        progress((first + len(angles.stiffness)) / motion.time.size)
    return Simulated(
        time=motion.time,
        carrier_angle=motion.carrier_angle,
        transmission_error=record.rotation,
        output_speed=motion.carrier_speed + record.speed,
        output_acceleration=motion.carrier_acceleration + record.acceleration,
        input_torque=record.input_torque,
        pins_in_contact=record.touching,
        status=record.status,
        residual=record.residual,
        displacement=record.coordinate * scale,
        velocity=record.velocity * scale,
        acceleration=record.second * scale,
        pin_forces=record.pin_force,
    )
