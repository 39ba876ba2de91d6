"""Gains of an adjustment, and what they leave of part errors and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.final_errors import FinalErrors, final_errors
from tolalloc.assembly.kalman import KalmanFilter, kalman_filter
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.regulator import Regulator, regulator
from tolalloc.assembly.trajectory import Trajectory, drawn, random_numbers
from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Gains of regulator and filter, fixed while tolerances are allocated.

    Parameters
    ----------
    precision
        Q, weight of the final errors against the effort [-].
    regulator
        The adjustments.
    kalman
        The estimator.
    adjustment_noise
        Standard deviation of what an adjustment misses; 0 where nothing is turned [rad].
    errors
        What parts and noise leave with these gains.
    """

    precision: float
    regulator: Regulator
    kalman: KalmanFilter
    adjustment_noise: float
    errors: FinalErrors


def tuned_gains(plan: AssemblyPlan, precision: float, tolerances: Float[np.ndarray, "part 3"]) -> Gains:
    """Return the gains whose filter expects parts of given tolerances.

    Parameters
    ----------
    plan
        What is assembled.
    precision
        Q [-].
    tolerances
        Tolerances that the filter expects [rad].

    Raises
    ------
    InputError
        A precision that is not 0 or above, or a reading without noise that is known before.
    """
    if not 0 <= precision < np.inf:
        raise InputError.at(plan.name, "precision", precision, "0 or above")
    # At a precision of 0 nothing is turned, and what is not turned misses nothing.
    noise = (plan.measurement_noise, plan.adjustment_noise if precision > 0 else 0.0)
    adjusting = regulator(plan.space, plan.final_weight(precision))
    kalman = kalman_filter(plan.space, (tolerances / 3).ravel() ** 2, *noise, plan.name)
    return Gains(
        precision=precision,
        regulator=adjusting,
        kalman=kalman,
        adjustment_noise=noise[1],
        errors=final_errors(plan.space, adjusting, kalman, *noise),
    )


def assembled(
    plan: AssemblyPlan,
    gains: Gains,
    tolerances: Float[np.ndarray, "part 3"],
    standard: Float[np.ndarray, "*samples number"],
) -> Trajectory:
    """Return assemblies of parts within given tolerances, from standard normal numbers.

    Parameters
    ----------
    plan
        What is assembled.
    gains
        Its gains.
    tolerances
        Tolerances of the parts [rad].
    standard
        `tolalloc.assembly.trajectory.random_numbers` per assembly [-].
    """
    deviations = (tolerances.ravel() / 3, plan.measurement_noise, gains.adjustment_noise)
    return drawn(plan.space, gains.regulator, gains.kalman, deviations, standard)


def expected_angles(plan: AssemblyPlan, gains: Gains) -> Float[np.ndarray, "step 2 state"]:
    """Return the standard deviation of every angle after each step, as mounted and as adjusted, exact [rad].

    Parameters
    ----------
    plan
        What is assembled.
    gains
        Its gains.
    """
    # One assembly for each random number: everything is linear in them, and they are independent.
    each = assembled(plan, gains, plan.tolerances, np.eye(random_numbers(plan.space)))
    return np.asarray(np.sqrt((np.stack([each.mounted, each.adjusted], axis=2) ** 2).sum(axis=0)))
