"""Which of the verified drawings is the answer: never one that costs more than another that may be drawn."""

from __future__ import annotations

from dataclasses import replace

import pytest

import tolalloc as ta
from tests.builders import says
from tolalloc.allocation.result import AllocationResult
from tolalloc.allocation.search.candidates import ALIKE, FREE, GRADES, TABLE
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.reports.header import Header
from tolalloc.reports.tellers.allocation_drawing import sources_table
from tolalloc.study.answer import Answer

ZONE = {"plus": 0.01, "minus": -0.01, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}


def gap(housing, shaft):
    return housing - shaft


@pytest.fixture(scope="module")
def graded() -> AllocationResult:
    study = ta.Study(
        ta.model(gap, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
        ta.Drawing.of_rows([{"id": "housing", "nominal": 30.1, **ZONE}, {"id": "shaft", "nominal": 30.0, **ZONE}]),
        limits={"gap [mm]": ta.Limit(lower=0.07, upper=0.13)},
        questions=[ta.Allocation(grades=True, what_if=False, front=False)],
        name="fit",
    )
    found = study.allocate(effort="quick").result
    assert found.met
    return found


def told(result: AllocationResult) -> Answer[AllocationResult]:
    """Return the answer that a result is."""
    return Answer(kind="allocation", header=Header(name="fit", model="gap", seed=1), result=result)


def at_cost(design: VerifiedDesign, cost: float) -> VerifiedDesign:
    return replace(design, cost=cost)


def confirming(allocation: ZoneAllocation) -> ZoneAllocation:
    """Return an allocation whose design was confirmed."""
    return replace(allocation, chosen=replace(allocation.chosen, accepted=True))


def with_table(answer: AllocationResult, cost: float) -> AllocationResult:
    """Return the answer with a table that keeps the limits at a cost."""
    table = replace(answer.free.baseline, checks=answer.chosen.checks, cost=cost, accepted=True)
    alike = answer.free.proportional_tried[1:]
    return replace(answer, free=replace(answer.free, proportional_tried=(table, *alike)))


def test_free_zones_are_never_dearer_than_grades(graded):
    assert graded.free.chosen.cost <= graded.graded.chosen.cost


def test_a_table_that_costs_less_is_kept_and_said_to_be(graded):
    dearer = with_table(graded, 1.01 * graded.graded.chosen.cost)
    assert dearer.chosen is graded.graded.chosen
    assert says(told(dearer).title, "allocation.title")
    kept = with_table(graded, 0.99 * graded.graded.chosen.cost)
    assert kept.keeps_table
    assert kept.met
    assert says(told(kept).title, "allocation.title_kept")
    (said,) = [sentence for sentence in told(kept).sentences if says(sentence, "allocation.kept")]
    assert f"{TABLE} {kept.cost:.2f}" in said
    assert told(kept).summary["cost [cost units]"] == kept.cost
    assert sources_table(kept).frame()["cost [cost units]"].notna().all()


def test_where_grades_are_asked_for_no_other_zones_are_drawn(graded):
    admitted = graded.candidates.admitted()
    assert set(admitted) == {TABLE, GRADES}
    free = replace(graded, graded=None, free=confirming(graded.free))
    assert set(free.candidates.admitted()) == {TABLE, ALIKE, FREE}
    assert free.chosen is free.free.chosen


def test_zones_beyond_what_they_may_be_are_not_drawn(graded):
    free, alike = graded.free, graded.free.proportional
    beyond = at_cost(replace(alike, design=alike.design + 10.0, checks=free.chosen.checks), 0.5 * free.chosen.cost)
    changed = replace(graded, graded=None, free=confirming(replace(free, proportional_tried=(free.baseline, beyond))))
    assert ALIKE not in changed.candidates.admitted()
    assert changed.chosen is changed.free.chosen


def test_models_that_a_verified_drawing_undercuts_bound_nothing(graded):
    assert graded.bound is not None
    assert graded.bound <= graded.cost
    undercut = with_table(graded, 0.9 * graded.bound)
    assert undercut.bound is None
    assert told(undercut).summary["lower bound [cost units]"] is None
    assert says(told(undercut).sentences, "allocation.no_bound")
    assert not says(told(undercut).sentences, "allocation.bound_local")


def test_a_miss_is_titled_so(graded):
    (check,) = graded.chosen.checks
    far = tuple(replace(side, value=side.limit + side.sign * 1.0) for side in check.constraints)
    lost = replace(graded.graded.chosen, checks=(replace(check, constraints=far),), accepted=False)
    answer = replace(graded, graded=replace(graded.graded, chosen=lost))
    table = replace(answer.free.baseline, checks=lost.checks)
    answer = replace(answer, free=replace(answer.free, proportional_tried=(table,)))
    assert not answer.met
    assert says(told(answer).title, "allocation.title_missed")


def spring(part, preload):
    return part - preload


@pytest.mark.parametrize("grades", [False, True])
def test_a_setting_outside_what_it_may_become_is_not_drawn_though_it_is_cheapest(grades):
    """At 0 the setting leaves the zones most room; it may be −3 to −1, and −1 leaves the most of these."""
    setting = ta.Setting(name="preload [mm]", value=0.0, lower=-3.0, upper=-1.0, step=0.01)
    study = ta.Study(
        ta.model(spring, inputs=("part",), outputs=("force [N]",), settings=(setting,)),
        ta.Drawing.of_rows([{"id": "part", "nominal": 0.0, **ZONE}]),
        limits={"force [N]": ta.Limit(upper=1.04)},
        questions=[ta.Allocation(grades=grades, what_if=False, front=False)],
        name="preloaded",
    )
    answer = study.allocate(effort="quick")
    found = answer.result
    (value,) = found.chosen.settings
    assert value == pytest.approx(-1.0, abs=0.01)
    assert found.met
    assert found.cost > found.fixed.chosen.cost
    (said,) = [sentence for sentence in answer.warnings if sentence.startswith("preload")]
    assert said == (
        "preload: 0 mm today, not among the −3…−1 mm that it may become; only the table as it is may keep it."
    )
