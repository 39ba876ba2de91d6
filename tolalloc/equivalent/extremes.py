"""The two extremes of each sample's transmission error, refined between the coarse angles.

The extremes of the curve are kinks, where one pin takes over from another, so the peak is searched by
halving the step around the candidates and not by a parabola.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from tolalloc.equivalent.contact_solver import (
    CONVERGED,
    NOT_FINITE,
    TILE,
    gather,
    jit,
    make_buffers,
    solve_anywhere,
    solve_tile,
)


@jit
def _gain(left, centre, right):
    """Return how much a peak near ``centre`` may rise above it: the steeper flank carried on for one step."""
    return max(centre - left, centre - right)


@jit
def _refine(sign, coarse, discs_at, search, tables, values, buffers):
    """Return the largest sign·rotation, its position, the error that may be left, solves, and the worst outcome."""
    first, stride, levels, safety = search
    best_at = (sign * coarse).argmax()
    best, position = sign * coarse[best_at], first + best_at * float(stride)
    left_over, solves, worst_status, worst_residual = 0.0, 0, CONVERGED, 0.0
    q, sides = np.empty(discs_at.shape[1]), np.empty(2)
    for i in np.argsort(-sign * coarse):
        left, centre, right = sign * coarse[i - 1], sign * coarse[i], sign * coarse[(i + 1) % coarse.size]
        if centre < left or centre < right:
            continue
        at, step = first + i * float(stride), float(stride)
        for _ in range(levels):
            if centre + safety * _gain(left, centre, right) <= best and centre < best:
                break
            step *= 0.5
            for side in range(2):
                q[:] = discs_at[i]
                rotation, status, ratio, _ = solve_anywhere(
                    at + (2 * side - 1) * step, tables, values[0], values[1], q, buffers
                )
                sides[side] = sign * rotation if status == CONVERGED else -np.inf
                solves += 1
                worst_status, worst_residual = max(worst_status, status), max(worst_residual, ratio)
            if sides[0] > centre and sides[0] >= sides[1]:
                left, centre, right, at = left, sides[0], centre, at - step
            elif sides[1] > centre:
                left, centre, right, at = centre, sides[1], right, at + step
            else:
                left, right = sides[0], sides[1]
        if centre > best or at == position:
            best, position, left_over = max(centre, best), at, _gain(left, centre, right)
    return best, position, left_over, solves, worst_status, worst_residual


@nb.njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def solve_extremes(
    tables, columns, errors, torque, angles, search, extreme, position, left_over, solves, status, residual
):
    """Fill the extremes of every sample; ``search`` is (first node, stride, levels, safety).

    Writes extreme [sample, 2] (largest and smallest carrier rotation [rad]), position [sample, 2] among the nodes,
    left_over [sample] (what finer angles may add to their difference [rad]), number of solves, worst status, and
    largest residual over the largest force.
    """
    first, stride, _, _ = search
    samples = errors.shape[0]
    for tile in nb.prange((samples + TILE - 1) // TILE):
        a, b = tile * TILE, min((tile + 1) * TILE, samples)
        n, size = b - a, 3 * columns[1].shape[0]
        values = gather(errors[a:b], torque, columns[0], columns[1])
        buffers = make_buffers(columns[1].shape[0], tables[4].shape[3])
        rotation, residual_at = np.empty((n, angles)), np.empty((n, angles))
        discs_at = np.empty((n, angles, size))
        status_at, touching = np.empty((n, angles), np.uint8), np.empty((n, angles), np.uint8)
        solve_tile(first, stride, tables, values, buffers, rotation, discs_at, status_at, residual_at, touching)
        for s in range(n):
            solves[a + s], left_over[a + s] = angles, 0.0
            status[a + s], residual[a + s] = status_at[s].max(), residual_at[s].max()
            if status[a + s] == NOT_FINITE:
                extreme[a + s], position[a + s] = np.nan, np.nan
                continue
            own = (values[0][s], values[1][s])
            for side in range(2):
                sign = 1.0 - 2.0 * side
                best, at, left, count, worst_status, worst_residual = _refine(
                    sign, rotation[s], discs_at[s], search, tables, own, buffers
                )
                extreme[a + s, side], position[a + s, side] = sign * best, at
                left_over[a + s] += left
                solves[a + s] += count
                status[a + s] = max(status[a + s], worst_status)
                residual[a + s] = max(residual[a + s], worst_residual)
