"""A user's own table comes back with other zones: the same file, cell by cell, with what changed marked."""

import csv
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from openpyxl import Workbook, load_workbook
from openpyxl.styles import Font

import tolalloc as ta
from tolalloc.drawings.drawing import load_drawing
from tolalloc.exceptions import InputError

HEADS = [
    "Pos.",
    "Merkmal",
    "Art",
    "Nennmaß [mm]",
    "oberes Abmaß",
    "unteres Abmaß",
    "Einheit",
    "kleinste",
    "größte",
    "Kosten [EUR]",
    "Prüfmittel",
]
ROWS = [
    [1, "Bohrung", "size", 42, "0,025", "-0,025", "mm", "0,002", "0,12", "10,5", "KMG"],
    [2, "Ring", "size", 6.06, 0.02, -0.01, "mm", 0.002, 0.12, 10, "Messuhr"],
    [3, "Bund", "size", 20.5, "0,030", "-0,030", "mm", "0,002", "0,12", "8,00", ""],
]
COLUMNS = {
    "Merkmal": "id",
    "Art": "feature",
    "Nennmaß": "nominal",
    "oberes Abmaß": "plus",
    "unteres Abmaß": "minus",
    "Einheit": "unit",
    "kleinste": "min",
    "größte": "max",
    "Kosten": "cost",
}


def workbook(folder: Path) -> Path:
    book = Workbook()
    sheet = book.active
    sheet.title = "Toleranzen"
    sheet.append(["Toleranztabelle Getriebe"])
    sheet.append(HEADS)
    for row in ROWS:
        sheet.append(row)
    sheet.append(["# Summe", *[None] * 8, "=SUM(J3:J5)"])
    sheet["B3"].font = Font(bold=True)
    book.create_sheet("Notizen")["A1"] = "bleibt"
    book.save(folder / "tabelle.xlsx")
    return folder / "tabelle.xlsx"


def changed(drawing):
    """Return the sources with two other zones."""
    first, second, third = drawing.sources
    return (replace(first, zone=31.4e-6, cost=14.2), replace(second, zone=24e-6, cost=12.25), third)


def test_workbook_comes_back_cell_by_cell_with_the_changed_ones_marked(tmp_path):
    path = workbook(tmp_path)
    drawing = load_drawing(path, columns=COLUMNS)
    (tmp_path / "out").mkdir()
    written = drawing.errors.file.written(drawing.sources, changed(drawing), tmp_path / "out")
    assert written.name == "tabelle_allocated.xlsx"
    before, after = load_workbook(path), load_workbook(written)
    assert after.sheetnames == ["Toleranzen", "Notizen"]
    assert after["Notizen"]["A1"].value == "bleibt"
    moved = {}
    for old, new in zip(before["Toleranzen"].iter_rows(), after["Toleranzen"].iter_rows(), strict=True):
        for one, other in zip(old, new, strict=True):
            is_marked = other.fill.fgColor.rgb.endswith("FFFF99")
            assert is_marked == (one.value != other.value)
            if is_marked:
                moved[other.coordinate] = other.value
    assert moved == {
        "E3": "0,0157",
        "F3": "-0,0157",
        "J3": "14,2",
        "E4": pytest.approx(0.017),
        "F4": pytest.approx(-0.007),
        "J4": pytest.approx(12.25),
    }
    assert after["Toleranzen"]["B3"].font.bold
    assert after["Toleranzen"]["J6"].value == "=SUM(J3:J5)"


def test_csv_comes_back_with_its_semicolons_and_decimal_commas(tmp_path):
    path = tmp_path / "tabelle.csv"
    lines = [HEADS, *([str(own).replace(".", ",") for own in row] for row in ROWS)]
    path.write_text("# Rev. C\n" + "".join(";".join(row) + "\n" for row in lines), encoding="utf-8")
    drawing = load_drawing(path, columns=COLUMNS)
    (tmp_path / "out").mkdir()
    written = drawing.errors.file.written(drawing.sources, changed(drawing), tmp_path / "out")
    rows = [*csv.reader(written.read_text(encoding="utf-8-sig").splitlines(), delimiter=";")]
    assert rows[0] == ["# Rev. C"]
    assert rows[1] == HEADS
    assert rows[2] == ["1", "Bohrung", "size", "42", "0,0157", "-0,0157", "mm", "0,002", "0,12", "14,2", "KMG"]
    assert rows[4] == lines[3]
    again = load_drawing(written, columns=COLUMNS)
    assert [own.zone for own in again.sources] == pytest.approx([own.zone for own in changed(drawing)])


def test_both_deviations_of_one_cell_stand_behind_their_sign_again(tmp_path):
    path = tmp_path / "tabelle.csv"
    path.write_text("id;plus;unit;min;max;cost\nWelle;± 1,5;µm;1;9;2\n", encoding="utf-8")
    drawing = load_drawing(path)
    (tmp_path / "out").mkdir()
    written = drawing.errors.file.written(drawing.sources, [replace(drawing.sources[0], zone=2.6e-6)], tmp_path / "out")
    assert written.read_text(encoding="utf-8-sig").splitlines()[1] == "Welle;± 1,3;µm;1;9;2"


def test_run_returns_the_table_of_an_office_and_leaves_the_own_layout_to_allocation_csv(tmp_path):
    drawing = load_drawing(workbook(tmp_path), columns=COLUMNS)

    def gap(Bohrung, Ring, Bund):  # noqa: N803  # heads of the table
        return 1000 * (Bohrung - Ring - Bund) - 15_440

    inputs = {"Bohrung": 42.0, "Ring": 6.06, "Bund": 20.5}
    model = ta.model(gap, inputs=inputs, outputs=("gap [µm]",))
    study = ta.Study(
        model,
        drawing,
        limits={"gap [µm]": ta.Limit(lower=-25.0, upper=15.0)},
        questions=[ta.Allocation(front=False, what_if=False)],
    )
    answer = study.allocate(effort="quick")
    (tmp_path / "run").mkdir()
    answer.teller.add_files(tmp_path / "run")
    told = " ".join(" ".join(text for section in answer.sections for text in section.paragraphs).split())
    assert "Beside this report: tabelle_allocated.xlsx is your table with the new zones; allocation.csv" in told
    returned = load_workbook(tmp_path / "run" / "tabelle_allocated.xlsx")["Toleranzen"]
    for row, own in zip(
        returned.iter_rows(min_row=3, max_row=5, values_only=True), answer.result.drawn_sources, strict=True
    ):
        plus, minus = (float(str(cell).replace(",", ".")) for cell in row[4:6])
        assert plus - minus == pytest.approx(own.zone * 1e3, abs=1e-7)
    assert load_drawing("rv20e_drawing").errors.file is None


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("soffice") is None, reason="needs LibreOffice")
def test_german_office_program_opens_the_returned_csv_as_columns(tmp_path):
    path = tmp_path / "tabelle.csv"
    lines = [HEADS, *([str(own).replace(".", ",") for own in row] for row in ROWS)]
    path.write_text("".join(";".join(row) + "\n" for row in lines), encoding="utf-8")
    drawing = load_drawing(path, columns=COLUMNS)
    (tmp_path / "out").mkdir()
    written = drawing.errors.file.written(drawing.sources, changed(drawing), tmp_path / "out")
    subprocess.run(
        [
            "soffice",
            "--headless",
            "--infilter=CSV:59,34,76,1,,1031",
            "--convert-to",
            "xlsx",
            "--outdir",
            str(tmp_path),
            str(written),
        ],
        check=True,
        capture_output=True,
        timeout=180,
    )
    sheet = load_workbook(tmp_path / f"{written.stem}.xlsx").active
    assert [cell.value for cell in sheet[1]] == HEADS
    assert sheet["E2"].value == pytest.approx(0.0157)


def returned(tmp_path, text, **zones):
    """Return the lines of a table that comes back with the zones of some rows."""
    path = tmp_path / "tabelle.csv"
    path.write_text(text, encoding="utf-8")
    drawing = load_drawing(path, columns={head: name for head, name in COLUMNS.items() if f"{head};" in text})
    (tmp_path / "out").mkdir()
    drawn = [replace(own, zone=zones.get(own.own_id or own.name, own.zone)) for own in drawing.sources]
    return drawing.errors.file.written(drawing.sources, drawn, tmp_path / "out"), drawn


def test_titles_comments_and_lines_that_stay_are_kept_as_they_were(tmp_path):
    head = "Merkmal;Nennmaß;oberes Abmaß;unteres Abmaß;Einheit;kleinste;größte;Kosten;note"
    lines = ["h;42;0,025;-0,025;mm;0,002;0,12;10;", '#;"Rest; offen', "r;6;0,025;-0,025;mm;0,002;0,12;10;", ""]
    text = "\n".join(["Toleranztabelle Rev. B", head, *lines])
    written, drawn = returned(tmp_path, text, r=40e-6)
    assert written.read_text(encoding="utf-8-sig") == text.replace("r;6;0,025;-0,025", "r;6;0,02;-0,02")
    assert [own.zone for own in load_drawing(written).sources] == pytest.approx([own.zone for own in drawn])


def test_numbers_get_the_decimal_sign_of_the_table_not_of_their_cell(tmp_path):
    text = "id;nominal;plus;minus;unit;min;max;cost\nh;42;1;-1;µm;0,5;9;10\n"
    written, _ = returned(tmp_path, text, h=1.4e-6)
    assert "h;42;0,7;-0,7;µm" in written.read_text(encoding="utf-8-sig")


def test_fit_that_one_cell_cannot_say_otherwise_is_refused_and_stays_where_nothing_changes(tmp_path):
    text = "id;nominal;plus;unit;min;max;cost\nh;42;H7;µm;5;90;10\nr;6;± 5;µm;1;20;10\n"
    written, _ = returned(tmp_path, text, r=8e-6)
    assert written.read_text(encoding="utf-8-sig") == text.replace("± 5", "± 4")
    drawing = load_drawing(tmp_path / "tabelle.csv")
    drawn = [replace(own, zone=own.zone / 2) for own in drawing.sources]
    with pytest.raises(InputError, match=r"returned table \(h\): plus is .*; allowed is ± one number alone"):
        drawing.errors.file.written(drawing.sources, drawn, tmp_path / "out")


def test_fit_beside_an_empty_lower_deviation_becomes_both_deviations(tmp_path):
    text = "id;nominal;plus;minus;unit;min;max;cost\nh;6;h5;;µm;1;9;10\n"
    written, drawn = returned(tmp_path, text, h=3e-6)
    assert "h;6;-1;-4;µm" in written.read_text(encoding="utf-8-sig")
    assert [own.zone for own in load_drawing(written).sources] == pytest.approx([own.zone for own in drawn])


def test_cells_of_a_workbook_in_per_cent_and_empty_ones_take_what_is_meant(tmp_path):
    book = Workbook()
    sheet = book.active
    for row in (
        ["id", "nominal", "plus", "minus", "unit", "min", "max", "cost", "process"],
        ["h", 42, 0.0005, -0.0005, "%", 0.0002, 0.002, 10, None],
    ):
        sheet.append(row)
    for column in "CDFG":
        sheet[f"{column}2"].number_format = "0.000%"
    book.save(tmp_path / "t.xlsx")
    drawing = load_drawing(tmp_path / "t.xlsx")
    (tmp_path / "out").mkdir()
    drawn = [replace(own, zone=0.8 * own.zone, process="ground") for own in drawing.sources]
    written = drawing.errors.file.written(drawing.sources, drawn, tmp_path / "out")
    cells = load_workbook(written).active
    assert (cells["C2"].value, cells["D2"].value, cells["I2"].value) == (
        pytest.approx(0.0004),
        pytest.approx(-0.0004),
        "ground",
    )
    assert load_drawing(written, processes="generic").sources[0].zone == pytest.approx(drawn[0].zone)


def test_grades_come_back_and_a_table_that_cannot_say_a_zone_stops_no_report(tmp_path):
    text = "id;nominal;plus;minus;unit;min;max;cost;grade\nh;42;25;-25;µm;5;120;10;IT9\n"
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8")
    drawing = load_drawing(path)
    (tmp_path / "out").mkdir()
    written = drawing.errors.file.written(
        drawing.sources, [replace(drawing.sources[0], zone=25e-6, grade="IT7")], tmp_path / "out"
    )
    assert written.read_text(encoding="utf-8-sig").splitlines()[1] == "h;42;12.5;-12.5;µm;5;120;10;IT7"


def test_row_that_begins_with_an_error_is_no_comment(tmp_path):
    path = workbook(tmp_path)
    book = load_workbook(path)
    book["Toleranzen"]["A4"] = "#N/A"
    book["Toleranzen"]["A4"].data_type = "e"
    book.save(path)
    with pytest.raises(InputError, match="row 4: cell A4 is '#N/A'; allowed is a value and no error"):
        load_drawing(path, columns=COLUMNS)
