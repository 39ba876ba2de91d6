"""Reading measured parts: one row per error of a part."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

from tolalloc.assembly.mounting.columns import own_name
from tolalloc.assembly.mounting.parts import MeasuredPart
from tolalloc.assembly.mounting.places import places_of
from tolalloc.assembly.mounting.stock import count_units
from tolalloc.drawing.sources import ANGULAR
from tolalloc.drawing.table_file import read_text_table
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


def load_parts(path: str | Path, reducer: Reducer, orders: tuple[int, ...] = HARMONICS) -> tuple[MeasuredPart, ...]:
    """Return the parts of a CSV file with the columns ``part, kind, error, value, unit``, in the order of the file.

    Parameters
    ----------
    path
        The file; a value is in µm, or in arcsec for an angle.
    reducer
        Nominal design, which says what kinds of parts there are.
    orders
        Orders of the harmonic deviations of pitch and run-out [-].

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
    """Return the own names of the errors that a part of each kind can have.

    Parameters
    ----------
    reducer
        Nominal design.
    orders
        Orders of the harmonic deviations of pitch and run-out [-].
    """
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
