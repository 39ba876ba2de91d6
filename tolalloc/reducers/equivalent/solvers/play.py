"""Elements with play of one register of samples, and the steps to equilibrium that they take part in.

A part in its clearance is held by nothing, and beyond it in a direction that turns as the part slides along the wall: a
whole step of Newton's may overshoot. So the energy's slope along the step is looked at where it ends. Where it has
turned to a rise, the lane goes back along the same step; elsewhere it takes the next one. Both are one more look at the
contacts, so lanes that go back and lanes that go on stay side by side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.solvers.contact_solver import PIVOT, ROUNDING, TOLERANCE
from tolalloc.reducers.equivalent.solvers.pressing import BEYOND, first_touch, press
from tolalloc.reducers.equivalent.solvers.simd import (
    ALL,
    WIDTH,
    above,
    add,
    aligned,
    choose,
    divide,
    entry,
    fma,
    larger,
    load,
    magnitude,
    multiply,
    root,
    spread,
    store,
    subtract,
)
from tolalloc.running.compiled import jit, jit_in_place, jit_within

_ENOUGH = 0.5
"""Rise at the end of a step, over the fall at its beginning, up to which it is taken [-]."""
_LEAST_SHARE = 0.1
"""Of a step that is left where it goes back [-]."""
_LONGEST = 1e-3
"""Step beyond which a part is held by nothing, and goes to where the next pin touches [m]."""
_LOOKS = 40
"""At a lane's contacts, before it is left to the solver for one sample [-]."""
_REACH = 1.0
"""Displacement of a disc beyond which nothing holds it [m]."""


class Play(NamedTuple):
    """Elements with play of a batch, and the work space of one register; samples are the last axis."""

    # Compression x, y of every element at undisplaced coordinates, and its clearance [m]
    offset: Float[np.ndarray, "row sample"]
    clearance: Float[np.ndarray, "element sample"]
    # The coordinates that each element touches, one element after another, and where each one's end
    coordinate: Int[np.ndarray, " touched"]
    end: Int[np.ndarray, " element"]
    # Of one register: forces of all contacts [N], tangent by rows, the lower half [N/m], the next of Newton's steps [m]
    force: Float[np.ndarray, "coordinate lane"]
    tangent: Float[np.ndarray, "entry lane"]
    step: Float[np.ndarray, "coordinate lane"]
    # The same: the energy's fall where the step began [N·m], how much of the step is gone, looks so far [-]
    search: Float[np.ndarray, "3 lane"]


@jit
def make_play(size, elements, samples):
    """Return the room for a batch of so many samples."""
    return Play(
        aligned(2 * elements, samples),
        aligned(elements, samples),
        np.empty(elements * size, np.int64),
        np.zeros(elements, np.int64),
        aligned(size, WIDTH),
        aligned(size * size, WIDTH),
        aligned(size, WIDTH),
        aligned(3, WIDTH),
    )


@jit_in_place
def displace_play(at, tables, layout, rows, used, values, play):
    """Set clearances, and what the errors compress the elements by at one node while all coordinates are undisplaced.

    The sources of one element compress that one alone, so nearly all entries of the table are zero.

    h = E·ε, and c = max(c, 0) [m], theory page equation (28), own derivation.

    Examples
    --------
    What it adds up, a pin that stands 3 µm off and a hole that stands 1 µm off [µm]:

    >>> float(np.round(np.array([1.0, -1.0]) @ np.array([3.0, 1.0]), 6))
    2.0
    """
    table, width = tables.play_by_load[at], play.offset.shape[1]
    for e in range(play.end.size):
        for v in range(0, used, WIDTH):
            own = load(values, (layout.clearance + e) * values.shape[1] + v)
            store(play.clearance, e * width + v, larger(own, spread(0.0)))
            store(play.offset, 2 * e * width + v, spread(0.0))
            store(play.offset, (2 * e + 1) * width + v, spread(0.0))
    for m in rows:
        for e in range(play.end.size):
            for i in range(2):
                if table[m, e, i] == 0.0:
                    continue
                factor, row = spread(table[m, e, i]), (2 * e + i) * width
                for v in range(0, used, WIDTH):
                    own = load(values, m * values.shape[1] + v)
                    store(play.offset, row + v, fma(factor, own, load(play.offset, row + v)))


@jit_in_place
def list_touched(tables, play):
    """List the coordinates that each element touches in any lane."""
    size, count = play.force.shape[0], 0
    for e in range(play.end.size):
        for j in range(size):
            along, across = (
                entry(tables.play_by_retained, 2 * e * size + j),
                entry(tables.play_by_retained, (2 * e + 1) * size + j),
            )
            play.coordinate[count] = j
            count += above(larger(magnitude(along), magnitude(across)), spread(0.0)) != 0
        play.end[e] = count


@jit_in_place
def bring_play(sample, lane, play):
    """Put the elements of a sample into another place of the batch."""
    for row in range(play.offset.shape[0]):
        play.offset[row, lane] = play.offset[row, sample]
    for e in range(play.end.size):
        play.clearance[e, lane] = play.clearance[e, sample]


@jit_in_place
def begin_search(lane, batch, play):
    """Let a lane begin where it stands."""
    for i in range(batch.step.shape[0]):
        batch.step[i, lane] = 0.0
    for row in range(play.search.shape[0]):
        play.search[row, lane] = 0.0


@jit_within
def _begin_sums(discs, tables, batch, play):
    """Set forces and tangent to those of the pins and of all springs without play; return the largest of the pins."""
    size, largest = play.force.shape[0], spread(0.0)
    for i in range(size):
        for j in range(i + 1):
            store(play.tangent, (i * size + j) * WIDTH, entry(tables.stiffness, i * size + j))
        store(play.force, i * WIDTH, spread(0.0))
    for d in range(len(discs)):
        for i in range(3):
            pressing = load(batch.pressing.force, (3 * d + i) * WIDTH)
            largest = larger(magnitude(pressing), largest)
            store(play.force, (3 * d + i) * WIDTH, pressing)
            for j in range(i + 1):
                place = ((3 * d + i) * size + 3 * d + j) * WIDTH
                own = load(batch.pressing.stiffness, (6 * d + i * (i + 1) // 2 + j) * WIDTH)
                store(play.tangent, place, add(load(play.tangent, place), own))
    return largest


@jit_within
def _compression(tables, element, first, last, v, batch, play):
    """Return what x, y an element is compressed by; its coordinates stand between two places of the list."""
    size, width, row = play.force.shape[0], batch.q.shape[1], 2 * element * play.force.shape[0]
    x, y = load(play.offset, 2 * element * width + v), load(play.offset, (2 * element + 1) * width + v)
    for at in range(first, last):
        j = play.coordinate[at]
        moved = load(batch.q, j * width + v)
        x = fma(entry(tables.play_by_retained, row + j), moved, x)
        y = fma(entry(tables.play_by_retained, row + size + j), moved, y)
    return x, y


@jit_in_place
def _press_elements(tables, v, batch, play):
    """Add the elements of one register to the sums; return the largest force of one.

    `tolalloc.reducers.equivalent.solvers.contact_solver.play_force`, eight side by side.
    """
    size, width, largest, last = play.force.shape[0], batch.q.shape[1], spread(0.0), 0
    one, zero = spread(1.0), spread(0.0)
    for e in range(play.end.size):
        first, last, row = last, play.end[e], 2 * e * size
        x, y = _compression(tables, e, first, last, v, batch, play)
        reach, clearance = root(fma(x, x, multiply(y, y))), load(play.clearance, e * width + v)
        taut = above(reach, clearance)
        if not taut:
            continue
        inverse, stiffness = divide(one, choose(taut, reach, one)), entry(tables.play_stiffness, e)
        free = multiply(clearance, inverse)
        pull = choose(taut, multiply(stiffness, subtract(one, free)), zero)
        turn = choose(taut, multiply(multiply(stiffness, free), multiply(inverse, inverse)), zero)
        largest = larger(multiply(pull, reach), largest)
        fx, fy, across = multiply(pull, x), multiply(pull, y), multiply(turn, x)
        xx, xy, yy = fma(across, x, pull), multiply(across, y), fma(multiply(turn, y), y, pull)
        for at in range(first, last):
            i = play.coordinate[at]
            a, b = entry(tables.play_by_retained, row + i), entry(tables.play_by_retained, row + size + i)
            store(play.force, i * WIDTH, fma(fx, a, fma(fy, b, load(play.force, i * WIDTH))))
            ka, kb = fma(xx, a, multiply(xy, b)), fma(xy, a, multiply(yy, b))
            for other in range(first, at + 1):
                j = play.coordinate[other]
                place = (i * size + j) * WIDTH
                total = fma(ka, entry(tables.play_by_retained, row + j), load(play.tangent, place))
                store(play.tangent, place, fma(kb, entry(tables.play_by_retained, row + size + j), total))
    return largest


@jit_within
def _balance(tables, v, largest, batch, play):
    """Set the unbalanced force of one register; return residual, what it may be, and the largest force."""
    size, width, cancelling, residual = play.force.shape[0], batch.q.shape[1], spread(0.0), spread(0.0)
    for i in range(size):
        applied, terms = load(batch.force, i * width + v), spread(0.0)
        value = subtract(load(play.force, i * WIDTH), applied)
        for j in range(size):
            factor, moved = entry(tables.stiffness, i * size + j), load(batch.q, j * width + v)
            value = fma(factor, moved, value)
            terms = fma(magnitude(factor), magnitude(moved), terms)
        store(batch.gradient, i * WIDTH, value)
        largest = larger(magnitude(applied), largest)
        cancelling, residual = larger(terms, cancelling), larger(magnitude(value), residual)
    allowed = larger(multiply(spread(TOLERANCE), largest), multiply(spread(ROUNDING), cancelling))
    return residual, allowed, largest


@jit_in_place
def _solve_tangent(gradient, play):
    """Set Newton's next step; return one bit per lane with a vanishing pivot, which a small one replaces.

    LDLᵀ·step = −gradient as in `newton_step`, in loops: how many coordinates there are depends on which interfaces have
    play, and code of its own for each number would take half a minute to compile. −Lᵀ stands above the diagonal, 1/D on
    it; two rows at a time share what they load, the last one of an odd number with itself.
    """
    size, tangent, step, singular = play.force.shape[0], play.tangent, play.step, 0
    least, one, zero = load(tangent, 0), spread(1.0), spread(0.0)
    for i in range(1, size):
        least = larger(load(tangent, i * (size + 1) * WIDTH), least)
    least = multiply(spread(PIVOT), least)
    for k in range(size):
        pivot, value = load(tangent, k * (size + 1) * WIDTH), subtract(zero, load(gradient, k * WIDTH))
        for j in range(k):
            factor = load(tangent, (j * size + k) * WIDTH)
            pivot = fma(load(tangent, (k * size + j) * WIDTH), factor, pivot)
            value = fma(factor, load(step, j * WIDTH), value)
        regular = above(pivot, least)
        singular |= ALL ^ regular
        inverse = divide(one, choose(regular, pivot, least))
        store(tangent, k * (size + 1) * WIDTH, inverse)
        store(step, k * WIDTH, value)
        for i in range(k + 1, size, 2):
            other = min(i + 1, size - 1)
            a, b = load(tangent, (i * size + k) * WIDTH), load(tangent, (other * size + k) * WIDTH)
            for j in range(k):
                factor = load(tangent, (j * size + k) * WIDTH)
                a = fma(load(tangent, (i * size + j) * WIDTH), factor, a)
                b = fma(load(tangent, (other * size + j) * WIDTH), factor, b)
            for row, own in ((i, a), (other, b)):
                store(tangent, (row * size + k) * WIDTH, own)
                store(tangent, (k * size + row) * WIDTH, multiply(subtract(zero, own), inverse))
    for i in range(size - 1, -1, -1):
        value = multiply(load(tangent, i * (size + 1) * WIDTH), load(step, i * WIDTH))
        for m in range(i + 1, size):
            value = fma(load(tangent, (i * size + m) * WIDTH), load(step, m * WIDTH), value)
        store(step, i * WIDTH, value)
    return singular


@jit_within
def _slope(gradient, step):
    """Return the energy's slope along the step."""
    total = spread(0.0)
    for i in range(step.shape[0]):
        total = fma(load(gradient, i * WIDTH), load(step, i * WIDTH), total)
    return total


@jit_in_place
def _first_taut(tables, v, batch, play, lanes):
    """Return how many steps away the next element is taut in some lanes, and one bit per lane in which one will be.

    The positive root t of |δ + t·ρ| = c where |δ| is below c.
    """
    size, width, last, found = play.force.shape[0], batch.q.shape[1], 0, 0
    nearest, zero, one = spread(0.0), spread(0.0), spread(1.0)
    for e in range(play.end.size):
        first, last, row = last, play.end[e], 2 * e * size
        x, y = _compression(tables, e, first, last, v, batch, play)
        along, across = zero, zero
        for at in range(first, last):
            j = play.coordinate[at]
            moved = load(batch.step, j * WIDTH)
            along = fma(entry(tables.play_by_retained, row + j), moved, along)
            across = fma(entry(tables.play_by_retained, row + size + j), moved, across)
        clearance, speed = load(play.clearance, e * width + v), fma(along, along, multiply(across, across))
        left = subtract(multiply(clearance, clearance), fma(x, x, multiply(y, y)))
        meets = lanes & above(left, zero) & above(speed, zero)
        if meets:
            drift = fma(along, x, multiply(across, y))
            ahead = subtract(root(larger(fma(drift, drift, multiply(speed, left)), zero)), drift)
            tight = divide(ahead, choose(meets, speed, one))
            sooner = meets & ((ALL ^ found) | above(nearest, tight))
            nearest, found = choose(sooner, tight, nearest), found | meets
    return nearest, found


@jit_in_place
def _curvature(step, play):
    """Return the energy's curvature along the step."""
    size, total = step.shape[0], spread(0.0)
    for i in range(size):
        own, row = load(step, i * WIDTH), spread(0.0)
        for j in range(i):
            row = fma(load(play.tangent, (i * size + j) * WIDTH), load(step, j * WIDTH), row)
        row = fma(spread(2.0), row, multiply(load(play.tangent, i * (size + 1) * WIDTH), own))
        total = fma(own, row, total)
    return total


@jit_within
def _go_back(slope, back, batch, play):
    """Shorten the step in some lanes; return by how much of it they move."""
    length = load(play.search, WIDTH)
    shorter = subtract(length, divide(slope, _curvature(batch.step, play)))
    shorter = larger(shorter, multiply(spread(_LEAST_SHARE), length))
    store(play.search, WIDTH, choose(back, shorter, length))
    return choose(back, subtract(shorter, length), spread(0.0))


@jit_within
def _go_on(discs, tables, v, onward, batch, play):
    """Begin Newton's next step in some lanes; return how much of it they move, and which nothing will hold."""
    size, whole, unheld = play.force.shape[0], spread(1.0), 0
    singular, longest = _solve_tangent(batch.gradient, play), spread(0.0)
    for i in range(size):
        own = load(play.step, i * WIDTH)
        longest = larger(magnitude(own), longest)
        store(batch.step, i * WIDTH, choose(onward, own, load(batch.step, i * WIDTH)))
    loose = singular & onward & above(longest, spread(_LONGEST))
    if loose:
        gap, met = first_touch(discs, tables, v, batch, loose)
        tight, taut = _first_taut(tables, v, batch, play, loose)
        gap = choose(taut & ((ALL ^ met) | above(gap, tight)), tight, gap)
        unheld = loose & (ALL ^ (met | taut))
        whole = choose(loose, multiply(spread(BEYOND), gap), whole)
    fall = magnitude(_slope(batch.gradient, batch.step))
    store(play.search, 0, choose(onward, fall, load(play.search, 0)))
    store(play.search, WIDTH, choose(onward, whole, load(play.search, WIDTH)))
    return whole, unheld


@jit_in_place
def move_with_play(law, discs, tables, v, batch, play, running):
    """Look at one register's contacts where its lanes stand, and move them on or back.

    Return one bit per lane that is settled, as `settle` says it, and one per lane that needs more care than more steps.

    Newton's method on S·q − f + Σ D·F(h + D·q) = 0 with the forces of theory page equation (28) among F; where the
    energy's slope along the step has turned to more than half of its first fall, Newton's method on that slope.

    References
    ----------
    Own derivation.
    """
    zero, width = spread(0.0), batch.q.shape[1]
    touching, far = press(law, discs, tables, v, batch)
    largest = larger(_begin_sums(discs, tables, batch, play), _press_elements(tables, v, batch, play))
    residual, allowed, largest = _balance(tables, v, largest, batch, play)
    settled = (ALL ^ above(residual, allowed)) & running & (ALL ^ far)
    store(batch.ratio, v, choose(above(largest, zero), divide(residual, largest), zero))
    store(batch.touching, v, touching)
    looks = add(load(play.search, 2 * WIDTH), spread(1.0))
    store(play.search, 2 * WIDTH, looks)
    moving = running & (ALL ^ settled)
    slope, change = _slope(batch.gradient, batch.step), zero
    back = above(slope, multiply(spread(_ENOUGH), load(play.search, 0))) & moving
    onward, careful = moving & (ALL ^ back), above(looks, spread(_LOOKS)) & moving
    if back:
        change = _go_back(slope, back, batch, play)
    if onward:
        whole, unheld = _go_on(discs, tables, v, onward, batch, play)
        change, careful = choose(onward, whole, change), careful | unheld
    if moving:
        for i in range(play.force.shape[0]):
            q = load(batch.q, i * width + v)
            moved = choose(moving, fma(change, load(batch.step, i * WIDTH), q), q)
            store(batch.q, i * width + v, moved)
            careful |= moving & (ALL ^ above(spread(_REACH), magnitude(moved)))
    return settled, careful


@jit_in_place
def settle_with_play(law, discs, tables, batch, play, running):
    """Bring the lanes that run to equilibrium; return one bit per lane that is not settled."""
    left = 0
    list_touched(tables, play)
    for lane in range(WIDTH):
        begin_search(lane, batch, play)
    while running:
        settled, careful = move_with_play(law, discs, tables, 0, batch, play, running)
        running &= ALL ^ (settled | careful)
        left |= careful
    return left
