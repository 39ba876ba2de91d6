"""The report that a user's function made is told as it is."""

from __future__ import annotations

from typing import Any

from tolalloc.reports.document import Document
from tolalloc.reports.teller import Teller


def _part(name: str) -> Any:
    """Return the property that is a part of the report."""
    return property(lambda teller: getattr(teller.result, name))


class CalculationTeller(Teller[Document]):
    """The report that a function made, part by part."""

    title, subtitle, sentences = _part("title"), _part("subtitle"), _part("answer")
    warnings, assumptions = _part("warnings"), _part("assumptions")
    sections, summary = _part("sections"), _part("summary")


TELLER = CalculationTeller
