"""The results as one workbook."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE, Cell
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter

from tolalloc.files import is_formula


@dataclass(frozen=True)
class Formula:
    """A formula of ours; every other text of a table is text in its workbook, however it begins."""

    text: str  # With its equals sign

    def __str__(self) -> str:
        return self.text


def write_sheets(sheets: dict[str, pd.DataFrame], path: Path) -> None:
    """Write one sheet per table, headers frozen, units in every header."""
    with pd.ExcelWriter(path, engine="openpyxl") as writer:
        for name, frame in sheets.items():
            frame.rename(columns=_shown).map(_shown).to_excel(writer, sheet_name=name, index=False)
            sheet = writer.sheets[name]
            sheet.freeze_panes = "A2"
            for number, header in enumerate(frame.columns, start=1):
                longest = max([len(str(header)) * 0.7, *(len(str(value)) for value in frame[header].head(40))])
                sheet.column_dimensions[get_column_letter(number)].width = min(max(longest + 2, 10), 60)
                cell = sheet.cell(1, number)
                cell.font, cell.alignment = Font(bold=True), Alignment(wrap_text=True, vertical="top")
                _keep_text(cell, header)
                for row in range(2, len(frame) + 2):
                    value, cell = frame.iloc[row - 2, number - 1], sheet.cell(row, number)
                    if isinstance(value, float):
                        cell.number_format = "0.0###"
                    _keep_text(cell, value)


def _shown(value: object) -> object:
    """Return a cell without the control characters that no workbook may hold."""
    return ILLEGAL_CHARACTERS_RE.sub("\ufffd", value) if isinstance(value, str) else value


def _keep_text(cell: Cell, value: object) -> None:
    """Keep a text that begins like a formula from being one, also when somebody edits the cell."""
    if isinstance(value, str) and is_formula(value):
        cell.data_type, cell.quotePrefix = "s", True
