"""The convex programs of a design space: which processes to take, and how far one step may go."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.convex import ConvexProgram
from tolalloc.allocation.program.problem import Solution, Stack

SETTLED = 0.01
"""Relative gain of cost that the next step must promise for a search to go on from a met design [-]."""


class Programs:
    """The convex programs of a design space, one for each choice of processes, compiled once.

    Parameters
    ----------
    space
        The design variables.
    stacks
        Number of limited sides of all requirements [-].
    """

    def __init__(self, space: DesignSpace, stacks: int) -> None:
        self.space, self.stacks = space, stacks
        self._compiled: dict[tuple[int, ...], ConvexProgram] = {}

    def of(self, processes: Int[np.ndarray, " group"]) -> ConvexProgram:
        """Return the program of the processes at the given positions."""
        key = tuple(processes.tolist())
        if key not in self._compiled:
            self._compiled[key] = ConvexProgram(self.space.features, processes, self.stacks, self.space.shared)
        return self._compiled[key]

    def choose(self, stacks: tuple[Stack, ...], present: Int[np.ndarray, " group"]) -> Int[np.ndarray, " group"]:
        """Return the processes that the models prefer; the present ones stay unless another choice clearly pays.

        Parameters
        ----------
        stacks
            Local models with the budget that is aimed at.
        present
            Position of the present process of every group [-].
        """
        if not self.space.has_choices:
            return present
        best = process_choice.allocate(self.space.problem(stacks))
        kept = self.of(present).solve(stacks)
        if kept is not None and isinstance(best, Solution) and best.cost > (1 - SETTLED) * kept.cost:
            return present
        return best.processes

    def step(
        self,
        stacks: tuple[Stack, ...],
        processes: Int[np.ndarray, " group"],
        around: Float[np.ndarray, " variable"],
        reach: float,
    ) -> Float[np.ndarray, " variable"]:
        """Return the cheapest design near another one, or the one there that violates the stacks least.

        Parameters
        ----------
        stacks
            Local models with the budget that is aimed at.
        processes
            Position of the process of every group [-].
        around
            A design.
        reach
            Factor by which variables may change, as far as their ranges go [-].
        """
        program, groups, shared = self.of(processes), len(self.space.groups), self.space.shared
        low, high = (np.clip(around[:groups] * by, program.lower, program.upper) for by in (1 / reach, reach))
        bounds = (low, high, *_reached(around[groups:], reach, shared.lower, shared.upper))
        found = program.solve(stacks, *bounds) or program.least_infeasible(stacks, *bounds)
        return np.concatenate([found.zones, found.shared])


def _reached(
    around: Float[np.ndarray, " shared"],
    reach: float,
    lower: Float[np.ndarray, " shared"],
    upper: Float[np.ndarray, " shared"],
) -> tuple[Float[np.ndarray, " shared"], Float[np.ndarray, " shared"]]:
    """Return the bounds within reach of clearances; near zero the reach is that of 1 µm [µm]."""
    centre = np.clip(around, lower, upper)
    size = np.maximum(np.abs(centre), 1.0)
    return np.maximum(lower, centre - size * (1 - 1 / reach)), np.minimum(upper, centre + size * (reach - 1))
