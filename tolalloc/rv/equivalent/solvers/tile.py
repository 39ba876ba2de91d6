"""A tile of samples: what the lanes work on, and everything that is the same for all Newton steps at an angle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.compiled import jit, jit_in_place, jit_within
from tolalloc.rv.equivalent.solvers.lanes import WIDTH, fma, load, spread, store

TILE = 128
"""Largest number of samples that share one look at an angle's tables."""

FOUR = 4 * WIDTH
"""Samples in four registers; as many are worked on at a time."""


class Tile(NamedTuple):
    """Loads, state and work space of a tile; samples are the last axis, so that a register holds eight of them."""

    # What the tables take, `tolalloc.rv.equivalent.columns.Layout` [m, rad, N·m]
    values: Float[np.ndarray, "value sample"]
    # Pin compressions [m], forces on the discs [N] and carrier rotation [rad] at undisplaced discs
    undisturbed: Float[np.ndarray, "contact sample"]
    force: Float[np.ndarray, "coordinate sample"]
    rotation: Float[np.ndarray, " sample"]
    # Coordinates of the discs: guess, then equilibrium, and the equilibrium at the last angle [m]
    q: Float[np.ndarray, "coordinate sample"]
    last: Float[np.ndarray, "coordinate sample"]
    # Residual over the largest force; pins in contact [-]
    ratio: Float[np.ndarray, " sample"]
    touching: Float[np.ndarray, " sample"]
    weighted: Float[np.ndarray, "3 contact"]  # k·d of every contact at this angle [N/m]
    # Of one register's samples: sums over the pressed contacts of each disc, of forces [N] and of k·d_i·d_j [N/m]
    pins: Float[np.ndarray, "coordinate 8"]
    stiffness: Float[np.ndarray, "entry 8"]
    # The same: unbalanced force, Newton's step [N, m]
    gradient: Float[np.ndarray, "coordinate 8"]
    step: Float[np.ndarray, "coordinate 8"]


@jit
def aligned(rows, width):
    """Return zeros whose rows start where a register does: a load across two lines of the cache takes twice as long."""
    room = np.zeros(rows * width + WIDTH)
    first = (-(room.ctypes.data >> 3)) % WIDTH
    return room[first : first + rows * width].reshape(rows, width)


@jit
def make_tile(layout, size, contacts, samples):
    """Return an empty tile."""
    return Tile(
        aligned(layout.end, samples),
        aligned(contacts, samples),
        aligned(size, samples),
        aligned(1, samples).reshape(samples),
        aligned(size, samples),
        aligned(size, samples),
        aligned(1, samples).reshape(samples),
        aligned(1, samples).reshape(samples),
        np.empty((3, contacts)),
        aligned(size, WIDTH),
        aligned(2 * size, WIDTH),
        aligned(size, WIDTH),
        aligned(size, WIDTH),
    )


@jit
def nonzero_rows(values, first, last):
    """Return the numbers of the values from first to last that differ from zero in any sample."""
    rows = np.empty(last - first, np.int64)
    count = 0
    for m in range(first, last):
        if np.any(values[m] != 0.0):
            rows[count] = m
            count += 1
    return rows[:count]


@jit
def nonzero_waves(layout, values):
    """Return the harmonic amplitudes, counted from 0 on each disc, that differ from zero in any sample and disc."""
    waves = np.empty(layout.waves, np.int64)
    count = 0
    for m in range(layout.waves):
        if np.any(values[layout.wave + m : layout.tooth : layout.waves] != 0.0):
            waves[count] = m
            count += 1
    return waves[:count]


@jit_within
def _forces(at, tables, rows, used, tile):
    """Set forces and carrier rotation at undisplaced discs."""
    table, by_load, values = tables.load[at], tables.carrier_by_load[at], tile.values
    for v in range(0, used, WIDTH):
        total = spread(0.0)
        for m in rows:
            total = fma(spread(by_load[m]), load(values, m * TILE + v), total)
        store(tile.rotation, v, total)
    for i in range(table.shape[1]):
        for v in range(0, used, FOUR):
            a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
            for m in rows:
                factor, row = spread(table[m, i]), m * TILE + v
                a = fma(factor, load(values, row), a)
                b = fma(factor, load(values, row + WIDTH), b)
                c = fma(factor, load(values, row + 2 * WIDTH), c)
                d = fma(factor, load(values, row + 3 * WIDTH), d)
            _store_four(tile.force, i * TILE + v, a, b, c, d)


@jit_in_place
def _store_four(out, at, a, b, c, d):
    store(out, at, a)
    store(out, at + WIDTH, b)
    store(out, at + 2 * WIDTH, c)
    store(out, at + 3 * WIDTH, d)


@jit_within
def _add_waves(table, values, first, waves, k, other, p, q, out):
    """Add the disc's harmonic deviations to two contacts of four registers: both share the amplitudes."""
    a, b, c, d = load(out, p), load(out, p + WIDTH), load(out, p + 2 * WIDTH), load(out, p + 3 * WIDTH)
    e, f, g, h = load(out, q), load(out, q + WIDTH), load(out, q + 2 * WIDTH), load(out, q + 3 * WIDTH)
    for m in waves:
        one, two, row = spread(table[2 + m, k]), spread(table[2 + m, other]), first + m * TILE
        w, x = load(values, row), load(values, row + WIDTH)
        y, z = load(values, row + 2 * WIDTH), load(values, row + 3 * WIDTH)
        a, b, c, d = fma(one, w, a), fma(one, x, b), fma(one, y, c), fma(one, z, d)
        e, f, g, h = fma(two, w, e), fma(two, x, f), fma(two, y, g), fma(two, z, h)
    _store_four(out, q, e, f, g, h)
    _store_four(out, p, a, b, c, d)


@jit_within
def _undisturbed(at, tables, layout, waves, teeth_deviate, used, tile):
    """Set the pin compressions at undisplaced discs."""
    pins, values, out = layout.pins, tile.values, tile.undisturbed
    radial, tangential, radius = layout.pin * TILE, (layout.pin + pins) * TILE, (layout.pin + 2 * pins) * TILE
    for d in range(tables.contact_by_error.shape[1]):
        table, contact, wave = tables.contact_by_error[at, d], d * pins, (layout.wave + d * layout.waves) * TILE
        for k in range(pins):
            outward, along, row = spread(table[0, k]), spread(table[1, k]), (contact + k) * TILE
            for v in range(0, used, WIDTH):
                place = k * TILE + v
                total = fma(outward, load(values, radial + place), load(values, radius + place))
                store(out, row + v, fma(along, load(values, tangential + place), total))
        for k in range(0, pins, 2):
            other = min(k + 1, pins - 1)
            for v in range(0, used, FOUR):
                p, q = (contact + k) * TILE + v, (contact + other) * TILE + v
                _add_waves(table, values, wave + v, waves, k, other, p, q, out)
        if teeth_deviate:
            for k in range(pins):
                for kind in range(2):
                    factor, tooth = spread(table[2 + layout.waves + kind, k]), tables.tooth[at, d, k]
                    row = (layout.tooth + (2 * d + kind) * layout.teeth + tooth) * TILE
                    for v in range(0, used, WIDTH):
                        place = (contact + k) * TILE + v
                        store(out, place, fma(factor, load(values, row + v), load(out, place)))


@jit_within
def _weigh(at, tables, weighted):
    """Set k·d of all contacts."""
    by_disc, stiffness = tables.contact_by_disc[at], tables.contact_stiffness[at]
    discs, _, pins = by_disc.shape
    for d in range(discs):
        for i in range(3):
            for k in range(pins):
                weighted[i, d * pins + k] = stiffness[d * pins + k] * by_disc[d, i, k]


@jit_in_place
def guess_next(used, tile):
    """Go on from the equilibrium as far as it is from that of the last angle."""
    for i in range(tile.q.shape[0]):
        for s in range(used):
            q = tile.q[i, s]
            tile.q[i, s] = 2.0 * q - tile.last[i, s]
            tile.last[i, s] = q


@jit_within
def displace_nothing(at, tables, layout, rows, waves, teeth_deviate, used, tile):
    """Set all that the errors do at one node while the discs are undisplaced."""
    _forces(at, tables, rows, used, tile)
    _undisturbed(at, tables, layout, waves, teeth_deviate, used, tile)
    _weigh(at, tables, tile.weighted)
