"""Sixty files as offices send them, made here: each is read as it was meant, or refused in one sentence."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from openpyxl import Workbook
from openpyxl.cell.rich_text import CellRichText, TextBlock
from openpyxl.cell.text import InlineFont
from openpyxl.styles import Font

import tolalloc as ta
from tolalloc.exceptions import TolallocError

HEAD = ("id", "nominal", "plus", "minus", "unit", "min", "max", "cost")
ROWS = (
    ("shaft", 25, 0.02, -0.01, "mm", 0.005, 0.1, 1),
    ("hub", 25.1, 0.03, 0, "mm", 0.005, 0.1, 2.5),
    ("lid", 4, 0.05, -0.05, "mm", 0.01, 0.2, 0.5),
)
MEANT = {name: numbers for name, *numbers in ((row[0], *row[1:4], *row[5:]) for row in ROWS)}
"""Id → nominal, plus, minus, min, max [mm] and cost."""


@dataclass(frozen=True)
class OfficeFile:
    """A file, how it is made, and what is read from it, or the words by which it is refused."""

    name: str
    content: str | bytes | Callable[[Path], None]
    changed: dict = field(default_factory=dict)  # Id → numbers that differ from the usual ones
    refused: str = ""
    renamed: dict = field(default_factory=dict)  # Usual id → id in the file
    notes: tuple[str, ...] = ()  # Words that `check` says of it
    suffix: str = ".csv"


def text(separator: str = ";", head: tuple = HEAD, rows: tuple = ROWS, comma: bool = True) -> str:
    """Return the table as a CSV file, with decimal commas unless told otherwise."""
    lines = [separator.join(map(str, row)) for row in (head, *rows)]
    joined = "\n".join(lines) + "\n"
    return joined.replace(".", ",") if comma and separator != "," else joined


def book(
    change: Callable | None = None, rows: tuple = ROWS, head: tuple = HEAD, top: int = 0, left: int = 0
) -> Callable:
    """Return what writes the table into a workbook, so many rows and columns off the corner, and then changes it."""

    def write(path: Path) -> None:
        workbook = Workbook()
        sheet = workbook.active
        for at, row in enumerate((head, *rows), start=1 + top):
            for column, value in enumerate(row, start=1 + left):
                sheet.cell(at, column, value)
        if change:
            change(sheet)
        workbook.save(path)

    return write


def cells(**values: object) -> Callable:
    """Return what sets cells of a sheet to values."""

    def change(sheet) -> None:
        for place, value in values.items():
            sheet[place] = value

    return change


def form(place: str, value: object, number_format: str) -> Callable:
    """Return what sets a cell and the format that it is shown in."""

    def change(sheet) -> None:
        sheet[place] = value
        sheet[place].number_format = number_format

    return change


def raised(place: str, text: str, end: str, **font: object) -> Callable:
    """Return what sets a cell to a text whose end is raised, or in another font."""
    block = TextBlock(InlineFont(**(font or {"vertAlign": "superscript"})), end)
    return cells(**{place: CellRichText(text, block)})


def hidden(sheet) -> None:
    sheet.row_dimensions[3].hidden = True
    sheet.column_dimensions["F"].hidden = True


def struck(sheet, *rows) -> None:
    for cell in (cell for row in rows or (4,) for cell in sheet[row]):
        cell.font = Font(strike=True)


def struck_rows(sheet) -> None:
    struck(sheet, 3, 4)


def struck_cell(sheet) -> None:
    sheet["C3"].font = Font(strike=True)


def struck_title(sheet) -> None:
    sheet["A1"] = "Rev. A"
    sheet["A1"].font = Font(strike=True)


def struck_comment(sheet) -> None:
    sheet.append(["# ring", None, 0.5])
    struck(sheet, sheet.max_row)


def struck_blanks(sheet) -> None:
    sheet["Z3"].font = Font(strike=True)


def merged_title(sheet) -> None:
    sheet["A1"] = "Toleranzliste Getriebe 4711"
    sheet.merge_cells("A1:H1")


def merged_cells(sheet) -> None:
    sheet.merge_cells("E2:E4")


def second_sheet(sheet) -> None:
    other = sheet.parent.create_sheet("Kosten")
    other.append(("id", "plus"))
    other.append(("shaft", 99))


def without_row(sheet) -> None:
    sheet.insert_rows(3)


def without_head(sheet) -> None:
    sheet.insert_cols(4)


PERCENT = (("shaft", 25, 0.1, -0.1, "%", 0.02, 1, 1), *ROWS[1:])
OF_25 = {"shaft": [25, 0.025, -0.025, 0.005, 0.25, 1]}
PLAIN = text(",")
NO_UNIT = tuple(name for name in HEAD if name != "unit")
WITHOUT = tuple(row[:4] + row[5:] for row in ROWS)

FILES = [
    # Layout of a CSV file
    OfficeFile("title rows", "Firma Muster GmbH;;;;;;;\nStand 2026;;;;;;;\n\n" + text(), notes=("left out",)),
    OfficeFile("title that names an id", "ID;4711;;;;;;\n" + text(), notes=("row 2",)),
    OfficeFile("separator stated for Excel", "sep=;\n" + text()),
    OfficeFile("empty rows between", text().replace("hub", "\n;;;;;;;\n\nhub")),
    OfficeFile("empty column in front", "\n".join(f";{line}" for line in text().splitlines()) + "\n"),
    OfficeFile("empty columns between", text().replace(";mm;", ";;mm;").replace(";unit;", ";;unit;")),
    OfficeFile("empty columns behind", text().replace("\n", ";;;\n")),
    OfficeFile("units below the heads", text().replace("cost\n", "cost\n;mm;mm;mm;;mm;mm;EUR\n")),
    OfficeFile(
        "units in brackets below the heads", text().replace("cost\n", "cost\n-;[mm];[unit];[unit];;[unit];[unit];[€]\n")
    ),
    OfficeFile(
        "units below heads that say others",
        text().replace("nominal", "nominal [mm]").replace("cost\n", "cost\n;in;;;;;;\n"),
        refused="nominal is 'in'; allowed is mm as in the head",
    ),
    OfficeFile("units in round brackets", text().replace("nominal;plus", "nominal (mm);plus (mm)")),
    OfficeFile(
        "units in heads alone",
        text(
            head=("id", "nominal [mm]", "plus [mm]", "minus [mm]", "min [mm]", "max [mm]", "cost [EUR]"), rows=WITHOUT
        ),
    ),
    OfficeFile("no unit anywhere", text(head=NO_UNIT, rows=WITHOUT), refused="the column 'unit' is missing"),
    OfficeFile("tabs", text("\t")),
    OfficeFile("tabs and points", text("\t", comma=False)),
    OfficeFile("commas", PLAIN),
    OfficeFile("bars", text("|")),
    OfficeFile("byte order mark", "\ufeff" + text()),
    OfficeFile("line ends of an old Mac", text().replace("\n", "\r").encode()),
    OfficeFile("UTF-16 with its mark", text().encode("utf-16"), notes=("UTF-16",)),
    OfficeFile("UTF-16 without its mark", text().encode("utf-16-le"), refused="control character|cannot be read"),
    OfficeFile(
        "quoted cells",
        "\n".join(";".join(f'"{cell}"' for cell in line.split(";")) for line in text().splitlines()) + "\n",
    ),
    OfficeFile("quoted head of two lines", text().replace(";plus;", ';"plus\n[mm]";')),
    OfficeFile(
        "quoted note with a number sign",
        text(head=(*HEAD, "note"), rows=((*ROWS[0], '"as\n#3"'), (*ROWS[1], ""), (*ROWS[2], ""))),
    ),
    OfficeFile("comment rows", "# Entwurf\n" + text().replace("lid", "# lid alt;;;;;;;\nlid")),
    OfficeFile(
        "comment rows of another language",
        text().replace("lid", "// lid alt;;;;;;;\nlid"),
        refused=r"row 4 \(// lid alt\): .*cost are missing|row 4 \(// lid alt\): .*max are missing",
    ),
    OfficeFile(
        "sum behind",
        text() + "Summe;;;;;;;4,0\n",
        refused=r"row 5 \(Summe\): .*cost are missing|row 5 \(Summe\): .*max are missing",
    ),
    OfficeFile(
        "sum without a name",
        text() + ";;;;;;;4,0\n",
        refused=r"row 5 \(no id\): .*cost are missing|row 5 \(no id\): .*max are missing",
    ),
    OfficeFile(
        "head again on the next page",
        text().replace("lid", ";".join(HEAD) + "\nlid"),
        refused="row 4: the header is repeated here",
    ),
    OfficeFile(
        "second table below",
        text() + "\nPrüfer;Datum;;;;;;\nMeier;3.4.26;;;;;;\n",
        refused=r"\(Prüfer\): plus, minus, unit, min, max, cost are missing",
    ),
    OfficeFile(
        "second table beside",
        "\n".join(
            f"{line};;{more}" for line, more in zip(text().splitlines(), ("id;plus", "a;1", "b;2", "c;3"), strict=True)
        )
        + "\n",
        refused="the column 'id' is there twice",
    ),
    OfficeFile(
        "table turned",
        "\n".join(";".join(map(str, own)) for own in zip(HEAD, *ROWS, strict=True)) + "\n",
        refused=r"no such column: 'shaft' \(shift\?\)",
    ),
    # Numbers in a CSV file
    OfficeFile("thousands between others", text().replace("2,5", "2.500,00"), refused="cost is '2.500,00'"),
    OfficeFile(
        "thousands that may be decimals",
        text(rows=(("shaft", 25, 20, -10, "µm", 5, 100, "1.500"),), comma=False),
        refused="'1.500'; allowed is a number that shows what its sign means",
    ),
    OfficeFile("blank between thousands", text().replace("2,5", "2\u00a0500"), refused="cost is '2 500'"),
    OfficeFile("apostrophe between thousands", text().replace("2,5", "2'500"), refused='cost is "2\'500"'),
    OfficeFile(
        "no-break blanks and unseen signs",
        text().replace("shaft;", "\u00a0shaft\u200b\u00a0;").replace("0,02;", "\u202f0,02\u00a0;"),
    ),
    OfficeFile("blanks behind", text().replace(";", "  ; ")),
    OfficeFile(
        "units behind numbers",
        text().replace("0,02;", "0,02 mm;").replace(";25;", ";25 mm;").replace("-0,05", "\u22120,05\u00a0mm"),
    ),
    OfficeFile(
        "other units behind numbers",
        text().replace("0,02;", "20 µm;"),
        refused="plus is '20 µm'; allowed is a number in mm",
    ),
    OfficeFile("scientific notation", text().replace("0,02;", "2,0E-02;").replace("0,005", "5e-3")),
    OfficeFile(
        "plus and minus swapped", text().replace("0,02;-0,01", "-0,01;0,02"), refused="zone plus − minus is -30 µm"
    ),
    OfficeFile(
        "minus without its sign",
        text().replace("0,05;-0,05", "0,05;0,05"),
        refused="if ± 0.05 is meant, minus is −0.05",
    ),
    OfficeFile("minus behind", text().replace("-0,01", "0,01-"), refused="minus is '0,01-'"),
    OfficeFile("minus as brackets", text().replace("-0,01", "(0,01)"), refused=r"minus is '\(0,01\)'"),
    OfficeFile("dash for minus", text().replace("-0,01", "–0,01"), refused="minus is '–0,01'"),
    OfficeFile(
        "both deviations in one cell", text().replace("0,02;-0,01", "+0,02/-0,01;"), refused=r"plus is '\+0,02/-0,01'"
    ),
    OfficeFile(
        "limits of size",
        text().replace("0,02;-0,01", "25,02;24,99"),
        refused="plus 25.02 and minus 24.99 are limits of a size of 25 mm",
    ),
    OfficeFile("footnote behind a number", text().replace("0,02;", "0,02¹;"), refused="plus is '0,02¹'"),
    OfficeFile("footnote at an id", text().replace("hub;", "hub²;"), renamed={"hub": "hub²"}),
    OfficeFile("footnote at a head", text().replace("minus;", "minus¹);"), refused=r"'minus¹\)' \(minus\?\)"),
    OfficeFile("full-width digits", text().replace("0,02;", "０,０２;"), refused="plus is '０,０２'"),
    OfficeFile(
        "Greek letters and diameters in ids",
        text().replace("shaft", "Ø_Welle").replace("hub", "φ₁").replace("lid", "μ-Deckel"),
        renamed={"shaft": "Ø_Welle", "hub": "φ₁", "lid": "μ-Deckel"},
    ),
    OfficeFile("accents in two signs", text().replace("hub", "Gehäuse"), renamed={"hub": "Gehäuse"}),
    OfficeFile(
        "an id twice", text().replace("lid;", "hub;"), refused=r"row 4 \(hub\): id is 'hub' for the second time"
    ),
    OfficeFile(
        "an id twice but for a blank",
        text().replace("lid;", "hub\u00a0;"),
        refused=r"row 4 \(hub\): id is 'hub' for the second time",
    ),
    OfficeFile(
        "text columns keep their commas",
        text(head=(*HEAD, "drawing", "Prüfnr."), rows=tuple((*row, "4,7", "12,345") for row in ROWS)),
    ),
    OfficeFile("per cent of the nominal size", text(rows=PERCENT), changed=OF_25),
    OfficeFile("per cent behind the numbers", text(rows=PERCENT).replace("0,1;-0,1", "0,1 %;-0,1%"), changed=OF_25),
    OfficeFile(
        "per cent of no nominal size",
        text(rows=(("shaft", 0, *PERCENT[0][2:]),)),
        refused="of the nominal size; allowed is a nominal size other than 0",
    ),
    OfficeFile("no number", text().replace("2,5", "n/a"), refused="cost is 'n/a'"),
    OfficeFile("not a number", text().replace("2,5", "NaN"), refused="cost is "),
    # Workbooks
    OfficeFile("table off the corner", book(top=3, left=2), suffix=".xlsx", notes=("left out",)),
    OfficeFile("merged title", book(merged_title, top=2), suffix=".xlsx"),
    OfficeFile("merged cells", book(merged_cells), suffix=".xlsx", refused="the cells E2:E4 are merged"),
    OfficeFile("empty row and column", book(lambda sheet: (without_row(sheet), without_head(sheet))), suffix=".xlsx"),
    OfficeFile("formula without its value", book(cells(C2="=0.04/2")), suffix=".xlsx", refused="cell C2 is '=0.04/2'"),
    OfficeFile("error of a formula", book(cells(C2="#DIV/0!")), suffix=".xlsx", refused="#DIV/0!"),
    OfficeFile("hidden row and column", book(hidden), suffix=".xlsx", notes=("hidden rows", "hidden columns")),
    OfficeFile("row that is struck out", book(struck), suffix=".xlsx", refused="row 4 is struck out; delete"),
    OfficeFile("one cell that is struck out", book(struck_cell), suffix=".xlsx", refused="row 3 is struck out; delete"),
    OfficeFile("rows that are struck out", book(struck_rows), suffix=".xlsx", refused="rows 3, 4 are struck out"),
    OfficeFile("title that is struck out", book(struck_title, top=2), suffix=".xlsx", notes=("left out",)),
    OfficeFile("comment that is struck out", book(struck_comment), suffix=".xlsx"),
    OfficeFile("empty cells that are struck out", book(struck_blanks), suffix=".xlsx"),
    OfficeFile(
        "number turned into a date",
        book(cells(C2=datetime.date(2026, 5, 1))),
        suffix=".xlsx",
        refused="'2026-05-01'; allowed is what was typed",
    ),
    OfficeFile(
        "id turned into a date",
        book(cells(A2=datetime.date(2026, 3, 4))),
        suffix=".xlsx",
        refused="'2026-03-04'; allowed is what was typed",
    ),
    OfficeFile(
        "date in a column of their own",
        book(head=(*HEAD, "geprüft"), rows=tuple((*row, datetime.date(2026, 3, 4)) for row in ROWS)),
        suffix=".xlsx",
        notes=("kept",),
    ),
    OfficeFile(
        "numbers as text",
        book(rows=tuple(tuple(str(cell).replace(".", ",") for cell in row) for row in ROWS)),
        suffix=".xlsx",
    ),
    OfficeFile(
        "thousands as text", book(cells(H3="2.500")), suffix=".xlsx", refused="a number kept as text is '2.500'"
    ),
    OfficeFile(
        "per cent by format",
        book(lambda sheet: (form("C2", 0.001, "0.0%")(sheet), form("D2", -0.001, "0.0%")(sheet)), rows=PERCENT),
        suffix=".xlsx",
        changed=OF_25,
    ),
    OfficeFile(
        "per cent by format in a row of mm",
        book(form("C2", 0.02, "0%")),
        suffix=".xlsx",
        refused="plus is '2%'; allowed is a number in mm",
    ),
    OfficeFile("unit by format", book(form("C2", 0.02, '0.00" mm"')), suffix=".xlsx"),
    OfficeFile(
        "other unit by format",
        book(form("C2", 20, '0" µm"')),
        suffix=".xlsx",
        refused="plus is '20 µm'; allowed is a number in mm",
    ),
    OfficeFile("zeros before an id by format", book(form("A2", 7, "000")), suffix=".xlsx", renamed={"shaft": "007"}),
    OfficeFile("currency by format", book(form("H3", 2.5, '#,##0.00\\ "€"')), suffix=".xlsx"),
    OfficeFile("second sheet", book(second_sheet), suffix=".xlsx"),
    OfficeFile("truth for a number", book(cells(H3=True)), suffix=".xlsx", refused="cost is 'True'"),
    OfficeFile(
        "comment row",
        book(cells(A5="# alt", B5=1, C5=1, D5=0, E5="mm", F5=1, G5=2, H5=1)),
        suffix=".xlsx",
    ),
    OfficeFile(
        "sum as a formula",
        book(cells(A5="Summe", H5=4.0)),
        suffix=".xlsx",
        refused=r"row 5 \(Summe\): .*cost are missing|row 5 \(Summe\): .*max are missing",
    ),
    OfficeFile(
        "number shown in thousands",
        book(form("C2", 20, "0.000,")),
        suffix=".xlsx",
        refused="plus is '20 shown in thousands'",
    ),
    OfficeFile(
        "remark below the table",
        book(cells(A6="Alle Maße in mm")),
        suffix=".xlsx",
        refused=r"row 6 \(Alle Maße in mm\): plus, minus, unit",
    ),
    OfficeFile(
        "units below the heads of a workbook",
        book(rows=(("", "mm", "mm", "mm", "mm", "mm", "EUR"), *WITHOUT), head=NO_UNIT),
        suffix=".xlsx",
    ),
    OfficeFile("heads of two lines", book(cells(C1="plus\n[mm]", D1="minus\n(mm)")), suffix=".xlsx"),
    OfficeFile(
        "footnote that is raised", book(raised("C2", "0.02", "1")), suffix=".xlsx", refused=r"plus is '0.02\^1'"
    ),
    OfficeFile(
        "digit that is struck out",
        book(raised("H3", "2.5", "5", strike=True)),
        suffix=".xlsx",
        refused="cost is '2.5~5'",
    ),
    OfficeFile("words in two fonts", book(raised("A3", "hu", "b", b=True)), suffix=".xlsx"),
    OfficeFile(
        "capability in other words",
        text(head=(*HEAD, "Cp (kurz)"), rows=tuple((*row, 1.33) for row in ROWS)),
        refused=r"'Cp \(kurz\)' \(Cp\?\)",
    ),
    OfficeFile("cost per currency", text().replace("cost\n", "cost (EUR)\n")),
    OfficeFile("cost in words", text().replace("cost\n", "cost / part\n"), refused=r"'cost / part' \(cost\?\)"),
    OfficeFile(
        "section in the middle",
        text().replace("lid;", "Deckelseite;;;;;;;\nlid;"),
        refused=r"row 4 \(Deckelseite\): plus, minus, unit, min, max, cost are missing",
    ),
    OfficeFile("plus and minus in one column of text", book(cells(C4="± 0,05", D4=None)), suffix=".xlsx"),
    # Other kinds of files
    OfficeFile(
        "old workbook",
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600),
        suffix=".xls",
        refused=r"this is an Excel 97–2003 workbook \(XLS\).*save it as",
    ),
    OfficeFile(
        "old workbook under another ending",
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600),
        suffix=".xlsx",
        refused=r"this is an Excel 97–2003 workbook",
    ),
    OfficeFile(
        "OpenDocument",
        b"PK\x03\x04mimetypeapplication/vnd.oasis.opendocument.spreadsheet",
        suffix=".ods",
        refused=r"an OpenDocument spreadsheet \(ODS\).*save it as",
    ),
    OfficeFile(
        "binary workbook", b"PK\x03\x04....xl/workbook.bin", suffix=".xlsb", refused=r"a binary workbook \(XLSB\)"
    ),
    OfficeFile("workbook called CSV", book(), refused="a workbook or an archive under another ending"),
    OfficeFile(
        "web page called workbook",
        "<html><table><tr><td>id</td></tr></table></html>",
        suffix=".xls",
        refused="this is a web page",
    ),
    OfficeFile("XML of an office", '<?xml version="1.0"?><Workbook/>', suffix=".xls", refused="this is a file in XML"),
    OfficeFile("PDF", b"%PDF-1.7 ...", suffix=".csv", refused="this is a PDF"),
    OfficeFile("text called workbook", text("\t"), suffix=".xls"),
    OfficeFile("empty", "", refused="the table is empty"),
    OfficeFile("head alone", text(rows=()), refused="the table has no rows"),
]


def test_there_are_sixty_files_and_more():
    assert len({own.name for own in FILES}) == len(FILES) >= 60


@pytest.mark.parametrize("own", FILES, ids=lambda own: own.name)
def test_a_file_is_read_as_it_was_meant_or_refused_in_one_sentence(own, tmp_path):
    path = tmp_path / f"zones{own.suffix}"
    if callable(own.content):
        own.content(path if own.suffix == ".xlsx" else path.with_suffix(".xlsx"))
        path.with_suffix(".xlsx").replace(path)
    else:
        path.write_bytes(own.content if isinstance(own.content, bytes) else own.content.encode())
    if own.refused:
        with pytest.raises(TolallocError, match=own.refused) as caught:
            ta.drawing(path)
        assert str(caught.value).startswith(str(path)) and str(caught.value).endswith(".")
        sentences = str(caught.value).split("\n")
        assert len({sentence.partition(":")[0] for sentence in sentences}) == len(sentences)  # one a row
        return
    drawing = ta.drawing(path)
    meant = {own.renamed.get(name, name): own.changed.get(name, numbers) for name, numbers in MEANT.items()}
    found = {
        source.name: (
            source.nominal,
            source.middle + source.zone / 2,
            source.middle - source.zone / 2,
            source.minimum,
            source.maximum,
            source.cost / 1e3,
        )
        for source in drawing.sources
    }
    assert list(found) == list(meant)
    for name, numbers in meant.items():
        assert [1e3 * number for number in found[name]] == pytest.approx(numbers, abs=1e-9), name
    for words in own.notes:
        assert any(re.search(words, note) for note in drawing.notes), drawing.notes
