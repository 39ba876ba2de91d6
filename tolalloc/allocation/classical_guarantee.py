"""What must be shown of a limited output without a sample: its worst case, or the classical stack."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tolalloc.allocation.level import side_name, side_scale
from tolalloc.allocation.local_model import Side, worst_case_stack
from tolalloc.allocation.program.problem import Stack
from tolalloc.allocation.trial import OutputTrial
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import CONFIDENCE

_MISSED = 0.005
"""Share of a worst case by which an ascent may have missed it [-]."""


@dataclass(frozen=True, kw_only=True)
class WorstCase:
    """No unit inside its zones lies beyond a limit, as far as an ascent from many starts can tell."""

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return "worst case found"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Accept every number of units; none is asked."""

    def judge(self, trial: OutputTrial, limits: Limits) -> tuple[Side, ...]:
        """Return every limited side."""
        return tuple(self._side(trial, sign, limit) for sign, limit in limits.turned)

    def _side(self, trial: OutputTrial, sign: Literal[1, -1], limit: float) -> Side:
        value, gradient = trial.worst(sign)
        stack = worst_case_stack(
            side_name(trial, sign), trial.design, sign * (value - limit), sign * gradient, trial.groups
        )
        return Side(
            sign=sign,
            limit=limit,
            value=value,
            standard_error=_MISSED * abs(value),
            scale=side_scale(trial, limit),
            stack=stack,
        )


@dataclass(frozen=True, kw_only=True)
class RootSumSquare:
    """Nominal value and root-sum-square of what every source adds at its limit, to first order, lie inside the limits.

    Notes
    -----
    The classical stack: √Σ(Dᵢtᵢ)² with the derivatives Dᵢ at nominal and tᵢ half the zone. It takes sizes and
    positions, needs no sample and knows neither distributions nor what the model bends, so the report shows the yield
    of fresh units beside it.
    """

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return "root-sum-square"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Accept every number of units; none is asked."""

    def judge(self, trial: OutputTrial, limits: Limits) -> tuple[Side, ...]:
        """Return every limited side.

        Raises
        ------
        InputError
            A source that is neither a size nor a position.
        """
        value, locked, added, by_setting = trial.linear()
        spread = float(np.hypot(locked, np.linalg.norm(added)))
        scales, settings = trial.design[: trial.groups], trial.design[trial.groups :]
        return tuple(
            Side(
                sign=sign,
                limit=limit,
                value=value + sign * spread,
                standard_error=0.0,
                scale=side_scale(trial, limit),
                stack=Stack(
                    name=side_name(trial, sign),
                    worst_case=np.zeros(trial.groups),
                    root_sum_square=added / scales,
                    # Locked zones take their part of the quadrature: the free ones may fill what it leaves.
                    budget=_left(sign * (limit - value), locked) + float(sign * by_setting @ settings),
                    slopes=sign * by_setting,
                ),
            )
            for sign, limit in limits.turned
        )


def _left(distance: float, locked: float) -> float:
    """Return what locked zones leave of the distance to a limit, less than nothing beyond it [unit of the output]."""
    return float(np.sqrt(max(distance**2 - locked**2, 0.0))) if distance > locked else distance - locked
