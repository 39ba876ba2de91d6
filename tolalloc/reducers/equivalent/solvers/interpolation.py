"""Equilibria of one sample between the tabulated angles, all tables interpolated by cubics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.contact_solver import equilibrium
from tolalloc.reducers.equivalent.solvers.energy import make_work
from tolalloc.reducers.equivalent.solvers.problem import fill_loads, make_problem, sample_constants, solve_at_node
from tolalloc.running.compiled import jit, jit_in_place, jit_within


class Nodes(NamedTuple):
    """Loads of one sample at the four nodes around two neighbouring intervals, kept while the search stays there."""

    first: Int[np.ndarray, "2"]  # First of the four nodes, per slot; −1 for an empty one [-]
    rotation: Float[np.ndarray, "2 4"]  # Carrier rotation at fixed discs [rad]
    # As in `Problem` [N, m, m]
    force: Float[np.ndarray, "2 4 retained"]
    undisturbed: Float[np.ndarray, "2 4 contact"]
    play_offset: Float[np.ndarray, "2 4 element 2"]
    turn: Float[np.ndarray, "2"]  # Of the discs' axes, at the position in between [-]


@jit
def make_nodes(retained, contacts, elements):
    """Return two empty slots."""
    return Nodes(
        np.full(2, -1),
        np.empty((2, 4)),
        np.empty((2, 4, retained)),
        np.empty((2, 4, contacts)),
        np.empty((2, 4, elements, 2)),
        np.empty(2),
    )


@jit_in_place
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


@jit_within
def blend(table, weights, out):
    """Set out to the weighted sum of the table's first four rows."""
    flat, own, size = table.reshape(table.size), out.reshape(out.size), out.size
    for i in range(size):
        first = weights[0] * flat[i] + weights[1] * flat[size + i]
        own[i] = first + (weights[2] * flat[2 * size + i] + weights[3] * flat[3 * size + i])


@jit_within
def _blend_levers(first, weights, tables, out):
    """Set out to the contacts' compressions per displacement of their discs.

    Between nodes, too, all normals of a disc pass through its pole.
    """
    discs, _, pins = out.shape
    blend(tables.contact_by_disc[first : first + 4], weights, out)
    pole = tables.pole_by_rotation
    for d in range(discs):
        x, y = 0.0, 0.0
        for node in range(4):
            x += weights[node] * pole[first + node, d, 0]
            y += weights[node] * pole[first + node, d, 1]
        for k in range(pins):
            out[d, 2, k] = x * out[d, 0, k] + y * out[d, 1, k]


@jit_in_place
def problem_between(position, tables, layout, face_width, values, nodes, own, carrier_by_retained):
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
    _blend_levers(first, weights, tables, own.by_disc)
    blend(nodes.undisturbed[slot], weights, own.undisturbed)
    blend(tables.contact_stiffness[here], weights, own.contact)
    if own.law != LINEAR:
        blend(tables.contact_log_length[here], weights, own.log_length)
    blend(tables.play_by_retained[here], weights, own.play_by_retained)
    blend(nodes.play_offset[slot], weights, own.play_offset)
    blend(tables.play_stiffness[here], weights, own.play_stiffness)
    blend(tables.carrier_by_retained[here], weights, carrier_by_retained)
    blend(tables.turn[here], weights, nodes.turn)
    sample_constants(own, nodes.turn, face_width, layout, values)
    rotation = 0.0
    for node in range(4):
        rotation += weights[node] * nodes.rotation[slot, node]
    return rotation


@jit_in_place
def solve_between(position, tables, layout, face_width, values, q, memory):
    """Solve one sample between nodes from the guess q; return rotation, status, residual, pins in contact."""
    own, work, nodes, carrier_by_retained = memory
    rotation = problem_between(position, tables, layout, face_width, values, nodes, own, carrier_by_retained)
    status, ratio, touching = equilibrium(own, q, work)
    for i in range(q.size):
        rotation += carrier_by_retained[i] * q[i]
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
    retained, contacts = tables.stiffness.shape[1], tables.contact_stiffness.shape[1]
    elements = tables.play_stiffness.shape[1]
    return (
        make_problem(law, tables),
        make_work(retained, contacts, elements),
        make_nodes(retained, contacts, elements),
        np.empty(retained),
    )
