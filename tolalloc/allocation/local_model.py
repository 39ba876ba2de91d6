"""How a verified design stands against one limit, and the convex model of that limit around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.problem import Stack


@dataclass(frozen=True, kw_only=True)
class Side:
    """One limited side of a requirement at a verified design.

    Parameters
    ----------
    sign
        1 for an upper limit, −1 for a lower one [-].
    limit
        The limit [unit of the output].
    value
        What the guarantee compares with the limit [unit of the output].
    doubt
        Standard error of the value, the margin that the next step keeps [unit of the output].
    scale
        What makes requirements comparable: the limit, or the deviation of the units where that is larger
        [unit of the output].
    stack
        Convex model around the design; its load less its budget is the predicted `excess`.
    """

    sign: int
    limit: float
    value: float
    doubt: float
    scale: float
    stack: Stack

    @property
    def excess(self) -> float:
        """How far the value lies beyond the limit, negative inside [unit of the output]."""
        return self.sign * (self.value - self.limit)

    @property
    def relative_excess(self) -> float:
        """The same over the scale [-]."""
        return self.excess / self.scale

    def predicted(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the excess that the model predicts, negative inside the limit [unit of the output]."""
        return np.asarray(self.stack.load(designs[..., :-2], designs[..., -2:]) - self.stack.budget)


def root_sum_square_stack(
    name: str, design: Float[np.ndarray, " variable"], excess: float, gradient: Float[np.ndarray, " variable"]
) -> Stack:
    """Return the model of a statistical requirement: slopes·clearances + ‖weights∘scales‖₂ ≤ budget.

    Parameters
    ----------
    name
        What the stack keeps.
    design
        Scales [-] and clearances [µm].
    excess
        How far the design lies beyond the limit [unit of the output].
    gradient
        Derivative of the excess by every variable [unit of the output, per µm for the clearances].

    Notes
    -----
    Theory page, equation (25). The norm is how independent random errors combine, and it is homogeneous, so its value
    is gradient·scales. A group whose larger zone relieves the limit, by noise or because its errors open the contact,
    gets weight zero: the model never rewards a larger error.
    """
    by_scale = np.maximum(gradient[:-2], 0.0)
    spread = float(by_scale @ design[:-2])
    return Stack(
        name=name,
        worst_case=np.zeros(by_scale.size),
        root_sum_square=np.sqrt(by_scale * spread / design[:-2]),
        budget=float(spread + gradient[-2:] @ design[-2:] - excess),
        slopes=gradient[-2:].copy(),
    )


def worst_case_stack(
    name: str, design: Float[np.ndarray, " variable"], excess: float, gradient: Float[np.ndarray, " variable"]
) -> Stack:
    """Return the model of a worst case, weights·scales + slopes·clearances ≤ budget, from the same arguments."""
    by_scale = np.maximum(gradient[:-2], 0.0)
    return Stack(
        name=name,
        worst_case=by_scale,
        root_sum_square=np.zeros(by_scale.size),
        budget=float(by_scale @ design[:-2] + gradient[-2:] @ design[-2:] - excess),
        slopes=gradient[-2:].copy(),
    )
