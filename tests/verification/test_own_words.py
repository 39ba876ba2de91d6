"""What a user's drawings call a source is kept from the table to the answers and back into a table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import ZONE_OF_A_LENGTH, page_of, study_of_lengths
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_text
from tolalloc.reports.columns import own_words

ROWS = (
    {"id": "a", "label": "Hülse Ø55", "drawing": "4711-B", "group": "sleeves", **ZONE_OF_A_LENGTH},
    {"id": "b", "drawing": "4711-B", "group": "sleeves", **ZONE_OF_A_LENGTH},
    {"id": "c", **ZONE_OF_A_LENGTH},
)


def study(rows) -> ta.Study:
    return study_of_lengths(ta.Drawing.of_rows(rows))


@pytest.fixture(scope="module")
def answers():
    asked = study(ROWS)
    return asked.rank(effort="quick"), asked.allocate(effort="quick")


def test_label_and_drawing_stand_beside_the_id(answers):
    ranking, allocation = answers
    drawing, dimensions = allocation.tables["drawing"], allocation.tables["dimensions"].set_index("dimension")
    for frame, named in ((drawing, "source"), (ranking.to_frame(), "dimension")):
        at = list(frame.columns).index(named)
        assert list(frame.columns[at : at + 3]) == [named, "drawing", "label"]
    found, ranked = drawing.set_index("source"), ranking.to_frame().set_index("dimension")
    assert found.loc["a", ["drawing", "label"]].tolist() == ["4711-B", "Hülse Ø55"]
    assert found.loc["b", ["drawing", "label"]].tolist() == ["4711-B", ""]
    assert ranked.loc["sleeves", ["drawing", "label"]].tolist() == ["4711-B", "Hülse Ø55"]
    for own in (found, ranked):
        assert own.loc["c", ["drawing", "label"]].tolist() == ["", ""]
    assert dimensions.loc["sleeves", ["drawing", "label"]].tolist() == ["4711-B", "Hülse Ø55"]


def test_they_are_in_the_written_drawing_and_read_back(answers, tmp_path):
    allocation = answers[1]
    allocation.save(tmp_path / "found")
    written = load_tolerance_table(tmp_path / "found" / "allocation.csv")
    assert [(source.drawing, source.label) for source in written] == [("4711-B", "Hülse Ø55"), ("4711-B", ""), ("", "")]
    page = page_of(tmp_path / "found")
    assert "Hülse Ø55" in page
    book = pd.read_excel(tmp_path / "found" / "drawing.xlsx", sheet_name=None, header=None, dtype=str)
    assert any(np.any(sheet.to_numpy() == "Hülse Ø55") for sheet in book.values())


def test_a_number_of_a_drawing_stays_a_text(tmp_path):
    text = table_text(study(ROWS).drawing.sources).replace("4711-B", "0815")
    (tmp_path / "zones.csv").write_text(text, encoding="utf-8")
    assert [source.drawing for source in load_tolerance_table(tmp_path / "zones.csv")] == ["0815", "0815", ""]


@pytest.mark.slow
def test_a_table_without_them_has_no_empty_columns():
    bare = [{name: value for name, value in row.items() if name not in ("label", "drawing")} for row in ROWS]
    assert not {"label", "drawing"} & {*study(bare).rank(effort="quick").to_frame().columns}


def test_copies_of_one_line_have_the_first_and_the_last_own_id_or_none_that_its_name_says():
    sources = ta.Drawing.of_rows([{"id": name, **ZONE_OF_A_LENGTH} for name in "abcd"]).sources

    def of(ids: str, name: str) -> str:
        known = [replace(own, own_id=said) for own, said in zip(sources, ids.split("|"), strict=False)]
        return own_words(lambda _: known, lambda _: name)[0].value(0)

    assert of("Exzenter 1/1|Exzenter 1/2|Exzenter 2/1|Exzenter 2/2", "Exzenter") == ""
    assert of("Bolzen", "Bolzen") == ""
    assert of("B-17", "Bolzen") == "B-17"
    assert of("B-17|C-3|D-4", "Bolzen") == "B-17 … D-4"
    assert of("B-17|C-3", "Bolzen") == "B-17, C-3"
    assert of("|B-17", "Bolzen") == "B-17"
    assert of("", "Bolzen") == ""
    assert of("4711-12", "") == of("4711-12", "4711-13") == "4711-12"  # an id of numbers alone is no number of a copy
