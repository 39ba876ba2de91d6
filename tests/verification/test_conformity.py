"""Guard bands, risks of measuring and samples against closed forms."""

from math import atan, pi, sqrt

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

import tolalloc as ta
from tolalloc.capability.conformity import capability_bound, guard_band, parts_to_show, risks
from tolalloc.capability.indices import Limits
from tolalloc.exceptions import InputError


@pytest.mark.parametrize(("conformance", "factor"), [(0.95, 1.6449 / 2), (0.5, 0.0), (0.97725, 1.0)])
def test_guard_band_is_a_quantile_of_the_error(conformance, factor):
    assert guard_band(3.0, conformance) == pytest.approx(3.0 * factor, abs=1e-3)


@pytest.mark.parametrize("error", [0.1, 0.5, 1.0, 3.0])
def test_risks_of_a_limit_at_the_mean_are_an_angle(error):
    """P(x > 0, x + e ≤ 0) = atan(u/σ)/2π, Sheppard (1899)."""
    found = risks(0.0, 1.0, Limits(upper=0.0), 2 * error)
    assert found.consumer == pytest.approx(atan(error) / (2 * pi), rel=1e-6)
    assert found.producer == pytest.approx(found.consumer, rel=1e-6)


@pytest.mark.parametrize("guard", [-0.3, 0.0, 0.4])
@pytest.mark.parametrize(("lower", "upper"), [(-2.0, 2.0), (None, 1.5), (-1.0, None)])
def test_risks_are_those_of_the_bivariate_normal_distribution(lower, upper, guard):
    mean, deviation, error = 0.2, 1.1, 0.3
    found = risks(mean, deviation, Limits(lower=lower, upper=upper), 2 * error, guard)
    both = multivariate_normal(
        [mean, mean], [[deviation**2, deviation**2], [deviation**2, deviation**2 + error**2]], abseps=1e-10
    )
    low, high = (-40.0 if lower is None else lower), (40.0 if upper is None else upper)
    inside = (low + guard if lower is not None else low, high - guard if upper is not None else high)

    def rectangle(true, shown):
        return (
            both.cdf([true[1], shown[1]])
            - both.cdf([true[0], shown[1]])
            - both.cdf([true[1], shown[0]])
            + both.cdf([true[0], shown[0]])
        )

    good, accepted = rectangle((low, high), inside), rectangle((-40.0, 40.0), inside)
    kept = norm.cdf(high, mean, deviation) - norm.cdf(low, mean, deviation)
    assert found.accepted == pytest.approx(accepted, abs=1e-7)
    assert found.consumer == pytest.approx(accepted - good, abs=1e-7)
    assert found.producer == pytest.approx(kept - good, abs=1e-7)


def test_exact_gauge_decides_rightly():
    found = risks(0.0, 1.0, Limits(lower=-2.0, upper=2.0), 0.0)
    assert found.consumer == 0.0
    assert found.producer == pytest.approx(0.0, abs=1e-9)


def test_bound_of_a_capability_is_kept_by_as_many_samples_as_it_says():
    generator, parts, true = np.random.default_rng(5), 50, 1.33
    values = generator.normal(0.0, 1.0, (20_000, parts))
    mean, deviation = values.mean(axis=1), values.std(axis=1, ddof=1)
    shown = (3 * true - np.abs(mean)) / (3 * deviation)
    below = np.mean([capability_bound(own, parts) <= true for own in shown])
    assert below >= 0.95 - 3 * sqrt(0.05 * 0.95 / 20_000)


def test_parts_are_the_fewest_that_show_a_capability():
    for demanded, shown in ((1.0, 4 / 3), (1.33, 1.6), (0.67, 0.9)):
        parts = parts_to_show(demanded, shown)
        assert capability_bound(shown, parts) >= demanded > capability_bound(shown, parts - 1)
    assert parts_to_show(1.0, 1.001) == 10_000
    assert parts_to_show(1.0, 9.0) == 5


def test_what_shows_nothing_is_refused():
    with pytest.raises(InputError, match=r"more than the 1\.33"):
        parts_to_show(1.33, 1.2)
    with pytest.raises(InputError, match=r"conformance is 1.*0\.5 to below 1"):
        guard_band(1.0, 1.0)


def test_guard_band_that_leaves_no_room_accepts_nothing():
    found = risks(0.0, 1.0, Limits(lower=-2.0, upper=2.0), 4.0, guard=2.5)
    assert (found.consumer, found.accepted) == (0.0, 0.0)
    assert found.producer == pytest.approx(norm.cdf(2.0) - norm.cdf(-2.0))


def best_guard_by_hand(error, rejected, escaped, room=1.5):
    """A reading is accepted while the part is bad with no more than rejected/escaped; the true values are N(0, 1)."""
    known = 1 / (1 + error**2)
    worst_reading = (room - norm.isf(rejected / escaped) * error * sqrt(known)) / known
    return room - worst_reading


@pytest.mark.parametrize(("error", "rejected", "escaped"), [(0.1, 1.0, 20.0), (0.3, 1.0, 5.0), (0.3, 1.0, 1.5)])
def test_cheapest_guard_band_is_that_by_hand(error, rejected, escaped):
    gauge = ta.Gauge(name="caliper", uncertainty=2 * error, price=0.1)
    (found,) = ta.costs_of_gauges([gauge], 0.0, 1.0, upper=1.5, rejected=rejected, escaped=escaped)
    assert found.guard == pytest.approx(best_guard_by_hand(error, rejected, escaped), abs=1e-4)


def test_cheapest_gauge_is_where_another_reading_costs_what_it_saves():
    """Gauges whose price grows as uncertainty falls: the cheapest of 60 is the one of the closed form's minimum."""
    gauges = [ta.Gauge(name=f"{u:.3f}", uncertainty=2 * u, price=0.01 / u) for u in np.geomspace(0.02, 0.9, 60)]
    found = ta.costs_of_gauges(gauges, 0.0, 1.0, upper=1.5, rejected=1.0, escaped=20.0)

    def by_hand(gauge):
        error = gauge.uncertainty / 2
        edge = 1.5 - best_guard_by_hand(error, 1.0, 20.0)
        accepted = norm.cdf(edge / sqrt(1 + error**2))
        shown = [[1.0, 1.0], [1.0, 1 + error**2]]
        good = multivariate_normal([0.0, 0.0], shown, abseps=1e-10).cdf([1.5, edge])
        return gauge.price + (1 - accepted) + 20.0 * (accepted - good)

    assert found[0].gauge == min(gauges, key=by_hand)
    assert [own.cost for own in found] == pytest.approx(sorted(map(by_hand, gauges)), rel=1e-5)
    assert gauges[0] != found[0].gauge != gauges[-1]


def test_gauges_cost_the_same_in_every_unit():
    def costs(unit):
        gauges = [ta.Gauge(name="one", uncertainty=4.0 * unit, price=0.1)]
        (own,) = ta.costs_of_gauges(gauges, 0.0, 6.0 * unit, lower=-12 * unit, upper=12 * unit, rejected=5, escaped=99)
        return own.cost, own.guard / unit

    assert costs(1e-6) == pytest.approx(costs(1.0), rel=1e-6)


def test_gauges_that_cannot_be_priced_are_refused():
    with pytest.raises(InputError, match="uncertainty is -1"):
        ta.Gauge(name="caliper", uncertainty=-1.0, price=0.0)
    with pytest.raises(InputError, match="gauges is 'none'; allowed is one or more"):
        ta.costs_of_gauges([], 0.0, 1.0, upper=1.0, rejected=1.0, escaped=2.0)
    gauge = ta.Gauge(name="exact", uncertainty=0.0, price=0.5)
    with pytest.raises(InputError, match="escaped is 0"):
        ta.costs_of_gauges([gauge], 0.0, 1.0, upper=1.0, rejected=1.0, escaped=0.0)
    (found,) = ta.costs_of_gauges([gauge], 0.0, 1.0, upper=1.0, rejected=2.0, escaped=9.0)
    assert found.cost == pytest.approx(0.5 + 2.0 * norm.sf(1.0))
