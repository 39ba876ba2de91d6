"""Surrogates: Chebyshev polynomials in a box, quadratic forms, and regressions that earn their place by their Q²."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import chebyshev
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.blas import dsyrk
from scipy.stats import qmc

from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Evaluation, Samples

Units = Float[np.ndarray, "unit column"]
"""Columns of every unit."""
Outputs = Float[np.ndarray, "unit output"]
"""Outputs of every unit."""
Point = Float[np.ndarray, " variable"]
"""A number of every variable of a box."""
_UNITS_AT_ONCE = 512
"""Units whose terms are in memory at a time [-]."""


@dataclass(frozen=True, kw_only=True)
class QuadraticForm:
    """Outputs as offset + slopes·u + uᵀ·curvature·u of the standardised columns u."""

    middle: Float[np.ndarray, " column"]  # Mean of the columns [column]
    spread: Float[np.ndarray, " column"]  # Their standard deviation, 1 where they do not vary [column]
    offset: Float[np.ndarray, " output"]  # [output]
    slopes: Float[np.ndarray, "column output"]  # [output]
    curvature: Float[np.ndarray, "output column column"]  # [output]

    def __call__(self, x: Units) -> Outputs:
        """Return the outputs of every unit."""
        u = (x - self.middle) / self.spread
        bent = [np.einsum("uc,uc->u", u @ own, u) for own in self.curvature]
        return np.asarray(self.offset + u @ self.slopes + np.stack(bent, axis=1))


def fit_quadratic_form(x: Units, y: Outputs, strength: float) -> QuadraticForm:
    """Return the ridge regression on the standardised columns and all products of two.

    The weights minimise Σ (y − ŷ)² + strength·Σ w²; strengths of 0 and up, 0 only with more units than terms.

    References
    ----------
    Hoerl & Kennard 1970, Technometrics 12, 55–67: w = (TᵀT + strength·I)⁻¹·Tᵀ·y of centred terms T, or
    from the products of units w = Tᵀ·(T·Tᵀ + strength·I)⁻¹·y (Saunders, Gammerman & Vovk 1998).
    """
    middle, deviation = x.mean(axis=0), x.std(axis=0)
    spread = np.where(deviation > 0, deviation, 1.0)
    u, mean = (x - middle) / spread, y.mean(axis=0)
    fewer_terms = u.shape[1] * (u.shape[1] + 3) // 2 <= u.shape[0]
    slopes, products = (_by_terms if fewer_terms else _by_units)(u, y - mean, strength)
    curvature = np.triu(products)
    # The mean of a product is a moment of the columns.
    offset = mean - u.mean(axis=0) @ slopes - np.einsum("oij,ij->o", curvature, u.T @ u / u.shape[0])
    return QuadraticForm(middle=middle, spread=spread, offset=offset, slopes=slopes, curvature=curvature)


Weights = tuple[Float[np.ndarray, "column output"], Float[np.ndarray, "output column column"]]
"""Weights of the columns and of their products of two, of which the upper triangle counts [output]."""


def _by_terms(u: Units, y: Outputs, strength: float) -> Weights:
    """Return the ridge's weights from the products of all terms with each other, some units at a time."""
    first, second = np.triu_indices(u.shape[1])
    count, columns = u.shape[1] + first.size, u.shape[1]
    means = np.concatenate([u.mean(axis=0), (u.T @ u / u.shape[0])[first, second]])
    gram = np.zeros((count, count), order="F")  # what stands below its diagonal is not looked at
    right = np.zeros((count, y.shape[1]))
    for start in range(0, u.shape[0], _UNITS_AT_ONCE):
        own = u[start : start + _UNITS_AT_ONCE]
        terms = np.concatenate([own, own[:, first] * own[:, second]], axis=1) - means
        gram = dsyrk(1.0, terms.T, beta=1.0, c=gram, overwrite_c=True)
        right += terms.T @ y[start : start + _UNITS_AT_ONCE]
    gram[np.diag_indices(count)] += strength
    weights = cho_solve(cho_factor(gram, overwrite_a=True), right)
    products = np.zeros((y.shape[1], columns, columns))
    products[:, first, second] = weights[columns:].T
    return weights[:columns], products


def _by_units(u: Units, y: Outputs, strength: float) -> Weights:
    """Return the same from the products of all units with each other, where there are fewer units than terms.

    The products of two of a unit times those of another one are ½·((uᵀv)² + Σ uᵢ²·vᵢ²): no term is ever formed.
    """
    alike = u @ u.T
    gram = alike + (alike**2 + u**2 @ (u**2).T) / 2
    gram += gram.mean() - gram.mean(axis=0) - gram.mean(axis=0)[:, np.newaxis]
    gram[np.diag_indices(len(gram))] += strength
    by_unit = cho_solve(cho_factor(gram, overwrite_a=True), y)
    return u.T @ by_unit, np.stack([(u * own[:, np.newaxis]).T @ u for own in by_unit.T])


HELD_OUT = 0.2
"""Answers that the fit does not see, over those that it sees [-]."""

_RUNS_PER_TERM = 2.5

Answers = Callable[[Float[np.ndarray, "sample variable"]], Float[np.ndarray, "sample output"]]
"""What is stood in for: outputs of every row of variables."""


@dataclass(frozen=True, kw_only=True)
class BoxPolynomial:
    """A fitted surrogate of a function with many outputs."""

    # The box [variable]
    lower: Point
    upper: Point
    degrees: Int[np.ndarray, "term variable"]  # Degree of each term in each variable [-]
    coefficients: Float[np.ndarray, "term output"]  # Coefficient of each term for each output [output]
    # Root-mean-square and largest error on held-out answers, over all outputs [output]
    rms_error: float
    largest_error: float
    # Numbers of answers [-]
    trained: int
    held_out: int

    def __call__(self, x: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample output"]:
        """Return the outputs of every sample."""
        return np.asarray(terms(self._scaled(x), self.degrees) @ self.coefficients)

    def derivatives(self, x: Point) -> Float[np.ndarray, "output variable"]:
        """Return the derivatives of the outputs at one point by the variables [output/variable]."""
        values = chebyshev.chebvander(self._scaled(x[np.newaxis])[0], self._top)
        by_variable = [self._slopes @ factor for factor in values]
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
        return np.pad(chebyshev.chebder(np.eye(size), axis=1), ((0, 0), (0, 1)))[:, :size]

    def _scaled(self, x: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the variables on −1…1."""
        return np.asarray((2.0 * x - self.lower - self.upper) / (self.upper - self.lower))


def terms(
    x: Float[np.ndarray, "sample variable"], degrees: Int[np.ndarray, "term variable"]
) -> Float[np.ndarray, "sample term"]:
    """Return the products of Chebyshev polynomials of every sample, of variables on −1…1 [-].

    Term i is Π_v T_dᵢᵥ(x_v) with T_n(cos θ) = cos(n·θ): Mason & Handscomb 2003, Chebyshev Polynomials, ch. 1.
    """
    values = np.moveaxis(chebyshev.chebvander(x, int(degrees.max())), 1, 0)
    return np.asarray(np.prod([values[own][:, degrees[:, own]] for own in range(x.shape[1])], axis=0))


def total_degrees(variables: int, degree: int) -> Int[np.ndarray, "term variable"]:
    """Return all terms whose degrees add up to no more than ``degree`` [-].

    They are (variables + degree)! / (variables!·degree!) terms (combinations with repetition, own derivation).
    """
    return np.array([row for row in product(range(degree + 1), repeat=variables) if sum(row) <= degree])


def fit_box_polynomial(answers: Answers, lower: Point, upper: Point, degree: int, seeds: SeedTree) -> BoxPolynomial:
    """Return the polynomial of least squares, up to a total degree, through answers all over a box [variable].

    References
    ----------
    Least squares min ‖T·c − y‖² over Chebyshev products at x = −cos(π·u), u Sobol' points, which have the density of
    Chebyshev's weight: Narayan & Zhou 2015, Comm. Comput. Phys. 18, 1–36.
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


NEEDED_Q2 = 0.95
"""A surrogate below this Q² is not used; the response itself runs instead."""


@dataclass(frozen=True, kw_only=True)
class Regression:
    """A fitted regression in place of a response."""

    # As in `tolalloc.models.model.Response`; the columns are the first ones of every sample
    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    estimator: Any  # The fitted scikit-learn estimator of the outputs

    def __call__(self, x: Samples) -> Evaluation:
        """Return the predictions."""
        own = x[:, : len(self.columns)]
        values = np.reshape(self.estimator.predict(own), (-1, len(self.outputs)))
        return Evaluation(values=np.asarray(values, dtype=float), status=np.zeros(x.shape[0], np.uint8))


@dataclass(frozen=True, kw_only=True)
class RegressionCandidate:
    """A regression that may stand in for a response with one output."""

    name: str  # What a table calls it
    # As in `tolalloc.models.model.Response`
    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    estimator: Callable[[], Any]  # Makes the unfitted scikit-learn regressor

    def fit(self, x: Samples, y: Float[np.ndarray, " sample"]) -> Regression:
        """Return the regression through answers."""
        return Regression(columns=self.columns, outputs=self.outputs, estimator=fitted(self.estimator(), x, y))


def fitted(estimator: Any, x: Samples, y: Float[np.ndarray, "sample *output"]) -> Any:
    """Return the fitted estimator."""
    from sklearn.exceptions import ConvergenceWarning

    with warnings.catch_warnings():
        # A length or the noise at its bound only says that a column, or noise, does not matter; a path of weights that
        # ends early is judged by its error like every other.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return estimator.fit(x, y)


def on_products(regressor: Any, most: int = 2) -> Any:
    """Return a linear regressor on the columns and all products of up to so many of them, two unless told."""
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    return make_pipeline(StandardScaler(), PolynomialFeatures(most, include_bias=False), StandardScaler(), regressor)


def linear_regression() -> Any:
    """Return a ridge regression on the columns alone, of the strength with the least leave-one-out error."""
    from sklearn.linear_model import RidgeCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), RidgeCV(np.logspace(0, 5, 11)))


def quadratic_regression() -> Any:
    """Return a ridge regression on all products of two columns.

    Hoerl & Kennard 1970, as `fit_quadratic_form`, with the strength of 1 … 1e5 that has the least leave-one-out error.
    """
    from sklearn.linear_model import RidgeCV

    return on_products(RidgeCV(np.logspace(0, 5, 11)))


def sparse_quadratic_regression() -> Any:
    """Return a regression on those products of two columns that the `lasso` keeps."""
    return on_products(lasso())


def lasso() -> Any:
    """Return a linear regressor that keeps few columns, how few found by cross-validation.

    Least Σ (y − ŷ)²/2n + α·Σ |w|, α by cross-validation: Tibshirani 1996, J. R. Stat. Soc. B 58, 267–288.
    """
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.linear_model import LassoCV
    from sklearn.preprocessing import StandardScaler

    return TransformedTargetRegressor(LassoCV(alphas=np.logspace(-2.5, 0, 14), cv=3), transformer=StandardScaler())
