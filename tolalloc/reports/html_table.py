"""A frame as an HTML table: numbers as a person writes them, the exact one where the pointer rests on it."""

from __future__ import annotations

import re
from functools import singledispatch
from numbers import Integral

import pandas as pd
from markupsafe import Markup, escape

from tolalloc.reading.units import in_cost_units, unit_of

_DECIMALS = {"%": 1, "cost units": 2}
"""Unit → decimals; every other number has four significant digits [-]."""
_SPAN = re.compile(r"[\d.]+…[\d.]+")
_POINT = re.compile(r"\.(?=[A-Za-z])")
_SMALLER = {"several": 8, "many": 12}
"""Class of a table that is set smaller on paper → columns beyond which it is [-]."""


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


_NUMBER = ' class="number"'


def _is_number(value: object) -> bool:
    """Return whether a cell is a number, or a text from one number to another."""
    return isinstance(value, float | Integral) or (isinstance(value, str) and bool(_SPAN.fullmatch(value)))


def written(value: float, unit: str) -> str:
    """Return a number as a report writes it.

    >>> written(41.6543, "cost units"), written(12.345678, "µm"), written(123456.7, "-")
    ('41.65', '12.35', '123457')
    """
    if pd.isna(value):
        return ""
    if unit in _DECIMALS and (value == 0.0 or 0.05 <= abs(value) < 1e6):
        return f"{value:.{_DECIMALS[unit]}f}"
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e15 else f"{value:.4g}"


@singledispatch
def _cell(value: object, unit: str) -> str:  # noqa: ARG001 (only numbers ask for it)
    if hasattr(value, "_repr_html_"):
        return f"<td>{value._repr_html_()}</td>"
    # A name such as disc1.bore1.position may be broken behind its points.
    return f"<td{_NUMBER if _is_number(value) else ''}>{re.sub(_POINT, '.<wbr>', str(escape(value)))}</td>"


@_cell.register
def _(value: float, unit: str) -> str:
    text, exact = written(value, unit), f"{value:.10g}"
    title = f' title="{exact}"' if text and float(text) != float(exact) else ""
    return f"<td{_NUMBER}{title}>{text}</td>"


@_cell.register
def _(value: Integral, unit: str) -> str:  # noqa: ARG001
    return f"<td{_NUMBER}>{value}</td>" if not isinstance(value, bool) else f"<td>{value}</td>"
