"""The first sheet of the drawing's workbook: verdict, cost, limits and amounts, and whether its zones were changed."""

from __future__ import annotations

from math import isfinite

from openpyxl.formatting.rule import CellIsRule, FormulaRule
from openpyxl.styles import Alignment, Border, Font, PatternFill, Side
from openpyxl.workbook.workbook import Workbook
from openpyxl.worksheet.worksheet import Worksheet

from tolalloc.allocation.result import AllocationResult
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.excel import Formula, set_up_print
from tolalloc.reports.header import Header
from tolalloc.reports.tellers import allocation_sentences as texts
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity

NAME = "answer"
"""Name of the sheet."""
GUARD = "B4"
"""Cell that says whether the zones are those of the verdict."""

_say = Sentences("allocation")

_WIDTHS = (34, 16, 16, 16, 16, 20)
_LINE = 15.0
"""Height of a line of text [pt]."""
_ACROSS = 98
"""Letters that fit beside the first column, and in all of them where that is a part of it [-]."""
_GOOD, _CAUTION, _BAD = (PatternFill("solid", bgColor=own, fgColor=own) for own in ("C6EFCE", "FFEB9C", "FFC7CE"))
_BOLD = Font(name="Calibri", bold=True)
_EDGE = Border(bottom=Side(style="thin", color="7F7F7F"))


class AnswerSheet:
    """Rows of the sheet, written from the top.

    Parameters
    ----------
    sheet
        An empty sheet.
    """

    def __init__(self, sheet: Worksheet) -> None:
        self.sheet, self.row = sheet, 0
        self.values: dict[str, float | str] = {}  # Cell → what its formula gives
        for letter, width in zip("ABCDEF", _WIDTHS, strict=True):
            sheet.column_dimensions[letter].width = width

    def across(self, text: str, *, name: str = "", longest: int = 0) -> None:
        """Write a text over the whole width, or beside its name."""
        self.row += 1
        first, room = (2, _ACROSS) if name else (1, _ACROSS + 30)
        if name:
            self.sheet.cell(self.row, 1, name).font = _BOLD
        cell = self.sheet.cell(self.row, first, text)
        self.sheet.merge_cells(start_row=self.row, start_column=first, end_row=self.row, end_column=len(_WIDTHS))
        for own in (self.sheet.cell(self.row, 1), cell):
            own.alignment = Alignment(wrap_text=True, vertical="top")
        self.sheet.row_dimensions[self.row].height = _LINE * (1 + max(len(text), longest) // room)

    def line(self, *cells: str | float | Formula | None, number: str = "0.0##", bold: bool = False) -> None:
        """Write cells beside each other."""
        self.row += 1
        for column, own in enumerate(cells, start=1):
            cell = self.sheet.cell(self.row, column, str(own) if isinstance(own, Formula) else own)
            cell.number_format, cell.alignment = number, Alignment(wrap_text=True, vertical="top")
            if isinstance(own, Formula) and own.value is not None:
                self.values[cell.coordinate] = own.value
            if isinstance(own, str | Formula) and column > 1:
                cell.alignment = Alignment(wrap_text=True, vertical="top", horizontal="right")
            if bold:
                cell.font, cell.border = _BOLD, _EDGE
        if bold or len(str(cells[0])) > _WIDTHS[0]:
            self.sheet.row_dimensions[self.row].height = 2 * _LINE

    def space(self) -> None:
        """Leave a row free."""
        self.row += 1


def add_answer(
    workbook: Workbook, result: AllocationResult, header: Header, predicted: dict[str, Formula | float | None]
) -> dict[str, float | str]:
    """Put the sheet in front of the others and return what its formulas give.

    Parameters
    ----------
    workbook
        It has the sheets ``drawing`` and ``requirements``.
    result, header
        The allocation, and what is said of its run.
    predicted
        What is limited, or the cost → what the other sheets predict of it, in their order.
    """
    sheet = workbook.create_sheet(NAME, 0)
    rows, groups = AnswerSheet(sheet), len(result.drawn.groups)
    rows.across(texts.title(result, header))
    sheet["A1"].font = Font(name="Calibri", bold=True, size=14)
    rows.across(_say("sheet_study", study=header.name, digest=header.digest[:12], quick=_quick(header)))
    rows.across(" ".join(texts.verdict(result)), name=_say("sheet_verdict"))
    sheet["B3"].fill = _GOOD if result.met and not texts.examined(result).fault else _BAD
    _guard(rows, groups)
    _limits(rows, result, header.cost_unit, predicted)
    _amounts(rows, result)
    for at, text in enumerate(texts.warnings(result, header)):
        if at == 0:
            rows.space()
        rows.across(text, name=_say("sheet_warnings") if at == 0 else " ")
    _finish(workbook, rows)
    return rows.values


def _quick(header: Header) -> str:
    return f" {_say('sheet_quick')}" if header.quick else ""


def _guard(rows: AnswerSheet, groups: int) -> None:
    """Write the cell that says whether the zones are still those of the verdict, and where the weights hold."""
    first, last = 2, 1 + groups
    beyond, unheld = (f'COUNTIF(drawing!${column}${first}:${column}${last},"no")>0' for column in ("P", "G"))
    moved = f"SUMPRODUCT((drawing!$B${first}:$B${last}-drawing!$M${first}:$M${last})^2)>0.00000001"
    said = {key: _say(f"sheet_guard_{key}") for key in ("beyond", "unheld", "moved", "verified")}
    formula = (
        f'=IF({beyond},"{said["beyond"]}",IF({unheld},"{said["unheld"]}",IF({moved},"{said["moved"]}",'
        f'"{said["verified"]}")))'
    )
    rows.across(formula, name=_say("sheet_zones"))
    height = 1 + max(map(len, said.values())) // _ACROSS
    rows.sheet.row_dimensions[rows.row].height = _LINE * height
    cell, sheet = rows.sheet[GUARD], rows.sheet
    cell.font = _BOLD
    rows.values[GUARD] = said["verified"]
    for condition, fill in ((f"OR({beyond},{unheld})", _BAD), (moved, _CAUTION), ("TRUE", _GOOD)):
        sheet.conditional_formatting.add(GUARD, FormulaRule(formula=[condition], fill=fill, stopIfTrue=True))


def _limits(
    rows: AnswerSheet, result: AllocationResult, cost_unit: str, predicted: dict[str, Formula | float | None]
) -> None:
    """Write every limit beside what was verified and what the zones of the workbook would keep, and the cost."""
    held = result.model_range
    key = "sheet_range" if held.designs else "sheet_range_alone"
    rows.across(_say(key, low=1 / held.factor, high=held.factor, count=held.designs), name=_say("sheet_range_name"))
    rows.space()
    rows.line(*_say("sheet_limits").split("|"), bold=True)
    first = rows.row + 1
    for at, (side, off) in enumerate(zip(result.chosen.alone, held.off, strict=True), start=2):
        name = side.stack.name
        rows.line(
            name,
            side.limit,
            side.value if isfinite(side.value) else None,
            _linked("D", at, predicted[name]),
            _linked("E", at, _kept(side.sign, side.limit, predicted[name])),
            off if isfinite(off) else None,
            number={"mm": "0.0000", "in": "0.000000"}.get(unit_of(name), "0.00##"),
        )
    cost = f"cost [{cost_unit}]"
    rows.line(cost, None, result.cost, _linked("D", len(result.chosen.alone) + 2, predicted[cost]), number="0.00")
    place = f"E{first}:E{rows.row}"
    rows.sheet.conditional_formatting.add(place, CellIsRule(operator="equal", formula=['"yes"'], fill=_GOOD))
    rows.sheet.conditional_formatting.add(place, FormulaRule(formula=[f'AND(E{first}<>"",E{first}<>"yes")'], fill=_BAD))


def _linked(column: str, row: int, held: Formula | float | str | None) -> Formula:
    """Return a cell that shows one of the sheet ``requirements``."""
    return Formula(f"=requirements!{column}{row}", held.value if isinstance(held, Formula) else held)


def _kept(sign: int, limit: float, predicted: Formula | float | None) -> str:
    """Return whether the limit is kept, as far as the models tell of the verified zones."""
    value = predicted.value if isinstance(predicted, Formula) else predicted
    return "yes" if isinstance(value, float) and sign * value <= sign * limit else "no"


def _amounts(rows: AnswerSheet, result: AllocationResult) -> None:
    """Write the amounts that must be made with the zones, each with its tolerance where the table states one."""
    if not result.amounts:
        return
    rows.space()
    rows.line(*_say("sheet_amounts").split("|"), bold=True)
    for own in result.amounts:
        tolerance = own.tolerance and own.tolerance / MICROMETRE
        rows.line(quantity(own.name), own.value, own.before, unit_of(own.name), tolerance, number="0.00##")
    for text in texts.amounts_convention(result):
        rows.across(text)


def _finish(workbook: Workbook, rows: AnswerSheet) -> None:
    """Let the workbook open on the sheet, and the sheet print on one page's width."""
    sheet = rows.sheet
    set_up_print(sheet)
    sheet.print_area = f"A1:F{rows.row}"
    workbook.active = 0
    for own in workbook.worksheets:  # two selected sheets would be changed together
        own.sheet_view.tabSelected = own is sheet
