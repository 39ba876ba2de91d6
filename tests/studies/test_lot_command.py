"""The command ``tolalloc lot``: readings and a drawing in, what moved and the lot's own table out."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import headed, page_of, says, summary_of
from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.wings.bench import lot_orders

DRAWING = """id,feature,nominal [mm],plus [unit],minus [unit],unit,min [unit],max [unit],cost,spectrum,systematic,locked
hub,size,40,8,-4,µm,1,60,1,,,no
bore,position,0,10,0,µm,1,60,1,,,no
ring.pitch,pitch,0,12,0,µm,1,60,1,1:2 2:1,,no
ring.runout,runout,0,12,0,µm,1,60,1,1:2 2:1,2:5@30,no
exact,size,40,0,0,µm,0,0,0,,,yes
"""
HUB = ("1", "4", "1.5", "3", "2.5", "0.5", "3.5")
BORE = ("1", "2", "3", "1.5", "2.5", "0.5", "3.5")


def written(folder, *columns):
    """Write readings, each column its head and its cells, and the drawing, and return both paths."""
    heads, cells = [own[0] for own in columns], [own[1] for own in columns]
    rows = [",".join(row) for row in zip(*cells, strict=True)]
    lot, drawing = folder / "lot.csv", folder / "drawing.csv"
    lot.write_text("\n".join([",".join(heads), *rows]) + "\n", encoding="utf-8")
    drawing.write_text(DRAWING, encoding="utf-8")
    return lot, drawing


def test_a_lot_is_told_reported_and_read_back_as_a_drawing(tmp_path):
    shifted = [f"{float(cell) + 5}" for cell in HUB]
    lot, drawing = written(tmp_path, ("unit", "1234567"), ("hub [µm]", shifted), ("bore.radius [µm]", BORE))
    folder, table = tmp_path / "report", tmp_path / "zones.csv"
    done = tolalloc("lot", lot, drawing, "--next-parts", 5, "--write", table, "--out", folder)
    assert done.returncode == 0, done.stderr
    assert "Moved: the mean of hub, " in done.stdout
    assert "The tolerance table of the lot is" in done.stderr
    summary = summary_of(folder)
    assert summary["moved"] == ["hub"]
    limits = next(row for row in summary["control limits"] if row["source"] == "hub")
    # Zone −4…8: middle 2, σ 2; A of five parts is 1.342 and B6 1.964.
    assert limits["mean, upper limit [µm]"] == pytest.approx(2 + 1.342 * 2, abs=1e-3)
    assert limits["s, upper limit [µm]"] == pytest.approx(1.964 * 2, abs=1e-3)
    assert {file.name for file in (folder / "figures").iterdir()} >= {"shift.png", "spread.png"}
    of_report, asked = ta.drawing(folder / "lot.tolerances.csv"), ta.drawing(table)
    assert [own.shift for own in of_report.sources] == [own.shift for own in asked.sources]
    hub = asked.sources[0]
    assert hub.shift == pytest.approx((sum(map(float, shifted)) / 7 - 2) / 6, abs=1e-4)
    assert asked.sources[2:] == ta.drawing(drawing).sources[2:]  # what was not measured stays as it is


def test_a_lot_of_the_drawing_s_processes_moves_nothing(tmp_path):
    done = tolalloc("lot", *written(tmp_path, ("hub [µm]", HUB), ("bore.radius [µm]", BORE)))
    assert "No process moved: all 2 columns" in done.stdout, done.stdout


def test_a_row_of_gauges_is_taken_off_the_spread_and_said(tmp_path):
    rows = ("part", [*map(str, range(1, 8)), "Gauge"]), ("hub [µm]", [*HUB, "0.5"]), ("bore.radius [µm]", [*BORE, ""])
    lot, drawing = written(tmp_path, *rows)
    summary = answer_of("lot", lot, drawing, "--out", tmp_path / "report")
    hub, bore = summary["processes"]
    square = pd.Series(map(float, HUB)).var()
    assert hub["readings [-]"] == 7
    assert hub["standard deviation [µm]"] == pytest.approx((square - 0.25) ** 0.5)
    assert hub["variance by the gauge [%]"] == pytest.approx(25 / square)
    assert bore["variance by the gauge [%]"] == ""
    page = page_of(tmp_path / "report")
    assert "The gauge contributes most to hub" in page and "only for hub, all other gauges are taken as exact" in page


def test_an_office_s_file_is_read_with_semicolons_and_decimal_commas(tmp_path):
    lot, drawing = written(tmp_path, ("hub [µm]", HUB), ("bore.radius [µm]", BORE))
    plain = tolalloc("lot", lot, drawing).stdout
    text = lot.read_text(encoding="utf-8").replace(",", ";").replace(".5", ",5")
    lot.write_text(text, encoding="cp1252")
    assert ",5" in text
    assert tolalloc("lot", lot, drawing).stdout == plain


def test_a_workbook_is_read_as_its_csv(tmp_path):
    lot, drawing = written(tmp_path, ("hub [µm]", ("", *HUB[1:])), ("bore.radius [µm]", BORE))
    book = tmp_path / "lot.xlsx"
    pd.read_csv(lot).to_excel(book, index=False)
    said = [tolalloc("lot", path, drawing).stdout for path in (lot, book)]
    assert said[0].replace("lot.csv", "lot.xlsx").split() == said[1].split()
    pd.DataFrame(columns=["hub [µm]"]).to_excel(tmp_path / "empty.xlsx", index=False)
    refused(tolalloc("lot", tmp_path / "empty.xlsx", drawing), "the table has no rows")


def test_readings_in_another_unit_are_doubted_and_their_row_is_cut_to_what_a_table_takes(tmp_path):
    done = tolalloc("lot", *written(tmp_path, ("hub [mm]", [f"{float(cell) / 2}" for cell in HUB])))
    assert "7 of 7 readings lie more than ten times as far out" in done.stdout
    assert "its row has the nearest, Cp 0.1 and shift 1" in done.stdout


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        ([("hub", HUB)], "the unit of column 'hub' is ''; allowed is µm or um or mm or in or inch in square brackets"),
        ([("hub [yard]", HUB)], "the unit of column 'hub [yard]' is 'yard'"),
        ([("hup [µm]", HUB)], "unknown source of column 'hup'; the nearest known is hub"),
        ([("bore [µm]", HUB)], "allowed is bore.radius or bore.diameter, or both bore.x and bore.y"),
        ([("hub.radius [µm]", HUB)], "unknown source of column 'hub.radius'"),
        ([("bore.x [µm]", HUB)], "what is measured of bore is 'bore.x [µm]'; allowed is radius, diameter, or x with y"),
        ([("bore.x [µm]", HUB), ("bore.radius [µm]", HUB)], "is 'bore.x [µm], bore.radius [µm]'; allowed is radius"),
        ([("bore.x [µm]", HUB), ("bore.y [µm]", ("", *HUB[1:]))], "row 2: bore has one coordinate"),
        ([("hub [µm]", HUB), ("hub [µm]", HUB)], "the column 'hub [µm]' is there twice; each has one"),
        ([("hub [µm]", ("thick", *HUB[1:]))], "row 2: hub [µm] is 'thick'; allowed is a number"),
        ([("hub [µm]", ("9999999", *HUB[1:]))], "row 2: hub [µm] is 9999999.0; allowed is -1,000,000 to 1,000,000 µm"),
        ([("bore.radius [µm]", ("-1", *HUB[1:]))], "row 2: bore.radius [µm] is -1.0; allowed is 0 to 1,000,000 µm"),
        ([("ring.pitch [mm]", ("3000", *HUB[1:]))], "row 2: ring.pitch [mm] is 3000.0; allowed is 0 to 1,000,000 µm"),
        ([("hub [µm]", ("1", "2", "3", "4", "", "n/a", "-"))], "the number of readings of 'hub [µm]' is 4; allowed"),
        ([("hub [µm]", ["2"] * 7)], "every reading of 'hub [µm]' is 2; allowed are readings that differ"),
        ([("exact [µm]", HUB)], "the zone of exact is 0; allowed is a zone above 0"),
        (
            [("ring.runout [µm]", HUB)],
            "systematic of ring.runout is 'stated on the drawing'; allowed is a source without",
        ),
        ([("part", ["1"] * 7), ("hub [µm]", HUB)], "the number of parts of 'hub [µm]' is 1; allowed is 5 or more"),
        (
            [("note", [*"123456", "gauge"]), ("hub [µm]", HUB)],
            "the standard deviation by the gauge of 'hub [µm]' is '3.5 µm'; allowed is less than that of the parts",
        ),
        (
            [("note", [*"12345", "gauge", "gauge"]), ("hub [µm]", HUB)],
            "the number of rows 'gauge' is 2; allowed is 1",
        ),
        (
            [("note", [*"123456", "gauge"]), ("hub [µm]", (*HUB[:6], "-1"))],
            "row 8: the gauge of 'hub [µm]' is -1.0; allowed is above 0, or empty",
        ),
        ([("part", HUB)], "no column holds readings; allowed are heads such as 'disc1.pitch [µm]'"),
    ],
)
def test_readings_that_are_not_allowed_are_refused_in_one_sentence(tmp_path, columns, sentence):
    refused(tolalloc("lot", *written(tmp_path, *columns)), sentence)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--false-alarms", "0.6"), "--false-alarms is 0.6; allowed is 0.001 to 0.5"),
        (("--next-parts", "1"), "--next-parts is 1; allowed is 2 to 10000"),
        (("--torque", "-5"), "--torque is -5.0; allowed is none without curves"),
        (("--seed", "-1"), "--seed is -1; allowed is 0 or a positive integer"),
        (("--sheet", "zones"), "sheet is 'zones'; allowed is none"),
    ],
)
def test_a_wrong_option_is_refused(tmp_path, options, sentence):
    refused(tolalloc("lot", *written(tmp_path, ("hub [µm]", HUB)), *options), sentence)


def test_files_that_are_missing_empty_or_there_already_are_refused(tmp_path):
    lot, drawing = written(tmp_path, ("hub [µm]", HUB))
    refused(tolalloc("lot", tmp_path / "none.csv", drawing), "no such file")
    refused(tolalloc("lot", lot, "rv21e_drawing"), "unknown name 'rv21e_drawing'")
    refused(tolalloc("lot", lot, drawing, "--write", drawing), "the file exists")
    (tmp_path / "empty.csv").write_text("hub [µm]\n", encoding="utf-8")
    refused(tolalloc("lot", tmp_path / "empty.csv", drawing), "the table has no rows")


@pytest.mark.slow
def test_curves_of_a_lot_tell_the_orders_that_moved_and_what_makes_them(tmp_path, monkeypatch):
    monkeypatch.setattr(lot_orders, "_UNITS", 128)
    monkeypatch.setattr(lot_orders, "_REDRAWN", 4)
    lot, curves, angle = tmp_path / "lot.csv", tmp_path / "curves", np.arange(0.0, 360.0, 0.5)
    lot.write_text("pin.diameter [µm]\n" + "\n".join(HUB) + "\n", encoding="utf-8")
    curves.mkdir()
    for unit in range(5):  # 9″ of order 2, and nothing else
        rows = zip(angle, 9.0 * np.cos(2.0 * np.radians(angle) + unit), strict=True)
        text = "".join(f"{one},{value:.5f}\n" for one, value in rows)
        (curves / f"{unit}.csv").write_text(f"angle [deg],transmission error [arcsec]\n{text}", encoding="utf-8")
    asked = ("lot", lot, "rv20e_drawing", "--curves", curves)
    refused(tolalloc(*asked, "--out", tmp_path / "report"), "--reducer is missing: where a file is written")
    refused(tolalloc(*asked, "--noise", "0"), "--noise is 0.0; allowed is above 0 up to 60")
    teller = ta.lot(lot, "rv20e_drawing", curves=curves, reducer="rv20e").teller
    assert says(teller.sentences, "lot.order_of_several")
    assert headed(teller.sections, "lot.orders_heading")
    summary = json.loads(json.dumps(teller.summary))
    orders = {row["order"]: row for row in summary["orders of the curves"]}
    assert orders[2]["root mean square amplitude of the lot [arcsec]"] == pytest.approx(9.0, abs=1e-4)
    assert orders[2]["moved"] == orders[40]["moved"] == "yes"  # one too large, the other too small
    assert "carrier.assembly" in orders[2]["sources, total effect on it"]
