"""Selective assembly: parts sorted into classes that fit each other, by deviation, direction or size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
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
    Units,
    one_source,
    require_vector,
)
from tolalloc.drawings.distributions import ABOVE_ZERO, BELOW_ONE, RAYLEIGH, ndtr, ndtri
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import Rule, flag, number, or_none, whole
from tolalloc.reading.units import MICROMETRE

_MEASURED = ("deviation", "direction", "size", "direction and size")


@dataclass(frozen=True)
class Sorting(Compensator):
    """Selective assembly: two parts are measured, sorted into classes, and mated class by class.

    Parameters
    ----------
    parts, mates
        Sources of the tolerance table that are sorted, also of two like parts of one unit, such as its discs. The parts
        of one unit, such as all its pins, come from one class.
    classes
        Number of classes, on each axis; of equally many parts unless a width is given. Several numbers are compared by
        an allocation, and other questions take the first [-].
    opposite
        Whether the smallest parts go with the largest mates rather than with the smallest, and directions with opposite
        ones.
    by
        What is measured of them: their ``deviation``, of positions on each axis; of a position, or of the wave of order
        1 of a pitch or run-out, its ``direction`` in the axes of its columns, its ``size``, or ``direction and size``.
    width
        Width of every class but the outer ones, which are open, of sizes alone; the classes then lie about the middle
        of each zone and hold as many parts as they come. Equally many in each unless given [µm].
    batch
        Parts that are sorted at a time, from which follows how many are left over [-].
    class_cost
        What sorting costs per unit for every class beyond the first [cost units].
    leftover_cost
        What a part and a mate that are left over cost together [cost units].

    Notes
    -----
    The classes end at the quantiles i/n of each process, so all hold equally many parts on average. A unit's parts then
    lie in class ⌊n·F(mate)⌋, and inside it as they come: F(part) → (⌊n·F(mate)⌋ + frac(n·F(part)))/n, theory page
    equation (80). Both processes keep their own distribution, and units need no batch to be drawn (own derivation;
    tests compare with batches that are assigned exactly). What is left over does, `leftover`.

    The same map takes the share of all directions below that of a vector, φ/2π, and the probability of one no longer,
    theory page equation (86). The normal numbers behind a vector give both, independently of each other, so that every
    order of a wave but the first stays as it comes.

    Classes of equal width hold shares p of the parts and q of the mates. A batch builds E[min(N, M)] units of each, so
    its units lie in a class with a probability in proportion, and inside it both parts have their own law cut to the
    class, theory page equation (87): what is left over is no longer as likely of any class, and built parts are no
    longer all parts (own derivation). Derivatives with respect to zones are those of classes that grow with the zones.

    References
    ----------
    Mease, Nair, Sudjianto, Selective assembly in manufacturing: statistical issues and optimal binning strategies,
    Technometrics 46 (2004) 165–175.

    Examples
    --------
    Pins in four classes, each with the grooves that fit them; of 50 of each, so many are left over:

    >>> pins = Sorting("pin.diameter", "housing.groove.radius", classes=4, batch=50)
    >>> f"{pins.leftover:.1%}"
    '13.8%'
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
    width: Annotated[
        float | None, or_none(number("a width above 0 up to 1,000 µm, or None", above=0.0, most=1000.0))
    ] = None
    batch: Annotated[int, whole("a whole number from 1 to 1,000,000", 1, 1_000_000)] = 100
    class_cost: Annotated[float, COST] = 0.0
    leftover_cost: Annotated[float, COST] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.parts == self.mates:
            raise InputError.at(self.called, "mates", self.mates, "another source than parts")
        if self.width is not None and self.by != _MEASURED[0]:
            raise InputError.at(self.called, "by", self.by, f"{_MEASURED[0]!r} where a width is given")

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
        """The parts; their mates may be correlated with others, unless classes of equal width select among them."""
        return (self.parts,) if self.width is None else self.named

    @property
    def arranges(self) -> bool:
        """Whether classes have a width, and so depend on the zones."""
        return self.width is not None

    def resolved(self, sources: Sequence[Source], place: str) -> Sorting:
        """Return the same with the names that the table itself uses."""
        parts = one_source("parts", self.parts, sources, place)
        mates = one_source("mates", self.mates, sources, place)
        for name, own in (("parts", parts), ("mates", mates)):
            self._require_sortable(own, f"{place}, {self.called}", name)
        if self._numbers(parts) != self._numbers(mates) or mates.each > 1:
            allowed = "a source of the same feature with one deviation in each unit"
            raise InputError.at(f"{place}, {self.called} of {parts.name}", "mates", mates.name, allowed)
        return replace(self, parts=parts.name, mates=mates.name)

    def _require_sortable(self, source: Source, place: str, named: str) -> None:
        if self.width is not None and source.feature is not Feature.SIZE:
            raise InputError.at(place, named, source.name, "a size where a width is given")
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
        """Share of the parts that find no mate in a batch where all classes hold equally many, on average [-].

        Theory page equation (81), exact: 1 − (n/B)·E[min(N, M)] with E[min(N, M)] = Σₖ P(N ≥ k)² for two independent
        binomial numbers of B parts in one of n classes (own derivation).

        Examples
        --------
        >>> round(Sorting("a", "b", classes=2, batch=2).leftover, 6)  # 1 − P(N ≥ 1)² − P(N = 2)² with 3/4 and 1/4
        0.375
        """
        return self._leftover(self.count)

    def _leftover(self, classes: int) -> float:
        return 0.0 if classes == 1 else float(1.0 - classes * _mated(1.0 / classes, 1.0 / classes, self.batch))

    def leftover_of(self, sources: Mapping[str, Source]) -> float:
        """Return the same at the zones of sources, by their names [-].

        Classes of a position are those of both axes together; of equal width it is 1 − Σ E[min(N, M)]/B over all,
        theory page equation (87).
        """
        if self.width is None:
            return self._leftover(self.count ** self._numbers(sources[self.parts]))
        ends = [self._ends(sources[name], sources[name].zone) for name in self.named]
        return float(1.0 - self._built(np.diff(ends[0]), np.diff(ends[1])).sum())

    def _ends(self, source: Source, zone: float) -> Float[np.ndarray, " end"]:
        """Return the share of parts of a source below each end of the classes of equal width, 0 and 1 included [-]."""
        middles = (np.arange(1, self.count) - self.count / 2.0) * (self.width or 0.0) * MICROMETRE
        return np.array([0.0, *source.zone_mapping.marginal.probability(middles / (zone / 2.0)), 1.0])

    def _built(
        self, parts: Float[np.ndarray, " class"], mates: Float[np.ndarray, " class"]
    ) -> Float[np.ndarray, " class"]:
        """Return the units that a batch builds of each class of the mates, over its parts [-]."""
        parts = parts[::-1] if self.opposite else parts
        return np.array([_mated(float(p), float(q), self.batch) for p, q in zip(parts, mates, strict=True)])

    def cost(self, sources: Mapping[str, Source]) -> float:
        """Return what it costs per unit that is built [cost units]."""
        lost, further = self.leftover_of(sources), self.count ** self._numbers(sources[self.parts]) - 1
        return float(self.class_cost * further + self.leftover_cost * lost / (1.0 - lost))

    def sorted(self, uniform: Units, known: Known) -> None:
        """Put the parts of units into the class of their mates, uniform numbers in place [-]."""
        if self.width is not None:
            return
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

    def arranged(self, deviations: Units, zones: Mapping[str, float], known: Known) -> None:
        """Put parts and mates into the classes of equal width that a batch builds units of, deviations in place [m].

        Where either is exact, as in the nominal unit, both stay.
        """
        if self.width is None:
            return
        sources = [known[name].source for name in self.named]
        scales = [zones[own.name] / 2.0 / own.lever for own in sources]
        offs = [known[own.name].of(deviations)[..., 0] - own.middle / own.lever for own in sources]
        ends = [self._ends(own, zones[own.name]) for own in sources]
        ranks = [
            own.zone_mapping.marginal.probability(off / scale)
            for own, off, scale in zip(sources, offs, scales, strict=True)
        ]
        shares = [np.diff(own) for own in ends]
        built = self._built(*shares)
        reached = np.cumsum(built) / built.sum()
        number = np.searchsorted(reached[:-1], ranks[1], side="right")
        inside = (ranks[1] - (reached - built / built.sum())[number]) / (built / built.sum())[number]
        of_parts = self.count - 1 - number if self.opposite else number
        placed = (
            ends[0][of_parts] + ranks[0] * shares[0][of_parts],
            ends[1][number] + np.clip(inside, 0.0, 1.0) * shares[1][number],
        )
        exact = (offs[1] == 0.0) | (offs[0] == 0.0).all(axis=-1, keepdims=True)
        for own, off, scale, rank in zip(sources, offs, scales, placed, strict=True):
            value = own.zone_mapping.marginal.quantile(np.clip(rank, ABOVE_ZERO, BELOW_ONE)) * scale
            known[own.name].put(deviations, (np.where(exact, off, value) + own.middle / own.lever)[..., np.newaxis])

    def limits(self, source: Source) -> Float[np.ndarray, " limit"]:
        """Return where the classes of one of its sources end: deviations from nominal, or sizes of its vector [m].

        The outer classes are open: what the zone allows beyond belongs to them. Of a position, those of each axis.
        Where directions alone are sorted, nothing.
        """
        if self.width is not None:
            return np.asarray((np.arange(1, self.count) - self.count / 2.0) * self.width * MICROMETRE + source.middle)
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
        """Return where the sectors of one of its sources begin and end, from the x axis on; of none, nothing [°]."""
        if 1 not in self.measured:
            return np.empty(0)
        turned = 180.0 if self.opposite and source == self.mates else 0.0
        return np.asarray(360.0 * np.arange(self.count + 1) / self.count - turned)


@lru_cache(maxsize=4096)
def _mated(parts: float, mates: float, batch: int) -> float:
    """Return E[min(N, M)]/B of binomial numbers of B parts and B mates that lie in a class with these shares [-].

    Σ P(N > k)·P(M > k) over all k, of which those further than nine standard deviations from B times the smaller share
    are 1 or 0.

    Examples
    --------
    >>> _mated(0.5, 0.5, 2), round(_mated(0.3, 0.9, 10_000), 4)
    (0.3125, 0.3)
    """
    from scipy.special import bdtrc

    mean = batch * min(parts, mates)
    reach = 9.0 * np.sqrt(mean) + 9.0
    first, last = max(0, int(mean - reach)), min(batch, int(mean + reach) + 1)
    number = np.arange(first, last, dtype=float)
    return float((first + np.sum(bdtrc(number, batch, parts) * bdtrc(number, batch, mates))) / batch)


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
