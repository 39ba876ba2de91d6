"""The gains of an adjustment: a linear-quadratic regulator that acts on what a Kalman filter knows of the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigvalsh, pinv, solve

from tolalloc.exceptions import InputError
from tolalloc.wings.assembly.steps import StateSpace

_NOTHING_NEW = 1e-13
"""Variance of what is new in a reading over its variance without any measurement, up to which it is rounding [-]."""


@dataclass(frozen=True, kw_only=True)
class Regulator:
    """What to turn at every step: u(k) = −K(k) ẑ(k)."""

    # K(k): adjustment of every part in its own axes per state before the adjustment [rad/rad]
    gains: Float[np.ndarray, "step adjustment state"]
    # P(k): weight of the state before step k's adjustment in the least cost from there on; the last one is the weight
    # of the final errors [-]
    cost_to_go: Float[np.ndarray, "time state state"]


def regulator(space: StateSpace, final_weight: Float[np.ndarray, "state state"]) -> Regulator:
    """Return the adjustments that minimise xᵀQx of the final errors, Q the final weight, plus the sum of uᵀRu.

    Theory page equation (56), errors and adjustments [rad].
    zhang2025's K = R⁻¹BᵀP[I + BR⁻¹BᵀP]⁻¹ equals (R + BᵀPB)⁻¹BᵀP, a symmetric positive definite system, and
    P = (I − BK)ᵀP(I − BK) + KᵀRK stays positive where P falls by many orders in one step. Where a later step cannot
    reach every state, gains lose digits as Q/R grows, 1e-16·Q/R of them: far beyond 1e8 take `limiting_regulator`.
    """
    gains = np.zeros_like(space.adjusting.swapaxes(1, 2))
    cost_to_go = np.empty((space.steps + 1, space.states, space.states))
    cost_to_go[-1] = ahead = final_weight
    for step in reversed(range(space.steps)):
        turning, effort = space.adjusting[step], np.diag(space.effort[step])
        gain = solve(effort + turning.T @ ahead @ turning, turning.T @ ahead, assume_a="pos")
        left = np.eye(space.states) - turning @ gain
        ahead = left.T @ ahead @ left + gain.T @ effort @ gain
        gains[step], cost_to_go[step] = gain, ahead
    return Regulator(gains=gains, cost_to_go=cost_to_go)


def limiting_regulator(space: StateSpace, final_weight: Float[np.ndarray, "state state"]) -> Regulator:
    """Return the limit of theory page equation (56) as its final weight, of which only ratios matter, grows unbounded.

    Gains [rad/rad]. Its cost to go is the effort alone, the least with which the errors fall as far as they can.

    The adjustments of all remaining steps, each times √R, tend to the shortest least-squares solution: a
    pseudoinverse, so that no large number has to stand for infinity.
    """
    root = np.sqrt(space.effort)
    values, vectors = np.linalg.eigh(final_weight)
    weight = np.sqrt(values.clip(0))[:, np.newaxis] * vectors.T
    reach = weight @ (space.adjusting / root[:, np.newaxis])
    gains = np.zeros_like(space.adjusting.swapaxes(1, 2))
    cost_to_go = np.zeros((space.steps + 1, space.states, space.states))
    for step in range(space.steps):
        plan = pinv(np.hstack(reach[step:])) @ weight
        gains[step] = plan[: gains.shape[1]] / root[step][:, np.newaxis]
        cost_to_go[step] = plan.T @ plan
    return Regulator(gains=gains, cost_to_go=cost_to_go)


@dataclass(frozen=True, kw_only=True)
class KalmanFilter:
    """How far every reading moves the estimate of the state."""

    # L(k): change of the estimated state per deviation of a reading from what was expected [rad/rad]
    gains: tuple[Float[np.ndarray, "state _reading"], ...]
    # Covariance of state less estimate after every step, adjustment included [rad²]
    covariance: Float[np.ndarray, "step state state"]


def kalman_filter(
    space: StateSpace,
    variances: Float[np.ndarray, " error"],
    measurement_noise: float,
    adjustment_noise: float,
    place: str,
) -> KalmanFilter:
    """Return the best linear estimator of the state from all readings so far.

    Theory page equation (57), linear, with Joseph's form. Variances are those of every part error [rad²]; noise is the
    standard deviation of one reading, and of what an adjustment misses, per axis and step [rad].
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
        told, own = innovation[np.ix_(telling, telling)], scale[telling]
        # A combination of readings that is known before, judged on each reading's own scale.
        if telling.size and not eigvalsh(told / np.outer(own, own))[0] > _NOTHING_NEW:
            known = "a reading that is known without being taken"
            allowed = "readings that each tell something new, or a measurement noise above 0"
            raise InputError.at(f"{place}, step {step + 1}", "measure", known, allowed)
        gain = np.zeros((space.states, len(observing)))
        gain[:, telling] = solve(told, observing[telling] @ covariance, assume_a="pos").T
        left = identity - gain @ observing
        # Joseph's form stays symmetric and positive semidefinite whatever rounding does to the gain.
        covariance = left @ covariance @ left.T + gain @ noise @ gain.T + missed
        unmeasured = unmeasured + missed
        gains.append(gain)
        covariances.append(covariance)
    return KalmanFilter(gains=tuple(gains), covariance=np.array(covariances))
