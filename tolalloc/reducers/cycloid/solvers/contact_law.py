"""Force of one pin on one disc tooth from their compression: every law is convex in energy and C¹ under load."""

from __future__ import annotations

import numpy as np

from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.running.compiled import jit_in_place

_STIFFEST = 2.0  # ln(cλ/F) at which the logarithmic law goes on straight: a force that no part carries


@jit_in_place
def _logarithmic(stiffness, log_length, compression):
    """Return force and its derivative of Hertzian line contact, theory page equation (30).

    The approach is F/c·ln(cλ/F) with c = 2·stiffness. With w = ln(cλ/F) it reads w − ln w = ln(λ/compression), which
    Newton's method solves. λ is given by its logarithm, because a pin that bends easily makes it huge.
    """
    scale = 2.0 * stiffness
    goal = log_length - np.log(compression)
    if goal <= _STIFFEST - np.log(_STIFFEST):
        force = scale * np.exp(log_length - _STIFFEST)
        beyond = compression - force / scale * _STIFFEST
        return force + scale / (_STIFFEST - 1.0) * beyond, scale / (_STIFFEST - 1.0)
    w = goal + np.log(goal + 1.0)
    for _ in range(8):
        change = (w - np.log(w) - goal) * w / (w - 1.0)
        w -= change
        if abs(change) <= 1e-15 * w:
            break
    return scale * compression / w, scale / (w - 1.0)


@jit_in_place
def pin_force(law, stiffness, log_length, half_tilt, compression):
    """Return force [N] and its derivative [N/m] of one pin contact.

    ``half_tilt`` is how much deeper the tilted tooth's end lies than its middle, equation (31), for linear laws only.
    """
    if abs(compression) < half_tilt:  # one end of the tooth is lifted
        deep = compression + half_tilt
        slope = stiffness * deep / (2.0 * half_tilt)
        return 0.5 * slope * deep, slope
    if not compression > 0.0:
        return 0.0, 0.0
    if law == LINEAR:
        return stiffness * compression, stiffness
    return _logarithmic(stiffness, log_length, compression)


@jit_in_place
def pin_forces(law, stiffness, log_length, compression, force):
    """Fill the forces of several pins, [pin]."""
    for k in range(compression.size):
        force[k] = pin_force(law, stiffness[k], log_length[k], 0.0, compression[k])[0]
