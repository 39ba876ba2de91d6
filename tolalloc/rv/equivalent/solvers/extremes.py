"""The two extremes of each sample's transmission error, refined between the coarse angles.

The extremes of the curve are kinks, where one pin takes over from another, so the peak is searched by
halving the step around the candidates and not by a parabola.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.compiled import in_threads, jit
from tolalloc.rv.equivalent.solvers.interpolation import make_memory, solve_anywhere
from tolalloc.rv.equivalent.solvers.problem import values_of
from tolalloc.rv.equivalent.solvers.records import CONVERGED, MARGIN, NOT_FINITE, SolvedExtremes
from tolalloc.rv.equivalent.solvers.turn import make_turn, solve_tile, tile_size


@jit
def _gain(left, centre, right):
    """Return how much a peak near ``centre`` may rise above it: the steeper flank carried on for one step."""
    return max(centre - left, centre - right)


@jit
def _refine(sign, rotation, retained, search, tables, layout, design, values, memory):
    """Return the largest sign·rotation, its position, the error that may be left, solves, and the worst outcome.

    ``rotation`` and ``retained`` begin and end one coarse angle outside the turn, so that every angle has two
    neighbours of its own, also where the ratio leaves the curve not periodic.
    """
    inside = sign * rotation[1:-1]
    best_at = inside.argmax()
    first, stride = search.nodes_per_coarse + MARGIN, float(search.nodes_per_coarse)
    best, position = inside[best_at], first + best_at * stride
    left_over, solves, worst_status, worst_residual = 0.0, 0, CONVERGED, 0.0
    sides, here, at_side = np.empty(2), np.empty(retained.shape[1]), np.empty((2, retained.shape[1]))
    peaks = np.flatnonzero((inside >= sign * rotation[:-2]) & (inside >= sign * rotation[2:]))
    for i in peaks[np.argsort(-inside[peaks])]:
        left, centre, right = sign * rotation[i], inside[i], sign * rotation[i + 2]
        at, step = first + i * stride, stride
        here[:] = retained[i + 1]
        for _ in range(search.levels):
            if centre + search.safety * _gain(left, centre, right) <= best and centre < best:
                break
            step *= 0.5
            for side in range(2):
                at_side[side] = here
                turned, status, ratio, _ = solve_anywhere(
                    at + (2 * side - 1) * step, tables, layout, design.face_width, values, at_side[side], memory
                )
                sides[side] = sign * turned if status == CONVERGED else -np.inf
                solves += 1
                worst_status, worst_residual = max(worst_status, status), max(worst_residual, ratio)
            if sides[0] > centre and sides[0] >= sides[1]:
                left, centre, right, at = left, sides[0], centre, at - step
                here[:] = at_side[0]
            elif sides[1] > centre:
                left, centre, right, at = centre, sides[1], right, at + step
                here[:] = at_side[1]
            else:
                left, right = sides[0], sides[1]
        if centre > best or at == position:
            best, position, left_over = max(centre, best), at, _gain(left, centre, right)
    return best, position, left_over, solves, worst_status, worst_residual


@jit
def _refine_all(tables, layout, mapped, design, errors, torque, search, turn, found):
    """Fill the extremes of some samples whose coarse turn is solved."""
    values = np.empty((errors.shape[0], layout.end))
    values_of(errors, torque, layout, mapped, values)
    memory = make_memory(design.law, tables)
    for s in range(errors.shape[0]):
        found.solves[s], found.left_over[s] = turn.rotation.shape[1], 0.0
        found.status[s], found.residual[s] = turn.status[s].max(), turn.residual[s].max()
        if found.status[s] == NOT_FINITE:
            found.extreme[s], found.position[s] = np.nan, np.nan
            continue
        memory[2].first[:] = -1
        for side in range(2):
            sign = 1.0 - 2.0 * side
            best, at, left, count, worst_status, worst_residual = _refine(
                sign, turn.rotation[s], turn.retained[s], search, tables, layout, design, values[s], memory
            )
            found.extreme[s, side], found.position[s, side] = sign * best, at
            found.left_over[s] += left
            found.solves[s] += count
            found.status[s] = max(found.status[s], worst_status)
            found.residual[s] = max(found.residual[s], worst_residual)


def solve_extremes(
    discs: Any, tables: Any, layout: Any, mapped: Any, design: Any, errors: Any, torque: Any, search: Any, found: Any
) -> None:
    """Fill the extremes of every sample."""

    def solve(part: slice) -> None:
        given = (tables, layout, mapped, design, errors[part], torque)
        turn = make_turn(part.stop - part.start, search.coarse + 2, tables.load.shape[2])
        solve_tile(discs, MARGIN, search.nodes_per_coarse, *given, turn)
        _refine_all(*given, search, turn, SolvedExtremes(*(values[part] for values in found)))

    in_threads(solve, errors.shape[0], tile_size(errors.shape[0]))
