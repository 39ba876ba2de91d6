"""What a yield costs: the cheapest design for another share of units within the limit of the leading output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.problem import Solution
from tolalloc.allocation.search import ZoneAllocation


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
