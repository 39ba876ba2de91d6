"""What a printed report has lost: cells of tables that are not on paper, charts that are not whole on one page."""

from __future__ import annotations

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

from tolalloc.reports import pdf

MISSING = "no browser that prints a page, or no pdftotext of poppler, is installed"


def can_print() -> bool:
    """Return whether a page can be printed and read again here."""
    return any(map(shutil.which, pdf.BROWSERS)) and shutil.which("pdftotext") is not None


class _Shown(HTMLParser):
    """Texts of the cells and of the pictures that are not folded."""

    def __init__(self, page: str):
        super().__init__()
        self.cells, self.pictures, self._drawn = [""], [], []
        self._open, self._folded = "", 0
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self._separate()
        if tag == "details":
            self._folded += 1
        elif tag == "svg":
            self._drawn = []
            if not self._folded:
                self.pictures.append(self._drawn)
        if tag in ("td", "text"):
            self._open = tag
            (self.cells if tag == "td" else self._drawn).append("")

    def handle_endtag(self, tag):
        self._separate()
        if tag == "details":
            self._folded -= 1
        if tag == self._open:
            self._open = ""

    def _separate(self):
        if self._open == "td":
            self.cells[-1] += " "

    def handle_data(self, data):
        if self._open == "td" and not self._folded:
            self.cells[-1] += data
        elif self._open == "text":
            self._drawn[-1] += data


def lost(page: Path, folder: Path, paper: str = "A4") -> list[str]:
    """Return the cells and charts of a page that are not whole when it is printed on a paper.

    A text is compared without blanks: a cell may have several lines, but no word of it on two. What stands beyond the
    edge of the paper is no text of a PDF for poppler.
    """
    path = folder / f"{page.parent.name}-{paper}.pdf"
    pdf.write_pdf(page, path, paper)
    text = subprocess.run(["pdftotext", "-raw", path, "-"], capture_output=True, text=True, check=True).stdout
    sheets = [_bare(sheet) for sheet in text.split("\f")]
    whole, shown = "".join(sheets), _Shown(page.read_text(encoding="utf-8"))
    found = [cell for cell in shown.cells if _bare(cell) not in whole]
    words = {word for cell in shown.cells for word in re.findall(r"[A-Za-z]{3,}", cell)}
    found += [f"{word} is broken" for word in sorted(words - {*re.findall(r"[A-Za-z]{3,}", text)})]
    for words in shown.pictures:
        if not any(all(_bare(word) in sheet for word in words) for sheet in sheets):
            found.append(f"a chart with {words[:3]}")
    return found


def _bare(text: str) -> str:
    return re.sub(r"\s", "", text)
