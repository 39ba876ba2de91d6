"""Measured parts of one or several units, all ways to mount each, and the errors of units assembled from them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import is_angular
from tolalloc.drawings.table_file import believed_number, read_text_table
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCSECOND, MICROMETRE
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.unit_file import LARGEST_LENGTH
from tolalloc.wings.assembly.places import (
    MountingPlace,
    mounted,
    own_name,
    owned_columns,
    places_of,
    unmounted,
)

Mountings = Int[np.ndarray, "_unit _place 2"]
"""For every unit and place, the number of the part that stands there and of its turn."""

HEADERS = ("part", "kind", "error", "value", "unit")

LARGEST_ANGLE = 3600.0
"""Largest deviation of an angle that is believed [arcsec]."""


@dataclass(frozen=True, kw_only=True)
class PartStock:
    """Parts that make whole units."""

    reducer: Reducer  # Nominal design
    parts: tuple[MeasuredPart, ...]  # The parts; the first of each kind make the first unit as it comes
    columns: tuple[str, ...]  # Columns of the response

    def __post_init__(self) -> None:
        count_units(self.parts, places_of(self.reducer), "parts")
        _ = self._table  # an error that no column of the response stands for is said at once

    @cached_property
    def units(self) -> int:
        """Number of units that the parts make [-]."""
        return count_units(self.parts, self.places, "parts")

    @cached_property
    def places(self) -> tuple[MountingPlace, ...]:
        """Places for which there are parts."""
        kinds = {part.kind for part in self.parts}
        return tuple(place for place in places_of(self.reducer) if place.kind in kinds)

    def fitting(self, place: MountingPlace) -> tuple[int, ...]:
        """Return the numbers of the parts that fit a place [-]."""
        return tuple(at for at, part in enumerate(self.parts) if part.kind == place.kind)

    def _rows(self, part: MeasuredPart, place: MountingPlace) -> Float[np.ndarray, "turn column"]:
        """Return what a part adds to the columns in each turn [m, angles rad]."""
        where = {name: at for at, name in enumerate(self.columns)}
        rows = np.zeros((len(place.turns), len(self.columns)))
        for row, turn in zip(rows, place.turns, strict=True):
            for column, value in mounted(part.errors, place, turn).items():
                UnknownNameError.require(f"part {part.name} at {place.name}", "error", column, where)
                row[where[column]] = value
        return rows

    @cached_property
    def _table(self) -> tuple[Float[np.ndarray, "entry column"], Int[np.ndarray, "part place"]]:
        """What every part adds at every place in every turn, and where the first turn stands."""
        rows, first, count = [], np.full((len(self.parts), len(self.places)), -1), 0
        for at, place in enumerate(self.places):
            for part in self.fitting(place):
                rows.append(self._rows(self.parts[part], place))
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


@dataclass(frozen=True, kw_only=True)
class MeasuredPart:
    """One part and its errors; an error that is not named is 0.

    A part's own frame is the one in which the model counts its errors when it stands unturned at the first place of its
    kind. A housing comes with its pins and with what stands fixed in it: ``carrier.assembly``, ``carrier.tilt`` and
    ``sun.assembly``; a crank with its planet, ``planet.eccentricity``, and that planet's share of the mesh,
    ``mesh.deviation``.
    """

    name: str  # What is written on the part
    kind: str  # Kind of place that it fits, `tolalloc.wings.assembly.places.MountingPlace.kind`
    # Error in the part's own name, such as ``runout.cos1`` of a disc → deviation in its own frame [m, angles rad]
    errors: Mapping[str, float]


def count_units(parts: Sequence[MeasuredPart], places: Sequence[MountingPlace], origin: Path | str) -> int:
    """Return how many units the parts make [-].

    A kind of which there is no part at all counts as exact.
    """
    needed, there = Counter(place.kind for place in places), Counter(part.kind for part in parts)
    for part in parts:
        UnknownNameError.require(f"{origin}, part {part.name}", "kind", part.kind, needed)
    for name, count in Counter(part.name for part in parts).items():
        if count > 1:
            raise InputError.at(origin, "number of parts of the name " + name, count, "1")
    if not parts:
        raise InputError.at(origin, "number of parts", 0, "those of one unit or more")
    units = {kind: there[kind] / needed[kind] for kind in there}
    if len(set(units.values())) > 1 or any(count % needed[kind] for kind, count in there.items()):
        counts = ", ".join(f"{there[kind]} {kind}" for kind in sorted(there))
        each = ", ".join(f"{needed[kind]} {kind}" for kind in sorted(there))
        raise InputError.at(origin, "number of parts", counts, f"{each} for every unit")
    return int(next(iter(units.values())))


def load_parts(path: str | Path, reducer: Reducer) -> tuple[MeasuredPart, ...]:
    """Return the parts of a CSV file with the columns ``part, kind, error, value, unit``, in the order of the file.

    A value is in µm, or in arcsec for an angle; the reducer says what kinds of parts there are.
    """
    table = read_text_table(Path(path))
    if table.headers != HEADERS:
        raise InputError.at(table.path, "columns", ", ".join(table.headers), ", ".join(HEADERS))
    known = own_errors(reducer)
    kinds: dict[str, str] = {}
    errors: dict[str, dict[str, float]] = {}
    for row, (part, kind, error, value, unit) in zip(table.rows, table.cells, strict=True):
        place = f"{table.path}, row {row}"
        if not part:
            raise InputError.at(place, "part", part, "a name")
        if kind not in known:
            numbered = [name for name in known if name.rstrip("0123456789") == kind]
            if numbered:
                allowed = f"{' or '.join(numbered)}: made for one place of this reducer, a {kind} fits no other"
                raise InputError.at(place, "kind", kind, allowed)
            raise UnknownNameError.among(place, "kind", kind, known)
        if kinds.setdefault(part, kind) != kind:
            raise InputError.at(place, f"kind of part {part}", kind, f"{kinds[part]}, as further up")
        UnknownNameError.require(place, f"error of a {kind}", error, known[kind])
        if error in errors.setdefault(part, {}):
            allowed = "each error once, and this one stands further up"
            raise InputError.at(place, f"error of part {part}", error, allowed)
        errors[part][error] = _deviation(place, error, value, unit)
    parts = tuple(MeasuredPart(name=name, kind=kind, errors=errors[name]) for name, kind in kinds.items())
    count_units(parts, places_of(reducer), table.path)
    return parts


def own_errors(reducer: Reducer) -> dict[str, tuple[str, ...]]:
    """Return the own names of the errors that a part of each kind can have."""
    columns, found = EquivalentModel(reducer).columns, {}
    for place in places_of(reducer):
        names = (own_name(column, place) for column in columns)
        found[place.kind] = tuple(name for name in names if name is not None)
    return found


def _deviation(place: str, error: str, cell: str, unit: str) -> float:
    """Return the value of one row [m, angles rad]."""
    angle = is_angular(source_name(error))
    allowed = ("arcsec",) if angle else ("µm", "um")
    if unit not in allowed:
        raise InputError.at(place, f"unit of {error}", unit, " or ".join(allowed))
    largest = LARGEST_ANGLE if angle else LARGEST_LENGTH
    believed = f"a number from {-largest:g} to {largest:g} {unit}"
    value = believed_number(place, f"value of {error}", cell, largest, believed)
    return value * (ARCSECOND if angle else MICROMETRE)


def drawn_parts(errors: ErrorModel, reducer: Reducer, units: int, seeds: SeedTree) -> tuple[MeasuredPart, ...]:
    """Return the parts of random units; as they come, they make these units again.

    What the error model does not list is exact.

    A part keeps the zones of the place that it is drawn for, where the drawings of like parts differ. A kind of part
    without any error is left out.
    """
    places = tuple(place for place in places_of(reducer) if owned_columns(errors.columns, (place,)))
    parts = []
    for unit, row in enumerate(errors.random_units(units, seeds), start=1):
        deviations = {**errors.fixed, **dict(zip(errors.columns, map(float, row), strict=True))}
        nonzero = {column: value for column, value in deviations.items() if value != 0.0}
        for place in places:
            own = unmounted(nonzero, place, place.turns[0])
            parts.append(MeasuredPart(name=f"{place.name} of unit {unit}", kind=place.kind, errors=own))
    return tuple(parts)
