"""The results as one workbook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import ZIP_DEFLATED, ZipFile

import pandas as pd
from openpyxl import Workbook, load_workbook
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE, Cell
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter
from openpyxl.worksheet.pagebreak import Break
from openpyxl.worksheet.properties import PageSetupProperties
from openpyxl.worksheet.worksheet import Worksheet

from tolalloc.reading.files import is_formula
from tolalloc.reading.units import in_cost_units, unit_of
from tolalloc.reports.figure import Figure, shares

_MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
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
_COLUMN = 8.5
"""Width of a column of the sheet of charts [characters]."""
_LINE = 110
"""Characters of a line of the answer, with room for wide ones [-]."""


@dataclass(frozen=True)
class Formula:
    """A formula of ours; every other text of a table is text in its workbook, however it begins."""

    text: str  # With its equals sign
    value: float | str | None = None  # What it gives now, for readers that calculate nothing; none if not known

    def __str__(self) -> str:
        return self.text


def write_sheets(sheets: dict[str, pd.DataFrame], path: Path, figures: Iterable[object] = ()) -> None:
    """Write one sheet per table, headers frozen, units in every header; and figures as charts of the workbook's own."""
    with pd.ExcelWriter(path, engine="openpyxl") as writer:
        for name, frame in sheets.items():
            frame.rename(columns=_shown).map(_shown).to_excel(writer, sheet_name=name, index=False)
            sheet = writer.sheets[name]
            sheet.freeze_panes = "A2"
            set_up_print(sheet)
            for number, header in enumerate(frame.columns, start=1):
                longest = max([len(str(header)) * 0.7, *(len(str(value)) for value in frame[header].head(40))])
                sheet.column_dimensions[get_column_letter(number)].width = min(max(longest + 2, 10), 60)
                cell = sheet.cell(1, number)
                cell.font, cell.alignment = Font(bold=True), Alignment(wrap_text=True, vertical="top")
                _keep_text(cell, header)
                for row in range(2, len(frame) + 2):
                    value, cell = frame.iloc[row - 2, number - 1], sheet.cell(row, number)
                    if isinstance(value, float | Formula):
                        cell.number_format = _FORMATS.get(in_cost_units(unit_of(str(header))), "0.0###")
                    _keep_text(cell, value)
        _lay_out(writer.sheets)
        _draw(writer.book, [own for own in figures if isinstance(own, Figure) and _is_chart(own)][:_CHARTS])


def _is_chart(figure: Figure) -> bool:
    """Return whether a workbook draws a figure: bars, histograms, or lines and points of a few numbers."""
    kinds = {own.kind for own in figure.series}
    few = sum(len(own.x) for own in figure.series) <= _POINTS
    return 0 < len(figure.series) <= _SERIES and (
        kinds in ({"bars"}, {"histogram"}) or (kinds <= {"line", "points"} and few)
    )


def _draw(book: Workbook, figures: Sequence[Figure]) -> None:
    """Draw figures below each other on a sheet of their own, from numbers on the last sheet."""
    if not figures:
        return
    sheet, data = book.create_sheet(CHARTS, book.sheetnames.index(CONTENTS) + 1), book.create_sheet(_DATA)
    set_up_print(sheet)
    sheet.print_title_rows = None  # a chart stands in the first row
    top, column, left = 0.0, 1, 0.0  # Where the next pair stands, and how much of a sheet of paper is left [cm]
    for first in range(0, len(figures), 2):
        pair, row = [], int(top / _ROW) + 1
        for own in figures[first : first + 2]:
            chart, used = _chart(own, data, column)
            _style(chart, own)
            pair.append(chart)
            column += used
        tall = max(chart.height for chart in pair) + _ROW
        if first and tall > left:
            sheet.row_breaks.append(Break(id=row - 1))
        left = (left if first and tall <= left else _PAPER) - tall
        for place, chart in zip("AH", pair, strict=False):
            sheet.add_chart(chart, f"{place}{row}")
        top += tall + _ROW
    for letter in "ABCDEFGHIJKLMN":
        sheet.column_dimensions[letter].width = _COLUMN


def _style(chart: Any, figure: Figure) -> None:
    """Give a chart its title, its size and axes that are seen."""
    from openpyxl.drawing.text import CharacterProperties

    chart.title, chart.width = figure.title, _WIDE
    for paragraph in chart.title.tx.rich.p:
        for run in paragraph.r:
            run.rPr = CharacterProperties(sz=1000, b=True)
    chart.height = min(max(7.0, 0.5 * figure.rows * len(figure.series) + 3.0), _PAPER)
    chart.x_axis.delete = chart.y_axis.delete = False
    if len(figure.series) > 1:
        chart.legend.position = "b"
    else:
        chart.legend = None


def _chart(figure: Figure, data: Worksheet, column: int) -> tuple[Any, int]:
    """Return a chart whose numbers are written from a column on, and how many columns they take."""
    from openpyxl.chart import BarChart, Reference, ScatterChart
    from openpyxl.chart import Series as Drawn

    if figure.series[0].kind in ("line", "points"):
        chart, used = ScatterChart(style=13), 0
        for own in figure.series:
            _write(data, column + used, [figure.x_label, own.label], list(own.x), list(own.y))
            x, y = (Reference(data, column + used + at, 2, column + used + at, len(own.x) + 1) for at in (0, 1))
            drawn = Drawn(y, x, title=own.label)
            if own.kind == "points":
                drawn.marker.symbol, drawn.graphicalProperties.line.noFill = "circle", True
            chart.series.append(drawn)
            used += 2
        chart.x_axis.title, chart.y_axis.title = figure.x_label, figure.y_label
        return chart, used
    shown, bars = _bars(figure), figure.series[0].kind == "bars"
    heads = [figure.x_label, *(own.label for own in figure.series)]
    _write(data, column, heads, *([row[at] for row in shown] for at in range(len(heads))))
    chart = BarChart()
    chart.type, chart.gapWidth = ("bar", 40) if bars else ("col", 0)
    chart.overlap = None if bars else 100
    chart.add_data(Reference(data, column + 1, 1, column + len(figure.series), len(shown) + 1), titles_from_data=True)
    chart.set_categories(Reference(data, column, 2, column, len(shown) + 1))
    if bars:
        chart.x_axis.scaling.orientation, chart.y_axis.crosses = "maxMin", "max"  # the first one on top
        chart.y_axis.title, chart.x_axis.tickLblSkip = figure.x_label, 1
    else:
        chart.x_axis.title, chart.y_axis.title, chart.x_axis.number_format = figure.x_label, figure.y_label, "0"
    return chart, len(heads)


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


def _write(data: Worksheet, column: int, heads: Sequence[str], *columns: Sequence[object]) -> None:
    """Write columns with their heads."""
    for at, (head, values) in enumerate(zip(heads, columns, strict=True)):
        for row, value in enumerate((head, *values), start=1):
            cell = data.cell(row, column + at, None if isinstance(value, float) and not isfinite(value) else value)
            _keep_text(cell, value)


def _lay_out(sheets: Mapping[str, Worksheet]) -> None:
    """Let the answer be read as text, and every entry of the contents lead to its sheet."""
    if ANSWER in sheets:
        sheet = sheets[ANSWER]
        sheet.column_dimensions["A"].width = 110
        for (cell,) in sheet.iter_rows(min_row=2):
            cell.alignment = Alignment(wrap_text=True, vertical="top")
            sheet.row_dimensions[cell.row].height = 15.0 * (1 + len(str(cell.value)) // _LINE)
    if CONTENTS in sheets:
        for (cell,) in sheets[CONTENTS].iter_rows(min_row=2, max_col=1):
            cell.hyperlink, cell.style = f"#'{cell.value}'!A1", "Hyperlink"


def set_up_print(sheet: Worksheet) -> None:
    """Let a sheet print across on A4, as wide as the paper, with its header on every page."""
    sheet.page_setup.paperSize = Worksheet.PAPERSIZE_A4
    sheet.page_setup.orientation, sheet.page_setup.fitToWidth, sheet.page_setup.fitToHeight = "landscape", 1, 0
    sheet.sheet_properties.pageSetUpPr = PageSetupProperties(fitToPage=True)
    sheet.print_title_rows = "1:1"
    sheet.oddFooter.left.text, sheet.oddFooter.right.text = "&A", "&P / &N"


def keep_values(path: Path, values: Mapping[str, Mapping[str, float | str]]) -> None:
    """Write what formulas give into a workbook, for viewers and programs that calculate nothing.

    openpyxl writes a formula or its value and never both.

    Parameters
    ----------
    path
        Workbook whose sheets stand in the order in which they were made.
    values
        Sheet → cell, such as ``D2``, → what its formula gives.
    """
    ElementTree.register_namespace("", _MAIN)
    names = load_workbook(path, read_only=True).sheetnames
    files = {f"xl/worksheets/sheet{at}.xml": name for at, name in enumerate(names, start=1)}
    beside = path.with_suffix(".part")
    with ZipFile(path) as old, ZipFile(beside, "w", ZIP_DEFLATED) as new:
        for item in old.infolist():
            content = old.read(item)
            known = values.get(files.get(item.filename, ""), {})
            new.writestr(item, _with_values(content, known) if known else content)
    beside.replace(path)


def _with_values(sheet: bytes, values: Mapping[str, float | str]) -> bytes:
    """Return the XML of a sheet whose formulas have values."""
    root = ElementTree.fromstring(sheet)
    for cell in root.iter(f"{{{_MAIN}}}c"):
        value, shown = values.get(cell.get("r", "")), cell.find(f"{{{_MAIN}}}v")
        if value is None or cell.find(f"{{{_MAIN}}}f") is None:
            continue
        if shown is None:
            shown = ElementTree.SubElement(cell, f"{{{_MAIN}}}v")
        shown.text = value if isinstance(value, str) else repr(float(value))
        if isinstance(value, str):
            cell.set("t", "str")
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _shown(value: object) -> object:
    """Return a cell without the control characters that no workbook may hold."""
    return ILLEGAL_CHARACTERS_RE.sub("\ufffd", value) if isinstance(value, str) else value


def _keep_text(cell: Cell, value: object) -> None:
    """Keep a text that begins like a formula from being one, also when somebody edits the cell."""
    if isinstance(value, str) and is_formula(value):
        cell.data_type, cell.quotePrefix = "s", True
