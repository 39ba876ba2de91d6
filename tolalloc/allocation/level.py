"""What is compared with a limit, and how far it may be off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.limited_sample import LimitedSample
from tolalloc.allocation.trial import OutputTrial
from tolalloc.capability.linear_function import LinearLaw
from tolalloc.capability.near_limit import largest_first

_SURROUNDED, _SURROUNDING = 4, 4000
"""Of so many times what lies beyond a rank, and so many more values, the rank of a resample is one, surely [-]."""
_ACCURACY = 1e-6
"""Error of a quantile of a linear law over half the width of the law, tested on sums with closed forms [-]."""


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


def order_statistic(sample: LimitedSample, sign: Literal[1, -1], limit: float, beyond: float) -> Level:
    """Return the outermost value that is no further beyond a limit; beyond every limit where nothing is shown."""
    turned = np.where(np.isfinite(sample.values), sign * sample.values, np.inf)
    further = min(int(np.count_nonzero(turned - sign * limit > beyond)), turned.size - 1)
    outermost = largest_first(turned, _SURROUNDED * further + _SURROUNDING)
    return Level(
        sign=sign,
        limit=limit,
        value=sign * (float(turned[outermost[further]]) if np.isfinite(beyond) else np.inf),
        standard_error=_order_statistic_error(
            turned[outermost], sample.units.stand_for[outermost], further, float(sample.units.stand_for.sum())
        ),
    )


def levels_of_law(sample: LimitedSample, law: LinearLaw, beyond: float) -> tuple[Level, ...]:
    """Return what a law says of every limited side if such a share of it may lie beyond the limits [-]."""
    excess = law.excess(sample.limits, beyond)
    error = _ACCURACY * law.half_width
    return tuple(
        Level(sign=sign, limit=limit, value=limit + sign * excess, standard_error=error)
        for sign, limit in sample.limits.turned
    )


def _order_statistic_error(
    outermost: Float[np.ndarray, " unit"], stand_for: Float[np.ndarray, " unit"], further: int, drawn: float
) -> float:
    """Return the standard error of the value that so many lie further beyond than [unit of the output].

    Parameters
    ----------
    outermost
        The outermost values, the furthest first [unit of the output].
    stand_for
        How many units each of them stands for [-].
    further
        How many of them lie further beyond [-].
    drawn
        What all units stand for [-].

    Notes
    -----
    Exact bootstrap: the rank's value of a resample is that of unit i with a probability of the incomplete beta function
    (Maritz & Jarrett 1978). Where units stand for different numbers of others, it is that of as many equal units as
    have the variance of those beyond the rank.
    """
    from scipy.stats import beta

    above = stand_for[:further] if further else stand_for[:1]
    equal = drawn * above.sum() / (above @ above)
    places = np.append(0.0, np.cumsum(stand_for)) / drawn
    at = equal * places[further]
    weights, finite = np.diff(beta.cdf(places, at + 1, equal - at)), np.isfinite(outermost)
    weights, outermost = weights[finite], outermost[finite]
    return float(np.sqrt(weights @ (outermost - weights @ outermost) ** 2))


def reached(level: Level, values: Float[np.ndarray, " good"]) -> float:
    """Return the turned value of a level, the outermost unit's where it is infinite [unit of the output]."""
    return level.sign * level.value if np.isfinite(level.value) else float((level.sign * values).max())


def side_scale(trial: OutputTrial, limit: float) -> float:
    """Return what an excess is compared with; a limit of zero says nothing of its size [unit of the output]."""
    return max(abs(limit), float(trial.values.std())) or 1.0


def side_name(trial: OutputTrial, sign: int) -> str:
    """Return what the limited side of an output is called."""
    return f"{trial.output}, {'upper' if sign > 0 else 'lower'} limit"
