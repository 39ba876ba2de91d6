"""The adjustments that make the sum of final errors and effort least: a linear-quadratic regulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import pinv, solve

from tolalloc.assembly.state_space import StateSpace


@dataclass(frozen=True, kw_only=True)
class Regulator:
    """What to turn at every step: u(k) = −K(k) ẑ(k).

    Parameters
    ----------
    gains
        K(k): adjustment of every part in its own axes per state before the adjustment [rad/rad].
    cost_to_go
        P(k): weight of the state before step k's adjustment in the least cost from there on; the last one is the weight
        of the final errors [-].
    """

    gains: Float[np.ndarray, "step adjustment state"]
    cost_to_go: Float[np.ndarray, "time state state"]


def regulator(space: StateSpace, final_weight: Float[np.ndarray, "state state"]) -> Regulator:
    """Return the adjustments that minimise xᵀQx of the final errors plus the sum of uᵀRu.

    Parameters
    ----------
    space
        The assembly as a linear system.
    final_weight
        Q(N), weight of the final errors [-].

    Notes
    -----
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
    """Return the limit of the regulator as its final weight grows without bound.

    Its cost to go is the effort alone, the least with which the errors fall as far as they can.

    Parameters
    ----------
    space
        The assembly as a linear system.
    final_weight
        Weight of the final errors; only its ratios matter [-].

    Notes
    -----
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
