"""Derivatives by source, on functions with known derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from tests.builders import baseline_errors, kernel_of, source
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.derivatives import ResponseWithDerivatives, local_derivatives


@dataclass(frozen=True)
class Answer:
    evaluation: Evaluation
    by_column: np.ndarray


@dataclass(frozen=True)
class Function:
    """A function with its derivatives; the first ``fail`` samples fail."""

    columns: tuple[str, ...]
    value: Callable[[np.ndarray], np.ndarray]
    slope: Callable[[np.ndarray], np.ndarray]
    fail: int = 0
    outputs: tuple[str, ...] = ("y [-]",)

    def with_derivatives(self, x: np.ndarray) -> Answer:
        return Answer(evaluation=self(x), by_column=self.slope(x))

    def __call__(self, x: np.ndarray) -> Evaluation:
        status = np.zeros(x.shape[0], np.uint8)
        status[: self.fail] = 1
        return Evaluation(values=self.value(x)[:, np.newaxis], status=status)


def linear(errors: ErrorModel, weights: list[float], fail: int = 0) -> Function:
    return Function(
        errors.columns, lambda x: x @ np.array(weights), lambda x: np.tile(np.array(weights), (x.shape[0], 1)), fail
    )


def test_local_derivatives_have_sign_and_length():
    errors = ErrorModel((source("a", middle=2.0), source("b", Feature.POSITION), source("c", over=0.5)))
    found = local_derivatives(Experiment.of(linear(errors, [-3.0, 3.0, 4.0, 1.0]), errors, SeedTree(4)), 64)
    np.testing.assert_allclose(found.slope, np.array([-3.0, 5.0, 2.0]) * 1e-6)
    one, across = found.per_micrometre[[0, 1]] * 1e6
    assert one == pytest.approx(3.0, rel=1e-12)
    assert across == pytest.approx(5.0 / np.sqrt(2.0), rel=0.2)  # a random direction, of 64 units
    assert found.by_zone[0] == pytest.approx(3.0, rel=0.3)  # σ = 1 of 64 units


def test_a_micrometre_is_of_one_feature_and_the_zone_of_all():
    """Four like features, each with the slope 2: one changes the output by 2 a micrometre, all by √4 times σ."""
    errors = ErrorModel((source("pins", each=4), source("b")))
    slopes = [2.0] * 4 + [1.0]
    found = local_derivatives(Experiment.of(linear(errors, slopes), errors, SeedTree(4)), 4096)
    np.testing.assert_allclose(found.per_micrometre, np.array([2.0, 1.0]) * 1e-6, rtol=1e-12)
    np.testing.assert_allclose(found.by_zone, [4.0, 1.0], rtol=0.05)


def test_root_mean_square_is_over_random_units():
    """Mean of (2x)² with σ = 1 is 4; its standard error is 4·√(2/n), of which 4 are allowed."""
    errors = ErrorModel((source("a"),))
    square = Function(errors.columns, lambda x: x[:, 0] ** 2, lambda x: 2 * x)
    found = local_derivatives(Experiment.of(square, errors, SeedTree(5)), 4096)
    assert found.slope[0] == pytest.approx(found.per_micrometre[0]), "signs cancel: there is a mean of none"
    np.testing.assert_allclose((found.slope[0] * 1e6) ** 2, 4.0, rtol=4 * np.sqrt(2 / 4096))


def test_failed_units_are_left_out_and_too_many_stop():
    errors = ErrorModel((source("a"), source("b")))
    few = local_derivatives(Experiment.of(linear(errors, [1.0, 1.0], fail=5), errors, SeedTree(6)), 1000)
    np.testing.assert_allclose(few.slope, 1e-6)
    with pytest.raises(SolveError, match="no usable answer"):
        local_derivatives(Experiment.of(linear(errors, [1.0, 1.0], fail=50), errors, SeedTree(6)), 1000)


def test_the_kernel_knows_its_derivatives(rv20e):
    errors = baseline_errors()
    kernel = kernel_of(rv20e, errors, rv20e.reducer.load.test_torque)
    assert isinstance(kernel, ResponseWithDerivatives)
    found = local_derivatives(Experiment.of(kernel, errors, SeedTree(7)), 64)
    assert np.isfinite(found.by_zone).all()
    assert found.by_zone.max() > 0.0
