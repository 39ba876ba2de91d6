"""``tolalloc assemble`` as a user meets it: measured parts, parts still on the drawing, and bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.builders import page_of, summary_of, written
from tests.studies.command import WRITTEN, answer_of, refused, tolalloc

THREE_PARTS = """
name = "pump"
source = "own"
datum = "base"
precision = 5
adjust = "mounted"
measure = "current"

[noise]
measurement_arcsec = 2
adjustment_arcsec = 1

[[part]]
name = "bracket"
on = "base"
tolerance_arcsec = [60, 60, 60]

[[part]]
name = "rotor"
on = "bracket"
turned_deg = [0, 0, 90]
tolerance_arcsec = [40, 40, 0]

[[part]]
name = "cover"
on = "base"
tolerance_arcsec = [30, 30, 30]
"""


def errors_file(path: Path, names: tuple[str, ...], errors: np.ndarray) -> Path:
    rows = [f"{name},{x:.2f},{y:.2f},{z:.2f}" for name, (x, y, z) in zip(names, errors, strict=True)]
    return written(path, "\n".join(["part,x [arcsec],y [arcsec],z [arcsec]", *rows]))


@pytest.fixture
def pump(tmp_path) -> Path:
    return written(tmp_path / "pump.chain.toml", THREE_PARTS)


@pytest.fixture
def unit(tmp_path) -> Path:
    errors = np.random.default_rng(20250711).uniform(-60, 60, (4, 3))
    return errors_file(tmp_path / "unit1.csv", ("KC1", "KC2", "KC3", "KC4"), errors)


@pytest.mark.slow
def test_measured_parts_are_adjusted_and_reported(unit, tmp_path):
    answer = answer_of("assemble", "bx40e", "--measured", unit, "--out", tmp_path / "report")
    measured, tolerances = answer["measured"], answer["tolerances"]
    assert measured["norm unadjusted [arcsec]"] == pytest.approx(86.0307, abs=1e-4)
    assert measured["norm adjusted [arcsec]"] == pytest.approx(8.4957, abs=1e-4)
    assert answer["expected rms adjusted [arcsec]"] == pytest.approx(9.7065, abs=1e-4)
    assert answer["left however large the precision [arcsec]"] == pytest.approx(9.3220, abs=1e-4)
    assert tolerances["cost unadjusted [cost units]"] == pytest.approx(148.278, abs=1e-3)
    assert tolerances["cost adjusted [cost units]"] == pytest.approx(19.1306, abs=1e-4)
    assert tolerances["cost re-tuned [cost units]"] == pytest.approx(14.457, abs=1e-3)
    assert "KC1" in answer["warnings"][0] and "+52.21″" in answer["warnings"][0]
    load = [row["largest line load, rated torque [N/mm]"] for row in answer["transmission"]["values"]]
    assert load[0] < load[-1] < load[1]  # perfect parts, adjusted, unadjusted
    folder = tmp_path / "report"
    names = {path.name for path in folder.iterdir()}
    assert names == WRITTEN | {"figures", "tables"}
    assert summary_of(folder) == answer
    assert {path.stem for path in (folder / "figures").iterdir()} >= {"tilt", "precision", "pressure", "line_load"}


def test_a_chain_without_a_reducer_says_what_is_to_be_expected(pump):
    result = tolalloc("assemble", pump)
    assert result.returncode == 0, result.stderr
    said = " ".join(result.stdout.split())
    assert "measure rotor" in said
    assert "line load" not in said and "cost units" not in said


def test_a_chain_without_a_reducer_adjusts_measured_parts(pump, tmp_path):
    errors = np.array([[50, -20, 10], [-30, 15, 0], [5, 25, -12]])
    parts = errors_file(tmp_path / "seven.csv", ("bracket", "rotor", "cover"), errors)
    answer = answer_of("assemble", pump, "--measured", parts, "--precision", "10")
    assert answer["precision [-]"] == 10
    assert answer["transmission"] is None and answer["tolerances"] is None
    # The rotor is turned by 90° about z: its x is the datum's y.
    before = [50, -20, 10, 50 - 15, -20 - 30, 10, 5, 25, -12]
    assert answer["measured"]["norm unadjusted [arcsec]"] == pytest.approx(np.linalg.norm(before))
    assert answer["measured"]["norm adjusted [arcsec]"] < 0.2 * np.linalg.norm(before)


def test_a_precision_of_zero_turns_nothing(pump):
    answer = answer_of("assemble", pump, "--precision", "0")
    assert [row["turn"] for row in answer["steps"]] == ["nothing"] * 3
    assert answer["expected rms adjusted [arcsec]"] == answer["expected rms unadjusted [arcsec]"]


def test_measured_parts_are_listed_without_measuring_again(pump, tmp_path):
    parts = errors_file(tmp_path / "seven.csv", ("bracket", "rotor", "cover"), np.full((3, 3), 12.0))
    result = tolalloc("assemble", pump, "--measured", parts)
    assert result.returncode == 0, result.stderr
    said = " ".join(result.stdout.split())
    assert "mount rotor" in said and "measure rotor" not in said


@pytest.mark.slow
def test_impossible_limits_keep_nobody_from_the_turns(unit, tmp_path):
    chain = tmp_path / "tight.chain.toml"
    shipped = Path("tolalloc/wings/assembly/data/bx40e.chain.toml").read_text(encoding="utf-8")
    tight = shipped.replace("tilt_limit_arcsec = 15\n", "tilt_limit_arcsec = 0.2\n").replace('reducer = "bx40e"', "")
    chain.write_text(tight, encoding="utf-8")
    for arguments in (["--measured", unit], []):
        folder = tmp_path / f"report{len(arguments)}"
        answer = answer_of("assemble", chain, *arguments, "--out", folder)
        assert answer["tolerances"] is None and answer["steps"]
        (warning,) = (own for own in answer["warnings"] if "angular tolerances" in own)
        assert warning.split(":")[0] in page_of(folder)
        shown = tolalloc("assemble", chain, *arguments)
        assert shown.returncode == 0, shown.stderr
        assert warning in shown.stdout


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("assemble", ["[arcsec]"]),
        ("mount", ["[N·m]"]),
        ("contact", ["[mm]"]),
        ("modify", ["[rad]"]),
        ("diagnose", ["[deg]", "[arcsec]"]),
        ("te", ["[N·m]"]),
        ("costs", ["[unit]", "[cost units]"]),
    ],
)
def test_help_names_units_of_measurement(command, words):
    said = tolalloc(command, "--help", COLUMNS="200").stdout
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bx40"], ["bx40", "bx40e"]),
        (["bx40e", "--precision", "-1"], ["--precision", "-1", "0 to"]),
        (["bx40e", "--precision", "nan"], ["--precision", "nan"]),
        (["bx40e", "--measured", "nope.csv"], ["nope.csv"]),
    ],
)
def test_bad_options_are_refused_in_one_sentence(tmp_path, arguments, words):
    refused(tolalloc("assemble", *arguments, "--out", tmp_path / "report"), *words)
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("part,x [arcsec],y [arcsec],z [arcsec]\nKC1,1,2,3\n", ["KC2", "missing"]),
        ("part,x [deg],y [arcsec],z [arcsec]\nKC1,1,2,3\n", ["deg", "arcsec"]),
        ("part,x [arcsec],y [arcsec],z [arcsec]\nKC9,1,2,3\n", ["KC9", "KC4"]),
        ("part,x [arcsec],y [arcsec],z [arcsec]\nKC1,one,2,3\n", ["row 2", "one"]),
    ],
)
def test_bad_measurements_are_refused_in_one_sentence(tmp_path, content, words):
    path = tmp_path / "parts.csv"
    path.write_text(content, encoding="utf-8")
    refused(tolalloc("assemble", "bx40e", "--measured", path), "parts.csv", *words)


def test_a_folder_with_something_in_it_is_left_alone(pump, tmp_path):
    kept = tmp_path / "report" / "kept.txt"
    kept.parent.mkdir()
    kept.write_text("mine", encoding="utf-8")
    refused(tolalloc("assemble", pump, "--out", kept.parent), "not empty")
    assert [path.name for path in kept.parent.iterdir()] == ["kept.txt"]
    assert kept.read_text(encoding="utf-8") == "mine"
