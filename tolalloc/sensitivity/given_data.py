"""PAWN and delta of one measure from units that exist already, in SALib's definitions and for a whole sample at once.

SALib asks a library for every density and every distance of two distributions anew, which took a third of a ranking's
processor time. Here the units of all classes stand beside each other; the numbers are SALib's but for rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from tolalloc.sensitivity.effort import CLASSES

_CURVE_POINTS = 100
"""Points at which delta compares two densities, SALib's number."""
_MOST_CLASSES = 48
"""Classes of delta at most, SALib's number [-]."""
_POINTS_AT_ONCE = 10
"""Points whose kernels are in memory at a time, few enough for the processor's own [-]."""
_LEAST_EXPONENT = -700.0
"""Exponent from which a kernel counts as that small: numbers near the smallest cost twenty times as much [-]."""


def pawn_index(column: Float[np.ndarray, " unit"], y: Float[np.ndarray, " unit"]) -> float:
    """Return the median over classes of equal size of the Kolmogorov–Smirnov distance to the whole sample [-].

    The unit with the largest value of the measure is in no class, as in SALib.
    """
    ends = np.quantile(column, np.arange(0, 1 + 1 / CLASSES, 1 / CLASSES))
    order = np.argsort(y)
    column, last = column[order], np.searchsorted(y[order], y[order], side="right")
    found = []
    for low, high in pairwise(ends[: CLASSES + 1]):
        count = np.cumsum((column >= low) & (column < high))
        if count[-1]:
            apart = count[last - 1] / count[-1] - last / y.size
            found.append(max(apart.max(), -apart.min()))
    return float(np.median(found))


@dataclass(frozen=True, kw_only=True)
class OutputDensity:
    """The density of an output over all units, which delta compares that of every class with."""

    y: Float[np.ndarray, " unit"]  # The output [output]
    grid: Float[np.ndarray, " point"]  # Where densities are compared [output]
    density: Float[np.ndarray, "point 1"]  # The density there [1/output]

    @classmethod
    def of(cls, y: Float[np.ndarray, " unit"]) -> OutputDensity:
        """Return the density of the output of units."""
        grid = np.linspace(y.min(), y.max(), _CURVE_POINTS)
        return cls(y=y, grid=grid, density=_densities(y, np.array([0, y.size]), grid))


def delta_index(column: Float[np.ndarray, " unit"], output: OutputDensity) -> float:
    """Return half the mean distance of the density in classes of a measure from that of all units, with its bias [-].

    A class whose units are all alike has no density and adds nothing.

    References
    ----------
    Plischke, Borgonovo & Smith 2013, eq. (26).
    """
    units = output.y.size
    bounds = _class_bounds(units)
    of_classes = _densities(output.y[np.argsort(column, kind="stable")], bounds, output.grid)
    distance = np.trapezoid(np.abs(output.density - of_classes), output.grid, axis=0)
    return float(np.nansum(np.diff(bounds) / (2 * units) * distance))


def _class_bounds(units: int) -> Int[np.ndarray, " bound"]:
    """Return where classes of equal size begin among units in order, and where the last one ends [-]."""
    exponent = 2.0 / (7.0 + np.tanh((1500.0 - units) / 500.0))
    return np.linspace(0, units, min(int(np.ceil(units**exponent)), _MOST_CLASSES) + 1).astype(int)


def _densities(
    y: Float[np.ndarray, " unit"], bounds: Int[np.ndarray, " bound"], grid: Float[np.ndarray, " point"]
) -> Float[np.ndarray, "point class"]:
    """Return the kernel densities of classes, units in their order, by Silverman's rule; NaN where all are alike."""
    starts, counts = bounds[:-1], np.diff(bounds)
    means = np.add.reduceat(y, starts) / counts
    squares = np.add.reduceat((y - np.repeat(means, counts)) ** 2, starts)
    alike = np.maximum.reduceat(y, starts) == np.minimum.reduceat(y, starts)
    width = np.sqrt(squares / np.maximum(counts - 1, 1)) * (counts * 0.75) ** -0.2
    width[alike] = np.nan
    per_width, sums = np.repeat(np.sqrt(0.5) / width, counts), np.empty((grid.size, counts.size))
    for first in range(0, grid.size, _POINTS_AT_ONCE):
        points = slice(first, first + _POINTS_AT_ONCE)
        away = (grid[points, np.newaxis] - y) * per_width
        away *= -away
        np.maximum(away, _LEAST_EXPONENT, out=away)
        np.exp(away, out=away)
        sums[points] = np.add.reduceat(away, starts, axis=1)
    return np.asarray(sums / (counts * np.sqrt(2 * np.pi) * width))
