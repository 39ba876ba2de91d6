"""A report of headings, tables and figures about anything: page, workbook and pictures from one record."""

from __future__ import annotations

import json
import platform
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from tolalloc.report.excel import write_sheets
from tolalloc.report.figure import Figure, as_html, save_png
from tolalloc.report.heat_map import HeatMap

_LARGE = (24, 15)
"""Rows and columns beyond which a table is folded [-]."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One heading with what stands below it.

    Parameters
    ----------
    heading
        The heading.
    paragraphs
        Text.
    figures
        Figures.
    tables
        Sheet name → table, units in the headers.
    """

    heading: str
    paragraphs: tuple[str, ...] = ()
    figures: tuple[Figure | HeatMap, ...] = ()
    tables: tuple[tuple[str, pd.DataFrame], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Document:
    """A report.

    Parameters
    ----------
    title, subtitle
        What it is about, and under which conditions.
    answer
        The answer in a few sentences.
    warnings
        What a reader must know before acting on it.
    sections
        The rest.
    assumptions
        What no source prints.
    summary
        The answer for a program, units of measurement in the names.
    seed
        Seed of the random numbers; none if nothing is random [-].
    """

    title: str
    subtitle: str
    answer: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]
    assumptions: tuple[str, ...]
    summary: dict[str, Any]
    seed: int | None = None


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
    """Return a frame as an HTML table."""
    text = frame.map(_number)
    return Markup(text.to_html(index=False, border=0, classes="data", justify="left"))


def environment() -> Environment:
    """Return where the pages' templates come from."""
    return Environment(loader=PackageLoader("tolalloc.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True)


def write_document(document: Document, folder: Path) -> None:
    """Write ``report.html``, ``results.xlsx``, ``summary.json``, ``manifest.json``, tables as CSV and figures as PNG.

    Parameters
    ----------
    document
        The report.
    folder
        New or empty folder.
    """
    figures = folder / "figures"
    figures.mkdir(parents=True)
    sections = [
        {
            "heading": section.heading,
            "paragraphs": section.paragraphs,
            "figures": [(figure.title, Markup(as_html(figure))) for figure in section.figures],
            "tables": [(name, len(frame), _is_large(frame), html_table(frame)) for name, frame in section.tables],
        }
        for section in document.sections
    ]
    page = environment().get_template("document.html.j2")
    content = page.render(document=document, sections=sections, plotly=Markup(get_plotlyjs()))
    (folder / "report.html").write_text(content, encoding="utf-8")
    sheets = {name: frame for section in document.sections for name, frame in section.tables}
    (folder / "tables").mkdir()
    for name, frame in sheets.items():
        frame.to_csv(folder / "tables" / f"{name}.csv", index=False, encoding="utf-8")
    write_sheets({**sheets, "assumptions": pd.DataFrame({"assumption": document.assumptions})}, folder / "results.xlsx")
    for section in document.sections:
        for figure in section.figures:
            save_png(figure, figures / f"{figure.name}.png")
    write_json(document.summary, folder / "summary.json")
    versions = {"tolalloc": version("tolalloc"), "python": platform.python_version()}
    libraries = ("numpy", "scipy", "numba", "pymoo", "cvxpy", "clarabel", "highspy", "SALib", "pandas")
    write_json(
        {
            "title": document.title,
            "seed": document.seed,
            "versions": versions | {name: version(name) for name in libraries},
        },
        folder / "manifest.json",
    )


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write a JSON file."""
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
