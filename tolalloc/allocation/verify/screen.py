"""Which random units of a design are near a limit, by a regression through the units of its search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.requirement import AtYield, Requirement
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.sensitivity.surrogate.regression import QuadraticForm, fit_quadratic_form

_LEARNT = 0.8
"""Share of the units that the regression learns from; the others tell how far it is off [-]."""
_WORST = 0.1
"""Share of those others, with the largest excess, that tell what units at a limit are predicted [-]."""
_ERRORS = 2.0
"""Standard deviations below that from which a unit is near [-]."""
_MOST_NEAR = 0.35
"""Share of near units beyond which nothing is saved by telling them from far ones [-]."""
_FEWEST = 10
"""Units that such a line is drawn through, at least [-]."""
_STRENGTH = 1000.0
"""Of the ridge; cross-validation chooses it for the peak-to-peak of an RV-20E from 1,152 and from 6,144 units [-]."""


@dataclass(frozen=True, kw_only=True)
class Screen:
    """Calls units near or far.

    Notes
    -----
    Nothing depends on its being right (`tolalloc.capability.near_limit`): where it is wrong more units are solved.
    """

    excess: QuadraticForm  # Predicted excess over every limited side [unit of the output]
    # Least predicted excess of a near unit [unit of the output]
    least: Float[np.ndarray, " side"]
    share: float  # Units that are near [-]

    @classmethod
    def of(cls, design: VerifiedDesign) -> Screen | None:
        """Return the screen of a design, none where a requirement is no yield, or where it would tell too little."""
        requirements = tuple(check.requirement for check in design.checks)
        if not all(isinstance(own.guarantee, AtYield) for own in requirements):
            return None
        excess = np.concatenate([_excesses(own, design.outputs) for own in requirements], axis=1)
        known = np.isfinite(excess).all(axis=1)
        learnt = int(_LEARNT * np.count_nonzero(known))
        if np.count_nonzero(known) - learnt < _FEWEST:
            return None
        x, excess = design.sample.redraw()[known], excess[known]
        predicted = fit_quadratic_form(x[:learnt], excess[:learnt], _STRENGTH)
        held_out = zip(predicted(x[learnt:]).T, excess[learnt:].T, strict=True)
        least = np.array([_least_of_near(*own) for own in held_out])
        share = float((predicted(x) >= least).any(axis=1).mean())
        return cls(excess=predicted, least=least, share=share) if share <= _MOST_NEAR else None

    def __call__(self, x: Float[np.ndarray, "unit column"]) -> Bool[np.ndarray, " unit"]:
        """Return which units are near a limit."""
        return np.asarray((self.excess(x) >= self.least).any(axis=1))


def _excesses(
    requirement: Requirement, outputs: Mapping[str, Float[np.ndarray, " unit"]]
) -> Float[np.ndarray, "unit side"]:
    """Return how far every unit lies beyond the limited sides, not a number where it has no answer."""
    values = requirement.read(outputs)
    return np.stack([sign * (values - limit) for sign, limit in requirement.limits.turned], axis=1)


def _least_of_near(predicted: Float[np.ndarray, " held_out"], excess: Float[np.ndarray, " held_out"]) -> float:
    """Return the predicted excess from which a unit is near [unit of the output].

    A ridge predicts the worst units too good, the more so the worse they are; a line through them reaches the limit.
    """
    worst = np.argsort(excess)[-max(int(_WORST * excess.size), _FEWEST) :]
    if np.ptp(excess[worst]) == 0:
        return float(predicted[worst].min())
    slope, at_limit = np.polyfit(excess[worst], predicted[worst], 1)
    errors = predicted[worst] - at_limit - slope * excess[worst]
    return float(at_limit - _ERRORS * errors.std(ddof=2))
