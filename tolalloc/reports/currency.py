"""Everything that is said to people, in the currency that costs are counted in."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

from tolalloc.reading.units import COST_UNITS
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, HeatMap, Series

_RECORDS = (Document, Section, Figure, HeatMap, Series)

Said = TypeVar("Said")


def in_currency(said: Said, currency: str) -> Said:
    """Return what is said to people with the currency for cost units; without one, as it is.

    What programs read, a summary and a manifest, keeps its names.

    >>> in_currency(("cost [cost units]", "Cost 41.65 cost units."), "EUR")
    ('cost [EUR]', 'Cost 41.65 EUR.')
    """
    return _said(said, currency) if currency else said


def _said(said: Any, currency: str) -> Any:
    import pandas as pd

    if isinstance(said, str):
        return said.replace(COST_UNITS, currency)
    if type(said) is tuple:  # a record of its own keeps its kind
        return tuple(_said(one, currency) for one in said)
    if isinstance(said, pd.DataFrame):
        return said.rename(columns=lambda header: _said(header, currency)).map(lambda cell: _said(cell, currency))
    if isinstance(said, _RECORDS) and is_dataclass(said):
        return replace(said, **{own.name: _said(getattr(said, own.name), currency) for own in fields(said)})
    return said  # numbers, and what programs read
