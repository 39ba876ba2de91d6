"""Tolerance tables as offices write them: their heads, signs, words and encodings, and columns of their own."""

from __future__ import annotations

import pandas as pd
import pytest

import tolalloc as ta
from tolalloc.drawings.sources import meant
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_text
from tolalloc.exceptions import InputError, UnknownNameError

HEADS = (
    "id;part;nominal [mm];plus [unit];minus [unit];unit;distribution;sorted;group;min [unit];max [unit];"
    "cost [cost units]"
)
ROWS = (
    "shaft;shaft;25;0.02;-0.01;mm;normal;no;seat;0.005;0.1;1",
    "hub;hub;25.1;0.03;0;mm;uniform;yes;seat;0.005;0.1;2.5",
    "lid;lid;4;0.05;-0.05;mm;normal;no;;0.01;0.2;0.5",
)
PLAIN = "\n".join((HEADS, *ROWS, ""))


def written(folder, text, encoding="utf-8", name="zones.csv"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


def plain(folder):
    return load_tolerance_table(written(folder, PLAIN, name="plain.csv"))


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.replace("id;part", "ID;Part")
        .replace("nominal", "NOMINAL")
        .replace("plus", "Plus")
        .replace("cost [", "Cost ["),
        PLAIN.replace(";-0.0", ";\u22120.0"),
        PLAIN.replace(";-0.0", ";\u2212 0.0").replace(".", ","),
        PLAIN.replace("normal", "Normal").replace("uniform", "UNIFORM"),
        PLAIN.replace("normal", "Gauss").replace("uniform", "rectangular"),
        PLAIN.replace("yes", "Ja").replace("no;", "nein;"),
        "Maker GmbH;;;\n\n" + PLAIN.replace("id;", "Id;", 1),
    ],
    ids=["capitals", "true minus", "true minus and commas", "words", "other words", "German answers", "titles"],
)
def test_an_office_s_spelling_gives_the_same_sources(tmp_path, text):
    assert load_tolerance_table(written(tmp_path, text)) == plain(tmp_path)


@pytest.mark.parametrize(("encoding", "said"), [("cp1252", "Windows-1252"), ("utf-16", "UTF-16"), ("utf-8-sig", "")])
def test_a_table_is_read_as_a_spreadsheet_saves_it_and_that_is_said(tmp_path, encoding, said):
    path = written(tmp_path, PLAIN.replace("mm;", "µm;").replace("lid;lid", "lid;Gehäuse"), encoding)
    drawing = ta.drawing(path)
    assert drawing.sources[2].part == "Gehäuse" and drawing.sources[0].zone == pytest.approx(0.03e-6)
    assert [note for note in drawing.notes if "read as" in note] == (
        [f"zones.csv: read as {said}, since it is not UTF-8"] if said else []
    )


@pytest.mark.parametrize("sign", ["±", "± ", "+/-", "+-"])
@pytest.mark.parametrize("with_minus", [True, False])
def test_one_cell_is_both_deviations(tmp_path, sign, with_minus):
    heads = HEADS if with_minus else HEADS.replace("minus [unit];", "")
    row = f"lid;lid;4;{sign}0.05;{';' if with_minus else ''}mm;normal;no;;0.01;0.2;0.5"
    (lid,) = load_tolerance_table(written(tmp_path, f"{heads}\n{row}\n"))
    assert lid == plain(tmp_path)[2]


@pytest.mark.parametrize(
    ("fit", "size", "unit", "plus", "minus"),
    [("h5", "25", "mm", 0, -9), ("H7", "25", "µm", 21, 0), ("js6", "40", "µm", 8, -8), ("IT6", "40", "mm", 8, -8)],
)
def test_a_fit_is_both_deviations_of_a_size(tmp_path, fit, size, unit, plus, minus):
    row = f"pin;pin;{size};{fit};{unit};normal;no;;{'0.002;0.1' if unit == 'mm' else '2;100'};1"
    (pin,) = load_tolerance_table(written(tmp_path, f"{HEADS.replace('minus [unit];', '')}\n{row}\n"))
    assert pin.zone == pytest.approx((plus - minus) * 1e-6)
    assert pin.middle == pytest.approx((plus + minus) / 2 * 1e-6, abs=1e-12)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("pin;pin;;h5;0;mm;normal;no;;0.002;0.1;1", "plus is 'h5'; allowed is a number"),
        ("pin;pin;;h5;;mm;normal;no;;0.002;0.1;1", "a fit is that of a diameter or width with its nominal size"),
        ("pin.radius;pin;3;h5;;mm;normal;no;;0.002;0.1;1", "a fit is that of a diameter or width"),
        ("pin;pin;30;z5;;mm;normal;no;;0.002;0.1;1", r"row 2 \(pin\): ISO 286-2: fit is 'z5'"),
        ("pin;pin;900;h5;;mm;normal;no;;0.002;0.1;1", r"row 2 \(pin\): ISO 286-1: nominal \[mm\] is 900"),
    ],
)
def test_a_fit_without_a_size_is_refused(tmp_path, row, words):
    with pytest.raises(InputError, match=words):
        load_tolerance_table(written(tmp_path, f"{HEADS}\n{row}\n"))


def own_columns(folder):
    heads = HEADS.replace("id;", "id;Zeichn.-Nr.;") + ";Bemerkung;Prüfmittel [Nr]"
    rows = [row.replace(";", f";Z-{at};", 1) + f";Zeile {at};{at}7" for at, row in enumerate(ROWS)]
    return written(folder, "\n".join((heads, *rows, "")))


def test_own_columns_are_kept_said_and_written_again(tmp_path):
    path = own_columns(tmp_path)
    drawing = ta.drawing(path)
    assert [own.own_cells for own in drawing.sources][1] == (
        ("Zeichn.-Nr.", "Z-1"),
        ("Bemerkung", "Zeile 1"),
        ("Prüfmittel [Nr]", "17"),
    )
    (note,) = [own for own in drawing.notes if "kept" in own]
    assert note == "zones.csv: kept as they are, and written again: Zeichn.-Nr., Bemerkung, Prüfmittel"
    again = written(tmp_path, table_text(drawing.sources), name="again.csv")
    assert [own.own_cells for own in load_tolerance_table(again)] == [own.own_cells for own in drawing.sources]
    assert list(pd.read_csv(again)["Bemerkung"]) == ["Zeile 0", "Zeile 1", "Zeile 2"]


@pytest.mark.slow
def test_own_columns_come_back_in_the_drawing_of_an_allocation(tmp_path):
    study = ta.Study(
        ta.model(lambda shaft, hub, lid: hub - shaft + 0.1 * lid, ("shaft", "hub", "lid"), ("gap [mm]",)),
        ta.drawing(own_columns(tmp_path)),
        limits={"gap [mm]": ta.Limit(lower=0.4)},
        questions=[ta.Allocation(front=False, what_if=False)],
        name="own",
    )
    study.allocate(effort="quick").save(tmp_path / "report")
    table = pd.read_csv(tmp_path / "report" / "allocation.csv", comment="#")
    assert list(table["Zeichn.-Nr."]) == ["Z-0", "Z-1", "Z-2"]


def test_a_map_of_heads_reads_an_office_s_table_as_it_is(tmp_path):
    text = (
        PLAIN.replace("id;part", "Merkmal;Teil")
        .replace("plus [", "oberes Abmaß [")
        .replace("minus [", "unteres Abmaß [")
    )
    columns = {"Merkmal": "id", "Teil": "part", "oberes Abmaß": "plus", "unteres Abmaß": "minus"}
    drawing = ta.drawing(written(tmp_path, text), columns=columns)
    assert drawing.sources == plain(tmp_path)
    with pytest.raises(UnknownNameError, match="'pluss' is not known; the nearest known"):
        ta.drawing(written(tmp_path, text), columns={**columns, "oberes Abmaß": "pluss"})


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_all_heads_that_are_slips_are_named_at_once(tmp_path, suffix):
    frame = pd.DataFrame([{"id": "a", "nominel [mm]": 1, "pluss [unit]": 1, "minus": 0, "Bemerkung": "x", "Kosten": 1}])
    path = tmp_path / f"zones{suffix}"
    frame.to_csv(path, index=False) if suffix == ".csv" else frame.to_excel(path, index=False)
    with pytest.raises(InputError, match=r"no such column: 'nominel' \(nominal\?\), 'pluss' \(plus\?\); rename each"):
        load_tolerance_table(path)


def test_a_dimension_that_a_report_prints_means_its_sources(tmp_path):
    assert meant("seat", plain(tmp_path)) == ["shaft", "hub"]
    assert meant("lid", plain(tmp_path)) == ["lid"]
