"""Dense curves on fewer angles: a least-squares cubic spline, and what it leaves of the readings' noise."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.linalg import solveh_banded

READINGS = 936
"""Angles of a resampled curve; order 80 has 12 of them per period, and the spline errs by 1e-4 of its amplitude [-]."""

FULL = 2 * READINGS
"""Most readings that keep their own angles [-].

With less than two readings between knots the spline all but interpolates, and where readings fall between knots it
amplifies their noise.
"""

WRAPPED = 24
"""Knot spacings that a whole turn is continued beyond its ends; a reading's influence falls to 0.4 per spacing [-]."""


@dataclass(frozen=True, kw_only=True)
class Cleaned:
    """Clean readings."""

    # Angles or torques, ascending; resampled angles equally spaced but for gaps of the readings [rad or N·m]
    along: Float[np.ndarray, " reading"]
    values: Float[np.ndarray, " reading"]  # Readings without their mean, or the spline at resampled angles [rad]
    # Standard deviation of one of these over that of a reading of the instrument, root mean square; resampled, its
    # square is near angles over readings [-]
    noise_factor: float
    repairs: tuple[str, ...] = ()  # What was mended, a sentence each


def resampled(
    angle: Float[np.ndarray, " reading"], values: Float[np.ndarray, " reading"], *, whole_turn: bool
) -> Cleaned:
    """Return a dense curve at `READINGS` angles, the knots of the spline.

    There are about as many values as the spline has coefficients, so that the curve weighs as much afterwards as its
    readings did. Angles in gaps are left out: where no reading stands before the next angle, and where the value would
    be less certain than a reading.

    Angles ascend strictly, angles and values are in rad; over a whole turn the curve closes after 2π.
    """
    length = 2.0 * pi if whole_turn else float(angle[-1] - angle[0])
    spacing, wrap = length / READINGS, WRAPPED if whole_turn else 0
    grid = angle[0] + spacing * np.arange(-wrap, READINGS + wrap + 1)
    if wrap:
        before, after = angle > angle[0] + length - wrap * spacing, angle < angle[0] + wrap * spacing
        values = np.concatenate([values[before], values, values[after]])
        angle = np.concatenate([angle[before] - length, angle, angle[after] + length])
    gaps = np.flatnonzero(np.diff(angle) > 2.0 * spacing) + 1
    pieces = [
        _piece(own, shown, grid, grid[wrap : wrap + READINGS])
        for own, shown in zip(np.split(angle, gaps), np.split(values, gaps), strict=True)
    ]
    angles, smooth, variance = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    sure = variance <= 1.0
    return Cleaned(along=angles[sure], values=smooth[sure], noise_factor=float(np.sqrt(variance[sure].mean())))


def _piece(
    angle: Float[np.ndarray, " reading"],
    values: Float[np.ndarray, " reading"],
    grid: Float[np.ndarray, " knot"],
    wanted: Float[np.ndarray, " angle"],
) -> tuple[Float[np.ndarray, " value"], Float[np.ndarray, " value"], Float[np.ndarray, " value"]]:
    """Return angles, values and variances between two gaps; one cubic across a gap would bend both sides."""
    nothing = np.empty(0)
    # A knot only where a reading stands before the next one: then every coefficient has its reading.
    starts = grid[np.unique(np.searchsorted(grid[1:], angle, side="right"))]
    inner = starts[(starts > angle[0]) & (starts < angle[-1])]
    knots = np.concatenate([np.repeat(angle[0], 4), inner, np.repeat(angle[-1], 4)])
    angles = np.intersect1d(starts[(starts >= angle[0]) & (starts < angle[-1])], wanted)
    if angle.size < inner.size + 4 or angles.size == 0:
        return nothing, nothing, nothing
    try:
        spline = make_lsq_spline(angle, values, knots, k=3)
        return angles, np.asarray(spline(angles)), _variance(angle, knots, angles)
    except np.linalg.LinAlgError:  # few readings, and where one basis function is all but 0
        return nothing, nothing, nothing


def _variance(
    angle: Float[np.ndarray, " reading"], knots: Float[np.ndarray, " knot"], angles: Float[np.ndarray, " angle"]
) -> Float[np.ndarray, " angle"]:
    """Return the variance of the spline over that of a reading: the diagonal of A·(BᵀB)⁻¹·Aᵀ.

    B holds the basis functions at the readings, A at the angles. Wrapped readings are copies, but no value feels both a
    reading and its copy.
    """
    basis = BSpline.design_matrix(angle, knots, 3)
    wanted = BSpline.design_matrix(angles, knots, 3).toarray()
    gram = (basis.T @ basis).tocsr()
    size = gram.shape[0]
    bands = np.zeros((4, size))
    for offset in range(4):
        bands[3 - offset, offset:] = gram.diagonal(offset)
    return np.asarray(np.einsum("ij,ji->i", wanted, solveh_banded(bands, wanted.T)))
