"""Time steps of all samples: each step is an equilibrium of springs, contacts, inertia and damping.

With an implicit integrator, inertia and damping are springs and forces of the step. So the step's energy is as convex
as the static one, with a stiffness that has no zero eigenvalue, and the static contact solver finds its minimum. Sought
is the displacement beyond the predicted one: no large forces of inertia cancel, so the solver's tolerance is a share of
the forces that are there.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from tolalloc.reducers.equivalent.solvers.contact_solver import (
    along,
    compress,
    contact_force,
    equilibrium,
    fill_loads,
    make_problem,
    make_work,
    play_force,
    values_of,
    with_tables,
)
from tolalloc.reducers.equivalent.solvers.records import CONVERGED, NOT_FINITE
from tolalloc.running.compiled import in_threads, jit


class Parts(NamedTuple):
    """What is the same at every step."""

    mass: Float[np.ndarray, " coordinate"]  # Of every coordinate [kg]
    retained: Int[np.ndarray, " retained"]  # Which coordinates pins and play touch [-]
    carrier: int  # Which coordinate is the carrier's rotation [-]
    carrier_scale: float  # Its rotation per length [rad/m]
    played_meshes: int  # Number of meshes with play, the first of the elements with play [-]
    sun_base_radius: float  # Lever of the mesh forces on the sun [m]


class State(NamedTuple):
    """Coordinates, velocity, acceleration and algorithmic acceleration [m, m/s, m/s²]; outcome so far [-]."""

    coordinate: Float[np.ndarray, "sample coordinate"]
    velocity: Float[np.ndarray, "sample coordinate"]
    acceleration: Float[np.ndarray, "sample coordinate"]
    algorithmic: Float[np.ndarray, "sample coordinate"]
    status: UInt8[np.ndarray, " sample"]


class StepRecord(NamedTuple):
    """What the steps leave, filled in by `advance`."""

    # Of the carrier, beyond the nominal ones [rad, rad/s, rad/s²]
    rotation: Float[np.ndarray, "sample time"]
    speed: Float[np.ndarray, "sample time"]
    acceleration: Float[np.ndarray, "sample time"]
    input_torque: Float[np.ndarray, "sample time"]  # Torque that the meshes ask of the sun [N·m]
    touching: UInt16[np.ndarray, "sample time disc"]  # Pins in contact [-]
    # Outcome; unbalanced force over the largest force [-]
    status: UInt8[np.ndarray, "sample time"]
    residual: Float[np.ndarray, "sample time"]
    slot: Int[np.ndarray, " time"]  # Place of each step among the observed ones, −1 for none [-]
    # All coordinates and their derivatives at the observed steps [m, m/s, m/s²]
    coordinate: Float[np.ndarray, "sample observed coordinate"]
    velocity: Float[np.ndarray, "sample observed coordinate"]
    second: Float[np.ndarray, "sample observed coordinate"]
    pin_force: Float[np.ndarray, "sample observed disc pin"]  # Force of every pin there [N]


@jit
def _predict(integrator, h, x, v, acceleration, algorithmic):
    """Move the state of one sample to what the next step would be without further displacement."""
    keep = 1.0 / (1.0 - integrator.alpha_f)
    for i in range(x.size):
        a = algorithmic[i]
        x[i] += h * v[i] + h * h * (0.5 - integrator.beta) * a
        v[i] += h * (1.0 - integrator.gamma) * a
        acceleration[i] = keep * (integrator.alpha_m * a - integrator.alpha_f * acceleration[i])
        algorithmic[i] = 0.0


@jit
def _unbalance(at, tables, mass, x, v, acceleration, force):
    """Take off the loads what springs, damping and inertia carry in the predicted state, contacts left out."""
    stiffness, damping = tables.stiffness[at], tables.damping[at]
    for i in range(x.size):
        carried = mass[i] * (acceleration[i] + tables.acceleration[at, i])
        for j in range(x.size):
            carried += stiffness[i, j] * x[j] + damping[i, j] * v[j]
        force[i] -= carried


@jit
def _problem(at, angles, tables, parts, layout, face_width, values, x, force, own, moved):
    """Return the step's problem in the displacement of the retained coordinates beyond the predicted ones x."""
    by_retained = tables.by_retained[at]
    for m in range(parts.retained.size):
        own.force[m], moved.position[m] = 0.0, x[parts.retained[m]]
        for i in range(x.size):
            own.force[m] += by_retained[i, m] * force[i]
    along(angles.contact_by_disc[at], angles.play_by_retained[at], moved.position, moved.compression, moved.play)
    own.undisturbed[:] += moved.compression
    own.play_offset[:] += moved.play
    return with_tables(at, angles, layout, face_width, values, own)


class Moved(NamedTuple):
    """Work space: predicted retained coordinates [m] and what they compress [m]."""

    position: Float[np.ndarray, " retained"]
    compression: Float[np.ndarray, " contact"]
    play: Float[np.ndarray, "element 2"]


@jit
def _correct(at, tables, q, force, x, v, acceleration, algorithmic):
    """Add to the predicted state the displacement q of the retained coordinates and what follows from it."""
    rates = tables.rates[at]
    for i in range(x.size):
        change = 0.0
        for m in range(q.size):
            change += tables.by_retained[at, i, m] * q[m]
        for j in range(x.size):
            change += tables.flexibility[at, i, j] * force[j]
        x[i] += change
        algorithmic[i] += rates[0] * change
        v[i] += rates[1] * change
        acceleration[i] += rates[2] * change


@jit
def _input_torque(at, tables, parts, problem, play, values, x, v):
    """Return the torque on the sun that balances the mesh forces."""
    torque = 0.0
    for i in range(x.size):
        torque += tables.drive_by_coordinate[at, i] * x[i] + tables.drive_by_velocity[at, i] * v[i]
    for m in range(tables.drive_by_load.shape[1]):
        torque += tables.drive_by_load[at, m] * values[m]
    for e in range(parts.played_meshes):
        force, _, _, _, _ = play_force(problem.play_stiffness[e], problem.clearance[e], play[e, 0], play[e, 1])
        torque += parts.sun_base_radius * force
    return torque


@jit
def _observe(s, slot, problem, compression, x, v, acceleration, record):
    record.coordinate[s, slot], record.velocity[s, slot], record.second[s, slot] = x, v, acceleration
    discs, pins = record.pin_force.shape[2:]
    for c in range(discs * pins):
        record.pin_force[s, slot, c // pins, c % pins], _ = contact_force(problem, c, compression[c])


@jit
def _give_up(s, time, record):
    record.rotation[s, time], record.speed[s, time], record.acceleration[s, time] = np.nan, np.nan, np.nan
    record.input_torque[s, time], record.residual[s, time], record.touching[s, time] = np.nan, np.nan, 0
    slot = record.slot[time]
    if slot >= 0:
        record.coordinate[s, slot], record.velocity[s, slot], record.second[s, slot] = np.nan, np.nan, np.nan
        record.pin_force[s, slot] = np.nan


@jit
def _advance_sample(s, first, angles, tables, parts, integrator, step, layout, mapped, design, errors, state, record):
    values = np.empty((1, layout.end))
    if not values_of(errors[s : s + 1], 0.0, layout, mapped, values)[0]:
        state.status[s] = NOT_FINITE
    own, pins = make_problem(design.law, angles), layout.pins
    contacts, elements = angles.contact_stiffness.shape[1], angles.play_stiffness.shape[1]
    work = make_work(parts.retained.size, contacts, elements)
    moved = Moved(np.empty(parts.retained.size), np.empty(contacts), np.empty((elements, 2)))
    x, v = state.coordinate[s], state.velocity[s]
    acceleration, algorithmic = state.acceleration[s], state.algorithmic[s]
    q, force, carrier = np.empty(parts.retained.size), np.empty(x.size), parts.carrier
    for at in range(tables.torque.size):
        time, ratio = first + at, 0.0
        if state.status[s] == CONVERGED:
            values[0, layout.torque] = tables.torque[at]
            for m in range(q.size):
                q[m] = x[parts.retained[m]]  # where the step is looked for first: where the last one ended
            if time > 0:
                _predict(integrator, step, x, v, acceleration, algorithmic)
            else:  # at the start springs and torque are in balance, so all parts but stay behind the nominal motion
                acceleration[:] = -tables.acceleration[0]
                algorithmic[:] = acceleration
            for m in range(q.size):
                q[m] -= x[parts.retained[m]]
            fill_loads(at, angles, layout, values[0], force, own.undisturbed, own.play_offset)
            _unbalance(at, tables, parts.mass, x, v, acceleration, force)
            problem = _problem(at, angles, tables, parts, layout, design.face_width, values[0], x, force, own, moved)
            state.status[s], ratio, _ = equilibrium(problem, q, work)
        record.status[s, time] = state.status[s]
        if state.status[s] != CONVERGED:
            _give_up(s, time, record)
            continue
        _correct(at, tables, q, force, x, v, acceleration, algorithmic)
        compress(problem, q, work.compression, work.play)
        record.rotation[s, time] = parts.carrier_scale * x[carrier]
        record.speed[s, time] = parts.carrier_scale * v[carrier]
        record.acceleration[s, time] = parts.carrier_scale * acceleration[carrier]
        record.input_torque[s, time] = _input_torque(at, tables, parts, problem, work.play, values[0], x, v)
        record.residual[s, time] = ratio
        for d in range(contacts // pins):
            touching = 0
            for c in range(d * pins, (d + 1) * pins):
                touching += work.compression[c] + problem.half_tilt[c] > 0.0
            record.touching[s, time, d] = touching
        if record.slot[time] >= 0:
            _observe(s, record.slot[time], problem, work.compression, x, v, acceleration, record)


def advance(samples: int, *given: Any) -> None:
    """Take all samples through the steps of some tables; given is what `_advance_sample` takes of every one."""
    in_threads(lambda part: _advance_sample(part.start, *given), samples, 1)
