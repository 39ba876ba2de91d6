"""What part errors and noise leave of the final errors, and the effort that they cost: exact, for any fixed gains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.kalman import KalmanFilter
from tolalloc.assembly.regulator import Regulator
from tolalloc.assembly.state_space import StateSpace
from tolalloc.assembly.trajectory import drawn, random_numbers


@dataclass(frozen=True, kw_only=True)
class FinalErrors:
    """Final state and adjustments as linear maps of everything random.

    Parameters
    ----------
    by_part
        Final state per part error [rad/rad].
    by_noise
        Final state per standard deviation of every reading, then of every adjustment of every step [rad].
    adjustments_by_part, adjustments_by_noise
        Adjustments of all steps in the same way [rad/rad, rad].
    effort
        Diagonal of R(k) [-].

    Notes
    -----
    Part errors and noise are independent of each other, so covariance and expected effort are affine in the part
    variances as long as the gains stay as they are.
    """

    by_part: Float[np.ndarray, "state error"]
    by_noise: Float[np.ndarray, "state noise"]
    adjustments_by_part: Float[np.ndarray, "step adjustment error"]
    adjustments_by_noise: Float[np.ndarray, "step adjustment noise"]
    effort: Float[np.ndarray, "step adjustment"]

    def covariance(self, variances: Float[np.ndarray, " error"]) -> Float[np.ndarray, "state state"]:
        """Return the covariance of the final state [rad²].

        Parameters
        ----------
        variances
            Variance of every part error [rad²].
        """
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
        """Return the expectation of Σ uᵀRu [rad²].

        Parameters
        ----------
        variances
            Variance of every part error [rad²].
        """
        return float(self.effort_by_variance @ variances) + self.noise_effort

    def expected_cost(
        self, variances: Float[np.ndarray, " error"], final_weight: Float[np.ndarray, "state state"]
    ) -> float:
        """Return the expectation of xᵀQx of the final errors plus the effort [rad²].

        Parameters
        ----------
        variances
            Variance of every part error [rad²].
        final_weight
            Q(N), weight of the final errors [-].
        """
        return float(np.vdot(final_weight, self.covariance(variances))) + self.expected_effort(variances)


def final_errors(
    space: StateSpace, regulator: Regulator, kalman: KalmanFilter, measurement_noise: float, adjustment_noise: float
) -> FinalErrors:
    """Return how final state and adjustments follow from part errors and noise.

    Parameters
    ----------
    space
        The assembly as a linear system.
    regulator
        The adjustments; any gains will do.
    kalman
        The estimator; any gains will do.
    measurement_noise, adjustment_noise
        Standard deviation of one reading, and of what an adjustment misses, per axis and step [rad].
    """
    # One assembly for each random number, with that number at one and all others at zero.
    deviations = (np.ones(space.entering.shape[2]), measurement_noise, adjustment_noise)
    assemblies = drawn(space, regulator, kalman, deviations, np.eye(random_numbers(space)))
    final, adjustments = assemblies.adjusted[:, -1].T, np.moveaxis(assemblies.adjustments, 0, -1)
    errors = space.entering.shape[2]
    return FinalErrors(
        by_part=final[:, :errors],
        by_noise=final[:, errors:],
        adjustments_by_part=adjustments[..., :errors],
        adjustments_by_noise=adjustments[..., errors:],
        effort=space.effort,
    )
