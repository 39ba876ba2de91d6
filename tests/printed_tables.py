"""Tables of the validation pages, each written by the test that computes it: a row that differs from the page fails."""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"
SUMMARY = "validation.md"


def printed(page: str, head: str) -> list[str]:
    """Return the rows of the table with this head on a page of the handbook."""
    lines = (DOCS / page).read_text(encoding="utf-8").splitlines()
    assert head in lines, f"{page} has no table with the head {head}"
    return list(takewhile(lambda line: line.startswith("|"), lines[lines.index(head) + 2 :]))


def row(*cells: str) -> str:
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def number(value: float, form: str) -> str:
    """Return a number in a format, with a true minus sign."""
    return f"{value:{form}}".replace("-", "−")
