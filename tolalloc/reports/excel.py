"""Results as workbooks: the one place that writes them.

XlsxWriter writes; what is read, anywhere, is read by openpyxl. A cell has its value and its style when the workbook is
closed, and a formula what it gives now, for viewers and programs that calculate nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import count
from math import ceil, isfinite
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import pandas as pd
import xlsxwriter
from xlsxwriter.utility import xl_col_to_name

from tolalloc.reading.files import is_formula
from tolalloc.reading.units import in_cost_units, unit_of
from tolalloc.reports.figure import Figure, shares

_FORMATS = {
    "µm": "0.0##",
    "mm": "0.0000",
    "in": "0.000000",
    "%": "0.0#",
    "cost units": "0.00",
    "arcsec": "0.00",
    "arcmin": "0.000",
}
"""Unit in a header → format of its numbers."""


ANSWER, CONTENTS, CHARTS = "answer", "contents", "charts"
"""Sheets that stand before those of the tables."""
_DATA = "data of charts"
"""Sheet of the numbers that the charts show, behind all tables."""
_CHARTS, _SERIES, _POINTS = 8, 4, 2000
"""Charts of a workbook, series of one and points of one, at most [-]."""
_WIDE, _ROW, _PAPER = 13.0, 0.53, 17.0
"""Width of a chart, height of a row of its sheet, and height of what a sheet of paper holds [cm]."""
_PIXELS = 96 / 2.54
"""Pixels of a centimetre, in which XlsxWriter sizes a chart [1/cm]."""
_COLUMN = 8.5
"""Width of a column of the sheet of charts [characters]."""
_LINE = 110
"""Characters of a line of the answer, with room for wide ones [-]."""
_LONGEST = 32767
"""Characters that a cell holds [-]."""
_NAME = 31
"""Letters of the name of a sheet [-]."""
_NO_NAME = re.compile(r"[\[\]:*?/\\']")
"""What no name of a sheet may hold, or what a link to it would have to quote."""
_CONTROL = re.compile(r"[\000-\010\013\014\016-\037]")
"""What no workbook may hold."""
_ACROSS, _MOST_COLUMNS = 200, 16_384
"""Characters of a row that A4 holds across in letters of 7.5 points, and columns that a sheet has [-]."""
HEAD = {"bold": True, "text_wrap": True, "valign": "top"}
"""Style of a header."""


@dataclass(frozen=True)
class Formula:
    """A formula of ours; every other text of a table is text in its workbook, however it begins."""

    text: str  # With its equals sign
    value: float | str | None = None  # What it gives now, for readers that calculate nothing; none if not known

    def __str__(self) -> str:
        return self.text


def letter(column: int) -> str:
    """Return the letter of a column that counts from 1.

    >>> letter(1), letter(27)
    ('A', 'AA')
    """
    return str(xl_col_to_name(column - 1))


@dataclass(frozen=True)
class _Link:
    """The name of a table, which leads to its sheet."""

    name: str
    sheet: str


class Sheet:
    """One sheet, whose cells are written when its workbook is closed; rows and columns count from 1, as in a formula.

    Parameters
    ----------
    inner
        The sheet of XlsxWriter, which takes what is no cell, such as widths and rules, and counts from 0.
    """

    def __init__(self, inner: Any) -> None:
        self.inner = inner
        self.rows = 0  # The last one that has a cell
        self._widths: dict[int, float] = {}  # Column → characters
        self._is_printed, self._printed = False, _MOST_COLUMNS
        self._cells: dict[tuple[int, int], tuple[object, dict[str, object]]] = {}

    def cell(self, row: int, column: int, value: object = None, **style: object) -> None:
        """Give a cell a value, and properties of a format of XlsxWriter beside those that it has.

        Without a value it keeps the one that it has.
        """
        held, before = self._cells.get((row, column), (None, {}))
        self._cells[row, column] = (held if value is None else value, before | style)
        self.rows = max(self.rows, row)

    def width(self, column: int, characters: float) -> None:
        """Set the width of a column."""
        self._widths[column] = characters
        self.inner.set_column(column - 1, column - 1, characters)

    def height(self, row: int, points: float) -> None:
        """Set the height of a row."""
        self.inner.set_row(row - 1, points)

    def print_only(self, columns: int) -> None:
        """Leave all columns behind the first ones out of print, and rows without a cell."""
        self._printed = columns
        self.inner.print_area(0, 0, self.rows - 1, columns - 1)

    def set_up_print(self, *, headed: bool = True) -> None:
        """Let the sheet print across on A4, with its header, if it has one, on every page.

        It is as wide as the paper, or as several with the first column on each where letters would be too small.
        """
        self._is_printed = True
        self.inner.set_paper(9)  # A4
        self.inner.set_landscape()
        if headed:
            self.inner.repeat_rows(0)
        self.inner.set_footer("&L&A&R&P / &N")

    def _fit_to_pages(self) -> None:
        """Spread the printed columns over as many pages as they need to be read."""
        characters = sum(own for column, own in self._widths.items() if column <= self._printed)
        pages = max(ceil(characters / _ACROSS), 1)
        self.inner.fit_to_pages(pages, 0)
        if pages > 1:
            self.inner.repeat_columns(0)

    def write(self, book: Book) -> None:
        """Hand all cells over to XlsxWriter."""
        if self._is_printed:
            self._fit_to_pages()
        for (row, column), (value, style) in self._cells.items():
            _write(self.inner, (row - 1, column - 1), value, style, book)


class Book:
    """A workbook that is being made."""

    def __init__(self) -> None:
        self._stream = BytesIO()
        self._file = xlsxwriter.Workbook(self._stream, {"in_memory": True})
        self._formats: dict[tuple[tuple[str, object], ...], Any] = {}
        self.sheets: dict[str, Sheet] = {}

    def sheet(self, name: str) -> Sheet:
        """Return a new sheet behind the others; a workbook opens on its first."""
        self.sheets[name] = Sheet(self._file.add_worksheet(self._name(name)))
        return self.sheets[name]

    def _name(self, name: str) -> str:
        """Return a name that no other sheet has, as long and of such letters as Excel allows."""
        short = _NO_NAME.sub("-", name)[:_NAME]
        taken = {own.inner.get_name().casefold() for own in self.sheets.values()}
        spare = (f"{short[: _NAME - len(ending)]}{ending}" for ending in map("~{}".format, count(2)))
        return short if short.casefold() not in taken else next(own for own in spare if own.casefold() not in taken)

    def table(self, name: str, frame: pd.DataFrame) -> Sheet:
        """Return a new sheet with a table: headers frozen, numbers as their unit asks for, set up for print."""
        sheet = self.sheet(name)
        sheet.inner.freeze_panes(1, 0)
        sheet.set_up_print()
        for number, header in enumerate(frame.columns, start=1):
            values = frame.iloc[:, number - 1].tolist()
            longest = max([len(str(header)) * 0.7, *(len(str(value)) for value in values[:40])])
            sheet.width(number, min(max(longest + 2, 10), 60))
            sheet.cell(1, number, str(header), **HEAD)
            shown = {"num_format": _FORMATS.get(in_cost_units(unit_of(str(header))), "0.0###")}
            for row, value in enumerate(values, start=2):
                sheet.cell(row, number, value, **(shown if isinstance(value, float | Formula) else {}))
        return sheet

    def style(self, **properties: object) -> Any:
        """Return a format of XlsxWriter, the same one for the same properties."""
        key = tuple(sorted(properties.items()))
        if key not in self._formats:
            self._formats[key] = self._file.add_format(properties)
        return self._formats[key]

    def chart(self, **options: object) -> Any:
        """Return a new chart of XlsxWriter, which no sheet shows yet."""
        return self._file.add_chart(options)

    def content(self) -> bytes:
        """Write all cells, and return the file; nothing can be added then."""
        for sheet in self.sheets.values():
            sheet.write(self)
        self._file.close()
        return self._stream.getvalue()


def _write(sheet: Any, place: tuple[int, int], value: Any, style: dict[str, object], book: Book) -> None:
    """Write a cell: a formula of ours, a number, or text that stays text, also when somebody edits it."""
    if isinstance(value, Formula):
        known = value.value if isinstance(value.value, str) or _is_finite(value.value) else ""
        sheet.write_formula(*place, value.text, book.style(**style), known)
    elif isinstance(value, _Link):
        sheet.write_url(*place, f"internal:'{value.sheet}'!A1", string=value.name)
    elif isinstance(value, bool) or type(value).__name__ == "bool":  # NumPy's own too
        sheet.write_boolean(*place, bool(value), book.style(**style))
    elif _is_finite(value):
        sheet.write_number(*place, value, book.style(**style))
    elif value is None or pd.isna(value) is True:
        if style:
            sheet.write_blank(*place, None, book.style(**style))
    else:
        text = _CONTROL.sub("\ufffd", str(value))[:_LONGEST]
        quoted = {"quote_prefix": True} if is_formula(text) else {}
        sheet.write_string(*place, text, book.style(**style, **quoted))


def _is_finite(value: object) -> bool:
    return isinstance(value, Integral | Real) and isfinite(value)


def write_sheets(sheets: Mapping[str, pd.DataFrame], path: Path, figures: Iterable[object] = ()) -> None:
    """Write one sheet per table, headers frozen, units in every header; and figures as charts of the workbook's own."""
    drawn = [own for own in figures if isinstance(own, Figure) and _is_chart(own)][:_CHARTS]
    book = Book()
    for name, frame in sheets.items():
        book.table(name, frame)
        if name == CONTENTS and drawn:
            book.sheet(CHARTS)
    _lay_out(book, sheets)
    if drawn:
        _draw(book, drawn)
    path.write_bytes(book.content())


def _is_chart(figure: Figure) -> bool:
    """Return whether a workbook draws a figure: bars, histograms, or lines and points of a few numbers."""
    kinds = {own.kind for own in figure.series}
    few = sum(len(own.x) for own in figure.series) <= _POINTS
    return 0 < len(figure.series) <= _SERIES and (
        kinds in ({"bars"}, {"histogram"}) or (kinds <= {"line", "points"} and few)
    )


def _draw(book: Book, figures: Sequence[Figure]) -> None:
    """Draw figures below each other on a sheet of their own, from numbers on the last sheet."""
    sheet, data = book.sheets[CHARTS], book.sheet(_DATA)
    sheet.set_up_print(headed=False)  # a chart stands in the first row
    top, column, left = 0.0, 1, 0.0  # Where the next pair stands, and how much of a sheet of paper is left [cm]
    breaks = []
    for first in range(0, len(figures), 2):
        pair, row = figures[first : first + 2], int(top / _ROW)
        tall = max(map(_height, pair)) + _ROW
        if first and tall > left:
            breaks.append(row)
        left = (left if first and tall <= left else _PAPER) - tall
        for place, own in zip((0, 7), pair, strict=False):
            chart, used = _chart(book, own, data, column)
            _style(chart, own)
            sheet.inner.insert_chart(row, place, chart)
            column += used
        top += tall + _ROW
    sheet.inner.set_h_pagebreaks(breaks)
    sheet.inner.set_column(0, 13, _COLUMN)


def _height(figure: Figure) -> float:
    """Return the height of a chart [cm]."""
    return min(max(7.0, 0.5 * figure.rows * len(figure.series) + 3.0), _PAPER)


def _style(chart: Any, figure: Figure) -> None:
    """Give a chart its title, its size and its legend."""
    chart.set_title({"name": figure.title, "name_font": {"size": 10, "bold": True}})
    chart.set_size({"width": round(_WIDE * _PIXELS), "height": round(_height(figure) * _PIXELS)})
    chart.set_legend({"position": "bottom"} if len(figure.series) > 1 else {"none": True})


def _chart(book: Book, figure: Figure, data: Sheet, column: int) -> tuple[Any, int]:
    """Return a chart whose numbers are written from a column on, and how many columns they take."""
    if figure.series[0].kind in ("line", "points"):
        chart, used = book.chart(type="scatter", subtype="straight"), 0
        for own in figure.series:
            _put(data, column + used, [figure.x_label, own.label], list(own.x), list(own.y))
            x, y = (_range(column + used + at, len(own.x)) for at in (0, 1))
            points = {"marker": {"type": "circle"}, "line": {"none": True}}
            kind = points if own.kind == "points" else {"line": {"width": 1.5}}
            chart.add_series({"name": own.label, "categories": x, "values": y, **kind})
            used += 2
        chart.set_x_axis({"name": figure.x_label})
        chart.set_y_axis({"name": figure.y_label})
        return chart, used
    shown, bars = _bars(figure), figure.series[0].kind == "bars"
    heads = [figure.x_label, *(own.label for own in figure.series)]
    _put(data, column, heads, *([row[at] for row in shown] for at in range(len(heads))))
    chart = book.chart(type="bar" if bars else "column")
    layout = {"gap": 40} if bars else {"gap": 0, "overlap": 100}
    for at, own in enumerate(figure.series, start=1):
        names, lengths = _range(column, len(shown)), _range(column + at, len(shown))
        chart.add_series({"name": own.label, "categories": names, "values": lengths, **layout})
    if bars:  # the first one on top
        chart.set_x_axis({"name": figure.x_label})
        chart.set_y_axis({"reverse": True, "interval_unit": 1, "crossing": "max"})
    else:
        chart.set_x_axis({"name": figure.x_label, "num_format": "0"})
        chart.set_y_axis({"name": figure.y_label})
    return chart, len(heads)


def _range(column: int, count: int) -> str:
    """Return the cells below a head on the sheet of the charts' numbers, as a formula."""
    return f"='{_DATA}'!${letter(column)}$2:${letter(column)}${count + 1}"


def _bars(figure: Figure) -> list[list[object]]:
    """Return the rows of a chart of bars or of a histogram: a category, or the middle of a bin, and the lengths."""
    if figure.series[0].kind == "bars":
        names = list(dict.fromkeys(str(name) for own in figure.series for name in own.x))
        known = [dict(zip(map(str, own.x), own.y, strict=True)) for own in figure.series]
        return [[name, *(own.get(name) for own in known)] for name in names]
    start, width = figure.bins
    counted = [shares(own.x, start, width) for own in figure.series]
    middles = [edge + width / 2 for edge in counted[0]["x"]]
    return [[f"{middle:.4g}", *(own["y"][at] for own in counted)] for at, middle in enumerate(middles)]


def _put(data: Sheet, column: int, heads: Sequence[str], *columns: Sequence[object]) -> None:
    """Write columns with their heads; what is no finite number leaves its cell empty."""
    for at, (head, values) in enumerate(zip(heads, columns, strict=True)):
        for row, value in enumerate((head, *values), start=1):
            data.cell(row, column + at, value if isinstance(value, str) or _is_finite(value) else None)


def _lay_out(book: Book, sheets: Mapping[str, pd.DataFrame]) -> None:
    """Let the answer be read as text, and every entry of the contents lead to its sheet."""
    if ANSWER in sheets:
        sheet = book.sheets[ANSWER]
        sheet.width(1, 110)
        for row, text in enumerate(sheets[ANSWER].iloc[:, 0], start=2):
            sheet.cell(row, 1, text_wrap=True, valign="top")
            sheet.height(row, 15.0 * (1 + len(str(text)) // _LINE))
    if CONTENTS in sheets:
        for row, name in enumerate(sheets[CONTENTS].iloc[:, 0], start=2):
            book.sheets[CONTENTS].cell(row, 1, _Link(name, book.sheets[name].inner.get_name()))
