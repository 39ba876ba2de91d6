"""What no design that keeps the limits costs less than, with the errors of the units counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.search import process_choice
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.allocation.space.problem import OneSidedConstraint, Solution, Stack, root_sum_square_stack
from tolalloc.allocation.space.requirement import Check, QuantileBound, RootSumSquare, Sampled
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.capability.monte_carlo import CONFIDENCE

_ROUNDING = 1e-9
"""Part of a budget by which a load that is its own budget may lie beyond it [-]."""

Cheapest = Callable[[tuple[Stack, ...]], tuple[float, Float[np.ndarray, " variable"]] | None]
"""Returns a lower bound on the cost of what keeps some stacks [cost units] and the design, none if nothing does."""


@dataclass(frozen=True, kw_only=True)
class LowerBound:
    """A cost below which no design keeps the limits."""

    cost: float  # [cost units]
    confidence: float  # With which it holds against the errors of the units, one-sided [-]
    # Whether it holds for every allowed design; otherwise for those that the local models around the design describe
    certified: bool


def lower_bound(design: VerifiedDesign) -> LowerBound:
    """Return what no design costs less than by what is known around a verified one.

    Notes
    -----
    A requirement is a quantile of units, q(design) ≤ limit, of which the units of one design tell the value with an
    error, and its derivatives. It is replaced by a weaker one: q is taken at its least, by the other end of the
    confidence interval that shows it kept, and lower by what the derivatives may err between the two designs. So the
    cheapest design of the weaker one is cheaper than that of the real one, as far as the local model describes it.

    Where every output is linear in the deviations, the quantile and its derivatives are those of the exact law. For
    symmetric log-concave deviations and one limit the quantile is convex in the zones, so it lies above the plane
    that touches it, and the bound holds for every allowed design.

    cost ≥ min cost over the weaker requirements (own derivation) [cost units]; by the Lagrange dual, `cost_bound`.

    Examples
    --------
    Least 1/a + 1/b with (3a)² + (4b)² ≤ 5²: (3^⅔ + 4^⅔)^(3/2)/5 = 1.9731.

    >>> from tolalloc.allocation.verify.verification import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    >>> round(lower_bound(verifier.verify(verifier.space.uniform(1.0), "as drawn")).cost, 4)
    1.9731
    """
    space = design.space

    def cheapest(stacks: tuple[Stack, ...]) -> tuple[float, Float[np.ndarray, " variable"]] | None:
        found = process_choice.allocate(space.problem(stacks))
        if not isinstance(found, Solution):
            return None
        return found.bound, np.concatenate([found.zones, found.shared])

    return LowerBound(
        cost=least_cost(design, cheapest) + space.locked_cost,
        confidence=CONFIDENCE,
        certified=_is_certified(design),
    )


def least_cost(design: VerifiedDesign, cheapest: Cheapest) -> float:
    """Return the least cost of what keeps the weaker requirements, whatever chooses it [cost units].

    At most that of the design itself, which may keep them by more than its own cost tells.

    Notes
    -----
    Theory page, equation (76): budgets load(design) − (q̲ − limit) + z·s. Half of the error of 5 % is that of the least
    quantiles q̲, the other half, shared among all limits, that of what sixteen batches say of the derivatives (s).

    min(own cost, cost of what keeps Σ load ≤ budget) (own derivation).

    Examples
    --------
    What chooses nothing cheaper leaves the cost of the design itself.

    >>> from tolalloc.allocation.verify.verification import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    >>> design = verifier.verify(verifier.space.uniform(1.0), "as drawn")
    >>> least_cost(design, lambda stacks: (1.9, design.design)), least_cost(design, lambda stacks: None)
    (1.9, 2.0)
    """
    stacks = tuple(stack for _, stack in _weaker(design))
    free = design.cost - design.space.locked_cost
    found = cheapest(stacks)
    if found is None:
        return free
    moved = tuple(
        replace(stack, budget=stack.budget + _derivative_error(constraint, stack, design, found[1]))
        for constraint, stack in _weaker(design)
    )
    again = cheapest(moved)
    return min(free, again[0] if again else free)


def _is_certified(design: VerifiedDesign) -> bool:
    """Return whether the bound holds for all allowed designs rather than near this one."""
    shared = design.space.shared
    if np.any(shared.upper > shared.lower):
        return False
    return all(_is_exact(check, design) for check in _alone(design))


def _is_exact(check: Check, design: VerifiedDesign) -> bool:
    """Return whether the stacks of a requirement hold for every design: they lie nowhere above what they stand for."""
    if isinstance(check.requirement.guarantee, RootSumSquare):
        return True
    laws = [constraint.law for constraint in check.constraints]
    if not all(law is not None and law.is_convex and (len(laws) == 1 or law.is_normal) for law in laws):
        return False
    groups = len(design.space.groups)
    return all(
        constraint.batches is None or bool((constraint.batches[0, :groups] >= 0).all())
        for constraint in check.constraints
    )


def _weaker(design: VerifiedDesign) -> list[tuple[OneSidedConstraint, Stack]]:
    """Return every one-sided constraint with the stack that a design keeps that keeps the limit, the error counted."""
    constraints = sum(len(check.constraints) for check in _alone(design))
    found = []
    for check in _alone(design):
        bounds: tuple[QuantileBound, ...] = ()
        if isinstance(check.requirement.guarantee, Sampled):
            confidence = 1 - (1 - CONFIDENCE) / (2 * constraints)  # the other half is that of the derivatives
            bounds = check.requirement.guarantee.least_bounds(_sample(design, check), confidence)
        for at, constraint in enumerate(check.constraints):
            excess = bounds[at].excess if bounds else constraint.excess
            if np.isfinite(excess):
                load = float(constraint.stack.load(design.scales, design.settings))
                budget = load - excess + _ROUNDING * (abs(load) + abs(excess))
                found.append((constraint, replace(_touching(constraint, design), budget=budget)))
    return found


def _alone(design: VerifiedDesign) -> tuple[Check, ...]:
    """Return the checks of every limit alone: what keeps all of them at once keeps each of them."""
    return tuple(check for check in design.checks if not isinstance(check.requirement, JointRequirement))


def _sample(design: VerifiedDesign, check: Check) -> LimitedSample:
    """Return the units that tested a design last."""
    requirement, law = check.requirement, design.laws.get(check.requirement.output)
    if design.independent:
        return design.independent.limited(requirement, law, design.nearest)
    return LimitedSample.all_of(requirement.read(design.outputs), requirement.limits, law)


def _touching(constraint: OneSidedConstraint, design: VerifiedDesign) -> Stack:
    """Return the plane that touches the model of a linear output at the design, the model itself of any other."""
    stack = constraint.stack
    if constraint.law is None:
        return stack
    spread = stack.root_sum_square * design.scales
    length = float(np.linalg.norm(spread)) or 1.0
    return replace(
        stack,
        worst_case=stack.worst_case + stack.root_sum_square * spread / length,
        root_sum_square=np.zeros(spread.size),
    )


def _derivative_error(
    constraint: OneSidedConstraint, stack: Stack, design: VerifiedDesign, other: Float[np.ndarray, " variable"]
) -> float:
    """Return by how much the derivatives may err of what changes from one design to another [unit of the output]."""
    from scipy.stats import norm

    if constraint.batches is None or constraint.law is not None:
        return 0.0
    groups, changes = len(design.space.groups), []
    for gradient in constraint.batches:
        own = root_sum_square_stack(stack.name, design.design, 0.0, gradient, groups)
        loads = [float(own.load(each[:groups], each[groups:])) for each in (other, design.design)]
        changes.append(loads[0] - loads[1])
    error = float(np.std(changes, ddof=1)) / np.sqrt(len(changes)) if len(changes) > 1 else 0.0
    return float(norm.ppf(1 - (1 - CONFIDENCE) / (2 * sum(len(check.constraints) for check in _alone(design))))) * error
