"""What a choice of equidistant and shift amount minimises, what it must keep, and the optimum without chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.reducer.design import CycloidStage, Modification

Amounts = Float[np.ndarray, "n 2"]
"""Pairs of Δr_rp and Δr_p, `tolalloc.reducers.reducer.design.Modification` [m]."""

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
class ModificationProblem:
    """Find the amounts (Δr_rp, Δr_p) with the smallest objective.

    Notes
    -----
    The gap after closing at φ0 is Δr_rp(1 − S) − Δr_p(C − qS) with C = √(1 − K1²S²), so it depends on φ by
    S ∈ [0, 1] alone (`tolalloc.reducers.cycloid.clearance.formula_gap`). It vanishes at S = 1, where its derivative
    by S is
    −Δr_rp + Δr_p/q, as K1² + q² = 1. C is concave in S: for Δr_p ≥ 0 the gap is convex and nowhere negative if and
    only if that derivative is not positive, q·Δr_rp ≥ Δr_p. For Δr_p < 0 it is concave and nowhere negative if and
    only if it is not negative at S = 0, Δr_rp ≥ Δr_p, from which q·Δr_rp ≥ Δr_p follows. So together with the radial
    clearance the one row q·Δr_rp − Δr_p ≥ 0 says gap ≥ 0 at every φ.
    """

    name: str  # What reports call it
    description: str  # What the objective measures, in a sentence for reports
    stage: CycloidStage  # Cycloid stage
    objective: Callable[[Amounts], Float[np.ndarray, " n"]]  # What is to be minimised [m]
    # Bounds of the two amounts [m]
    lower: Float[np.ndarray, " 2"]
    upper: Float[np.ndarray, " 2"]
    radial_clearance: float = 0.0  # Smallest clearance j at tip and root, Δr_rp − Δr_p ≥ j [m]
    require_gap: bool = False  # Whether no pin may interfere once the flank at φ0 is closed

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


_FIRST, _POINTS, _LEVELS = 33, 9, 24  # the last points are 32·4²³ times closer than the bounds, which is rounding

Values = Callable[[Float[np.ndarray, "n p"]], Float[np.ndarray, "n p"]]
"""Values of points on n lines."""


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The best of all points that were evaluated."""

    amounts: Float[np.ndarray, " 2"]  # Δr_rp and Δr_p [m]
    objective: float  # Objective there [m]
    violation: float  # By how much the constraints are missed there [m]
    evaluations: int  # Points that were evaluated [-]

    @property
    def modification(self) -> Modification:
        """The amounts as a tooth modification."""
        return Modification(equidistant=float(self.amounts[0]), shift=float(self.amounts[1]))

    @property
    def status(self) -> str:
        """One sentence: whether the answer can be used."""
        if self.violation == 0:
            return f"met every constraint; best of {self.evaluations} points"
        missed = f"{self.violation / MICROMETRE:.4g} µm"
        return f"no point of {self.evaluations} met the constraints; the one that misses them least, by {missed}"


class BestPoint:
    """Evaluates points of a problem, counts them and keeps the best.

    Attributes
    ----------
    amounts
        Best amounts up to now [m].
    objective, violation
        Objective and missed constraints there [m].
    evaluations
        Points that were evaluated [-].
    """

    def __init__(self, problem: ModificationProblem) -> None:
        self.problem = problem
        self.amounts, self.evaluations = np.full(2, np.nan), 0
        self._merit = self.objective = self.violation = np.inf

    def __call__(self, amounts: Amounts) -> EvaluatedAmounts:
        """Return points evaluated."""
        evaluated = self.problem.evaluate(amounts)
        at = int(evaluated.merit.argmin())
        if evaluated.merit[at] < self._merit:
            self.amounts, self._merit = amounts[at].copy(), float(evaluated.merit[at])
            self.objective, self.violation = float(evaluated.objective[at]), float(evaluated.violation[at])
        self.evaluations += len(amounts)
        return evaluated


def reference(problem: ModificationProblem) -> Optimum:
    """Return the optimum of a problem: for each equidistant amount the best shift, and of these the best.

    Notes
    -----
    Both searches narrow a grid down around its best point, by comparison alone. So kinks, bounds and corners of the
    constraints need no care, and an optimum is missed only if it hides between the points of the first grid, 33 × 33.
    """
    best = BestPoint(problem)

    def best_by_shift(equidistants: Float[np.ndarray, "1 p"]) -> Float[np.ndarray, "1 p"]:
        def merit(shifts: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "n p"]:
            amounts = np.stack(np.broadcast_arrays(equidistants.T, shifts), axis=-1)
            return best(amounts.reshape(-1, 2)).merit.reshape(shifts.shape)

        bounds = np.repeat([[problem.lower[1]], [problem.upper[1]]], equidistants.size, axis=1)
        return _smallest(merit, *bounds)[np.newaxis]

    _smallest(best_by_shift, problem.lower[:1], problem.upper[:1])
    return Optimum(
        amounts=best.amounts, objective=best.objective, violation=best.violation, evaluations=best.evaluations
    )


def _smallest(
    values: Values, lower: Float[np.ndarray, " n"], upper: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the smallest value on each of n lines."""
    rows = np.arange(lower.size)
    for points in (_FIRST, *[_POINTS] * (_LEVELS - 1)):
        share = np.linspace(0, 1, points)
        places = np.outer(lower, 1 - share) + np.outer(upper, share)
        found = values(places)
        at = found.argmin(axis=1)
        lower, upper = places[rows, np.maximum(at - 1, 0)], places[rows, np.minimum(at + 1, points - 1)]
    return np.asarray(found[rows, at])
