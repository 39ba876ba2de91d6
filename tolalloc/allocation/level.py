"""What is compared with a limit, and how far it may be off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.trial import OutputTrial
from tolalloc.capability.near_limit import SolvedUnits


@dataclass(frozen=True, kw_only=True)
class Level:
    """What units say of one limited side."""

    sign: Literal[1, -1]  # 1 for an upper limit, −1 for a lower one [-]
    limit: float  # The limit [unit of the output]
    value: float  # What is compared with the limit, infinite where too few units answered [unit of the output]
    standard_error: float  # Standard error of the value [unit of the output]

    @property
    def excess(self) -> float:
        """How far the value lies beyond the limit, negative inside [unit of the output]."""
        return self.sign * (self.value - self.limit)


def order_statistic(
    values: Float[np.ndarray, " solved"], units: SolvedUnits, sign: Literal[1, -1], limit: float, beyond: float
) -> Level:
    """Return the outermost value that is no further beyond a limit; beyond every limit where nothing is shown."""
    turned = np.where(np.isfinite(values), sign * values, np.inf)
    order = np.argsort(turned, kind="stable")
    inside = max(int(np.count_nonzero(turned - sign * limit <= beyond)), 1)
    return Level(
        sign=sign,
        limit=limit,
        value=sign * (float(turned[order[inside - 1]]) if np.isfinite(beyond) else np.inf),
        standard_error=_order_statistic_error(turned[order], units.stand_for[order], inside),
    )


def _order_statistic_error(
    ordered: Float[np.ndarray, " unit"], stand_for: Float[np.ndarray, " unit"], rank: int
) -> float:
    """Return the standard error of the value at a rank, counted from 1 [unit of the output].

    Exact bootstrap: the rank's value of a resample is that of unit i with a probability of the incomplete beta function
    (Maritz & Jarrett 1978). Where units stand for different numbers of others, it is that of as many equal units as
    have the variance of those above the rank.
    """
    from scipy.stats import beta

    above = stand_for[rank:] if rank < ordered.size else stand_for[-1:]
    equal = stand_for.sum() * above.sum() / (above @ above)
    places = np.append(0.0, np.cumsum(stand_for)) / stand_for.sum()
    at = equal * places[rank]
    weights, finite = np.diff(beta.cdf(places, at, equal - at + 1)), np.isfinite(ordered)
    weights, ordered = weights[finite], ordered[finite]
    return float(np.sqrt(weights @ (ordered - weights @ ordered) ** 2))


def reached(level: Level, values: Float[np.ndarray, " good"]) -> float:
    """Return the turned value of a level, the outermost unit's where it is infinite [unit of the output]."""
    return min(level.sign * level.value, float((level.sign * values).max()))


def side_scale(trial: OutputTrial, limit: float) -> float:
    """Return what an excess is compared with; a limit of zero says nothing of its size [unit of the output]."""
    return max(abs(limit), float(trial.values.std())) or 1.0


def side_name(trial: OutputTrial, sign: int) -> str:
    """Return what the limited side of an output is called."""
    return f"{trial.output}, {'upper' if sign > 0 else 'lower'} limit"
