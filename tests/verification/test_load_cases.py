"""Several load cases at once: each the model under its own torque, temperature and angles; their worst and mean."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import seeded_units
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reducers.model import ReducerModel
from tolalloc.study.prepared import Prepared

RATED = ta.LoadCase("rated", torque=-167.0, share=3.0)
BACK = ta.LoadCase("reversed", torque=167.0, share=1.0)
WARM = ta.LoadCase("warm", disc_temperature=5.0)
QUARTER = ta.LoadCase("quarter", output_angles=(0, 90))
CASES = (RATED, BACK, WARM)
PRESSURE = "peak pressure, rated torque [MPa]"


def bound(drawing: ta.Drawing, **options) -> ReducerModel:
    return ta.reducer("rv20e", neglected=("disc*.tilt",), **options).bound(drawing.errors, "test")


@pytest.fixture(scope="module")
def drawing() -> ta.Drawing:
    return ta.drawing("rv20e_drawing")


@pytest.fixture(scope="module")
def model(drawing) -> ReducerModel:
    return bound(drawing, load_cases=(*CASES, QUARTER))


@pytest.fixture(scope="module")
def units(drawing) -> np.ndarray:
    return seeded_units(drawing.errors, 6)


@pytest.mark.slow
def test_output_under_a_load_case_is_that_of_the_study_under_its_conditions(model, drawing, units):
    alone = {
        RATED: bound(drawing, torque=-167.0),
        BACK: bound(drawing, torque=167.0),
        WARM: bound(drawing, disc_temperature=5.0),
    }
    names = tuple(ta.at(ta.PEAK_TO_PEAK, case) for case in alone)
    found = model.reading((*names, ta.PEAK_TO_PEAK))(units)
    for at, own in enumerate(alone.values()):
        np.testing.assert_array_equal(found.values[:, at], own.reading((ta.PEAK_TO_PEAK,))(units).values[:, 0])
    np.testing.assert_array_equal(found.values[:, 3], model.kernel(units).values[:, 0])
    assert np.ptp(found.values, axis=1).min() > 1.0  # the load cases differ


def test_worst_and_mean_are_those_of_the_load_cases_unit_by_unit(drawing, units):
    model = bound(drawing, load_cases=CASES)
    names = tuple(ta.at(ta.PEAK_TO_PEAK, case) for case in CASES)
    found = model.reading((ta.worst(ta.PEAK_TO_PEAK), *names, ta.mean(ta.PEAK_TO_PEAK)))(units).values
    np.testing.assert_array_equal(found[:, 0], found[:, 1:4].max(axis=1))
    np.testing.assert_allclose(found[:, 4], found[:, 1:4] @ [0.6, 0.2, 0.2], rtol=1e-14)


def test_the_worst_stiffness_is_the_least(drawing, units):
    cold = ta.LoadCase("cold", disc_temperature=-5.0)
    model = bound(drawing, load_cases=(cold, WARM))
    names = (ta.worst(ta.TORSIONAL_STIFFNESS), *(ta.at(ta.TORSIONAL_STIFFNESS, case) for case in (cold, WARM)))
    found = model.reading(names)(units).values
    np.testing.assert_array_equal(found[:, 0], found[:, 1:].min(axis=1))


def test_loads_under_a_torque_are_those_of_the_torque(model, drawing, units):
    half = ta.LoadCase("half", torque=-167.0 / 2)
    own = bound(drawing, torque=-1.0, load_cases=(half, RATED))
    names = (ta.at(PRESSURE, half), ta.at(PRESSURE, RATED), PRESSURE)
    assert names[0] == "peak pressure, half [MPa]"
    found = own.reading(names)(units).values
    np.testing.assert_array_equal(found[:, 1], found[:, 2])
    assert np.all((found[:, 0] > 0.5 * found[:, 2]) & (found[:, 0] < found[:, 2]))  # Hertz: less than in proportion


def test_a_load_case_offers_what_it_changes(model):
    offered = {name for name in model.outputs if "rated [" in name or "quarter" in name}
    assert ta.at(ta.PEAK_TO_PEAK, RATED) in offered
    assert ta.at(ta.PEAK_TO_PEAK, QUARTER) in offered
    assert ta.at(ta.LOST_MOTION, RATED) not in model.outputs  # its torques are ±3 % of the rated one by definition
    assert ta.at(ta.LOST_MOTION, WARM) in model.outputs
    assert ta.worst(ta.LOST_MOTION) not in model.outputs  # of one load case


@pytest.mark.slow
def test_transmission_error_within_a_part_of_the_turn(drawing, units):
    whole = ta.LoadCase("whole", output_angles=(0, 360))
    parts = [ta.LoadCase(f"part {at}", output_angles=(90 * at, 90 * at + 90)) for at in range(4)]
    model = bound(drawing, load_cases=(whole, *parts))
    names = (ta.PEAK_TO_PEAK, *(ta.at(ta.PEAK_TO_PEAK, case) for case in model.load_cases))
    found = model.reading(names)(units[:3]).values
    np.testing.assert_allclose(found[:, 1], found[:, 0], atol=0.25)  # the search looks between tabulated angles too
    assert np.all(found[:, 1] <= found[:, 0] + 1e-9)
    assert np.all(found[:, 2:] <= found[:, [1]] + 1e-9)
    kernel = model.kernel
    curve = kernel.model.equilibria(kernel.errors(units[:3]), kernel.torque, np.radians(np.linspace(90, 180, 937)))
    by_hand = np.ptp(curve.transmission_error, axis=1) / np.radians(1 / 3600)
    np.testing.assert_allclose(found[:, 3], by_hand, rtol=1e-9)
    assert names[1] not in (*model.exact, *model.differentiable)


def test_derivatives_of_worst_and_mean_are_those_of_the_load_cases(drawing, units):
    model = bound(drawing, load_cases=(RATED, WARM), flank_clearance=(1, 8))
    parts = [model.derivatives(ta.at(ta.PEAK_TO_PEAK, case), units) for case in (RATED, WARM)]
    values = np.hstack([part.evaluation.values for part in parts])
    mean, worst = (model.derivatives(name, units) for name in (ta.mean(ta.PEAK_TO_PEAK), ta.worst(ta.PEAK_TO_PEAK)))
    for field in ("by_column", "by_setting"):
        rated, warm = (getattr(part, field) for part in parts)
        np.testing.assert_allclose(getattr(mean, field), 0.75 * rated + 0.25 * warm, rtol=1e-12)
        larger = (values[:, :1] > values[:, 1:]).astype(float)
        np.testing.assert_allclose(getattr(worst, field), larger * rated + (1 - larger) * warm, rtol=1e-12)
    column = int(np.abs(worst.by_column[0]).argmax())
    beside = [units[:1] + side * 1e-8 * np.eye(units.shape[1])[column] for side in (1, -1)]
    high, low = (model.reading((ta.worst(ta.PEAK_TO_PEAK),))(own).values[0, 0] for own in beside)
    assert worst.by_column[0, column] == pytest.approx((high - low) / 2e-8, rel=0.01)


def test_a_study_limits_load_cases_and_their_worst(drawing):
    limits = {
        ta.worst(ta.PEAK_TO_PEAK): ta.Limit(upper=60),
        ta.at(PRESSURE, RATED): ta.Limit(upper=1500),
    }
    reducer = ta.reducer("rv20e", neglected=("disc*.tilt",), load_cases=CASES)
    prepared = Prepared(study=ta.Study(reducer, drawing, limits=limits))
    assert [own.output for own in prepared.requirements][:2] == [*limits]
    other = ta.reducer("rv20e", neglected=("disc*.tilt",))
    with pytest.raises(UnknownNameError, match="worst load case"):
        _ = Prepared(study=ta.Study(other, drawing, limits=limits)).requirements


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"torque": 0.0}, "torque"),
        ({"torque": "5"}, "torque"),
        ({"output_angles": (90, 0)}, "output_angles"),
        ({"output_angles": (0, 361)}, "output_angles"),
        ({"speed": -1.0}, "speed"),
        ({"share": 0.0}, "share"),
    ],
)
def test_a_load_case_that_cannot_be_is_refused(given, named):
    with pytest.raises(InputError, match=f"load case own: {named}"):
        ta.LoadCase("own", **given)


@pytest.mark.parametrize(
    "name", ["", "a [b]", 5, "worst load case", "mean of load cases", "rated torque", "old less in force"]
)
def test_a_load_case_needs_a_name_that_an_output_can_bear(name):
    with pytest.raises(InputError, match="name"):
        ta.LoadCase(name)


@pytest.mark.parametrize("given", [5, [5.0], (RATED, RATED)])
def test_load_cases_of_a_reducer_are_refused_where_they_cannot_be(given):
    with pytest.raises(InputError, match="load_cases"):
        ta.reducer("rv20e", load_cases=given)


def test_a_torque_beyond_the_reducer_is_refused_by_its_load_case():
    with pytest.raises(InputError, match="load case stop of reducer rv20e: torque"):
        ta.reducer("rv20e", load_cases=(ta.LoadCase("stop", torque=1e5),))


@pytest.mark.parametrize("given", ["peak-to-peak", 5, ""])
def test_an_output_without_a_unit_has_no_name_under_a_load_case(given):
    for name in (lambda: ta.at(given, WARM), lambda: ta.worst(given), lambda: ta.mean(given)):
        with pytest.raises(InputError, match="output"):
            name()
    with pytest.raises(InputError, match="case"):
        ta.at(ta.PEAK_TO_PEAK, "warm")


@pytest.mark.parametrize(
    ("name", "table"), [("rv80e", "rv80e_drawing"), pytest.param("cd29", "cd29_drawing", marks=pytest.mark.slow)]
)
def test_three_cranks_and_a_single_stage_take_load_cases(name, table):
    drawing = ta.drawing(table)
    rated = ta.reducer(name).reducer.load.rated_torque
    cases = (ta.LoadCase("rated", torque=-rated), ta.LoadCase("reversed", torque=rated, disc_temperature=3.0))
    model = ta.reducer(name, neglected=("disc*.tilt",), load_cases=cases).bound(drawing.errors, "test")
    names = (ta.worst(ta.PEAK_TO_PEAK), ta.at(ta.LOST_MOTION, cases[1]), ta.at(PRESSURE, cases[0]), PRESSURE)
    found = model.reading(names)(0.3 * seeded_units(drawing.errors, 2))
    assert found.good.all()
    np.testing.assert_allclose(found.values[:, 2], found.values[:, 3], rtol=1e-12)


def test_a_duty_cycle_file_gives_a_reducer_its_load_cases(tmp_path):
    file = tmp_path / "cycle.csv"
    file.write_text("case,torque [N·m],speed [rpm],share [%]\nup,-100,10,40\ndown,80,10,60\n")
    assert [case.name for case in ta.reducer("rv20e", load_cases=file).load_cases] == ["up", "down"]
