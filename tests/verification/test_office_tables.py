"""Tolerance tables as offices write them: their heads, signs, words and encodings, and columns of their own."""

from __future__ import annotations

import csv
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
from openpyxl import Workbook

import tolalloc as ta
from tests.builders import written
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


def plain(folder):
    return load_tolerance_table(written(folder / "plain.csv", PLAIN))


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
    assert load_tolerance_table(written(tmp_path / "zones.csv", text)) == plain(tmp_path)


@pytest.mark.parametrize(("encoding", "said"), [("cp1252", "Windows-1252"), ("utf-16", "UTF-16"), ("utf-8-sig", "")])
def test_a_table_is_read_as_a_spreadsheet_saves_it_and_that_is_said(tmp_path, encoding, said):
    path = written(tmp_path / "zones.csv", PLAIN.replace("mm;", "µm;").replace("lid;lid", "lid;Gehäuse"), encoding)
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
    (lid,) = load_tolerance_table(written(tmp_path / "zones.csv", f"{heads}\n{row}\n"))
    assert lid == plain(tmp_path)[2]


@pytest.mark.parametrize(
    ("fit", "size", "unit", "plus", "minus"),
    [("h5", "25", "mm", 0, -9), ("H7", "25", "µm", 21, 0), ("js6", "40", "µm", 8, -8), ("IT6", "40", "mm", 8, -8)],
)
def test_a_fit_is_both_deviations_of_a_size(tmp_path, fit, size, unit, plus, minus):
    row = f"pin;pin;{size};{fit};{unit};normal;no;;{'0.002;0.1' if unit == 'mm' else '2;100'};1"
    (pin,) = load_tolerance_table(written(tmp_path / "zones.csv", f"{HEADS.replace('minus [unit];', '')}\n{row}\n"))
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
        load_tolerance_table(written(tmp_path / "zones.csv", f"{HEADS}\n{row}\n"))


def own_columns(folder):
    heads = HEADS.replace("id;", "id;Zeichn.-Nr.;") + ";Bemerkung;Prüfmittel [Nr]"
    rows = [row.replace(";", f";Z-{at};", 1) + f";Zeile {at};{at}7" for at, row in enumerate(ROWS)]
    return written(folder / "zones.csv", "\n".join((heads, *rows, "")))


def test_own_columns_are_kept_said_and_written_again(tmp_path):
    path = own_columns(tmp_path)
    drawing = ta.drawing(path)
    assert [own.own_cells for own in drawing.sources][1] == (
        ("Zeichn.-Nr.", "Z-1"),
        ("Bemerkung", "Zeile 1"),
        ("Prüfmittel [Nr]", "17"),
    )
    (note,) = [own for own in drawing.notes if "kept" in own]
    assert note == "zones.csv: kept unchanged and written again: Zeichn.-Nr., Bemerkung, Prüfmittel"
    again = written(tmp_path / "again.csv", table_text(drawing.sources))
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
    drawing = ta.drawing(written(tmp_path / "zones.csv", text), columns=columns)
    assert drawing.sources == plain(tmp_path)
    with pytest.raises(UnknownNameError, match=r"unknown .*'pluss'; the nearest known"):
        ta.drawing(written(tmp_path / "zones.csv", text), columns={**columns, "oberes Abmaß": "pluss"})


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


UNIT_HEADS = "id;nominal;plus;minus;unit;min;max;cost"


@pytest.mark.parametrize(
    ("row", "zone", "middle", "nominal"),
    [
        ("pin;1.25;0.001;-0.001;in;0.0002;0.01;1", 0.002 * 25.4, 0.0, 1.25 * 25.4),
        ("pin;0.5;0.0012;0.0004;inch;0.0002;0.01;1", 0.0008 * 25.4, 0.0008 * 25.4, 12.7),
        ("pin;2;± 0.0005;;in;0.0002;0.01;1", 0.001 * 25.4, 0.0, 50.8),
        ("pin;1;h7;;in;0.0001;0.01;1", 0.021, -0.0105, 25.4),  # ISO 286-2 prints 0/−21 µm for 18 to 30 mm
        ("pin;50;2;-2;%;0.1;5;1", 2.0, 0.0, 50.0),
        ("pin;8;1.5;-0.5;%;0.1;5;1", 0.16, 0.04, 8.0),
        ("pin;-8;1.5;-0.5;%;0.1;5;1", 0.16, 0.04, -8.0),
        ("pin;20;± 0.25 %;;%;0.1;5;1", 0.1, 0.0, 20.0),
        ("pin;900;5;-5;mm;1;12;1", 10.0, 0.0, 900.0),
        ("pin;900;3500;-1500;µm;100;9000;1", 5.0, 1.0, 900.0),
    ],
)
def test_inches_and_per_cent_are_read_and_written_as_they_stand(tmp_path, row, zone, middle, nominal):
    drawing = ta.drawing(written(tmp_path / "zones.csv", f"{UNIT_HEADS}\n{row}\n"))
    (pin,) = drawing.sources
    assert [1e3 * pin.zone, 1e3 * pin.middle, 1e3 * pin.nominal] == pytest.approx([zone, middle, nominal], abs=1e-9)
    again = drawing.to_csv(tmp_path / "again.csv")
    table, unit = pd.read_csv(again), row.split(";")[4].replace("inch", "in")
    head = "nominal [in]" if unit == "in" else "nominal [mm]"
    assert (table["unit"][0], table[head][0]) == (unit, float(row.split(";")[1]))
    assert [table["min [unit]"][0], table["max [unit]"][0]] == pytest.approx(
        [float(own) for own in row.split(";")[5:7]]
    )
    (read,) = load_tolerance_table(again)
    assert [read.zone, read.nominal, read.minimum] == pytest.approx([pin.zone, pin.nominal, pin.minimum], abs=3e-12)
    assert read.middle == pytest.approx(pin.middle, abs=2e-11)


@pytest.mark.parametrize(
    ("heads", "row", "words"),
    [
        (
            "nominal;",
            "pin;0;2;-2;%;0.1;5;1",
            "unit is %, which is of the nominal size; allowed is a nominal size other",
        ),
        ("nominal [%];", "pin;50;2;-2;%;0.1;5;1", r"the unit of column nominal is '%'; allowed is mm"),
        ("nominal [mm];", "pin;1.25;1;-1;in;0.2;9;1", "unit is 'in'; allowed is mm as in the header nominal"),
        ("nominal [in];", "pin;1.25;0.1;-0.1;mm;0.02;9;1", "unit is 'mm'; allowed is in as in the header nominal"),
        ("nominal;", "pin;1.25;0.1;-0.1;ft;0.02;9;1", "unit is 'ft'; allowed is µm, um, mm, in, inch or %"),
        (
            "nominal;",
            "pin;1.25;1.251;1.249;in;0.0002;0.01;1",
            "are limits of a size of 1.25 in; allowed are deviations",
        ),
        ("nominal;", "pin;9000;1200;-1200;mm;1;2500;1", "2400000 µm and must be 0 to 1000000 µm"),
        ("nominal;", "pin;1.25;1/16;0;in;0.0002;0.01;1", "plus is '1/16'; allowed is a number"),
    ],
)
def test_units_that_contradict_each_other_are_refused(tmp_path, heads, row, words):
    with pytest.raises(InputError, match=words):
        ta.drawing(written(tmp_path / "zones.csv", f"{UNIT_HEADS.replace('nominal;', heads)}\n{row}\n"))


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (
            "pin;50;2;-2;%;0.1;5;1",
            "4 % of the nominal size, 2,000 µm, full width between the limits: normal, σ = 333 µm",
        ),
        (
            "pin;1.25;0.001;-0.001;in;0.0002;0.01;1",
            "0.002 in, full width between the limits: normal, σ = 0.000333 in at",
        ),
        (
            "pin;900;0;-12.5;mm;1;20;1",
            "12,500 µm, full width between the limits, its middle −6,250 µm from the nominal",
        ),
    ],
)
def test_a_sentence_says_a_zone_in_the_unit_of_its_row(tmp_path, row, words):
    (pin,) = load_tolerance_table(written(tmp_path / "zones.csv", f"{UNIT_HEADS}\n{row}\n"))
    assert pin.mapping.startswith(words)


def test_a_wide_zone_without_a_nominal_size_is_doubted(tmp_path):
    drawing = ta.drawing(written(tmp_path / "zones.csv", f"{UNIT_HEADS}\npin;;3;-3;mm;1;9;1\n"))
    assert any("the zone of 6 mm is wide, and no nominal size" in note for note in drawing.notes)


def test_an_own_function_gets_inches_where_its_rows_are_in_inches(tmp_path):
    rows = ("bore;1.253;0.001;-0.001;in;0.0002;0.005;1", "shaft;31.75;0.02;-0.02;mm;0.005;0.1;1", "n;4;5;-5;%;1;15;1")
    drawing = ta.drawing(written(tmp_path / "zones.csv", "\n".join((UNIT_HEADS, *rows, ""))))
    seen = ta.model(lambda *inputs: inputs, ("bore", "shaft", "n"), ("a [in]", "b [mm]", "c [mm]"))
    bound = seen.bound(drawing.errors, "test")
    deviations = np.array([[25.4e-6, -0.01e-3, 0.05 * 4e-3]])
    assert bound(deviations).values[0] == pytest.approx([1.254, 31.74, 4.2])
    slopes = bound.derivatives("a [in]", deviations).by_column[0]
    assert slopes == pytest.approx([1 / 0.0254, 0, 0])  # [in per m]
    assert bound.content != seen.bound(drawing.with_table(mm_of(tmp_path)).errors, "test").content


def mm_of(folder):
    rows = ("bore;31.8262;0.0254;-0.0254;mm;0.01;0.1;1", "shaft;31.75;0.02;-0.02;mm;0.005;0.1;1", "n;4;5;-5;%;1;15;1")
    return written(folder / "mm.csv", "\n".join((UNIT_HEADS, *rows, "")))


TOML = """[columns]
"Merkmal" = "id"
"Teil" = "part"
"oberes Abmaß" = "plus"
"unteres Abmaß" = "minus"
"Zeichn.-Nr." = "drawing"
"""


def office_text():
    text = (
        PLAIN.replace("id;part", "Merkmal;Teil")
        .replace("plus [", "oberes Abmaß [")
        .replace("minus [", "UNTERES Abmaß [")
    )
    lines = [f"{line};{last}" for line, last in zip(text.splitlines(), ("Zeichn.-Nr.", *"123"), strict=True)]
    return "\n".join((*lines, ""))


def frame_of(text, path):
    rows = [line.split(";") for line in text.splitlines()]
    pd.DataFrame(rows[1:], columns=rows[0]).to_excel(path, index=False)
    return path


@pytest.mark.parametrize("name", ["zones.csv", "zones.xlsx", "Teil 3.tolerances.csv"])
def test_a_file_beside_the_table_says_what_its_heads_mean(tmp_path, name):
    path = tmp_path / name
    path.with_suffix(".toml").write_text(TOML, encoding="utf-8")
    path = frame_of(office_text(), path) if name.endswith("xlsx") else written(tmp_path / name, office_text())
    drawing = ta.drawing(path)
    assert [own.drawing for own in drawing.sources] == ["1", "2", "3"]
    assert [(own.name, own.part, own.zone) for own in drawing.sources] == [
        (own.name, own.part, own.zone) for own in plain(tmp_path)
    ]
    assert any("heads as " in note and "Merkmal is id" in note for note in drawing.notes)
    again = drawing.to_csv(tmp_path / "again.csv")
    assert list(pd.read_csv(again).columns)[:6] == [
        *("Merkmal", "Teil", "feature", "nominal [mm]", "oberes Abmaß [unit]", "unteres Abmaß [unit]"),
    ]
    assert ta.drawing(again).sources == drawing.sources


def test_what_is_given_in_python_comes_before_the_file(tmp_path):
    (tmp_path / "zones.toml").write_text(TOML.replace('"drawing"', '"label"'), encoding="utf-8")
    path = written(tmp_path / "zones.csv", office_text())
    assert ta.drawing(path).sources[0].label == "1"
    assert ta.drawing(path, columns={"Zeichn.-Nr.": "note"}).sources[0].note == "1"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TOML.replace('"plus"', '"pluss"'), r"zones.toml, columns: unknown column for 'oberes Abmaß', 'pluss'.*plus"),
        (TOML.replace("[columns]", "[colums]"), "zones.toml: unknown field 'colums'.*columns"),
        ("columns = 3\n", "zones.toml: columns is"),
        (TOML.replace('"plus"', "5"), "zones.toml: columns.oberes Abmaß is 5"),
        (TOML + '"broken', "zones.toml: not complete TOML"),
        (TOML + 'Merkmal = "part"\n', "zones.toml: not complete TOML"),
        (TOML + 'Merkmale = "id"\n', "zones.csv, columns: unknown head 'Merkmale'; the nearest known is Merkmal"),
        (TOML + "[rows]\n", "zones.toml: .*unknown .*'rows'"),
    ],
)
def test_a_file_of_heads_that_is_wrong_is_refused_in_one_sentence(tmp_path, text, words):
    (tmp_path / "zones.toml").write_text(text, encoding="utf-8")
    path = written(tmp_path / "zones.csv", office_text())
    with pytest.raises((InputError, UnknownNameError), match=words) as caught:
        ta.drawing(path)
    assert "\n" not in str(caught.value)


def test_a_slip_in_the_heads_of_a_workbook_is_not_taken_for_a_damaged_file(tmp_path):
    (tmp_path / "zones.toml").write_text(TOML + 'Merkmale = "id"\n', encoding="utf-8")
    book = Workbook()
    for row in csv.reader(office_text().splitlines(), delimiter=";"):
        book.active.append(row)
    book.save(tmp_path / "zones.xlsx")
    with pytest.raises(UnknownNameError, match=r"zones.xlsx, columns: unknown head 'Merkmale'; the nearest known is"):
        ta.drawing(tmp_path / "zones.xlsx")


@pytest.mark.parametrize(("locked", "is_read"), [("ja", True), ("yes", True), ("no", False), ("", False)])
def test_a_bought_part_needs_neither_range_nor_price_where_it_is_locked(tmp_path, locked, is_read):
    lines = ("id,nominal,plus,minus,unit,min,max,cost,locked", f"bearing,30,0,-0.06,mm,,,,{locked}")
    path = written(tmp_path / "zones.csv", "\n".join([*lines, "pin,5,0.01,-0.01,mm,0.005,0.1,2,", ""]))
    if is_read:
        bearing, _ = ta.drawing(path).sources
        assert (bearing.locked, bearing.cost, bearing.process) == (True, 0.0, "")
        assert [1e6 * own for own in (bearing.zone, bearing.minimum, bearing.maximum)] == pytest.approx([60.0] * 3)
    else:
        with pytest.raises(InputError, match=r"row 2 \(bearing\).*min"):
            ta.drawing(path)


def test_two_heads_for_one_column_are_refused(tmp_path):
    (tmp_path / "zones.toml").write_text(TOML.replace('"drawing"', '"part"'), encoding="utf-8")
    with pytest.raises(InputError, match="the column 'part' is there twice"):
        ta.drawing(written(tmp_path / "zones.csv", office_text()))


def test_a_file_of_another_kind_beside_the_table_says_nothing_of_its_heads(tmp_path):
    (tmp_path / "zones.toml").write_text('#:schema x\n[reducer]\nname = "mine"\n', encoding="utf-8")
    assert ta.drawing(written(tmp_path / "zones.csv", PLAIN)).sources == plain(tmp_path)


@pytest.mark.slow
def test_inches_heads_and_own_columns_come_back_from_an_allocation(tmp_path):
    text = office_text().replace(";mm;", ";in;").replace("[mm]", "[in]") + "\n"
    (tmp_path / "zones.toml").write_text(TOML, encoding="utf-8")
    study = ta.Study(
        ta.model(lambda shaft, hub, lid: hub - shaft + 0.1 * lid, ("shaft", "hub", "lid"), ("gap [in]",)),
        ta.drawing(
            written(
                tmp_path / "zones.csv", text.replace("Zeichn.-Nr.", "Zeichn.-Nr.;Bemerkung").replace(";1\n", ";1;neu\n")
            )
        ),
        limits={"gap [in]": ta.Limit(lower=0.4)},
        questions=[ta.Allocation(front=False, what_if=False)],
        name="inches",
    )
    answer = study.allocate(effort="quick")
    answer.save(tmp_path / "report")
    table = pd.read_csv(tmp_path / "report" / "allocation.csv", comment="#")
    assert list(table["unit"]) == ["in"] * 3 and list(table["nominal [in]"]) == [25, 25.1, 4]
    assert list(table["Merkmal"]) == ["shaft", "hub", "lid"] and list(table["Zeichn.-Nr."]) == [1, 2, 3]
    assert list(table["Bemerkung"].fillna("")) == ["neu", "", ""]
    zones = answer.to_frame("drawing")["zone [in]"]
    np.testing.assert_allclose(table["oberes Abmaß [unit]"] - table["unteres Abmaß [unit]"], zones, atol=2e-10)
    again = ta.drawing(tmp_path / "report" / "allocation.csv")
    np.testing.assert_allclose([own.zone for own in again.sources], zones * 0.0254, atol=5e-12)
    written_as = list(answer.to_frame("dimensions")["write [in]"].map(str))
    assert all(own.endswith(" in") for own in written_as)


@pytest.mark.slow
def test_beta_trapezoid_and_rayleigh_are_ranked_and_allocated(tmp_path):
    """Shares of a sum are those of the closed variances; the allocation keeps its limits at a lower cost."""
    head = "id;nominal;plus;minus;unit;min;max;cost;distribution;shape"
    rows = (
        "a;30.1;0.02;-0.02;mm;0.004;0.2;1;Beta;2 5",
        "b;25;0.02;-0.02;mm;0.004;0.2;1;trapezoid;0.5",
        "c;5;0.02;0;mm;0.004;0.2;1;rayleigh;",
    )
    study = ta.Study(
        ta.model(lambda a, b, c: a - b - c, ("a", "b", "c"), ("gap [mm]",)),
        ta.drawing(written(tmp_path / "zones.csv", "\n".join((head, *rows, "")))),
        limits={"gap [mm]": ta.Limit(lower=0.05, upper=0.12)},
        name="three kinds",
    )
    variances = np.array(
        [
            0.04**2 * 2 * 5 / (7**2 * 8),
            0.02**2 * (1 + 0.5**2) / 6,
            (0.02**2 / (-2 * np.log(0.0027))) * (2 - np.pi / 2),
        ]
    )
    ranking = study.rank(effort="quick").to_frame("ranking").set_index("dimension")["total index ST [-]"]
    assert ranking[["a", "b", "c"]].to_numpy() == pytest.approx(variances / variances.sum(), abs=2e-3)
    found = study.allocate(effort="quick").result
    assert found.met and found.bound <= found.cost < 3.0


GERMAN = ("Merkmal", "Teil", "Art", "Nennmaß [mm]", "oberes Abmaß", "unteres Abmaß", "Einheit", "kleinste Toleranz",
    "größte Toleranz", "Kosten [EUR]", "Prüfmittel", "Spektrum")  # fmt: skip
FRENCH = ("caractéristique", "pièce", "genre", "cote nominale [mm]", "écart supérieur", "écart inférieur", "unité",
    "tolérance minimale", "tolérance maximale", "coût [EUR]", "moyen", "spectre")  # fmt: skip
CHINESE = (
    "特性",
    "零件",
    "类型",
    "公称尺寸 [mm]",
    "上偏差",
    "下偏差",
    "单位",
    "最小公差",
    "最大公差",
    "成本 [EUR]",
    "量具",
    "频谱",
)
ENGLISH = ("Characteristic", "Component", "Type", "Nominal size [mm]", "Upper deviation", "Lower deviation", "Unit",
    "Smallest tolerance", "Largest tolerance", "Price [EUR]", "Gauge", "Spectrum")  # fmt: skip
FEATURES = {
    GERMAN: ("Maß", "Position", "Teilung", "Rundlauf"),
    FRENCH: ("cote", "localisation", "pas", "battement"),
    CHINESE: ("尺寸", "位置", "齿距", "圆跳动"),
    ENGLISH: ("Dimension", "Location", "Pitch", "Run-out"),
}


def test_heads_of_which_the_fewer_are_known_are_listed_instead_of_a_title_above_them(tmp_path):
    rows = ("Tolerances of the RV-40X,,,,,", "Part,Characteristic,Unit,Upper dev.,Nominal,Tightest,Gauge")
    (tmp_path / "zones.csv").write_text("\n".join([*rows, "pin,diameter,mm,0.01,6,0.002,CMM", ""]), encoding="utf-8")
    with pytest.raises(InputError, match=r"no row has a head 'id'; row 2 has 'Part'.*\"Upper dev.\" = \"plus\""):
        ta.drawing(tmp_path / "zones.csv")


@pytest.mark.parametrize("heads", FEATURES, ids=["German", "French", "Chinese", "English"])
@pytest.mark.parametrize("is_workbook", [False, True], ids=["CSV", "XLSX"])
def test_heads_that_nobody_mapped_are_listed_and_what_is_said_of_them_can_be_pasted(heads, is_workbook, tmp_path):
    rows = [
        ("Tolerances of the RV-80X", *[""] * 11),
        heads,
        *(
            (f"place {at}", "part", word, 8, 0.01, 0, "mm", 0.002, 0.02, 5, "", "1:9.2" if at > 1 else "")
            for at, word in enumerate(FEATURES[heads])
        ),
        ("# sum", *[""] * 8, 20, "", ""),
    ]
    path = tmp_path / ("zones.xlsx" if is_workbook else "zones.csv")
    if is_workbook:
        book = Workbook()
        for row in rows:
            book.active.append(row)
        book.active.merge_cells("A1:D1")
        book.save(path)
    else:
        path.write_text("".join(",".join(map(str, row)) + "\n" for row in rows), encoding="utf-8")
    with pytest.raises(InputError, match="no row has a head 'id'; row 2 has") as caught:
        ta.drawing(path)
    said = str(caught.value)
    assert "\n" not in said
    assert all(repr(head) in said for head in heads)
    (tmp_path / "zones.toml").write_text(said.partition("beside it: ")[2], encoding="utf-8")
    sources = ta.drawing(path).sources
    assert [source.feature for source in sources] == ["size", "position", "pitch", "runout"]
    assert [source.zone for source in sources] == pytest.approx([1e-5] * 4)


def test_a_head_may_be_said_with_its_unit(tmp_path):
    (tmp_path / "zones.toml").write_text(TOML.replace('"oberes Abmaß"', '"oberes Abmaß [µm]"'), encoding="utf-8")
    assert len(ta.drawing(written(tmp_path / "zones.csv", office_text())).sources) == 3


def test_a_fit_stands_in_a_row_whose_feature_is_called_as_an_office_does(tmp_path):
    row = "pin.diameter,Maß,8,h5,,µm,1,9,10"
    text = f"id,feature,nominal [mm],plus,minus,unit,min,max,cost\n{row}\n"
    (pin,) = ta.drawing(written(tmp_path / "zones.csv", text)).sources
    assert (pin.middle, pin.zone) == pytest.approx((-3e-6, 6e-6))


def test_a_strict_workbook_is_refused_with_what_to_save_it_as(tmp_path):
    path = tmp_path / "zones.xlsx"
    with ZipFile(path, "w") as archive:
        archive.writestr("xl/workbook.xml", '<workbook xmlns="http://purl.oclc.org/ooxml/spreadsheetml/main"/>')
        archive.writestr("[Content_Types].xml", "<Types/>")
    with pytest.raises(InputError, match=r"Strict Open XML.*save it"):
        ta.drawing(path)
