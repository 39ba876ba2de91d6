"""The gains of an adjustment, what it leaves, and the same over the weight of the final angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.wings.assembly.control import KalmanFilter, Regulator, kalman_filter, limiting_regulator, regulator
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.steps import StateSpace
from tolalloc.wings.assembly.trajectory import Trajectory, drawn, foreseen, random_numbers


@dataclass(frozen=True, kw_only=True)
class FinalErrors:
    """Final state and adjustments as linear maps of everything random.

    Part errors and noise are independent of each other, so covariance and expected effort are affine in the part
    variances as long as the gains stay as they are.
    """

    by_part: Float[np.ndarray, "state error"]  # Final state per part error [rad/rad]
    # Final state per standard deviation of every reading, then of every adjustment of every step [rad]
    by_noise: Float[np.ndarray, "state noise"]
    # Adjustments of all steps in the same way [rad/rad, rad]
    adjustments_by_part: Float[np.ndarray, "step adjustment error"]
    adjustments_by_noise: Float[np.ndarray, "step adjustment noise"]
    effort: Float[np.ndarray, "step adjustment"]  # Diagonal of R(k) [-]

    def covariance(self, variances: Float[np.ndarray, " error"]) -> Float[np.ndarray, "state state"]:
        """Return the covariance of the final state for variances of every part error [rad²]."""
        return np.asarray((self.by_part * variances) @ self.by_part.T + self.noise_covariance)

    @property
    def noise_covariance(self) -> Float[np.ndarray, "state state"]:
        """What noise alone leaves of it [rad²]."""
        return np.asarray(self.by_noise @ self.by_noise.T)

    @property
    def effort_by_variance(self) -> Float[np.ndarray, " error"]:
        """Expected effort, Σ uᵀRu, per variance of every part error [-]."""
        return np.asarray(np.einsum("ka,kae->e", self.effort, self.adjustments_by_part**2))

    @property
    def noise_effort(self) -> float:
        """Expected effort that noise alone causes [rad²]."""
        return float(np.einsum("ka,kan->", self.effort, self.adjustments_by_noise**2))

    def expected_effort(self, variances: Float[np.ndarray, " error"]) -> float:
        """Return the expectation of Σ uᵀRu for variances of every part error [rad²]."""
        return float(self.effort_by_variance @ variances) + self.noise_effort


def final_errors(
    space: StateSpace, adjusting: Regulator, kalman: KalmanFilter, measurement_noise: float, adjustment_noise: float
) -> FinalErrors:
    """Return how final state and adjustments follow from part errors and noise, with any gains.

    Theory page equation (58), exact for the linear system and gains that stay as they are; noise [rad], maps [rad/rad].
    """
    # One assembly for each random number, with that number at one and all others at zero.
    deviations = (np.ones(space.entering.shape[2]), measurement_noise, adjustment_noise)
    assemblies = drawn(space, adjusting, kalman, deviations, np.eye(random_numbers(space)))
    final, adjustments = assemblies.adjusted[:, -1].T, np.moveaxis(assemblies.adjustments, 0, -1)
    errors = space.entering.shape[2]
    return FinalErrors(
        by_part=final[:, :errors],
        by_noise=final[:, errors:],
        adjustments_by_part=adjustments[..., :errors],
        adjustments_by_noise=adjustments[..., errors:],
        effort=space.effort,
    )


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Gains of regulator and filter, fixed while tolerances are allocated."""

    state_weight: float  # Q, weight of the final errors against the effort [-]
    regulator: Regulator  # The adjustments
    kalman: KalmanFilter  # The estimator
    adjustment_noise: float  # Standard deviation of what an adjustment misses; 0 where nothing is turned [rad]
    errors: FinalErrors  # What parts and noise leave with these gains


def tuned_gains(plan: AssemblyPlan, state_weight: float, tolerances: Float[np.ndarray, "part 3"]) -> Gains:
    """Return the gains at a precision Q whose filter expects parts of given tolerances [rad]."""
    if not 0 <= state_weight < np.inf:
        raise InputError.at(plan.name, "precision", state_weight, "0 or above")
    # At a precision of 0 nothing is turned, and what is not turned misses nothing.
    noise = (plan.measurement_noise, plan.adjustment_noise if state_weight > 0 else 0.0)
    adjusting = regulator(plan.space, plan.final_weight(state_weight))
    kalman = kalman_filter(plan.space, (tolerances / 3).ravel() ** 2, *noise, plan.name)
    return Gains(
        state_weight=state_weight,
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
    """Return assemblies of parts within given tolerances [rad], from standard normal numbers as of `drawn` [-]."""
    deviations = (tolerances.ravel() / 3, plan.measurement_noise, gains.adjustment_noise)
    return drawn(plan.space, gains.regulator, gains.kalman, deviations, standard)


def expected_angles(plan: AssemblyPlan, gains: Gains) -> Float[np.ndarray, "step 2 state"]:
    """Return the standard deviation of every angle after each step, as mounted and as adjusted, exact [rad]."""
    # One assembly for each random number: everything is linear in them, and they are independent.
    each = assembled(plan, gains, plan.tolerances, np.eye(random_numbers(plan.space)))
    return np.asarray(np.sqrt((np.stack([each.mounted, each.adjusted], axis=2) ** 2).sum(axis=0)))


@dataclass(frozen=True, kw_only=True)
class StateWeightSweep:
    """Final errors and effort over the precision weight."""

    state_weights: Float[np.ndarray, " state_weight"]  # Q [-]
    total: Float[np.ndarray, " state_weight"]  # Root of the sum of the variances of all final angles [rad]
    # Standard deviation of every part's final tilt, x and y together, and of its rotation about the datum's axis [rad]
    tilt: Float[np.ndarray, "state_weight part"]
    rotation: Float[np.ndarray, "state_weight part"]
    effort: Float[np.ndarray, " state_weight"]  # Expected Σ uᵀRu [rad²]
    next_unit: Float[np.ndarray, " state_weight"]  # Share of the total that another unit of Q takes off [-]
    noise_floor: float  # Total that is left however large Q is [rad]

    def diminished(self, share: float = 0.01) -> float | None:
        """Return the smallest Q from which on another unit takes off less than a share of the total, if reached [-]."""
        worth = np.flatnonzero(self.next_unit >= share)
        first = worth[-1] + 1 if worth.size else 0
        return float(self.state_weights[first]) if first < len(self.state_weights) else None


def state_weight_sweep(plan: AssemblyPlan, state_weights: Float[np.ndarray, " state_weight"]) -> StateWeightSweep:
    """Return what is to be expected of an assembly over the precision weight, ascending [-].

    The estimator does not depend on Q (separation). At Q = 0 nothing is turned, so nothing is missed.
    """
    noise = plan.measurement_noise, plan.adjustment_noise
    kalman = kalman_filter(plan.space, plan.variances, *noise, plan.name)
    limit = final_errors(plan.space, limiting_regulator(plan.space, plan.final_weight(1.0)), kalman, *noise)

    def at(state_weight: float) -> FinalErrors:
        return tuned_gains(plan, float(state_weight), plan.tolerances).errors

    def angles(found: FinalErrors) -> Float[np.ndarray, "part 3"]:
        return np.diag(found.covariance(plan.variances)).reshape(-1, 3)

    maps = [at(state_weight) for state_weight in state_weights]
    variances = np.array([angles(each) for each in maps])
    following = np.array([angles(at(state_weight + 1)) for state_weight in state_weights])
    total, next_total = (np.sqrt(each.sum(axis=(1, 2))) for each in (variances, following))
    return StateWeightSweep(
        state_weights=state_weights,
        total=total,
        tilt=np.sqrt(variances[..., 0] + variances[..., 1]),
        rotation=np.sqrt(variances[..., 2]),
        effort=np.array([each.expected_effort(plan.variances) for each in maps]),
        next_unit=1 - next_total / np.where(total > 0, total, 1.0),
        noise_floor=float(np.sqrt(angles(limit).sum())),
    )


def norms(
    plan: AssemblyPlan, errors: Float[np.ndarray, "*samples error"], state_weights: Float[np.ndarray, " state_weight"]
) -> Float[np.ndarray, "state_weight *samples"]:
    """Return the weighted norm of the final errors of parts that are measured beforehand, over the precision weight.

    It is √(xᵀQx) of the final errors at Q = 1 times the plan's weights: the plain norm where all weights are 1 [rad].
    With S = √Q₁ W √Q₁ ⪰ 0 the weighted final state is (I + qS)⁻¹ times the unadjusted one: each of its coordinates
    along the eigenvectors of S falls and is convex in q, and so is the norm. A single angle need not fall.
    """
    root = np.sqrt(np.diag(plan.final_weight(1.0)))
    found = list[Float[np.ndarray, "*samples"]]()
    for state_weight in state_weights:
        adjustments = regulator(plan.space, plan.final_weight(float(state_weight)))
        final = foreseen(plan.space, adjustments, errors).adjusted[..., -1, :]
        found.append(np.linalg.norm(root * final, axis=-1))
    return np.array(found)
