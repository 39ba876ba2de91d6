"""The tolerance table as a workbook that helps to fill it in: choices to pick from, and what every column means."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.fields import COLUMNS, HEADERS
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import table_rows
from tolalloc.drawings.zones import Feature

_CHOICES = {
    "feature": [str(feature.value) for feature in Feature],
    "distribution": [str(own.value) for own in Distribution],
    "unit": ["µm", "mm"],
    "locked": ["yes", "no"],
    "sorted": ["yes", "no"],
    "grade": [f"IT{grade}" for grade in range(1, 12)],
}
"""Column → what may stand there; of a grade, which is carried through, anything else too."""
_SPARE = 200
"""Rows below the table that have the same choices [-]."""


def table_workbook(sources: Sequence[Source]) -> bytes:
    """Return the workbook of a tolerance table."""
    from openpyxl import Workbook
    from openpyxl.comments import Comment
    from openpyxl.styles import Font, PatternFill
    from openpyxl.utils import get_column_letter
    from openpyxl.worksheet.datavalidation import DataValidation

    book = Workbook()
    sheet = book.active
    sheet.title = "tolerances"
    sheet.append(list(HEADERS.values()))
    for row in table_rows(sources):
        sheet.append(row)
    for at, (name, column) in enumerate(COLUMNS.items(), start=1):
        letter, head = get_column_letter(at), sheet.cell(row=1, column=at)
        head.font, head.fill = Font(bold=True), PatternFill("solid", fgColor="DDE6F0")
        head.comment = Comment(column.meaning, "tolalloc")
        longest = max(len(str(cell.value or "")) for cell in sheet[letter])
        sheet.column_dimensions[letter].width = min(longest, 40) + 3
        if name in _CHOICES:
            allowed = DataValidation(type="list", formula1=f'"{",".join(_CHOICES[name])}"', allow_blank=True)
            allowed.showErrorMessage = name != "grade"
            allowed.error, allowed.errorTitle = f"Allowed are {', '.join(_CHOICES[name])}.", name
            allowed.add(f"{letter}2:{letter}{sheet.max_row + _SPARE}")
            sheet.add_data_validation(allowed)
    sheet.freeze_panes = "B2"
    content = BytesIO()
    book.save(content)
    return content.getvalue()
