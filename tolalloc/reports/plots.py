"""A figure as a still picture, drawn by matplotlib: no browser is needed for it."""

from __future__ import annotations

from functools import singledispatch
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Canvas

from tolalloc.reports.figure import BINS, Figure, HeatMap
from tolalloc.reports.fonts import with_letters

_SEARCHED = 4000
"""Points up to which the emptiest corner is looked for, which takes long among many [-]."""
_UPRIGHT = 7
"""Letters of a line that stand below a cell of a map without meeting those of the next one [-]."""
_LETTERS = 10.5
"""Letters of a title per width of a picture [1/inch]."""
COLOURS = ("#1f4e79", "#d9822b", "#3a8f5c", "#8c3b7a", "#7f7f7f", "#b8a100", "#17a2b8", "#c0392b", "#6a4fc3")


def _draw_bars(axes: Any, figure: Figure, number: int) -> None:
    """Draw one of several sets of horizontal bars."""
    item, count = figure.series[number], sum(item.kind == "bars" for item in figure.series)
    height = 0.8 / count
    places = [row + height * (number - (count - 1) / 2) for row in range(len(item.x))]
    error = [np.subtract(item.y, item.low), np.subtract(item.high, item.y)] if item.low else None
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
        counts, _ = np.histogram(np.asarray(item.x, float), edges)  # what matplotlib does itself, of millions at once
        axes.hist(edges[:-1], edges, weights=share * counts, label=item.label, color=colour, alpha=0.55)
    else:
        _draw_bars(axes, figure, number)


@singledispatch
def save_png(figure: Figure | HeatMap, path: Path) -> None:
    """Draw a figure into a PNG file."""
    drawn(figure).savefig(path, dpi=130)


def _title(canvas: Canvas, title: str) -> None:
    """Put a title over the whole picture, on as many lines as its width asks for."""
    canvas.suptitle(fill(title, int(_LETTERS * canvas.get_figwidth())), fontsize=12)


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
    _title(canvas, figure.title)
    axes.set(xlabel=figure.x_label, ylabel=figure.y_label)
    if figure.logarithmic:
        axes.set_yscale("log")
    if figure.logarithmic_x:
        axes.set_xscale("log")
    if figure.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)
    points = sum(len(item.x) for item in figure.series)
    axes.legend(loc="best" if points <= _SEARCHED else "upper right")
    return with_letters(canvas)


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
    names = [str(name) for name in figure.columns]
    longest = max((len(line) for name in names for line in name.splitlines()), default=0)
    axes.set_xticks(range(len(names)), names, rotation=90 if longest > _UPRIGHT else 0)
    axes.set_yticks(range(len(figure.rows)), list(figure.rows))
    _title(canvas, figure.title)
    axes.set(xlabel=figure.x_label)
    canvas.colorbar(image, label=figure.label)
    return with_letters(canvas)
