"""One limited side of an output: what is compared with the limit, how far that may be off, and its convex model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.output_sample import LimitedSample, OutputSample
from tolalloc.allocation.space.problem import Stack
from tolalloc.capability.linear_function import LinearLaw
from tolalloc.capability.near_limit import largest_first


@dataclass(frozen=True, kw_only=True)
class OneSidedConstraint:
    """One limited side of a requirement at a verified design."""

    sign: int  # 1 for an upper limit, −1 for a lower one [-]
    limit: float  # The limit [unit of the output]
    value: float  # What the guarantee compares with the limit [unit of the output]
    standard_error: float  # Standard error of the value, the margin that the next step keeps [unit of the output]
    # What makes requirements comparable: the limit, or the deviation of the units where that is larger [unit of the
    # output]
    scale: float
    stack: Stack  # Convex model around the design; its load less its budget is the predicted `excess`
    # Derivative of the excess by every variable, by batches of units that tell its error; none where it has no error
    batches: Float[np.ndarray, "batch variable"] | None = None
    law: LinearLaw | None = None  # Law of the output, where it is linear: the model's derivatives are its own

    @property
    def excess(self) -> float:
        """How far the value lies beyond the limit, negative inside [unit of the output]."""
        return self.sign * (self.value - self.limit)

    @property
    def relative_excess(self) -> float:
        """The same over the scale [-]."""
        return self.excess / self.scale

    def load_of_zones(self, design: Float[np.ndarray, " variable"]) -> float:
        """Return what the zones alone take of the model's budget [unit of the output]."""
        groups = self.stack.worst_case.size
        return float(self.stack.load(design[:groups], np.zeros(design.size - groups)))

    def predicted(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the excess that the model predicts, negative inside the limit [unit of the output]."""
        groups = self.stack.worst_case.size
        return np.asarray(self.stack.load(designs[..., :groups], designs[..., groups:]) - self.stack.budget)

    def predicted_value(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the value that the model predicts [unit of the output]."""
        return self.limit + self.sign * self.predicted(designs)


def root_sum_square_stack(
    name: str,
    design: Float[np.ndarray, " variable"],
    excess: float,
    gradient: Float[np.ndarray, " variable"],
    groups: int,
) -> Stack:
    """Return the model of a statistical requirement: slopes·settings + ‖weights∘scales‖₂ ≤ budget.

    Parameters
    ----------
    name
        What the stack keeps.
    design
        Scales [-] and settings.
    excess
        How far the design lies beyond the limit [unit of the output].
    gradient
        Derivative of the excess by every variable [unit of the output, per unit of a setting].
    groups
        Number of scales; what follows them are the settings [-].

    Notes
    -----
    Theory page, equation (25). The norm is how independent random errors combine, and it is homogeneous, so its value
    is gradient·scales. A group whose larger zone relieves the limit, by noise or because its errors open the contact,
    gets weight zero: the model never rewards a larger error.
    """
    by_scale = np.maximum(gradient[:groups], 0.0)
    spread = float(by_scale @ design[:groups])
    return Stack(
        name=name,
        worst_case=np.zeros(by_scale.size),
        root_sum_square=np.sqrt(by_scale * spread / design[:groups]),
        budget=float(spread + gradient[groups:] @ design[groups:] - excess),
        slopes=gradient[groups:].copy(),
    )


def worst_case_stack(
    name: str,
    design: Float[np.ndarray, " variable"],
    excess: float,
    gradient: Float[np.ndarray, " variable"],
    groups: int,
) -> Stack:
    """Return the model of a worst case, weights·scales + slopes·settings ≤ budget, from the same arguments."""
    by_scale = np.maximum(gradient[:groups], 0.0)
    return Stack(
        name=name,
        worst_case=by_scale,
        root_sum_square=np.zeros(by_scale.size),
        budget=float(by_scale @ design[:groups] + gradient[groups:] @ design[groups:] - excess),
        slopes=gradient[groups:].copy(),
    )


_SURROUNDED, _SURROUNDING = 4, 4000
"""Of so many times what lies beyond a rank, and so many more values, the rank of a resample is one, surely [-]."""
_ACCURACY = 1e-6
"""Error of a quantile of a linear law over half the width of the law, tested on sums with closed forms [-]."""


@dataclass(frozen=True, kw_only=True)
class QuantileBound:
    """Confidence bound on the quantile that a guarantee limits, of one limited side."""

    sign: Literal[1, -1]  # 1 for an upper limit, −1 for a lower one [-]
    limit: float  # The limit [unit of the output]
    value: float  # What is compared with the limit, infinite where too few units answered [unit of the output]
    standard_error: float  # Standard error of the value [unit of the output]

    @property
    def excess(self) -> float:
        """How far the value lies beyond the limit, negative inside [unit of the output]."""
        return self.sign * (self.value - self.limit)

    def turned(self, values: Float[np.ndarray, " good"]) -> float:
        """Return sign·value, the outermost unit's where the bound is infinite [unit of the output]."""
        return self.sign * self.value if np.isfinite(self.value) else float((self.sign * values).max())


def order_statistic(sample: LimitedSample, sign: Literal[1, -1], limit: float, beyond: float) -> QuantileBound:
    """Return the outermost value that is no further beyond a limit; beyond every limit where nothing is shown."""
    turned = np.where(np.isfinite(sample.values), sign * sample.values, np.inf)
    further = min(int(np.count_nonzero(turned - sign * limit > beyond)), turned.size - 1)
    outermost = largest_first(turned, _SURROUNDED * further + _SURROUNDING)
    return QuantileBound(
        sign=sign,
        limit=limit,
        value=sign * (float(turned[outermost[further]]) if np.isfinite(beyond) else np.inf),
        standard_error=_order_statistic_error(
            turned[outermost], sample.units.stand_for[outermost], further, float(sample.units.stand_for.sum())
        ),
    )


def bounds_of_law(sample: LimitedSample, law: LinearLaw, beyond: float) -> tuple[QuantileBound, ...]:
    """Return what a law says of every limited side if such a share of it may lie beyond the limits [-]."""
    excess = law.excess(sample.limits, beyond)
    error = _ACCURACY * law.half_width
    return tuple(
        QuantileBound(sign=sign, limit=limit, value=limit + sign * excess, standard_error=error)
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


def scale_of(sample: OutputSample, limit: float) -> float:
    """Return what an excess is compared with; a limit of zero says nothing of its size [unit of the output]."""
    return max(abs(limit), float(sample.values.std())) or 1.0


def name_of(sample: OutputSample, sign: int) -> str:
    """Return what the limited side of an output is called."""
    return f"{sample.output}, {'upper' if sign > 0 else 'lower'} limit"
