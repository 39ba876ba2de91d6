"""What the weight of precision against effort buys, and where it stops buying."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.control import kalman_filter, limiting_regulator, regulator
from tolalloc.assembly.gains import FinalErrors, final_errors, tuned_gains
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.trajectory import foreseen


@dataclass(frozen=True, kw_only=True)
class PrecisionSweep:
    """Final errors and effort over the precision weight."""

    precisions: Float[np.ndarray, " precision"]  # Q [-]
    total: Float[np.ndarray, " precision"]  # Root of the sum of the variances of all final angles [rad]
    tilt: Float[np.ndarray, "precision part"]  # Standard deviation of every part's final tilt, x and y together [rad]
    rotation: Float[np.ndarray, "precision part"]  # The same of its rotation about the datum's axis [rad]
    effort: Float[np.ndarray, " precision"]  # Expected Σ uᵀRu [rad²]
    next_unit: Float[np.ndarray, " precision"]  # Share of the total that another unit of Q takes off [-]
    noise_floor: float  # Total that is left however large Q is [rad]

    def diminished(self, share: float = 0.01) -> float | None:
        """Return the smallest Q from which on another unit takes off less than a share of the total, if reached [-]."""
        worth = np.flatnonzero(self.next_unit >= share)
        first = worth[-1] + 1 if worth.size else 0
        return float(self.precisions[first]) if first < len(self.precisions) else None


def precision_sweep(plan: AssemblyPlan, precisions: Float[np.ndarray, " precision"]) -> PrecisionSweep:
    """Return what is to be expected of an assembly over the precision weight, ascending [-].

    Raises
    ------
    InputError
        A reading without noise is known without being taken, from others or from earlier ones.

    Notes
    -----
    The estimator does not depend on Q (separation). At Q = 0 nothing is turned, so nothing is missed.
    """
    noise = plan.measurement_noise, plan.adjustment_noise
    kalman = kalman_filter(plan.space, plan.variances, *noise, plan.name)
    limit = final_errors(plan.space, limiting_regulator(plan.space, plan.final_weight(1.0)), kalman, *noise)

    def at(precision: float) -> FinalErrors:
        return tuned_gains(plan, float(precision), plan.tolerances).errors

    def angles(found: FinalErrors) -> Float[np.ndarray, "part 3"]:
        return np.diag(found.covariance(plan.variances)).reshape(-1, 3)

    maps = [at(precision) for precision in precisions]
    variances = np.array([angles(each) for each in maps])
    following = np.array([angles(at(precision + 1)) for precision in precisions])
    total, next_total = (np.sqrt(each.sum(axis=(1, 2))) for each in (variances, following))
    return PrecisionSweep(
        precisions=precisions,
        total=total,
        tilt=np.sqrt(variances[..., 0] + variances[..., 1]),
        rotation=np.sqrt(variances[..., 2]),
        effort=np.array([each.expected_effort(plan.variances) for each in maps]),
        next_unit=1 - next_total / np.where(total > 0, total, 1.0),
        noise_floor=float(np.sqrt(angles(limit).sum())),
    )


def norms(
    plan: AssemblyPlan, errors: Float[np.ndarray, "*samples error"], precisions: Float[np.ndarray, " precision"]
) -> Float[np.ndarray, "precision *samples"]:
    """Return the weighted norm of the final errors of parts that are measured beforehand, over the precision weight.

    Notes
    -----
    It is √(xᵀQx) of the final errors at Q = 1 times the plan's weights: the plain norm where all weights are 1 [rad].
    With S = √Q₁ W √Q₁ ⪰ 0 the weighted final state is (I + qS)⁻¹ times the unadjusted one: each of its coordinates
    along the eigenvectors of S falls and is convex in q, and so is the norm. A single angle need not fall.
    """
    root = np.sqrt(np.diag(plan.final_weight(1.0)))
    found = list[Float[np.ndarray, "*samples"]]()
    for precision in precisions:
        adjustments = regulator(plan.space, plan.final_weight(float(precision)))
        final = foreseen(plan.space, adjustments, errors).adjusted[..., -1, :]
        found.append(np.linalg.norm(root * final, axis=-1))
    return np.array(found)
