"""The first sheet of the drawing's workbook: verdict, cost, limits and amounts, and whether its zones were changed."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any

from tolalloc.allocation.result import AllocationResult
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.excel import Book, Formula
from tolalloc.reports.header import Header
from tolalloc.reports.tellers import allocation_sentences as texts
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity

if TYPE_CHECKING:
    import pandas as pd

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
_GOOD, _CAUTION, _BAD = ({"bg_color": own} for own in ("#C6EFCE", "#FFEB9C", "#FFC7CE"))
_TOP = {"text_wrap": True, "valign": "top"}
_HEAD = {"bold": True, "bottom": 1, "bottom_color": "#7F7F7F"}


class AnswerSheet:
    """Rows of the sheet, written from the top.

    Parameters
    ----------
    book
        The workbook that gets the sheet.
    """

    def __init__(self, book: Book) -> None:
        self.book, self.sheet, self.row = book, book.sheet(NAME), 0
        for column, width in enumerate(_WIDTHS, start=1):
            self.sheet.width(column, width)

    def across(self, text: str | Formula, *, name: str = "", longest: int = 0) -> None:
        """Write a text over the whole width, or beside its name."""
        self.row += 1
        first, room = (2, _ACROSS) if name else (1, _ACROSS + 30)
        self.sheet.inner.merge_range(self.row - 1, first - 1, self.row - 1, len(_WIDTHS) - 1, "")
        if name:
            self.sheet.cell(self.row, 1, name, bold=True, **_TOP)
        self.sheet.cell(self.row, first, text, **_TOP)
        self.sheet.height(self.row, _LINE * (1 + (longest or len(str(text))) // room))

    def line(self, *cells: str | float | Formula | None, number: str = "0.0##", bold: bool = False) -> None:
        """Write cells beside each other."""
        self.row += 1
        for column, own in enumerate(cells, start=1):
            right = {"align": "right"} if isinstance(own, str | Formula) and column > 1 else {}
            self.sheet.cell(self.row, column, own, num_format=number, **_TOP, **right, **(_HEAD if bold else {}))
        if bold or len(str(cells[0])) > _WIDTHS[0]:
            self.sheet.height(self.row, 2 * _LINE)

    def rule(self, place: str, condition: str, style: Mapping[str, object], *, last: bool = False) -> None:
        """Give cells a style where a condition holds; the last one that is looked at, if it says so."""
        rule = {"type": "formula", "criteria": f"={condition}", "format": self.book.style(**style)}
        self.sheet.inner.conditional_format(place, {**rule, "stop_if_true": last})


def add_answer(book: Book, result: AllocationResult, header: Header, watched: pd.DataFrame) -> None:
    """Write the sheet, on which the workbook opens.

    Parameters
    ----------
    book
        It has no sheet yet, and gets ``drawing`` and ``requirements`` after this one.
    result, header
        The allocation, and what is said of its run.
    watched
        The table of ``requirements``: every limited side, and the cost.
    """
    rows, groups = AnswerSheet(book), len(result.drawn.groups)
    rows.across(texts.title(result, header))
    rows.sheet.cell(1, 1, bold=True, font_size=14)
    quick = f" {_say('sheet_quick')}" if header.quick else ""
    rows.across(_say("sheet_study", study=header.name, digest=header.digest[:12] or "not known", quick=quick))
    rows.across(" ".join(texts.promise(result)), name=_say("sheet_verdict"))
    rows.sheet.cell(3, 2, **(_GOOD if result.met and not texts.examined(result).fault else _BAD))
    _guard(rows, groups)
    _limits(rows, result, watched)
    _amounts(rows, result)
    for at, text in enumerate(texts.warnings(result, header)):
        if at == 0:
            rows.row += 1
        rows.across(text, name=_say("sheet_warnings") if at == 0 else " ")
    rows.sheet.set_up_print()
    rows.sheet.print_only(len(_WIDTHS))


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
    longest = max(map(len, said.values()))
    rows.across(Formula(formula, said["verified"]), name=_say("sheet_zones"), longest=longest)
    rows.sheet.cell(rows.row, 2, bold=True)
    for condition, style in ((f"OR({beyond},{unheld})", _BAD), (moved, _CAUTION), ("TRUE", _GOOD)):
        rows.rule(GUARD, condition, style, last=True)


def _limits(rows: AnswerSheet, result: AllocationResult, watched: pd.DataFrame) -> None:
    """Write every limit beside what was verified and what the zones of the workbook would keep, and the cost."""
    held = result.model_range
    key = "sheet_range" if held.designs else "sheet_range_alone"
    rows.across(_say(key, low=1 / held.factor, high=held.factor, count=held.designs), name=_say("sheet_range_name"))
    rows.row += 1
    rows.line(*_say("sheet_limits").split("|"), bold=True)
    first, sides = rows.row + 1, result.chosen.alone
    for at, (side, off) in enumerate(zip(sides, held.off, strict=True)):
        rows.line(
            side.stack.name,
            side.limit,
            side.value if isfinite(side.value) else None,
            linked(watched, at, "D"),
            linked(watched, at, "E"),
            off if isfinite(off) else None,
            number={"mm": "0.0000", "in": "0.000000"}.get(unit_of(side.stack.name), "0.00##"),
        )
    rows.line(watched["what"].iloc[-1], None, result.cost, linked(watched, len(sides), "D"), number="0.00")
    place = f"E{first}:E{rows.row}"
    rows.rule(place, f'E{first}="yes"', _GOOD)
    rows.rule(place, f'AND(E{first}<>"",E{first}<>"yes")', _BAD)


def linked(watched: pd.DataFrame, at: int, column: str) -> Formula:
    """Return a cell that shows one of the sheet ``requirements``, by its place in the table and its column's letter."""
    held: Any = watched.iloc[at, "ABCDE".index(column)]
    return Formula(f"=requirements!{column}{at + 2}", held.value if isinstance(held, Formula) else held)


def _amounts(rows: AnswerSheet, result: AllocationResult) -> None:
    """Write the amounts that must be made with the zones, each with its tolerance where the table states one."""
    if not result.amounts:
        return
    rows.row += 1
    rows.line(*_say("sheet_amounts").split("|"), bold=True)
    for own in result.amounts:
        tolerance = own.tolerance and own.tolerance / MICROMETRE
        rows.line(quantity(own.name), own.value, own.before, unit_of(own.name), tolerance, number="0.00##")
    for text in texts.amounts_convention(result):
        rows.across(text)
