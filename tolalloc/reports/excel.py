"""The results as one workbook."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZIP_DEFLATED, ZipFile

import pandas as pd
from openpyxl import load_workbook
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE, Cell
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter
from openpyxl.worksheet.properties import PageSetupProperties
from openpyxl.worksheet.worksheet import Worksheet

from tolalloc.reading.files import is_formula
from tolalloc.reading.units import in_cost_units, unit_of

_MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_FORMATS = {"µm": "0.0##", "mm": "0.0000", "%": "0.0", "cost units": "0.00", "arcsec": "0.00", "arcmin": "0.000"}
"""Unit in a header → format of its numbers."""


ANSWER, CONTENTS = "answer", "contents"
"""Sheets that stand before those of the tables."""


@dataclass(frozen=True)
class Formula:
    """A formula of ours; every other text of a table is text in its workbook, however it begins."""

    text: str  # With its equals sign
    value: float | str | None = None  # What it gives now, for readers that calculate nothing; none if not known

    def __str__(self) -> str:
        return self.text


def write_sheets(sheets: dict[str, pd.DataFrame], path: Path) -> None:
    """Write one sheet per table, headers frozen, units in every header."""
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


def _lay_out(sheets: Mapping[str, Worksheet]) -> None:
    """Let the answer be read as text, and every entry of the contents lead to its sheet."""
    if ANSWER in sheets:
        sheet = sheets[ANSWER]
        sheet.column_dimensions["A"].width = 110
        for (cell,) in sheet.iter_rows(min_row=2):
            cell.alignment = Alignment(wrap_text=True, vertical="top")
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
