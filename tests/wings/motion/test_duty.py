"""A duty cycle: ISO 281 by hand, Miner over load cases, the makers' formula, heat that feeds back, external moment."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, tan

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import says
from tests.printed_tables import printed, row
from tolalloc.exceptions import InputError, SolveError
from tolalloc.reducers.equivalent.perfect import perfect_reducer
from tolalloc.reducers.load_case import LoadCase, load_cycle
from tolalloc.reducers.reducer.bearings import BallBearing, RollerBearing
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.motion.duty import duty_of, lever

RATED = LoadCase("rated", torque=-167.0, speed=15.0)
LIGHT = LoadCase("light", torque=-50.0, speed=30.0, share=3.0)


@pytest.fixture(scope="module")
def reducer() -> Reducer:
    return load_reducer("rv20e")


@pytest.mark.parametrize(
    ("balls", "diameter", "pitch", "catalogue"),
    [(9, 7.938, 39.04, 14_000), (8, 17.462, 72.5, 52_700), (9, 9.525, 46.0, 19_500)],
    ids=["6205", "6309", "6206"],
)
def test_load_rating_of_deep_groove_balls_is_that_of_catalogues(balls, diameter, pitch, catalogue):
    bearing = BallBearing(balls=balls, ball_diameter=diameter * 1e-3, pitch_diameter=pitch * 1e-3)
    assert bearing.load_rating == pytest.approx(catalogue, rel=0.03)


@pytest.mark.parametrize(("slenderness", "tabulated"), [(0.01, 52.1), (0.02, 60.8)])
def test_factor_of_rollers_is_that_of_the_standard(slenderness, tabulated):
    bearing = RollerBearing(rollers=20, roller_diameter=slenderness * 0.1, roller_length=1e-3, pitch_diameter=0.1)
    factor = bearing.load_rating / (1.1 * 20**0.75 * (slenderness * 100) ** (29 / 27))
    assert factor == pytest.approx(tabulated, rel=2e-3)


def test_inclined_rows_carry_their_cosine(reducer):
    bearing = reducer.friction_dimensions.crank_carrier_bearing
    level = replace(bearing, contact_angle=0.0, pitch_diameter=bearing.pitch_diameter / cos(radians(12)))
    assert bearing.load_rating == pytest.approx(level.load_rating * cos(radians(12)) ** (7 / 9), rel=1e-12)
    assert bearing.load_rating == pytest.approx(replace(bearing, rows=1).load_rating * 2 ** (7 / 9), rel=1e-12)


def test_life_of_crank_bearings_is_that_of_a_hand_calculation(reducer):
    found = duty_of(reducer, [RATED], 0.0)
    needles = next(own for own in found.bearings if own.kind == "crank_disc_bearing")
    # Statics of one disc of two: half of 167 N·m as a couple of cranks 54 mm apart, and the radial part.
    assert needles.load == pytest.approx(2_000, rel=0.1)
    by_hand = 1e6 * (8_817 / needles.load) ** (10 / 3) / (60 * 40 * 15)
    assert needles.life == pytest.approx(by_hand, rel=1e-3)
    assert needles.count == 4


def test_lives_add_up_as_miner_says(reducer):
    both = duty_of(reducer, [RATED, LIGHT], 0.0)
    alone = [duty_of(reducer, [case], 0.0) for case in (RATED, LIGHT)]
    for kind in range(3):
        damage = 0.25 / alone[0].bearings[kind].life + 0.75 / alone[1].bearings[kind].life
        assert both.bearings[kind].life == pytest.approx(1 / damage, rel=1e-12)
        assert both.bearings[kind].shares[0] == pytest.approx(0.25 / alone[0].bearings[kind].life / damage)
    assert both.mean_loss == pytest.approx(0.25 * alone[0].mean_loss + 0.75 * alone[1].mean_loss)


def test_all_bearings_together_live_less_than_the_weakest(reducer):
    found = duty_of(reducer, [RATED], 0.0)
    assert found.life < min(own.life for own in found.bearings)
    four, two, one = (own.count * own.life ** (-9 / 8) for own in found.bearings)
    assert found.life == pytest.approx((four + two + one) ** (-8 / 9))


def test_the_page_prints_the_lives_of_the_presets():
    head = (
        "| size | crank–disc, crank–carrier bearing, each [h] | all bearings together [h] | peak pressure [MPa] "
        "| lost power [W] | discs above the ring [K] |"
    )
    rows = []
    for size in ("20", "40", "80", "110", "160"):
        own = load_reducer(f"rv{size}e")
        found = duty_of(own, [LoadCase("rated", torque=-own.load.rated_torque, speed=15.0)])
        life = {bearing.kind: f"{bearing.life:,.0f}" for bearing in found.bearings}
        cranks = f"{life['crank_disc_bearing']}, {life['crank_carrier_bearing']}"
        load, heat = found.loads[0], f"{found.temperatures[-1]:.2f}"
        together, pressure = f"{found.life:,.0f}", f"{load.pressure:,.0f}"
        rows.append(row(f"RV-{size}E", cranks, together, pressure, f"{found.mean_loss:.1f}", heat))
    assert printed("validation/catalogues.md", head) == rows


def test_mean_torque_and_speed_are_the_makers(reducer):
    found = duty_of(reducer, [RATED, LIGHT], 0.0)
    assert found.mean_speed == pytest.approx(0.25 * 15 + 0.75 * 30)
    powers = (15 * 0.25 * 167 ** (10 / 3) + 30 * 0.75 * 50 ** (10 / 3)) / (15 * 0.25 + 30 * 0.75)
    assert found.mean_torque == pytest.approx(powers**0.3)
    assert found.catalogue_life == pytest.approx(6000 * 15 / 26.25 * (167 / powers**0.3) ** (10 / 3))


def test_pressure_and_force_are_those_of_the_perfect_reducer(reducer):
    loads = duty_of(reducer, [RATED], 0.0).loads[0]
    assert loads.pin_force == pytest.approx(perfect_reducer(reducer, -167.0).forces.pins.max(), rel=0.02)
    assert loads.efficiency == pytest.approx(0.89, abs=0.01)
    assert loads.loss == pytest.approx(loads.friction_torque * 2 * pi * 15 / 60)


def test_temperature_settles_where_the_loss_holds_it(reducer):
    found = duty_of(reducer, [RATED], 0.1)
    assert found.temperatures[0] == 0.0
    assert all(np.diff(found.temperatures) > 0)  # warmer discs rub more
    assert found.temperatures[-1] - found.temperatures[-2] < 1e-3
    again = duty_of(reducer, [replace(RATED, disc_temperature=found.temperatures[-1])], 0.1)
    assert 0.1 * again.mean_loss == pytest.approx(found.temperatures[-1], abs=2e-3)


def test_a_temperature_that_runs_away_is_a_sentence(reducer):
    with pytest.raises(SolveError, match="do not settle below 50 K"):
        duty_of(reducer, [replace(RATED, speed=100.0)], 2.0)


def test_a_stated_temperature_is_kept(reducer):
    found = duty_of(reducer, [replace(RATED, disc_temperature=-5.0), LIGHT])
    assert found.loads[0].disc_temperature == -5.0
    assert found.loads[1].disc_temperature == pytest.approx(found.temperatures[-1], abs=2e-3)


def test_external_moment_is_a_couple_of_the_rows(reducer):
    plain, loaded = duty_of(reducer, [RATED], 0.0), duty_of(reducer, [replace(RATED, moment=400.0)], 0.0)
    apart = (22 + 93.6 * tan(radians(40))) * 1e-3
    assert lever(reducer) == pytest.approx(apart)
    main, idle = (own.bearings[-1] for own in (loaded, plain))
    assert main.load - idle.load == pytest.approx(400 / apart, rel=1e-9)
    assert main.life < idle.life
    assert plain.tilt is None
    # A catalogue states 372 N·m/arcmin for this size, from memory.
    assert 400 / np.degrees(loaded.tilt * 60) == pytest.approx(372, rel=0.1)


@pytest.mark.parametrize("name", ["cd29", "rv20e_liu2020"])
def test_without_dimensions_only_the_makers_formula_is_left(name):
    design = load_reducer(name)
    found = duty_of(design, [LoadCase("rated", torque=-design.load.rated_torque, speed=15.0, moment=10.0)])
    assert (found.bearings, found.life, found.tilt) == ((), None, None)
    assert found.catalogue_life == pytest.approx(6000)
    assert found.loads[0].pressure > 500


@pytest.mark.parametrize(
    ("cases", "said"),
    [
        ([], "no load case"),
        ([LoadCase("own", speed=5.0)], "torque is missing"),
        ([LoadCase("own", torque=5.0)], "speed is missing"),
        ([LoadCase("own", torque=5.0, speed=5.0, output_angles=(0, 90))], "output_angles"),
        ([LoadCase("own", torque=1e6, speed=5.0)], "torque is 1000000"),
    ],
)
def test_what_is_no_duty_cycle_is_refused(reducer, cases, said):
    with pytest.raises(InputError, match=said):
        duty_of(reducer, cases)


def test_a_file_gives_load_cases(tmp_path):
    file = tmp_path / "cycle.csv"
    file.write_text("case,torque [N·m],speed [rpm],share [%],moment [N·m]\nup,-100,10,40,\ndown,80,10,60,5\n")
    up, down = load_cycle(file)
    assert (up.torque, up.moment, down.share, down.moment) == (-100.0, 0.0, 60.0, 5.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("case,torque,speed,share\na,0,5,1\n", r"row 2 \(a\): load case a: torque is 0"),
        ("case,torque,speed,share\na,5,5,1\na,5,5,1\n", "names that differ"),
        ("case,torque [kN],speed,share\na,5,5,1\n", "unit of column torque"),
        ("case,torque,share\na,5,1\n", "speed"),
        ("case,torque,speed,share\na,5,x,1\n", "row 2"),
    ],
)
def test_a_wrong_file_is_refused_in_a_sentence(tmp_path, text, said):
    file = tmp_path / "cycle.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        load_cycle(file)
    assert "cycle.csv" in str(caught.value)


def test_the_answer_says_life_pressure_and_heat(tmp_path):
    file = tmp_path / "cycle.csv"
    file.write_text("case,torque,speed,share,moment\nstart,-200,15,1,300\nrun,-100,20,4,\n")
    answer = ta.duty(file, reducer="rv20e")
    said = " ".join(answer.sentences)
    assert says(said, "duty.life", life=answer.result.life)
    assert says(said, "duty.heat")
    assert says(said, "duty.tilt", moment=300.0)
    assert answer.to_frame("load cases")["share of the time [%]"].tolist() == [20.0, 80.0]
    assert len(answer.to_frame("bearings")) == 3
