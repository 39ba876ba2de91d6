"""What settings and yields are worth: the cheapest zones for every choice of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.zone_allocation import Programs, ZoneAllocation
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.problem import Solution
from tolalloc.models.model import Evaluation, Model


@dataclass(frozen=True, kw_only=True)
class QuantileResponse:
    """Quantile of an output of a design, on the real model with common random numbers.

    Notes
    -----
    Mean + spread·σ of a few hundred shared units varies smoothly from design to design; the empirical quantile of
    so few would not. The spread is calibrated on large samples, and every design that counts is verified on one.
    """

    space: DesignSpace  # The design variables
    model: Model  # What answers for single units
    output: str  # Name of the output with its unit
    standard: Float[np.ndarray, "unit column"]  # Standard values of the units that all designs share [-]
    spread: float  # Quantile's distance from the mean over the standard deviation [-]

    @property
    def columns(self) -> tuple[str, ...]:
        """The design variables."""
        return self.space.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return (f"quantile of the {self.output}",)

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
    space
        The design variables.
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
    of what was compared with the limit; at the yield asked for they are the same. What the zones spread is in
    proportion to it, so the weights of the model are, too. Other requirements stay.
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
        """Return the cost of one more unit of a setting, below zero where it saves [cost units per unit]."""
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
    """
    programs = Programs(response.space, len(allocation.asked_stacks))
    known = float(response(allocation.chosen.design[np.newaxis]).values[0, 0])
    found = [_cheapest(response, allocation, programs, known, np.array(choice)) for choice in product(*values)]
    cost, missed = np.array(found).T
    left = missed[np.isfinite(missed)]
    return SettingTrade(
        names=response.space.shared.names,
        values=values,
        cost=cost.reshape([own.size for own in values]) + response.space.locked_cost,
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
    processes = space.process_positions(chosen.design)
    for number in range(_CORRECTIONS):
        corrected = (replace(first, budget=first.budget - missed), *others)
        if number % _CHOSEN_AGAIN == 0 and space.has_choices:
            held = replace(space.shared, lower=settings, upper=settings)
            processes = process_choice.allocate(replace(space.problem(corrected), shared=held)).processes
        program, bounds = programs.of(processes), {"shared_lower": settings, "shared_upper": settings}
        solution = program.solve(corrected, **bounds)
        # Where the model lets nothing keep the limits, it may still be the model that is wrong.
        found = solution or program.least_infeasible(corrected, **bounds)
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
