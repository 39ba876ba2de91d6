"""Cheapest angular tolerances of parts that one will adjust, proven for the gains of the adjustment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.problem import Solution
from tolalloc.allocation.program.process_choice import allocate
from tolalloc.assembly.angular.limits import AngularLimits, angular_limits, requirements_of
from tolalloc.assembly.angular.program import angular_problem
from tolalloc.assembly.gains import Gains, tuned_gains
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.exceptions import InputError
from tolalloc.units import ARCSECOND


@dataclass(frozen=True, kw_only=True)
class AngularAllocation:
    """Cheapest tolerances for fixed gains of the adjustment.

    Parameters
    ----------
    gains
        Gains of the adjustment, and what they leave of part errors and noise.
    tolerances
        Tolerance of every part about its own axes, ±, three standard deviations [rad].
    cost
        Cost of the tolerances [cost units].
    effort_cost
        Price of the expected effort [cost units].
    bound
        Lower bound on the total of all tolerances that keep the limits with these gains; no solver's word [cost units].
    limits
        What is limited.
    spread
        Three standard deviations of what is limited [rad].
    prices
        Cost saved by widening every limit [cost units/rad].
    """

    gains: Gains
    tolerances: Float[np.ndarray, "part 3"]
    cost: float
    effort_cost: float
    bound: float
    limits: AngularLimits
    spread: Float[np.ndarray, " limit"]
    prices: Float[np.ndarray, " limit"]

    @property
    def total(self) -> float:
        """Cost of tolerances and effort [cost units]."""
        return self.cost + self.effort_cost

    @property
    def gap(self) -> float:
        """Total over its lower bound, minus one [-]."""
        return self.total / self.bound - 1


def allocated(plan: AssemblyPlan, gains: Gains) -> AngularAllocation | None:
    """Return the cheapest tolerances for given gains, or None where no tolerances keep the limits.

    Parameters
    ----------
    plan
        What is assembled.
    gains
        Gains of the adjustment.

    Raises
    ------
    InputError
        The plan states no requirements, or costs of an unknown form.
    """
    problem = angular_problem(plan, gains.errors)
    found = allocate(problem)
    if not isinstance(found, Solution):
        return None
    limits, budgets = angular_limits(plan), np.array([stack.budget for stack in problem.stacks])
    tolerances, price = found.zones.reshape(-1, 3) * ARCSECOND, requirements_of(plan).effort_price
    return AngularAllocation(
        gains=gains,
        tolerances=tolerances,
        cost=found.cost - float(problem.losses @ found.zones**2),
        effort_cost=price * gains.errors.expected_effort((tolerances / 3).ravel() ** 2),
        bound=found.bound + price * gains.errors.noise_effort,
        limits=limits,
        spread=limits.spread(gains.errors, tolerances),
        # The budget is √(limit² − noise²), so its change by the limit is the limit over it.
        prices=found.prices * limits.values / (budgets * ARCSECOND) / ARCSECOND,
    )


def allocate_angles(plan: AssemblyPlan, precision: float | None = None) -> AngularAllocation:
    """Return the cheapest tolerances with the filter that expects parts of the plan's tolerances.

    Parameters
    ----------
    plan
        What is assembled.
    precision
        Q in place of the plan's own [-].

    Raises
    ------
    InputError
        The plan states no requirements, or no tolerances keep its limits.
    """
    gains = tuned_gains(plan, plan.precision if precision is None else precision, plan.tolerances)
    found = allocated(plan, gains)
    if found is None:
        raise _refusal(plan, gains)
    return found


def _refusal(plan: AssemblyPlan, gains: Gains) -> InputError:
    """Say which limit no tolerances keep, and what would help."""
    limits, smallest = angular_limits(plan), requirements_of(plan).smallest
    noise, spread = limits.noise(gains.errors), limits.spread(gains.errors, np.full_like(plan.tolerances, smallest))
    too_noisy = bool((noise >= limits.values).any())
    at = int(np.argmax((noise if too_noisy else spread) / limits.values))
    left, least, alone, limit = np.array([spread[at], smallest, noise[at], limits.values[at]]) / ARCSECOND
    made = f"the noise alone makes {alone:.4g} arcsec"
    if not too_noisy:
        made = f"the smallest tolerances of {least:g} arcsec make {left:.4g} arcsec, the noise alone {alone:.4g}"
    # Which of these helps depends on the plan; none is promised.
    remedy = "measure or adjust better, expect smaller errors" if too_noisy else "allow smaller tolerances"
    return InputError(
        f"{plan.name}: three standard deviations of the {limits.names[at]} may be {limit:g} arcsec, but at a precision "
        f"of {gains.precision:g}, with a filter that expects the stated tolerances, {made}; {remedy}, try another "
        "precision, or widen the limit."
    )
