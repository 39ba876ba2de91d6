"""Angular tolerances of parts that are adjusted while they are assembled: the cheapest, certified and verified."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import exp, inf

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import minimize_scalar

from tolalloc.allocation.cost.model import ClosedForm, Exponential, Process, Reciprocal
from tolalloc.allocation.search.process_choice import allocate
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Solution, Stack
from tolalloc.capability.indices import Interval, wilson_interval
from tolalloc.drawings.seeds import CHUNK, SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.gains import FinalErrors, Gains, assembled, tuned_gains
from tolalloc.wings.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.wings.assembly.trajectory import random_numbers

_TOLERANCES_SETTLED = 1e-8
"""Relative change of all tolerances below which they count as settled [-]."""

_STATE_WEIGHT_SETTLED = 1e-6
"""Step of the precision's logarithm with which the search for the best one ends [-]."""


@dataclass(frozen=True, kw_only=True)
class AngularLimits:
    """Limits of three standard deviations of the final angles."""

    names: tuple[str, ...]  # What each limits, such as ``tilt of disc``
    values: Float[np.ndarray, " limit"]  # The limits [rad]
    # 1 for the states whose variances add up to the limited one, 0 for the others [-]
    counted: Float[np.ndarray, "limit state"]

    def by_tolerance(self, errors: FinalErrors) -> Float[np.ndarray, "limit error"]:
        """Return a: what every tolerance² adds to the square of three standard deviations [-]."""
        return np.asarray(self.counted @ errors.by_part**2)

    def noise(self, errors: FinalErrors) -> Float[np.ndarray, " limit"]:
        """Return three standard deviations that the noise alone makes [rad]."""
        return np.asarray(3 * np.sqrt(self.counted @ np.diag(errors.noise_covariance)))

    def spread(self, errors: FinalErrors, tolerances: Float[np.ndarray, "part 3"]) -> Float[np.ndarray, " limit"]:
        """Return three standard deviations of what is limited, for tolerances of the parts [rad]."""
        parts = self.by_tolerance(errors) @ tolerances.ravel() ** 2
        return np.asarray(np.sqrt(parts + self.noise(errors) ** 2))


def requirements_of(plan: AssemblyPlan) -> AngularRequirements:
    """Return the requirements of a plan."""
    if plan.requirements is None:
        raise InputError.at(plan.name, "requirements", "not stated", "limits and costs of angular tolerances")
    return plan.requirements


def angular_limits(plan: AssemblyPlan) -> AngularLimits:
    """Return the limits of a plan; what has no limit gets no row.

    The tilt is limited as a whole, Var_x + Var_y, since its direction turns with the crank.
    """
    requirements, parts = requirements_of(plan), np.eye(len(plan.chain.names))
    names = [f"{kind} of {name}" for kind in ("tilt", "rotation") for name in plan.chain.names]
    values = np.concatenate([requirements.tilt_limit, requirements.rotation_limit])
    counted = np.concatenate([np.kron(parts, [1.0, 1.0, 0.0]), np.kron(parts, [0.0, 0.0, 1.0])])
    stated = np.isfinite(values)
    return AngularLimits(
        names=tuple(name for name, kept in zip(names, stated, strict=True) if kept),
        values=values[stated],
        counted=counted[stated],
    )


def angular_problem(plan: AssemblyPlan, errors: FinalErrors) -> AllocationProblem:
    """Return the allocation with tolerances and stacks in arcseconds, for the gains of given final errors.

    With fixed gains nine times a final variance is Σ a_i·t_i² + 9ν, theory page equation (59), for t = 3σ of
    independent part errors [arcsec], so it stays below T² where ‖√a∘t‖ ≤ √(T² − 9ν). The priced effort is affine in t²
    too: a quality loss and a constant, which is left out. Where the noise alone exceeds a limit the budget is negative,
    as no tolerance keeps it.
    """
    requirements, limits = requirements_of(plan), angular_limits(plan)
    left = limits.values**2 - limits.noise(errors) ** 2
    budgets = np.sign(left) * np.sqrt(np.abs(left)) / ARCSECOND
    losses = requirements.effort_price * errors.effort_by_variance / 9 * ARCSECOND**2
    names = [f"{part}.{axis}" for part, axis in product(plan.chain.names, "xyz")]
    features = tuple(
        PricedFeature(name=name, processes=(_process(requirements, at),), loss=float(loss))
        for at, (name, loss) in enumerate(zip(names, losses, strict=True))
    )
    roots = np.sqrt(limits.by_tolerance(errors))
    stacks = tuple(
        Stack(name=name, worst_case=np.zeros(len(names)), root_sum_square=root_sum_square, budget=float(budget))
        for name, root_sum_square, budget in zip(limits.names, roots, budgets, strict=True)
    )
    return AllocationProblem(features=features, stacks=stacks)


def _process(requirements: AngularRequirements, at: int) -> Process:
    """Return how the tolerance at a position among all is made, over arcseconds."""
    own, form = requirements, requirements.form
    fixed, factor, scale = (float(each.flat[at]) for each in (own.fixed, own.factor, own.scale))
    if form not in ("reciprocal", "exponential"):
        raise InputError.at("angular requirements", "form", form, "reciprocal or exponential")
    cost: ClosedForm = Reciprocal(fixed=fixed, factor=factor)
    if form == "exponential":
        cost = Exponential(fixed=fixed, factor=factor, scale=scale)
    return Process(name=form, cost=cost, minimum=own.smallest, maximum=own.largest).rescaled(ARCSECOND)


@dataclass(frozen=True, kw_only=True)
class AngularAllocation:
    """Cheapest tolerances for fixed gains of the adjustment."""

    gains: Gains  # Gains of the adjustment, and what they leave of part errors and noise
    # Tolerance of every part about its own axes, ±, three standard deviations [rad]
    tolerances: Float[np.ndarray, "part 3"]
    cost: float  # Cost of the tolerances [cost units]
    effort_cost: float  # Price of the expected effort [cost units]
    # Lower bound on the total of all tolerances that keep the limits with these gains; no solver's word [cost units]
    bound: float
    limits: AngularLimits  # What is limited
    spread: Float[np.ndarray, " limit"]  # Three standard deviations of what is limited [rad]
    prices: Float[np.ndarray, " limit"]  # Cost saved by widening every limit [cost units/rad]

    @property
    def total(self) -> float:
        """Cost of tolerances and effort [cost units]."""
        return self.cost + self.effort_cost

    @property
    def gap(self) -> float:
        """Total over its lower bound, minus one [-]."""
        return self.total / self.bound - 1


def allocated(plan: AssemblyPlan, gains: Gains) -> AngularAllocation | None:
    """Return the cheapest tolerances for given gains, or None where no tolerances keep the limits."""
    problem = angular_problem(plan, gains.errors)
    found = allocate(problem)
    if not isinstance(found, Solution):
        return None
    limits, budgets = angular_limits(plan), np.array([stack.budget for stack in problem.stacks])
    tolerances, price = found.zones.reshape(-1, 3) * ARCSECOND, requirements_of(plan).effort_price
    return AngularAllocation(
        gains=gains,
        tolerances=tolerances,
        cost=found.cost - float(problem.losses @ found.zones**2),
        effort_cost=price * gains.errors.expected_effort((tolerances / 3).ravel() ** 2),
        bound=found.bound + price * gains.errors.noise_effort,
        limits=limits,
        spread=limits.spread(gains.errors, tolerances),
        # The budget is √(limit² − noise²), so its change by the limit is the limit over it.
        prices=found.prices * limits.values / (budgets * ARCSECOND) / ARCSECOND,
    )


def allocate_angles(plan: AssemblyPlan, state_weight: float | None = None) -> AngularAllocation:
    """Return the cheapest tolerances, at the plan's precision or another Q [-], the filter expecting its own."""
    gains = tuned_gains(plan, plan.state_weight if state_weight is None else state_weight, plan.tolerances)
    found = allocated(plan, gains)
    if found is None:
        raise _refusal(plan, gains)
    return found


def _refusal(plan: AssemblyPlan, gains: Gains) -> InputError:
    """Say which limit no tolerances keep, and what would help."""
    limits, smallest = angular_limits(plan), requirements_of(plan).smallest
    noise, spread = limits.noise(gains.errors), limits.spread(gains.errors, np.full_like(plan.tolerances, smallest))
    too_noisy = bool((noise >= limits.values).any())
    at = int(np.argmax((noise if too_noisy else spread) / limits.values))
    left, least, alone, limit = np.array([spread[at], smallest, noise[at], limits.values[at]]) / ARCSECOND
    made = f"the noise alone makes {alone:.4g} arcsec"
    if not too_noisy:
        made = f"the smallest tolerances of {least:g} arcsec make {left:.4g} arcsec, the noise alone {alone:.4g}"
    # Which of these helps depends on the plan; none is promised.
    remedy = "measure or adjust better, expect smaller errors" if too_noisy else "allow smaller tolerances"
    return InputError(
        f"{plan.name}: three standard deviations of the {limits.names[at]} may be {limit:g} arcsec, but at a precision "
        f"of {gains.state_weight:g}, with a filter that expects the stated tolerances, {made}; {remedy}, try another "
        "precision, or widen the limit."
    )


@dataclass(frozen=True, kw_only=True)
class AngularVerification:
    """What a sample of assemblies shows of an allocation."""

    assemblies: int  # Number of assemblies [-]
    spread: Float[np.ndarray, " limit"]  # Three standard deviations of what is limited [rad]
    standard_error: Float[np.ndarray, " limit"]  # Standard error of the spread [rad]
    shares: tuple[Interval, ...]  # Share of the assemblies within each limit
    share: Interval  # Share within all limits at once


def verify_angles(
    plan: AssemblyPlan, allocation: AngularAllocation, seeds: SeedTree, assemblies: int = 100_000
) -> AngularVerification:
    """Return what assemblies of normally distributed parts, readings and adjustments show of an allocation.

    An assembly is within a tilt limit where √(x² + y²) is, which is not what three standard deviations of x and y
    together promise of one normal angle: of assemblies that just keep a limit 99.73 % are within it where the tilt has
    one direction only, and 1 − exp(−9) = 99.988 % where it has none.
    """
    squares = []
    for index, start in enumerate(range(0, assemblies, CHUNK)):
        # A whole chunk is drawn, so that the first assemblies are the same however many follow.
        standard = seeds.generator(index).standard_normal((CHUNK, random_numbers(plan.space)))[: assemblies - start]
        squares.append(assembled(plan, allocation.gains, allocation.tolerances, standard).adjusted[:, -1] ** 2)
    limited = np.concatenate(squares) @ allocation.limits.counted.T
    variance = limited.mean(axis=0)
    within: Bool[np.ndarray, "assembly limit"] = limited <= allocation.limits.values**2
    return AngularVerification(
        assemblies=assemblies,
        spread=3 * np.sqrt(variance),
        # That of a mean, through the derivative of the square root.
        standard_error=3 * limited.std(axis=0, ddof=1) / np.sqrt(assemblies) / (2 * np.sqrt(variance)),
        shares=tuple(wilson_interval(assemblies, int(each)) for each in within.sum(axis=0)),
        share=wilson_interval(assemblies, int(within.all(axis=1).sum())),
    )


@dataclass(frozen=True, kw_only=True)
class RetunedAllocation:
    """Allocations with filters that expect the tolerances of the one before."""

    allocations: tuple[AngularAllocation, ...]  # The allocations; the first filter expects the plan's own tolerances
    settled: bool  # Whether the last filter expects the tolerances that are allocated with it

    @property
    def best(self) -> AngularAllocation:
        """The cheapest; its bound holds for its own gains, not for all filters."""
        return min(self.allocations, key=lambda each: each.total)


def retuned_allocation(plan: AssemblyPlan, most_filters: int = 100) -> RetunedAllocation:
    """Return allocations whose filters are tuned again until the tolerances settle.

    Every allocation keeps the limits with its own gains, so each is one that can be built, whether or not the iteration
    settles. Gains and tolerances together are not a convex program: neither the fixed point nor the best of the
    allocations is claimed to be the cheapest of all filters. The iteration ends where no tolerances keep the limits.
    """
    found, settled = [allocate_angles(plan)], False
    while len(found) < most_filters and not settled:
        last = found[-1]
        following = allocated(plan, tuned_gains(plan, last.gains.state_weight, last.tolerances))
        if following is None:
            break
        found.append(following)
        settled = bool(np.abs(following.tolerances / last.tolerances - 1).max() <= _TOLERANCES_SETTLED)
    return RetunedAllocation(allocations=tuple(found), settled=settled)


@dataclass(frozen=True, kw_only=True)
class StateWeightCost:
    """Costs over the precision, and the allocation at the best one."""

    state_weights: Float[np.ndarray, " state_weight"]  # Q [-]
    # Cost of the tolerances; not a number where none keep the limits [cost units]
    cost: Float[np.ndarray, " state_weight"]
    effort_cost: Float[np.ndarray, " state_weight"]  # Price of the expected effort; likewise [cost units]
    best: AngularAllocation  # Allocation at the best precision

    @property
    def total(self) -> Float[np.ndarray, " state_weight"]:
        """Cost of tolerances and effort [cost units]."""
        return np.asarray(self.cost + self.effort_cost)

    @property
    def interior(self) -> bool:
        """Whether the curve has points that cost more on both sides of its best one."""
        at = int(np.nanargmin(self.total))
        return 0 < at < self.state_weights.size - 1 and bool(np.isfinite(self.total[at - 1 : at + 2]).all())


def best_state_weight(
    plan: AssemblyPlan, lowest: float = 0.1, highest: float = 100.0, points: int = 41
) -> StateWeightCost:
    """Return what tolerances and effort cost over the precision, with the filter of the plan's tolerances.

    The points of the curve are evenly spread by their logarithms; the best one is looked for between the lowest and the
    highest [-].

    The best of the points is refined between its neighbours. The total need not have one minimum alone, so what lies
    between other points is not searched.
    """
    if not 0 < lowest < highest < inf or points < 3:
        allowed = "two numbers above 0, the smaller one first, and 3 points or more"
        raise InputError.at(plan.name, "range and points of the precision", (lowest, highest, points), allowed)
    state_weights = np.geomspace(lowest, highest, points)
    found = [_at(plan, float(state_weight)) for state_weight in state_weights]
    cost = np.array([np.nan if each is None else each.cost for each in found])
    effort_cost = np.array([np.nan if each is None else each.effort_cost for each in found])
    if np.isnan(cost).all():
        allowed = "one where some tolerances keep the limits"
        raise InputError.at(plan.name, "range of the precision", (lowest, highest), allowed)
    at = int(np.nanargmin(cost + effort_cost))
    around = np.log(state_weights[[max(at - 1, 0), min(at + 1, points - 1)]])
    refined = minimize_scalar(
        lambda q: _total(plan, exp(q)), bounds=around, method="bounded", options={"xatol": _STATE_WEIGHT_SETTLED}
    )
    return StateWeightCost(
        state_weights=state_weights,
        cost=cost,
        effort_cost=effort_cost,
        best=min(filter(None, (found[at], _at(plan, exp(refined.x)))), key=lambda each: each.total),
    )


def _at(plan: AssemblyPlan, state_weight: float) -> AngularAllocation | None:
    return allocated(plan, tuned_gains(plan, state_weight, plan.tolerances))


def _total(plan: AssemblyPlan, state_weight: float) -> float:
    """Return the least total at a precision, infinite where no tolerances keep the limits [cost units]."""
    found = _at(plan, state_weight)
    return inf if found is None else found.total
