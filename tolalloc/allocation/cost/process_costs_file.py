"""Process cost tables: the ways in which the features of a tolerance table can be made, and what each costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from tolalloc.allocation.cost.closed_forms import Reciprocal
from tolalloc.allocation.cost.model import Process
from tolalloc.allocation.cost.points_file import ShopPoints, load_shop_points, points_of
from tolalloc.allocation.cost.process_cost_row import ProcessCostRow
from tolalloc.drawing.sources import Source
from tolalloc.drawing.table_file import DATA, read_rows
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import shipped_or_path
from tolalloc.units import MICROMETRE

ProcessesOfSources = Mapping[str, tuple[Process, ...]]
"""Source → ways to make it, zones in metres."""

PlacedRow = tuple[str, ProcessCostRow]
"""File and row, and what stands there."""


def today(source: Source) -> Process:
    """Return the one way to make a feature that the tolerance table knows: its cost falls as 1/zone."""
    return Process(
        name=source.process or "as today",
        cost=Reciprocal(factor=source.cost * source.zone),
        minimum=source.minimum,
        maximum=source.maximum,
    )


def load_process_costs(name: str | Path, sources: Sequence[Source]) -> ProcessesOfSources:
    """Return the ways to make every feature whose zone may change, from a process cost table.

    A feature without a row keeps the one way of the tolerance table.

    Parameters
    ----------
    name
        Shipped name, or path of the user's CSV file; files of points stand beside it.
    sources
        Rows of the tolerance table.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed, or a feature that no process can hold.
    """
    path = shipped_or_path(name, DATA, ".process_costs.csv", "process cost table")
    rows = read_rows(path, ProcessCostRow, "sources")
    for place, row in rows:
        if not any(fnmatchcase(source.name, row.sources) for source in sources):
            raise UnknownNameError.among(place, "source", row.sources, [source.name for source in sources])
        if row.points and not (path.parent / row.points).is_file():
            folder = path.absolute().parent
            raise InputError(f"{place}: points {row.points}: no such file; allowed is a CSV file in {folder}.")
    shops = {row.points: load_shop_points(path.parent / row.points) for _, row in rows if row.points}
    found = {}
    for source in sources:
        if source.zone > 0 and not source.locked:
            own = [(place, row) for place, row in rows if fnmatchcase(source.name, row.sources)]
            found[source.name] = _processes(source, own, shops, path) if own else (today(source),)
    return found


def _processes(
    source: Source, rows: Sequence[PlacedRow], shops: Mapping[str, ShopPoints], path: Path
) -> tuple[Process, ...]:
    """Return what remains of the rows of a source between its smallest and its largest zone."""
    names: list[str] = []
    for place, row in rows:
        if row.process in names:
            raise InputError(
                f"{place}: process is {row.process!r} for {source.name} for the second time; each has one row."
            )
        names.append(row.process)
    if source.process and source.process not in names:
        raise UnknownNameError.among(path, f"process of {source.name} in the tolerance table,", source.process, names)
    now = source.process or names[0]
    for place, row in rows:
        if not (row.factor or row.points or row.process == now):
            raise InputError(
                f"{place}: factor is missing: the tolerance table's cost of {source.name} is that of {now!r}."
            )
    processes = [_process(source, place, row, shops, 0.0 if row.process == now else row.change) for place, row in rows]
    left = tuple(process for process in processes if process is not None)
    if not left:
        raise InputError(
            f"{path}: no process can hold a zone of {source.minimum / MICROMETRE:g} to "
            f"{source.maximum / MICROMETRE:g} µm for {source.name}; allowed are rows whose min and max reach into it."
        )
    return left


def _process(
    source: Source, place: str, row: ProcessCostRow, shops: Mapping[str, ShopPoints], change: float
) -> Process | None:
    """Return the process of a row, or None where it holds no zone that the source may have."""
    points = points_of(shops[row.points], row.process, source.feature, place) if row.points else None
    lowest, highest = (points.zones[0], points.zones[-1]) if points else (0.0, np.inf)  # nothing is known beyond them
    minimum = max(source.minimum, lowest * MICROMETRE, (row.min or 0.0) * MICROMETRE)
    maximum = min(source.maximum, highest * MICROMETRE, (row.max or np.inf) * MICROMETRE)
    if minimum > maximum:
        return None
    return Process(
        name=row.process,
        cost=row.cost(source, points, place).rescaled(1 / MICROMETRE),
        minimum=minimum,
        maximum=maximum,
        change=change,
    )
