"""What every answer is: a kind, a header and a result; everything that people see is its teller's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tolalloc.exceptions import UnknownNameError
from tolalloc.reports.document import Document, Section, tables_of
from tolalloc.reports.header import Header
from tolalloc.reports.teller import Teller, teller_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

    from tolalloc.reports.figure import Figure, HeatMap

Result = TypeVar("Result")
Item = TypeVar("Item")


@dataclass(frozen=True, kw_only=True)
class Answer(Generic[Result]):
    """The answer to one question.

    Parameters
    ----------
    kind
        Word for the question, such as ``ranking``.
    header
        What every answer says of its run.
    result
        The numbers, frozen, with units.
    told_by
        What tells of it; the teller of its kind unless given.
    """

    kind: str
    header: Header
    result: Result
    told_by: type[Teller[Result]] | None = None

    @cached_property
    def teller(self) -> Teller[Result]:
        """What tells people of the result."""
        return (
            self.told_by(self.result, self.header) if self.told_by else teller_of(self.kind, self.result, self.header)
        )

    @property
    def title(self) -> str:
        """What the answer is about."""
        return self.teller.title

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        return self.teller.subtitle

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        return self.teller.sentences

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return self.teller.warnings

    @property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""
        return self.teller.sections

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        return self.teller.assumptions

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        return self.teller.summary

    @property
    def document(self) -> Document:
        """The report on this answer alone."""
        return self.teller.document

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables by name, units in the headers, costs in the user's currency."""
        return tables_of(self.document.sections)

    @property
    def figures(self) -> dict[str, Figure | HeatMap]:
        """All figures by name."""
        return self.document.figures

    def to_frame(self, name: str = "") -> pd.DataFrame:
        """Return a table by name, the first one unless named.

        Raises
        ------
        UnknownNameError
            The answer has no such table.
        """
        return _picked(self.tables, name, f"the answer's tables ({self.kind})")

    def plot(self, name: str = "") -> Canvas:
        """Return a figure by name as a picture of matplotlib, the first one unless named.

        Raises
        ------
        UnknownNameError
            The answer has no such figure.
        """
        from tolalloc.reports.plots import drawn

        return drawn(_picked(self.figures, name, f"the answer's figures ({self.kind})"))

    def save(self, folder: str | Path) -> Path:
        """Write report, workbook, tables, pictures and summary into a new or empty folder, and return it.

        Raises
        ------
        RunFolderError
            Something is in the way.
        """
        from tolalloc.reports.folder import claimed
        from tolalloc.reports.writer import write_document

        path = Path(folder)
        with claimed(path) as beside:
            self.teller.add_files(beside)
            write_document(self.document, beside)
        return path

    def __repr__(self) -> str:
        """Return kind, study and model; the numbers behind an answer fill pages."""
        return f"<{self.kind} answer: {self.header.name}, {self.header.model}>"

    def __str__(self) -> str:
        """Return title, sentences and warnings."""
        return "\n".join([self.title, *self.sentences, *self.warnings])

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:  # noqa: ARG002
        """Show a terminal session what a person reads, not the numbers behind it."""
        printer.text(str(self))

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the first three sentences, the first table, one figure."""
        from tolalloc.reports.writer import html_table, inline_png

        shown = [f"<p><b>{self.title}</b></p>", *(f"<p>{sentence}</p>" for sentence in self.sentences[:3])]
        shown += [str(html_table(frame.head(12))) for frame in list(self.tables.values())[:1]]
        shown += [inline_png(figure) for figure in list(self.figures.values())[:1]]
        return "\n".join(shown)


def _picked(known: Mapping[str, Item], name: str, place: str) -> Item:
    """Return what has the name, the first one unless named."""
    asked = name or next(iter(known), "")
    UnknownNameError.require(place, "name", asked, known)
    return known[asked]
