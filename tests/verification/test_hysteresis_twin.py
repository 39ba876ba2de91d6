"""Torque against twist with rolling bearings, against the dense twin: as secants, as bearings, element by element."""

from __future__ import annotations

import tomllib
from functools import cache

import numpy as np
import pytest

from tests.builders import prepared, seeded_units
from tests.random_cases import is_angle
from tests.verification.dense_twin import DenseModel, dense_model, least_energy
from tests.verification.dense_twin_bearings import standing, turning, with_bearings, with_secants
from tolalloc.reading.files import validated
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES, hysteresis_loop, own_load_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.perfect import exact_unit
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.reducer.records import ReducerRecord

ORDERS = (1, 2)
ANGLES = np.array([0.41, 2.3, 0.0, 5.1])
REDUCERS = ("rv20e", "rv40e", "three cranks")


@cache
def reducer_of(name: str) -> Reducer:
    """A preset, or one of the RV-80E's size with three cranks, loose needles and preloaded tapered rollers."""
    if name != "three cranks":
        return load_reducer(name)
    table = tomllib.loads((PRESETS / "rv80e.reducer.toml").read_text(encoding="utf-8"))
    del table["catalogue"]
    table["crank_count"] = 3
    table["stiffness"]["crank_disc_bearing"]["clearance_um"] = 8
    table["stiffness"]["crank_carrier_bearing"]["preload_n"] = 600
    return validated(ReducerRecord, table, "three cranks").reducer()


def rows_of(model: EquivalentModel) -> np.ndarray:
    """Exact parts, and parts that are off by some 2 µm or 20 µrad."""
    generator, exact = np.random.default_rng(20), exact_unit(model)
    size = np.array([2e-5 if is_angle(name) else 2e-6 for name in model.columns])
    off = np.array([not name.startswith("modification.") and "clearance" not in name for name in model.columns])
    return np.concatenate([exact, exact + off * size * generator.normal(size=exact.shape)])


def units_of(model: EquivalentModel) -> list[dict[str, float]]:
    return [dict(zip(model.columns, row.tolist(), strict=True)) for row in rows_of(model)]


def rotation(model: DenseModel) -> float:
    """The carrier's rotation, which alone has a load."""
    q = least_energy(model)
    assert model.imbalance(q) < 1e-9
    return float(q[np.flatnonzero(model.load)[0]])


QUICK = [("rv20e", 1, ANGLES[0])]
CASES = [
    pytest.param(name, unit, angle, marks=() if (name, unit, angle) in QUICK else pytest.mark.slow)
    for name in REDUCERS
    for unit in (0, 1)
    for angle in ANGLES
]
"""Reducer, number of the unit, carrier angle."""


@pytest.mark.parametrize(("name", "unit", "angle"), CASES)
def test_the_loop_is_the_twins_with_the_secants_of_the_theory_page(name, unit, angle):
    """What is promised of every loop: both directions, from backlash to rated torque; measured 3e-11."""
    reducer = reducer_of(name)
    model = EquivalentModel(reducer, orders=ORDERS)
    loop = hysteresis_loop(model, rows_of(model)[[unit]], np.array([angle]))
    for level, torque in enumerate(loop.torque.tolist()):
        twin = rotation(dense_model(with_secants(reducer, torque), units_of(model)[unit], torque, angle, ORDERS))
        assert loop.twist[0, level, 0] == pytest.approx(twin, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "unit", "angle"), CASES)
def test_the_loop_under_own_loads_is_that_of_nonlinear_bearings(name, unit, angle):
    """The same against bearings whose force is their own function of displacement; measured 1.8e-7."""
    reducer = reducer_of(name)
    model = EquivalentModel(reducer, orders=ORDERS)
    loop = own_load_loop(model, rows_of(model)[[unit]], np.array([angle]))
    for level, torque in enumerate(loop.torque.tolist()):
        twin = rotation(with_bearings(reducer, units_of(model)[unit], torque, angle, turning, ORDERS))
        assert loop.twist[0, level, 0] == pytest.approx(twin, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "lost", "stiff"), [("rv20e", -0.0028, 0.0042), ("rv40e", -0.0018, 0.0033)])
def test_what_secants_leave_out_of_exact_parts(size, lost, stiff):
    """Under own loads the lost motion is 0.2 to 0.3 % smaller, the torsional stiffness 0.3 to 0.4 % larger."""
    model = EquivalentModel(reducer_of(size))
    secants, own = (loop(model, exact_unit(model), TURN_ANGLES) for loop in (hysteresis_loop, own_load_loop))
    assert own.lost_motion[0] / secants.lost_motion[0] - 1 == pytest.approx(lost, abs=1e-4)
    assert own.torsional_stiffness[0] / secants.torsional_stiffness[0] - 1 == pytest.approx(stiff, abs=1e-4)


@pytest.mark.slow
def test_what_secants_leave_out_of_units_of_the_baseline_drawing():
    """Part errors load the bearings without torque, which stiffens them: lost motion is less than secants say."""
    bound = prepared(reducer={"name": "rv20e"}, name="own loads")
    kernel = bound.model.kernel
    units = kernel.errors(seeded_units(bound.errors, 20))
    secants, own = (loop(kernel.model, units, TURN_ANGLES) for loop in (hysteresis_loop, own_load_loop))
    lost = own.lost_motion / secants.lost_motion - 1
    assert lost.max() == pytest.approx(-0.019, abs=0.001)
    assert np.median(lost) == pytest.approx(-0.045, abs=0.001)
    assert lost.min() == pytest.approx(-0.075, abs=0.001)
    assert np.median(own.torsional_stiffness / secants.torsional_stiffness) == pytest.approx(1.0026, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rv20e", "rv40e"])
def test_where_the_elements_stand_matters_less(name):
    """Every row of rollers and balls anywhere in its ring, eight times: below 0.06 % of the twist at rated torque."""
    reducer, generator = reducer_of(name), np.random.default_rng(3)
    model = EquivalentModel(reducer, orders=ORDERS)
    for unit, row in zip(units_of(model), rows_of(model), strict=True):
        loop = own_load_loop(model, row[np.newaxis], ANGLES[:1], (1.0,))
        for torque, twist in zip(loop.torque.tolist(), loop.twist[0, :, 0], strict=True):
            found = [
                rotation(with_bearings(reducer, unit, torque, ANGLES[0], standing(generator), ORDERS)) for _ in range(8)
            ]
            assert np.abs(np.array(found) / twist - 1).max() < 6e-4
            assert np.ptp(found) > 0
