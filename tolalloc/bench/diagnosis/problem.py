"""The question of a diagnosis: which errors, likely on their drawings, make the curve that was read."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.bench.diagnosis.readings import Readings
from tolalloc.chunks import map_chunks
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.rv.equivalent.answers import Equilibria
from tolalloc.rv.equivalent.condensation import CondensedAngles
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.response.kernel import KernelResponse

_STEP = 1e-4
"""Step of the standard normal numbers in the derivative of the deviations, which are smooth in them [-]."""


@dataclass(frozen=True)
class _OneTurn(EquivalentModel):
    """An equivalent model that is asked for the same few sets of angles again and again."""

    @cached_property
    def _kept(self) -> dict[bytes, CondensedAngles]:
        return {}

    def tables_at(self, carrier_angle: Float[np.ndarray, " angle"]) -> CondensedAngles:
        """Return the condensed tables at the carrier angles [rad], made once."""
        key = carrier_angle.tobytes()
        if key not in self._kept:
            self._kept[key] = super().tables_at(carrier_angle)
        return self._kept[key]


@dataclass(frozen=True, kw_only=True)
class CurveProblem:
    """Errors of one unit as standard normal numbers, and how badly they explain its curve.

    Parameters
    ----------
    kernel
        The real model; its columns are those of the errors.
    errors
        What is known of the errors before the curve is read.
    zones
        Zones of the sources that vary [m].
    readings
        The curve.
    """

    kernel: KernelResponse
    errors: ErrorModel
    zones: Float[np.ndarray, " source"]
    readings: Readings

    @cached_property
    def _model(self) -> EquivalentModel:
        model = self.kernel.model
        return _OneTurn(model.reducer, model.search, model.orders)

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
        return self._model.equilibria(kernel.errors(x), kernel.torque, self.readings.carrier_angle)

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
        curve, derivatives = self._model.rotation_derivatives(
            kernel.errors(deviations), kernel.torque, readings.carrier_angle
        )
        columns = [kernel.model.columns.index(name) for name in self.errors.columns]
        by_column = derivatives.by_error[:, columns].reshape(samples, -1, size)
        moved = self.deviations((numbers[:, np.newaxis] + _STEP * np.eye(size)).reshape(-1, size))
        by_number = (moved.reshape(samples, size, size) - deviations[:, np.newaxis]).transpose(0, 2, 1) / _STEP
        kernel.observe(derivatives.status.reshape(samples, -1).max(axis=1))
        return (curve - readings.values) @ readings.whitening.T, readings.whitening @ by_column @ by_number
