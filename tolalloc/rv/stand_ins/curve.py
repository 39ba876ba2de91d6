"""Regression of the whole curve: the amounts of its principal modes as polynomials of the columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from sklearn.decomposition import PCA
from sklearn.multioutput import MultiOutputRegressor

from tolalloc.chunks import map_chunks
from tolalloc.model import Evaluation
from tolalloc.rv.response.kernel import KernelResponse
from tolalloc.rv.stand_ins.contact import Corrected, corrected
from tolalloc.surrogate.regression import fitted, lasso, on_products_of_two
from tolalloc.units import ARCSECOND


@dataclass(frozen=True, kw_only=True)
class CurveRegression:
    """Fitted curves of the transmission error, answered by their peak-to-peak.

    Parameters
    ----------
    columns, outputs
        As in `tolalloc.model.Response`.
    modes
        The fitted principal modes of the curves.
    estimator
        The fitted estimator of the modes' amounts.
    """

    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    modes: Any
    estimator: Any

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the peak-to-peak of the fitted curves."""
        values = np.empty((x.shape[0], 1))
        for rows, curves in map_chunks(self.curves, x):
            values[rows, 0] = np.ptp(curves, axis=1)
        return Evaluation(values=values, status=np.zeros(x.shape[0], np.uint8))

    def curves(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample angle"]:
        """Return the fitted curves [output]."""
        return np.asarray(self.modes.inverse_transform(self.estimator.predict(x)))


@dataclass(frozen=True, kw_only=True)
class CurveCandidate:
    """Regression of the curve that the kernel's coarse angles give.

    Parameters
    ----------
    kernel
        What the curves come from.
    modes
        Principal modes that are kept [-].

    Notes
    -----
    A regression flattens what it cannot follow, so the peak-to-peak comes out too small; a line makes up for it on
    average. Fitting takes a LASSO per mode, which is minutes for some 60 columns.
    """

    kernel: KernelResponse
    modes: int = 20

    @property
    def name(self) -> str:
        """What a table calls it."""
        return f"sparse quadratic regression of {self.modes} modes of the curve"

    def fit(self, x: Float[np.ndarray, "sample column"], y: Float[np.ndarray, " sample"]) -> Corrected:
        """Return the regression through the curves of the samples, its peak-to-peak brought to the answers."""
        curves = np.concatenate([part for _, part in map_chunks(self._curves, x)])
        modes = PCA(self.modes, svd_solver="covariance_eigh")
        amounts = modes.fit_transform(curves)
        regression = CurveRegression(
            columns=self.kernel.columns,
            outputs=self.kernel.outputs,
            modes=modes,
            estimator=fitted(on_products_of_two(MultiOutputRegressor(lasso())), x, amounts),
        )
        return corrected(regression, x, y)

    def _curves(self, x: Float[np.ndarray, "chunk column"]) -> Float[np.ndarray, "chunk angle"]:
        """Return the curves at the coarse angles [arcsec]."""
        equilibria = self.kernel.model.equilibria(self.kernel.errors(x), self.kernel.torque)
        return np.asarray(equilibria.transmission_error / ARCSECOND)
