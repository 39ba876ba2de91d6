"""Angular tolerances as an allocation: least cost such that the final angles keep their limits."""

from __future__ import annotations

from itertools import product

import numpy as np

from tolalloc.allocation.cost.closed_forms import ClosedForm, Exponential, Reciprocal
from tolalloc.allocation.cost.model import Process
from tolalloc.allocation.program.problem import AllocationProblem, Feature, Stack
from tolalloc.assembly.angular.limits import angular_limits, requirements_of
from tolalloc.assembly.final_errors import FinalErrors
from tolalloc.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.exceptions import InputError
from tolalloc.units import ARCSECOND


def angular_problem(plan: AssemblyPlan, errors: FinalErrors) -> AllocationProblem:
    """Return the allocation with tolerances and stacks in arcseconds, for the gains of given final errors.

    Parameters
    ----------
    plan
        What is assembled.
    errors
        What parts and noise leave.

    Raises
    ------
    InputError
        The plan states no requirements, or a cost of an unknown form.

    Notes
    -----
    With fixed gains nine times a final variance is Σ a_i·t_i² + 9ν, so it stays below T² where ‖√a∘t‖ ≤ √(T² − 9ν).
    The priced effort is affine in t² too: a quality loss and a constant, which is left out. Where the noise alone
    exceeds a limit the budget is negative, as no tolerance keeps it.
    """
    requirements, limits = requirements_of(plan), angular_limits(plan)
    left = limits.values**2 - limits.noise(errors) ** 2
    budgets = np.sign(left) * np.sqrt(np.abs(left)) / ARCSECOND
    losses = requirements.effort_price * errors.effort_by_variance / 9 * ARCSECOND**2
    names = [f"{part}.{axis}" for part, axis in product(plan.chain.names, "xyz")]
    features = tuple(
        Feature(name=name, processes=(_process(requirements, at),), loss=float(loss))
        for at, (name, loss) in enumerate(zip(names, losses, strict=True))
    )
    stacks = tuple(
        Stack(name=name, worst_case=np.zeros(len(names)), root_sum_square=root_sum_square, budget=float(budget))
        for name, root_sum_square, budget in zip(
            limits.names, np.sqrt(limits.by_tolerance(errors)), budgets, strict=True
        )
    )
    return AllocationProblem(features=features, stacks=stacks)


def _process(requirements: AngularRequirements, at: int) -> Process:
    """Return how the tolerance at a position among all is made, over arcseconds."""
    made = Process(
        name=requirements.form,
        cost=_cost(requirements, at),
        minimum=requirements.smallest,
        maximum=requirements.largest,
    )
    return made.rescaled(ARCSECOND)


def _cost(requirements: AngularRequirements, at: int) -> ClosedForm:
    """Return the cost of that tolerance, over radians."""
    fixed, factor = float(requirements.fixed.flat[at]), float(requirements.factor.flat[at])
    if requirements.form == "reciprocal":
        return Reciprocal(fixed=fixed, factor=factor)
    if requirements.form == "exponential":
        return Exponential(fixed=fixed, factor=factor, scale=float(requirements.scale.flat[at]))
    raise InputError.at("angular requirements", "form", requirements.form, "reciprocal or exponential")
