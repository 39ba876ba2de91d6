"""What settings and yields are worth, and whether the drawing stays the same when assumptions change."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.front.price_region import (
    SAME,
    PriceRange,
    WorstPrices,
    graded_price_ranges,
    price_ranges,
    worst_prices,
)
from tolalloc.allocation.front.uncertain_region import UncertainRegion, Variant, uncertain_region
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.discrete import GradedAllocation
from tolalloc.allocation.search.steering import Programs
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.problem import AllocationProblem, Solution
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Evaluation, Model


@dataclass(frozen=True, kw_only=True)
class QuantileResponse:
    """Quantile of an output of a design, on the real model with common random numbers.

    Notes
    -----
    mean + κ·σ of a few hundred units that all designs share varies smoothly from design to design; the empirical
    quantile of so few would not. The spread κ is that of a verified design, (quantile − mean)/σ on its large sample,
    and every design that counts is verified on one of its own.
    """

    space: DesignSpace  # The design variables
    model: Model  # What answers for single units
    output: str  # Name of the output with its unit
    standard: Float[np.ndarray, "unit column"]  # Standard values of the units that all designs share [-]
    spread: float  # Quantile's distance from the mean over the standard deviation [-]

    def __call__(self, x: Float[np.ndarray, "design variable"]) -> Evaluation:
        """Return the quantile of every design; a design with a failed unit is a failed sample."""
        values, status = np.empty((x.shape[0], 1)), np.zeros(x.shape[0], np.uint8)
        for at, design in enumerate(x):
            response = self.model.at(self.space.settings_of(design)).reading((self.output,))
            evaluation = response(self.space.errors.deviations(self.standard, self.space.zones(design)))
            units = evaluation.values[evaluation.good, 0]
            values[at, 0] = units.mean() + self.spread * units.std(ddof=1) if units.size > 1 else np.nan
            status[at] = evaluation.status.max()
        return Evaluation(values=values, status=status)


def cost_at_yield(space: DesignSpace, allocation: ZoneAllocation, target: float) -> float:
    """Return the cost of the cheapest design that keeps another yield [cost units].

    Parameters
    ----------
    allocation
        What was found for the yield asked for; its local models are used.
    target
        Share of units that must keep the limit of the leading output [-].

    Returns
    -------
    float
        The cost, not a number where no design keeps the yield, or where the verified units are too few to show it.

    Notes
    -----
    The smallest limit that the verified units show kept at the other yield, with the same confidence, takes the place
    of what was compared with the limit; at the yield asked for they are the same. What the zones spread, s, is in
    proportion to it, so the weights of the model are, too: all are multiplied by (s + shown − compared)/s. Other
    requirements stay. It holds near the verified yield, where the shape of the output's tail does.

    Own derivation, w′ = w·(s + shown − compared)/s.

    Examples
    --------
    99 % of a normal sum needs less than 99.73 %: the cost falls.

    >>> from tolalloc.allocation.search.zone_allocation import allocate, scale_in_proportion
    >>> from tolalloc.allocation.space.effort import SearchEffort
    >>> from tolalloc.allocation.space.requirement import AtYield
    >>> from tests.builders import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0, guarantee=AtYield(0.9973))
    >>> found = allocate(verifier, scale_in_proportion(verifier, 3), SearchEffort(steps=1))
    >>> round(found.chosen.cost, 1), round(cost_at_yield(verifier.space, found, 0.99), 1)
    (2.0, 1.7)
    """
    chosen, (first, *others) = allocation.chosen, allocation.asked_stacks
    shown = chosen.shown_at(target)
    if not np.isfinite(shown):
        return np.nan
    spread = float(first.load(chosen.scales, np.zeros(chosen.settings.size)))
    factor = max(spread + shown - chosen.quantile_bound, 0.0) / spread
    changed = replace(first, worst_case=factor * first.worst_case, root_sum_square=factor * first.root_sum_square)
    found = process_choice.allocate(space.problem((changed, *others)))
    return found.cost + space.locked_cost if isinstance(found, Solution) else np.nan


_CORRECTIONS = 6
"""Largest number of corrections of the model of the leading output, on the real one, for every choice [-]."""
_CHOSEN_AGAIN = 2
"""Corrections after which processes are chosen again [-]."""
_SETTLED = 1 / 1200
"""What the corrected model may still miss, over the limit: 0.05″ of 60″ [-]."""


@dataclass(frozen=True, kw_only=True)
class SettingTrade:
    """Least cost over the settings."""

    names: tuple[str, ...]  # Names of the settings with their units
    values: tuple[Float[np.ndarray, " _step"], ...]  # Values of each that were tried, ascending [unit of the setting]
    # Cost of the cheapest zones that keep the requirements there, one axis for each setting; not a number where none
    # do, or where a unit of the real model has no answer [cost units]
    cost: Float[np.ndarray, "..."]
    # Root-mean-square of what is left between the local and the real model after the last correction, not a number
    # where no choice has a cost [unit of the leading output]
    error: float

    @property
    def cheapest(self) -> Float[np.ndarray, " setting"]:
        """The settings with the cheapest zones, not numbers where no choice has a cost [units of the settings]."""
        if np.isnan(self.cost).all():
            return np.full(len(self.names), np.nan)
        at = np.unravel_index(int(np.nanargmin(self.cost)), self.cost.shape)
        return np.array([own[place] for own, place in zip(self.values, at, strict=True)])

    def price(self, setting: int) -> Float[np.ndarray, "..."]:
        """Return the cost of one more unit of a setting, below zero where it saves [cost units per unit].

        Second-order differences over unevenly spaced values, one-sided at the ends; not numbers with one value alone.
        """
        along = self.values[setting]
        if along.size < 2:
            return np.full(self.cost.shape, np.nan)
        return np.asarray(np.gradient(self.cost, along, axis=setting))


def setting_trade(
    response: QuantileResponse, allocation: ZoneAllocation, values: tuple[Float[np.ndarray, " _step"], ...]
) -> SettingTrade:
    """Return the cost of the cheapest zones for every choice of settings.

    Parameters
    ----------
    response
        Quantile of the leading output of a design on the real model, common random numbers.
    allocation
        What was found with all settings free; its local models are used.
    values
        Values of each setting, in ascending order [unit of the setting].

    Notes
    -----
    Far from the chosen design its models are off, so for every choice the program is solved, the real model runs the
    found design, and the budget of the leading output is corrected by what the local model missed; then again, until it
    misses little. Every choice has processes of its own. Other requirements keep their models.

    Corrections are secant steps mₖ₊₁ = mₖ + e/(1 − min(e/e₋, 0)) (own derivation).

    Examples
    --------
    Without settings it is the least cost itself, 1.9731 of `lower_bound`.

    >>> from tolalloc.allocation.search.zone_allocation import allocate, scale_in_proportion
    >>> from tolalloc.allocation.space.effort import SearchEffort
    >>> from tests.builders import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    >>> found = allocate(verifier, scale_in_proportion(verifier, 3), SearchEffort(steps=1))
    >>> standard = np.random.default_rng(1).normal(size=(500, 2)) / 6
    >>> response = QuantileResponse(
    ...     space=verifier.space, model=verifier.model, output="y [mm]", standard=standard, spread=3.0
    ... )
    >>> round(float(setting_trade(response, found, ()).cost), 4)
    1.9731
    """
    programs = Programs(response.space)
    known = float(response(allocation.chosen.design[np.newaxis]).values[0, 0])
    found = [_cheapest(response, allocation, programs, known, np.array(choice)) for choice in product(*values)]
    cost, missed = np.array(found).T
    left = missed[np.isfinite(missed)]
    return SettingTrade(
        names=response.space.shared.names,
        values=values,
        cost=np.asarray(cost.reshape([own.size for own in values]) + response.space.locked_cost),
        error=float(np.sqrt(np.mean(left**2))) if left.size else np.nan,
    )


def _cheapest(
    response: QuantileResponse,
    allocation: ZoneAllocation,
    programs: Programs,
    known: float,
    settings: Float[np.ndarray, " setting"],
) -> tuple[float, float]:
    """Return the least cost at given settings, and what the model last missed there [unit of the output]."""
    space, chosen, (first, *others) = response.space, allocation.chosen, allocation.asked_stacks
    model, missed, cost, error = chosen.constraints[0], 0.0, np.nan, np.inf
    processes, held = space.process_positions(chosen.design), replace(space.shared, lower=settings, upper=settings)
    for number in range(_CORRECTIONS):
        corrected = (replace(first, budget=first.budget - missed), *others)
        if number % _CHOSEN_AGAIN == 0 and space.has_choices:
            processes = process_choice.allocate(replace(space.problem(corrected), shared=held)).processes
        program = programs.of(processes, len(corrected))
        solution = program.solve(corrected, shared=held)
        # Where the model lets nothing keep the limits, it may still be the model that is wrong.
        found = solution or program.least_infeasible(corrected, shared=held)
        design = np.concatenate([found.zones, found.shared])
        answered = response(design[np.newaxis])
        if not answered.good[0]:
            return np.nan, np.nan
        rise = float(model.predicted(design) - model.predicted(chosen.design))
        cost, before = solution.cost if solution else np.nan, error
        error = model.sign * (float(answered.values[0, 0]) - known) - rise - missed
        if abs(error) > _SETTLED * model.scale:
            missed += error / (1 - min(error / before, 0.0))  # the secant where corrections swing to and fro
        elif number >= _CHOSEN_AGAIN or not space.has_choices:
            break
        else:
            error = np.inf  # the next processes are another curve
    return (cost, error) if np.isfinite(cost) else (np.nan, np.nan)


@dataclass(frozen=True, kw_only=True)
class Robustness:
    """Answers under changed assumptions."""

    groups: tuple[str, ...]  # Names of the groups
    optimum: Float[np.ndarray, " group"]  # The undisturbed answer of the same local models [-]
    prices: tuple[PriceRange, ...]  # Of every group, while its zone stays within `SAME` of the optimum
    # Of every group, while its zone keeps its step of the ladder; none without ladders or a proof
    graded: tuple[PriceRange, ...]
    worst: WorstPrices  # Of the box in which every cost changes by `COST_CHANGE`
    at_worst: Variant  # The answer at these prices
    uncertain: UncertainRegion | None  # Of what is uncertain of the model; none where nothing is
    second_best: Variant | None  # With the second-best set of processes, none where there is no other

    @property
    def variants(self) -> tuple[Variant, ...]:
        """All of them."""
        uncertain = self.uncertain.least_favourable if self.uncertain else None
        return tuple(own for own in (self.at_worst, uncertain, self.second_best) if own)

    @property
    def ratios(self) -> Float[np.ndarray, "change group"]:
        """Scale under the changed assumption over the undisturbed one, the ends of what is uncertain too [-]."""
        ends = self.uncertain.ratios if self.uncertain else np.empty((0, len(self.groups)))
        return np.vstack([*(variant.scales / self.optimum for variant in self.variants), ends])

    @property
    def same(self) -> Bool[np.ndarray, " group"]:
        """Which zones stay within `SAME` under all changes, and with their own cost `COST_CHANGE` higher or lower."""
        alone = np.array([own.holds_change for own in self.prices])
        return np.asarray((np.abs(np.log(self.ratios)) <= np.log(1 + SAME)).all(axis=0) & alone)


def robustness(
    verifier: Verifier, allocation: ZoneAllocation, nodes: int, graded: GradedAllocation | None = None
) -> Robustness:
    """Return the answers under changed costs, models and processes.

    Parameters
    ----------
    verifier
        Verifies the chosen design again with every changed model.
    nodes
        Most nodes of the search for the worst prices [-].
    graded
        What was found on ladders of zones, if that was asked for.

    Notes
    -----
    Costs and processes are changed in the local models of the chosen design (`price_region`), what is uncertain of the
    model in those of the changed model (`uncertain_region`).

    regret = cost of the answer / cost of the changed answer − 1 (own derivation) [-].

    Examples
    --------
    With every cost 20 % up or down the answer loses less than 1 %.

    >>> from tolalloc.allocation.search.zone_allocation import allocate, scale_in_proportion
    >>> from tolalloc.allocation.space.effort import SearchEffort
    >>> from tests.builders import verifier_of_sum
    >>> verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    >>> found = allocate(verifier, scale_in_proportion(verifier, 3), SearchEffort(steps=1))
    >>> robustness(verifier, found, nodes=10).at_worst.regret < 0.01
    True
    """
    problem, optimum, locked = verifier.space.problem(allocation.stacks), allocation.inside, allocation.locked_cost
    worst = worst_prices(problem, optimum, nodes)
    cost, steps = worst.cheapest.cost + locked, tuple[PriceRange, ...]()
    if graded and graded.chosen.met:
        with suppress(SolveError):  # a choice that is not proven would claim too much
            steps = graded_price_ranges(graded.problem, graded.solution)
    return Robustness(
        groups=verifier.space.groups,
        optimum=optimum.zones,
        prices=price_ranges(problem, optimum),
        graded=steps,
        worst=worst,
        at_worst=Variant(
            name="worst prices found", scales=worst.cheapest.zones, cost=cost, regret=worst.lost / cost, kept=True
        ),
        uncertain=uncertain_region(verifier, allocation),
        second_best=_second_best(problem, optimum, locked),
    )


def _second_best(problem: AllocationProblem, optimum: Solution, locked: float) -> Variant | None:
    """Return the answer made by the second-best set of processes, none if there is no other."""
    if all(len(feature.processes) == 1 for feature in problem.features):
        return None
    found = process_choice.second_best(problem, optimum)
    if found is None:
        return None
    changed = [
        f"{feature.name} by {feature.processes[now].name}"
        for feature, now, before in zip(problem.features, found.processes, optimum.processes, strict=True)
        if now != before
    ]
    return Variant(
        name=f"second-best processes: {', '.join(changed)}",
        scales=found.zones,
        cost=found.cost + locked,
        regret=(optimum.cost + locked) / (found.cost + locked) - 1,
        kept=True,
    )
