"""A function of one's own, ranked and allocated: the one-way clutch of Choi, Park & Salisbury 2000."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import says
from tolalloc.allocation.space.effort import QUICK_ALLOCATION
from tolalloc.reports.portrait import portrait_of

ROOT = Path(__file__).parents[2]
CASES = json.loads((ROOT / "tests" / "validation" / "allocation.json").read_text(encoding="utf-8"))["problems"]


@pytest.fixture(scope="module")
def study():
    sys.path.insert(0, str(ROOT / "studies"))
    try:
        return importlib.import_module("choi2000_clutch").study
    finally:
        sys.path.remove(str(ROOT / "studies"))


@pytest.fixture(scope="module")
def found(study):
    own = ta.Study(
        study.model,
        study.drawing,
        limits=study.limits,
        questions=[ta.Allocation(what_if=False)],
        largest_failed_share=study.largest_failed_share,
        effort=ta.Effort(allocation=QUICK_ALLOCATION),
    )
    return own.allocate().result


def published():
    return next(case for case in CASES if case["id"] == "clutch_choi2000")["results"]["0"]["true_optimum"]


def test_the_cost_is_the_published_optimum(found):
    assert found.met
    assert found.cost == pytest.approx(published()["total"], rel=1e-8)


def test_the_bound_certifies_it(found):
    assert found.bound <= found.cost * (1 + 1e-9)
    assert found.cost / found.bound - 1 < 1e-8


def test_zones_and_processes_are_the_published_ones(found):
    zones = np.array([source.zone for source in found.drawing.sources])
    assert zones / 2 * 1e3 == pytest.approx(published()["t"], rel=1e-4)
    assert found.chosen.processes == ("rough", "grind", "lap", "press")


def test_the_yield_of_fresh_units_stands_beside_the_guarantee(found):
    """√Σ(Dt)² = 0.035 with σ = t/3 keeps 99.73 % of a linear normal output; the angle bends, so some fewer are kept."""
    assert 0.97 < found.chosen.achieved.estimate < 0.9973


def test_a_function_of_single_numbers_gives_what_one_of_arrays_gives(study):
    from math import acos

    def one(hub, roller, other, cage):
        rollers = (roller + other) / 2
        return acos((hub + rollers) / (cage - rollers))

    errors = study.drawing.errors
    alone = ta.model(one, inputs=study.model.inputs, outputs=study.model.outputs).bound(errors, "test")
    together = study.model.bound(errors, "test")
    x = np.random.default_rng(1).uniform(-1e-4, 1e-4, (20, 4))
    assert alone(x).values == pytest.approx(together(x).values, rel=1e-14)


def test_a_jacobian_is_used_where_there_is_one(study):
    errors = study.drawing.errors

    def jacobian(hub, roller, other, cage):
        rollers = (roller + other) / 2
        cosine = (hub + rollers) / (cage - rollers)
        outer = -1 / np.sqrt(1 - cosine**2)
        by_rollers = (1 / (cage - rollers) + (hub + rollers) / (cage - rollers) ** 2) / 2
        return [
            outer / (cage - rollers),
            outer * by_rollers,
            outer * by_rollers,
            -outer * (hub + rollers) / (cage - rollers) ** 2,
        ]

    exact = ta.model(
        study.model.function, inputs=study.model.inputs, outputs=study.model.outputs, jacobian=jacobian
    ).bound(errors, "test")
    x = np.zeros((1, 4))
    printed = [-0.10393848030651141, -0.10354907401123048, -0.10354907401123048, 0.10315966771594956]
    assert exact.derivatives("contact angle [rad]", x).by_column[0] / 1e3 == pytest.approx(printed, rel=1e-9)
    differences = study.model.bound(errors, "test").derivatives("contact angle [rad]", x)
    assert differences.by_column[0] / 1e3 == pytest.approx(printed, rel=1e-7)


def test_samples_without_an_answer_are_counted(study):
    far = study.model.bound(study.drawing.errors, "test")(np.array([[0.0, 0.0, 0.0, 0.0], [2e-3, 2e-3, 2e-3, -2e-3]]))
    assert far.status.tolist() == [0, 1]


def test_a_source_that_is_no_input_is_refused(study):
    model = ta.model(lambda hub: hub, inputs=("hub",), outputs=("y [mm]",))
    with pytest.raises(ta.UnknownNameError, match="unknown source 'roller'; known is hub"):
        model.bound(study.drawing.errors, "study x")


class Engine:
    """Stands for the library that runs Functional Mock-up Units; the gap at the end of each simulation."""

    @staticmethod
    def simulate_fmu(path, start_values, output, stop_time):
        if start_values["shaft_mm"] > 10.0:
            raise RuntimeError("no solution")
        return {"gap_mm": [0.0, start_values["housing_mm"] - start_values["shaft_mm"]]}


def test_a_mock_up_unit_is_a_function_of_its_parameters(monkeypatch, tmp_path):
    unit = tmp_path / "gap.fmu"
    unit.write_bytes(b"")
    monkeypatch.setitem(sys.modules, "fmpy", Engine())
    names = {"housing": "housing_mm", "shaft": "shaft_mm"}
    model = ta.from_fmu(str(unit), inputs=names, outputs={"gap [mm]": "gap_mm"})
    row = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 1.0}
    drawing = ta.Drawing.of_rows([{"id": "housing", "nominal": 10.0, **row}, {"id": "shaft", "nominal": 9.9, **row}])
    found = model.bound(drawing.errors, "test")(np.array([[0.0, 0.0], [0.0, 0.05e-3], [0.0, 0.2e-3]]))
    assert model.name == "gap"
    assert found.values[:2, 0] == pytest.approx([0.1, 0.05])
    assert found.status.tolist() == [0, 0, 1]


def test_without_the_extra_a_mock_up_unit_is_refused_in_one_sentence(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "fmpy", None)
    with pytest.raises(ta.InputError, match=r"need the optional extra: pip install -e '\.\[fmu\]'"):
        ta.from_fmu(str(tmp_path / "gap.fmu"), inputs={"a": "a"}, outputs={"b [mm]": "b"})


@pytest.mark.slow
def test_grades_of_a_model_without_settings(study):
    own = ta.Study(
        study.model,
        study.drawing,
        limits=study.limits,
        questions=[ta.Allocation(grades=True, what_if=False)],
        effort=ta.Effort(allocation=QUICK_ALLOCATION),
    )
    answer = own.allocate()
    found = answer.result
    assert found.met
    assert all(source.grade for source in found.drawing.sources)
    assert found.cost >= published()["total"]
    assert says(str(answer), "allocation.title", model="contact angle")


def test_what_a_function_takes_and_returns_is_checked(study):
    errors = study.drawing.errors
    inputs = study.model.inputs
    for function, words in (
        (lambda hub: hub, "cannot be called with 4 values, inputs and settings"),
        (lambda *sizes: [1.0, 2.0, 3.0], "returned 3 values; asked for are 1"),
    ):
        model = ta.model(function, inputs=inputs, outputs=("y [mm]",)).bound(errors, "test")
        with pytest.raises(ta.InputError, match=words):
            model(np.zeros((5, 4)))
    with pytest.raises(ta.InputError, match=r"such as \('y \[mm\]',\)"):
        ta.model(lambda hub: hub, inputs=("hub",), outputs="y [mm]")


def test_a_row_of_process_costs_has_five_entries(study):
    row = {"id": "hub", "plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 1.0}
    drawing = ta.Drawing.of_rows([row], costs={"hub": [("turn", 5, 0.5, 0.06)]})
    model = ta.model(lambda hub: hub, inputs=("hub",), outputs=("y [mm]",))
    with pytest.raises(ta.InputError, match="name, A, B, smallest t, largest t"):
        ta.Study(model, drawing, limits={"y [mm]": ta.Limit(upper=1.0)}).allocate("quick")


def test_inputs_without_a_nominal_size_are_named():
    row = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 3.0}
    gap = ta.model(lambda housing, shaft: housing - shaft, inputs=("housing", "shaft"), outputs=("gap [mm]",))
    drawing = ta.Drawing.of_rows([{"id": "housing", "nominal": 20.0, **row}, {"id": "shaft", **row}])
    (said,) = portrait_of(gap.bound(drawing.errors, "study")).assumptions
    assert said == "no nominal size on the drawing, taken as deviations from 0: shaft"
