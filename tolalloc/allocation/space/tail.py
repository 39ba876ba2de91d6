"""The tail of an output: the units furthest beyond its limits, and what they say of a share that lies beyond."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from tolalloc.capability.near_limit import largest_first

_OUTERMOST, _FEWEST = 3.0, 200
"""The tail is that of so many times the share that may fail, of so many units at least [-]."""
_ENOUGH = 60
"""Failing units from which those further out than a third of them say nothing of where they begin to fail [-]."""
FEWEST_OF_TAIL = 3
"""Units through which such a line is drawn at least [-]."""


def tail_units(units: float, share: float, *, cheap: bool = False) -> int:
    """Return how many of the outermost units tell what a share of them lies beyond, twice as many if cheap [-]."""
    few = max(int(_OUTERMOST * share * units), _FEWEST) * (2 if cheap else 1)
    return min(few, int(units))


def tail_scores(units: float, outermost: int) -> Float[np.ndarray, " outermost"]:
    """Return the normal scores of the outermost of all units, z = −Φ⁻¹((i − ½)/n), the furthest first [-]."""
    from scipy.special import ndtri

    return -np.asarray(ndtri((np.arange(outermost) + 0.5) / units))


def norm_score(share: float) -> float:
    """Return the score of a normal output that a share lies further out than [-]."""
    from scipy.special import ndtri

    return -float(ndtri(share))


def norm_share(score: float) -> float:
    """Return the share of a normal output further out than a score [-]."""
    from scipy.special import ndtr

    return float(np.clip(ndtr(-score), 1e-9, 0.5))


def tail_weights(units: float, share: float, outermost: int) -> Float[np.ndarray, " outermost"]:
    """Return by what the outermost of all units count in the value that a share of them lies beyond.

    Parameters
    ----------
    units
        Number of all units [-].
    share
        Share that lies beyond the value [-].
    outermost
        Number of those that count, the furthest first [-].

    Notes
    -----
    The line through their values over their normal scores, read at the score of the share: exact for a normal output,
    whose mean and deviation it does not need. As the weights do not depend on the values, the derivative of the value
    is what the same weights make of the derivatives of the units, where a quantile's own would be that of one unit (own
    derivation).

    wᵢ = 1/m + (z − z̄)·(zᵢ − z̄)/Σ(zⱼ − z̄)² with zᵢ = Φ⁻¹(1 − (i − ½)/n), Σ wᵢ = 1. Where many fail, the outermost third
    of these has no weight: the tail there may be another one.
    """
    failing = share * units
    first = min(int(failing / _OUTERMOST), outermost - FEWEST_OF_TAIL) if failing >= _ENOUGH else 0
    scores = tail_scores(units, outermost)[first:]
    apart = scores - scores.mean()
    weights = 1 / scores.size + (norm_score(share) - scores.mean()) * apart / (apart @ apart)
    return np.asarray(np.concatenate([np.zeros(first), weights]))


@dataclass(frozen=True, kw_only=True)
class FurthestUnits:
    """Units of a design furthest beyond one limit of an output, and how their excess moves."""

    units: float  # Of how many they are [-]
    rows: Int[np.ndarray, " few"]  # Which of them they are
    excess: Float[np.ndarray, " few"]  # Over the deviation of the output, the largest first [-]
    slopes: Float[np.ndarray, "few variable"]  # Its derivative by every variable
    deviation: float  # Of the output [unit of the output]
    relative: float  # Limit over it, what an excess over the limit is an excess over the deviation by [-]

    @classmethod
    def of(
        cls,
        excess: Float[np.ndarray, " unit"],
        size: float,
        count: int,
        slopes_at: Callable[[Int[np.ndarray, " few"]], Float[np.ndarray, "few variable"]],
    ) -> FurthestUnits:
        """Return so many of some units.

        Parameters
        ----------
        excess
            How far every unit lies beyond the limit, NaN where it has no answer [unit of the output].
        size
            Of the limit [unit of the output].
        count
            Number of units [-].
        slopes_at
            Returns the derivatives of the excess of some units by every variable.
        """
        known = np.flatnonzero(np.isfinite(excess))
        rows = known[largest_first(excess[known], count)]
        slopes, deviation = slopes_at(rows), float(excess[known].std()) or 1.0
        kept = np.isfinite(slopes).all(axis=1)
        return cls(
            units=excess.size,
            rows=rows[kept],
            excess=excess[rows[kept]] / deviation,
            slopes=slopes[kept] / deviation,
            deviation=deviation,
            relative=size / deviation,
        )

    def batch(self, first: int, count: int) -> FurthestUnits:
        """Return every so-manieth of them, as if so many fewer units had been drawn."""
        of_batch = self.rows % count == first
        return replace(
            self,
            units=self.units / count,
            rows=self.rows[of_batch],
            excess=self.excess[of_batch],
            slopes=self.slopes[of_batch],
        )
