"""From requirements to a verified allocation: steps of the convex program, and proportional scaling beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.effort import SearchEffort
from tolalloc.allocation.lower_bound import LowerBound, lower_bound
from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.problem import Solution, Stack
from tolalloc.allocation.trust_region import aimed, kept_stacks, step_to_optimum
from tolalloc.allocation.verification import VerifiedDesign, Verifier, answer
from tolalloc.exceptions import InputError, SolveError


@dataclass(frozen=True, kw_only=True)
class ZoneAllocation:
    """What the search found."""

    limit: float  # Limit of the leading output, the upper one of two [unit of the output]
    # The cheapest design that fresh units on the real kernel show to be met, or the least violating one
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
        return answer(self.proportional_tried)

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
            optimum=cheapest_by_models(chosen.space, chosen, every, margin=0.0),
            inside=cheapest_by_models(chosen.space, chosen, every, margin=1.0),
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
        """Limited side → cost saved per unit by which its limit is relaxed [cost units per unit of the output]."""
        return {
            side.stack.name: float(price) for side, price in zip(self.chosen.sides, self.optimum.prices, strict=True)
        }

    @property
    def saving(self) -> float:
        """Cost saved against proportional scaling, as a share of its cost [-]."""
        return 1 - self.chosen.cost / self.proportional.cost

    @property
    def saving_at_least(self) -> float:
        """The same had proportional scaling used the limit to its last arcsecond: so its cost moved with it [-].

        The quantile grows nearly in proportion to a common scale of all zones, and the cost falls with it.
        """
        unused = min(1.0, self.proportional.quantile_bound / self.limit)
        return 1 - self.chosen.cost / (self.proportional.cost * unused)


def require_groups(space: DesignSpace, place: str) -> None:
    """Raise unless a zone may change.

    Raises
    ------
    InputError
        None may.
    """
    if not space.groups:
        raise InputError(f"{place}, tolerance table: every zone is locked or zero, so there is nothing to allocate.")


def cheapest_by_models(
    space: DesignSpace, chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...], margin: float
) -> Solution:
    """Return the cheapest design that the models of a verified one let keep the limits.

    Parameters
    ----------
    space
        The design variables.
    chosen
        The verified design.
    tried
        All designs of its search.
    margin
        How far inside the limits, as far as the verified design itself is [standard errors].

    Raises
    ------
    SolveError
        The program does not even find the design itself.
    """
    # A load that is its own budget may lie beyond it by rounding.
    kept = kept_stacks(chosen, tried, margin)
    stacks = tuple(replace(stack, budget=stack.budget + 1e-9 * abs(stack.budget)) for stack in kept)
    found = process_choice.allocate(space.problem(stacks))
    if not isinstance(found, Solution):
        raise SolveError(f"{chosen.name}: the convex program does not find the design that it was built around.")
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
        Judges designs on fresh units.
    proportional_tried
        Designs with all zones scaled alike, `tolalloc.allocation.proportional.scale_in_proportion`.
    effort
        How much may be spent.
    start
        A verified design to start from, the best of proportional scaling if there is none; with the reducer's own
        modification it tells tolerances alone from tolerances and modification together.
    """
    first, space = start or answer(proportional_tried), verifier.space
    # Proportional scaling has no bounds; a start that keeps them is an answer like any other.
    tried = ((first,) if space.allows(first.design) else ()) + step_to_optimum(
        verifier, first, effort.steps, effort.reach
    )
    chosen = answer(tried)
    return ZoneAllocation(
        limit=verifier.limit,
        chosen=chosen,
        tried=tried,
        proportional_tried=proportional_tried,
        optimum=cheapest_by_models(space, chosen, tried, margin=0.0),
        inside=cheapest_by_models(space, chosen, tried, margin=1.0),
        locked_cost=space.locked_cost,
    )
