"""What a source of error is, said once by the spring group whose rows it moves; nothing else reads it off its name.

A source has one column or more: a number, a vector in the plane, or the waves of a deviation along a ring, each once or
once for every pin or tooth.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

from tolalloc.drawings.zones import Characteristic
from tolalloc.exceptions import UnknownNameError
from tolalloc.reducers.reducer.design import Reducer

_COMPONENTS = {"number": "", "vector": r"\.(?P<axis>[xy])", "waves": r"\.(?P<wave>cos|sin)(?P<order>\d+)"}


@dataclass(frozen=True, kw_only=True)
class Nominal:
    """The nominal size that a tolerance table may state for a source."""

    said: str  # What it is of the reducer, in words
    of: Callable[[Reducer], float]  # The size itself [m]
    chosen: bool = False  # Whether a study may choose it, so that a table made for a reducer leaves it open


@dataclass(frozen=True, kw_only=True)
class ErrorSource:
    """A kind of source, one for each part that has it: ``crank{i}.journal{j}.eccentricity``."""

    # Name of the sources, ``{i}`` and ``{j}`` for the numbers of parts and features; an angle's ends as
    # `tolalloc.drawings.sources.ANGULAR` says, by which a tolerance table knows it
    name: str
    # What one deviation is: a number, a vector in the plane, or waves along a ring
    shape: Literal["number", "vector", "waves"] = "number"
    # Feature of which each has a deviation of its own, such as ``pin`` or ``tooth``, of `Reducer.like_features`
    each: str = ""
    place: str = ""  # Where the picture shows it, as `tolalloc.reducers.scene.Place.id` says; nowhere if empty
    # What a vector becomes where half a turn carries the reducer into itself: its direction is ``reversed``, or
    # ``kept`` where it counts along the part's own radius or acts by its height between the discs
    mirror: Literal["reversed", "kept"] = "reversed"
    # Whether its angles count from the teeth of a disc, which half a turn does not carry into those of the other one
    teeth: bool = False
    neglected: str = ""  # Pattern by which a table may leave it out; empty where it may not
    # Whether a unit that does not state it is exact there without saying so, as all that were written before the
    # source was declared
    silent: bool = False
    fine: bool = False  # Whether a first study leaves it out: it is in the new table with a zone of 0
    first_stage: bool = False  # Whether the first stage has it, whose errors the ratio divides
    nominal: Nominal | None = None  # Nominal size, if there is one
    characteristic: Characteristic | None = None  # What a drawing writes for it, if its feature alone does not say it
    fixed: bool = False  # Whether it stands fixed in the housing, so that it is mounted and measured with it
    # Part with which it is mounted and its name there, where these are not the beginning and the rest of its own
    with_part: tuple[str, str] | None = None

    @property
    def mounted(self) -> tuple[str, str]:
        """The part with which it is mounted and turns, and its name on that part alone."""
        part, _, rest = self.name.partition(".")
        return self.with_part or (("housing", self.name) if self.fixed else (part, rest))

    def count(self, reducer: Reducer) -> int:
        """Return how many like features each have a deviation of their own [-]."""
        return reducer.like_features[self.each]

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """What the names of its sources match, with the numbers in them."""
        return re.compile(_numbered(self.name))

    @cached_property
    def column_pattern(self) -> re.Pattern[str]:
        """What the names of its columns match: source, number of the pin or tooth, axis or wave and order."""
        member = r"\.(?P<member>\d+)" if self.each else ""
        return re.compile(f"(?P<source>{_numbered(self.name)}){member}{_COMPONENTS[self.shape]}")

    def numbers(self, column: str) -> dict[str, str]:
        """Return what a column's name says of it: source, numbers of parts and member, axis or wave and order."""
        found = self.column_pattern.fullmatch(column)
        return found.groupdict() if found else {}

    def member(self, column: str) -> slice:
        """Return where in a column's name the number of its pin or tooth stands."""
        found = self.column_pattern.fullmatch(column)
        return slice(*found.span("member")) if found and self.each else slice(0, 0)

    def index(self, column: str) -> tuple[int, ...] | None:
        """Return the numbers of parts and member and the axis in a column's name, from 0; none if it is not its own."""
        if found := self.column_pattern.fullmatch(column):
            return tuple("xy".index(part) if part in "xy" else int(part) - 1 for part in found.groups()[1:])
        return None

    def line(self, sources: Sequence[str]) -> str:
        """Return what a drawing calls sources of its kind: the name with those numbers that all of them have."""
        numbers = [found.groupdict() for own in sources if (found := self.pattern.fullmatch(own))]
        alike = {key: {own[key] for own in numbers} for key in numbers[0]}
        return self.name.format(**{key: found.pop() if len(found) == 1 else "" for key, found in alike.items()})

    def place_of(self, source: str) -> str:
        """Return the id of the place at which the picture shows a source of its kind."""
        numbers = self.pattern.fullmatch(source)
        return self.place.format(**numbers.groupdict()) if numbers else ""


def _numbered(name: str) -> str:
    return re.sub(r"\\{(\w)\\}", r"(?P<\1>\\d+)", re.escape(name))


class ErrorSources:
    """All kinds of sources of a model, to be asked by the name of a source or of a column."""

    def __init__(self, kinds: Iterable[ErrorSource]) -> None:
        self.kinds = tuple(kinds)
        self.of = lru_cache(maxsize=None)(self._of)
        self.of_column = lru_cache(maxsize=None)(self._of_column)

    def _of(self, source: str) -> ErrorSource | None:
        """Return the kind of a source, none if nothing declares it."""
        return next((kind for kind in self.kinds if kind.pattern.fullmatch(source)), None)

    def shared_lines(self, stated: Mapping[str, Hashable]) -> dict[str, str]:
        """Return source → the line of the drawing, part and feature, on which it stands with its copies.

        Sources of one kind are copies of each other, on identical parts or all around one part; those of which the
        table states different things have lines of their own.
        """
        copies: dict[tuple[ErrorSource, Hashable], list[str]] = {}
        for name, own in stated.items():
            if kind := self.of(name):
                copies.setdefault((kind, own), []).append(name)
        lines = [kind.line(members) for (kind, _), members in copies.items()]
        return {
            name: line if lines.count(line) == 1 else ", ".join(members)
            for line, members in zip(lines, copies.values(), strict=True)
            for name in members
        }

    def _of_column(self, column: str) -> ErrorSource:
        """Return the kind of the source that a column belongs to."""
        for kind in self.kinds:
            if kind.column_pattern.fullmatch(column):
                return kind
        raise UnknownNameError.among("the reducer's model", "column", column, [kind.name for kind in self.kinds])

    def silent(self, columns: Iterable[str]) -> frozenset[str]:
        """Return the columns that a unit need not state."""
        silent = [kind.column_pattern for kind in self.kinds if kind.silent]
        return frozenset(name for name in columns if any(own.fullmatch(name) for own in silent))

    @property
    def neglected(self) -> tuple[str, ...]:
        """Patterns of all sources that a table may leave out, in the order of their declaration."""
        return tuple(dict.fromkeys(kind.neglected for kind in self.kinds if kind.neglected))
