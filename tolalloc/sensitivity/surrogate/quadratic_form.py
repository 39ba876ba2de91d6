"""Quadratic forms of many columns, fitted by a ridge and quick to ask for hundreds of thousands of units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.blas import dsyrk

_UNITS_AT_ONCE = 512
"""Units whose terms are in memory at a time [-]."""
_TERMS_AT_ONCE = 512
"""Terms of all units that are in memory at a time [-]."""
_LEAST_VARIANCE = 10 * np.finfo(float).eps
"""Variance of a term of standardised columns below which it is rounding [-]."""


@dataclass(frozen=True, kw_only=True)
class QuadraticForm:
    """Outputs as offset + slopes·u + uᵀ·curvature·u of the standardised columns u."""

    middle: Float[np.ndarray, " column"]  # Mean of the columns [column]
    spread: Float[np.ndarray, " column"]  # Their standard deviation, 1 where they do not vary [column]
    offset: Float[np.ndarray, " output"]  # [output]
    slopes: Float[np.ndarray, "column output"]  # [output]
    curvature: Float[np.ndarray, "output column column"]  # [output]

    def __call__(self, x: Float[np.ndarray, "unit column"]) -> Float[np.ndarray, "unit output"]:
        """Return the outputs of every unit."""
        u = (x - self.middle) / self.spread
        bent = [np.einsum("uc,uc->u", u @ own, u) for own in self.curvature]
        return np.asarray(self.offset + u @ self.slopes + np.stack(bent, axis=1))


def fit_quadratic_form(
    x: Float[np.ndarray, "unit column"], y: Float[np.ndarray, "unit output"], strength: float
) -> QuadraticForm:
    """Return the ridge regression on the standardised columns and all products of two.

    Parameters
    ----------
    x, y
        Columns and outputs of the units to learn from.
    strength
        Of the ridge: the square of a standardised weight costs as much as so many squared errors [-].
    """
    middle, deviation = x.mean(axis=0), x.std(axis=0)
    spread = np.where(deviation > 0, deviation, 1.0)
    first, second = np.triu_indices(x.shape[1])
    terms = _Terms((x - middle) / spread, first, second)
    centred = y - y.mean(axis=0)
    weights = (_by_terms if terms.count <= x.shape[0] else _by_units)(terms, centred, strength)
    curvature = np.zeros((y.shape[1], x.shape[1], x.shape[1]))
    curvature[:, first, second] = weights[x.shape[1] :].T
    return QuadraticForm(
        middle=middle,
        spread=spread,
        offset=y.mean(axis=0) - terms.means @ weights,
        slopes=weights[: x.shape[1]],
        curvature=curvature,
    )


class _Terms:
    """Columns and all products of two, some at a time: those of 5,000 units and 60 columns together are 70 MiB."""

    def __init__(
        self,
        u: Float[np.ndarray, "unit column"],
        first: Int[np.ndarray, " product"],
        second: Int[np.ndarray, " product"],
    ) -> None:
        self.u, self.first, self.second = u, first, second
        self.count = u.shape[1] + first.size
        # The mean of a product is a moment of the columns.
        self.means = np.concatenate([u.mean(axis=0), (u.T @ u / u.shape[0])[first, second]])

    def of_units(self) -> Iterator[tuple[slice, Float[np.ndarray, "unit term"]]]:
        """Yield all terms of some units, less their means."""
        for start in range(0, self.u.shape[0], _UNITS_AT_ONCE):
            units = slice(start, start + _UNITS_AT_ONCE)
            u = self.u[units]
            yield units, np.concatenate([u, u[:, self.first] * u[:, self.second]], axis=1) - self.means

    def of_all_units(self) -> Iterator[tuple[slice, Float[np.ndarray, "unit term"]]]:
        """Yield some terms of all units, less their means."""
        for start in range(0, self.count, _TERMS_AT_ONCE):
            terms = np.arange(start, min(start + _TERMS_AT_ONCE, self.count))
            alone, products = terms[terms < self.u.shape[1]], terms[terms >= self.u.shape[1]] - self.u.shape[1]
            u = [self.u[:, alone], self.u[:, self.first[products]] * self.u[:, self.second[products]]]
            own = slice(start, start + terms.size)
            yield own, np.concatenate(u, axis=1) - self.means[own]


def _by_terms(terms: _Terms, y: Float[np.ndarray, "unit output"], strength: float) -> Float[np.ndarray, "term output"]:
    """Return the ridge's weights from the products of all terms with each other."""
    gram = np.zeros((terms.count, terms.count), order="F")  # what stands below its diagonal is not looked at
    right = np.zeros((terms.count, y.shape[1]))
    for units, own in terms.of_units():
        gram = dsyrk(1.0, own.T, beta=1.0, c=gram, overwrite_c=True)
        right += own.T @ y[units]
    scale = _scale(np.diag(gram) / y.shape[0])[:, np.newaxis]
    gram /= scale.T
    gram /= scale
    gram[np.diag_indices(terms.count)] += strength
    return np.asarray(cho_solve(cho_factor(gram, overwrite_a=True), right / scale) / scale)


def _by_units(terms: _Terms, y: Float[np.ndarray, "unit output"], strength: float) -> Float[np.ndarray, "term output"]:
    """Return the same from the products of all units with each other, where there are fewer units than terms."""
    gram = np.asfortranarray(strength * np.eye(y.shape[0]))
    for _, own in terms.of_all_units():
        gram = dsyrk(1.0, own / _scale((own**2).mean(axis=0)), beta=1.0, c=gram, overwrite_c=True)
    by_unit = cho_solve(cho_factor(gram, overwrite_a=True), y)
    weights = ((own.T @ by_unit).T / (_scale((own**2).mean(axis=0)) ** 2) for _, own in terms.of_all_units())
    return np.concatenate([own.T for own in weights])


def _scale(variance: Float[np.ndarray, " term"]) -> Float[np.ndarray, " term"]:
    """Return the standard deviation of terms, 1 where they do not vary."""
    return np.sqrt(np.where(variance > _LEAST_VARIANCE, variance, 1.0))
