"""What the readings fix and what they do not: information, its directions, covariance and bounds that stop a search."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2
from scipy.stats import f as fisher_f
from scipy.stats import t as student

from tolalloc.wings.bench.least_squares import IdentificationProblem
from tolalloc.wings.bench.parameters import BIAS
from tolalloc.wings.bench.prediction import Prediction

LEVEL = 0.95
"""Confidence of every interval [-]."""

_ON_BOUND = 1e-3  # distance over the box within which a coordinate stands on its bound [-]
_FINEST = 1e-6  # least variance factor of noise that nobody stated: a thousandth of an arcsecond, squared [-]
_TINY = np.finfo(float).tiny
_RARE = 1e-3  # probability below which the stated noise is doubted [-]
_NOTHING = 1e-12  # eigenvalue over the largest, or squared loading, that is rounding [-]


@dataclass(frozen=True, kw_only=True)
class Direction:
    """One combination of coordinates that the readings fix independently of the others."""

    loading: Float[np.ndarray, " parameter"]  # Share of each coordinate, of length 1, its largest positive [-]
    deviation: float  # Standard deviation that the readings leave along it [-]
    # Half the box's extent along it: the standard deviation must be well below for the readings to say anything [-]
    half_width: float

    @property
    def is_fixed(self) -> bool:
        """Whether the 95 % interval is no longer than half of what the bounds allow."""
        return 1.96 * self.deviation < 0.5 * self.half_width


@dataclass(frozen=True, kw_only=True)
class Information:
    """What the readings say around the least objective, to first order."""

    # Fisher information of the coordinates from the readings over the variance factor, and from the prior [-]
    matrix: Float[np.ndarray, "parameter parameter"]
    # Variance of the noise over the one that the data carry: 1 where it was stated and can be believed, else the
    # reduced χ² [-]
    variance_factor: float
    freedom: int  # Readings less parameters [-]
    reduced_chi_square: float  # Sum of squared residuals over noise, per degree of freedom [-]
    # Bounds of the coordinates [-]
    lower: Float[np.ndarray, " parameter"]
    upper: Float[np.ndarray, " parameter"]
    coordinates: Float[np.ndarray, " parameter"]  # Where it was taken [-]
    estimated: bool  # Whether the variance factor was estimated from the residuals; if not, the noise is known
    logarithmic: Bool[np.ndarray, " parameter"]  # Which coordinates are logarithms; the bias is not

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Eigenvectors of the information of all logarithms, best known first; a bias is left free."""
        own, other = self.logarithmic, ~self.logarithmic
        between = self.matrix[np.ix_(own, other)]
        left = self.matrix[np.ix_(own, own)] - between @ np.linalg.pinv(self.matrix[np.ix_(other, other)]) @ between.T
        values, vectors = np.linalg.eigh(left)
        width = (self.upper - self.lower)[own]
        found = []
        for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
            loading = vector * np.sign(vector[np.abs(vector).argmax()])
            half_width = 0.5 * float(np.abs(loading) @ width)
            deviation = sqrt(1.0 / value) if value > _NOTHING * max(values[-1], _TINY) else np.inf
            found.append(Direction(loading=loading, deviation=deviation, half_width=half_width))
        return tuple(found)

    @property
    def covariance(self) -> Float[np.ndarray, "parameter parameter"]:
        """Covariance of the coordinates from the readings and the bounds together [-].

        Bounds enter as a prior with the variance of an even distribution between them, (upper − lower)²/12, so a
        coordinate of which the readings say nothing has that variance and no more. Where readings say much, it is the
        inverse of their information. Theory page, equation (40), to first order around the least.
        """
        bounds = np.diag(12.0 / (self.upper - self.lower) ** 2)
        return np.asarray(np.linalg.inv(self.matrix + bounds))

    @property
    def standard_errors(self) -> Float[np.ndarray, " parameter"]:
        """Standard errors of the coordinates from the readings alone; infinite where they say nothing [-]."""
        values, vectors = np.linalg.eigh(self.matrix)
        known = values > _NOTHING * max(values.max(), _TINY)
        share = vectors**2
        variance = share[:, known] @ (1.0 / values[known])
        open_to = share[:, ~known].sum(axis=1) > _NOTHING
        return np.asarray(np.where(open_to, np.inf, np.sqrt(variance)))

    @property
    def interval(self) -> Float[np.ndarray, "2 parameter"]:
        """First-order 95 % interval of the coordinates, not cut at the bounds [-]."""
        freedom = self.freedom if self.estimated else np.inf
        half = float(student.ppf(0.5 + LEVEL / 2, freedom)) * self.standard_errors
        return np.stack([self.coordinates - half, self.coordinates + half])

    @property
    def threshold(self) -> float:
        """Rise of twice the objective at which a 95 % interval ends: χ² of one, or F where the noise was estimated."""
        return float(fisher_f.ppf(LEVEL, 1, self.freedom) if self.estimated else chi2.ppf(LEVEL, 1))

    @property
    def on_bound(self) -> Bool[np.ndarray, " parameter"]:
        """Which coordinates stand on a bound."""
        near = _ON_BOUND * (self.upper - self.lower)
        return np.asarray((self.coordinates <= self.lower + near) | (self.coordinates >= self.upper - near))


def information(
    problem: IdentificationProblem, prediction: Prediction, coordinates: Float[np.ndarray, " parameter"]
) -> Information:
    """Return what the readings say around a point, given what should have been read there.

    Theory page, equation (39) [-], over the variance factor and with the prior deviations of (40); first order.
    """
    readings, freedom = problem.data.measured.size, problem.freedom
    slopes, left = problem.jacobian(prediction), problem.residuals(prediction, coordinates)[:readings]
    reduced = float(left @ left) / freedom
    # Stated noise is believed unless it makes such residuals in less than one case of a thousand.
    estimated = not problem.data.noise_stated or bool(chi2.sf(reduced * freedom, freedom) < _RARE)
    factor = max(reduced, _FINEST) if estimated else 1.0
    known = slopes[readings:]
    return Information(
        matrix=slopes[:readings].T @ slopes[:readings] / factor + known.T @ known,
        variance_factor=factor,
        freedom=freedom,
        reduced_chi_square=reduced,
        lower=problem.lower,
        upper=problem.upper,
        coordinates=coordinates,
        estimated=estimated,
        logarithmic=np.array([item.name != BIAS for item in problem.parameters]),
    )
