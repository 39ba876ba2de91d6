"""Capability against closed forms, and the coverage of its intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, norm

from tests.validation_manual import shown
from tolalloc.capability.indices import (
    Interval,
    Limits,
    capability,
    quantile_interval,
    wilson_interval,
)
from tolalloc.capability.monte_carlo import CONFIDENCE, proportion
from tolalloc.exceptions import InputError

SAMPLE = np.array([9.0, 11.0, 10.0, 12.0, 8.0, 10.0])
"""Mean 10, sum of squares 10."""


def test_indices_by_hand():
    found = capability(SAMPLE, Limits(lower=4.0, upper=13.0))
    overall = np.sqrt(2.0)
    assert found.deviation_overall == pytest.approx(overall)
    assert (found.pp, found.ppk) == pytest.approx((9 / (6 * overall), 3 / (3 * overall)))
    assert found.normal_ppm == pytest.approx(1e6 * (norm.cdf(-6 / overall) + norm.cdf(-3 / overall)))
    assert Limits(lower=4.0, upper=13.0).outside(SAMPLE) == 0


@pytest.mark.parametrize(
    ("limits", "distance", "outside"),
    [(Limits(upper=11.5), 1.5, 1), (Limits(lower=8.5), 1.5, 1), (Limits(lower=11.0), -1.0, 4)],
)
def test_one_limit(limits, distance, outside):
    found = capability(SAMPLE, limits)
    assert found.pp is None
    assert found.ppk == pytest.approx(distance / (3 * np.sqrt(2.0)))
    assert limits.outside(SAMPLE) == outside
    assert found.normal_ppm == pytest.approx(1e6 * norm.sf(distance / np.sqrt(2.0)))


def test_three_sigma_is_2700_ppm(generator):
    """Independent normal units with limits at ±3σ: all indices 1, and both figures 2700 per million."""
    sample, limits = generator.standard_normal(400_000), Limits(lower=-3.0, upper=3.0)
    found = capability(sample, limits)
    np.testing.assert_allclose([found.pp, found.ppk], 1.0, atol=0.01)
    assert found.normal_ppm == pytest.approx(2699.8, rel=0.03)
    assert limits.outside(sample) / 0.4 == pytest.approx(2699.8, abs=4 * np.sqrt(2699.8 / 0.4))


def test_skewed_units_part_the_two_figures(generator):
    sample, limits = generator.exponential(size=200_000), Limits(upper=6.0)
    found = capability(sample, limits)
    assert limits.outside(sample) / sample.size == pytest.approx(np.exp(-6), rel=0.15)
    assert found.normal_ppm < 5.0


def test_wilson_ends_solve_its_equation():
    """Each end p satisfies |p̂ − p| = z·√(p·(1 − p)/n), from which the interval is derived."""
    found = wilson_interval(200, 193, 0.9)
    z = norm.isf(0.05)
    for end in (found.low, found.high):
        assert abs(found.estimate - end) == pytest.approx(z * np.sqrt(end * (1 - end) / 200))
    assert found.low < found.estimate < found.high


def test_wilson_of_extreme_yields():
    assert wilson_interval(100, 100).high == 1.0
    assert wilson_interval(100, 0).low == 0.0
    z = norm.isf(0.025)
    assert wilson_interval(100, 100).low == pytest.approx(100 / (100 + z**2))


@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_wilson_covers_on_average(confidence):
    """Exact coverage over many yields: the mean as stated, and none far below."""
    units, counts = 300, np.arange(301)
    ends = [wilson_interval(units, int(count), confidence) for count in counts]
    low, high = np.array([end.low for end in ends]), np.array([end.high for end in ends])
    coverage = [binom.pmf(counts, units, p)[(low <= p) & (p <= high)].sum() for p in np.linspace(0.02, 0.98, 193)]
    assert np.mean(coverage) == pytest.approx(confidence, abs=0.005)
    if confidence == 0.95:
        shown("S4", 100 * float(np.mean(coverage)))
    assert min(coverage) > confidence - 0.05


def attained_by(ordered: np.ndarray, share: float, found: Interval) -> float:
    """Return the exact confidence of the order statistics that an interval ends at, P(r ≤ B < s)."""
    low = np.searchsorted(ordered, found.low) + 1 if np.isfinite(found.low) else 0
    high = np.searchsorted(ordered, found.high) + 1 if np.isfinite(found.high) else ordered.size + 1
    return float(binom.cdf(high - 1, ordered.size, share) - binom.cdf(low - 1, ordered.size, share))


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_quantile_interval_covers(generator, share):
    """The true quantile of a skewed distribution lies inside as often as the confidence of its order statistics."""
    samples = generator.exponential(size=(4000, 600))
    found = [quantile_interval(sample, share) for sample in samples]
    inside = np.mean([item.low <= -np.log1p(-share) < item.high for item in found])
    attained = attained_by(np.sort(samples[0]), share, found[0])
    assert attained >= 0.95
    assert inside == pytest.approx(attained, abs=4 * np.sqrt(attained * (1 - attained) / 4000))


def test_no_nearer_order_statistics_would_do(generator):
    """Moving either end inwards leaves more than half of the doubt on its side."""
    sample = np.sort(generator.standard_normal(500))
    found = quantile_interval(sample, 0.9, 0.99)
    low, high = int(np.searchsorted(sample, found.low)) + 1, int(np.searchsorted(sample, found.high)) + 1
    assert binom.cdf(low - 1, 500, 0.9) <= 0.005 < binom.cdf(low, 500, 0.9)
    assert binom.sf(high - 1, 500, 0.9) <= 0.005 < binom.sf(high - 2, 500, 0.9)


@pytest.mark.parametrize("share", [0.0027, 0.5, 0.9973])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_small_samples_say_so(generator, share, confidence):
    """The fewest units that bound both sides are those with max(share, 1 − share)ⁿ ≤ half of the doubt."""
    needed = int(np.ceil(np.log((1 - confidence) / 2) / np.log(max(share, 1 - share))))
    samples = [generator.standard_normal(units) for units in (needed, needed - 1)]
    enough, wanting = (quantile_interval(sample, share, confidence) for sample in samples)
    assert np.isfinite([enough.low, enough.high]).all()
    assert not np.isfinite([wanting.low, wanting.high]).all()
    attained = [
        attained_by(np.sort(sample), share, own) for sample, own in zip(samples, (enough, wanting), strict=True)
    ]
    assert min(attained) >= confidence


def test_arguments_out_of_range():
    for call in (
        lambda: Limits(),
        lambda: Limits(lower=1.0, upper=1.0),
        lambda: capability(SAMPLE[:1], Limits(upper=1.0)),
        lambda: capability(np.array([1.0, np.nan]), Limits(upper=1.0)),
        lambda: capability(np.ones(4), Limits(upper=1.0)),
        lambda: wilson_interval(0, 0),
        lambda: wilson_interval(10, 11),
        lambda: wilson_interval(10, 5, 1.0),
        lambda: quantile_interval(SAMPLE, 0.0),
        lambda: quantile_interval(SAMPLE[:0], 0.5),
    ):
        with pytest.raises(InputError):
            call()


@pytest.mark.parametrize(("units", "rejected"), [(100, 3), (1000, 1), (40, 20)])
def test_the_ends_of_an_exact_interval_are_where_the_binomial_tails_are(units, rejected):
    found, tail, accepted = proportion(units, rejected), (1 - CONFIDENCE) / 2, units - rejected
    assert binom.cdf(accepted, units, found.high) == pytest.approx(tail)
    assert binom.sf(accepted - 1, units, found.low) == pytest.approx(tail)
    assert binom.sf(accepted - 1, units, found.bound) == pytest.approx(1 - CONFIDENCE)
