"""The two extremes of each sample's transmission error, refined between the coarse angles, a search to a lane.

First the highest peak of either side is followed to its end; then every other one that may still reach what was found.
An extreme is a kink, where one pin takes over from another, so a peak is searched by halving the step around it and
not by a parabola. Every peak's search depends on its own sample alone, whatever stands in the lanes beside it; searches
go through the turn side by side, so that what the lanes read of the tables is still in the cache.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.solvers.batch import most_steps, settle
from tolalloc.reducers.equivalent.solvers.contact_solver import values_of
from tolalloc.reducers.equivalent.solvers.play import settle_with_play
from tolalloc.reducers.equivalent.solvers.records import (
    CONVERGED,
    MARGIN,
    NOT_FINITE,
    Given,
    SolvedExtremes,
    SolvedTurn,
)
from tolalloc.reducers.equivalent.solvers.simd import ALL, WIDTH
from tolalloc.reducers.equivalent.solvers.turn import batch_size, make_turn, part_of, solve_batch
from tolalloc.reducers.equivalent.solvers.workspace import (
    fill_lane,
    look_at_all_taken,
    make_memory,
    make_workspace,
    moved_too_far,
    solve_anywhere,
)
from tolalloc.running.compiled import in_threads, jit, jit_in_place


class Peaks(NamedTuple):
    """Peaks of the coarse curves that are searched, in the order of their angles, and what was found there."""

    sample: Int[np.ndarray, " peak"]  # Whose curve it is on [-]
    side: Int[np.ndarray, " peak"]  # 0 for its largest, 1 for its smallest value [-]
    coarse: Int[np.ndarray, " peak"]  # Coarse angle of the turn [-]
    # The highest ±rotation found [rad], where [nodes], and what its flanks may still add [rad]
    height: Float[np.ndarray, " peak"]
    position: Float[np.ndarray, " peak"]
    left_over: Float[np.ndarray, " peak"]


class Searches(NamedTuple):
    """What the searches know."""

    peak: Int[np.ndarray, " lane"]  # Which peak is searched; −1 for none [-]
    level: Int[np.ndarray, " lane"]  # Halvings done [-]
    half: Int[np.ndarray, " lane"]  # Whether the left or the right side is looked at [-]
    # Where the centre is, and how far its sides [nodes]
    at: Float[np.ndarray, " lane"]
    step: Float[np.ndarray, " lane"]
    looks_at: Float[np.ndarray, " lane"]  # Which side that is [nodes]
    # Left neighbour, centre, right neighbour; and the two that stand half as far: ±rotation [rad], coordinates [m]
    height: Float[np.ndarray, "lane 3"]
    q: Float[np.ndarray, "lane 3 retained"]
    new_height: Float[np.ndarray, "lane 2"]
    new_q: Float[np.ndarray, "lane 2 retained"]


def _make_searches(retained: int) -> Searches:
    """Return lanes without a search."""
    return Searches(
        np.full(WIDTH, -1),
        np.zeros(WIDTH, np.int64),
        np.zeros(WIDTH, np.int64),
        np.zeros(WIDTH),
        np.zeros(WIDTH),
        np.zeros(WIDTH),
        np.zeros((WIDTH, 3)),
        np.zeros((WIDTH, 3, retained)),
        np.zeros((WIDTH, 2)),
        np.zeros((WIDTH, 2, retained)),
    )


def _make_peaks(found: Int[np.ndarray, "3 peak"]) -> Peaks:
    """Return peaks in the order of their angles, so that searches side by side read the same tables."""
    sample, side, coarse = found
    order = np.argsort(coarse, kind="stable")
    return Peaks(
        sample[order],
        side[order],
        coarse[order],
        np.empty(order.size),
        np.empty(order.size),
        np.empty(order.size),
    )


@jit_in_place
def _begin(lane, peak, search, turn, peaks, own):
    """Let a lane search around a peak.

    The solved turn begins and ends one coarse angle outside, so that every angle has two neighbours of its own, also
    where the ratio leaves the curve not periodic.
    """
    sample, coarse, sign = peaks.sample[peak], peaks.coarse[peak], 1.0 - 2.0 * peaks.side[peak]
    own.peak[lane], own.level[lane], own.step[lane] = peak, 0, float(search.nodes_per_coarse)
    own.at[lane] = search.nodes_per_coarse + MARGIN + coarse * own.step[lane]
    for i in range(3):
        own.height[lane, i] = sign * turn.rotation[sample, coarse + i]
        for j in range(own.q.shape[2]):
            own.q[lane, i, j] = turn.retained[sample, coarse + i, j]


@jit_in_place
def _gain(left, centre, right):
    """Return how much a peak near ``centre`` may rise above it: the steeper flank carried on for one step."""
    return max(centre - left, centre - right)


@jit_in_place
def _look_closer(lane, search, best, peaks, own):
    """Halve the step, or end the search where it is fine enough or cannot reach the sample's best any more."""
    peak, centre = own.peak[lane], own.height[lane, 1]
    more = _gain(own.height[lane, 0], centre, own.height[lane, 2])
    hopeful = centre + search.safety * more > best[peaks.sample[peak], peaks.side[peak]]
    if own.level[lane] < search.levels and hopeful:
        own.level[lane] += 1
        own.step[lane] *= 0.5
        own.half[lane] = 0
        return
    peaks.height[peak], peaks.position[peak], peaks.left_over[peak] = centre, own.at[lane], more
    own.peak[lane] = -1


@jit_in_place
def _put(lane, place, height, q, own):
    """Put a height and its coordinates at the left, in the centre or at the right."""
    own.height[lane, place] = height
    for i in range(q.size):
        own.q[lane, place, i] = q[i]


@jit_in_place
def _move(lane, own):
    """Make the highest of centre and new sides the centre."""
    left, centre, right = own.new_height[lane, 0], own.height[lane, 1], own.new_height[lane, 1]
    q, at_left, at_right = own.q[lane, 1], own.new_q[lane, 0], own.new_q[lane, 1]
    if left > centre and left >= right:
        _put(lane, 2, centre, q, own)
        _put(lane, 1, left, at_left, own)
        own.at[lane] -= own.step[lane]
    elif right > centre:
        _put(lane, 0, centre, q, own)
        _put(lane, 1, right, at_right, own)
        own.at[lane] += own.step[lane]
    else:
        _put(lane, 0, left, at_left, own)
        _put(lane, 2, right, at_right, own)


@jit_in_place
def _take(lane, rotation, status, ratio, search, best, peaks, own, found):
    """Take in what was found where the lane looked."""
    peak, half = own.peak[lane], own.half[lane]
    sample = peaks.sample[peak]
    found.solves[sample] += 1
    found.status[sample] = max(found.status[sample], status)
    found.residual[sample] = max(found.residual[sample], ratio)
    own.new_height[lane, half] = (1.0 - 2.0 * peaks.side[peak]) * rotation
    if status != CONVERGED:
        own.new_height[lane, half] = -np.inf
        for i in range(own.q.shape[2]):
            own.new_q[lane, half, i] = own.q[lane, 1, i]
    own.half[lane] += 1
    if half == 1:
        _move(lane, own)
        _look_closer(lane, search, best, peaks, own)


@jit_in_place
def _fill_all(alone, law, tables, layout, values, peaks, own, workspace):
    """Put the problems where the lanes look into them; return one bit per lane that is solved so, or alone."""
    together, apart = 0, 0
    for lane in range(WIDTH):
        if own.peak[lane] < 0:
            continue
        sample, half = peaks.sample[own.peak[lane]], own.half[lane]
        start, side = own.new_q[lane, half], own.q[lane, 2 * half]
        own.looks_at[lane] = own.at[lane] + (2 * half - 1) * own.step[lane]
        for i in range(start.size):
            start[i] = 0.5 * (own.q[lane, 1, i] + side[i])
        if alone[sample]:
            apart |= 1 << lane
            continue
        together |= 1 << lane
        for i in range(workspace.batch.q.shape[0]):
            workspace.batch.q[i, lane] = start[i]
        fill_lane(lane, own.looks_at[lane], start, side, law, tables, layout, values[sample], workspace)
    look_at_all_taken(workspace)
    return together, apart


@jit_in_place
def _search_peaks(
    discs, alone, play, tables, layout, design, values, search, turn, best, peaks, own, memory, workspace, found
):
    """Search around all peaks, the lanes taking one after another.

    Samples that are to be ``alone``, and lanes that do not settle, go to the solver for one sample.
    """
    waiting, batch, face_width = 0, workspace.batch, design.face_width
    while True:
        for lane in range(WIDTH):
            while own.peak[lane] < 0 and waiting < peaks.coarse.size:
                _begin(lane, waiting, search, turn, peaks, own)
                workspace.node[lane, :] = -1
                _look_closer(lane, search, best, peaks, own)
                waiting += 1
        together, careful = _fill_all(alone, design.law, tables, layout, values, peaks, own, workspace)
        if not together | careful:
            return
        if together:
            if play is None:
                done, steps = ALL ^ together, most_steps(design.law)
                left, _ = settle(design.law, discs, workspace.tables, 0, batch, done, steps)
            else:
                left = settle_with_play(design.law, discs, workspace.tables, batch, play, together)
            careful |= left
        for lane in range(WIDTH):
            q = own.new_q[lane, own.half[lane]]
            if (together >> lane) & 1 and moved_too_far(lane, q, workspace):
                careful |= 1 << lane
            if (careful >> lane) & 1:
                sample, position = peaks.sample[own.peak[lane]], own.looks_at[lane]
                memory[2].first[0], memory[2].first[1] = -1, -1
                rotation, status, ratio, _ = solve_anywhere(
                    position, tables, layout, face_width, values[sample], q, memory
                )
                _take(lane, rotation, status, ratio, search, best, peaks, own, found)
            elif (together >> lane) & 1:
                rotation = workspace.base[lane]
                for i in range(batch.q.shape[0]):
                    q[i] = batch.q[i, lane]
                    rotation += workspace.by_coordinate[i, lane] * q[i]
                _take(lane, rotation, CONVERGED, batch.ratio[lane], search, best, peaks, own, found)


def _highest(turn: SolvedTurn, found: SolvedExtremes) -> Peaks:
    """Return the highest peak of every side of every sample."""
    sample = np.flatnonzero(found.status != NOT_FINITE)
    inside = turn.rotation[sample, 1:-1]
    coarse = np.concatenate([inside.argmax(axis=1), inside.argmin(axis=1)])
    return _make_peaks(np.stack([np.tile(sample, 2), np.repeat([0, 1], sample.size), coarse]))


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
                if peak and centre + search.safety * _gain(left, centre, right) > best[s, one]:
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
def _prepare(layout, mapped, errors, torque, turn, values, found):
    """Set the values of all samples and what their coarse turns say; return which are solved one by one."""
    alone = np.empty(errors.shape[0], np.bool_)
    values_of(errors, torque, layout, mapped, values)
    for s in range(alone.size):
        found.solves[s] = turn.rotation.shape[1]
        found.status[s], found.residual[s] = turn.status[s].max(), turn.residual[s].max()
        found.extreme[s], found.position[s] = np.nan, np.nan
        alone[s] = np.any(values[s, layout.tilt :] != 0.0)
    return alone


def make_extremes(samples: int, angles: int) -> SolvedExtremes:
    """Return room for the extremes of some samples, and their curves at the first coarse angles."""
    return SolvedExtremes(
        np.empty((samples, 2)),
        np.empty((samples, 2)),
        np.empty(samples),
        np.empty(samples, np.int64),
        np.empty(samples, np.uint8),
        np.empty(samples),
        np.empty((samples, angles)),
    )


def refine(discs: Any, tables: Any, given: Given, search: Any, turn: Any, found: Any) -> None:
    """Fill the extremes of some samples whose coarse turn is solved.

    Not compiled itself: what it calls would be compiled a second time as a part of it.
    """
    layout, mapped, design, errors, torque = given
    contacts, values = tables.contact_stiffness.shape[1], np.empty((errors.shape[0], layout.end))
    best, left_over = np.full((errors.shape[0], 2), -np.inf), np.zeros((errors.shape[0], 2))
    alone = _prepare(layout, mapped, errors, torque, turn, values, found)
    size, elements = turn.retained.shape[2], tables.play_stiffness.shape[1]
    own, workspace = _make_searches(size), make_workspace(layout, size, contacts, elements)
    memory, play = make_memory(design.law, tables), workspace.play if elements else None
    searched = (discs, alone, play, tables, layout, design, values, search, turn, best)
    highest = _highest(turn, found)
    _search_peaks(*searched, highest, own, memory, workspace, found)
    _keep_best(highest, best, left_over, found)
    others = _make_peaks(_others(turn, search, best, highest, found))
    _search_peaks(*searched, others, own, memory, workspace, found)
    _keep_best(others, best, left_over, found)
    found.left_over[:] = left_over.sum(axis=1)


def solve_extremes(discs: Any, tables: Any, given: Given, search: Any, found: Any) -> None:
    """Fill the extremes of every sample."""

    def solve(part: slice) -> None:
        mine = part_of(given, part)
        turn = make_turn(part.stop - part.start, search.coarse + 2, tables.load.shape[2])
        solve_batch(discs, MARGIN, search.nodes_per_coarse, search.turn_of_crank(given[0].teeth), tables, mine, turn)
        own = SolvedExtremes(*(values[part] for values in found))
        own.curve[:] = turn.rotation[:, 1 : 1 + own.curve.shape[1]]
        refine(discs, tables, mine, search, turn, own)

    in_threads(solve, len(given[3]), batch_size(len(given[3])))
