"""An own function without an answer in part of the widest zones: the answer stays inside, and nothing done is lost."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import page_of
from tolalloc.exceptions import InputError, SolveError
from tolalloc.study.questions import Allocation

GAP = "gap [mm]"
EFFORT = ta.Effort(
    ranking=ta.RankingEffort(units=1000, permutations=2, surrogate_units=96, level_units=100),
    allocation=ta.AllocationEffort(verification_units=512, confirmation_units=1024, error=0.5),
    is_quick=True,
)


def gap(housing, shaft, ring):
    if abs(housing - 30.1) > 0.035 or abs(ring - 5.0) > 0.04:
        raise ValueError("no root")
    return housing - shaft - ring


def study() -> ta.Study:
    row = {"unit": "mm", "plus": 0.02, "minus": -0.02, "min": 0.005, "max": 0.2, "cost": 1}
    sizes = {"housing": 30.1, "shaft": 25.0, "ring": 5.0}
    return ta.Study(
        ta.model(gap, inputs=tuple(sizes), outputs=(GAP,)),
        ta.Drawing.of_rows([{"id": name, "nominal": size, **row} for name, size in sizes.items()]),
        limits={GAP: ta.Limit(upper=0.35, show=ta.AtYield(target=0.99))},
        questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
        name="narrow",
        effort=EFFORT,
    )


@pytest.mark.slow
def test_zones_do_not_grow_into_units_without_an_answer():
    found = study().allocate().result
    assert found.met
    assert found.chosen.cost < found.free.baseline.cost
    values = found.chosen.sample.evaluation
    assert (~values.good).mean() <= 0.01


def test_a_drawing_whose_own_units_have_no_answer_is_said():
    wide = ta.Drawing.of_rows(
        [
            {
                "id": name,
                "nominal": size,
                "unit": "mm",
                "plus": 0.08,
                "minus": -0.08,
                "min": 0.005,
                "max": 0.2,
                "cost": 1,
            }
            for name, size in (("housing", 30.1), ("shaft", 25.0), ("ring", 5.0))
        ]
    )
    own = study()
    with pytest.raises(SolveError, match=r"of 512 units have no usable answer"):
        ta.Study(own.model, wide, limits=own.limits, effort=EFFORT, name="wide").allocate()


@pytest.mark.slow
@pytest.mark.parametrize(("least", "lost"), [(30.0799, 0), (30.09, "[4-9]\\d"), (31.0, 1000)])
def test_a_check_says_that_a_run_would_stop_and_for_which_unit(least, lost):
    def array_gap(housing, shaft):
        return np.where(housing < least, np.nan, housing - shaft), housing + shaft

    row = {"unit": "mm", "plus": 0.02, "minus": -0.02, "min": 0.005, "max": 0.2, "cost": 1}
    sizes = {"housing": 30.1, "shaft": 25.0}
    asked = ta.Study(
        ta.model(array_gap, inputs=sizes, outputs=(GAP, "sum [mm]")),
        ta.Drawing.of_rows([{"id": name, "nominal": size, **row} for name, size in sizes.items()]),
        limits={GAP: ta.Limit(upper=5.35), "sum [mm]": ta.Limit(upper=56.0)},
        name="narrow",
    )
    if not lost:
        assert ta.check(asked).sentence
        return
    said = rf"study narrow: {lost} of 1000 random units have no usable answer of gap \[mm\]; allowed is a share of 0.01"
    with pytest.raises(
        SolveError, match=rf"{said}, .* The first of them deviates by housing [+−].* µm, shaft [+−].* µm\."
    ):
        ta.check(asked)


@pytest.mark.parametrize("kind", [SolveError, InputError])
def test_what_was_answered_before_a_fault_is_kept(tmp_path, monkeypatch, kind):
    def fails(*_):
        raise kind("gap: no drawing.")

    monkeypatch.setattr(Allocation, "answer", fails)
    with pytest.raises(kind, match=r"gap: no drawing\. What was answered before, ranking, stands in .*run\."):
        study().run(tmp_path / "run")
    page = page_of(tmp_path / "run")
    assert "gap: no drawing." in page
    assert json.loads((tmp_path / "run" / "manifest.json").read_text(encoding="utf-8"))["questions"] == ["ranking"]


def test_nothing_stays_where_the_first_question_has_no_answer(tmp_path, monkeypatch):
    def fails(*_):
        raise SolveError("gap: no ranking.")

    monkeypatch.setattr(ta.Ranking, "answer", fails)
    with pytest.raises(SolveError, match=r"^gap: no ranking\.$"):
        study().run(tmp_path / "run")
    assert not (tmp_path / "run").exists()
