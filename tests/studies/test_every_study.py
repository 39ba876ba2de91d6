"""Every study that is shipped runs, quickly, from its script to its report."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from fnmatch import fnmatchcase
from pathlib import Path

import pandas as pd
import pytest

import tolalloc as ta
from tests.golden.cases import PUSHED, SHIPPED, UNRECORDED, shipped
from tests.golden.record import recorded
from tests.studies.command import ROOT, process, refused
from tests.studies.paper import can_print, lost
from tests.studies.test_golden import require_golden
from tolalloc.drawings.table_file import DATA
from tolalloc.reports import pdf

STUDIES = sorted((ROOT / "studies").glob("*.py"))


SECTIONED = (
    "li2018_modification",
    "published_benchmarks",
    "rv20e_speeds",
    "song2019_modification",
    "xi2015_contact",
    "xi2015_virtual_prototype",
    "zhang2025_assembly",
)
"""Studies that make one report of three sections or more, in whose summary no text is empty of a number either."""


def _no_number(constant):
    raise AssertionError(f"{constant} is no number")


def _liu2020_identification(result: subprocess.CompletedProcess[str], folder: Path) -> None:
    """Printed pairs, three seeds of every method, ten repetitions."""
    said = " ".join(result.stdout.split())
    assert "A constant explains the printed residual better than any stiffness" in said
    assert "K_b is not identified by these data" in said
    answer = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert answer["within three standard errors [-]"] >= 9
    methods = {item["method"]: item for item in answer["peak-to-peaks"]["methods"]}
    best = {name: min(item["objectives [-]"]) for name, item in methods.items()}
    assert max(best.values()) <= (1 + 1e-4) ** 2 * min(best.values())
    swarm, exact = (methods[name]["evaluations [-]"] for name in ("improved particle swarm", "Gauss–Newton"))
    assert max(exact) <= min(swarm) / 20


def _xi2015_contact(_: subprocess.CompletedProcess[str], folder: Path) -> None:
    """A second run into the same folder is refused."""
    again = process("run", ROOT / "studies" / "xi2015_contact.py", "--quick", "--out", folder)
    refused(again, "not empty")


def _gap_inspection(_: subprocess.CompletedProcess[str], folder: Path) -> None:
    """The plan has a line for each part, and the ring keeps the smallest zone that its gauge allows."""
    plan = pd.read_excel(folder / "drawing.xlsx", sheet_name="inspection plan", header=None).to_string()
    assert all(part in plan for part in ("housing", "ring", "bearing", "shoulder"))
    assert "Cp ≥ 1.33" in plan
    assert ta.drawing(folder / "allocation.csv").sources[1].zone == pytest.approx(10 * 3e-6)


def _rv20e_lot(_: subprocess.CompletedProcess[str], folder: Path) -> None:
    """The pins alone moved, and the drawing of the lot says so."""
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8"))["lot"]["moved"] == ["pin.diameter"]
    shifts = {own.name: own.shift for own in ta.drawing(folder / "lot.tolerances.csv").sources}
    assert max(shifts, key=shifts.__getitem__) == "pin.diameter"


def _rv20e_processes(_: subprocess.CompletedProcess[str], folder: Path) -> None:
    """No zone is smaller than its step makes, and some line takes its further one."""
    drawn = ta.drawing(folder / "allocation.csv").sources
    assert any(" and " in own.process for own in drawn)
    held = pd.read_csv(DATA / "rv20e_drawing.process_costs.csv", comment="#")
    for own in drawn:
        mine = held[held["sources"].map(lambda pattern, name=own.name: fnmatchcase(name, pattern))]
        (least,) = mine[mine["process"] == own.process]["min [µm]"]
        assert own.zone >= least * 1e-6 * (1 - 1e-9)


FINDS = {
    "bores_lower_bound": "No drawing with free zones that costs less than",
    "cd29_ranking": "1. shaft assembly takes part in",
    "rv20e_duty": "load case start uses up",
    "rv20e_load_cases": "Drivers of no-load friction torque, warm",
    "rv20e_wear": "Which dimension of the drawing drives the lost motion, 3000 h",
    "rv27c_ranking": "1. disc pitch takes part in",
    "shimmed_bearing": "3 sizes of washer",
    "sorted_pins": "4 classes of pin",
}
"""Study → what its report says of the feature that it shows."""
SAYS: dict[str, Callable[[subprocess.CompletedProcess[str], Path], None]] = {
    "liu2020_identification": _liu2020_identification,
    "xi2015_contact": _xi2015_contact,
    "gap_inspection": _gap_inspection,
    "rv20e_lot": _rv20e_lot,
    "rv20e_processes": _rv20e_processes,
}
"""What the answer of a study says, where that is more than a complete report."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "script",
    [pytest.param(own, marks=pytest.mark.push if own.stem in PUSHED else (), id=own.stem) for own in STUDIES],
)
def test_a_study_runs_and_writes_its_report(script, tmp_path):
    def look(result: subprocess.CompletedProcess[str], made: Path) -> None:
        folder = made / "run"
        assert result.returncode == 0, result.stderr
        page = (folder / "report.html").read_text(encoding="utf-8")
        assert page
        assert FINDS.get(script.stem, "") in page
        papers = pdf.PAPERS if script.stem == "rv20e_allocation" else pdf.PAPERS[:1]
        for paper in papers if can_print() else ():
            assert not lost(folder / "report.html", tmp_path, paper)
        summary = (folder / "summary.json").read_text(encoding="utf-8")
        assert page.count("<h2>") >= (3 if script.stem in SECTIONED else 0)
        assert script.stem not in SECTIONED or "nan" not in summary.lower()
        json.loads(summary, parse_constant=_no_number)
        if script.stem in SAYS:
            SAYS[script.stem](result, folder)

    if script.stem in UNRECORDED:
        recorded(shipped(script.stem), process, look)
    else:
        require_golden(SHIPPED.format(script.stem), process, look)
