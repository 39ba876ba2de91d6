"""An allocation as a mathematical program: features to make, tolerance stacks and one-sided constraints to keep."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.cost.model import Process
from tolalloc.capability.linear_function import LinearLaw
from tolalloc.exceptions import InputError, SolveError

_KEPT = 1e-10
"""Violation below which a stack counts as kept [-]."""
_TIE = 1e-9
"""Distance from the largest violation within which a stack blocks too [-]."""


@dataclass(frozen=True, kw_only=True)
class PricedFeature:
    """One zone to be chosen: of one callout, or of a group of callouts that change together."""

    name: str  # Name of the feature or group
    processes: tuple[Process, ...]  # Ways to make it, one of which is chosen
    loss: float = 0.0  # Quality loss per zone², 0 or above [cost units per unit²]

    def __post_init__(self) -> None:
        if not self.processes:
            raise InputError.at(f"feature {self.name}", "processes", "an empty list", "one process or more")
        if not self.loss >= 0:
            raise InputError.at(f"feature {self.name}", "loss", self.loss, "0 or above")


@dataclass(frozen=True, kw_only=True)
class Stack:
    """A tolerance stack: Σ wᵢ·zᵢ + √Σ(qᵢ·zᵢ)² + Σ sⱼ·vⱼ ≤ budget, of zones z and shared variables v.

    Worst-case stacks have q = 0, root-sum-square stacks w = 0.

    References
    ----------
    K. W. Chase, W. H. Greenwood, Design issues in mechanical tolerance analysis, Manuf. Rev. 1 (1988) 50–59.

    Examples
    --------
    Two zones of 3 and 4 µm that add in quadrature, and a third one of 2 µm with all of its size:

    >>> stack = Stack(
    ...     name="gap", worst_case=np.array([0.0, 0, 1]), root_sum_square=np.array([1.0, 1, 0]), budget=10.0
    ... )
    >>> float(stack.load(np.array([3.0, 4.0, 2.0]), np.empty(0)))
    7.0
    """

    name: str  # What the stack keeps
    # What a feature adds per zone in the worst case, 0 or above [unit of the stack per unit of the zone]
    worst_case: Float[np.ndarray, " feature"]
    # What a feature adds per zone in quadrature, 0 or above [unit of the stack per unit of the zone]
    root_sum_square: Float[np.ndarray, " feature"]
    budget: float  # Largest value allowed [unit of the stack]
    # Change with the shared variables [unit of the stack per unit of the variable]
    slopes: Float[np.ndarray, " shared"] = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        for name, weights in (("worst_case", self.worst_case), ("root_sum_square", self.root_sum_square)):
            if not np.all(weights >= 0):
                raise InputError.at(f"stack {self.name}", name, weights.tolist(), "numbers that are 0 or above")

    def load(
        self, zones: Float[np.ndarray, "*designs feature"], shared: Float[np.ndarray, "*designs shared"]
    ) -> Float[np.ndarray, "*designs"]:
        """Return the value of the stack [unit of the stack]."""
        spread = np.sqrt(((self.root_sum_square * zones) ** 2).sum(axis=-1))
        return np.asarray(zones @ self.worst_case + spread + shared @ self.slopes)

    def zone_slopes(self, zones: Float[np.ndarray, " feature"]) -> Float[np.ndarray, " feature"]:
        """Return the derivatives of the value by the zones [unit of the stack per unit of the zone]."""
        spread = self.root_sum_square * zones
        length = float(np.linalg.norm(spread)) or 1.0
        return np.asarray(self.worst_case + self.root_sum_square * spread / length)


@dataclass(frozen=True, kw_only=True)
class Shared:
    """Variables that move all stacks at once and cost nothing, such as the two clearances of the modification."""

    names: tuple[str, ...] = ()  # Their names
    # Their bounds, in a unit that makes them of order one [unit of the variable]
    lower: Float[np.ndarray, " shared"] = field(default_factory=lambda: np.empty(0))
    upper: Float[np.ndarray, " shared"] = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, kw_only=True)
class AllocationProblem:
    """Features and stacks: least cost such that every stack stays within its budget."""

    features: tuple[PricedFeature, ...]  # What is chosen
    stacks: tuple[Stack, ...]  # What must be kept
    shared: Shared = field(default_factory=Shared)  # Variables that belong to no feature

    @cached_property
    def losses(self) -> Float[np.ndarray, " feature"]:
        """Quality loss per zone² of every feature."""
        return np.array([feature.loss for feature in self.features])

    @cached_property
    def scales(self) -> Float[np.ndarray, " stack"]:
        """Size of every stack: its budget, or a thousandth of its largest load if that is more [unit of the stack]."""
        zones = np.array([max(made.maximum for made in feature.processes) for feature in self.features])
        reach = np.maximum(np.abs(self.shared.lower), np.abs(self.shared.upper))
        loads = [float(stack.load(zones, np.zeros(reach.size)) + np.abs(stack.slopes) @ reach) for stack in self.stacks]
        found = np.maximum(np.abs([stack.budget for stack in self.stacks]), 1e-3 * np.array(loads))
        return np.where(found > 0, found, 1.0)  # of what neither zones nor settings move

    def cost(self, zones: Float[np.ndarray, " feature"], processes: Int[np.ndarray, " feature"]) -> float:
        """Return the cost of zones made by the processes at the given positions [cost units]."""
        made = [
            float(feature.processes[at].total(np.asarray(zone)))
            for feature, zone, at in zip(self.features, zones, processes, strict=True)
        ]
        return sum(made) + float(self.losses @ zones**2)

    def violation(
        self, zones: Float[np.ndarray, " feature"], shared: Float[np.ndarray, " shared"]
    ) -> Float[np.ndarray, " stack"]:
        """Return by how much every stack exceeds its budget, negative where it is kept [unit of the stack]."""
        return np.array([float(stack.load(zones, shared)) - stack.budget for stack in self.stacks])


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Zones and processes, with what proves how good they are."""

    zones: Float[np.ndarray, " feature"]  # Zone of every feature [unit of the zone]
    processes: Int[np.ndarray, " feature"]  # Position of the chosen process of every feature [-]
    shared: Float[np.ndarray, " shared"]  # Values of the shared variables [unit of the variable]
    cost: float  # Cost [cost units]
    bound: float  # Lower bound on the cost of every allowed choice, computed without the solver [cost units]
    # Shadow price of every stack: cost saved per unit of budget [cost units per unit of the stack]
    prices: Float[np.ndarray, " stack"]
    # Shadow price of the smallest and the largest zone of every feature: cost saved by moving that bound outwards [cost
    # units per unit of the zone]
    bound_prices: Float[np.ndarray, "feature 2"]

    @property
    def gap(self) -> float:
        """Cost over its lower bound, minus one [-]."""
        return self.cost / self.bound - 1


@dataclass(frozen=True, kw_only=True)
class LeastInfeasible:
    """The design whose largest violation is smallest."""

    zones: Float[np.ndarray, " feature"]  # Smallest zone of every feature [unit of the zone]
    processes: Int[np.ndarray, " feature"]  # Position of the process that holds it [-]
    shared: Float[np.ndarray, " shared"]  # Values of the shared variables [unit of the variable]
    # By how much every stack exceeds its budget, over the stack's scale; negative where it is kept [-]
    violations: Float[np.ndarray, " stack"]
    blocking: tuple[str, ...]  # Names of the stacks with the largest violation

    @property
    def largest(self) -> float:
        """Largest violation, negative where budget is left in all stacks [-]."""
        return float(self.violations.max(initial=-np.inf))

    @property
    def feasible(self) -> bool:
        """Whether the design keeps all stacks."""
        return self.largest <= _KEPT


def least_infeasible(problem: AllocationProblem) -> LeastInfeasible:
    """Return the design with the smallest largest violation; if it does not keep all stacks, no design does.

    min max (load − budget)/scale over all stacks [-] (own derivation); exact.

    Notes
    -----
    A larger zone never relieves a stack, so the smallest zones are best for all stacks at once and only the shared
    variables are left: a linear program, or nothing.
    """
    processes = np.array([np.argmin([made.minimum for made in feature.processes]) for feature in problem.features])
    zones = np.array([feature.processes[at].minimum for feature, at in zip(problem.features, processes, strict=True)])
    shared = _relief(problem, zones) if problem.shared.names and problem.stacks else problem.shared.lower.copy()
    violations = problem.violation(zones, shared) / problem.scales
    near = np.flatnonzero(violations >= violations.max(initial=-np.inf) - _TIE)
    return LeastInfeasible(
        zones=zones,
        processes=processes,
        shared=shared,
        violations=violations,
        blocking=tuple(problem.stacks[at].name for at in near),
    )


def _relief(problem: AllocationProblem, zones: Float[np.ndarray, " feature"]) -> Float[np.ndarray, " shared"]:
    """Return the shared variables that make the largest violation of given zones smallest."""
    from scipy.optimize import linprog

    box, scales = problem.shared, problem.scales
    fixed = problem.violation(zones, np.zeros(box.lower.size)) / scales
    slopes = np.stack([stack.slopes for stack in problem.stacks]) / scales[:, None]
    found = linprog(
        np.append(np.zeros(box.lower.size), 1.0),
        A_ub=np.column_stack([slopes, -np.ones(scales.size)]),
        b_ub=-fixed,
        bounds=[*zip(box.lower, box.upper, strict=True), (None, None)],
    )
    if found.status != 0:
        raise SolveError(f"The shared variables that relieve the stacks were not found: {found.message}")
    return np.asarray(np.clip(found.x[:-1], box.lower, box.upper))


@dataclass(frozen=True, kw_only=True)
class OneSidedConstraint:
    """One limit at a verified design: what is compared with it, and a convex model of that around the design."""

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

    @property
    def relief(self) -> Float[np.ndarray, " group"]:
        """By how much a larger zone relieves the limit, 0 or below, which no model of a search rewards.

        Per scale and to first order, mean over the batches [unit of the output]; a smaller zone then costs as much.
        """
        groups = self.stack.worst_case.size
        if self.batches is None:
            return np.zeros(groups)
        return np.asarray(np.minimum(self.batches[:, :groups].mean(axis=0), 0.0))

    def predicted(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the excess that the model predicts, negative inside the limit [unit of the output]."""
        groups = self.stack.worst_case.size
        return np.asarray(self.stack.load(designs[..., :groups], designs[..., groups:]) - self.stack.budget)


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
    Theory page, equation (25), own derivation. The norm is how independent random errors combine, and it is
    homogeneous, so its value is gradient·scales: weightᵢ² = gᵢ·(g·scales)/scaleᵢ with gᵢ = max(∂excess/∂scaleᵢ, 0). A
    group whose larger zone relieves the limit, by noise or because its errors open the contact, gets weight zero: the
    model never rewards a larger error. It is exact at the design, and near it to first order.

    Examples
    --------
    An output that rises by 3 and 4 with two scales, at a design 1 inside its limit:

    >>> stack = root_sum_square_stack("play", np.array([1.0, 1.0]), -1.0, np.array([3.0, 4.0]), groups=2)
    >>> np.round(stack.root_sum_square, 3), stack.budget, float(stack.load(np.array([1.0, 1.0]), np.empty(0)))
    (array([4.583, 5.292]), 8.0, 7.0)
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
    """Return the model of a worst case, weights·scales + slopes·settings ≤ budget, from the same arguments.

    Theory page equation (25) without its norm: weightᵢ = max(∂excess/∂scaleᵢ, 0) [unit of the output] (own derivation),
    exact at the design and near it to first order.

    Examples
    --------
    >>> stack = worst_case_stack("play", np.array([1.0, 1.0]), -1.0, np.array([3.0, 4.0]), groups=2)
    >>> stack.worst_case, stack.budget
    (array([3., 4.]), 8.0)
    """
    by_scale = np.maximum(gradient[:groups], 0.0)
    return Stack(
        name=name,
        worst_case=by_scale,
        root_sum_square=np.zeros(by_scale.size),
        budget=float(by_scale @ design[:groups] + gradient[groups:] @ design[groups:] - excess),
        slopes=gradient[groups:].copy(),
    )
