"""Zones that are tried outside what their row allows are said, whoever tries them, and in which unit they were read."""

from __future__ import annotations

import pytest

import tolalloc as ta
from tolalloc.cli.studies import _zone
from tolalloc.exceptions import InputError

ZONE = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 1.0}


def study() -> ta.Study:
    return ta.Study(
        ta.model(lambda a, b: a - b, inputs=("a", "b"), outputs=("gap [mm]",)),
        ta.Drawing.of_rows([{"id": "a", "nominal": 10.0, **ZONE}, {"id": "b", "nominal": 10.0, **ZONE}]),
        limits={"gap [mm]": ta.Limit(upper=0.2)},
    )


@pytest.mark.parametrize(
    ("zone", "said"),
    [
        (0.3, "its zone of 0.3 µm lies outside the 20 to 500 µm that its row allows. Write a=0.3mm if"),
        (501.0, "its zone of 501 µm lies outside the 20 to 500 µm that its row allows."),
        (19.0, "its zone of 19 µm lies outside"),
        (1900.0, "its zone of 1900 µm lies outside"),
        (0.019, "its zone of 0.019 µm lies outside"),
    ],
)
def test_a_difference_warns_of_a_zone_outside_its_row(zone, said):
    answer = study().ask(ta.Difference(zones={"a": zone}, units=256))
    assert any(said in warning for warning in answer.warnings)


def test_nothing_is_said_of_a_zone_at_its_bounds():
    for zone in (20.0, 500.0, 300.0):
        answer = study().ask(ta.Difference(zones={"a": zone}, units=256))
        assert not any("outside" in warning for warning in answer.warnings)


@pytest.mark.parametrize(
    ("text", "zone"),
    [
        ("pin.diameter=3", 3.0),
        ("pin.diameter=2,5", 2.5),
        ("pin.diameter=0.3mm", 300.0),
        ("pin.diameter=0,3 mm", 300.0),
        ("pin.diameter=30µm", 30.0),
        ("pin.diameter = 30 um", 30.0),
        ("pin.diameter=1e-3mm", 1.0),
        ("pin.diameter=1E+1", 10.0),
        ("pin.diameter=0,125", 0.125),
        ("pin.diameter=1.125", 1.125),
    ],
)
def test_a_zone_may_have_a_decimal_comma_and_a_unit(text, zone):
    assert _zone(text) == ("pin.diameter", pytest.approx(zone))


@pytest.mark.parametrize(
    "text",
    ["a", "a=", "a=x", "a=1.000,5", "a=1,000", "a=12,345mm", "a=250,000", "a=1 000", "a=-3", "a=3cm", "a=nan", "a=inf"],
)
def test_what_is_no_zone_is_refused_with_what_is_allowed(text):
    with pytest.raises(InputError, match=r"SOURCE=µm, such as pin.diameter=3, or with its unit as in housing=0.02mm"):
        _zone(text)
