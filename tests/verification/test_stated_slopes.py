"""Slopes that are stated of an own function: units may refute them, and what rests on them says so."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import ZONE_OF_A_LENGTH, says, study_of_lengths

ONE = {"a": (1, 1), "b": (1, 1)}


def bound(function, slopes, **rows):
    """Return an own function of two lengths with stated slopes at a drawing."""
    own = [{"id": name, "nominal": 5.0, **ZONE_OF_A_LENGTH, **rows} for name in "ab"]
    model = ta.model(function, inputs=("a", "b"), outputs=("y [mm]",), slopes={"y [mm]": slopes})
    return model.bound(ta.Drawing.of_rows(own).errors, "test")


@pytest.mark.parametrize(
    ("function", "slopes"),
    [
        (lambda a, b: abs(a - 5) + abs(b - 5), ONE),
        (lambda a, b: a + 2 * b, ONE),
        (lambda a, b: a - b, ONE),
        (lambda a, b: a + b + 0.01 * np.sin(400 * a), ONE),
        (lambda a, b: np.maximum(a, b), {"a": (0, 0.4), "b": (0, 1)}),
        (lambda a, b: (a - 5) ** 2 + b, {"a": (-0.01, 0.01), "b": (1, 1)}),
    ],
    ids=["absolute values", "too flat", "wrong sign", "ripple", "larger of two", "square"],
)
def test_slopes_that_units_refute_bound_nothing(function, slopes):
    assert "slopes of y [mm] that its units refute" in bound(function, slopes).unbounded("y [mm]")


@pytest.mark.parametrize(
    ("function", "slopes", "rows"),
    [
        (lambda a, b: abs(a - 5) + abs(b - 5), {"a": (-1, 1), "b": (-1, 1)}, {}),
        (lambda a, b: a + b, ONE, {}),
        (lambda a, b: a + b, ONE, {"unit": "in", "plus": 0.001, "minus": -0.001, "min": 0.0005, "max": 0.01}),
        (lambda a, b: np.maximum(a, b), {"a": (0, 1), "b": (0, 1)}, {}),
        (lambda a, b: (a - 5) ** 2 + b, {"a": (-0.08, 0.08), "b": (1, 1)}, {}),  # ±0.02 mm, looked at to ±0.04 mm
    ],
    ids=["absolute values", "sum", "inches", "larger of two", "square"],
)
def test_slopes_that_are_right_are_not_refuted(function, slopes, rows):
    assert not bound(function, slopes, **rows).unbounded("y [mm]")


@pytest.mark.slow
def test_a_proof_says_that_it_rests_on_stated_slopes_and_is_refused_where_they_are_wrong():
    rows = [{"id": name, **ZONE_OF_A_LENGTH} for name in "abc"]
    study = study_of_lengths(ta.Drawing.of_rows(rows), questions=[ta.Allocation(front=False, what_if=False, boxes=50)])

    def stated(slope):
        right = {"length [mm]": dict.fromkeys("abc", (slope, slope))}
        model = ta.model(study.model.function, inputs=tuple("abc"), outputs=("length [mm]",), slopes=right)
        return ta.Study(model, study.drawing, limits=study.limits, questions=study.questions, effort="quick")

    answer = stated(1).allocate()
    found = answer.sentences
    assert answer.result.proven.rests_on == "the stated slopes"
    assert says(found, "allocation.proven", rests=", provided that the stated slopes hold") or says(
        found, "allocation.proven_nothing"
    )
    with pytest.raises(ta.InputError, match=r"no bound can be proven, as model .* its units refute"):
        stated(0.9).allocate()
