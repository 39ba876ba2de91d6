"""Functions that are linear in the deviations: recognised as such, and their exact law against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import beta, norm

from tests.builders import source, units_at_random
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import LinearFunction, LinearLaw
from tolalloc.capability.near_limit import SolvedUnits
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.zones import Feature
from tolalloc.sensitivity.sobol import SourceIndices

UNIFORM, TRIANGULAR = {"distribution": Distribution.UNIFORM}, {"distribution": Distribution.TRIANGULAR}
SHIFTED = {"shift": 0.3, "cp": 1.3}
WEIBULL = {"distribution": Distribution.WEIBULL, "shape": 2.0}
BETA = {"distribution": Distribution.BETA, "shape": (2.0, 5.0)}
TRAPEZOID = {"distribution": Distribution.TRAPEZOID, "shape": 0.4, "cp": 1.2}
MIXES = {
    "normal": [{}, {}, {}],
    "uniform": [UNIFORM, UNIFORM],
    "with a shift": [SHIFTED, {}, TRIANGULAR],
    "sorted and one-sided": [{"sorted": True}, {}, WEIBULL],
    "position": [{"feature": Feature.POSITION}, {}, UNIFORM],
    "skewed and bounded": [BETA, TRAPEZOID, {}],
    "radial": [{"distribution": Distribution.RAYLEIGH}, TRAPEZOID, {}],
}


def errors_of(kinds: list[dict]) -> ErrorModel:
    return ErrorModel(tuple(source(f"s{at}", zone=(1 + at) * 1e-4, **kind) for at, kind in enumerate(kinds)))


def law_of(errors: ErrorModel, slopes: np.ndarray, zones: np.ndarray | None = None) -> LinearLaw:
    function = LinearFunction(offset=3.0, slopes=slopes, rounding=1e-9)
    law = LinearLaw.of(function, errors, errors.zones if zones is None else zones)
    assert law is not None
    return law


def test_a_normal_sum_has_the_normal_share_beyond_its_limits():
    law = law_of(errors_of([{}, {}]), np.array([1000.0, -2000.0]))
    deviation = np.hypot(0.1, 0.4) / 6
    share = norm.sf(0.2 / deviation) + norm.cdf(-0.15 / deviation)
    assert law.beyond(Limits(lower=2.85, upper=3.2), 0.0) == pytest.approx(share, rel=1e-12)
    assert law.excess(Limits(upper=3.2), norm.sf(3.0)) == pytest.approx(3 * deviation - 0.2, abs=1e-10)


def test_two_uniform_sizes_add_up_to_a_trapezoid():
    """P(Y > y) = (reach − y)²/(2·a·b) in the outer slope of half widths a/2 and b/2."""
    law = law_of(errors_of([UNIFORM, UNIFORM]), np.array([1000.0, 1000.0]))
    for y in (0.06, 0.1, 0.13, 0.149):
        assert law.beyond(Limits(upper=3.0 + y), 0.0) == pytest.approx((0.15 - y) ** 2 / (2 * 0.1 * 0.2), abs=1e-7)
    y = law.excess(Limits(upper=3.0), 0.0027)
    assert y == pytest.approx(0.15 - np.sqrt(2 * 0.1 * 0.2 * 0.0027), abs=1e-6 * law.half_width)


def test_correlated_normal_sizes_add_as_their_covariance_says():
    sources = (source("s0", zone=1e-4), source("s1", zone=2e-4))
    errors = ErrorModel(sources, correlation=Correlation(pairs=(Pair(one="s0", other="s1", correlation=0.6),)))
    law = law_of(errors, np.array([1000.0, 1000.0]))
    deviation = np.sqrt(0.1**2 + 0.2**2 + 2 * 0.6 * 0.1 * 0.2) / 6
    assert law.excess(Limits(upper=3.0), norm.sf(3.0)) == pytest.approx(3 * deviation, rel=1e-9)


@pytest.mark.parametrize("mix", MIXES)
def test_the_share_beyond_is_that_of_random_units(mix):
    """400,000 units: within four standard errors."""
    errors = errors_of(MIXES[mix])
    x = units_at_random(errors, 400_000)
    slopes = 1e3 * np.arange(1, 1 + x.shape[1]) * (-1.0) ** np.arange(x.shape[1])
    y = 3.0 + x @ slopes
    limits = Limits(lower=float(np.quantile(y, 0.002)), upper=float(np.quantile(y, 0.997)))
    share = law_of(errors, slopes).beyond(limits, 0.0)
    assert np.mean(~limits.kept_by(y)) == pytest.approx(share, abs=4 * np.sqrt(share / y.size))


@pytest.mark.parametrize("mix", MIXES)
def test_what_columns_add_to_the_variance_is_what_random_units_scatter(mix):
    """400,000 units: within four standard errors of each variance."""
    errors = errors_of(MIXES[mix])
    x = units_at_random(errors, 400_000)
    slopes = 1e3 * np.arange(1, 1 + x.shape[1]) * (-1.0) ** np.arange(x.shape[1])
    off = (x * slopes - (x * slopes).mean(axis=0)) ** 2
    error = off.std(axis=0) / np.sqrt(len(x))
    assert (np.abs(law_of(errors, slopes).variances - off.mean(axis=0)) < 4 * error).all()


def test_indices_of_a_linear_output_are_the_parts_of_its_variance():
    """Two correlated sizes count as one: 0.1² + 0.2² + 2·0.6·0.1·0.2 = 0.074 beside 0.3² = 0.09, a third part 0.16²."""
    zones = (1e-4, 2e-4, 3e-4, 1.6e-4)
    sources = tuple(source(f"s{at}", zone=zone) for at, zone in enumerate(zones))
    errors = ErrorModel(sources, correlation=Correlation(pairs=(Pair(one="s0", other="s1", correlation=0.6),)))
    found = SourceIndices.of_linear(law_of(errors, np.full(4, 1000.0)), errors.dimension_of_column)
    parts = np.array([0.074, 0.09, 0.0256])
    assert found.sources == ("s0 + s1", "s2", "s3")
    np.testing.assert_allclose(found.total, parts / parts.sum(), rtol=1e-12)
    np.testing.assert_allclose(found.total_interval, np.tile(found.total, (2, 1)), rtol=1e-12)
    assert [pair.probability for pair in found.neighbours] == [1.0, 1.0]


@pytest.mark.parametrize("mix", MIXES)
def test_derivatives_by_the_zones_are_those_of_differences(mix):
    errors = errors_of(MIXES[mix])
    slopes = 1e3 * np.arange(1, 1 + len(errors.columns)) * (-1.0) ** np.arange(len(errors.columns))
    limits = Limits(lower=2.7, upper=3.25)
    law = law_of(errors, slopes)
    excess = law.excess(limits, 0.0027)
    found = law.excess_by_zone(limits, excess)
    for at, step in enumerate(1e-3 * errors.zones):
        ends = [law_of(errors, slopes, errors.zones + side * step * np.eye(len(found))[at]) for side in (1, -1)]
        slope = np.subtract(*(own.excess(limits, 0.0027) for own in ends)) / (2 * step)
        assert found[at] == pytest.approx(slope, rel=0.01, abs=2e-3 * np.abs(found).max())


def test_a_plane_is_found_through_linear_samples_alone():
    errors = errors_of([{}, UNIFORM, {}])
    x, slopes = units_at_random(errors, 5000), np.array([1000.0, 0.0, -500.0])
    linear = 7.0 + x @ slopes
    found = LinearFunction.through(x, linear)
    assert found is not None
    assert found.slopes == pytest.approx(slopes, abs=1e-6)
    assert found.offset == pytest.approx(7.0, abs=1e-12)
    bent = {
        "squared": linear + (1e3 * x[:, 0]) ** 2,
        "slightly bent": linear + 1e-4 * (1e3 * x[:, 0]) ** 2,
        "kink in one of a thousand units": np.minimum(linear, np.quantile(linear, 0.999)),
        "product": linear + 1e6 * x[:, 0] * x[:, 1],
        "noisy": linear + np.random.default_rng(2).normal(size=5000) * 1e-5,
        "without an answer once": np.where(np.arange(5000) == 4321, np.nan, linear),
    }
    assert [name for name, values in bent.items() if LinearFunction.through(x, values)] == []


def test_few_samples_show_no_plane():
    errors = errors_of([{}, {}])
    x = units_at_random(errors, 60)
    assert LinearFunction.through(x, x @ np.ones(2)) is None


def test_a_law_is_not_claimed_of_what_cannot_be_folded():
    errors = errors_of([{}, {"feature": Feature.POSITION, **UNIFORM}])
    function = LinearFunction(offset=0.0, slopes=np.ones(3), rounding=1e-9)
    assert LinearLaw.of(function, errors, errors.zones) is None
    still = LinearFunction(offset=0.0, slopes=np.zeros(2), rounding=1e-9)
    assert LinearLaw.of(still, errors_of([{}, {}]), np.array([1e-4, 2e-4])) is None


def test_symmetric_log_concave_deviations_alone_make_a_convex_set():
    slopes = np.ones(2)
    assert law_of(errors_of([UNIFORM, {"sorted": True}]), slopes).is_convex
    assert not law_of(errors_of([{}, WEIBULL]), slopes).is_convex
    assert law_of(errors_of([TRAPEZOID, {**BETA, "shape": (3.0, 3.0)}]), slopes).is_convex
    assert not law_of(errors_of([{}, BETA]), slopes).is_convex
    assert not law_of(errors_of([{}, {"distribution": Distribution.RAYLEIGH}]), slopes).is_convex


def test_units_that_leave_the_law_count_as_rejected():
    """Clopper and Pearson's bound of their share: none of n leaves a bound of 1 − error^(1/n)."""
    law = law_of(errors_of([{}, {}]), np.ones(2))
    values = np.zeros(2000)
    common = {"values": values, "units": SolvedUnits.all_of(2000), "limits": Limits(upper=1.0), "law": law}
    assert LimitedSample(**common).most_leaving(0.95) == pytest.approx(1 - 0.05 ** (1 / 2000), rel=1e-9)
    assert LimitedSample(**common, leaving=7).most_leaving(0.95) == pytest.approx(beta.ppf(0.95, 8, 1993))
    assert LimitedSample(**common, leaving=7).most_leaving(0.5) == 7 / 2000
