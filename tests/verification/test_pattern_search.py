"""The search by pattern where an output jumps with the zones: when it is asked, what it finds, how the line goes on."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.allocation.search.cost_line import CostLine
from tolalloc.allocation.search.pattern_search import CommonUnits, by_pattern, jumps
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

GAP = "gap [mm]"
CLASSES = ta.Sorting("shaft", "hole", classes=4, width=2.0, batch=100, class_cost=0.1, leftover_cost=0.05)
LIMIT = ta.Limit(lower=-0.005, upper=0.005, show=ta.AtYield(0.99))


def study_of(function, seed=1, **changes) -> ta.Study:
    sizes = {"nominal": 0.0, "unit": "mm", "min": 3e-4, "max": 0.24}
    rows = [
        {"id": name, "plus": 0.006, "minus": -0.006, "cost": own, **sizes} for name, own in (("hole", 1), ("shaft", 4))
    ]
    model = ta.model(function, inputs=("hole", "shaft"), outputs=(GAP,))
    drawing, limits = ta.Drawing.of_rows(rows), {GAP: LIMIT}
    return ta.Study(model, drawing, limits=limits, questions=[ta.Allocation()], seed=seed, **changes)


def verifier_of(study: ta.Study) -> Verifier:
    own = Prepared(study=study)
    return Verifier(space=own.space, model=own.model, requirements=own.requirements, seeds=SeedTree(1), units=2**16)


def gap(hole, shaft):
    return hole - shaft


@pytest.mark.parametrize(
    ("study", "is_jumping"),
    [
        (study_of(lambda a, b: a - b + 30.0 * a * b), False),
        (study_of(lambda a, b: a + 5.0 * np.maximum(b, 0.0)), False),
        (study_of(lambda a, b: np.abs(a) - np.minimum(b, 0.001)), False),
        (study_of(gap, compensators=[ta.Sorting("shaft", "hole", classes=4)]), False),
        (study_of(gap, compensators=[CLASSES]), True),
        (study_of(lambda a, b: a + np.floor(b / 0.002) * 0.002), True),
        (study_of(lambda a, b: a + 0.002 * (b > a)), True),
    ],
)
def test_classes_of_one_width_and_steps_jump_bends_and_kinks_do_not(study, is_jumping):
    verifier = verifier_of(study)
    assert jumps(verifier, verifier.verify(verifier.space.uniform(1.0), "drawn")) == is_jumping


@pytest.mark.slow
def test_of_classes_of_one_width_it_finds_the_cheapest_ratio_of_a_grid():
    verifier = verifier_of(study_of(gap, compensators=[CLASSES]))
    start = verifier.verify(verifier.space.uniform(1.3), "alike")
    assert start.met
    found = by_pattern(verifier, start)
    fresh = CommonUnits.of(verifier, "fresh", 2.0)
    grid = [fresh.cost(np.array([ratio, 1.0]) * 1.4) for ratio in np.linspace(0.6, 1.2, 13)]
    assert fresh.cost(found.design) < 1.003 * min(grid)
    assert fresh.cost(start.design) > 1.02 * min(grid)  # which the derivatives of units do not see


def test_a_line_through_a_design_that_jumps_scales_all_zones_alike():
    verifier = verifier_of(study_of(gap, compensators=[CLASSES]))
    design = verifier.verify(np.array([1.2, 1.4]), "found")
    line = CostLine.through(design, [design], verifier.model.drawn_amounts, lambda _: verifier)
    assert line.safe[0] / line.safe[1] == pytest.approx(12 / 14)
    assert line.cheap / line.safe == pytest.approx(line.cheap[0] / line.safe[0])
    assert line.cost(1.0) < design.cost < line.cost(0.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_an_allocation_with_classes_of_one_width_ends_within_two_percent_of_a_grid(seed):
    study = study_of(gap, seed, compensators=[CLASSES]).with_effort("quick")
    answer = study.ask(ta.Allocation(front=False, what_if=False)).result
    fresh = CommonUnits.of(verifier_of(study), "fresh", 4.0)
    grid = [fresh.cost(np.array([ratio, 1.0]) * 1.4) for ratio in np.linspace(0.7, 1.0, 7)]
    assert answer.met
    assert answer.cost < 1.02 * min(grid)
