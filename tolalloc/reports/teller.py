"""What tells people of a result: one teller for each kind of result, a module of `tolalloc.reports.tellers`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from functools import cached_property
from importlib import import_module
from pathlib import Path
from traceback import print_exc
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tolalloc.reports.document import Document, Section
from tolalloc.reports.header import Header
from tolalloc.reports.wording import quantity, with_unit

if TYPE_CHECKING:
    import pandas as pd

Result = TypeVar("Result")

_FAILED_HEADING = "A part of this report failed"
_FAILED = "The part after “{last}” could not be written: {fault}. The rest stands; the terminal shows where it failed."


class Teller(ABC, Generic[Result]):
    """What is said and shown of a result; a subclass with ``kind=`` tells of all answers of that kind.

    Parameters
    ----------
    result
        The numbers.
    header
        What every answer says of its run.
    """

    def __init_subclass__(cls, kind: str = "") -> None:
        if kind:
            _OWN[kind] = cls

    def __init__(self, result: Result, header: Header) -> None:
        self.result, self.header = result, header

    @property
    @abstractmethod
    def title(self) -> str:
        """What the answer is about."""

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        conditions = ((name, value) for name, value in self.header.conditions.items() if name != "unit")
        return ", ".join(f"{quantity(name)} {with_unit(f'{value:g}', name)}" for name, value in conditions)

    @property
    @abstractmethod
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return ()

    @property
    @abstractmethod
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""

    def standing(self, *makers: Callable[[], Iterable[Section]]) -> tuple[Section, ...]:
        """Return the sections of all makers; one that fails is a card that says so, and the rest stands."""
        found = list[Section]()
        for maker in makers:
            try:
                found.extend(maker())
            except Exception as fault:
                print_exc()
                said = _FAILED.format(last=found[-1].heading if found else self.title, fault=f"{fault!r}")
                found.append(Section(heading=_FAILED_HEADING, paragraphs=(said,), first=True))
        return tuple(found)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        return self.header.assumptions

    @property
    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""

    @property
    def shown(self) -> tuple[str, ...]:
        """Columns of the first table that a terminal shows; the first six unless a teller says otherwise."""
        return ()

    @property
    def before(self) -> tuple[str, ...]:
        """What is better done before another answer is acted on, such as moving a nominal; said first of all."""
        return ()

    @property
    def headline(self) -> tuple[str, ...]:
        """What a terminal, and a first page behind another answer, says in short; nothing where all is said."""
        return ()

    @property
    def headline_table(self) -> tuple[pd.DataFrame, str] | None:
        """The one table that a terminal shows with it, and its title; none unless a teller says otherwise."""
        return None

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Tables that a command prints above the sentences, each with its title."""
        return ()

    def add_files(self, folder: Path) -> None:
        """Add files of its own to a written report; nothing unless a teller says otherwise."""

    @cached_property
    def document(self) -> Document:
        """The report on this answer alone."""
        return Document(
            title=self.title,
            subtitle=self.subtitle,
            answer=self.sentences,
            warnings=self.warnings,
            sections=self.sections,
            assumptions=self.assumptions,
            summary=self.summary,
            seed=self.header.seed,
            manifest={"statuses": dict(self.header.statuses), "stages": dict(self.header.stages)},
            headlines={self.title: self.headline} if self.headline else {},
            before=self.before,
        )


_OWN: dict[str, type[Teller[Any]]] = {}
"""Kind → teller of a kind that this package does not know, or instead of its own teller."""


def teller_of(kind: str, result: Any, header: Header) -> Teller[Any]:
    """Return what tells of a result: the teller of that kind, or ``TELLER`` of the module of that kind."""
    if kind in _OWN:
        return _OWN[kind](result, header)
    module = import_module(f"tolalloc.reports.tellers.{kind.replace(' ', '_')}")
    made: Teller[Any] = module.TELLER(result, header)
    return made
