"""A tile of samples: what the lanes work on, and everything that is the same for all Newton steps at an angle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.solvers.lanes import WIDTH, aligned, fma, load, spread, store
from tolalloc.reducers.equivalent.solvers.pressing import Pressing, make_pressing
from tolalloc.running.compiled import jit, jit_in_place, jit_within

TILE = 256
"""Largest number of samples that share one look at an angle's tables."""

FOUR = 4 * WIDTH
"""Samples in four registers; as many are worked on at a time."""

LATE = TILE
"""Where the register begins that samples go to which do not settle with their neighbours."""

ROW = TILE + WIDTH
"""Samples of a tile with that register; not a power of two, because a cache keeps few rows that lie so far apart."""


class Tile(NamedTuple):
    """Loads, state and work space of a tile; samples are the last axis, so that a register holds several of them."""

    # What the tables take, `tolalloc.reducers.equivalent.columns.Layout` [m, rad, N·m]
    values: Float[np.ndarray, "value sample"]
    # Pin compressions [m], forces on the discs [N] and carrier rotation [rad] at undisplaced discs
    undisturbed: Float[np.ndarray, "register contact lane"]
    force: Float[np.ndarray, "coordinate sample"]
    rotation: Float[np.ndarray, " sample"]
    q: Float[np.ndarray, "coordinate sample"]  # Coordinates of the discs: guess, then equilibrium [m]
    # Residual over the largest force; pins in contact [-]
    ratio: Float[np.ndarray, " sample"]
    touching: Float[np.ndarray, " sample"]
    late: Int[np.ndarray, " sample"]  # Samples that are not settled with their neighbours [-]
    pressing: Pressing  # Of one register's samples
    # The same: unbalanced force, Newton's step [N, m]
    gradient: Float[np.ndarray, "coordinate lane"]
    step: Float[np.ndarray, "coordinate lane"]


@jit
def make_tile(layout, size, contacts, samples):
    """Return an empty tile of so many samples: `ROW`, or one register."""
    return Tile(
        aligned(layout.end, samples),
        aligned(samples // WIDTH * contacts, WIDTH).reshape(samples // WIDTH, contacts, WIDTH),
        aligned(size, samples),
        aligned(1, samples).reshape(samples),
        aligned(size, samples),
        aligned(1, samples).reshape(samples),
        aligned(1, samples).reshape(samples),
        np.empty(samples, np.int64),
        make_pressing(size, contacts),
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
            total = fma(spread(by_load[m]), load(values, m * ROW + v), total)
        store(tile.rotation, v, total)
    for i in range(table.shape[1]):
        for v in range(0, used, FOUR):
            a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
            for m in rows:
                factor, row = spread(table[m, i]), m * ROW + v
                a = fma(factor, load(values, row), a)
                b = fma(factor, load(values, row + WIDTH), b)
                c = fma(factor, load(values, row + 2 * WIDTH), c)
                d = fma(factor, load(values, row + 3 * WIDTH), d)
            _store_four(tile.force, i * ROW + v, WIDTH, a, b, c, d)


@jit_in_place
def _store_four(out, at, apart, a, b, c, d):
    store(out, at, a)
    store(out, at + apart, b)
    store(out, at + 2 * apart, c)
    store(out, at + 3 * apart, d)


@jit_within
def _by_pin(outward, along, values, row, pins):
    """Return what the deviations of a pin compress its contact by: radial, tangential, of its radius."""
    total = fma(outward, load(values, row), load(values, row + 2 * pins * ROW))
    return fma(along, load(values, row + pins * ROW), total)


@jit_within
def _by_pin_of_four(table, values, row, pins, k):
    """Return the same for four registers."""
    outward, along = spread(table[0, k]), spread(table[1, k])
    return (
        _by_pin(outward, along, values, row, pins),
        _by_pin(outward, along, values, row + WIDTH, pins),
        _by_pin(outward, along, values, row + 2 * WIDTH, pins),
        _by_pin(outward, along, values, row + 3 * WIDTH, pins),
    )


@jit_within
def _undisturbed(at, tables, layout, waves, teeth_deviate, used, tile):
    """Set the pin compressions at undisplaced discs: two contacts of four registers at a time share what they load."""
    pins, values, out, contacts = layout.pins, tile.values, tile.undisturbed, tile.undisturbed.shape[1]
    apart = contacts * WIDTH
    for disc in range(tables.contact_by_error.shape[1]):
        table, first, wave = tables.contact_by_error[at, disc], disc * pins, (layout.wave + disc * layout.waves) * ROW
        for k in range(0, pins, 2):
            other = min(k + 1, pins - 1)
            for v in range(0, used, FOUR):
                a, b, c, d = _by_pin_of_four(table, values, (layout.pin + k) * ROW + v, pins, k)
                e, f, g, h = _by_pin_of_four(table, values, (layout.pin + other) * ROW + v, pins, other)
                for m in waves:
                    one, two, row = spread(table[2 + m, k]), spread(table[2 + m, other]), wave + m * ROW + v
                    w, x = load(values, row), load(values, row + WIDTH)
                    y, z = load(values, row + 2 * WIDTH), load(values, row + 3 * WIDTH)
                    a, b, c, d = fma(one, w, a), fma(one, x, b), fma(one, y, c), fma(one, z, d)
                    e, f, g, h = fma(two, w, e), fma(two, x, f), fma(two, y, g), fma(two, z, h)
                _store_four(out, v * contacts + (first + k) * WIDTH, apart, a, b, c, d)
                _store_four(out, v * contacts + (first + other) * WIDTH, apart, e, f, g, h)
        if teeth_deviate:
            for k in range(pins):
                for kind in range(2):
                    factor, tooth = spread(table[2 + layout.waves + kind, k]), tables.tooth[at, disc, k]
                    row = (layout.tooth + (2 * disc + kind) * layout.teeth + tooth) * ROW
                    for v in range(0, used, WIDTH):
                        place = v * contacts + (first + k) * WIDTH
                        store(out, place, fma(factor, load(values, row + v), load(out, place)))


@jit_within
def displace_nothing(at, tables, layout, rows, waves, teeth_deviate, used, tile):
    """Set all that the errors do at one node while the discs are undisplaced."""
    _forces(at, tables, rows, used, tile)
    _undisturbed(at, tables, layout, waves, teeth_deviate, used, tile)
