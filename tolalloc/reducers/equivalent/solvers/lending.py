"""What each lane solves where its search looks: tables between the nodes by cubics, loads of its own sample.

Of all pins a lane takes those that are pressed at its guess, or clear by less than a margin. A solution that lies
farther from the guess than the margin may have met another one; it is not believed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.interpolation import blend, interpolation
from tolalloc.reducers.equivalent.solvers.lanes import WIDTH, Apart, aligned
from tolalloc.reducers.equivalent.solvers.pressing import LaneTables
from tolalloc.reducers.equivalent.solvers.problem import fill_loads
from tolalloc.reducers.equivalent.solvers.tile import Tile, make_tile
from tolalloc.running.compiled import jit, jit_in_place, jit_within

_SLOTS = 8  # nodes whose loads a lane keeps: a search stays within five
_MARGIN = 4.0
"""Times the distance between the two equilibria that the guess lies between."""
_LEAST_MARGIN = 1e-9  # metres
_NOWHERE = -1.0
"""Depth of a contact that no pin stands for [m]."""


class Lent(NamedTuple):
    """What the lanes solve, and the loads of their samples at the nodes that each has met last."""

    tables: LaneTables
    tile: Tile  # Of which the first register is used
    node: Int[np.ndarray, "lane slot"]  # Which node a slot holds; −1 for none [-]
    # Carrier rotation [rad], forces [N] and compressions [m] at undisplaced discs; no elements with play
    rotation: Float[np.ndarray, "lane slot"]
    force: Float[np.ndarray, "lane slot coordinate"]
    undisturbed: Float[np.ndarray, "lane slot contact"]
    play_offset: Float[np.ndarray, "0 2"]
    # Where a lane looks: carrier rotation at undisplaced discs [rad], and by the discs' coordinates [rad/m]
    base: Float[np.ndarray, " lane"]
    by_coordinate: Float[np.ndarray, "coordinate lane"]
    # Where the lane looks that is being filled, of all contacts: D [m/m], depth at undisplaced discs [m], stiffness
    # [N/m], ln L
    normal: Float[np.ndarray, " row_and_contact"]
    depth: Float[np.ndarray, " contact"]
    stiffness: Float[np.ndarray, " contact"]
    log_length: Float[np.ndarray, " contact"]
    # Gap of every pin of a disc at the guess [m], and the pins that the lane takes [-]
    gap: Float[np.ndarray, " pin"]
    pin: Int[np.ndarray, " pin"]
    taken: Int[np.ndarray, "lane disc"]  # How many each lane has taken [-]
    margin: Float[np.ndarray, " lane"]  # Movement of a pole up to which no other pin can be met [m]


@jit
def make_lent(layout, size, contacts):
    """Return empty lanes."""
    discs, tile = size // 3, make_tile(layout, size, contacts, WIDTH)
    tile.undisturbed[:] = _NOWHERE
    return Lent(
        LaneTables(
            Apart(aligned(size * size, WIDTH)),
            Apart(aligned(3 * contacts, WIDTH)),
            Apart(aligned(2 * discs, WIDTH)),
            Apart(aligned(contacts, WIDTH)),
            Apart(aligned(contacts, WIDTH)),
        ),
        tile,
        np.full((WIDTH, _SLOTS), -1),
        np.empty((WIDTH, _SLOTS)),
        np.empty((WIDTH, _SLOTS, size)),
        np.empty((WIDTH, _SLOTS, contacts)),
        np.empty((0, 2)),
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
def _slot(lane, node, tables, layout, values, lent):
    """Return the slot with the loads of a lane's sample at a node."""
    slot = node % _SLOTS
    if lent.node[lane, slot] != node:
        lent.node[lane, slot] = node
        force, undisturbed = lent.force[lane, slot], lent.undisturbed[lane, slot]
        lent.rotation[lane, slot] = fill_loads(node, tables, layout, values, force, undisturbed, lent.play_offset)
    return slot


@jit_within
def _around(lane, position, tables, layout, values, lent):
    """Return the first of four nodes around a position, their weights, and the slots with their loads."""
    first, weights = interpolation(position)
    own = _slot(lane, first + 1, tables, layout, values, lent)
    if position == first + 1.0:  # at a node, whose neighbours weigh nothing
        return first, weights, (own, own, own, own)
    before = _slot(lane, first, tables, layout, values, lent)
    behind = _slot(lane, first + 2, tables, layout, values, lent)
    return first, weights, (before, own, behind, _slot(lane, first + 3, tables, layout, values, lent))


@jit_within
def _blend(table, first, weights, lane, out):
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
def _pole_moves(lane, disc, along, across, turn, lent):
    """Return by what x, y a disc's pole moves in a lane where the disc's three coordinates change so."""
    pole = lent.tables.pole.entries
    return along + pole[2 * disc, lane] * turn, across + pole[2 * disc + 1, lane] * turn


@jit_within
def _take_near(lane, guess, side, law, lent):
    """Put the contacts into a lane that are pressed at its guess or nearly so, and set what nearly is.

    The guess lies half-way to one ``side`` of two equilibria.
    """
    here, (discs, pins), undisturbed = lent.tables, (lent.taken.shape[1], lent.pin.size), lent.tile.undisturbed
    margin = _LEAST_MARGIN
    for d in range(discs):
        along, across = side[3 * d] - guess[3 * d], side[3 * d + 1] - guess[3 * d + 1]
        x, y = _pole_moves(lane, d, along, across, side[3 * d + 2] - guess[3 * d + 2], lent)
        margin = max(margin, _MARGIN * (abs(x) + abs(y)))
    lent.margin[lane] = margin
    for d in range(discs):
        x, y = _pole_moves(lane, d, guess[3 * d], guess[3 * d + 1], guess[3 * d + 2], lent)
        row, first, count = 3 * d * pins, d * pins, 0
        for k in range(pins):
            lent.gap[k] = -lent.depth[first + k] - (lent.normal[row + k] * x + lent.normal[row + pins + k] * y)
        for k in range(pins):
            lent.pin[count] = k
            count += bool(lent.gap[k] < margin)  # without a branch, which would be guessed wrong
        for j in range(count):
            k = lent.pin[j]
            undisturbed[0, first + j, lane] = lent.depth[first + k]
            here.by_disc.entries[row + j, lane] = lent.normal[row + k]
            here.by_disc.entries[row + pins + j, lane] = lent.normal[row + pins + k]
            here.contact.entries[first + j, lane] = lent.stiffness[first + k]
            if law != LINEAR:
                here.log_length.entries[first + j, lane] = lent.log_length[first + k]
        for j in range(count, lent.taken[lane, d]):
            undisturbed[0, first + j, lane] = _NOWHERE
            here.by_disc.entries[row + j, lane], here.by_disc.entries[row + pins + j, lane] = 0.0, 0.0
        lent.taken[lane, d] = count


@jit_within
def lend(lane, position, guess, side, law, tables, layout, values, lent):
    """Put a sample's problem where its lane looks into the lane."""
    here = lent.tables
    first, weights, slots = _around(lane, position, tables, layout, values, lent)
    around = slice(first, first + 4)
    lent.base[lane] = 0.0
    for i in range(4):
        lent.base[lane] += weights[i] * lent.rotation[lane, slots[i]]
    for i in range(lent.tile.force.shape[0]):
        force = weights[0] * lent.force[lane, slots[0], i] + weights[1] * lent.force[lane, slots[1], i]
        force += weights[2] * lent.force[lane, slots[2], i] + weights[3] * lent.force[lane, slots[3], i]
        lent.tile.force[i, lane] = force
    _blend(tables.carrier_by_retained, first, weights, lane, lent.by_coordinate)
    _blend(tables.stiffness, first, weights, lane, here.stiffness.entries)
    _blend(tables.pole_by_rotation, first, weights, lane, here.pole.entries)
    _blend_slots(lent.undisturbed[lane], slots, weights, lent.depth)
    blend(tables.contact_by_disc[around], weights, lent.normal)
    blend(tables.contact_stiffness[around], weights, lent.stiffness)
    if law != LINEAR:
        blend(tables.contact_log_length[around], weights, lent.log_length)
    _take_near(lane, guess, side, law, lent)


@jit_in_place
def look_at_all_taken(lent):
    """Let the register look at as many contacts of each disc as the lane has that took most."""
    for d in range(lent.taken.shape[1]):
        most = 0
        for lane in range(WIDTH):
            most = max(most, lent.taken[lane, d])
        lent.tile.pressing.looked_at[d] = most


@jit_within
def moved_too_far(lane, guess, lent):
    """Return whether a lane's solution lies so far from its guess that a pin that it did not take may be met."""
    q, moved = lent.tile.q, 0.0
    for d in range(lent.taken.shape[1]):
        along, across = q[3 * d, lane] - guess[3 * d], q[3 * d + 1, lane] - guess[3 * d + 1]
        x, y = _pole_moves(lane, d, along, across, q[3 * d + 2, lane] - guess[3 * d + 2], lent)
        moved = max(moved, abs(x) + abs(y))
    return not moved <= lent.margin[lane]
