"""Readings of one curve, and what separates them from the model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.bench.measurement.angles import TURN
from tolalloc.bench.measurement.records import MeasuredCurve
from tolalloc.exceptions import InputError
from tolalloc.units import ARCSECOND, DEGREE

FEWEST = 24
"""Fewest readings that a diagnosis starts from [-]."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What separates a reading from the model.

    Parameters
    ----------
    reading
        Standard deviation of one reading, independent of all others [rad].
    discrepancy
        Standard deviation of what the model leaves out [rad].
    correlation_angle
        Angle over which what is left out stays alike: its correlation falls as exp(−½(Δ/angle)²) [rad].
    """

    reading: float = 0.5 * ARCSECOND
    discrepancy: float = 0.5 * ARCSECOND
    correlation_angle: float = 1.5 * DEGREE

    def __post_init__(self) -> None:
        for name in ("reading", "correlation_angle"):
            if not getattr(self, name) > 0.0:
                raise InputError.at("noise", name, getattr(self, name), "above 0")
        if not self.discrepancy >= 0.0:
            raise InputError.at("noise", "discrepancy", self.discrepancy, "0 or more")

    def left_out(self, carrier_angle: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle angle"]:
        """Return the covariance of what the model leaves out at angles of one turn [rad²]."""
        apart = np.abs(carrier_angle[:, np.newaxis] - carrier_angle) % TURN
        apart = np.minimum(apart, TURN - apart)
        return np.asarray(self.discrepancy**2 * np.exp(-0.5 * (apart / self.correlation_angle) ** 2))


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Readings that a diagnosis starts from.

    Parameters
    ----------
    carrier_angle
        Their angles [rad].
    values
        Transmission error [rad].
    covariance
        Of their noise and of what the model leaves out [rad²].
    """

    carrier_angle: Float[np.ndarray, " angle"]
    values: Float[np.ndarray, " angle"]
    covariance: Float[np.ndarray, "angle angle"]

    @property
    def freedom(self) -> int:
        """Independent numbers that they hold; no bench knows their mean [-]."""
        return self.values.size - 1

    @cached_property
    def whitening(self) -> Float[np.ndarray, "angle angle"]:
        """What makes residuals independent with variance 1 and takes out a common offset of the readings [1/rad]."""
        whitened = np.linalg.inv(np.linalg.cholesky(self.covariance))
        offset = whitened.sum(axis=1, keepdims=True) / np.linalg.norm(whitened.sum(axis=1))
        return np.asarray(whitened - offset @ (offset.T @ whitened))


def thinned(curve: MeasuredCurve, noise: Noise, most: int) -> Readings:
    """Return those readings of a measured curve that stand nearest to equally spaced angles.

    Parameters
    ----------
    curve
        Readings over a turn or a piece of one.
    noise
        What separates them from the model.
    most
        Equally spaced angles of a turn; closer readings share what the model leaves out and tell little more [-].

    Raises
    ------
    InputError
        Fewer than `FEWEST` readings.
    """
    step = TURN / most
    place = np.mod(curve.carrier_angle, TURN) / step
    nearest = np.rint(place)
    order = np.lexsort((np.abs(place - nearest), np.mod(nearest, most)))
    _, first = np.unique(np.mod(nearest, most)[order], return_index=True)
    kept = np.sort(order[first])
    if kept.size < FEWEST:
        raise InputError.at("measured curve", "number of readings apart", int(kept.size), f"{FEWEST} or more")
    angle = curve.carrier_angle[kept]
    return Readings(
        carrier_angle=angle,
        values=curve.transmission_error[kept],
        covariance=noise.reading**2 * np.eye(kept.size) + noise.left_out(angle),
    )
