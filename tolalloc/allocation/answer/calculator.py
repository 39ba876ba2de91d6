"""The drawing as sheets that go on calculating: change a zone and see cost and what each limit then keeps.

The cells hold formulas, so the workbook needs no tolalloc. It says what the local models around the drawing say, no
more: small changes of zones are judged well, large ones by ``tolalloc`` on fresh units.
"""

from __future__ import annotations

from math import floor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from jaxtyping import Float
from openpyxl import load_workbook
from openpyxl.styles import Border, Font, PatternFill, Side
from openpyxl.utils import get_column_letter
from openpyxl.worksheet.datavalidation import DataValidation
from openpyxl.worksheet.worksheet import Worksheet

from tolalloc.allocation.answer.cost_formulas import cost_formula, number
from tolalloc.allocation.answer.dimensions import dimensions
from tolalloc.allocation.answer.sentences import amounts_convention, drawn_amounts
from tolalloc.allocation.space.problem import OneSidedConstraint
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.currency import in_currency
from tolalloc.reports.excel import Formula, keep_values
from tolalloc.reports.feature_frame import FeatureFrame, callout

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer

_FIRST = 2
"""Row of the first entry below the header."""
_WEIGHTS = 13
"""Column of the first weight; those before it are printed."""
_INPUT = PatternFill("solid", fgColor="FFF2CC")
_RESULT = PatternFill("solid", fgColor="E2EFDA")
_EDGE = Side(style="thin", color="7F7F7F")
_NOTES = (
    "Change a yellow zone: what to write, cost and limits follow. A group in several places has the zone of its first "
    "member here; the others keep their ratios to it.",
    "Predicted by models around the drawing: good for small changes, to be verified by tolalloc for large ones.",
)


def calculator_sheets(answer: AllocationAnswer) -> dict[str, pd.DataFrame]:
    """Return the sheets ``drawing`` (to change and to print) and ``requirements`` (how the limits follow)."""
    return {"drawing": _drawing(answer), "requirements": _requirements(answer)}


def _drawing(answer: AllocationAnswer) -> pd.DataFrame:
    """Return one row per group, with what to write, what it costs and what it adds to every limited side."""
    space, chosen = answer.drawn, answer.chosen
    groups, drawn = len(space.groups), dimensions(answer)
    callouts = [callout(drawn[name][0]) for name in space.groups]
    scales, zones = chosen.design[:groups], space.first_zones * chosen.design[:groups] / MICROMETRE
    rows = range(_FIRST, _FIRST + groups)
    made = [
        feature.processes[at]
        for feature, at in zip(space.features, space.process_positions(chosen.design), strict=True)
    ]
    table = pd.DataFrame(
        {
            "group": space.groups,
            "zone to change [µm]": zones,
            "zone in the tolerance table [µm]": space.first_zones / MICROMETRE,
            "scale [-]": [Formula(f"=B{row}/C{row}", scale) for row, scale in zip(rows, scales.tolist(), strict=True)],
            "smallest [µm]": space.first_zones * [process.minimum for process in made] / MICROMETRE,
            "largest [µm]": space.first_zones * [process.maximum for process in made] / MICROMETRE,
            "inside": [
                Formula(f'=IF(AND(B{row}>=E{row}-0.0001,B{row}<=F{row}+0.0001),"yes","no")', "yes") for row in rows
            ],
            "process": chosen.processes,
            "cost [cost units]": [
                Formula(
                    f"={cost_formula(process.cost, f'D{row}')}+{number(process.change)}",
                    float(process.total(np.array(scale))),
                )
                for process, row, scale in zip(made, rows, scales, strict=True)
            ],
            "characteristic": [f"{own.symbol} {own.characteristic}".strip() for own in callouts],
            "write [mm]": [
                Formula(f"=INT(B{row}*{_steps(own)}+0.001)/10000", floor(zone * _steps(own) + 0.001) / 10000)
                for row, own, zone in zip(rows, callouts, zones.tolist(), strict=True)
            ],
            "datum": [" ".join(own.datums) for own in callouts],
        }
    )
    for side in chosen.constraints:
        table[f"{side.stack.name}: added per scale [{unit_of(side.stack.name)}]"] = side.stack.worst_case + _relief(
            side
        )
        table[f"{side.stack.name}: spread per scale [{unit_of(side.stack.name)}]"] = side.stack.root_sum_square
    return table


def _relief(side: OneSidedConstraint) -> Float[np.ndarray, " group"]:
    """Return by how much a larger zone relieves a limit, 0 or below, which no model of a search rewards.

    Per scale and to first order [unit of the output]; a smaller zone then costs as much.
    """
    groups = side.stack.worst_case.size
    if side.batches is None:
        return np.zeros(groups)
    return np.asarray(np.minimum(side.batches[:, :groups].mean(axis=0), 0.0))


def _without_weight(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return of which zones these sheets know hardly more than that a smaller one gains nothing."""
    weights = np.sum([side.stack.worst_case + side.stack.root_sum_square for side in answer.chosen.constraints], axis=0)
    names = [group for group, weight in zip(answer.drawn.groups, weights.tolist(), strict=True) if weight == 0.0]
    if not names:
        return ()
    return (
        f"A smaller zone of {', '.join(names)} relieves no limit here, and may move one the other way by more than "
        "these sheets say: ask tolalloc whatif.",
    )


def _steps(frame: FeatureFrame) -> int:
    """Return how many steps of a tenth of a micrometre a micrometre of the zone is written as; ± has half of them."""
    return 5 if frame.characteristic == "size" else 10


def _requirements(answer: AllocationAnswer) -> pd.DataFrame:
    """Return one row per limited side with what the zones of the other sheet would keep, and the total cost."""
    space, chosen = answer.drawn, answer.chosen
    first, last = _FIRST, _FIRST + len(space.groups) - 1
    scales, watched = f"drawing!$D${first}:$D${last}", []
    for at, side in enumerate(chosen.constraints):
        adds, spreads = (get_column_letter(_WEIGHTS + 2 * at + step) for step in (0, 1))
        load = (
            f"SUMPRODUCT(drawing!${adds}${first}:${adds}${last},{scales})"
            f"+SQRT(SUMPRODUCT((drawing!${spreads}${first}:${spreads}${last}*{scales})^2))"
        )
        rest = float(side.stack.slopes @ chosen.design[len(space.groups) :]) - side.stack.budget
        rest -= float(_relief(side) @ chosen.scales)
        upper, row = side.sign > 0, _FIRST + at
        predicted = float(side.limit + side.sign * side.predicted(chosen.design))
        kept = "yes" if side.sign * predicted <= side.sign * side.limit else "no"
        watched.append(
            {
                "what": side.stack.name,
                "limit": side.limit,
                "verified on fresh units": side.value,
                "predicted for the zones": Formula(
                    f"=B{row}{'+' if upper else '-'}({load}+({number(rest)}))", predicted
                ),
                "kept by the model": Formula(f'=IF(D{row}{"<=" if upper else ">="}B{row},"yes","no")', kept),
            }
        )
    total = Formula(f"=SUM(drawing!I{first}:I{last})+{number(space.locked_cost)}", chosen.cost)
    return pd.DataFrame([*watched, {"what": "cost [cost units]", "predicted for the zones": total}])


def style_calculator(answer: AllocationAnswer, path: Path) -> None:
    """Make the written sheets a drawing: cells to change marked and guarded, cost and limits below, notes.

    Parameters
    ----------
    answer
        What the sheets were made of.
    path
        Workbook with the sheets of `calculator_sheets`, and others behind them.
    """
    workbook = load_workbook(path)
    sheets = {name: in_currency(own, answer.header.currency) for name, own in calculator_sheets(answer).items()}
    drawing, requirements = workbook["drawing"], workbook["requirements"]
    groups = len(answer.drawn.groups)
    guard = DataValidation(
        type="decimal",
        operator="between",
        formula1=f"$E{_FIRST}",
        formula2=f"$F{_FIRST}",
        allow_blank=False,
        showErrorMessage=True,
        errorStyle="stop",
    )
    guard.errorTitle, guard.error = "zone", "The zone must lie between the smallest and the largest one of its row."
    drawing.add_data_validation(guard)
    for row, name in zip(range(_FIRST, _FIRST + groups), answer.drawn.groups, strict=True):
        drawing.cell(row, 2).fill, drawing.cell(row, 2).border = _INPUT, Border(*[_EDGE] * 4)
        guard.add(drawing.cell(row, 2))
        drawing.cell(row, 4).number_format = "0.000"
        drawing.cell(row, 11).number_format = _written_as(callout(dimensions(answer)[name][0]))
    for row in range(_FIRST, requirements.max_row + 1):
        requirements.cell(row, 4).number_format, requirements.cell(row, 4).fill = "0.000", _RESULT
    values = {
        name: {
            f"{get_column_letter(column)}{row}": cell.value
            for column, header in enumerate(frame.columns, start=1)
            for row, cell in enumerate(frame[header], start=_FIRST)
            if isinstance(cell, Formula) and cell.value is not None
        }
        for name, frame in sheets.items()
    }
    notes = (*drawn_amounts(answer), *amounts_convention(answer), *_without_weight(answer))
    values["drawing"] |= _below(drawing, sheets["requirements"], groups, notes)
    drawing.freeze_panes = "C2"
    drawing.print_area = f"A1:{get_column_letter(_WEIGHTS - 1)}{drawing.max_row}"
    for sheet in (drawing, requirements):
        for column in range(2, sheet.max_column + 1):
            sheet.column_dimensions[get_column_letter(column)].width = 16  # a formula is longer than its number
    workbook.calculation.fullCalcOnLoad = True
    workbook.save(path)
    keep_values(path, values)


def _written_as(frame: FeatureFrame) -> str:
    """Return the format of a number that looks as on the drawing, whatever the language of its reader."""
    sign = "±" if frame.characteristic == "size" else "⌀" if frame.zone.startswith("⌀") else ""
    return f'"{sign}"0.0000' if sign else "0.0000"


def _below(drawing: Worksheet, watched: pd.DataFrame, groups: int, notes: tuple[str, ...]) -> dict[str, float | str]:
    """Write cost, limits and notes below the drawing, and return what the formulas there give."""
    start, values = _FIRST + groups + 1, dict[str, float | str]()
    for column, header in enumerate(("what", "limit", "predicted", "kept"), start=1):
        drawing.cell(start, column, header).font = Font(bold=True)
    for at, own in enumerate(watched.to_dict("records")):
        row, there = start + 1 + at, _FIRST + at
        drawing.cell(row, 1, str(own["what"]))
        for column, place, held in (
            (2, "B", own["limit"]),
            (3, "D", own["predicted for the zones"]),
            (4, "E", own["kept by the model"]),
        ):
            value = held.value if isinstance(held, Formula) else held
            if isinstance(value, str) or (value is not None and value == value):
                cell = drawing.cell(row, column, f"=requirements!{place}{there}")
                cell.number_format, cell.fill = "0.00", _RESULT
                values[cell.coordinate] = value
    for row, text in enumerate((*notes, *_NOTES), start=drawing.max_row + 2):
        drawing.cell(row, 1, text).font = Font(italic=True)
    return values
