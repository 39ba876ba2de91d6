"""A mean off the middle of its limits is said before a zone is tightened, with the nominal that mends it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

import tolalloc as ta

SPREAD = {"min": 0.01, "max": 0.4, "cost": 1.0, "unit": "mm"}
STACK = (
    {"id": "housing", "nominal": 50.0, "plus": 0.1, "minus": -0.1, **SPREAD},
    {"id": "bearing", "nominal": 15.0, "plus": 0.0, "minus": -0.12, **SPREAD},
    {"id": "spacer", "nominal": 33.0, "plus": 0.1, "minus": -0.1, **SPREAD},
    {"id": "ring", "nominal": 1.5, "plus": 0.05, "minus": -0.05, **SPREAD},
)


def gap(housing, bearing, spacer, ring):
    return housing - bearing - spacer - ring


def ranked(rows=STACK, limit=None, function=gap):
    inputs = tuple(str(row["id"]) for row in rows)
    study = ta.Study(
        ta.model(function, inputs=inputs, outputs=("gap [mm]",)),
        ta.Drawing.of_rows(rows),
        limits={"gap [mm]": limit or ta.Limit(lower=0.42, upper=0.58)},
        name="stack",
    )
    return study.rank("quick")


def test_a_stack_off_the_middle_says_which_nominal_moves_it_there():
    """The mean is 0.56 mm and σ = √(0.1² + 0.06² + 0.1² + 0.05²)/3 = 0.0539 mm: Φ in the middle against Φ as it is."""
    answer = ranked()
    found = answer.result.centring
    sigma = np.sqrt(0.1**2 + 0.06**2 + 0.1**2 + 0.05**2) / 3
    assert found.off == pytest.approx(0.06, abs=4 * sigma / np.sqrt(2048))
    assert abs(found.shift) == pytest.approx(found.off * 1e-3, rel=1e-6)
    assert found.source == "housing" and found.shift < 0  # all four slopes are 1 or −1: the first of the table
    # four standard errors of 2,048 units
    assert found.now == pytest.approx(norm.cdf(0.02 / sigma) - norm.cdf(-0.14 / sigma), abs=0.045)
    assert found.moved == pytest.approx(2 * norm.cdf(0.08 / sigma) - 1, abs=0.035)
    said = answer.sentences[0]
    assert (
        said.startswith("Before tightening any zone: the mean of gap lies 0.0")
        and "above the middle of its limits" in said
    )
    assert f"Moving the nominal of {found.source} by" in said
    pp, ppk = 0.08 / (3 * sigma), 0.02 / (3 * sigma)
    assert f"Pp {pp:.1f}" in said and f"Ppk {ppk:.1f}" in said


def test_the_shift_is_tried_on_the_model_and_not_taken_for_linear():
    """y = x + 40·x²: moved by −off/slope the mean is not in the middle, and the share is that of the model there."""
    row = {"id": "a", "nominal": 0.0, "plus": 0.03, "minus": -0.03, "min": 0.01, "max": 0.1, "unit": "mm", "cost": 1.0}
    answer = ranked((row,), ta.Limit(lower=-0.03, upper=0.015), lambda a: a + 40 * a**2)
    found = answer.result.centring
    x = 1e3 * (answer.result.sample.x[:, 0] + found.shift)
    y = x + 40 * x**2
    assert found.moved == pytest.approx(float(np.mean((y >= -0.03) & (y <= 0.015))))


@pytest.mark.parametrize(
    ("rows", "limit"),
    [
        (STACK, ta.Limit(upper=0.58)),  # one side has no middle
        (STACK, ta.Limit(lower=0.48, upper=0.64)),  # the mean lies in it
        (STACK, ta.Limit(lower=0.0, upper=1.0)),  # all units are inside wherever it lies
        (tuple(row | {"locked": "yes"} for row in STACK), ta.Limit(lower=0.42, upper=0.58)),  # nothing may move
    ],
)
def test_nothing_is_said_where_nothing_is_gained_or_may_move(rows, limit):
    answer = ranked(rows, limit)
    assert answer.result.centring is None
    assert not any("middle of its limits" in own for own in answer.sentences)


def test_inches_stay_inches():
    rows = tuple(row | {"unit": "in"} for row in STACK)
    answer = ranked(rows)
    assert " in costs nothing" in answer.sentences[0].replace("\n", " ")
