"""A smooth function of a few variables in a box, by Chebyshev polynomials of a total degree, with a measured error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import chebyshev
from scipy.stats import qmc

from tolalloc.drawings.seeds import SeedTree

HELD_OUT = 0.2
"""Answers that the fit does not see, over those that it sees [-]."""

_RUNS_PER_TERM = 2.5

Answers = Callable[[Float[np.ndarray, "sample variable"]], Float[np.ndarray, "sample output"]]
"""What is stood in for: outputs of every row of variables."""


@dataclass(frozen=True, kw_only=True)
class BoxPolynomial:
    """A fitted stand-in for a function with many outputs.

    Parameters
    ----------
    lower, upper
        The box [variable].
    degrees
        Degree of each term in each variable [-].
    coefficients
        Coefficient of each term for each output [output].
    rms_error, largest_error
        Root-mean-square and largest error on held-out answers, over all outputs [output].
    trained, held_out
        Numbers of answers [-].
    """

    lower: Float[np.ndarray, " variable"]
    upper: Float[np.ndarray, " variable"]
    degrees: Int[np.ndarray, "term variable"]
    coefficients: Float[np.ndarray, "term output"]
    rms_error: float
    largest_error: float
    trained: int
    held_out: int

    def __call__(self, x: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample output"]:
        """Return the outputs of every sample."""
        return np.asarray(terms(self._scaled(x), self.degrees) @ self.coefficients)

    def derivatives(self, x: Float[np.ndarray, " variable"]) -> Float[np.ndarray, "output variable"]:
        """Return the derivatives of the outputs at one point by the variables [output/variable]."""
        by_variable = [
            self._slopes @ factor for factor in chebyshev.chebvander(self._scaled(x[np.newaxis])[0], self._top)
        ]
        values = chebyshev.chebvander(self._scaled(x[np.newaxis])[0], self._top)
        columns = []
        for own in range(x.size):
            factors = [
                (by_variable if variable == own else values)[variable][self.degrees[:, variable]]
                for variable in range(x.size)
            ]
            slope = np.prod(factors, axis=0) @ self.coefficients
            columns.append(slope * 2.0 / (self.upper[own] - self.lower[own]))
        return np.stack(columns, axis=1)

    @property
    def _top(self) -> int:
        return int(self.degrees.max())

    @cached_property
    def _slopes(self) -> Float[np.ndarray, "degree degree"]:
        """Derivative of each Chebyshev polynomial in terms of the others."""
        size = self._top + 1
        slopes = np.zeros((size, size))
        for degree in range(1, size):
            own = chebyshev.chebder(np.eye(size)[degree])
            slopes[degree, : own.size] = own
        return slopes

    def _scaled(self, x: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the variables on −1…1."""
        return np.asarray((2.0 * x - self.lower - self.upper) / (self.upper - self.lower))


def terms(
    x: Float[np.ndarray, "sample variable"], degrees: Int[np.ndarray, "term variable"]
) -> Float[np.ndarray, "sample term"]:
    """Return the products of Chebyshev polynomials of every sample.

    Parameters
    ----------
    x
        Variables on −1…1 [-].
    degrees
        Degree of each term in each variable [-].
    """
    values = np.moveaxis(chebyshev.chebvander(x, int(degrees.max())), 1, 0)
    return np.asarray(np.prod([values[own][:, degrees[:, own]] for own in range(x.shape[1])], axis=0))


def total_degrees(variables: int, degree: int) -> Int[np.ndarray, "term variable"]:
    """Return all terms whose degrees add up to no more than ``degree`` [-]."""
    return np.array([row for row in product(range(degree + 1), repeat=variables) if sum(row) <= degree])


def fit_box_polynomial(
    answers: Answers,
    lower: Float[np.ndarray, " variable"],
    upper: Float[np.ndarray, " variable"],
    degree: int,
    seeds: SeedTree,
) -> BoxPolynomial:
    """Return the polynomial of least squares through answers at evenly scattered points of the box.

    Parameters
    ----------
    answers
        What is stood in for; it must answer everywhere in the box.
    lower, upper
        The box [variable].
    degree
        Largest total degree of a term [-].
    seeds
        Node of the seed tree.
    """
    degrees = total_degrees(lower.size, degree)
    trained = int(np.ceil(_RUNS_PER_TERM * len(degrees)))
    held_out = int(np.ceil(HELD_OUT * trained))
    runs = trained + held_out
    scattered = qmc.Sobol(lower.size, rng=seeds.generator()).random_base2((runs - 1).bit_length())[:runs]
    # Denser towards the sides, where a polynomial through even points would be worst.
    seen = -np.cos(np.pi * scattered[:trained])
    x = np.concatenate([seen, 2.0 * scattered[trained:] - 1.0])
    y = answers(lower + (x + 1.0) / 2.0 * (upper - lower))
    coefficients = np.linalg.lstsq(terms(x[:trained], degrees), y[:trained], rcond=None)[0]
    error = terms(x[trained:], degrees) @ coefficients - y[trained:]
    return BoxPolynomial(
        lower=lower,
        upper=upper,
        degrees=degrees,
        coefficients=coefficients,
        rms_error=float(np.sqrt((error**2).mean())),
        largest_error=float(np.abs(error).max()),
        trained=trained,
        held_out=held_out,
    )
