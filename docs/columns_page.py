"""The page of columns: every column of a tolerance table, made from the list that reads and writes it.

python docs/columns_page.py
"""

from __future__ import annotations

from pathlib import Path

from files_page import allowed

from tolalloc.drawings.fields import COLUMNS, HEADERS, ToleranceRow

HEAD = """# Columns of the tolerance table

One row per source, in XLSX or CSV; `zones.xlsx` of a folder that `tolalloc new` made has lists and notes in its heads.
Columns may stand in any order, and only the needed ones must be there.
Your own heads, units, fits and what is refused: [the tolerance table](tolerance-table.md).
"""


def page() -> str:
    """Return the page."""
    found = ToleranceRow.model_json_schema()["properties"]
    rows = [
        f"| {HEADERS[name]} | {'yes' if field.is_required() else ''} | {allowed(found[name])} "
        f"| {COLUMNS[name].meaning} |"
        for name, field in ToleranceRow.model_fields.items()
    ]
    return "\n".join([HEAD, "| column | needed | allowed | meaning |", "|---|---|---|---|", *rows, ""])


if __name__ == "__main__":
    (Path(__file__).parent / "reference" / "columns.md").write_text(page(), encoding="utf-8")
