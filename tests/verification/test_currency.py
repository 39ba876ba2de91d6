"""Costs of a user's files in a currency: everything for people says it, and programs find the names they know."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

import tolalloc as ta
from tests.builders import page_of, study_of_lengths, summary_of, written
from tests.verification.test_own_words import ROWS
from tolalloc.cli.main import app
from tolalloc.drawings.tolerance_table import table_text
from tolalloc.exceptions import InputError
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.feature_frame import FeatureFrame, Frames
from tolalloc.reports.finished_run import read_run
from tolalloc.reports.header import Header
from tolalloc.study.prepared import Prepared
from tolalloc.study.study import run

PROCESSES = "sources,process,model,fixed [{0}],factor [{0} µm^n],min [µm],max [µm],note\n{1}"
TURNED = "*,turned,reciprocal,0.5,40,5,200,x\n*,ground,reciprocal,1.5,25,5,60,x\n"


def table(folder: Path, unit: str) -> Path:
    text = table_text(ta.Drawing.of_rows(ROWS).sources, folder)
    return written(folder / "zones.csv", text.replace("[cost units]", f"[{unit}]"))


def study(drawing: ta.Drawing) -> ta.Study:
    return study_of_lengths(drawing, questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    here = tmp_path_factory.mktemp("euros")
    (here / "made.csv").write_text(PROCESSES.format("EUR", TURNED), encoding="utf-8")
    asked = study(ta.drawing(table(here, "EUR"), costs=here / "made.csv"))
    return run(asked, here / "run").folder


@pytest.mark.slow
def test_every_file_for_people_says_it_and_none_says_cost_units(folder):
    texts = [path.read_text(encoding="utf-8") for path in folder.rglob("*") if path.suffix in (".html", ".csv")]
    for book in folder.glob("*.xlsx"):
        texts += [frame.to_csv() for frame in pd.read_excel(book, sheet_name=None, header=None, dtype=str).values()]
    assert len(texts) > 20
    assert not [text for text in texts if "cost unit" in text]
    page = page_of(folder)
    assert " EUR" in page
    assert "cost [EUR]" in page


@pytest.mark.slow
def test_programs_find_the_names_that_every_run_has(folder):
    found = read_run(folder)
    summary = summary_of(folder)
    assert summary["allocation"]["cost [cost units]"] == pytest.approx(found.zones["cost [cost units]"].sum(), rel=1e-9)
    assert found.currency == "EUR"


@pytest.mark.slow
def test_a_drawing_goes_on_in_its_currency(folder, tmp_path):
    again = ta.drawing(folder / "allocation.csv")
    assert again.currency == "EUR"
    assert ta.drawing(again.to_csv(tmp_path / "again.csv")).currency == "EUR"
    assert "cost [EUR]" in again.to_frame().columns


@pytest.mark.slow
def test_two_runs_are_compared_in_their_currency_or_told_apart(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "other")
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    (tmp_path / "other" / "manifest.json").write_text(json.dumps({**manifest, "currency": "USD"}), encoding="utf-8")
    alike = ta.compare(folder, folder)
    assert " EUR." in "".join(alike.sentences)
    assert "cost [EUR]" in set(alike.tables["answers"]["quantity"])
    assert "cost [cost units]" in {row["quantity"] for row in alike.summary["answers"]}
    apart = "The costs of A are in EUR and those of B in USD; they cannot be compared."
    assert apart in ta.compare(folder, tmp_path / "other").warnings


def test_two_currencies_are_refused(tmp_path):
    (tmp_path / "made.csv").write_text(PROCESSES.format("USD", TURNED), encoding="utf-8")
    asked = study(ta.drawing(table(tmp_path, "EUR"), costs=tmp_path / "made.csv"))
    with pytest.raises(InputError, match=r"made\.csv: currency is 'USD'; allowed is EUR as in the tolerance table\.$"):
        _ = Prepared(study=asked).header
    (tmp_path / "made.csv").write_text(
        PROCESSES.format("EUR", TURNED).replace("factor [EUR", "factor [USD"), encoding="utf-8"
    )
    asked = study(ta.drawing(table(tmp_path, "EUR"), costs=tmp_path / "made.csv"))
    with pytest.raises(InputError, match="the currency of column factor is 'USD'; allowed is EUR as in the columns"):
        _ = Prepared(study=asked).space


def test_rows_of_python_have_a_currency_too():
    assert Prepared(study=study(ta.Drawing.of_rows(ROWS, currency="€"))).header.currency == "€"
    with pytest.raises(InputError, match="currency is 'euros'; allowed is three letters such as EUR"):
        ta.Drawing.of_rows(ROWS, currency="euros")


@pytest.mark.slow
def test_an_answer_tells_costs_in_its_currency():
    answer = study(ta.Drawing.of_rows(ROWS, currency="CHF")).allocate()
    assert "CHF" in str(answer)
    assert "CHF" in answer._repr_html_()
    assert "cost unit" not in str(answer) + "".join(answer.tables["dimensions"].columns)


def test_without_one_nothing_changes():
    assert Header(name="a", model="b").currency == ""
    assert Prepared(study=study(ta.Drawing.of_rows(ROWS))).header.currency == ""


def test_prices_of_a_shop_are_fitted_in_their_currency(tmp_path):
    shop = tmp_path / "shop.csv"
    rows = "".join(f"turned,{zone},µm,{2 + 50 / zone}\n" for zone in (5, 10, 20, 50, 100))
    shop.write_text(f"process,tolerance [unit],unit,cost [CHF]\n{rows}", encoding="utf-8")
    said = CliRunner().invoke(app, ["costs", str(shop)], env={"COLUMNS": "200"})
    assert said.exit_code == 0
    assert "[CHF]" in said.output.replace("\n", "")
    assert "cost units" not in said.output


def test_a_frame_stays_a_frame_in_a_currency():
    frames = Frames([FeatureFrame("position", "⌀0.0047", ("A",))])
    columns = (Column(header="cost [{cost}]", value=lambda _: 1.0), Column(header="write [mm]", value=lambda _: frames))
    found = Table(name="frames", columns=columns, rows=[0]).frame("EUR")
    assert list(found.columns) == ["cost [EUR]", "write [mm]"]
    assert str(found["write [mm]"][0]) == "⌖ ⌀0.0047 A"
