"""What a figure shows, said once; `tolalloc.reports.plots` draws it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Literal

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


@dataclass(frozen=True, kw_only=True)
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
    x_label: str = ""
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
