"""The one stated error of an answer: how often designs just at their limits are confirmed, and better ones are."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from scipy.stats import binom, norm

import tolalloc as ta
from tolalloc.allocation.search.candidates import _still_kept
from tolalloc.allocation.space.effort import AllocationEffort
from tolalloc.allocation.space.output_sample import ControlPlane, ControlResiduals, LimitedSample
from tolalloc.allocation.verify.acceptance import (
    ATTEMPTS,
    FIRST,
    AcceptanceTest,
    AlphaSpending,
    accept_cheapest,
    confidence_of_fewer,
)
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import NearPlane
from tolalloc.capability.monte_carlo import allowed_rejections
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

ANSWERS, ERROR, TARGET, UNITS = 400, 0.05, 0.95, 512
MEAN, DEVIATION = 37.7, 8.0
"""Of an output that has its 99.73 % quantile near 60, as the peak-to-peak of the shipped study [µm]."""
GAP, PLAY = "gap [µm]", "play [µm]"


def independent(first, second):
    """Two outputs of single numbers, which no array is, bent by less than a millionth so that no exact law is known."""
    return tuple(MEAN + 1e3 * math.fsum((own, 1e-4 * own * own)) for own in (first, second))


def prepared(limits: dict[str, ta.Limit], joint: ta.AtYield | None = None, deviation: float = DEVIATION) -> Prepared:
    """Return a study of two independent normal outputs."""
    sizes = {"plus": 3e-3 * deviation, "minus": -3e-3 * deviation, "unit": "mm"}
    row = {**sizes, "min": 1e-3, "max": 1.0, "cost": 1, "distribution": "normal", "Cp": 1.0}
    return Prepared(
        study=ta.Study(
            ta.model(independent, inputs=("first", "second"), outputs=(GAP, PLAY)),
            ta.Drawing.of_rows([{"id": name, "nominal": 0.0, **row} for name in ("first", "second")]),
            limits=limits,
            joint=joint,
            questions=[ta.Allocation()],
        )
    )


def designed(study: Prepared) -> VerifiedDesign:
    """Return the design of the table, with the models of a small search."""
    requirements, space = study.requirements_with_joint, study.space
    own = Verifier(space=space, model=study.model, requirements=requirements, seeds=SeedTree(1), units=1200)
    return own.verify(space.uniform(1.0), "table")


def acceptance_test_of(study: Prepared, seed: int, units: int = UNITS) -> AcceptanceTest:
    return AcceptanceTest(model=study.model, seeds=SeedTree(seed), units=units, error=ERROR)


def at(share: float) -> float:
    """Return the value that a share of the units lies below [µm]."""
    return float(MEAN + DEVIATION * norm.ppf(share))


SHOWN = ta.AtYield(TARGET)
EACH = np.sqrt(TARGET)
GAIN = 0.005
ON_THE_LIMIT = {
    "one limit": ({GAP: ta.Limit(upper=at(TARGET), show=SHOWN)}, None),
    "jointly, one with both sides": (
        {GAP: ta.Limit(upper=at((1 + EACH) / 2), lower=at((1 - EACH) / 2)), PLAY: ta.Limit(upper=at(EACH))},
        SHOWN,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("limits", ON_THE_LIMIT)
def test_of_designs_just_at_their_limit_no_more_than_the_stated_error_are_drawn(limits):
    """Each of 400 answers judges as many such designs as it may; their number has three standard errors of room."""
    study = prepared(*ON_THE_LIMIT[limits])
    design, costs = designed(study), count(10)

    def another(kind, judged, attempt, worth):
        return kind, replace(design, cost=float(next(costs)))

    answers = [
        accept_cheapest(
            acceptance_test_of(study, seed), {"table": design, "other": replace(design, cost=5.0)}, another, GAIN
        )
        for seed in range(ANSWERS)
    ]
    drawn = sum(found.drawn is not None for found in answers)
    assert max(len(found.tested) for found in answers) == ATTEMPTS
    assert drawn <= ERROR * ANSWERS + 3 * np.sqrt(ERROR * (1 - ERROR) * ANSWERS)
    assert drawn > 0


@pytest.mark.slow
def test_a_confirmed_design_gives_its_error_back_and_no_more_answers_are_wrong():
    """Of 400 answers, each with a design well inside and then as many just at the limit as it may judge."""
    study = prepared(*ON_THE_LIMIT["one limit"])
    at_limit = designed(study)
    inside = replace(at_limit, design=0.5 * at_limit.design, cost=100.0)

    def another(kind, judged, attempt, worth):
        return kind, replace(at_limit, cost=10.0 - attempt.number)

    answers = [
        accept_cheapest(acceptance_test_of(study, seed), {"inside": inside}, another, GAIN) for seed in range(ANSWERS)
    ]
    assert all(found.tested[0][1].accepted for found in answers)
    second = {found.tested[1][1].confidence for found in answers if found.tested[1][1].accepted}
    assert second == {1 - FIRST.error(ERROR)}
    wrong = sum(found.drawn[1].cost < inside.cost for found in answers)
    assert 0 < wrong <= ERROR * ANSWERS + 3 * np.sqrt(ERROR * (1 - ERROR) * ANSWERS)


def test_the_errors_of_designs_that_are_not_confirmed_add_up_to_less_than_the_one_stated():
    attempt, spent = FIRST, []
    for confirmed in (False, True, True, False, False, False):
        spent.append(0.0 if confirmed else attempt.error(ERROR))
        attempt = attempt.after(accepted=confirmed)
    assert 0.99 * ERROR < sum(spent) < ERROR
    assert (attempt.number, attempt.missed) == (7, 4)


def test_a_design_well_inside_is_confirmed_and_one_far_beyond_given_up_early():
    inside = prepared({GAP: ta.Limit(upper=at(1 - 1e-5), show=SHOWN)})
    beyond = prepared({GAP: ta.Limit(upper=at(0.85), show=SHOWN)})
    found, lost = (acceptance_test_of(study, 1).run(designed(study), FIRST) for study in (inside, beyond))
    assert (found.accepted, lost.accepted) == (True, False)
    # Few units are near the wide limit, so as many are drawn as may be; a quarter of all finds the other one hopeless.
    assert found.achieved.units == 8 * UNITS
    assert (len(found.sample.redraw()), len(lost.sample.redraw())) == (308, 77)
    assert found.confidence == 1 - FIRST.error(ERROR)
    assert lost.confidence == confidence_of_fewer(found.confidence, 77, 308)
    assert lost.confidence == pytest.approx(norm.cdf(norm.ppf(found.confidence) / 2))
    for side in (*found.constraints, *lost.constraints):
        assert side.predicted(found.design) == pytest.approx(side.excess)


@pytest.mark.slow
def test_with_the_full_effort_designs_two_percent_inside_are_confirmed_in_most_cases():
    """The share of 99.73 % lies at 60·0.98; 50 designs."""
    effort, target = AllocationEffort(), 0.9973
    limit = at(target) / 0.98
    study = prepared({GAP: ta.Limit(upper=limit, show=ta.AtYield(target))})
    design = designed(study)
    confirmed = [
        acceptance_test_of(study, seed, effort.confirmation_units).run(design, FIRST).accepted for seed in range(50)
    ]
    assert np.mean(confirmed) > 0.8


def test_after_a_confirmed_design_cheaper_ones_are_tried_and_a_miss_costs_nothing():
    study = prepared({GAP: ta.Limit(upper=at(1 - 1e-5), show=SHOWN)})
    design = designed(study)
    beyond = replace(design, design=3.0 * design.design, cost=0.5 * design.cost)
    between = replace(design, design=1.01 * design.design, cost=0.9 * design.cost)
    asked = []

    def cheaper(kind, judged, attempt, worth):
        asked.append((judged[-1].accepted, worth / design.cost))
        following = {2: beyond, 3: between}.get(attempt.number)
        return (kind, following) if following else None

    found = accept_cheapest(
        acceptance_test_of(study, 1), {"table": design, "dearer": replace(design, cost=9.0)}, cheaper, GAIN
    )
    assert [(kind, own.accepted) for kind, own in found.tested] == [("table", True), ("table", False), ("table", True)]
    assert found.drawn == found.tested[2]
    assert found.last("table") is found.tested[2][1]
    assert asked == [(True, 1 - GAIN), (False, 1 - GAIN), (True, pytest.approx(0.9 * (1 - GAIN)))]


@pytest.mark.parametrize("accepted", [True, False])
def test_a_design_that_was_tested_and_is_no_cheaper_than_the_drawn_one_counts(accepted):
    study = prepared({GAP: ta.Limit(upper=at(1 - 1e-5), show=SHOWN)})
    judge, design = acceptance_test_of(study, 1), designed(study)
    dearer = replace(judge.run(design, FIRST), accepted=accepted, cost=2.0 * design.cost)
    asked = []

    def another(kind, judged, spending, worth):
        asked.append(spending)
        return ("line", replace(design, cost=0.5 * design.cost)) if len(asked) == 1 else None

    stated = {"line": dearer}
    found = accept_cheapest(judge, {"drawn": design}, another, GAIN, lambda kind, own, _: stated.get(kind, own))
    assert [own.accepted for _, own in found.tested] == [True, accepted]
    assert found.drawn == found.tested[0]
    assert asked[-1] == AlphaSpending(number=3, missed=int(not accepted))


def test_as_many_units_are_allowed_to_fail_as_leave_the_error(generator):
    for units, target, confidence in ((100, 0.9973, 0.95), (1152, 0.9973, 0.5), (2048, 0.99, 0.97)):
        allowed = allowed_rejections(units, target, confidence)
        assert allowed < 0 or binom.cdf(allowed, units, 1 - target) <= 1 - confidence
        assert binom.cdf(allowed + 1, units, 1 - target) > 1 - confidence


def test_a_joint_requirement_judges_what_all_limits_together_do():
    """A unit is good inside all limits; what steers the search leaves no more units than may fail."""
    limits = {GAP: ta.Limit(upper=at(0.99), lower=at(0.001)), PLAY: ta.Limit(upper=at(0.98))}
    study = prepared(limits, ta.AtYield(0.95))
    design = designed(study)
    gap, play = design.outputs[GAP], design.outputs[PLAY]
    kept = (gap <= at(0.99)) & (gap >= at(0.001)) & (play <= at(0.98))
    joint = design.checks[-1].requirement
    np.testing.assert_array_equal(joint.read(design.outputs) <= 0, kept)
    assert design.joint.rejected == np.count_nonzero(~kept)
    assert [check.requirement.guarantee.target for check in design.checks] == [0.95] * 3
    (side,) = design.checks[-1].constraints
    assert (side.excess <= 0) == (design.joint.rejected <= allowed_rejections(1200, 0.95))
    decides = {name: max(own.excess for other, own in named(design) if other == name) for name, _ in named(design)}
    furthest = [(name, own.sign * (design.outputs[name] - own.limit)) for name, own in named(design)]
    beyond = np.any([excess > decides[name] for name, excess in furthest], axis=0)
    assert np.count_nonzero(beyond) <= allowed_rejections(1200, 0.95)
    assert [own.sign for own in design.constraints] == [1, -1, 1]


def named(design: VerifiedDesign):
    """Return the constraints that a search keeps, with their outputs."""
    return [(check.requirement.output, side) for check in design.checks for side in check.steering]


def test_a_joint_yield_is_refused_where_no_question_reads_it_or_it_is_none():
    with pytest.raises(ta.InputError, match=r"joint is 0\.9"):
        ta.Study(joint=0.9, questions=[ta.Allocation()])
    with pytest.raises(ta.InputError, match="no question of it reads joint"):
        ta.Study(joint=ta.AtYield(0.9), questions=[ta.Ranking()])


def test_one_limit_alone_needs_no_joint_requirement():
    study = prepared({GAP: ta.Limit(upper=at(0.99))}, ta.AtYield(0.9))
    assert study.requirements_with_joint == study.requirements
    assert study.requirements[0].guarantee == ta.AtYield(0.9)


@pytest.mark.slow
def test_quick_answers_do_not_lose_a_drawing_that_is_just_good_enough():
    """Of 24 seeds; 99.85 % of the units of the table keep the limits, 99.73 % are asked for."""

    def gap(housing, shaft):
        return housing - shaft

    zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}
    study = ta.Study(
        ta.model(gap, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
        ta.Drawing.of_rows([{"id": "housing", "nominal": 30.1, **zone}, {"id": "shaft", "nominal": 30.0, **zone}]),
        limits={"gap [mm]": ta.Limit(lower=0.07, upper=0.13)},
        questions=[ta.Allocation(front=False, what_if=False)],
    )
    met = [replace(study, seed=seed).allocate(effort="quick").result.met for seed in range(1, 25)]
    assert sum(met) >= 22  # 18 where four nearly equal designs were judged one after the other


def test_after_a_miss_a_design_counts_that_stays_inside_with_what_the_missed_one_says():
    study = prepared({GAP: ta.Limit(upper=at(TARGET), show=SHOWN)})
    cheap, seeds = designed(study), SeedTree(8)
    known = {"space": study.space, "model": study.model, "requirements": study.requirements}
    verifier = Verifier(**known, seeds=seeds, units=1200)
    inside = verifier.verify(0.6 * cheap.design, "inside")
    wider = verifier.verify(1.4 * cheap.design, "wider")
    assert (inside.met, wider.met) == (True, False)
    assert _still_kept((inside, wider, cheap), cheap) == (inside,)  # and never the judged one again
    # What a judged one says with a small error, that all near it lie far beyond the limit, counts more.
    (side,) = cheap.constraints
    beyond = replace(side, stack=replace(side.stack, budget=side.stack.budget - 100.0), standard_error=1e-6)
    assert not _still_kept((inside,), replace(cheap, checks=(replace(cheap.checks[0], constraints=(beyond,)),)))


@pytest.mark.parametrize(("more", "fewer"), [(0.0002, 0.0004), (0.0, 0.001), (0.002, 0.0), (1e-5, 1e-5)])
def test_what_units_say_beside_planes_shows_too_few_failures_no_more_often_than_stated(generator, more, fewer):
    """2,000 samples of 65,536 units; a share of 5 % has a standard error of 0.5 %. Both ends are tried."""
    samples, units, by_law = 2000, 2**16, 0.0027
    true, called = by_law + more - fewer, generator.multinomial(units, [more, fewer, 1 - more - fewer], samples)
    wrong = {0.95: 0, 0.05: 0}
    for own, other, _ in called.tolist():
        found = ControlResiduals(units=units, more=own, fewer=other, sum=own - other, by_law=by_law)
        wrong[0.95] += found.share(0.95) < true
        wrong[0.05] += found.share(0.05) > true
    assert max(wrong.values()) <= samples * (ERROR + 3 * np.sqrt(ERROR * (1 - ERROR) / samples))


@pytest.mark.parametrize("scale", [0.99, 0.999, 1.001, 1.01])
def test_a_limit_is_kept_just_where_units_and_planes_show_it(generator, scale):
    """A bent sum of two sizes, whose units at a limit the plane behind it calls."""
    errors = prepared(ON_THE_LIMIT["one limit"][0]).space.errors
    x = generator.standard_normal((2**16, 2)) * errors.zones / 6

    def bent(x):
        return np.exp(1e4 * x.sum(axis=1))

    near = NearPlane.of(x[: 2**15], bent(x[: 2**15]), errors, errors.zones)
    limits = Limits(upper=scale * np.exp(1e4 * norm.ppf(TARGET) * np.hypot(*errors.zones) / 6))
    control = ControlPlane(near=near, values=near(x), limits=limits)
    sample = LimitedSample.all_of(bent(x), limits, controls=(control,))
    (bound,) = SHOWN.bounds(sample, 0.95)
    called = (control.excess > 0).astype(int)
    shown = ControlResiduals.among(sample.excess > 0, called, near.share_above(1, limits.upper), x.shape[0]).share(0.95)
    assert (bound.excess <= 0) == (shown <= 1 - TARGET)
    plain = LimitedSample.all_of(bent(x), limits)
    assert bound.standard_error < 0.3 * SHOWN.bounds(plain, 0.95)[0].standard_error


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("function", "says_more"),
    [
        (lambda a, b: a + b + 5.0 * a * b, True),
        (lambda a, b: np.exp(20.0 * (a + b)) + b, True),
        (lambda a, b: a + 5.0 * np.maximum(b, 0.0), False),
        (lambda a, b: np.maximum(a, b) + 0.5 * (a + b), False),
        (lambda a, b: a + 30.0 * b**2, False),
        (lambda a, b: np.floor((a + b) / 0.02) * 0.02, False),
    ],
)
def test_a_plane_stands_beside_an_output_only_where_it_says_more_than_the_units_at_the_limit(function, says_more):
    row = {"nominal": 0.0, "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 1e-3, "max": 1.0, "cost": 1}
    study = Prepared(
        study=ta.Study(
            ta.model(function, inputs=("a", "b"), outputs=("y [mm]",)),
            ta.Drawing.of_rows([{"id": name, **row} for name in "ab"]),
            limits={"y [mm]": ta.Limit(upper=0.05)},
            questions=[ta.Allocation()],
        )
    )
    space, requirements = study.space, study.requirements
    own = Verifier(space=space, model=study.model, requirements=requirements, seeds=SeedTree(1), units=2**16)
    found = own.verify(space.uniform(1.0), "table")
    assert bool(found.near) == says_more
    excess = found.sample.evaluation.values[:, 0]
    assert found.quantile_bound <= np.sort(excess)[-100]  # 0.9973 of the units, shown: 177 lie beyond it, or fewer
