"""Page, workbook, tables and pictures of a report: one folder that works offline."""

from __future__ import annotations

import json
import platform
from base64 import b64encode
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader
from markupsafe import Markup, escape

from tolalloc.compiled import thread_count
from tolalloc.files import no_formula
from tolalloc.report.charts import chart
from tolalloc.report.document import Document
from tolalloc.report.excel import write_sheets
from tolalloc.report.figure import Figure, HeatMap
from tolalloc.report.page import as_json, script, style
from tolalloc.report.plots import drawn, save_png

_LARGE = (24, 15)
"""Rows and columns beyond which a table is folded [-]."""
_PRINTED = 10
"""Columns beyond which a table is printed small [-]."""
_LISTED = 6
"""Sections beyond which a page begins with a list of them [-]."""
_LIBRARIES = (
    *("numpy", "scipy", "numba", "cvxpy", "clarabel", "highspy"),
    *("pymoo", "SALib", "pandas", "scikit-learn"),
)


def _number(value: object) -> str:
    """Return a cell as text with five significant digits at most."""
    if isinstance(value, float):
        if pd.isna(value):
            return ""
        return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.5g}"
    return str(value)


def _is_large(frame: pd.DataFrame) -> bool:
    """Return whether a page shows a table only when it is asked for."""
    return len(frame) > _LARGE[0] or frame.shape[1] > _LARGE[1]


def html_table(frame: pd.DataFrame) -> Markup:
    """Return a frame as an HTML table; a number that is rounded there says itself whole to a pointer."""
    page = Markup('<table class="data{}"><thead><tr>{}</tr></thead><tbody>{}</tbody></table>')
    many = " many" if frame.shape[1] > _PRINTED else ""
    head = Markup("").join(Markup("<th>{}</th>").format(name) for name in frame.columns)
    rows = (Markup("").join(_html_cell(value) for value in row) for row in frame.itertuples(index=False))
    return page.format(many, head, Markup("").join(Markup("<tr>{}</tr>").format(row) for row in rows))


def _html_cell(value: object) -> Markup:
    if not isinstance(value, float):
        return Markup("<td>{}</td>").format(value)
    text = _number(value)
    whole = "" if not text or float(text) == value else Markup(' title="{}"').format(f"{value:.12g}")
    return Markup('<td class="number"{}>{}</td>').format(whole, text)


def inline_png(figure: Figure | HeatMap) -> str:
    """Return a figure as an image that stands in the page itself."""
    buffer = BytesIO()
    drawn(figure).savefig(buffer, dpi=80, format="png")
    return f'<img alt="{escape(figure.title)}" src="data:image/png;base64,{b64encode(buffer.getvalue()).decode()}">'


def versions() -> dict[str, str]:
    """Return the versions of everything that computes."""
    own = {"tolalloc": version("tolalloc"), "python": platform.python_version()}
    return own | {name: version(name) for name in _LIBRARIES}


def write_document(document: Document, folder: Path) -> None:
    """Write ``report.html``, ``results.xlsx``, ``summary.json``, tables, figures and, last, ``manifest.json``.

    The folder has no such files yet.
    """
    figures = folder / "figures"
    figures.mkdir(parents=True)
    _write_page(document, folder / "report.html")
    (folder / "tables").mkdir()
    for name, frame in document.tables.items():
        write_csv(frame, folder / "tables" / f"{name}.csv")
    assumptions = pd.DataFrame({"assumption": document.assumptions})
    write_sheets({**document.tables, "assumptions": assumptions}, folder / "results.xlsx")
    for name, figure in document.figures.items():
        save_png(figure, figures / f"{name}.png")
    write_json(document.summary, folder / "summary.json")
    known = {"title": document.title, "seed": document.seed, **(document.manifest or {})}
    write_json({**known, "threads": thread_count(), "versions": versions()}, folder / "manifest.json")


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a table in which no text becomes a formula of a spreadsheet."""
    frame.rename(columns=no_formula).map(no_formula).to_csv(path, index=False, encoding="utf-8")


def _write_page(document: Document, path: Path) -> None:
    """Write the page, with its style and its script inside."""
    sections = [
        {
            "part": section.part,
            "heading": section.heading,
            "paragraphs": section.paragraphs,
            "figures": [(figure.title, as_json(chart(figure))) for figure in section.figures],
            "tables": [
                (name, len(frame), _is_large(frame) and not section.unfolded, html_table(frame))
                for name, frame in section.tables
            ],
        }
        for section in document.sections
    ]
    loader = PackageLoader("tolalloc.report")
    page = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = page.get_template("document.html.j2")
    is_long = len(sections) > _LISTED
    content = template.render(document=document, sections=sections, is_long=is_long, style=style(), script=script())
    path.write_text(content, encoding="utf-8")


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write a JSON file."""
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
