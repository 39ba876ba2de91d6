"""Cost models as formulas of a spreadsheet."""

from __future__ import annotations

from functools import singledispatch

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.model import Combined, Exponential, Reciprocal, ReciprocalPower, SumOfCosts, Weighted
from tolalloc.allocation.cost.points import Spline, Tabulated


@singledispatch
def cost_formula(model: object, zone: str) -> str:
    """Return a cost as a formula of a spreadsheet, without the equals sign.

    Parameters
    ----------
    model
        The cost model.
    zone
        Expression of the zone in the unit of the model.
    """
    raise TypeError(f"{type(model).__name__} has no formula of {zone}")


@cost_formula.register
def _(model: Reciprocal, zone: str) -> str:
    return f"({number(model.fixed)}+{number(model.factor)}/{zone})"


@cost_formula.register
def _(model: ReciprocalPower, zone: str) -> str:
    return f"({number(model.fixed)}+{number(model.factor)}/{zone}^{number(model.exponent)})"


@cost_formula.register
def _(model: Exponential, zone: str) -> str:
    return f"({number(model.fixed)}+{number(model.factor)}*EXP(-{zone}/{number(model.scale)}))"


@cost_formula.register
def _(model: Combined, zone: str) -> str:
    falling = f"EXP(-{zone}/{number(model.scale)})/{zone}^{number(model.exponent)}"
    return f"({number(model.fixed)}+{number(model.factor)}*{falling})"


@cost_formula.register
def _(model: SumOfCosts, zone: str) -> str:
    parts = [cost_formula(own.rescaled(ratio), zone) for own, ratio in zip(model.models, model.ratios, strict=True)]
    return f"({'+'.join(parts)})"


@cost_formula.register
def _(model: Weighted, zone: str) -> str:
    return f"({number(model.weight)}*{cost_formula(model.model, zone)})"


@cost_formula.register
def _(model: Tabulated, zone: str) -> str:
    zones, slopes = np.array(model.points.zones), np.diff(model.points.costs) / np.diff(model.points.zones)
    return _piecewise(zone, model.points.costs[0], slopes[0], zones[:-1], np.diff(slopes, prepend=slopes[0])[:, None])


@cost_formula.register
def _(model: Spline, zone: str) -> str:
    zones, costs = np.array(model.points.zones), np.array(model.points.costs)
    slopes, lengths = model.slope(zones), np.diff(zones)
    secants, ends = np.diff(costs) / lengths, slopes[:-1] + slopes[1:]
    # Square and cubic coefficients of every piece, none before the first point and behind the last.
    square = np.concatenate([[0.0], (3 * secants - slopes[:-1] - ends) / lengths, [0.0]])
    cubic = np.concatenate([[0.0], (ends - 2 * secants) / lengths**2, [0.0]])
    bent = np.diff(square) - 3 * cubic[:-1] * np.concatenate([[0.0], lengths])
    return _piecewise(zone, costs[0], slopes[0], zones, np.stack([np.zeros(zones.size), bent, np.diff(cubic)], axis=1))


def _piecewise(
    zone: str,
    cost: float,
    slope: float,
    zones: Float[np.ndarray, " point"],
    changes: Float[np.ndarray, "point power"],
) -> str:
    """Return a line that gets terms of first, second, … power behind every point: no IF in an IF, however many."""
    terms = [
        f"{number(change)}*MAX({zone}-{number(point)},0)^{power}"
        for point, own in zip(zones, changes, strict=True)
        for power, change in enumerate(own, start=1)
        if change
    ]
    return f"({'+'.join([number(cost), f'{number(slope)}*({zone}-{number(zones[0])})', *terms])})"


def number(value: float) -> str:
    """Return a number with all its digits, as a workbook stores it whatever the language of its reader."""
    return repr(float(value)).upper()
