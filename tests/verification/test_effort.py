"""Efforts that no estimator would take are refused before anything runs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.builders import sizes
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.limit_state import ResponseLimit
from tolalloc.capability.monte_carlo import monte_carlo
from tolalloc.capability.rare_failure import scaled_sigma_sampling, subset_simulation
from tolalloc.capability.yield_at_limit import yield_at_limit
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.effort import RankingEffort, SobolEffort
from tolalloc.sensitivity.shapley import shapley_effects
from tolalloc.sensitivity.sobol import sobol_indices
from tolalloc.sensitivity.surrogate.validation import answers_of
from tolalloc.sensitivity.target import target_sensitivity
from tolalloc.study.problem import QUICK

ERRORS = sizes("a", minimum=1.0, maximum=9.0)
SEEDS = SeedTree(0)


class Itself:
    """The one column."""

    columns = ("a",)
    outputs = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        return Evaluation(values=x.copy(), status=np.zeros(x.shape[0], np.uint8))


LIMIT = ResponseLimit(experiment=Experiment.of(Itself(), ERRORS, SEEDS), limit=3.5)


def drawn(units: int):
    return monte_carlo(Experiment.of(Itself(), ERRORS, SEEDS), units)


ESTIMATORS = {
    "units": lambda units: target_sensitivity(drawn(units), ERRORS, 9.0, SEEDS, permutations=9, resamples=9),
    "surrogate_units": lambda units: answers_of(Itself(), drawn(units).x, SEEDS),
    "level_units": lambda units: subset_simulation(LIMIT, SEEDS, samples=units),
    "level_runs": lambda runs: yield_at_limit(LIMIT, drawn(100), samples=100, runs=runs, scaled=100),
    "widened_units": lambda units: scaled_sigma_sampling(LIMIT, SEEDS, samples=units),
    "permutations": lambda count: shapley_effects(Experiment.of(Itself(), ERRORS, SEEDS), count),
}
SMALLEST = {
    "units": 1000,
    "derivative_units": 10,
    "inverse_units": 1,
    "surrogate_units": 10,
    "level_units": 100,
    "level_runs": 2,
    "widened_units": 100,
    "permutations": 2,
}


@pytest.mark.parametrize(("field", "smallest"), SMALLEST.items())
def test_a_number_below_the_smallest_is_refused_and_named(field, smallest):
    assert getattr(RankingEffort(**{field: smallest}), field) == smallest
    with pytest.raises(InputError, match=rf"study: effort\.ranking\.{field} is {smallest - 1}; allowed is {smallest}"):
        RankingEffort(**{field: smallest - 1})


@pytest.mark.parametrize("field", ESTIMATORS)
def test_the_smallest_number_is_the_smallest_that_the_estimator_takes(field):
    ESTIMATORS[field](SMALLEST[field])
    with pytest.raises(InputError):
        ESTIMATORS[field](SMALLEST[field] - 1)


@pytest.mark.parametrize("field", ["level_units", "widened_units"])
def test_a_level_is_made_of_whole_chains(field):
    with pytest.raises(InputError, match=f"{field} is 105; allowed is a multiple of 10"):
        RankingEffort(**{field: 105})
    with pytest.raises(InputError):
        subset_simulation(LIMIT, SEEDS, samples=105)


@pytest.mark.parametrize(
    ("field", "effort"),
    [
        ("limit", {"start": 64, "limit": 32}),
        ("probability", {"probability": 1.0}),
        ("probability", {"probability": 0.0}),
        ("resamples", {"resamples": 1}),
    ],
)
def test_the_growth_of_the_sobol_analysis_is_checked(field, effort):
    with pytest.raises(InputError, match=rf"effort\.ranking\.sobol\.{field}"):
        RankingEffort(sobol=SobolEffort(**effort))


def test_the_quick_effort_is_allowed_and_more_places_than_sources_are_not_asked_for():
    assert QUICK.ranking.units == 2048
    effort = SobolEffort(start=16, limit=16, places=3)
    assert sobol_indices(Experiment.of(Itself(), ERRORS, SEEDS), effort).convergence.stable
