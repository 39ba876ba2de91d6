"""How Sphinx makes the handbook of these pages: ``sphinx-build -W docs docs/_build``, read without a network.

Where TOLALLOC_SCRIPTS is set, only scripts whose path it matches are run, and pictures of the others are left blank.
"""

from __future__ import annotations

import base64
import logging
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

logging.getLogger("ezdxf").setLevel(logging.WARNING)  # what the drawings of the pages would tell

SCRIPTS = os.environ.get("TOLALLOC_SCRIPTS", r"\.py$")
BLANK = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==")

project = "tolalloc"
author = "tolalloc maintainers"
release = version = installed("tolalloc")
extensions = [
    "myst_parser",
    "mathml",
    "links",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "tutorials", "gallery"]
myst_enable_extensions = ["attrs_block", "attrs_inline", "dollarmath"]
html_math_renderer = "mathml"
smartquotes_action = "q"  # two hyphens begin an option
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["handbook.css"]
html_title = f"tolalloc {release}"
html_show_copyright = False
html_show_sourcelink = False
myst_heading_anchors = 3
autodoc_member_order = "bysource"
napoleon_use_rtype = False
sphinx_gallery_conf = {
    "examples_dirs": ["tutorials", "gallery"],
    "gallery_dirs": ["_made/tutorials", "_made/gallery"],
    "image_scrapers": ("pictures.of_answers", "matplotlib"),
    "ignore_repr_types": r"matplotlib\.",
    "thumbnail_size": (400, 250),
    "filename_pattern": SCRIPTS,
    "within_subsection_order": "FileNameSortKey",
    "show_memory": False,
    "write_computation_times": False,
    "abort_on_example_error": True,
}


def whole(page: str) -> str:
    """Return the page of commands with the first sentence of each in its list, which typer cuts, as a link to it."""
    said = dict(re.findall(r"^## `tolalloc (\S+)`\n+(.+)", page, re.MULTILINE))
    page = re.sub(r"^\* `([\w-]+)`: .*$", lambda found: _line(found, said), page, flags=re.MULTILINE)
    return page.replace(", …", " and so on").replace("study = Study(...)", "`study = ta.Study(...)`")


def _line(found: re.Match[str], said: dict[str, str]) -> str:
    name = found[1]
    return f"* [`{name}`](#tolalloc-{name}): {said[name]}" if name in said else found[0]


def _write_commands(_: Any) -> None:
    """Write the page of commands, from the program itself, into a folder that holds nothing of an earlier build."""
    typer = [sys.executable, "-m", "typer", "tolalloc.cli.main", "utils", "docs", "--name", "tolalloc"]
    page = HERE / "_made" / "commands.md"
    shutil.rmtree(page.parent, ignore_errors=True)
    page.parent.mkdir()
    subprocess.run([*typer, "--title", "Commands", "--output", str(page)], check=True, stdout=subprocess.DEVNULL)
    page.write_text(whole(page.read_text(encoding="utf-8")), encoding="utf-8")


def _write_files(_: Any) -> None:
    """Write the page of files beside it, from the records that read them."""
    from files_page import page

    (HERE / "_made" / "files.md").write_text(page(), encoding="utf-8")


def _write_cases(_: Any) -> None:
    """Write the validation manual beside it, from the cases whose values tests show."""
    from cases_page import page

    (HERE / "_made" / "cases.md").write_text(page(), encoding="utf-8")


def _write_blanks(_: Any) -> None:
    """Write a blank picture in place of each that a page shows and no script has made, where not all are run."""
    if "TOLALLOC_SCRIPTS" not in os.environ:
        return
    for page in HERE.rglob("*.md"):
        for name in re.findall(r"\]\(([^)]*_made/[^)]+\.png)\)", page.read_text(encoding="utf-8")):
            picture = page.parent / name
            if not picture.exists():
                picture.parent.mkdir(parents=True, exist_ok=True)
                picture.write_bytes(BLANK)


def _say_levels(_: Any, __: str, ___: str, context: dict[str, Any], ____: Any) -> None:
    """Give the headings of the list of pages a level, which a screen reader needs and Sphinx leaves out."""
    listed = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = listed.replace('role="heading"', 'role="heading" aria-level="2"')


def setup(app: Any) -> None:
    """Make the pages that no hand writes before Sphinx reads them."""
    app.connect("html-page-context", _say_levels, priority=900)  # after the theme has made its list
    app.connect("builder-inited", _write_commands, priority=100)  # before the gallery is made
    app.connect("builder-inited", _write_files, priority=101)
    app.connect("builder-inited", _write_cases, priority=103)
    app.connect("builder-inited", _write_blanks, priority=900)  # after the gallery was made
