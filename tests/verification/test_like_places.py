"""One row for several like places: read as one source each, told as one line, written as the row that it was."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import ZONE_OF_A_LENGTH, refusal, written
from tests.golden.cases import small_effort
from tolalloc.drawings.sources import meant
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_text
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.study.prepared import Prepared
from tolalloc.wings.bench.lots import load_lot, prepare_lot

POSITION = {"feature": "position", "plus": 5, "minus": 0, "unit": "µm", "min": 1, "max": 10, "cost": 6.5}
JOURNALS = {f"crank{i}.journal{j}.eccentricity" for i in (1, 2, 3) for j in (1, 2)}
BORES = {f"disc{j}.bore{i}.position" for i in (1, 2, 3) for j in (1, 2)}


def reducer(*rows: dict, **more: object) -> Prepared:
    """Return a study of three cranks and two discs with these rows alone; nothing is solved."""
    limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=60)}
    drawing = ta.Drawing.of_rows([{**POSITION, **row} for row in rows])
    return Prepared(study=ta.Study(ta.reducer("rv80e"), drawing, limits=limits, neglected=["*"], **more))


@pytest.mark.parametrize(
    ("row", "places"),
    [
        ({"id": "crank*.journal*.eccentricity"}, JOURNALS),
        ({"id": "6x crank*.journal*.eccentricity"}, JOURNALS),
        ({"id": "Exzenter", "source": "6× crank*.journal*.eccentricity"}, JOURNALS),
        ({"id": "6× Exzenter", "source": "crank*.journal*.eccentricity"}, JOURNALS),
        ({"id": "Exzenter (6x)", "source": "crank*.journal*.eccentricity"}, JOURNALS),
        ({"id": "Exzenter", "source": "crank.journal.eccentricity", "places": "6x"}, JOURNALS),
        ({"id": "disc.bore.position", "places": 6}, BORES),
        ({"id": "disc1.bore*.position", "places": "3 ×"}, {own for own in BORES if own.startswith("disc1")}),
        ({"id": "crank[12].journal*.eccentricity", "places": 4}, {own for own in JOURNALS if "crank3" not in own}),
    ],
)
def test_a_row_stands_for_all_places_that_it_names(row, places):
    sources = reducer(row).errors.sources
    assert {own.name for own in sources} == places and len(sources) == len(places)
    assert len({own.dimension for own in sources}) == 1
    assert {(round(own.zone * 1e6, 9), own.cost) for own in sources} == {(5.0, 6.5)}


def test_a_place_with_a_row_of_its_own_keeps_it():
    own = {"id": "crank2.journal1.eccentricity", "plus": 3}
    found = reducer({"id": "5x crank*.journal*.eccentricity"}, own).errors.sources
    zones = {source.name: round(source.zone * 1e6, 9) for source in found}
    assert zones == dict.fromkeys(JOURNALS, 5.0) | {own["id"]: 3.0}


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([{"id": "4x crank*.journal*.eccentricity"}], "places is 4; allowed is 6, as many as crank.*crank3.journal2"),
        ([{"id": "disk*.bore*.position"}], r"unknown source 'disk\*.bore\*.position'; the nearest known"),
        ([{"id": "disc1.pitch", "places": 2}], "places is 2; allowed is 1, as many as disc1.pitch"),
        (
            [{"id": "disc*.bore1.position"}, {"id": "disc*.bore*.position"}, {"id": "6x disc.bore.position"}],
            "places is 6; allowed is 0, .*: none",
        ),
    ],
)
def test_places_that_are_not_there_are_refused(rows, words):
    with pytest.raises((InputError, UnknownNameError), match=words):
        _ = reducer(*rows).errors


def test_two_numbers_of_places_are_refused():
    with pytest.raises(InputError, match="places is 6, and the name of its source says 4"):
        ta.Drawing.of_rows([{"id": "4x crank*.journal*.eccentricity", "places": 6, **POSITION}])


def test_a_row_for_all_is_the_six_rows():
    single = [
        {"id": own, "group": "journals"} for own in reducer({"id": "crank*.journal*.eccentricity"}).errors.columns
    ]
    names = dict.fromkeys(row["id"].removesuffix(".x").removesuffix(".y") for row in single)
    apart = reducer(*({"id": name, "group": "journals"} for name in names))
    together = reducer({"id": "6x crank*.journal*.eccentricity", "group": "journals"})
    assert apart.errors.columns == together.errors.columns
    np.testing.assert_array_equal(apart.random_units(8), together.random_units(8))
    assert apart.space.cost(apart.space.uniform(1.0)) == together.space.cost(together.space.uniform(1.0)) == 6 * 6.5


HEADS = "Merkmal;Anzahl;plus;minus;unit;min;max;cost;Quelle;Prüfmittel\n"
TABLE = HEADS + "Passfeder;;20;-20;µm;5;100;3;key;Lehre 1\nBolzen;4x;20;-20;µm;5;100;1;pin*;Lehre 2\n"
OFFICE = '[columns]\nMerkmal = "id"\nAnzahl = "places"\nQuelle = "source"\n'


def gap(key: float, pin1: float, pin2: float, pin3: float, pin4: float) -> float:
    return key + pin1 + pin2 + pin3 + pin4


def pins(folder, **more: object) -> ta.Study:
    """Return the study of an office's table in which one row is four pins."""
    written(folder / "zones.toml", OFFICE)
    model = ta.model(gap, inputs=("key", "pin1", "pin2", "pin3", "pin4"), outputs=("gap [mm]",))
    drawing = ta.drawing(written(folder / "zones.csv", TABLE))
    # Five σ of 40/6 µm: 14.9 µm together; the limit is four of them.
    limits = {"gap [mm]": ta.Limit(lower=-0.06, upper=0.06, show=ta.AtYield(target=0.95))}
    return ta.Study(model, drawing, limits=limits, name="pins", effort=small_effort(), **more)


def test_they_are_one_line_of_a_check(tmp_path):
    lines = [own for own in ta.check(pins(tmp_path)).sentences if "Bolzen" in own]
    assert len(lines) == 1 and lines[0].startswith("  Bolzen (pin*), 4 places (pin1, pin2, pin3, pin4): 40 µm, ")


@pytest.mark.slow
def test_they_are_one_line_of_a_drawing_everywhere_and_come_back_as_their_row(tmp_path):
    answer = pins(tmp_path, questions=[ta.Allocation(front=False, what_if=False)]).allocate()
    answer.save(tmp_path / "found")
    for name, column in {"drawing": "source", "dimensions": "dimension", "tolerances": "Merkmal"}.items():
        assert len(answer.tables[name]) == 2, name
        assert list(answer.tables[name][column])[1] == {"source": "pin*"}.get(column, "Bolzen")
    drawn = answer.tables["drawing"].set_index("source")
    assert drawn["places [-]"].tolist() == ["1", "4"]
    found = {own.name: own for own in answer.result.drawn_sources}
    assert drawn.loc["pin*", "cost [cost units]"] == pytest.approx(4 * found["pin1"].cost)
    assert drawn["share of variance [%]"].sum() == pytest.approx(100)
    csv = pd.read_csv(tmp_path / "found" / "allocation.csv", comment="#")
    assert csv["Merkmal"].tolist() == ["Passfeder", "Bolzen"] and csv["Prüfmittel"].tolist() == ["Lehre 1", "Lehre 2"]
    assert csv["Quelle"].tolist() == ["key", "pin*"] and csv["Anzahl [-]"].tolist()[1] == 4
    book = pd.read_excel(tmp_path / "found" / "drawing.xlsx", sheet_name=None)
    assert len(book["tolerances"]) == 2
    assert csv["cost [cost units]"].to_numpy() @ [1, 4] == pytest.approx(answer.result.cost)
    again = pins(tmp_path).changed(tmp_path / "found" / "allocation.csv")
    zones = {own.name: own.zone for own in Prepared(study=again).errors.sources}
    assert zones == pytest.approx({name: own.zone for name, own in found.items()})


@pytest.mark.parametrize("asked", ["Bolzen", "pin*"])
def test_other_zones_of_a_row_are_one_line(tmp_path, asked):
    answer = pins(tmp_path).ask(ta.Difference(zones={asked: 20.0}, units=128))
    (line,) = answer.tables["changed zones"].to_dict("records")
    assert (line["source"], line["own id"]) == ("pin*", "Bolzen")
    assert (line["zone before [µm]"], line["zone after [µm]"]) == pytest.approx((40, 20))
    assert (line["cost before [cost units]"], line["cost after [cost units]"]) == pytest.approx((4, 8))


def test_another_zone_of_one_place_has_a_row_of_its_own(tmp_path):
    study = pins(tmp_path)
    answer = study.ask(ta.Difference(zones={"pin2": 20.0}, units=128))
    assert answer.tables["changed zones"]["source"].tolist() == ["pin2"]
    changed = {own.name: own for own in answer.result.after}
    sources = [changed.get(own.name, own) for own in Prepared(study=study).errors.sources]
    table = load_tolerance_table(written(tmp_path / "again.csv", table_text(sources)))
    assert {own.name: round(own.zone * 1e6) for own in table} == {
        "key": 40,
        "pin1": 40,
        "pin2": 20,
        "pin3": 40,
        "pin4": 40,
    }
    assert [own.own_id for own in table] == ["Passfeder", "", "", "", ""]
    assert meant("Bolzen", table) == ["pin1", "pin2", "pin3", "pin4"]  # by their group


def test_correlations_of_a_row_are_those_of_its_places(tmp_path):
    rows = [{"id": "key", **ZONE_OF_A_LENGTH}, {"id": "pin*", **ZONE_OF_A_LENGTH}]
    path = written(tmp_path / "pairs.csv", "sources,correlation\nkey pin*,0.3\n")
    errors = ta.Drawing.of_rows(rows, correlations=path).errors.at_places(("key", "pin1", "pin2"))
    expected = [[1, 0.3, 0.3], [0.3, 1, 0], [0.3, 0, 1]]
    np.testing.assert_array_equal(errors.correlation.source_matrix(errors.sources), expected)


READINGS = "pin1 [µm];pin3 [µm]\n" + "".join(f"{at % 7 - 3};{at % 5 - 2}\n" for at in range(30))


def test_a_lot_reads_single_places_of_a_row(tmp_path):
    written(tmp_path / "zones.toml", OFFICE)
    drawing = ta.drawing(written(tmp_path / "zones.csv", TABLE))
    found = prepare_lot(written(tmp_path / "lot.csv", READINGS), drawing, 0.05, None, 1)
    assert [own.source.name for own in found.columns] == ["pin1", "pin3"]
    assert [own.source.zone for own in found.columns] == pytest.approx([40e-6] * 2)
    again = load_tolerance_table(written(tmp_path / "again.csv", table_text(found.drawing.sources)))
    assert [(own.name, own.places) for own in again] == [("key", 0), ("pin*", 2), ("pin1", 0), ("pin3", 0)]
    places = ta.Drawing.of_rows([{"id": "key", **ZONE_OF_A_LENGTH}]).with_sources(again).errors
    assert [own.name for own in places.at_places(("key", "pin1", "pin2", "pin3", "pin4")).sources] == [
        *("key", "pin2", "pin4"),
        *("pin1", "pin3"),
    ]


def test_a_lot_reads_a_row_by_its_id(tmp_path):
    written(tmp_path / "zones.toml", OFFICE)
    drawing = ta.drawing(written(tmp_path / "zones.csv", TABLE))
    path = written(tmp_path / "lot.csv", READINGS.replace("pin1 [µm];pin3", "Bolzen [µm];key"))
    assert [own.source.name for own in load_lot(path, drawing.sources)] == ["pin*", "key"]
    unknown = written(tmp_path / "other.csv", READINGS.replace("pin1", "bolt1").replace("pin3", "key"))
    assert "unknown source of column 'bolt1'" in refusal(lambda path: load_lot(path, drawing.sources), unknown)
