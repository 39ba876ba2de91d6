"""What else can be tuned: a filter that expects what is allocated with it, and the precision that costs least."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, inf

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from tolalloc.assembly.angular.allocation import AngularAllocation, allocate_angles, allocated
from tolalloc.assembly.gains import tuned_gains
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.exceptions import InputError

_TOLERANCES_SETTLED = 1e-8
"""Relative change of all tolerances below which they count as settled [-]."""
_PRECISION_SETTLED = 1e-6
"""Step of the precision's logarithm with which the search for the best one ends [-]."""


@dataclass(frozen=True, kw_only=True)
class RetunedAllocation:
    """Allocations with filters that expect the tolerances of the one before."""

    allocations: tuple[AngularAllocation, ...]  # The allocations; the first filter expects the plan's own tolerances
    settled: bool  # Whether the last filter expects the tolerances that are allocated with it

    @property
    def best(self) -> AngularAllocation:
        """The cheapest; its bound holds for its own gains, not for all filters."""
        return min(self.allocations, key=lambda each: each.total)


def retuned_allocation(plan: AssemblyPlan, most_filters: int = 100) -> RetunedAllocation:
    """Return allocations whose filters are tuned again until the tolerances settle.

    Parameters
    ----------
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
    found = [allocate_angles(plan)]
    while len(found) < most_filters:
        last = found[-1]
        following = allocated(plan, tuned_gains(plan, last.gains.precision, last.tolerances))
        if following is None:
            break
        found.append(following)
        if np.abs(following.tolerances / last.tolerances - 1).max() <= _TOLERANCES_SETTLED:
            return RetunedAllocation(allocations=tuple(found), settled=True)
    return RetunedAllocation(allocations=tuple(found), settled=False)


@dataclass(frozen=True, kw_only=True)
class PrecisionCost:
    """Costs over the precision, and the allocation at the best one."""

    precisions: Float[np.ndarray, " precision"]  # Q [-]
    # Cost of the tolerances; not a number where none keep the limits [cost units]
    cost: Float[np.ndarray, " precision"]
    effort_cost: Float[np.ndarray, " precision"]  # Price of the expected effort; likewise [cost units]
    best: AngularAllocation  # Allocation at the best precision

    @property
    def total(self) -> Float[np.ndarray, " precision"]:
        """Cost of tolerances and effort [cost units]."""
        return np.asarray(self.cost + self.effort_cost)

    @property
    def interior(self) -> bool:
        """Whether the curve has points that cost more on both sides of its best one."""
        at = int(np.nanargmin(self.total))
        return 0 < at < self.precisions.size - 1 and bool(np.isfinite(self.total[at - 1 : at + 2]).all())


def best_precision(plan: AssemblyPlan, lowest: float = 0.1, highest: float = 100.0, points: int = 41) -> PrecisionCost:
    """Return what tolerances and effort cost over the precision, with the filter of the plan's tolerances.

    Parameters
    ----------
    lowest, highest
        Precisions between which the best one is looked for, above 0 [-].
    points
        Precisions of the curve, evenly spread by their logarithms [-].

    Raises
    ------
    InputError
        The plan states no requirements, its limits are kept at no point, or there is no range to search.

    Notes
    -----
    The best of the points is refined between its neighbours. The total need not have one minimum alone, so what lies
    between other points is not searched.
    """
    if not 0 < lowest < highest < inf or points < 3:
        raise InputError.at(
            plan.name,
            "range and points of the precision",
            (lowest, highest, points),
            "two numbers above 0, the smaller one first, and 3 points or more",
        )
    precisions = np.geomspace(lowest, highest, points)
    found = [_at(plan, float(precision)) for precision in precisions]
    cost = np.array([np.nan if each is None else each.cost for each in found])
    effort_cost = np.array([np.nan if each is None else each.effort_cost for each in found])
    if np.isnan(cost).all():
        raise InputError.at(
            plan.name, "range of the precision", (lowest, highest), "one where some tolerances keep the limits"
        )
    at = int(np.nanargmin(cost + effort_cost))
    around = np.log(precisions[[max(at - 1, 0), min(at + 1, points - 1)]])
    refined = minimize_scalar(
        lambda q: _total(plan, exp(q)), bounds=around, method="bounded", options={"xatol": _PRECISION_SETTLED}
    )
    return PrecisionCost(
        precisions=precisions,
        cost=cost,
        effort_cost=effort_cost,
        best=min(filter(None, (found[at], _at(plan, exp(refined.x)))), key=lambda each: each.total),
    )


def _at(plan: AssemblyPlan, precision: float) -> AngularAllocation | None:
    return allocated(plan, tuned_gains(plan, precision, plan.tolerances))


def _total(plan: AssemblyPlan, precision: float) -> float:
    """Return the least total at a precision, infinite where no tolerances keep the limits [cost units]."""
    found = _at(plan, precision)
    return inf if found is None else found.total
