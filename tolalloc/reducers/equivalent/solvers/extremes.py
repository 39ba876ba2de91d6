"""The two extremes of each sample's transmission error, refined between the coarse angles.

First the highest peak of either side is followed to its end; then every other one that may still reach what was found.
Every peak's search depends on its own sample alone, whatever stands in the lanes beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.reducers.equivalent.solvers.interpolation import make_memory
from tolalloc.reducers.equivalent.solvers.lending import make_lent
from tolalloc.reducers.equivalent.solvers.problem import values_of
from tolalloc.reducers.equivalent.solvers.records import MARGIN, NOT_FINITE, SolvedExtremes, SolvedTurn
from tolalloc.reducers.equivalent.solvers.refinement import search_peaks
from tolalloc.reducers.equivalent.solvers.searches import Peaks, gain, make_peaks, make_searches
from tolalloc.reducers.equivalent.solvers.turn import make_turn, solve_tile, tile_size
from tolalloc.running.compiled import in_threads, jit


def _highest(turn: SolvedTurn, found: SolvedExtremes) -> Peaks:
    """Return the highest peak of every side of every sample."""
    sample = np.flatnonzero(found.status != NOT_FINITE)
    inside = turn.rotation[sample, 1:-1]
    coarse = np.concatenate([inside.argmax(axis=1), inside.argmin(axis=1)])
    return make_peaks(np.stack([np.tile(sample, 2), np.repeat([0, 1], sample.size), coarse]))


@jit
def _others(turn, search, best, highest, found):
    """Return sample, side and coarse angle of the other peaks that may reach what was found at the highest ones."""
    others = np.empty((3, turn.rotation.size), np.int64)
    count, known = 0, np.full((found.status.size, 2), -1)
    for p in range(highest.coarse.size):
        known[highest.sample[p], highest.side[p]] = highest.coarse[p]
    for s in range(found.status.size):
        if found.status[s] == NOT_FINITE:
            continue
        for one in range(2):
            sign = 1.0 - 2.0 * one
            for i in range(search.coarse):
                left, centre, right = (
                    sign * turn.rotation[s, i],
                    sign * turn.rotation[s, i + 1],
                    sign * turn.rotation[s, i + 2],
                )
                peak = centre >= left and centre >= right and i != known[s, one]
                if peak and centre + search.safety * gain(left, centre, right) > best[s, one]:
                    others[0, count], others[1, count], others[2, count] = s, one, i
                    count += 1
    return others[:, :count]


@jit
def _keep_best(peaks, best, left_over, found):
    """Take over what is higher than the best of its sample and side."""
    for p in range(peaks.coarse.size):
        s, one = peaks.sample[p], peaks.side[p]
        if peaks.height[p] > best[s, one]:
            best[s, one], left_over[s, one] = peaks.height[p], peaks.left_over[p]
            found.extreme[s, one], found.position[s, one] = (1.0 - 2.0 * one) * peaks.height[p], peaks.position[p]


@jit
def _prepare(layout, mapped, errors, torque, elements, turn, values, found):
    """Set the values of all samples and what their coarse turns say; return which are solved one by one."""
    alone = np.empty(errors.shape[0], np.bool_)
    values_of(errors, torque, layout, mapped, values)
    for s in range(alone.size):
        found.solves[s] = turn.rotation.shape[1]
        found.status[s], found.residual[s] = turn.status[s].max(), turn.residual[s].max()
        found.extreme[s], found.position[s] = np.nan, np.nan
        alone[s] = elements > 0 or np.any(values[s, layout.tilt :] != 0.0)
    return alone


def refine(
    discs: Any,
    tables: Any,
    layout: Any,
    mapped: Any,
    design: Any,
    errors: Any,
    torque: Any,
    search: Any,
    turn: Any,
    found: Any,
) -> None:
    """Fill the extremes of some samples whose coarse turn is solved.

    Not compiled itself: what it calls would be compiled a second time as a part of it.
    """
    contacts, values = tables.contact_stiffness.shape[1], np.empty((errors.shape[0], layout.end))
    best, left_over = np.full((errors.shape[0], 2), -np.inf), np.zeros((errors.shape[0], 2))
    alone = _prepare(layout, mapped, errors, torque, tables.play_stiffness.shape[1], turn, values, found)
    own, lent = make_searches(turn.retained.shape[2]), make_lent(layout, 3 * len(discs), contacts)
    memory = make_memory(design.law, tables)
    given = (discs, alone, tables, layout, design, values, search, turn, best)
    highest = _highest(turn, found)
    search_peaks(*given, highest, own, memory, lent, found)
    _keep_best(highest, best, left_over, found)
    others = make_peaks(_others(turn, search, best, highest, found))
    search_peaks(*given, others, own, memory, lent, found)
    _keep_best(others, best, left_over, found)
    found.left_over[:] = left_over.sum(axis=1)


def solve_extremes(
    discs: Any, tables: Any, layout: Any, mapped: Any, design: Any, errors: Any, torque: Any, search: Any, found: Any
) -> None:
    """Fill the extremes of every sample."""

    def solve(part: slice) -> None:
        given = (tables, layout, mapped, design, errors[part], torque)
        turn = make_turn(part.stop - part.start, search.coarse + 2, tables.load.shape[2])
        solve_tile(discs, MARGIN, search.nodes_per_coarse, search.turn_of_crank(layout.teeth), *given, turn)
        own = SolvedExtremes(*(values[part] for values in found))
        own.curve[:] = turn.rotation[:, 1 : 1 + own.curve.shape[1]]
        refine(discs, *given, search, turn, own)

    in_threads(solve, errors.shape[0], tile_size(errors.shape[0]))
