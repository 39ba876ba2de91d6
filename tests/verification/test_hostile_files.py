"""Files that are damaged, endless, enormous or not what they seem are refused in one sentence."""

from __future__ import annotations

import os
import tracemalloc
import zipfile
from io import BytesIO
from pathlib import Path

import pytest
from openpyxl import Workbook, load_workbook
from openpyxl.chart import BarChart

from tests.builders import refusal, written
from tolalloc.allocation.cost.points import load_shop_points
from tolalloc.allocation.cost.process_costs import load_process_costs
from tolalloc.drawings.table_file import DATA
from tolalloc.drawings.tolerance_table import load_process_capabilities, load_tolerance_table
from tolalloc.exceptions import InputError, TolallocError, UnknownNameError
from tolalloc.reading.file_content import require_believable
from tolalloc.reading.files import shipped_or_path
from tolalloc.reducers.reducer.files import load_identified_stiffness, load_reducer
from tolalloc.reducers.unit_file import load_unit, load_units
from tolalloc.wings.bench.readings import load_readings

HEADERS, ROW = ("id", "plus", "minus", "unit", "min", "max", "cost"), ("a", 0.1, -0.1, "mm", 0.02, 0.5, 3)
HEADER, LINE = ",".join(HEADERS), ",".join(map(str, ROW))
UNIT = 'name = "u"\nsource = "s"\n'


def table(folder, *, header="", cell="", row=LINE):
    added = (f",{header}", f",{cell}") if header else ("", "")
    return written(folder / "t.csv", f"{HEADER}{added[0]}\n{row}{added[1]}\n")


def workbook(folder, change=lambda book: None, header=None, cell=None):
    book = Workbook()
    for row in ((*HEADERS, header), (*ROW, cell)) if header else (HEADERS, ROW):
        book.active.append(row)
    change(book)
    book.save(folder / "t.xlsx")
    return folder / "t.xlsx"


def with_part(folder, name, change):
    """Return a workbook with one part changed, or left out where there is nothing left."""
    out, path = BytesIO(), workbook(folder)
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for part in old.namelist():
            content = change(old.read(part)) if part == name else old.read(part)
            if content is not None:
                new.writestr(part, content)
    path.write_bytes(out.getvalue())
    return path


@pytest.mark.parametrize(
    ("header", "cell", "words"),
    [
        ("locked", "#REF!", "row 2: cell H2 is '#REF!'; allowed is a value and no error"),
        ("note", "#N/A", "row 2: cell H2 is '#N/A'"),
        ("locked", "=1=1", "row 2: cell H2 is '=1=1'; allowed is a value, or a formula whose value was kept"),
        ("Cp", "=1+1", "row 2: cell H2 is '=1+1'"),
    ],
)
def test_a_cell_of_a_workbook_without_a_value_is_no_empty_cell(header, cell, words, tmp_path):
    assert words in refusal(load_tolerance_table, workbook(tmp_path, header=header, cell=cell))


def test_a_formula_whose_value_was_kept_is_read(tmp_path):
    path = with_part(
        tmp_path, "xl/worksheets/sheet1.xml", lambda part: part.replace(b"<v>3</v>", b"<f>1+2</f><v>3</v>")
    )
    assert load_workbook(path).active["G2"].value == "=1+2"
    assert load_tolerance_table(path)[0].cost == 3.0


def test_hidden_sheets_and_merged_cells_are_refused(tmp_path):
    def hide(book):
        book.active.sheet_state = "hidden"
        book.create_sheet("shown")

    assert "the sheet is hidden" in refusal(load_tolerance_table, workbook(tmp_path, hide))
    merged = workbook(tmp_path, lambda book: book.active.merge_cells("G2:G3"))
    assert "the cells G2:G3 are merged" in refusal(load_tolerance_table, merged)


def test_a_chart_sheet_before_the_table_is_passed_over(tmp_path):
    path = workbook(tmp_path, lambda book: book.create_chartsheet("c", 0).add_chart(BarChart()))
    assert load_tolerance_table(path)[0].name == "a"


@pytest.mark.parametrize("name", ["xl/worksheets/sheet1.xml", "xl/workbook.xml", "xl/styles.xml", "docProps/core.xml"])
@pytest.mark.parametrize("damage", [lambda part: part[: len(part) // 2], lambda part: b"", lambda part: b"\xff\xfe\0"])
def test_damaged_workbooks_are_refused(name, damage, tmp_path):
    assert "not a complete workbook (XLSX)" in refusal(load_tolerance_table, with_part(tmp_path, name, damage))


@pytest.mark.parametrize(
    ("row", "column", "words"), [(1_048_576, 16_384, "row 1048576"), (1_048_576, 1, "row"), (1, 16_384, "16384 col")]
)
def test_a_far_cell_takes_no_memory(row, column, words, tmp_path):
    path = workbook(tmp_path, lambda book: book.active.cell(row, column, "x"))
    tracemalloc.start()
    sentence = refusal(load_tolerance_table, path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert words in sentence
    assert peak < 20e6


@pytest.mark.parametrize("filling", [b" " * 40_000_000, b"<row>" + b"<c/>" * 500_000 + b"</row>"])
def test_a_workbook_that_unpacks_to_much_more_is_refused_unread(filling, tmp_path):
    path = with_part(
        tmp_path, "xl/worksheets/sheet1.xml", lambda part: part.replace(b"</sheetData>", filling + b"</sheetData>")
    )
    assert path.stat().st_size < 100_000
    assert "allowed are 16 MB and 100000 cells" in refusal(load_tolerance_table, path)


def test_tables_of_too_many_columns_cells_or_bytes_are_refused(tmp_path):
    assert "4001 columns" in refusal(load_tolerance_table, written(tmp_path / "t.csv", "a," * 4000 + "a\n"))
    assert "allowed are 32 MB" in refusal(load_units, written(tmp_path / "t.csv", b"x" * (32 * 2**20 + 1)))
    with pytest.raises(InputError, match=r"row 7: .* allowed are 4000 columns and 2000000 cells"):
        require_believable(Path("t.csv"), 7, 2, 2_000_001)


@pytest.mark.parametrize("read", [load_tolerance_table, load_shop_points, load_unit, load_units, load_reducer])
@pytest.mark.parametrize("name", ["pipe.csv", "loop.csv", "x" * 300 + ".csv", "nul\0.csv", "folder.csv"])
def test_what_is_no_file_is_refused(read, name, tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    os.symlink(tmp_path / "loop.csv", tmp_path / "loop.csv")
    (tmp_path / "folder.csv").mkdir()
    sentence = refusal(read, tmp_path / name)
    assert any(
        words in sentence for words in ("no such file", "cannot be read as a", "is a folder, a device or a pipe")
    )


def test_a_device_is_not_read():
    assert "folder or device" in refusal(load_shop_points, Path("/dev/zero"))


@pytest.mark.parametrize("name", [None, 5, b"rv20e"])
def test_a_name_that_is_no_text_is_refused(name):
    assert "allowed is a shipped name or a path" in refusal(lambda own: shipped_or_path(own, DATA, ".x", "x"), name)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[lengths]\na = 1" + "0" * 5000, "not complete TOML"),
        ("[lengths]\na = 0x1" + "0" * 9000, "lengths.a is a int too long to be shown"),
        ("a = " + "[" * 20_000, "too deeply"),
        ("a = " + "[" * 900 + "]" * 900, "too deeply"),
        (".".join("a" * 30_000) + " = 1\n", "too deeply"),
        ('a = "\x1b[31m"', "holds the control character '\\x1b'"),
    ],
)
def test_toml_that_python_cannot_hold_is_refused(text, words, tmp_path):
    assert words in refusal(load_unit, written(tmp_path / "u.unit.toml", UNIT + text))


def test_long_cells_and_values_are_not_quoted_in_full(tmp_path):
    assert "a cell is too long; allowed are 131072" in refusal(
        load_tolerance_table, table(tmp_path, header="note", cell="x" * 140_000)
    )
    for row in (LINE.replace("0.1", "7x " * 30_000, 1), LINE.replace("a", "y" * 100_000 + ",x", 1)):
        assert len(refusal(load_tolerance_table, table(tmp_path, row=row))) < 700
    toml = written(tmp_path / "u.unit.toml", f'{UNIT}{"k" * 90_000} = 1\n[lengths]\na = "{"x " * 90_000}"\n')
    with pytest.raises(TolallocError) as caught:
        load_unit(toml)
    assert all(len(sentence) < 700 for sentence in str(caught.value).split("\n"))
    assert len(str(InputError.at("file", "field", "ab " * 1000, "less"))) < 240
    assert len(str(UnknownNameError.among("file", "field", "ab " * 1000, "ab"))) < 280


@pytest.mark.parametrize("number", ["1_0", "١", "１", "²"])
def test_numbers_have_plain_digits(number, tmp_path):
    assert "cost is" in refusal(load_tolerance_table, table(tmp_path, row=LINE[:-1] + number))
    assert "each is" in refusal(load_tolerance_table, table(tmp_path, header="each", cell=number))
    readings = written(tmp_path / "r.csv", f"angle [deg],transmission error [arcsec]\n{number},1\n2,2\n3,4\n")
    assert "row 2" in refusal(lambda path: load_readings(path, "angle", "transmission error"), readings)
    assert "row 2" in refusal(load_units, written(tmp_path / "u.csv", f"unit,disc1.tilt.x [µrad]\nu,{number}\n"))


@pytest.mark.parametrize(
    "spectrum",
    [
        *("1:1e999", "1:1e308", "1:1e-320", "101:1", "1:1 99999:1", "random:1e999/40", "١:٢"),
        " ".join(f"{order}:1" for order in range(1, 22)),
    ],
)
def test_a_spectrum_has_believable_orders_and_amplitudes(spectrum, tmp_path):
    path = written(
        tmp_path / "t.csv", f"id,feature,plus,minus,unit,min,max,cost,spectrum\na,pitch,10,0,µm,1,20,1,{spectrum}\n"
    )
    assert "spectrum" in refusal(load_tolerance_table, path)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("a,1e-300,0,mm,1e-300,1,3", "must be 0, or 1e-06 µm or more"),
        ("a,1e-12,0,mm,1e-12,1,3", "must be 0, or 1e-06 µm or more"),
        (LINE[:-1] + "5e-324", "the cost must be 1e-09 or more"),
    ],
)
def test_numbers_near_the_smallest_are_refused(row, words, tmp_path):
    assert words in refusal(load_tolerance_table, table(tmp_path, row=row))


def test_batches_and_prices_are_counted(tmp_path):
    path = table(tmp_path, header="distribution,batches", cell="mixture," + " ".join(["1:0:1"] * 21))
    assert "20 batches or less" in refusal(load_tolerance_table, path)
    prices = "".join(f"g,{1 + at},µm,{9 + at}\n" for at in range(201))
    path = written(tmp_path / "s.csv", f"process,tolerance,unit,cost\n{prices}")
    assert "number of prices of process g is 201; allowed is 200 or less" in refusal(load_shop_points, path)
    path.write_text("process,tolerance,unit,cost\ng,1e-12,µm,2\ng,2,µm,1\n")
    assert "tolerance is 1e-12" in refusal(load_shop_points, path)


@pytest.mark.parametrize(
    ("read", "text", "words"),
    [
        (load_process_capabilities, "process,feature,Cp [mm],note\ng,size,1,n\n", "column Cp is 'mm'; allowed is -"),
        (load_process_capabilities, "process,feature,Cp,shift [µm],note\ng,size,1,1,n\n", "allowed is half zone"),
        (load_shop_points, "process,tolerance [mm],unit,cost\ng,1,µm,1\ng,2,µm,1\n", "allowed is unit"),
        (
            lambda path: load_process_costs(path, ()),
            "sources,process,model,factor [EUR mm],note\na,g,reciprocal,1,n\n",
            "column factor is 'EUR mm'; allowed is a currency such as EUR, or cost units µm^n",
        ),
    ],
)
def test_a_unit_that_no_column_has_is_refused(read, text, words, tmp_path):
    assert words in refusal(read, written(tmp_path / "t.csv", text))


def test_a_stiffness_is_known_better_than_by_twice_its_value(tmp_path):
    text = 'source = "s"\n[stiffness.carrier_bearing]\nvalue = 1e8\nstandard_uncertainty = 1e12\n'
    path = written(tmp_path / "k.stiffness.toml", text)
    assert "allowed is twice the value" in refusal(load_identified_stiffness, path)


def faults(read, path):
    with pytest.raises(TolallocError) as caught:
        read(path)
    return str(caught.value).split("\n")


def test_all_faults_of_a_table_are_said_row_by_row(tmp_path):
    rows = [LINE, "b,x,-0.1,cm,0.02,0.5,y", LINE.replace("a", "c", 1), LINE, "d,0.1,-0.1,mm,0.3,0.5,3"]
    said = faults(load_tolerance_table, written(tmp_path / "t.csv", "\n".join((HEADER, *rows, ""))))
    assert [sentence.removeprefix(str(tmp_path / "t.csv")) for sentence in said] == [
        ", row 3 (b): plus is 'x'; allowed is a number with a decimal point.",
        ", row 3 (b): cost is 'y'; allowed is a number with a decimal point.",
        ", row 5 (a): id is 'a' for the second time; each source has one row.",
        ", row 6 (d): the zone must lie between min and max, above 0 and up to 1000000 µm: min 0.3, zone 0.2, max 0.5, "
        "all in the mm of the row.",
    ]


def test_twenty_faults_are_said_and_the_others_counted(tmp_path):
    said = faults(load_tolerance_table, written(tmp_path / "t.csv", f"{HEADER}\n" + "a,x,0,mm,1,2,3\n" * 50))
    assert said[:2] == [
        f"{tmp_path / 't.csv'}, row {row} (a): plus is 'x'; allowed is a number with a decimal point." for row in (2, 3)
    ]
    assert len(said) == 21
    assert said[-1] == "And 30 more faults."


def test_all_faults_of_other_files_are_said(tmp_path):
    toml = written(tmp_path / "u.unit.toml", 'name = 1\nsorce = "s"\n[lengths]\na = 1e9\nb = "x"\n')
    said = faults(load_unit, toml)
    assert len(said) == 4
    assert "unknown field 'sorce'; the nearest known is source" in said[0]
    assert not any("source is missing" in sentence for sentence in said)
    readings = written(tmp_path / "r.csv", "angle [deg],transmission error [arcsec]\nx,1\n2,2\ny,4\n")
    assert len(faults(lambda path: load_readings(path, "angle", "transmission error"), readings)) == 2
    units = written(tmp_path / "u.csv", "unit,disc1.tilt.x [µrad],disc1.tilt.y [µrad]\nu,x,y\nv,1,z\n")
    assert len(faults(load_units, units)) == 3
    prices = written(tmp_path / "s.csv", "process,tolerance,unit,cost\ng,0,µm,1\ng,1,cm,1\ng,2,µm,1\n")
    assert len(faults(load_shop_points, prices)) == 2


@pytest.mark.parametrize("line", ["a = [1.9]", "a = [1.9,]", "a = []"])
def test_a_vector_without_its_direction_is_refused(line, tmp_path):
    (tmp_path / "u.unit.toml").write_text(f"{UNIT}[vectors]\n{line}\n")
    with pytest.raises(InputError, match=r"u.unit.toml: vectors.a.1 is missing\."):
        load_unit(tmp_path / "u.unit.toml")
