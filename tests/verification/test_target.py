"""What drives units beyond the limit, against closed forms of a normal sum."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import norm

from tests import builders
from tests.builders import source
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import MonteCarlo, monte_carlo
from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import limited_measure
from tolalloc.drawings.zones import Feature, parsed_spectrum
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.target import limited_measures, target_sensitivity

SHARES = np.array([0.6, 0.4, 0.0])
SIZES = ErrorModel(tuple(source(name) for name in "abc"))


@dataclass(frozen=True)
class Sum:
    """A normal output of variance 1, to which the sources give SHARES."""

    fail: int = 0
    columns: tuple[str, ...] = ("a", "b", "c")
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        status = np.zeros(x.shape[0], np.uint8)
        status[: self.fail] = 1
        return Evaluation(values=(x @ np.sqrt(SHARES))[:, np.newaxis], status=status)


def drawn(seed: int, units: int) -> MonteCarlo:
    return monte_carlo(Experiment.of(Sum(), SIZES, SeedTree(seed)), units)


def true_lift(limit: float) -> np.ndarray:
    """Return E[z² | Y > limit] of inputs that give a share of the variance of a standard normal Y."""
    return 1 + SHARES * limit * norm.pdf(limit) / norm.sf(limit)


def true_first(limit: float) -> np.ndarray:
    """Return the variance of P(Y > limit | input) over that of the indicator, by quadrature."""
    z, chance = np.linspace(-9, 9, 4001), norm.sf(limit)
    given = norm.sf((limit - np.sqrt(SHARES)[:, np.newaxis] * z) / np.sqrt(1 - SHARES)[:, np.newaxis])
    return np.trapezoid((given - chance) ** 2 * norm.pdf(z), z, axis=1) / (chance * (1 - chance))


@pytest.mark.parametrize("limit", [1.0, 2.0])
def test_index_and_lift_are_those_of_the_closed_form(limit):
    """Within 4 standard errors; 282 classes of 20,000 units hide at most 2 % of an index."""
    found = target_sensitivity(drawn(0, 20000), SIZES, limit, SeedTree(0).child("t"))
    assert found.is_limit
    assert found.threshold == limit
    assert (np.abs(found.lift - true_lift(limit)) < 4 * found.lift_resamples.std(axis=0)).all()
    truth = true_first(limit)
    assert (np.abs(found.first - truth) < 4 * found.first_resamples.std(axis=0) + 0.02 * truth).all()
    assert found.p_value[:2].max() < 0.001 < found.p_value[2]


MANY = ErrorModel((source("one"), source("few", each=4), source("pins", each=9)))
"""Sources whose columns are standard normal, so that their shares of the variance of a sum are as 1 to 4 to 9."""


def test_the_excess_orders_sources_of_many_columns_as_their_shares_of_the_variance():
    """Within 4 standard errors of the closed form; the lifts, diluted by the columns, are all the same."""
    limit, deviation = 1.5 * np.sqrt(14.0), np.sqrt(14.0)
    sample = monte_carlo(Experiment.of(builders.Sum(MANY.columns), MANY, SeedTree(0)), 20_000)
    found = target_sensitivity(sample, MANY, limit, SeedTree(0).child("t"), permutations=9)
    np.testing.assert_array_equal(found.columns, [1, 4, 9])
    truth = found.columns / 14.0 * (limit / deviation) * norm.pdf(1.5) / norm.sf(1.5)
    error = found.columns * found.lift_resamples.std(axis=0)
    assert (np.abs(found.excess - truth) < 4 * error).all()
    assert (np.diff(found.excess) > 4 * np.hypot(error[1:], error[:-1])).all()
    low, high = found.excess_interval
    assert (low < found.excess).all()
    assert (found.excess < high).all()
    np.testing.assert_allclose(high - low, found.columns * np.diff(found.lift_interval, axis=0)[0])


def test_a_source_of_many_columns_is_not_behind_one_of_few_whose_lift_is_higher():
    """Shares 5/14 of one column and 9/14 of nine: the lifts rank them the wrong way round."""
    errors = ErrorModel((source("one"), source("pins", each=9)))
    weights = np.array([np.sqrt(5.0)] + [1.0] * 9)

    @dataclass(frozen=True)
    class Weighted(builders.Sum):
        def __call__(self, x: np.ndarray) -> Evaluation:
            return super().__call__(x * weights)

    sample = monte_carlo(Experiment.of(Weighted(errors.columns), errors, SeedTree(1)), 20_000)
    found = target_sensitivity(sample, errors, 1.5 * np.sqrt(14.0), SeedTree(1), permutations=9)
    assert found.lift[0] > found.lift[1]
    assert found.excess[1] > found.excess[0]


def test_an_output_that_does_not_vary_is_refused():
    sample = drawn(2, 2000)
    same = replace(sample.evaluation, values=np.ones_like(sample.evaluation.values))
    for limit in (0.5, 1.5):
        with pytest.raises(SolveError, match="same for all units"):
            target_sensitivity(replace(sample, evaluation=same), SIZES, limit, SeedTree(2))


def test_the_worst_units_of_an_output_with_steps_are_those_on_its_highest_step():
    sample = drawn(2, 4000)
    steps = replace(sample.evaluation, values=np.where(sample.evaluation.values > 0, 2.0, 1.0))
    found = target_sensitivity(replace(sample, evaluation=steps), SIZES, 5.0, SeedTree(2), permutations=9, resamples=9)
    assert (found.threshold, found.is_limit) == (1.0, False)
    assert found.outside == np.count_nonzero(sample.evaluation.values > 0)


def test_failed_units_do_not_make_a_sample_too_small():
    sample = monte_carlo(Experiment.of(Sum(fail=10), SIZES, SeedTree(3)), 1000)
    found = target_sensitivity(sample, SIZES, 5.0, SeedTree(3), permutations=9, resamples=9)
    assert (found.units, found.outside) == (990, 50)


@pytest.mark.slow
def test_intervals_cover():
    """90 % intervals of 100 samples cover 0.9 less 3 standard errors and 0.03 that so few units outside cost."""
    inside = []
    for seed in range(100):
        found = target_sensitivity(
            drawn(seed, 4000), SIZES, 1.3, SeedTree(seed).child("t"), permutations=1, resamples=200
        )
        inside.append(
            [
                (low <= truth) & (truth <= high)
                for (low, high), truth in (
                    (found.first_interval, true_first(1.3)),
                    (found.lift_interval, true_lift(1.3)),
                )
            ]
        )
    assert np.mean(inside, axis=0).min() > 0.9 - 0.03 - 3 * np.sqrt(0.09 / 100)


@pytest.mark.slow
def test_the_test_of_no_effect_is_as_rarely_wrong_as_stated():
    """A source without effect has p ≤ 0.2 in a fifth of 150 samples; 4 standard errors."""
    wrong = [
        target_sensitivity(
            drawn(seed, 1000), SIZES, 1.3, SeedTree(seed).child("t"), permutations=99, resamples=2
        ).p_value[2]
        <= 0.2
        for seed in range(150)
    ]
    assert abs(np.mean(wrong) - 0.2) < 4 * np.sqrt(0.16 / 150)


def test_the_median_shows_which_way_a_size_went():
    found = target_sensitivity(drawn(1, 4000), SIZES, 1.0, SeedTree(1))
    np.testing.assert_allclose(found.median, 0.0, atol=4 * 1.2533 / np.sqrt(4000))
    assert found.median_outside[0] > found.median_outside[1] > 0.5
    assert abs(found.median_outside[2]) < 4 * 1.2533 / np.sqrt(found.outside)


@pytest.mark.parametrize("limit", [5.0, -5.0])
def test_the_worst_units_stand_in_for_a_limit_that_few_miss_or_keep(limit):
    sample = drawn(2, 2000)
    found = target_sensitivity(sample, SIZES, limit, SeedTree(2), permutations=9, resamples=9)
    assert not found.is_limit
    assert (found.outside, found.threshold) == (100, sample.quantile(0.95))


def test_too_small_a_sample_is_refused():
    with pytest.raises(InputError, match="1000 or more"):
        target_sensitivity(drawn(2, 500), SIZES, 5.0, SeedTree(2))


def test_failed_units_are_left_out_and_counted():
    sample = monte_carlo(Experiment.of(Sum(fail=10), SIZES, SeedTree(3)), 2000)
    found = target_sensitivity(sample, SIZES, 1.0, SeedTree(3), permutations=9, resamples=9)
    assert (found.units, sample.failed) == (1990, 10)
    broken = MonteCarlo(x=sample.x, evaluation=Evaluation(values=sample.evaluation.values, status=np.ones(2000, "u1")))
    with pytest.raises(SolveError):
        target_sensitivity(broken, SIZES, 1.0, SeedTree(3))


def test_the_same_seed_gives_the_same_bits():
    one, two = (target_sensitivity(drawn(0, 2000), SIZES, 1.0, SeedTree(0), permutations=9) for _ in range(2))
    for name in ("first_resamples", "lift_resamples", "p_value"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_what_fills_the_zone_measures_as_much_as_the_zone(generator):
    spectrum = ((1, 1.0), (3, 0.5), (7, 0.2))
    for feature, more in (
        (Feature.SIZE, {}),
        (Feature.POSITION, {}),
        (Feature.POSITION, {"over": 50.0}),
        (Feature.POSITION, {"each": 4}),
        (Feature.PITCH, {"spectrum": spectrum}),
        (Feature.RUNOUT, {"spectrum": ((2, 1.0),)}),
    ):
        one = source("s", feature, **more)
        columns = one.zone * one.at_limit(generator.random((20, len(one.columns))))
        full = one.zone / 2 if feature is Feature.SIZE else one.zone
        np.testing.assert_allclose(np.abs(limited_measure(one, columns)), full, rtol=0.006)


def test_random_teeth_are_measured_at_the_teeth(generator):
    spectrum, teeth = parsed_spectrum("1:2.0 random:1.0/40")
    one = source("s", Feature.PITCH, spectrum=spectrum, teeth=teeth)
    columns = one.zone * one.at_limit(generator.random((20, len(one.columns))))
    np.testing.assert_allclose(limited_measure(one, columns), one.zone, rtol=1e-9)


def test_a_size_is_measured_from_the_middle_of_its_zone():
    one = source("s", middle=4.0, over=2.0)
    np.testing.assert_allclose(limited_measure(one, np.array([[3.0]])), 3.0 * 2.0 - 4.0)
    many = source("s", each=3)
    np.testing.assert_allclose(limited_measure(many, np.array([[1.0, -2.0, 0.5]])), 2.0)


def test_a_joint_source_is_measured_in_its_own_deviations(generator):
    joint = CorrelatedSource(name="k", columns=("k1", "k2"), covariance=np.diag([4.0, 0.0]))
    errors = ErrorModel((source("a"),), joint=(joint,))
    x = builders.deviations_at(errors, generator.random((4000, 3)))
    assert limited_measures(errors, x).shape == (4000, 2)
    sample = monte_carlo(Experiment.of(builders.Sum(errors.columns), errors, SeedTree(4)), 4000)
    found = target_sensitivity(sample, errors, 1.0, SeedTree(4), permutations=9, resamples=9)
    np.testing.assert_array_equal(found.columns, [1, 1])
    np.testing.assert_allclose((limited_measures(errors, x)[:, 1] ** 2).mean(), 0.5, rtol=1e-6)
