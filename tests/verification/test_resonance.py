"""The first resonance of the load: against natural modes, in commands, and where a file states it wrongly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import tolalloc as ta
from tests.builders import at_constant_contact
from tests.verification.test_ring import on
from tolalloc.cli.main import app
from tolalloc.exceptions import SolveError, TolallocError
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.perfect import exact_unit
from tolalloc.reducers.equivalent.resonance import Resonance, orders_of, resonance_of
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.reducer.housing import Housing
from tolalloc.reports.portraits.reducer import resonance_sentence
from tolalloc.study.commands import check
from tolalloc.wings.motion.motion import inertia_of
from tolalloc.wings.motion.speeds import modes


@pytest.mark.parametrize("name", ["rv20e", "rv80e"])
def test_it_is_the_lowest_mode_of_a_heavy_output(name):
    """The modes have all masses and stiffnesses; beside ten times the inertia of what is inside they are one spring."""
    reducer = at_constant_contact(load_reducer(name))
    model, torque, inertia = EquivalentModel(reducer), -reducer.load.rated_torque, 50.0
    angles = 2 * np.pi * np.arange(6) / 6
    found = modes(model, exact_unit(model)[0], torque, inertia_of(reducer, output_inertia=inertia), angles)
    mean = float(found.frequency[:, 0].mean())
    assert resonance_of(reducer, torque, inertia).frequency == pytest.approx(mean, rel=0.02)
    assert found.carrier_share[:, 0].min() > 0.95


def test_it_falls_with_the_root_of_the_inertia_and_with_a_ring_that_gives():
    reducer = load_reducer("rv20e")
    one, four = (resonance_of(reducer, -167.0, inertia).frequency for inertia in (1.0, 4.0))
    assert one == pytest.approx(2 * four)
    # Two springs in series: 1/f² adds.
    soft = resonance_of(on(reducer, Housing(turn=1e5)), -167.0, 1.0)
    ring = np.sqrt(1e5) / (2 * np.pi)
    assert soft.frequency == pytest.approx((one**-2 + ring**-2) ** -0.5, rel=0.02)


def test_an_order_meets_it_where_its_waves_come_as_often():
    found = Resonance(frequency=55.0, stiffness=1.0, ratio=81.0)
    assert found.input_speed(162) == pytest.approx(55.0 * 60 * 81 / 162)
    assert list(found.met((78, 156, 162, 240), 1720.0)) == [240, 162, 156]
    assert not found.met((39,), 1000.0)
    assert {1, 39, 40, 156, 240, 2 * load_reducer("rv20e").ratio} <= {*orders_of(load_reducer("rv20e"))}


def test_a_sentence_says_which_orders_and_where_or_that_there_is_none():
    reducer = load_reducer("rv20e")
    assert resonance_sentence(reducer, -167.0, (39,), 1000.0) == ""
    loaded = replace(reducer, load=replace(reducer.load, inertia=10.0))
    speed = resonance_of(loaded, -167.0, 10.0).input_speed(78)
    said = resonance_sentence(loaded, -167.0, (39, 78), 1.01 * speed)
    assert f"order 78 of the output excites it at {speed:,.0f} rpm" in said
    assert "no order of the gear train excites it up to 10 rpm" in resonance_sentence(loaded, -167.0, (39, 78), 10.0)
    assert "orders 78 and 39 of the output excite it at" in resonance_sentence(loaded, -167.0, (39, 78), None)


def test_exact_parts_without_a_stiffness_are_said_and_end_no_report():
    """Under a hundred thousand times the rated torque no equilibrium lies within small displacements."""
    reducer = load_reducer("rv20e_liu2020")
    with pytest.raises(SolveError, match="no stiffness"):
        resonance_of(reducer, -1.67e7, 5.0)
    loaded = replace(reducer, load=replace(reducer.load, inertia=5.0))
    assert resonance_sentence(loaded, -1.67e7, (39,), None).startswith("The first resonance is not known: ")


def with_load(tmp_path, lines: str) -> str:
    path = tmp_path / "own.reducer.toml"
    text = (PRESETS / "rv20e.reducer.toml").read_text()
    path.write_text(text.replace("[load]", f"[load]\n{lines}", 1))
    return str(path)


def test_commands_say_it(tmp_path):
    path = with_load(tmp_path, "inertia_kgm2 = 5\ninput_speed_rpm = 2000")
    assert "the first resonance is at" in CliRunner().invoke(
        app, ["te", "--reducer", path, "--unit", "exact"]
    ).output.replace("\n", " ")
    study = ta.Study(
        ta.reducer(path), ta.drawing("rv20e_drawing"), limits={ta.PEAK_TO_PEAK: ta.Limit(upper=70)}, name="own"
    )
    assert any("the first resonance is at" in line for line in check(study).teller.sentences)


def test_a_duty_cycle_says_which_orders_meet_it_up_to_its_fastest_load_case(tmp_path):
    path, cycle = with_load(tmp_path, "inertia_kgm2 = 5"), tmp_path / "cycle.csv"
    cycle.write_text("case,torque [N·m],speed [rpm],share [%]\nwork,-100,20,100\n", encoding="utf-8")
    said = CliRunner().invoke(app, ["duty", str(cycle), "--reducer", path]).output.replace("\n", " ")
    reducer = load_reducer(path)
    found, fastest = resonance_of(reducer, -100.0, 5.0), 20.0 * reducer.ratio
    slowest = next(iter(found.met(orders_of(reducer), fastest).values()))
    assert f"{found.frequency:.3g} Hz" in said
    assert f"excite it at {slowest:,.0f}" in said


@pytest.mark.parametrize("line", ["inertia_kgm2 = -1", "inertia_kgm2 = 'heavy'", "input_speed_rpm = 0"])
def test_a_wrong_load_is_refused_by_name(tmp_path, line):
    with pytest.raises(TolallocError, match=f"load.{line.split(' ')[0]}"):
        load_reducer(with_load(tmp_path, line))


def test_what_is_elastic_of_an_error_under_load_is_said_and_what_is_not_is_not(tmp_path):
    case = ta.LoadCase("loaded", torque=-167.0)
    path = tmp_path / "soft.reducer.toml"
    text = (PRESETS / "rv20e.reducer.toml").read_text()
    path.write_text(f"{text}\n[housing]\ntilt_along_nm_per_arcmin = 10\n")
    for reducer, said in ((str(path), True), ("rv20e", False)):
        study = ta.Study(
            ta.reducer(reducer, load_cases=[case]),
            ta.drawing("rv20e_drawing"),
            limits={ta.PEAK_TO_PEAK: ta.Limit(upper=70), ta.at(ta.PEAK_TO_PEAK, case): ta.Limit(upper=70)},
            name="own",
        )
        sentences = check(study).teller.sentences
        assert any("at 167 N·m is elastic" in own for own in sentences) is said
        assert not any("at 1 N·m is elastic" in own for own in sentences)
