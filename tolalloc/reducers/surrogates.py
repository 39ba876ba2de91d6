"""Stand-ins for the model: itself at fewer angles, and a regression of the modes of its curve."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.polynomial import polynomial

from tolalloc.models.model import Evaluation, KeepsTables, Passing, Response, Samples
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.chunks import map_chunks


@dataclass(frozen=True, kw_only=True)
class Corrected(Passing):
    """A response with one output, brought by a straight line to that of a better one."""

    offset: float  # Added to its answers [output]
    factor: float  # What its answers are multiplied by before [-]

    def __call__(self, x: Samples) -> Evaluation:
        """Return the corrected answers; a sample that fails stays a failed one."""
        evaluation = self.response(x)
        return replace(evaluation, values=self.offset + self.factor * evaluation.values)

    def release(self) -> None:
        """Let go of the tables of what answers."""
        if isinstance(self.response, KeepsTables):
            self.response.release()


def corrected(response: Response, evaluation: Evaluation, y: Float[np.ndarray, " sample"]) -> Corrected:
    """Return the response with the line of least squares that brings what it said to the answers ``y``.

    min Σ (y − a − b·ŷ)², least squares; fitted where both are good (own derivation).
    """
    offset, factor = polynomial.polyfit(evaluation.values[evaluation.good, 0], y[evaluation.good], 1)
    return Corrected(response=response, offset=float(offset), factor=float(factor))


@dataclass(frozen=True, kw_only=True)
class ContactCandidate:
    """The equivalent model itself, its curve read at equally spaced angles without a search between them.

    Angles miss the kinks where the extremes are, so the peak-to-peak comes out too small, by nearly the same amount
    for every unit; the line makes up for it. At 936 angles the RV-20E's line, fitted at the zones of its table, is off
    by 0.4″ on average at a quarter of them and by less at larger ones.
    """

    kernel: KernelResponse  # The model with the full search
    angles: int  # Angles of the turn [-]
    # Columns of a sample → value and status at these angles: a sample is fitted to in most folds, and solved once
    _known: dict[bytes, tuple[float, int]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def name(self) -> str:
        """What a table calls it."""
        return f"contact at {self.angles} angles"

    def fit(self, x: Samples, y: Float[np.ndarray, " sample"]) -> Corrected:
        """Return the model at fewer angles, brought to the answers."""
        keys = [row.tobytes() for row in x]
        new = [at for at, key in enumerate(keys) if key not in self._known]
        if new:
            found = self._fewer(x[new])
            answers = zip(found.values[:, 0].tolist(), found.status.tolist(), strict=True)
            self._known.update(zip((keys[at] for at in new), answers, strict=True))
        values, status = zip(*(self._known[key] for key in keys), strict=True)
        known = Evaluation(values=np.array(values)[:, np.newaxis], status=np.array(status, np.uint8))
        return corrected(self._fewer, known, y)

    @cached_property
    def _fewer(self) -> KernelResponse:
        """The model at these angles."""
        model, search = self.kernel.model, AngleSearch(coarse=self.angles, nodes_per_coarse=1, levels=0)
        return replace(self.kernel, model=EquivalentModel(model.reducer, search, model.orders))


@dataclass(frozen=True, kw_only=True)
class CurveRegression:
    """Fitted curves of the transmission error, answered by their peak-to-peak."""

    # As in `tolalloc.models.model.Response`
    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    modes: Any  # The fitted principal modes of the curves
    estimator: Any  # The fitted estimator of the modes' amounts

    def __call__(self, x: Samples) -> Evaluation:
        """Return the peak-to-peak of the fitted curves."""
        values = np.empty((x.shape[0], 1))
        for rows, curves in map_chunks(self.curves, x):
            values[rows, 0] = np.ptp(curves, axis=1)
        return Evaluation(values=values, status=np.zeros(x.shape[0], np.uint8))

    def curves(self, x: Samples) -> Float[np.ndarray, "sample angle"]:
        """Return the fitted curves [output]."""
        return np.asarray(self.modes.inverse_transform(self.estimator.predict(x)))


@dataclass(frozen=True, kw_only=True)
class CurveCandidate:
    """Regression of the curve that the kernel's coarse angles give.

    A regression flattens what it cannot follow, so the peak-to-peak comes out too small; a line makes up for it on
    average. Fitting takes a LASSO per mode, which is minutes for some 60 columns.
    """

    kernel: KernelResponse  # What the curves come from
    modes: int = 20  # Principal modes that are kept [-]

    @property
    def name(self) -> str:
        """What a table calls it."""
        return f"sparse quadratic regression of {self.modes} modes of the curve"

    def fit(self, x: Samples, y: Float[np.ndarray, " sample"]) -> Corrected:
        """Return the regression through the curves of the samples, its peak-to-peak brought to the answers."""
        from sklearn.decomposition import PCA
        from sklearn.multioutput import MultiOutputRegressor

        from tolalloc.sensitivity.surrogate.regression import fitted, lasso, on_products

        curves = np.concatenate([part for _, part in map_chunks(self._curves, x)])
        modes = PCA(self.modes, svd_solver="covariance_eigh")
        amounts = modes.fit_transform(curves)
        regression = CurveRegression(
            columns=self.kernel.columns,
            outputs=self.kernel.outputs,
            modes=modes,
            estimator=fitted(on_products(MultiOutputRegressor(lasso())), x, amounts),
        )
        return corrected(regression, regression(x), y)

    def _curves(self, x: Float[np.ndarray, "chunk column"]) -> Float[np.ndarray, "chunk angle"]:
        """Return the curves at the coarse angles [arcsec]."""
        equilibria = self.kernel.model.equilibria(self.kernel.errors(x), self.kernel.torque)
        return np.asarray(equilibria.transmission_error / ARCSECOND)
