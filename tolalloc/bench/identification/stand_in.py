"""A polynomial in place of the model, for the many thousand readings of a swarm, a profile or a bootstrap."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.bench.identification.data import AllReadings
from tolalloc.bench.identification.parameters import BIAS, Parameter, box
from tolalloc.bench.identification.prediction import KernelPredictor, Prediction
from tolalloc.drawings.seeds import SeedTree
from tolalloc.surrogate.polynomial import BoxPolynomial, fit_box_polynomial
from tolalloc.units import ARCSECOND

LARGE_DRIFT = 0.3
"""Distance of polynomials' and model's least objective over the standard deviation that makes profiles doubtful [-]."""

_DEGREES = {1: 8, 2: 6, 3: 4, 4: 3, 5: 3}
"""Parameters → total degree; beyond them 2 [-]."""


@dataclass(frozen=True)
class StandIn:
    """The readings as polynomials of the coordinates inside the bounds; the bias is added exactly."""

    # The unknowns, in the order of the coordinates; those that the polynomial has and this lacks stay at their start
    parameters: tuple[Parameter, ...]
    fitted: tuple[Parameter, ...]  # Parameters of the polynomial
    polynomial: BoxPolynomial  # The fitted polynomial of all readings
    data: AllReadings  # The readings
    # Added to every reading, so that they are the model's at one point; 0 unless `anchored` [rad]
    offset: float | Float[np.ndarray, " datum"] = 0.0

    def of(self, parameters: tuple[Parameter, ...]) -> StandIn:
        """Return the stand-in for fewer unknowns, or with a bias."""
        return replace(self, parameters=parameters)

    def anchored(self, coordinates: Float[np.ndarray, " parameter"], model: Prediction) -> StandIn:
        """Return the stand-in moved onto what the model predicts at one point."""
        return replace(self, offset=model.values - self.values(coordinates[np.newaxis])[0])

    def __call__(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        """Return readings and derivatives at one point."""
        slopes = np.zeros((self.data.measured.size, len(self.parameters)))
        by_fitted = self.polynomial.derivatives(self._inside(coordinates[np.newaxis])[0])
        for at, item in enumerate(self.parameters):
            if item.name == BIAS:
                slopes[self.data.peak_to_peak or slice(0), at] = ARCSECOND
            else:
                slopes[:, at] = by_fitted[:, self._place[item.name]]
        return Prediction(values=self.values(coordinates[np.newaxis])[0], by_coordinate=slopes)

    def values(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point datum"]:
        """Return the readings at many points [rad]."""
        found = self.polynomial(self._inside(coordinates))
        for at, item in enumerate(self.parameters):
            if item.name == BIAS:
                bias = (item.start + coordinates[:, at]) * ARCSECOND
                found[:, self.data.peak_to_peak or slice(0)] += bias[:, np.newaxis]
        return np.asarray(found + self.offset)

    @property
    def _place(self) -> dict[str, int]:
        return {item.name: at for at, item in enumerate(self.fitted)}

    def _inside(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point fitted"]:
        """Return the coordinates of the polynomial's own parameters."""
        found = np.zeros((coordinates.shape[0], len(self.fitted)))
        for at, item in enumerate(self.parameters):
            if item.name != BIAS:
                found[:, self._place[item.name]] = coordinates[:, at]
        return found


def fit_stand_in(kernel: KernelPredictor, seeds: SeedTree) -> StandIn:
    """Return polynomials of all readings inside the bounds, their error measured on runs that the fit did not see."""
    fitted = tuple(item for item in kernel.parameters if item.name != BIAS)
    polynomial = fit_box_polynomial(
        replace(kernel, parameters=fitted).values, *box(fitted), _DEGREES.get(len(fitted), 2), seeds
    )
    return StandIn(kernel.parameters, fitted, polynomial, kernel.data)
