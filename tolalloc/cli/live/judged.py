"""What random units say of a design: the yield of all limits, and of every limited output quantiles and a histogram."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.difference import limited_shares
from tolalloc.allocation.space.requirement import Requirement
from tolalloc.capability.indices import quantile_interval
from tolalloc.capability.monte_carlo import proportion
from tolalloc.reading.units import unit_of
from tolalloc.reports.charts import numbers, shares
from tolalloc.reports.figure import BINS
from tolalloc.reports.wording import short
from tolalloc.study.prepared import Prepared


def judged(prepared: Prepared, outputs: tuple[str, ...], values: Float[np.ndarray, "unit output"]) -> dict[str, Any]:
    """Return the yield of all limits, and of each output its quantiles, its share and its histogram.

    Parameters
    ----------
    prepared
        The study.
    outputs
        Names of the outputs, in the order of the values.
    values
        Outputs of every unit, NaN where a unit has none [as the names state].
    """
    read = [(own, values[:, outputs.index(own.output)]) for own in prepared.requirements]
    kept = np.all([own.limits.kept_by(found) for own, found in read], axis=0)
    inside = proportion(len(values), int(np.count_nonzero(~kept)))
    limited = prepared.model.own_limits
    return {
        "units": len(values),
        "lost": int(np.count_nonzero(np.isnan(values).any(axis=1))),
        "yield": [inside.estimate, inside.low, inside.high],
        "target": prepared.target,
        # share of units that do not work at all, for every limit that the model has of its own
        "broken": {
            own.output: float((~own.limits.kept_by(found)).mean()) for own, found in read if own.output in limited
        },
        "outputs": [_output(own, found, kept) for own, found in read],
    }


def _output(
    requirement: Requirement, values: Float[np.ndarray, " unit"], kept: Bool[np.ndarray, " unit"]
) -> dict[str, Any]:
    limits, known = requirement.limits, values[np.isfinite(values)]
    inside = proportion(len(values), int(np.count_nonzero(~limits.kept_by(values))))
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    order = np.argsort(np.where(np.isfinite(values), values, -np.inf))
    return {
        "name": short(requirement.output),
        "output": requirement.output,
        "unit": unit_of(requirement.output),
        "lower": limits.lower,
        "upper": limits.upper,
        "quantiles": [_quantile(known, share) for share in limited_shares(requirement)],
        "inside": [inside.estimate, inside.low, inside.high],
        "histogram": shares(known, low, (high - low) / BINS or 1.0),
        "worst": int(order[-1]) + 1,
        "median": int(order[len(order) // 2]) + 1,
        "reject": int(np.flatnonzero(~kept)[0]) + 1 if not kept.all() else None,
    }


def _quantile(values: Float[np.ndarray, " known"], share: float) -> dict[str, Any]:
    """Return a quantile with its 95 % interval, whose ends are unknown where the units are too few."""
    if not values.size:
        return {"share": share, "value": None, "interval": [None, None]}
    found = quantile_interval(values, share)
    return {"share": share, "value": found.estimate, "interval": numbers([found.low, found.high])}
