"""Contacts of one register of samples at given coordinates: what presses them, and what that adds up to.

Force and stiffness of line contacts have no table and no iteration that ends by itself, so that a lane has the same
bits alone and among others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.simd import (
    WIDTH,
    Apart,
    Common,
    above,
    add,
    aligned,
    choose,
    compress,
    count_bits,
    divide,
    entry,
    expand,
    fma,
    larger,
    load,
    logarithm,
    multiply,
    spread,
    store,
    subtract,
)
from tolalloc.running.compiled import jit, jit_in_place, jit_within

DEEPEST = 2.5
"""ln(λ/depth) of the deepest line contact that is solved here; no pin is pressed nearly so far [-]."""
_FITTED = (5.0, 40.0)
"""The same, between which w is a quotient of two polynomials; contacts elsewhere hardly touch, or bend [-]."""
# Polynomials in ln(λ/depth) whose quotient is w within 3e-15 of it; the highest power first
_ABOVE = (
    5.672391747372849e-07,
    0.0001299594283366941,
    0.007869168757409338,
    0.16762474883751757,
    1.3152282419323045,
    3.208371600720944,
    -0.0405589794698379,
    -2.926977775381174,
    0.22754703860728592,
)
_BELOW = (
    1e-12,
    5.660080962424214e-07,
    0.00012637603146998638,
    0.007277723649627696,
    0.1416246660138495,
    0.9440256812267587,
    1.6378491713093841,
    -0.5558535883401736,
    -0.62195314420652,
)
BEYOND = 1.000001
"""Of the way to the next contact, where a step ends that nothing else resists [-]."""


@jit_within
def _polynomial(coefficients, x):
    """Return a polynomial by its coefficients, the highest power first."""
    total = spread(coefficients[0])
    for i in range(1, len(coefficients)):
        total = fma(total, x, spread(coefficients[i]))
    return total


@jit_within
def _halley(w, goal):
    """Return w after one of Halley's steps to w − ln w = goal."""
    one = spread(1.0)
    inverse = divide(one, multiply(w, subtract(w, one)))
    newton = multiply(multiply(subtract(subtract(w, logarithm(w)), goal), multiply(w, w)), inverse)
    return subtract(w, multiply(newton, fma(multiply(spread(0.5), newton), inverse, one)))


@jit_within
def line_contact(stiffness, log_length, depth):
    """Return force, stiffness and one bit per lane that is pressed too far, of Hertzian line contact at depths above 0.

    The law of `tolalloc.reducers.cycloid.solvers.pins`: w − ln w = ln(λ/depth), F = c·depth/w with c twice the
    stiffness k, and dF/d(depth) = c/(w − 1) [N, N/m]. Quotients share their denominators: a division takes as long as
    ten products.

    References
    ----------
    Hertz's line contact, theory page equation (30); polynomials and Halley's steps are an own derivation.
    """
    one = spread(1.0)
    goal = subtract(log_length, logarithm(depth))
    far = above(spread(DEEPEST), goal)
    goal = larger(goal, spread(DEEPEST))
    p, q = _polynomial(_ABOVE, goal), _polynomial(_BELOW, goal)  # w = p/q
    elsewhere = above(goal, spread(_FITTED[1])) | above(spread(_FITTED[0]), goal)
    if elsewhere:
        w = _halley(_halley(_halley(add(goal, logarithm(add(goal, one))), goal), goal), goal)
        p, q = choose(elsewhere, w, p), choose(elsewhere, one, q)
    below = subtract(p, q)
    scale = divide(multiply(add(stiffness, stiffness), q), multiply(p, below))
    return multiply(multiply(scale, below), depth), multiply(scale, p), far


class VectorTables(NamedTuple):
    """What is tabulated at an angle: one angle for all lanes, or an own one for each."""

    stiffness: Common | Apart  # S, by rows [N/m]
    by_disc: Common | Apart  # D of every disc, direction and contact [m/m]
    pole: Common | Apart  # Displacement of every disc's pole per its rotation coordinate [m/m]
    # Stiffness [N/m] and ln L of every contact, for line contact
    contact: Common | Apart
    log_length: Common | Apart
    # Compression of every element with play, x, y, per coordinate [m/m], and its stiffness [N/m]
    play_by_retained: Common | Apart
    play_stiffness: Common | Apart


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

    All contact normals of a disc pass through its pole, so two coordinates say exactly what three do in the gap of
    theory page equation (17), in two thirds of the time.

    (x − r_d·θ·sin β, y + r_d·θ·cos β) [m], own derivation.

    Examples
    --------
    What a pin feels of a disc's rotation is what it feels of its pole's movement:

    >>> from tolalloc.reducers.equivalent.condensation import condense
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = condense(load_reducer("rv20e_liu2020"), (1,), np.zeros(1))
    >>> by_disc, pole = found.contact_by_disc[0, 0], found.pole_by_rotation[0, 0]
    >>> bool(np.allclose(by_disc[2], pole @ by_disc[:2]))
    True
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
def _press(discs, tables, v, batch):
    """Add up the contacts of one register by the linear law; return how many are pressed."""
    out, contacts, undisturbed = batch.pressing, batch.undisturbed.shape[1], batch.undisturbed
    pins, width = contacts // len(discs), batch.q.shape[1]
    zero, one = spread(0.0), spread(1.0)
    touching = zero
    for d in range(len(discs)):
        x, y = pole_moves(d, tables, batch.q, width, v)
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
def _list_pairs(discs, tables, v, batch):
    """List the pressed contacts of one register, and all pairs of them with a lane that presses; return how many."""
    out, contacts, undisturbed, zero = batch.pressing, batch.undisturbed.shape[1], batch.undisturbed, spread(0.0)
    pins, room, width = contacts // len(discs), out.pairs.shape[1], batch.q.shape[1]
    listed, pairs = 0, 0
    for d in range(len(discs)):
        x, y = pole_moves(d, tables, batch.q, width, v)
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
def _press_line_contacts(discs, tables, v, batch):
    """Add up the contacts of one register by line contact; return how many are pressed, and which lanes too far.

    Of eight lanes, a contact that is pressed in one is pressed in three. So the law, which is most of the work, is
    solved for pairs of a contact and a lane, eight pairs side by side.
    """
    out, zero, one = batch.pressing, spread(0.0), spread(1.0)
    pins, room = batch.undisturbed.shape[1] // len(discs), out.pairs.shape[1]
    far = _press_pairs(_list_pairs(discs, tables, v, batch), out)
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
def press(law, discs, tables, v, batch):
    """Add up the contacts of one register; return how many are pressed, and one bit per lane pressed too far."""
    if law == LINEAR:
        return _press(discs, tables, v, batch), 0
    return _press_line_contacts(discs, tables, v, batch)


@jit_in_place
def first_touch(discs, tables, v, batch, lanes):
    """Return how many steps away the next pin touches in some lanes, and one bit per lane that meets one.

    Quotients are compared by products, because a division takes as long as sixteen.

    The least −depth/rate of all pins that come nearer, own derivation [-].

    Examples
    --------
    A pin 2 µm off that a step brings 4 µm nearer, and one 3 µm off that it brings 5 µm nearer [steps]:

    >>> min(2 / 4, 3 / 5)
    0.5
    """
    zero, contacts, found = spread(0.0), batch.undisturbed.shape[1], 0
    gap, speed = spread(1.0), zero  # of the pin that touches first, as yet one that never does
    pins, width = contacts // len(discs), batch.q.shape[1]
    for d in range(len(discs)):
        x, y = pole_moves(d, tables, batch.q, width, v)
        along, across = pole_moves(d, tables, batch.step, WIDTH, 0)
        for c in range(d * pins, d * pins + batch.pressing.looked_at[d]):
            a, b = normal(tables, d, pins, c)
            depth = fma(b, y, fma(a, x, load(batch.undisturbed, v * contacts + c * WIDTH)))
            rate = fma(b, across, multiply(a, along))
            meets = above(rate, zero) & (lanes & ~above(depth, zero))
            if not meets:
                continue
            # −depth/rate < gap/speed
            sooner = meets & above(multiply(gap, rate), multiply(subtract(zero, depth), speed))
            gap, speed = choose(sooner, subtract(zero, depth), gap), choose(sooner, rate, speed)
            found |= sooner
    return divide(gap, choose(found, speed, spread(1.0))), found
