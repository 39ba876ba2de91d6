"""What leaves the program of an own function with a setting: zones, setting, costs and weights of the answer."""

from __future__ import annotations

import csv
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from ezdxf import readfile
from openpyxl import load_workbook

import tolalloc as ta
from tests.builders import says
from tests.sheets import cells, frames, paragraphs
from tolalloc.allocation.search.zone_allocation import REACH_OF_MODELS
from tolalloc.allocation.space.effort import QUICK_ALLOCATION
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reports.drawing_sheet import LAYERS
from tolalloc.reports.feature_frame import callout
from tolalloc.study.prepared import Prepared
from tolalloc.study.problem import Effort

GAP, SPRING = "gap [mm]", "spring [mm]"
ZONE = {"unit": "mm", "min": 0.005, "max": 0.3, "distribution": "normal", "Cp": 1.0}
SMALL = replace(QUICK_ALLOCATION, verification_units=8192, confirmation_units=65_536, error=0.05)
ROWS = [
    {"id": "a", "nominal": 10.0, "plus": 0.1, "minus": -0.1, "cost": 1.0, **ZONE},
    {"id": "b", "nominal": 4.0, "plus": 0.1, "minus": -0.1, "cost": 3.0, **ZONE},
    {"id": "c", "nominal": 4.0, "plus": 0.05, "minus": -0.05, "cost": 0.5, **ZONE, "locked": "yes"},
    {"id": "d", "nominal": 1.0, "plus": 0.02, "minus": -0.02, "cost": 2.0, **ZONE},
]
COSTS = {
    "a": [("today", 0.0, 0.1, 0.02, 0.2), ("ground", 0.25, 0.04, 0.005, 0.1)],
    "b": [("today", 0.0, 0.3, 0.02, 0.2), ("ground", 0.5, 0.1, 0.005, 0.1)],
}


def gap(a, b, c, d, spring):
    return a - b + 2 * c + d**2 + spring


def study(**changed) -> ta.Study:
    own = {"limits": {GAP: ta.Limit(lower=14.9, upper=15.15, show=ta.AtYield(0.9973))}, "name": "drawn", "seed": 1}
    own["title_block"] = {"drawing number": "X-17", "material": "GCr15"}
    setting = ta.Setting(name=SPRING, value=0.1, lower=-0.5, upper=0.5, step=0.01)
    return ta.Study(
        ta.model(gap, inputs=("a", "b", "c", "d"), outputs=(GAP,), settings=(setting,)),
        changed.pop("drawing", None) or ta.Drawing.of_rows(ROWS, costs=COSTS),
        questions=[ta.Allocation(front=False, what_if=False)],
        effort=Effort(allocation=SMALL, is_quick=True),
        **{**own, **changed},
    )


@pytest.fixture(scope="module")
def told():
    return study().allocate()


@pytest.fixture(scope="module")
def answer(told):
    return told.result


@pytest.fixture(scope="module")
def folder(told, tmp_path_factory):
    found = tmp_path_factory.mktemp("drawn")
    told.teller.add_files(found)
    return found


@pytest.mark.slow
def test_the_rows_add_up_to_the_cost_of_the_drawing(told, answer, folder):
    assert answer.met
    assert any("ground" in own.process for own in answer.drawn_sources)
    rows = list(csv.DictReader((folder / "allocation.csv").read_text(encoding="utf-8").splitlines()))
    stated = [float(row["cost [cost units]"]) for row in rows if row["cost [cost units]"]]
    assert sum(stated) == pytest.approx(answer.cost, rel=1e-6)
    assert told.tables["dimensions"]["cost [cost units]"].sum() == pytest.approx(answer.cost)
    assert told.tables["drawing"]["cost [cost units]"].sum() == pytest.approx(answer.cost)
    book = load_workbook(folder / "drawing.xlsx", data_only=True)
    heads = [cell.value for cell in book["tolerances"][1]]
    column = heads.index("cost [cost units]")
    listed = [row[column] for row in book["tolerances"].iter_rows(min_row=2, values_only=True)]
    assert sum(listed) == pytest.approx(answer.cost, rel=1e-6)


def test_the_table_brings_its_setting_back(answer, folder):
    drawing = ta.drawing(folder / "allocation.csv", costs=COSTS)
    (value,) = answer.chosen.settings
    assert drawing.settings == {SPRING: value}
    again = Prepared(study=study(drawing=drawing))
    assert again.model.settings[0].value == value
    units = again.space.units(again.space.uniform(1.0), SeedTree(5), 200_000)
    kept = again.requirements[0].limits.kept_by(again.model.reading((GAP,))(units).values[:, 0])
    error = np.sqrt(0.0027 / kept.size)
    assert kept.mean() == pytest.approx(answer.chosen.achieved.estimate, abs=4 * error)
    plain = folder / "plain.csv"
    plain.write_text("".join((folder / "allocation.csv").read_text("utf-8").partition("# setting")[:1]), "utf-8")
    assert drawing.with_table(plain).settings == drawing.settings  # other zones, the same modification
    changed = study(drawing=drawing).changed(drawing, settings={SPRING: 0.2})
    assert Prepared(study=changed).model.settings[0].value == 0.2


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("# setting: spring [mm] = 0,1", "a number with a decimal point"),
        ("# setting: spring [mm] = 0.1\n# setting: spring [mm] = 0.2", "stated twice"),
        ("# setting: sprung [mm] = 0.1", "spring [mm]"),
        ("# setting: spring [mm] = 9", "the bounds of this setting"),
        ("# setting: spring [mm] = nan", "the bounds of this setting"),
    ],
)
def test_a_setting_of_a_table_that_is_not_allowed_is_one_sentence(folder, tmp_path, line, said):
    rows = (folder / "allocation.csv").read_text(encoding="utf-8").split("# setting")[0]
    (tmp_path / "zones.csv").write_text(f"{rows}{line}\n", encoding="utf-8")
    with pytest.raises((InputError, UnknownNameError)) as caught:
        _ = Prepared(study=study(drawing=ta.drawing(tmp_path / "zones.csv"))).model
    assert said in str(caught.value)


def test_sensitivities_have_their_sign_and_the_other_slope_its_own_name(told):
    table = told.tables["drawing"].set_index("source")
    sens = table["Sens [mm/µm]"]
    assert sens.to_dict() == pytest.approx({"a": 1e-3, "b": -1e-3, "c": 2e-3, "d": 2e-3}, rel=1e-2)
    assert (table["kept value per zone [mm/µm]"].abs() < 0.5 * sens.abs()).all()


def test_the_workbook_refuses_a_zone_outside_its_row(folder):
    sheet = load_workbook(folder / "drawing.xlsx")["drawing"]
    (guard,) = sheet.data_validations.dataValidation
    # What the file leaves out is what the format says then: stop, and between.
    assert (guard.showErrorMessage, guard.errorStyle or "stop", guard.operator or "between") == (
        True,
        "stop",
        "between",
    )
    assert guard.allow_blank is False
    assert (guard.formula1, guard.formula2) == ("$E2", "$F2")


def test_the_first_sheet_has_the_answer(told, answer, folder):
    book = load_workbook(folder / "drawing.xlsx", data_only=True)
    assert book.active.title == book.sheetnames[0] == "answer"
    assert [sheet.title for sheet in book if sheet.sheet_view.tabSelected] == ["answer"]
    rows = list(book["answer"].iter_rows(values_only=True))
    assert rows[2][1] == told.sentences[0]
    assert says(rows[3][1], "allocation.sheet_guard_verified")
    shown = {row[0]: row[1:] for row in rows}
    for side, off in zip(answer.chosen.constraints, answer.model_range.off, strict=True):
        limit, verified, predicted, kept, differs = shown[side.stack.name]
        # Between the quantiles of half and of all that may fail.
        ends = np.quantile(side.sign * answer.chosen.outputs[GAP], [0.9973, 0.99865])
        assert (limit, verified, kept) == (side.limit, pytest.approx(side.value), "yes")
        assert ends[0] - 0.01 < side.sign * verified < ends[1] + 0.01, "not the mirror of what the other side reaches"
        assert predicted == pytest.approx(verified, abs=1e-3)
        assert differs == (pytest.approx(off) if answer.model_range.designs else None)
    cost = shown["cost [cost units]"]
    assert cost[1] == pytest.approx(answer.cost) and cost[2] == pytest.approx(answer.cost)
    assert shown["spring"][:3] == (pytest.approx(answer.chosen.settings[0]), pytest.approx(0.1), "mm")


def test_every_sheet_prints_on_a4_as_wide_as_the_page(folder):
    for sheet in load_workbook(folder / "drawing.xlsx"):
        assert (int(sheet.page_setup.paperSize), sheet.page_setup.orientation) == (9, "landscape")
        across = 3 if sheet.title == "tolerances" else 1  # a table of so many columns could not be read on one page
        assert (sheet.page_setup.fitToWidth or 1, sheet.page_setup.fitToHeight) == (across, 0)  # one page unless said
        assert (sheet.print_title_cols is not None) == (across > 1)  # names stand on every page
        assert sheet.sheet_properties.pageSetUpPr.fitToPage and sheet.print_title_rows == "$1:$1"
    assert all(load_workbook(folder / "drawing.xlsx")[name].print_area for name in ("answer", "drawing"))


def test_the_range_of_the_weights_is_about_the_verified_zones(answer, folder):
    sheet = load_workbook(folder / "drawing.xlsx", data_only=True)["drawing"]
    heads = [cell.value for cell in sheet[1]]
    zones = answer.drawn.first_zones * answer.chosen.scales / 1e-6
    columns = [heads.index(name) for name in ("verified zone [µm]", "weights hold from [µm]", "weights hold to [µm]")]
    for row, zone in enumerate(zones.tolist(), start=2):
        found = [sheet.cell(row, column + 1).value for column in columns]
        assert found == pytest.approx([zone, zone / REACH_OF_MODELS, zone * REACH_OF_MODELS])


def test_the_workbook_has_every_line_of_the_drawing(answer, folder):
    sheet = load_workbook(folder / "drawing.xlsx", data_only=True)["drawing"]
    rows = {row[0]: row for row in sheet.iter_rows(min_row=2, values_only=True)}
    for line in answer.lines:
        row, own = rows[answer.line_name(line)], line[1][0]
        assert row[1] == pytest.approx(own.zone * 1e6)
        assert row[6] == ("locked" if own.locked else "yes")
        assert callout(own).zone == f"±{row[10]:.5f}".rstrip("0")


def test_setting_and_sum_stand_in_workbook_and_frames(answer, folder):
    (value,) = answer.chosen.settings
    rows = list(load_workbook(folder / "drawing.xlsx")["settings"].iter_rows(values_only=True))
    assert rows[0] == ("what", "value [unit]", "before [unit]", "unit", "tolerance ± [µm]")
    assert rows[1] == ("spring", pytest.approx(value), pytest.approx(0.1), "mm", None)
    printed = [str(row[0].value) for row in load_workbook(folder / "drawing.xlsx")["drawing"].iter_rows()]
    said = f"The drawing is valid only with these settings: spring {value:.2f} mm".replace("-", "−")
    assert any(text.startswith(said) for text in printed)
    assert any(text.startswith(said) for text in paragraphs(folder / "frames.dxf"))
    assert ["", "spring", f"{value:.2f}".replace("-", "−"), "", "mm", ""] in cells(folder / "frames.dxf", "TABLE")


def test_the_sheet_has_layers_and_a_title_block_that_invents_nothing(told, answer, folder):
    drawing = readfile(folder / "frames.dxf")
    assert not drawing.audit().has_errors
    assert set(LAYERS) <= {layer.dxf.name for layer in drawing.layers}
    used = {own.dxf.layer for own in drawing.modelspace()}
    assert used == set(LAYERS) - {"SIGN_PICTURE"}  # an own function says nothing of grinding
    fields = {text for row in cells(folder / "frames.dxf", "TITLE_BLOCK") for text in row}
    assert {"drawing number X-17", "author", "revision", "material GCr15", "study drawn"} <= fields
    assert f"study hash {told.header.digest[:12]}" in fields
    shown = frames(folder / "frames.dxf")
    assert shown == {answer.line_name(own): str(callout(own[1][0])) for own in answer.lines}


def test_the_table_says_what_the_title_block_states(folder):
    comments = [line for line in (folder / "allocation.csv").read_text("utf-8").splitlines() if line.startswith("# ")]
    assert says(comments, "allocation.table_block", fields="drawing number X-17 - material GCr15")


def recalculated(path, tmp_path):
    """Return a workbook as LibreOffice calculates it."""
    if shutil.which("soffice") is None:
        pytest.skip("no LibreOffice to recalculate a workbook with")
    profile = f"-env:UserInstallation=file://{tmp_path / 'profile'}"
    command = [
        "soffice",
        profile,
        "--headless",
        "--convert-to",
        "xlsx:Calc MS Excel 2007 XML",
        "--outdir",
        str(tmp_path),
    ]
    subprocess.run([*command, str(path)], check=True, capture_output=True, timeout=120)
    return load_workbook(tmp_path / path.name, data_only=True)


@pytest.mark.slow
def test_a_changed_zone_moves_cost_and_limits_as_the_model_does(answer, folder, tmp_path):
    """Every zone 3 % wider in LibreOffice: the cost is exact, the kept value within a twentieth of the room."""
    book = load_workbook(folder / "drawing.xlsx")
    groups, space = len(answer.drawn.groups), answer.drawn
    for row in range(2, 2 + groups):
        book["drawing"].cell(row, 2).value *= 1.03
    moved = tmp_path / "moved"
    moved.mkdir()
    book.save(moved / "drawing.xlsx")
    sheet = recalculated(moved / "drawing.xlsx", tmp_path)["requirements"]
    rows = {row[0]: row for row in sheet.iter_rows(min_row=2, values_only=True)}
    design = answer.chosen.design.copy()
    design[:groups] *= 1.03
    assert rows["cost [cost units]"][3] == pytest.approx(float(space.cost(design)), rel=1e-6)
    for side in answer.chosen.constraints:
        predicted = side.limit + side.sign * float(side.predicted(design))
        assert rows[side.stack.name][3] == pytest.approx(predicted, abs=2e-5)
        assert rows[side.stack.name][4] == ("yes" if side.sign * (predicted - side.limit) <= 0 else "no")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "said", "kept"),
    [(0.97, "moved", {"yes"}), (0.7, "beyond", {"ask tolalloc whatif"}), (1.4, "beyond", {"ask tolalloc whatif"})],
)
def test_the_guard_says_when_a_zone_leaves_the_range_of_the_weights(answer, folder, tmp_path, factor, said, kept):
    book = load_workbook(folder / "drawing.xlsx")
    book["drawing"]["B3"] = book["drawing"]["B3"].value * factor
    moved = tmp_path / "moved"
    moved.mkdir()
    book.save(moved / "drawing.xlsx")
    found = recalculated(moved / "drawing.xlsx", tmp_path)
    assert says(str(found["answer"]["B4"].value), f"allocation.sheet_guard_{said}")
    rows = {row[0]: row for row in found["answer"].iter_rows(values_only=True)}
    assert {rows[side.stack.name][4] for side in answer.chosen.constraints} == kept
    assert [found["drawing"][f"P{row}"].value for row in (2, 3)] == ["yes", "yes" if said == "moved" else "no"]


@pytest.mark.slow
def test_the_guard_says_when_a_process_holds_no_such_zone(answer, folder, tmp_path):
    """The smallest zone of a row is raised above its verified one, as an edit around the validation does."""
    book = load_workbook(folder / "drawing.xlsx")
    book["drawing"]["E2"] = book["drawing"]["B2"].value * 1.1
    moved = tmp_path / "moved"
    moved.mkdir()
    book.save(moved / "drawing.xlsx")
    found = recalculated(moved / "drawing.xlsx", tmp_path)
    assert says(str(found["answer"]["B4"].value), "allocation.sheet_guard_unheld")
