"""Contacts of one register of samples at given coordinates: what presses them, and what that adds up to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.lanes import (
    WIDTH,
    Apart,
    Common,
    above,
    add,
    aligned,
    choose,
    compress,
    count_bits,
    entry,
    expand,
    fma,
    load,
    multiply,
    spread,
    store,
)
from tolalloc.reducers.equivalent.solvers.line_contact import line_contact
from tolalloc.running.compiled import jit, jit_in_place, jit_within


class LaneTables(NamedTuple):
    """What is tabulated at an angle: one angle for all lanes, or an own one for each."""

    stiffness: Common | Apart  # S, by rows [N/m]
    by_disc: Common | Apart  # D of every disc, direction and contact [m/m]
    pole: Common | Apart  # Displacement of every disc's pole per its rotation coordinate [m/m]
    # Stiffness [N/m] and ln L of every contact, for line contact
    contact: Common | Apart
    log_length: Common | Apart


class Pressing(NamedTuple):
    """Contacts of one register; those of a disc stand together, from the disc's number times the pins on."""

    looked_at: Int[np.ndarray, " disc"]  # Contacts of each disc that are looked at [-]
    # Sums over the pressed contacts of each disc, of forces [N] and of k·d_i·d_j, the lower triangle by rows [N/m]
    force: Float[np.ndarray, "coordinate lane"]
    stiffness: Float[np.ndarray, "entry lane"]
    # Contacts that are pressed in any lane, and one bit per lane in which they are, disc by disc; where each disc's end
    listed: Int[np.ndarray, " contact"]
    lanes: Int[np.ndarray, " contact"]
    end: Int[np.ndarray, " disc"]
    # All pairs of a listed contact and a lane that presses it, one after another: depth [m], stiffness [N/m] and ln L,
    # which become force [N], stiffness [N/m], and 1 where it is pressed too far
    pairs: Float[np.ndarray, "3 pair"]


@jit
def make_pressing(size, contacts):
    """Return the room for the contacts of one register, all of which are looked at."""
    discs = size // 3
    return Pressing(
        np.full(discs, contacts // discs),
        aligned(size, WIDTH),
        aligned(2 * size, WIDTH),
        np.empty(contacts, np.int64),
        np.empty(contacts, np.int64),
        np.empty(discs, np.int64),
        aligned(3, (contacts + 1) * WIDTH),
    )


@jit_within
def normal(tables, disc, pins, contact):
    """Return what a contact is compressed by per displacement x, y of its disc's pole."""
    at = 2 * disc * pins + contact
    return entry(tables.by_disc, at), entry(tables.by_disc, at + pins)


@jit_within
def pole_moves(disc, tables, rows, width, v):
    """Return by what x, y a disc's pole moves where the disc's three coordinates stand in rows of so many samples.

    All contact normals of a disc pass through its pole, so two coordinates say what three do (theory page, equation
    (16)), in two thirds of the time.
    """
    at = 3 * disc * width + v
    turn = load(rows, at + 2 * width)
    x, y = entry(tables.pole, 2 * disc), entry(tables.pole, 2 * disc + 1)
    return fma(x, turn, load(rows, at)), fma(y, turn, load(rows, at + width))


@jit_within
def _keep_sums(disc, tables, force, stiffness, out):
    """Keep what the contacts of a disc add up to at its pole, by the disc's three coordinates."""
    (gx, gy), (xx, xy, yy) = force, stiffness
    x, y = entry(tables.pole, 2 * disc), entry(tables.pole, 2 * disc + 1)
    for i, total in ((0, gx), (1, gy), (2, fma(x, gx, multiply(y, gy)))):
        store(out.force, (3 * disc + i) * WIDTH, total)
    xt, yt = fma(x, xx, multiply(y, xy)), fma(x, xy, multiply(y, yy))
    for i, total in ((0, xx), (1, xy), (2, yy), (3, xt), (4, yt), (5, fma(x, xt, multiply(y, yt)))):
        store(out.stiffness, (6 * disc + i) * WIDTH, total)


@jit_within
def _press(discs, tables, v, tile):
    """Add up the contacts of one register by the linear law; return how many are pressed."""
    out, contacts, undisturbed = tile.pressing, tile.undisturbed.shape[1], tile.undisturbed
    pins, width = contacts // len(discs), tile.q.shape[1]
    zero, one = spread(0.0), spread(1.0)
    touching = zero
    for d in range(len(discs)):
        x, y = pole_moves(d, tables, tile.q, width, v)
        gx, gy, xx, xy, yy = zero, zero, zero, zero, zero
        for c in range(d * pins, d * pins + out.looked_at[d]):
            a, b = normal(tables, d, pins, c)
            depth = fma(b, y, fma(a, x, load(undisturbed, v * contacts + c * WIDTH)))
            pressed = above(depth, zero)
            stiffness = choose(pressed, entry(tables.contact, c), zero)
            ka, kb = multiply(stiffness, a), multiply(stiffness, b)
            gx, gy = fma(ka, depth, gx), fma(kb, depth, gy)
            xx, xy, yy = fma(ka, a, xx), fma(ka, b, xy), fma(kb, b, yy)
            touching = choose(pressed, add(touching, one), touching)
        _keep_sums(d, tables, (gx, gy), (xx, xy, yy), out)
    return touching


@jit_within
def _list_pairs(discs, tables, v, tile):
    """List the pressed contacts of one register, and all pairs of them with a lane that presses; return how many."""
    out, contacts, undisturbed, zero = tile.pressing, tile.undisturbed.shape[1], tile.undisturbed, spread(0.0)
    pins, room, width = contacts // len(discs), out.pairs.shape[1], tile.q.shape[1]
    listed, pairs = 0, 0
    for d in range(len(discs)):
        x, y = pole_moves(d, tables, tile.q, width, v)
        for c in range(d * pins, d * pins + out.looked_at[d]):
            a, b = normal(tables, d, pins, c)
            depth = fma(b, y, fma(a, x, load(undisturbed, v * contacts + c * WIDTH)))
            pressed = above(depth, zero)
            if not pressed:
                continue
            out.listed[listed], out.lanes[listed] = c, pressed
            listed += 1
            compress(out.pairs, pairs, pressed, depth)
            compress(out.pairs, room + pairs, pressed, entry(tables.contact, c))
            compress(out.pairs, 2 * room + pairs, pressed, entry(tables.log_length, c))
            pairs += count_bits(pressed)
        out.end[d] = listed
    return pairs


@jit_within
def _press_pairs(pairs, out):
    """Turn depth, stiffness and ln L of all pairs into force, stiffness and 1 where a pair is pressed too far."""
    room, found = out.pairs.shape[1], 0
    for row, number in ((0, 1e-6), (1, 1.0), (2, 10.0)):  # beyond the last pair
        store(out.pairs, row * room + pairs, spread(number))
    for at in range(0, pairs, WIDTH):
        depth, stiffness, log_length = (
            load(out.pairs, at),
            load(out.pairs, room + at),
            load(out.pairs, 2 * room + at),
        )
        force, slope, far = line_contact(stiffness, log_length, depth)
        store(out.pairs, at, force)
        store(out.pairs, room + at, slope)
        store(out.pairs, 2 * room + at, choose(far, spread(1.0), spread(0.0)))
        found |= far
    return found


@jit_in_place
def _press_line_contacts(discs, tables, v, tile):
    """Add up the contacts of one register by line contact; return how many are pressed, and which lanes too far.

    Of eight lanes, a contact that is pressed in one is pressed in three. So the law, which is most of the work, is
    solved for pairs of a contact and a lane, eight pairs side by side.
    """
    out, zero, one = tile.pressing, spread(0.0), spread(1.0)
    pins, room = tile.undisturbed.shape[1] // len(discs), out.pairs.shape[1]
    far = _press_pairs(_list_pairs(discs, tables, v, tile), out)
    touching, careful, first, pair = zero, 0, 0, 0
    for d in range(len(discs)):
        gx, gy, xx, xy, yy = zero, zero, zero, zero, zero
        for n in range(first, out.end[d]):
            c, pressed = out.listed[n], out.lanes[n]
            a, b = normal(tables, d, pins, c)
            force, slope = expand(out.pairs, pair, pressed), expand(out.pairs, room + pair, pressed)
            if far:
                careful |= above(expand(out.pairs, 2 * room + pair, pressed), zero)
            pair += count_bits(pressed)
            gx, gy = fma(force, a, gx), fma(force, b, gy)
            ka, kb = multiply(slope, a), multiply(slope, b)
            xx, xy, yy = fma(ka, a, xx), fma(ka, b, xy), fma(kb, b, yy)
            touching = choose(pressed, add(touching, one), touching)
        first = out.end[d]
        _keep_sums(d, tables, (gx, gy), (xx, xy, yy), out)
    return touching, careful


@jit_within
def press(law, discs, tables, v, tile):
    """Add up the contacts of one register; return how many are pressed, and one bit per lane pressed too far."""
    if law == LINEAR:
        return _press(discs, tables, v, tile), 0
    return _press_line_contacts(discs, tables, v, tile)
