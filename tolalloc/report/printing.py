"""A report on paper: a browser that is installed prints the page, in its print style, to PDF."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from tolalloc.exceptions import InputError, in_short

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
_PATIENCE = 120
"""Seconds after which a browser that has not printed is given up [s]."""


def browser() -> str:
    """Return the browser that prints.

    Raises
    ------
    InputError
        None is installed.
    """
    found = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if found is None:
        raise InputError(
            "--pdf: no browser that prints is installed; install Chromium or Chrome, or print report.html."
        )
    return found


def print_page(page: Path) -> Path:
    """Print a page beside itself, under the same name, and return the PDF.

    Raises
    ------
    InputError
        There is no browser, or it did not print.
    """
    target = page.absolute().with_suffix(".pdf")
    with TemporaryDirectory() as profile:  # a browser that is open already has a profile of its own
        command = [
            *(browser(), "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"),
            *("--virtual-time-budget=5000", f"--user-data-dir={profile}"),
            *(f"--print-to-pdf={target}", page.absolute().as_uri()),
        ]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=_PATIENCE)
        except (subprocess.SubprocessError, OSError) as error:
            said = f"the browser did not print {in_short(str(page))} ({type(error).__name__})"
            raise InputError(f"--pdf: {said}; the report itself is whole.") from None
    return target
