"""A filter that expects the tolerances that are allocated with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tolalloc.assembly.angular.allocation import AngularAllocation, allocate_angles, allocated
from tolalloc.assembly.gains import tuned_gains
from tolalloc.assembly.plan import AssemblyPlan

_SETTLED = 1e-8
"""Relative change of all tolerances below which they count as settled [-]."""


@dataclass(frozen=True, kw_only=True)
class RetunedAllocation:
    """Allocations with filters that expect the tolerances of the one before.

    Parameters
    ----------
    allocations
        The allocations; the first filter expects the plan's own tolerances.
    settled
        Whether the last filter expects the tolerances that are allocated with it.
    """

    allocations: tuple[AngularAllocation, ...]
    settled: bool

    @property
    def best(self) -> AngularAllocation:
        """The cheapest; its bound holds for its own gains, not for all filters."""
        return min(self.allocations, key=lambda each: each.total)


def retuned_allocation(
    plan: AssemblyPlan, precision: float | None = None, most_filters: int = 100
) -> RetunedAllocation:
    """Return allocations whose filters are tuned again until the tolerances settle.

    Parameters
    ----------
    plan
        What is assembled.
    precision
        Q in place of the plan's own [-].
    most_filters
        Filters after which the iteration ends, settled or not [-].

    Raises
    ------
    InputError
        As `allocate_angles`.

    Notes
    -----
    Every allocation keeps the limits with its own gains, so each is one that can be built, whether or not the iteration
    settles. Gains and tolerances together are not a convex program: neither the fixed point nor the best of the
    allocations is claimed to be the cheapest of all filters. The iteration ends where no tolerances keep the limits.
    """
    found = [allocate_angles(plan, precision)]
    while len(found) < most_filters:
        last = found[-1]
        following = allocated(plan, tuned_gains(plan, last.gains.precision, last.tolerances))
        if following is None:
            break
        found.append(following)
        if np.abs(following.tolerances / last.tolerances - 1).max() <= _SETTLED:
            return RetunedAllocation(allocations=tuple(found), settled=True)
    return RetunedAllocation(allocations=tuple(found), settled=False)
