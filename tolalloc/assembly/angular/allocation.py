"""Cheapest angular tolerances of parts that one will adjust: proven for the gains, and tried on random assemblies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.search.process_choice import allocate
from tolalloc.allocation.space.problem import Solution
from tolalloc.assembly.angular.program import AngularLimits, angular_limits, angular_problem, requirements_of
from tolalloc.assembly.gains import Gains, assembled, tuned_gains
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.trajectory import random_numbers
from tolalloc.capability.indices import ShareInterval, wilson_interval
from tolalloc.drawings.seeds import CHUNK, SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND


@dataclass(frozen=True, kw_only=True)
class AngularAllocation:
    """Cheapest tolerances for fixed gains of the adjustment."""

    gains: Gains  # Gains of the adjustment, and what they leave of part errors and noise
    # Tolerance of every part about its own axes, ±, three standard deviations [rad]
    tolerances: Float[np.ndarray, "part 3"]
    cost: float  # Cost of the tolerances [cost units]
    effort_cost: float  # Price of the expected effort [cost units]
    # Lower bound on the total of all tolerances that keep the limits with these gains; no solver's word [cost units]
    bound: float
    limits: AngularLimits  # What is limited
    spread: Float[np.ndarray, " limit"]  # Three standard deviations of what is limited [rad]
    prices: Float[np.ndarray, " limit"]  # Cost saved by widening every limit [cost units/rad]

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
    """Return the cheapest tolerances, at the plan's precision or another Q [-], with the filter that expects its own.

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


@dataclass(frozen=True, kw_only=True)
class AngularVerification:
    """What a sample of assemblies shows of an allocation."""

    assemblies: int  # Number of assemblies [-]
    spread: Float[np.ndarray, " limit"]  # Three standard deviations of what is limited [rad]
    standard_error: Float[np.ndarray, " limit"]  # Standard error of the spread [rad]
    shares: tuple[ShareInterval, ...]  # Share of the assemblies within each limit
    share: ShareInterval  # Share within all limits at once


def verify_angles(
    plan: AssemblyPlan, allocation: AngularAllocation, seeds: SeedTree, assemblies: int = 100_000
) -> AngularVerification:
    """Return what assemblies of normally distributed parts, readings and adjustments show of an allocation.

    Notes
    -----
    An assembly is within a tilt limit where √(x² + y²) is, which is not what three standard deviations of x and y
    together promise of one normal angle: of assemblies that just keep a limit 99.73 % are within it where the tilt has
    one direction only, and 1 − exp(−9) = 99.988 % where it has none.
    """
    squares = np.concatenate(
        [
            _final(plan, allocation, seeds.generator(index), min(CHUNK, assemblies - start)) ** 2
            for index, start in enumerate(range(0, assemblies, CHUNK))
        ]
    )
    limited = squares @ allocation.limits.counted.T
    variance = limited.mean(axis=0)
    within: Bool[np.ndarray, "assembly limit"] = limited <= allocation.limits.values**2
    return AngularVerification(
        assemblies=assemblies,
        spread=3 * np.sqrt(variance),
        # That of a mean, through the derivative of the square root.
        standard_error=3 * limited.std(axis=0, ddof=1) / np.sqrt(assemblies) / (2 * np.sqrt(variance)),
        shares=tuple(wilson_interval(assemblies, int(each)) for each in within.sum(axis=0)),
        share=wilson_interval(assemblies, int(within.all(axis=1).sum())),
    )


def _final(
    plan: AssemblyPlan, allocation: AngularAllocation, generator: np.random.Generator, assemblies: int
) -> Float[np.ndarray, "assembly state"]:
    """Return final states of one chunk of assemblies [rad]."""
    # A whole chunk is drawn, so that the first assemblies are the same however many follow.
    standard = generator.standard_normal((CHUNK, random_numbers(plan.space)))[:assemblies]
    return np.asarray(assembled(plan, allocation.gains, allocation.tolerances, standard).adjusted[:, -1])
