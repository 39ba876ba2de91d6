"""Running a study: every question once, one folder, one report."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Document, joined
from tolalloc.reports.folder import claimed
from tolalloc.reports.portrait import portrait_of
from tolalloc.running.chunks import Mapper
from tolalloc.running.progress import Progress, RunRecord, Silent
from tolalloc.running.result_cache import KeptUnits
from tolalloc.study.prepared import Prepared
from tolalloc.study.questions import Calculation, Question
from tolalloc.study.study import Study


@dataclass(frozen=True, kw_only=True)
class Run:
    """A finished study.

    Parameters
    ----------
    answers
        Kind of question → answer, in the order of the study.
    folder
        Where the report stands; none if nothing was written.
    document
        The one report.
    """

    answers: dict[str, Answer]
    folder: Path | None
    document: Document

    def __repr__(self) -> str:
        """Return what was answered and where it stands."""
        return f"<run of {', '.join(self.answers)}: {self.folder or 'nothing written'}>"

    def __getitem__(self, kind: str) -> Answer:
        return self.answers[kind]

    def _repr_html_(self) -> str:
        """Return what a notebook shows: every answer."""
        return "\n".join(answer._repr_html_() for answer in self.answers.values())


def answered(
    study: Study, question: Question, progress: Progress | None = None, checkpoint: Path | None = None
) -> Answer:
    """Return the answer to one question."""
    prepared = Prepared(study=study)
    return question.answer(prepared, _record(prepared, question, progress), checkpoint)


def _record(prepared: Prepared, question: Question, progress: Progress | None) -> RunRecord:
    outcomes = portrait_of(prepared.model).outcomes if "model" in question.reads else {}
    return RunRecord(progress or Silent(), outcomes)


def run(
    study: Study,
    folder: Path,
    questions: tuple[Question, ...] = (),
    progress: Progress | None = None,
    checkpoint: Path | None = None,
    *,
    fresh: bool = False,
    solved_by: Mapper = map,
) -> Run:
    """Ask all or some of a study's questions and write one new or empty folder; on any error nothing stays behind.

    Progress and checkpoint are as of `Study.ask`. Solved units are kept beside the folder, in `kept_beside`, and a
    run that was stopped takes them from there, unless it is to begin afresh. All others are solved by a mapper: this
    process unless given.

    Raises
    ------
    TolallocError
        One sentence on what is wrong.
    """
    asked = questions or tuple(study.questions)
    kept = replace(kept_beside(folder), solved_by=solved_by).pruned()
    prepared = Prepared(study=study, mapper=solved_by if fresh else kept)
    with claimed(folder) as beside:
        answers = {
            question.kind: question.answer(prepared, _record(prepared, question, progress), checkpoint)
            for question in asked
        }
        from tolalloc.reports.writer import write_document

        document = _document(prepared, answers)
        if study.model is not None:
            prepared.model.put_away()  # drawing the figures takes as much memory
        for answer in answers.values():
            answer.add_files(beside)
        write_document(document, beside)
    return Run(answers=answers, folder=folder, document=document)


def kept_beside(folder: Path) -> KeptUnits:
    """Return where the units of runs into neighbouring folders are kept."""
    return KeptUnits(folder=folder.absolute().parent / ".tolalloc-units")


def _document(prepared: Prepared, answers: dict[str, Answer]) -> Document:
    """Return the one report: the answer itself where there is one, all of them under their study otherwise."""
    study, first = prepared.study, next(iter(answers.values()))
    known: dict[str, Any] = {
        "study": study.name,
        "study hash": first.header.digest,
        "quick": study.quick,
        "questions": list(answers),
        "currency": first.header.currency,
        "statuses": {kind: dict(answer.header.statuses) for kind, answer in answers.items()},
        "stages": {kind: dict(answer.header.stages) for kind, answer in answers.items()},
    }
    if not set(answers) - {Calculation.kind}:
        return replace(
            first.document, manifest=known, title_block=study.title_block
        )  # a calculation has a summary of its own, not one beside others
    title = first.title if len(answers) == 1 else f"{first.header.model}: {study.name}"
    parts = [(kind, answer.document) for kind, answer in answers.items()]
    whole = joined(title, first.subtitle, parts, **known, seed=study.seed)
    return replace(whole, title_block=study.title_block)
