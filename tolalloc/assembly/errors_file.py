"""Measured errors of the parts of one assembly, read from CSV."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.chain_records import LARGEST
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.drawing.table_file import TextTable, read_text_table, split_header
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.units import ARCSECOND

HEADERS = ("part", "x [arcsec]", "y [arcsec]", "z [arcsec]")
IN_DEGREES = 0.05
"""Where no error reaches this, they were written in degrees [arcsec]."""


def load_errors(path: Path, plan: AssemblyPlan) -> Float[np.ndarray, "part 3"]:
    """Return measured errors of the parts in their own axes, in the order of the chain [rad].

    Parameters
    ----------
    path
        CSV file with the columns ``part``, ``x [arcsec]``, ``y [arcsec]``, ``z [arcsec]`` and one row per part, in any
        order; lines that start with # are comments.
    plan
        The parts.

    Raises
    ------
    InputError
        A column, unit or number that is not allowed, or a part that has no row or two.
    UnknownNameError
        A part that the chain does not have.
    """
    table = read_text_table(path)
    columns = _columns(table)
    names, found = plan.chain.names, dict[str, list[float]]()
    for row, cells in zip(table.rows, table.cells, strict=True):
        name, place = cells[columns[0]], f"{path}, row {row}"
        if name not in names:
            raise UnknownNameError.among(place, "part", name, names)
        if name in found:
            raise InputError.at(place, "part", name, "each part once, and this one stands further up too")
        found[name] = [_arcseconds(cells[at], table.headers[at], f"{place} (part {name})") for at in columns[1:]]
    for name in names:
        if name not in found:
            raise InputError(f"{path}: part {name} is missing; allowed is one row for each of {', '.join(names)}.")
    errors = np.array([found[name] for name in names])
    largest = float(np.abs(errors).max())
    if 0 < largest < IN_DEGREES:
        raise InputError(
            f"{path}: the largest error is {largest:g} arcsec; are these degrees? allowed are arcseconds, some of "
            f"{IN_DEGREES:g} or more."
        )
    return errors * ARCSECOND


def _columns(table: TextTable) -> list[int]:
    """Return where part, x, y and z stand."""
    units = dict(map(split_header, HEADERS))
    stated = [split_header(header.lower()) for header in table.headers]
    # Programs that close every row with a separator leave an empty header behind the last.
    if sorted(name for name, _ in stated if name) != sorted(units):
        raise InputError.at(table.path, "the header", ", ".join(table.headers), ", ".join(HEADERS))
    for (name, unit), header in zip(stated, table.headers, strict=True):
        if name and unit != units[name]:
            allowed = f"{units[name]} in square brackets" if units[name] else "none"
            raise InputError.at(table.path, f"the unit of column {header!r}", unit, allowed)
    return [[name for name, _ in stated].index(name) for name in units]


def _arcseconds(cell: str, header: str, place: str) -> float:
    """Return the number in a cell."""
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not (isfinite(value) and abs(value) <= LARGEST):
        allowed = f"a number with a decimal point from {-LARGEST:g} to {LARGEST:g}"
        raise InputError.at(place, header, cell, allowed)
    return value
