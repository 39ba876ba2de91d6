"""Simulation of the equivalent model in time, and the tables of its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from tolalloc.reducers.equivalent.condensation import (
    CondensedAngles,
    bilateral_groups,
    condense,
    retained_coordinates,
    rotation_scale,
)
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.springs import Coordinates, Positions
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.wings.motion.motion import Damping, Inertia, Integrator, Motion, nominal_acceleration
from tolalloc.wings.motion.solvers.stepping import Parts, State, StepRecord, advance

_STEPS_AT_ONCE = 512
Progress = Callable[[float], None]
"""Told which share of the time is simulated [-]."""


class StepTables(NamedTuple):
    """Tables of some successive steps, beside the condensed ones. All coordinates are lengths, as there."""

    stiffness: Float[np.ndarray, "step coordinate coordinate"]  # Of the interfaces without play [N/m]
    damping: Float[np.ndarray, "step coordinate coordinate"]  # Of these and the masses [N·s/m]
    # Change of all coordinates per change of the retained ones [m/m]
    by_retained: Float[np.ndarray, "step coordinate retained"]
    # Change of all coordinates per force at fixed retained ones [m/N]
    flexibility: Float[np.ndarray, "step coordinate coordinate"]
    # What a displacement beyond the predicted one adds to algorithmic acceleration, velocity and acceleration [1/s²,
    # 1/s, 1/s²]; zero at the start, which is a static equilibrium
    rates: Float[np.ndarray, "step 3"]
    acceleration: Float[np.ndarray, "step coordinate"]  # Nominal acceleration [m/s²]
    torque: Float[np.ndarray, " step"]  # Torque on the carrier [N·m]
    # Torque of the meshes without play on the sun, against its rotation, per coordinate, velocity and value [N, N·s, N]
    drive_by_coordinate: Float[np.ndarray, "step coordinate"]
    drive_by_velocity: Float[np.ndarray, "step coordinate"]
    drive_by_load: Float[np.ndarray, "step load"]


@dataclass(frozen=True, kw_only=True)
class Steps:
    """Everything but the samples of a simulation."""

    # As in `tolalloc.wings.motion.stepping.simulate`; numbers in SI units [-]
    model: EquivalentModel
    motion: Motion
    inertia: Inertia
    damping: Damping
    integrator: Integrator

    def __post_init__(self) -> None:
        self.damping.check(bilateral_groups(self._positions(slice(0, 1))))

    @property
    def reducer(self) -> Reducer:
        """The nominal design."""
        return self.model.reducer

    @property
    def coordinates(self) -> Coordinates:
        """The layout of q."""
        return Coordinates.of(self.reducer)

    @cached_property
    def scale(self) -> Float[np.ndarray, " coordinate"]:
        """Coordinate of q per length that the tables have instead [m/m, rad/m]."""
        return np.asarray(rotation_scale(self.reducer, self.coordinates))

    @cached_property
    def mass(self) -> Float[np.ndarray, " coordinate"]:
        """Mass of every coordinate taken as a length [kg]."""
        return np.asarray(self.inertia.diagonal(self.coordinates) * self.scale**2)

    @cached_property
    def retained(self) -> Int[np.ndarray, " retained"]:
        """Which coordinates pins and play touch, the discs' first [-]."""
        return retained_coordinates(self.reducer, self.coordinates, bilateral_groups(self._positions(slice(0, 1))))

    @property
    def played_meshes(self) -> int:
        """Number of meshes with play; they are the first elements of all that can have play [-]."""
        return self.reducer.crank_count if self.reducer.clearance_of("gear_mesh") else 0

    def parts(self) -> Iterator[tuple[int, CondensedAngles, StepTables]]:
        """Yield the first step and the tables of each part of the steps; memory holds one part at a time.

        The condensed tables are as the contact solver takes them, with inertia and damping in ``stiffness`` [N/m] and
        with the ``load`` on all coordinates instead of the retained ones [N/m, last N/(N·m)].
        """
        for first in range(0, self.motion.time.size, _STEPS_AT_ONCE):
            yield first, *self._tables(slice(first, min(first + _STEPS_AT_ONCE, self.motion.time.size)))

    def _positions(self, steps: slice) -> Positions:
        return Positions(self.reducer, self.motion.carrier_angle[steps], self.model.orders)

    def _springs(
        self, at: Positions
    ) -> tuple[dict[str, Float[np.ndarray, "step ..."]], Float[np.ndarray, "step coordinate load"]]:
        """Return what `StepTables` says of the bilateral springs, and their load on all coordinates."""
        steps, size = at.carrier_angle.size, self.coordinates.count
        loads = self.model.error_columns.layout.torque + 1
        by_coordinate, by_velocity, by_load = np.zeros((steps, size)), np.zeros((steps, size)), np.zeros((steps, loads))
        stiffness, load = np.zeros((steps, size, size)), np.zeros((steps, size, loads))
        damping = np.zeros((steps, size, size)) + self.damping.mass_proportional * np.diag(self.mass)
        first = 0
        for group in bilateral_groups(at):
            own = slice(first, first + len(group.columns))
            first = own.stop
            if group.contact == "play":
                continue
            rows, own_damping = group.displacement * self.scale, self.damping.interfaces.get(group.stiffness_name, 0.0)
            delay = self.damping.stiffness_proportional + own_damping
            weighted = np.swapaxes(rows * group.stiffness[..., np.newaxis], 1, 2)
            between = weighted @ rows
            stiffness += between
            damping += delay * between
            load[:, :, own] = -(weighted @ group.error)
            if group.stiffness_name == "gear_mesh":
                by_coordinate[:] = self.reducer.sun_base_radius * weighted.sum(axis=2)
                by_velocity[:] = delay * by_coordinate
                force_by_error = (group.stiffness[..., np.newaxis] * group.error).sum(axis=1)
                by_load[:, own] = self.reducer.sun_base_radius * force_by_error
        rotation = self.coordinates.carrier + 2
        load[:, rotation, -1] = self.scale[rotation]
        return {
            "stiffness": stiffness,
            "damping": damping,
            "drive_by_coordinate": by_coordinate,
            "drive_by_velocity": by_velocity,
            "drive_by_load": by_load,
        }, load

    def _tables(self, steps: slice) -> tuple[CondensedAngles, StepTables]:
        at, motion = self._positions(steps), self.motion
        (springs, load), size, count = self._springs(at), self.coordinates.count, at.carrier_angle.size
        rates = np.tile(self.integrator.rates(motion.step), (count, 1))
        if steps.start == 0:
            rates[0] = 0.0
        retained, rest = self.retained, np.setdiff1d(np.arange(size), self.retained)
        stiffness = springs["stiffness"] + rates[:, 1, None, None] * springs["damping"]
        stiffness += rates[:, 2, None, None] * np.diag(self.mass)
        by_retained, flexibility = np.zeros((count, size, retained.size)), np.zeros((count, size, size))
        inverse = np.linalg.inv(stiffness[:, rest[:, np.newaxis], rest])
        by_retained[:, retained] = np.eye(retained.size)
        by_retained[:, rest] = -inverse @ stiffness[:, rest[:, np.newaxis], retained]
        flexibility[:, rest[:, np.newaxis], rest] = inverse
        condensed = stiffness[:, retained] @ by_retained
        part = Motion(**{name: values[steps] for name, values in vars(motion).items()})
        angles = condense(self.reducer, self.model.orders, at.carrier_angle)._replace(
            stiffness=0.5 * (condensed + np.swapaxes(condensed, 1, 2)),
            load=np.ascontiguousarray(np.swapaxes(load, 1, 2)),
        )
        return angles, StepTables(
            **springs,
            by_retained=by_retained,
            flexibility=flexibility,
            rates=rates,
            acceleration=nominal_acceleration(at, part) / self.scale,
            torque=part.torque,
        )


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
    # Number of pins that carry load, `tolalloc.reducers.equivalent.model.Status`, unbalanced over largest force [-]
    pins_in_contact: UInt16[np.ndarray, "sample time disc"]
    status: UInt8[np.ndarray, "sample time"]
    residual: Float[np.ndarray, "sample time"]
    # At the times asked for: deviations q from the nominal motion, in the order of
    # `tolalloc.reducers.equivalent.springs.Coordinates`, and their derivatives [m, rad, and per s, per s²]
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
        **{name: np.empty(curve) for name in ("rotation", "speed", "acceleration", "input_torque", "residual")},
        **{name: np.empty(whole) for name in ("coordinate", "velocity", "second")},
        touching=np.empty((*curve, reducer.disc_count), np.uint16),
        status=np.empty(curve, np.uint8),
        slot=slot,
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

    Theory page equations (61) to (63). Gaps are linear in the displacements, as in the static model; waves are drawn
    well with 20 steps or more.

    Under a constant load the drive needs T/i of the torque on the carrier, whatever the masses.

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> from tolalloc.wings.motion.motion import SpeedProfile, inertia_of, motion_of, newmark
    >>> reducer = load_reducer("rv40e_xi2015")
    >>> rest = motion_of(reducer, SpeedProfile.constant(0.0), SpeedProfile.constant(-572.0), duration=1e-3, steps=2)
    >>> model = EquivalentModel(reducer)
    >>> exact = np.zeros((1, len(model.columns)))
    >>> found = simulate(model, exact, rest, inertia_of(reducer), Damping(), newmark())
    >>> round(float(found.input_torque[0, -1]), 3)  # 572/81 [N·m]
    7.062
    """
    steps = Steps(model=model, motion=motion, inertia=inertia, damping=damping, integrator=integrator)
    columns, coordinates, samples = model.error_columns, steps.coordinates, errors.shape[0]
    chosen = np.array([], np.int64) if observe is None else observe
    record, rotation = _record(steps, samples, chosen), coordinates.carrier + 2
    nothing = np.zeros((4, samples, coordinates.count))
    state = State(nothing[0], nothing[1], nothing[2], nothing[3], np.zeros(samples, np.uint8))
    scale, given = steps.scale, np.ascontiguousarray(errors)
    parts = Parts(
        steps.mass, steps.retained, rotation, float(scale[rotation]), steps.played_meshes, model.reducer.sun_base_radius
    )
    own = (columns.layout, columns.map, model.design, given)
    for first, angles, tables in steps.parts():
        advance(samples, first, angles, tables, parts, integrator, motion.step, *own, state, record)
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
