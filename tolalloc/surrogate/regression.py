"""Regression surrogates: a stand-in earns its place by its Q² on answers that it has not seen."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.models import Evaluation

NEEDED_Q2 = 0.95
"""A surrogate below this Q² is not used; the response itself runs instead."""


Baseline = Callable[[Float[np.ndarray, "sample column"]], Float[np.ndarray, " sample"]]


def _no_baseline(x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
    """Return one for every sample."""
    return np.ones(x.shape[0])


@dataclass(frozen=True, kw_only=True)
class Regression:
    """A fitted regression in place of a response with one output.

    Parameters
    ----------
    columns, outputs
        As in `tolalloc.models.Response`.
    estimator
        The fitted scikit-learn estimator of the output over the baseline.
    baseline
        A rough answer that the estimator corrects.
    """

    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    estimator: Any
    baseline: Baseline = _no_baseline

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the predictions."""
        values = np.asarray(self.estimator.predict(x) * self.baseline(x), dtype=float)
        return Evaluation(values=values.reshape(-1, 1), status=np.zeros(x.shape[0], np.uint8))


@dataclass(frozen=True, kw_only=True)
class Surrogate(Regression):
    """A regression with its error on answers that it has not seen.

    Parameters
    ----------
    columns, outputs, estimator, baseline
        As in `Regression`.
    q2
        Predictivity 1 − Σ(error²)/Σ(deviation from the training mean²) on held-out answers [-].
    rms_error
        Root-mean-square error on held-out answers [output].
    trained, held_out
        Numbers of answers [-].
    """

    q2: float
    rms_error: float
    trained: int
    held_out: int

    @property
    def earns_its_place(self) -> bool:
        """Whether Q² is high enough for the surrogate to be used."""
        return self.q2 >= NEEDED_Q2


@dataclass(frozen=True, kw_only=True)
class RegressionCandidate:
    """A regression that may stand in for a response with one output.

    Parameters
    ----------
    name
        What a table calls it.
    columns, outputs
        As in `tolalloc.models.Response`.
    estimator
        Makes the unfitted scikit-learn regressor.
    """

    name: str
    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    estimator: Callable[[], Any]

    def fit(self, x: Float[np.ndarray, "sample column"], y: Float[np.ndarray, " sample"]) -> Regression:
        """Return the regression through answers."""
        return Regression(columns=self.columns, outputs=self.outputs, estimator=fitted(self.estimator(), x, y))


def fitted(estimator: Any, x: Float[np.ndarray, "sample column"], y: Float[np.ndarray, "sample *output"]) -> Any:
    """Return the fitted estimator."""
    from sklearn.exceptions import ConvergenceWarning

    with warnings.catch_warnings():
        # A length or the noise at its bound only says that a column, or noise, does not matter; a path of weights that
        # ends early is judged by its error like every other.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return estimator.fit(x, y)


def on_products_of_two(regressor: Any) -> Any:
    """Return a linear regressor on the columns and all products of two of them."""
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    return make_pipeline(StandardScaler(), PolynomialFeatures(2, include_bias=False), StandardScaler(), regressor)


def quadratic_regression() -> Any:
    """Return a ridge regression on all products of two columns."""
    from sklearn.linear_model import RidgeCV

    return on_products_of_two(RidgeCV(np.logspace(0, 5, 11)))


def sparse_quadratic_regression() -> Any:
    """Return a regression on those products of two columns that the LASSO keeps."""
    return on_products_of_two(lasso())


def lasso() -> Any:
    """Return a linear regressor that keeps few columns, how few found by cross-validation."""
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.linear_model import LassoCV
    from sklearn.preprocessing import StandardScaler

    return TransformedTargetRegressor(LassoCV(alphas=np.logspace(-2.5, 0, 14), cv=3), transformer=StandardScaler())


def gaussian_process(columns: int) -> Any:
    """Return a Gaussian process of the logarithm of a positive output, one length per column, and noise."""
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    kernel = ConstantKernel(10.0) * RBF(np.full(columns, 3.0), (0.3, 1e3)) + WhiteKernel(1e-3, (1e-8, 1.0))
    process = make_pipeline(StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True, random_state=1))
    return TransformedTargetRegressor(process, func=np.log, inverse_func=np.exp)


def fit_surrogate(
    estimator: Any,
    columns: tuple[str, ...],
    output: str,
    x: Float[np.ndarray, "sample column"],
    y: Float[np.ndarray, " sample"],
    held_out: int,
    baseline: Baseline = _no_baseline,
) -> Surrogate:
    """Return the estimator fitted to all but the last answers, judged on those.

    Parameters
    ----------
    estimator
        An unfitted scikit-learn regressor.
    columns, output
        Names of the inputs and of the output.
    x, y
        Inputs and answers in random order.
    held_out
        Number of last answers that the fit must not see [-].
    baseline
        A rough positive answer; the estimator learns the ratio to it.
    """
    seen = slice(0, y.size - held_out)
    unseen = slice(y.size - held_out, y.size)
    fitted(estimator, x[seen], y[seen] / baseline(x[seen]))
    error = np.asarray(estimator.predict(x[unseen]) * baseline(x[unseen])) - y[unseen]
    return Surrogate(
        columns=columns,
        outputs=(output,),
        estimator=estimator,
        baseline=baseline,
        q2=float(1 - (error**2).sum() / ((y[unseen] - y[seen].mean()) ** 2).sum()),
        rms_error=float(np.sqrt((error**2).mean())),
        trained=y.size - held_out,
        held_out=held_out,
    )
