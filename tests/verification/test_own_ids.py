"""Ids of a user's own, with a column that says which source is meant, from the table to every answer and back."""

from __future__ import annotations

import pandas as pd
import pytest

import tolalloc as ta
from tests.verification.test_own_words import ZONE, summed
from tolalloc.drawings.correlation import load_correlations
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_text
from tolalloc.exceptions import InputError, UnknownNameError

ROWS = (
    {"id": "4711-12", "source": "a", "group": "sleeves", **ZONE},
    {"id": "4711-13", "source": "b", "group": "sleeves", **ZONE},
    {"id": "c", **ZONE},
)


def study(drawing: ta.Drawing) -> ta.Study:
    return ta.Study(
        ta.model(summed, inputs=dict.fromkeys("abc", 0.0), outputs=("length [mm]",)),
        drawing,
        limits={"length [mm]": ta.Limit(lower=-0.03, upper=0.03)},
        questions=[ta.Allocation(front=False, what_if=False)],
        effort="quick",
    )


def written(folder, rows=ROWS):
    path = folder / "zones.csv"
    path.write_text(table_text(ta.Drawing.of_rows(rows).sources, folder), encoding="utf-8")
    return path


def test_they_are_read_and_written_back(tmp_path):
    found = load_tolerance_table(written(tmp_path))
    assert [(own.name, own.own_id) for own in found] == [("a", "4711-12"), ("b", "4711-13"), ("c", "")]
    assert [own.part for own in found] == ["a", "b", "c"]
    frame = pd.read_csv(tmp_path / "zones.csv", dtype=str, keep_default_na=False)
    assert frame["id"].tolist() == ["4711-12", "4711-13", "c"]
    assert frame["source"].tolist() == ["a", "b", ""]


@pytest.mark.slow
def test_they_stand_beside_the_source_in_every_answer_and_in_the_next_table(tmp_path):
    asked = study(ta.drawing(written(tmp_path)))
    ranking = asked.rank().to_frame().set_index("source")
    assert ranking.loc["a", "own id"] == "4711-12"
    allocation = asked.allocate()
    assert allocation.tables["drawing"].set_index("source").loc["b", "own id"] == "4711-13"
    assert allocation.tables["dimensions"].set_index("dimension").loc["sleeves", "own id"] == "4711-12, 4711-13"
    allocation.save(tmp_path / "found")
    again = load_tolerance_table(tmp_path / "found" / "allocation.csv")
    assert [own.own_id for own in again] == ["4711-12", "4711-13", ""]
    book = pd.read_excel(tmp_path / "found" / "drawing.xlsx", sheet_name="tolerances")
    assert book["share of variance [%]"].notna().all()


def test_they_stand_for_the_source_where_files_and_commands_name_one(tmp_path):
    drawing = ta.drawing(written(tmp_path))
    for asked in ("4711-12", "4711-*"):
        changed = study(drawing).ask(ta.Difference(zones={asked: 10.0}))
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
    priced = study(ta.drawing(tmp_path / "zones.csv", costs=tmp_path / "made.csv")).allocate()
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


def test_suggestions_know_them():
    drawing = ta.Drawing.of_rows(ROWS)
    with pytest.raises(UnknownNameError, match="4711-12"):
        study(drawing).ask(ta.Difference(zones={"4711-21": 10.0}))
