"""Equilibria of a batch of samples at one angle, side by side in registers, for pins and discs without play.

Newton's steps start where the angles before let the discs be guessed, and nearly all samples need whole ones only.
Where the tangent is singular, a small pivot replaces the vanishing one and the step ends where the next pin touches.
A register waits for the slowest of its samples. So those that are not settled after the first steps, one in twenty,
leave their registers and go on together. Samples not settled in more steps, or that meet no pin, need a line search and
are left to the solver for one sample.

After a turn of its crank a disc meets the pins again, each a tooth further, and only the errors of single pins and
teeth make the difference. So an equilibrium is that of a crank's turn before, and has changed by nearly what it had
changed by in the turn before that. A straight line through the last two angles is five times as far off: there are 24
angles to a crank's turn, and at each of them a pin begins or ceases to touch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.solvers.contact_solver import PIVOT, ROUNDING, TOLERANCE
from tolalloc.reducers.equivalent.solvers.play import (
    begin_search,
    bring_play,
    displace_play,
    list_touched,
    move_with_play,
)
from tolalloc.reducers.equivalent.solvers.pressing import (
    BEYOND,
    Pressing,
    VectorTables,
    first_touch,
    make_pressing,
    press,
)
from tolalloc.reducers.equivalent.solvers.simd import (
    ALL,
    WIDTH,
    Common,
    above,
    aligned,
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
from tolalloc.running.compiled import jit, jit_in_place, jit_within

BATCH = 256
"""Largest number of samples that share one look at an angle's tables."""

FOUR = 4 * WIDTH
"""Samples in four registers; as many are worked on at a time."""

LATE = BATCH
"""Where the register begins that samples go to which do not settle with their neighbours."""

ROW = BATCH + WIDTH
"""Samples of a batch with that register; not a power of two, because a cache keeps few rows that lie so far apart."""
_LAST, _AHEAD, _HERE, _BEHIND = 0.3, 0.5, 0.35, -0.15
"""Weights, 1 together, of what changed within a turn of the crank, near the best for random units of four reducers.

At the last angle; a turn before the angle after the next one, the next one, and the last.
"""
_FIRST_STEPS, _STEPS = 2, 10
# Under a curved law, whose stiffness changes with every step
_FIRST_CURVED_STEPS, _CURVED_STEPS = 4, 16


class SampleBatch(NamedTuple):
    """Loads, state and work space of a batch; samples are the last axis, so that a register holds several of them."""

    # What the tables take, `tolalloc.reducers.equivalent.columns.Layout` [m, rad, N·m]
    values: Float[np.ndarray, "value sample"]
    # Pin compressions [m], forces on the discs [N] and carrier rotation [rad] at undisplaced discs
    undisturbed: Float[np.ndarray, "register contact lane"]
    force: Float[np.ndarray, "coordinate sample"]
    rotation: Float[np.ndarray, " sample"]
    q: Float[np.ndarray, "coordinate sample"]  # Coordinates of the discs: start, then equilibrium [m]
    # Residual over the largest force; pins in contact [-]
    ratio: Float[np.ndarray, " sample"]
    touching: Float[np.ndarray, " sample"]
    late: Int[np.ndarray, " sample"]  # Samples that are not settled with their neighbours [-]
    pressing: Pressing  # Of one register's samples
    # The same: unbalanced force, Newton's step [N, m]
    gradient: Float[np.ndarray, "coordinate lane"]
    step: Float[np.ndarray, "coordinate lane"]


@jit
def make_batch(layout, size, contacts, samples):
    """Return an empty batch of so many samples: `ROW`, or one register."""
    return SampleBatch(
        aligned(layout.end, samples),
        aligned(samples // WIDTH * contacts, WIDTH).reshape(samples // WIDTH, contacts, WIDTH),
        aligned(size, samples),
        aligned(1, samples).reshape(samples),
        aligned(size, samples),
        aligned(1, samples).reshape(samples),
        aligned(1, samples).reshape(samples),
        np.empty(samples, np.int64),
        make_pressing(3 * contacts // layout.pins, contacts),
        aligned(size, WIDTH),
        aligned(size, WIDTH),
    )


@jit
def present(values, first, last, period):
    """Return which of every ``period`` rows from first to last are not zero of all samples, in any of the periods."""
    found = np.empty(period, np.int64)
    count = 0
    for m in range(period):
        if np.any(values[first + m : last : period] != 0.0):
            found[count] = m
            count += 1
    return found[:count]


@jit_within
def _forces(at, tables, rows, used, batch):
    """Set forces and carrier rotation at undisplaced discs."""
    table, by_load, values = tables.load[at], tables.carrier_by_load[at], batch.values
    for v in range(0, used, WIDTH):
        total = spread(0.0)
        for m in rows:
            total = fma(spread(by_load[m]), load(values, m * ROW + v), total)
        store(batch.rotation, v, total)
    for i in range(table.shape[1]):
        for v in range(0, used, FOUR):
            a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
            for m in rows:
                factor, row = spread(table[m, i]), m * ROW + v
                a = fma(factor, load(values, row), a)
                b = fma(factor, load(values, row + WIDTH), b)
                c = fma(factor, load(values, row + 2 * WIDTH), c)
                d = fma(factor, load(values, row + 3 * WIDTH), d)
            _store_four(batch.force, i * ROW + v, WIDTH, a, b, c, d)


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
def _undisturbed(at, tables, layout, waves, teeth_deviate, flanks_turned, used, batch):
    """Set the pin compressions at undisplaced discs: two contacts of four registers at a time share what they load."""
    pins, values, out, contacts = layout.pins, batch.values, batch.undisturbed, batch.undisturbed.shape[1]
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
        if flanks_turned:
            for k in range(pins):
                factor = spread(-abs(tables.contact_by_disc[at, disc, 2, k]))
                for v in range(0, used, WIDTH):
                    place = v * contacts + (first + k) * WIDTH
                    store(out, place, fma(factor, load(values, layout.flank * ROW + v), load(out, place)))


@jit_within
def _displace_nothing(at, tables, layout, rows, waves, teeth_deviate, flanks_turned, used, batch, play):
    """Set all that the errors do at one node while the discs are undisplaced."""
    _forces(at, tables, rows, used, batch)
    _undisturbed(at, tables, layout, waves, teeth_deviate, flanks_turned, used, batch)
    if play is not None:
        displace_play(at, tables, layout, rows, used, batch.values, play)


@jit
def make_history(turn, size):
    """Return room for the equilibria at two turns of a crank, so many angles each, or at two angles if it is 0."""
    return aligned((2 * turn + 2) * size, ROW).reshape(2 * turn + 2, size, ROW)


@jit_in_place
def start_next(angle, turn, used, q, history):
    """Keep the equilibria at an angle, counted from 0, and put the warm starts for the next one in their place.

    A crank turns once in ``turn`` angles; 0 where that is no whole number.
    """
    size, kept = q.shape[0], history.shape[0]
    for i in range(size):
        for v in range(0, used, WIDTH):
            store(history, (angle % kept * size + i) * ROW + v, load(q, i * ROW + v))
    if turn == 0 or angle < 2 * turn:
        _add(2.0, -1.0, max(angle - 1, 0) % kept, used, q, history)
        return
    following = angle + 1
    _add(_LAST, _AHEAD, (following - turn + 1) % kept, used, q, history)
    for weight, back in (
        (1.0 + _HERE, turn),
        (_BEHIND - _LAST, turn + 1),
        (-_AHEAD, 2 * turn - 1),
        (-_HERE, 2 * turn),
        (-_BEHIND, 2 * turn + 1),
    ):
        _add(1.0, weight, (following - back) % kept, used, q, history)


@jit_in_place
def _add(own, weight, kept, used, q, history):
    """Put so many times the coordinates, and so many times those kept in a place of the history, in their place."""
    for i in range(q.shape[0]):
        for v in range(0, used, WIDTH):
            place = i * ROW + v
            own_part = multiply(spread(own), load(q, place))
            store(q, place, fma(spread(weight), load(history, kept * q.shape[0] * ROW + place), own_part))


@jit_within
def _first_steps(law):
    """Return how many steps a sample may take among its neighbours."""
    return _FIRST_STEPS if law == LINEAR else _FIRST_CURVED_STEPS


@jit_within
def most_steps(law):
    """Return how many steps a sample may take in a register before it is left to the solver for one sample."""
    return _STEPS if law == LINEAR else _CURVED_STEPS


@jit_within
def _balance(discs, stiffness, v, batch):
    """Set the unbalanced force of one register; return residual, what it may be, and the largest force."""
    size, width = 3 * len(discs), batch.q.shape[1]  # the size is known when compiled: straight code
    largest, cancelling, residual = spread(0.0), spread(0.0), spread(0.0)
    for i in range(size):
        applied, pressing = load(batch.force, i * width + v), load(batch.pressing.force, i * WIDTH)
        value, terms = subtract(pressing, applied), spread(0.0)
        for j in range(size):
            factor, moved = entry(stiffness, i * size + j), load(batch.q, j * width + v)
            value = fma(factor, moved, value)
            terms = fma(magnitude(factor), magnitude(moved), terms)
        store(batch.gradient, i * WIDTH, value)
        largest = larger(larger(magnitude(applied), magnitude(pressing)), largest)
        cancelling, residual = larger(terms, cancelling), larger(magnitude(value), residual)
    allowed = larger(multiply(spread(TOLERANCE), largest), multiply(spread(ROUNDING), cancelling))
    return residual, allowed, largest


@jit_within
def settle(law, discs, tables, v, batch, done, steps):
    """Bring one register's samples to equilibrium but for those done, in so many steps at most.

    Return one bit per lane that is not settled, and one per lane that needs more care than more steps.

    Steps are whole. With too few pins in contact the tangent is singular: such a lane moves to where the next pin
    touches and a hair beyond.

    Newton's method on S·q − f + Σ D·F(h + D·q) = 0 [N], theory page equations (21) and (22); settled where no component
    exceeds 1e-11 of the largest force. Discs without tilt.

    References
    ----------
    Own derivation.
    """
    zero, width = spread(0.0), batch.q.shape[1]
    touching, careful = press(law, discs, tables, v, batch)
    for step in range(steps + 1):
        residual, allowed, largest = _balance(discs, tables.stiffness, v, batch)
        fresh = (ALL ^ above(residual, allowed)) & (ALL ^ (done | careful))
        if fresh:
            ratio = choose(above(largest, zero), divide(residual, largest), zero)
            store(batch.ratio, v, choose(fresh, ratio, load(batch.ratio, v)))
            store(batch.touching, v, choose(fresh, touching, load(batch.touching, v)))
            done |= fresh
        if (done | careful) == ALL or step == steps:
            break
        # A vanishing pivot is replaced by a small one.
        stiffness = batch.pressing.stiffness
        singular = newton_step(discs, tables.stiffness, stiffness, batch.gradient, batch.step, PIVOT)
        singular &= ALL ^ (done | careful)
        length = spread(1.0)
        if singular:
            reach, met = first_touch(discs, tables, v, batch, singular)
            careful |= singular & (ALL ^ met)
            length = choose(singular, multiply(spread(BEYOND), reach), length)
        moving = ALL ^ (done | careful)
        for i in range(3 * len(discs)):
            q = load(batch.q, i * width + v)
            store(batch.q, i * width + v, choose(moving, fma(length, load(batch.step, i * WIDTH), q), q))
        touching, far = press(law, discs, tables, v, batch)
        careful |= far & moving
    return ALL ^ done, careful & (ALL ^ done)


@jit_in_place
def _bring(sample, lane, batch):
    """Put a sample into a lane of the register behind the batch."""
    contacts = batch.undisturbed.shape[1]
    undisturbed = batch.undisturbed.reshape(batch.undisturbed.size)
    own, late = (sample // WIDTH * contacts) * WIDTH + sample % WIDTH, LATE * contacts + lane
    for c in range(contacts):
        undisturbed[late + c * WIDTH] = undisturbed[own + c * WIDTH]
    for i in range(batch.q.shape[0]):
        batch.q[i, LATE + lane], batch.force[i, LATE + lane] = batch.q[i, sample], batch.force[i, sample]


@jit_in_place
def _take_back(sample, lane, batch):
    """Put a sample back into its own register."""
    batch.ratio[sample], batch.touching[sample] = batch.ratio[LATE + lane], batch.touching[LATE + lane]
    for i in range(batch.q.shape[0]):
        batch.q[i, sample] = batch.q[i, LATE + lane]


@jit_within
def _settle_all(law, discs, here, samples, batch, careful):
    """Bring the first samples of a batch to equilibrium: register by register, then those that are late together."""
    late, brought, v = 0, 0, 0
    # One loop for both, so that `settle`, which is written out where it is called, is compiled once.
    while v < samples or brought < late:
        among = v < samples
        count = WIDTH if among else min(late - brought, WIDTH)
        if not among:
            for lane in range(count):
                _bring(batch.late[brought + lane], lane, batch)
        at, done = (v, 0) if among else (LATE, ALL ^ (2**count - 1))
        left, hard = settle(law, discs, here, at, batch, done, _first_steps(law) if among else most_steps(law))
        for lane in range(count):
            left_alone = ((hard if among else left) >> lane) & 1
            if among:
                careful[v + lane] = left_alone
                batch.late[late] = v + lane
                late += ((left & (ALL ^ hard)) >> lane) & 1
            else:
                careful[batch.late[brought + lane]] = left_alone
                _take_back(batch.late[brought + lane], lane, batch)
        if among:
            v += WIDTH
        else:
            brought += count


@jit_within
def _settle_in_turn(law, discs, here, samples, batch, play, careful):
    """Bring the first samples of a batch to equilibrium, with elements with play: a lane that ends takes the next one.

    They take from three steps to thirty, so that a register would wait for its slowest sample half of the time.
    """
    following, running = 0, 0
    list_touched(here, play)
    while running or following < samples:
        for lane in range(WIDTH):
            if not (running >> lane) & 1 and following < samples:
                _bring(following, lane, batch)
                bring_play(following, LATE + lane, play)
                begin_search(lane, batch, play)
                batch.late[lane] = following
                running |= 1 << lane
                following += 1
        settled, hard = move_with_play(law, discs, here, LATE, batch, play, running)
        for lane in range(WIDTH):
            if ((settled | hard) >> lane) & 1:
                careful[batch.late[lane]] = (hard >> lane) & 1
                _take_back(batch.late[lane], lane, batch)
        running &= ALL ^ (settled | hard)


@jit_within
def solve_batch_at(
    law, discs, at, tables, layout, rows, waves, teeth_deviate, flanks_turned, samples, batch, play, careful
):  # fmt: skip
    """Solve the first samples of a batch at one node from the warm starts in ``batch.q``; set which need more care."""
    used = (samples + FOUR - 1) // FOUR * FOUR
    _displace_nothing(at, tables, layout, rows, waves, teeth_deviate, flanks_turned, used, batch, play)
    here = VectorTables(
        Common(tables.stiffness[at]),
        Common(tables.contact_by_disc[at]),
        Common(tables.pole_by_rotation[at]),
        Common(tables.contact_stiffness[at]),
        Common(tables.contact_log_length[at]),
        Common(tables.play_by_retained[at]),
        Common(tables.play_stiffness[at]),
    )
    if play is None:
        _settle_all(law, discs, here, samples, batch, careful)
    else:
        _settle_in_turn(law, discs, here, samples, batch, play, careful)
    width = batch.q.shape[1]
    for v in range(0, samples, WIDTH):
        total = load(batch.rotation, v)
        for i in range(batch.q.shape[0]):
            total = fma(spread(tables.carrier_by_retained[at, i]), load(batch.q, i * width + v), total)
        store(batch.rotation, v, total)
