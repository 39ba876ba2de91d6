"""A yield of all limits at once: linear functions whose cheapest drawing is known, and how failures are divided."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import norm

import tolalloc as ta
from tests.builders import says
from tolalloc.allocation.space.effort import AllocationEffort
from tolalloc.allocation.space.joint_yield import JointCheck, JointRequirement
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reports.tellers.allocation_tables import today_frame
from tolalloc.study.prepared import Prepared

GAP, PLAY = "gap [mm]", "play [mm]"
TARGET, DEVIATION = 0.9973, 0.1 / 3
"""Yield that is asked for [-], and standard deviation of a size at a scale of 1 [mm]."""
EFFORT = ta.Effort(allocation=AllocationEffort(verification_units=2**14, confirmation_units=2**18))
NARROW, WIDE = 0.12, 0.2

pytestmark = pytest.mark.slow  # whole allocations, read by all


def study(function, costs: dict[str, float], limits: dict[str, ta.Limit], **changed) -> ta.Study:
    """Return a study of two outputs of normal sizes ± 0.1 mm that cost so much at that zone."""
    own = {"nominal": 0.0, "plus": 0.1, "minus": -0.1, "unit": "mm", "distribution": "normal", "Cp": 1.0}
    rows = [{"id": name, "cost": cost, "min": 1e-3, "max": 2.0, **own} for name, cost in costs.items()]
    return ta.Study(
        ta.model(function, inputs=tuple(costs), outputs=(GAP, PLAY)),
        ta.Drawing.of_rows(rows),
        limits=limits,
        questions=[ta.Allocation(front=False, what_if=False)],
        **{"effort": EFFORT, **changed},
    )


def cheapest(costs: tuple[float, float], limit: float, share: float) -> float:
    """Return Σ c/s for √Σ s²·σ·z(share) = limit: (Σ c^⅔)^1.5 over what the limit leaves."""
    return float(sum(cost ** (2 / 3) for cost in costs) ** 1.5 * DEVIATION * norm.isf(share) / limit)


def apart_study(**changed) -> ta.Study:
    """Return a study of two outputs that share no size."""
    limits = {GAP: ta.Limit(upper=NARROW), PLAY: ta.Limit(upper=WIDE)}
    return study(lambda a, b, c, d: (a + b, c + d), {"a": 1.0, "b": 3.0, "c": 0.5, "d": 1.0}, limits, **changed)


def same_study(**changed) -> ta.Study:
    """Return a study of two outputs that fail together."""
    limits = {GAP: ta.Limit(upper=NARROW), PLAY: ta.Limit(upper=3 + 2 * NARROW)}
    return study(lambda a, b: (a + b, 3 + 2 * (a + b)), {"a": 1.0, "b": 3.0}, limits, **changed)


def cost_apart(first: float) -> float:
    """Return the least cost of independent outputs of which the first may fail with such a share [-]."""
    second = 1 - TARGET / (1 - first)
    return cheapest((1.0, 3.0), NARROW, first) + cheapest((0.5, 1.0), WIDE, second)


def true_yield(scales: np.ndarray) -> float:
    """Return the share of units of a design that keep both limits, of outputs that share a size or are the same."""
    first = norm.cdf(NARROW / (DEVIATION * np.hypot(*scales[:2])))
    return float(first * (norm.cdf(WIDE / (DEVIATION * np.hypot(*scales[2:]))) if scales.size > 2 else 1.0))


STUDIES = {
    "independent": (apart_study, minimize_scalar(cost_apart, bounds=(1e-5, 0.00269), method="bounded").fun),
    "the same": (same_study, cheapest((1.0, 3.0), NARROW, 1 - TARGET)),
}


@pytest.fixture(scope="module")
def answers() -> dict[str, ta.Answer]:
    return {name: made().allocate() for name, (made, _) in STUDIES.items()}


@pytest.mark.parametrize("name", STUDIES)
def test_two_limits_are_kept_at_once_at_hardly_more_than_the_least_cost(answers, name):
    """Without a word of it: both ask for 99.73 %, so 99.73 % of the units keep both."""
    found, optimum = answers[name].result, STUDIES[name][1]
    assert found.met
    assert true_yield(found.chosen.scales) >= TARGET - 1e-4
    assert optimum * 0.998 < found.cost < optimum * 1.02
    assert found.bound <= optimum


@pytest.mark.parametrize("seed", range(2, 8))
@pytest.mark.parametrize("name", STUDIES)
def test_other_random_numbers_find_hardly_another_cost(name, seed):
    made, optimum = STUDIES[name]
    found = made(seed=seed, effort="quick").allocate().result
    assert found.met
    assert true_yield(found.chosen.scales) >= TARGET - 1e-4
    assert optimum * 0.998 < found.cost < optimum * 1.02


@pytest.mark.parametrize("name", STUDIES)
def test_a_quick_answer_and_an_explicit_joint_yield_go_the_same_way(name):
    made, optimum = STUDIES[name]
    for seed in range(1, 3):
        found = made(seed=seed, effort="quick", joint=ta.AtYield(TARGET)).allocate().result
        assert found.met
        assert true_yield(found.chosen.scales) >= TARGET - 1e-4
        assert optimum * 0.998 < found.cost < optimum * 1.02


def test_each_limit_alone_costs_less_and_fewer_units_keep_both():
    found = apart_study(joint=None).allocate().result
    alone = cheapest((1.0, 3.0), NARROW, 1 - TARGET) + cheapest((0.5, 1.0), WIDE, 1 - TARGET)
    assert found.chosen.parts == ()
    assert found.cost == pytest.approx(alone, rel=0.01)
    assert found.chosen.joint.high < TARGET


def test_limits_that_ask_for_different_things_are_kept_each_alone():
    def joint(first: ta.Limit, second: ta.Limit, **asked) -> ta.AtYield | None:
        own = Prepared(study=replace(apart_study(**asked), limits={GAP: first, PLAY: second}))
        last = own.requirements_with_joint[-1]
        return last.guarantee if isinstance(last, JointRequirement) else None

    plain, strict = ta.Limit(upper=1.0), ta.Limit(upper=1.0, show=ta.AtYield(0.99))
    assert joint(plain, plain) == ta.AtYield(TARGET)
    assert joint(strict, strict) == ta.AtYield(0.99)
    assert joint(plain, strict) is None
    assert joint(plain, ta.Limit(upper=1.0, show=ta.AtCpk(1.0))) is None
    assert joint(plain, plain, joint=None) is None
    assert joint(plain, strict, joint=ta.AtYield(0.9)) == ta.AtYield(0.9)


def checked(made: ta.Study) -> JointCheck:
    """Return how the table stands against all limits at once."""
    own = Prepared(study=made)
    verifier = Verifier(
        space=own.space, model=own.model, requirements=own.requirements_with_joint, seeds=SeedTree(1), units=2**16
    )
    found = verifier.verify(own.space.uniform(0.8), "table").checks[-1]
    assert isinstance(found, JointCheck)
    return found


def test_failures_that_coincide_count_once():
    """Of independent outputs each is left half of the failures, of outputs that fail together all of them."""
    units, half = (
        2**16,
        0.025,
    )  # of an error of 5 %, for units that a law does not call, and those called twice
    nothing_leaves = 1 - half ** (1 / units)  # shown by units that all keep to their laws
    assert checked(apart_study()).overlap == pytest.approx(1 - nothing_leaves / (1 - TARGET), abs=0.01)
    # Twice: 2f of the laws less what at least fails both, f·(1 − 1.96/√(f·units)), is what is allowed.
    twice = 1 / (1 + norm.isf(half) / np.sqrt(units * (1 - TARGET)))
    assert checked(same_study()).overlap == pytest.approx(2 * twice, abs=0.1)
    assert checked(same_study()).shares == pytest.approx([twice * (1 - TARGET)] * 2, rel=0.05)


def test_a_limit_that_costs_nothing_leaves_its_failures_to_the_other(monkeypatch):
    wide = {GAP: ta.Limit(upper=NARROW), PLAY: ta.Limit(upper=5.0)}
    found = replace(apart_study(), limits=wide).allocate().result
    assert found.chosen.parts[1] < 0.05
    assert found.met
    prices = dict.fromkeys((own.stack.name for own in found.chosen.constraints), 1.0)
    monkeypatch.setattr(type(found.free), "prices", prices)  # a local model gives a price to what no unit misses too
    rows = today_frame(found, "cost units").set_index("drawing")
    assert rows.loc[[GAP, PLAY], "binds"].to_dict() == {GAP: "yes", PLAY: ""}


def test_the_first_sentence_says_the_yield_of_all_limits(answers):
    answer = answers["independent"]
    chosen = answer.result.chosen
    assert says(answer.sentences[0], "allocation.met_jointly", share=chosen.joint.estimate, high=chosen.joint.high)
    assert not says(answer.sentences, "allocation.all_limits")
