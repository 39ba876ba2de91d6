"""Equilibria of a tile of samples at one angle, eight samples to a register, for pins on linear springs alone.

Whole Newton steps from the last angle's equilibrium find nine in ten solutions within four steps. Lanes that need a
line search (a singular tangent, a contact set that does not settle) are left to the solver for one sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.equivalent.solvers.compiled import jit
from tolalloc.equivalent.solvers.contact_solver import PIVOT, ROUNDING, TOLERANCE
from tolalloc.equivalent.solvers.lanes import (
    WIDTH,
    above,
    add,
    choose,
    divide,
    fma,
    larger,
    load,
    magnitude,
    multiply,
    spread,
    store,
    subtract,
)

TILE = 32
"""Samples that share one look at an angle's tables: four registers."""

_STEPS = 8
_ALL = 2**WIDTH - 1


class Tile(NamedTuple):
    """Loads, state and work space of a tile; samples are the last axis, so that a register holds eight of them.

    Parameters
    ----------
    values
        What the tables take, `tolalloc.equivalent.columns.Layout` [m, rad, N·m].
    undisturbed, force, rotation
        Pin compressions [m], forces on the discs [N] and carrier rotation [rad] at undisplaced discs.
    q
        Coordinates of the discs: guess, then equilibrium [m].
    products
        k·d_i and k·d_i·d_j of every contact at this angle [N/m].
    gradient, step, tangent
        Of one register's samples [N, m, N/m].
    ratio, touching
        Residual over the largest force; pins in contact [-].
    """

    values: Float[np.ndarray, "value 32"]
    undisturbed: Float[np.ndarray, "contact 32"]
    force: Float[np.ndarray, "coordinate 32"]
    rotation: Float[np.ndarray, "32"]
    q: Float[np.ndarray, "coordinate 32"]
    products: Float[np.ndarray, "9 contact"]
    gradient: Float[np.ndarray, "coordinate 8"]
    step: Float[np.ndarray, "coordinate 8"]
    tangent: Float[np.ndarray, "coordinate coordinate 8"]
    ratio: Float[np.ndarray, "32"]
    touching: Float[np.ndarray, "32"]


@jit
def make_tile(layout, size, contacts):
    """Return an empty tile."""
    return Tile(
        np.empty((layout.end, TILE)),
        np.empty((contacts + 1, TILE)),
        np.empty((size, TILE)),
        np.empty(TILE),
        np.zeros((size, TILE)),
        np.empty((9, contacts)),
        np.empty((size, WIDTH)),
        np.empty((size, WIDTH)),
        np.empty((size, size, WIDTH)),
        np.empty(TILE),
        np.empty(TILE),
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


@jit
def _forces(at, tables, rows, tile):
    """Set forces and carrier rotation at undisplaced discs."""
    table, by_load = tables.load[at], tables.carrier_by_load[at]
    for v in range(0, TILE, WIDTH):
        total = spread(0.0)
        for m in rows:
            total = fma(spread(by_load[m]), load(tile.values, m * TILE + v), total)
        store(tile.rotation, v, total)
    for i in range(table.shape[1]):
        a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
        for m in rows:
            factor, row = spread(table[m, i]), m * TILE
            a = fma(factor, load(tile.values, row), a)
            b = fma(factor, load(tile.values, row + WIDTH), b)
            c = fma(factor, load(tile.values, row + 2 * WIDTH), c)
            d = fma(factor, load(tile.values, row + 3 * WIDTH), d)
        row = i * TILE
        store(tile.force, row, a)
        store(tile.force, row + WIDTH, b)
        store(tile.force, row + 2 * WIDTH, c)
        store(tile.force, row + 3 * WIDTH, d)


@jit
def _add_product(factor, values, row, out, at):
    """Add factor·(a tile's row) to a row of another array."""
    for v in range(0, TILE, WIDTH):
        store(out, at + v, fma(factor, load(values, row + v), load(out, at + v)))


@jit
def _undisturbed(at, tables, layout, waves, teeth_deviate, tile):
    """Set the pin compressions at undisplaced discs; two contacts at a time share the harmonic amplitudes."""
    pins, values, out = layout.pins, tile.values, tile.undisturbed
    radial, tangential, radius = layout.pin * TILE, (layout.pin + pins) * TILE, (layout.pin + 2 * pins) * TILE
    for d in range(tables.contact_by_error.shape[1]):
        table = tables.contact_by_error[at, d]
        for k in range(pins):
            outward, along, row = spread(table[0, k]), spread(table[1, k]), (d * pins + k) * TILE
            for v in range(0, TILE, WIDTH):
                place = k * TILE + v
                total = fma(outward, load(values, radial + place), load(values, radius + place))
                store(out, row + v, fma(along, load(values, tangential + place), total))
        for k in range(0, pins, 2):
            other = min(k + 1, pins - 1)
            p, q = (d * pins + k) * TILE, (d * pins + other) * TILE
            a, b, c, e = load(out, p), load(out, p + WIDTH), load(out, p + 2 * WIDTH), load(out, p + 3 * WIDTH)
            f, g, h, i = load(out, q), load(out, q + WIDTH), load(out, q + 2 * WIDTH), load(out, q + 3 * WIDTH)
            for m in waves:
                one, two = spread(table[2 + m, k]), spread(table[2 + m, other])
                row = (layout.wave + d * layout.waves + m) * TILE
                w, x = load(values, row), load(values, row + WIDTH)
                y, z = load(values, row + 2 * WIDTH), load(values, row + 3 * WIDTH)
                a, b, c, e = fma(one, w, a), fma(one, x, b), fma(one, y, c), fma(one, z, e)
                f, g, h, i = fma(two, w, f), fma(two, x, g), fma(two, y, h), fma(two, z, i)
            store(out, q, f)
            store(out, q + WIDTH, g)
            store(out, q + 2 * WIDTH, h)
            store(out, q + 3 * WIDTH, i)
            store(out, p, a)
            store(out, p + WIDTH, b)
            store(out, p + 2 * WIDTH, c)
            store(out, p + 3 * WIDTH, e)
        if teeth_deviate:
            first = layout.tooth + d * 2 * layout.teeth
            for k in range(pins):
                for kind in range(2):
                    factor = spread(table[2 + layout.waves + kind, k])
                    row = (first + kind * layout.teeth + tables.tooth[at, d, k]) * TILE
                    _add_product(factor, values, row, out, (d * pins + k) * TILE)


@jit
def _products(at, tables, products):
    """Set k·d_i and k·d_i·d_j of all contacts."""
    by_disc, stiffness = tables.contact_by_disc[at], tables.contact_stiffness[at]
    discs, _, pins = by_disc.shape
    for d in range(discs):
        row = 3
        for i in range(3):
            for k in range(pins):
                products[i, d * pins + k] = stiffness[d * pins + k] * by_disc[d, i, k]
            for j in range(i + 1):
                for k in range(pins):
                    products[row, d * pins + k] = products[i, d * pins + k] * by_disc[d, j, k]
                row += 1


@jit
def _assemble(at, tables, v, tile):
    """Set gradient and lower tangent of one register; return residual, bound of a converged one, and ratio's parts."""
    by_disc, stiffness, contact = tables.contact_by_disc[at], tables.stiffness[at], tables.contact_stiffness[at]
    discs, _, pins = by_disc.shape
    size, zero, one, products = 3 * discs, spread(0.0), spread(1.0), tile.products
    largest, cancelling, touching, residual = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    for i in range(size):
        applied = load(tile.force, i * TILE + v)
        value, terms = subtract(zero, applied), zero
        for j in range(size):
            factor, moved = spread(stiffness[i, j]), load(tile.q, j * TILE + v)
            value = fma(factor, moved, value)
            terms = fma(magnitude(factor), magnitude(moved), terms)
        store(tile.gradient, i * WIDTH, value)
        largest, cancelling = larger(magnitude(applied), largest), larger(terms, cancelling)
        for j in range(i + 1):
            store(tile.tangent, (i * size + j) * WIDTH, spread(stiffness[i, j]))
    for d in range(discs):
        x, y = load(tile.q, 3 * d * TILE + v), load(tile.q, (3 * d + 1) * TILE + v)
        turn = load(tile.q, (3 * d + 2) * TILE + v)
        gx, gy, gt, xx, xy, yy, xt, yt, tt = zero, zero, zero, zero, zero, zero, zero, zero, zero
        for k in range(pins):
            c = d * pins + k
            depth = load(tile.undisturbed, c * TILE + v)
            depth = fma(spread(by_disc[d, 0, k]), x, depth)
            depth = fma(spread(by_disc[d, 1, k]), y, depth)
            depth = fma(spread(by_disc[d, 2, k]), turn, depth)
            pressed = above(depth, zero)
            depth = choose(pressed, depth, zero)
            largest = larger(multiply(spread(contact[c]), depth), largest)
            touching = choose(pressed, add(touching, one), touching)
            gx = fma(spread(products[0, c]), depth, gx)
            gy = fma(spread(products[1, c]), depth, gy)
            gt = fma(spread(products[2, c]), depth, gt)
            xx = choose(pressed, add(xx, spread(products[3, c])), xx)
            xy = choose(pressed, add(xy, spread(products[4, c])), xy)
            yy = choose(pressed, add(yy, spread(products[5, c])), yy)
            xt = choose(pressed, add(xt, spread(products[6, c])), xt)
            yt = choose(pressed, add(yt, spread(products[7, c])), yt)
            tt = choose(pressed, add(tt, spread(products[8, c])), tt)
        first = 3 * d
        for i, sum_ in ((0, gx), (1, gy), (2, gt)):
            row = (first + i) * WIDTH
            store(tile.gradient, row, add(load(tile.gradient, row), sum_))
        for i, j, sum_ in ((0, 0, xx), (1, 0, xy), (1, 1, yy), (2, 0, xt), (2, 1, yt), (2, 2, tt)):
            row = ((first + i) * size + first + j) * WIDTH
            store(tile.tangent, row, add(load(tile.tangent, row), sum_))
    for i in range(size):
        residual = larger(magnitude(load(tile.gradient, i * WIDTH)), residual)
    allowed = larger(multiply(spread(TOLERANCE), largest), multiply(spread(ROUNDING), cancelling))
    return residual, allowed, largest, touching


@jit
def _solve(size, tile):
    """Solve tangent·step = −gradient by LDLᵀ in place; return one bit per lane whose pivot vanishes."""
    tangent, step, zero = tile.tangent, tile.step, spread(0.0)
    largest = zero
    for i in range(size):
        largest = larger(load(tangent, (i * size + i) * WIDTH), largest)
    least, singular = multiply(spread(PIVOT), largest), 0
    for i in range(size):
        value = subtract(zero, load(tile.gradient, i * WIDTH))
        pivot = load(tangent, (i * size + i) * WIDTH)
        for j in range(i):
            entry = load(tangent, (i * size + j) * WIDTH)
            for m in range(j):
                # Above the diagonal stand the factors times their pivots.
                entry = subtract(
                    entry,
                    multiply(load(tangent, (m * size + i) * WIDTH), load(tangent, (j * size + m) * WIDTH)),
                )
            store(tangent, (j * size + i) * WIDTH, entry)
            factor = multiply(entry, load(tangent, (j * size + j) * WIDTH))
            store(tangent, (i * size + j) * WIDTH, factor)
            pivot = subtract(pivot, multiply(entry, factor))
            value = subtract(value, multiply(factor, load(step, j * WIDTH)))
        singular |= _ALL ^ above(pivot, least)
        store(tangent, (i * size + i) * WIDTH, divide(spread(1.0), pivot))
        store(step, i * WIDTH, value)
    for i in range(size - 1, -1, -1):
        value = multiply(load(step, i * WIDTH), load(tangent, (i * size + i) * WIDTH))
        for m in range(i + 1, size):
            value = subtract(value, multiply(load(tangent, (m * size + i) * WIDTH), load(step, m * WIDTH)))
        store(step, i * WIDTH, value)
    return singular


@jit
def _newton(at, tables, v, tile):
    """Bring one register's samples to equilibrium by whole steps; return one bit per lane that needs more care."""
    size = tables.load.shape[2]
    done, careful = 0, 0
    for _ in range(_STEPS):
        residual, allowed, largest, touching = _assemble(at, tables, v, tile)
        fresh = (_ALL ^ above(residual, allowed)) & (_ALL ^ (done | careful))
        if fresh:
            ratio = choose(above(largest, spread(0.0)), divide(residual, largest), spread(0.0))
            store(tile.ratio, v, choose(fresh, ratio, load(tile.ratio, v)))
            store(tile.touching, v, choose(fresh, touching, load(tile.touching, v)))
            done |= fresh
        if (done | careful) == _ALL:
            break
        careful |= _solve(size, tile) & (_ALL ^ done)
        moving = _ALL ^ (done | careful)
        for i in range(size):
            q = load(tile.q, i * TILE + v)
            store(tile.q, i * TILE + v, choose(moving, add(q, load(tile.step, i * WIDTH)), q))
    return _ALL ^ done


@jit
def solve_tile_at(at, tables, layout, rows, waves, teeth_deviate, tile, careful):
    """Solve a tile at one node from the guesses in ``tile.q``; set which samples need more care."""
    _forces(at, tables, rows, tile)
    _undisturbed(at, tables, layout, waves, teeth_deviate, tile)
    _products(at, tables, tile.products)
    for v in range(0, TILE, WIDTH):
        bits = _newton(at, tables, v, tile)
        for lane in range(WIDTH):
            careful[v + lane] = (bits >> lane) & 1
        total = load(tile.rotation, v)
        for i in range(tile.q.shape[0]):
            total = fma(spread(tables.carrier_by_kept[at, i]), load(tile.q, i * TILE + v), total)
        store(tile.rotation, v, total)
