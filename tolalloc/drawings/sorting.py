"""Selective assembly: parts sorted into classes that fit each other, by deviation, direction or size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from jaxtyping import Float, Int

from tolalloc.drawings.compensators import (
    COST,
    COUNTS,
    TEXT,
    Compensator,
    Known,
    Standing,
    one_source,
    require_vector,
)
from tolalloc.drawings.distributions import ABOVE_ZERO, BELOW_ONE, RAYLEIGH, ndtr, ndtri
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import Rule, flag, whole

_MEASURED = ("deviation", "direction", "size", "direction and size")
"""What may be measured of parts that are sorted."""


@dataclass(frozen=True)
class Sorting(Compensator):
    """Selective assembly: two parts are measured, sorted into classes, and mated class by class.

    Parameters
    ----------
    parts, mates
        Sources of the tolerance table that are sorted, also of two like parts of one unit, such as its discs. The parts
        of one unit, such as all its pins, come from one class.
    classes
        Number of classes of equally many parts, on each axis; several numbers are compared by an allocation, and other
        questions take the first [-].
    opposite
        Whether the smallest parts go with the largest mates rather than with the smallest, and directions with opposite
        ones.
    by
        What is measured of them: their ``deviation``, of positions on each axis; of a position, or of the wave of order
        1 of a pitch or run-out, its ``direction`` in the axes of its columns, its ``size``, or ``direction and size``.
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

    The same map takes the share of all directions below that of a vector, φ/2π, and the probability of one no longer.
    The normal numbers behind a vector give both, independently of each other, so that every order of a wave but the
    first stays as it comes.

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
    counted: ClassVar[str] = "classes"
    done: ClassVar[str] = "sorted as parts"
    by_position: ClassVar[int] = 2

    parts: Annotated[str, TEXT]
    mates: Annotated[str, TEXT]
    classes: Annotated[int | Sequence[int], COUNTS] = (1, 2, 4)
    opposite: Annotated[bool, flag()] = False
    by: Annotated[str, Rule(f"one of {', '.join(map(repr, _MEASURED))}", _MEASURED.__contains__)] = _MEASURED[0]
    batch: Annotated[int, whole("a whole number from 1 to 1,000,000", 1, 1_000_000)] = 100
    class_cost: Annotated[float, COST] = 0.0
    leftover_cost: Annotated[float, COST] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.parts == self.mates:
            raise InputError.at(self.called, "mates", self.mates, "another source than parts")

    @property
    def chosen(self) -> tuple[str, ...]:
        """The source that is sorted as parts."""
        return (self.parts,)

    @property
    def named(self) -> tuple[str, ...]:
        """Parts and mates."""
        return (self.parts, self.mates)

    @property
    def tied(self) -> tuple[tuple[str, str], ...]:
        """Parts and mates, whose deviations depend on each other."""
        return ((self.parts, self.mates),)

    @property
    def independent(self) -> tuple[str, ...]:
        """The parts; their mates may be correlated with others."""
        return (self.parts,)

    def resolved(self, sources: Sequence[Source], place: str) -> Sorting:
        """Return the same with the names that the table itself uses.

        Raises
        ------
        InputError, UnknownNameError
            No such source, or one that cannot be sorted so.
        """
        parts = one_source("parts", self.parts, sources, place)
        mates = one_source("mates", self.mates, sources, place)
        for name, own in (("parts", parts), ("mates", mates)):
            self._require_sortable(own, f"{place}, {self.called}", name)
        if self._numbers(parts) != self._numbers(mates) or mates.each > 1:
            allowed = "a source of the same feature with one deviation in each unit"
            raise InputError.at(f"{place}, {self.called} of {parts.name}", "mates", mates.name, allowed)
        return replace(self, parts=parts.name, mates=mates.name)

    def _require_sortable(self, source: Source, place: str, named: str) -> None:
        if self.by != _MEASURED[0]:
            require_vector(source, place, named)
        elif source.feature not in (Feature.SIZE, Feature.POSITION):
            allowed = (
                "a size or a position; waves are sorted by direction or size, parts ground together are correlated"
            )
            raise InputError.at(place, named, source.name, allowed)
        elif source.feature is Feature.POSITION and source.zone_mapping.marginal != RAYLEIGH:
            raise InputError.at(place, named, source.name, "a normal position; others are sorted by direction and size")

    @property
    def label(self) -> str:
        """What is chosen, in words, such as ``4 classes of disc1.runout by direction``."""
        return super().label + (f" by {self.by}" if self.by != _MEASURED[0] else "")

    def _numbers(self, source: Source) -> int:
        """Return how many numbers of a part are sorted, each into its own classes [-]."""
        return self.measured.size if self.by != _MEASURED[0] else 1 if source.feature is Feature.SIZE else 2

    @property
    def measured(self) -> Int[np.ndarray, " number"]:
        """Which of size and direction of a vector are measured, 0 and 1 [-]."""
        return np.flatnonzero([name in self.by.split() for name in ("size", "direction")])

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
        return self._leftover(self.count ** self._numbers(parts))

    def cost(self, sources: Mapping[str, Source]) -> float:
        """Return what it costs per unit that is built [cost units]."""
        parts = sources[self.parts]
        lost = self.leftover_of(parts)
        return float(
            self.class_cost * (self.count ** self._numbers(parts) - 1) + self.leftover_cost * lost / (1.0 - lost)
        )

    def sorted(self, uniform: Float[np.ndarray, "*sample column"], known: Known) -> None:
        """Put the parts of units into the class of their mates, uniform numbers in place [-]."""
        parts, mates = (known[name].of(uniform) for name in self.named)
        if self.by == _MEASURED[0]:
            known[self.parts].put(uniform, self._placed(parts, 1.0 - mates if self.opposite else mates))
            return
        polar, of_mates = _polar(parts), _polar(mates)
        if self.opposite:
            of_mates = np.stack([1.0 - of_mates[..., 0], np.mod(of_mates[..., 1] + 0.5, 1.0)], axis=-1)
        polar[..., self.measured] = self._placed(polar[..., self.measured], of_mates[..., self.measured])
        known[self.parts].put(uniform, _uniform(polar))

    def _placed(
        self, parts: Float[np.ndarray, "*sample copy number"], mates: Float[np.ndarray, "*sample one number"]
    ) -> Float[np.ndarray, "*sample copy number"]:
        """Return the shares of parts inside the classes of their mates, whose shares are given [-]."""
        least = np.minimum(np.floor(self.count * mates), self.count - 1)
        return np.asarray(np.clip((least + np.modf(self.count * parts)[0]) / self.count, ABOVE_ZERO, BELOW_ONE))

    def limits(self, source: Source) -> Float[np.ndarray, " limit"]:
        """Return where the classes of one of its sources end: deviations from nominal, or sizes of its vector [m].

        The outer classes are open: what the zone allows beyond belongs to them. Of a position, those of each axis.
        Where directions alone are sorted, nothing.
        """
        shares = np.arange(1, self.count) / self.count
        vector = Standing(source, slice(0, len(source.columns))).vector.start
        if self.by == _MEASURED[0]:
            numbers = np.repeat(shares[:, np.newaxis], len(source.columns), axis=1)
        elif 0 in self.measured:
            numbers = np.full((self.count - 1, len(source.columns)), 0.5)
            numbers[:, vector] = ndtr(RAYLEIGH.quantile(shares))
        else:
            return np.empty(0)
        return np.asarray((source.standard_values(numbers)[:, vector] * source.zone + source.middles[0]) * source.lever)

    def sectors(self, source: str) -> Float[np.ndarray, " end"]:
        """Return where the sectors of one of its sources begin and end, counted from the x axis [°]; of none, nothing.

        Examples
        --------
        >>> Sorting("disc1.runout", "disc2.runout", classes=4, by="direction").sectors("disc1.runout").tolist()
        [0.0, 90.0, 180.0, 270.0, 360.0]
        """
        if 1 not in self.measured:
            return np.empty(0)
        turned = 180.0 if self.opposite and source == self.mates else 0.0
        return np.asarray(360.0 * np.arange(self.count + 1) / self.count - turned)


def _polar(pairs: Float[np.ndarray, "*sample 2"]) -> Float[np.ndarray, "*sample 2"]:
    """Return the probability of no longer a vector and the share of directions below it, of uniform numbers [-]."""
    normal = ndtri(pairs)
    direction = np.mod(np.arctan2(normal[..., 1], normal[..., 0]) / (2.0 * np.pi), 1.0)
    return np.stack([RAYLEIGH.probability(np.hypot(normal[..., 0], normal[..., 1])), direction], axis=-1)


def _uniform(polar: Float[np.ndarray, "*sample 2"]) -> Float[np.ndarray, "*sample 2"]:
    """Return the uniform numbers of a vector from its probability and direction, the way back [-]."""
    length, turn = RAYLEIGH.quantile(np.minimum(polar[..., 0], BELOW_ONE)), 2.0 * np.pi * polar[..., 1]
    normal = np.stack([length * np.cos(turn), length * np.sin(turn)], axis=-1)
    return np.asarray(np.clip(ndtr(normal), ABOVE_ZERO, BELOW_ONE))
