"""The report page: one file that works offline."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from tolalloc.report import tables
from tolalloc.report.figures import study_figures
from tolalloc.report.plots import as_html
from tolalloc.report.results import StudyResults
from tolalloc.report.writer import html_table

_RANKING_COLUMNS = (
    "rank [-]",
    "source",
    "contribution [%]",
    "cumulative [%]",
    "total index ST [-]",
    "ST low 5 % [-]",
    "ST high 95 % [-]",
    "S1 reading",
    "P(before the next) [%]",
    "rank low 5 % [-]",
    "rank high 95 % [-]",
    "Sens of the quantile [arcsec/µm]",
    "alone at its limit [arcsec]",
)


def write_page(results: StudyResults, path: Path) -> None:
    """Write ``report.html``: text, tables and figures, plotly.js embedded once."""
    ranked = tables.ranking(results)
    content: dict[str, Any] = {
        "results": results,
        "allocation": results.allocation,
        "plotly": Markup(get_plotlyjs()),
        "figures": {figure.name: (figure.title, Markup(as_html(figure))) for figure in study_figures(results)},
        "first": ranked.iloc[0],
        "ninety": int((ranked["cumulative [%]"] < 90).sum()) + 1,
        "ranking": html_table(ranked[list(_RANKING_COLUMNS)]),
        "before_after": html_table(tables.before_after(results)),
        "modification": html_table(tables.modification(results)),
        "capability": html_table(tables.capability(results)),
        "stack_up": html_table(tables.stack_up(results)),
        "verified": html_table(tables.verified(results)),
        "mappings": html_table(tables.mappings(results)),
    }
    page = (
        Environment(loader=PackageLoader("tolalloc.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True)
        .get_template("report.html.j2")
        .render(content)
    )
    path.write_text(page, encoding="utf-8")
