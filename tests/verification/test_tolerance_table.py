"""Distributions in a user's table: written and read again, measured parts from their files, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tests.builders import prepared
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_frame, with_zones
from tolalloc.exceptions import InputError, TolallocError

PARTS = 0.5e-6 + 0.6e-6 * stats.weibull_min(2.5).ppf((np.arange(60) + 0.5) / 60)

HEADER = (
    "id,part,feature,plus,minus,unit,min,max,cost,distribution,Cp,shift,shape,batches,measured,sorted,spectrum,process"
)
BASE = {
    "id": "a",
    "part": "p",
    "feature": "size",
    "plus": "2",
    "minus": "-2",
    "unit": "µm",
    "min": "1",
    "max": "9",
    "cost": "1",
}
POSITION = {"feature": "position", "plus": "4", "minus": "0"}
PITCH = {"feature": "pitch", "plus": "4", "minus": "0", "spectrum": "1:2 2:1"}


def write_table(folder, *rows):
    pd.DataFrame([BASE | row for row in rows], columns=HEADER.split(",")).to_csv(folder / "t.csv", index=False)
    return folder / "t.csv"


def write_parts(folder, header="deviation [µm]", rows=None):
    rows = [f"{value:.4f}" for value in 1e6 * PARTS] if rows is None else rows
    (folder / "parts.csv").write_text("\n".join([header, *map(str, rows)]), encoding="utf-8")


def test_every_column_survives_writing_and_reading_at_other_zones_and_from_another_folder(tmp_path, generator):
    write_parts(tmp_path)
    sources = load_tolerance_table(
        write_table(
            tmp_path,
            {"id": "a", "distribution": "weibull", "shape": "1.234567890123", "Cp": "1.1", "shift": "0.1"},
            {"id": "b", "distribution": "mixture", "batches": "0.7:-0.3:0.81234567 0.3:0.5:0.6", "sorted": "yes"},
            {"id": "c", "distribution": "empirical", "measured": "parts.csv"},
            {"id": "d", "process": "honed to limit"},
            {"id": "e", **PITCH, "spectrum": "1:9.2 3:0.123456789 random:1.0/40"},
            {"id": "f", "distribution": "Beta", "shape": "2.25 5", "Cp": "1.2"},
            {"id": "g", "distribution": "trapezoid", "shape": "0.35", "shift": "-0.2"},
            {"id": "h", "distribution": "RAYLEIGH", "sorted": "yes"},
            {"id": "i", **POSITION, "distribution": "beta", "shape": "3 2"},
        )
    )
    moved = with_zones(sources, [0.8 * own.zone for own in sources])
    (tmp_path / "elsewhere").mkdir()
    table_frame(moved).to_csv(tmp_path / "elsewhere" / "t.csv", index=False)
    again = load_tolerance_table(tmp_path / "elsewhere" / "t.csv")
    for own, other in zip(moved, again, strict=True):
        uniform = generator.random((100, len(own.columns)))
        np.testing.assert_allclose(other.standard_values(uniform), own.standard_values(uniform), rtol=1e-12, atol=1e-12)
        assert other.written_spectrum == own.written_spectrum
        assert (other.process, other.sorted, other.shape) == (own.process, own.sorted, own.shape)
        assert other.mapping == own.mapping
    assert "3.2 µm, full width" in again[2].mapping
    assert "assumed to scale with the zone from the 4 µm" in again[2].mapping


def test_a_written_table_names_measured_parts_from_its_own_folder(tmp_path):
    (tmp_path / "shop").mkdir()
    write_parts(tmp_path / "shop")
    table = write_table(tmp_path / "shop", {"distribution": "empirical", "measured": "parts.csv"})
    sources, runs = load_tolerance_table(table), tmp_path / "runs" / "one"
    frame = table_frame(sources, runs)
    assert frame["measured"].tolist() == ["../../shop/parts.csv"]
    runs.mkdir(parents=True)
    frame.to_csv(runs / "t.csv", index=False)
    assert load_tolerance_table(runs / "t.csv")[0].measured == sources[0].measured


def test_the_same_files_in_another_folder_are_the_same_study(tmp_path, monkeypatch):
    found = {}
    for folder in ("one", "two", "other"):
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        frame = table_frame(load_tolerance_table("rv20e_table4"))
        chosen = frame["id"] == "pin.diameter"
        frame.loc[chosen, ["distribution", "measured"]] = ["empirical", "parts.csv"]
        frame.to_csv("t.csv", index=False)
        write_parts(Path.cwd(), rows=[f"{(2 if folder == 'other' else 1) * value:.4f}" for value in 1e6 * PARTS])
        Path("correlations.csv").write_text("sources,correlation\ndisc1.bore1.position disc1.bore2.position,0.5\n")
        found[folder] = prepared(name="same", drawing={"table": "t.csv", "correlations": "correlations.csv"}).digest
    assert found["one"] == found["two"] != found["other"]


def test_measured_positions_are_read_as_axes_or_as_radii(tmp_path):
    rows = [f"{0.1 * k},{0.05 * k}" for k in range(20)]
    write_parts(tmp_path, "x [µm],y [µm]", rows)
    table = write_table(tmp_path, POSITION | {"distribution": "empirical", "measured": "parts.csv"})
    axes = load_tolerance_table(table)[0]
    write_parts(tmp_path, "radius [mm]", [np.hypot(0.1, 0.05) * k / 1000 for k in range(20)])
    radii = load_tolerance_table(table)[0]
    np.testing.assert_allclose(axes.measured.values, radii.measured.values, rtol=1e-12)
    assert axes.measured.are_radii


BAD_ROWS = [
    ({"distribution": "truncated"}, "allowed is one of normal, .*; a truncated one is written .* sorted = yes"),
    ({"distribution": "gamma"}, "distribution is 'gamma'; allowed is one of normal, uniform"),
    ({"distribution": "beta"}, "beta needs 2 shapes such as '2 5', each from 1 to 50: none"),
    ({"distribution": "beta", "shape": "2"}, "beta needs 2 shapes such as '2 5', each from 1 to 50: 2"),
    ({"distribution": "beta", "shape": "2 0.5"}, "each from 1 to 50: 2 0.5"),
    (
        {"distribution": "beta", "shape": "2:5"},
        "shape is '2:5'; allowed is a number with a decimal point, or for beta two",
    ),
    ({"distribution": "trapezoid"}, "trapezoid needs a shape from 0.01 to 0.99: none"),
    ({"distribution": "trapezoid", "shape": "1"}, "trapezoid needs a shape from 0.01 to 0.99: 1"),
    ({"distribution": "trapezoid", "shape": "0.2 0.4"}, "trapezoid needs a shape from 0.01 to 0.99: 0.2 0.4"),
    (
        {"distribution": "rayleigh", "shape": "2"},
        "rayleigh has no shape; trapezoid, beta, lognormal and weibull have one",
    ),
    (POSITION | {"distribution": "rayleigh"}, "rayleigh is for radial sizes; for feature position allowed is normal"),
    (PITCH | {"distribution": "rayleigh"}, "rayleigh is for radial sizes; for feature pitch allowed is normal"),
    ({"distribution": "weibull"}, "needs a shape from 0.3 to 20: none"),
    ({"distribution": "lognormal", "shape": "9"}, "needs a shape from 0.02 to 1.5: 9"),
    ({"shape": "2"}, "normal has no shape"),
    ({"distribution": "weibull", "shape": "two"}, "shape is 'two'; allowed is a number"),
    ({"distribution": "mixture"}, "go together"),
    ({"batches": "1:0:1"}, "go together"),
    ({"distribution": "mixture", "batches": "0.5:0.1"}, "must read like '0.7:-0.3:0.8"),
    ({"distribution": "mixture", "batches": "0.5:3:1"}, "shift -2 to 2"),
    (
        {"distribution": "mixture", "batches": "1:0:1", "Cp": "2"},
        "batches .* state their spreads, so Cp must be 1: 2",
    ),
    (POSITION | {"distribution": "mixture", "batches": "1:0.2:1"}, "shift of a batch must be 0 for feature position"),
    ({"distribution": "empirical"}, "go together"),
    ({"measured": "parts.csv"}, "go together"),
    (
        {"distribution": "empirical", "measured": "parts.csv", "Cp": "1.3"},
        "show spread and mean, so Cp must be 1",
    ),
    ({"distribution": "empirical", "measured": "none.csv"}, "none.csv: no such file"),
    (PITCH | {"distribution": "empirical", "measured": "parts.csv"}, "is for sizes and positions, not for pitch"),
    (PITCH | {"sorted": "yes"}, "sorted concerns all orders of a part at once.*: 2 orders"),
    (PITCH | {"distribution": "mixture", "batches": "1:0:1"}, "mixture concerns all orders"),
    (PITCH | {"distribution": "uniform", "spectrum": "random:1/40"}, "random part of the spectrum is normal"),
    (PITCH | {"spectrum": "random:1/2"}, "on 4 to 400 teeth"),
    (PITCH | {"spectrum": "random:1/40 random:1/40"}, "at most one random part"),
    (PITCH | {"spectrum": "21:1 random:1/40"}, "highest order must be 20 or less"),
    (PITCH | {"spectrum": "1:2 1:3"}, "1:3 must be an order from 1 up to 100, each once"),
    ({"sorted": "maybe"}, "sorted is 'maybe'; allowed is yes or no"),
    ({"distribution": "mixture", "batches": "1:2:0.1", "sorted": "yes"}, "would leave less than 1% of all parts"),
]


@pytest.mark.parametrize(("row", "sentence"), BAD_ROWS)
def test_bad_rows_are_refused_in_one_sentence(row, sentence, tmp_path):
    write_parts(tmp_path)
    with pytest.raises(TolallocError, match=sentence) as caught:
        load_tolerance_table(write_table(tmp_path, row))
    assert "row 2 (a)" in str(caught.value) or "none.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


BAD_PARTS = [
    ("deviation [µm]", range(19), "number of measured parts is 19; allowed is 20 or more"),
    ("deviation [µm]", [*range(19), "x"], r"parts.csv, row 21: deviation \[µm\] is 'x'; allowed is a number"),
    ("deviation [µm]", [*range(19), 9e6], "row 21: .* is '9000000.0'; allowed is a number from -1000000 to 1000000 µm"),
    ("deviation [µm]", [*range(19), "nan"], "row 21: .* is 'nan'"),
    ("deviation", range(30), "the unit of column 'deviation' is ''"),
    ("radius [µm]", range(30), "columns for feature size is .*; allowed is deviation"),
    ("deviation [µm]", [3] * 30, "parts that differ"),
]


@pytest.mark.parametrize(("header", "rows", "sentence"), BAD_PARTS)
def test_bad_measured_parts_are_refused_in_one_sentence(header, rows, sentence, tmp_path):
    write_parts(tmp_path, header, rows)
    with pytest.raises(InputError, match=sentence):
        load_tolerance_table(write_table(tmp_path, {"distribution": "empirical", "measured": "parts.csv"}))


def test_a_negative_radius_is_refused(tmp_path):
    write_parts(tmp_path, "radius [µm]", [*range(20), -1])
    with pytest.raises(InputError, match=r"row 22: radius \[µm\] is '-1 µm'; allowed is 0 or more"):
        load_tolerance_table(write_table(tmp_path, POSITION | {"distribution": "empirical", "measured": "parts.csv"}))
