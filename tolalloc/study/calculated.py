"""The answer of a calculation: the report that a function made."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Document, Section
from tolalloc.reports.header import Header

if TYPE_CHECKING:
    from tolalloc.study.prepared import Prepared


@dataclass(frozen=True, kw_only=True)
class CalculatedAnswer(Answer):
    """The report that a function made, part by part."""

    kind: ClassVar[str] = "calculation"

    title: str = ""
    subtitle: str = ""
    sentences: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    sections: tuple[Section, ...] = ()
    assumptions: tuple[str, ...] = ()
    numbers: dict[str, Any] = field(default_factory=dict)
    """The summary; a field with a factory cannot stand for an abstract property itself."""

    @property
    def summary(self) -> dict[str, Any]:
        """What the function's report says for a program."""
        return self.numbers

    @classmethod
    def of(cls, made: Document, prepared: Prepared) -> CalculatedAnswer:
        """Return the answer of a study whose function made the report."""
        study = prepared.study
        return cls(
            header=Header(name=study.name, model="", seed=made.seed, quick=study.quick),
            title=made.title,
            subtitle=made.subtitle,
            sentences=made.answer,
            warnings=made.warnings,
            sections=made.sections,
            assumptions=made.assumptions,
            numbers=made.summary,
        )
