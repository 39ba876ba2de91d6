"""``tolalloc allocate`` as a user meets it: drawing, files, limits out of reach, interruption, and what it refuses."""

from __future__ import annotations

import json
import math
import re
import subprocess
from pathlib import Path

import pandas as pd
import pytest
from openpyxl import load_workbook

from tests.builders import FEW, few_sources, numbers_of, page_of, refusal, says, summary_of, telling, wording
from tests.studies.command import ROOT, process, refused, tolalloc
from tolalloc.allocation.cost.process_costs import load_process_costs
from tolalloc.cli.run import allocate
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.exceptions import TolallocError
from tolalloc.reports.wording import with_unit

PROCESSES = """sources,process,model,fixed [cost units],factor,min [µm],max [µm],note
housing.pitch,ground,reciprocal,,,,,today
housing.pitch,broached,reciprocal,0.8,25,22,,wide zones only
"""
PRICED = """sources,process,model,fixed [cost units],factor,change [cost units],note
housing.pitch,ground,reciprocal,,,,today
housing.pitch,broached,reciprocal,0.8,5,{change},another machine
"""
SMALL = """AllocationEffort(
        verification_units=128, confirmation_units=512, shared_units=16, graded_steps=2,
        setting_steps=(2, 2), price_nodes=4, stiffness_units=128, share_blocks=8,
        yields=(0.9, 0.95), front_limits=(0.95, 1.1), front_units=128, front_steps=1, search=SearchEffort(steps=2))"""
STUDY = """import tolalloc as ta
from tolalloc.allocation.space.effort import AllocationEffort
from tolalloc.allocation.space.effort import SearchEffort

MOST = ta.AtYield(target=0.95)
study = ta.Study(
    ta.reducer("rv20e_liu2020", neglected=("*",), flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0){reducer}),
    ta.drawing("few.csv"{drawing}),
    limits={{ta.PEAK_TO_PEAK: ta.Limit({first}){others}}},
    questions=(ta.Allocation({asked}),),
    name="drawn",
    effort={effort},
)
"""
LOST = "ta.LOST_MOTION"


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    return tolalloc("allocate", *arguments, COLUMNS="100")


def run_with_threads(threads: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run it in a process of its own."""
    return process("allocate", *arguments, NUMBA_NUM_THREADS=str(threads))


def script_with(path: Path, effort: str = f"ta.Effort(allocation={SMALL})", **texts: str) -> Path:
    """Write a study of few sources, one of which can be made in two ways, with texts at the named places."""
    few_sources(path)
    (path / "costs.csv").write_text(PROCESSES, encoding="utf-8")
    given = {"first": "upper=50.0, show=MOST", "others": "", "reducer": "", "drawing": "", "asked": "", **texts}
    (path / "study.py").write_text(STUDY.format(effort=effort, **given), encoding="utf-8")
    return path / "study.py"


@pytest.fixture(scope="module")
def allocated(tmp_path_factory) -> tuple[Path, str]:
    path = tmp_path_factory.mktemp("allocate")
    script = script_with(
        path,
        effort="ta.Effort()",
        drawing=", costs='costs.csv'",
        asked="unit_price=ta.UnitPrice(inspection=0.1, scrap=5.0)",
        reducer=", stiffness='rv20e_table6'",
    )
    result = run(script, "--quick", "--grades", "--seed", 0, "--out", path / "report")
    assert result.returncode == 0, result.stderr
    return path / "report", result.stdout + result.stderr


@pytest.mark.slow
def test_an_allocation_is_compared_with_itself(allocated):
    folder, _ = allocated
    result = tolalloc("compare", folder, folder, "--json")
    assert result.returncode == 0, result.stderr
    assert "housing.pitch" in result.stdout


@pytest.mark.slow
def test_the_report_is_complete(allocated):
    folder, said = allocated
    assert {path.name for path in folder.iterdir()} == {
        "report.html",
        "results.xlsx",
        "summary.json",
        "manifest.json",
        "figures",
        "tables",
        "allocation.csv",
        "drawing.xlsx",
        "frames.dxf",
        "inspection.dfd",
    }
    page = page_of(folder)
    for key in ("today", "risks", "dimensions", "requirements", "optimality", "good_unit", "robustness", "work"):
        assert wording(f"allocation.heading_{key}") in page
    assert wording("allocation.heading_trade", word="Modification") in page
    assert "<script src" not in page
    book = load_workbook(folder / "results.xlsx")
    assert book.sheetnames[:3] == ["answer", "contents", "charts"]
    histogram, effects = book["charts"]._charts[:2]
    assert len(histogram.series) == 2 == len(effects.series)
    for stage in ("tolerances alone", "with modification", "grades", "modification trade", "front", "robustness"):
        assert stage in said
    assert "units/s" in said


@pytest.mark.slow
def test_the_answer_reads_well(allocated):
    _, said = allocated
    met = f"{wording('allocation.verdict_met_quick')}: "
    assert "-0.0" not in said
    assert "nan" not in said
    lines = said.splitlines()
    (top,) = (at for at, line in enumerate(lines) if line.startswith("drawing "))
    rows = [re.split(r"  +", line)[0] for line in lines[top + 2 :]]
    assert rows[0].startswith("cost [")
    assert rows[1] == "peak-to-peak [arcsec]"
    (first,) = (at for at, line in enumerate(lines) if line.startswith(met))
    last = next(at for at, line in enumerate(lines) if at > first and re.search(r": (done|so far), ", line))
    assert last - first <= 24, "a screen holds all of it, and the path of the report"
    assert lines[-1].startswith("Report: ")
    assert "disc run-out" not in said, "the drawing itself stands in the report"


@pytest.mark.slow
def test_the_answer_for_programs_is_finite(allocated):
    folder, _ = allocated
    answer = summary_of(folder)["allocation"]
    assert answer["seed"] == 0
    assert answer["met"] is True
    assert answer["blocking requirement"] is None
    assert all(math.isfinite(number) for number in numbers_of(answer))
    assert answer["lower bound [cost units]"] <= answer["cost [cost units]"]
    assert {row["source"] for row in answer["drawing"]} == set(FEW)
    with_unit = [name for name, value in answer.items() if isinstance(value, float)]
    assert all(name.endswith("]") for name in with_unit)


@pytest.mark.slow
def test_the_drawing_is_read_back_and_carries_grades(allocated):
    folder, _ = allocated
    sources = {source.name: source for source in load_tolerance_table(folder / "allocation.csv")}
    assert set(sources) == set(FEW)
    assert sources["pin.diameter"].grade.startswith("IT")
    assert sources["disc1.pitch"].zone == sources["disc2.pitch"].zone


@pytest.mark.slow
@pytest.mark.parametrize("change", [0.0, 0.5])
def test_the_cost_is_one_number_in_summary_drawing_and_table(tmp_path, change):
    """All are read back from the files, with what is paid once, to leave today's process."""
    script = script_with(
        tmp_path, drawing=", costs='priced.csv'", asked="fixed_first=False, front=False, what_if=False"
    )
    (tmp_path / "priced.csv").write_text(PRICED.format(change=change), encoding="utf-8")
    folder = tmp_path / "report"
    result = tolalloc("run", script, "--only", "allocation", "--out", folder)
    assert result.returncode == 0, result.stderr
    answer = summary_of(folder)["allocation"]
    cost, header = answer["cost [cost units]"], "cost [cost units]"
    assert pd.read_excel(folder / "drawing.xlsx", sheet_name="drawing")[header].sum() == pytest.approx(cost, rel=1e-9)
    assert pd.read_csv(folder / "tables" / "drawing.csv")[header].sum() == pytest.approx(cost, rel=1e-9)
    assert sum(row[header] for row in answer["drawing"]) == pytest.approx(cost, rel=1e-9)
    table = {source.name: source for source in load_tolerance_table(folder / "allocation.csv")}
    assert sum(source.cost for source in table.values()) == pytest.approx(cost, rel=1e-9)
    assert table["housing.pitch"].process == "broached"
    before = load_tolerance_table(tmp_path / "few.csv")
    assert sum(own.cost * own.zone / table[own.name].zone for own in before) != pytest.approx(cost, rel=0.05)


@pytest.mark.slow
def test_every_header_of_the_tables_has_a_unit(allocated):
    folder, _ = allocated
    for path in (folder / "tables").iterdir():
        frame = pd.read_csv(path)
        if path.stem == "today and as drawn":  # a row has the unit
            assert frame[frame["as drawn"].notna()]["drawing"].str.endswith("]").all()
            continue
        missing = [name for name in frame.select_dtypes("number") if "[" not in name]
        assert missing == [] or path.stem == "tolerances", (path.stem, missing)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("texts", "blocking", "unit"),
    [
        (
            {"first": "upper=5.0, show=MOST", "asked": "unit_price=ta.UnitPrice(scrap=5.0)"},
            "peak-to-peak transmission error [arcsec]",
            "arcsec",
        ),
        pytest.param(
            {
                "others": f", {LOST}: ta.Limit(upper=0.01, show=MOST)",
                "asked": "grades=True, unit_price=ta.UnitPrice(scrap=5.0)",
            },
            "lost motion [arcmin]",
            "arcmin",
        ),
    ],
)
def test_a_limit_out_of_reach_has_an_answer_with_what_blocks_and_by_how_much(tmp_path, texts, blocking, unit):
    result = run(script_with(tmp_path, **texts), "--json", "--out", tmp_path / "report")
    assert result.returncode == 0, result.stderr
    answer = json.loads(result.stdout)["allocation"]
    assert answer["met"] is False
    assert answer["blocking requirement"] == blocking
    beyond = answer[f"beyond its limit by [{unit}]"]
    assert beyond > 0
    said = telling(answer["warnings"], "allocation.not_verified")
    assert f"{with_unit(f'{beyond:.3g}', blocking)} beyond" in said
    assert all(math.isfinite(number) for number in numbers_of(answer))
    page = page_of(tmp_path / "report")
    assert not says(page, "allocation.price")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"yield_target": 2.0}, ["target is 2.0", "a share from 0.5 to below 1"]),
        ({"limit": math.nan}, ["limit", "nan", "finite"]),
        ({"seed": -1}, ["seed is -1", "0 or a positive integer"]),
        ({"out": ROOT / "docs"}, ["docs", "not empty", "nothing is overwritten"]),
    ],
)
def test_bad_options_are_refused_in_one_sentence(tmp_path, options, words):
    refused_here({"script": script_with(tmp_path), "out": tmp_path / "report", **options}, *words)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (
            {"others": ", 'lost motoin [arcmin]': ta.Limit(upper=1.0)"},
            ["unknown output", "lost motion [arcmin]"],
        ),
        ({"others": f", {LOST}: ta.Limit(upper=1.0, show=ta.AtCpk(target=0.0))"}, ["target is 0.0", "above 0"]),
        ({"others": f", {LOST}: ta.Limit(upper=1.0, show=1.33)"}, ["show", "1.33", "AtCpk"]),
        ({"others": f", {LOST}: 1.0"}, ["limits['lost motion [arcmin]'] is 1.0", "Limit(...)"]),
        ({"others": f", {LOST}: ta.Limit(upper=float('inf'))"}, ["limit", "inf", "finite"]),
        ({"others": f", {LOST}: ta.Limit(lower=2.0, upper=1.0)"}, ["limit: upper is 1.0", "above the lower one"]),
        (
            {"others": f", {LOST}: ta.Limit(upper=1.0, show=ta.AtYield(target=0.999))"},
            ["effort.allocation.confirmation_units for lost motion", "512", "3282 or more"],
        ),
        (
            {"first": "upper=50.0, show=ta.AtYield(target=0.999)"},
            ["effort.allocation.confirmation_units for peak-to-peak", "512", "3282 or more"],
        ),
        ({"asked": "unit_price=ta.UnitPrice(inspection=-1.0)"}, ["inspection is -1.0", "0 or above"]),
        ({"asked": "unit_price=5.0"}, ["unit_price is 5.0", "UnitPrice"]),
        ({"drawing": ", costs='rv20f'"}, ["rv20f", "rv20e"]),
    ],
)
def test_bad_fields_are_refused_in_one_sentence(tmp_path, texts, words):
    refused_here({"script": script_with(tmp_path, **texts), "out": tmp_path / "report"}, *words)


@pytest.mark.parametrize(
    ("effort", "words"),
    [
        ("graded_steps=0", ["allocation.graded_steps is 0", "1 or more"]),
        ("share_blocks=100", ["allocation.share_blocks is 100", "power of two"]),
        ("yields=()", ["allocation.yields is ()", "between 0 and 1"]),
        ("yields=(0.9, 1.0)", ["allocation.yields is (0.9, 1.0)"]),
        ("shared_units=0", ["effort.allocation.shared_units is 0", "2 or more"]),
        ("search=SearchEffort(steps=0)", ["search.steps is 0", "1 or more"]),
        ("search=SearchEffort(reach=1.0)", ["search.reach is 1.0", "above 1"]),
        ("front_steps=0", ["front_steps is 0", "1 or more"]),
        ("front_limits=(0.9, 3.0)", ["front_limits is (0.9, 3.0)", "between 0.5 and 2"]),
    ],
)
def test_an_effort_that_makes_no_sense_is_refused(tmp_path, effort, words):
    refused_here(
        {
            "script": script_with(tmp_path, effort=f"ta.Effort(allocation=AllocationEffort({effort}))"),
            "out": tmp_path / "report",
        },
        *words,
    )


@pytest.mark.slow
def test_an_effort_that_is_no_whole_number_is_refused(tmp_path):
    """In a process of its own: here the check of annotations would refuse it first."""
    script = script_with(tmp_path, effort="ta.Effort(allocation=AllocationEffort(front_steps=2.5))")
    refused(process("check", script), "allocation.front_steps is 2.5", "whole number")


@pytest.mark.parametrize(
    ("columns", "options", "words"),
    [
        ({"locked": "yes"}, {}, ["every zone is locked"]),
        ({"min [unit]": "30", "max [unit]": "20"}, {}, ["row 2", "min 30", "max 20"]),
        (
            {"min [unit]": "0.1", "max [unit]": "0.2", "plus [unit]": "0.15", "minus [unit]": "0"},
            {"grades": True},
            ["pin.diameter", "(0.1, 0.2)", "IT01"],
        ),
    ],
)
def test_zones_that_cannot_be_had_are_refused(tmp_path, columns, options, words):
    script = script_with(tmp_path)
    few_sources(tmp_path, **columns)
    refused_here({"script": script, "out": tmp_path / "report", **options}, *words)


def refused_here(options: dict[str, object], *words: str) -> None:
    """Nothing is made, and the reason is one sentence for every fault, with these words."""
    defaults = {"limit": None, "yield_target": None, "grades": False, "seed": None}
    with pytest.raises(TolallocError) as caught:
        allocate(**{**defaults, **options})
    said = str(caught.value)
    assert all(sentence.endswith(".") for sentence in said.split("\n"))
    for word in words:
        assert word in said
    assert not (Path(str(options["script"])).parent / "report").exists()


ROW = "housing.pitch,ground,reciprocal,0,,,,x\n"
HEAD = PROCESSES.splitlines()[0] + "\n"
POINTED = "sources,process,model,points,note\nhousing.pitch,ground,tabulated,shop.csv,x\n"
SHOP = "process,tolerance,unit,cost\n"


@pytest.mark.parametrize(
    ("table", "shop", "words"),
    [
        (HEAD, None, ["no rows"]),
        ("", None, ["no rows"]),
        (HEAD + ROW.replace("housing.pitch", "gear*"), None, ["row 2", "gear*", "carrier", "known"]),
        (HEAD + ROW.replace(",x", ","), None, ["row 2", "note is missing"]),
        (HEAD + ROW + ROW, None, ["row 3", "'ground'", "second time"]),
        (HEAD.replace("min [µm]", "min [mm]") + ROW, None, ["column min is 'mm'", "µm"]),
        (HEAD.replace("factor", "fixed") + ROW, None, ["'fixed' is there twice"]),
        (HEAD.replace("process,model", "model,process") + ROW, None, ["model is 'ground'", "reciprocal"]),
        (HEAD + "housing.pitch,ground,reciprocal,0,,9,5,x\n", None, ["min must not be above max", "9, 5"]),
        (HEAD + "housing.pitch,ground,reciprocal,0,,150,190,x\n", None, ["no process can hold", "housing.pitch"]),
        (HEAD + "housing.pitch,ground,reciprocal,0,-3,,,x\n", None, ["factor is -3.0", "greater than or equal to"]),
        (POINTED, None, ["row 2", "points shop.csv", "CSV file in"]),
        (POINTED, SHOP + "ground,10,µm,2\nground,20,µm,3\n", ["shop.csv", "costs that fall"]),
        (POINTED, SHOP + "ground,10,cubit,3\nground,20,µm,2\n", ["unit is 'cubit'", "mm"]),
        (POINTED, SHOP + "ground,10,µm,3\n", ["two zones or more"]),
        (POINTED, SHOP + "milled,10,µm,3\nmilled,20,µm,2\n", ["row 2", "'ground'", "milled"]),
    ],
)
def test_process_cost_tables_are_refused_in_one_sentence(tmp_path, table, shop, words):
    sources = load_tolerance_table("rv20e_table4")
    (tmp_path / "costs.csv").write_text(table, encoding="utf-8")
    if shop:
        (tmp_path / "shop.csv").write_text(shop, encoding="utf-8")
    said = refusal(lambda path: load_process_costs(path, sources), tmp_path / "costs.csv")
    assert said.endswith(".")
    for word in words:
        assert word in said


def test_a_table_saved_by_a_spreadsheet_is_read(tmp_path):
    text = (HEAD + ROW).replace(",", ";")
    (tmp_path / "costs.csv").write_text(text, encoding="utf-8-sig")
    found = load_process_costs(tmp_path / "costs.csv", load_tolerance_table("rv20e_table4"))
    assert [process.name for process in found["housing.pitch"]] == ["ground"]


def test_the_shell_sees_one_sentence_and_exit_code_2(tmp_path):
    result = run(script_with(tmp_path), "--yield", 2, "--out", tmp_path / "report")
    assert result.returncode == 2
    assert result.stderr == (
        "Error: guarantee AtYield: target is 2.0; allowed is a share from 0.5 to below 1, such as 0.9973.\n"
    )
    assert result.stdout == ""
