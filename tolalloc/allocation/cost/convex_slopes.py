"""Slopes at points with which a cubic spline is convex, as near as possible to given ones."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

ROUNDING = 1e-9
"""Relative difference of slopes up to which it is rounding, such as on one straight line [-]."""


def convex_slopes(
    secants: Float[np.ndarray, " piece"], slopes: Float[np.ndarray, " point"]
) -> Float[np.ndarray, " point"]:
    """Return slopes that make the spline convex, or the given ones where none do.

    Parameters
    ----------
    secants
        Slopes of the straight lines between neighbouring points, 0 or below [cost units per unit of the zone].
    slopes
        Slopes at the points to stay close to [cost units per unit of the zone].

    Notes
    -----
    A cubic with end slopes −x and −y over a secant −m is convex where x + 2y ≤ 3m ≤ 2x + y. Given an interval of y,
    those of x that leave a choice are an interval too; so the intervals are found from the last point to the first, and
    the slopes inside them from the first to the last.
    """
    falls = -secants
    intervals = [(0.0, np.inf)]
    for fall in falls[::-1]:
        least, most = intervals[-1]
        if least > fall * (1 + ROUNDING):
            return slopes
        intervals.append(((3 * fall - min(most, fall)) / 2, 3 * fall - 2 * least))
    intervals.reverse()
    chosen = [float(np.clip(-slopes[0], *intervals[0]))]
    for fall, (least, most), wanted in zip(falls, intervals[1:], -slopes[1:], strict=True):
        least, most = max(least, 3 * fall - 2 * chosen[-1]), min(most, (3 * fall - chosen[-1]) / 2)
        chosen.append(float(np.clip(wanted, least, most)))
    return -np.array(chosen)
