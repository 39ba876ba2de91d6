"""A script plays the newcomer: a new folder, three cells changed in Excel, a check, a run.

The whole `run --quick` of such a folder takes minutes, so the effort here is smaller still and the ranking left out.
The golden case ``three`` asks both questions of a folder of three cranks.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from openpyxl import load_workbook

from tests.builders import page_of, summary_of
from tests.studies.command import tolalloc
from tolalloc.drawings.drawing import load_drawing

SMALL = """seed=1,
    effort=ta.Effort(
        allocation=AllocationEffort(
            verification_units=300, confirmation_units=600, shared_units=16, front_limits=(0.9,), front_units=300,
            share_blocks=4, error=0.5,
            search=SearchEffort(steps=2)),
        is_quick=True),
"""
IMPORTS = """from tolalloc.allocation.space.effort import AllocationEffort, SearchEffort

import tolalloc as ta
"""
CELLS = (
    ("disc1.pitch", "plus [unit]", 11),
    ("pin.diameter", "cost [cost units]", 7.5),
    ("housing.runout", "locked", "yes"),
)


def change_cells(path: Path) -> None:
    """Change three cells as a person does in a spreadsheet program."""
    book = load_workbook(path)
    sheet = book.active
    columns = {cell.value: cell.column for cell in sheet[1]}
    rows = {sheet.cell(row=row, column=columns["id"]).value: row for row in range(2, sheet.max_row + 1)}
    for name, column, value in CELLS:
        sheet.cell(row=rows[name], column=columns[column]).value = value
    book.save(path)


@pytest.mark.slow
def test_a_newcomer_comes_from_nothing_to_an_answer(tmp_path):
    place = tmp_path / "mine"
    assert tolalloc("new", place, "--cranks", 2).returncode == 0
    change_cells(place / "zones.xlsx")
    checked = tolalloc("check", place / "study.py")
    assert checked.returncode == 0, checked.stderr
    study = (place / "study.py").read_text(encoding="utf-8")
    asked = "[ta.Ranking(), ta.Allocation()]"
    assert asked in study
    kept = "[ta.Allocation(fixed_first=False, front=False, what_if=False)]"
    study = study.replace("import tolalloc as ta\n", IMPORTS).replace("seed=1,\n", SMALL).replace(asked, kept)
    (place / "study.py").write_text(study.replace("0.9973", "0.9"), encoding="utf-8")
    run = tolalloc("run", place / "study.py", "--out", tmp_path / "run")
    assert run.returncode == 0, run.stderr
    summary = summary_of(tmp_path / "run")
    assert summary["allocation"]["cost [cost units]"] > 0
    assert "housing.pitch" in page_of(tmp_path / "run")
    before = {own.name: own for own in load_drawing(place / "zones.xlsx").sources}
    after = {own.name: own for own in load_drawing(tmp_path / "run" / "allocation.csv").sources}
    assert before["disc1.pitch"].zone == pytest.approx(11e-6)
    assert after.keys() == before.keys()
    for name, own in after.items():
        if before[name].locked:
            assert own.zone == pytest.approx(before[name].zone)
        else:
            assert before[name].minimum * 0.999 <= own.zone <= before[name].maximum * 1.001
