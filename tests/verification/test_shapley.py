"""Shapley effects against closed forms, with the coverage of their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import factorial

import numpy as np
import pytest
from scipy.special import ndtri

from tests.builders import source
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.correlation import CorrelatedSource, Correlation, Pair
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.shapley import ShapleyEffects, shapley_effects

SIGMA_ZONE = float(2 * -ndtri((1 - 0.9973) / 2))
"""Zone at which a size has standard deviation 1."""
WEIGHTS = (1.0, 2.0, -1.5, 0.5)
PAIRS = {(0, 1): 0.6, (1, 2): 0.4, (0, 2): -0.2}


def model(pairs: dict[tuple[int, int], float], count: int = 4, feature: Feature = Feature.SIZE) -> ErrorModel:
    named = tuple(Pair(one=f"x{one}", other=f"x{other}", correlation=value) for (one, other), value in pairs.items())
    sources = tuple(source(f"x{at}", feature, SIGMA_ZONE) for at in range(count))
    return ErrorModel(sources, correlation=Correlation(pairs=named))


@dataclass(frozen=True)
class Function:
    """Outputs as functions of all columns; some samples fail."""

    functions: tuple
    columns: tuple[str, ...] = ()
    fail_above: float = np.inf

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(f"y{at} [-]" for at in range(len(self.functions)))

    def __call__(self, x: np.ndarray) -> Evaluation:
        values = np.stack([function(x) for function in self.functions], axis=1)
        status = (x[:, 0] > self.fail_above).astype(np.uint8)
        values[status > 0] = np.nan
        return Evaluation(values=values, status=status)


def linear(x: np.ndarray) -> np.ndarray:
    return x @ np.array(WEIGHTS[: x.shape[1]])


def exact_linear(weights: Sequence[float], matrix: np.ndarray) -> np.ndarray:
    """Return the effects of a linear function of normal inputs from all subsets (Owen & Prieur 2017, section 4)."""
    beta, count = np.array(weights), len(weights)

    def worth(group: tuple[int, ...]) -> float:
        others = [at for at in range(count) if at not in group]
        inside, across = matrix[np.ix_(group, group)], matrix[np.ix_(group, others)]
        left = inside - across @ np.linalg.pinv(matrix[np.ix_(others, others)]) @ across.T
        return float(beta[list(group)] @ left @ beta[list(group)])

    effects = np.zeros(count)
    for at in range(count):
        rest = [other for other in range(count) if other != at]
        for size in range(count):
            share = factorial(size) * factorial(count - size - 1) / factorial(count)
            for group in combinations(rest, size):
                effects[at] += share * (worth((*group, at)) - worth(group))
    return effects / float(beta @ matrix @ beta)


def within_standard_errors(found: ShapleyEffects, output: int, exact: np.ndarray, count: float = 4.0) -> None:
    error = found.resamples[output].std(axis=0)
    np.testing.assert_array_less(np.abs(found.effects[output] - exact), count * error + 1e-12)


def test_the_closed_form_of_two_correlated_inputs_is_that_of_owen_and_prieur():
    one, other, rho = 1.0, 2.0, 0.6
    variance = one**2 + other**2 + 2 * rho * one * other
    half = rho * one * other + 0.5 * rho**2 * (other**2 - one**2)
    exact = np.array([one**2 + half, other**2 + 2 * rho * one * other - half]) / variance
    np.testing.assert_allclose(exact_linear((one, other), np.array([[1, rho], [rho, 1]])), exact)
    found = shapley_effects(
        Experiment(Function((linear,)), model({(0, 1): rho}, 2), np.full(2, SIGMA_ZONE), SeedTree(0)), 4000
    )
    within_standard_errors(found, 0, exact)


@pytest.mark.parametrize("seed", [0, 1])
def test_linear_function_of_correlated_sources(seed):
    errors = model(PAIRS)
    found = shapley_effects(Experiment.of(Function((linear,)), errors, SeedTree(seed)), 8000)
    exact = exact_linear(WEIGHTS, errors.normal_correlation)
    within_standard_errors(found, 0, exact)
    # Sharp enough to tell correlated from independent sources: ten standard errors and more.
    independent = exact_linear(WEIGHTS, np.eye(4))
    assert (np.abs(exact - independent) / found.resamples[0].std(axis=0)).max() > 10
    np.testing.assert_allclose(found.effects.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.resamples.sum(axis=2), 1.0, rtol=1e-12)


@pytest.mark.parametrize("correlation", [1.0, -1.0])
def test_sources_that_fix_each_other_share_alike(correlation):
    errors = model({(0, 1): correlation}, 3)
    found = shapley_effects(Experiment.of(Function((linear,)), errors, SeedTree(2)), 4000)
    within_standard_errors(found, 0, exact_linear(WEIGHTS[:3], errors.normal_correlation))


def test_all_columns_of_a_source_go_together():
    errors = model(PAIRS, feature=Feature.POSITION)
    weights = np.array([1.0, 0.5, 2.0, -1.0, -1.5, 1.0, 0.5, 3.0])
    found = shapley_effects(Experiment.of(Function((lambda x: x @ weights,)), errors, SeedTree(3)), 8000)
    by_axis = [weights[axis::2] for axis in (0, 1)]
    share = [float(own @ errors.source_correlation @ own) for own in by_axis]
    exact = sum(part * exact_linear(own, errors.source_correlation) for part, own in zip(share, by_axis, strict=True))
    within_standard_errors(found, 0, exact / sum(share))
    assert found.sources == ("x0", "x1", "x2", "x3")


def test_additive_function_of_independent_sources_has_its_first_order_indices():
    sources = (
        *(source(f"x{at}", zone=SIGMA_ZONE) for at in range(3)),
        source("x3", zone=SIGMA_ZONE, distribution=Distribution.UNIFORM),
    )
    joint = CorrelatedSource(name="k", columns=("k1", "k2"), covariance=np.array([[1.0, 0.5], [0.5, 1.0]]))
    errors = ErrorModel(sources, (joint,))

    def additive(x: np.ndarray) -> np.ndarray:
        return x[:, 0] ** 2 + x[:, 1] + 0.1 * x[:, 2] + x[:, 3] + x[:, 4] - 2 * x[:, 5]

    found = shapley_effects(Experiment.of(Function((additive,)), errors, SeedTree(4)), 8000)
    variances = np.array([2.0, 1.0, 0.01, SIGMA_ZONE**2 / 12, 1 + 4 - 2.0])
    within_standard_errors(found, 0, variances / variances.sum())
    # Noise is in proportion to the source's own part: one of a thousandth is known to a tenth of that.
    assert found.effects[0, 2] == pytest.approx(variances[2] / variances.sum(), rel=0.5)


def test_interaction_is_shared_alike():
    errors = model({}, 3)
    found = shapley_effects(
        Experiment.of(Function((lambda x: x[:, 0] * x[:, 1] + x[:, 2],)), errors, SeedTree(5)), 8000
    )
    within_standard_errors(found, 0, np.array([0.25, 0.25, 0.5]))


def test_every_output_has_the_bits_that_it_has_alone():
    errors = model(PAIRS)
    both = shapley_effects(
        Experiment.of(Function((linear, lambda x: x[:, 3] ** 2, lambda x: 0 * x[:, 0])), errors, SeedTree(0)),
        300,
    )
    alone = shapley_effects(Experiment.of(Function((linear,)), errors, SeedTree(0)), 300)
    np.testing.assert_allclose(both.effects[0], alone.effects[0], rtol=1e-12)
    np.testing.assert_allclose(both.effects[1], [0, 0, 0, 1], atol=1e-12)
    assert np.isnan(both.effects[2]).all()
    again = shapley_effects(Experiment.of(Function((linear,)), errors, SeedTree(0)), 300)
    np.testing.assert_array_equal(again.resamples, alone.resamples)


def test_a_failed_sample_drops_its_permutation_and_too_many_stop_the_analysis():
    errors = model(PAIRS)
    found = shapley_effects(Experiment.of(Function((linear,), fail_above=3.4), errors, SeedTree(0)), 4000)
    assert 0 < found.dropped <= 40
    within_standard_errors(found, 0, exact_linear(WEIGHTS, errors.normal_correlation))
    with pytest.raises(SolveError, match=r"units have no usable answer; allowed is a share of 0\.01"):
        shapley_effects(Experiment.of(Function((linear,), fail_above=1.5), errors, SeedTree(0)), 4000)
    with pytest.raises(InputError, match="permutations is 1; allowed is 2 or more"):
        shapley_effects(Experiment.of(Function((linear,)), errors, SeedTree(0)), 1)


@pytest.mark.slow
def test_intervals_cover_and_ranks_agree():
    """The 90 % intervals of 100 repetitions: 82 to 97 % is four standard errors and the bootstrap's own shortfall."""
    errors = model(PAIRS)
    exact = exact_linear(WEIGHTS, errors.normal_correlation)
    results = [shapley_effects(Experiment.of(Function((linear,)), errors, SeedTree(seed)), 500) for seed in range(100)]
    inside = np.array([(found.interval(0)[0] <= exact) & (exact <= found.interval(0)[1]) for found in results])
    assert 0.82 <= inside.mean() <= 0.97
    assert inside.mean(axis=0).min() > 0.78
    rank = (1 + np.argsort(np.argsort(-exact))).astype(float)
    held = [(found.rank_interval(0)[0] <= rank) & (rank <= found.rank_interval(0)[1]) for found in results]
    assert np.mean(held) > 0.9
