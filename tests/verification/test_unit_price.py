"""Quality loss, the price of a good unit, and the yield that makes it cheapest."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest
from scipy.stats import norm

from tolalloc.allocation.cost.unit_price import QualityLoss, UnitPrice, best_yield
from tolalloc.exceptions import InputError


def test_the_mean_loss_is_that_of_sampled_units(generator):
    loss, values = QualityLoss(limit=60.0, at_limit=12.0), generator.normal(40.0, 5.0, 40000)
    for best, expected in ((0.0, loss.smaller_is_better(40.0, 5.0)), (38.0, loss.nominal_is_best(2.0, 5.0))):
        sampled = 12.0 * ((values - best) / 60.0) ** 2
        assert abs(sampled.mean() - expected) < 4 * sampled.std() / np.sqrt(sampled.size)  # 4 standard errors
    assert loss.nominal_is_best(60.0, 0.0) == pytest.approx(12.0)


def test_the_price_is_what_all_units_cost_over_the_good_ones():
    price = UnitPrice(inspection=2.0, rework_share=0.25, rework=8.0, scrap=4.0)
    made, good, reworked, scrapped = 1000, 900, 25, 75
    spent = made * (50.0 + 2.0) + reworked * 8.0 + scrapped * 4.0
    assert price.of_good_unit(50.0, good / made) == pytest.approx(spent / (good + reworked))
    assert UnitPrice().of_good_unit(50.0, 1.0) == 50.0
    assert UnitPrice().of_good_unit(50.0, 0.8) == pytest.approx(62.5)


def test_the_best_yield_is_the_one_with_the_cheapest_good_unit():
    """Cost 1/zone with zones that σ allows: at yield p the limit is z(p) standard deviations away."""

    def cost(target):
        return 10.0 * float(norm.ppf((1 + target) / 2))

    yields = (0.8, 0.9, 0.95, 0.99, 0.9973, 0.9999)
    dear, cheap = UnitPrice(scrap=500.0), UnitPrice(rework_share=1.0, rework=1.0)
    assert best_yield(cost, cheap, yields).best == 0.8
    ladder = best_yield(cost, dear, yields)
    assert ladder.best == min(yields, key=lambda target: dear.of_good_unit(cost(target), target))
    assert ladder.best > 0.9
    np.testing.assert_array_equal(ladder.targets, yields)
    np.testing.assert_array_equal(ladder.manufacturing, [cost(target) for target in yields])


def test_yields_that_no_design_reaches_have_no_price_and_are_never_chosen():
    ladder = best_yield(lambda target: 10.0 if target < 0.95 else nan, UnitPrice(scrap=100.0), (0.8, 0.9, 0.99))
    assert (ladder.best, ladder.priced.tolist()) == (0.9, [0.8, 0.9])
    assert np.isnan(ladder.prices[-1])
    nothing = best_yield(lambda target: nan, UnitPrice(), (0.8, 0.9973))
    assert nothing.priced.size == 0
    assert np.isnan(nothing.best)


def test_prices_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match=r"price of a unit: rework_share is 1.2; allowed is a number from 0 to 1"):
        UnitPrice(rework_share=1.2)
    with pytest.raises(InputError, match=r"scrap is -1.0; allowed is a finite number, 0 or above"):
        UnitPrice(scrap=-1.0)
    with pytest.raises(InputError, match=r"quality loss: limit is 0.0; allowed is a finite number above 0"):
        QualityLoss(limit=0.0, at_limit=1.0)
    with pytest.raises(InputError, match=r"quality loss: at_limit is nan; allowed is a finite number, 0 or above"):
        QualityLoss(limit=1.0, at_limit=nan)
    for target in (1.1, 0.0):
        with pytest.raises(InputError, match=rf"yield is {target}; allowed is a share from 0 to 1 that leaves good"):
            UnitPrice().of_good_unit(50.0, target)
    with pytest.raises(InputError, match=r"yields is \[\]; allowed is one target or more"):
        best_yield(lambda target: 1.0, UnitPrice(), ())
    with pytest.raises(InputError, match=r"yield is 1.5"):
        best_yield(lambda target: pytest.fail("nothing long may run before"), UnitPrice(), (0.9, 1.5))
