"""Equilibria of a tile of samples at one angle, eight samples to a register, for pins and discs without play.

Newton's steps start on the line through the last two angles' equilibria, and nearly all samples need whole ones only.
Where the tangent is singular, a small pivot replaces the vanishing one and the step ends where the next pin touches.
Samples not settled in some steps, or that so meet no pin, need a line search and are left to the solver for one sample.
"""

from __future__ import annotations

import numpy as np

from tolalloc.compiled import jit, jit_within
from tolalloc.rv.cycloid.solvers import LINEAR
from tolalloc.rv.equivalent.solvers.contact_solver import PIVOT, ROUNDING, TOLERANCE
from tolalloc.rv.equivalent.solvers.lanes import (
    WIDTH,
    above,
    add,
    choose,
    divide,
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
from tolalloc.rv.equivalent.solvers.tile import TILE, displace_nothing

_STEPS = 10
_CURVED_STEPS = 16  # under a curved law, whose stiffness changes with every step
DEEPEST = 2.5
"""ln(λ/depth) of the deepest line contact that is solved here; no pin is pressed nearly so far [-]."""
_BEYOND = 1.000001  # of the way to the next contact
_ALL = 2**WIDTH - 1


@jit_within
def _press(by_disc, v, tile):
    """Set force and stiffness of the contacts of one register; return how many are pressed."""
    discs, _, pins = by_disc.shape
    zero, one, weighted, undisturbed = spread(0.0), spread(1.0), tile.weighted, tile.undisturbed
    touching = zero
    for d in range(discs):
        first = 3 * d * TILE + v
        x, y, turn = load(tile.q, first), load(tile.q, first + TILE), load(tile.q, first + 2 * TILE)
        gx, gy, gt, xx, xy, yy, xt, yt, tt = zero, zero, zero, zero, zero, zero, zero, zero, zero
        for k in range(pins):
            c = d * pins + k
            a, b, t = spread(by_disc[d, 0, k]), spread(by_disc[d, 1, k]), spread(by_disc[d, 2, k])
            depth = fma(t, turn, fma(b, y, fma(a, x, load(undisturbed, c * TILE + v))))
            pressed = above(depth, zero)
            ka = choose(pressed, spread(weighted[0, c]), zero)
            kb = choose(pressed, spread(weighted[1, c]), zero)
            kt = choose(pressed, spread(weighted[2, c]), zero)
            gx, gy, gt = fma(ka, depth, gx), fma(kb, depth, gy), fma(kt, depth, gt)
            xx, xy, yy = fma(ka, a, xx), fma(ka, b, xy), fma(kb, b, yy)
            xt, yt, tt = fma(ka, t, xt), fma(kb, t, yt), fma(kt, t, tt)
            touching = choose(pressed, add(touching, one), touching)
        for i, total in ((0, gx), (1, gy), (2, gt)):
            store(tile.pins, (3 * d + i) * WIDTH, total)
        for i, total in ((0, xx), (1, xy), (2, yy), (3, xt), (4, yt), (5, tt)):
            store(tile.stiffness, (6 * d + i) * WIDTH, total)
    return touching


@jit
def _line_contact(stiffness, log_length, depth):
    """Return force, stiffness and one bit per lane that is pressed too far, of Hertzian line contact at depths above 0.

    The law of `tolalloc.rv.cycloid.solvers.contact_law`: w − ln w = ln(λ/depth), F = c·depth/w with c twice the
    stiffness. Halley's steps from w = g + ln(1 + g) triple the digits: two of them end at rounding.
    """
    one, half = spread(1.0), spread(0.5)
    goal = subtract(spread(log_length), logarithm(depth))
    far = above(spread(DEEPEST), goal)
    goal = larger(goal, spread(DEEPEST))
    w = add(goal, logarithm(add(goal, one)))
    for _ in range(2):
        below = subtract(w, one)
        newton = divide(multiply(subtract(subtract(w, logarithm(w)), goal), w), below)
        bend = divide(multiply(half, newton), multiply(w, below))
        w = subtract(w, multiply(newton, add(one, bend)))
    scale = spread(2.0 * stiffness)
    return divide(multiply(scale, depth), w), divide(scale, subtract(w, one)), far


@jit
def _press_line_contacts(at, tables, v, tile):
    """Set force and stiffness of the contacts of one register; return how many are pressed, and which too far."""
    by_disc, stiffness, log_length = (
        tables.contact_by_disc[at],
        tables.contact_stiffness[at],
        tables.contact_log_length[at],
    )
    discs, _, pins = by_disc.shape
    zero, one, undisturbed = spread(0.0), spread(1.0), tile.undisturbed
    touching, careful = zero, 0
    for d in range(discs):
        first = 3 * d * TILE + v
        x, y, turn = load(tile.q, first), load(tile.q, first + TILE), load(tile.q, first + 2 * TILE)
        gx, gy, gt, xx, xy, yy, xt, yt, tt = zero, zero, zero, zero, zero, zero, zero, zero, zero
        for k in range(pins):
            c = d * pins + k
            a, b, t = spread(by_disc[d, 0, k]), spread(by_disc[d, 1, k]), spread(by_disc[d, 2, k])
            depth = fma(t, turn, fma(b, y, fma(a, x, load(undisturbed, c * TILE + v))))
            pressed = above(depth, zero)
            if not pressed:
                continue
            force, slope, far = _line_contact(stiffness[c], log_length[c], choose(pressed, depth, spread(1e-6)))
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
def _pressed(law, at, tables, v, tile):
    """Set force and stiffness of the contacts of one register by their law."""
    if law == LINEAR:
        return _press(tables.contact_by_disc[at], v, tile), 0
    return _press_line_contacts(at, tables, v, tile)


@jit_within
def _balance(discs, stiffness, v, tile):
    """Set the unbalanced force of one register; return residual, what it may be, and the largest force."""
    size = 3 * len(discs)  # known when compiled, so these loops become straight code
    largest, cancelling, residual = spread(0.0), spread(0.0), spread(0.0)
    for i in range(size):
        applied, pressing = load(tile.force, i * TILE + v), load(tile.pins, i * WIDTH)
        value, terms = subtract(pressing, applied), spread(0.0)
        for j in range(size):
            factor, moved = spread(stiffness[i, j]), load(tile.q, j * TILE + v)
            value = fma(factor, moved, value)
            terms = fma(magnitude(factor), magnitude(moved), terms)
        store(tile.gradient, i * WIDTH, value)
        largest = larger(larger(magnitude(applied), magnitude(pressing)), largest)
        cancelling, residual = larger(terms, cancelling), larger(magnitude(value), residual)
    allowed = larger(multiply(spread(TOLERANCE), largest), multiply(spread(ROUNDING), cancelling))
    return residual, allowed, largest


@jit
def _first_touch(by_disc, v, tile):
    """Return how many steps away the next pin touches, and one bit per lane that meets one."""
    zero, nowhere = spread(0.0), spread(-np.inf)
    discs, _, pins = by_disc.shape
    closest = nowhere  # minus the length
    for d in range(discs):
        row, first = 3 * d * WIDTH, 3 * d * TILE + v
        x, y, turn = load(tile.q, first), load(tile.q, first + TILE), load(tile.q, first + 2 * TILE)
        sx, sy, st = load(tile.step, row), load(tile.step, row + WIDTH), load(tile.step, row + 2 * WIDTH)
        for k in range(pins):
            a, b, t = spread(by_disc[d, 0, k]), spread(by_disc[d, 1, k]), spread(by_disc[d, 2, k])
            depth = fma(t, turn, fma(b, y, fma(a, x, load(tile.undisturbed, (d * pins + k) * TILE + v))))
            rate = fma(t, st, fma(b, sy, multiply(a, sx)))
            meets = above(rate, zero) & (_ALL ^ above(depth, zero))
            closest = larger(choose(meets, divide(depth, rate), nowhere), closest)
    return subtract(zero, closest), above(closest, nowhere)


@jit_within
def _newton(law, discs, at, tables, v, tile):
    """Bring one register's samples to equilibrium; return one bit per lane that needs more care.

    Steps are whole. With too few pins in contact the tangent is singular: such a lane moves to where the next pin
    touches and a hair beyond.
    """
    by_disc, stiffness, zero = tables.contact_by_disc[at], tables.stiffness[at], spread(0.0)
    done = 0
    touching, careful = _pressed(law, at, tables, v, tile)
    for _ in range(_STEPS if law == LINEAR else _CURVED_STEPS):
        residual, allowed, largest = _balance(discs, stiffness, v, tile)
        fresh = (_ALL ^ above(residual, allowed)) & (_ALL ^ (done | careful))
        if fresh:
            ratio = choose(above(largest, zero), divide(residual, largest), zero)
            store(tile.ratio, v, choose(fresh, ratio, load(tile.ratio, v)))
            store(tile.touching, v, choose(fresh, touching, load(tile.touching, v)))
            done |= fresh
        if (done | careful) == _ALL:
            break
        # A vanishing pivot is replaced by a small one.
        singular = newton_step(discs, stiffness, tile.stiffness, tile.gradient, tile.step, PIVOT)
        singular &= _ALL ^ (done | careful)
        length = spread(1.0)
        if singular:
            reach, met = _first_touch(by_disc, v, tile)
            careful |= singular & (_ALL ^ met)
            length = choose(singular, multiply(spread(_BEYOND), reach), length)
        moving = _ALL ^ (done | careful)
        for i in range(3 * len(discs)):
            q = load(tile.q, i * TILE + v)
            store(tile.q, i * TILE + v, choose(moving, fma(length, load(tile.step, i * WIDTH), q), q))
        touching, far = _pressed(law, at, tables, v, tile)
        careful |= far & moving
    return _ALL ^ done


@jit_within
def solve_tile_at(law, discs, at, tables, layout, rows, waves, teeth_deviate, used, tile, careful):
    """Solve the ``used`` samples of a tile at one node from the guesses in ``tile.q``; set which need more care."""
    displace_nothing(at, tables, layout, rows, waves, teeth_deviate, used, tile)
    for v in range(0, used, WIDTH):
        bits = _newton(law, discs, at, tables, v, tile)
        for lane in range(WIDTH):
            careful[v + lane] = (bits >> lane) & 1
        total = load(tile.rotation, v)
        for i in range(tile.q.shape[0]):
            total = fma(spread(tables.carrier_by_retained[at, i]), load(tile.q, i * TILE + v), total)
        store(tile.rotation, v, total)
