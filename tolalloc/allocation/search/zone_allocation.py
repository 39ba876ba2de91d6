"""From requirements to a verified allocation: steps of the convex program, and proportional scaling beside it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.lower_bound import LowerBound, lower_bound
from tolalloc.allocation.search.pattern_search import by_pattern
from tolalloc.allocation.search.steering import (
    LARGEST_LOG,
    REACH_OF_MODELS,
    REACH_OF_SETTINGS,
    SETTLED,
    Programs,
    aimed_stacks,
    explains,
    is_similar,
    steering,
)
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.effort import SearchEffort
from tolalloc.allocation.space.problem import Solution, Stack
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier, cheapest_met
from tolalloc.exceptions import FailedUnitsError, InputError, SolveError

_LEAST_RISE = 1e-6
"""What all zones together take of a limit is at least so much of the limit, where it is what a step divides by [-]."""

_TWO_SIGMA = (0.0227501319, 0.5, 0.9772498681)
"""Shares of a normal output below its median less and plus two standard deviations, and below its median [-]."""


def limit_parts(
    values: Float[np.ndarray, " unit"], limits: Float[np.ndarray, " side"], prices: Float[np.ndarray, " side"]
) -> Float[np.ndarray, " side"]:
    """Return the price of each limit of an output that keeps its units between two [cost units per its unit].

    Theory page equation (110), own derivation: each as units lie just at it, by the normal density of its side's spread
    between the median and the 2σ quantile. Exact where the output is normal and its middle stays.

    Examples
    --------
    A price of 2 on one of two limits equally far from the middle is 1 on each:

    >>> limit_parts(np.linspace(-3, 3, 1001), np.array([3.0, -3.0]), np.array([2.0, 0.0])).round(9).tolist()
    [1.0, 1.0]
    """
    good = values[np.isfinite(values)]
    low, middle, high = np.quantile(good, _TWO_SIGMA) if good.size else (np.nan,) * 3
    distances = np.abs(limits - middle)
    spreads = np.where(limits > middle, high - middle, middle - low) / 2
    if not (prices.any() and np.all(spreads > 0)):
        return prices
    exponents = -((distances / spreads) ** 2) / 2
    densities = np.exp(exponents - exponents.max()) / spreads
    return np.asarray(densities * (prices @ distances) / (densities @ distances))


def scale_in_proportion(verifier: Verifier, steps: int) -> tuple[VerifiedDesign, ...]:
    """Return designs with all zones scaled alike, the first the tolerance table as it is.

    Notes
    -----
    The next scale is 1 + left/rise times this one, with what is left of a limit, a standard error kept, and what all
    zones together take of it, the tightest limit counting and at most a factor of 2.5, until a met design has next to
    nothing left to gain.

    sₖ₊₁ = sₖ·clip(1 + left/rise, 0.4, 2.5) (own derivation); exact in one step where a quantile is in
    proportion to the zones. Where too many units of a scale have no answer, half of the way to it is gone.
    """
    space, scale, factor = verifier.space, 1.0, 1.0
    widest = float(space.upper[: len(space.groups)].max())  # beyond it no zone lies inside its range
    tried: list[VerifiedDesign] = []
    for step in range(steps):
        try:  # the stream of random units keeps the name that it had
            verified = verifier.verify(space.uniform(scale), f"by hand {step + 1}").evenly_divided()
        except FailedUnitsError:
            if not tried:
                raise
            factor = float(np.sqrt(factor))  # half of the way, where fewer units are without an answer
            scale /= factor
            continue
        tried.append(verified)
        factor = min(_factor(verified), widest / scale)
        if verified.met and factor < 1 + SETTLED:
            break
        scale *= factor
    return tuple(tried)


def _factor(tried: VerifiedDesign) -> float:
    """Return the common factor of all scales that takes a design to its limits, each kept alone [-].

    What keeps all limits at once by so few units is too uncertain to tighten all zones for it; the search comes to it.
    """
    factors = []
    for constraint in tried.alone:
        rise = float(constraint.stack.load(tried.scales, np.zeros(tried.settings.size)))
        budget = -float(constraint.predicted(tried.design)) - constraint.standard_error
        factors.append(1 + budget / max(rise, _LEAST_RISE * constraint.scale))
    return float(np.clip(min(factors), 0.4, 2.5))


ROUNDING = 1e-9
"""Part of a budget by which rounding may lay a load that is its own budget beyond it [-]."""
_REPAIRS = 1
"""Steps more where the last design does not quite keep the limits and is cheaper than any that does [-]."""
_WORTH = (1e-4, 0.003)
"""Relative gain of cost that the next step must promise for a search to go on from a met design [-].

As much as its units err, over the deviation of an output, and between these.
"""
_AGAIN = 0.02
"""Excess up to which a step aims as far inside as the last one lay beyond, over the deviation of an output [-]."""
_LEAST_REACH = 1.05
"""Ratio of zones below which a step does not fall back where units have no answer [-]."""
_SCALED_WITHIN = 0.05
"""Part of a common factor, and of its cost, within which it is told as what one factor takes [-]."""
_PROMISED = 0.02
"""Excess up to which a step is taken to keep its limits, over the deviation of an output [-]."""
_EXPLAINED = 2.0
"""Standard errors by which a verified value may be off its prediction for the region to keep its size [-]."""


def aimed(last: VerifiedDesign, tried: list[VerifiedDesign], margin: float = 1.0) -> tuple[Stack, ...]:
    """Return the local models of a design with the budget to aim at.

    Parameters
    ----------
    tried
        It and all designs before it.
    margin
        How far inside each limit the aim is [standard errors].
    """
    similar = [item.divided(last.parts) for item in tried if is_similar(item, last)]
    return aimed_stacks(last.constraints, [(item.design, item.constraints) for item in similar], margin)


@dataclass(frozen=True, kw_only=True)
class ModelRange:
    """Where the local models of a design are believed, and what other verified designs there say of them."""

    factor: float  # Ratio of a zone to the verified one up to which they are [-]
    designs: int  # Other verified designs whose zones and settings all lie in this range [-]
    # Largest difference of their verified values from what the models predict, noise of the units included, one per
    # limited side alone; not a number without such designs [unit of the output]
    off: tuple[float, ...]


def model_range(chosen: VerifiedDesign, tried: Iterable[VerifiedDesign]) -> ModelRange:
    """Return where the local models of a design are believed, which is where a search lets designs share them.

    off = max |excess − predicted excess − relief·change of the scales| over the other designs (own derivation).

    Parameters
    ----------
    tried
        Designs that were verified, whatever their members and steps are.
    """
    zones, groups, sides = chosen.space.zones(chosen.design), chosen.scales.size, chosen.alone
    compared = []
    for own in tried:
        ratios = own.space.zones(own.design) / zones
        same = np.array_equal(own.design, chosen.design) and np.allclose(ratios, 1.0)
        moved = np.abs(own.settings - chosen.settings) / (10 * chosen.space.setting_steps)
        if same or np.abs(np.log(ratios)).max() > LARGEST_LOG or moved.max(initial=0.0) > REACH_OF_SETTINGS:
            continue
        design = own.design_in(chosen.space)
        wider = design[:groups] - chosen.scales
        predicted = [float(side.predicted(design) + side.relief @ wider) for side in sides]
        compared.append(np.abs(np.subtract([side.excess for side in own.alone], predicted)))
    off = np.max(compared, axis=0).tolist() if compared else [float("nan")] * len(sides)
    return ModelRange(factor=REACH_OF_MODELS, designs=len(compared), off=tuple(off))


def kept_stacks(
    chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...], margin: float, room: float = 0.0
) -> tuple[Stack, ...]:
    """Return the models of a design whose budget is what is aimed at, or what the design itself takes of it.

    Parameters
    ----------
    tried
        All designs of its search, which tell how lucky its own sample was.
    margin
        How far inside each limit the aim is; 0 for the limits themselves [standard errors].
    room
        Part of a budget that is added, as rounding may lay a load that is its own budget beyond it [-].

    Notes
    -----
    budget′ = max(aimed budget, load of the design) (own derivation), so that the design itself is always allowed.
    """
    loads = [float(constraint.stack.load(chosen.scales, chosen.settings)) for constraint in chosen.constraints]
    stacks = aimed(chosen, list(tried), margin)
    budgets = [max(stack.budget, load) for stack, load in zip(stacks, loads, strict=True)]
    return tuple(replace(own, budget=most + room * abs(most)) for own, most in zip(stacks, budgets, strict=True))


def step_from(
    last: VerifiedDesign, known: Sequence[VerifiedDesign], margin: float, reach: float
) -> Float[np.ndarray, " variable"]:
    """Return the cheapest design near a verified one that its models let keep the limits, made by the same processes.

    Parameters
    ----------
    last
        The verified design.
    known
        Designs that correct its models, itself among them.
    margin
        How far inside each limit the aim is [standard errors].
    reach
        Factor by which a variable may change [-].
    """
    processes = last.space.process_positions(last.design)
    return Programs(last.space).step(steering(last, known, margin).moved_out(_AGAIN), processes, last.design, reach)


def promised(start: VerifiedDesign, reach: float) -> tuple[float, float]:
    """Return how far beyond its limits the next step from a design lies [-] and what it costs [cost units].

    As its units say; within the limits is one as good as another.
    """
    programs, goal = Programs(start.space), steering(start, [start])
    found = programs.step(goal, start.space.process_positions(start.design), start.design, reach)
    return max(goal.excess(found), _PROMISED), float(start.space.cost(found))


def step_to_optimum(verifier: Verifier, start: VerifiedDesign, steps: int, reach: float) -> tuple[VerifiedDesign, ...]:
    """Return the designs of a trust-region sequence; each is verified on its own random units before the next is made.

    Parameters
    ----------
    verifier
        Verifies the designs and gives the convex models around each.
    start
        A verified design to start from.
    steps
        Largest number of verified designs, but for up to three that mend the last one [-].
    reach
        Factor by which a variable may change in the first step [-].

    Notes
    -----
    Every step is the cheapest design near by that the units of the last one let keep the limits, each with its own
    derivatives: where all limits are kept at once, a unit fails the one that it lies furthest beyond, and no failures
    need be divided.

    Where the units of a step are further from the prediction than chance explains, by more than two standard errors of
    both, the next step reaches less: the square root of the factor, 1.25 at least. So it does, 1.05 at least, where
    too many of its units have no answer.

    References
    ----------
    A. R. Conn, N. I. M. Gould, Ph. L. Toint, Trust-Region Methods, SIAM (2000); K. Svanberg, The method of moving
    asymptotes, Int. J. Numer. Meth. Eng. 24 (1987) 359–373, for convex models that are made anew at every design.

    Examples
    --------
    Least 1/a + 1/b with (3a)² + (4b)² ≤ 5² is where a/b = (4/3)^⅔.

    >>> from tests.builders import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    >>> start = verifier.verify(verifier.space.uniform(1.0), "as drawn")
    >>> step_to_optimum(verifier, start, steps=3, reach=2.0)[-1].scales.round(3).tolist()
    [1.121, 0.925]
    """
    space, tried = verifier.space, [start]
    programs, processes = Programs(space), space.process_positions(start.design)
    for step in range(steps + _REPAIRS):
        last, kept = tried[-1], [own.cost for own in tried if own.met]
        worth = float(np.clip(max((own.error for own in last.quantiles), default=0.0), *_WORTH))
        if step >= steps and (last.met or last.cost >= (1 - worth) * min(kept, default=np.inf)):
            break
        goal = steering(last, tried)
        if step > 0:  # what is missed by as little as units err is missed again where it is aimed at
            goal = goal.moved_out(_AGAIN)
        processes = programs.choose(goal.around(last.design), processes)
        found = programs.step(goal, processes, last.design, reach)
        settled = space.cost(found) > (1 - worth) * last.cost if last.met else np.allclose(found, last.design)
        if step > 0 and settled:
            break
        try:
            tried.append(verifier.verify(found, f"convex {step + 1}").evenly_divided())
        except FailedUnitsError:
            reach = max(_LEAST_REACH, float(np.sqrt(reach)))
            continue
        if not explains(last, tried[-1], _EXPLAINED):
            reach = max(1.25, float(np.sqrt(reach)))
    return tuple(tried[1:])


@dataclass(frozen=True, kw_only=True)
class ZoneAllocation:
    """What the search found."""

    limit: float  # Limit of the leading output, the upper one of two [unit of the output]
    # The cheapest design that random units on the real kernel show to be met, or the least violating one
    chosen: VerifiedDesign
    tried: tuple[VerifiedDesign, ...]  # All designs verified on the way, in order
    # Zones of the tolerance table scaled alike until met, modification as it was; the first is the table itself
    proportional_tried: tuple[VerifiedDesign, ...]
    # Cheapest design of all that the chosen one's convex models let keep the limits; without locked zones
    optimum: Solution
    inside: Solution  # The same one standard error inside the limits, which is where the search aims
    locked_cost: float  # Cost of the locked zones [cost units]

    @property
    def proportional(self) -> VerifiedDesign:
        """The cheapest met design with all zones scaled alike, or the least violating one."""
        return cheapest_met(self.proportional_tried)

    @property
    def proportional_settled(self) -> bool:
        """Whether a little wider a scale is known not to be met: it misses, or it comes to a limit kept alone."""
        best = self.proportional
        missed = max((own.cost for own in self.proportional_tried if not own.met), default=0.0)
        near = (1 - _SCALED_WITHIN) * best.cost < missed < best.cost
        return best.met and (near or _factor(best) < 1 + _SCALED_WITHIN)

    @property
    def baseline(self) -> VerifiedDesign:
        """The tolerance table as it is, modification as it was."""
        return self.proportional_tried[0]

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        """The chosen design's local models with the budget that the search aims at, or that the design takes of it."""
        return kept_stacks(self.chosen, self.tried, margin=1.0)

    @property
    def asked_stacks(self) -> tuple[Stack, ...]:
        """The same with the budget that the limits leave, however far the chosen design lies beyond them."""
        return self.stacks if self.chosen.met else aimed(self.chosen, list(self.tried))

    def with_chosen(self, chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...]) -> ZoneAllocation:
        """Return the allocation with another design, which was found beside those of the search."""
        every = (*self.tried, *tried)
        return replace(
            self,
            chosen=chosen,
            tried=every,
            optimum=_cheapest_by_models(chosen.space, chosen, every, margin=0.0),
            inside=_cheapest_by_models(chosen.space, chosen, every, margin=1.0),
        )

    @cached_property
    def lower_bound(self) -> LowerBound:
        """What no design costs less than, by what is known around the chosen one."""
        return lower_bound(self.chosen)

    @property
    def bound(self) -> float:
        """The same as a number [cost units]."""
        return self.lower_bound.cost

    @property
    def gap(self) -> float:
        """Cost of the chosen design over the bound, minus one [-]."""
        return self.chosen.cost / self.bound - 1

    @property
    def prices(self) -> dict[str, float]:
        """Limited side → cost saved per unit by which its limit is relaxed [cost units per unit of the output].

        Two limits of one output share what both are worth as often as its units lie just at each (`limit_parts`).
        """
        found: dict[str, float] = {}
        for constraint, price in zip(self.chosen.constraints, self.optimum.prices, strict=True):
            found[constraint.stack.name] = found.get(constraint.stack.name, 0.0) + float(price)
        for check in self.chosen.checks:
            # Two limits of a law share the price of the excess beyond both as units lie near them.
            sides, asked = check.steering, check.requirement
            if isinstance(asked.guarantee, AtYield) and len(sides) > 1 and sides[0].law:
                decides = max(sides, key=lambda side: side.excess)
                price, upper = found.pop(decides.stack.name), sides[0].law.upper_part(asked.limits, decides.excess)
                for side, part in zip(sides, (upper, 1.0 - upper), strict=True):
                    found[side.stack.name] = found.get(side.stack.name, 0.0) + price * part
            elif isinstance(asked.guarantee, AtYield) and len(sides) > 1:
                names, limits = [own.stack.name for own in sides], np.array([own.limit for own in sides])
                prices = np.array([found.get(name, 0.0) for name in names])
                found |= zip(names, limit_parts(asked.read(self.chosen.outputs), limits, prices).tolist(), strict=True)
        return found

    @property
    def saving_at_least(self) -> float:
        """Cost saved against proportional scaling that uses its limit up, as a share of its cost [-].

        The quantile grows nearly in proportion to a common scale of all zones, and the cost falls with it.
        """
        unused = min(1.0, self.proportional.constraints[0].value / self.limit)
        return 1 - self.chosen.cost / (self.proportional.cost * unused)


def require_groups(space: DesignSpace, place: str) -> None:
    """Raise unless a zone may change."""
    if not space.groups:
        raise InputError(f"{place}, tolerance table: every zone is locked or zero, so there is nothing to allocate.")


def _cheapest_by_models(
    space: DesignSpace, chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...], margin: float
) -> Solution:
    """Return the cheapest design that the models of a verified one let keep the limits, as far inside as it is."""
    found = process_choice.allocate(space.problem(kept_stacks(chosen, tried, margin, ROUNDING)))
    if not isinstance(found, Solution):
        raise SolveError("The convex program does not reproduce the design that it starts from.")
    return found


def allocate(
    verifier: Verifier,
    proportional_tried: tuple[VerifiedDesign, ...],
    effort: SearchEffort,
    start: VerifiedDesign | None = None,
) -> ZoneAllocation:
    """Return the cheapest verified allocation, or the least violating one with what blocks it.

    Parameters
    ----------
    verifier
        Verifies designs on random units.
    proportional_tried
        Designs with all zones scaled alike, `tolalloc.allocation.search.zone_allocation.scale_in_proportion`.
    start
        A verified design to start from, the best of proportional scaling if there is none; with the reducer's own
        modification it tells tolerances alone from tolerances and modification together.
    """
    first, space = start or cheapest_met(proportional_tried), verifier.space
    # Proportional scaling has no bounds; a start that keeps them is an answer like any other.
    stepped = step_to_optimum(verifier, first, effort.steps, effort.reach)
    tried = ((first,) if space.allows(first.design) else ()) + stepped
    if not tried:
        raise FailedUnitsError("Of every drawing inside the ranges that was tried too many units have no answer.")
    if found := by_pattern(verifier, cheapest_met(tried)):
        tried = (*tried, found)
    chosen = cheapest_met(tried).evenly_divided()
    return ZoneAllocation(
        limit=verifier.limit,
        chosen=chosen,
        tried=tried,
        proportional_tried=proportional_tried,
        optimum=_cheapest_by_models(space, chosen, tried, margin=0.0),
        inside=_cheapest_by_models(space, chosen, tried, margin=1.0),
        locked_cost=space.locked_cost,
    )
