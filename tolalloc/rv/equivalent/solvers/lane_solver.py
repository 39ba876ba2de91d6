"""Equilibria of a tile of samples at one angle, eight samples to a register, for pins and discs without play.

Newton's steps start on the line through the last two angles' equilibria, and nearly all samples need whole ones only.
Where the tangent is singular, a small pivot replaces the vanishing one and the step ends where the next pin touches.
Samples not settled in some steps, or that so meet no pin, need a line search and are left to the solver for one sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolalloc.compiled import jit_in_place, jit_within
from tolalloc.rv.cycloid.solvers import LINEAR
from tolalloc.rv.equivalent.solvers.contact_solver import PIVOT, ROUNDING, TOLERANCE
from tolalloc.rv.equivalent.solvers.lanes import (
    WIDTH,
    Apart,
    Common,
    above,
    add,
    choose,
    divide,
    entry,
    fma,
    larger,
    load,
    logarithm,
    magnitude,
    multiply,
    newton_step,
    spread,
    store,
    subtract,
)
from tolalloc.rv.equivalent.solvers.tile import FOUR, displace_nothing

_STEPS = 10
_CURVED_STEPS = 16  # under a curved law, whose stiffness changes with every step
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
_BEYOND = 1.000001  # of the way to the next contact
ALL = 2**WIDTH - 1
"""One bit for every lane."""


class LaneTables(NamedTuple):
    """What is tabulated at an angle: one angle for all lanes, or an own one for each."""

    stiffness: Common | Apart  # S, by rows [N/m]
    by_disc: Common | Apart  # D of every disc, direction and pin [m/m]
    weighted: Common | Apart  # k·d of every direction and contact [N/m], for the linear law
    # Stiffness [N/m] and ln L of every contact, for line contact
    contact: Common | Apart
    log_length: Common | Apart


@jit_within
def _lever(tables, disc, pins, pin):
    """Return what a contact is compressed by with its disc's three coordinates."""
    at = 3 * disc * pins + pin
    return entry(tables.by_disc, at), entry(tables.by_disc, at + pins), entry(tables.by_disc, at + 2 * pins)


@jit_within
def _press(discs, tables, v, tile):
    """Set force and stiffness of the contacts of one register; return how many are pressed."""
    contacts, width = tile.undisturbed.shape
    pins = contacts // len(discs)
    zero, one, undisturbed = spread(0.0), spread(1.0), tile.undisturbed
    touching = zero
    for d in range(len(discs)):
        first = 3 * d * width + v
        x, y, turn = load(tile.q, first), load(tile.q, first + width), load(tile.q, first + 2 * width)
        gx, gy, gt, xx, xy, yy, xt, yt, tt = zero, zero, zero, zero, zero, zero, zero, zero, zero
        for k in range(pins):
            c = d * pins + k
            a, b, t = _lever(tables, d, pins, k)
            depth = fma(t, turn, fma(b, y, fma(a, x, load(undisturbed, c * width + v))))
            pressed = above(depth, zero)
            ka = choose(pressed, entry(tables.weighted, c), zero)
            kb = choose(pressed, entry(tables.weighted, contacts + c), zero)
            kt = choose(pressed, entry(tables.weighted, 2 * contacts + c), zero)
            gx, gy, gt = fma(ka, depth, gx), fma(kb, depth, gy), fma(kt, depth, gt)
            xx, xy, yy = fma(ka, a, xx), fma(ka, b, xy), fma(kb, b, yy)
            xt, yt, tt = fma(ka, t, xt), fma(kb, t, yt), fma(kt, t, tt)
            touching = choose(pressed, add(touching, one), touching)
        for i, total in ((0, gx), (1, gy), (2, gt)):
            store(tile.pins, (3 * d + i) * WIDTH, total)
        for i, total in ((0, xx), (1, xy), (2, yy), (3, xt), (4, yt), (5, tt)):
            store(tile.stiffness, (6 * d + i) * WIDTH, total)
    return touching


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
def _line_contact(stiffness, log_length, depth):
    """Return force, stiffness and one bit per lane that is pressed too far, of Hertzian line contact at depths above 0.

    The law of `tolalloc.rv.cycloid.solvers.contact_law`: w − ln w = ln(λ/depth), F = c·depth/w with c twice the
    stiffness k, and dF/d(depth) = c/(w − 1). Quotients share their denominators: a division takes as long as ten
    products.
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


@jit_in_place
def _press_line_contacts(discs, tables, v, tile):
    """Set force and stiffness of the contacts of one register; return how many are pressed, and which too far."""
    pins, width = tile.undisturbed.shape[0] // len(discs), tile.undisturbed.shape[1]
    zero, one, undisturbed = spread(0.0), spread(1.0), tile.undisturbed
    touching, careful = zero, 0
    for d in range(len(discs)):
        first = 3 * d * width + v
        x, y, turn = load(tile.q, first), load(tile.q, first + width), load(tile.q, first + 2 * width)
        gx, gy, gt, xx, xy, yy, xt, yt, tt = zero, zero, zero, zero, zero, zero, zero, zero, zero
        for k in range(pins):
            c = d * pins + k
            a, b, t = _lever(tables, d, pins, k)
            depth = fma(t, turn, fma(b, y, fma(a, x, load(undisturbed, c * width + v))))
            pressed = above(depth, zero)
            if not pressed:
                continue
            own = choose(pressed, depth, spread(1e-6))
            force, slope, far = _line_contact(entry(tables.contact, c), entry(tables.log_length, c), own)
            careful |= far & pressed
            force, slope = choose(pressed, force, zero), choose(pressed, slope, zero)
            gx, gy, gt = fma(force, a, gx), fma(force, b, gy), fma(force, t, gt)
            ka, kb, kt = multiply(slope, a), multiply(slope, b), multiply(slope, t)
            xx, xy, yy = fma(ka, a, xx), fma(ka, b, xy), fma(kb, b, yy)
            xt, yt, tt = fma(ka, t, xt), fma(kb, t, yt), fma(kt, t, tt)
            touching = choose(pressed, add(touching, one), touching)
        for i, total in ((0, gx), (1, gy), (2, gt)):
            store(tile.pins, (3 * d + i) * WIDTH, total)
        for i, total in ((0, xx), (1, xy), (2, yy), (3, xt), (4, yt), (5, tt)):
            store(tile.stiffness, (6 * d + i) * WIDTH, total)
    return touching, careful


@jit_within
def _pressed(law, discs, tables, v, tile):
    """Set force and stiffness of the contacts of one register by their law."""
    if law == LINEAR:
        return _press(discs, tables, v, tile), 0
    return _press_line_contacts(discs, tables, v, tile)


@jit_within
def _balance(discs, stiffness, v, tile):
    """Set the unbalanced force of one register; return residual, what it may be, and the largest force."""
    size, width = 3 * len(discs), tile.q.shape[1]  # the size is known when compiled: straight code
    largest, cancelling, residual = spread(0.0), spread(0.0), spread(0.0)
    for i in range(size):
        applied, pressing = load(tile.force, i * width + v), load(tile.pins, i * WIDTH)
        value, terms = subtract(pressing, applied), spread(0.0)
        for j in range(size):
            factor, moved = entry(stiffness, i * size + j), load(tile.q, j * width + v)
            value = fma(factor, moved, value)
            terms = fma(magnitude(factor), magnitude(moved), terms)
        store(tile.gradient, i * WIDTH, value)
        largest = larger(larger(magnitude(applied), magnitude(pressing)), largest)
        cancelling, residual = larger(terms, cancelling), larger(magnitude(value), residual)
    allowed = larger(multiply(spread(TOLERANCE), largest), multiply(spread(ROUNDING), cancelling))
    return residual, allowed, largest


@jit_in_place
def _first_touch(discs, tables, v, tile):
    """Return how many steps away the next pin touches, and one bit per lane that meets one."""
    zero, nowhere = spread(0.0), spread(-np.inf)
    pins, width = tile.undisturbed.shape[0] // len(discs), tile.undisturbed.shape[1]
    closest = nowhere  # minus the length
    for d in range(len(discs)):
        row, first = 3 * d * WIDTH, 3 * d * width + v
        x, y, turn = load(tile.q, first), load(tile.q, first + width), load(tile.q, first + 2 * width)
        sx, sy, st = load(tile.step, row), load(tile.step, row + WIDTH), load(tile.step, row + 2 * WIDTH)
        for k in range(pins):
            a, b, t = _lever(tables, d, pins, k)
            depth = fma(t, turn, fma(b, y, fma(a, x, load(tile.undisturbed, (d * pins + k) * width + v))))
            rate = fma(t, st, fma(b, sy, multiply(a, sx)))
            meets = above(rate, zero) & (ALL ^ above(depth, zero))
            closest = larger(choose(meets, divide(depth, rate), nowhere), closest)
    return subtract(zero, closest), above(closest, nowhere)


@jit_within
def settle(law, discs, tables, v, tile, done):
    """Bring one register's samples to equilibrium but for those done; return one bit per lane that needs more care.

    Steps are whole. With too few pins in contact the tangent is singular: such a lane moves to where the next pin
    touches and a hair beyond.
    """
    zero, width = spread(0.0), tile.q.shape[1]
    touching, careful = _pressed(law, discs, tables, v, tile)
    for _ in range(_STEPS if law == LINEAR else _CURVED_STEPS):
        residual, allowed, largest = _balance(discs, tables.stiffness, v, tile)
        fresh = (ALL ^ above(residual, allowed)) & (ALL ^ (done | careful))
        if fresh:
            ratio = choose(above(largest, zero), divide(residual, largest), zero)
            store(tile.ratio, v, choose(fresh, ratio, load(tile.ratio, v)))
            store(tile.touching, v, choose(fresh, touching, load(tile.touching, v)))
            done |= fresh
        if (done | careful) == ALL:
            break
        # A vanishing pivot is replaced by a small one.
        singular = newton_step(discs, tables.stiffness, tile.stiffness, tile.gradient, tile.step, PIVOT)
        singular &= ALL ^ (done | careful)
        length = spread(1.0)
        if singular:
            reach, met = _first_touch(discs, tables, v, tile)
            careful |= singular & (ALL ^ met)
            length = choose(singular, multiply(spread(_BEYOND), reach), length)
        moving = ALL ^ (done | careful)
        for i in range(3 * len(discs)):
            q = load(tile.q, i * width + v)
            store(tile.q, i * width + v, choose(moving, fma(length, load(tile.step, i * WIDTH), q), q))
        touching, far = _pressed(law, discs, tables, v, tile)
        careful |= far & moving
    return ALL ^ done


@jit_within
def solve_tile_at(law, discs, at, tables, layout, rows, waves, teeth_deviate, samples, tile, careful):
    """Solve the first samples of a tile at one node from the guesses in ``tile.q``; set which need more care."""
    used = (samples + FOUR - 1) // FOUR * FOUR
    displace_nothing(at, tables, layout, rows, waves, teeth_deviate, used, tile)
    here = LaneTables(
        Common(tables.stiffness[at]),
        Common(tables.contact_by_disc[at]),
        Common(tile.weighted),
        Common(tables.contact_stiffness[at]),
        Common(tables.contact_log_length[at]),
    )
    width = tile.q.shape[1]
    for v in range(0, samples, WIDTH):
        bits = settle(law, discs, here, v, tile, 0)
        for lane in range(WIDTH):
            careful[v + lane] = (bits >> lane) & 1
        total = load(tile.rotation, v)
        for i in range(tile.q.shape[0]):
            total = fma(spread(tables.carrier_by_retained[at, i]), load(tile.q, i * width + v), total)
        store(tile.rotation, v, total)
