"""What a user asks for: a model, a drawing, limits and questions, checked as a whole before anything long runs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, cast

from tolalloc.allocation.space.requirement import AtYield
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.named_fields import NamedFields, is_number
from tolalloc.study.effort import QUICK, Effort
from tolalloc.study.limit import Limit
from tolalloc.study.questions import Allocation, Question, Ranking, named

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer
    from tolalloc.drawings.drawing import Drawing
    from tolalloc.models.model import ModelSource
    from tolalloc.reports.answer import Answer
    from tolalloc.running.progress import Progress
    from tolalloc.sensitivity.answer import RankingAnswer
    from tolalloc.study.runner import Run


_TITLE_BLOCK = ("drawing number", "revision", "author")
_LONGEST_TEXT = 60
_NAME = r"[\w-][\w. -]{0,99}"


def _effort(name: str, place: str) -> Effort:
    """Return the effort of a name, ``quick`` or ``full``."""
    if name not in ("quick", "full"):
        raise UnknownNameError.among(place, "effort", name, ("quick", "full"))
    return QUICK if name == "quick" else Effort()


def _is_source(model: object) -> bool:
    return hasattr(model, "bound") and not isinstance(model, type)


def _is_share(value: object) -> bool:
    return is_number(value) and 0 <= cast("float", value) < 0.5


def _are_named(limits: object) -> bool:
    return isinstance(limits, Mapping) and all(isinstance(output, str) for output in limits)


def _is_title_block(given: object) -> bool:
    return isinstance(given, Mapping) and all(
        label in _TITLE_BLOCK and isinstance(text, str) and len(text) <= _LONGEST_TEXT for label, text in given.items()
    )


def _are_questions(given: object) -> bool:
    return isinstance(given, Sequence) and bool(given) and all(isinstance(one, Question) for one in given)


@dataclass(frozen=True, repr=False)
class Study(NamedFields):
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
        Share of units that must keep all limits at once, ``AtYield(target=…)``; a limit that says nothing else of its
        own need only be kept by them.
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
        What the first page of a report says beside study and date: ``drawing number``, ``revision``, ``author``. What
        is not said stays empty there, to be filled in by hand.

    Raises
    ------
    InputError, UnknownNameError
        A field that is not allowed, or that no question of the study reads.

    Examples
    --------
    >>> import tolalloc as ta
    >>> ta.Study(ta.reducer("rv20e"), ta.drawing("rv20e_baseline"), limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60)}).seed
    1
    """

    called: ClassVar[str] = "study"
    by_position: ClassVar[int] = 2

    model: ModelSource | None = None
    drawing: Drawing | None = None
    limits: Mapping[str, Limit | None] = field(default_factory=dict)
    joint: AtYield | None = None
    questions: Sequence[Question] = (Ranking(), Allocation())
    name: str = "study"
    seed: int = 1
    largest_failed_share: float = 0.01
    effort: Effort = field(default_factory=Effort)
    title_block: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        is_name = isinstance(self.name, str) and re.fullmatch(_NAME, self.name)
        place = f"study {self.name}" if is_name else "study"
        if isinstance(self.questions, Question):
            object.__setattr__(self, "questions", (self.questions,))
        if isinstance(self.effort, str):
            object.__setattr__(self, "effort", _effort(self.effort, place))
        for name, good, allowed in (
            ("name", is_name, "100 letters, digits, '_', '-', '.' and blanks, or less"),
            ("model", self.model is None or _is_source(self.model), "ta.reducer(...), ta.model(...) or another model"),
            ("drawing", self.drawing is None or hasattr(self.drawing, "errors"), "ta.drawing(...)"),
            ("limits", _are_named(self.limits), "a dictionary of outputs and their ta.Limit(...)"),
            ("joint", self.joint is None or isinstance(self.joint, AtYield), "ta.AtYield(...) or None"),
            ("seed", type(self.seed) is int and self.seed >= 0, "0 or a positive integer"),
            ("largest_failed_share", _is_share(self.largest_failed_share), "0 to 0.5"),
            ("questions", _are_questions(self.questions), "ta.Ranking(...), ta.Allocation(...) and other questions"),
            (
                "title_block",
                _is_title_block(self.title_block),
                f"a dictionary of texts up to {_LONGEST_TEXT} characters under {', '.join(_TITLE_BLOCK)}",
            ),
            ("effort", hasattr(self.effort, "is_quick"), "'quick', 'full' or ta.Effort(...)"),
        ):
            if not good:
                raise InputError.at(place, name, getattr(self, name), allowed)
        object.__setattr__(self, "questions", tuple(self.questions))
        kinds = [question.kind for question in self.questions]
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise InputError(f"{place}: it asks {kind} {kinds.count(kind)} times; a study asks each question once.")
        for output, limit in self.limits.items():
            if not isinstance(limit, Limit | None):
                raise InputError.at(
                    place, f"limits[{output!r}]", limit, "ta.Limit(...), or None to lift the model's own"
                )
        self._require_read(place)

    def _require_read(self, place: str) -> None:
        """Raise if a field is given that no question reads."""
        read = frozenset().union(*(question.reads for question in self.questions)) | {
            "name",
            "questions",
            "effort",
            "title_block",
        }
        kinds = ", ".join(question.kind for question in self.questions)
        for own in fields(self):
            default = own.default_factory() if callable(own.default_factory) else own.default
            if own.name not in read and getattr(self, own.name) != default:
                raise InputError(
                    f"{place}: no question of it reads {own.name} (it asks: {kinds}); leave it out or "
                    "ask what reads it."
                )

    def __repr__(self) -> str:
        asked = ", ".join(question.kind for question in self.questions)
        limits = ", ".join(self.limits) or "none"
        model, drawing = (
            getattr(own, "name", type(own).__name__) if own else "none" for own in (self.model, self.drawing)
        )
        return f"Study({self.name!r}: {model} at {drawing}; limits: {limits}; asks: {asked}; seed {self.seed})"

    @property
    def quick(self) -> bool:
        """Whether the effort is the small one."""
        return self.effort.is_quick

    def with_effort(self, effort: Literal["quick", "full"] | Effort | None) -> Study:
        """Return the study at another effort, as it is where none is given."""
        if effort is None:
            return self
        return replace(self, effort=_effort(effort, f"study {self.name}") if isinstance(effort, str) else effort)

    def changed(
        self, drawing: Drawing | str | Path, settings: Mapping[str, float] | None = None, name: str = ""
    ) -> Study:
        """Return the study at another drawing, and at other values of the model's settings and operating conditions.

        Parameters
        ----------
        drawing
            Another drawing, or the path of a tolerance table whose zones the present one takes; its correlations and
            process costs stay.
        settings
            Setting or operating condition → its value [unit of its name], such as ``{"flank clearance [µm]": 2.0}``.
        name
            Name of the new study; that of this one unless given.

        Raises
        ------
        InputError, UnknownNameError
            A table that cannot be read, a setting that the model does not have, a value outside its bounds.
        """
        if self.drawing is None or self.model is None:
            raise InputError(f"study {self.name}: it has no {'drawing' if self.model else 'model'} that could change.")
        model = self.model.set_to(settings) if settings else self.model
        other = self.drawing.with_table(drawing) if isinstance(drawing, str | Path) else drawing
        # What is asked for counts before what the drawing states.
        asked = {name: value for name, value in (settings or {}).items() if name in other.settings}
        other = replace(other, settings={**other.settings, **asked})
        return replace(self, model=model, drawing=other, name=name or self.name)

    def ask(
        self,
        question: Question | str,
        effort: Literal["quick", "full"] | Effort | None = None,
        progress: Progress | None = None,
        checkpoint: Path | None = None,
    ) -> Answer:
        """Return the answer to one question, of this study or any other.

        Parameters
        ----------
        question
            A question, or the kind of one of the study's.
        effort
            ``quick``, ``full`` or numbers; the study's own if none is given.
        progress
            Told how far the work has come; silent unless given.
        checkpoint
            File that keeps an interrupted search, if one is wanted.
        """
        from tolalloc.study.runner import answered

        if isinstance(question, str):
            question = named((question,), tuple(self.questions), f"study {self.name}")[0]
        return answered(self.with_effort(effort), question, progress, checkpoint)

    def rank(
        self, effort: Literal["quick", "full"] | Effort | None = None, progress: Progress | None = None
    ) -> RankingAnswer:
        """Return which error drives which output."""
        return cast("RankingAnswer", self.ask("ranking", effort, progress))

    def allocate(
        self, effort: Literal["quick", "full"] | Effort | None = None, progress: Progress | None = None
    ) -> AllocationAnswer:
        """Return the cheapest drawing that keeps every limit."""
        return cast("AllocationAnswer", self.ask("allocation", effort, progress))

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
            New or empty folder; ``runs/NAME`` unless given.
        effort, progress
            As of `ask`.
        fresh
            Whether units that an earlier or a stopped run has kept beside the folder are solved again.

        Raises
        ------
        TolallocError
            One sentence on what is wrong; nothing is written then.
        """
        from tolalloc.study.runner import run

        return run(self.with_effort(effort), Path(folder or Path("runs") / self.name), progress=progress, fresh=fresh)
