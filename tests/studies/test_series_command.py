"""``tolalloc series``: many studies in one table, what is finished not run again, what fails told beside the rest."""

from __future__ import annotations

import json

import pytest

from tests.builders import written
from tests.studies.command import answer_of, refused, tolalloc

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
    return written(folder / f"{name}_study.py", STUDY.format(name=name, half=half, function=function))


@pytest.mark.slow
def test_a_series_is_one_table_and_is_not_run_twice(tmp_path):
    wide, tight = script(tmp_path, "wide"), script(tmp_path, "tight", half=0.02)
    broken = script(tmp_path, "broken", function="lambda housing, shaft: float('nan')")
    answered = answer_of("series", wide, tight, broken, "--out", tmp_path / "runs")
    rows = {row["study"]: row for row in answered["studies"]}
    assert list(rows) == ["wide", "tight", "broken"]
    assert rows["wide"]["answer"] == rows["tight"]["answer"] == "met"
    assert rows["tight"]["cost [cost units]"] > 1.3 * rows["wide"]["cost [cost units]"]
    assert rows["broken"]["answer"].startswith("not run: ")
    assert not (tmp_path / "runs" / "broken").exists()
    saved = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("summary.json")}
    second = tolalloc("series", wide, tight, "--out", tmp_path / "runs", "--json")
    assert json.loads(second.stdout)["studies"] == [rows["wide"], rows["tight"]]
    assert saved == {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("summary.json")}


@pytest.mark.slow
def test_a_folder_of_another_study_is_not_taken_for_an_answer_nor_overwritten(tmp_path):
    found = tolalloc("series", script(tmp_path, "wide", half=0.03), "--out", tmp_path / "runs")
    assert found.returncode == 0
    kept = (tmp_path / "runs" / "wide" / "summary.json").read_bytes()
    other = tolalloc("series", script(tmp_path, "wide", half=0.025), "--out", tmp_path / "runs", "--json")
    (row,) = json.loads(other.stdout)["studies"]
    assert (row["answer"], row["folder"]) == ("met", "wide-2")
    assert (tmp_path / "runs" / "wide" / "summary.json").read_bytes() == kept


def test_two_studies_of_one_name_are_refused(tmp_path):
    one = script(tmp_path, "same")
    refused(tolalloc("series", one, one, "--out", tmp_path / "runs"), "2 studies are named 'same'")


HELPED = """
import tolalloc as ta
from helper import scale
import numpy as np

zone = {{"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.002, "max": 0.1, "cost": 1}}
study = ta.Study(
    ta.model(lambda housing, shaft: scale(housing - shaft), inputs=("housing", "shaft"), outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{{"id": "housing", "nominal": 30.1, **zone}}, {{"id": "shaft", "nominal": 30.0, **zone}}]),
    limits={{"gap [mm]": ta.Limit(lower=0.07, upper=0.13)}},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="{name}",
    effort="quick",
)
"""


def helped(folder, name, helper):
    """Write a study whose function calls a helper module beside it, in a folder of its own."""
    folder.mkdir(exist_ok=True)
    (folder / "helper.py").write_text(helper, encoding="utf-8")
    path = folder / "design.py"
    path.write_text(HELPED.format(name=name), encoding="utf-8")
    return path


def scaled(by):
    return f"def scale(gap):\n    return 0.1 + {by} * (gap - 0.1)\n"


def costs_of(*arguments):
    studies = answer_of("series", *arguments)["studies"]
    return {row["study"]: (row["cost [cost units]"], row["folder"]) for row in studies}


@pytest.mark.slow
@pytest.mark.parametrize(
    "second",
    [
        scaled(2.0),
        "from numbers_of_it import K\ndef scale(gap):\n    return 0.1 + K * (gap - 0.1)\n",
        "import kit.inner\ndef scale(gap):\n    return kit.inner.scale(gap)\n",
        "def scale(gap):\n    import numbers_of_it\n    return 0.1 + numbers_of_it.K * (gap - 0.1)\n",
        "import json\nK = json.load(open(__file__.replace('helper.py', 'k.json')))\n"
        "def scale(gap):\n    return 0.1 + K * (gap - 0.1)\n",
    ],
    ids=["function", "number", "package", "import when called", "file beside it"],
)
def test_each_study_of_a_series_has_its_own_modules(tmp_path, second):
    """The scale doubles what two equal sizes do, so their zones are halved: twice the cost."""
    one, two = helped(tmp_path / "a", "one", scaled(1.0)), helped(tmp_path / "b", "two", second)
    for folder, factor in (("a", 1.0), ("b", 2.0)):
        (tmp_path / folder / "numbers_of_it.py").write_text(f"K = {factor}\n", encoding="utf-8")
        (tmp_path / folder / "k.json").write_text(f"{factor}", encoding="utf-8")
        kit = tmp_path / folder / "kit"
        kit.mkdir()
        (kit / "__init__.py").write_text("", encoding="utf-8")
        (kit / "inner.py").write_text(scaled(factor), encoding="utf-8")
    found = costs_of(one, two, "--out", tmp_path / "runs")
    assert found["two"][0] == pytest.approx(2 * found["one"][0], rel=0.01)
    turned = costs_of(two, one, "--out", tmp_path / "turned")
    assert {name: cost for name, (cost, _) in turned.items()} == {name: cost for name, (cost, _) in found.items()}


@pytest.mark.slow
def test_a_change_in_a_helper_module_is_run_again_into_the_next_folder(tmp_path):
    out = ("--out", tmp_path / "runs")
    first = costs_of(helped(tmp_path / "a", "one", scaled(1.0)), *out)
    again = costs_of(tmp_path / "a" / "design.py", *out)
    changed = costs_of(helped(tmp_path / "a", "one", scaled(1.5)), *out)
    assert first["one"] == again["one"] == (first["one"][0], "one")
    assert changed["one"] == (pytest.approx(1.5 * first["one"][0], rel=0.01), "one-2")
    back = costs_of(helped(tmp_path / "a", "one", scaled(1.0)), *out)
    assert back["one"] == first["one"]
    afresh = costs_of(tmp_path / "a" / "design.py", *out, "--fresh")
    assert afresh["one"] == (pytest.approx(first["one"][0], rel=1e-12), "one-3")
    assert sorted(path.name for path in (tmp_path / "runs").iterdir() if not path.name.startswith(".")) == [
        *("one", "one-2", "one-3")
    ]


HELD = {
    "DataFrame": "import pandas as pd\nT = pd.DataFrame({{'k': [{0}]}})\ndef k(): return T['k'].iloc[0]\n",
    "dict six deep": "D = dict(a=dict(b=dict(c=dict(d=dict(e=dict(k={0}))))))\n"
    "def k(): return D['a']['b']['c']['d']['e']['k']\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("held", HELD.values(), ids=HELD)
def test_a_constant_that_is_held_in_whatever_is_run_again_when_it_is_edited_and_only_then(tmp_path, held):
    out, calls = ("--out", tmp_path / "runs"), "def scale(gap): return 0.1 + k() * (gap - 0.1)\n"
    first, again, edited = (
        costs_of(helped(tmp_path / "a", "one", held.format(own) + calls), *out)["one"] for own in ("1.0", "1.0", "1.5")
    )
    assert first == again == (first[0], "one")
    assert edited == (pytest.approx(1.5 * first[0], rel=0.01), "one-2")


@pytest.mark.slow
def test_what_reads_a_file_is_run_again_and_says_why(tmp_path):
    kept = tmp_path / "k.txt"
    path = helped(
        tmp_path / "a", "one", f"def scale(gap): return 0.1 + float(open({str(kept)!r}).read()) * (gap - 0.1)"
    )
    said, found = [], []
    for own in ("1.0", "1.0", "1.5"):
        kept.write_text(own)
        series = tolalloc("series", path, "--out", tmp_path / "runs", "--json")
        (row,) = json.loads(series.stdout)["studies"]
        found.append((row["cost [cost units]"], row["folder"]))
        said.append(" ".join(series.stderr.split()))
    cost = found[0][0]
    assert found == [(cost, "one"), (cost, "one-2"), (pytest.approx(1.5 * cost, rel=0.01), "one-3")]
    sentence = (
        "one is run again: whether the model of study one is the same as before is not known: io.open may look at"
    )
    assert [sentence in own for own in said] == [False, True, True]
