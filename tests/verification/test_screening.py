"""Elementary effects, PAWN and delta on functions that carry their own answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from SALib.analyze import delta, pawn
from SALib.analyze import morris as salib_morris
from SALib.sample import morris
from scipy.stats import norm

from tests import builders
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import MonteCarlo, monte_carlo
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Distribution, Feature
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.screening import (
    OutputDensity,
    delta_index,
    elementary_effects,
    moment_independent,
    pawn_index,
)


def source(name: str, feature: Feature = Feature.SIZE, distribution: Distribution = Distribution.UNIFORM) -> Source:
    return builders.source(name, feature, 1.0, distribution=distribution)


SIZES = ErrorModel((source("a"), source("b"), source("c")))


@dataclass(frozen=True)
class Products:
    """2a − b + 3ab and c², of sizes that are uniform in ±1/2."""

    fail: tuple[int, ...] = ()
    columns: tuple[str, ...] = ("a", "b", "c")
    outputs: tuple[str, ...] = ("y [-]", "z [-]")

    def __call__(self, x: np.ndarray) -> Evaluation:
        a, b, c = x.T
        values = np.column_stack([2 * a - b + 3 * a * b, c**2])
        status = np.zeros(x.shape[0], np.uint8)
        values[list(self.fail)], status[list(self.fail)] = np.nan, 1
        return Evaluation(values=values, status=status)


@dataclass(frozen=True)
class Weighted:
    """A weighted sum of all columns."""

    columns: tuple[str, ...]
    weights: tuple[float, ...]
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        return Evaluation(values=(x @ np.array(self.weights))[:, np.newaxis], status=np.zeros(x.shape[0], np.uint8))


def test_effects_are_those_of_salib():
    found = elementary_effects(Experiment.of(Products(), SIZES, SeedTree(0)), 40)
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0.001, 0.999]] * 3}
    uniform = morris.sample(problem, 40, num_levels=4, seed=SeedTree(0).child("sample").integer())
    answers = Products()(uniform - 0.5).values
    for output in range(2):
        theirs = salib_morris.analyze(problem, uniform, answers[:, output], num_levels=4, seed=1)
        np.testing.assert_allclose(found.mu_star[output], theirs["mu_star"], rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(found.sigma[output], theirs["sigma"], rtol=1e-10, atol=1e-12)


def test_effects_of_a_linear_output_are_its_weights_without_scatter():
    found = elementary_effects(Experiment.of(Weighted(SIZES.columns, (3.0, -2.0, 0.0)), SIZES, SeedTree(1)), 8)
    np.testing.assert_allclose(found.effects[0], np.tile([3.0 * 0.998, -2.0 * 0.998, 0.0], (8, 1)), atol=1e-12)
    np.testing.assert_allclose(found.sigma, 0.0, atol=1e-12)


def test_the_columns_of_a_source_move_together_and_have_no_sign():
    errors = ErrorModel((source("a"), source("b", Feature.POSITION, Distribution.NORMAL)))
    found = elementary_effects(Experiment.of(Weighted(errors.columns, (1.0, 1.0, 0.0)), errors, SeedTree(2)), 16)
    assert found.sources == ("a", "b")
    assert np.isnan(found.sigma[0, 1])
    assert found.mu_star[0, 1] > 0.0


def test_correlated_sources_stand_together():
    pair = Pair(one="a", other="c", correlation=0.5)
    errors = ErrorModel(SIZES.sources, correlation=Correlation(pairs=(pair,)))
    assert elementary_effects(Experiment.of(Products(), errors, SeedTree(2)), 8).sources == ("a + c", "b")


def test_a_failed_sample_drops_its_trajectory_alone():
    whole = elementary_effects(Experiment.of(Products(), SIZES, SeedTree(3)), 40)
    found = elementary_effects(Experiment.of(Products(fail=(9,)), SIZES, SeedTree(3), 0.05), 40)
    assert (found.trajectories, found.dropped) == (39, 1)
    np.testing.assert_array_equal(found.effects, np.delete(whole.effects, 2, axis=1))
    with pytest.raises(SolveError, match="2 of 160 units"):
        elementary_effects(Experiment.of(Products(fail=(9, 10)), SIZES, SeedTree(3)), 40)


@pytest.mark.slow
def test_the_interval_of_mu_star_covers():
    """A 90 % interval of 200 covers 0.9 less 3 standard errors, and the small sample's own shortfall of 0.03."""
    truth = elementary_effects(Experiment.of(Products(), SIZES, SeedTree(4)), 4000).mu_star[0, 0]
    inside = []
    for seed in range(200):
        low, high = elementary_effects(Experiment.of(Products(), SIZES, SeedTree(seed)), 30).mu_star_interval(0)[:, 0]
        inside.append(low <= truth <= high)
    assert np.mean(inside) > 0.9 - 0.03 - 3 * np.sqrt(0.09 / 200)


def normal_sum(share: float, seed: int, units: int) -> tuple[MonteCarlo, ErrorModel]:
    """Return a normal output to whose variance ``a`` gives a share, ``b`` the rest and ``c`` nothing."""
    errors = ErrorModel(tuple(source(name, distribution=Distribution.NORMAL) for name in "abc"))
    response = Weighted(errors.columns, (np.sqrt(share), np.sqrt(1 - share), 0.0))
    return monte_carlo(Experiment.of(response, errors, SeedTree(seed)), units), errors


def true_delta(share: float) -> float:
    """Return delta of a normal input that gives a share of a normal output's variance, by quadrature."""
    x, y = np.linspace(-6, 6, 801), np.linspace(-7, 7, 2001)
    given = norm.pdf(y, np.sqrt(share) * x[:, np.newaxis], np.sqrt(1 - share))
    distance = np.trapezoid(np.abs(given - norm.pdf(y)), y, axis=1) / 2
    return float(np.trapezoid(distance * norm.pdf(x), x))


def true_pawn(share: float) -> float:
    """Return the median distance of ten classes by quadrature."""
    x, y = norm.ppf((np.arange(2000) + 0.5) / 2000).reshape(10, 200), np.linspace(-5, 5, 1001)
    given = norm.cdf((y - np.sqrt(share) * x[:, :, np.newaxis]) / np.sqrt(1 - share)).mean(axis=1)
    return float(np.median(np.abs(given - norm.cdf(y)).max(axis=1)))


def test_pawn_is_the_median_distance_of_the_classes():
    sample, errors = normal_sum(0.6, 0, 2048)
    found = moment_independent(sample, errors, SeedTree(0).child("m"), resamples=2, dummies=2)
    within = 4 * 0.4 * 0.5 / np.sqrt(205) + 0.02
    np.testing.assert_allclose(found.pawn[:2], [true_pawn(0.6), true_pawn(0.4)], atol=within)


@pytest.mark.parametrize("units", [100, 777, 4096])
@pytest.mark.parametrize("resampled", [False, True])
def test_pawn_and_delta_are_those_of_salib(units, resampled):
    """But for rounding: SALib makes every density anew. Units drawn again are ties."""
    generator = SeedTree(units).generator()
    y = generator.gamma(9.0, 5.0, units)
    column = y + generator.normal(0.0, 20.0, units)
    if resampled:
        drawn = generator.integers(units, size=units)
        column, y = column[drawn], y[drawn]
    exponent = 2.0 / (7.0 + np.tanh((1500.0 - units) / 500.0))
    edges = np.linspace(0, units, min(int(np.ceil(units**exponent)), 48) + 1)
    theirs = delta.calc_delta(y, np.linspace(y.min(), y.max(), 100), column, edges)
    assert delta_index(column, OutputDensity.of(y)) == pytest.approx(theirs, rel=1e-12)
    problem = {"num_vars": 1, "names": ["x"]}
    theirs = pawn.analyze(problem, column[:, np.newaxis], y, S=10)["median"][0]
    assert pawn_index(column, y) == pytest.approx(theirs, rel=1e-12)


def test_a_class_of_equal_outputs_adds_nothing():
    y = np.repeat([1.0, 2.0, 3.0], 100)
    assert np.isfinite(delta_index(np.arange(300.0), OutputDensity.of(y)))


@pytest.mark.slow
def test_pawn_and_delta_of_a_normal_sum():
    """Within 4 standard errors, and 0.02 that the kernel density (delta) and the maximum over noise (PAWN) add.

    One distance of 205 units has a standard error of 0.5/√205; the median of ten has 0.4 of it.
    """
    sample, errors = normal_sum(0.6, 0, 2048)
    found = moment_independent(sample, errors, SeedTree(0).child("m"), resamples=20, dummies=10)
    truth = np.array([true_delta(0.6), true_delta(0.4), 0.0])
    assert (np.abs(found.delta - truth) < 4 * found.delta_resamples.std(axis=0) + 0.02).all()
    within = 4 * 0.4 * 0.5 / np.sqrt(205) + 0.02
    np.testing.assert_allclose(found.pawn[:2], [true_pawn(0.6), true_pawn(0.4)], atol=within)
    assert found.pawn[2] < 0.1
    assert found.delta_dummy < 0.1 < found.delta[1] < found.delta[0]
    assert found.pawn_dummy < found.pawn[1] < found.pawn[0]
    assert (found.units, found.failed) == (2048, 0)


@pytest.mark.slow
def test_an_index_without_effect_passes_the_dummies_as_rarely_as_stated():
    """One of eleven vectors without effect is the largest with probability 1/11; 4 standard errors of 60."""
    passed = []
    for seed in range(60):
        sample, errors = normal_sum(0.5, seed, 200)
        found = moment_independent(sample, errors, SeedTree(seed).child("m"), resamples=1, dummies=10)
        passed.append(found.pawn[2] > found.pawn_dummy)
    assert abs(np.mean(passed) - 1 / 11) < 4 * np.sqrt(1 / 11 * 10 / 11 / 60)


@pytest.mark.slow
def test_a_vector_without_effect_passes_the_dummies_as_rarely_as_stated():
    """A source of three measures, the most there are, passes 10 dummies with probability 1/11; 3 standard errors."""
    errors = ErrorModel(
        (source("a", distribution=Distribution.NORMAL), source("idle", Feature.POSITION, Distribution.NORMAL))
    )
    response, passed = Weighted(errors.columns, (1.0, 0.0, 0.0)), []
    for seed in range(100):
        sample = monte_carlo(Experiment.of(response, errors, SeedTree(seed)), 200)
        found = moment_independent(sample, errors, SeedTree(seed).child("m"), resamples=1, dummies=10)
        passed.append([found.pawn[1] > found.pawn_dummy, found.delta[1] > found.delta_dummy])
    assert (np.abs(np.mean(passed, axis=0) - 1 / 11) < 3 * np.sqrt(1 / 11 * 10 / 11 / 100)).all()


def test_an_output_that_does_not_vary_is_refused():
    sample, errors = normal_sum(0.6, 0, 200)
    same = replace(sample.evaluation, values=np.ones_like(sample.evaluation.values))
    with pytest.raises(SolveError, match="same for all units"):
        moment_independent(replace(sample, evaluation=same), errors, SeedTree(1))


def test_too_few_trajectories_and_units_are_refused():
    with pytest.raises(InputError, match="trajectories is 1"):
        elementary_effects(Experiment.of(Products(), SIZES, SeedTree(1)), 1)
    sample, errors = normal_sum(0.6, 0, 99)
    with pytest.raises(InputError, match="100 or more"):
        moment_independent(sample, errors, SeedTree(1))


def test_one_source_alone_has_effects():
    errors = ErrorModel((source("a"),))
    found = elementary_effects(Experiment.of(Weighted(errors.columns, (2.0,)), errors, SeedTree(1)), 4)
    np.testing.assert_allclose(found.mu_star, [[2.0 * 0.998]])


def test_a_vector_is_seen_by_its_length_and_by_its_direction():
    errors = ErrorModel(tuple(source(name, Feature.POSITION, Distribution.NORMAL) for name in ("a", "b", "c")))

    @dataclass(frozen=True)
    class Vectors:
        columns: tuple[str, ...] = errors.columns
        outputs: tuple[str, ...] = ("y [-]",)

        def __call__(self, x: np.ndarray) -> Evaluation:
            values = 10 * (x[:, 0] ** 2 + x[:, 1] ** 2) + x[:, 3]
            return Evaluation(values=values[:, np.newaxis], status=np.zeros(x.shape[0], np.uint8))

    sample = monte_carlo(Experiment.of(Vectors(), errors, SeedTree(5)), 1024)
    found = moment_independent(sample, errors, SeedTree(5).child("m"), resamples=5, dummies=5)
    assert (found.pawn[:2] > 2 * found.pawn_dummy).all()
    assert (found.delta[:2] > 2 * found.delta_dummy).all()
    assert found.pawn[2] < 1.5 * found.pawn_dummy


def test_failed_units_are_left_out_and_counted():
    sample, errors = normal_sum(0.6, 0, 1000)
    values, status = sample.evaluation.values.copy(), sample.evaluation.status.copy()
    values[:5], status[:5] = np.nan, 1
    found = moment_independent(
        MonteCarlo(x=sample.x, evaluation=Evaluation(values=values, status=status)), errors, SeedTree(1), resamples=2
    )
    assert (found.units, found.failed) == (995, 5)
    assert np.isfinite(found.delta).all()
    status[:20] = 1
    with pytest.raises(SolveError):
        moment_independent(
            MonteCarlo(x=sample.x, evaluation=Evaluation(values=values, status=status)), errors, SeedTree(1)
        )


def test_the_same_seed_gives_the_same_bits_and_numpys_own_state_stays():
    np.random.seed(7)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    sample, errors = normal_sum(0.6, 0, 500)
    one, two = (moment_independent(sample, errors, SeedTree(0), resamples=3) for _ in range(2))
    np.testing.assert_array_equal(one.delta_resamples, two.delta_resamples)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002
