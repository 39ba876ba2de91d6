"""Derivatives by source and the bounds that they put on total indices, on functions with known derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.special import ndtr

from tests.builders import baseline_errors, kernel_of, source
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Distribution, Feature
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.derivatives import ResponseWithDerivatives, derivative_measures, local_derivatives


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


def test_the_bound_of_a_linear_output_is_its_total_index():
    """The measures are exact; the variance has a standard error of √(2/n), of which 4 are allowed."""
    errors = ErrorModel((source("a"), source("b", Feature.POSITION), source("c", over=2.0, shift=0.3, middle=1.0)))
    weights = [1.0, 0.5, -2.0, 3.0]
    found = derivative_measures(Experiment.of(linear(errors, weights), errors, SeedTree(0)), 4096)
    middle, one_deviation = errors.deviations(
        errors.standard_values(ndtr(np.array([[0.0] * 4, [1.0] * 4]))), errors.zones
    )
    parts = ((one_deviation - middle) * np.array(weights)) ** 2
    truth = np.array([parts[0], parts[1] + parts[2], parts[3]])
    np.testing.assert_allclose(found.measure, truth, rtol=1e-6)
    np.testing.assert_allclose(found.bound, truth / truth.sum(), rtol=4 * np.sqrt(2 / 4096))
    assert found.sources == ("a", "b", "c")


def test_the_bound_is_above_the_total_index_of_the_ishigami_function():
    errors = ErrorModel(
        tuple(source(name, zone=2 * np.pi, distribution=Distribution.UNIFORM) for name in ("x1", "x2", "x3"))
    )
    ishigami = Function(
        errors.columns,
        lambda x: np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]),
        lambda x: np.column_stack(
            [
                np.cos(x[:, 0]) * (1 + 0.1 * x[:, 2] ** 4),
                7 * np.sin(2 * x[:, 1]),
                0.4 * x[:, 2] ** 3 * np.sin(x[:, 0]),
            ]
        ),
    )
    found = derivative_measures(Experiment.of(ishigami, errors, SeedTree(1)), 4096)
    assert (found.bound_interval[0] > [0.55758886, 0.44241114, 0.24368366]).all()


def test_the_bound_holds_for_a_vector_of_uniform_magnitude():
    errors = ErrorModel((source("a", Feature.POSITION, distribution=Distribution.UNIFORM), source("b", zone=1.0)))
    squares = Function(
        errors.columns,
        lambda x: x[:, 0] ** 2 + x[:, 0] + x[:, 1] ** 2 + np.abs(x[:, 2]),
        lambda x: np.column_stack([2 * x[:, 0] + 1, 2 * x[:, 1], np.sign(x[:, 2])]),
    )
    found = derivative_measures(Experiment.of(squares, errors, SeedTree(2)), 4096)
    # Magnitude m uniform up to 3, any phase: Var m² + E[m²]/2; and the variance of |b| with σ = 1/6.
    parts = np.array([81 * (1 / 5 - 1 / 9) + 9 / 6, (1 - 2 / np.pi) / 36])
    assert (found.bound_interval[0] > parts / parts.sum()).all()


def test_correlated_sources_have_one_measure_together():
    pair = Pair(one="a", other="c", correlation=0.6)
    errors = ErrorModel(
        (source("a"), source("b", Feature.POSITION, distribution=Distribution.UNIFORM), source("c")),
        correlation=Correlation(pairs=(pair,)),
    )
    weights = [1.0, 2.0, -1.0, 0.5]
    found = derivative_measures(Experiment.of(linear(errors, weights), errors, SeedTree(3)), 4096)
    assert found.sources == ("a + c", "b")
    # a + c/2 is normal, and a linear measure is the variance.
    np.testing.assert_allclose(found.measure[0], 1.0 + 0.25 + 2 * 0.6 * 0.5, rtol=1e-6)


def test_bounds_of_the_resamples_cover():
    """90 % intervals of the bound of a linear output over 200 samples; less 3 standard errors."""
    errors = ErrorModel((source("a"), source("b")))
    inside = []
    for seed in range(200):
        low, high = derivative_measures(
            Experiment.of(linear(errors, [1.0, 2.0]), errors, SeedTree(seed)), 512, resamples=200
        ).bound_interval[:, 0]
        inside.append(low <= 0.2 <= high)
    assert np.mean(inside) > 0.9 - 3 * np.sqrt(0.09 / 200)


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


def test_failed_units_are_counted_and_too_many_stop():
    errors = ErrorModel((source("a"), source("b")))
    few = derivative_measures(Experiment.of(linear(errors, [1.0, 1.0], fail=5), errors, SeedTree(6)), 1000)
    assert (few.units, few.failed) == (995, 5)
    with pytest.raises(SolveError, match="no usable answer"):
        derivative_measures(Experiment.of(linear(errors, [1.0, 1.0], fail=50), errors, SeedTree(6)), 1000)
    with pytest.raises(SolveError, match="same for all units"):
        derivative_measures(Experiment.of(linear(errors, [0.0, 0.0]), errors, SeedTree(6)), 1000)


def test_the_kernel_knows_its_derivatives(rv20e):
    errors = baseline_errors()
    kernel = kernel_of(rv20e, errors, rv20e.reducer.load.test_torque)
    assert isinstance(kernel, ResponseWithDerivatives)
    found = derivative_measures(Experiment.of(kernel, errors, SeedTree(7)), 64, resamples=10)
    assert np.isfinite(found.bound).all()
    assert found.bound.sum() > 0.5
