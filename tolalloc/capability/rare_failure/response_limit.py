"""An upper limit on a response, seen from standard normal space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.rare_failure.limit_state import LimitValues
from tolalloc.models import Response, ResponseWithDerivatives

_STEP = 1e-3
"""Step of the differences in standard normal space; up to 6, rounding and curvature both cost less than 1e-4 [-]."""


@runtime_checkable
class DifferentiableResponse(Response, ResponseWithDerivatives, Protocol):
    """A response that answers with its derivatives or without."""


@dataclass(frozen=True, kw_only=True)
class ResponseLimit:
    """Distance of a response's first output from its upper limit, negative where a unit exceeds it.

    Parameters
    ----------
    experiment
        Every column of its sources has a standard normal variable of its own, whatever its distribution.
    limit
        Largest output allowed [output].
    """

    experiment: Experiment[Response]
    limit: float

    @property
    def variables(self) -> int:
        """Number of columns."""
        return len(self.experiment.errors.columns)

    def deviations(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the deviations that are as probable as the standard normal numbers [m, angles rad]."""
        return self.experiment.errors.deviations_of_normal(u, self.experiment.zones)

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> LimitValues:
        """Return the distance of every sample from the limit [output]."""
        evaluation = self.experiment.response(self.deviations(u))
        # Another output of a sample may have failed, and then the sample is lost as a whole.
        values = np.where(evaluation.good, self.limit - evaluation.values[:, 0], np.nan)
        return LimitValues(values=values, status=evaluation.status)


@dataclass(frozen=True, kw_only=True)
class ResponseLimitWithGradient(ResponseLimit):
    """The same limit on a response that knows its derivatives."""

    experiment: Experiment[DifferentiableResponse]

    def gradient(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the derivatives of every distance by the standard normal numbers, NaN where a sample failed [output].

        Notes
        -----
        The chain rule takes all deviations by all numbers, because those of one source, or of sources that depend on
        each other, mix: central differences of the distributions, exact derivatives of the response.
        """
        answer = self.experiment.response.with_derivatives(self.deviations(u))
        by_column = np.where(answer.evaluation.good[:, np.newaxis], answer.by_column, np.nan)
        gradient = np.empty_like(u)
        for variable, shift in enumerate(_STEP * np.eye(self.variables)):
            by_number = (self.deviations(u + shift) - self.deviations(u - shift)) / (2 * _STEP)
            gradient[:, variable] = -np.sum(by_column * by_number, axis=1)
        return gradient
