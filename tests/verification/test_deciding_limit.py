"""The limit that decides leads the answer, whichever the study names first."""

from __future__ import annotations

import pytest

import tolalloc as ta
from tolalloc.capability.monte_carlo import deciding
from tolalloc.study.prepared import Prepared

ROWS = [
    {"id": name, "nominal": 0, "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.002, "max": 0.2, "cost": cost}
    for name, cost in (("a", 1), ("b", 3))
]
LOOSE, TIGHT = "loose [mm]", "tight [mm]"


def study(**limits: ta.Limit) -> ta.Study:
    model = ta.model(lambda a, b: (a + b, a - b), inputs=("a", "b"), outputs=(LOOSE, TIGHT))
    named = {LOOSE: limits["loose"], TIGHT: limits["tight"]}
    return ta.Study(model, ta.Drawing.of_rows(ROWS), limits=named, name="two", effort="quick")


def test_the_limit_that_most_units_miss_leads():
    asked = study(loose=ta.Limit(upper=0.05), tight=ta.Limit(upper=0.01))
    result = asked.ask(ta.Allocation(front=False, what_if=False)).result
    assert result.leading == TIGHT
    assert result.met
    assert [own.output for own in Prepared(study=asked).requirements] == [LOOSE, TIGHT]


def test_the_first_one_leads_where_others_are_missed_hardly_more():
    asked = study(loose=ta.Limit(upper=0.0205), tight=ta.Limit(upper=0.02))
    result = asked.ask(ta.Allocation(front=False, what_if=False)).result
    assert result.leading == LOOSE


def test_what_a_unit_beyond_a_limit_costs_is_of_the_first_one():
    asked = study(loose=ta.Limit(upper=0.05), tight=ta.Limit(upper=0.01))
    price = ta.UnitPrice(scrap=10.0)
    result = asked.ask(ta.Allocation(front=False, what_if=False, unit_price=price)).result
    assert result.leading == LOOSE


@pytest.mark.parametrize(
    ("beyond", "leads"),
    [
        ({"a": 0.0, "b": 0.009}, "a"),
        ({"a": 0.0, "b": 0.02}, "b"),
        ({"a": 0.2, "b": 0.39}, "a"),
        ({"a": 0.2, "b": 0.41, "c": 0.6}, "c"),
    ],
)
def test_it_takes_twice_as_many_units_and_a_hundredth_of_them(beyond, leads):
    assert deciding(beyond) == leads
