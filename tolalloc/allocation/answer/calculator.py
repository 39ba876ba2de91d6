"""Sheets that go on calculating: change a zone and see cost, variance and what every requirement then keeps.

The cells hold formulas, so the workbook needs no tolalloc. It says what the local models around the drawing say, no
more: small changes of zones are judged well, large ones by ``tolalloc`` on fresh units.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from openpyxl import load_workbook
from openpyxl.styles import Border, Font, PatternFill, Side
from openpyxl.utils import get_column_letter

from tolalloc.allocation.answer.answer import AllocationAnswer
from tolalloc.allocation.answer.cost_formulas import cost_formula, number
from tolalloc.report.excel import Formula
from tolalloc.report.wording import unit_of
from tolalloc.units import MICROMETRE

_FIRST = 2
"""Row of the first entry below the header."""
_WEIGHTS = 10
"""Column of the first weight."""
_INPUT = PatternFill("solid", fgColor="FFF2CC")
_RESULT = PatternFill("solid", fgColor="E2EFDA")
_EDGE = Side(style="thin", color="7F7F7F")
_NOTES = {
    "zones": (
        "Change a yellow zone: cost here and the sheet 'requirements' follow.",
        "A group in several places has the zone of its first member here; the others keep their ratios to it.",
    ),
    "requirements": (
        "Predicted by models around the drawing: good for small changes, to be verified by tolalloc for large ones.",
    ),
}


def calculator_sheets(answer: AllocationAnswer) -> dict[str, pd.DataFrame]:
    """Return the sheets ``zones`` (to change) and ``requirements`` (to watch)."""
    return {"zones": _zones(answer), "requirements": _requirements(answer)}


def _zones(answer: AllocationAnswer) -> pd.DataFrame:
    """Return one row per group, with what its zone costs and what it adds to every limited side."""
    space, chosen = answer.drawn, answer.chosen
    groups = len(space.groups)
    rows = range(_FIRST, _FIRST + groups)
    made = [
        feature.processes[at]
        for feature, at in zip(space.features, space.process_positions(chosen.design), strict=True)
    ]
    table = pd.DataFrame(
        {
            "group": space.groups,
            "zone to change [µm]": space.first_zones * chosen.design[:groups] / MICROMETRE,
            "zone in the tolerance table [µm]": space.first_zones / MICROMETRE,
            "scale [-]": [Formula(f"=B{row}/C{row}") for row in rows],
            "smallest [µm]": space.first_zones * [process.minimum for process in made] / MICROMETRE,
            "largest [µm]": space.first_zones * [process.maximum for process in made] / MICROMETRE,
            "inside": [Formula(f'=IF(AND(B{row}>=E{row}-0.0001,B{row}<=F{row}+0.0001),"yes","no")') for row in rows],
            "process": chosen.processes,
            "cost [cost units]": [
                Formula(f"={cost_formula(process.cost, f'D{row}')}+{number(process.change)}")
                for process, row in zip(made, rows, strict=True)
            ],
        }
    )
    for side in chosen.sides:
        table[f"{side.stack.name}: added per scale [{unit_of(side.stack.name)}]"] = side.stack.worst_case
        table[f"{side.stack.name}: spread per scale [{unit_of(side.stack.name)}]"] = side.stack.root_sum_square
    return table


def _requirements(answer: AllocationAnswer) -> pd.DataFrame:
    """Return one row per limited side with what the zones of the other sheet would keep, and the total cost."""
    space, chosen = answer.drawn, answer.chosen
    first, last = _FIRST, _FIRST + len(space.groups) - 1
    scales, watched = f"zones!$D${first}:$D${last}", []
    for at, side in enumerate(chosen.sides):
        adds, spreads = (get_column_letter(_WEIGHTS + 2 * at + step) for step in (0, 1))
        load = (
            f"SUMPRODUCT(zones!${adds}${first}:${adds}${last},{scales})"
            f"+SQRT(SUMPRODUCT((zones!${spreads}${first}:${spreads}${last}*{scales})^2))"
        )
        rest = float(side.stack.slopes @ chosen.design[len(space.groups) :]) - side.stack.budget
        upper, row = side.sign > 0, _FIRST + at
        watched.append(
            {
                "what": side.stack.name,
                "limit": side.limit,
                "verified on fresh units": side.value,
                "predicted for the zones": Formula(f"=B{row}{'+' if upper else '-'}({load}+({number(rest)}))"),
                "kept by the model": Formula(f'=IF(D{row}{"<=" if upper else ">="}B{row},"yes","no")'),
            }
        )
    total = Formula(f"=SUM(zones!I{first}:I{last})+{number(space.locked_cost)}")
    return pd.DataFrame([*watched, {"what": "cost [cost units]", "predicted for the zones": total}])


def style_calculator(path: Path) -> None:
    """Mark what to change and what to read in the sheets of a written workbook, and say so below them.

    Parameters
    ----------
    path
        Workbook with the sheets of `calculator_sheets`.
    """
    workbook = load_workbook(path)
    zones, requirements = (workbook[name] for name in _NOTES)
    for row in range(_FIRST, zones.max_row + 1):
        zones.cell(row, 2).fill, zones.cell(row, 2).border = _INPUT, Border(*[_EDGE] * 4)
        zones.cell(row, 4).number_format = zones.cell(row, 9).number_format = "0.000"
    for row in range(_FIRST, requirements.max_row + 1):
        requirements.cell(row, 4).number_format, requirements.cell(row, 4).fill = "0.000", _RESULT
    zones.freeze_panes = "C2"
    for name, notes in _NOTES.items():
        sheet = workbook[name]
        for row, text in enumerate(notes, start=sheet.max_row + 2):
            sheet.cell(row, 1, text).font = Font(italic=True)
        for column in range(2, sheet.max_column + 1):
            sheet.column_dimensions[get_column_letter(column)].width = 16  # a formula is longer than its number
    workbook.save(path)
