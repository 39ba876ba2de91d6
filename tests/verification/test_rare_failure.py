"""Rare failures on limit states whose probability is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import gumbel_r, kstest, lognorm, norm, uniform

from tests.first_order import DesignPoints, design_point, design_points, importance_sampling
from tests.reliability import LargestValue, LimitOfInputs, LogNormal, Normal, Uniform
from tolalloc.capability.limit_state import CountedLimitState, RareFailure
from tolalloc.capability.rare_failure import subset_simulation
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError


@dataclass(frozen=True)
class Flat:
    """β − a·u, whose failure probability is Φ(−β); rows drawn beyond a radius may fail."""

    beta: float
    variables: int = 2
    blind_beyond: float = np.inf
    both_sides: bool = False
    seen: list[int] = field(default_factory=list)

    def __call__(self, u: np.ndarray) -> np.ndarray:
        self.seen.append(u.shape[0])
        along = u.sum(axis=1) / np.sqrt(self.variables)
        along = np.abs(along) if self.both_sides else along
        status = (np.abs(u[:, -1]) > self.blind_beyond).astype(np.uint8)
        return np.where(status, np.nan, self.beta - along)


@dataclass(frozen=True)
class Bent:
    """β + κ/2·u₂² − u₁."""

    beta: float
    bend: float
    variables: int = 2

    def __call__(self, u: np.ndarray) -> np.ndarray:
        return self.beta + self.bend / 2 * u[:, 1] ** 2 - u[:, 0]

    @property
    def exact(self) -> float:
        return float(quad(lambda v: norm.pdf(v) * norm.sf(self.beta + self.bend / 2 * v**2), -12, 12, limit=200)[0])


@dataclass(frozen=True)
class Step:
    """1 where u₁ is below a bound and −1 beyond: nothing leads to the failure."""

    bound: float
    variables: int = 2

    def __call__(self, u: np.ndarray) -> np.ndarray:
        return np.where(u[:, 0] < self.bound, 1.0, -1.0)


def test_failures_of_one_in_ten_million_take_few_calls():
    """Φ(−5.2) ≈ 1e-7 in ten variables: each estimate within three standard errors and 20,000 calls."""
    limit, probability = Flat(beta=5.2, variables=10), norm.sf(5.2)
    point = DesignPoints.only(design_point(limit))
    assert point.points[0].beta == pytest.approx(5.2, rel=1e-6)
    for seed in range(10):
        by_levels = subset_simulation(limit, SeedTree(seed), samples=2500)
        by_weights = importance_sampling(limit, point, SeedTree(seed))
        for item, variation in ((by_levels, 0.5), (by_weights, 0.05)):
            assert abs(item.probability - probability) <= 3 * item.standard_error
            assert item.coefficient_of_variation < variation
            assert item.calls < 20_000


@pytest.mark.parametrize("bend", [-0.15, 0.0, 2.0, 20.0])
def test_curved_limits(bend):
    limit = Bent(beta=3.0, bend=bend)
    point = DesignPoints.only(design_point(limit))
    errors = []
    for seed in range(6):
        item = importance_sampling(limit, point, SeedTree(seed))
        errors.append((item.probability - limit.exact) / item.standard_error)
        item = subset_simulation(limit, SeedTree(seed), samples=4000)
        errors.append((item.probability - limit.exact) / item.standard_error)
    assert np.abs(errors).max() <= 3.0
    assert np.mean(np.square(errors)) > 0.1


@pytest.mark.slow
def test_stated_errors_are_neither_small_nor_large():
    """Over many seeds the spread of the estimates is that which each of them states."""
    limit = Flat(beta=3.5)
    results = [subset_simulation(limit, SeedTree(seed), samples=1000) for seed in range(150)]
    found = np.array([item.probability for item in results])
    stated = np.mean([item.standard_error for item in results])
    assert found.mean() == pytest.approx(norm.sf(3.5), abs=4 * found.std() / np.sqrt(found.size))
    assert 0.75 < found.std() / stated < 1.3


def test_seeds_repeat_and_zero_is_one_like_every_other():
    limit = Flat(beta=3.0)
    for estimate in (
        lambda seed: subset_simulation(limit, SeedTree(seed), samples=500, runs=2),
        lambda seed: importance_sampling(limit, design_points(limit, SeedTree(seed), starts=3), SeedTree(seed)),
    ):
        assert estimate(0) == estimate(0)
        assert estimate(0).probability != estimate(1).probability


def test_calls_are_counted():
    limit = Flat(beta=3.0)
    found = subset_simulation(limit, SeedTree(4), samples=500, runs=2)
    assert found.calls == sum(limit.seen)
    limit.seen.clear()
    points = design_points(limit, SeedTree(4), starts=5)
    assert importance_sampling(limit, points, SeedTree(4), samples=700).calls == sum(limit.seen)


def test_one_level_has_the_binomial_error():
    """Where one level is enough, no chain and no lineage may change the error of independent samples."""
    found = subset_simulation(Flat(beta=1.0), SeedTree(6))
    share = found.probability
    assert len(found.runs[0].levels) == 1
    assert found.standard_error == pytest.approx(np.sqrt(share * (1 - share) / 2000))


def test_levels_lead_to_the_probability():
    found = subset_simulation(Flat(beta=4.0), SeedTree(2))
    levels = found.runs[0].levels
    assert np.prod([level.share for level in levels]) == pytest.approx(found.probability)
    thresholds = [level.bound for level in levels]
    assert thresholds == sorted(thresholds, reverse=True)
    assert thresholds[-1] == 0.0
    for level in levels:
        squared = (1 - level.share) / (2000 * level.share) * (1 + level.correlation)
        assert level.coefficient_of_variation == pytest.approx(np.sqrt(squared))
    assert all(0.3 < level.accepted < 0.6 and level.correlation > 0 for level in levels[1:-1])


def test_failed_samples_count_as_safe_up_to_one_per_cent_and_then_stop():
    few = Flat(beta=3.0, blind_beyond=3.8)
    found = subset_simulation(few, SeedTree(1))
    assert 0 < found.failed < 0.01 * found.calls
    assert found.cautions
    assert "no usable answer and count as kept; the yields of random units count them as missed" in " ".join(
        found.cautions
    )
    many = Flat(beta=3.0, blind_beyond=2.0)
    with pytest.raises(SolveError, match="have no usable answer"):
        subset_simulation(many, SeedTree(1))
    with pytest.raises(SolveError, match="have no usable answer"):
        importance_sampling(many, DesignPoints.only(design_point(many)), SeedTree(1))


def test_a_value_that_is_not_finite_is_a_failed_sample():
    class Holed:
        variables = 1

        def __call__(self, u: np.ndarray) -> np.ndarray:
            return np.where(u[:, 0] > 0, -np.inf, 1.0)

    counted = CountedLimitState(Holed())
    np.testing.assert_array_equal(counted.values(np.array([[1.0], [-1.0]])), [np.inf, 1.0])
    assert (counted.calls, counted.failed) == (2, 1)


def test_origin_in_the_failure_has_a_negative_index():
    point = design_point(Flat(beta=-1.0))
    assert point.converged
    assert point.beta == pytest.approx(-1.0)
    assert point.probability == pytest.approx(norm.sf(-1.0))
    found = subset_simulation(Flat(beta=-1.0), SeedTree(3))
    assert len(found.runs[0].levels) == 1
    assert abs(found.probability - norm.sf(-1.0)) <= 3 * found.standard_error


def test_flat_limit_state_is_reported():
    found = subset_simulation(Step(bound=4.5), SeedTree(3))
    assert found.probability == 0.0
    assert found.standard_error == found.coefficient_of_variation == np.inf
    assert "flat" in " ".join(found.cautions)
    assert "gradient vanishes" in design_point(Step(bound=4.5)).status
    unreachable = subset_simulation(Flat(beta=40.0), SeedTree(3), samples=100)
    assert "levels away" in " ".join(unreachable.cautions)


def test_importance_sampling_says_when_it_cannot_see():
    """In many variables the wide component is too thin to meet a second region, and the status says so."""
    limit = Flat(beta=3.0, variables=100, both_sides=True)
    one = DesignPoints.only(design_point(limit, np.full(100, 0.1)))
    assert one.points[0].converged
    found = importance_sampling(limit, one, SeedTree(0))
    assert found.cautions
    assert "another region as near as the design point would be met only" in " ".join(found.cautions)
    by_levels = subset_simulation(limit, SeedTree(0), samples=4000)
    assert abs(by_levels.probability - 2 * norm.sf(3.0)) <= 3 * by_levels.standard_error


def apart(one: RareFailure, other: RareFailure) -> float:
    """Return the difference of independent estimates in its standard errors."""
    return (one.probability - other.probability) / float(np.hypot(one.standard_error, other.standard_error))


def test_two_methods_contradict_each_other_where_one_is_blind():
    """Around one of two design points in many variables, half of the probability goes unseen but for luck."""
    limit = Flat(beta=4.0, variables=100, both_sides=True)
    one = DesignPoints.only(design_point(limit, np.full(100, 0.1)))
    by_weights = importance_sampling(limit, one, SeedTree(0))
    by_levels = subset_simulation(limit, SeedTree(0), samples=4000, runs=10)
    assert apart(by_levels, by_weights) > 3.0
    alone = importance_sampling(
        Flat(beta=4.0, variables=2, both_sides=True),
        design_points(Flat(beta=4.0, both_sides=True), SeedTree(0)),
        SeedTree(0),
    )
    assert not alone.cautions
    assert abs(apart(by_levels, alone)) <= 3.0


def test_steps_to_failed_samples_are_shortened():
    """From the origin the first full step ends near u₁ = 19, where there is no answer."""

    class Steep:
        variables = 2

        def __call__(self, u: np.ndarray) -> np.ndarray:
            return np.where(u[:, 0] > 8.0, np.nan, 1 - np.exp(np.minimum(u[:, 0], 8.0) - 3))

    point = design_point(Steep())
    assert point.converged
    np.testing.assert_allclose(point.u, [3.0, 0.0], atol=1e-5)


def test_few_samples_degenerate():
    point = DesignPoints.only(design_point(Bent(beta=3.0, bend=2000.0)))
    found = importance_sampling(Bent(beta=3.0, bend=2000.0), point, SeedTree(0), samples=500)
    assert found.effective_samples < 50
    assert "degenerate" in " ".join(found.cautions) or "no sample failed" in " ".join(found.cautions)


def test_arguments_out_of_range():
    limit = Flat(beta=3.0)
    point = DesignPoints.only(design_point(limit))
    for call in (
        lambda: subset_simulation(limit, SeedTree(0), samples=1005),
        lambda: subset_simulation(limit, SeedTree(0), samples=90),
        lambda: subset_simulation(limit, SeedTree(0), runs=0),
        lambda: importance_sampling(limit, point, SeedTree(0), samples=10),
        lambda: importance_sampling(limit, DesignPoints(points=(), calls=0, failed=0), SeedTree(0)),
        lambda: design_points(limit, SeedTree(0), starts=0),
        lambda: Normal(mean=0.0, deviation=0.0),
        lambda: Uniform(low=1.0, high=1.0),
        lambda: LogNormal(mean=-1.0, deviation=1.0),
        lambda: LargestValue(mean=0.0, deviation=-1.0),
    ):
        with pytest.raises(InputError):
            call()


def test_marginals_have_their_distributions(generator):
    sigma = np.sqrt(np.log1p(0.25))
    scale = 2.0 * np.sqrt(6) / np.pi
    u = generator.standard_normal(4000)
    for marginal, truth in (
        (Normal(mean=4.0, deviation=2.0), norm(4.0, 2.0)),
        (Uniform(low=-1.0, high=3.0), uniform(-1.0, 4.0)),
        (LogNormal(mean=4.0, deviation=2.0), lognorm(sigma, scale=4.0 * np.exp(-(sigma**2) / 2))),
        (LargestValue(mean=4.0, deviation=2.0), gumbel_r(4.0 - np.euler_gamma * scale, scale)),
    ):
        assert kstest(marginal.value(u), truth.cdf).pvalue > 1e-3
        far = np.array([-7.0, -1.0, 0.5, 7.0])
        np.testing.assert_allclose(truth.sf(marginal.value(far))[1:3], norm.sf(far)[1:3], rtol=1e-10)
        np.testing.assert_allclose(marginal.value(far), [truth.ppf(norm.cdf(far[0])), *truth.isf(norm.sf(far[1:]))])
    assert np.isfinite(LargestValue(mean=0.0, deviation=1.0).value(np.array([-50.0, 50.0]))).all()
    assert LogNormal(mean=1.0, deviation=1.0).value(np.array([5000.0]))[0] == np.inf
    both = LimitOfInputs(marginals=(Normal(mean=1.0, deviation=2.0),) * 2, margin=lambda x: x.sum(axis=1))
    np.testing.assert_array_equal(both(np.ones((3, 2))), [6.0] * 3)
