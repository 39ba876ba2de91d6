"""What a choice of equidistant and shift amount minimises, and what it must keep."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.rv.reducer.design import CycloidStage

Amounts = Float[np.ndarray, "n 2"]
"""Pairs of Δr_rp and Δr_p, `tolalloc.rv.reducer.design.Modification` [m]."""

_ROUNDING = 1e-17  # violation that counts as none [m]
_UNMET = 1.0  # merit from which on a constraint is violated; no objective comes near it [m]


@dataclass(frozen=True, kw_only=True)
class EvaluatedAmounts:
    """Points of a problem, evaluated."""

    objective: Float[np.ndarray, " n"]  # What is to be minimised [m]
    constraints: Float[np.ndarray, "n c"]  # What must not be negative [m]

    @cached_property
    def violation(self) -> Float[np.ndarray, " n"]:
        """By how much all constraints together are missed, 0 where they are met [m]."""
        missed = np.maximum(-self.constraints, 0.0).sum(axis=-1)
        return np.where(missed > _ROUNDING, missed, 0.0)

    @cached_property
    def merit(self) -> Float[np.ndarray, " n"]:
        """One number to sort by: points that meet the constraints by objective, then the others by violation [m]."""
        return np.where(self.violation > 0, _UNMET + self.violation, self.objective)


@dataclass(frozen=True, kw_only=True)
class ModificationProblem(ABC):
    """Find the amounts (Δr_rp, Δr_p) with the smallest objective.

    Notes
    -----
    The gap after closing at φ0 is Δr_rp(1 − S) − Δr_p(C − qS) with C = √(1 − K1²S²), so it depends on φ by
    S ∈ [0, 1] alone (`tolalloc.rv.cycloid.clearance.formula_gap`). It vanishes at S = 1, where its derivative by S is
    −Δr_rp + Δr_p/q, as K1² + q² = 1. C is concave in S: for Δr_p ≥ 0 the gap is convex and nowhere negative if and
    only if that derivative is not positive, q·Δr_rp ≥ Δr_p. For Δr_p < 0 it is concave and nowhere negative if and
    only if it is not negative at S = 0, Δr_rp ≥ Δr_p, from which q·Δr_rp ≥ Δr_p follows. So together with the radial
    clearance the one row q·Δr_rp − Δr_p ≥ 0 says gap ≥ 0 at every φ.
    """

    name: str  # What reports call it
    stage: CycloidStage  # Cycloid stage
    # Bounds of the two amounts [m]
    lower: Float[np.ndarray, " 2"]
    upper: Float[np.ndarray, " 2"]
    radial_clearance: float = 0.0  # Smallest clearance j at tip and root, Δr_rp − Δr_p ≥ j [m]
    require_gap: bool = False  # Whether no pin may interfere once the flank at φ0 is closed

    @property
    @abstractmethod
    def description(self) -> str:
        """What the objective measures, in a sentence for reports."""

    @abstractmethod
    def objective(self, amounts: Amounts) -> Float[np.ndarray, " n"]:
        """Return what is to be minimised [m]."""

    def constraints(self, amounts: Amounts) -> Float[np.ndarray, "n c"]:
        """Return what must not be negative: radial clearance beyond j and, if required, q·Δr_rp − Δr_p [m]."""
        equidistant, shift = amounts.T
        rows = [equidistant - shift - self.radial_clearance]
        if self.require_gap:
            rows.append(self.stage.flank_ratio * equidistant - shift)
        return np.stack(rows, axis=-1)

    def evaluate(self, amounts: Amounts) -> EvaluatedAmounts:
        """Return objective and constraints."""
        return EvaluatedAmounts(objective=self.objective(amounts), constraints=self.constraints(amounts))
