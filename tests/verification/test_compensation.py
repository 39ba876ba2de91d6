"""Orders that a controller takes out: what is left of the peak-to-peak, its limit, and the table over the torque."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

import tolalloc as ta
from tolalloc.cli.main import app
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.outputs import compensated_peak_to_peak
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.sensitivity.measures import Measures
from tolalloc.study.commands import check
from tolalloc.study.prepared import Prepared

TORQUE = -167.0


@pytest.fixture(scope="module")
def unit() -> tuple[EquivalentModel, np.ndarray]:
    reducer = load_reducer("rv20e")
    model = EquivalentModel(reducer)
    return model, load_unit("table4").errors(model.columns, reducer.modification.deviations)


@pytest.mark.parametrize("orders", [(1,), (1, 2), (78, 80), (1, 2, 39, 78, 79, 80)])
def test_what_is_left_is_that_of_many_angles(unit, orders):
    model, errors = unit
    span, status = compensated_peak_to_peak(model, errors, TORQUE, orders)
    angle = 2 * np.pi * np.arange(6240) / 6240
    curve = model.equilibria(errors, TORQUE, angle).transmission_error[0]
    spectrum = np.fft.rfft(curve)
    spectrum[list(orders)] = 0.0
    assert status[0] == Status.CONVERGED
    more = (span[0] - np.ptp(np.fft.irfft(spectrum, curve.size))) / ARCSECOND
    assert -0.2 < more < 0.8  # on the safe side, where it is off; 90″ without compensation


def test_without_orders_it_is_the_peak_to_peak(unit):
    model, errors = unit
    span, _ = compensated_peak_to_peak(model, errors, TORQUE, ())
    assert span[0] == pytest.approx(model.extremes(errors, TORQUE).peak_to_peak[0], rel=1e-12)


def test_a_limit_is_judged_after_it():
    case = ta.LoadCase("learnt", compensated=(1, 2, 39, 40, 78, 79, 80))
    learnt = ta.at(ta.PEAK_TO_PEAK, case)
    study = ta.Study(
        ta.reducer("rv20e", load_cases=[case]),
        ta.drawing("rv20e_drawing"),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=70), learnt: ta.Limit(upper=60)},
        name="own",
    )
    assert "peak-to-peak transmission error, learnt" in learnt
    prepared = Prepared(study=study)
    x = prepared.random_units(64)
    plain, left = prepared.model.reading((ta.PEAK_TO_PEAK, learnt))(x).values.T
    assert (left < plain).mean() > 0.95
    assert 0.3 < np.median(left) / np.median(plain) < 0.8
    assert any("learnt" in line for line in check(study).teller.sentences)


@pytest.mark.parametrize(
    "given", [{"compensated": (0,)}, {"compensated": (1, 1)}, {"compensated": ("x",)}, {"compensated": 1}]
)
def test_orders_that_are_none_are_refused(given):
    with pytest.raises(InputError, match="compensated"):
        ta.LoadCase("learnt", **given)


def test_part_of_the_turn_and_of_the_orders_do_not_go_together():
    case = ta.LoadCase("learnt", compensated=(1,), output_angles=(-30, 30))
    with pytest.raises(InputError, match="not both"):
        ta.reducer("rv20e", load_cases=[case])


@pytest.mark.slow
def test_a_run_of_one_unit_leaves_the_table_of_a_controller(tmp_path):
    out = tmp_path / "run"
    arguments = ["te", "--reducer", "rv20e_liu2020", "--unit", "table4", "--out", str(out)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    with (out / "orders_over_torque.csv").open(encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    columns = json.loads((out / "orders_over_torque.json").read_text(encoding="utf-8"))
    assert len(rows) == len(columns["order [-]"]) == 14 * 8
    at = next(own for own in rows if float(own["torque [N·m]"]) == -167.0 and float(own["order [-]"]) == 1)
    reducer = load_reducer("rv20e_liu2020")
    model = EquivalentModel(reducer)
    errors = load_unit("table4").errors(model.columns, reducer.modification.deviations)
    curve = model.equilibria(errors, -167.0, 2 * np.pi * np.arange(6240) / 6240).transmission_error[0]
    wave = np.fft.rfft(curve)[1] * 2 / curve.size / ARCSECOND
    assert float(at["amplitude [arcsec]"]) == pytest.approx(abs(wave), rel=0.01)
    phase = float(at["phase of the cosine [deg]"])
    assert np.cos(np.radians(phase) - np.angle(wave)) > 0.999


@pytest.mark.slow
def test_no_products_of_hundreds_of_columns_stand_in_for_an_output_under_load():
    """Minutes went into them where a load case leads; the linear one is judged as any candidate."""
    case = ta.LoadCase("loaded", torque=-300.0)
    study = ta.Study(
        ta.reducer("rv20e", load_cases=[case]),
        ta.drawing("rv20e_drawing"),
        limits={ta.at(ta.PEAK_TO_PEAK, case): ta.Limit(upper=30)},
        name="own",
    )
    prepared = Prepared(study=study.with_effort("quick"))
    asked = Measures(
        model=prepared.model,
        errors=prepared.errors,
        limits={own.output: own.limits for own in prepared.requirements},
        target=prepared.target,
        effort=prepared.ranking_effort,
        seeds=SeedTree(1),
        largest_failed_share=0.01,
        by="dimension",
    )
    assert len(asked.response.columns) > 100
    sample = asked.sample()
    assert [own.name for own in asked.choice(sample).scores] == ["linear regression"]
