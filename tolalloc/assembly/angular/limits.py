"""Limits of the final angles, and the square rows that part and noise variances fill."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.final_errors import FinalErrors
from tolalloc.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class AngularLimits:
    """Limits of three standard deviations of the final angles.

    Parameters
    ----------
    names
        What each limits, such as ``tilt of disc``.
    values
        The limits [rad].
    counted
        1 for the states whose variances add up to the limited one, 0 for the others [-].
    """

    names: tuple[str, ...]
    values: Float[np.ndarray, " limit"]
    counted: Float[np.ndarray, "limit state"]

    def by_tolerance(self, errors: FinalErrors) -> Float[np.ndarray, "limit error"]:
        """Return a: what every tolerance² adds to the square of three standard deviations [-].

        Parameters
        ----------
        errors
            What parts and noise leave.
        """
        return np.asarray(self.counted @ errors.by_part**2)

    def noise(self, errors: FinalErrors) -> Float[np.ndarray, " limit"]:
        """Return three standard deviations that the noise alone makes [rad].

        Parameters
        ----------
        errors
            What parts and noise leave.
        """
        return np.asarray(3 * np.sqrt(self.counted @ np.diag(errors.noise_covariance)))

    def spread(self, errors: FinalErrors, tolerances: Float[np.ndarray, "part 3"]) -> Float[np.ndarray, " limit"]:
        """Return three standard deviations of what is limited [rad].

        Parameters
        ----------
        errors
            What parts and noise leave.
        tolerances
            Tolerances of the parts [rad].
        """
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

    Parameters
    ----------
    plan
        The plan.

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
