"""The results as one workbook."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter

from tolalloc.drawing.tolerance_table import table_frame
from tolalloc.report import tables
from tolalloc.report.results import StudyResults


def write_workbook(results: StudyResults, path: Path) -> None:
    """Write ``results.xlsx``: one sheet per table, headers frozen, units in every header."""
    sheets = {
        "capability": tables.capability(results),
        "drawing": tables.before_after(results),
        "allocation": table_frame(tables.allocated_sources(results), path.parent),
        "modification": tables.modification(results),
        "sensitivity": tables.ranking(results),
        "stack-up": tables.stack_up(results),
        "pareto": tables.pareto(results),
        "verified designs": tables.verified(results),
        "orders": tables.orders(results),
        "distributions": tables.mappings(results),
        "assumptions": pd.DataFrame({"assumption": results.assumptions}),
    }
    write_sheets(sheets, path)


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
