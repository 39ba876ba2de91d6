"""The inspection plan of a drawing, in its files and back again: names, limits, classes, samples, a lot's values."""

import csv
from pathlib import Path

import numpy as np
import pytest
from ezdxf import readfile
from openpyxl import load_workbook
from typer.testing import CliRunner

import tolalloc as ta
from tolalloc.capability.conformity import guard_band, parts_to_show
from tolalloc.cli.main import app
from tolalloc.drawings.drawing import load_drawing
from tolalloc.drawings.qdas_file import read_description
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.wings.bench.lots import load_lot

ROW = {"unit": "µm", "min": 2, "max": 60, "cost": 10.0, "uncertainty": 1.5}
ROWS = [
    {"id": "bore", "label": "Bohrung", "nominal": 42.0, "plus": 25, "minus": -25, **ROW, "drawing": "4711 B"},
    {"id": "ring", "nominal": 6.0, "plus": 40, "minus": 0, **ROW, "Cp": 1.33, "max": 90},
    {"id": "small", "nominal": 3.0, "plus": 2, "minus": -2, **ROW, "uncertainty": 0, "min": 1, "max": 5},
]
GAP = "gap [µm]"


@pytest.fixture(scope="module")
def told():
    model = ta.model(
        lambda bore, ring, small: 1000 * (bore - ring - small) - 33_000,
        inputs={"bore": 42.0, "ring": 6.0, "small": 3.0},
        outputs=(GAP,),
    )
    limits = {GAP: ta.Limit(lower=-60.0, upper=30.0)}
    return ta.Study(
        model,
        ta.Drawing.of_rows(ROWS),
        limits=limits,
        questions=[ta.Allocation(front=False, what_if=False)],
        name="plan",
    ).allocate(effort="quick")


@pytest.fixture(scope="module")
def folder(told, tmp_path_factory):
    found = tmp_path_factory.mktemp("plan")
    told.teller.add_files(found)
    return found


def plan_of(folder: Path) -> list[dict[str, object]]:
    head, *rows = load_workbook(folder / "drawing.xlsx")["inspection plan"].iter_rows(values_only=True)
    return [dict(zip(head, row, strict=True)) for row in rows if isinstance(row[0], int)]


def test_description_has_the_names_nominal_sizes_and_limits_of_the_table(folder):
    described = [own.fields for own in read_description(folder / "inspection.dfd").values()]
    rows = list(csv.DictReader((folder / "allocation.csv").read_text(encoding="utf-8").splitlines()))
    rows = [own for own in rows if not own["id"].startswith("#")]
    assert [own["K2003"] for own in described] == [own["id"] for own in rows]
    assert [own["K2001"] for own in described] == ["1", "2", "3"]
    for own, row in zip(described, rows, strict=True):
        nominal, plus, minus = (float(row[name]) for name in ("nominal [mm]", "plus [unit]", "minus [unit]"))
        assert float(own["K2101"]) == nominal
        assert 0 <= plus / 1000 - float(own["K2113"]) < 2e-5  # written in steps of 0.01 µm, inside the zone
        assert 0 <= float(own["K2112"]) - minus / 1000 < 2e-5
        assert float(own["K2111"]) == pytest.approx(nominal + float(own["K2113"]), abs=1e-9)
        assert float(own["K2110"]) == pytest.approx(nominal + float(own["K2112"]), abs=1e-9)
        assert own["K2142"] == "mm"
    assert described[0]["K2002"] == "Bohrung (bore)"


def test_plan_measures_what_drives_as_often_as_shows_its_capability(folder):
    plan = {own["dimension"]: own for own in plan_of(folder)}
    assert plan["Bohrung"]["when"] == plan["ring"]["when"] == "every batch"
    assert plan["small"]["when"].startswith("first article")
    assert plan["Bohrung"]["sample [-]"] == parts_to_show(1.0, 4 / 3)
    assert plan["ring"]["sample [-]"] == parts_to_show(1.33, 4 / 3 * 1.33)
    assert plan["small"]["sample [-]"] == 5
    assert plan["ring"]["population"] == "Cp ≥ 1.33, centred"
    assert plan["Bohrung"]["drawing"] == "4711 B"


def test_acceptance_lies_a_guard_band_inside_and_rejects_what_the_formula_says(told, folder):
    plan = {own["dimension"]: own for own in plan_of(folder)}
    own, (source, *_) = plan["Bohrung"], told.result.drawn_sources
    guard = guard_band(1.5e-3)
    assert own["accept to [mm]"] == pytest.approx(own["upper deviation [mm]"] - guard, abs=1e-6)
    assert own["accept from [mm]"] == pytest.approx(own["lower deviation [mm]"] + guard, abs=1e-6)
    sigma, error, upper = source.zone * 1e3 / 6, 1.5e-3 / 2, own["upper deviation [mm]"]
    shown = np.random.default_rng(2).normal(0.0, sigma, (2, 2_000_000)) * np.array([[1.0], [error / sigma]])
    accepted = np.abs(shown.sum(axis=0)) <= upper - guard
    rejected = (~accepted & (np.abs(shown[0]) <= upper)).mean()
    assert own["good parts rejected [%]"] / 100 == pytest.approx(rejected, abs=4 * np.sqrt(rejected / 2e6))
    assert not plan["small"]["good parts rejected [%]"]
    assert plan["small"]["accept to [mm]"] == plan["small"]["upper deviation [mm]"]


def test_every_balloon_of_the_sheet_is_a_line_of_the_plan(folder):
    sheet = readfile(folder / "frames.dxf").modelspace()
    balloons = {own.dxf.text for own in sheet.query("TEXT") if own.dxf.layer == "BALLOONS"}
    assert balloons == {str(own["no. [-]"]) for own in plan_of(folder)}
    texts = [own.dxf.text for own in sheet.query("TEXT")]
    assert "Cp ≥ 1.33, centred" in texts
    notes = " ".join(own.text for own in sheet.query("MTEXT"))
    assert "Population (in the sense of ISO 18391)" in notes
    assert "spread evenly" in notes


@pytest.mark.parametrize("comma", [False, True])
def test_lot_reads_the_values_that_a_measuring_room_puts_behind_the_description(folder, tmp_path, comma):
    described = read_description(folder / "inspection.dfd")
    drawing, generator = load_drawing(folder / "allocation.csv"), np.random.default_rng(4)
    lines = []
    for _ in range(60):
        values = []
        for own, source in zip(described.values(), drawing.sources, strict=True):
            moved = 0.3 * source.zone * (source.name == "ring")
            sigma = source.zone / 6 / source.cp
            deviation = source.middle + moved + sigma * generator.standard_normal()
            values.append(f"{float(own.fields['K2101']) + deviation * 1e3:.6f}\x140")
        lines.append("\x0f".join(values))
    text = (folder / "inspection.dfd").read_text(encoding="utf-8") + "\r\n".join(lines) + "\r\n"
    lot = tmp_path / "lot.dfq"
    lot.write_text(text.replace(".", ",") if comma else text, encoding="utf-8")
    run = CliRunner().invoke(app, ["lot", str(lot), str(folder / "allocation.csv")])
    assert run.exit_code == 0, run.output
    said = " ".join(run.output.split())
    assert "Moved: the mean of ring" in said
    assert "The other 2 columns agree with the drawing's processes." in said


def test_lot_refuses_a_unit_that_it_does_not_know_and_a_characteristic_of_no_source(folder, tmp_path):
    text = (folder / "inspection.dfd").read_text(encoding="utf-8")
    for name, changed, said in (
        (
            "unit",
            text.replace("K2142/1 mm", "K2142/1 furlong"),
            "the unit (K2142) is 'furlong'; allowed is µm, um or mm",
        ),
        ("source", text.replace("K2003/1 bore", "K2003/1 boar"), "boar"),
    ):
        lot = tmp_path / f"{name}.dfq"
        lot.write_text(changed + "42.0\x0f6.0\x0f3.0\r\n" * 6, encoding="utf-8")
        run = CliRunner().invoke(app, ["lot", str(lot), str(folder / "allocation.csv")])
        assert isinstance(run.exception, InputError | UnknownNameError)
        assert said in str(run.exception)


def test_zones_that_their_gauges_do_not_resolve_are_named_at_once_on_page_1(told):
    result = told.result
    fine = [own.name for own in result.drawn_sources if own.zone < 10 * own.uncertainty]
    said = [text for section in told.teller.sections if section.first for text in section.paragraphs]
    named = [text for text in said if "uncertainty of its gauge" in text]
    assert len(named) == bool(fine)
    assert all(name in named[0] for name in fine)


@pytest.mark.parametrize(
    ("status", "note", "known"),
    [
        ("", "", {}),
        ("", "assumed: as alike", dict.fromkeys(("zone", "range", "cost"), "assumed")),
        ("", "zone, range and cost assumed: scaled", dict.fromkeys(("zone", "range", "cost"), "assumed")),
        ("supplier", "assumed: old", dict.fromkeys(("zone", "range", "cost"), "supplier")),
        ("zone:measured cost:estimated", "", {"zone": "measured", "cost": "estimated"}),
        ("cost:measured", "assumed: rest", {"zone": "assumed", "range": "assumed", "cost": "measured"}),
    ],
)
def test_status_of_a_row_is_what_it_states_or_what_its_note_begins_with(status, note, known):
    own = ta.Drawing.of_rows(
        [{"id": "bore", "plus": 5, "minus": -5, **ROW, "provenance": status, "note": note}]
    ).sources[0]
    assert own.known_from == known


@pytest.mark.parametrize(
    "bad", ["guessed", "zone:guessed", "price:assumed", "zone:assumed zone:measured", "assumed cost:measured"]
)
def test_unknown_statuses_are_refused_with_what_is_allowed(bad):
    with pytest.raises(InputError, match="allowed is one of measured, standard, supplier, estimated, assumed for all"):
        ta.Drawing.of_rows([{"id": "bore", "plus": 5, "minus": -5, **ROW, "provenance": bad}])


def said_of(statuses, **changed):
    rows = [own | {"provenance": status} for own, status in zip(ROWS, statuses, strict=True)]
    model = ta.model(
        lambda bore, ring, small: 1000 * (bore - ring - small) - 33_000,
        inputs={"bore": 42.0, "ring": 6.0, "small": 3.0},
        outputs=(GAP,),
    )
    limits = {GAP: ta.Limit(lower=-60.0, upper=30.0)}
    study = ta.Study(
        model, ta.Drawing.of_rows(rows), limits=limits, questions=[ta.Allocation(front=False, what_if=False)]
    )
    answer = study.allocate(effort="quick")
    return answer, [text for own in answer.teller.sections if own.first for text in own.paragraphs]


def test_study_of_assumed_numbers_alone_says_so_first():
    answer, paragraphs = said_of(["assumed"] * 3)
    assert answer.teller.sentences[0].startswith("Every zone, range and cost in this table is assumed")
    assert answer.teller.before == answer.teller.sentences[:1]
    assert not any(text.startswith("Assumed, not measured") for text in paragraphs)


def test_assumed_prices_are_counted_with_what_they_make_of_the_change_of_cost():
    answer, paragraphs = said_of(["assumed", "supplier", "zone:measured cost:assumed"])
    (said,) = [text for text in paragraphs if text.startswith("Assumed, not measured")]
    drawn = answer.result.drawn_sources
    moved = [abs(own.cost - 10.0) for own in drawn]
    share = (moved[0] + moved[2]) / sum(moved)
    assert "1 of 3 zones, 1 of 3 ranges and 2 of 3 costs" in said
    assert f"costs account for {100 * share:.0f}" in said


def test_table_that_says_nothing_of_its_numbers_gets_no_count(told):
    assert not any("ssumed, not measured" in text for own in told.teller.sections for text in own.paragraphs)
    assert told.teller.before == ()


def test_line_of_several_sizes_or_gauges_is_parted_in_the_plan_and_a_gauge_too_coarse_is_no_end(tmp_path):
    rows = [own | {"group": "seats", "max": 60} for own in ROWS[:2]] + [ROWS[2] | {"uncertainty": 40.0}]
    rows[1] |= {"plus": 25, "minus": -25, "Cp": 1.0}
    model = ta.model(
        lambda bore, ring, small: 1000 * (bore - ring - small) - 33_000,
        inputs={"bore": 42.0, "ring": 6.0, "small": 3.0},
        outputs=(GAP,),
    )
    limits = {GAP: ta.Limit(lower=-60.0, upper=60.0)}
    study = ta.Study(
        model, ta.Drawing.of_rows(rows), limits=limits, questions=[ta.Allocation(front=False, what_if=False)]
    )
    answer = study.allocate(effort="quick")
    answer.teller.add_files(tmp_path)
    plan = plan_of(tmp_path)
    assert [own["nominal [mm]"] for own in plan] == [42, 6, 3]
    assert plan[2]["accept to [mm]"] == "no gauge reading can show it"
    assert [own.fields["K2101"] for own in read_description(tmp_path / "inspection.dfd").values()] == [
        "42.000000",
        "6.000000",
        "3.000000",
    ]


def test_lot_pools_the_values_of_like_places_of_one_name(folder, tmp_path):
    text = (folder / "inspection.dfd").read_text(encoding="utf-8").replace("K2003/3 small", "K2003/3 bore")
    text = text.replace("K2101/3 3.000000", "K2101/3 42.000000")
    generator = np.random.default_rng(1)
    lines = [
        "\x0f".join(f"{size + 1e-3 * own:.6f}" for size, own in zip((42.0, 6.005, 42.0), row, strict=True))
        for row in generator.standard_normal((20, 3))
    ]
    lot = tmp_path / "lot.dfq"
    lot.write_text(text + "\r\n".join(lines), encoding="utf-8")
    columns = load_lot(lot, load_drawing(folder / "allocation.csv").sources)
    assert {own.name: own.taken.size for own in columns} == {"bore": 40, "ring": 20}
