"""One failed sample, planted anywhere: it is dropped whole and counted, or it stops the estimate.

A sample fails in two ways: its output is NaN, or its status is not 0 and its output looks like any other. Whatever
reads both in the same way, to the last bit, has not used the output.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from tests.builders import sizes
from tests.first_order import DesignPoints, design_point, design_points, importance_sampling
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.indices import Limits, capability, quantile_interval
from tolalloc.capability.limit_state import ResponseLimit
from tolalloc.capability.monte_carlo import monte_carlo
from tolalloc.capability.rare_failure import scaled_sigma_sampling, subset_simulation
from tolalloc.capability.yield_at_limit import YieldAtLimit, yield_at_limit
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.derivatives import classical_estimate
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.saltelli import saltelli_indices
from tolalloc.sensitivity.shapley import shapley_effects
from tolalloc.sensitivity.sobol import sobol_indices

KINDS = ("NaN", "status")
NAMES = ("a", "b", "c")
ERRORS = sizes(NAMES, minimum=1.0, maximum=9.0)
SEEDS = SeedTree(0, ("planted",))


@dataclass
class Planted:
    """Sum of the columns; the samples with these numbers, counted over all calls, fail."""

    at: tuple[int, ...] = ()
    kind: str = "NaN"
    columns: tuple[str, ...] = NAMES
    outputs: tuple[str, ...] = ("y [-]",)
    seen: int = field(default=0)

    def __call__(self, x: np.ndarray) -> Evaluation:
        values, status = x.sum(axis=1, keepdims=True), np.zeros(x.shape[0], np.uint8)
        for row in (number - self.seen for number in self.at if self.seen <= number < self.seen + x.shape[0]):
            values[row] = np.nan if self.kind == "NaN" else 0.5
            status[row] = 0 if self.kind == "NaN" else 7
        self.seen += x.shape[0]
        return Evaluation(values=values, status=status)


def limit_state(at: tuple[int, ...], kind: str, *share: float) -> ResponseLimit:
    return ResponseLimit(experiment=Experiment.of(Planted(at, kind), ERRORS, SEEDS, *share), limit=5.0)


def random_units(at: tuple[int, ...], kind: str, *share: float):
    return monte_carlo(Experiment.of(Planted(at, kind), ERRORS, SEEDS, *share), 400)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("at", [0, 137, 399])
def test_random_units_drop_it_and_count_it_as_rejected(at, kind):
    clean, found = random_units((), kind), random_units((at,), kind)
    assert found.failed == 1
    np.testing.assert_array_equal(found.values, np.delete(clean.evaluation.values[:, 0], at))
    for limit in (-10.0, 0.0, 10.0):
        accepted = np.count_nonzero(found.values <= limit)
        assert found.within(limit).rejected == 400 - accepted
        assert found.within(limit).units == 400
    assert found.quantile(0.9) == np.quantile(found.values, 0.9)
    assert np.isfinite(found.quantile_bound(0.9))
    assert not (found.unit_at(0.5) == found.x[at]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_random_units_stop_above_one_per_cent_unless_told_otherwise(kind):
    assert random_units(tuple(range(4)), kind).failed == 4
    with pytest.raises(SolveError, match="5 of 400"):
        random_units(tuple(range(5)), kind)
    assert random_units(tuple(range(5)), kind, 0.02).failed == 5


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("at", [0, 3, 617, 999])
def test_indices_drop_the_block_whole(at, kind, generator):
    x = generator.standard_normal((200 * 5, 3))
    clean, planted = Planted()(x), Planted((at,), kind)(x)
    left = np.delete(np.arange(1000).reshape(200, 5), at // 5, axis=0).ravel()
    rest = Evaluation(values=clean.values[left], status=clean.status[left])
    found, expected = saltelli_indices(planted, 3, SEEDS), saltelli_indices(rest, 3, SEEDS)
    assert (found.dropped, found.blocks) == (1, 199)
    for name in ("first", "total", "variance"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert np.isfinite(found.total_resamples).all()


@pytest.mark.parametrize("kind", KINDS)
def test_indices_stop_above_one_per_cent(kind, generator):
    x = generator.standard_normal((200 * 5, 3))
    assert saltelli_indices(Planted(tuple(range(0, 500, 50)), kind)(x), 3, SEEDS).dropped == 10
    with pytest.raises(SolveError, match="11 of 1,000 units"):
        saltelli_indices(Planted(tuple(range(0, 550, 50)), kind)(x), 3, SEEDS)


@dataclass(frozen=True)
class Scattered:
    """Sum of 50 columns without an answer for a share of units, wherever they lie."""

    share: float
    columns: tuple[str, ...] = tuple(f"x{at}" for at in range(50))
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        lot = (1e4 * x @ np.sqrt(np.arange(2.0, 52.0)) + 0.5) % 1.0
        return Evaluation(values=x.sum(axis=1, keepdims=True), status=(lot < self.share).astype(np.uint8))


@pytest.mark.parametrize(
    "estimate",
    [
        lambda asked: sobol_indices(asked, SobolEffort(start=128, limit=128, places=1)).dropped,
        lambda asked: shapley_effects(asked, 200).dropped,
        lambda asked: classical_estimate(asked).alone.size - 50,
    ],
)
def test_the_share_that_may_fail_is_one_of_units_however_many_sources_there_are(estimate):
    """0.2 % of units, in a tenth of the blocks and orders of 51 or 52 units, which drop."""
    errors = sizes(Scattered(0.0).columns)
    dropped = estimate(Experiment.of(Scattered(0.002), errors, SEEDS))
    assert dropped == 0 or dropped > 5
    with pytest.raises(SolveError, match=r"units have no usable answer; allowed is a share of 0\.01"):
        estimate(Experiment.of(Scattered(0.03), errors, SEEDS))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("at", [0, 1, 20, 48])
def test_hand_estimate_stops_at_any(at, kind):
    """The nominal unit and 16 units for each of the three sources."""
    with pytest.raises(SolveError):
        classical_estimate(Experiment.of(Planted((at,), kind), ERRORS, SEEDS))


@pytest.mark.parametrize("at", [0, 31, 99])
def test_capability_refuses_it(at, generator):
    sample = generator.standard_normal(100)
    sample[at] = np.nan
    for call in (lambda: capability(sample, Limits(upper=3.0)), lambda: quantile_interval(sample, 0.9)):
        with pytest.raises(InputError, match="all finite"):
            call()


@pytest.mark.slow
@pytest.mark.parametrize("at", [0, 150, 500, 1200])
def test_subset_simulation_counts_it_as_safe_and_cautions(at):
    found = [subset_simulation(limit_state((at,), kind), SEEDS, samples=500, runs=2) for kind in KINDS]
    assert found[0] == found[1]
    assert found[0].failed == 1
    assert found[0].cautions


@pytest.mark.parametrize("at", [0, 150, 999])
def test_weighted_samples_count_it_as_safe_and_caution(at):
    points = DesignPoints.only(design_point(limit_state((), "NaN")))
    for estimate in (
        lambda state: scaled_sigma_sampling(state, SEEDS, samples=1000),
        lambda state: importance_sampling(state, points, SEEDS, samples=1000),
    ):
        found = [estimate(limit_state((at,), kind)) for kind in KINDS]
        assert found[0] == found[1]
        assert found[0].failed == 1
        assert re.search(r"1 of [\d,]+ samples behind this share have no usable answer", " ".join(found[0].cautions))


def test_searches_for_design_points_count_it():
    found = [design_points(limit_state((5,), kind), SEEDS, starts=3) for kind in KINDS]
    assert [item.failed for item in found] == [1, 1]
    np.testing.assert_array_equal(found[0].points[0].u, found[1].points[0].u)
    samples = importance_sampling(limit_state((), "NaN"), found[0], SEEDS, samples=500)
    assert samples.failed == 1


def planted_yield(at: tuple[int, ...], kind: str, units: int, *share: float) -> YieldAtLimit:
    """Return the yield from random units of which some fail, which no later sample does."""
    state = limit_state(at, kind, *share)
    sample = monte_carlo(replace(state.experiment, largest_failed_share=0.1), units)
    return yield_at_limit(state, sample, samples=200, runs=2, scaled=100)


@pytest.mark.parametrize("at", [0, 1999])
def test_yield_at_a_limit_counts_it_as_rejected(at):
    found = [planted_yield((at,), kind, 2000) for kind in KINDS]
    assert found[0] == found[1]
    assert sum(item.failed for item in found[0].estimates) == 1
    plain = found[0].estimates[0]
    assert plain.probability >= 1 / 2000
    assert "count as rejected" in " ".join(plain.cautions)
    assert (plain.calls, plain.failed) == (2000, 1)


@pytest.mark.parametrize("kind", KINDS)
def test_rare_failures_stop_above_one_per_cent_unless_told_otherwise(kind):
    with pytest.raises(SolveError, match="no usable answer"):
        subset_simulation(limit_state(tuple(range(6)), kind), SEEDS, samples=500)
    allowed = subset_simulation(limit_state(tuple(range(6)), kind), SEEDS, samples=500, largest_failed_share=0.02)
    assert any("no usable answer" in text for text in allowed.cautions)
    with pytest.raises(SolveError, match="no usable answer"):
        planted_yield(tuple(range(6)), kind, 500)
    found = planted_yield(tuple(range(6)), kind, 500, 0.02)
    assert any("no usable answer" in text for text in found.estimate.cautions)
