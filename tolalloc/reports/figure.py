"""What a figure shows, said once, and the record that a page draws it from; `tolalloc.reports.plots` draws it too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, dataclass
from functools import singledispatch
from math import isfinite
from typing import Any, Literal

import numpy as np

BINS = 60
"""Bins of a histogram [-]."""
_SHOWN = 0.005
"""A value below is no number in its cell, so that the eye finds those that matter [of the largest]."""


@dataclass(frozen=True, kw_only=True)
class Series:
    """One set of data in a figure.

    Parameters
    ----------
    label
        Name in the legend.
    kind
        How it is drawn; ``bars`` are horizontal with one category per entry of x.
    x, y
        Data; for ``bars`` the categories and the lengths, for ``histogram`` the values alone, drawn as shares of their
        number [%], so that samples of different size can be set against each other.
    low, high
        Ends of the intervals around y of ``bars``, edges of the band around a ``line``.
    """

    label: str
    kind: Literal["line", "points", "stems", "bars", "histogram"]
    x: Sequence[float] | Sequence[str]
    y: Sequence[float] = ()
    low: Sequence[float] = ()
    high: Sequence[float] = ()

    @classmethod
    def line(
        cls, label: str, x: Iterable[float], y: Iterable[float], low: Iterable[float] = (), high: Iterable[float] = ()
    ) -> Series:
        """Return a line, with a band around it where edges are given."""
        return cls(label=label, kind="line", x=list(x), y=list(y), low=list(low), high=list(high))

    @classmethod
    def points(cls, label: str, x: Iterable[float], y: Iterable[float]) -> Series:
        """Return single points."""
        return cls(label=label, kind="points", x=list(x), y=list(y))

    @classmethod
    def bars(
        cls, label: str, x: Iterable[str], y: Iterable[float], low: Iterable[float] = (), high: Iterable[float] = ()
    ) -> Series:
        """Return horizontal bars, a category each, with intervals where their ends are given."""
        return cls(label=label, kind="bars", x=list(x), y=list(y), low=list(low), high=list(high))


@dataclass(frozen=True)
class Figure:
    """A figure.

    Parameters
    ----------
    name
        File name without ending.
    title
        What it shows, as a sentence.
    x_label, y_label
        Axis titles with units; bars need none of y.
    series
        The data.
    vertical, horizontal
        Marked values on the axes, with their names.
    logarithmic, logarithmic_x
        Whether the y axis is logarithmic, and whether the x axis is.
    equal
        Whether a length is the same on both axes, as in a drawing.
    """

    name: str
    title: str
    x_label: str
    y_label: str = ""
    _: KW_ONLY
    series: tuple[Series, ...]
    vertical: tuple[tuple[float, str], ...] = ()
    horizontal: tuple[tuple[float, str], ...] = ()
    logarithmic: bool = False
    logarithmic_x: bool = False
    equal: bool = False

    @property
    def rows(self) -> int:
        """Number of categories of horizontal bars."""
        return max((len(item.x) for item in self.series if item.kind == "bars"), default=0)

    @property
    def bins(self) -> tuple[float, float]:
        """Start and width of the bins that all histograms of the figure share [unit of x]."""
        values = [np.asarray(item.x, float) for item in self.series if item.kind == "histogram" and len(item.x)]
        low = min((float(own.min()) for own in values), default=0.0)
        high = max((float(own.max()) for own in values), default=1.0)
        return low, (high - low) / BINS or 1.0


@dataclass(frozen=True)
class HeatMap:
    """A figure of coloured cells."""

    name: str  # File name without ending
    title: str  # What it shows, as a sentence
    _: KW_ONLY
    x_label: str = ""  # What the columns are
    label: str  # What a cell says, with its unit
    # Names of the columns and the rows
    columns: Sequence[str]
    rows: Sequence[str]
    values: Sequence[Sequence[float]]  # One row of numbers per row; the darkest is the largest

    @property
    def largest(self) -> float:
        """The largest value; a cell without a number has no part in it."""
        return max((value for row in self.values for value in row if isfinite(value)), default=0.0)

    @property
    def texts(self) -> list[list[str]]:
        """The numbers in the cells."""
        least, decimals = _SHOWN * self.largest, 2 if self.largest < 100 else 0
        return [[f"{value:.{decimals}f}" if value >= least else "" for value in row] for row in self.values]


@singledispatch
def chart(figure: object) -> dict[str, Any]:
    """Return what ``page/chart.js`` draws a figure from; it can be written as JSON.

    Examples
    --------
    >>> line = Series(label="unit 1", kind="line", x=[0.0, 1.0], y=[2.0, float("nan")])
    >>> chart(Figure(name="te", title="TE", x_label="angle [°]", series=(line,)))["series"][0]["y"]
    [2.0, None]
    """
    raise TypeError(f"{type(figure).__name__} is no figure")


@chart.register
def _(figure: Figure) -> dict[str, Any]:
    return _fields(figure) | {"series": [_series(item, figure) for item in figure.series]}


@chart.register
def _(figure: HeatMap) -> dict[str, Any]:
    return _fields(figure) | {"values": [numbers(row) for row in figure.values], "texts": figure.texts}


def _fields(figure: Figure | HeatMap) -> dict[str, Any]:
    """Return what a figure states, without the name of its file."""
    return {name: own for name, own in vars(figure).items() if name != "name"}


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
    edge, wide = numbers(edges[:-1]), numbers([width])[0]
    return {"x": edge, "y": numbers(100.0 * counts / max(known.size, 1)), "width": wide}
