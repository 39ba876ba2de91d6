"""The last stretch of a search: the cheapest design on a line that the units of a test show."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import norm

import tolalloc as ta
from tests.builders import verifier_of_sum
from tolalloc.allocation.search.cost_line import CostLine, _between
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.allocation.verify.acceptance import FIRST, AcceptanceTest
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.function_model import FunctionModel
from tolalloc.models.settings import DrawnAmounts

TARGET, ERROR, UNITS, LIMIT = 0.95, 0.05, 512, 1.0
AMOUNTS = DrawnAmounts(names=(), by_setting=np.zeros((0, 0)), steps=())


def folded(*x: float) -> float:
    """The size of a sum, of which no plane tells the tail."""
    return abs(math.fsum(x))


def line_and_model():
    """Return a line of designs around one that is just at its limit, and the model."""
    made = verifier_of_sum(6.0, 8.0, limit=LIMIT, guarantee=AtYield(TARGET))
    model = FunctionModel(function=folded, inputs=("x1", "x2"), outputs=("y [mm]",)).bound(made.space.errors, "")
    verifier = replace(made, model=model)
    scale = LIMIT / (norm.ppf((1 + TARGET) / 2) * np.hypot(1.0, 8 / 6))
    around = verifier.verify(verifier.space.uniform(scale), "at the limit")
    return line_through(around, verifier), model


def line_through(around, verifier) -> CostLine:
    return CostLine.through(around, [around], AMOUNTS, lambda space: replace(verifier, space=space))


def kept_by(design) -> float:
    """Return the share of all units that a design keeps, exactly [-]."""
    return float(2 * norm.cdf(LIMIT / np.hypot.reduce(design.space.zones(design.design) * 1e3 / 6)) - 1)


def acceptance_test_of(model, seed: int) -> AcceptanceTest:
    return AcceptanceTest(model=model, seeds=SeedTree(seed), units=UNITS, error=ERROR)


def test_costs_fall_along_a_line_whose_ends_lie_on_both_sides_of_the_limit():
    line, _ = line_and_model()
    designs = [line.at(position) for position in np.linspace(0, 1, 6)]
    assert all(before.cost > after.cost for before, after in pairwise(designs))
    assert kept_by(designs[0]) > TARGET + 0.01 > TARGET - 0.01 > kept_by(designs[-1])


def test_a_line_begins_no_less_safe_than_the_design_that_was_verified():
    line, _ = line_and_model()
    verifier = line.verifier(line.around.space)
    inside = verifier.verify(0.5 * line.around.design, "far inside")
    assert inside.met
    assert line_through(inside, verifier).safe.tolist() == inside.design.tolist()
    assert not line.around.met
    assert line.cost(0.0) > line.around.cost  # as its models say


@pytest.mark.slow
def test_of_the_cheapest_shown_no_more_than_the_stated_error_are_beyond_the_limit():
    """However often a line is looked at: 150 answers, three standard errors of room; hardly any is far inside."""
    line, model = line_and_model()
    tests = [acceptance_test_of(model, seed) for seed in range(150)]
    shown = [own for test in tests if (own := line.cheapest_shown(test, FIRST))]
    found = [kept_by(own) for own in shown if own.accepted]
    wrong, error = float(np.mean(np.array(found) < TARGET)), FIRST.error(ERROR)
    assert len(found) > 140
    assert 0 < wrong <= error + 3 * np.sqrt(error * (1 - error) / len(found))
    # As many plain units would take 1.78 standard errors of a share for 96.25 %; those near the limit take less.
    assert TARGET < np.median(found) < TARGET + 1.78 * np.sqrt(TARGET * (1 - TARGET) / UNITS)


def test_the_shown_design_is_accepted_by_the_same_test_and_a_cheaper_one_is_not():
    line, model = line_and_model()
    test = acceptance_test_of(model, 3)
    shown = line.cheapest_shown(test, FIRST)
    assert shown is not None
    assert test.run(shown, FIRST).accepted
    cheaper = next(own for own in map(line.at, np.linspace(0, 1, 101)) if own.cost < 0.985 * shown.cost)
    assert not test.run(cheaper, FIRST).accepted


def test_where_the_units_show_nothing_of_a_line_its_safe_end_is_what_missed():
    line, model = line_and_model()
    beyond = replace(line, safe=line.cheap, cheap=line.cheap * 1.2)
    test = acceptance_test_of(model, 3)
    shown = beyond.cheapest_shown(test, FIRST)
    assert shown is not None
    assert shown.design == pytest.approx(line.cheap, rel=0.005)  # as its drawing states it
    assert not test.run(shown, FIRST).accepted


def test_nothing_is_tested_where_a_law_tells_the_limit():
    verifier = verifier_of_sum(6.0, 8.0, limit=LIMIT, guarantee=AtYield(TARGET))
    around = verifier.verify(verifier.space.uniform(0.3), "by its law")
    line = line_through(around, verifier)
    assert line.cheapest_shown(acceptance_test_of(verifier.model, 1), FIRST) is None


def test_the_next_position_lies_between_what_is_shown_and_what_is_not():
    assert _between((0.5, -0.1), (1.0, np.nan)) == 0.75
    assert _between((0.0, np.nan), (0.5, 0.2)) == 0.25
    assert _between((0.0, np.nan), (0.1, 0.2)) == 0.0
    assert _between((0.2, -0.1), (0.6, 0.3)) == pytest.approx(0.2 + (0.5 + 0.25) / 2 * 0.4)
    assert _between((0.2, -0.1), (0.6, np.inf)) == pytest.approx(0.4)


@pytest.mark.slow
def test_a_study_whose_output_has_a_kink_ends_within_a_percent_of_its_optimum():
    """y = a + 5·max(0, b) ≤ 40 µm: least 1/a + 3/b, by a grid of a million units 8.79."""

    def output(a, b):
        return a + 5 * np.maximum(0, b)

    row = {"nominal": 0.0, "plus": 20, "minus": -20, "unit": "µm", "min": 1, "max": 200}
    study = ta.Study(
        ta.model(output, inputs=("a", "b"), outputs=("y [mm]",)),
        ta.Drawing.of_rows([{"id": "a", **row, "cost": 1}, {"id": "b", **row, "cost": 3}]),
        limits={"y [mm]": ta.Limit(upper=0.04)},
        effort="quick",
    )
    assert study.ask(ta.Allocation(front=False, what_if=False)).result.cost == pytest.approx(8.79, rel=0.01)
