"""Page, workbook, tables and pictures of a report: one folder that works offline."""

from __future__ import annotations

import json
import platform
import re
from base64 import b64encode
from collections.abc import Iterable
from datetime import date
from functools import singledispatch
from importlib.metadata import version
from io import BytesIO
from numbers import Integral
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader
from markupsafe import Markup, escape

from tolalloc.reading.files import no_formula
from tolalloc.reading.plugins import plugin_versions
from tolalloc.reading.units import in_cost_units, unit_of
from tolalloc.reports.document import Document, Section
from tolalloc.reports.excel import ANSWER, CONTENTS, write_sheets
from tolalloc.reports.figure import Figure, HeatMap, chart
from tolalloc.reports.page import as_json, scripts, style
from tolalloc.reports.wording import signed, true_minus, words_in
from tolalloc.running.compiled import processor, thread_count

_DECIMALS = {"%": 1, "cost units": 2}
"""Unit → decimals; every other number has four significant digits [-]."""
_SPAN = re.compile(r"[-−]?[\d.]+…[-−]?[\d.]+")
_POINT = re.compile(r"\.(?=[A-Za-z])")
_SMALLER = {"several": 8, "many": 12}
"""Class of a table that is set smaller on paper → columns beyond which it is [-]."""

_NUMBER = ' class="number"'

_NEARLY_ALL = 90.0
"""Share from which two decimals are written, as in a sentence and on a terminal [%]."""

_BELOW_ALL = 99.99
"""Largest share that is written of what is less than all [%]."""

_LARGE = (24, 15)
"""Rows and columns beyond which a table is folded [-]."""

_SENTENCES = 5
"""Sentences of the first answer on a first page that shows more than sentences [-]."""

_MOVING = "moving"

_LISTED = 6
"""Sections beyond which a page begins with a list of them [-]."""

_LIBRARIES = (
    *("numpy", "scipy", "numba", "cvxpy", "clarabel", "highspy"),
    *("pymoo", "SALib", "pandas", "scikit-learn"),
)


def html_table(frame: pd.DataFrame) -> Markup:
    """Return a frame as an HTML table."""
    numeric = [all(map(_is_number, frame.iloc[:, at])) for at in range(frame.shape[1])]
    units = [in_cost_units(unit_of(str(name))) for name in frame.columns]
    head = "".join(
        f"<th{_NUMBER if is_number else ''}>{escape(name)}</th>"
        for name, is_number in zip(frame.columns, numeric, strict=True)
    )
    rows = "\n".join(
        f"<tr>{''.join(_cell(value, unit) for value, unit in zip(row, units, strict=True))}</tr>"
        for row in frame.itertuples(index=False)
    )
    smaller = [name for name, columns in _SMALLER.items() if frame.shape[1] > columns][-1:]
    kind = " ".join(["data", *smaller])
    return Markup(f'<table class="{kind}"><thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>')


def _is_number(value: object) -> bool:
    """Return whether a cell is a number, or a text from one number to another."""
    return isinstance(value, float | Integral) or (isinstance(value, str) and bool(_SPAN.fullmatch(value)))


def written(value: float, unit: str) -> str:
    """Return a number as a report writes it, with a true minus.

    A share just below all is not rounded up to all.

    >>> written(41.6543, "cost units"), written(-12.345678, "µm"), written(123456.7, "-"), written(99.967, "%")
    ('41.65', '−12.35', '123457', '99.97')
    >>> written(99.997, "%"), written(98.958, "%"), written(100.0, "%")
    ('99.99', '98.96', '100.0')
    """
    if pd.isna(value):
        return ""
    if unit == "%" and _NEARLY_ALL < value < 100.0:
        return f"{min(value, _BELOW_ALL):.2f}"
    if unit in _DECIMALS and (value == 0.0 or 0.05 <= abs(value) < 1e6):
        return signed(f"{value:.{_DECIMALS[unit]}f}")
    return signed(f"{value:.0f}" if 1e4 <= abs(value) < 1e15 else f"{value:.4g}")


@singledispatch
def _cell(value: object, unit: str) -> str:  # noqa: ARG001 (only numbers ask for it)
    if hasattr(value, "_repr_html_"):
        return f"<td>{value._repr_html_()}</td>"
    # A name such as disc1.bore1.position may be broken behind its points.
    text = re.sub(_POINT, ".<wbr>", true_minus(str(escape(value))))
    return f"<td{_NUMBER if _is_number(value) else ''}>{text}</td>"


@_cell.register
def _(value: float, unit: str) -> str:
    text, exact = written(value, unit), f"{value:.10g}"
    title = f' title="{signed(exact)}"' if text and float(text.replace("−", "-")) != float(exact) else ""
    return f"<td{_NUMBER}{title}>{text}</td>"


@_cell.register
def _(value: Integral, unit: str) -> str:  # noqa: ARG001
    return f"<td{_NUMBER}>{signed(str(value))}</td>" if not isinstance(value, bool) else f"<td>{value}</td>"


def _is_large(frame: pd.DataFrame) -> bool:
    """Return whether a page shows a table only when it is asked for."""
    return len(frame) > _LARGE[0] or frame.shape[1] > _LARGE[1]


def inline_png(figure: Figure | HeatMap) -> str:
    """Return a figure as an image that stands in the page itself."""
    from tolalloc.reports.plots import drawn

    buffer = BytesIO()
    drawn(figure).savefig(buffer, dpi=80, format="png")
    return f'<img alt="{escape(figure.title)}" src="data:image/png;base64,{b64encode(buffer.getvalue()).decode()}">'


def versions() -> dict[str, str]:
    """Return the versions of everything that computes."""
    own = {"tolalloc": version("tolalloc"), "python": platform.python_version()}
    return own | {name: version(name) for name in _LIBRARIES} | plugin_versions()


def write_document(document: Document, folder: Path) -> None:
    """Write ``report.html``, ``results.xlsx``, ``summary.json``, tables, figures and, last, ``manifest.json``.

    The folder has no such files yet. What draws is imported here: many ask this module for a table alone.
    """
    from tolalloc.reports.plots import save_png

    figures = folder / "figures"
    figures.mkdir(parents=True)
    _write_page(document, folder / "report.html")
    (folder / "tables").mkdir()
    for name, stem in _stems(document.tables).items():
        write_csv(document.tables[name], folder / "tables" / f"{stem}.csv")
    write_sheets(_sheets(document), folder / "results.xlsx", document.figures.values())
    for name, stem in _stems(document.figures).items():
        save_png(document.figures[name], figures / f"{stem}.png")
    write_json(document.summary, folder / "summary.json")
    known = {"title": document.title, "seed": document.seed, **(document.manifest or {})}
    machine = {"processor": processor(), "threads": thread_count(), "versions": versions()}
    write_json({**known, **machine}, folder / "manifest.json")


def _stems(names: Iterable[str]) -> dict[str, str]:
    """Return what a file of each name is called, another one for each: an output may be called ``gap/limit``."""
    found: dict[str, str] = {}
    for name in names:
        stem = re.sub(r'[\\/:*?"<>|\x00-\x1f]', "-", name)
        while stem in found.values():
            stem += "-"
        found[name] = stem
    return found


def _sheets(document: Document) -> dict[str, pd.DataFrame]:
    """Return the sheets of the workbook: the answer and a list of the others first."""
    sheets = {**document.tables, "assumptions": pd.DataFrame({"assumption": document.assumptions})}
    headings = {name: section.heading for section in document.sections for name, _ in section.tables}
    contents = pd.DataFrame(
        [
            {"sheet": name, "rows [-]": len(frame), "of the report's section": headings.get(name, "Assumptions")}
            for name, frame in sheets.items()
        ]
    )
    said = [*document.answer, *document.warnings]
    return {ANSWER: pd.DataFrame({document.title: said}), CONTENTS: contents, **sheets}


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a table in which no text becomes a formula of a spreadsheet."""
    frame.rename(columns=no_formula).map(no_formula).to_csv(path, index=False, encoding="utf-8")


def _answers(document: Document) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return title and sentences of every answer; a report alone has no title beside its own."""
    return document.answers or (("", document.answer),)


def _told(document: Document) -> list[tuple[str, tuple[str, ...]]]:
    """Return what the box of the first page says."""
    # Where a drawing or another answer stands there too, the first page has only the first sentences.
    most = _SENTENCES if document.answers or any(section.first for section in document.sections) else None
    return [
        (title, (number and document.headlines.get(title)) or sentences[:most])
        for number, (title, sentences) in enumerate(_answers(document))
    ]


def _block(document: Document) -> list[tuple[str, str]]:
    """Return the title block: what is not known stays empty, to be filled in by hand."""
    known = {"study": str((document.manifest or {}).get("study", document.title)), **document.title_block}
    labels = ("study", "drawing number", "revision", "author")
    return [*((label, known.get(label, "")) for label in labels), ("date", date.today().isoformat())]


def _in_full(document: Document) -> list[dict[str, Any]]:
    """Return what the first page leaves out of the answers, but for the first one folded."""
    return [
        {
            "part": title,
            "heading": "More on this answer",
            "paragraphs": [sentence for sentence in sentences if sentence not in told],
            "figures": (),
            "tables": (),
            "folded": number > 0,
        }
        for number, ((title, sentences), (_, told)) in enumerate(zip(_answers(document), _told(document), strict=True))
        if sentences != told
    ]


def _drawn_by(record: dict[str, Any]) -> tuple[str, str, Markup]:
    """Return the title of a figure, what kind of script draws it, and the record that it is drawn from."""
    return record["title"], _MOVING if "scene" in record else "figure", as_json(record)


def _told_table(section: Section, name: str, frame: pd.DataFrame) -> tuple[str, int, bool, Markup | None]:
    """Return name and rows of a table, whether it is folded, and what the page shows; a fold in a fold is only named.

    What is large and stands behind a heading decides nothing at a desk: it is read in the workbook.
    """
    is_folded = _is_large(frame) and not section.unfolded
    return name, len(frame), is_folded, None if is_folded and section.folded else html_table(frame)


def _write_page(document: Document, path: Path) -> None:
    """Write the page, all that it shows inside."""
    sections: list[dict[str, Any]] = [
        {
            **vars(section),
            "figures": [_drawn_by(chart(figure)) for figure in section.figures],
            "tables": [_told_table(section, name, frame) for name, frame in section.tables],
        }
        for section in document.sections
    ]
    for full in reversed(_in_full(document)):
        sections.insert(next((at for at, own in enumerate(sections) if own["part"] == full["part"]), 0), full)
    for number, section in enumerate(sections, start=1):
        told = section["paragraphs"] or section["figures"] or any(table for *_, table in section["tables"])
        # A fold that only names tables is opened for nothing.
        section |= {"number": number, "named": section["folded"] and section["tables"] and not told}
    page = Environment(
        loader=PackageLoader("tolalloc.reports", "page"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    ).get_template("document.html.j2")
    headers = [str(header) for frame in document.tables.values() for header in frame.columns]
    texts = [*document.answer, *document.warnings, *(own.heading for own in document.sections), *headers]
    texts += [paragraph for own in document.sections for paragraph in own.paragraphs]
    moving = any(kind == _MOVING for own in sections for _, kind, _ in own["figures"])
    content = page.render(
        document=document,
        style=style(moving=moving),
        scripts=scripts(moving=moving),
        answers=_told(document),
        answer_stands=any(section.first for section in document.sections),
        block=_block(document),
        footer=document.title.replace("\\", "").replace('"', "”"),
        sections=sections,
        is_long=len(sections) > _LISTED,
        glossary=words_in(texts) if len(sections) > _LISTED else (),
    )
    # A number and its % are not parted at the end of a line.
    path.write_text(re.sub(r"(?<=\d) %", "\u00a0%", content), encoding="utf-8")


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write a JSON file."""
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
