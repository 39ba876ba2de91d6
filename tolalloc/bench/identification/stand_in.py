"""A polynomial in place of the model, for the many thousand readings of a swarm, a profile or a bootstrap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.bench.identification.data import Data
from tolalloc.bench.identification.parameters import BIAS, Parameter, box
from tolalloc.bench.identification.prediction import KernelPredictor, Prediction
from tolalloc.drawing.seeds import SeedTree
from tolalloc.surrogate.polynomial import BoxPolynomial, fit_box_polynomial
from tolalloc.units import ARCSECOND

LARGE_DRIFT = 0.3
"""Distance of polynomials' and model's least objective over the standard deviation that makes profiles doubtful [-]."""

_DEGREES = {1: 8, 2: 6, 3: 4, 4: 3, 5: 3}
"""Parameters → total degree; beyond them 2 [-]."""


@dataclass(frozen=True)
class StandIn:
    """The readings as polynomials of the coordinates inside the bounds; the bias is added exactly.

    Parameters
    ----------
    parameters
        The unknowns, in the order of the coordinates; those that the polynomial has and this lacks stay at their start.
    fitted
        Parameters of the polynomial.
    polynomial
        The fitted polynomial of all readings.
    data
        The readings.
    """

    parameters: tuple[Parameter, ...]
    fitted: tuple[Parameter, ...]
    polynomial: BoxPolynomial
    data: Data

    def of(self, parameters: tuple[Parameter, ...]) -> StandIn:
        """Return the stand-in for fewer unknowns, or with a bias."""
        return StandIn(parameters, self.fitted, self.polynomial, self.data)

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
        return found

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
    """Return polynomials of all readings inside the bounds, their error measured on runs that the fit did not see.

    Parameters
    ----------
    kernel
        The model; its bias is left to the stand-in.
    seeds
        Node of the seed tree.
    """
    fitted = tuple(item for item in kernel.parameters if item.name != BIAS)
    own = KernelPredictor(kernel.reducer, fitted, kernel.measurements, kernel.data, kernel.observe)
    degree = _DEGREES.get(len(fitted), 2)
    polynomial = fit_box_polynomial(own.values, *box(fitted), degree, seeds)
    return StandIn(kernel.parameters, fitted, polynomial, kernel.data)


@dataclass(frozen=True)
class Anchored:
    """A stand-in whose readings are moved, so that they are the model's at one point.

    Parameters
    ----------
    stand_in
        The polynomials.
    offset
        Model less polynomials at that point, without the bias's part [rad].
    """

    stand_in: StandIn
    offset: Float[np.ndarray, " datum"]

    def __call__(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        """Return readings and derivatives at one point."""
        found = self.stand_in(coordinates)
        return Prediction(values=found.values + self.offset, by_coordinate=found.by_coordinate)

    def values(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point datum"]:
        """Return the readings at many points [rad]."""
        return np.asarray(self.stand_in.values(coordinates) + self.offset)

    def of(self, parameters: tuple[Parameter, ...]) -> Anchored:
        """Return the same for fewer unknowns, or with a bias."""
        return Anchored(self.stand_in.of(parameters), self.offset)


def anchored(stand_in: StandIn, coordinates: Float[np.ndarray, " parameter"], model: Prediction) -> Anchored:
    """Return the stand-in moved onto what the model predicts at one point."""
    return Anchored(stand_in, model.values - stand_in.values(coordinates[np.newaxis])[0])
