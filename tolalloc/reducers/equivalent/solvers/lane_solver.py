"""Equilibria of a tile of samples at one angle, side by side in registers, for pins and discs without play.

Newton's steps start where the angles before let the discs be guessed, and nearly all samples need whole ones only.
Where the tangent is singular, a small pivot replaces the vanishing one and the step ends where the next pin touches.
A register waits for the slowest of its samples. So those that are not settled after the first steps, one in twenty,
leave their registers and go on together. Samples not settled in more steps, or that meet no pin, need a line search and
are left to the solver for one sample.
"""

from __future__ import annotations

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.contact_solver import PIVOT, ROUNDING, TOLERANCE
from tolalloc.reducers.equivalent.solvers.lanes import (
    WIDTH,
    Common,
    above,
    choose,
    divide,
    entry,
    fma,
    larger,
    load,
    magnitude,
    multiply,
    newton_step,
    spread,
    store,
    subtract,
)
from tolalloc.reducers.equivalent.solvers.pressing import LaneTables, normal, pole_moves, press
from tolalloc.reducers.equivalent.solvers.tile import FOUR, LATE, displace_nothing
from tolalloc.running.compiled import jit_in_place, jit_within

_FIRST_STEPS, _STEPS = 2, 10
# Under a curved law, whose stiffness changes with every step
_FIRST_CURVED_STEPS, _CURVED_STEPS = 4, 16
_BEYOND = 1.000001  # of the way to the next contact
ALL = 2**WIDTH - 1
"""One bit for every lane."""


@jit_within
def first_steps(law):
    """Return how many steps a sample may take among its neighbours."""
    return _FIRST_STEPS if law == LINEAR else _FIRST_CURVED_STEPS


@jit_within
def most_steps(law):
    """Return how many steps a sample may take in a register before it is left to the solver for one sample."""
    return _STEPS if law == LINEAR else _CURVED_STEPS


@jit_within
def _balance(discs, stiffness, v, tile):
    """Set the unbalanced force of one register; return residual, what it may be, and the largest force."""
    size, width = 3 * len(discs), tile.q.shape[1]  # the size is known when compiled: straight code
    largest, cancelling, residual = spread(0.0), spread(0.0), spread(0.0)
    for i in range(size):
        applied, pressing = load(tile.force, i * width + v), load(tile.pressing.force, i * WIDTH)
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
def _first_touch(discs, tables, v, tile, lanes):
    """Return how many steps away the next pin touches in some lanes, and one bit per lane that meets one.

    Quotients are compared by products, because a division takes as long as sixteen.
    """
    zero, contacts, found = spread(0.0), tile.undisturbed.shape[1], 0
    gap, speed = spread(1.0), zero  # of the pin that touches first, as yet one that never does
    pins, width = contacts // len(discs), tile.q.shape[1]
    for d in range(len(discs)):
        x, y = pole_moves(d, tables, tile.q, width, v)
        along, across = pole_moves(d, tables, tile.step, WIDTH, 0)
        for c in range(d * pins, d * pins + tile.pressing.looked_at[d]):
            a, b = normal(tables, d, pins, c)
            depth = fma(b, y, fma(a, x, load(tile.undisturbed, v * contacts + c * WIDTH)))
            rate = fma(b, across, multiply(a, along))
            meets = above(rate, zero) & (lanes & ~above(depth, zero))
            if not meets:
                continue
            # −depth/rate < gap/speed
            sooner = meets & above(multiply(gap, rate), multiply(subtract(zero, depth), speed))
            gap, speed = choose(sooner, subtract(zero, depth), gap), choose(sooner, rate, speed)
            found |= sooner
    return divide(gap, choose(found, speed, spread(1.0))), found


@jit_within
def settle(law, discs, tables, v, tile, done, steps):
    """Bring one register's samples to equilibrium but for those done, in so many steps at most.

    Return one bit per lane that is not settled, and one per lane that needs more care than more steps.

    Steps are whole. With too few pins in contact the tangent is singular: such a lane moves to where the next pin
    touches and a hair beyond.
    """
    zero, width = spread(0.0), tile.q.shape[1]
    touching, careful = press(law, discs, tables, v, tile)
    for step in range(steps + 1):
        residual, allowed, largest = _balance(discs, tables.stiffness, v, tile)
        fresh = (ALL ^ above(residual, allowed)) & (ALL ^ (done | careful))
        if fresh:
            ratio = choose(above(largest, zero), divide(residual, largest), zero)
            store(tile.ratio, v, choose(fresh, ratio, load(tile.ratio, v)))
            store(tile.touching, v, choose(fresh, touching, load(tile.touching, v)))
            done |= fresh
        if (done | careful) == ALL or step == steps:
            break
        # A vanishing pivot is replaced by a small one.
        stiffness = tile.pressing.stiffness
        singular = newton_step(discs, tables.stiffness, stiffness, tile.gradient, tile.step, PIVOT)
        singular &= ALL ^ (done | careful)
        length = spread(1.0)
        if singular:
            reach, met = _first_touch(discs, tables, v, tile, singular)
            careful |= singular & (ALL ^ met)
            length = choose(singular, multiply(spread(_BEYOND), reach), length)
        moving = ALL ^ (done | careful)
        for i in range(3 * len(discs)):
            q = load(tile.q, i * width + v)
            store(tile.q, i * width + v, choose(moving, fma(length, load(tile.step, i * WIDTH), q), q))
        touching, far = press(law, discs, tables, v, tile)
        careful |= far & moving
    return ALL ^ done, careful & (ALL ^ done)


@jit_in_place
def _bring_late(first, count, tile):
    """Put some of the late samples into the register behind the tile."""
    contacts = tile.undisturbed.shape[1]
    undisturbed = tile.undisturbed.reshape(tile.undisturbed.size)
    for lane in range(count):
        s = tile.late[first + lane]
        own, late = (s // WIDTH * contacts) * WIDTH + s % WIDTH, LATE * contacts + lane
        for c in range(contacts):
            undisturbed[late + c * WIDTH] = undisturbed[own + c * WIDTH]
        for i in range(tile.q.shape[0]):
            tile.q[i, LATE + lane], tile.force[i, LATE + lane] = tile.q[i, s], tile.force[i, s]


@jit_in_place
def _take_back_late(first, count, tile):
    """Put the late samples back into their own registers."""
    for lane in range(count):
        s = tile.late[first + lane]
        tile.ratio[s], tile.touching[s] = tile.ratio[LATE + lane], tile.touching[LATE + lane]
        for i in range(tile.q.shape[0]):
            tile.q[i, s] = tile.q[i, LATE + lane]


@jit_within
def _settle_all(law, discs, here, samples, tile, careful):
    """Bring the first samples of a tile to equilibrium: register by register, then those that are late together."""
    late, brought, v = 0, 0, 0
    # One loop for both, so that `settle`, which is written out where it is called, is compiled once.
    while v < samples or brought < late:
        among = v < samples
        count = WIDTH if among else min(late - brought, WIDTH)
        if not among:
            _bring_late(brought, count, tile)
        at, done = (v, 0) if among else (LATE, ALL ^ (2**count - 1))
        left, hard = settle(law, discs, here, at, tile, done, first_steps(law) if among else most_steps(law))
        for lane in range(count):
            left_alone = ((hard if among else left) >> lane) & 1
            if among:
                careful[v + lane] = left_alone
                tile.late[late] = v + lane
                late += ((left & (ALL ^ hard)) >> lane) & 1
            else:
                careful[tile.late[brought + lane]] = left_alone
        if among:
            v += WIDTH
        else:
            _take_back_late(brought, count, tile)
            brought += count


@jit_within
def solve_tile_at(law, discs, at, tables, layout, rows, waves, teeth_deviate, samples, tile, careful):
    """Solve the first samples of a tile at one node from the guesses in ``tile.q``; set which need more care."""
    used = (samples + FOUR - 1) // FOUR * FOUR
    displace_nothing(at, tables, layout, rows, waves, teeth_deviate, used, tile)
    here = LaneTables(
        Common(tables.stiffness[at]),
        Common(tables.contact_by_disc[at]),
        Common(tables.pole_by_rotation[at]),
        Common(tables.contact_stiffness[at]),
        Common(tables.contact_log_length[at]),
    )
    _settle_all(law, discs, here, samples, tile, careful)
    width = tile.q.shape[1]
    for v in range(0, samples, WIDTH):
        total = load(tile.rotation, v)
        for i in range(tile.q.shape[0]):
            total = fma(spread(tables.carrier_by_retained[at, i]), load(tile.q, i * width + v), total)
        store(tile.rotation, v, total)
