"""The exact front: the least cost for every budget of one stack."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.convex import ConvexProgram
from tolalloc.allocation.program.problem import Solution, Stack


def front(
    program: ConvexProgram, stacks: Sequence[Stack], at: int, budgets: Float[np.ndarray, " point"]
) -> tuple[Solution | None, ...]:
    """Return the cheapest design for every budget of one stack, None for a budget that no design keeps.

    Parameters
    ----------
    program
        The compiled program.
    stacks
        All stacks; the budgets of the others stay.
    at
        Position of the stack [-].
    budgets
        Its budgets [unit of the stack].
    """
    return tuple(
        program.solve([*stacks[:at], replace(stacks[at], budget=float(budget)), *stacks[at + 1 :]])
        for budget in budgets
    )
