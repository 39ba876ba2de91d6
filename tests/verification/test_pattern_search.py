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


WIDE = {"nominal": 0.0, "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 1e-3, "max": 0.8}
STEPPING = {
    "a count of two that may not be beyond": (
        lambda a, b: (abs(a) > 0.02) * 1 + (abs(b) > 0.03) * 1,
        {"upper": 0},
        3.196,
    ),
    "a count of two of which one may be beyond": (
        lambda a, b: (abs(a) > 0.005) * 1 + (abs(b) > 0.008) * 1,
        {"upper": 1},
        4.15,
    ),
    "a rounded size": (lambda a, b: a + np.round(b / 0.02) * 0.02, {"lower": -0.04, "upper": 0.04}, 2.865),
    "a step and a low yield": (
        lambda a, b: a + np.floor(b / 0.02) * 0.02,
        {"upper": 0.04, "show": ta.AtYield(0.9)},
        0.9367,
    ),
}
"""Function of two sizes that cost 1 and 3 at ± 0.02 mm, its limit, and the least cost that a random search of 10 s
found on 200,000 units, checked on 500,000 others."""


@pytest.mark.slow
@pytest.mark.parametrize("case", STEPPING)
def test_what_steps_costs_no_more_than_a_random_search_finds(case):
    function, limit, best = STEPPING[case]
    drawing = ta.Drawing.of_rows([{"id": "a", "cost": 1, **WIDE}, {"id": "b", "cost": 3, **WIDE}])
    model = ta.model(function, inputs=("a", "b"), outputs=("y [-]",))
    study = ta.Study(model, drawing, limits={"y [-]": ta.Limit(**limit)}, seed=1).with_effort("quick")
    answer = study.ask(ta.Allocation(front=False, what_if=False)).result
    assert answer.met
    assert answer.cost < 1.01 * best


@pytest.mark.slow
@pytest.mark.parametrize(("locked", "best"), [("", 0.9314), ("yes", 2.2897)])
def test_a_single_zone_that_steps_uses_its_limit_up(locked, best):
    rows = [{"id": "b", "cost": 3, **WIDE}]
    rows += [{"id": "a", "cost": 1, "locked": locked, **WIDE}] if locked else []
    inputs = tuple(own["id"] for own in rows)
    model = ta.model(lambda b, a=0.0: a + np.floor(b / 0.02) * 0.02, inputs=inputs, outputs=("y [mm]",))
    study = ta.Study(model, ta.Drawing.of_rows(rows), limits={"y [mm]": ta.Limit(upper=0.04)}, seed=1)
    answer = study.with_effort("quick").ask(ta.Allocation(front=False, what_if=False)).result
    assert answer.met
    zone = next(own.zone for own in answer.drawn_sources if own.name == "b")
    x = np.random.default_rng(3).normal(size=(2, 10**6)) / 6
    kept = np.mean(x[0] * 0.04e-3 * bool(locked) + np.floor(x[1] * zone / 0.02e-3) * 0.02e-3 <= 0.04e-3 * (1 + 1e-12))
    assert 0.9972 < kept < 0.9976
    assert answer.cost == pytest.approx(best, rel=0.005)
