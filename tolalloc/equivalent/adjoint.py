"""Exact derivatives of the peak-to-peak by every error column, at the converged contact set.

At equilibrium the carrier rotation is w·q + t·ε with (S + ΣkDDᵀ)q = F·ε − ΣkD(H·ε), sums over the pins in
contact. One solve of the same matrix for w gives the derivative by all columns at once.

An extreme of the curve is a kink, where a branch A that rises with the angle meets a branch B that falls. Its
value follows from A(θ, ε) = B(θ, ε), so its derivative is the mean of both branches' derivatives, each weighted by
the other's slope. Where the extreme is smooth both slopes vanish alike and the mean is as good as either.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from tolalloc.equivalent.contact_solver import CONVERGED, gather, interpolation, jit, make_buffers, solve_between
from tolalloc.equivalent.contact_solver import solve_tangent as _solve_tangent


@jit
def _add_derivative(position, factor, tables, columns, values, buffers, q, out):
    """Add factor·∂(carrier rotation)/∂(error) at one position to out; return the status of the equilibrium."""
    _, load, _, carrier_by_load, _, by_error, _ = tables
    bilateral_columns, contact_columns = columns
    q[:] = 0.0
    _, status, _, _ = solve_between(position, tables, values[0], values[1], q, buffers)
    if status != CONVERGED:
        return status
    stiffness, _, carrier_by_disc, by_disc, contact, undisturbed = buffers[3]
    tangent, adjoint = stiffness.copy(), np.empty(q.size)
    discs, _, pins = by_disc.shape
    weight_of_pin = np.zeros(contact.size)
    for d in range(discs):
        for k in range(pins):
            compression = undisturbed[d * pins + k]
            for i in range(3):
                compression += by_disc[d, i, k] * q[3 * d + i]
            if compression > 0.0:
                weight_of_pin[d * pins + k] = contact[d * pins + k]
                for i in range(3):
                    for j in range(i + 1):
                        tangent[3 * d + i, 3 * d + j] += contact[d * pins + k] * by_disc[d, i, k] * by_disc[d, j, k]
    _solve_tangent(tangent, -carrier_by_disc, adjoint)
    for d in range(discs):
        for k in range(pins):
            lever = 0.0
            for i in range(3):
                lever += by_disc[d, i, k] * adjoint[3 * d + i]
            weight_of_pin[d * pins + k] *= lever
    first, weights = interpolation(position)
    for node in range(4):
        at, weight = first + node, factor * weights[node]
        for m in range(bilateral_columns.size):
            value = carrier_by_load[at, m]
            for i in range(q.size):
                value += load[at, m, i] * adjoint[i]
            out[bilateral_columns[m]] += weight * value
        for d in range(discs):
            for m in range(contact_columns.shape[1]):
                value = 0.0
                for k in range(pins):
                    value += by_error[at, d, m, k] * weight_of_pin[d * pins + k]
                out[contact_columns[d, m]] -= weight * value
    return status


@jit
def _slope(position, step, tables, values, buffers, q):
    """Return the change of the carrier rotation over one step of the position, from half before to half behind."""
    rotation = np.empty(2)
    for side in range(2):
        q[:] = 0.0
        rotation[side] = solve_between(position + (side - 0.5) * step, tables, values[0], values[1], q, buffers)[0]
    return rotation[1] - rotation[0]


@nb.njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def solve_derivatives(tables, columns, errors, torque, position, step, derivative, status):
    """Fill ∂(peak-to-peak)/∂(error) of every sample from the positions of its two extremes, [sample, column].

    ``step`` is the distance in nodes within which the extremes were found.
    """
    for s in nb.prange(errors.shape[0]):
        derivative[s] = 0.0
        if not np.isfinite(position[s]).all():
            derivative[s] = np.nan
            continue
        bilateral_values, contact_values = gather(errors[s : s + 1], torque, columns[0], columns[1])
        buffers, q = make_buffers(columns[1].shape[0], tables[4].shape[3]), np.empty(3 * columns[1].shape[0])
        values = (bilateral_values[0], contact_values[0])
        for extreme in range(2):
            sign = 1.0 - 2.0 * extreme
            before, behind = position[s, extreme] - 2.0 * step, position[s, extreme] + 2.0 * step
            rise = max(sign * _slope(before, step, tables, values, buffers, q), 0.0)
            fall = max(-sign * _slope(behind, step, tables, values, buffers, q), 0.0)
            share = rise / (rise + fall) if rise + fall > 0.0 else 0.5
            for at, factor in ((before, sign * (1.0 - share)), (behind, sign * share)):
                outcome = _add_derivative(at, factor, tables, columns, values, buffers, q, derivative[s])
                status[s] = max(status[s], outcome)
