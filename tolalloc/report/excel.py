"""The results as one workbook."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter


def write_sheets(sheets: dict[str, pd.DataFrame], path: Path) -> None:
    """Write one sheet per table, headers frozen, units in every header; a text that begins with = is a formula."""
    with pd.ExcelWriter(path, engine="openpyxl") as writer:
        for name, frame in sheets.items():
            frame.to_excel(writer, sheet_name=name, index=False)
            sheet = writer.sheets[name]
            sheet.freeze_panes = "A2"
            for number, header in enumerate(frame.columns, start=1):
                longest = max([len(str(header)) * 0.7, *(len(str(value)) for value in frame[header].head(40))])
                sheet.column_dimensions[get_column_letter(number)].width = min(max(longest + 2, 10), 60)
                cell = sheet.cell(1, number)
                cell.font, cell.alignment = Font(bold=True), Alignment(wrap_text=True, vertical="top")
                for row in range(2, len(frame) + 2):
                    if isinstance(frame.iloc[row - 2, number - 1], float):
                        sheet.cell(row, number).number_format = "0.0###"
