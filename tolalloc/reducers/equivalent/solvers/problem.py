"""The problem of one sample at one tabulated angle, from the condensed tables."""

from __future__ import annotations

import numpy as np

from tolalloc.reducers.equivalent.solvers.contact_solver import equilibrium
from tolalloc.reducers.equivalent.solvers.energy import Problem
from tolalloc.running.compiled import jit, jit_in_place


@jit
def values_of(errors, torque, layout, mapped, values):
    """Fill the values [sample, value] of all samples; return which samples are finite."""
    finite = np.empty(errors.shape[0], np.bool_)
    for s in range(errors.shape[0]):
        for m in range(layout.end):
            values[s, m] = mapped.nominal[m]
        values[s, layout.torque] = torque
        for entry in range(mapped.value.size):
            values[s, mapped.value[entry]] += mapped.factor[entry] * errors[s, mapped.column[entry]]
        finite[s] = np.isfinite(values[s]).all()
    return finite


@jit
def make_problem(law, tables):
    """Return a problem with memory of its own, to be filled by `fill_loads` and `blend`."""
    retained, discs, pins = tables.stiffness.shape[1], tables.contact_by_disc.shape[1], tables.contact_by_disc.shape[3]
    elements = tables.play_stiffness.shape[1]
    return Problem(
        law,
        np.empty((retained, retained)),
        np.empty(retained),
        np.empty((discs, 3, pins)),
        np.empty(discs * pins),
        np.empty(discs * pins),
        np.empty(discs * pins),
        np.zeros(discs * pins),
        np.empty((elements, 2, retained)),
        np.empty((elements, 2)),
        np.empty(elements),
        np.empty(elements),
    )


@jit_in_place
def _any_nonzero(values, first, last):
    found = False
    for m in range(first, last):
        found |= values[m] != 0.0
    return found


@jit_in_place
def _undisturbed(at, tables, layout, values, out):
    """Set out to the pins' compression at undisplaced discs."""
    discs, pins = tables.contact_by_disc.shape[1], layout.pins
    for d in range(discs):
        coefficient = tables.contact_by_error[at, d]
        row = out[d * pins : (d + 1) * pins]
        for k in range(pins):
            row[k] = values[layout.pin + 2 * pins + k] + (
                coefficient[0, k] * values[layout.pin + k] + coefficient[1, k] * values[layout.pin + pins + k]
            )
        for m in range(layout.waves):
            value = values[layout.wave + d * layout.waves + m]
            if value != 0.0:
                for k in range(pins):
                    row[k] += coefficient[2 + m, k] * value
        first = layout.tooth + d * 2 * layout.teeth
        for kind in range(2):
            start = first + kind * layout.teeth
            if _any_nonzero(values, start, start + layout.teeth):
                for k in range(pins):
                    row[k] += coefficient[2 + layout.waves + kind, k] * values[start + tables.tooth[at, d, k]]


@jit_in_place
def fill_loads(at, tables, layout, values, force, undisturbed, play_offset):
    """Set force, undisturbed compressions and play offsets at a node; return the carrier rotation at fixed discs."""
    rotation = 0.0
    force[:] = 0.0
    play_offset[:] = 0.0
    for m in range(layout.torque + 1):
        if values[m] != 0.0:
            rotation += tables.carrier_by_load[at, m] * values[m]
            for i in range(force.size):
                force[i] += tables.load[at, m, i] * values[m]
            for e in range(play_offset.shape[0]):
                play_offset[e, 0] += tables.play_by_load[at, e, 0, m] * values[m]
                play_offset[e, 1] += tables.play_by_load[at, e, 1, m] * values[m]
    _undisturbed(at, tables, layout, values, undisturbed)
    return rotation


@jit_in_place
def sample_constants(problem, turn, face_width, layout, values):
    """Set what does not depend on the angle: clearances; and the tilted depths, which need the turned tilt only."""
    for e in range(problem.clearance.size):
        problem.clearance[e] = max(values[layout.clearance + e], 0.0)
    pins = layout.pins
    for d in range(problem.by_disc.shape[0]):
        x, y = values[layout.tilt + 2 * d], values[layout.tilt + 2 * d + 1]
        if x == 0.0 and y == 0.0:
            problem.half_tilt[d * pins : (d + 1) * pins] = 0.0
            continue
        tilt_x, tilt_y = turn[0] * x - turn[1] * y, turn[1] * x + turn[0] * y
        for k in range(pins):
            along = tilt_y * problem.by_disc[d, 0, k] - tilt_x * problem.by_disc[d, 1, k]
            problem.half_tilt[d * pins + k] = 0.5 * face_width * abs(along)


@jit
def with_tables(at, tables, layout, face_width, values, own):
    """Return the problem whose loads ``own`` has, with the tables of a node."""
    problem = Problem(
        own.law,
        tables.stiffness[at],
        own.force,
        tables.contact_by_disc[at],
        own.undisturbed,
        tables.contact_stiffness[at],
        tables.contact_log_length[at],
        own.half_tilt,
        tables.play_by_retained[at],
        own.play_offset,
        tables.play_stiffness[at],
        own.clearance,
    )
    sample_constants(problem, tables.turn[at], face_width, layout, values)
    return problem


@jit
def problem_at_node(at, tables, layout, face_width, values, own):
    """Return carrier rotation at fixed discs and the problem at a node; ``own`` lends the memory of the loads."""
    rotation = fill_loads(at, tables, layout, values, own.force, own.undisturbed, own.play_offset)
    return rotation, with_tables(at, tables, layout, face_width, values, own)


@jit
def solve_at_node(at, tables, layout, face_width, values, q, own, work):
    """Solve one sample at one node from the guess q; return rotation, status, residual, pins in contact."""
    rotation, problem = problem_at_node(at, tables, layout, face_width, values, own)
    status, ratio, touching = equilibrium(problem, q, work)
    for i in range(q.size):
        rotation += tables.carrier_by_retained[at, i] * q[i]
    return rotation, status, ratio, touching
