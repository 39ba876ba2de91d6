"""How a verified design stands against one limit, and the convex model of that limit around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.problem import Stack
from tolalloc.capability.linear_function import LinearLaw


@dataclass(frozen=True, kw_only=True)
class Side:
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
