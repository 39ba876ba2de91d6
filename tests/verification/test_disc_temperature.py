"""Discs warmer than the ring: a shift of the teeth by α·R_p·ΔT, in every output, its derivatives and its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import seeded_units
from tolalloc.cli.start import new
from tolalloc.exceptions import InputError
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.design import THERMAL_EXPANSION, thermal_shift
from tolalloc.study.prepared import Prepared

COLD, WARM = ta.LoadCase("cold", disc_temperature=-5.0), ta.LoadCase("warm", disc_temperature=5.0)
KELVIN = 5.0
FREE = {"flank clearance [µm]": 3.5, "radial clearance [µm]": 8.0}


@pytest.fixture(scope="module")
def drawing() -> ta.Drawing:
    return ta.drawing("rv20e_all_sources")


@pytest.fixture(scope="module")
def model(drawing) -> ReducerModel:
    source = ta.reducer("rv20e", neglected=("disc*.tilt",), load_cases=(COLD, WARM)).set_to(FREE)
    return source.bound(drawing.errors, "test")


def units(drawing: ta.Drawing, count: int) -> np.ndarray:
    return seeded_units(drawing.errors, count, scale=0.3)


@pytest.mark.parametrize("name", ["rv20e", "rv40e"])
def test_shift_of_warm_discs_is_expansion_times_radius_times_difference(name):
    stage = ta.reducer(name).reducer.cycloid_stage
    for warmer in (-50.0, -5.0, 0.0, 5.0, 10.0):
        expected = THERMAL_EXPANSION * stage.pin_circle_radius * warmer
        assert thermal_shift(stage, warmer) == pytest.approx(expected, rel=1e-12, abs=1e-18)


def test_warm_unit_is_the_unit_whose_teeth_are_ground_on_a_wider_circle(model, drawing):
    x = units(drawing, 4)
    kernel, stage = model.kernel, model.reducer.cycloid_stage
    wider = kernel.fixed["modification.shift"] + thermal_shift(stage, KELVIN)
    ground = replace(model, kernel=replace(kernel, fixed={**kernel.fixed, "modification.shift": wider}))
    names = (ta.LOST_MOTION, ta.PRELOAD, ta.RADIAL_CLEARANCE)
    found = model.reading(tuple(ta.at(name, WARM) for name in names))(x)
    np.testing.assert_allclose(found.values, ground.reading(names)(x).values, rtol=1e-9, atol=1e-9)


def test_radial_clearance_falls_by_the_shift(model, drawing):
    names = (ta.RADIAL_CLEARANCE, *(ta.at(ta.RADIAL_CLEARANCE, own) for own in (COLD, WARM)))
    found = model.reading(names)(units(drawing, 4)).values
    shift = 1e6 * thermal_shift(model.reducer.cycloid_stage, KELVIN)
    np.testing.assert_allclose(found[:, 1:] - found[:, :1], [[shift, -shift]] * 4, atol=1e-9)


def test_condition_of_a_study_is_what_an_output_names(model, drawing):
    x = units(drawing, 2)
    source = ta.reducer("rv20e", neglected=("disc*.tilt",)).set_to({**FREE, ta.DISC_TEMPERATURE: KELVIN})
    warm = source.bound(drawing.errors, "test")
    assert warm.conditions[ta.DISC_TEMPERATURE] == KELVIN
    assert ta.DISC_TEMPERATURE not in model.conditions
    names = (ta.LOST_MOTION, ta.RADIAL_CLEARANCE)
    found = model.reading(tuple(ta.at(name, WARM) for name in names))(x)
    np.testing.assert_array_equal(found.values, warm.reading(names)(x).values)
    wider = warm.reducer_in_force.modification.shift - model.reducer.modification.shift
    assert wider == pytest.approx(thermal_shift(model.reducer.cycloid_stage, KELVIN), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("output", [ta.PEAK_TO_PEAK, ta.LOST_MOTION])
def test_derivatives_are_those_at_the_temperature(model, drawing, output):
    x, step = units(drawing, 1), 0.02
    name = ta.at(output, COLD)
    assert name in (*model.exact, *model.differentiable)
    found = model.derivatives(name, x)
    assert found.evaluation.values[0, 0] == pytest.approx(model.reading((name,))(x).values[0, 0], rel=1e-6)
    for at in range(2):
        beside = [model.at(np.array(model.present_clearances) + side * step * np.eye(2)[at]) for side in (1, -1)]
        high, low = (own.reading((name,))(x).values[0, 0] for own in beside)
        assert found.by_setting[0, at] == pytest.approx((high - low) / (2 * step), rel=0.05, abs=0.01)


def test_rankings_leave_further_temperatures_out_until_they_are_limited(model):
    assert not [name for name in model.ranked if "warm" in name or "cold" in name]
    assert len(model.outputs) == 7 * len(replace(model, load_cases=()).outputs)


def test_a_study_limits_cold_and_warm_discs_at_once(drawing):
    limits = {
        ta.PEAK_TO_PEAK: ta.Limit(upper=60),
        ta.at(ta.LOST_MOTION, COLD): ta.Limit(upper=1.3),
        ta.at(ta.FRICTION_TORQUE, WARM): ta.Limit(upper=15),
    }
    reducer = ta.reducer("rv20e", neglected=("disc*.tilt",), load_cases=(COLD, WARM))
    prepared = Prepared(study=ta.Study(reducer, drawing, limits=limits))
    assert [own.output for own in prepared.requirements][:3] == [*limits]
    other = replace(reducer, load_cases=(COLD,))
    with pytest.raises(ta.UnknownNameError):
        _ = Prepared(study=ta.Study(other, drawing, limits=limits)).requirements


def test_a_reducer_of_three_cranks_takes_a_temperature(tmp_path):
    new(tmp_path / "own", cranks=3)
    reducer = ta.reducer(next((tmp_path / "own").glob("*reducer*.toml")), load_cases=(WARM,))
    drawing = ta.drawing(next((tmp_path / "own").glob("zones.xlsx")))
    model = reducer.bound(drawing.errors, "own")
    names = (ta.RADIAL_CLEARANCE, ta.at(ta.RADIAL_CLEARANCE, WARM))
    found = model.reading(names)(units(drawing, 2)).values
    shift = 1e6 * thermal_shift(model.reducer.cycloid_stage, KELVIN)
    np.testing.assert_allclose(found[:, 0] - found[:, 1], shift, atol=1e-9)


@pytest.mark.parametrize("given", [60.0, float("nan"), "5", True])
def test_temperatures_that_cannot_be_meant_are_refused(given):
    with pytest.raises(InputError, match="temperature"):
        ta.reducer("rv20e", disc_temperature=given)
    with pytest.raises(InputError, match="load case warm: disc_temperature"):
        ta.LoadCase("warm", disc_temperature=given)
