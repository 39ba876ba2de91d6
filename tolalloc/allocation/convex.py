"""The convex program: least cost for a limit on the modelled quantile, with a bound that needs no solver."""

from __future__ import annotations

from functools import cached_property

import cvxpy as cp
import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.quantile import LocalQuantile


class ConvexAllocation:
    """The program for one design space, compiled once and solved for many models and limits.

    Parameters
    ----------
    space
        Variables, their bounds and costs.

    Notes
    -----
    Theory page, equation (26). Scales and clearances are of order one; cost is divided by its value at scale 1 and
    the requirement by its limit.
    """

    def __init__(self, space: DesignSpace) -> None:
        self.space = space
        groups = len(space.groups)
        self._scales, self._clearances = cp.Variable(groups, pos=True), cp.Variable(2)
        self._weights = cp.Parameter(groups, nonneg=True)
        self._slopes, self._room = cp.Parameter(2), cp.Parameter()
        self._lower, self._upper = cp.Parameter(groups + 2), cp.Parameter(groups + 2)

    @cached_property
    def _problem(self) -> cp.Problem:
        relative = self.space.costs / self.space.costs.sum()
        design = cp.hstack([self._scales, self._clearances])
        requirement = cp.norm2(cp.multiply(self._weights, self._scales)) + self._slopes @ self._clearances <= self._room
        return cp.Problem(
            cp.Minimize(relative @ cp.inv_pos(self._scales)),
            [requirement, design >= self._lower, design <= self._upper],
        )

    def solve(
        self,
        model: LocalQuantile,
        limit: float,
        lower: Float[np.ndarray, " variable"],
        upper: Float[np.ndarray, " variable"],
    ) -> Float[np.ndarray, " variable"] | None:
        """Return the cheapest design within the bounds that the model lets meet the limit, or None.

        Parameters
        ----------
        model
            The modelled quantile.
        limit
            Largest quantile allowed [arcsec].
        lower, upper
            Bounds of the design, inside those of the space.
        """
        self._weights.value = model.weights / limit
        self._slopes.value = model.slopes / limit
        self._room.value = (limit - model.offset) / limit
        self._lower.value, self._upper.value = lower, upper
        self._problem.solve(solver=cp.CLARABEL)
        if self._problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            return None
        return np.asarray(np.clip(np.concatenate([self._scales.value, self._clearances.value]), lower, upper))

    def front(self, model: LocalQuantile, limits: Float[np.ndarray, " limit"]) -> Float[np.ndarray, "design variable"]:
        """Return the cheapest designs for several limits [arcsec], leaving out limits that the model cannot keep."""
        solved = [self.solve(model, float(limit), self.space.lower, self.space.upper) for limit in limits]
        return np.array([design for design in solved if design is not None]).reshape(-1, self.space.lower.size)


def cost_bound(
    space: DesignSpace,
    model: LocalQuantile,
    limit: float,
    near: Float[np.ndarray, " variable"],
) -> float:
    """Return a lower bound on the cost of every design that the model lets meet the limit [cost units].

    Parameters
    ----------
    space
        Variables, their bounds and costs.
    model
        The modelled quantile.
    limit
        Largest quantile allowed [arcsec].
    near
        A design whose direction weights∘scales/‖·‖ makes the bound tight; any design gives a valid one.

    Notes
    -----
    Lagrange dual with the norm replaced by its supporting plane u·(weights∘scales), ‖u‖ = 1: for every multiplier
    each variable is minimised alone in closed form over its whole range. No solver's word is taken; theory page,
    equation (27).
    """
    groups = len(space.groups)
    contribution = model.weights * near[:groups]
    plane = model.weights * contribution / max(float(np.linalg.norm(contribution)), 1e-300)
    lower, upper = space.lower, space.upper

    def dual(multiplier: float) -> float:
        price = np.maximum(multiplier * plane, 1e-300)
        scales = np.clip(np.sqrt(space.costs / price), lower[:groups], upper[:groups])
        slopes = multiplier * model.slopes
        clearances = np.minimum(slopes * lower[groups:], slopes * upper[groups:]).sum()
        return float((space.costs / scales + price * scales).sum() + clearances + multiplier * (model.offset - limit))

    scale = float(space.costs.sum()) / limit
    best = minimize_scalar(lambda log: -dual(scale * np.exp(log)), bounds=(-8.0, 8.0), method="bounded")
    return max(dual(0.0), -float(best.fun)) + space.locked_cost
