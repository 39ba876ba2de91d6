"""Rare failures by methods that fail differently, on cases with exact answers (`tests.reliability`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import poisson

from tests.reliability import CASES, breitung, flat, metaballs_probability, outside_sphere, random_units, uniform_sum
from tolalloc.capability.monte_carlo import monte_carlo
from tolalloc.capability.rare_failure import scaled_sigma_sampling, subset_simulation
from tolalloc.capability.yield_at_limit import Agreement, agreement, judged, yield_at_limit
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError

UNITS = 16_384


def asked(case, seed: int, **effort: int) -> Agreement:
    return agreement(case, random_units(case, SeedTree(seed, ("units",)), UNITS), SeedTree(seed), **effort)


def test_cases_are_many_and_have_names_of_their_own():
    assert len(CASES) >= 40
    assert len({(case.name, case.variables) for case in CASES}) == len(CASES)
    assert {2, 100} <= {case.variables for case in CASES}
    assert sum(case.exact < 1e-3 for case in CASES) >= 40


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", [case for case in CASES if case.variables <= 10 and case.exact > 1e-5], ids=lambda case: case.name
)
def test_exact_probabilities_are_those_of_random_units(case):
    """Of 400,000 units (an expectation of 4 failures or more) within the 1e-5 tails of a Poisson count."""
    units = 400_000
    failures = int((case(np.random.default_rng(5).standard_normal((units, case.variables))) < 0).sum())
    low, high = poisson.ppf([1e-5, 1 - 1e-5], units * case.exact)
    assert low <= failures <= high


@pytest.mark.parametrize("case", [breitung(2), flat(10, 5.2), uniform_sum(6)], ids=lambda case: case.name)
def test_estimates_without_a_caution_are_right_within_a_factor_of_two(case):
    found = asked(case, 0).estimate
    assert not found.cautions
    assert 0.5 < found.probability / case.exact < 2
    assert abs(found.probability - case.exact) <= 3 * found.standard_error


@pytest.mark.slow
def test_cases_keep_their_word():
    """One seed of every third case: a factor of two without a caution, three errors with one; few cautions in all."""
    found = [(case, asked(case, 1000).estimate) for case in CASES[::3]]
    relied = [(case, item) for case, item in found if not item.cautions]
    assert all(0.5 < item.probability / case.exact < 2 for case, item in relied)
    assert sum(abs(item.probability - case.exact) > 3 * item.standard_error for case, item in found) <= 1
    assert len(relied) >= 0.9 * len(found)


def test_a_slope_that_leads_away_fools_subset_simulation_and_is_noticed():
    """Runs of few samples find the region that is a hundred times rarer; scaled-sigma sampling finds the other."""
    case = breitung(2)
    fooled = [
        (levels, seed)
        for seed in range(12)
        if (levels := subset_simulation(case, SeedTree(seed), samples=200, runs=2)).probability < case.exact / 20
    ]
    assert fooled
    levels, seed = fooled[0]
    scaled = scaled_sigma_sampling(case, SeedTree(seed), samples=1000, runs=4, known=levels.failing)
    found = judged(random_units(case, SeedTree(seed), 2000), levels, scaled)
    assert "contradict each other" in found.verdict
    assert found.verdict.startswith("Do not rely on this estimate")
    assert found.estimate.probability == scaled.probability
    assert abs(found.estimate.probability - case.exact) <= 3 * found.estimate.standard_error


def test_steps_do_not_follow_the_spread_of_their_starts():
    """In 100 variables such steps made the estimate too low by a fifth; 24 runs within 3.5 of their standard errors."""
    case = outside_sphere(100, 100, 12.2)
    runs = subset_simulation(case, SeedTree(0), samples=1000, runs=24).runs
    found = np.array([run.probability for run in runs])
    assert found.mean() == pytest.approx(case.exact, abs=3.5 * found.std(ddof=1) / np.sqrt(24))
    assert found.std(ddof=1) / np.sqrt(24) < 0.07 * case.exact


@dataclass(frozen=True)
class NoAnswerFarOut:
    """A hyperplane whose model has no answer on the other side far out."""

    variables: int = 2

    def __call__(self, u: np.ndarray) -> np.ndarray:
        return np.where(u[:, 0] < -4.0, np.nan, 3.5 - u[:, 0])


def test_widths_stay_where_the_model_answers():
    """At a width of 1.72 a hundredth of the units has no answer: the first width stays below, and failures are few."""
    found = scaled_sigma_sampling(NoAnswerFarOut(), SeedTree(0), samples=2000, runs=2)
    assert found.runs[0].levels[0].bound < 1.72
    assert abs(found.probability - flat(2, 3.5).exact) <= 3.5 * found.standard_error
    assert any("no usable answer" in text for text in found.cautions)


def test_a_check_that_stops_is_a_caution():
    case = flat(2, 3.5)
    levels = subset_simulation(case, SeedTree(0), samples=1000, runs=3)
    found = judged(random_units(case, SeedTree(0), 1000), levels, SolveError("Too many failed."))
    assert found.estimate.probability == levels.probability
    assert "not checked; scaled-sigma sampling stopped: Too many failed" in found.verdict
    assert found.estimate.cautions


def test_random_units_alone_are_not_relied_on_where_few_fail_and_nothing_else_does():
    """A small island that no slope leads to and that ends further out."""
    case = replace(flat(2, 4.0), margin=lambda u: np.where(np.linalg.norm(u - [3.0, 0.0], axis=1) < 0.3, -1.0, 4.0))
    found = [asked(case, seed, samples=100, runs=2, scaled=100) for seed in range(3)]
    assert any("neither subset" in item.verdict for item in found)
    assert all(item.verdict.startswith("Do not rely") for item in found)


def test_random_units_may_contradict():
    case = flat(2, 3.5)
    levels = subset_simulation(case, SeedTree(0), samples=1000, runs=3)
    scaled = scaled_sigma_sampling(case, SeedTree(0), samples=1000, runs=3, known=levels.failing)
    plain = replace(random_units(case, SeedTree(0), 20_000), effective_samples=25.0)
    assert "of 20000 random units 25 lie beyond the limit" in judged(plain, levels, scaled).verdict


def test_an_estimate_that_a_factor_of_two_may_change_is_not_relied_on():
    found = asked(flat(2, 4.5), 0, samples=100, runs=2, scaled=100)
    assert "more than a factor of two" in found.verdict
    assert found.estimate.cautions


def test_the_yield_is_that_of_the_agreement():
    """The normal columns of a drawing give the case itself."""
    limit = flat(2, 3.5).limit(0)
    sample = monte_carlo(replace(limit.experiment, seeds=SeedTree(0, ("units",))), 1000)
    found = yield_at_limit(limit, sample, samples=200, runs=2, scaled=100)
    assert found.estimate.calls == sum(item.calls for item in found.estimates)
    assert found.interval.low < 1 - flat(2, 3.5).exact < found.interval.high
    assert found.interval.estimate == 1 - found.estimate.probability


@pytest.mark.slow
def test_metaballs_on_a_finer_grid():
    assert metaballs_probability(1e-3) == pytest.approx(metaballs_probability(), rel=1e-3)
