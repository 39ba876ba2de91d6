"""What a study is about: a model at a drawing, the limits of its outputs, and how much may be computed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from tolalloc.allocation.space.effort import QUICK_ALLOCATION, AllocationEffort
from tolalloc.allocation.space.requirement import USUAL_YIELD, AtYield, Guarantee
from tolalloc.capability.indices import Limits
from tolalloc.drawings.compensators import Compensator
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.model import is_fast
from tolalloc.reading.named_fields import NamedFields, Rule, a, each, mapped, number, or_none, whole
from tolalloc.sensitivity.effort import QUICK_RANKING, RankingEffort

if TYPE_CHECKING:
    from tolalloc.drawings.drawing import Drawing
    from tolalloc.models.model import Model, ModelSource

COMMON: Literal["common"] = "common"
"""What is asked of all limits at once is what each of them asks for, where that is one yield."""
_TITLE_BLOCK = ("drawing number", "revision", "author", "material")
_LONGEST_TEXT = 60
_NAME = re.compile(r"[\w-][\w. -]{0,99}")
_SIDE = or_none(number("a finite number; an open side is None"))
_LONGER = 1.5
"""How many times the asked time the least effort may take without a word of its own [-]."""
_NUMBERS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_ORDER = re.compile(rf"order of the first ({'|'.join(_NUMBERS)}|[1-9]\d?)")
_UNTIL = Rule(
    "'order of the first three', any number from one to ten in words or up to 99 in digits, or None",
    lambda given: given is None or (isinstance(given, str) and bool(_ORDER.fullmatch(given))),
)


@dataclass(frozen=True, kw_only=True)
class Limit(NamedFields):
    """Limits of an output and what must be shown of them.

    Parameters
    ----------
    upper, lower
        Largest and smallest value allowed; an open side is None [unit of the output].
    show
        What must be shown: ``AtYield(target=…)``, ``AtCpk(target=…)``, ``WorstCase()``, ``RootSumSquare()``;
        99.73 % of units unless given.

    Raises
    ------
    InputError
        No side, sides in the wrong order, or numbers that are not finite.

    Examples
    --------
    >>> Limit(upper=60.0).upper
    60.0
    """

    called: ClassVar[str] = "limit"

    upper: Annotated[float | None, _SIDE] = None
    lower: Annotated[float | None, _SIDE] = None
    show: Guarantee | None = None

    def __post_init__(self) -> None:
        if isinstance(self.show, type) or not (self.show is None or isinstance(self.show, Guarantee)):
            raise InputError.at("limit", "show", self.show, "AtYield(...), AtCpk(...), WorstCase() or RootSumSquare()")
        super().__post_init__()
        for name in ("upper", "lower"):
            if (side := getattr(self, name)) is not None:
                object.__setattr__(self, name, float(side))  # a study asks the same with 60 and with 60.0
        _ = self.limits

    @property
    def guarantee(self) -> Guarantee:
        """What must be shown."""
        return self.show or AtYield(target=USUAL_YIELD)

    @property
    def limits(self) -> Limits:
        """The limits alone."""
        return Limits(upper=self.upper, lower=self.lower)


@dataclass(frozen=True, kw_only=True)
class Effort(NamedFields):
    """How much a study may compute.

    Parameters
    ----------
    ranking
        Effort of a ranking.
    allocation
        Effort of an allocation.
    is_quick
        Whether reports shall say that the run is a quick one.
    seconds
        About how long the ranking and the allocation may take together, by a stated number of units a second for each
        kind of model: their units are scaled to it, those of the quick effort where the full one takes longer, and no
        clock is read, so that the same study has the same bits [s].
    until
        ``"order of the first three"``, any number of places: the blocks of a ranking grow until that order is stable,
        within a limit.
    """

    called: ClassVar[str] = "effort"

    ranking: Annotated[RankingEffort, a(RankingEffort)] = field(default_factory=RankingEffort)
    allocation: Annotated[AllocationEffort, a(AllocationEffort)] = field(default_factory=AllocationEffort)
    is_quick: Annotated[bool, a(bool)] = False
    seconds: Annotated[
        float | None, or_none(number("a number above 0 up to 86,400, or None", above=0, most=86_400))
    ] = None
    until: Annotated[str | None, _UNTIL] = None

    @property
    def places(self) -> int | None:
        """First places whose order a ranking must settle; None where nothing is asked of it [-]."""
        if self.until is None:
            return None
        said = self.until.split()[-1]
        return int(said) if said.isdigit() else _NUMBERS.index(said) + 1

    def notes(self, model: Model, units: int) -> tuple[str, ...]:
        """Return what a reader must know of the time that was asked for, of which so many units are made [-]."""
        if self.seconds is None:
            return ()
        rate = f"at {model.stated_rate:,.0f} units a second, an assumed rate that no clock corrects"
        takes = units / model.stated_rate
        if takes > _LONGER * self.seconds:
            least = f"the least effort that has an answer takes about {takes:,.0f} s {rate}"
            return (f"{self.seconds:,g} s were asked for; {least}",)
        return (f"units for about {self.seconds:,g} s {rate}; four times as long halves the intervals of the indices",)

    def of_ranking(self, model: Model, sources: int, kinds: int) -> RankingEffort:
        """Return how much a ranking may compute, one of so many questions that share the time [-]."""

        def sized(effort: RankingEffort) -> RankingEffort:
            return effort.of_fast_model(sources) if is_fast(model) else effort

        effort = sized(self.ranking)
        if self.seconds is not None:
            units = self.seconds / kinds * model.stated_rate
            if self.ranking == RankingEffort() and units < effort.counted(sources):
                effort = sized(QUICK_RANKING)
            effort = effort.within(units, sources)
        return effort if self.places is None else effort.until_order(self.places)

    def of_allocation(self, model: Model, kinds: int) -> AllocationEffort:
        """Return how much an allocation may compute, one of so many questions that share the time [-]."""

        def sized(effort: AllocationEffort) -> AllocationEffort:
            return effort.of_fast_model if is_fast(model) else effort

        effort = sized(self.allocation)
        if self.seconds is None:
            return effort
        units = self.seconds / kinds * model.stated_rate
        if self.allocation == AllocationEffort() and units < effort.counted:
            effort = sized(QUICK_ALLOCATION)
        return effort.within(units)


QUICK = Effort(ranking=QUICK_RANKING, allocation=QUICK_ALLOCATION, is_quick=True)
"""Effort of a quick run: every stage is real, every interval wide."""


def effort_of(name: str, place: str) -> Effort:
    """Return the effort of a name, ``quick`` or ``full``."""
    UnknownNameError.require(place, "effort", name, ("quick", "full"))
    return QUICK if name == "quick" else Effort()


def _is_title_block(given: object) -> bool:
    return isinstance(given, Mapping) and all(
        label in _TITLE_BLOCK and isinstance(text, str) and len(text) <= _LONGEST_TEXT for label, text in given.items()
    )


@dataclass(frozen=True, repr=False)
class Problem(NamedFields):
    """A model at the zones of a drawing, what is limited, and how much may be computed; for its fields see `Study`."""

    called: ClassVar[str] = "study"
    by_position: ClassVar[int] = 2

    model: Annotated[
        "ModelSource | None",
        Rule(
            "ta.reducer(...), ta.model(...) or another model",
            lambda given: given is None or (hasattr(given, "bound") and not isinstance(given, type)),
        ),
    ] = None
    drawing: Annotated[
        "Drawing | None", Rule("ta.drawing(...)", lambda given: given is None or hasattr(given, "errors"))
    ] = None
    limits: Annotated[
        Mapping[str, Limit | None],
        mapped("a dictionary of outputs and their ta.Limit(...)", Rule("", lambda _: True)),
    ] = field(default_factory=dict)
    joint: Annotated[
        AtYield | Literal["common"] | None,
        Rule("ta.AtYield(...), 'common' or None", lambda given: given in (COMMON, None) or isinstance(given, AtYield)),
    ] = COMMON
    name: Annotated[
        str, Rule("100 letters, digits, '_', '-', '.' and blanks, or less", lambda name: _is_name(name))
    ] = "study"
    seed: Annotated[int, whole("0 or a positive integer", 0)] = 1
    largest_failed_share: Annotated[float, number("0 to 0.5", least=0, below=0.5)] = 0.01
    effort: Annotated[Effort, a(Effort, "'quick', 'full' or ta.Effort(...)")] = field(default_factory=Effort)
    title_block: Annotated[
        Mapping[str, str],
        Rule(
            f"a dictionary of texts up to {_LONGEST_TEXT} characters under {', '.join(_TITLE_BLOCK)}", _is_title_block
        ),
    ] = field(default_factory=dict)
    neglected: Annotated[
        Sequence[str],
        each("a list of names in quotation marks, such as ['disc*.tilt']", a(str)),
    ] = ()
    compensators: Annotated[
        "Sequence[Compensator]",
        each("several of ta.Sorting(...), ta.Shim(...) and ta.Indexing(...)", a(Compensator)),
    ] = ()
    questions: Sequence[Any] = ()

    def __post_init__(self) -> None:
        if isinstance(self.effort, str):
            object.__setattr__(self, "effort", effort_of(self.effort, self.place))
        if isinstance(self.compensators, Compensator):
            object.__setattr__(self, "compensators", (self.compensators,))
        super().__post_init__()
        object.__setattr__(self, "compensators", tuple(self.compensators))
        for output, limit in self.limits.items():
            if not isinstance(limit, Limit | None):
                allowed = "ta.Limit(...), or None to lift the model's own"
                raise InputError.at(self.place, f"limits[{output!r}]", limit, allowed)

    @property
    def place(self) -> str:
        """Who is meant, for messages."""
        return self._place(vars(self))

    @classmethod
    def _place(cls, named: Mapping[str, Any]) -> str:
        """Return who is meant; a name that is none is not said."""
        return f"{cls.called} {named['name']}" if _is_name(named.get("name")) else cls.called

    @property
    def quick(self) -> bool:
        """Whether the effort is the small one."""
        return self.effort.is_quick

    def with_effort(self, effort: Literal["quick", "full"] | Effort | None) -> Self:
        """Return the same at another effort, as it is where none is given."""
        if effort is None:
            return self
        return replace(self, effort=effort_of(effort, self.place) if isinstance(effort, str) else effort)

    def changed(
        self, drawing: Drawing | str | Path, settings: Mapping[str, float] | None = None, name: str = ""
    ) -> Self:
        """Return the same at another drawing, and at other values of the model's settings and operating conditions.

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


def _is_name(given: object) -> bool:
    return isinstance(given, str) and bool(_NAME.fullmatch(given))
