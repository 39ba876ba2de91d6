"""What is chosen at assembly: parts sorted into classes that fit each other, and sizes chosen for what was measured.

`ErrorModel` applies them to random units, so that every question is asked of reducers as they are assembled: each is
a map of one unit's numbers, of the uniform ones that it is drawn from (`Compensator.sorted`) or of its deviations
(`Compensator.fitted`).
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Annotated, ClassVar, Self

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.drawings.sources import Source, known_as, meant
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.named_fields import NamedFields, Rule, is_number, number, whole
from tolalloc.reading.units import MICROMETRE

_MOST = 64
"""Most classes and most sizes that are believed [-]."""
MOST_CHOICES = 16
"""Most combinations of classes and sizes that one question compares [-]."""


_COUNT = whole("", 1, _MOST)
COST = number("a cost of 0 or above", least=0.0)
TEXT = Rule("the name of a source in quotation marks", lambda given: isinstance(given, str) and bool(given))
Names = str | tuple[str, ...]
"""One source of a tolerance table, or several that are chosen for each on their own."""


def _are_counts(given: object) -> bool:
    if isinstance(given, Sequence) and not isinstance(given, str):
        return 0 < len(given) == len(set(given)) and all(map(_COUNT.keeps, given))
    return _COUNT.keeps(given)


COUNTS = Rule(f"a whole number from 1 to {_MOST}, or several different ones to choose from", _are_counts)
_SIZES = Rule(
    f"an odd whole number from 1 to {_MOST}, or several different ones to choose from",
    lambda given: _are_counts(given) and all(own % 2 for own in (given if isinstance(given, Sequence) else (given,))),
)


def _are_texts(given: object) -> bool:
    return TEXT.keeps(given) or (isinstance(given, tuple) and bool(given) and all(map(TEXT.keeps, given)))


_TEXTS = Rule("the name or pattern of sources in quotation marks, or several names in brackets", _are_texts)
_AGAINST = Rule(
    "source names with their weights, such as {'housing.groove.radius': -1.0}",
    lambda given: isinstance(given, Mapping) and all(_are_texts(own) and is_number(given[own]) for own in given),
)


Units = Float[np.ndarray, "*sample column"]
"""Numbers of some units, one row each: uniform ones [-] or deviations [m, angles rad]."""


@dataclass(frozen=True)
class Standing:
    """An active source, and where its columns stand among those of a unit."""

    source: Source
    columns: slice

    @property
    def vector(self) -> slice:
        """Where the vectors of a position stand, or the one of the wave of order 1; of a size, its deviations."""
        if not self.source.spectrum:
            return self.columns
        start = self.columns.start + 2 * [order for order, _ in self.source.spectrum].index(1)
        return slice(start, start + 2)

    @property
    def width(self) -> int:
        """Columns of one deviation or vector [-]."""
        return 1 if self.source.feature is Feature.SIZE else 2

    def of(self, numbers: Units) -> Float[np.ndarray, "*sample copy width"]:
        """Return the deviations or vectors of every like feature among the numbers of units, a copy."""
        own = numbers[..., self.vector]
        return own.reshape(*own.shape[:-1], -1, self.width).copy()

    def put(self, numbers: Units, own: Float[np.ndarray, "*sample copy width"]) -> None:
        """Put them back in place."""
        numbers[..., self.vector] = own.reshape(*own.shape[:-2], -1)


Known = Mapping[str, Standing]
"""Where the columns of each source stand, by its name."""


class Compensator(NamedFields, ABC):
    """What is chosen at assembly: how many choices there are, what they cost, and the map of one unit's numbers."""

    counted: ClassVar[str]
    """Name of the field with the number of choices, which is also their word: classes, sizes."""
    done: ClassVar[str]
    """What it does to its parts, in a refusal."""

    def __post_init__(self) -> None:
        super().__post_init__()
        given = getattr(self, self.counted)
        if isinstance(given, Sequence):
            object.__setattr__(self, self.counted, tuple(given))

    @property
    def _counts(self) -> tuple[int, ...]:
        given = getattr(self, self.counted)
        return (given,) if isinstance(given, int) else tuple(given)

    @property
    def choices(self) -> tuple[Self, ...]:
        """The same with every number of choices that may be taken."""
        return tuple(replace(self, **{self.counted: own}) for own in self._counts)  # type: ignore[type-var]

    @property
    def count(self) -> int:
        """Classes or sizes in force, the first number that is stated [-]."""
        return self._counts[0]

    @property
    def acts(self) -> bool:
        """Whether there is anything to choose."""
        return self.count > 1

    @property
    @abstractmethod
    def chosen(self) -> tuple[str, ...]:
        """Sources whose parts are chosen."""

    @property
    @abstractmethod
    def named(self) -> tuple[str, ...]:
        """Sources that it names, those that are chosen first."""

    @property
    def tied(self) -> tuple[tuple[str, str], ...]:
        """Pairs of sources whose numbers depend on each other by it, parts first and then their mates."""
        return ()

    @property
    def independent(self) -> tuple[str, ...]:
        """Sources that may be correlated with no other."""
        return ()

    @property
    def arranges(self) -> bool:
        """Whether it puts deviations in the place of those that the zones give, which then grow with the zones."""
        return False

    @property
    def label(self) -> str:
        """What is chosen, in words, such as ``4 classes of pin.diameter``."""
        more = f" and {len(self.chosen) - 1} more" if len(self.chosen) > 1 else ""
        return f"{self.count} {self.counted} of {self.chosen[0]}{more}"

    @abstractmethod
    def resolved(self, sources: Sequence[Source], place: str) -> Self:
        """Return the same with the table's own names; one of which nothing can be chosen so is refused."""

    @abstractmethod
    def cost(self, sources: Mapping[str, Source]) -> float:
        """Return what it costs per unit that is built, at the zones of sources by their names [cost units]."""

    def leftover_of(self, sources: Mapping[str, Source]) -> float:  # noqa: ARG002
        """Return the share of parts that find no mate, at the zones of sources by their names [-]."""
        return 0.0

    def sorted(self, uniform: Units, known: Known) -> None:
        """Put the parts of units where their mates are, uniform numbers in place [-]; unless it sorts, nothing."""

    def arranged(self, deviations: Units, zones: Mapping[str, float], known: Known) -> None:
        """Put deviations of units at these zones [m] where it `arranges` them, in place [m]."""

    def fitted(self, deviations: Units, known: Known) -> None:
        """Put what is chosen into deviations of units, in place [m]; unless it fits for measured ones, nothing."""


class _Fitting(Compensator):
    """What is chosen of a part, or of each of several parts, for what was measured of the others."""

    part: Names
    against: Mapping[Names, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.named[len(self.chosen) :]:
            if name in self.chosen:
                raise InputError.at(self.called, "against", name, "other sources than part")

    @property
    def chosen(self) -> tuple[str, ...]:
        return _listed(self.part)

    @property
    def named(self) -> tuple[str, ...]:
        return (*self.chosen, *(name for own in self.against for name in _listed(own)))

    def cost(self, sources: Mapping[str, Source]) -> float:  # noqa: ARG002
        price: float = getattr(self, f"{self.counted[:-1]}_cost")
        return price * (self.count - 1)

    @property
    def of_each(self) -> tuple[tuple[str, tuple[tuple[str, float], ...]], ...]:
        """Every part, and what is measured for it of the others with its weight [-]."""
        others = [(_listed(own), weight) for own, weight in self.against.items()]
        return tuple(
            (part, tuple((names[at % len(names)], weight) for names, weight in others))
            for at, part in enumerate(self.chosen)
        )

    def resolved(self, sources: Sequence[Source], place: str) -> Self:
        parts, against = _sources("part", self.part, sources, place), dict[Names, float]()
        for given, weight in self.against.items():
            others = _sources("against", given, sources, place)
            copies = {own.each for own in others} - {1}
            if len(others) not in (1, len(parts)) or (copies and copies != {own.each for own in parts}):
                allowed = "one source for all parts or one for each of them, with as many like features or one"
                names = " and ".join(own.name for own in others)
                raise InputError.at(f"{place}, {self.called}", "against", names, allowed)
            against[_together(others)] = weight
        return replace(self, part=_together(parts), against=against)  # type: ignore[type-var]


@dataclass(frozen=True)
class Shim(_Fitting):
    """A part that is chosen from sizes in steps for what was measured of the others.

    Parameters
    ----------
    part
        Source of the tolerance table whose part comes in several sizes: its own deviation is that from its size. Like
        features of one source, such as 40 pins, and all sources of a pattern, of a dimension or of several names are
        chosen each on its own.
    step
        Step between two sizes [µm].
    sizes
        Number of sizes, the middle one nominal: an odd number; several are compared by an allocation, and other
        questions take the first [-].
    against
        Measured source → how much of the gap a micrometre of it makes, for a gap of the part's own 1; nothing where
        the part's own deviation alone is measured [-]. One source is measured for all parts; as many as there are parts
        are measured for one each, in the order of the numbers in their names, or in that of several names.
    size_cost
        What every size beyond the first costs per unit, for all parts together [cost units].

    Notes
    -----
    The gap g = d + Σ w·dₛ of measured deviations becomes g + step·k with the whole number k, at most (sizes − 1)/2
    either way, that leaves the least of it; d becomes d + step·k, theory page equation (82). Measuring errs by nothing
    (an assumption). Derivatives with respect to zones are those of the sizes chosen, as a unit that changes its size
    has none (own derivation).

    Examples
    --------
    A distance ring in five thicknesses, chosen for the measured depth of its housing; two steps to either side:

    >>> Shim("ring", step=10.0, sizes=5, against={"housing": -1.0}).reach
    2
    """

    called: ClassVar[str] = "shim"
    counted: ClassVar[str] = "sizes"
    done: ClassVar[str] = "shimmed"
    by_position: ClassVar[int] = 1

    part: Annotated[Names, _TEXTS]
    step: Annotated[float, number("a step above 0 up to 1,000 µm", above=0.0, most=1000.0)]
    sizes: Annotated[int | Sequence[int], _SIZES] = (1, 3, 5)
    against: Annotated[Mapping[Names, float], _AGAINST] = field(default_factory=dict, hash=False)
    size_cost: Annotated[float, COST] = 0.0

    @property
    def reach(self) -> int:
        """Steps to either side of the nominal size [-]."""
        return (self.count - 1) // 2

    def resolved(self, sources: Sequence[Source], place: str) -> Self:
        """Return the same with the names of the table; raise for a source that is no length or not one for each."""
        found = super().resolved(sources, place)
        for own in (own for own in sources if own.name in found.named):
            if own.feature is not Feature.SIZE or own.lever != 1.0:
                raise InputError.at(f"{place}, {self.called}", "source", own.name, "a size, which is a length")
        return found

    def fitted(self, deviations: Units, known: Known) -> None:
        """Put the sizes that are chosen into deviations of units, in place [m]."""
        step = self.step * MICROMETRE
        for name, others in self.of_each:
            part = known[name].columns
            gap = deviations[..., part].copy()
            for other, weight in others:
                gap += weight * deviations[..., known[other].columns]
            deviations[..., part] -= step * np.clip(np.rint(gap / step), -self.reach, self.reach)


@dataclass(frozen=True)
class Indexing(_Fitting):
    """A part that is mounted at the one of several angular positions where its vector best closes those it sits with.

    Parameters
    ----------
    part
        Source of the tolerance table whose part is turned: a position, or a pitch or run-out with a wave of order 1.
        Sources of a pattern or of several names are turned each on its own.
    positions
        Number of positions around a turn; several are compared by an allocation, and other questions take the first
        [-].
    against
        Measured source → how much of the sum its vector makes, for the part's own 1 [-], as `Shim` says.
    position_cost
        What every position beyond the first costs per unit, for all parts together [cost units].

    Notes
    -----
    Theory page equation (88): of the vectors v of the part and s = Σ w·vₛ of the others, v turns by k·360°/n with the k
    that leaves the shortest sum v + s: the one that is nearest to the direction of −s. Other vectors of the part turn
    too and keep their law, as all directions are alike (own derivation). Measuring errs by nothing (an assumption).
    Derivatives with respect to zones are those of the positions chosen, with the vector as it is turned.
    """

    called: ClassVar[str] = "indexing"
    counted: ClassVar[str] = "positions"
    done: ClassVar[str] = "turned"
    by_position: ClassVar[int] = 1

    part: Annotated[Names, _TEXTS]
    positions: Annotated[int | Sequence[int], COUNTS] = (1, 2, 4)
    against: Annotated[Mapping[Names, float], _AGAINST] = field(default_factory=dict, hash=False)
    position_cost: Annotated[float, COST] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.against:
            raise InputError.at(self.called, "against", "empty", "one measured source or several")

    @property
    def independent(self) -> tuple[str, ...]:
        """The parts; those they sit with may be correlated with others."""
        return self.chosen

    def resolved(self, sources: Sequence[Source], place: str) -> Self:
        """Return the same with the names of the table; raise for a source that is no vector or not one for each."""
        found, named = super().resolved(sources, place), f"{place}, {self.called}"
        own = [source for source in sources if source.name in found.named]
        for source in own:
            require_vector(source, named, "source")
        if len({source.over > 0.0 for source in own}) > 1:
            raise InputError.at(named, "against", " and ".join(found.named), "angles with angles, lengths with lengths")
        return found

    @property
    def arranges(self) -> bool:
        """Yes: a vector that is turned grows with its zone as it is turned."""
        return True

    def arranged(self, deviations: Units, zones: Mapping[str, float], known: Known) -> None:  # noqa: ARG002
        """Turn the parts of units to the position that is chosen, deviations in place [m]."""
        for name, others in self.of_each:
            part = _complex(known[name].of(deviations))
            rest = sum((weight * _complex(known[other].of(deviations)) for other, weight in others), np.zeros(1))
            steps = np.rint(self.count * np.angle(-rest * part.conj()) / (2.0 * np.pi)) % self.count
            turned = part * np.exp(2j * np.pi * steps / self.count)
            known[name].put(deviations, np.stack([turned.real, turned.imag], axis=-1))


def _complex(pairs: Float[np.ndarray, "*sample copy 2"]) -> Complex[np.ndarray, "*sample copy"]:
    return np.asarray(pairs[..., 0] + 1j * pairs[..., 1])


def _listed(given: Names) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else given


def _together(sources: Sequence[Source]) -> Names:
    return sources[0].name if len(sources) == 1 else tuple(own.name for own in sources)


def require_vector(source: Source, place: str, named: str) -> None:
    """Raise unless a source is a vector or has one of order 1, and no systematic waves: all directions alike."""
    orders = [order for order, _ in source.spectrum]
    if source.feature is Feature.SIZE or (orders and 1 not in orders):
        raise InputError.at(place, named, source.name, "a position, or a pitch or run-out with a wave of order 1")
    if source.systematic:
        raise InputError.at(place, named, source.name, "a source without systematic waves, all directions alike")


def _sources(field_name: str, given: Names, sources: Sequence[Source], place: str) -> tuple[Source, ...]:
    """Return the sources that names mean, which must vary; those of one name in the order of the numbers in theirs."""
    known, named = {own.name: own for own in sources}, f"{field_name} of a compensator"
    found = list[Source]()
    for name in _listed(given):
        of_name = [known[own] for own in meant(name, sources)]
        if not of_name:
            raise UnknownNameError.among(place, named, name, known_as(sources))
        if not all(own.zone > 0.0 for own in of_name):
            raise InputError.at(place, named, name, "a source with a zone above 0")
        found += sorted(of_name, key=lambda own: [int(digits) for digits in re.findall(r"\d+", own.name)])
    if twice := next((own.name for own in found if found.count(own) > 1), None):
        raise InputError.at(place, named, twice, "every source once")
    return tuple(found)


def one_source(field_name: str, name: str, sources: Sequence[Source], place: str) -> Source:
    """Return the one source that a name means, which must vary."""
    found = _sources(field_name, name, sources, place)
    if len(found) > 1:
        raise InputError.at(place, f"{field_name} of a compensator", name, f"one source and no pattern of {len(found)}")
    return found[0]


def in_force(compensators: Sequence[Compensator], sources: Sequence[Source], place: str) -> tuple[Compensator, ...]:
    """Return the compensators that act, with the names of the table; a source may be chosen once alone."""
    found = [own.resolved(sources, place) for own in compensators]
    done = Counter((name, own.done) for own in found for name in own.chosen)
    for (name, what), times in done.items():
        if times > 1:
            raise InputError(f"{place}: {name} is {what} {times} times; allowed is once.")
    pairs = [pair for own in found for pair in own.tied]
    for mates in (mates for _, mates in pairs if mates in dict(pairs)):
        raise InputError(
            f"{place}: the mates {mates} are sorted as parts too; name the mates of both, so that one choice follows "
            "from one measurement."
        )
    sorted_by = Counter(name for pair in pairs for name in pair)
    for name in (name for own in found if own.tied and own.arranges for name in own.named if sorted_by[name] > 1):
        raise InputError(f"{place}: {name} is sorted into classes of equal width and once more; allowed is once.")
    return tuple(own for own in found if own.acts)


def all_choices(compensators: Sequence[Compensator], place: str) -> tuple[tuple[Compensator, ...], ...]:
    """Return every combination of classes, sizes and positions, the first numbers first; too many are an InputError."""
    found: tuple[tuple[Compensator, ...], ...] = tuple(product(*(own.choices for own in compensators)))
    if len(found) > MOST_CHOICES:
        raise InputError.at(place, "combinations at assembly", len(found), f"{MOST_CHOICES} or less")
    return found


def assembly_cost(compensators: Sequence[Compensator], sources: Sequence[Source]) -> float:
    """Return what choosing parts at assembly costs per unit, at the zones of the sources [cost units]."""
    known = {source.name: source for source in sources}
    return float(sum(own.cost(known) for own in compensators))


def choice_label(compensators: Sequence[Compensator]) -> str:
    """Return what is chosen, in words, such as ``4 classes of pin.diameter``; of nothing, ``as they come``."""
    return " and ".join(own.label for own in compensators if own.acts) or "as they come"
