"""The answer of a calculation: the report that a function made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from tolalloc.report.answer import Answer, Header
from tolalloc.report.document import Document, Section

if TYPE_CHECKING:
    from tolalloc.study.prepared import Prepared


@dataclass(frozen=True, kw_only=True)
class CalculatedAnswer(Answer):
    """The report that a function made.

    Parameters
    ----------
    made
        The report.
    """

    kind: ClassVar[str] = "calculation"

    made: Document

    @classmethod
    def of(cls, made: Document, prepared: Prepared) -> CalculatedAnswer:
        """Return the answer of a study whose function made the report."""
        study = prepared.study
        return cls(made=made, header=Header(name=study.name, model="", seed=made.seed, quick=study.quick))

    @property
    def title(self) -> str:
        """Its own."""
        return self.made.title

    @property
    def subtitle(self) -> str:
        """Its own."""
        return self.made.subtitle

    @property
    def sentences(self) -> tuple[str, ...]:
        """Its own."""
        return self.made.answer

    @property
    def warnings(self) -> tuple[str, ...]:
        """Its own."""
        return self.made.warnings

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Its own."""
        return self.made.assumptions

    @property
    def sections(self) -> tuple[Section, ...]:
        """Its own."""
        return self.made.sections

    @property
    def summary(self) -> dict[str, Any]:
        """Its own."""
        return self.made.summary
