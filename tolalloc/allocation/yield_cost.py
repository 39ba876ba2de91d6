"""What a yield costs: the cheapest design for another share of units within the limit of the peak-to-peak."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.problem import Solution
from tolalloc.allocation.search import Allocation


def cost_at_yield(space: DesignSpace, allocation: Allocation, target: float) -> float:
    """Return the cost of the cheapest design that keeps another yield, not a number where none does [cost units].

    Parameters
    ----------
    space
        The design variables.
    allocation
        What was found for the yield asked for; its local models are used.
    target
        Share of units that must keep the limit of the peak-to-peak [-].

    Notes
    -----
    The quantile of the verified units at the other yield takes the place of the one that was compared with the limit.
    What the zones spread is in proportion to it, so the weights of the model are, too. Other requirements stay.
    """
    chosen, (first, *others) = allocation.chosen, allocation.stacks
    spread = float(first.load(chosen.design[:-2], np.zeros(2)))
    change = chosen.sample.quantile(target) - chosen.quantile_bound
    factor = max(spread + change, 0.0) / spread
    changed = replace(first, adding=factor * first.adding, spreading=factor * first.spreading)
    found = process_choice.allocate(space.problem((changed, *others)))
    return found.cost + space.locked_cost if isinstance(found, Solution) else np.nan
