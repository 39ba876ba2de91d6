"""``tolalloc diagnose`` as a user meets it: a simulated bad unit, one that nothing explains, and bad input."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.builders import page_of, prepared, says, seeded_units
from tests.studies.command import ROOT, WRITTEN, answer_of, refused, tolalloc
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_frame
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.excel import write_sheets
from tolalloc.wings.bench.ask.diagnose import Diagnose

REPORT = ("--reducer", "rv20e_liu2020", "--out")


@dataclass(frozen=True)
class Bench:
    """A tolerance table of few sources, and the curve of a unit whose housing pitch is bad."""

    tolerances: Path
    curve: Path


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Bench:
    path = tmp_path_factory.mktemp("bench")
    table = pd.read_csv(ROOT / "tolalloc/drawings/data/rv20e_table4.tolerances.csv", dtype=str, keep_default_na=False)
    varied = ("housing.pitch", "disc1.pitch", "disc2.pitch", "pin.diameter")
    still = ~table["id"].isin(varied)
    for column in ("plus [unit]", "minus [unit]"):
        table.loc[still, column] = "0"
    table.loc[still, "locked"] = "yes"
    table.to_csv(path / "few.csv", index=False)
    study = prepared(name="bench", drawing={"table": path / "few.csv"})
    errors, kernel = study.errors, study.model.kernel
    x = 0.2 * seeded_units(errors, 1, 3)
    x[0, errors.columns.index("housing.pitch.cos2")] = 5e-6
    angle = 2 * np.pi * np.arange(720) / 720
    curve = kernel.model.equilibria(kernel.errors(x), kernel.torque, angle).transmission_error[0] / ARCSECOND
    read = curve + 0.5 * SeedTree(4).generator().standard_normal(angle.size)
    frame = pd.DataFrame({"angle [deg]": np.degrees(angle), "transmission error [arcsec]": read})
    frame.to_csv(path / "unit7.csv", index=False)
    return Bench(path / "few.csv", path / "unit7.csv")


def test_a_unit_is_diagnosed_with_the_modification_that_its_drawing_states(bench):
    own = Diagnose(curve=bench.curve, reducer="rv20e").prepare()
    left = own.reducer.modification
    clearances = [left.flank_clearance(own.reducer.cycloid_stage), left.radial_clearance]
    assert np.array(clearances) * 1e6 == pytest.approx([3.5, 8.0])
    assert len(own.errors.sources) == 50
    silent = Diagnose(curve=bench.curve, reducer="rv20e", tolerances="rv20e_table4").prepare()
    assert silent.reducer == load_reducer("rv20e")


@pytest.mark.slow
def test_a_bad_housing_is_named(bench, tmp_path):
    answer = answer_of("diagnose", bench.curve, "--tolerances", bench.tolerances, *REPORT, tmp_path / "report")
    assert answer["explained"] is True
    assert answer["named"] == ["housing.pitch"]
    first = answer["sources"][0]
    assert first["source"] == "housing.pitch"
    assert first["low 2.5 % [µm]"] < first["reading [µm]"] < first["high 97.5 % [µm]"]
    assert 8 < first["reading [µm]"] < 14  # a wave of amplitude 5 µm and little else, over a turn
    assert answer["curves failed [-]"] == 0
    names = {path.name for path in (tmp_path / "report").iterdir()}
    assert names == WRITTEN | {"figures", "tables"}
    assert {path.stem for path in (tmp_path / "report" / "figures").iterdir()} == {
        "dominant",
        "readings",
        "curve",
        "left",
    }
    page = page_of(tmp_path / "report")
    assert "0.5″" in page and "unit7" in page


REPAIR = """
limit_arcsec = 28
scrap = 900
minute = 1.2
currency = "EUR"
change = {"disc?.*" = 300, "housing.*" = 60}
minutes = {"*" = 15}
read = {"housing.pitch" = 10.8}
"""


@pytest.mark.slow
def test_a_unit_with_prices_is_told_what_to_do_and_what_to_measure_next(bench, tmp_path):
    """One gauge has read the housing already; the curve knows it, so nothing more is worth its time."""
    (tmp_path / "repair.toml").write_text(REPAIR, encoding="utf-8")
    options = ("--tolerances", bench.tolerances, "--repair", tmp_path / "repair.toml")
    answer = answer_of("diagnose", bench.curve, *options, *REPORT, tmp_path / "report")
    assert (answer["measure next"], answer["decision"]) == (None, "change housing.*")
    assert answer["decisions"][0]["decision"] == "change housing.*"
    assert {row["source"] for row in answer["readings"]} == {"pin.diameter", "disc1.pitch", "disc2.pitch"}
    assert all(row["expected cost after [cost units]"] >= 0 for row in answer["readings"])
    page = " ".join(page_of(tmp_path / "report").split())
    assert says(page, "diagnosis.stop") and says(page, "diagnosis.decide", unit="EUR")
    assert says(page, "diagnosis.next_heading")


@pytest.mark.slow
def test_a_curve_that_no_such_errors_make_is_not_diagnosed(bench, tmp_path):
    frame = pd.read_csv(bench.curve)[::12]  # to be short
    frame["transmission error [arcsec]"] = 30 * np.sin(np.radians(7 * frame["angle [deg]"]))
    frame.to_csv(tmp_path / "strange.csv", index=False)
    answer = answer_of("diagnose", tmp_path / "strange.csv", "--tolerances", bench.tolerances)
    assert answer["explained"] is False
    assert answer["named"] == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--noise", "0"], ["--noise", "0", "above 0"]),
        (["--level", "1"], ["--level", "0.5 up to but not 1"]),
        (["--discrepancy", "-1"], ["--discrepancy", "0 to 60"]),
        (["--torque", "9999"], ["torque", "9999"]),
        (["--tolerances", "nope"], ["nope", "rv20e_table4"]),
        (["--correlations", "nope.csv"], ["nope.csv"]),
        (["--seed", "-1"], ["seed", "-1"]),
        (["--repair", "nope.toml"], ["nope.toml"]),
    ],
)
def test_bad_options_are_refused_in_one_sentence(bench, tmp_path, options, words):
    refused(tolalloc("diagnose", bench.curve, *REPORT, tmp_path / "report", *options), *words)
    assert not (tmp_path / "report").exists()


def test_a_sheet_of_the_workbook_may_be_named(bench, tmp_path):
    workbook = tmp_path / "zones.xlsx"
    table = table_frame(load_tolerance_table("rv20e_table4"))
    write_sheets({"Rev A": table.assign(id="twice"), "Rev B": table}, workbook)
    words = {
        "Rev A": "twice",
        "Rev B": "--noise is 0",  # the table is in order, so the next fault is told
        "Rev C": "sheet is 'Rev C'; allowed is one of 'Rev A', 'Rev B'",
    }
    for sheet, said in words.items():
        options = ("--reducer", "rv20e_liu2020", "--tolerances", workbook, "--sheet", sheet, "--noise", "0")
        refused(tolalloc("diagnose", bench.curve, *options), said)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("angle [deg],te [arcsec]\n0,1\n", ["transmission error", "missing"]),
        ("angle [deg],transmission error [µm]\n0,1\n", ["unit", "µm"]),
        ("angle [deg],transmission error [arcsec]\n0,1\n10,2\n20,3\n", ["0.1 or more"]),
        ("angle [deg],transmission error [arcsec]\n0,one\n", ["row 2", "one"]),
    ],
)
def test_bad_curves_are_refused_in_one_sentence(tmp_path, content, words):
    (tmp_path / "curve.csv").write_text(content, encoding="utf-8")
    refused(tolalloc("diagnose", tmp_path / "curve.csv"), "curve.csv", *words)
