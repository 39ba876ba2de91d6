"""What a study may be asked: each question is one class that says what it reads and how it is answered."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

from tolalloc.allocation.cost.unit_price import QualityLoss, UnitPrice
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import UnknownNameError
from tolalloc.reading.named_fields import NamedFields, Rule, a, flag, is_number, mapped, or_none, whole
from tolalloc.reading.plugins import plugins
from tolalloc.reports.header import Header
from tolalloc.sensitivity.effort import BY_DIMENSION, BY_SOURCE
from tolalloc.study.answer import Answer
from tolalloc.study.prepared import Prepared

if TYPE_CHECKING:
    from tolalloc.reports.document import Document
    from tolalloc.running.progress import RunRecord
    from tolalloc.sensitivity.result import RankingResult

Result = TypeVar("Result")

_ZONES = "source names with their zones in µm, such as {'pin.diameter': 3.0}"


@dataclass(frozen=True, kw_only=True)
class Question(NamedFields, ABC):
    """A question of a study.

    A subclass names what it is called on the command line (``kind``), which fields of the study it reads (``reads``),
    and answers from the prepared study.
    """

    kind: ClassVar[str]
    reads: ClassVar[frozenset[str]] = frozenset(
        {"model", "drawing", "limits", "seed", "largest_failed_share", "effort", "neglected", "compensators"}
    )

    def __init_subclass__(cls) -> None:
        cls.called = f"question {getattr(cls, 'kind', cls.__name__)}"

    @abstractmethod
    def answer(self, prepared: Prepared, record: RunRecord) -> Answer[Any]:
        """Return the answer."""


@dataclass(frozen=True, kw_only=True)
class Ranking(Question):
    """Which error drives which output, which order and the rejects, and how sure that is.

    Parameters
    ----------
    by
        What is ranked: ``dimension``, each dimension of the drawing with all its places together, or ``source``, each
        source alone.

    >>> Ranking().by
    'dimension'
    """

    kind: ClassVar[str] = "ranking"

    by: Annotated[str, Rule(f"{BY_DIMENSION} or {BY_SOURCE}", (BY_DIMENSION, BY_SOURCE).__contains__)] = BY_DIMENSION

    def answer(self, prepared: Prepared, record: RunRecord) -> Answer[RankingResult]:
        """Return what drives the outputs at the zones of the drawing."""
        from tolalloc.sensitivity.measures import Measures, rank

        study = prepared.study
        asked = Measures(
            model=prepared.model,
            errors=prepared.errors,
            limits={requirement.output: requirement.limits for requirement in prepared.requirements},
            target=prepared.target,
            effort=prepared.ranking_effort,
            seeds=SeedTree(study.seed).child("rank"),
            largest_failed_share=study.largest_failed_share,
            by=self.by,
        )
        result, header = rank(asked, record), prepared.header
        header = replace(header, assumptions=tuple(dict.fromkeys(header.assumptions)))
        return _answer(self.kind, header, record, result)


@dataclass(frozen=True, kw_only=True)
class Difference(Question):
    """What other zones do to cost, yield and quantiles, on the same random units.

    Parameters
    ----------
    zones
        Source, or a pattern of several as ``disc*.pitch``, and its full zone [µm].
    units
        Random units of either drawing [-].
    """

    kind: ClassVar[str] = "difference"

    zones: Annotated[Mapping[str, float], mapped(_ZONES, Rule("a number", is_number))]
    units: Annotated[int, whole("a whole number from 100 to 10,000,000", 100, 10_000_000)] = 1024

    def answer(self, prepared: Prepared, record: RunRecord) -> Answer[Any]:
        """Return both drawings on the same units."""
        from tolalloc.allocation.difference import difference

        found = difference(
            model=prepared.model,
            space=prepared.space,
            requirements=prepared.requirements,
            zones=self.zones,
            units=self.units,
            seeds=SeedTree(prepared.study.seed).child("difference"),
            record=record,
        )
        return _answer(self.kind, prepared.header, record, found)


@dataclass(frozen=True, kw_only=True)
class Allocation(Question):
    """The cheapest drawing that keeps every limit, verified on an independent sample.

    Parameters
    ----------
    grades
        Whether zones come from ISO 286 grades and preferred numbers alone.
    fixed_first
        Whether zones are first allocated with the settings of the model as they are: the answer then says what freeing
        them is worth.
    front
        Whether cost is traded against the first limit.
    what_if
        Whether settings are traded against zones, and costs, stiffnesses and processes are changed.
    unit_price
        What becomes of units beyond the first limit; the yield with the cheapest good unit is then named.
    quality_loss
        What the leading output costs a user although it keeps its limit (Taguchi).
    boxes
        Boxes of zones and settings in which a cost is looked for that no drawing undercuts, on the real model; 0 for
        none. The more, the nearer the bound; a reducer looks at some 50 to 200 a second [-].

    Examples
    --------
    >>> Allocation(grades=True).grades
    True
    """

    kind: ClassVar[str] = "allocation"
    reads: ClassVar[frozenset[str]] = Question.reads | {"joint"}

    grades: Annotated[bool, flag()] = False
    fixed_first: Annotated[bool, flag()] = True
    front: Annotated[bool, flag()] = True
    what_if: Annotated[bool, flag()] = True
    unit_price: Annotated[UnitPrice | None, or_none(a(UnitPrice, "UnitPrice(...) or None"))] = None
    quality_loss: Annotated[QualityLoss | None, or_none(a(QualityLoss, "QualityLoss(...) or None"))] = None
    boxes: Annotated[int, whole("a whole number from 0 to 10,000,000", 0, 10_000_000)] = 0

    def answer(self, prepared: Prepared, record: RunRecord) -> Answer[Any]:
        """Return the cheapest drawing."""
        from tolalloc.allocation.drawing_question import AssembledQuestion, DrawingQuestion, allocate_assembled

        study = prepared.study
        question = DrawingQuestion(
            model=prepared.model.observed(record.observe),
            space=prepared.space,
            # What a unit beyond a limit costs is stated for the first limit.
            requirements=prepared.requirements_with_joint
            if self.unit_price or self.quality_loss
            else prepared.led_by_what_decides,
            effort=prepared.allocation_effort,
            seed=study.seed,
            largest_failed_share=study.largest_failed_share,
            place=prepared.place,
            **vars(self),
        )
        asked = AssembledQuestion(question=question, choices=prepared.assemblies)
        return _answer(self.kind, prepared.header, record, allocate_assembled(asked, record, study.name))


@dataclass(frozen=True)
class Calculation(Question):
    """A report that a function makes: a replica of a paper, a benchmark, anything beside ranking and allocation.

    Parameters
    ----------
    build
        Makes the report from whether it should be quick; one that takes long has an argument ``progress`` too, the
        `tolalloc.running.progress.Progress` that it tells of its stages.
    """

    kind: ClassVar[str] = "calculation"
    by_position: ClassVar[int] = 1
    reads: ClassVar[frozenset[str]] = frozenset()

    build: Callable[..., Document]

    def answer(self, prepared: Prepared, record: RunRecord) -> Answer[Any]:
        """Return what the function made."""
        study = prepared.study
        with record.stage(study.name):
            made = self.build(study.quick, **({"progress": record.progress} if _takes_progress(self.build) else {}))
        return Answer(
            kind=self.kind, header=Header(name=study.name, model="", seed=made.seed, quick=study.quick), result=made
        )


def _takes_progress(build: Callable[..., Document]) -> bool:
    """Return whether a function that makes a report tells of its stages."""
    try:
        return "progress" in signature(build).parameters
    except ValueError:  # some functions in C tell nothing of their arguments
        return False


def _answer(kind: str, header: Header, record: RunRecord, result: Result) -> Answer[Result]:
    """Return the answer that a result is, with the units that were solved for it and the stages that they took."""
    return Answer(kind=kind, header=replace(header, statuses=record.counts, stages=record.stages), result=result)


def questions_of(kinds: tuple[str, ...], asked: Sequence[Question], place: str) -> tuple[Question, ...]:
    """Return the questions of a study that are meant by their kinds; one that it does not ask has its defaults."""
    known: dict[str, Any] = {own.kind: own for own in (Ranking, Allocation)}
    known |= plugins("questions", (*known, Difference.kind, Calculation.kind), ("kind",), "kind", kind=Question)
    own = {question.kind: question for question in asked}
    for kind in kinds:
        if kind not in known and kind not in own:
            raise UnknownNameError.among(place, "question", kind, {*known, *own})
    return tuple(own[kind] if kind in own else known[kind]() for kind in kinds)
