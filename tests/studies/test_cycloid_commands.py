"""``tolalloc contact``, ``tolalloc modify`` and the studies of the cycloid stage, as a user meets them."""

from __future__ import annotations

import ezdxf
import numpy as np
import pandas as pd
import pytest

from tests.builders import reducer_file
from tests.studies.command import WRITTEN, answer_of, refused, tolalloc


def test_contact_of_the_rv40e():
    answer = answer_of("contact", "--reducer", "rv40e_xi2015", "--torque", "-572", "--phases", "1")
    assert answer["per tooth"]["largest pin force [N]"] == pytest.approx(1144, abs=1)
    assert answer["per tooth"]["peak pressure [MPa]"] == pytest.approx(1569, abs=1)
    assert answer["profile"]["radial clearance at tip and root [µm]"] == pytest.approx(6)


def test_contact_takes_width_and_support():
    result = tolalloc("contact", "--reducer", "rv40e_xi2015", "--width", "16", "--support", "30.6", "--torque", "-572")
    assert result.returncode == 0, result.stderr
    assert "16…17" in result.stdout


@pytest.mark.slow
def test_contact_writes_report_and_profile(tmp_path):
    folder, file = tmp_path / "report", tmp_path / "disc.dxf"
    result = tolalloc("contact", "--reducer", "rv40e_xi2015", "--out", folder, "--profile", file, "--points", "100")
    assert result.returncode == 0, result.stderr
    assert "chord error at most 0.61 µm" in result.stderr
    names = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    figures = {f"figures/{name}.png" for name in ("profile", "clearance", "forces", "pins_in_contact")}
    tables = {f"tables/{name}.csv" for name in ("profile", "loaded contact", "pins")}
    assert names == WRITTEN | figures | tables
    drawing = ezdxf.readfile(file)
    (outline,) = drawing.modelspace().query("LWPOLYLINE")
    assert outline.closed
    assert len(outline) == 39 * 100
    radius = np.hypot(*np.array([point[:2] for point in outline.get_points()]).T)
    assert radius.max() == pytest.approx(62.294, abs=1e-6)  # Rp + e − r, less 6 µm of radial clearance
    assert radius.min() == pytest.approx(59.694, abs=1e-6)


@pytest.mark.slow
def test_profile_as_csv_carries_what_was_removed(tmp_path):
    file = tmp_path / "disc.csv"
    assert tolalloc("contact", "--reducer", "rv40e_xi2015", "--profile", file).returncode == 0
    frame = pd.read_csv(file)
    assert len(frame) == 39 * 200
    tip = frame["angle [deg]"] == -180
    assert tip.sum() == 39
    np.testing.assert_allclose(frame.loc[tip, "removed along the normal [µm]"], 6.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([("pin_radius_mm = 3", "pin_radius_mm = 5.1")], ["pin_radius_mm", "5.03", "overlap"]),
        ([("eccentricity_mm = 1.3", "eccentricity_mm = 1.6")], ["K1", "below 1"]),
        ([("pin_radius_mm = 3", "pin_radius_mm = 4.7")], ["pin_radius_mm", "4.61", "undercut"]),
        ([('convention = "minus"', 'convention = "plus"')], ["interference of 10 µm at tip and root", "convention"]),
        ([('convention = "minus"', 'convention = "seed"')], ["convention", "seed"]),
        ([("disc_teeth = 39", "disc_teeth = 40")], ["disc_teeth", "39"]),
    ],
)
def test_a_stage_that_cannot_be_built_is_refused(tmp_path, changes, words):
    refused(tolalloc("contact", "--reducer", reducer_file(tmp_path / "mine.toml", "rv40e_xi2015", *changes)), *words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--torque", "0"], ["torque", "not 0"]),
        (["--torque", "1e9"], ["torque", "5720"]),
        (["--torque", "500", "--support", "500"], ["beyond any contact", "allowed is below"]),
        (["--width", "0"], ["--width", "0.5 to 200"]),
        (["--support", "-1"], ["--support", "1 to 500"]),
        (["--law", "hertz"], ["hertz", "logarithmic"]),
        (["--phases", "0"], ["--phases", "1 to 3600"]),
        (["--profile", "disc.stl"], ["disc.stl", ".csv or .dxf"]),
        (["--profile", "nowhere/disc.csv"], ["cannot be made there", "nowhere"]),
        (["--profile", "disc.csv", "--points", "7"], ["points per tooth", "7"]),
        (["--reducer", "rv41"], ["rv41", "rv40e"]),
    ],
)
def test_contact_refuses_in_one_sentence(options, words):
    refused(tolalloc("contact", *([] if "--reducer" in options else ["--reducer", "rv40e_xi2015"]), *options), *words)


def test_nothing_is_overwritten(tmp_path):
    file = tmp_path / "disc.csv"
    file.write_text("mine", encoding="utf-8")
    refused(tolalloc("contact", "--reducer", "rv40e_xi2015", "--profile", file, "--out", tmp_path / "report"), "exists")
    assert file.read_text(encoding="utf-8") == "mine"
    assert not (tmp_path / "report").exists()
    refused(tolalloc("contact", "--reducer", "rv40e_xi2015", "--out", tmp_path), "not empty")
    both = ("--profile", tmp_path / "new.csv", "--out", tmp_path / "report")
    refused(tolalloc("contact", "--reducer", "rv40e_xi2015", *both, "--points", "7"), "7")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["disc.csv"]
    refused(tolalloc("modify", "li2018", "--reducer", "rv40e_xi2015", "--profile", file), "exists")


@pytest.mark.parametrize(
    "written",
    [
        ("contact", "--out", "report"),
        ("modify", "li2018", "--profile", "disc.csv"),
        ("modify", "li2018", "--write", "new.reducer.toml"),
    ],
)
def test_no_file_is_written_about_a_reducer_that_nobody_named(written):
    refused(tolalloc(*written), "--reducer is missing", "rv40e, rv40e_xi2015, rv80e")


@pytest.mark.slow
def test_a_large_modification_is_said_wherever_gaps_are_linear(tmp_path):
    large = (("equidistant_um = -2", "equidistant_um = 80"), ("shift_um = 8", "shift_um = -50"))
    path = reducer_file(tmp_path / "mine.toml", "rv40e_xi2015", *large)
    assert "50 µm" in answer_of("te", "--reducer", path)["warnings"][0]
    exact = answer_of("contact", "--reducer", path)
    assert exact["profile"]["distances"] == "exact"
    assert exact["warnings"]


@pytest.mark.slow
def test_modify_li2018_gives_the_closed_form():
    answer = answer_of("modify", "li2018", "--reducer", "rv40e_xi2015", "--radial", "15")
    assert answer["equidistant amount [µm]"] == pytest.approx(35.9679, abs=1e-4)
    assert answer["shift amount [µm]"] == pytest.approx(20.9679, abs=1e-4)
    # li2018's 3.220′ of the disc, at the output times zc/zp·(1 − 1/i).
    assert answer["backlash [arcmin]"] == pytest.approx(3.220 * 39 / 40 * 80 / 81, abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["li2017"], ["li2017", "li2018"]),
        (["li2018", "--radial", "500"], ["meet the constraints", "0…100 µm", "radial clearance"]),
        (["li2018", "--radial", "-5"], ["--radial", "-5 µm", "0 to 1000 µm"]),
        (["--flank", "20", "--radial", "8"], ["flank clearance is 20 µm", "at least", "µm"]),
        (["--flank", "2", "--radial", "500"], ["flank clearance 2 µm", "by exact distances", "less radial"]),
        (["--flank", "-1"], ["--flank", "-1 µm", "0 to 1000 µm"]),
        (["li2018", "--flank", "3"], ["--flank", "3 µm", "li2018"]),
        (["song2019", "--rotation", "0.5"], ["rotation", "0.5"]),
        (["song2019", "--metric", "far"], ["far", "nearest"]),
    ],
)
def test_modify_refuses_in_one_sentence(arguments, words):
    refused(tolalloc("modify", *arguments, "--reducer", "rv40e_xi2015"), *words)
