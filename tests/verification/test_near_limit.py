"""What few solved units say of many drawn ones: the stated error holds whatever calls them near or far."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multinomial

from tests.verification.test_acceptance import GAP, SHOWN, TARGET, acceptance_test_of, at, designed, prepared
from tolalloc.allocation.verify import independent_sample
from tolalloc.allocation.verify.acceptance import FIRST
from tolalloc.allocation.verify.independent_sample import Screen
from tolalloc.capability.monte_carlo import allowed_rejections, proportion
from tolalloc.capability.near_limit import Drawn, SolvedUnits

import tolalloc as ta  # isort: skip


def exactly(drawn: Drawn, near: float, far: float, allowed: float) -> float:
    """Return the probability that no more than the allowed weight lies beyond a limit, unit by unit."""
    first, others = drawn.whatever, drawn.units - drawn.whatever
    found = 0.0
    for of_far in range(first + 1):
        left = allowed - drawn.weight * of_far
        for of_near in range(first - of_far + 1):
            if of_near > left:
                break
            probability = multinomial.pmf(
                [of_near, of_far, first - of_near - of_far], first, [near, far, 1 - near - far]
            )
            more = np.arange(0, int(np.floor(left - of_near)) + 1)
            found += probability * multinomial.pmf(np.stack([more, others - more], 1), others, [near, 1 - near]).sum()
    return found


def test_however_the_share_is_parted_no_more_than_the_error_is_wrongly_shown():
    """Exact probabilities, unit by unit, near and far ones of one sample."""
    drawn, share, confidence = Drawn(units=300, whatever=60), 0.1, 0.9
    allowed = drawn.allowed(1 - share, confidence)
    wrongly = [exactly(drawn, (1 - part) * share, part * share, allowed) for part in (0.0, 0.02, 0.1, 0.3, 0.6, 1.0)]
    assert 0.8 * (1 - confidence) < max(wrongly) <= 1 - confidence
    assert drawn.probability_of_no_more(allowed + 1, share) > 1 - confidence


def test_where_all_units_are_solved_it_is_the_bound_of_clopper_and_pearson():
    drawn = Drawn(units=1152, whatever=1152)
    assert drawn.allowed(0.99, 0.95) == allowed_rejections(1152, 0.99, 0.95)
    assert drawn.interval(7.0, 7, 0) == proportion(1152, 7)


def test_an_interval_holds_the_share_and_its_bound_agrees_with_what_is_allowed():
    drawn, target = Drawn(units=20_000, whatever=2_000), 0.99
    allowed = int(drawn.allowed(target, 0.95))
    shown, not_shown = (drawn.interval(float(weight), weight, 0) for weight in (allowed, allowed + 1))
    assert not_shown.bound < target <= shown.bound
    assert shown.low < shown.bound < shown.estimate < shown.high
    assert drawn.interval(allowed + drawn.weight, allowed, 1).bound < shown.bound


def test_what_is_left_out_is_what_lies_furthest_beyond_the_limit(generator):
    """Of equal units: the order statistic that so many rejections allow."""
    excess = generator.standard_normal(1000)
    allowed = allowed_rejections(1000, 0.95, 0.9)
    units = SolvedUnits.all_of(1000)
    assert units.kept_excess(excess, 0.95, 0.9) == np.sort(excess)[-1 - allowed]
    assert SolvedUnits.all_of(20).kept_excess(excess[:20], 0.9973, 0.95) == np.inf


def screen_of(design):
    requirements = tuple(check.requirement for check in design.checks)
    return Screen.through(requirements, design.outputs, design.sample.redraw)


def test_a_screen_calls_those_near_that_lie_beyond_the_limit():
    study = prepared({GAP: ta.Limit(upper=at(0.99), show=ta.AtYield(0.99))})
    design = designed(study)
    screen = screen_of(design)
    assert screen is not None
    x = np.random.default_rng(2).standard_normal((4000, 2)) * design.sample.redraw().std(axis=0)
    beyond = study.model.reading((GAP,))(x).values[:, 0] > at(0.99)
    assert screen(x)[beyond].mean() > 0.9
    assert screen(x).mean() < 3 * beyond.mean()


@pytest.mark.slow
@pytest.mark.parametrize("call", ["nothing near", "a random tenth near"])
def test_a_screen_that_knows_nothing_fools_nobody(call, monkeypatch):
    """Of 400 designs just at the limit, each judged once; three standard errors of room."""
    study = prepared({GAP: ta.Limit(upper=at(TARGET), show=SHOWN)})
    design, share = designed(study), 0.001 if call == "nothing near" else 0.1
    blind = replace(screen_of(design), share=share)
    called = (lambda x: np.zeros(len(x), bool)) if call == "nothing near" else (lambda x: (x[:, 1] * 1e7) % 1 < share)
    monkeypatch.setattr(independent_sample.Screen, "through", lambda *_: blind)
    monkeypatch.setattr(independent_sample.Screen, "__call__", lambda _, x: called(x))
    confirmed = sum(acceptance_test_of(study, seed).run(design, FIRST).accepted for seed in range(400))
    error = FIRST.error(0.05)
    assert confirmed <= 400 * error + 3 * np.sqrt(400 * error * (1 - error))
