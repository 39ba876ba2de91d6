"""How wrong what is uncertain of a model may be: a sum with an uncertain gain, whose cheapest zones are known."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.builders import verifier_of_sum
from tolalloc.allocation.front.price_region import SAME
from tolalloc.allocation.front.uncertain_region import COVERED, SPAN, changed_stack, uncertain_region
from tolalloc.allocation.search.zone_allocation import allocate, scale_in_proportion
from tolalloc.allocation.space.effort import SearchEffort
from tolalloc.allocation.space.problem import Stack
from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.models.function_model import BoundFunction

ZONES = np.array([6.0, 8.0])
LIMIT = 5.0


@dataclass(frozen=True, kw_only=True)
class UncertainSum(BoundFunction):
    """y = a·x₁ + b·x₂, of which ln a and ln b are uncertain."""

    covariance: np.ndarray

    @property
    def uncertain(self):
        return (CorrelatedSource(name="gain (assumed)", columns=("gain.a", "gain.b"), covariance=self.covariance),)

    def changed(self, change):
        gains = np.exp(change)
        return replace(self, source=replace(self.source, function=lambda one, other: gains[0] * one + gains[1] * other))


def found_of(covariance, room: float = 0.0):
    """Return the region of an allocation whose limit is so much wider than what was compared with it [mm]."""
    plain = verifier_of_sum(*ZONES, limit=LIMIT)
    known = {own.name: getattr(plain.model, own.name) for own in fields(BoundFunction)}
    verifier = replace(plain, model=UncertainSum(**known, covariance=np.asarray(covariance, dtype=float)))
    allocation = allocate(verifier, scale_in_proportion(verifier, 3), SearchEffort(steps=3))
    if room:
        chosen = allocation.chosen
        (check,) = chosen.checks
        wider = tuple(replace(own, limit=own.limit + room) for own in check.constraints)
        allocation = replace(allocation, chosen=replace(chosen, checks=(replace(check, constraints=wider),)))
    return uncertain_region(verifier, allocation), allocation


def cheapest(change) -> np.ndarray:
    """Return the cheapest zones over those of no change, by the closed form of two costs 1/z and one norm."""

    def scales(by):
        weights = np.exp(by) * ZONES
        return weights ** (-2 / 3) / np.sqrt((weights ** (2 / 3)).sum())

    return scales(np.asarray(change, dtype=float)) / scales(np.zeros(2))


@pytest.fixture(scope="module")
def region():
    return found_of(np.diag([0.01, 0.0]))


def test_the_ends_of_each_range_are_those_of_the_closed_form(region):
    found, _ = region
    for at, own in enumerate(found.ranges):

        def most(change, at=at):
            return np.abs(np.log(cheapest(change * np.eye(2)[at]))).max() - np.log1p(SAME)

        assert own.same[1] == pytest.approx(brentq(most, 1e-6, SPAN), abs=3e-3)
        assert own.same[0] == pytest.approx(brentq(most, -SPAN, -1e-6), abs=3e-3)
        assert own.first == (f"x{at + 1}", f"x{at + 1}")
        assert own.tried == (-SPAN, SPAN)


def test_zones_at_the_ends_are_those_of_the_closed_form(region):
    ends = [sign * SPAN * step for step in np.eye(2) for sign in (-1, 1)]
    np.testing.assert_allclose(region[0].ratios, [cheapest(change) for change in ends], rtol=2e-3)


def test_zones_on_their_limit_keep_it_only_where_the_gain_falls(region):
    for own in region[0].ranges:
        assert own.kept[0] == -SPAN
        assert own.kept[1] == pytest.approx(0.0, abs=2e-3)


def test_room_below_a_limit_is_used_up_by_the_gain_that_the_closed_form_says():
    """√((6·a·s₁)² + (8·s₂)²)/2 = 5.5 at the gain a = eᵟ."""
    found, allocation = found_of(np.zeros((2, 2)), room=0.5)
    spread = (ZONES * allocation.chosen.scales / 2) ** 2
    gain = np.sqrt(((LIMIT + 0.5) ** 2 - spread[1]) / spread[0])
    assert found.ranges[0].kept[1] == pytest.approx(np.log(gain), rel=0.02)
    assert found.least_favourable is None  # nothing is uncertain by any amount


def test_the_least_favourable_change_is_that_of_the_covariance(region):
    """σ = 0.1 of the first gain alone: twice that makes its zone dearer."""
    found, allocation = region
    worst = found.least_favourable
    np.testing.assert_allclose(worst.scales / allocation.inside.zones, cheapest([COVERED * 0.1, 0.0]), rtol=2e-3)
    assert not worst.kept
    assert np.isnan(worst.regret)
    assert worst.cost > allocation.chosen.cost
    # Fully correlated in opposite directions the two changes nearly cancel, in the same direction they do not.
    alike, opposite = (found_of(0.01 * np.array([[1.0, sign], [sign, 1.0]]))[0].least_favourable for sign in (1, -1))
    assert alike.cost > worst.cost > opposite.cost


def test_a_change_under_which_units_have_no_answer_is_one_beyond_which_nothing_is_known():
    @dataclass(frozen=True, kw_only=True)
    class Breaking(UncertainSum):
        def changed(self, change):
            broken = replace(self.source, function=lambda one, other: np.nan * one + other)
            return replace(self, source=broken) if change[0] > 0.1 else super().changed(change)

    plain = verifier_of_sum(*ZONES, limit=LIMIT)
    known = {own.name: getattr(plain.model, own.name) for own in fields(BoundFunction)}
    verifier = replace(plain, model=Breaking(**known, covariance=np.diag([0.01, 0.0])))
    allocation = allocate(verifier, scale_in_proportion(verifier, 3), SearchEffort(steps=2))
    found = uncertain_region(verifier, allocation)
    first, second = found.ranges
    assert first.tried == (-SPAN, 0.0)
    assert first.kept[1] == first.same[1] == 0.0
    assert first.first[1] == ""
    assert second.same[1] > 0.1
    assert np.isnan(found.ratios[1]).all()


def test_a_stack_moves_by_what_two_models_of_the_same_units_tell():
    stack = Stack(name="gap", worst_case=np.zeros(2), root_sum_square=np.array([3.0, 4.0]), budget=6.0)
    before = replace(stack, root_sum_square=np.array([2.0, 5.0]))
    after = replace(stack, root_sum_square=np.array([4.0, 1.0]))
    found = changed_stack(stack, before, after, np.ones(2), np.empty(0), 0.3)
    np.testing.assert_allclose(found.root_sum_square**2, [21.0, 0.0])
    assert float(found.load(np.ones(2), np.empty(0))) - found.budget == pytest.approx(5.0 - 6.0 + 0.3)
