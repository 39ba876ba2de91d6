"""What the tooth modification is worth: the cheapest zones for every pair of clearances, the price of a micrometre."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.convex import ConvexProgram
from tolalloc.allocation.program.problem import Stack
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.allocation.search import Allocation
from tolalloc.allocation.trust_region import Programs, aimed
from tolalloc.allocation.verification import VerifiedDesign

_CORRECTIONS = 6
"""Largest number of corrections of the model of the peak-to-peak, on the kernel, for every pair of clearances [-]."""
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


def asked_stacks(allocation: Allocation) -> tuple[Stack, ...]:
    """Return the chosen design's local models with the room that the limits leave, however far it lies beyond them."""
    chosen = allocation.chosen
    return allocation.stacks if chosen.met else aimed(chosen, list(allocation.tried))


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
    design, and the room of the peak-to-peak is corrected by what the model missed; then again, until it misses
    little. Other requirements keep their models.
    """
    space, chosen, stacks = response.space, allocation.chosen, asked_stacks(allocation)
    program = Programs(space, len(stacks)).of(space.process_positions(chosen.design))
    known = float(response(chosen.design[np.newaxis]).values[0, 0])
    pairs = [np.array([first, second]) for first in flank for second in radial]
    found = [_corrected(program, stacks, pair, response, chosen, known) for pair in pairs]
    cost, missed = np.array(found).T
    known_misses = missed[np.isfinite(missed)]
    return ModificationTrade(
        flank=flank,
        radial=radial,
        cost=cost.reshape(flank.size, radial.size) + space.locked_cost,
        error=float(np.sqrt(np.mean(known_misses**2))) if known_misses.size else np.nan,
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
    first, model, missed, cost, error = stacks[0], chosen.sides[0], 0.0, np.nan, np.inf
    for _ in range(_CORRECTIONS):
        corrected = (replace(first, room=first.room - missed), *stacks[1:])
        bounds = {"shared_lower": clearances, "shared_upper": clearances}
        solution = program.solve(corrected, **bounds)
        # Where the model lets nothing keep the limits, it may still be the model that is wrong.
        found = solution or program.least_infeasible(corrected, **bounds)
        design = np.concatenate([found.zones, found.shared])
        answered = response(design[np.newaxis])
        if not answered.good[0]:
            return np.nan, np.nan
        rise = float(model.predicted(design) - model.predicted(chosen.design))
        cost, before = solution.cost if solution else np.nan, error
        error = float(answered.values[0, 0]) - known - rise - missed
        if abs(error) <= _SETTLED:
            break
        missed += error / (1 - min(error / before, 0.0))  # the secant where corrections swing to and fro
    return (cost, error) if np.isfinite(cost) else (np.nan, np.nan)
