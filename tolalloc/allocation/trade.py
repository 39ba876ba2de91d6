"""What the tooth modification is worth: the cheapest zones for every pair of clearances, the price of a micrometre."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.problem import Stack
from tolalloc.allocation.programs import Programs
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.allocation.search import Allocation

_CORRECTIONS = 6
"""Largest number of corrections of the model of the peak-to-peak, on the kernel, for every pair of clearances [-]."""
_CHOSEN_AGAIN = 2
"""Corrections after which processes are chosen again [-]."""
_SETTLED = 0.05
"""What the corrected model may still miss [arcsec]."""


@dataclass(frozen=True, kw_only=True)
class ModificationTrade:
    """Least cost over the two clearances.

    Parameters
    ----------
    flank, radial
        Clearances [µm].
    cost
        Cost of the cheapest zones that keep the requirements there, not a number where none do, or where a unit of
        the kernel run has no equilibrium [cost units].
    error
        Root-mean-square of what is left between model and kernel after the last correction, not a number where no
        pair of clearances has a cost [arcsec].
    """

    flank: Float[np.ndarray, " flank"]
    radial: Float[np.ndarray, " radial"]
    cost: Float[np.ndarray, "flank radial"]
    error: float

    @property
    def cheapest(self) -> tuple[float, float]:
        """Flank and radial clearance with the cheapest zones, not numbers where no pair has a cost [µm]."""
        if np.isnan(self.cost).all():
            return np.nan, np.nan
        at = np.unravel_index(int(np.nanargmin(self.cost)), self.cost.shape)
        return float(self.flank[at[0]]), float(self.radial[at[1]])

    @property
    def price_of_flank(self) -> Float[np.ndarray, "flank radial"]:
        """Cost of one more micrometre on the flank, below zero where it saves [cost units/µm]."""
        return np.asarray(_slope(self.cost, self.flank, 0))

    @property
    def price_of_radial(self) -> Float[np.ndarray, "flank radial"]:
        """Cost of one more micrometre at tip and root, below zero where it saves [cost units/µm]."""
        return np.asarray(_slope(self.cost, self.radial, 1))


def _slope(cost: Float[np.ndarray, "flank radial"], along: Float[np.ndarray, " step"], axis: int) -> object:
    return np.gradient(cost, along, axis=axis) if along.size > 1 else np.full(cost.shape, np.nan)


def modification_trade(
    response: QuantileResponse,
    allocation: Allocation,
    flank: Float[np.ndarray, " flank"],
    radial: Float[np.ndarray, " radial"],
) -> ModificationTrade:
    """Return the cost of the cheapest zones for every pair of clearances.

    Parameters
    ----------
    response
        Quantile of the peak-to-peak of a design on the real kernel, common random numbers.
    allocation
        What was found with both clearances free; its local models are used.
    flank, radial
        Clearances, in ascending order [µm].

    Notes
    -----
    Far from the chosen design its models are off, so for every pair the program is solved, the kernel runs the found
    design, and the budget of the peak-to-peak is corrected by what the model missed; then again, until it misses
    little. Every pair has processes of its own. Other requirements keep their models.
    """
    search = _Search(response, allocation)
    found = [search.cheapest(np.array([first, second])) for first in flank for second in radial]
    cost, missed = np.array(found).T
    known = missed[np.isfinite(missed)]
    return ModificationTrade(
        flank=flank,
        radial=radial,
        cost=cost.reshape(flank.size, radial.size) + response.space.locked_cost,
        error=float(np.sqrt(np.mean(known**2))) if known.size else np.nan,
    )


class _Search:
    """The cheapest zones at given clearances, by the models of an allocation, corrected on the kernel."""

    def __init__(self, response: QuantileResponse, allocation: Allocation) -> None:
        self.response, self.space, self.chosen = response, response.space, allocation.chosen
        self.stacks = allocation.asked_stacks
        self.programs = Programs(self.space, len(self.stacks))
        self.known = float(response(self.chosen.design[np.newaxis]).values[0, 0])

    def cheapest(self, clearances: Float[np.ndarray, " 2"]) -> tuple[float, float]:
        """Return the least cost at given clearances, and what the model last missed there [arcsec]."""
        first, model, missed, cost, error = self.stacks[0], self.chosen.sides[0], 0.0, np.nan, np.inf
        processes = self.space.process_positions(self.chosen.design)
        for number in range(_CORRECTIONS):
            corrected = (replace(first, budget=first.budget - missed), *self.stacks[1:])
            if number % _CHOSEN_AGAIN == 0:
                processes = self._processes(corrected, clearances, processes)
            program, bounds = self.programs.of(processes), {"shared_lower": clearances, "shared_upper": clearances}
            solution = program.solve(corrected, **bounds)
            # Where the model lets nothing keep the limits, it may still be the model that is wrong.
            found = solution or program.least_infeasible(corrected, **bounds)
            design = np.concatenate([found.zones, found.shared])
            answered = self.response(design[np.newaxis])
            if not answered.good[0]:
                return np.nan, np.nan
            rise = float(model.predicted(design) - model.predicted(self.chosen.design))
            cost, before = solution.cost if solution else np.nan, error
            error = float(answered.values[0, 0]) - self.known - rise - missed
            if abs(error) > _SETTLED:
                missed += error / (1 - min(error / before, 0.0))  # the secant where corrections swing to and fro
            elif number >= _CHOSEN_AGAIN or not self.space.has_choices:
                break
            else:
                error = np.inf  # the next processes are another curve
        return (cost, error) if np.isfinite(cost) else (np.nan, np.nan)

    def _processes(
        self, stacks: tuple[Stack, ...], clearances: Float[np.ndarray, " 2"], present: Int[np.ndarray, " group"]
    ) -> Int[np.ndarray, " group"]:
        """Return the cheapest processes at given clearances."""
        if not self.space.has_choices:
            return present
        held = replace(self.space.shared, lower=clearances, upper=clearances)
        return process_choice.allocate(replace(self.space.problem(stacks), shared=held)).processes
