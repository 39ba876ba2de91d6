"""The report page: one file that works offline."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, select_autoescape
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from tolalloc.report import tables
from tolalloc.report.figure import as_html
from tolalloc.report.figures import study_figures
from tolalloc.report.results import StudyResults

_RANKING_COLUMNS = (
    "rank [-]",
    "source",
    "contribution [%]",
    "cumulative [%]",
    "total index ST [-]",
    "ST low 5 % [-]",
    "ST high 95 % [-]",
    "S1 reading",
    "rank low 5 % [-]",
    "rank high 95 % [-]",
    "Sens of the quantile [arcsec/µm]",
    "alone at its limit [arcsec]",
)


def _number(value: object) -> str:
    """Return a cell as text with four significant digits at most."""
    if isinstance(value, float):
        if pd.isna(value):
            return ""
        return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    return str(value)


def _table(frame: pd.DataFrame) -> Markup:
    """Return a frame as an HTML table."""
    text = frame.map(_number)
    return Markup(text.to_html(index=False, border=0, classes="data", justify="left"))


def write_page(results: StudyResults, path: Path) -> None:
    """Write ``report.html``: text, tables and figures, plotly.js embedded once."""
    environment = Environment(
        loader=PackageLoader("tolalloc.report"), autoescape=select_autoescape(), trim_blocks=True, lstrip_blocks=True
    )
    ranked = tables.ranking(results)
    content: dict[str, Any] = {
        "results": results,
        "allocation": results.allocation,
        "plotly": Markup(get_plotlyjs()),
        "figures": {figure.name: (figure.title, Markup(as_html(figure))) for figure in study_figures(results)},
        "first": ranked.iloc[0],
        "ninety": int((ranked["cumulative [%]"] < 90).sum()) + 1,
        "ranking": _table(ranked[list(_RANKING_COLUMNS)]),
        "before_after": _table(tables.before_after(results)),
        "modification": _table(tables.modification(results)),
        "capability": _table(tables.capability(results)),
        "stack_up": _table(tables.stack_up(results)),
        "verified": _table(tables.verified(results)),
        "mappings": _table(tables.mappings(results)),
    }
    page = environment.get_template("report.html.j2").render(content)
    path.write_text(page, encoding="utf-8")
