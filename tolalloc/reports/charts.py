"""A figure as the record that a page draws it from: plain numbers of six digits, histograms already in their bins."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import singledispatch
from math import isfinite
from typing import Any

import numpy as np

from tolalloc.reports.figure import BINS, Figure, HeatMap, Series


@singledispatch
def chart(figure: object) -> dict[str, Any]:
    """Return what ``page/chart.js`` draws a figure from; it can be written as JSON.

    Raises
    ------
    TypeError
        It is no figure.

    Examples
    --------
    >>> line = Series(label="unit 1", kind="line", x=[0.0, 1.0], y=[2.0, float("nan")])
    >>> chart(Figure(name="te", title="TE", x_label="angle [°]", series=(line,)))["series"][0]["y"]
    [2.0, None]
    """
    raise TypeError(f"{type(figure).__name__} is no figure")


@chart.register
def _(figure: Figure) -> dict[str, Any]:
    return {
        "title": figure.title,
        "x_label": figure.x_label,
        "y_label": figure.y_label,
        "series": [_series(item, figure) for item in figure.series],
        "vertical": [[value, name] for value, name in figure.vertical],
        "horizontal": [[value, name] for value, name in figure.horizontal],
        "logarithmic": figure.logarithmic,
        "logarithmic_x": figure.logarithmic_x,
        "equal": figure.equal,
    }


@chart.register
def _(figure: HeatMap) -> dict[str, Any]:
    return {
        "title": figure.title,
        "x_label": figure.x_label,
        "label": figure.label,
        "columns": list(figure.columns),
        "rows": list(figure.rows),
        "values": [numbers(row) for row in figure.values],
        "texts": figure.texts,
    }


def numbers(values: Iterable[object]) -> list[float | None]:
    """Return numbers with six significant digits; what is none becomes nothing."""
    found = (float(value) for value in values)  # type: ignore[arg-type]
    return [float(f"{value:.6g}") if isfinite(value) else None for value in found]


def _series(item: Series, figure: Figure) -> dict[str, Any]:
    if item.kind == "histogram":
        return {"label": item.label, "kind": item.kind, **shares(item.x, *figure.bins)}
    names = item.kind == "bars"
    return {
        "label": item.label,
        "kind": item.kind,
        "x": [str(name) for name in item.x] if names else numbers(item.x),
        "y": numbers(item.y),
        "low": numbers(item.low),
        "high": numbers(item.high),
    }


def shares(values: Sequence[object], start: float, width: float) -> dict[str, Any]:
    """Return a histogram: the lower edges of its bins, their width and the share of the values in each [%]."""
    edges = start + width * np.arange(BINS + 2)
    known = np.asarray(values, dtype=float)
    counts, _ = np.histogram(known[np.isfinite(known)], edges)
    return {"x": numbers(edges[:-1]), "y": numbers(100.0 * counts / max(known.size, 1)), "width": width}
