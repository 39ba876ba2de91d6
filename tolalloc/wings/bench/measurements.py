"""What was measured on finished reducers, clean and in SI units, and the measurement files that say where it stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float, Int
from pydantic import AfterValidator, BeforeValidator, Field

from tolalloc.drawings.table_file import read_text_table
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.files import Record, read_toml, validated
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.unit_file import BuiltUnit, load_unit, load_units, unit_names
from tolalloc.wings.bench.readings import (
    ANGLE,
    LARGEST_RANGE,
    PEAK_TO_PEAK,
    TORQUE,
    TRANSMISSION_ERROR,
    TWIST,
    Cleaned,
    clean_curve,
    clean_loop,
    load_readings,
    read_column,
    require_moving,
)


@dataclass(frozen=True, kw_only=True)
class MeasuredCurve:
    """Transmission error of one unit over the output angle."""

    unit: int  # Position in `Measurements.units` [-]
    torque: float  # Torque on the carrier, negative against the rotation [N·m]
    carrier_angle: Float[np.ndarray, " reading"]  # Angles of the readings, ascending [rad]
    transmission_error: Float[np.ndarray, " reading"]  # Readings without their mean, output side [rad]
    # Standard deviation of one reading as it stands here, None where the file does not state it [rad]
    noise: float | None = None
    repairs: tuple[str, ...] = ()  # What was mended, prefixed by the file


@dataclass(frozen=True, kw_only=True)
class MeasuredLoop:
    """Twist of the carrier of one unit against torque, the sun held."""

    unit: int  # Position in `Measurements.units` [-]
    carrier_angle: float  # Angle at which the loop was measured [rad]
    torque: Float[np.ndarray, " level"]  # Torques on the carrier, ascending, none of them 0 [N·m]
    twist: Float[np.ndarray, " level"]  # Readings without their mean, output side [rad]
    # As of a curve [rad]
    noise: float | None = None
    repairs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredPeakToPeak:
    """Largest minus smallest transmission error over one output turn, one value per unit."""

    unit: Int[np.ndarray, " n"]  # Positions in `Measurements.units` [-]
    values: Float[np.ndarray, " n"]  # Peak-to-peaks, output side [rad]
    torque: float  # Torque on the carrier, negative against the rotation [N·m]
    noise: float | None = None  # Standard deviation of one value, None where the file does not state it [rad]


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """Measured errors of the parts of some units, and what the finished units did."""

    # What was measured, and where
    name: str
    source: str
    units: tuple[BuiltUnit, ...]  # Errors of the parts, unit by unit
    peak_to_peak: MeasuredPeakToPeak | None = None  # One value per unit, None where there is no such table
    # Any number per unit
    curves: tuple[MeasuredCurve, ...] = ()
    loops: tuple[MeasuredLoop, ...] = ()
    assumptions: tuple[str, ...] = ()  # What was not measured

    @property
    def repairs(self) -> tuple[str, ...]:
        """Everything that was mended, each prefixed by its file."""
        shapes: tuple[MeasuredCurve | MeasuredLoop, ...] = (*self.curves, *self.loops)
        return tuple(repair for own in shapes for repair in own.repairs)


def _loaded(torque: float) -> float:
    if torque == 0.0:
        raise ValueError("a torque of 0 is not allowed, as no pin carries; below 0 it resists the rotation")
    return torque


def _as_list(names: object) -> object:
    return (names,) if isinstance(names, str) else names


Text = Annotated[str, Field(min_length=1)]
Torque = Annotated[float, Field(ge=-1e5, le=1e5), AfterValidator(_loaded)]
NoiseArcsec = Annotated[float, Field(gt=0, le=3600)]
Degrees = Annotated[float, Field(ge=-360, le=360)]


class PeakToPeakRecord(Record):
    """Table ``[peak_to_peak]``."""

    file: Text
    torque_nm: Torque
    noise_arcsec: NoiseArcsec | None = None


class CurveRecord(Record):
    """One table ``[[curves]]``."""

    unit: Text
    file: Text
    torque_nm: Torque
    noise_arcsec: NoiseArcsec | None = None
    angle_offset_deg: Degrees = 0.0
    start_stop_deg: Annotated[float, Field(ge=0, le=180)] = 0.0


class LoopRecord(Record):
    """One table ``[[loops]]``."""

    unit: Text
    file: Text
    carrier_angle_deg: Degrees
    noise_arcsec: NoiseArcsec | None = None


class MeasurementRecord(Record):
    """A measurement file; its inner tables are checked one by one, so that a sentence can number them."""

    name: Text
    source: Text
    units: Annotated[tuple[Text, ...], BeforeValidator(_as_list), Field(min_length=1)]
    neglected: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    peak_to_peak: dict[str, Any] | None = None
    curves: tuple[dict[str, Any], ...] = ()
    loops: tuple[dict[str, Any], ...] = ()


def load_measurements(path: str | Path) -> Measurements:
    """Return the measurements of a TOML file, cleaned; the files it names stand relative to it.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = Path(path)
    record = validated(MeasurementRecord, read_toml(path), path)
    if record.peak_to_peak is None and not (record.curves or record.loops):
        raise InputError(f"{path}: there are no measured data; give [peak_to_peak], [[curves]] or [[loops]].")
    units = _units(record, path)
    positions = {unit.name: number for number, unit in enumerate(units)}
    faults, peak_to_peak = Faults(), None
    curves, loops = list[MeasuredCurve](), list[MeasuredLoop]()
    if record.peak_to_peak is not None:
        with faults.kept():
            peak_to_peak = _peak_to_peak(record.peak_to_peak, path, positions)
    for number, data in enumerate(record.curves, 1):
        with faults.kept():
            curves.append(_curve(data, path, f"{path}, curve {number}", positions))
    for number, data in enumerate(record.loops, 1):
        with faults.kept():
            loops.append(_loop(data, path, f"{path}, loop {number}", positions))
    faults.require_none()
    return Measurements(
        name=record.name,
        source=record.source,
        units=units,
        peak_to_peak=peak_to_peak,
        curves=tuple(curves),
        loops=tuple(loops),
        assumptions=record.assumptions,
    )


def _units(record: MeasurementRecord, path: Path) -> tuple[BuiltUnit, ...]:
    """Return the units of tables and unit files, each name once."""
    units: list[BuiltUnit] = []
    for name in record.units:
        if name.lower().endswith(".toml"):
            unit = load_unit(path.parent / name)
            unit.require_no_form(str(path))
            units.append(replace(unit, neglected=unit.neglected + record.neglected))
        else:
            units.extend(load_units(path.parent / name, record.neglected))
    names = [unit.name for unit in units]
    for name in names:
        if names.count(name) > 1:
            raise InputError.at(path, "the name of a unit", name, "each name once in all of its unit files")
    return tuple(units)


def _position(name: str, place: Path | str, positions: Mapping[str, int]) -> int:
    UnknownNameError.require(place, "unit", name, positions)
    return positions[name]


def _in_radians(noise: float | None, factor: float = 1.0) -> float | None:
    return None if noise is None else noise * ARCSECOND * factor


def _peak_to_peak(data: Mapping[str, Any], path: Path, positions: Mapping[str, int]) -> MeasuredPeakToPeak:
    record = validated(PeakToPeakRecord, data, f"{path}, peak_to_peak")
    table = read_text_table(path.parent / record.file)
    names = unit_names(table)
    header, factor, values = read_column(table, PEAK_TO_PEAK)
    units = []
    for row, name, cells, value in zip(table.rows, names, table.cells, values, strict=True):
        units.append(_position(name, f"{table.path}, row {row}", positions))
        if not 0.0 <= value <= LARGEST_RANGE:
            cell, allowed = cells[table.headers.index(header)], f"a number from 0 to {LARGEST_RANGE / factor:g}"
            raise InputError.at(f"{table.path}, row {row} (unit {name})", header, cell, allowed)
    require_moving(table.path, header, values / factor)
    return MeasuredPeakToPeak(
        unit=np.array(units), values=values, torque=record.torque_nm, noise=_in_radians(record.noise_arcsec)
    )


def _prefixed(file: str, cleaned: Cleaned) -> tuple[str, ...]:
    return tuple(f"{file}: {repair}" for repair in cleaned.repairs)


def _curve(data: Mapping[str, Any], path: Path, place: str, positions: Mapping[str, int]) -> MeasuredCurve:
    record = validated(CurveRecord, data, place)
    unit = _position(record.unit, place, positions)
    cleaned = clean_curve(
        load_readings(path.parent / record.file, ANGLE, TRANSMISSION_ERROR),
        offset=record.angle_offset_deg * DEGREE,
        start_stop=record.start_stop_deg * DEGREE,
    )
    return MeasuredCurve(
        unit=unit,
        torque=record.torque_nm,
        carrier_angle=cleaned.along,
        transmission_error=cleaned.values,
        noise=_in_radians(record.noise_arcsec, cleaned.noise_factor),
        repairs=_prefixed(record.file, cleaned),
    )


def _loop(data: Mapping[str, Any], path: Path, place: str, positions: Mapping[str, int]) -> MeasuredLoop:
    record = validated(LoopRecord, data, place)
    unit = _position(record.unit, place, positions)
    cleaned = clean_loop(load_readings(path.parent / record.file, TORQUE, TWIST))
    return MeasuredLoop(
        unit=unit,
        carrier_angle=record.carrier_angle_deg * DEGREE,
        torque=cleaned.along,
        twist=cleaned.values,
        noise=_in_radians(record.noise_arcsec, cleaned.noise_factor),
        repairs=_prefixed(record.file, cleaned),
    )
