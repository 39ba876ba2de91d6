"""Users' tables as spreadsheets write them: separators, decimal commas, encodings and units in headers."""

from __future__ import annotations

import csv
from dataclasses import replace

import pandas as pd
import pytest
from openpyxl import Workbook, load_workbook

from tests.builders import written
from tolalloc.drawings.drawing import load_drawing
from tolalloc.drawings.fields import COLUMNS, HEADERS
from tolalloc.drawings.table_file import read_table_file, read_text_table
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_frame
from tolalloc.exceptions import InputError, TolallocError

ROWS = (
    {"id": "a", "nominal": 55.29, "plus": 0.1, "minus": -0.05, "min": 0.02, "max": 0.5, "cost": 3.25, "Cp": 1.1},
    {
        "id": "b",
        "places": "1x",
        "uncertainty": "0.001",
        "provenance": "assumed",
        "plus": 12.5,
        "minus": -12.5,
        "unit": "µm",
        "min": 2,
        "max": 50,
        "cost": 1200,
        "note": 'Ø 5"; "x", #2',
    },
    {"id": "c", "distribution": "mixture", "batches": "0.7:-0.3:0.8 0.3:0.5:0.6", "note": "one\nor two"},
    {"id": "d", "feature": "pitch", "minus": 0, "spectrum": "1:9.2 2:4.3", "locked": "yes"},
)
USUAL = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 3}
FRAME = pd.DataFrame([USUAL | row for row in ROWS])
HEADER = "id,plus,minus,unit,min,max,cost"
ROW = "a,0.1,-0.1,mm,0.02,0.5,3"


def refused(path, sentence, read=load_tolerance_table):
    with pytest.raises(TolallocError, match=sentence) as caught:
        read(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.fixture
def sources(tmp_path):
    FRAME.to_csv(tmp_path / "comma.csv", index=False)
    return load_tolerance_table(tmp_path / "comma.csv")


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")], ids=repr
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_a_table_is_the_same_whatever_separates_its_cells(separator, decimal, encoding, ending, sources, tmp_path):
    FRAME.to_csv(
        tmp_path / "t.csv", index=False, sep=separator, decimal=decimal, encoding=encoding, lineterminator=ending
    )
    assert load_tolerance_table(tmp_path / "t.csv") == sources


def test_a_table_is_the_same_in_a_workbook(sources, tmp_path):
    FRAME.to_excel(tmp_path / "t.xlsx", index=False)
    assert load_tolerance_table(tmp_path / "t.xlsx") == sources
    assert [source.note for source in sources[1:3]] == ['Ø 5"; "x", #2', "one\nor two"]
    assert sources[1].zone == pytest.approx(25e-6)


TITLES = (("Tolerances of reducer 7; rev. B, 2026",), (), ("Drawing", "4711-02"))


def shop_sheet(path, change=lambda sheet: None, cells=lambda value: value):
    """Write the frame as a workbook with titles above it."""
    book = Workbook()
    for row in (*TITLES, FRAME.columns, *FRAME.astype(object).where(FRAME.notna(), None).values.tolist()):
        book.active.append([cells(value) for value in row])
    change(book.active)
    book.save(path)
    return path


def test_a_sheet_may_be_chosen(sources, tmp_path):
    path = shop_sheet(tmp_path / "t.xlsx")
    book = load_workbook(path)
    book.active.title = "Rev B"
    book.active.row_dimensions[len(TITLES) + 2].hidden = True
    book.create_sheet("Rev A", 0)
    book.create_sheet("Lists").sheet_state = "hidden"
    book.save(path)
    drawing = load_drawing(path, sheet="Rev B")
    assert drawing.sources == sources
    assert len(_read(drawing)) == 2  # of the titles and of the hidden row
    with pytest.raises(InputError, match="the table is empty"):
        load_drawing(path)
    with pytest.raises(InputError, match=r"t\.xlsx: sheet is 'Rev C'; allowed is one of 'Rev A', 'Rev B'\.$"):
        load_drawing(path, sheet="Rev C")
    with pytest.raises(InputError, match="sheet 'Lists': the sheet is hidden"):
        load_drawing(path, sheet="Lists")
    with pytest.raises(InputError, match="sheet is 'Rev B'; allowed is none, since only a workbook"):
        load_drawing("rv20e_table4", sheet="Rev B")


def test_titles_above_the_header_are_left_out(sources, tmp_path):
    assert load_tolerance_table(shop_sheet(tmp_path / "t.xlsx")) == sources
    for separator, title in ((";", "Reducer 7, rev. B;;"), (",", "Reducer 7; rev. B,,"), ("\t", "Reducer 7, rev. B")):
        text = FRAME.to_csv(index=False, sep=separator)
        assert load_tolerance_table(written(tmp_path / "t.csv", f"{title}\n\n{text}")) == sources
    refused(
        written(tmp_path / "t.csv", f"Reducer 7\n\n{HEADER}\na,x,-0.1,mm,0.02,0.5,3\n"), r"row 4 \(a\): plus is 'x'"
    )


def test_a_workbook_may_hold_numbers_as_text_with_decimal_commas(sources, tmp_path):
    def comma(value):
        return str(value).replace(".", ",") if isinstance(value, float) else value

    assert load_tolerance_table(shop_sheet(tmp_path / "t.xlsx", cells=comma)) == sources


@pytest.mark.parametrize("text", ["1,234", "1.234"])
def test_a_text_of_a_workbook_that_may_separate_thousands_is_refused(text, tmp_path):
    def change(sheet):
        sheet["F5"] = text

    refused(
        shop_sheet(tmp_path / "t.xlsx", change),
        f"row 5: a number kept as text is '{text}'; allowed is a number as Excel keeps it",
    )


def _read(drawing):
    """Return what the drawing says of how it was read, without what is doubted of its rows."""
    return tuple(note for note in drawing.notes if not note.endswith("Is it meant?"))


def test_hidden_rows_and_columns_are_read_and_said(sources, tmp_path):
    def hide(sheet):
        sheet.row_dimensions[6].hidden = True
        sheet.column_dimensions["B"].hidden = True

    drawing = load_drawing(shop_sheet(tmp_path / "t.xlsx", hide))
    assert drawing.sources == sources
    titles, rows, columns = _read(drawing)
    assert "the rows above it were left out" in titles
    assert rows.endswith("hidden rows of the sheet are read like the others: 6")
    assert columns.endswith("hidden columns of the sheet are read like the others: B")
    assert _read(drawing.with_table(tmp_path / "comma.csv")) == ()  # its own, not those of the table before
    assert _read(load_drawing(shop_sheet(tmp_path / "u.xlsx"))) == (titles.replace("t.xlsx", "u.xlsx"),)


def test_comments_blank_rows_and_empty_cells_behind_the_last_column_are_left_out(sources, tmp_path):
    FRAME.to_csv(tmp_path / "t.csv", index=False, sep=";", quoting=csv.QUOTE_NONNUMERIC)
    header, *rows = (tmp_path / "t.csv").read_text(encoding="utf-8").split("\n")
    text = "\n".join(["# it isn't \"closed", f"{header};;", *rows[:2], "", ";;;", "#;", *rows[2:]])
    assert load_tolerance_table(written(tmp_path / "t.csv", text)) == sources
    # Excel leaves out the separators behind the last cell of some rows.
    plain, short = (
        load_tolerance_table(written(tmp_path / "t.csv", f"{HEADER},grade,note\n{row}\n")) for row in (f"{ROW},,", ROW)
    )
    assert plain == short


def test_all_tables_are_read_alike(tmp_path):
    for separator in ";\t":
        path = written(tmp_path / "t.csv", "# c\nname;x [mm];\n\na;1,5;\nb;-2,5e-3\nc;,5;\n".replace(";", separator))
        assert [cells for _, cells in read_table_file(path)][1:] == [("a", "1.5"), ("b", "-2.5e-3"), ("c", ".5")]
        table = read_text_table(path)
        assert table.headers == ("name", "x [mm]")
        assert (table.rows, table.cells) == ((4, 5, 6), (("a", "1.5"), ("b", "-2.5e-3"), ("c", ".5")))


@pytest.mark.parametrize("read", [read_table_file, read_text_table])
@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"name,note\na,5 \x81\n", r"row 2 looks like Windows-1252 \(cp1252\); save it as CSV UTF-8\.$"),
        (
            "name,note\na,5 µm\nb,".encode() + b"\xe4\n",
            r"row 3 looks like Windows-1252 \(cp1252\); save it as CSV UTF-8\.$",
        ),
        (b"\xff\xfex\n1", r"row 2 looks like UTF-16; save it as CSV UTF-8\.$"),
        (b"a,b\n1,2,3\n", "row 2: 3 cells stand under 2 headers; numbers have a decimal point, and .* by ','"),
        (b"a;b\n1;2;3\n", "row 2: 3 cells stand under 2 headers; cells are separated by ';'"),
        (b"a,b,\n1,2,3\n", "row 2: column 3 has '3' under an empty header; allowed is a name"),
        (b'a,b\n1,"2\n', "row 2: a quotation mark is not closed"),
        (b'a,b\n1,2\n"1"x,2\n', "row 3: a quotation mark is not closed, or not doubled within a cell"),
        (b"a,b\n1,2\n1", r"row 3: 1 of 2 cells are there; is the file truncated\?$"),
        (
            b"a;b\n1.234;2\n0,5;3\n",
            "row 2: a cell is '1.234'; allowed is decimal commas or decimal points in the whole",
        ),
        (b"a\tb\n0.5\t2\n1,234\t3\n", "row 3: a cell is '1,234'; allowed is decimal commas or decimal points"),
    ],
)
def test_what_is_no_table_is_refused_in_one_sentence(read, content, sentence, tmp_path):
    (tmp_path / "t.csv").write_bytes(content)
    refused(tmp_path / "t.csv", sentence, read)


def test_only_files_that_end_within_a_row_are_asked_about_truncation(tmp_path):
    cases = (f"{HEADER}\n{ROW},9\n", f"{HEADER}\na,0.1\n", f'{HEADER}\n"{ROW}\n', "", f"{HEADER},\n{ROW},x\n")
    for text in cases:
        with pytest.raises(InputError) as caught:
            load_tolerance_table(written(tmp_path / "t.csv", text))
        assert "truncated" not in str(caught.value)
    refused(
        written(tmp_path / "t.csv", f"{HEADER}\n{ROW}"[:-2]), r"row 2: 6 of 7 cells are there; is the file truncated\?"
    )


def test_an_empty_header_is_refused_by_its_number(tmp_path):
    text = f"{HEADER}\n{ROW}\n"
    refused(
        written(tmp_path / "t.csv", text.replace(",min,", ",,")), "the header of column 5 is empty; allowed is the name"
    )
    refused(written(tmp_path / "t.csv", text.replace("id,", " ,")), "the header of column 1 is empty")
    FRAME.assign(other="x").rename(columns={"other": ""}).to_excel(tmp_path / "t.xlsx", index=False)
    number = len(FRAME.columns) + 1
    refused(tmp_path / "t.xlsx", f"row 2: column {number} has 'x' under an empty header; allowed is a name")


WRONG = {
    "": ("[mm]", "none"),
    "mm": ("[µm]", "mm; numbers are not converted"),
    "unit": (
        "[cm]",
        "unit, where the column unit says it row by row; or µm, um, mm, in, inch or %, the same as in all rows",
    ),
    "-": ("[%]", "-; numbers are not converted"),
    "half zone": ("[µm]", "half zone; numbers are not converted"),
    "weight:shift:spread": ("[µm]", "weight:shift:spread; numbers are not converted"),
    "order:amplitude": ("[µm]", "order:amplitude; numbers are not converted"),
    "order:amplitude@°": ("[µm]", "order:amplitude@°; numbers are not converted"),
    "cost units": ("[µm]", "a currency such as EUR, or cost units; numbers are not converted"),
}


@pytest.mark.parametrize("currency", ["EUR", "€"])
def test_a_currency_is_a_cost_unit(currency, sources, tmp_path):
    table_frame(sources).rename(columns={HEADERS["cost"]: f"cost [{currency}]"}).to_csv(tmp_path / "t.csv", index=False)
    assert [own.cost for own in load_tolerance_table(tmp_path / "t.csv")] == [own.cost for own in sources]


@pytest.mark.parametrize("column", COLUMNS)
def test_a_header_with_another_unit_is_refused(column, sources, tmp_path):
    unit, allowed = WRONG[COLUMNS[column].unit]
    frame = table_frame(sources)
    for header in (f"{column} {unit}", f"{column}{unit}"):
        frame.rename(columns={HEADERS[column]: header}).to_csv(tmp_path / "t.csv", index=False)
        sentence = f"the unit of column {column} is '{unit[1:-1]}'; allowed is {allowed}"
        refused(tmp_path / "t.csv", sentence)
    frame.rename(columns={HEADERS[column]: column}).to_csv(tmp_path / "t.csv", index=False)
    assert load_tolerance_table(tmp_path / "t.csv")[0].name == "a"


@pytest.mark.parametrize("column", [name for name, column in COLUMNS.items() if column.unit == "unit"])
def test_the_header_of_a_zone_states_the_unit_of_all_rows_or_is_refused(column, sources, tmp_path):
    written_frame = table_frame([replace(own, unit="µm") for own in sources])
    written_frame.to_csv(tmp_path / "t.csv", index=False)
    again = load_tolerance_table(tmp_path / "t.csv")
    for unit in ("µm", "um", "\u03bcm"):
        frame = written_frame.rename(columns={HEADERS[column]: f"{column} [{unit}]"})
        frame.to_csv(tmp_path / "t.csv", index=False)
        assert load_tolerance_table(tmp_path / "t.csv") == again
    written_frame.rename(columns={HEADERS[column]: f"{column} [mm]"}).to_csv(tmp_path / "t.csv", index=False)
    refused(tmp_path / "t.csv", rf"row 2 \(a\): unit is 'µm'; allowed is mm as in the header {column} \[mm\]; numbers")


def test_the_unit_of_a_row_is_one_of_those_known(tmp_path):
    text = f"{HEADER}\n{ROW}\n"
    refused(
        written(tmp_path / "t.csv", text.replace("mm", "cm")),
        r"row 2 \(a\): unit is 'cm'; allowed is µm, um, mm, in, inch or %\.$",
    )
    micro = text.replace("mm", "um"), text.replace("mm", "\u03bcm")
    one, other = (load_tolerance_table(written(tmp_path / "t.csv", text)) for text in micro)
    assert one == other
    assert one[0].zone == pytest.approx(0.2e-6)
