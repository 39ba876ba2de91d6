"""Tolerance tables: one row per source, read from CSV or Excel and written back in the same layout."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from tolalloc.drawing.process_capability import load_process_capabilities, with_process
from tolalloc.drawing.sources import Source
from tolalloc.drawing.table_file import DATA, read_table_file
from tolalloc.drawing.tolerance_cells import batches_text, spectrum_text, typed_cells
from tolalloc.drawing.tolerance_row import ToleranceRow
from tolalloc.drawing.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import shipped_or_path, validated
from tolalloc.units import MICROMETRE, MILLIMETRE

SMALLEST_KEPT = 0.01
"""Smallest share that sorting may leave of all parts [-]."""

DECIMALS = 5
"""Decimals of a micrometre that a written table has: half a zone of four decimals [-]."""

HEADERS = {
    "id": "id",
    "part": "part",
    "feature": "feature",
    "nominal": "nominal [mm]",
    "plus": "plus [unit]",
    "minus": "minus [unit]",
    "unit": "unit",
    "distribution": "distribution",
    "Cp": "Cp [-]",
    "shift": "shift [half zone]",
    "shape": "shape [-]",
    "batches": "batches [weight:shift:spread]",
    "measured": "measured",
    "measured_zone": "measured_zone [unit]",
    "sorted": "sorted",
    "process": "process",
    "group": "group",
    "locked": "locked",
    "min": "min [unit]",
    "max": "max [unit]",
    "cost": "cost [cost units]",
    "grade": "grade",
    "spectrum": "spectrum [order:amplitude]",
    "each": "each [-]",
    "over": "over [mm]",
    "note": "note",
}
REQUIRED = ("id", "part", "feature", "plus", "minus", "unit", "min", "max", "cost")


def load_tolerance_table(name: str | Path, capabilities: str | Path = "generic") -> tuple[Source, ...]:
    """Return the sources of a tolerance table by shipped name or from the user's CSV or XLSX file.

    Parameters
    ----------
    name
        Shipped name, or path of the table.
    capabilities
        Shipped name, or path of the process capability library that the table's processes are looked up in.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".tolerances.csv", "tolerance table")
    frame = _read(path)
    if frame.empty:
        raise InputError(f"{path}: the table has no rows; one row per source is needed.")
    processes = load_process_capabilities(capabilities)
    sources: dict[str, Source] = {}
    for number, row in zip(frame.index + 1, frame.to_dict("records"), strict=True):
        identity = str(row.get("id", "")).strip()
        place = f"{path}, row {number} ({identity or 'no id'})"
        cells = typed_cells(ToleranceRow, {str(key): str(value) for key, value in row.items()}, place)
        source = validated(ToleranceRow, with_process(cells, processes, place), place).source(path.parent)
        if identity in sources:
            raise InputError(f"{place}: id is {identity!r} for the second time; each source has one row.")
        if source.sorted and source.zone_mapping.inside < SMALLEST_KEPT:
            left = f"no, as it would leave less than {SMALLEST_KEPT:.0%} of all parts"
            raise InputError.at(place, "sorted", "yes", left)
        sources[identity] = source
    return tuple(sources.values())


def _read(path: Path) -> pd.DataFrame:
    """Return the table as text with bare headers, or say what is wrong with it as a whole."""
    cells = read_table_file(path)
    frame = cells.iloc[1:].set_axis([header.split(" [")[0].strip() for header in cells.iloc[0]], axis="columns")
    for header in frame.columns:
        if header not in HEADERS:
            raise UnknownNameError.among(path, "column", header, HEADERS)
    for header in REQUIRED:
        if header not in frame.columns:
            raise InputError(f"{path}: the column {header!r} is missing; needed are {', '.join(REQUIRED)}.")
    return frame


def table_frame(sources: Sequence[Source], folder: Path | None = None) -> pd.DataFrame:
    """Return the sources as a tolerance table in the layout that `load_tolerance_table` reads.

    Parameters
    ----------
    sources
        The rows.
    folder
        Folder that the table is written to, from where its files of measured parts are named; without it they are named
        in such a way that they are found from everywhere.
    """
    rows = []
    for source in sources:
        zone, middle = round(source.zone / MICROMETRE, DECIMALS), source.middle / MICROMETRE
        plus = round(middle + zone / 2, DECIMALS) if source.feature is Feature.SIZE else zone
        rows.append(
            {
                "id": source.name,
                "part": source.part,
                "feature": source.feature.value,
                "nominal": source.nominal / MILLIMETRE,
                "plus": plus,
                "minus": round(plus - zone, DECIMALS),
                "unit": "µm",
                "distribution": source.distribution.value,
                "Cp": source.cp,
                "shift": source.shift,
                "shape": source.shape or "",
                "batches": batches_text(source.batches),
                "measured": _path_from(folder, source.measured.path) if source.measured else "",
                "measured_zone": source.measured.zone / MICROMETRE if source.measured else "",
                "sorted": "yes" if source.sorted else "no",
                "process": source.process,
                "group": source.group,
                "locked": "yes" if source.locked else "no",
                "min": round(source.minimum / MICROMETRE, DECIMALS),
                "max": round(source.maximum / MICROMETRE, DECIMALS),
                "cost": round(source.cost, 12),
                "grade": source.grade,
                "spectrum": source.written_spectrum or spectrum_text(source.spectrum),
                "each": source.each,
                "over": source.over / MILLIMETRE if source.over else "",
                "note": source.note,
            }
        )
    return pd.DataFrame(rows).rename(columns=HEADERS)


def _path_from(folder: Path | None, path: Path) -> str:
    """Return the path as it is written into a table of this folder, or absolute without one."""
    return (Path(os.path.relpath(path, folder.resolve())) if folder else path).as_posix()


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
    """Return the sources at other zones [m], each at its cost.

    Parameters
    ----------
    sources
        The rows of the tolerance table.
    zones
        Their zones, in the same order [m].
    costs
        Source → what its zone costs; without one it falls as 1/zone [cost units].
    """
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
