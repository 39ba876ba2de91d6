"""The problem of one sample at one angle, from the condensed tables: at a tabulated angle or between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.equivalent.solvers.compiled import jit
from tolalloc.equivalent.solvers.contact_law import LINEAR
from tolalloc.equivalent.solvers.contact_solver import Problem, equilibrium, make_work


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
    kept, discs, pins = tables.stiffness.shape[1], tables.contact_by_disc.shape[1], tables.contact_by_disc.shape[3]
    elements = tables.play_stiffness.shape[1]
    return Problem(
        law,
        np.empty((kept, kept)),
        np.empty(kept),
        np.empty((discs, 3, pins)),
        np.empty(discs * pins),
        np.empty(discs * pins),
        np.empty(discs * pins),
        np.zeros(discs * pins),
        np.empty((elements, 2, kept)),
        np.empty((elements, 2)),
        np.empty(elements),
        np.empty(elements),
    )


@jit
def _deviates(values, first, last):
    """Return whether any value from first to last differs from zero, without an array in between."""
    for m in range(first, last):
        if values[m] != 0.0:
            return True
    return False


@jit
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
            if _deviates(values, start, start + layout.teeth):
                for k in range(pins):
                    row[k] += coefficient[2 + layout.waves + kind, k] * values[start + tables.tooth[at, d, k]]


@jit
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


@jit
def _sample_constants(problem, turn, face_width, layout, values):
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
def problem_at_node(at, tables, layout, face_width, values, own):
    """Return carrier rotation at fixed discs and the problem at a node; ``own`` lends the memory of the loads."""
    rotation = fill_loads(at, tables, layout, values, own.force, own.undisturbed, own.play_offset)
    problem = Problem(
        own.law,
        tables.stiffness[at],
        own.force,
        tables.contact_by_disc[at],
        own.undisturbed,
        tables.contact_stiffness[at],
        tables.contact_length[at],
        own.half_tilt,
        tables.play_by_kept[at],
        own.play_offset,
        tables.play_stiffness[at],
        own.clearance,
    )
    _sample_constants(problem, tables.turn[at], face_width, layout, values)
    return rotation, problem


@jit
def solve_at_node(at, tables, layout, face_width, values, q, own, work):
    """Solve one sample at one node from the guess q; return rotation, status, residual, pins in contact."""
    rotation, problem = problem_at_node(at, tables, layout, face_width, values, own)
    status, ratio, touching = equilibrium(problem, q, work)
    for i in range(q.size):
        rotation += tables.carrier_by_kept[at, i] * q[i]
    return rotation, status, ratio, touching


class Nodes(NamedTuple):
    """Loads of one sample at the four nodes around two neighbouring intervals, kept while the search stays there.

    Parameters
    ----------
    first
        First of the four nodes, per slot; −1 for an empty one [-].
    rotation
        Carrier rotation at fixed discs [rad].
    force, undisturbed, play_offset
        As in `Problem` [N, m, m].
    """

    first: Int[np.ndarray, "2"]
    rotation: Float[np.ndarray, "2 4"]
    force: Float[np.ndarray, "2 4 kept"]
    undisturbed: Float[np.ndarray, "2 4 contact"]
    play_offset: Float[np.ndarray, "2 4 element 2"]


@jit
def make_nodes(kept, contacts, elements):
    """Return two empty slots."""
    return Nodes(
        np.full(2, -1),
        np.empty((2, 4)),
        np.empty((2, 4, kept)),
        np.empty((2, 4, contacts)),
        np.empty((2, 4, elements, 2)),
    )


@jit
def interpolation(position):
    """Return the first of four nodes around a position, and the weights of the cubic through them."""
    x = position - np.floor(position)
    weights = (
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    )
    return int(np.floor(position)) - 1, weights


@jit
def blend(table, weights, out):
    """Set out to the weighted sum of the table's first four rows."""
    a, b, c, d, flat = table[0].ravel(), table[1].ravel(), table[2].ravel(), table[3].ravel(), out.ravel()
    for i in range(flat.size):
        flat[i] = (weights[0] * a[i] + weights[1] * b[i]) + (weights[2] * c[i] + weights[3] * d[i])


@jit
def problem_between(position, tables, layout, face_width, values, nodes, own, carrier_by_kept):
    """Fill ``own`` with the problem between nodes, all tables interpolated; return the rotation at fixed discs."""
    first, weights = interpolation(position)
    slot = first % 2
    if nodes.first[slot] != first:
        nodes.first[slot] = first
        for node in range(4):
            nodes.rotation[slot, node] = fill_loads(
                first + node,
                tables,
                layout,
                values,
                nodes.force[slot, node],
                nodes.undisturbed[slot, node],
                nodes.play_offset[slot, node],
            )
    here = slice(first, first + 4)
    blend(tables.stiffness[here], weights, own.stiffness)
    blend(nodes.force[slot], weights, own.force)
    blend(tables.contact_by_disc[here], weights, own.by_disc)
    blend(nodes.undisturbed[slot], weights, own.undisturbed)
    blend(tables.contact_stiffness[here], weights, own.contact)
    if own.law != LINEAR:
        blend(tables.contact_length[here], weights, own.length)
    blend(tables.play_by_kept[here], weights, own.play_by_kept)
    blend(nodes.play_offset[slot], weights, own.play_offset)
    blend(tables.play_stiffness[here], weights, own.play_stiffness)
    blend(tables.carrier_by_kept[here], weights, carrier_by_kept)
    turn = np.empty(2)
    blend(tables.turn[here], weights, turn)
    _sample_constants(own, turn, face_width, layout, values)
    rotation = 0.0
    for node in range(4):
        rotation += weights[node] * nodes.rotation[slot, node]
    return rotation


@jit
def solve_between(position, tables, layout, face_width, values, q, memory):
    """Solve one sample between nodes from the guess q; return rotation, status, residual, pins in contact."""
    own, work, nodes, carrier_by_kept = memory
    rotation = problem_between(position, tables, layout, face_width, values, nodes, own, carrier_by_kept)
    status, ratio, touching = equilibrium(own, q, work)
    for i in range(q.size):
        rotation += carrier_by_kept[i] * q[i]
    return rotation, status, ratio, touching


@jit
def solve_anywhere(position, tables, layout, face_width, values, q, memory):
    """Solve one sample at a node or between nodes; positions count nodes."""
    node = int(np.floor(position))
    if node == position:
        return solve_at_node(node, tables, layout, face_width, values, q, memory[0], memory[1])
    return solve_between(position, tables, layout, face_width, values, q, memory)


@jit
def make_memory(law, tables):
    """Return the memory of one thread: a problem, Newton's work space, loads at nodes, the carrier's row."""
    kept, contacts = tables.stiffness.shape[1], tables.contact_stiffness.shape[1]
    elements = tables.play_stiffness.shape[1]
    return (
        make_problem(law, tables),
        make_work(kept, contacts, elements),
        make_nodes(kept, contacts, elements),
        np.empty(kept),
    )
