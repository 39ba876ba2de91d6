"""The report that a user's function made is told as it is."""

from __future__ import annotations

from typing import Any

from tolalloc.reports.document import Document, Section
from tolalloc.reports.teller import Teller


class CalculationTeller(Teller[Document]):
    """The report that a function made, part by part."""

    @property
    def title(self) -> str:
        """What the report is about."""
        return self.result.title

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        return self.result.subtitle

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        return self.result.answer

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return self.result.warnings

    @property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""
        return self.result.sections

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        return self.result.assumptions

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program."""
        return self.result.summary


TELLER = CalculationTeller
