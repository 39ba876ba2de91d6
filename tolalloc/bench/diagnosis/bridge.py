"""Samples of a distribution that is hard to draw from, led there from one that is easy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_triangular
from scipy.optimize import brentq

_CORRELATION = 0.4
"""A step ends when the particles' correlation with where they stood before has fallen this far [-]."""

_ACCEPTED = 0.25
"""Share of moves that the length of a move is adapted to [-]."""

_INFLATION = 1.3
"""Covariance of the moves over that of the particles, so that the tails are reached [-]."""

LogDensity = Callable[[Float[np.ndarray, "particle column"]], Float[np.ndarray, " particle"]]


@dataclass(frozen=True, kw_only=True)
class Neighbourhood:
    """A normal density that is easy to draw from."""

    centre: Float[np.ndarray, " column"]  # Its mean [-]
    precision: Float[np.ndarray, "column column"]  # Inverse of its covariance [-]

    @cached_property
    def _root(self) -> Float[np.ndarray, "column column"]:
        return np.linalg.cholesky(self.precision)

    def drawn(self, count: int, generator: np.random.Generator) -> Float[np.ndarray, "particle column"]:
        """Return particles of it."""
        standard = generator.standard_normal((count, self.centre.size))
        return np.asarray(self.centre + solve_triangular(self._root.T, standard.T).T)

    def __call__(self, where: Float[np.ndarray, "particle column"]) -> Float[np.ndarray, " particle"]:
        """Return the logarithm of its density, up to a constant."""
        return np.asarray(-0.5 * (((where - self.centre) @ self._root) ** 2).sum(axis=1))


def bridge(
    start: Neighbourhood,
    target: LogDensity,
    particles: int,
    generator: np.random.Generator,
    *,
    effective: float = 0.5,
    most: int = 20,
    settling: int = 0,
) -> Float[np.ndarray, "particle column"]:
    """Return particles of the target density from particles of the start density.

    The target is the logarithm of a density, up to a constant; minus infinity where a particle may not be. Each step
    leaves the effective share of the particles, which sets its length, and makes at most so many moves; settling are
    the moves at the end of the way.

    Notes
    -----
    Sequential Monte Carlo over start^(1−t)·target^t: at each t the particles are weighed, resampled and moved. A move
    is a step of an autoregressive process that has the particles' mean and covariance, accepted by Metropolis–Hastings,
    so that a normal density in any number of dimensions needs few of them.

    References
    ----------
    Del Moral, Doucet & Jasra 2006, J. R. Stat. Soc. B 68; Cotter et al. 2013, Stat. Sci. 28.
    """
    where, time, length = start.drawn(particles, generator), 0.0, 0.5
    own, wanted = start(where), target(where)
    while time < 1.0:
        time, weight = _next_time(time, wanted - own, effective)
        mean, root = _cloud(where, weight)
        chosen = _resampled(weight, generator)
        where, own, wanted = where[chosen], own[chosen], wanted[chosen]
        before = np.asarray(solve_triangular(root, (where - mean).T, lower=True).T)
        reference = before
        for _ in range(most + (settling if time == 1.0 else 0)):
            step = np.minimum(length * np.exp(0.5 * generator.standard_normal(len(where))), 1.0)[:, np.newaxis]
            to = np.sqrt(1.0 - step**2) * before + step * generator.standard_normal(where.shape)
            there = np.asarray(mean + to @ root.T)
            own_there, wanted_there = start(there), target(there)
            gain = (1.0 - time) * (own_there - own) + time * (wanted_there - wanted)
            gain += 0.5 * ((to**2).sum(axis=1) - (before**2).sum(axis=1))
            taken = np.log(generator.random(len(where))) < gain
            where, before = np.where(taken[:, None], there, where), np.where(taken[:, None], to, before)
            own, wanted = np.where(taken, own_there, own), np.where(taken, wanted_there, wanted)
            length = float(np.clip(length * np.exp(taken.mean() - _ACCEPTED), 0.02, 0.9))
            if time < 1.0 and (before * reference).sum() < _CORRELATION * (reference**2).sum():
                break
    return where


def _cloud(
    where: Float[np.ndarray, "particle column"], weight: Float[np.ndarray, " particle"]
) -> tuple[Float[np.ndarray, " column"], Float[np.ndarray, "column column"]]:
    """Return mean and root of the covariance of the particles, in which their moves are made."""
    mean = weight @ where
    apart = where - mean
    covariance = _INFLATION * (apart.T * weight) @ apart
    ridge = 1e-9 * np.trace(covariance) / mean.size  # so that few particles still span all columns
    return mean, np.linalg.cholesky(covariance + ridge * np.eye(mean.size))


def _weight(gain: Float[np.ndarray, " particle"]) -> Float[np.ndarray, " particle"]:
    weight = np.exp(gain - gain.max())
    return np.asarray(weight / weight.sum())


def _next_time(
    time: float, gain: Float[np.ndarray, " particle"], effective: float
) -> tuple[float, Float[np.ndarray, " particle"]]:
    """Return the time at which the effective share of the particles has fallen so far, and their weights [-]."""

    def left(to: float) -> float:
        return float(1.0 / (gain.size * (_weight((to - time) * gain) ** 2).sum())) - effective

    to = 1.0 if left(1.0) >= 0.0 else float(brentq(left, time, 1.0, xtol=1e-12))
    return to, _weight((to - time) * gain)


def _resampled(weight: Float[np.ndarray, " particle"], generator: np.random.Generator) -> Int[np.ndarray, " particle"]:
    """Return which particles go on, each about as often as its weight says."""
    comb = (np.arange(weight.size) + generator.random()) / weight.size
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(weight), comb), weight.size - 1))
