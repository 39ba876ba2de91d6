"""Readings of an instrument: two columns of a CSV file, units in its header, into arrays in SI units."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from tolalloc.drawings.table_file import TextTable, plain_number, read_text_table, split_header
from tolalloc.exceptions import Faults, InputError
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE, MICRORADIAN

MISSING = ("", "nan", "na", "n/a", "-", "inf", "+inf", "-inf")
"""What instruments write where they have no number."""


FEWEST = 3
"""Fewest readings of a curve and levels of a loop; the mean takes one away [-]."""


_SMALL_ANGLES = {
    "arcsec": ARCSECOND,
    "arcmin": ARCMINUTE,
    "deg": DEGREE,
    "rad": 1.0,
    "µrad": MICRORADIAN,
    "urad": MICRORADIAN,
}
ANGLE, TORQUE = "angle", "torque"
TRANSMISSION_ERROR, TWIST, PEAK_TO_PEAK = "transmission error", "twist", "peak_to_peak"
UNITS = {
    ANGLE: {"deg": DEGREE, "rad": 1.0, "arcmin": ARCMINUTE},
    TORQUE: {"N·m": 1.0, "Nm": 1.0},
    **dict.fromkeys((TRANSMISSION_ERROR, TWIST, PEAK_TO_PEAK), _SMALL_ANGLES),
}
"""Column that a file may hold, by its header without unit → unit as written → factor to SI [-]."""


@dataclass(frozen=True, kw_only=True)
class RawReadings:
    """Readings in the order of the file; not a number where the instrument gave none."""

    path: Path  # Where they were read
    header: str  # Header of the column that they are taken along, as in the file
    factor: float  # SI units per unit of that column [-]
    row: Int[np.ndarray, " reading"]  # Line of each reading as counted in the file [-]
    along: Float[np.ndarray, " reading"]  # Angle or torque at which each was taken [rad or N·m]
    values: Float[np.ndarray, " reading"]  # What the instrument showed [rad]
    averaged: Float[np.ndarray, " reading"]  # Readings that each value is the mean of [-]

    def chosen(self, which: np.ndarray) -> RawReadings:
        """Return the readings that a mask or a list of positions names, in its order."""
        own = {name: getattr(self, name)[which] for name in ("row", "along", "values", "averaged")}
        return replace(self, **own)


def read_column(table: TextTable, name: str) -> tuple[str, float, Float[np.ndarray, " row"]]:
    """Return header, factor to SI, and values in SI units of one column; not a number where a cell holds none.

    Raises
    ------
    InputError
        The column is missing or there twice, its unit is missing or unknown, or a cell holds text.
    """
    headers = [header for header in table.headers if _same_name(header, name)]
    known = UNITS[name]
    units = " or ".join(known)
    if not headers:
        raise InputError(
            f"{table.path}: the column {name!r} with its unit in square brackets ({units}) is missing; the "
            f"columns are {', '.join(map(repr, table.headers))}."
        )
    if len(headers) > 1:
        raise InputError(f"{table.path}: the column {name!r} stands there {len(headers)} times; allowed is once.")
    unit = split_header(headers[0])[1]
    if unit not in known:
        raise InputError.at(table.path, f"the unit of column {headers[0]!r}", unit, f"{units} in square brackets")
    position, factor = table.headers.index(headers[0]), known[unit]
    values = np.full(len(table.rows), np.nan)
    faults = Faults()
    for number, (row, cells) in enumerate(zip(table.rows, table.cells, strict=True)):
        if cells[position].lower() not in MISSING:
            with faults.kept():
                values[number] = factor * _reading(cells[position], f"{table.path}, row {row}", headers[0])
    faults.require_none()
    return headers[0], factor, values


def _reading(cell: str, place: str, header: str) -> float:
    """Return the number in a cell."""
    try:
        value = plain_number(cell)
    except ValueError:
        value = np.inf
    if not isfinite(value):
        allowed = "a number with a decimal point, or nothing where the instrument gave none"
        raise InputError.at(place, header, cell, allowed)
    return value


def _same_name(header: str, name: str) -> bool:
    return split_header(header)[0].lower().replace("_", " ") == name.replace("_", " ")


def load_readings(path: Path, along: str, values: str) -> RawReadings:
    """Return the two columns of a file in SI units; columns of other names are not read.

    Taken along `ANGLE` or `TORQUE` are `TRANSMISSION_ERROR` or `TWIST`; lines that start with # are comments.

    Raises
    ------
    InputError
        The file, row, column and value that are not allowed; also a column whose values are all equal.
    """
    table = read_text_table(path)
    header, factor, places = read_column(table, along)
    value_header, value_factor, shown = read_column(table, values)
    for name, column, unit in ((header, places, factor), (value_header, shown, value_factor)):
        finite = column[np.isfinite(column)]
        if finite.size > 1 and np.ptp(finite) == 0:
            raise InputError(
                f"{path}: all {finite.size} values of column {name!r} are {finite[0] / unit:.6g}; an instrument that "
                "does not move is no measurement."
            )
    return RawReadings(
        path=path,
        header=header,
        factor=factor,
        row=np.array(table.rows),
        along=places,
        values=shown,
        averaged=np.ones(len(table.rows)),
    )


def counted(number: int, what: str) -> str:
    """Return a number and a noun in singular or plural."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def require_readings(readings: RawReadings, what: str) -> None:
    """Raise unless enough readings are left for a shape."""
    if readings.along.size < FEWEST:
        raise InputError.at(readings.path, f"the number of {what}s", readings.along.size, f"{FEWEST} or more")
