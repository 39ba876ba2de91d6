"""Where eight searches look, solved in one register: each lane has tables of its own, interpolated by cubics.

Searches go through the turn side by side, so that what the lanes read of the tables is still in the cache.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.compiled import jit, jit_in_place, jit_within
from tolalloc.rv.cycloid.solvers import LINEAR
from tolalloc.rv.equivalent.solvers.interpolation import interpolation, solve_anywhere
from tolalloc.rv.equivalent.solvers.lane_solver import ALL, LaneTables, settle
from tolalloc.rv.equivalent.solvers.lanes import WIDTH, Apart, load, multiply, store
from tolalloc.rv.equivalent.solvers.problem import fill_loads
from tolalloc.rv.equivalent.solvers.records import CONVERGED
from tolalloc.rv.equivalent.solvers.searches import begin, look_closer, take
from tolalloc.rv.equivalent.solvers.tile import Tile, aligned, make_tile

_SLOTS = 8  # nodes whose loads a lane keeps: a search stays within five


class Lent(NamedTuple):
    """What the lanes solve, and the loads of their samples at the nodes that each has met last."""

    tables: LaneTables
    tile: Tile  # Of which the first register is used
    node: Int[np.ndarray, "8 slot"]  # Which node a slot holds; −1 for none [-]
    # Carrier rotation [rad], forces [N] and compressions [m] at undisplaced discs; no elements with play
    rotation: Float[np.ndarray, "8 slot"]
    force: Float[np.ndarray, "8 slot coordinate"]
    undisturbed: Float[np.ndarray, "8 slot contact"]
    play_offset: Float[np.ndarray, "0 2"]
    # Where a lane looks: carrier rotation at undisplaced discs [rad], and by the discs' coordinates [rad/m]
    base: Float[np.ndarray, "8"]
    by_coordinate: Float[np.ndarray, "coordinate 8"]


@jit
def make_lent(layout, size, contacts):
    """Return empty lanes."""
    return Lent(
        LaneTables(
            Apart(aligned(size * size, WIDTH)),
            Apart(aligned(3 * contacts, WIDTH)),
            Apart(aligned(3 * contacts, WIDTH)),
            Apart(aligned(contacts, WIDTH)),
            Apart(aligned(contacts, WIDTH)),
        ),
        make_tile(layout, size, contacts, WIDTH),
        np.full((WIDTH, _SLOTS), -1),
        np.empty((WIDTH, _SLOTS)),
        np.empty((WIDTH, _SLOTS, size)),
        np.empty((WIDTH, _SLOTS, contacts)),
        np.empty((0, 2)),
        np.empty(WIDTH),
        aligned(size, WIDTH),
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
def _copy(table, node, lane, out):
    """Set a lane's entries to a row of a table."""
    flat, size = table.reshape(table.size), out.shape[0]
    for n in range(size):
        out[n, lane] = flat[node * size + n]


@jit_within
def _blend(table, first, weights, lane, out):
    """Set a lane's entries to the weighted sum of four rows of a table."""
    flat, size = table.reshape(table.size), out.shape[0]
    a, (w, x, y, z) = first * size, weights
    b, c, d = a + size, a + 2 * size, a + 3 * size
    for n in range(size):
        out[n, lane] = (w * flat[a + n] + x * flat[b + n]) + (y * flat[c + n] + z * flat[d + n])


@jit_within
def _blend_slots(kept, slots, weights, lane, out):
    """Set a lane's entries to the weighted sum of four slots."""
    (a, b, c, d), (w, x, y, z), size = slots, weights, out.shape[0]
    for n in range(size):
        out[n, lane] = (w * kept[lane, a, n] + x * kept[lane, b, n]) + (y * kept[lane, c, n] + z * kept[lane, d, n])


@jit_within
def _lend_node(lane, node, law, tables, layout, values, lent):
    """Put a sample's problem at a node into its lane."""
    slot, here, tile = _slot(lane, node, tables, layout, values, lent), lent.tables, lent.tile
    lent.base[lane] = lent.rotation[lane, slot]
    for i in range(tile.force.shape[0]):
        tile.force[i, lane] = lent.force[lane, slot, i]
    for c in range(tile.undisturbed.shape[0]):
        tile.undisturbed[c, lane] = lent.undisturbed[lane, slot, c]
    _copy(tables.carrier_by_retained, node, lane, lent.by_coordinate)
    _copy(tables.stiffness, node, lane, here.stiffness.entries)
    _copy(tables.contact_by_disc, node, lane, here.by_disc.entries)
    _copy(tables.contact_stiffness, node, lane, here.contact.entries)
    if law != LINEAR:
        _copy(tables.contact_log_length, node, lane, here.log_length.entries)


@jit_within
def _lend_between(lane, position, law, tables, layout, values, lent):
    """Put a sample's problem between nodes into its lane."""
    here, tile = lent.tables, lent.tile
    first, weights = interpolation(position)
    slots = (
        _slot(lane, first, tables, layout, values, lent),
        _slot(lane, first + 1, tables, layout, values, lent),
        _slot(lane, first + 2, tables, layout, values, lent),
        _slot(lane, first + 3, tables, layout, values, lent),
    )
    lent.base[lane] = 0.0
    for i in range(4):
        lent.base[lane] += weights[i] * lent.rotation[lane, slots[i]]
    _blend_slots(lent.force, slots, weights, lane, tile.force)
    _blend_slots(lent.undisturbed, slots, weights, lane, tile.undisturbed)
    _blend(tables.carrier_by_retained, first, weights, lane, lent.by_coordinate)
    _blend(tables.stiffness, first, weights, lane, here.stiffness.entries)
    _blend(tables.contact_by_disc, first, weights, lane, here.by_disc.entries)
    _blend(tables.contact_stiffness, first, weights, lane, here.contact.entries)
    if law != LINEAR:
        _blend(tables.contact_log_length, first, weights, lane, here.log_length.entries)


@jit_within
def _lend(lane, position, sample, law, tables, layout, values, lent):
    """Put a sample's problem where a lane looks into the lane."""
    node = int(np.floor(position))
    if node == position:
        _lend_node(lane, node, law, tables, layout, values[sample], lent)
    else:
        _lend_between(lane, position, law, tables, layout, values[sample], lent)


@jit_within
def _weigh(discs, here):
    """Set k·d of all contacts of all lanes."""
    contact, by_disc, weighted = here.contact.entries, here.by_disc.entries, here.weighted.entries
    contacts = contact.shape[0]
    pins = contacts // len(discs)
    for d in range(len(discs)):
        for i in range(3):
            for k in range(pins):
                factor = load(by_disc, ((3 * d + i) * pins + k) * WIDTH)
                own = multiply(load(contact, (d * pins + k) * WIDTH), factor)
                store(weighted, (i * contacts + d * pins + k) * WIDTH, own)


@jit_in_place
def _lend_all(alone, law, tables, layout, values, peaks, own, lent):
    """Put the problems where the lanes look into them; return one bit per lane that is solved so, or alone."""
    together, apart = 0, 0
    for lane in range(WIDTH):
        if own.peak[lane] < 0:
            continue
        sample, half = peaks.sample[own.peak[lane]], own.half[lane]
        own.looks_at[lane] = own.at[lane] + (2 * half - 1) * own.step[lane]
        for i in range(own.q.shape[2]):
            own.new_q[lane, half, i] = 0.5 * (own.q[lane, 1, i] + own.q[lane, 2 * half, i])
        if alone[sample]:
            apart |= 1 << lane
            continue
        together |= 1 << lane
        for i in range(lent.tile.q.shape[0]):
            lent.tile.q[i, lane] = own.new_q[lane, half, i]
        _lend(lane, own.looks_at[lane], sample, law, tables, layout, values, lent)
    return together, apart


@jit_in_place
def search_peaks(discs, alone, tables, layout, design, values, search, turn, best, peaks, own, memory, lent, found):
    """Search around all peaks, the lanes taking one after another.

    Samples that are to be ``alone``, and lanes that do not settle, go to the solver for one sample.
    """
    waiting, tile, face_width = 0, lent.tile, design.face_width
    while True:
        for lane in range(WIDTH):
            while own.peak[lane] < 0 and waiting < peaks.coarse.size:
                begin(lane, waiting, search, turn, peaks, own)
                for slot in range(_SLOTS):
                    lent.node[lane, slot] = -1
                look_closer(lane, search, best, peaks, own)
                waiting += 1
        together, careful = _lend_all(alone, design.law, tables, layout, values, peaks, own, lent)
        if not together | careful:
            return
        if together:
            if design.law == LINEAR:
                _weigh(discs, lent.tables)
            careful |= settle(design.law, discs, lent.tables, 0, tile, ALL ^ together)
        for lane in range(WIDTH):
            q = own.new_q[lane, own.half[lane]]
            if (careful >> lane) & 1:
                sample, position = peaks.sample[own.peak[lane]], own.looks_at[lane]
                memory[2].first[0], memory[2].first[1] = -1, -1
                rotation, status, ratio, _ = solve_anywhere(
                    position, tables, layout, face_width, values[sample], q, memory
                )
                take(lane, rotation, status, ratio, search, best, peaks, own, found)
            elif (together >> lane) & 1:
                rotation = lent.base[lane]
                for i in range(tile.q.shape[0]):
                    q[i] = tile.q[i, lane]
                    rotation += lent.by_coordinate[i, lane] * q[i]
                take(lane, rotation, CONVERGED, tile.ratio[lane], search, best, peaks, own, found)
