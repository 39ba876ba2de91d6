"""Measured curves and loops: repairs are counted, resampling keeps shape and noise, what is written is read back."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from studies.published.measurement_folder import write_measurements
from tests.builders import written
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.unit_file import BuiltUnit, load_units, units_text
from tolalloc.wings.bench.measurements import (
    MeasuredCurve,
    MeasuredLoop,
    MeasuredPeakToPeak,
    Measurements,
    load_measurements,
)
from tolalloc.wings.bench.readings import FULL, READINGS, RawReadings, clean_curve, clean_loop, resampled

TURN = 2 * np.pi
ORDERS = (1, 2, 39, 78, 80)


def curve(angle: np.ndarray) -> np.ndarray:
    """Return a sum of the orders that a reducer shows [rad]."""
    return ARCSECOND * sum(5.0 * np.cos(order * angle + order) for order in ORDERS)


def readings(along: np.ndarray, values: np.ndarray | None = None, header: str = "angle [deg]") -> RawReadings:
    return RawReadings(
        path=Path("curve.csv"),
        header=header,
        factor=1.0 if header == "angle [rad]" or "torque" in header else DEGREE,
        row=np.arange(along.size) + 2,
        along=along,
        values=curve(along) if values is None else values,
        averaged=np.ones(along.size),
    )


def turn(count: int = 720, turns: float = 1.0) -> np.ndarray:
    return TURN * turns * np.arange(count) / count


def test_a_clean_turn_is_left_alone():
    cleaned = clean_curve(readings(turn()))
    assert cleaned.repairs == ()
    assert cleaned.noise_factor == 1.0
    np.testing.assert_array_equal(cleaned.along, turn())
    np.testing.assert_allclose(cleaned.values, curve(turn()) - curve(turn()).mean(), atol=1e-18)
    assert abs(cleaned.values.mean()) < 1e-20


def numbers(cleaned) -> list[list[float]]:
    """Return the numbers that each repair of a curve or loop says, such as how many readings it left out."""
    return [[float(number) for number in re.findall(r"\d+(?:\.\d+)?", own)] for own in cleaned.repairs]


def test_the_offset_is_added_and_is_no_repair():
    cleaned = clean_curve(readings(turn()), offset=0.5)
    np.testing.assert_allclose(cleaned.along, turn() + 0.5)
    assert cleaned.repairs == ()


def test_a_closing_reading_is_left_out():
    cleaned = clean_curve(readings(TURN * np.arange(721) / 720))
    assert cleaned.along.size == 720
    assert numbers(cleaned) == [[1, 1]]


def test_missing_readings_are_left_out_and_counted():
    values = curve(turn())
    values[[5, 100, 700]] = np.nan
    cleaned = clean_curve(readings(turn(), values))
    assert numbers(cleaned) == [[3]]
    assert cleaned.along.size == 717


def test_up_to_5_percent_may_be_missing():
    values = curve(turn(100))
    values[40:45] = np.nan
    assert clean_curve(readings(turn(100), values)).along.size == 95
    values[45] = np.nan
    with pytest.raises(InputError, match=r"6 of 100 readings have no number, the first in row 42; allowed is up to 5%"):
        clean_curve(readings(turn(100), values))


def test_downwards_is_turned_round():
    cleaned = clean_curve(readings(turn()[::-1]))
    assert len(cleaned.repairs) == 1 and "downwards" in cleaned.repairs[0]
    np.testing.assert_allclose(cleaned.values, curve(cleaned.along), atol=1e-18)


def test_angles_that_start_anew_are_counted_on():
    angle = np.mod(turn() + 1.0, TURN)
    cleaned = clean_curve(readings(angle))
    assert len(cleaned.repairs) == 1 and "anew" in cleaned.repairs[0]
    np.testing.assert_allclose(cleaned.along, turn() + 1.0)
    down = clean_curve(readings(np.mod(turn(1440, 2.0) + 1.0, TURN)[::-1]))
    assert numbers(down)[:2] == [[2], []] and "downwards" in down.repairs[1]
    np.testing.assert_allclose(down.values, curve(down.along), atol=1e-15)


def test_a_few_steps_back_are_sorted():
    angle = turn()
    angle[[10, 11, 300, 301]] = angle[[11, 10, 301, 300]]
    cleaned = clean_curve(readings(angle))
    assert numbers(cleaned) == [[2]]
    np.testing.assert_array_equal(cleaned.along, turn())


@pytest.mark.parametrize("swapped", [range(10, 90, 8), [50]])
def test_many_or_long_steps_back_are_refused_with_their_row(swapped):
    angle, reach = turn(), 1 if len(swapped) > 1 else 3
    for place in swapped:
        angle[[place, place + reach]] = angle[[place + reach, place]]
    row = next(iter(swapped)) + 3
    with pytest.raises(InputError, match=rf"curve.csv, row {row}: angle \[deg\] is .* one direction of rotation"):
        clean_curve(readings(angle))
    # Turned round, the first step back stands elsewhere in time but in the same place of the file.
    with pytest.raises(InputError, match=rf"curve.csv, row {row}: "):
        clean_curve(readings(-angle))


def test_repeated_angles_are_averaged_and_lower_the_noise():
    angle = np.repeat(turn(180), 4)
    cleaned = clean_curve(readings(angle, curve(angle) + ARCSECOND * np.tile([1.0, 3.0, -2.0, 2.0], 180)))
    assert numbers(cleaned) == [[540]]
    assert cleaned.noise_factor == pytest.approx(0.5)
    np.testing.assert_allclose(cleaned.values, curve(turn(180)) - curve(turn(180)).mean(), atol=1e-17)


def test_start_and_stop_are_left_out():
    angle = TURN * np.arange(-36, 756 + 1) / 720  # 18° before and after a turn
    cleaned = clean_curve(readings(angle), start_stop=18.0 * DEGREE)
    assert numbers(cleaned) == [[72], [1, 1]]
    np.testing.assert_allclose(cleaned.along, turn(), atol=1e-12)


def test_whole_turns_are_kept_from_the_middle():
    cleaned = clean_curve(readings(turn(1000, 1.4)))
    assert cleaned.along[0] == pytest.approx(0.2 * TURN, abs=TURN / 700)
    assert cleaned.along[-1] - cleaned.along[0] == pytest.approx(TURN, abs=1.5 * TURN * 1.4 / 1000)
    assert numbers(cleaned) == [[286, 1]]


def test_several_turns_are_folded_onto_one():
    same = clean_curve(readings(turn(900, 3.0)))
    assert numbers(same) == [[900, 3], [600]]
    assert same.noise_factor == pytest.approx(3**-0.5)
    apart = clean_curve(readings(turn(901, 3.0)))
    assert apart.along.size == 901
    assert (np.diff(apart.along) > 0).all()
    np.testing.assert_allclose(apart.values, curve(apart.along) - curve(apart.along).mean(), atol=1e-15)


def test_a_piece_of_a_turn_is_noted_and_a_tenth_is_needed():
    piece = clean_curve(readings(turn(400, 0.6)))
    assert numbers(piece) == [[0.599]]
    assert piece.along.size == 400
    with pytest.raises(InputError, match=r"cover is 0\.0895; allowed is 0\.1 or more"):
        clean_curve(readings(turn(200, 0.09)))


def test_wrong_units_of_angles_are_recognised():
    with pytest.raises(InputError, match=r"720 angles under 'angle \[deg\]' span 6\.274 deg, which looks like radians"):
        clean_curve(readings(turn() * DEGREE))
    with pytest.raises(InputError, match=r"span 359\.5 rad, which looks like degrees"):
        clean_curve(readings(turn() / DEGREE, header="angle [rad]"))


def test_a_range_that_no_reducer_has_is_refused():
    with pytest.raises(InputError, match=r"range of its values is .* allowed is up to 1 deg, in the unit"):
        clean_curve(readings(turn(), curve(turn()) * 3600))


def test_loops_are_averaged_sorted_and_centred():
    up = np.array([-3.0, -1.0, 0.0, 1.0, 3.0])
    torque = np.concatenate([up, up[::-1]])
    twist = ARCSECOND * (2.0 * torque + np.repeat([7.0, 9.0], 5))
    cleaned = clean_loop(readings(torque, twist, "torque [Nm]"))
    assert numbers(cleaned) == [[2, 0], [4]]
    np.testing.assert_array_equal(cleaned.along, [-3, -1, 1, 3])
    np.testing.assert_allclose(cleaned.values, ARCSECOND * 2.0 * cleaned.along)
    assert cleaned.noise_factor == pytest.approx(0.5**0.5)
    with pytest.raises(InputError, match="number of torques is 2; allowed is 3 or more"):
        clean_loop(readings(np.array([1.0, -1.0, 1.0]), np.zeros(3), "torque [Nm]"))


def test_curves_up_to_twice_the_angles_keep_their_own():
    assert clean_curve(readings(turn(FULL))).along.size == FULL
    cleaned = clean_curve(readings(turn(3600)))
    assert cleaned.along.size == READINGS
    assert numbers(cleaned) == [[3600, READINGS]]


@pytest.mark.parametrize("count", [FULL + 1, 2000, 3600, 20_000])
@pytest.mark.parametrize("jitter", [0.0, 0.4])
def test_resampling_adds_next_to_nothing(count, jitter, generator):
    angle = 0.3 + TURN * np.sort(np.arange(count) + jitter * generator.uniform(-1, 1, count)) / count
    whole = resampled(angle, curve(angle), whole_turn=True)
    # Where readings happen to leave a gap, an angle is left out rather than made up.
    assert READINGS - (10 if jitter else 0) <= whole.along.size <= READINGS
    np.testing.assert_allclose(np.mod((whole.along - whole.along[0]) / TURN * READINGS + 0.5, 1.0), 0.5, atol=1e-9)
    # Five orders of 5″ each; the spline errs by 1e-4 of an amplitude at order 80 and less below.
    assert np.abs(whole.values - curve(whole.along)).max() < 5e-4 * 5 * ARCSECOND
    some = angle < 0.3 + 0.6 * TURN
    if some.sum() > FULL:
        piece = resampled(angle[some], curve(angle[some]), whole_turn=False)
        assert np.abs(piece.values - curve(piece.along)).max() < 5e-4 * 5 * ARCSECOND


def test_resampling_a_kink():
    """Pins that begin to carry leave kinks; a kink is blunted by a small part of its slope times a spacing."""
    angle = turn(7200)
    kinked = np.abs(np.sin(20 * angle))
    whole = resampled(angle, kinked, whole_turn=True)
    change = 40.0 * TURN / READINGS  # of the slope, times a spacing
    assert np.abs(whole.values - np.abs(np.sin(20 * whole.along))).max() < 0.15 * change


def test_angles_in_gaps_are_left_out(generator):
    angle = turn(3600)
    seen = ((angle < 1.0) | (angle > 1.1)) & ((angle < 3.0) | (angle > 3.01)) & ((angle < 4.0) | (angle > 4.02))
    whole = resampled(angle[seen], curve(angle[seen]), whole_turn=True)
    inside = (whole.along > 1.0) & (whole.along < 1.1 - 2 * TURN / READINGS)
    assert not inside.any()
    assert READINGS - 30 < whole.along.size < READINGS - 15
    assert np.abs(whole.values - curve(whole.along)).max() < 1e-3 * 5 * ARCSECOND


@pytest.mark.slow
@pytest.mark.parametrize(("count", "jitter"), [(2000, 0.0), (2000, 0.4), (5000, 0.0)])
def test_noise_of_resampled_readings_is_the_stated_one(count, jitter, generator):
    angle = TURN * np.sort(np.arange(count) + jitter * generator.uniform(-1, 1, count)) / count
    runs = 30
    squares = np.empty(runs)
    for run in range(runs):
        whole = resampled(angle, generator.standard_normal(count), whole_turn=True)
        squares[run] = np.mean(whole.values**2)
    standard_error = squares.std(ddof=1) / np.sqrt(runs)
    assert squares.mean() == pytest.approx(whole.noise_factor**2, abs=3 * standard_error)
    assert whole.noise_factor == pytest.approx(np.sqrt(READINGS / count), rel=0.15)


def test_noise_after_repeats_and_resampling_is_the_stated_one(generator):
    angle = np.sort(np.concatenate([turn(2500), turn(2500)[:1250]]))
    squares = np.empty(30)
    for run in range(squares.size):
        cleaned = clean_curve(readings(angle, 1e-5 * generator.standard_normal(angle.size)))
        squares[run] = np.mean(cleaned.values**2) / 1e-10
    standard_error = squares.std(ddof=1) / np.sqrt(30)
    # The mean that is taken away holds 1/3750 of the noise.
    assert squares.mean() == pytest.approx(cleaned.noise_factor**2, abs=3 * standard_error + 1 / 3750)


def simulated(generator: np.random.Generator) -> Measurements:
    columns = ("crank1.journal1.eccentricity.x", "disc1.tilt.x", "pin.diameter", "disc1.bores.rotation")
    units = tuple(
        BuiltUnit(
            name=name,
            source="simulated",
            deviations=dict(zip(columns, generator.normal(0, 5 * MICROMETRE, 4).tolist(), strict=True)),
            neglected=("sun.*",),
        )
        for name in ("1", 'the "second", µ; and last', "#3")
    )
    angles = (turn(936), np.sort(generator.uniform(0.2, 4.0, 500)), turn(300) + 1.0)
    return Measurements(
        name='three "units"',
        source="a model \\ no bench",
        units=units,
        peak_to_peak=MeasuredPeakToPeak(
            unit=np.array([2, 0, 1]), values=generator.uniform(1e-4, 5e-4, 3), torque=-1.0, noise=1e-6
        ),
        curves=tuple(
            MeasuredCurve(
                unit=number,
                torque=(-1.0) ** number * 0.7,
                carrier_angle=angle,
                transmission_error=curve(angle) - curve(angle).mean(),
                noise=None if number else 1.23e-6,
                repairs=("was.csv: 3 readings without a number left out",),
            )
            for number, angle in enumerate(angles)
        ),
        loops=(
            MeasuredLoop(
                unit=1,
                carrier_angle=0.3,
                torque=np.array([-167.0, -5.01, 0.0167, 167.0]),
                twist=np.array([-3e-5, -1e-5, 1e-5, 3e-5]),
                noise=2e-7,
            ),
        ),
        assumptions=("no friction",),
    )


def test_what_is_written_is_read_back(tmp_path, generator):
    before = simulated(generator)
    after = load_measurements(write_measurements(before, tmp_path / "new" / "folder"))
    assert (after.name, after.source, after.assumptions) == (before.name, before.source, before.assumptions)
    assert [unit.name for unit in after.units] == [unit.name for unit in before.units]
    assert after.units[0].neglected == ("sun.*",)
    for old, new in zip(before.units, after.units, strict=True):
        assert new.deviations == pytest.approx(old.deviations, rel=1e-14)
    np.testing.assert_array_equal(after.peak_to_peak.unit, before.peak_to_peak.unit)
    np.testing.assert_allclose(after.peak_to_peak.values, before.peak_to_peak.values, atol=1e-15)
    assert after.peak_to_peak.noise == pytest.approx(1e-6)
    for old, new in zip(before.curves, after.curves, strict=True):
        assert (new.unit, new.torque) == (old.unit, old.torque)
        assert new.noise == (None if old.noise is None else pytest.approx(old.noise))
        np.testing.assert_allclose(new.carrier_angle, old.carrier_angle, atol=1e-14)
        np.testing.assert_allclose(new.transmission_error, old.transmission_error, atol=1e-17)
    loop = after.loops[0]
    assert (loop.unit, loop.noise) == (1, pytest.approx(2e-7))
    assert loop.carrier_angle == pytest.approx(0.3)
    np.testing.assert_array_equal(loop.torque, before.loops[0].torque)
    np.testing.assert_allclose(loop.twist, before.loops[0].twist, atol=1e-17)
    assert len(after.repairs) == 1
    assert after.repairs[0].startswith("curve2.csv: covers 0.6")


def test_nothing_is_overwritten(tmp_path, generator):
    data = simulated(generator)
    (tmp_path / "loop1.csv").write_text("mine")
    with pytest.raises(InputError, match=r"loop1\.csv: the file exists; name a new one, nothing is overwritten"):
        write_measurements(data, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["loop1.csv"]
    written(tmp_path / "units.csv", "mine")
    (tmp_path / "loop1.csv").unlink()
    with pytest.raises(InputError, match=r"units\.csv: the file exists"):
        write_measurements(data, tmp_path)


def test_units_of_a_table_meet_the_model(tmp_path, rv20e, table4):
    nominal = dict(zip(rv20e.columns, table4[0].tolist(), strict=True))
    units = tuple(BuiltUnit(name=name, source="table4", deviations=nominal) for name in ("1", "2"))
    written(tmp_path / "units.csv", units_text(units, tmp_path))
    for unit in load_units(tmp_path / "units.csv"):
        np.testing.assert_allclose(unit.errors(rv20e.columns), table4, rtol=1e-14)
    short = {column: value for column, value in nominal.items() if not column.startswith("sun.")}
    written(tmp_path / "short.csv", units_text([BuiltUnit(name="1", source="table4", deviations=short)], tmp_path))
    with pytest.raises(InputError, match="unit 1: sun"):
        load_units(tmp_path / "short.csv")[0].errors(rv20e.columns)
    assert load_units(tmp_path / "short.csv", neglected=("sun.*",))[0].errors(rv20e.columns).shape == table4.shape
