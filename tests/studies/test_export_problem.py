"""``tolalloc export-problem``: what stands in the folder is enough to find the same yield without this package."""

from __future__ import annotations

import csv
import json
import runpy
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.golden.cases import OWN
from tests.studies.command import refused, tolalloc
from tolalloc.running.progress import SILENT
from tolalloc.study.exported_problem import export_problem
from tolalloc.study.script import load_study

LINEAR = """
import tolalloc as ta

ROW = {"plus": 20, "minus": -20, "unit": "µm", "min": 5, "max": 100, "cost": 1}


def gap(a, b):
    return 0.5 * a - 2 * b


study = ta.Study(
    ta.model(gap, inputs={"a": 10.0, "b": 2.0}, outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{"id": "a", **ROW}, {"id": "b", **ROW}]),
    limits={"gap [mm]": ta.Limit(lower=0.98, upper=1.02)},
    name="linear",
)
"""


def read(path: Path) -> tuple[list[str], list[list[str]]]:
    head, *rows = csv.reader(path.read_text("utf-8").splitlines())
    return head, rows


def share_within(folder: Path, values: dict[str, np.ndarray]) -> float:
    """Return the share of the rows that keep all limits."""
    kept = True
    for output, lower, upper, *_ in read(folder / "limits.csv")[1]:
        kept &= (values[output] >= float(lower or -np.inf)) & (values[output] <= float(upper or np.inf))
    return float(np.mean(kept))


def expected(folder: Path) -> tuple[float, int]:
    """Return the yield that the folder states and the number of units that it is of."""
    found = json.loads((folder / "expected.json").read_text("utf-8"))
    ((said, yields),) = [(name, own) for name, own in found.items() if name.startswith("yield")]
    estimate, low, high = yields["all limits"]
    assert low < estimate < high
    return estimate, int(said.split(" units")[0].split()[-1])


def test_what_decides_and_stands_in_no_file_is_said(tmp_path):
    text = LINEAR.replace('{"id": "b", **ROW}])', '{"id": "b", **ROW}], gauge_ratio=10)').replace(
        'name="linear",', 'name="linear", compensators=[ta.Shim("a", step=2.0, sizes=(1, 3), against={"b": -1.0})],'
    )
    (tmp_path / "study.py").write_text(text, "utf-8")
    made = tolalloc("export-problem", tmp_path / "study.py", "--out", tmp_path / "problem", "--rows", 200)
    assert made.returncode == 0, made.stderr
    page = (tmp_path / "problem" / "README.md").read_text("utf-8")
    assert "Not in these files: parts chosen at assembly and what choosing costs." in page

    assert read(tmp_path / "problem" / "nominals.csv")[1] == [["a", "10.0"], ["b", "2.0"]]
    assert [row[-1] for row in read(tmp_path / "problem" / "limits.csv")[1]] == ["0.9973"]


@pytest.mark.parametrize(("text", "points"), [(LINEAR, 4000), (OWN.replace("upper=0.2,", "upper=0.12,"), 3000)])
def test_the_points_give_the_expected_yield_and_the_function_gives_the_points(tmp_path, text, points):
    (tmp_path / "study.py").write_text(text, "utf-8")
    folder = tmp_path / "problem"
    made = tolalloc("export-problem", tmp_path / "study.py", "--out", folder, "--rows", points)
    assert made.returncode == 0, made.stderr
    head, rows = read(folder / "points.csv")
    data = dict(zip(head, np.array(rows, float).T, strict=True))
    assert not data["status"].any()
    share, (stated, units) = share_within(folder, data), expected(folder)
    assert units == len(rows) == points
    assert abs(share - stated) < 3 * sqrt(2 * stated * (1 - stated) / points)
    page = (folder / "README.md").read_text("utf-8")
    assert {path.name for path in folder.iterdir()} == {"README.md", *(name for name in NAMES if f"`{name}`" in page)}
    own = runpy.run_path(str(folder / "model.py"))  # the file of the function, with its nominal sizes
    if text is LINEAR:
        found = own["gap"](10.0 + data["a [µm]"] / 1000, 2.0 + data["b [µm]"] / 1000)
        assert np.abs(found - data["gap [mm]"]).max() < 1e-12
        (_, constant, *factors), *_ = read(folder / "linear.csv")[1]
        assert [float(own) for own in (constant, *factors)] == pytest.approx([1.0, 5e-4, -2e-3])
    else:
        assert read(folder / "settings.csv")[1] == [["press", "0.2", "0.0", "1.0"]]
        assert [row[0] for row in read(folder / "linear.csv")[1]] == ["gap [mm]"]  # the seat has a square


NAMES = tuple(f"{name}.csv" for name in ("tolerances", "limits", "settings", "nominals", "costs", "points", "linear"))
NAMES += ("model.py", "expected.json")


@pytest.mark.slow
def test_the_answer_of_a_run_is_added(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.py").write_text(LINEAR + "\nstudy = study.with_effort('quick')\n", "utf-8")
    place = tmp_path / "problem"
    study = load_study(tmp_path / "study.py")
    study.run()
    said = export_problem(study, place, 100, SILENT)
    assert said in (place / "README.md").read_text("utf-8")
    found = json.loads((place / "expected.json").read_text("utf-8"))
    assert found["allocation"]["met"]
    answer = json.loads((tmp_path / "runs" / "linear" / "summary.json").read_text("utf-8"))["allocation"]
    assert found["allocation"]["cost [cost units]"] == answer["cost [cost units]"] > 2.0  # today's drawing is too wide
    assert found["cost of today's drawing [cost units]"] == pytest.approx(2.0)


@pytest.mark.slow
def test_a_reducer_is_written_as_points(tmp_path):
    done = tolalloc("export-problem", "studies/rv20e_allocation.py", "--out", tmp_path / "problem", "--rows", 40)
    assert done.returncode == 0, done.stderr
    head, rows = read(tmp_path / "problem" / "points.csv")
    assert len(rows) == 40
    assert "crank1.tilt.x [µrad]" in head
    assert "pin.diameter [µm]" in head
    assert not (tmp_path / "problem" / "model.py").exists()


def test_a_folder_that_holds_something_and_too_few_rows_are_refused(tmp_path):
    (tmp_path / "study.py").write_text(LINEAR, "utf-8")
    refused(tolalloc("export-problem", tmp_path / "study.py", "--out", tmp_path), "not empty")
    few = tolalloc("export-problem", tmp_path / "study.py", "--out", tmp_path / "new", "--rows", 5)
    refused(few, "--rows is 5; allowed is a whole number from 10")
    assert not (tmp_path / "new").exists()
