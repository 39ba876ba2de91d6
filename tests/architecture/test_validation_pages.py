"""The validation pages: short enough to be read, reached from the summary, each naming what holds its figures.

That what they name exists is tested in ``test_names_on_pages``.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
SUMMARY = DOCS / "validation.md"
PAGES = sorted((DOCS / "validation").glob("*.md"))
WORDS = 2000
"""Most words of the page that a buyer reads [-]."""


def test_the_summary_is_read_in_ten_minutes():
    assert len(SUMMARY.read_text(encoding="utf-8").split()) <= WORDS


def test_the_summary_lists_every_other_page_and_leads_to_it():
    text, own = SUMMARY.read_text(encoding="utf-8"), [page.relative_to(DOCS).as_posix() for page in PAGES]
    assert sorted(text.split("```{toctree}")[1].splitlines()[4:-1]) == [name.removesuffix(".md") for name in own]
    assert {*re.findall(r"\]\((validation/[\w-]+\.md)", text)} == {*own}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_names_what_holds_its_figures(page):
    assert re.search(r"`(tests|studies)/[\w/]+\.py", page.read_text(encoding="utf-8"))
