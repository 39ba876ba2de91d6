"""Tolerance tables: one row per source, read from CSV or Excel and written back in the same layout."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from tolalloc.drawings.fields import ALLOWED_UNITS, COLUMNS, UNITS, Cell, ToleranceRow, headers_in
from tolalloc.drawings.process_capability import load_process_capabilities, with_process
from tolalloc.drawings.sources import Source, known_as
from tolalloc.drawings.table_file import (
    DATA,
    read_table_file,
    require_columns,
    require_units,
    split_header,
    typed_cells,
    usual_signs,
)
from tolalloc.exceptions import Faults, InputError
from tolalloc.reading.files import no_formula, shipped_or_path, validated
from tolalloc.reading.units import COST_UNITS, MICROMETRE

if TYPE_CHECKING:
    import pandas as pd

SMALLEST_KEPT = 0.01
"""Smallest share that sorting may leave of all parts [-]."""


def load_tolerance_table(name: str | Path, capabilities: str | Path = "generic", sheet: str = "") -> tuple[Source, ...]:
    """Return the sources of a tolerance table and its processes, each by shipped name or from the user's file.

    Of a workbook the named sheet is read, the first unless named.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".tolerances.csv", "tolerance table")
    (_, first), *others = read_table_file(path, header=("id",), sheet=sheet)
    stated = [split_header(header) for header in first]
    headers = tuple(name for name, _ in stated)
    require_columns(path, headers, ToleranceRow)
    if not others:
        raise InputError(f"{path}: the table has no rows; one row per source is needed.")
    rows = [(number, dict(zip(headers, cells, strict=True))) for number, cells in others]
    _require_units(path, stated, rows)
    return sources_of_rows(rows, capabilities, str(path), path.parent)


def _require_units(path: Path, stated: Sequence[tuple[str, str]], rows: Sequence[tuple[int, dict[str, str]]]) -> None:
    """Raise unless headers state the units of `COLUMNS`; that of zones may also be the one unit of all rows."""
    units = {name: column.unit for name, column in COLUMNS.items()}
    for column, unit in stated:
        if units[column] != "unit" or unit in ("", "unit"):
            continue
        if unit not in UNITS:
            allowed = f"unit, where the column unit says it row by row; or {ALLOWED_UNITS}, the same as in all rows"
            raise InputError.at(path, f"the unit of column {column}", unit, allowed)
        for number, row in rows:
            if UNITS.get(usual_signs(row["unit"]), UNITS[unit]) != UNITS[unit]:
                allowed = f"{unit} as in the header {column} [{unit}]; numbers are not converted"
                raise InputError.at(f"{path}, row {number} ({row['id'] or 'no id'})", "unit", row["unit"], allowed)
        units[column] = unit
    require_units(path, stated, units)


def sources_of_rows(
    rows: Iterable[tuple[int, Mapping[str, object]]], capabilities: str | Path, place: str, folder: Path
) -> tuple[Source, ...]:
    """Return the sources of numbered rows, whose cells are text or already of the type of their field.

    The place is what messages name; files of measured parts are looked for in the folder.

    Raises
    ------
    InputError, UnknownNameError
        The row, field and value that are not allowed.
    """
    processes = load_process_capabilities(capabilities)
    sources: dict[str, Source] = {}
    faults = Faults()
    for number, row in rows:
        identity = str(row.get("id", "")).strip()
        where = f"{place}, row {number} ({identity or 'no id'})"
        with faults.kept():
            cells = with_process(typed_cells(ToleranceRow, row, where), processes, where)
            source = validated(ToleranceRow, cells, where).as_source(folder)
            if source.name in sources:
                field = "source" if source.own_id else "id"
                raise InputError(f"{where}: {field} is {source.name!r} for the second time; each source has one row.")
            if {identity, source.name} & {*known_as(sources.values())}:
                raise InputError(f"{where}: id is {identity!r} for the second time; each row has one of its own.")
            if source.sorted and source.zone_mapping.inside < SMALLEST_KEPT:
                left = f"no, as it would leave less than {SMALLEST_KEPT:.0%} of all parts"
                raise InputError.at(where, "sorted", "yes", left)
            sources[source.name] = source
    faults.require_none()
    return tuple(sources.values())


def table_rows(sources: Sequence[Source], folder: Path | None = None) -> list[list[str | int | float]]:
    """Return the cells of the sources in the order of `COLUMNS`.

    Files of measured parts are named from the folder that the table is written to; without one in such a way that they
    are found from everywhere.
    """
    return [[_written(column.cell(source), folder) for column in COLUMNS.values()] for source in sources]


def _written(cell: Cell, folder: Path | None) -> str | int | float:
    """Return a cell as a table shows it."""
    if isinstance(cell, Path):
        return (Path(os.path.relpath(cell, folder.resolve())) if folder else cell).as_posix()
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if cell is None:
        return ""
    return str(cell) if isinstance(cell, str) else cell


def table_frame(sources: Sequence[Source], folder: Path | None = None, cost_unit: str = COST_UNITS) -> pd.DataFrame:
    """Return the sources as a tolerance table in the layout that `load_tolerance_table` reads."""
    import pandas as pd

    return pd.DataFrame(table_rows(sources, folder), columns=list(headers_in(cost_unit).values()))


def with_own_words(frame: pd.DataFrame, named: str, members: Mapping[str, Sequence[Source]]) -> pd.DataFrame:
    """Return a table with own id, drawing and label of its rows behind their names, where the drawing states any.

    Parameters
    ----------
    frame
        A table.
    named
        Header of its column of names.
    members
        Name → its sources.
    """
    for field, header in {"label": "label", "drawing": "drawing", "own_id": "own id"}.items():
        said = [
            ", ".join(dict.fromkeys(filter(None, (getattr(own, field) for own in members.get(name, ())))))
            for name in frame[named]
        ]
        if any(said):
            frame.insert(list(frame.columns).index(named) + 1, header, said)
    return frame


def table_text(sources: Sequence[Source], folder: Path | None = None, currency: str = "") -> str:
    """Return the sources as the CSV file that `load_tolerance_table` reads, costs in a currency if they are in one."""
    text = StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(headers_in(currency or COST_UNITS).values())
    writer.writerows(map(no_formula, row) for row in table_rows(sources, folder))
    return text.getvalue()


def require_small_zones(sources: Sequence[Source], largest: float, place: str | Path) -> None:
    """Raise unless all zones, and those that may be asked for, are as small as a model believes [m].

    Raises
    ------
    InputError
        The source with a larger one.
    """
    limit = largest / MICROMETRE
    for source in sources:
        zone, smallest, most = (length / MICROMETRE for length in (source.zone, source.minimum, source.maximum))
        if zone > limit:
            raise InputError(
                f"{place} ({source.name}): the zone plus − minus is {zone:g} µm and must be 0 to {limit:g} µm."
            )
        if zone > 0 and not source.locked and most > limit:
            raise InputError(
                f"{place} ({source.name}): the zone must lie between min and max, above 0 and up to {limit:g} µm: "
                f"min {smallest:g}, zone {zone:g}, max {most:g} µm."
            )


def with_zones(
    sources: Sequence[Source], zones: Sequence[float], costs: Mapping[str, float] | None = None
) -> tuple[Source, ...]:
    """Return the sources at other zones [m], each at the cost given for its name or else as 1/zone [cost units]."""
    known = costs or {}
    return tuple(
        source
        if zone == source.zone and source.name not in known
        else replace(
            source,
            zone=zone,
            cost=known[source.name] if source.name in known else source.cost * source.zone / zone,
            grade=source.grade if zone == source.zone else "",
        )
        for source, zone in zip(sources, zones, strict=True)
    )
