"""Angular tolerances as an allocation: least cost such that part and noise variances fill no limit beyond its value."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.model import ClosedForm, Exponential, Process, Reciprocal
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Stack
from tolalloc.assembly.gains import FinalErrors
from tolalloc.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND


@dataclass(frozen=True, kw_only=True)
class AngularLimits:
    """Limits of three standard deviations of the final angles."""

    names: tuple[str, ...]  # What each limits, such as ``tilt of disc``
    values: Float[np.ndarray, " limit"]  # The limits [rad]
    # 1 for the states whose variances add up to the limited one, 0 for the others [-]
    counted: Float[np.ndarray, "limit state"]

    def by_tolerance(self, errors: FinalErrors) -> Float[np.ndarray, "limit error"]:
        """Return a: what every tolerance² adds to the square of three standard deviations [-]."""
        return np.asarray(self.counted @ errors.by_part**2)

    def noise(self, errors: FinalErrors) -> Float[np.ndarray, " limit"]:
        """Return three standard deviations that the noise alone makes [rad]."""
        return np.asarray(3 * np.sqrt(self.counted @ np.diag(errors.noise_covariance)))

    def spread(self, errors: FinalErrors, tolerances: Float[np.ndarray, "part 3"]) -> Float[np.ndarray, " limit"]:
        """Return three standard deviations of what is limited, for tolerances of the parts [rad]."""
        parts = self.by_tolerance(errors) @ tolerances.ravel() ** 2
        return np.asarray(np.sqrt(parts + self.noise(errors) ** 2))


def requirements_of(plan: AssemblyPlan) -> AngularRequirements:
    """Return the requirements of a plan.

    Raises
    ------
    InputError
        It states none.
    """
    if plan.requirements is None:
        raise InputError.at(plan.name, "requirements", "not stated", "limits and costs of angular tolerances")
    return plan.requirements


def angular_limits(plan: AssemblyPlan) -> AngularLimits:
    """Return the limits of a plan; what has no limit gets no row.

    Raises
    ------
    InputError
        It states no requirements.

    Notes
    -----
    The tilt is limited as a whole, Var_x + Var_y, since its direction turns with the crank.
    """
    requirements, parts = requirements_of(plan), np.eye(len(plan.chain.names))
    names = [f"{kind} of {name}" for kind in ("tilt", "rotation") for name in plan.chain.names]
    values = np.concatenate([requirements.tilt_limit, requirements.rotation_limit])
    counted = np.concatenate([np.kron(parts, [1.0, 1.0, 0.0]), np.kron(parts, [0.0, 0.0, 1.0])])
    stated = np.isfinite(values)
    return AngularLimits(
        names=tuple(name for name, kept in zip(names, stated, strict=True) if kept),
        values=values[stated],
        counted=counted[stated],
    )


def angular_problem(plan: AssemblyPlan, errors: FinalErrors) -> AllocationProblem:
    """Return the allocation with tolerances and stacks in arcseconds, for the gains of given final errors.

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
        PricedFeature(name=name, processes=(_process(requirements, at),), loss=float(loss))
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
