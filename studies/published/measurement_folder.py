"""Measurements as a folder of files, so that simulated units can stand in for a bench."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.reading.files import as_toml, require_new, write_new
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.unit_file import table_text, units_text
from tolalloc.wings.bench.measurements import Measurements


def write_measurements(measurements: Measurements, folder: str | Path) -> Path:
    """Write measurements in the layout that `load_measurements` reads, and return the path of the measurement file.

    What was mended before stands as comments above the readings.

    Parameters
    ----------
    measurements
        Units of one table state the same columns.
    folder
        Made where it is missing; gets ``measurement.toml``, ``units.csv`` and a CSV file per table, curve and loop.

    Raises
    ------
    InputError
        A file exists or cannot be written, or units state different columns.
    """
    folder = Path(folder)
    tables = list(_tables(measurements))
    neglected = tuple(dict.fromkeys(pattern for unit in measurements.units for pattern in unit.neglected))
    lines = [
        f"name = {as_toml(measurements.name)}",
        f"source = {as_toml(measurements.source)}",
        'units = "units.csv"',
        f"neglected = {as_toml(neglected)}",
        f"assumptions = {as_toml(measurements.assumptions)}",
    ]
    for table in tables:
        fields = {"file": table.file, **table.fields}
        lines += [
            "",
            table.kind,
            *(f"{name} = {as_toml(value)}" for name, value in fields.items() if value is not None),
        ]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be made ({error.strerror}); name another one.") from None
    main = folder / "measurement.toml"
    for path in (main, folder / "units.csv", *(folder / table.file for table in tables)):
        require_new(path)  # all of them, before the first is written
    write_new(folder / "units.csv", units_text(measurements.units, folder / "units.csv"))
    for table in tables:
        write_new(folder / table.file, table_text(table.headers, table.rows, table.comments))
    write_new(main, "\n".join(lines) + "\n")
    return main


class _Table(NamedTuple):
    """One CSV file beside the units, and its table in the measurement file."""

    file: str
    kind: str
    fields: dict[str, str | float | None]
    headers: tuple[str, str]
    rows: list[tuple[str | float, float]]
    comments: tuple[str, ...]


def _tables(measurements: Measurements) -> Iterator[_Table]:
    """Yield every CSV file beside the units."""
    names = [unit.name for unit in measurements.units]
    table = measurements.peak_to_peak
    if table:
        yield _Table(
            file="peak_to_peak.csv",
            kind="[peak_to_peak]",
            fields={"torque_nm": table.torque, "noise_arcsec": _arcsec(table.noise)},
            headers=("unit", "peak_to_peak [arcsec]"),
            rows=[
                (names[unit], float(value) / ARCSECOND) for unit, value in zip(table.unit, table.values, strict=True)
            ],
            comments=(),
        )
    for number, curve in enumerate(measurements.curves, 1):
        yield _Table(
            file=f"curve{number}.csv",
            kind="[[curves]]",
            fields={
                "unit": names[curve.unit],
                "torque_nm": curve.torque,
                "noise_arcsec": _arcsec(curve.noise),
            },
            headers=("angle [deg]", "transmission error [arcsec]"),
            rows=_pairs(curve.carrier_angle / DEGREE, curve.transmission_error / ARCSECOND),
            comments=curve.repairs,
        )
    for number, loop in enumerate(measurements.loops, 1):
        yield _Table(
            file=f"loop{number}.csv",
            kind="[[loops]]",
            fields={
                "unit": names[loop.unit],
                "carrier_angle_deg": loop.carrier_angle / DEGREE,
                "noise_arcsec": _arcsec(loop.noise),
            },
            headers=("torque [N·m]", "twist [arcsec]"),
            rows=_pairs(loop.torque, loop.twist / ARCSECOND),
            comments=loop.repairs,
        )


def _pairs(first: Float[np.ndarray, " row"], second: Float[np.ndarray, " row"]) -> list[tuple[str | float, float]]:
    return list(zip(first.tolist(), second.tolist(), strict=True))


def _arcsec(noise: float | None) -> float | None:
    return None if noise is None else noise / ARCSECOND
