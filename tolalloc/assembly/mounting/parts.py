"""Measured parts: their errors in their own frames, read from a file or drawn at random inside their drawings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from tolalloc.assembly.mounting.places import Place, own_name, owned_columns, places_of, unmounted
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import ANGULAR
from tolalloc.drawings.table_file import read_text_table
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.rv.equivalent.columns import source_name
from tolalloc.rv.equivalent.kinematics import HARMONICS
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.unit_table import LARGEST_LENGTH
from tolalloc.units import ARCSECOND, MICROMETRE

HEADERS = ("part", "kind", "error", "value", "unit")
LARGEST_ANGLE = 3600.0
"""Largest deviation of an angle that is believed [arcsec]."""


@dataclass(frozen=True, kw_only=True)
class MeasuredPart:
    """One part and its errors; an error that is not named is 0.

    Parameters
    ----------
    name
        What is written on the part.
    kind
        Kind of place that it fits, `tolalloc.assembly.mounting.places.Place.kind`.
    errors
        Error in the part's own name, such as ``runout.cos1`` of a disc → deviation in its own frame [m, angles rad].

    Notes
    -----
    A part's own frame is the one in which the model counts its errors when it stands unturned at the first place of its
    kind. A housing comes with its pins and with what stands fixed in it: ``carrier.assembly``, ``carrier.tilt`` and
    ``sun.assembly``; a crank with its planet, ``planet.eccentricity``, and that planet's share of the mesh,
    ``mesh.deviation``.
    """

    name: str
    kind: str
    errors: Mapping[str, float]


def count_units(parts: Sequence[MeasuredPart], places: Sequence[Place], origin: Path | str) -> int:
    """Return how many units the parts make [-].

    Raises
    ------
    UnknownNameError
        A part of a kind that fits nowhere.
    InputError
        There is no part, two have one name, or they make no whole number of units.

    Notes
    -----
    A kind of which there is no part at all counts as exact.
    """
    needed, there = Counter(place.kind for place in places), Counter(part.kind for part in parts)
    for part in parts:
        if part.kind not in needed:
            raise UnknownNameError.among(f"{origin}, part {part.name}", "kind", part.kind, needed)
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


def load_parts(path: str | Path, reducer: Reducer, orders: tuple[int, ...] = HARMONICS) -> tuple[MeasuredPart, ...]:
    """Return the parts of a CSV file with the columns ``part, kind, error, value, unit``, in the order of the file.

    A value is in µm, or in arcsec for an angle; the reducer says what kinds of parts there are, and pitch and run-out
    have harmonic deviations of the orders.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, column and value that are not allowed, or the parts make no whole number of units.
    """
    table = read_text_table(Path(path))
    if table.headers != HEADERS:
        raise InputError.at(table.path, "columns", ", ".join(table.headers), ", ".join(HEADERS))
    known = own_errors(reducer, orders)
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
        if error not in known[kind]:
            raise UnknownNameError.among(place, f"error of a {kind}", error, known[kind])
        if error in errors.setdefault(part, {}):
            raise InputError.at(
                place, f"error of part {part}", error, "each error once, and this one stands further up"
            )
        errors[part][error] = _deviation(place, error, value, unit)
    parts = tuple(MeasuredPart(name=name, kind=kind, errors=errors[name]) for name, kind in kinds.items())
    count_units(parts, places_of(reducer), table.path)
    return parts


def own_errors(reducer: Reducer, orders: tuple[int, ...] = HARMONICS) -> dict[str, tuple[str, ...]]:
    """Return the own names of the errors that a part of each kind can have."""
    columns, found = EquivalentModel(reducer, orders=orders).columns, {}
    for place in places_of(reducer):
        names = (own_name(column, place) for column in columns)
        found[place.kind] = tuple(name for name in names if name is not None)
    return found


def _deviation(place: str, error: str, cell: str, unit: str) -> float:
    """Return the value of one row [m, angles rad]."""
    angle = source_name(error).rsplit(".", 1)[-1] in ANGULAR
    allowed = ("arcsec",) if angle else ("µm", "um")
    if unit not in allowed:
        raise InputError.at(place, f"unit of {error}", unit, " or ".join(allowed))
    largest = LARGEST_ANGLE if angle else LARGEST_LENGTH
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not (isfinite(value) and abs(value) <= largest):
        raise InputError.at(place, f"value of {error}", cell, f"a number from {-largest:g} to {largest:g} {unit}")
    return value * (ARCSECOND if angle else MICROMETRE)


def drawn_parts(errors: ErrorModel, reducer: Reducer, units: int, seeds: SeedTree) -> tuple[MeasuredPart, ...]:
    """Return the parts of random units; as they come, they make these units again.

    What the error model does not list is exact.

    Notes
    -----
    A part keeps the zones of the place that it is drawn for, where the drawings of like parts differ. A kind of part
    without any error is left out.
    """
    uniform = np.concatenate(list(seeds.uniform_chunks(units, len(errors.columns))))
    rows = errors.deviations(errors.standard_values(uniform), errors.zones)
    parts = []
    for unit, row in enumerate(rows, start=1):
        deviations = {**errors.fixed, **dict(zip(errors.columns, map(float, row), strict=True))}
        nonzero = {column: value for column, value in deviations.items() if value != 0.0}
        for place in places_of(reducer):
            if owned_columns(errors.columns, (place,)):
                own = unmounted(nonzero, place, place.turns[0])
                parts.append(MeasuredPart(name=f"{place.name} of unit {unit}", kind=place.kind, errors=own))
    return tuple(parts)
