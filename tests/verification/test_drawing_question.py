"""What the steps of a drawing cost, and that what is shown has them, whether it keeps its limits or not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import says
from tolalloc.allocation.drawing_question import DrawingQuestion
from tolalloc.allocation.search.candidates import ALIKE, Candidates
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.effort import QUICK_ALLOCATION
from tolalloc.allocation.verify.acceptance import FIRST, AlphaSpending
from tolalloc.drawings.sources import Source
from tolalloc.reports.header import Header
from tolalloc.study.answer import Answer
from tolalloc.study.prepared import Prepared

GAP = "gap [mm]"
UM = 1e-6
ROW = {"unit": "µm", "min": 1.0, "max": 60.0, "cost": 1.0}
ROWS = (
    {"id": "first", "plus": 9.8, "minus": -9.8, "group": "both", "step": 4.0, **ROW},
    {"id": "second", "plus": 8.0, "minus": -8.0, "group": "both", "step": 4.0, **ROW},
    {"id": "third", "plus": 10.0, "minus": -10.0, "step": 0.5, **ROW},
)


def summed(first, second, third, press):
    return first + second + 0.5 * third + 0.0 * press


def study(rows=ROWS) -> ta.Study:
    setting = ta.Setting(name="press [mm]", value=0.5, lower=0.0, upper=1.0, step=0.1)
    return ta.Study(
        ta.model(summed, inputs=("first", "second", "third"), outputs=(GAP,), settings=(setting,)),
        ta.Drawing.of_rows(rows),
        limits={GAP: ta.Limit(lower=-0.012, upper=0.012)},
        questions=[ta.Allocation(fixed_first=False, front=False, what_if=False)],
        name="steps",
    )


def question() -> DrawingQuestion:
    """Return what is asked of the study's cheapest drawing."""
    prepared = Prepared(study=study())
    return DrawingQuestion(
        model=prepared.model,
        space=prepared.space,
        requirements=prepared.requirements,
        effort=replace(QUICK_ALLOCATION, setting_steps=(2,)),
        seed=1,
        largest_failed_share=0.0,
        grades=False,
        fixed_first=False,
        front=False,
        what_if=True,
        unit_price=None,
        quality_loss=None,
        place="steps",
    )


@pytest.fixture(scope="module")
def asked() -> tuple[DrawingQuestion, ZoneAllocation]:
    own = question()
    return own, own.direct()


@pytest.fixture(scope="module")
def result():
    return study([{**own, "group": own["id"], "step": 0.5} for own in ROWS]).allocate(effort="quick").result


def in_steps(sources: tuple[Source, ...]) -> list[float]:
    """Return how far deviations of sizes lie from whole steps [steps]."""
    numbers = [own.zone / 2 / own.step for own in sources]
    return [abs(own - round(own)) for own in numbers]


def test_a_drawing_says_what_its_steps_cost(result):
    drawn = result.chosen
    assert in_steps(result.drawn_sources) == pytest.approx([0.0] * 3, abs=1e-9)
    assert drawn.cost > drawn.unrounded_cost + 0.005
    answer = Answer(kind="allocation", header=Header(name="steps", model="sum", seed=1), result=result)
    gaps = {"rounding": drawn.cost - drawn.unrounded_cost, "unrounded": drawn.unrounded_cost}
    assert says(answer.sentences, "allocation.rounding", **gaps)
    assert says(answer.sentences, "allocation.bound_certified") or says(answer.sentences, "allocation.bound_local")


@pytest.mark.parametrize("unrounded", [None, 0.0])
def test_nothing_is_said_of_steps_that_cost_nothing(result, unrounded):
    cost = None if unrounded is None else result.chosen.cost - 1e-4
    free = replace(result.free, chosen=replace(result.chosen, unrounded_cost=cost))
    answer = Answer(
        kind="allocation", header=Header(name="steps", model="sum", seed=1), result=replace(result, free=free)
    )
    assert answer.result.chosen.accepted
    assert not says(answer.sentences, "allocation.rounding")


def missed(design, beyond: float):
    """Return a design that lies so far beyond its upper limit [mm]."""
    (check,) = design.checks
    upper, lower = check.constraints
    return replace(design, checks=(replace(check, constraints=(replace(upper, value=upper.limit + beyond), lower)),))


def not_met(free: ZoneAllocation, scale: float) -> Candidates:
    """Return candidates none of which keeps the limits: zones scaled alike miss them least, and were not tested."""
    verifier = question().verifier("alike", free.chosen.space)
    alike = verifier.verify(np.append(np.full(2, scale), 0.5), "alike")
    table = missed(free.baseline, 1.0)
    free = replace(free, proportional_tried=(table, alike), chosen=missed(free.chosen, 1.0))
    found = Candidates(fixed=None, free=free, graded=None)
    assert found.shown == (ALIKE, alike) and not alike.met
    return found


def zones_of(design) -> dict[str, float]:
    """Return source → zone of a design [m]."""
    space = design.space
    return dict(zip((own.name for own in space.errors.active), space.zones(design.design), strict=True))


def test_a_design_that_misses_is_shown_with_whole_steps_and_the_numbers_of_the_rounded_one(asked):
    own, free = asked
    found = not_met(free, 1.49)
    _, shown = own.shown_as_drawn(found, own.acceptance_test, FIRST).shown
    # 29.2 and 23.8 µm in steps of 4 to either side, 29.8 in steps of a half.
    assert zones_of(shown) == pytest.approx({"first": 24 * UM, "second": 16 * UM, "third": 29 * UM})
    assert (shown.met, shown.accepted) == (False, False)
    assert shown.unrounded_cost == found.shown[1].cost < shown.cost
    assert shown.cost == pytest.approx(19.6 / 24 + 16 / 16 + 20 / 29)
    spread = np.array([24, 16, 14.5]) * 1e-3 / 6
    assert shown.outputs[GAP].std() == pytest.approx(np.hypot.reduce(spread), rel=0.03)


def test_a_design_that_keeps_its_limits_once_rounded_is_tested_with_the_error_that_is_left(asked):
    own, free = asked
    found = not_met(free, 0.9)
    kind, shown = own.shown_as_drawn(found, own.acceptance_test, AlphaSpending(number=5, missed=4)).shown
    assert kind == ALIKE and shown.accepted and shown.independent
    assert shown.confidence == pytest.approx(1 - AlphaSpending(missed=4).error(own.effort.error))
    assert zones_of(shown) == pytest.approx({"first": 16 * UM, "second": 8 * UM, "third": 18 * UM})


def test_what_settings_are_worth_is_asked_at_the_ratios_of_the_drawing(asked):
    own, free = asked
    rounded = own.as_drawn("free", free.chosen)
    first, second, _ = zones_of(rounded).values()
    assert (first, second) == (pytest.approx(8 * UM), pytest.approx(8 * UM))
    trade = own.trade(replace(free, chosen=rounded, tried=(rounded,)))
    # The setting does nothing, so zones cost what the cheapest pair z, z, t does: 35.6/z + 20/t by Lagrange, with
    # √(2(z/2)² + (t/4)²) = 12 µm at three standard deviations; the units ask for a little more.
    least = (((np.array([35.6, 20.0]) * [np.sqrt(0.5), 0.25]) ** (2 / 3)).sum()) ** 1.5 / 12
    assert trade.cost.tolist() == pytest.approx([least, least], rel=0.03)
    assert trade.cost.min() > least
