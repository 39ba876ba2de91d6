"""Equilibrium of one sample at one angle, for every contact law, tilt and play.

The energy ½qᵀSq − fᵀq + Σφ(h + D·q) is convex. Newton's method with an exact line search converges from anywhere in a
few steps; a plain active-set iteration cycles. S has one zero eigenvalue (the whole mechanism turning), so with too few
contacts the tangent is singular: a vanishing pivot is then replaced by a small one, which keeps the step a descent
direction, and the line search stops where contacts take over.

Each sample is solved alone and in a fixed order of operations, so its bits do not depend on the number of threads, on
its place in a batch or on its neighbours.
"""

from __future__ import annotations

import numpy as np

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.cycloid.solvers.contact_law import pin_force
from tolalloc.reducers.equivalent.solvers.energy import Problem, along, assemble, compress, play_force
from tolalloc.reducers.equivalent.solvers.records import CONVERGED, NOT_CONVERGED, NOT_RESISTED
from tolalloc.running.compiled import jit, jit_in_place, jit_within

TOLERANCE = 1e-11  # of the largest force
_PROMISED = 1e-9  # the same where a bearing that just touches keeps the steps from settling
ROUNDING = 2e-15  # of the terms that cancel in the balance of forces; below it a residual is noise
PIVOT = 1e-12  # of the largest diagonal entry
_ITERATIONS = 100
_SOFTEST = 6  # decades by which play is softened where a part slides around inside its bearing
_SEARCH_STEPS = 200
_ENOUGH = 0.1  # of the first slope along a step, under a curved law
_FARTHEST = 1e9  # steps; a contact that resists only beyond is none
_REACH = 1.0  # metres; the same


@jit_within
def solve_tangent(tangent, gradient, step):
    """Solve tangent·step = −gradient by Cholesky in place; return whether a pivot was replaced."""
    size = gradient.size
    largest = 0.0
    for i in range(size):
        largest = max(largest, tangent[i, i])
    replaced = False
    for i in range(size):
        for j in range(i):
            value = tangent[i, j]
            for m in range(j):
                value -= tangent[i, m] * tangent[j, m]
            tangent[i, j] = value / tangent[j, j]
        pivot = tangent[i, i]
        for m in range(i):
            pivot -= tangent[i, m] * tangent[i, m]
        if not pivot > PIVOT * largest:
            pivot = PIVOT * largest
            replaced = True
        tangent[i, i] = np.sqrt(pivot)
    for i in range(size):
        value = -gradient[i]
        for m in range(i):
            value -= tangent[i, m] * step[m]
        step[i] = value / tangent[i, i]
    for i in range(size - 1, -1, -1):
        value = step[i]
        for m in range(i + 1, size):
            value -= tangent[m, i] * step[m]
        step[i] = value / tangent[i, i]
    return replaced


@jit_in_place
def _slope_at(problem, work, length, slope, curvature):
    """Return first and second derivative of the energy along the step, ``length`` steps from q."""
    first, second = slope + curvature * length, curvature
    if problem.law == LINEAR:
        for c in range(work.compression.size):
            compression = work.compression[c] + length * work.rate[c]
            if problem.half_tilt[c] == 0.0 and compression > 0.0:
                stiff = problem.contact[c] * work.rate[c]
                first += stiff * compression
                second += stiff * work.rate[c]
    for c in range(work.compression.size):
        if problem.law != LINEAR or problem.half_tilt[c] > 0.0:
            compression = work.compression[c] + length * work.rate[c]
            force, stiff = pin_force(
                problem.law, problem.contact[c], problem.log_length[c], problem.half_tilt[c], compression
            )
            first += force * work.rate[c]
            second += stiff * work.rate[c] * work.rate[c]
    for e in range(work.play.shape[0]):
        vx, vy = work.play_rate[e, 0], work.play_rate[e, 1]
        fx, fy, xx, xy, yy = play_force(
            problem.play_stiffness[e],
            problem.clearance[e],
            work.play[e, 0] + length * vx,
            work.play[e, 1] + length * vy,
        )
        first += fx * vx + fy * vy
        second += xx * vx * vx + 2.0 * xy * vx * vy + yy * vy * vy
    return first, second


@jit_in_place
def _exact_step(problem, work, q):
    """Return how many steps away the energy along the step is least, or −1 where it falls for ever.

    The derivative along the step increases, straight between the lengths where contacts change. Newton's method on it,
    kept between lengths where it was seen to be negative and positive, ends on the root of the piecewise linear law.
    A law that is curved anyway has nothing from the exact root: there a slope that has fallen far is enough.
    """
    slope, curvature, least, start = 0.0, 0.0, 0.0, 0.0
    for i in range(q.size):
        against = -problem.force[i]
        start += work.gradient[i] * work.step[i]
        least += PIVOT * problem.stiffness[i, i] * work.step[i] * work.step[i]
        for j in range(q.size):
            against += problem.stiffness[i, j] * q[j]
            curvature += work.step[i] * problem.stiffness[i, j] * work.step[j]
        slope += against * work.step[i]
    curvature = max(curvature, 0.0)
    settled = 1e-14 if problem.law == LINEAR else _ENOUGH
    low, high, length = 0.0, np.inf, 1.0
    for _ in range(_SEARCH_STEPS):
        first, second = _slope_at(problem, work, length, slope, curvature)
        if abs(first) <= settled * abs(start):
            return length
        if first < 0.0:
            low = length
        else:
            high = length
        guess = length - first / second if second > least else np.inf
        if high == np.inf:
            if not guess < 10.0 * length:
                guess = 10.0 * length
            if guess > _FARTHEST:
                return -1.0
        elif not low < guess < high:
            guess = 0.5 * (low + high)
        if guess == length or not low < guess < high:
            return length
        length = guess
    return length


@jit_in_place
def _newton(problem, q, work):
    ratio, touching, least, least_touching = np.inf, 0, np.inf, 0
    for _ in range(_ITERATIONS):
        compress(problem, q, work.compression, work.play)
        largest, cancelling, touching = assemble(problem, work.compression, work.play, q, work.gradient, work.tangent)
        residual = 0.0
        for i in range(q.size):
            residual = max(residual, abs(work.gradient[i]))
        ratio = residual / largest if largest > 0.0 else 0.0
        if residual <= max(TOLERANCE * largest, ROUNDING * cancelling):
            return CONVERGED, ratio, touching
        if ratio < least:
            least, least_touching = ratio, touching
            for i in range(q.size):
                work.best[i] = q[i]
        replaced = solve_tangent(work.tangent, work.gradient, work.step)
        along(problem.by_disc, problem.play_by_retained, work.step, work.rate, work.play_rate)
        changed = work.play.shape[0] > 0 or problem.law != LINEAR
        for c in range(work.compression.size):
            changed |= (work.compression[c] > 0.0) != (work.compression[c] + work.rate[c] > 0.0)
            changed |= problem.half_tilt[c] > 0.0
        length = 1.0
        if changed or replaced:
            length = _exact_step(problem, work, q)
            if length < 0.0:
                return NOT_RESISTED, ratio, touching
        for i in range(q.size):
            q[i] += length * work.step[i]
            if not abs(q[i]) < _REACH:
                return NOT_RESISTED, ratio, touching
    for i in range(q.size):
        q[i] = work.best[i]
    return CONVERGED if least <= _PROMISED else NOT_CONVERGED, least, least_touching


@jit
def _softened(problem, factor):
    """Return the problem with softer elements with play."""
    return Problem(
        problem.law,
        problem.stiffness,
        problem.force,
        problem.by_disc,
        problem.undisturbed,
        problem.contact,
        problem.log_length,
        problem.half_tilt,
        problem.play_by_retained,
        problem.play_offset,
        factor * problem.play_stiffness,
        problem.clearance,
    )


@jit
def _decade_by_decade(problem, q, work):
    """Bring q near the equilibrium of a problem with play, its bearings stiffened from soft ones."""
    for decade in range(_SOFTEST):
        _newton(_softened(problem, 10.0 ** (decade - _SOFTEST)), q, work)


@jit_in_place
def equilibrium(problem, q, work):
    """Bring q to equilibrium; return status, residual over the largest force, pins in contact.

    Under a small torque a loose part slides around the wall of its bearing: a stiff, curved valley of the energy that
    Newton's steps only creep along. With soft bearings the valley is wide; they are stiffened decade by decade.
    """
    status, ratio, touching = _newton(problem, q, work)
    if status == NOT_CONVERGED and problem.clearance.size:
        _decade_by_decade(problem, q, work)
        status, ratio, touching = _newton(problem, q, work)
    return status, ratio, touching
