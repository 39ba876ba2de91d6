"""Equilibria between the tabulated angles, tables interpolated by cubics: of one sample, or of what each lane searches.

Of all pins a lane takes those that are pressed at its start, or clear by less than a margin. A solution that lies
farther from the start than the margin may have met another one; it is not believed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.batch import SampleBatch, make_batch
from tolalloc.reducers.equivalent.solvers.contact_solver import (
    equilibrium,
    fill_loads,
    make_problem,
    make_work,
    sample_constants,
    solve_at_node,
)
from tolalloc.reducers.equivalent.solvers.play import Play, make_play
from tolalloc.reducers.equivalent.solvers.pressing import VectorTables
from tolalloc.reducers.equivalent.solvers.simd import WIDTH, Apart, aligned
from tolalloc.running.compiled import jit, jit_in_place, jit_within

_SLOTS = 8  # nodes whose loads a lane keeps: a search stays within five
_MARGIN = 4.0
"""Times the distance between the two equilibria that the start lies between."""
_LEAST_MARGIN = 1e-9  # metres
_NOWHERE = -1.0
"""Depth of a contact that no pin stands for [m]."""


class Nodes(NamedTuple):
    """Loads of one sample at the four nodes around two neighbouring intervals, kept while the search stays there."""

    first: Int[np.ndarray, "2"]  # First of the four nodes, per slot; −1 for an empty one [-]
    rotation: Float[np.ndarray, "2 4"]  # Carrier rotation at fixed discs [rad]
    # As in `ContactProblem` [N, m, m]
    force: Float[np.ndarray, "2 4 retained"]
    undisturbed: Float[np.ndarray, "2 4 contact"]
    play_offset: Float[np.ndarray, "2 4 element 2"]
    turn: Float[np.ndarray, "2"]  # Of the discs' axes, at the position in between [-]


@jit
def _make_nodes(retained, contacts, elements):
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
    """Return the first of four nodes around a position, and the weights of the cubic through them.

    Lagrange's cubic through −1, 0, 1 and 2, own derivation; weights are 1 together, a cubic is exact.

    Examples
    --------
    >>> first, weights = interpolation.py_func(10.5)
    >>> first, [float(weight) for weight in weights]
    (9, [-0.0625, 0.5625, 0.5625, -0.0625])
    """
    x = position - np.floor(position)
    weights = (
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    )
    return int(np.floor(position)) - 1, weights


@jit_within
def _blend(table, weights, out):
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
    _blend(tables.contact_by_disc[first : first + 4], weights, out)
    pole = tables.pole_by_rotation
    for d in range(discs):
        x, y = 0.0, 0.0
        for node in range(4):
            x += weights[node] * pole[first + node, d, 0]
            y += weights[node] * pole[first + node, d, 1]
        for k in range(pins):
            out[d, 2, k] = x * out[d, 0, k] + y * out[d, 1, k]


@jit_in_place
def _problem_between(position, tables, layout, face_width, values, nodes, own, carrier_by_retained):
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
    _blend(tables.stiffness[here], weights, own.stiffness)
    _blend(nodes.force[slot], weights, own.force)
    _blend_levers(first, weights, tables, own.by_disc)
    _blend(nodes.undisturbed[slot], weights, own.undisturbed)
    _blend(tables.contact_stiffness[here], weights, own.contact)
    if own.law != LINEAR:
        _blend(tables.contact_log_length[here], weights, own.log_length)
    _blend(tables.play_by_retained[here], weights, own.play_by_retained)
    _blend(nodes.play_offset[slot], weights, own.play_offset)
    _blend(tables.play_stiffness[here], weights, own.play_stiffness)
    _blend(tables.carrier_by_retained[here], weights, carrier_by_retained)
    _blend(tables.turn[here], weights, nodes.turn)
    sample_constants(own, nodes.turn, face_width, layout, values)
    rotation = 0.0
    for node in range(4):
        rotation += weights[node] * nodes.rotation[slot, node]
    return rotation


@jit_in_place
def solve_between(position, tables, layout, face_width, values, q, memory):
    """Solve one sample between nodes from the start q; return rotation, status, residual, pins in contact."""
    own, work, nodes, carrier_by_retained = memory
    rotation = _problem_between(position, tables, layout, face_width, values, nodes, own, carrier_by_retained)
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
        _make_nodes(retained, contacts, elements),
        np.empty(retained),
    )


class Workspace(NamedTuple):
    """What the lanes solve, and the loads of their samples at the nodes that each has met last."""

    tables: VectorTables
    batch: SampleBatch  # Of which the first register is used
    play: Play
    node: Int[np.ndarray, "lane slot"]  # Which node a slot holds; −1 for none [-]
    # Carrier rotation [rad], forces [N], compressions of pins and of elements with play [m] at undisplaced discs
    rotation: Float[np.ndarray, "lane slot"]
    force: Float[np.ndarray, "lane slot coordinate"]
    undisturbed: Float[np.ndarray, "lane slot contact"]
    play_offset: Float[np.ndarray, "lane slot element 2"]
    # Where a lane looks: carrier rotation at undisplaced discs [rad], and by the discs' coordinates [rad/m]
    base: Float[np.ndarray, " lane"]
    by_coordinate: Float[np.ndarray, "coordinate lane"]
    # Where the lane looks that is being filled, of all contacts: D [m/m], depth at undisplaced discs [m], stiffness
    # [N/m], ln L
    normal: Float[np.ndarray, " row_and_contact"]
    depth: Float[np.ndarray, " contact"]
    stiffness: Float[np.ndarray, " contact"]
    log_length: Float[np.ndarray, " contact"]
    # Gap of every pin of a disc at the start [m], and the pins that the lane takes [-]
    gap: Float[np.ndarray, " pin"]
    pin: Int[np.ndarray, " pin"]
    taken: Int[np.ndarray, "lane disc"]  # How many each lane has taken [-]
    margin: Float[np.ndarray, " lane"]  # Movement of a pole up to which no other pin can be met [m]


@jit
def make_workspace(layout, size, contacts, elements):
    """Return empty lanes."""
    discs, batch = contacts // layout.pins, make_batch(layout, size, contacts, WIDTH)
    batch.undisturbed[:] = _NOWHERE
    return Workspace(
        VectorTables(
            Apart(aligned(size * size, WIDTH)),
            Apart(aligned(3 * contacts, WIDTH)),
            Apart(aligned(2 * discs, WIDTH)),
            Apart(aligned(contacts, WIDTH)),
            Apart(aligned(contacts, WIDTH)),
            Apart(aligned(2 * elements * size, WIDTH)),
            Apart(aligned(elements, WIDTH)),
        ),
        batch,
        make_play(size, elements, WIDTH),
        np.full((WIDTH, _SLOTS), -1),
        np.empty((WIDTH, _SLOTS)),
        np.empty((WIDTH, _SLOTS, size)),
        np.empty((WIDTH, _SLOTS, contacts)),
        np.empty((WIDTH, _SLOTS, elements, 2)),
        np.empty(WIDTH),
        aligned(size, WIDTH),
        np.empty(3 * contacts),
        np.empty(contacts),
        np.empty(contacts),
        np.empty(contacts),
        np.empty(contacts // discs),
        np.empty(contacts // discs, np.int64),
        np.zeros((WIDTH, discs), np.int64),
        np.empty(WIDTH),
    )


@jit_within
def _slot(lane, node, tables, layout, values, workspace):
    """Return the slot with the loads of a lane's sample at a node."""
    slot = node % _SLOTS
    if workspace.node[lane, slot] != node:
        workspace.node[lane, slot] = node
        force, undisturbed = workspace.force[lane, slot], workspace.undisturbed[lane, slot]
        offset = workspace.play_offset[lane, slot]
        workspace.rotation[lane, slot] = fill_loads(node, tables, layout, values, force, undisturbed, offset)
    return slot


@jit_within
def _around(lane, position, tables, layout, values, workspace):
    """Return the first of four nodes around a position, their weights, and the slots with their loads."""
    first, weights = interpolation(position)
    own = _slot(lane, first + 1, tables, layout, values, workspace)
    if position == first + 1.0:  # at a node, whose neighbours weigh nothing
        return first, weights, (own, own, own, own)
    before = _slot(lane, first, tables, layout, values, workspace)
    behind = _slot(lane, first + 2, tables, layout, values, workspace)
    return first, weights, (before, own, behind, _slot(lane, first + 3, tables, layout, values, workspace))


@jit_within
def _blend_into_lane(table, first, weights, lane, out):
    """Set a lane's entries to the weighted sum of four rows of a table."""
    flat, size = table.reshape(table.size), out.shape[0]
    a, (w, x, y, z) = first * size, weights
    b, c, d = a + size, a + 2 * size, a + 3 * size
    for n in range(size):
        out[n, lane] = (w * flat[a + n] + x * flat[b + n]) + (y * flat[c + n] + z * flat[d + n])


@jit_within
def _blend_slots(kept, slots, weights, out):
    """Set out to the weighted sum of four slots."""
    (a, b, c, d), (w, x, y, z) = slots, weights
    for n in range(out.size):
        out[n] = (w * kept[a, n] + x * kept[b, n]) + (y * kept[c, n] + z * kept[d, n])


@jit_within
def _pole_moves(lane, disc, along, across, turn, workspace):
    """Return by what x, y a disc's pole moves in a lane where the disc's three coordinates change so."""
    pole = workspace.tables.pole.entries
    return along + pole[2 * disc, lane] * turn, across + pole[2 * disc + 1, lane] * turn


@jit_within
def _take_near(lane, start, side, law, workspace):
    """Put the contacts into a lane that are pressed at its start or nearly so, and set what nearly is.

    The start lies half-way to one ``side`` of two equilibria.
    """
    here, (discs, pins), undisturbed = (
        workspace.tables,
        (workspace.taken.shape[1], workspace.pin.size),
        workspace.batch.undisturbed,
    )
    margin = _LEAST_MARGIN
    for d in range(discs):
        along, across = side[3 * d] - start[3 * d], side[3 * d + 1] - start[3 * d + 1]
        x, y = _pole_moves(lane, d, along, across, side[3 * d + 2] - start[3 * d + 2], workspace)
        margin = max(margin, _MARGIN * (abs(x) + abs(y)))
    workspace.margin[lane] = margin
    for d in range(discs):
        x, y = _pole_moves(lane, d, start[3 * d], start[3 * d + 1], start[3 * d + 2], workspace)
        row, first, count = 3 * d * pins, d * pins, 0
        for k in range(pins):
            workspace.gap[k] = -workspace.depth[first + k] - (
                workspace.normal[row + k] * x + workspace.normal[row + pins + k] * y
            )
        for k in range(pins):
            workspace.pin[count] = k
            count += bool(workspace.gap[k] < margin)  # without a branch, which would be guessed wrong
        for j in range(count):
            k = workspace.pin[j]
            undisturbed[0, first + j, lane] = workspace.depth[first + k]
            here.by_disc.entries[row + j, lane] = workspace.normal[row + k]
            here.by_disc.entries[row + pins + j, lane] = workspace.normal[row + pins + k]
            here.contact.entries[first + j, lane] = workspace.stiffness[first + k]
            if law != LINEAR:
                here.log_length.entries[first + j, lane] = workspace.log_length[first + k]
        for j in range(count, workspace.taken[lane, d]):
            undisturbed[0, first + j, lane] = _NOWHERE
            here.by_disc.entries[row + j, lane], here.by_disc.entries[row + pins + j, lane] = 0.0, 0.0
        workspace.taken[lane, d] = count


@jit_within
def _turn_flanks(turned, workspace):
    """Take what turned flanks leave from the depths, by the levers where the lane looks."""
    pins = workspace.pin.size
    for d in range(workspace.taken.shape[1]):
        for k in range(pins):
            workspace.depth[d * pins + k] -= abs(workspace.normal[(3 * d + 2) * pins + k]) * turned


@jit_within
def _fill_play(lane, first, weights, slots, tables, layout, values, workspace):
    """Put the elements with play where the lane looks into it."""
    own, (a, b, c, d), (w, x, y, z) = workspace.play, slots, weights
    kept = workspace.play_offset[lane]
    for e in range(own.end.size):
        own.clearance[e, lane] = max(values[layout.clearance + e], 0.0)
        for i in range(2):
            near = w * kept[a, e, i] + x * kept[b, e, i]
            own.offset[2 * e + i, lane] = near + (y * kept[c, e, i] + z * kept[d, e, i])
    _blend_into_lane(tables.play_by_retained, first, weights, lane, workspace.tables.play_by_retained.entries)
    _blend_into_lane(tables.play_stiffness, first, weights, lane, workspace.tables.play_stiffness.entries)


@jit_within
def fill_lane(lane, position, start, side, law, tables, layout, values, workspace):
    """Put a sample's problem where its lane looks into the lane."""
    here = workspace.tables
    first, weights, slots = _around(lane, position, tables, layout, values, workspace)
    around = slice(first, first + 4)
    workspace.base[lane] = 0.0
    for i in range(4):
        workspace.base[lane] += weights[i] * workspace.rotation[lane, slots[i]]
    for i in range(workspace.batch.force.shape[0]):
        force = weights[0] * workspace.force[lane, slots[0], i] + weights[1] * workspace.force[lane, slots[1], i]
        force += weights[2] * workspace.force[lane, slots[2], i] + weights[3] * workspace.force[lane, slots[3], i]
        workspace.batch.force[i, lane] = force
    _blend_into_lane(tables.carrier_by_retained, first, weights, lane, workspace.by_coordinate)
    _blend_into_lane(tables.stiffness, first, weights, lane, here.stiffness.entries)
    _blend_into_lane(tables.pole_by_rotation, first, weights, lane, here.pole.entries)
    _blend_slots(workspace.undisturbed[lane], slots, weights, workspace.depth)
    _blend(tables.contact_by_disc[around], weights, workspace.normal)
    if values[layout.flank] != 0.0:
        _turn_flanks(values[layout.flank], workspace)
    _blend(tables.contact_stiffness[around], weights, workspace.stiffness)
    if law != LINEAR:
        _blend(tables.contact_log_length[around], weights, workspace.log_length)
    _fill_play(lane, first, weights, slots, tables, layout, values, workspace)
    _take_near(lane, start, side, law, workspace)


@jit_in_place
def look_at_all_taken(workspace):
    """Let the register look at as many contacts of each disc as the lane has that took most."""
    for d in range(workspace.taken.shape[1]):
        most = 0
        for lane in range(WIDTH):
            most = max(most, workspace.taken[lane, d])
        workspace.batch.pressing.looked_at[d] = most


@jit_within
def moved_too_far(lane, start, workspace):
    """Return whether a lane's solution lies so far from its start that a pin that it did not take may be met."""
    q, moved = workspace.batch.q, 0.0
    for d in range(workspace.taken.shape[1]):
        along, across = q[3 * d, lane] - start[3 * d], q[3 * d + 1, lane] - start[3 * d + 1]
        x, y = _pole_moves(lane, d, along, across, q[3 * d + 2, lane] - start[3 * d + 2], workspace)
        moved = max(moved, abs(x) + abs(y))
    return not moved <= workspace.margin[lane]
