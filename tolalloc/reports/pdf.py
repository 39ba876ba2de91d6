"""A report on paper: the page printed by a browser that is installed."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from tolalloc.exceptions import InputError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
"""Programs that print a page without a window, in the order in which they are looked for."""
PAPERS = ("A4", "Letter")
"""Sizes of paper, the first one unless another is asked for."""
_LONGEST = 120.0
"""Time that a browser is given [s]."""


def browser() -> str:
    """Return the browser that prints."""
    for name in BROWSERS:
        if found := which(name):
            return found
    raise InputError(
        f"PDF: no browser that prints is installed (looked for {', '.join(BROWSERS)}); leave it out, open "
        "report.html and print it from there."
    )


def require_printable(paper: str) -> None:
    """Raise unless a report can be printed on a paper."""
    if paper not in PAPERS:
        raise InputError.of_argument("report", "paper", paper, " or ".join(PAPERS))
    browser()


def write_pdf(page: Path, path: Path, paper: str = PAPERS[0]) -> None:
    """Print a page into a PDF file.

    Parameters
    ----------
    page
        The page, one file that needs no other.
    path
        The PDF file, replaced if it is there.
    paper
        One of `PAPERS`.
    """
    require_printable(paper)
    program, size = browser(), f"<style>@page {{ size: {paper} portrait; }}</style></head>"
    with TemporaryDirectory(prefix="tolalloc-", ignore_cleanup_errors=True) as folder:
        sized = Path(folder) / "report.html"
        sized.write_text(page.read_text(encoding="utf-8").replace("</head>", size, 1), encoding="utf-8")
        words = [program, "--headless", "--disable-gpu", "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            words.append("--no-sandbox")  # a browser has none to offer to root; the page is our own and runs nothing
        words += [f"--print-to-pdf={path.absolute()}", sized.as_uri()]
        try:
            subprocess.run(words, capture_output=True, check=True, timeout=_LONGEST)
        except (OSError, subprocess.SubprocessError) as error:
            raise InputError(
                f"{path}: {Path(program).name} did not print ({type(error).__name__}); open {page} and print it there."
            ) from None
    if not path.is_file():
        raise InputError(f"{path}: {Path(program).name} printed nothing; open {page} and print it from there.")
