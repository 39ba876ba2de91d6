"""The play operator: what a spring behind friction feels of a torque that rises and falls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


def interpolated(
    at: Float[np.ndarray, "sample step"],
    levels: Float[np.ndarray, " level"] | Float[np.ndarray, "sample level"],
    values: Float[np.ndarray, " level"] | Float[np.ndarray, "sample level"],
) -> Float[np.ndarray, "sample step"]:
    """Return the values of every sample between its levels, straight from one to the next and constant beyond."""
    samples = at.shape[0]
    every = (np.broadcast_to(given, (samples, given.shape[-1])) for given in (levels, values))
    return np.stack([np.interp(*row) for row in zip(at, *every, strict=True)])


@dataclass(frozen=True, kw_only=True)
class Play:
    """Friction before a spring: the torque outside and the one that the spring feels, theory page equation (72).

    The spring feels S where the torque is S + f(S) as it rises and S − f(S) as it falls; between the two nothing moves.
    """

    inside: Float[np.ndarray, " level"]  # Torques S that the spring feels, ascending [N·m]
    rising: Float[np.ndarray, "sample level"]  # Torque at which the spring gives way upwards at S [N·m]
    falling: Float[np.ndarray, "sample level"]  # Torque at which it gives way downwards [N·m]

    @classmethod
    def of(cls, inside: Float[np.ndarray, " level"], friction: Float[np.ndarray, "sample level"]) -> Play:
        """Return the operator of a friction torque that belongs to the torques S [N·m].

        Where friction grows faster than the torque the spring is locked until the torque reaches what frees it, so the
        limits never fall.
        """
        return cls(
            inside=inside,
            rising=np.maximum.accumulate(inside + friction, axis=1),
            falling=np.minimum.accumulate((inside - friction)[:, ::-1], axis=1)[:, ::-1],
        )

    def follow(self, path: Float[np.ndarray, "sample step"]) -> Float[np.ndarray, "sample step"]:
        """Return what the spring feels at every step of a path, which starts where the torque has just risen.

        Exact wherever the torque only rises or only falls between two steps.
        """
        low = interpolated(path, self.rising, self.inside)
        high = interpolated(path, self.falling, self.inside)
        felt = np.empty(path.shape)
        state = low[:, 0]
        for step in range(path.shape[1]):
            state = np.maximum(low[:, step], np.minimum(high[:, step], state))
            felt[:, step] = state
        return felt
