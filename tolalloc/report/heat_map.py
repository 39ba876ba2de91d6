"""A table of shares as colours, said once and drawn twice like every other figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import plotly.graph_objects as go
from matplotlib.figure import Figure as Canvas

from tolalloc.report.figure import as_html, save_png

_SHOWN = 0.005
"""A value below is no number in its cell, so that the eye finds those that matter [of the largest]."""


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """A figure of coloured cells.

    Parameters
    ----------
    name
        File name without ending.
    title
        What it shows, as a sentence.
    columns, rows
        Names of the columns and the rows.
    x_label
        What the columns are.
    label
        What a cell says, with its unit.
    values
        One row of numbers per row; the darkest is the largest.
    """

    name: str
    title: str
    columns: Sequence[str]
    rows: Sequence[str]
    x_label: str
    label: str
    values: Sequence[Sequence[float]]

    @property
    def largest(self) -> float:
        """The largest value; a cell without a number has no part in it."""
        return max((value for row in self.values for value in row if isfinite(value)), default=0.0)

    @property
    def texts(self) -> list[list[str]]:
        """The numbers in the cells."""
        least, decimals = _SHOWN * self.largest, 2 if self.largest < 100 else 0
        return [[f"{value:.{decimals}f}" if value >= least else "" for value in row] for row in self.values]


@as_html.register
def _(figure: HeatMap) -> str:
    canvas = go.Figure(
        go.Heatmap(
            x=[name.replace("\n", "<br>") for name in figure.columns],
            y=list(figure.rows),
            z=[list(row) for row in figure.values],
            text=figure.texts,
            texttemplate="%{text}",
            colorscale="Blues",
            zmin=0.0,
            colorbar={"title": figure.label},
            hovertemplate=f"%{{y}}, {figure.x_label} %{{x}}: %{{z:.3f}}<extra></extra>",
        )
    )
    canvas.update_layout(
        template="plotly_white",
        xaxis={"title": figure.x_label, "type": "category"},
        height=max(420, 26 * len(figure.rows) + 140),
        margin={"l": 60, "r": 30, "t": 30, "b": 60},
    )
    canvas.update_yaxes(autorange="reversed", automargin=True)
    return str(canvas.to_html(full_html=False, include_plotlyjs=False))


@save_png.register
def _(figure: HeatMap, path: Path) -> None:
    canvas = Canvas(
        figsize=(max(7.0, 0.62 * len(figure.columns) + 3.5), max(4.0, 0.3 * len(figure.rows) + 1.4)),
        layout="constrained",
    )
    axes = canvas.subplots()
    top = figure.largest or 1.0
    drawn = axes.imshow(figure.values, cmap="Blues", aspect="auto", vmin=0.0, vmax=top)
    for row, texts in enumerate(figure.texts):
        for column, text in enumerate(texts):
            dark = figure.values[row][column] > 0.6 * top
            axes.text(column, row, text, ha="center", va="center", fontsize=7, color="white" if dark else "#222222")
    axes.set_xticks(range(len(figure.columns)), [str(name) for name in figure.columns])
    axes.set_yticks(range(len(figure.rows)), list(figure.rows))
    axes.set(title=figure.title, xlabel=figure.x_label)
    canvas.colorbar(drawn, label=figure.label)
    canvas.savefig(path, dpi=130)
