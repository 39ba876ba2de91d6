"""How wrong costs may be before other zones are cheapest: the price of one zone, and all prices at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.model import Process, Weighted
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.convex_program import ConvexProgram
from tolalloc.allocation.search.discrete import DiscreteProblem, DiscreteSolution, Option
from tolalloc.allocation.search.lagrange_dual import LagrangeDual, ascend
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Solution
from tolalloc.exceptions import SolveError

COST_CHANGE = 0.2
"""Relative change of every cost, up or down, in the box of prices [-]."""
SAME = 0.1
"""Relative difference up to which two zones are called the same; neighbours of a ladder differ by a quarter [-]."""
_SAME_PRICE = 1e-9
"""Relative difference of prices that ends the search for one [-]."""
_PROVEN = 1e-6
"""Gap of a choice that counts as proven [-]."""
_EXCHANGES = 8
"""Largest number of exchanges of zones and their worst prices [-]."""
_HELD = 1e-6
"""Room of a zone that is held, over the zone: a program needs an interior [-]."""


@dataclass(frozen=True, kw_only=True)
class PriceRange:
    """Between which factors the cost of one zone may lie, all others as assumed, so that the zone stays the same."""

    low: float  # 0 where it stays however cheap it gets [-]
    high: float  # Infinite where it stays however dear it gets [-]

    @property
    def nearest(self) -> float:
        """By which factor, up or down, the cost may be wrong at least; infinite where it does not matter [-]."""
        return min(self.high, 1 / self.low if self.low else np.inf)

    @property
    def holds_change(self) -> bool:
        """Whether the zone stays the same with its cost `COST_CHANGE` higher or lower."""
        return self.low <= 1 - COST_CHANGE and self.high >= 1 + COST_CHANGE


def price_ranges(problem: AllocationProblem, optimum: Solution) -> tuple[PriceRange, ...]:
    """Return for every zone the factors of its cost between which the cheapest zone stays within `SAME` of its own.

    Parameters
    ----------
    optimum
        Its cheapest design; processes stay as they are.

    Notes
    -----
    With V(z) the least cost of all other zones where this one is z, the cheapest z at a price t makes t·c(z) + V(z)
    least; V is convex, so that z is cheapest just at t = −V′(z)/c′(z), V′ = Σ λₛ·∂loadₛ/∂z with the prices λ of
    the program in which z is held. t grows with z, so two solves give the range.

    References
    ----------
    Own derivation; A. V. Fiacco, Introduction to sensitivity and stability analysis in nonlinear programming (1983),
    for V′.
    """
    features = zip(problem.features, optimum.processes, strict=True)
    alone = replace(problem, features=tuple(replace(own, processes=(own.processes[at],)) for own, at in features))
    dual = LagrangeDual(alone)
    # Settings give the dual kinks, at which an ascent stops, and planes make it long.
    kinked = dual.planar.any() or problem.shared.names
    worth = _worth_by_program(alone) if kinked else _worth_by_dual(dual, optimum)

    def price(at: int, zone: float) -> float | None:
        (made,) = alone.features[at].processes
        slope = float(made.cost.slope(np.array(zone)))
        own = worth(at, zone) if slope < 0 and made.minimum <= zone <= made.maximum else None
        return None if own is None else own / -slope

    found = []
    for at, zone in enumerate(optimum.zones.tolist()):
        low, high = price(at, zone / (1 + SAME)), price(at, zone * (1 + SAME))
        found.append(PriceRange(low=0.0 if low is None else low, high=np.inf if high is None else high))
    return tuple(found)


Worth = Callable[[int, float], float | None]
"""Returns what less of a zone held at a value is worth to all others, none where they have no room beside it."""


def _worth_by_program(problem: AllocationProblem) -> Worth:
    """Return what tells the worth by the prices of a convex program in which the zone is held."""
    program = ConvexProgram(problem.features, np.zeros(len(problem.features), int), len(problem.stacks), problem.shared)

    def worth(at: int, zone: float) -> float | None:
        lower, upper = program.lower.copy(), program.upper.copy()
        lower[at], upper[at] = zone * (1 - _HELD), zone * (1 + _HELD)
        found = program.solve(problem.stacks, lower=lower, upper=upper)
        if found is None:
            return None
        slopes = [stack.zone_slopes(found.zones)[at] for stack in problem.stacks]
        return float(found.prices @ np.array(slopes)) + 2 * problem.features[at].loss * zone

    return worth


def _worth_by_dual(dual: LagrangeDual, optimum: Solution) -> Worth:
    """Return what tells it by the dual, from the optimum's prices; a bound above the dearest design shows no room."""
    problem = dual.problem
    smallest, largest = np.array([(own.processes[0].minimum, own.processes[0].maximum) for own in problem.features]).T
    dearest = problem.cost(smallest, np.zeros(smallest.size, int)) + float(problem.losses @ largest**2)
    allowed = np.ones(smallest.size, bool)

    def worth(at: int, zone: float) -> float | None:
        held = dual.held(at, zone)
        start = held.price(optimum.prices, held.planes(optimum.zones))
        best = max(ascend(held, start, allowed, dearest), key=lambda priced: held.bound(priced, allowed))
        linear, square = held.zone_prices(best.prices, best.planes)
        return None if held.bound(best, allowed) >= dearest else float(linear[at] + 2 * square[at] * zone)

    return worth


def graded_price_ranges(problem: DiscreteProblem, optimum: DiscreteSolution) -> tuple[PriceRange, ...]:
    """Return for every zone of a ladder the factors of its cost between which it keeps its step.

    Parameters
    ----------
    problem
        The choice among the steps, with the local models.
    optimum
        The cheapest choice.

    Notes
    -----
    With W the least cost of all other zones where one has a step, the step s* stays cheapest against s up to the price
    t = (W(s) − W(s*))/(c(s*) − c(s)). The least t of all coarser steps and the largest of all finer ones are found
    without solving for every step: at a price the cheapest of them has a t of its own, at which the next is looked for,
    until none is cheaper.

    References
    ----------
    M. J. Eisner, D. G. Severance, J. ACM 23 (1976) 619–635, for the breakpoints of a program in one parameter.

    Examples
    --------
    Of two zones at most 4 together, both 2, one grows to 3 where its cost is (1 − 1/2)/(1/2 − 1/3) = 3 times as high.

    >>> from tolalloc.allocation.cost.model import Reciprocal
    >>> from tolalloc.allocation.search.discrete import feature_options
    >>> made = Process(name="ground", cost=Reciprocal(factor=1.0), minimum=0.1, maximum=9.0)
    >>> features = tuple(PricedFeature(name=name, processes=(made,)) for name in "ab")
    >>> from tolalloc.allocation.space.problem import Stack
    >>> stack = Stack(name="gap", worst_case=np.ones(2), root_sum_square=np.zeros(2), budget=4.0)
    >>> steps = tuple(feature_options(one, np.array([1.0, 2.0, 3.0]), ("1", "2", "3")) for one in features)
    >>> problem = DiscreteProblem(problem=AllocationProblem(features=features, stacks=(stack,)), options=steps)
    >>> found = graded_price_ranges(problem, problem.solve())[0]
    >>> round(found.low, 6), round(found.high, 6)
    (0.333333, 3.0)
    """
    _require_proven(optimum)
    return tuple(
        PriceRange(
            low=_break_even(problem, optimum, at, coarser=False), high=_break_even(problem, optimum, at, coarser=True)
        )
        for at in range(len(optimum.options))
    )


def _require_proven(found: DiscreteSolution) -> None:
    if found.gap > _PROVEN:
        raise SolveError("The cheapest of other steps was not proven within the nodes allowed.")


def _break_even(problem: DiscreteProblem, optimum: DiscreteSolution, at: int, *, coarser: bool) -> float:
    """Return the factor of a zone's cost from which on a coarser or a finer step is cheaper, the end where none is."""
    own, loss = optimum.options[at], problem.problem.features[at].loss
    rivals = [step for step in problem.options[at] if (step.zone > own.zone) == coarser and step.zone != own.zone]
    never = np.inf if coarser else 0.0

    def made(step: Option) -> float:
        return step.cost - loss * step.zone**2

    factor = 1.0
    for _ in range(len(rivals) + 1):
        priced = tuple(replace(step, cost=step.cost + (factor - 1) * made(step)) for step in rivals)
        others = (*problem.options[:at], priced, *problem.options[at + 1 :])
        found = replace(problem, options=others).solve() if priced else None
        if found is None:
            return never
        _require_proven(found)
        rival = rivals[priced.index(found.options[at])]
        saved = made(own) - made(rival)
        if saved == 0 or (saved > 0) != coarser:
            return never  # no price tells them apart in this direction
        rest = (found.cost - factor * made(rival)) - (optimum.cost - made(own))
        before, factor = factor, rest / saved
        if np.isclose(factor, before, rtol=_SAME_PRICE):
            break
    return factor if factor > _SAME_PRICE else 0.0


@dataclass(frozen=True, kw_only=True)
class WorstPrices:
    """The prices at which the answer loses most against the zones that are cheapest then."""

    cheapest: Solution  # At these prices
    lost: float  # What the answer costs more than these, at these prices [cost units]
    most: float  # What it costs more at any prices of the box at most, proven [cost units]


def worst_prices(problem: AllocationProblem, optimum: Solution, nodes: int = 100) -> WorstPrices:
    """Return the prices of the box of `COST_CHANGE` at which the answer loses most.

    Parameters
    ----------
    optimum
        Its cheapest design.
    nodes
        Most nodes of the search; with few the proven loss is further from the one found [-].

    Notes
    -----
    max over prices t and zones z of Σ tᵢ·(cᵢ(zᵢ*) − cᵢ(zᵢ)): a zone that costs less than in the answer has its cost
    raised, one that costs more has it lowered. Each process is cut in two where it costs what the answer does, so that
    the branch and bound over processes finds the worst prices, and its bound covers the whole box. The zones found are
    then exchanged with those that are cheapest at their worst prices as long as the loss grows.

    References
    ----------
    Own derivation, as minimax regret with interval costs: I. Averbakh, V. Lebedev, Eur. J. Oper. Res. 154 (2004).
    """
    costs = _costs(problem.features, optimum)
    cut = tuple(
        replace(feature, processes=tuple(_cut(feature, cost)))
        for feature, cost in zip(problem.features, costs, strict=True)
    )
    kept = float(costs.sum() + problem.losses @ optimum.zones**2)
    # Whatever is searched: the answer costs no more than all prices raised say, others no less than all lowered.
    most = (1 + COST_CHANGE) * kept - (1 - COST_CHANGE) * optimum.bound
    start = np.where(costs > np.median(costs), 1 + COST_CHANGE, 1 - COST_CHANGE)  # where no search says better
    with suppress(SolveError):  # no zones within so many nodes, so nothing is proven besides
        searched = process_choice.allocate(replace(problem, features=cut), nodes)
        if isinstance(searched, Solution):
            most, start = min(most, kept - searched.bound), _against(costs, _costs(cut, searched))
    best = _lost(problem, optimum, start)
    for _ in range(_EXCHANGES):
        further = _lost(problem, optimum, _against(costs, _costs(problem.features, best.cheapest)))
        if further.lost <= best.lost:
            break
        best = further
    return replace(best, most=max(most, best.lost))


def _costs(features: Sequence[PricedFeature], found: Solution) -> Float[np.ndarray, " feature"]:
    """Return what every zone costs [cost units]."""
    return np.array(
        [
            float(feature.processes[at].total(np.array(zone)))
            for feature, at, zone in zip(features, found.processes, found.zones, strict=True)
        ]
    )


def _against(answer: Float[np.ndarray, " feature"], other: Float[np.ndarray, " feature"]) -> Float[np.ndarray, "..."]:
    """Return the prices at which an answer loses most against other zones [-]."""
    return np.where(other <= answer, 1 + COST_CHANGE, 1 - COST_CHANGE)


def _lost(problem: AllocationProblem, optimum: Solution, factors: Float[np.ndarray, " feature"]) -> WorstPrices:
    """Return what the answer loses at some prices, which proves nothing of others."""
    features = tuple(_priced(feature, float(by)) for feature, by in zip(problem.features, factors, strict=True))
    changed = replace(problem, features=features)
    found = process_choice.allocate(changed)
    if not isinstance(found, Solution):
        raise SolveError("At other prices the allocation has no solution, although prices change no limit.")
    lost = max(changed.cost(optimum.zones, optimum.processes) - found.cost, 0.0)
    return WorstPrices(cheapest=found, lost=lost, most=np.inf)


def _priced(feature: PricedFeature, factor: float) -> PricedFeature:
    processes = tuple(
        replace(made, cost=Weighted(model=made.cost, weight=factor), change=factor * made.change)
        for made in feature.processes
    )
    return replace(feature, processes=processes)


def _cut(feature: PricedFeature, cost: float) -> Iterator[Process]:
    """Return a feature's processes, cheaper than a cost with their price raised, dearer with it lowered."""
    for made in feature.processes:
        middle = _zone_of_cost(made, cost)
        for low, high, weight in ((made.minimum, middle, 1 - COST_CHANGE), (middle, made.maximum, 1 + COST_CHANGE)):
            if low < high or made.minimum == made.maximum:
                yield replace(
                    made,
                    cost=Weighted(model=made.cost, weight=weight),
                    change=weight * made.change + (1 - weight) * cost,
                    minimum=low,
                    maximum=high,
                )


def _zone_of_cost(made: Process, cost: float) -> float:
    """Return the zone of a process at which it costs so much, or the end of its range that is nearest."""
    from scipy.optimize import brentq

    ends = [float(made.total(np.array(zone))) - cost for zone in (made.minimum, made.maximum)]
    if ends[0] <= 0:
        return made.minimum
    if ends[1] >= 0:
        return made.maximum
    found, *_ = brentq(lambda zone: float(made.total(np.array(zone))) - cost, made.minimum, made.maximum, full_output=1)
    return float(found)
