"""A study: a problem with its questions, asked one by one or run into one folder with one report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, cast

from tolalloc.exceptions import InputError, SolveError, TolallocError
from tolalloc.reading.named_fields import a, each
from tolalloc.reports.document import Document, joined
from tolalloc.reports.folder import RUNS, claimed, numbered
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.check import today_sentence
from tolalloc.running.chunks import Mapper
from tolalloc.running.progress import SILENT, Progress, RunRecord
from tolalloc.running.result_cache import ResultCache
from tolalloc.study.answer import Answer
from tolalloc.study.prepared import JUDGED, Prepared
from tolalloc.study.problem import Effort, Problem
from tolalloc.study.questions import Allocation, Calculation, Question, Ranking, questions_of

if TYPE_CHECKING:
    from tolalloc.allocation.result import AllocationResult
    from tolalloc.sensitivity.result import RankingResult

_READ_BY_ALL = frozenset({"name", "questions", "effort", "title_block"})
_SHORT = 10.0
"""Time up to which nobody is told how long it takes [s]."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """A finished study."""

    answers: dict[str, Answer[Any]]  # Kind of question → answer, in the order of the study
    folder: Path | None  # Where the report stands; none if nothing was written
    document: Document  # The one report

    def __repr__(self) -> str:
        """Return what was answered and where it stands."""
        return f"<run of {', '.join(self.answers)}: {self.folder or 'nothing written'}>"

    def __getitem__(self, kind: str) -> Answer[Any]:
        return self.answers[kind]

    def _repr_html_(self) -> str:
        """Return what a notebook shows: every answer."""
        return "\n".join(answer._repr_html_() for answer in self.answers.values())


@dataclass(frozen=True, repr=False)
class Study(Problem):
    """A study: what is asked of a model at the zones of a drawing.

    Parameters
    ----------
    model
        What answers: ``ta.reducer(...)``, ``ta.model(...)``.
    drawing
        The tolerance table, ``ta.drawing(...)``.
    limits
        Name of an output with its unit → `Limit`; the first one is the leading output, which fronts and prices follow.
        None lifts a limit that the model has of its own: no unit of a reducer may be preloaded, `PRELOAD`.
    joint
        Share of units that must keep all limits at once. ``"common"``: the yield that all limits ask for, each alone
        where they ask for different things. ``AtYield(target=…)``: that yield; a limit that says nothing else of its
        own need only be kept by them. None: each limit alone.
    questions
        What is asked, in the order of the report.
    name
        Name of the study and of its run folder.
    seed
        Seed of every random number [-].
    largest_failed_share
        Share of units without an answer above which a question stops [-].
    effort
        How much may be computed.
    title_block
        What the title blocks of page and drawing say beside study and date: ``drawing number``, ``revision``,
        ``author``, and ``material`` on the drawing. What is not said stays empty there, to be filled in by hand.
    neglected
        Names and patterns of sources that the drawing may leave out, taken as exact, beside those that the model leaves
        out itself; an input of an own function must have its nominal size in ``inputs`` then.
    compensators
        What is chosen at assembly, ``ta.Sorting(...)``, ``ta.Shim(...)`` and ``ta.Indexing(...)``: reducers are judged
        as they are assembled.
        An allocation compares all numbers of classes and sizes that they state, other questions take the first.

    Raises
    ------
    InputError, UnknownNameError
        A field that is not allowed, or that no question of the study reads.

    Examples
    --------
    >>> import tolalloc as ta
    >>> ta.Study(ta.reducer("rv20e"), ta.drawing("rv20e_drawing"), limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60)}).seed
    1
    """

    called: ClassVar[str] = "study"

    questions: Annotated[
        Sequence[Question], each("ta.Ranking(...), ta.Allocation(...) and other questions", a(Question), fewest=1)
    ] = (Ranking(), Allocation())

    def __post_init__(self) -> None:
        if isinstance(self.questions, Question):
            object.__setattr__(self, "questions", (self.questions,))
        super().__post_init__()
        object.__setattr__(self, "questions", tuple(self.questions))
        kinds = [question.kind for question in self.questions]
        for kind in kinds:
            if kinds.count(kind) > 1:
                times = f"it asks {kind} {kinds.count(kind)} times"
                raise InputError(f"{self.place}: {times}; a study asks each question once.")
        self._require_read()

    def _require_read(self) -> None:
        """Raise if a field is given that no question reads."""
        read = _READ_BY_ALL.union(*(question.reads for question in self.questions))
        for own in fields(self):
            default = own.default_factory() if callable(own.default_factory) else own.default
            if own.name not in read and getattr(self, own.name) != default:
                kinds = ", ".join(question.kind for question in self.questions)
                raise InputError(
                    f"{self.place}: no question of it reads {own.name} (it asks: {kinds}); leave it out or "
                    "ask what reads it."
                )

    def __repr__(self) -> str:
        asked = ", ".join(question.kind for question in self.questions)
        limits = ", ".join(self.limits) or "none"
        model, drawing = (
            getattr(own, "name", type(own).__name__) if own else "none" for own in (self.model, self.drawing)
        )
        return f"Study({self.name!r}: {model} at {drawing}; limits: {limits}; asks: {asked}; seed {self.seed})"

    def ask(
        self,
        question: Question | str,
        effort: Literal["quick", "full"] | Effort | None = None,
        progress: Progress | None = None,
    ) -> Answer[Any]:
        """Return the answer to one question, of this study or any other.

        Parameters
        ----------
        question
            A question, or the kind of one of the study's.
        effort
            ``quick``, ``full`` or numbers; the study's own if none is given.
        progress
            Told how far the work has come; silent unless given.
        """
        if isinstance(question, str):
            question = questions_of((question,), self.questions, self.place)[0]
        prepared = Prepared(study=self.with_effort(effort))
        return question.answer(prepared, _record(prepared, question, progress))

    def rank(
        self, effort: Literal["quick", "full"] | Effort | None = None, progress: Progress | None = None
    ) -> Answer[RankingResult]:
        """Return which error drives which output."""
        return cast("Answer[RankingResult]", self.ask("ranking", effort, progress))

    def allocate(
        self, effort: Literal["quick", "full"] | Effort | None = None, progress: Progress | None = None
    ) -> Answer[AllocationResult]:
        """Return the cheapest drawing that keeps every limit."""
        return cast("Answer[AllocationResult]", self.ask("allocation", effort, progress))

    def run(
        self,
        folder: str | Path | None = None,
        effort: Literal["quick", "full"] | Effort | None = None,
        progress: Progress | None = None,
        *,
        fresh: bool = False,
    ) -> Run:
        """Ask every question, write one folder with one report, and return the answers.

        Parameters
        ----------
        folder
            New or empty folder; the next one of ``runs/NAME``, ``runs/NAME-2``, … unless given.
        effort, progress
            As of `ask`.
        fresh
            Whether units that an earlier or a stopped run has kept beside the folder are solved again.

        Raises
        ------
        TolallocError
            One sentence on what is wrong; nothing is written then.
        """
        place = Path(folder) if folder else numbered(RUNS / self.name)[-1]
        return run(self.with_effort(effort), place, progress=progress, fresh=fresh)


def _record(prepared: Prepared, question: Question, progress: Progress | None) -> RunRecord:
    if "model" not in question.reads:
        return RunRecord(progress or SILENT, {})
    prepared.digest  # noqa: B018  # of before the first call: a function may remember its calls
    return RunRecord(progress or SILENT, portrait_of(prepared.model).outcomes)


def run(
    study: Study,
    folder: Path,
    questions: tuple[Question, ...] = (),
    progress: Progress | None = None,
    *,
    fresh: bool = False,
    solved_by: Mapper = map,
) -> Run:
    """Ask all or some of a study's questions and write one new or empty folder.

    On an error nothing stays behind, but for what earlier questions answered, whose report says what is missing.

    Progress is as of `Study.ask`. Solved units are kept beside the folder, in `cache_beside`, and a
    run that was stopped takes them from there, unless it is to begin afresh. All others are solved by a mapper: this
    process unless given.

    Raises
    ------
    TolallocError
        One sentence on what is wrong.
    """
    asked = questions or tuple(study.questions)
    kept = replace(cache_beside(folder), solved_by=solved_by).pruned()
    prepared = Prepared(study=study, mapper=solved_by if fresh else kept)
    with claimed(folder) as beside:
        answers, fault = _answers(prepared, asked, progress)
        from tolalloc.reports.writer import write_document

        if progress:
            progress.begin("report")
        document = _document(prepared, answers)
        missed = prepared.missed if any("limits" in own.reads for own in asked) else ()
        document = replace(document, warnings=(*([str(fault)] if fault else []), *missed, *document.warnings))
        if study.model is not None:
            prepared.model.release()  # drawing the figures takes as much memory
        for answer in answers.values():
            answer.teller.add_files(beside)
        write_document(document, beside)
    if fault:
        raise type(fault)(f"{fault} What was answered before, {' and '.join(answers)}, stands in {folder}.") from fault
    return Run(answers=answers, folder=folder, document=document)


def _answers(
    prepared: Prepared, asked: tuple[Question, ...], progress: Progress | None
) -> tuple[dict[str, Answer[Any]], TolallocError | None]:
    """Return the answer to every question, and what ended one if an earlier one is answered.

    The first of the limits begins with how the drawing stands as it is.
    """
    answers, opening = dict[str, Answer[Any]](), partial(_tell_today, prepared, progress) if progress else None
    for question in asked:
        record = _record(prepared, question, progress)
        if "limits" in question.reads:
            record.opening, opening = opening, None
        try:
            answers[question.kind] = question.answer(prepared, record)
        except (InputError, SolveError) as fault:
            if not answers:
                raise
            return answers, fault
    return answers, None


def _tell_today(prepared: Prepared, progress: Progress) -> None:
    """Say how the drawing stands as it is, some seconds after the start; what is asked takes minutes."""
    progress.begin("the drawing as it is", JUDGED)
    for sentence in prepared.missed:
        progress.tell(sentence)
    kept = prepared.judged
    progress.advance(kept.joint.units)
    progress.tell(today_sentence(kept))
    from tolalloc.reports.tellers.check import in_words
    from tolalloc.study.duration import expected_seconds

    seconds = expected_seconds(prepared)
    if seconds > _SHORT:
        progress.tell(f"What is asked takes about {in_words(seconds)} here.")


def cache_beside(folder: Path) -> ResultCache:
    """Return where the units of runs into neighbouring folders are kept."""
    return ResultCache(folder=folder.absolute().parent / ".tolalloc-units")


def _document(prepared: Prepared, answers: dict[str, Answer[Any]]) -> Document:
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
    title = first.title if len(answers) == 1 else first.header.asked
    parts = [(kind, answer.document) for kind, answer in answers.items()]
    whole = joined(title, first.subtitle, parts, **known, seed=study.seed)
    return replace(whole, title_block=study.title_block)
