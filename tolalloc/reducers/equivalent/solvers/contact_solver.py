"""Equilibrium of one sample at one angle, for every contact law, tilt and play; its problem from the condensed tables.

The energy ½qᵀSq − fᵀq + Σφ(h + D·q) is convex. Newton's method with an exact line search converges from anywhere in a
few steps; a plain active-set iteration cycles. S has one zero eigenvalue (the whole mechanism turning), so with too few
contacts the tangent is singular: a vanishing pivot is then replaced by a small one, which keeps the step a descent
direction, and the line search stops where contacts take over.

Each sample is solved alone and in a fixed order of operations, so its bits do not depend on the number of threads, on
its place in a batch or on its neighbours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.cycloid.solvers.pins import pin_force
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


class ContactProblem(NamedTuple):
    """One sample at one angle, in the retained coordinates; the discs' come first."""

    law: int  # One of `tolalloc.reducers.cycloid.solvers.LAWS` [-]
    # S [N/m] and f [N]
    stiffness: Float[np.ndarray, "retained retained"]
    force: Float[np.ndarray, " retained"]
    # D [m/m] and compression h at undisplaced discs [m]
    by_disc: Float[np.ndarray, "disc 3 pin"]
    undisturbed: Float[np.ndarray, " contact"]
    # Stiffness [N/m], L of the logarithmic law [m], and half the difference in depth along a tilted tooth [m]
    contact: Float[np.ndarray, " contact"]
    log_length: Float[np.ndarray, " contact"]
    half_tilt: Float[np.ndarray, " contact"]
    # Compression vector of every element with play: per coordinate [m/m], and at undisplaced coordinates [m]
    play_by_retained: Float[np.ndarray, "element 2 retained"]
    play_offset: Float[np.ndarray, "element 2"]
    # Stiffness [N/m] and clearance [m] of every element with play
    play_stiffness: Float[np.ndarray, " element"]
    clearance: Float[np.ndarray, " element"]


class Work(NamedTuple):
    """Work space of one thread: what changes from one Newton step to the next."""

    compression: Float[np.ndarray, " contact"]
    rate: Float[np.ndarray, " contact"]
    play: Float[np.ndarray, "element 2"]
    play_rate: Float[np.ndarray, "element 2"]
    gradient: Float[np.ndarray, " retained"]
    step: Float[np.ndarray, " retained"]
    tangent: Float[np.ndarray, "retained retained"]
    best: Float[np.ndarray, " retained"]


@jit
def make_work(retained, contacts, elements):
    """Return a new work space."""
    return Work(
        np.empty(contacts),
        np.empty(contacts),
        np.empty((elements, 2)),
        np.empty((elements, 2)),
        np.empty(retained),
        np.empty(retained),
        np.empty((retained, retained)),
        np.empty(retained),
    )


@jit_within
def along(by_disc, play_by_retained, vector, compression, play):
    """Set the compressions of pins and elements that a displacement gives.

    δ = D·v for pins and elements with play [m], theory page equation (21), own derivation.
    """
    discs, _, pins = by_disc.shape
    for d in range(discs):
        x, y, turn = vector[3 * d], vector[3 * d + 1], vector[3 * d + 2]
        for k in range(pins):
            compression[d * pins + k] = by_disc[d, 0, k] * x + by_disc[d, 1, k] * y + by_disc[d, 2, k] * turn
    for e in range(play_by_retained.shape[0]):
        for i in range(2):
            play[e, i] = 0.0
            for j in range(vector.size):
                play[e, i] += play_by_retained[e, i, j] * vector[j]


@jit_within
def compress(problem, q, compression, play):
    """Set the compressions of pins and elements with play at the coordinates q.

    δ = h + D·q [m], theory page equation (21), own derivation.

    Examples
    --------
    A pin with 1 µm of clearance whose disc moves by 1 µm and turns by 0.1 mrad at a lever of 50 mm [µm]:

    >>> float(np.round(1e6 * (-1e-6 + np.array([1.0, 0.0, 0.05]) @ np.array([1e-6, 0.0, 1e-4])), 6))
    5.0
    """
    along(problem.by_disc, problem.play_by_retained, q, compression, play)
    for k in range(compression.size):
        compression[k] += problem.undisturbed[k]
    for e in range(play.shape[0]):
        play[e, 0] += problem.play_offset[e, 0]
        play[e, 1] += problem.play_offset[e, 1]


@jit_in_place
def play_force(stiffness, clearance, x, y):
    """Return force (x, y) of an element with play and its derivative (xx, xy, yy), theory page equation (28).

    F = k·(1 − c/|δ|)·δ for |δ| > c, else 0 [N], derivative [N/m]; c ≥ 0 [m].

    References
    ----------
    Own derivation.

    Examples
    --------
    >>> x, y, *_ = play_force.py_func(1e8, 5e-6, 6e-6, 8e-6)  # 5 µm beyond the clearance, 100 N/µm
    >>> round(float(x), 6), round(float(y), 6)  # 500 N along (0.6, 0.8)
    (300.0, 400.0)
    """
    reach = np.sqrt(x * x + y * y)
    if not reach > clearance:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    free = clearance / reach
    taut = stiffness * (1.0 - free)
    across = stiffness * free / (reach * reach)
    return taut * x, taut * y, taut + across * x * x, across * x * y, taut + across * y * y


@jit_in_place
def contact_force(problem, c, compression):
    """Return the force [N] of one contact and its derivative [N/m] at some compression of it."""
    return pin_force(problem.law, problem.contact[c], problem.log_length[c], problem.half_tilt[c], compression)


@jit_within
def assemble(problem, compression, play, q, gradient, tangent):
    """Set gradient and lower tangent at q; return largest force, largest sum of cancelling terms, pins in contact.

    ∂V/∂q = S·q − f + Σ D·F and its derivative S + Σ k·D·Dᵀ, theory page equation (21), own derivation [N, N/m].
    """
    size, pins = problem.force.size, problem.by_disc.shape[2]
    largest, cancelling, touching = 0.0, 0.0, 0
    for i in range(size):
        value, terms = -problem.force[i], 0.0
        largest = max(largest, abs(problem.force[i]))
        for j in range(size):
            value += problem.stiffness[i, j] * q[j]
            terms += abs(problem.stiffness[i, j] * q[j])
            tangent[i, j] = problem.stiffness[i, j]
        gradient[i] = value
        cancelling = max(cancelling, terms)
    for d in range(problem.by_disc.shape[0]):
        for k in range(pins):
            c = d * pins + k
            if not compression[c] + problem.half_tilt[c] > 0.0:
                continue
            force, slope = contact_force(problem, c, compression[c])
            touching += 1
            largest = max(largest, force)
            for i in range(3):
                gradient[3 * d + i] += force * problem.by_disc[d, i, k]
                weighted = slope * problem.by_disc[d, i, k]
                for j in range(i + 1):
                    tangent[3 * d + i, 3 * d + j] += weighted * problem.by_disc[d, j, k]
    for e in range(play.shape[0]):
        fx, fy, xx, xy, yy = play_force(problem.play_stiffness[e], problem.clearance[e], play[e, 0], play[e, 1])
        if fx == 0.0 and fy == 0.0:
            continue
        largest = max(largest, np.sqrt(fx * fx + fy * fy))
        for i in range(size):
            ax, ay = problem.play_by_retained[e, 0, i], problem.play_by_retained[e, 1, i]
            gradient[i] += fx * ax + fy * ay
            for j in range(i + 1):
                bx, by = problem.play_by_retained[e, 0, j], problem.play_by_retained[e, 1, j]
                tangent[i, j] += ax * (xx * bx + xy * by) + ay * (xy * bx + yy * by)
    return largest, cancelling, touching


@jit_within
def solve_tangent(tangent, gradient, step):
    """Solve tangent·step = −gradient by Cholesky in place; return whether a pivot was replaced.

    LLᵀ·step = −gradient, Cholesky's, for symmetric positive semidefinite tangents; the replaced pivot is an own
    derivation.
    """
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
            force, stiff = contact_force(problem, c, compression)
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
    straight = problem.law == LINEAR and work.play.shape[0] == 0
    settled = 1e-14 if straight else _ENOUGH
    low, high, length = 0.0, np.inf, 1.0
    for _ in range(_SEARCH_STEPS):
        first, second = _slope_at(problem, work, length, slope, curvature)
        if abs(first) <= settled * abs(start):
            return length
        if first < 0.0:
            low = length
        else:
            high = length
        tried = length - first / second if second > least else np.inf
        if high == np.inf:
            if not tried < 10.0 * length:
                tried = 10.0 * length
            if tried > _FARTHEST:
                return -1.0
        elif not low < tried < high:
            tried = 0.5 * (low + high)
        if tried == length or not low < tried < high:
            return length
        length = tried
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
    return ContactProblem(
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

    The least of ½q·S·q − f·q + Σφ(h + D·q) [N·m], theory page equation (21), where its gradient is below 1e-11 of the
    largest force.

    References
    ----------
    Own derivation: Newton's method with an exact line search.
    """
    status, ratio, touching = _newton(problem, q, work)
    if status == NOT_CONVERGED and problem.clearance.size:
        _decade_by_decade(problem, q, work)
        status, ratio, touching = _newton(problem, q, work)
    return status, ratio, touching


@jit
def values_of(errors, torque, layout, mapped, values):
    """Fill the values [sample, value] of all samples; return which samples are finite.

    value = nominal + Σ factor·column, own derivation [m, rad].
    """
    finite = np.empty(errors.shape[0], np.bool_)
    for s in range(errors.shape[0]):
        for m in range(layout.end):
            values[s, m] = mapped.nominal[m]
        values[s, layout.torque] = torque
        for entry in range(mapped.value.size):
            values[s, mapped.value[entry]] += mapped.factor[entry] * errors[s, mapped.column[entry]]
        finite[s] = np.isfinite(values[s]).all()
    return finite


@jit
def make_problem(law, tables):
    """Return a problem with memory of its own, to be filled by `fill_loads` and from tables."""
    retained, discs, pins = tables.stiffness.shape[1], tables.contact_by_disc.shape[1], tables.contact_by_disc.shape[3]
    elements = tables.play_stiffness.shape[1]
    return ContactProblem(
        law,
        np.empty((retained, retained)),
        np.empty(retained),
        np.empty((discs, 3, pins)),
        np.empty(discs * pins),
        np.empty(discs * pins),
        np.empty(discs * pins),
        np.zeros(discs * pins),
        np.empty((elements, 2, retained)),
        np.empty((elements, 2)),
        np.empty(elements),
        np.empty(elements),
    )


@jit_in_place
def _any_nonzero(values, first, last):
    found = False
    for m in range(first, last):
        found |= values[m] != 0.0
    return found


@jit_in_place
def _undisturbed(at, tables, layout, values, out):
    """Set out to the pins' compression at undisplaced discs, without what turned flanks leave."""
    discs, pins = tables.contact_by_disc.shape[1], layout.pins
    for d in range(discs):
        coefficient = tables.contact_by_error[at, d]
        row = out[d * pins : (d + 1) * pins]
        for k in range(pins):
            row[k] = values[layout.pin + 2 * pins + k] + (
                coefficient[0, k] * values[layout.pin + k] + coefficient[1, k] * values[layout.pin + pins + k]
            )
        for m in range(layout.waves):
            value = values[layout.wave + d * layout.waves + m]
            if value != 0.0:
                for k in range(pins):
                    row[k] += coefficient[2 + m, k] * value
        first = layout.tooth + d * 2 * layout.teeth
        for kind in range(2):
            start = first + kind * layout.teeth
            if _any_nonzero(values, start, start + layout.teeth):
                for k in range(pins):
                    row[k] += coefficient[2 + layout.waves + kind, k] * values[start + tables.tooth[at, d, k]]


@jit_in_place
def fill_loads(at, tables, layout, values, force, undisturbed, play_offset):
    """Set force, undisturbed compressions and play offsets at a node; return the carrier rotation at fixed discs.

    Turned flanks are left to `sample_constants`: what they leave has a kink at root and tip, so between nodes it
    follows from the levers there, and not from the compressions at the nodes.

    f = F·ε and θca = t·ε at undisplaced discs, theory page equations (19) and (20), own derivation [N, rad].
    """
    rotation = 0.0
    force[:] = 0.0
    play_offset[:] = 0.0
    for m in range(layout.torque + 1):
        if values[m] != 0.0:
            rotation += tables.carrier_by_load[at, m] * values[m]
            for i in range(force.size):
                force[i] += tables.load[at, m, i] * values[m]
            for e in range(play_offset.shape[0]):
                play_offset[e, 0] += tables.play_by_load[at, m, e, 0] * values[m]
                play_offset[e, 1] += tables.play_by_load[at, m, e, 1] * values[m]
    _undisturbed(at, tables, layout, values, undisturbed)
    return rotation


@jit_in_place
def sample_constants(problem, turn, face_width, layout, values):
    """Set what does not depend on the angle, clearances; what the levers alone make of a sample: tilt, turned flanks.

    c = max(c, 0) [m]; half tilt = b/2·|γ_y·n_x − γ_x·n_y| [m], theory page equation (31); turned flanks take δ·r_d·|S|
    from the compressions [m], theory page equation (35), own derivation.
    """
    for e in range(problem.clearance.size):
        problem.clearance[e] = max(values[layout.clearance + e], 0.0)
    pins, turned = layout.pins, values[layout.flank]
    for d in range(problem.by_disc.shape[0]):
        if turned != 0.0:
            for k in range(pins):
                problem.undisturbed[d * pins + k] -= abs(problem.by_disc[d, 2, k]) * turned
        x, y = values[layout.tilt + 2 * d], values[layout.tilt + 2 * d + 1]
        if x == 0.0 and y == 0.0:
            problem.half_tilt[d * pins : (d + 1) * pins] = 0.0
            continue
        tilt_x, tilt_y = turn[0] * x - turn[1] * y, turn[1] * x + turn[0] * y
        for k in range(pins):
            along = tilt_y * problem.by_disc[d, 0, k] - tilt_x * problem.by_disc[d, 1, k]
            problem.half_tilt[d * pins + k] = 0.5 * face_width * abs(along)


@jit
def with_tables(at, tables, layout, face_width, values, own):
    """Return the problem whose loads ``own`` has, with the tables of a node."""
    problem = ContactProblem(
        own.law,
        tables.stiffness[at],
        own.force,
        tables.contact_by_disc[at],
        own.undisturbed,
        tables.contact_stiffness[at],
        tables.contact_log_length[at],
        own.half_tilt,
        tables.play_by_retained[at],
        own.play_offset,
        tables.play_stiffness[at],
        own.clearance,
    )
    sample_constants(problem, tables.turn[at], face_width, layout, values)
    return problem


@jit
def problem_at_node(at, tables, layout, face_width, values, own):
    """Return carrier rotation at fixed discs and the problem at a node; ``own`` lends the memory of the loads."""
    rotation = fill_loads(at, tables, layout, values, own.force, own.undisturbed, own.play_offset)
    return rotation, with_tables(at, tables, layout, face_width, values, own)


@jit
def solve_at_node(at, tables, layout, face_width, values, q, own, work):
    """Solve one sample at one node from the start q; return rotation, status, residual, pins in contact."""
    rotation, problem = problem_at_node(at, tables, layout, face_width, values, own)
    status, ratio, touching = equilibrium(problem, q, work)
    for i in range(q.size):
        rotation += tables.carrier_by_retained[at, i] * q[i]
    return rotation, status, ratio, touching
