"""The tight loops: the equilibrium of the discs against the pins, for many samples and angles.

The energy ½qᵀSq − fᵀq + ½Σk·max(δ,0)² with δ = h + D·q is convex and piecewise quadratic. Newton's
method with an exact line search converges from anywhere in a few steps; a plain active-set iteration
cycles. S has one zero eigenvalue (the whole mechanism turning), so with too few pins in contact the
tangent is singular: a vanishing pivot is then replaced by a small one, which keeps the step a descent
direction, and the line search stops where pins take over.

Each sample is solved alone and in a fixed order of operations, so its bits do not depend on the number
of threads, on its place in a batch or on its neighbours.
"""

from __future__ import annotations

import numba as nb
import numpy as np

CONVERGED, NOT_CONVERGED, NOT_RESISTED, NOT_FINITE = 0, 1, 2, 3

_ITERATIONS = 60
_TOLERANCE = 1e-11  # of the largest force; the promise to users is 1e-9
_ROUNDING = 2e-15  # of the terms that cancel in the balance of forces; below it a residual is noise
_PIVOT = 1e-13  # of the largest diagonal entry
TILE = 32  # samples that share one look at an angle's tables

jit = nb.njit(cache=True, nogil=True, error_model="numpy")


@jit
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
        if not pivot > _PIVOT * largest:
            pivot = _PIVOT * largest
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


@jit
def _exact_step(slope, curvature, least, compression, rate, stiffness, crossing):
    """Return the length at which the energy along the step is least, or −1 where it falls for ever.

    The derivative along the step is piecewise linear and increasing; it is followed from one pin that
    touches or leaves to the next, first within the full step, then beyond it. A curvature below ``least``
    is rounding.
    """
    for k in range(compression.size):
        if compression[k] > 0.0 or (compression[k] == 0.0 and rate[k] > 0.0):
            curvature += stiffness[k] * rate[k] * rate[k]
    length = 0.0
    for limit in (1.0, np.inf):
        for k in range(compression.size):
            crossing[k] = -compression[k] / rate[k] if rate[k] != 0.0 else -1.0
            if not length < crossing[k] <= limit:
                crossing[k] = np.inf
        while True:
            nearest = crossing.argmin()
            change = crossing[nearest]
            reached = length - slope / curvature if curvature > least else np.inf
            if reached <= min(change, limit):
                return reached if reached < np.inf else -1.0
            if change == np.inf:
                break
            slope += curvature * (change - length)
            length = change
            crossing[nearest] = np.inf
            stiff = stiffness[nearest] * rate[nearest] * rate[nearest]
            curvature += stiff if rate[nearest] > 0.0 else -stiff
    return -1.0


@jit
def _along(by_disc, vector, out):
    """Set out to the pins' compression that a displacement of the discs gives."""
    discs, _, pins = by_disc.shape
    for d in range(discs):
        x, y, turn = vector[3 * d], vector[3 * d + 1], vector[3 * d + 2]
        for k in range(pins):
            out[d * pins + k] = by_disc[d, 0, k] * x + by_disc[d, 1, k] * y + by_disc[d, 2, k] * turn


@jit
def _gradient(stiffness, force, by_disc, contact, compression, q, gradient, tangent):
    """Set gradient and tangent at q; return largest force, largest sum of cancelling terms, and pins in contact."""
    size, pins = force.size, by_disc.shape[2]
    largest, cancelling, touching = 0.0, 0.0, 0
    for i in range(size):
        value, terms = -force[i], 0.0
        largest = max(largest, abs(force[i]))
        for j in range(size):
            value += stiffness[i, j] * q[j]
            terms += abs(stiffness[i, j] * q[j])
            tangent[i, j] = stiffness[i, j]
        gradient[i] = value
        cancelling = max(cancelling, terms)
    for d in range(by_disc.shape[0]):
        for k in range(pins):
            if compression[d * pins + k] > 0.0:
                touching += 1
                pin_force = contact[d * pins + k] * compression[d * pins + k]
                largest = max(largest, pin_force)
                for i in range(3):
                    gradient[3 * d + i] += pin_force * by_disc[d, i, k]
                    weighted = contact[d * pins + k] * by_disc[d, i, k]
                    for j in range(i + 1):
                        tangent[3 * d + i, 3 * d + j] += weighted * by_disc[d, j, k]
    return largest, cancelling, touching


@jit
def _equilibrium(stiffness, force, by_disc, contact, undisturbed, q, work):
    """Bring q to equilibrium; return status, residual over the largest force, pins in contact."""
    compression, rate, crossing, gradient, step, tangent = work
    size = force.size
    ratio, touching = np.inf, 0
    for _ in range(_ITERATIONS):
        _along(by_disc, q, compression)
        for k in range(compression.size):
            compression[k] += undisturbed[k]
        largest, cancelling, touching = _gradient(stiffness, force, by_disc, contact, compression, q, gradient, tangent)
        residual = 0.0
        for i in range(size):
            residual = max(residual, abs(gradient[i]))
        ratio = residual / largest if largest > 0.0 else 0.0
        if residual <= max(_TOLERANCE * largest, _ROUNDING * cancelling):
            return CONVERGED, ratio, touching
        replaced = solve_tangent(tangent, gradient, step)
        _along(by_disc, step, rate)
        changed = 0
        for k in range(compression.size):
            changed += (compression[k] > 0.0) != (compression[k] + rate[k] > 0.0)
        length = 1.0
        if changed or replaced:
            slope, curvature, least = 0.0, 0.0, 0.0
            for i in range(size):
                slope += gradient[i] * step[i]
                least += _PIVOT * stiffness[i, i] * step[i] * step[i]
                for j in range(size):
                    curvature += step[i] * stiffness[i, j] * step[j]
            length = _exact_step(slope, max(curvature, 0.0), least, compression, rate, contact, crossing)
            if length < 0.0:
                return NOT_RESISTED, ratio, touching
        for i in range(size):
            q[i] += length * step[i]
    return NOT_CONVERGED, ratio, touching


@jit
def _undisturbed(by_error, values, out):
    """Set out to the pins' compression at undisplaced discs, four columns a pass."""
    discs, columns, pins = by_error.shape
    for d in range(discs):
        row = out[d * pins : (d + 1) * pins]
        for k in range(pins):
            row[k] = 0.0
        for m in range(0, columns - 3, 4):
            a, b, c, e = values[d, m], values[d, m + 1], values[d, m + 2], values[d, m + 3]
            for k in range(pins):
                row[k] += (by_error[d, m, k] * a + by_error[d, m + 1, k] * b) + (
                    by_error[d, m + 2, k] * c + by_error[d, m + 3, k] * e
                )
        for m in range(columns - columns % 4, columns):
            for k in range(pins):
                row[k] += by_error[d, m, k] * values[d, m]


@jit
def _loads(at, tables, bilateral_values, contact_values, force, undisturbed):
    """Set the discs' force and the pins' undisturbed compression; return the carrier rotation at fixed discs."""
    _, load, _, carrier_by_load, _, by_error, _ = tables
    rotation = 0.0
    for i in range(force.size):
        force[i] = 0.0
    for m in range(bilateral_values.size):
        rotation += carrier_by_load[at, m] * bilateral_values[m]
        for i in range(force.size):
            force[i] += load[at, m, i] * bilateral_values[m]
    _undisturbed(by_error[at], contact_values, undisturbed)
    return rotation


@jit
def _solve_at_node(at, tables, bilateral_values, contact_values, q, buffers):
    """Solve one sample at one tabulated angle from the guess q; return rotation, status, residual, pins."""
    stiffness, _, carrier_by_disc, _, by_disc, _, contact = tables
    force, undisturbed, work, _ = buffers
    rotation = _loads(at, tables, bilateral_values, contact_values, force, undisturbed)
    status, ratio, touching = _equilibrium(stiffness[at], force, by_disc[at], contact[at], undisturbed, q, work)
    for i in range(force.size):
        rotation += carrier_by_disc[at, i] * q[i]
    return rotation, status, ratio, touching


@jit
def interpolation(position):
    """Return the first of four nodes around a position, and the weights of the cubic through them."""
    x = position - np.floor(position)
    weights = (
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    )
    return int(np.floor(position)) - 1, weights


@jit
def solve_between(position, tables, bilateral_values, contact_values, q, buffers):
    """Solve one sample between tabulated angles, all tables interpolated by a cubic through four nodes."""
    stiffness, _, carrier_by_disc, _, by_disc, _, contact = tables
    node_force, node_undisturbed, work, blended = buffers
    s, f, c, d, k, u = blended
    s[:], f[:], c[:], d[:], k[:], u[:] = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    first, weights = interpolation(position)
    rotation = 0.0
    for node in range(4):
        at, weight = first + node, weights[node]
        rotation += weight * _loads(at, tables, bilateral_values, contact_values, node_force, node_undisturbed)
        s += weight * stiffness[at]
        f += weight * node_force
        c += weight * carrier_by_disc[at]
        d += weight * by_disc[at]
        k += weight * contact[at]
        u += weight * node_undisturbed
    status, ratio, touching = _equilibrium(s, f, d, k, u, q, work)
    for i in range(f.size):
        rotation += c[i] * q[i]
    return rotation, status, ratio, touching


@jit
def solve_anywhere(position, tables, bilateral_values, contact_values, q, buffers):
    """Solve one sample at a node or between nodes; positions count nodes."""
    node = int(np.floor(position))
    if node == position:
        return _solve_at_node(node, tables, bilateral_values, contact_values, q, buffers)
    return solve_between(position, tables, bilateral_values, contact_values, q, buffers)


@jit
def make_buffers(discs, pins):
    """Return the work space of one thread: loads, Newton's method, and interpolated tables."""
    size, contacts = 3 * discs, discs * pins
    work = (
        np.empty(contacts),
        np.empty(contacts),
        np.empty(contacts),
        np.empty(size),
        np.empty(size),
        np.empty((size, size)),
    )
    blended = (
        np.empty((size, size)),
        np.empty(size),
        np.empty(size),
        np.empty((discs, 3, pins)),
        np.empty(contacts),
        np.empty(contacts),
    )
    return np.empty(size), np.empty(contacts), work, blended


@jit
def gather(errors, torque, bilateral_columns, contact_columns):
    """Return the values of one tile's samples in the order of the condensed tables."""
    samples = errors.shape[0]
    bilateral_values = np.empty((samples, bilateral_columns.size + 1))
    contact_values = np.empty((samples, contact_columns.shape[0], contact_columns.shape[1]))
    for s in range(samples):
        for m in range(bilateral_columns.size):
            bilateral_values[s, m] = errors[s, bilateral_columns[m]]
        bilateral_values[s, bilateral_columns.size] = torque
        for d in range(contact_columns.shape[0]):
            for m in range(contact_columns.shape[1]):
                contact_values[s, d, m] = errors[s, contact_columns[d, m]]
    return bilateral_values, contact_values


@jit
def solve_tile(first, stride, tables, values, buffers, rotation, discs_at, status, residual, touching):
    """Solve some samples at every ``stride``-th node, each from its own last angle's equilibrium."""
    bilateral_values, contact_values = values
    samples, angles = rotation.shape
    guess = np.zeros((samples, discs_at.shape[2]))
    finite = np.empty(samples, np.bool_)
    for s in range(samples):
        finite[s] = np.isfinite(bilateral_values[s]).all() and np.isfinite(contact_values[s]).all()
        if not finite[s]:
            rotation[s], residual[s], status[s], touching[s] = np.nan, np.inf, NOT_FINITE, 0
    for angle in range(angles):
        for s in range(samples):
            if not finite[s]:
                continue
            rotation[s, angle], status[s, angle], residual[s, angle], touching[s, angle] = _solve_at_node(
                first + angle * stride, tables, bilateral_values[s], contact_values[s], guess[s], buffers
            )
            discs_at[s, angle] = guess[s]
            if status[s, angle] != CONVERGED:
                guess[s] = 0.0


@nb.njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def solve_curves(tables, columns, errors, torque, first, stride, rotation, discs_at, status, residual, touching):
    """Fill the equilibria of every sample at every ``stride``-th node of the tables, from node ``first`` on.

    Writes, all [sample, angle]: rotation of the carrier [rad], discs_at (the discs' coordinates, lengths [m]),
    status, residual over the largest force, and the number of pins in contact.
    """
    samples = rotation.shape[0]
    for tile in nb.prange((samples + TILE - 1) // TILE):
        a, b = tile * TILE, min((tile + 1) * TILE, samples)
        values = gather(errors[a:b], torque, columns[0], columns[1])
        buffers = make_buffers(columns[1].shape[0], tables[4].shape[3])
        solve_tile(
            first,
            stride,
            tables,
            values,
            buffers,
            rotation[a:b],
            discs_at[a:b],
            status[a:b],
            residual[a:b],
            touching[a:b],
        )
