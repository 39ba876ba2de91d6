"""Reading measured parts: one row per part, their deviations or where their axes lie."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

import numpy as np

from tolalloc.drawing.measured_parts import MeasuredParts
from tolalloc.drawing.table_file import TextTable, read_text_table, split_header
from tolalloc.drawing.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.units import MICROMETRE

FEWEST_PARTS = 20
LARGEST_DEVIATION = 2000.0
"""Largest deviation that is believed, as large as a zone may be [µm]."""

_FACTORS = {"µm": 1.0, "um": 1.0, "mm": 1000.0}
_LAYOUTS = {Feature.SIZE: (("deviation",),), Feature.POSITION: (("x", "y"), ("radius",))}


def load_measured_parts(path: Path, feature: Feature, zone: float, middle: float) -> MeasuredParts:
    """Return the parts of a CSV file.

    Parameters
    ----------
    path
        File with a column ``deviation [µm]`` for a size, and ``x [µm]`` and ``y [µm]`` or ``radius [µm]`` for a
        position; all from the nominal place.
    feature
        Size or position.
    zone, middle
        Width and middle of the zone that the parts were made to [m].

    Raises
    ------
    InputError
        The file, row, column and value that are not allowed, or there are too few parts.
    """
    table = read_text_table(path)
    names = tuple(split_header(header)[0] for header in table.headers)
    layouts = _LAYOUTS[feature]
    if names not in layouts:
        allowed = " or ".join(" and ".join(f"{name} [µm]" for name in layout) for layout in layouts)
        raise InputError.at(path, f"columns for feature {feature.value}", ", ".join(table.headers), allowed)
    if len(table.cells) < FEWEST_PARTS:
        raise InputError.at(path, "number of measured parts", len(table.cells), f"{FEWEST_PARTS} or more")
    columns = [_column(table, at) for at in range(len(names))]
    values = np.hypot(columns[0], columns[1]) if len(columns) == 2 else np.array(columns[0])
    if names == ("radius",) and values.min() < 0.0:
        row = table.rows[int(values.argmin())]
        raise InputError.at(f"{path}, row {row}", table.headers[0], f"{values.min():g} µm", "0 or more")
    if np.ptp(values) == 0.0:
        raise InputError.at(path, "every measured part", f"{values[0]:g} µm", "parts that differ from each other")
    return MeasuredParts(
        path=path,
        values=tuple((values * MICROMETRE).tolist()),
        are_radii=feature is Feature.POSITION,
        zone=zone,
        middle=middle,
    )


def _column(table: TextTable, at: int) -> list[float]:
    """Return a column [µm]."""
    header = table.headers[at]
    unit = split_header(header)[1]
    if unit not in _FACTORS:
        raise InputError.at(table.path, f"the unit of column {header!r}", unit, "µm, um or mm in square brackets")
    values = []
    for row, cells in zip(table.rows, table.cells, strict=True):
        try:
            value = float(cells[at]) * _FACTORS[unit]
        except ValueError:
            value = float("nan")
        if not (isfinite(value) and abs(value) <= LARGEST_DEVIATION):
            raise InputError.at(
                f"{table.path}, row {row}",
                header,
                cells[at],
                f"a number from {-LARGEST_DEVIATION:g} to {LARGEST_DEVIATION:g} µm",
            )
        values.append(value)
    return values
