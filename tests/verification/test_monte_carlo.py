"""Ranking and yields on functions that carry their own answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import norm

from tests.builders import sizes
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import allowed_rejections, monte_carlo, proportion
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Distribution
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.sobol import SourceIndices, sobol_indices


def angles(*names: str) -> ErrorModel:
    """Return sources that are uniform in ±π."""
    return sizes(names, zone=2 * np.pi, minimum=1.0, maximum=10.0, distribution=Distribution.UNIFORM)


@dataclass(frozen=True)
class Ishigami:
    """sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1, whose indices are known in closed form."""

    fail: tuple[int, ...] = ()
    columns: tuple[str, ...] = ("x1", "x2", "x3")
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
        status = np.zeros(x.shape[0], np.uint8)
        for row in self.fail:
            y[row], status[row] = np.nan, 1
        return Evaluation(values=y[:, np.newaxis], status=status)


def ranked(response: Ishigami, seeds: SeedTree, blocks: int) -> SourceIndices:
    errors = angles("x1", "x2", "x3")
    return sobol_indices(Experiment.of(response, errors, seeds), SobolEffort(start=blocks, limit=blocks)).of("y [-]")


FIRST = [0.31390519, 0.44241114, 0.0]
TOTAL = [0.55758886, 0.44241114, 0.24368366]


@pytest.mark.parametrize("seed", [0, 1])
def test_ishigami(seed):
    found = ranked(Ishigami(), SeedTree(seed).child("s"), 4096)
    for values, truth, resamples in (
        (found.first, FIRST, found.first_resamples),
        (found.total, TOTAL, found.total_resamples),
    ):
        np.testing.assert_array_less(np.abs(values - truth), 3.5 * resamples.std(axis=0) + 1e-3)
    assert [found.sources[at] for at in found.order] == ["x1", "x2", "x3"]
    assert found.among_first(1)[0] > 0.95


def test_seed_zero_is_a_seed_like_every_other():
    one, two = (ranked(Ishigami(), SeedTree(0), 64) for _ in range(2))
    np.testing.assert_array_equal(one.total_resamples, two.total_resamples)


def test_a_failed_sample_drops_its_block_and_nothing_else():
    found, whole = ranked(Ishigami(fail=(7,)), SeedTree(3), 1024), ranked(Ishigami(), SeedTree(3), 1024)
    assert (found.blocks, whole.blocks) == (1023, 1024)
    assert found.total.min() > 0.1
    np.testing.assert_allclose(found.total, whole.total, atol=0.02)


def test_too_many_failed_samples_stop_the_analysis():
    errors = angles("x1", "x2", "x3")
    with pytest.raises(SolveError, match="8 of 640 units have no usable answer"):
        ranked(Ishigami(fail=tuple(range(0, 40, 5))), SeedTree(3), 128)
    with pytest.raises(SolveError, match="no usable answer"):
        monte_carlo(Experiment.of(Ishigami(fail=tuple(range(50))), errors, SeedTree(3)), 1000)


def test_clopper_pearson_covers(generator):
    """A yield of 0.99 lies in its 95 % interval in at least 95 % of samples, and below the bound in at most 5 %."""
    rejected = generator.binomial(500, 0.01, 2000)
    yields = [proportion(500, int(count)) for count in rejected]
    inside = np.mean([item.low <= 0.99 <= item.high for item in yields])
    wrong = np.mean([item.bound > 0.99 for item in yields])
    assert inside >= 0.95 - 3 * np.sqrt(0.05 * 0.95 / 2000)
    assert wrong <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 2000)


def test_quantile_bound_and_yield_bound_are_the_same_verdict():
    @dataclass(frozen=True)
    class First:
        columns: tuple[str, ...] = ("x1",)
        outputs: tuple[str, ...] = ("y [-]",)

        def __call__(self, x: np.ndarray) -> Evaluation:
            return Evaluation(values=norm.ppf(x / (2 * np.pi) + 0.5), status=np.zeros(x.shape[0], np.uint8))

    errors = angles("x1")
    sample = monte_carlo(Experiment.of(First(), errors, SeedTree(5)), 4000)
    bound = sample.quantile_bound(0.99)
    assert sample.within(bound).bound >= 0.99 > sample.within(bound - 1e-9).bound
    assert bound > norm.ppf(0.99)
    assert allowed_rejections(100, 0.9973) == -1
    assert monte_carlo(Experiment.of(First(), errors, SeedTree(5)), 100).quantile_bound(0.9973) == np.inf
