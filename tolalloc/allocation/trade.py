"""What the tooth modification is worth: the cheapest zones for every pair of clearances, the price of a micrometre."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.convex import ConvexProgram
from tolalloc.allocation.program.problem import Stack
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.allocation.search import Allocation
from tolalloc.allocation.trust_region import Programs
from tolalloc.allocation.verification import VerifiedDesign

_CORRECTIONS = 3
"""Times that the model of the peak-to-peak is corrected on the kernel for every pair of clearances [-]."""


@dataclass(frozen=True, kw_only=True)
class ModificationTrade:
    """Least cost over the two clearances.

    Parameters
    ----------
    flank, radial
        Clearances [µm].
    cost
        Cost of the cheapest zones that keep the requirements there, not a number where none do [cost units].
    error
        Root-mean-square of what is left between model and kernel after the last correction [arcsec].
    """

    flank: Float[np.ndarray, " flank"]
    radial: Float[np.ndarray, " radial"]
    cost: Float[np.ndarray, "flank radial"]
    error: float

    @property
    def cheapest(self) -> tuple[float, float]:
        """Flank and radial clearance with the cheapest zones [µm]."""
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
        What was found with both clearances free; its local models and processes are used.
    flank, radial
        Clearances, in ascending order [µm].

    Notes
    -----
    Far from the chosen design its models are off, so for every pair the program is solved, the kernel runs the found
    design, and the room of the peak-to-peak is corrected by what the model missed; then again. Other requirements
    keep their models.
    """
    space, chosen, stacks = response.space, allocation.chosen, allocation.stacks
    program = Programs(space, len(stacks)).of(space.process_positions(chosen.design))
    known = float(response(chosen.design[np.newaxis]).values[0, 0])
    pairs = [np.array([first, second]) for first in flank for second in radial]
    found = [_corrected(program, stacks, pair, response, chosen, known) for pair in pairs]
    cost = np.array([cost for cost, _ in found]).reshape(flank.size, radial.size)
    missed = np.array([missed for _, missed in found])
    return ModificationTrade(
        flank=flank, radial=radial, cost=cost + space.locked_cost, error=float(np.sqrt(np.nanmean(missed**2)))
    )


def _corrected(
    program: ConvexProgram,
    stacks: tuple[Stack, ...],
    clearances: Float[np.ndarray, " 2"],
    response: QuantileResponse,
    chosen: VerifiedDesign,
    known: float,
) -> tuple[float, float]:
    """Return the least cost at given clearances, and what the model last missed there [arcsec]."""
    first, missed, cost = stacks[0], 0.0, np.nan
    for _ in range(_CORRECTIONS):
        corrected = replace(first, room=first.room - missed)
        solution = program.solve((corrected, *stacks[1:]), shared_lower=clearances, shared_upper=clearances)
        if solution is None:
            return np.nan, np.nan
        design = np.concatenate([solution.zones, solution.shared])
        model = chosen.sides[0]
        rise = float(model.predicted(design) - model.predicted(chosen.design))
        before, cost = missed, solution.cost
        missed = float(response(design[np.newaxis]).values[0, 0]) - known - rise
    return cost, missed - before
