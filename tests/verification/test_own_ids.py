"""Ids of a user's own, with a column that says which source is meant, from the table to every answer and back."""

from __future__ import annotations

import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import ZONE_OF_A_LENGTH, study_of_lengths, written
from tolalloc.drawings.correlation import load_correlations
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_text
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.study.prepared import Prepared

ROWS = (
    {"id": "4711-12", "source": "a", "group": "sleeves", **ZONE_OF_A_LENGTH},
    {"id": "4711-13", "source": "b", "group": "sleeves", **ZONE_OF_A_LENGTH},
    {"id": "c", **ZONE_OF_A_LENGTH},
)


def table(folder):
    return written(folder / "zones.csv", table_text(ta.Drawing.of_rows(ROWS).sources, folder))


def test_they_are_read_and_written_back(tmp_path):
    found = load_tolerance_table(table(tmp_path))
    assert [(own.name, own.own_id) for own in found] == [("a", "4711-12"), ("b", "4711-13"), ("c", "")]
    assert [own.part for own in found] == ["a", "b", "c"]
    frame = pd.read_csv(tmp_path / "zones.csv", dtype=str, keep_default_na=False)
    assert frame["id"].tolist() == ["4711-12", "4711-13", "c"]
    assert frame["source"].tolist() == ["a", "b", ""]


def test_a_line_of_one_source_is_called_what_the_table_calls_it(tmp_path):
    rows = [{**ROWS[0], "group": ""}, *ROWS[1:]]
    study = study_of_lengths(ta.Drawing.of_rows(rows))
    assert [own.dimension for own in Prepared(study=study).errors.sources] == ["4711-12", "sleeves", "c"]


@pytest.mark.slow
def test_they_stand_beside_the_source_in_every_answer_and_in_the_next_table(tmp_path):
    asked = study_of_lengths(ta.drawing(table(tmp_path)))
    ranking = asked.rank().to_frame().set_index("dimension")
    assert ranking.loc["sleeves", "own id"] == "4711-12, 4711-13"
    allocation = asked.allocate()
    assert allocation.tables["drawing"].set_index("source").loc["b", "own id"] == "4711-13"
    assert allocation.tables["dimensions"].set_index("dimension").loc["sleeves", "own id"] == "4711-12, 4711-13"
    allocation.save(tmp_path / "found")
    again = load_tolerance_table(tmp_path / "found" / "allocation.csv")
    assert [own.own_id for own in again] == ["4711-12", "4711-13", ""]
    book = pd.read_excel(tmp_path / "found" / "drawing.xlsx", sheet_name="tolerances")
    assert book["share of variance [%]"].notna().all()


@pytest.mark.slow
def test_they_stand_for_the_source_where_files_and_commands_name_one(tmp_path):
    drawing = ta.drawing(table(tmp_path))
    for asked in ("4711-12", "4711-*"):
        changed = study_of_lengths(drawing).ask(ta.Difference(zones={asked: 10.0}))
        assert {own.name: round(own.zone * 1e6, 6) for own in changed.result.after}["a"] == 10.0
        assert changed.tables["changed zones"].set_index("source").loc["a", "own id"] == "4711-12"
    (tmp_path / "pairs.csv").write_text("sources,correlation\n4711-12 4711-13,0.5\n", encoding="utf-8")
    pair = load_correlations(tmp_path / "pairs.csv", drawing.sources).pairs[0]
    assert (pair.one, pair.other) == ("a", "b")
    (tmp_path / "matrix.csv").write_text("name,4711-12,c\n4711-12,1,0.2\nc,0.2,1\n", encoding="utf-8")
    assert load_correlations(tmp_path / "matrix.csv", drawing.sources).pairs[0].one == "a"
    (tmp_path / "made.csv").write_text(
        "sources,process,model,fixed,factor,min,max,note\n4711-1?,turned,reciprocal,0.5,40,5,200,x\n", encoding="utf-8"
    )
    priced = study_of_lengths(ta.drawing(tmp_path / "zones.csv", costs=tmp_path / "made.csv")).allocate()
    assert set(priced.tables["drawing"].set_index("source").loc[["a", "b"], "process"]) == {"turned"}


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"id": "4711-12", "source": "c"}, "row 3 .*id is '4711-12' for the second time"),
        ({"id": "4711-14", "source": "a"}, "row 3 .*source is 'a' for the second time"),
        ({"id": "a", "source": "c"}, "row 3 .*id is 'a' for the second time"),
    ],
)
def test_one_id_twice_is_refused(changed, words):
    with pytest.raises(InputError, match=words):
        ta.Drawing.of_rows([*ROWS[:2], {**ROWS[2], **changed}])


@pytest.mark.parametrize("sign", ["\x00", "\x07", "\x1b", "\t", "\n", "\r", "\x7f", "\x85", "\u2028", "\ud800"])
@pytest.mark.parametrize("field", ["id", "source", "group"])
def test_a_name_that_no_line_holds_is_refused_when_the_drawing_is_read(field, sign):
    with pytest.raises(ta.InputError) as caught:
        ta.Drawing.of_rows([*ROWS[:2], {**ROWS[2], field: f"a{sign}b"}], place="own")
    said = str(caught.value)
    assert said.startswith(f"own, row 3: {field} is {f'a{sign}b'!r}; allowed is text without control characters")
    assert said.isprintable()


@pytest.mark.parametrize("field", ["note", "label", "drawing"])
def test_a_text_that_no_table_is_read_back_with_is_refused_and_one_of_two_lines_is_not(tmp_path, field):
    with pytest.raises(ta.InputError, match=f"row 1: {field} is 'a.x07b'; allowed is text without control"):
        ta.Drawing.of_rows([{**ROWS[0], field: "a\x07b"}])
    drawing = ta.Drawing.of_rows([{**ROWS[0], field: "a\nb"}])
    assert ta.drawing(drawing.to_csv(tmp_path / "zones.csv")).sources == drawing.sources


def test_suggestions_know_them():
    drawing = ta.Drawing.of_rows(ROWS)
    with pytest.raises(UnknownNameError, match="4711-12"):
        study_of_lengths(drawing).ask(ta.Difference(zones={"4711-21": 10.0}))
