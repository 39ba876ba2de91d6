"""The cost of one process once its zone has a price: its convex expression, and its minimum bounded from below."""

from __future__ import annotations

from math import sqrt

import cvxpy as cp
import numpy as np

from tolalloc.allocation.cost.closed_forms import Reciprocal
from tolalloc.allocation.cost.model import Process
from tolalloc.exceptions import InputError

_FRACTIONS = np.linspace(0.0, 1.0, 33)
_ROUNDS = 4
"""Each narrows a zone to 1/32 of its range, so four leave a ratio of 1 + 1e-5 at most [-]."""


def convex_cost(place: str, process: Process, zone: cp.Expression) -> cp.Expression:
    """Return the cost of a process as a convex expression [cost units].

    Parameters
    ----------
    place
        Where the process stands, for the message.
    process
        The process.
    zone
        Zone in the unit of the process.

    Raises
    ------
    InputError
        The cost is not convex.
    """
    expression = process.cost.expression(zone)
    if expression is None:
        raise InputError.at(place, f"process {process.name}", "a cost that is not convex", "a convex cost")
    return expression


def least_priced_cost(process: Process, linear: float, square: float) -> tuple[float, float]:
    """Return a lower bound on cost + linear·zone + square·zone² over the range of a process, and the zone there.

    Parameters
    ----------
    process
        The process, whose cost is convex.
    linear
        Price of its zone [cost units per unit of the zone].
    square
        Price of its zone squared, 0 or above [cost units per unit² of the zone].

    Notes
    -----
    A convex function lies above its tangents at any two zones, so the crossing of the two bounds it from below
    wherever they stand; that they stand on both sides of the minimum and close together only makes the bound tight.
    For b/t + p·t the minimum is known: it is reached at √(b/p), or at the nearer end of the range.
    """
    if isinstance(process.cost, Reciprocal) and square == 0:
        return _least_reciprocal(process, process.cost, linear)
    low, high = process.minimum, process.maximum
    for _ in range(_ROUNDS):
        zones = np.minimum(low * (high / low) ** _FRACTIONS, high)
        rising = process.cost.slope(zones) + linear + 2 * square * zones >= 0
        after = int(np.argmax(rising)) if rising[-1] else zones.size
        low, high = float(zones[max(after - 1, 0)]), float(zones[min(after, zones.size - 1)])
        if low == high:
            break
    ends = np.array([low, high])
    values = process.total(ends) + linear * ends + square * ends**2
    if low == high:
        return float(values[0]), low
    slopes = process.cost.slope(ends) + linear + 2 * square * ends
    step = float(np.clip((values[1] - values[0] - slopes[1] * (high - low)) / (slopes[0] - slopes[1]), 0, high - low))
    return float(values[0] + slopes[0] * step), low + step


def _least_reciprocal(process: Process, cost: Reciprocal, price: float) -> tuple[float, float]:
    """Return the least of a reciprocal cost with a price on its zone, and the zone there."""
    best = sqrt(cost.factor / price) if price > 0 else process.maximum
    zone = min(max(best, process.minimum), process.maximum)
    return cost.fixed + process.change + cost.factor / zone + price * zone, zone
