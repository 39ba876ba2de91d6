"""Measured data as a user brings them: the two layouts, and one sentence for every kind of bad input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.builders import refusal
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE, MICRORADIAN
from tolalloc.reducers.reducer.files import PRESETS
from tolalloc.reducers.unit_file import load_units
from tolalloc.wings.bench.measurements import load_measurements

UNITS = """# drawn on the coordinate measuring machine
unit,crank1.journal1.eccentricity.x [µm],disc1.tilt.x [urad],pin.diameter [um]
1,2.5,30,-1
2,-1.5,-20,0
3,0.5,10,1.5
"""
PEAK_TO_PEAK = "unit;peak_to_peak [arcsec]\n1;50.5\n3;61\n2;58.25\n"
FILE = """name = "three units"
source = "bench 3"
units = "units.csv"
neglected = ["sun.*"]

[peak_to_peak]
file = "peak_to_peak.csv"
torque_nm = -1
noise_arcsec = 1.0

[[curves]]
unit = "2"
file = "curve.csv"
torque_nm = -1
noise_arcsec = 0.5
angle_offset_deg = 90
start_stop_deg = 0

[[loops]]
unit = "3"
file = "loop.csv"
carrier_angle_deg = 45
"""
LOOP = "torque [N·m],twist [arcmin]\n-100,-0.5\n-1,-0.1\n1,0.1\n100,0.5\n1,0.3\n"


def curve(count: int = 360, step: float = 1.0) -> str:
    rows = (f"{step * place:.6g},{5 * np.cos(np.deg2rad(step * place)):.6f}" for place in range(count))
    return "angle [deg],transmission error [arcsec]\n" + "\n".join(rows) + "\n"


@pytest.fixture
def folder(tmp_path) -> Path:
    for name, text in {
        "units.csv": UNITS,
        "peak_to_peak.csv": PEAK_TO_PEAK,
        "curve.csv": curve(),
        "loop.csv": LOOP,
        "measurement.toml": FILE,
    }.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def changed(folder: Path, name: str, old: str, new: str) -> None:
    text = (folder / name).read_text(encoding="utf-8")
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1), encoding="utf-8")


def refused(folder: Path, read: Callable[[Path], object] = load_measurements, name: str = "measurement.toml") -> str:
    sentence = refusal(read, folder / name)
    assert sentence.endswith(".")
    return sentence.replace(f"{folder}/", "")


def test_everything_is_read_in_si_units(folder):
    data = load_measurements(folder / "measurement.toml")
    assert (data.name, data.source) == ("three units", "bench 3")
    assert [unit.name for unit in data.units] == ["1", "2", "3"]
    assert data.units[1].deviations == pytest.approx(
        {
            "crank1.journal1.eccentricity.x": -1.5 * MICROMETRE,
            "disc1.tilt.x": -20 * MICRORADIAN,
            "pin.diameter": 0.0,
        }
    )
    assert data.units[0].neglected == ("sun.*",)
    table = data.peak_to_peak
    np.testing.assert_array_equal(table.unit, [0, 2, 1])
    np.testing.assert_allclose(table.values, np.array([50.5, 61, 58.25]) * ARCSECOND)
    assert (table.torque, table.noise) == (-1.0, pytest.approx(ARCSECOND))
    measured = data.curves[0]
    assert (measured.unit, measured.torque, measured.noise) == (1, -1.0, pytest.approx(0.5 * ARCSECOND))
    np.testing.assert_allclose(measured.carrier_angle, (np.arange(360) + 90) * DEGREE)
    loop = data.loops[0]
    assert (loop.unit, loop.noise, loop.carrier_angle) == (2, None, pytest.approx(45 * DEGREE))
    np.testing.assert_array_equal(loop.torque, [-100, -1, 1, 100])
    np.testing.assert_allclose(loop.twist / ARCSECOND, [-31.5, -7.5, 10.5, 28.5])
    assert data.repairs == ("loop.csv: 1 reading with a repeated torque averaged",)


def test_noise_follows_what_cleaning_did(folder):
    (folder / "curve.csv").write_text(curve(3600, 0.1), encoding="utf-8")
    data = load_measurements(folder / "measurement.toml")
    assert data.curves[0].noise == pytest.approx(0.5 * ARCSECOND * (936 / 3600) ** 0.5, rel=0.15)
    assert data.repairs[0] == "curve.csv: 3600 readings resampled to 936 by a least-squares cubic spline"


def test_units_may_be_unit_files(folder):
    (folder / "a.unit.toml").write_text((PRESETS / "table4.unit.toml").read_text(encoding="utf-8"), encoding="utf-8")
    changed(folder, "measurement.toml", 'units = "units.csv"', 'units = ["a.unit.toml", "units.csv"]')
    data = load_measurements(folder / "measurement.toml")
    assert [unit.name for unit in data.units] == ["table4", "1", "2", "3"]
    assert data.units[0].neglected[-1] == "sun.*"
    assert data.curves[0].unit == 2


def test_other_units_separators_and_columns(folder):
    rows = "\n".join(f"x;{np.deg2rad(place):.12g};{np.cos(np.deg2rad(place)):.6f};" for place in range(360))
    (folder / "curve.csv").write_text(f"time;Angle [rad];Transmission_Error [µrad]\n# {rows}", encoding="utf-8")
    changed(folder, "curve.csv", "# x", "# begin\nx")
    data = load_measurements(folder / "measurement.toml")
    np.testing.assert_allclose(data.curves[0].carrier_angle, (np.arange(360) + 90) * DEGREE, rtol=1e-11)
    assert np.ptp(data.curves[0].transmission_error) == pytest.approx(2e-6)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("name =", "title =", "measurement.toml: unknown field 'title'; known are"),
        ('name = "three units"\n', "", "measurement.toml: name is missing."),
        ('units = "units.csv"', "units = []", "measurement.toml: units is []; "),
        ('units = "units.csv"', "units = 5", "measurement.toml: units is 5; "),
        ("units.csv", "unit.csv", "unit.csv: no such file."),
        ("units.csv", "a.unit.toml", "a.unit.toml: no such file; shipped unit files are"),
        (
            'units = "units.csv"',
            'units = ["units.csv", "units.csv"]',
            "the name of a unit is '1'; allowed is each name",
        ),
        ("torque_nm = -1", "torque = -1", "measurement.toml, peak_to_peak: unknown field 'torque'; the nearest"),
        (
            "torque_nm = -1",
            "torque_nm = 0",
            "measurement.toml, peak_to_peak: torque_nm is 0; a torque of 0 is not allowed, as no pin carries; below 0 "
            "it resists the rotation.",
        ),
        ('"2"\nfile', '"4"\nfile', "measurement.toml, curve 1: unknown unit '4'; known are 1, 2, 3."),
        ('"3"\nfile', '"33"\nfile', "measurement.toml, loop 1: unknown unit '33'; the nearest known is 3"),
        ("noise_arcsec = 0.5", "noise_arcsec = 0", "measurement.toml, curve 1: noise_arcsec is 0; "),
        ("noise_arcsec = 0.5", "noise_arcsec = nan", "measurement.toml, curve 1: noise_arcsec is nan; "),
        ("start_stop_deg = 0", "start_stop_deg = -5", "measurement.toml, curve 1: start_stop_deg is -5; "),
        ("start_stop_deg = 0", "start_stop_deg = 180", "curve.csv: the number of readings is 0; allowed is 3 or more."),
        (
            "angle_offset_deg = 90",
            "angle_offset = 90",
            "curve 1: unknown field 'angle_offset'; the nearest known is",
        ),
        ("carrier_angle_deg = 45", "", "measurement.toml, loop 1: carrier_angle_deg is missing."),
        ("carrier_angle_deg = 45", "carrier_angle_deg = 4500", "loop 1: carrier_angle_deg is 4500; "),
        ('file = "curve.csv"', 'file = "curves.csv"', "curves.csv: no such file."),
        ("[[curves]]", "[curves]", "measurement.toml: curves"),
        ("[[curves]]", "[[curves", "measurement.toml: not complete TOML; is the file truncated?"),
    ],
)
def test_bad_measurement_files_are_refused(folder, old, new, sentence):
    changed(folder, "measurement.toml", old, new)
    assert sentence in refused(folder)


def test_a_file_without_data_is_refused(folder):
    changed(folder, "measurement.toml", FILE[FILE.index("[peak_to_peak]") :], "")
    assert refused(folder) == (
        "measurement.toml: there are no measured data; give [peak_to_peak], [[curves]] or [[loops]]."
    )
    assert refused(folder, name="none.toml") == "none.toml: no such file."


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (UNITS, "", "units.csv: the table has no rows; a line of headers and one row or more are needed."),
        ("unit,", "name,", "units.csv: the column 'unit' is missing; it names the unit of each row."),
        ("\n2,", "\n1,", "units.csv, row 4: unit is '1'; allowed is each name once, and this one stands in row 3."),
        ("\n2,", "\n,", "units.csv, row 4: unit is ''; allowed is a name."),
        (
            "-1.5,",
            ",",
            "units.csv, row 4 (unit 2): crank1.journal1.eccentricity.x [µm] is ''; allowed is a number from -200 "
            "to 200.",
        ),
        ("-1.5,", "small,", "units.csv, row 4 (unit 2): crank1.journal1.eccentricity.x [µm] is 'small'; allowed"),
        ("-1.5,", "nan,", "crank1.journal1.eccentricity.x [µm] is 'nan'; allowed"),
        ("-1.5,", "inf,", "crank1.journal1.eccentricity.x [µm] is 'inf'; allowed"),
        ("-1.5,", "201,", "crank1.journal1.eccentricity.x [µm] is '201'; allowed"),
        ("30,", "-20001,", "(unit 1): disc1.tilt.x [urad] is '-20001'; allowed is a number from -20000 to 20000."),
        (",0\n", "\n", "units.csv, row 4: 3 of 4 cells are there; the columns must be of equal length"),
        (",0\n", ",0,7\n", "units.csv, row 4: 5 cells stand under 4 headers; numbers have a decimal point"),
        (
            "[urad]",
            "[µm]",
            "units.csv: the unit of column 'disc1.tilt.x' is 'µm'; allowed is µrad or urad in square brackets, as "
            "'disc1.tilt.x' is an angle.",
        ),
        ("eccentricity.x [µm]", "eccentricity.x [mm]", "eccentricity.x' is 'mm'; allowed is µm or um in square"),
        ("pin.diameter [um]", "pin.diameter", "the unit of column 'pin.diameter' is ''; allowed is µm or um"),
        ("pin.diameter [um]", "disc1.tilt.x [µrad]", "a column stands there twice"),
    ],
)
def test_bad_unit_tables_are_refused(folder, old, new, sentence):
    changed(folder, "units.csv", old, new)
    assert sentence in refused(folder, load_units, "units.csv")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "\n3;",
            "\n1;",
            "peak_to_peak.csv, row 3: unit is '1'; allowed is each name once, and this one stands in row 2.",
        ),
        ("\n3;", "\n30;", "peak_to_peak.csv, row 3: unknown unit '30'; the nearest known is 3"),
        ("unit;", "name;", "peak_to_peak.csv: the column 'unit' is missing"),
        (
            "61",
            "-61",
            "peak_to_peak.csv, row 3 (unit 3): peak_to_peak [arcsec] is '-61'; allowed is a number from 0 to 3600.",
        ),
        ("61", "nan", "peak_to_peak.csv, row 3 (unit 3): peak_to_peak [arcsec] is 'nan'; allowed is"),
        ("61", "", "peak_to_peak.csv, row 3 (unit 3): peak_to_peak [arcsec] is ''; allowed is"),
        ("61", "4000", "peak_to_peak [arcsec] is '4000'; allowed is a number from 0 to 3600."),
        (
            "61",
            "6l",
            "peak_to_peak.csv, row 3: peak_to_peak [arcsec] is '6l'; allowed is a number with a decimal point",
        ),
        (
            "61",
            "6,1,5",
            "peak_to_peak.csv, row 3: peak_to_peak [arcsec] is '6,1,5'; allowed is a number with a decimal",
        ),
        ("61\n2;58.25", "50.5\n2;50.5", "all 3 values of column 'peak_to_peak [arcsec]' are 50.5; an instrument that"),
        ("[arcsec]", "", "the unit of column 'peak_to_peak' is ''; allowed is arcsec or arcmin or deg"),
    ],
)
def test_bad_peak_to_peaks_are_refused(folder, old, new, sentence):
    changed(folder, "peak_to_peak.csv", old, new)
    assert sentence in refused(folder)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "transmission error [arcsec]",
            "error [arcsec]",
            "curve.csv: the column 'transmission error' with its unit in square brackets (arcsec or arcmin or deg or "
            "rad or µrad or urad) is missing; the columns are 'angle [deg]', 'error [arcsec]'.",
        ),
        (
            "angle [deg]",
            "angle [grad]",
            "curve.csv: the unit of column 'angle [grad]' is 'grad'; allowed is deg or rad or arcmin in square "
            "brackets.",
        ),
        ("angle [deg]", "angle", "curve.csv: the unit of column 'angle' is ''; allowed is deg or rad or arcmin"),
        ("angle [deg]", "angle [rad]", "span 359 rad, which looks like degrees; state the unit they were written in."),
        (
            "angle [deg]",
            "angle [arcmin]",
            "curve.csv: the part of a turn that its angles cover is 0.0166; allowed is 0.1",
        ),
        (
            "[arcsec]",
            "[deg]",
            "the range of its values is '10 deg'; allowed is up to 1 deg, in the unit that the header",
        ),
        (
            "\n7,4.962731\n",
            "\n7\n",
            "curve.csv, row 9: 1 of 2 cells are there; the columns must be of equal length, and a",
        ),
        ("\n7,4.962731\n", "\n7,4,962731\n", "curve.csv, row 9: 3 cells stand under 2 headers; numbers have a decimal"),
        (
            "\n7,4.962731\n",
            "\n7,overload\n",
            "curve.csv, row 9: transmission error [arcsec] is 'overload'; allowed is a number with a decimal point, or "
            "nothing where the instrument gave none.",
        ),
        (
            "\n7,4.962731\n",
            "\n3,4.962731\n",
            "curve.csv, row 9: angle [deg] is 3.0; allowed is one direction of rotation, in which 1 of 359 steps go "
            "back; up to 1% are sorted where none is longer than the median step; "
            "give each direction a file of its own.",
        ),
    ],
)
def test_bad_curves_are_refused(folder, old, new, sentence):
    changed(folder, "curve.csv", old, new)
    assert sentence in refused(folder)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            curve().replace("\n", ",1\n").replace(",1", ",angle [rad]", 1),
            "column 'angle' stands there 2 times; allowed is",
        ),
        (curve(20), "the part of a turn that its angles cover is 0.0528; allowed is 0.1 or more"),
        (curve(2), "curve.csv: the number of readings is 2; allowed is 3 or more."),
        (
            "angle [deg],transmission error [arcsec]\n" + "".join(f"{place},1.5\n" for place in range(360)),
            "curve.csv: all 360 values of column 'transmission error [arcsec]' are 1.5; an instrument that does not "
            "move is no measurement.",
        ),
        (
            "angle [deg],transmission error [arcsec]\n" + "".join(f"{place},\n" for place in range(360)),
            "curve.csv: 360 of 360 readings have no number, the first in row 2; allowed is up to 5%.",
        ),
        (curve(360, np.pi / 180), "the 360 angles under 'angle [deg]' span 6.266 deg, which looks like radians"),
        # There and back in one file; the row is the first of the way back.
        (
            "\n".join(curve().splitlines() + curve().splitlines()[:0:-1]),
            "curve.csv, row 363: angle [deg] is 358.0; allowed",
        ),
        ("# nothing\n", "curve.csv: the table has no rows"),
    ],
)
def test_curves_that_are_no_measurement_are_refused(folder, text, sentence):
    (folder / "curve.csv").write_text(text, encoding="utf-8")
    assert sentence in refused(folder)


def test_binary_files_are_refused(folder):
    (folder / "curve.csv").write_bytes(b"PK\x03\x04\xff\xfe")
    assert "curve.csv: this is a workbook or an archive under another ending" in refused(folder)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "[N·m]",
            "[lbf·ft]",
            "loop.csv: the unit of column 'torque [lbf·ft]' is 'lbf·ft'; allowed is N·m or Nm in square",
        ),
        ("twist", "angle", "loop.csv: the column 'twist' with its unit in square brackets"),
        ("-100,-0.5\n-1,-0.1\n", "", "loop.csv: the number of torques is 2; allowed is 3 or more."),
        ("-100,", "x,", "loop.csv, row 2: torque [N·m] is 'x'; allowed is a number with a decimal point"),
        ("-100,", ",", "loop.csv: 1 of 5 readings have no number, the first in row 2; allowed is up to 5%."),
        ("-100,-0.5\n-1,-0.1\n1,0.1\n100", "1,-0.5\n1,-0.1\n1,0.1\n1", "all 5 values of column 'torque [N·m]' are 1;"),
    ],
)
def test_bad_loops_are_refused(folder, old, new, sentence):
    changed(folder, "loop.csv", old, new)
    assert sentence in refused(folder)
