"""``tolalloc series``: many studies in one table, what is finished not run again, what fails told beside the rest."""

from __future__ import annotations

import json

import pytest

from tests.studies.command import refused, tolalloc

STUDY = """
import tolalloc as ta

def gap(housing, shaft):
    return housing - shaft

zone = {{"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}}
study = ta.Study(
    ta.model({function}, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{{"id": "housing", "nominal": 30.1, **zone}}, {{"id": "shaft", "nominal": 30.0, **zone}}]),
    limits={{"gap [mm]": ta.Limit(lower=0.1 - {half}, upper=0.1 + {half})}},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="{name}",
    effort="quick",
)
"""


def script(folder, name, half=0.03, function="gap"):
    path = folder / f"{name}_study.py"
    path.write_text(STUDY.format(name=name, half=half, function=function), encoding="utf-8")
    return path


def test_a_series_is_one_table_and_is_not_run_twice(tmp_path):
    wide, tight = script(tmp_path, "wide"), script(tmp_path, "tight", half=0.02)
    broken = script(tmp_path, "broken", function="lambda housing, shaft: float('nan')")
    first = tolalloc("series", wide, tight, broken, "--out", tmp_path / "runs", "--json")
    assert first.returncode == 0, first.stderr
    rows = {row["study"]: row for row in json.loads(first.stdout)["studies"]}
    assert list(rows) == ["wide", "tight", "broken"]
    assert rows["wide"]["answer"] == rows["tight"]["answer"] == "met"
    assert rows["tight"]["cost [cost units]"] > 1.3 * rows["wide"]["cost [cost units]"]
    assert rows["broken"]["answer"].startswith("not run: ")
    assert not (tmp_path / "runs" / "broken").exists()
    saved = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("summary.json")}
    second = tolalloc("series", wide, tight, "--out", tmp_path / "runs", "--json")
    assert json.loads(second.stdout)["studies"] == [rows["wide"], rows["tight"]]
    assert saved == {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("summary.json")}


@pytest.mark.parametrize("named", ["wide", "tight"])
def test_a_folder_of_another_study_is_not_taken_for_an_answer(tmp_path, named):
    found = tolalloc("series", script(tmp_path, named, half=0.03), "--out", tmp_path / "runs")
    assert found.returncode == 0
    other = tolalloc("series", script(tmp_path, named, half=0.025), "--out", tmp_path / "runs", "--json")
    assert "not empty" in json.loads(other.stdout)["studies"][0]["answer"]


def test_two_studies_of_one_name_are_refused(tmp_path):
    one = script(tmp_path, "same")
    refused(tolalloc("series", one, one, "--out", tmp_path / "runs"), "2 studies are named 'same'")
