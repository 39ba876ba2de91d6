"""What is chosen at assembly: parts sorted into classes that fit each other, and sizes chosen for what was measured.

`ErrorModel` applies them to random units, so that every question is asked of reducers as they are assembled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Annotated, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import ABOVE_ZERO, BELOW_ONE
from tolalloc.drawings.sources import Source, known_as, meant
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.named_fields import NamedFields, Rule, flag, is_number, mapped, number, whole
from tolalloc.reading.units import MICROMETRE

_MOST = 64
"""Most classes and most sizes that are believed [-]."""
MOST_CHOICES = 16
"""Most combinations of classes and sizes that one question compares [-]."""


def _is_count(value: object) -> bool:
    return type(value) is int and 1 <= value <= _MOST


def _are_counts(given: object) -> bool:
    if isinstance(given, Sequence) and not isinstance(given, str):
        return 0 < len(given) == len(set(given)) and all(map(_is_count, given))
    return _is_count(given)


_CLASSES = Rule(f"a whole number from 1 to {_MOST}, or several different ones to choose from", _are_counts)
_SIZES = Rule(
    f"an odd whole number from 1 to {_MOST}, or several different ones to choose from",
    lambda given: _are_counts(given) and all(own % 2 for own in (given if isinstance(given, Sequence) else (given,))),
)
_COST = number("a cost of 0 or above", least=0.0)
_TEXT = Rule("the name of a source in quotation marks", lambda given: isinstance(given, str) and bool(given))


@dataclass(frozen=True)
class Sorting(NamedFields):
    """Selective assembly: two parts are measured, sorted into classes, and mated class by class.

    Parameters
    ----------
    parts, mates
        Sources of the tolerance table whose deviations are sorted: sizes, or positions, which are sorted on each axis.
        The parts of one unit, such as all its pins, come from one class.
    classes
        Number of classes of equally many parts, on each axis; several numbers are compared by an allocation, and other
        questions take the first [-].
    opposite
        Whether the smallest parts go with the largest mates rather than with the smallest.
    batch
        Parts that are sorted at a time, from which follows how many are left over [-].
    class_cost
        What sorting costs per unit for every class beyond the first [cost units].
    leftover_cost
        What a part and a mate that are left over cost together [cost units].

    Notes
    -----
    The classes end at the quantiles i/n of each process, so all hold equally many parts on average. A unit's parts then
    lie in class ⌊n·F(mate)⌋, and inside it as they come: F(part) → (⌊n·F(mate)⌋ + frac(n·F(part)))/n. Both processes
    keep their own distribution, and units need no batch to be drawn (own derivation; tests compare with batches that
    are assigned exactly). What is left over does, `leftover`.

    References
    ----------
    Mease, Nair, Sudjianto, Selective assembly in manufacturing: statistical issues and optimal binning strategies,
    Technometrics 46 (2004) 165–175.

    Examples
    --------
    >>> sorting = Sorting("pin.diameter", "housing.groove.radius", classes=4)
    >>> round(sorting.leftover, 4)
    0.0975
    """

    called: ClassVar[str] = "sorting"
    by_position: ClassVar[int] = 2

    parts: Annotated[str, _TEXT]
    mates: Annotated[str, _TEXT]
    classes: Annotated[int | Sequence[int], _CLASSES] = (1, 2, 4)
    opposite: Annotated[bool, flag()] = False
    batch: Annotated[int, whole("a whole number from 1 to 1,000,000", 1, 1_000_000)] = 100
    class_cost: Annotated[float, _COST] = 0.0
    leftover_cost: Annotated[float, _COST] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.classes, Sequence):
            object.__setattr__(self, "classes", tuple(self.classes))
        if self.parts == self.mates:
            raise InputError.at(self.called, "mates", self.mates, "another source than parts")

    @property
    def choices(self) -> tuple[Sorting, ...]:
        """The same with every number of classes that may be chosen."""
        return tuple(replace(self, classes=own) for own in _several(self.classes))

    @property
    def count(self) -> int:
        """Classes in force, the first number that is stated [-]."""
        return _several(self.classes)[0]

    @property
    def acts(self) -> bool:
        """Whether there is anything to choose."""
        return self.count > 1

    @property
    def named(self) -> tuple[str, ...]:
        """Sources that it ties to each other."""
        return (self.parts, self.mates)

    def resolved(self, sources: Sequence[Source], place: str) -> Sorting:
        """Return the same with the names that the table itself uses.

        Raises
        ------
        InputError, UnknownNameError
            No such source, or one that cannot be sorted so.
        """
        parts = _source("parts", self.parts, sources, place)
        mates = _source("mates", self.mates, sources, place)
        for name, own in (("parts", parts), ("mates", mates)):
            if own.feature not in (Feature.SIZE, Feature.POSITION):
                allowed = "a size or a position; parts ground together are correlated instead, by correlations="
                raise InputError.at(f"{place}, {self.called}", name, own.name, allowed)
        axes = [_axes(own) for own in (parts, mates)]
        if axes[0] != axes[1] or mates.each > 1:
            allowed = "a source of the same feature with one deviation in each unit"
            raise InputError.at(f"{place}, {self.called} of {parts.name}", "mates", mates.name, allowed)
        return replace(self, parts=parts.name, mates=mates.name)

    @property
    def leftover(self) -> float:
        """Share of the parts that find no mate in a batch, on average [-].

        1 − (n/B)·E[min(N, M)] with E[min(N, M)] = Σₖ P(N ≥ k)² for two independent binomial numbers of B parts in one
        of n classes (own derivation).

        Examples
        --------
        >>> round(Sorting("a", "b", classes=2, batch=2).leftover, 6)  # 1 − P(N ≥ 1)² − P(N = 2)² with 3/4 and 1/4
        0.375
        """
        return self._leftover(self.count)

    def _leftover(self, classes: int) -> float:
        from scipy.stats import binom

        if classes == 1:
            return 0.0
        at_least = binom.sf(np.arange(self.batch), self.batch, 1.0 / classes)
        return float(1.0 - classes / self.batch * np.sum(at_least**2))

    def leftover_of(self, parts: Source) -> float:
        """Return the same of a source, whose classes of a position are those of both axes together [-]."""
        return self._leftover(self.count ** _axes(parts))

    def cost(self, parts: Source) -> float:
        """Return what it costs per unit that is built [cost units]."""
        lost = self.leftover_of(parts)
        return float(self.class_cost * (self.count ** _axes(parts) - 1) + self.leftover_cost * lost / (1.0 - lost))

    def sorted(self, uniform: Float[np.ndarray, "*sample column"], columns: Mapping[str, slice]) -> None:
        """Put the parts of units into the class of their mates, uniform numbers in place, by columns of sources [-]."""
        number, parts = uniform[..., columns[self.mates]], columns[self.parts]
        least = np.floor(self.count * (1.0 - number if self.opposite else number))
        own = uniform[..., parts]
        copies = np.tile(np.minimum(least, self.count - 1), own.shape[-1] // number.shape[-1])
        inside = np.modf(self.count * own)[0]
        uniform[..., parts] = np.clip((copies + inside) / self.count, ABOVE_ZERO, BELOW_ONE)

    def limits(self, source: Source) -> Float[np.ndarray, " limit"]:
        """Return where the classes of one of its sources end, as deviations from the nominal size [m].

        The outer classes are open: what the zone allows beyond belongs to them. Of a position, those of each axis.
        """
        shares = np.arange(1, self.count) / self.count
        columns = np.repeat(shares[:, np.newaxis], len(source.columns), axis=1)
        return np.asarray(source.standard_values(columns)[:, 0] * source.zone + source.middles[0])


@dataclass(frozen=True)
class Shim(NamedFields):
    """A part that is chosen from sizes in steps for what was measured of the others.

    Parameters
    ----------
    part
        Source of the tolerance table whose part comes in several sizes: its own deviation is that from its size.
    step
        Step between two sizes [µm].
    sizes
        Number of sizes, the middle one nominal: an odd number; several are compared by an allocation, and other
        questions take the first [-].
    against
        Measured source → how much of the gap a micrometre of it makes, for a gap of the part's own 1; nothing where
        the part's own deviation alone is measured [-].
    size_cost
        What every size beyond the first costs per unit [cost units].

    Notes
    -----
    The gap g = d + Σ w·dₛ of measured deviations becomes g + step·k with the whole number k, at most (sizes − 1)/2
    either way, that leaves the least of it; d becomes d + step·k. Measuring errs by nothing (an assumption).
    Derivatives with respect to zones are those of the sizes chosen, as a unit that changes its size has none (own
    derivation).

    Examples
    --------
    >>> Shim("pin.diameter", step=0.5, sizes=5, against={"housing.groove.radius": -1.0}).reach
    2
    """

    called: ClassVar[str] = "shim"
    by_position: ClassVar[int] = 1

    part: Annotated[str, _TEXT]
    step: Annotated[float, number("a step above 0 up to 1,000 µm", above=0.0, most=1000.0)]
    sizes: Annotated[int | Sequence[int], _SIZES] = (1, 3, 5)
    against: Annotated[
        Mapping[str, float],
        mapped("source names with their weights, such as {'housing.groove.radius': -1.0}", Rule("", is_number)),
    ] = field(default_factory=dict)
    size_cost: Annotated[float, _COST] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.sizes, Sequence):
            object.__setattr__(self, "sizes", tuple(self.sizes))
        if self.part in self.against:
            raise InputError.at(self.called, "against", self.part, "other sources than part")

    def __hash__(self) -> int:
        return hash((self.part, self.step, self.sizes, tuple(self.against.items()), self.size_cost))

    @property
    def choices(self) -> tuple[Shim, ...]:
        """The same with every number of sizes that may be chosen."""
        return tuple(replace(self, sizes=own) for own in _several(self.sizes))

    @property
    def count(self) -> int:
        """Sizes in force, the first number that is stated [-]."""
        return _several(self.sizes)[0]

    @property
    def reach(self) -> int:
        """Steps to either side of the nominal size [-]."""
        return (self.count - 1) // 2

    @property
    def acts(self) -> bool:
        """Whether there is anything to choose."""
        return self.count > 1

    @property
    def named(self) -> tuple[str, ...]:
        """Sources that it ties to each other."""
        return (self.part, *self.against)

    def resolved(self, sources: Sequence[Source], place: str) -> Shim:
        """Return the same with the names that the table itself uses.

        Raises
        ------
        InputError, UnknownNameError
            No such source, or one that is no single length.
        """
        found = [_source("part", self.part, sources, place)]
        found += [_source("against", own, sources, place) for own in self.against]
        for own in found:
            if own.feature is not Feature.SIZE or len(own.columns) > 1 or own.lever != 1.0:
                allowed = "a size with one deviation in each unit, which is a length"
                raise InputError.at(f"{place}, {self.called}", "source", own.name, allowed)
        part, *others = (own.name for own in found)
        return replace(self, part=part, against=dict(zip(others, self.against.values(), strict=True)))

    def cost(self, part: Source) -> float:  # noqa: ARG002
        """Return what it costs per unit [cost units]."""
        return self.size_cost * (self.count - 1)

    def shimmed(self, deviations: Float[np.ndarray, "*sample column"], columns: Mapping[str, slice]) -> None:
        """Put the size that is chosen into deviations of units in place, by the columns of every source [m]."""
        part, step = columns[self.part].start, self.step * MICROMETRE
        gap = deviations[..., part].copy()
        for name, weight in self.against.items():
            gap += weight * deviations[..., columns[name].start]
        deviations[..., part] -= step * np.clip(np.rint(gap / step), -self.reach, self.reach)


Compensator = Sorting | Shim
"""What is chosen at assembly."""


def _several(given: int | Sequence[int]) -> tuple[int, ...]:
    return (given,) if isinstance(given, int) else tuple(given)


def _axes(source: Source) -> int:
    return 2 if source.feature is Feature.POSITION else 1


def _source(field_name: str, name: str, sources: Sequence[Source], place: str) -> Source:
    """Return the one source that a name means, which must vary."""
    found = meant(name, sources)
    if not found:
        raise UnknownNameError.among(place, f"{field_name} of a compensator", name, known_as(sources))
    if len(found) > 1:
        raise InputError.at(place, f"{field_name} of a compensator", name, f"one source and no pattern of {len(found)}")
    source = next(own for own in sources if own.name == found[0])
    if not source.zone > 0.0:
        raise InputError.at(place, f"{field_name} of a compensator", name, "a source with a zone above 0")
    return source


def in_force(compensators: Sequence[Compensator], sources: Sequence[Source], place: str) -> tuple[Compensator, ...]:
    """Return the compensators that act, with the names of the table.

    Raises
    ------
    InputError, UnknownNameError
        A source that is not there or cannot be sorted or shimmed, or that is sorted twice.
    """
    found = [own.resolved(sources, place) for own in compensators]
    sorted_parts = [own.parts for own in found if isinstance(own, Sorting)]
    shimmed = [own.part for own in found if isinstance(own, Shim)]
    for names, word in ((sorted_parts, "sorted as parts"), (shimmed, "shimmed")):
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{place}: {name} is {word} {names.count(name)} times; allowed is once.")
    for own in (own for own in found if isinstance(own, Sorting)):
        if own.mates in sorted_parts:
            raise InputError(
                f"{place}: the mates {own.mates} are sorted as parts too; name the mates of both, so that one choice "
                "follows from one measurement."
            )
    return tuple(own for own in found if own.acts)


def all_choices(compensators: Sequence[Compensator], place: str) -> tuple[tuple[Compensator, ...], ...]:
    """Return every combination of classes and sizes, the first numbers first.

    Raises
    ------
    InputError
        More than are compared.
    """
    found: tuple[tuple[Compensator, ...], ...] = tuple(product(*(own.choices for own in compensators)))
    if len(found) > MOST_CHOICES:
        raise InputError.at(place, "combinations of classes and sizes", len(found), f"{MOST_CHOICES} or less")
    return found


def assembly_cost(compensators: Sequence[Compensator], sources: Sequence[Source]) -> float:
    """Return what choosing parts at assembly costs per unit [cost units]."""
    known = {source.name: source for source in sources}
    return float(sum(own.cost(known[own.named[0]]) for own in compensators))


def choice_label(compensators: Sequence[Compensator]) -> str:
    """Return what is chosen, in words, such as ``4 classes of pin.diameter``; of nothing, ``as they come``."""
    said = [
        f"{own.count} {'classes' if isinstance(own, Sorting) else 'sizes'} of {own.named[0]}"
        for own in compensators
        if own.acts
    ]
    return " and ".join(said) or "as they come"


def sorted_together(compensators: Sequence[Compensator]) -> tuple[tuple[str, str], ...]:
    """Return the parts and mates whose deviations depend on each other by sorting."""
    return tuple((own.parts, own.mates) for own in compensators if isinstance(own, Sorting))
