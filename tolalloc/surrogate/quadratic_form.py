"""Quadratic forms of many columns, fitted by a ridge and quick to ask for hundreds of thousands of units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


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
    from sklearn.linear_model import Ridge
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    middle, deviation = x.mean(axis=0), x.std(axis=0)
    spread = np.where(deviation > 0, deviation, 1.0)
    # The products of 60 columns of 5,000 units are 70 MiB: scaled and centred where they stand.
    products, scaler = PolynomialFeatures(2, include_bias=False), StandardScaler(copy=False)
    found = Ridge(strength, copy_X=False).fit(scaler.fit_transform(products.fit_transform((x - middle) / spread)), y)
    weights = np.atleast_2d(found.coef_) / scaler.scale_
    columns, is_product = x.shape[1], products.powers_.sum(axis=1) == 2
    powers = products.powers_[is_product]
    curvature = np.zeros((y.shape[1], columns, columns))
    curvature[:, powers.argmax(axis=1), columns - 1 - powers[:, ::-1].argmax(axis=1)] = weights[:, is_product]
    return QuadraticForm(
        middle=middle,
        spread=spread,
        offset=np.atleast_1d(found.intercept_) - weights @ scaler.mean_,
        slopes=weights[:, ~is_product].T,
        curvature=curvature,
    )
