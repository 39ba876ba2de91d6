"""Yields at a limit: on responses whose share beyond the limit is known, and on the real kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import chi2, norm

from tests.builders import prepared, sizes, source
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.indices import Limits, capability
from tolalloc.capability.limit_state import RareFailure, ResponseLimit
from tolalloc.capability.monte_carlo import MonteCarlo, monte_carlo, proportion
from tolalloc.capability.rare_failure import scaled_sigma_sampling, subset_simulation
from tolalloc.capability.yield_at_limit import METHOD, log_normal_interval, yield_at_limit
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Distribution, Feature
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation


def normals(count: int) -> ErrorModel:
    """Independent columns that are standard normal."""
    return sizes(f"s{number}" for number in range(count))


@dataclass(frozen=True)
class Sum:
    """Sum of the columns over √n."""

    columns: tuple[str, ...]
    outputs: tuple[str, ...] = ("y [arcsec]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        values = x.sum(axis=1, keepdims=True) / np.sqrt(x.shape[1])
        return Evaluation(values=values, status=np.zeros(x.shape[0], np.uint8))


@dataclass(frozen=True)
class Radius(Sum):
    """Distance from zero of the first two columns: nothing prefers a direction in their plane."""

    def __call__(self, x: np.ndarray) -> Evaluation:
        values = np.linalg.norm(x[:, :2], axis=1, keepdims=True)
        return Evaluation(values=values, status=np.zeros(x.shape[0], np.uint8))


def limited(kind: type[Sum], errors: ErrorModel, limit: float, seed: int = 0) -> ResponseLimit:
    return ResponseLimit(experiment=Experiment.of(kind(errors.columns), errors, SeedTree(seed)), limit=limit)


def units_of(limit: ResponseLimit, seed: int, units: int) -> MonteCarlo:
    return monte_carlo(replace(limit.experiment, seeds=SeedTree(seed, ("units",))), units)


MIXED = ErrorModel(
    (
        source("one"),
        source("other", distribution=Distribution.UNIFORM),
        source("bore", Feature.POSITION, distribution=Distribution.UNIFORM),
        source("journal", Feature.POSITION),
        replace(source("ring", Feature.RUNOUT, distribution=Distribution.UNIFORM), spectrum=((1, 1.0), (2, 0.5))),
    ),
    correlation=Correlation(pairs=(Pair(one="one", other="other", correlation=0.7),)),
)


def test_deviations_have_the_distributions_of_the_error_model(generator):
    limit = ResponseLimit(experiment=Experiment.of(Sum(MIXED.columns), MIXED, SeedTree(0)), limit=1.0)
    u = generator.standard_normal((50, limit.variables))
    expected = MIXED.deviations(MIXED.standard_values(ndtr(u)), MIXED.zones)
    np.testing.assert_array_equal(limit.deviations(u), expected)
    assert np.isfinite(limit.deviations(np.full((1, limit.variables), 40.0))).all()
    assert np.isfinite(limit.deviations(np.full((1, limit.variables), -35.0))).all()


def test_share_that_is_not_rare_is_left_to_random_units():
    limit = limited(Sum, normals(4), 2.0)
    sample = units_of(limit, 0, 20_000)
    found = yield_at_limit(limit, sample)
    low, high = found.interval.low, found.interval.high
    assert low < norm.cdf(2.0) < high
    within = sample.within(2.0)
    assert (found.interval.estimate, low, high) == (within.estimate, within.low, within.high)
    assert [item.method for item in found.estimates] == ["Monte Carlo"]
    assert "is not rare" in found.verdict
    assert found.estimate.calls == 20_000
    assert capability(sample.values, Limits(upper=2.0)).ppk == pytest.approx(2.0 / 3, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    ("kind", "limit", "exact"),
    [(Sum, 4.75, norm.sf(4.75)), (Radius, 5.25, chi2.sf(5.25**2, 2))],
    ids=["one direction", "all directions of a plane"],
)
def test_parts_per_million_by_two_methods(kind, limit, exact, seed):
    """Φ(−4.75) and exp(−5.25²/2) are about 1e-6; each estimate within 3.5 of its standard errors, 12 in all."""
    state = limited(kind, normals(6), limit, seed)
    found = yield_at_limit(state, units_of(state, seed, 5000), samples=2000, runs=4)
    for item in found.estimates[1:]:
        assert abs(item.probability - exact) <= 3.5 * item.standard_error
        assert item.coefficient_of_variation < 0.25
    assert found.verdict.startswith("Rely on it: subset simulation and scaled-sigma sampling differ by")
    assert (found.estimate.method, found.estimate.calls) == (METHOD, sum(item.calls for item in found.estimates))
    assert abs(found.estimate.probability - exact) <= 3.5 * found.estimate.standard_error
    assert found.parts_per_million.low < found.parts_per_million.estimate < found.parts_per_million.high
    assert found.interval.high < 1.0


@pytest.mark.slow
def test_widened_sampling_states_its_own_spread():
    """Over 60 seeds on a known share, each of two small runs."""
    limit, exact = limited(Radius, normals(6), 4.5), chi2.sf(4.5**2, 2)
    results = [scaled_sigma_sampling(limit, SeedTree(seed), samples=500, runs=2) for seed in range(60)]
    found = np.array([item.probability for item in results])
    stated = np.mean([item.standard_error for item in results])
    assert found.mean() == pytest.approx(exact, abs=4 * found.std() / np.sqrt(60))
    assert 0.6 < found.std() / stated < 1.3


@pytest.mark.slow
def test_limit_beyond_reach_leaves_the_upper_end_of_the_random_units():
    limit = limited(Sum, ErrorModel((source("s", distribution=Distribution.UNIFORM),)), 3.5)
    found = yield_at_limit(limit, units_of(limit, 0, 5000), samples=200, runs=2)
    assert "neither subset simulation nor scaled-sigma sampling found a failure" in found.verdict
    assert found.estimate.method == "Monte Carlo"
    assert found.interval.high == 1.0
    assert found.interval.low == proportion(5000, 0).low
    assert 0 < found.parts_per_million.high < 1000


@pytest.mark.parametrize("runs", [2, 5])
def test_log_normal_interval_covers_as_stated(generator, runs):
    """Coverage over 4000 log-normal estimates whose spread comes from so many runs, within 4 standard errors."""
    spread, exact = 0.4, 2e-6
    logarithms = np.log(exact) + spread * np.sqrt(runs) * generator.standard_normal((4000, runs))
    covered = 0
    for own in logarithms:
        value, variation = np.exp(own.mean()), np.sqrt(np.expm1(own.var(ddof=1) / runs))
        failure = RareFailure(
            probability=float(value),
            standard_error=float(variation * value),
            calls=1,
            failed=0,
            method="",
            cautions=(),
            effective_samples=1.0,
        )
        interval = log_normal_interval(failure, runs)
        covered += interval.low <= 1 - exact <= interval.high
    assert covered / 4000 == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 4000))


@pytest.mark.slow
def test_intervals_of_subset_simulation_cover():
    """30 intervals of 95 % at Φ(−4.265) ≈ 1e-5 from small runs cover 0.95 less 3 standard errors."""
    runs, seeds = 3, 30
    limit, exact = limited(Sum, normals(2), 4.265), norm.sf(4.265)
    covered = []
    for seed in range(seeds):
        found = log_normal_interval(subset_simulation(limit, SeedTree(seed), samples=100, runs=runs), runs)
        covered.append(found.low <= 1 - exact <= found.high)
    assert np.mean(covered) >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / seeds)


def test_arguments_out_of_range():
    limit = limited(Sum, normals(2), 4.5)
    sample = units_of(limit, 0, 100)
    for call in (
        lambda: yield_at_limit(limit, sample, runs=1),
        lambda: scaled_sigma_sampling(limit, SeedTree(0), runs=0),
        lambda: scaled_sigma_sampling(limit, SeedTree(0), samples=105),
    ):
        with pytest.raises(InputError):
            call()


@pytest.mark.slow
def test_kernel_agrees_with_random_units():
    """A share near 1 % by small subset simulations, within 3.5 standard errors of random units of another seed."""
    study = prepared(name="kernel")
    errors, kernel = study.errors, study.model.kernel
    limit = ResponseLimit(experiment=Experiment.of(kernel, errors, SeedTree(0)), limit=80.0)
    units = monte_carlo(Experiment.of(kernel, errors, SeedTree(1, ("units",))), 3000)
    share = 1 - units.within(80.0).estimate
    found = subset_simulation(limit, SeedTree(0), samples=1000, runs=2)
    error = np.hypot(found.standard_error, np.sqrt(share / 3000))
    assert abs(found.probability - share) <= 3.5 * error
    assert not found.cautions
