"""A report of headings, tables and figures about anything: one record from which page, workbook and pictures come."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tolalloc.reports.figure import Figure, HeatMap

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Section:
    """One heading with what stands below it.

    Parameters
    ----------
    heading
        The heading.
    paragraphs
        Text.
    figures
        Figures.
    tables
        Sheet name → table, units in the headers.
    part
        Title of the report that it comes from; empty where there is one report alone.
    unfolded
        Whether its tables stand open however large they are, as a drawing does.
    first
        Whether it stands on the first page, behind the answer.
    folded
        Whether it is there for who asks, behind its heading; paper has the heading alone.
    """

    heading: str
    paragraphs: tuple[str, ...] = ()
    figures: tuple[Figure | HeatMap, ...] = ()
    tables: tuple[tuple[str, pd.DataFrame], ...] = ()
    part: str = ""
    unfolded: bool = False
    first: bool = False
    folded: bool = False


@dataclass(frozen=True, kw_only=True)
class Document:
    """A report.

    Parameters
    ----------
    title, subtitle
        What it is about, and under which conditions.
    answer
        The answer in a few sentences.
    warnings
        What a reader must know before acting on it.
    sections
        The rest.
    assumptions
        What no source prints.
    summary
        The answer for a program, units of measurement in the names.
    seed
        Seed of the random numbers; none if nothing is random [-].
    manifest
        What else is needed to repeat the run and to trust it.
    answers
        Title and sentences of each report that this one joins; none of a report alone.
    headlines
        Title → what the first page says of a report behind another one; its first sentences where nothing stands here.
    before
        What is better done before the answer is acted on; of reports that are joined it stands before the first one.
    title_block
        What the first page says beside study and date, as a drawing does: its number, revision and author.
    """

    title: str
    subtitle: str
    answer: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]
    assumptions: tuple[str, ...]
    summary: dict[str, Any]
    seed: int | None = None
    manifest: dict[str, Any] | None = None
    answers: tuple[tuple[str, tuple[str, ...]], ...] = ()
    headlines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    before: tuple[str, ...] = ()
    title_block: Mapping[str, str] = field(default_factory=dict)

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables by name, in the order of the report."""
        return tables_of(self.sections)

    @property
    def figures(self) -> dict[str, Figure | HeatMap]:
        """All figures by name, in the order of the report."""
        return {figure.name: figure for section in self.sections for figure in section.figures}


def tables_of(sections: Iterable[Section]) -> dict[str, pd.DataFrame]:
    """Return all tables by name, in the order of the sections."""
    return {name: frame for section in sections for name, frame in section.tables}


def joined(title: str, subtitle: str, parts: Iterable[tuple[str, Document]], **manifest: Any) -> Document:
    """Return several reports as one, in their order.

    Parameters
    ----------
    title, subtitle
        Of the whole.
    parts
        Name and report of each; a table or figure whose name an earlier one has gets the part's name before its own,
        and a table that says the same as the earlier one is left out. The answer of the last report that has something
        for the first page, such as a drawing, stands first.
    manifest
        What is needed to repeat the run and to trust it.
    """
    sections: list[Section] = []
    drawn: set[str] = set()
    known: dict[str, pd.DataFrame] = {}
    reports = tuple(parts)
    leading = [part for part, document in reports if any(section.first for section in document.sections)][-1:]
    for part, document in reports:
        own = {
            name: frame for name, frame in document.tables.items() if name not in known or not known[name].equals(frame)
        }
        tables = {name: f"{part} {name}" if name in known else name for name in own}
        figures = {name: f"{part} {name}" if name in drawn else name for name in document.figures}
        known |= {tables[name]: frame for name, frame in own.items()}
        drawn |= set(figures.values())
        for section in document.sections:
            sections.append(
                replace(
                    section,
                    part=document.title if len(reports) > 1 else "",
                    first=section.first and part in leading,
                    tables=tuple((tables[name], frame) for name, frame in section.tables if name in tables),
                    figures=tuple(replace(figure, name=figures[figure.name]) for figure in section.figures),
                )
            )
    # The report that has something for the first page comes first.
    leading_first = sorted(reports, key=lambda report: report[0] not in leading)
    sections.sort(key=lambda section: section.part != leading_first[0][1].title)
    before = tuple(dict.fromkeys(sentence for _, document in reports for sentence in document.before))
    answers = [
        (document.title, (*(() if at else before), *(own for own in document.answer if own not in before)))
        for at, (_, document) in enumerate(leading_first)
    ]
    return Document(
        title=title,
        subtitle=subtitle,
        answer=tuple(sentence for _, said in answers for sentence in said),
        warnings=_once(sentence for _, document in leading_first for sentence in document.warnings),
        sections=tuple(sections),
        assumptions=tuple(dict.fromkeys(sentence for _, document in reports for sentence in document.assumptions)),
        summary={part: document.summary for part, document in reports},
        seed=manifest.get("seed"),
        manifest=manifest,
        answers=tuple(answers) if len(reports) > 1 else (),
        headlines={
            title: tuple(own for own in said if own not in before)
            for _, document in reports
            for title, said in document.headlines.items()
        },
        before=before,
    )


def _once(sentences: Iterable[str]) -> tuple[str, ...]:
    """Return sentences without those that say an earlier one with other numbers.

    >>> _once(["It twists by 0.1′.", "Two fail.", "It twists by 0.096′."])
    ('It twists by 0.1′.', 'Two fail.')
    """
    first: dict[str, str] = {}
    for sentence in sentences:
        first.setdefault(re.sub(r"\d[\d.,]*", "#", sentence), sentence)
    return tuple(first.values())
