"""A figure drawn twice: interactive in the page by plotly, as PNG by matplotlib.

A still picture needs no browser on the user's machine, and the page keeps its zoom and hover.
"""

from __future__ import annotations

from functools import singledispatch
from math import log10
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from matplotlib.figure import Figure as Canvas

from tolalloc.report.figure import BINS, Figure, HeatMap, Series

COLOURS = ("#1f4e79", "#d9822b", "#3a8f5c", "#8c3b7a", "#7f7f7f", "#b8a100", "#17a2b8", "#c0392b")


def _draw_bars(axes: Any, figure: Figure, number: int) -> None:
    """Draw one of several sets of horizontal bars."""
    item, count = figure.series[number], sum(item.kind == "bars" for item in figure.series)
    height = 0.8 / count
    places = [row + height * (number - (count - 1) / 2) for row in range(len(item.x))]
    error = None
    if item.low:
        error = [
            [y - low for y, low in zip(item.y, item.low, strict=True)],
            [high - y for y, high in zip(item.y, item.high, strict=True)],
        ]
    colour = COLOURS[number % len(COLOURS)]
    axes.barh(places, item.y, height, xerr=error, label=item.label, color=colour, ecolor="#444444", capsize=2)
    axes.set_yticks(range(len(item.x)), [str(name) for name in item.x])


def _draw(axes: Any, figure: Figure, number: int) -> None:
    """Draw one set of data by matplotlib."""
    item, colour = figure.series[number], COLOURS[number % len(COLOURS)]
    if item.kind == "line":
        axes.plot(item.x, item.y, label=item.label, color=colour, linewidth=1.2)
        if item.low:
            axes.fill_between(item.x, item.low, item.high, color=colour, alpha=0.18, linewidth=0)
    elif item.kind == "points":
        axes.plot(item.x, item.y, "o", label=item.label, color=colour, markersize=7)
    elif item.kind == "stems":
        offset = 0.28 * (number - (len(figure.series) - 1) / 2)
        axes.bar([float(x) + offset for x in item.x], item.y, 0.28, label=item.label, color=colour)
    elif item.kind == "histogram":
        start, width = figure.bins
        edges, share = [start + width * edge for edge in range(BINS + 2)], 100.0 / max(len(item.x), 1)
        axes.hist(item.x, edges, weights=[share] * len(item.x), label=item.label, color=colour, alpha=0.55)
    else:
        _draw_bars(axes, figure, number)


def save_png(figure: Figure | HeatMap, path: Path) -> None:
    """Draw a figure into a PNG file."""
    drawn(figure).savefig(path, dpi=130)


@singledispatch
def drawn(figure: object) -> Canvas:
    """Return a figure drawn by matplotlib."""
    raise TypeError(f"{type(figure).__name__} is no figure")


@drawn.register
def _(figure: Figure) -> Canvas:
    canvas = Canvas(figsize=(9.0, max(4.5, 0.34 * figure.rows + 1.4)), layout="constrained")
    axes = canvas.subplots()
    for number in range(len(figure.series)):
        _draw(axes, figure, number)
    for value, name in figure.vertical:
        axes.axvline(value, color="#b00020", linestyle="--", label=name)
    for value, name in figure.horizontal:
        axes.axhline(value, color="#b00020", linestyle="--", label=name)
    if figure.rows:
        axes.invert_yaxis()
    axes.set(title=figure.title, xlabel=figure.x_label, ylabel=figure.y_label)
    if figure.logarithmic:
        axes.set_yscale("log")
    if figure.logarithmic_x:
        axes.set_xscale("log")
    if figure.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)
    axes.legend()
    return canvas


def _faint(colour: str) -> tuple[int, int, int, float]:
    """Return red, green, blue and a small opacity of a colour."""
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return red, green, blue, 0.18


def _interval(item: Series) -> dict[str, Any] | None:
    """Return plotly's error bars around the lengths of bars."""
    if not item.low:
        return None
    return {
        "type": "data",
        "symmetric": False,
        "array": [high - y for y, high in zip(item.y, item.high, strict=True)],
        "arrayminus": [y - low for y, low in zip(item.y, item.low, strict=True)],
        "color": "#444444",
    }


def _add(canvas: go.Figure, figure: Figure, number: int) -> None:
    """Add one set of data by plotly."""
    item, colour = figure.series[number], COLOURS[number % len(COLOURS)]
    if item.kind == "line":
        canvas.add_scatter(x=item.x, y=item.y, name=item.label, mode="lines", line={"color": colour, "width": 1.4})
        if item.low:
            band = {"x": item.x, "mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
            canvas.add_scatter(y=item.low, **band)
            canvas.add_scatter(y=item.high, fill="tonexty", fillcolor=f"rgba{_faint(colour)}", **band)
    elif item.kind == "points":
        canvas.add_scatter(x=item.x, y=item.y, name=item.label, mode="markers", marker={"color": colour, "size": 10})
    elif item.kind == "stems":
        canvas.add_bar(x=item.x, y=item.y, name=item.label, marker_color=colour)
    elif item.kind == "histogram":
        start, width = figure.bins
        bins = {"start": start, "end": start + width * (BINS + 1), "size": width}
        canvas.add_histogram(
            x=item.x, name=item.label, marker_color=colour, opacity=0.6, xbins=bins, histnorm="percent"
        )
    else:
        canvas.add_bar(
            y=item.x, x=item.y, name=item.label, orientation="h", marker_color=colour, error_x=_interval(item)
        )


@singledispatch
def as_html(figure: object) -> str:
    """Return a figure as a page fragment; the page itself carries plotly.js once."""
    raise TypeError(f"{type(figure).__name__} is no figure")


@as_html.register
def _(figure: Figure) -> str:
    canvas = go.Figure()
    for number in range(len(figure.series)):
        _add(canvas, figure, number)
    # On a logarithmic axis plotly places a line by its value and a text by the logarithm of it.
    for value, name in figure.vertical:
        canvas.add_vline(x=value, line_dash="dash", line_color="#b00020")
        place = log10(value) if figure.logarithmic_x else value
        canvas.add_annotation(x=place, y=1, yref="paper", text=name, showarrow=False, xanchor="left", yanchor="top")
    for value, name in figure.horizontal:
        canvas.add_hline(y=value, line_dash="dash", line_color="#b00020")
        place = log10(value) if figure.logarithmic else value
        canvas.add_annotation(x=1, xref="paper", y=place, text=name, showarrow=False, xanchor="right", yanchor="bottom")
    canvas.update_layout(
        template="plotly_white",
        barmode="overlay" if any(item.kind == "histogram" for item in figure.series) else "group",
        xaxis_title=figure.x_label,
        yaxis_title=figure.y_label,
        height=max(420, 24 * figure.rows + 140),
        # Room for the rows of the legend; the buttons stand beside the picture and not over it.
        margin={"l": 60, "r": 60, "t": 36 + 20 * (len(figure.series) // 4), "b": 60},
        legend={"orientation": "h", "y": 1.01, "yanchor": "bottom"},
        modebar={"orientation": "v"},
    )
    if figure.logarithmic:
        canvas.update_yaxes(type="log", exponentformat="power")
    if figure.logarithmic_x:
        canvas.update_xaxes(type="log", exponentformat="power")
    if figure.equal:
        canvas.update_yaxes(scaleanchor="x", scaleratio=1)
    if figure.rows:
        canvas.update_yaxes(autorange="reversed", automargin=True)
    return str(canvas.to_html(full_html=False, include_plotlyjs=False))


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


@drawn.register
def _(figure: HeatMap) -> Canvas:
    canvas = Canvas(
        figsize=(max(7.0, 0.62 * len(figure.columns) + 3.5), max(4.0, 0.3 * len(figure.rows) + 1.4)),
        layout="constrained",
    )
    axes = canvas.subplots()
    top = figure.largest or 1.0
    image = axes.imshow(figure.values, cmap="Blues", aspect="auto", vmin=0.0, vmax=top)
    for row, texts in enumerate(figure.texts):
        for column, text in enumerate(texts):
            dark = figure.values[row][column] > 0.6 * top
            axes.text(column, row, text, ha="center", va="center", fontsize=7, color="white" if dark else "#222222")
    axes.set_xticks(range(len(figure.columns)), [str(name) for name in figure.columns])
    axes.set_yticks(range(len(figure.rows)), list(figure.rows))
    axes.set(title=figure.title, xlabel=figure.x_label)
    canvas.colorbar(image, label=figure.label)
    return canvas
