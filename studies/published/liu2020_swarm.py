"""liu2020's improved particle swarm: own, global and neighbourhood best, mixed by the distance from the global best.

Printed are equations (17)–(19), 20 particles and 100 iterations; inertia, acceleration, neighbourhood and the care for
bounds are assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.population import Population


@dataclass(frozen=True, kw_only=True)
class SwarmSettings:
    """What liu2020 does not print; the defaults are what pymoo's plain swarm begins with, before it adapts them.

    Parameters
    ----------
    inertia
        ω [-].
    acceleration
        C1 and C2 [-].
    neighbours
        Particles to either side on a ring that make up a neighbourhood [-].
    """

    inertia: float = 0.9
    acceleration: float = 2.0
    neighbours: int = 1


ASSUMED = SwarmSettings()


def weights(
    position: Float[np.ndarray, "particle parameter"],
    best: Float[np.ndarray, " parameter"],
    lower: Float[np.ndarray, " parameter"],
    upper: Float[np.ndarray, " parameter"],
) -> Float[np.ndarray, "particle 1"]:
    """Return α of every particle: 1 at the global best, 0 at the far corner of the box [-].

    Parameters
    ----------
    position
        The particles [-].
    best
        The global best [-].
    lower, upper
        The box [-].

    References
    ----------
    liu2020, equation (17), without the factor d that it prints inside the sum: with it α leaves 0…1.
    """
    return np.asarray(1.0 - (np.abs(best - position) / (upper - lower)).mean(axis=1, keepdims=True))


def velocity(
    position: Float[np.ndarray, "particle parameter"],
    old: Float[np.ndarray, "particle parameter"],
    own: Float[np.ndarray, "particle parameter"],
    best: Float[np.ndarray, " parameter"],
    local: Float[np.ndarray, "particle parameter"],
    alpha: Float[np.ndarray, "particle 1"],
    random: Float[np.ndarray, "3 particle parameter"],
    settings: SwarmSettings = ASSUMED,
) -> Float[np.ndarray, "particle parameter"]:
    """Return the new velocities.

    Parameters
    ----------
    position, old
        The particles and their velocities [-].
    own, best, local
        Best points: of each particle, of all, of each neighbourhood [-].
    alpha
        α of every particle [-].
    random
        r1, r2, r3 in 0…1 [-].
    settings
        ω and C.

    References
    ----------
    liu2020, equation (18).
    """
    among_others = (1.0 - alpha) * random[1] * (best - position) + alpha * random[2] * (local - position)
    return np.asarray(
        settings.inertia * old
        + alpha * settings.acceleration * random[0] * (own - position)
        + (1.0 - alpha) * settings.acceleration * among_others
    )


def best_neighbours(objective: Float[np.ndarray, " particle"], neighbours: int = 1) -> Int[np.ndarray, " particle"]:
    """Return the position of the best particle of each one's neighbourhood on the ring, itself included [-]."""
    around = np.arange(objective.size)[:, np.newaxis] + np.arange(-neighbours, neighbours + 1)
    around %= objective.size
    return np.asarray(around[np.arange(objective.size), objective[around].argmin(axis=1)])


class ImprovedPSO(PSO):  # type: ignore[misc]
    """liu2020's swarm on pymoo's: only how the particles move is its own; a particle that leaves stops at the bound."""

    def __init__(self, pop_size: int = 20, settings: SwarmSettings = ASSUMED) -> None:
        self.settings = settings
        super().__init__(pop_size=pop_size, adaptive=False, pertube_best=False, initial_velocity="zero")

    def _infill(self) -> Population:
        position, old = self.particles.get("X", "V")
        own, objective = self.pop.get("X"), self.pop.get("F")[:, 0]
        lower, upper = self.problem.bounds()
        best = own[objective.argmin()]
        new = velocity(
            position,
            old,
            own,
            best,
            own[best_neighbours(objective, self.settings.neighbours)],
            weights(position, best, lower, upper),
            self.random_state.random((3, *position.shape)),
            self.settings,
        )
        reached = np.clip(position + new, lower, upper)  # equation (19)
        return Population.new(X=reached, V=reached - position)
