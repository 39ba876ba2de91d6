"""What no design that keeps the limits costs less than, with the errors of the units counted."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import count, islice

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.search import process_choice
from tolalloc.allocation.space.joint_yield import JointCheck
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.allocation.space.problem import OneSidedConstraint, Solution, Stack, root_sum_square_stack
from tolalloc.allocation.space.requirement import AtYield, Check, QuantileBound, RootSumSquare, Sampled
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.capability.monte_carlo import CONFIDENCE
from tolalloc.exceptions import SolveError

_ROUNDING = 1e-9
"""Part of a budget by which a load that is its own budget may lie beyond it [-]."""
COUNTS = 0.05
"""Part of the failures below which a limit hardly counts [-]."""
_CUTS = 20
"""Cuts of boxes of divisions [-]."""
_NODES = 50
"""Nodes of the search for what a box costs [-]."""
_COUNTED = 100.0
"""Failing units that tell how many failures coincide [-]."""
_WIDEST = 0.25
"""Share of all units, at most, that is counted as failing for it [-]."""

Rises = Float[np.ndarray, " limit"]
"""By how much every limit is further in [unit of its output]."""

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

    cost ≥ min cost over the weaker requirements, theory page equation (76) (own derivation) [cost units]; by the
    Lagrange dual, `cost_bound`.

    Examples
    --------
    Least 1/a + 1/b with (3a)² + (4b)² ≤ 5²: (3^⅔ + 4^⅔)^(3/2)/5 = 1.9731.

    >>> from tests.builders import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    >>> round(lower_bound(verifier.verify(verifier.space.uniform(1.0), "as drawn")).cost, 4)
    1.9731
    """
    space, series = design.space, list[process_choice.BudgetSeries]()

    def cheapest(stacks: tuple[Stack, ...]) -> tuple[float, Float[np.ndarray, " variable"]] | None:
        found = process_choice.allocate(space.problem(stacks))
        return (found.bound, np.concatenate([found.zones, found.shared])) if isinstance(found, Solution) else None

    def near_by(stacks: tuple[Stack, ...]) -> float:
        if not series:
            series.append(process_choice.BudgetSeries(space.problem(stacks)))
        try:
            found = series[0].allocate(np.array([stack.budget for stack in stacks]), _NODES)
        except SolveError:
            return -np.inf
        return found.bound if isinstance(found, Solution) else np.inf

    return LowerBound(
        cost=least_cost(design, cheapest, near_by) + space.locked_cost,
        confidence=CONFIDENCE,
        certified=_is_certified(design),
    )


def least_cost(design: VerifiedDesign, cheapest: Cheapest, near_by: Callable[[tuple[Stack, ...]], float]) -> float:
    """Return the least cost of what keeps the weaker requirements, whatever chooses it [cost units].

    At most that of the design itself, which may keep them by more than its own cost tells.

    Parameters
    ----------
    design
        A verified design.
    cheapest
        What chooses the design.
    near_by
        Lower bound on the cost of what keeps the stacks chosen for last with other budgets [cost units].

    Notes
    -----
    Theory page, equation (76): budgets load(design) − (q̲ − limit) + z·s. Half of the error of 5 % is that of the least
    quantiles q̲, the other half, shared among all limits, that of what sixteen batches say of the derivatives (s).

    min(own cost, cost of what keeps Σ load ≤ budget) (own derivation).

    Of limits that are kept at once, every design divides the failures in some way: the least of all ways is taken, by
    branch and bound (`division_bounds`).
    """
    free = design.cost - design.space.locked_cost
    weaker, last = _weaker(design), design.checks[-1]
    found = cheapest(tuple(stack for _, _, stack in weaker))
    if found is None:
        return free
    moved = [
        (at, replace(stack, budget=stack.budget + _derivative_error(constraint, stack, design, found[1])))
        for at, constraint, stack in weaker
    ]

    again = cheapest(tuple(stack for _, stack in moved))
    least = min(free, again[0] if again else free)
    if not isinstance(last, JointCheck):
        return least

    def divided(rises: Rises) -> float:
        """Return the least cost where every limit is further in by so much [cost units]."""
        return near_by(tuple(replace(stack, budget=stack.budget - rises[at]) for at, stack in moved))

    return float(np.clip(_least_of_divisions(design, last, divided), least, free))


def _least_of_divisions(design: VerifiedDesign, joint: JointCheck, least: Callable[[Rises], float]) -> float:
    """Return the least cost over all ways to divide the failures among the limits [cost units].

    Notes
    -----
    Shares fᵢ of the units fail the limits, and of all failures but those of the limit that fails most a part ρ
    coincides with others: Σ fᵢ − ρ·(Σ fᵢ − max fᵢ) ≤ F, where F may fail in all. A box of parts lᵢ ≤ fᵢ/F ≤ uᵢ costs no
    less than if every limit had its uᵢ; the cheapest box is halved across its widest side (Land & Doig 1960; own
    bound). Limits that hardly count keep all failures.
    """
    guarantees = [own.guarantee for own in joint.joint.requirements]
    yields = {at: own.target for at, own in enumerate(guarantees) if isinstance(own, AtYield)}
    counting = [at for at, part in enumerate(joint.joint.parts) if part > COUNTS and at in yields]
    apart = 1 - _coinciding(design, joint)

    def cost(upper: Float[np.ndarray, " counting"]) -> float:
        rises = np.zeros(len(joint.tails))
        for at, part in zip(counting, upper, strict=True):
            alone = 1 - yields[at]
            rises[at] = joint.tails[at].extrapolation(min(part * joint.joint.failures, alone), alone)
        return least(rises)

    return next(islice(division_bounds(cost, len(counting), apart), _CUTS if len(counting) > 1 else 0, None))


def division_bounds(
    cost: Callable[[Float[np.ndarray, " counting"]], float], limits: int, apart: float = 1.0
) -> Iterator[float]:
    """Yield, after every cut of a box, what no division of the failures among so many limits costs less than.

    Parameters
    ----------
    cost
        Of the largest parts of a box, what none of its divisions costs less than.
    apart
        1 − ρ, the part of the failures that coincide with no others [-].
    """
    lower, upper = np.zeros(limits), np.ones(limits)
    boxes = [(cost(upper), 0, lower, upper)]
    for number in count(1):
        yield boxes[0][0]
        whole, _, lower, upper = heapq.heappop(boxes)
        for half, (below, above) in enumerate(_halves(lower, upper, apart)):
            heapq.heappush(boxes, (max(whole, cost(above)), 2 * number + half, below, above))


Box = tuple[Float[np.ndarray, " counting"], Float[np.ndarray, " counting"]]
"""Least and largest part of the failures of every limit that counts [-]."""


def _halves(lower: Float[np.ndarray, " counting"], upper: Float[np.ndarray, " counting"], apart: float) -> list[Box]:
    """Return the halves of a box across its widest side, 1 − ρ given; one that holds no division is left out."""
    at, found = int(np.argmax(upper - lower)), []
    middle = float(upper[at] + lower[at]) / 2
    for low, high in ((lower[at], middle), (middle, upper[at])):
        below, above = lower.copy(), upper.copy()
        below[at], above[at] = low, high
        above = np.minimum(above, [_largest_part(below, own, apart) for own in range(below.size)])
        if (above >= below).all():
            found.append((below, above))
    return found


def _largest_part(lower: Float[np.ndarray, " counting"], at: int, apart: float) -> float:
    """Return what a limit may have of the failures at most where the others have their least, 1 − ρ given [-]."""
    others = np.delete(lower, at)
    most = 1 - apart * float(others.sum())
    if most >= others.max():
        return most
    # Another limit fails more often, and so much of this one's own failures must not add to it.
    left = 1 - float(others.max()) - apart * float(others.sum() - others.max())
    return min(left / apart, 1.0) if apart > 0 else 1.0


def _coinciding(design: VerifiedDesign, joint: JointCheck) -> float:
    """Return ρ at its largest, with 95 % confidence [-].

    Counted among the units furthest out, some hundred, in the division in force; Clopper & Pearson 1934.
    """
    from scipy.stats import beta

    samples = [_sample(design, check) for check in design.checks_alone]
    excess = np.stack([own.excess for own in samples])
    wider = max(1.0, _COUNTED / (samples[0].units.drawn.units * joint.joint.failures))
    limits = [tail.excess(min(joint.joint.share(at, 1.0, wider), _WIDEST)) for at, tail in enumerate(joint.tails)]
    failed = excess > np.array(limits)[:, np.newaxis]
    each = failed.sum(axis=1)
    rest = int(each.sum() - each.max())
    coinciding = int(each.sum() - np.count_nonzero(failed.any(axis=0)))
    return 1.0 if coinciding == rest else float(beta.ppf(CONFIDENCE, coinciding + 1, rest - coinciding))


def _is_certified(design: VerifiedDesign) -> bool:
    """Return whether the bound holds for all allowed designs rather than near this one."""
    shared = design.space.shared
    if isinstance(design.checks[-1], JointCheck):  # how many failures coincide elsewhere is not known
        return False
    if np.any(shared.upper > shared.lower):
        return False
    return all(_is_exact(check, design) for check in design.checks_alone)


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


def _weaker(design: VerifiedDesign) -> list[tuple[int, OneSidedConstraint, Stack]]:
    """Return every one-sided constraint with the stack that a design keeps that keeps the limit, the error counted.

    The position of its check stands before it.
    """
    found = []
    for number, check in enumerate(design.checks_alone):
        bounds: tuple[QuantileBound, ...] = ()
        if isinstance(check.requirement.guarantee, Sampled):
            confidence = 1 - (1 - CONFIDENCE) / (2 * len(design.alone))  # the other half is that of the derivatives
            bounds = check.requirement.guarantee.counted_bounds(_sample(design, check), 1 - confidence)
        for at, constraint in enumerate(check.constraints):
            if constraint.law and constraint is not max(check.constraints, key=lambda side: side.excess):
                continue  # what decides says all: the other side's own quantile is not asked for
            excess = bounds[at].excess if bounds else constraint.excess
            if np.isfinite(excess):
                load = float(constraint.stack.load(design.scales, design.settings))
                budget = load - excess + _ROUNDING * (abs(load) + abs(excess))
                found.append((number, constraint, replace(_touching(constraint, design), budget=budget)))
    return found


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
    slopes = stack.zone_slopes(design.scales)
    return replace(stack, worst_case=slopes, root_sum_square=np.zeros(slopes.size))


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
    return float(norm.ppf(1 - (1 - CONFIDENCE) / (2 * len(design.alone)))) * error
