"""The question of a diagnosis: which errors, likely on their drawings, make the curve that was read."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.bench.measurement.angles import TURN
from tolalloc.bench.measurement.files import MeasuredCurve
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.equivalent.answers import Equilibria
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.chunks import map_chunks

FEWEST_READINGS = 24
"""Fewest readings that a diagnosis starts from [-]."""

_STEP = 1e-4
"""Step of the standard normal numbers in the derivative of the deviations, which are smooth in them [-]."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What separates a reading from the model."""

    reading: float = 0.5 * ARCSECOND  # Standard deviation of one reading, independent of all others [rad]
    discrepancy: float = 0.5 * ARCSECOND  # Standard deviation of what the model leaves out [rad]
    # Angle over which what is left out stays alike: its correlation falls as exp(−½(Δ/angle)²) [rad]
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
class ThinnedCurve:
    """Readings of one curve that a diagnosis starts from."""

    carrier_angle: Float[np.ndarray, " angle"]  # Their angles [rad]
    values: Float[np.ndarray, " angle"]  # Transmission error [rad]
    covariance: Float[np.ndarray, "angle angle"]  # Of their noise and of what the model leaves out [rad²]

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


def thinned(curve: MeasuredCurve, noise: Noise, most: int) -> ThinnedCurve:
    """Return those readings of a measured curve that stand nearest to equally spaced angles.

    There are ``most`` such angles in a turn; closer readings share what the model leaves out and tell little more.

    Raises
    ------
    InputError
        Fewer than `FEWEST_READINGS` readings.
    """
    step = TURN / most
    place = np.mod(curve.carrier_angle, TURN) / step
    nearest = np.rint(place)
    order = np.lexsort((np.abs(place - nearest), np.mod(nearest, most)))
    _, first = np.unique(np.mod(nearest, most)[order], return_index=True)
    kept = np.sort(order[first])
    if kept.size < FEWEST_READINGS:
        raise InputError.at("measured curve", "number of readings apart", int(kept.size), f"{FEWEST_READINGS} or more")
    angle = curve.carrier_angle[kept]
    return ThinnedCurve(
        carrier_angle=angle,
        values=curve.transmission_error[kept],
        covariance=noise.reading**2 * np.eye(kept.size) + noise.left_out(angle),
    )


@dataclass(frozen=True, kw_only=True)
class CurveProblem:
    """Errors of one unit as standard normal numbers, and how badly they explain its curve."""

    kernel: KernelResponse  # The real model; its columns are those of the errors
    errors: ErrorModel  # What is known of the errors before the curve is read
    zones: Float[np.ndarray, " source"]  # Zones of the sources that vary [m]
    readings: ThinnedCurve  # The curve

    @property
    def size(self) -> int:
        """Number of columns [-]."""
        return len(self.errors.columns)

    def deviations(self, numbers: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return the columns [m, angles rad] for standard normal numbers."""
        return self.errors.deviations_of_normal(numbers, self.zones)

    def curves(self, deviations: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample angle"]:
        """Return the transmission error at the angles of the readings, not a number where one angle failed [rad]."""
        values = np.empty((deviations.shape[0], self.readings.values.size))
        for rows, answer in map_chunks(self._equilibria, deviations):
            values[rows] = answer.transmission_error
            self.kernel.observe(answer.status.max(axis=1))
        return values

    def _equilibria(self, x: Float[np.ndarray, "chunk column"]) -> Equilibria:
        kernel = self.kernel
        return kernel.model.equilibria(kernel.errors(x), kernel.torque, self.readings.carrier_angle)

    def misfit_of(self, deviations: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
        """Return half the sum of squared residuals, each in standard deviations; infinite where a curve failed [-]."""
        residual = (self.curves(deviations) - self.readings.values) @ self.readings.whitening.T
        half = 0.5 * np.einsum("sa,sa->s", residual, residual)
        return np.where(np.isfinite(half), half, np.inf)

    def misfit(self, numbers: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
        """Return the same for standard normal numbers [-]."""
        return self.misfit_of(self.deviations(numbers))

    def linearised(
        self, numbers: Float[np.ndarray, "sample column"]
    ) -> tuple[Float[np.ndarray, "sample angle"], Float[np.ndarray, "sample angle column"]]:
        """Return the residuals in standard deviations and their derivatives by the numbers [-]."""
        samples, size = numbers.shape
        deviations = self.deviations(numbers)
        kernel, readings = self.kernel, self.readings
        curve, derivatives = kernel.model.rotation_derivatives(
            kernel.errors(deviations), kernel.torque, readings.carrier_angle
        )
        columns = [kernel.model.columns.index(name) for name in self.errors.columns]
        by_column = derivatives.by_error[:, columns].reshape(samples, -1, size)
        moved = self.deviations((numbers[:, np.newaxis] + _STEP * np.eye(size)).reshape(-1, size))
        by_number = (moved.reshape(samples, size, size) - deviations[:, np.newaxis]).transpose(0, 2, 1) / _STEP
        kernel.observe(derivatives.status.reshape(samples, -1).max(axis=1))
        return (curve - readings.values) @ readings.whitening.T, readings.whitening @ by_column @ by_number
