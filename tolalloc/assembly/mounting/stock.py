"""The parts of one or several units, all ways to mount each, and the errors of units assembled from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from tolalloc.assembly.mounting.parts import MeasuredPart, count_units
from tolalloc.assembly.mounting.places import PartTurn, Place, mounted, places_of
from tolalloc.exceptions import UnknownNameError
from tolalloc.rv.reducer.design import Reducer

Mountings = Int[np.ndarray, "_unit _place 2"]
"""For every unit and place, the number of the part that stands there and of its turn."""


@dataclass(frozen=True, kw_only=True)
class PartStock:
    """Parts that make whole units.

    Parameters
    ----------
    reducer
        Nominal design.
    parts
        The parts; the first of each kind make the first unit as it comes.
    columns
        Columns of the response.

    Raises
    ------
    InputError, UnknownNameError
        The parts make no whole units, or one has an error that the response does not take.
    """

    reducer: Reducer
    parts: tuple[MeasuredPart, ...]
    columns: tuple[str, ...]

    def __post_init__(self) -> None:
        count_units(self.parts, places_of(self.reducer), "parts")
        for place in self.places:
            for part in self.fitting(place):
                self._rows(self.parts[part], place, place.turns)

    @cached_property
    def units(self) -> int:
        """Number of units that the parts make [-]."""
        return count_units(self.parts, self.places, "parts")

    @cached_property
    def places(self) -> tuple[Place, ...]:
        """Places for which there are parts."""
        kinds = {part.kind for part in self.parts}
        return tuple(place for place in places_of(self.reducer) if place.kind in kinds)

    def fitting(self, place: Place) -> tuple[int, ...]:
        """Return the numbers of the parts that fit a place [-]."""
        return tuple(at for at, part in enumerate(self.parts) if part.kind == place.kind)

    def _rows(self, part: MeasuredPart, place: Place, turns: Sequence[PartTurn]) -> Float[np.ndarray, "turn column"]:
        """Return what a part adds to the columns in each turn [m, angles rad]."""
        where = {name: at for at, name in enumerate(self.columns)}
        rows = np.zeros((len(turns), len(self.columns)))
        for row, turn in zip(rows, turns, strict=True):
            for column, value in mounted(part.errors, place, turn).items():
                if column not in where:
                    raise UnknownNameError.among(f"part {part.name} at {place.name}", "error", column, where)
                row[where[column]] = value
        return rows

    @cached_property
    def _table(self) -> tuple[Float[np.ndarray, "entry column"], Int[np.ndarray, "part place"]]:
        """What every part adds at every place in every turn, and where the first turn stands."""
        rows, first, count = [], np.full((len(self.parts), len(self.places)), -1), 0
        for at, place in enumerate(self.places):
            for part in self.fitting(place):
                rows.append(self._rows(self.parts[part], place, place.turns))
                first[part, at], count = count, count + len(place.turns)
        return np.concatenate(rows), first

    @cached_property
    def turns(self) -> tuple[int, ...]:
        """Turns at each place; one where no part of the kind changes by a turn, as a sun without errors [-]."""
        table, first = self._table
        counts = []
        for at, place in enumerate(self.places):
            starts, own = first[list(self.fitting(place)), at], len(place.turns)
            same = all(np.array_equal(table[start : start + own], table[[start] * own]) for start in starts)
            counts.append(1 if same else own)
        return tuple(counts)

    @cached_property
    def slots(self) -> tuple[tuple[int, ...], ...]:
        """Places of each kind, which share their parts [-]."""
        kinds = dict.fromkeys(place.kind for place in self.places)
        return tuple(tuple(at for at, place in enumerate(self.places) if place.kind == kind) for kind in kinds)

    @property
    def as_they_come(self) -> Mountings:
        """The parts in their order, each in its first turn."""
        mountings = np.zeros((self.units, len(self.places), 2), int)
        for slots in self.slots:
            mountings[:, slots, 0] = np.reshape(self.fitting(self.places[slots[0]]), (self.units, len(slots)))
        return mountings

    def errors(self, mountings: Mountings) -> Float[np.ndarray, "unit column"]:
        """Return the columns of assembled units, each the sum over its parts [m, angles rad]."""
        table, first = self._table
        entries = first[mountings[:, :, 0], np.arange(len(self.places))] + mountings[:, :, 1]
        # One part after another: no bit of a unit depends on how many stand beside it.
        total = np.zeros((mountings.shape[0], len(self.columns)))
        for own in entries.T:
            total += table[own]
        return total

    def random_mountings(self, generator: np.random.Generator) -> Mountings:
        """Return the parts in random units, places and turns, all mountings equally likely."""
        mountings = self.as_they_come
        for slots in self.slots:
            parts = generator.permutation(mountings[:, slots, 0].ravel())
            mountings[:, slots, 0] = parts.reshape(self.units, len(slots))
        for at, turns in enumerate(self.turns):
            mountings[:, at, 1] = generator.integers(turns, size=self.units)
        return mountings
