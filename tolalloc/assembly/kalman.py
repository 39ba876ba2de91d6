"""What the measurements so far tell of the state: a Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigvalsh, solve

from tolalloc.assembly.state_space import StateSpace
from tolalloc.exceptions import InputError

_NOTHING_NEW = 1e-13
"""Variance of what is new in a reading over its variance without any measurement, up to which it is rounding [-]."""


@dataclass(frozen=True, kw_only=True)
class KalmanFilter:
    """How far every reading moves the estimate of the state.

    Parameters
    ----------
    gains
        L(k): change of the estimated state per deviation of a reading from what was expected [rad/rad].
    covariance
        Covariance of state less estimate after every step, adjustment included [rad²].
    """

    gains: tuple[Float[np.ndarray, "state _reading"], ...]
    covariance: Float[np.ndarray, "step state state"]


def kalman_filter(
    space: StateSpace,
    variances: Float[np.ndarray, " error"],
    measurement_noise: float,
    adjustment_noise: float,
    place: str,
) -> KalmanFilter:
    """Return the best linear estimator of the state from all readings so far.

    Parameters
    ----------
    space
        The assembly as a linear system.
    variances
        Variance of every part error [rad²].
    measurement_noise, adjustment_noise
        Standard deviation of one reading, and of what an adjustment misses, per axis and step [rad].
    place
        File or caller for the sentence.

    Raises
    ------
    InputError
        A reading without noise is known without being taken, from others or from earlier ones.
    """
    identity = np.eye(space.states)
    gains, covariances = list[Float[np.ndarray, "state reading"]](), list[Float[np.ndarray, "state state"]]()
    unmeasured = covariance = np.zeros_like(identity)
    for step, observing in enumerate(space.observing):
        entering = (space.entering[step] * variances) @ space.entering[step].T
        missed = adjustment_noise**2 * space.adjusting[step] @ space.adjusting[step].T
        noise = measurement_noise**2 * np.eye(len(observing))
        covariance, unmeasured = covariance + entering, unmeasured + entering
        innovation = observing @ covariance @ observing.T + noise
        scale = np.sqrt(np.diag(observing @ unmeasured @ observing.T + noise))
        telling = np.flatnonzero(scale > 0)  # what never varies and is read without noise has nothing to tell
        if not _tells_something_new(innovation[np.ix_(telling, telling)], scale[telling]):
            raise InputError.at(
                f"{place}, step {step + 1}",
                "measure",
                "a reading that is known without being taken",
                "readings that each tell something new, or a measurement noise above 0",
            )
        gain = np.zeros((space.states, len(observing)))
        gain[:, telling] = solve(
            innovation[np.ix_(telling, telling)], observing[telling] @ covariance, assume_a="pos"
        ).T
        left = identity - gain @ observing
        # Joseph's form stays symmetric and positive semidefinite whatever rounding does to the gain.
        covariance = left @ covariance @ left.T + gain @ noise @ gain.T + missed
        unmeasured = unmeasured + missed
        gains.append(gain)
        covariances.append(covariance)
    return KalmanFilter(gains=tuple(gains), covariance=np.array(covariances))


def _tells_something_new(
    innovation: Float[np.ndarray, "reading reading"], scale: Float[np.ndarray, " reading"]
) -> bool:
    """Return whether no combination of readings is known before, judged on each reading's own scale."""
    return not scale.size or bool(eigvalsh(innovation / np.outer(scale, scale))[0] > _NOTHING_NEW)
