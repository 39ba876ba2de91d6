"""Searches around peaks of the curve, one in each lane.

An extreme is a kink, where one pin takes over from another, so a peak is searched by halving the step around it and
not by a parabola. What a search finds depends on its own sample alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.solvers.lanes import WIDTH
from tolalloc.reducers.equivalent.solvers.records import CONVERGED, MARGIN
from tolalloc.running.compiled import jit_in_place


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


def make_searches(retained: int) -> Searches:
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


def make_peaks(found: Int[np.ndarray, "3 peak"]) -> Peaks:
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
def begin(lane, peak, search, turn, peaks, own):
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
def gain(left, centre, right):
    """Return how much a peak near ``centre`` may rise above it: the steeper flank carried on for one step."""
    return max(centre - left, centre - right)


@jit_in_place
def look_closer(lane, search, best, peaks, own):
    """Halve the step, or end the search where it is fine enough or cannot reach the sample's best any more."""
    peak, centre = own.peak[lane], own.height[lane, 1]
    more = gain(own.height[lane, 0], centre, own.height[lane, 2])
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
def take(lane, rotation, status, ratio, search, best, peaks, own, found):
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
        look_closer(lane, search, best, peaks, own)
