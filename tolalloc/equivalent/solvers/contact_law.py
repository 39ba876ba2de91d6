"""Force of one pin on one disc tooth from their compression: every law is convex in energy and C¹ under load."""

from __future__ import annotations

import numpy as np

from tolalloc.equivalent.solvers.compiled import jit

LINEAR, LOGARITHMIC = 0, 1
LAWS = {"constant": LINEAR, "table2": LINEAR, "logarithmic": LOGARITHMIC}
"""Law of each `Stiffness.pin_contact_law`; the linear ones differ in their stiffness along the tooth only."""

_STIFFEST = 2.0  # w of the smallest force law's argument; beyond it the law goes on straight


@jit
def _logarithmic(stiffness, length, compression):
    """Return force and its derivative of Hertzian line contact, theory page equation (30).

    The approach is F/c·(ln(4cL/F) − 1) with c = 2·stiffness. With u = F·e/(4cL) it reads −u·ln u = e·compression/(4L),
    which Newton's method solves for w = −ln u.
    """
    scale = 2.0 * stiffness
    straight = 4.0 * length * _STIFFEST * np.exp(-_STIFFEST - 1.0)
    if compression >= straight:
        force = 4.0 * scale * length * np.exp(-_STIFFEST - 1.0)
        return force + scale / (_STIFFEST - 1.0) * (compression - straight), scale / (_STIFFEST - 1.0)
    goal = np.log(4.0 * length / compression) - 1.0
    w = goal + np.log(goal + 1.0)
    for _ in range(8):
        change = (w - np.log(w) - goal) * w / (w - 1.0)
        w -= change
        if abs(change) <= 1e-15 * w:
            break
    return 4.0 * scale * length * np.exp(-w - 1.0), scale / (w - 1.0)


@jit
def pin_force(law, stiffness, length, half_tilt, compression):
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
    return _logarithmic(stiffness, length, compression)
