"""Energy of one sample at one angle: its problem, and the forces and stiffness of all contacts at given coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.cycloid.solvers.contact_law import pin_force
from tolalloc.running.compiled import jit, jit_in_place, jit_within


class Problem(NamedTuple):
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
    """Set the compressions of pins and elements that a displacement gives."""
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
    """Set the compressions of pins and elements with play at the coordinates q."""
    along(problem.by_disc, problem.play_by_retained, q, compression, play)
    for k in range(compression.size):
        compression[k] += problem.undisturbed[k]
    for e in range(play.shape[0]):
        play[e, 0] += problem.play_offset[e, 0]
        play[e, 1] += problem.play_offset[e, 1]


@jit_in_place
def play_force(stiffness, clearance, x, y):
    """Return force (x, y) of an element with play and its derivative (xx, xy, yy), theory page equation (28)."""
    reach = np.sqrt(x * x + y * y)
    if not reach > clearance:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    free = clearance / reach
    taut = stiffness * (1.0 - free)
    across = stiffness * free / (reach * reach)
    return taut * x, taut * y, taut + across * x * x, across * x * y, taut + across * y * y


@jit_within
def assemble(problem, compression, play, q, gradient, tangent):
    """Set gradient and lower tangent at q; return largest force, largest sum of cancelling terms, pins in contact."""
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
            force, slope = pin_force(
                problem.law, problem.contact[c], problem.log_length[c], problem.half_tilt[c], compression[c]
            )
            touching += 1
            largest = max(largest, force)
            for i in range(3):
                gradient[3 * d + i] += force * problem.by_disc[d, i, k]
                weighted = slope * problem.by_disc[d, i, k]
                for j in range(i + 1):
                    tangent[3 * d + i, 3 * d + j] += weighted * problem.by_disc[d, j, k]
    for e in range(play.shape[0]):
        fx, fy, xx, xy, yy = play_force(problem.play_stiffness[e], problem.clearance[e], play[e, 0], play[e, 1])
        largest = max(largest, np.sqrt(fx * fx + fy * fy))
        for i in range(size):
            ax, ay = problem.play_by_retained[e, 0, i], problem.play_by_retained[e, 1, i]
            gradient[i] += fx * ax + fy * ay
            for j in range(i + 1):
                bx, by = problem.play_by_retained[e, 0, j], problem.play_by_retained[e, 1, j]
                tangent[i, j] += ax * (xx * bx + xy * by) + ay * (xy * bx + yy * by)
    return largest, cancelling, touching
