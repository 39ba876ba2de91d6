"""Measured errors of built reducers: of one in a unit file, of many in a table with a row for each."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import StringIO
from math import cos, radians, sin
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, StrictBool

from tolalloc.drawings.heads import split_header
from tolalloc.drawings.sources import Source, is_angular, neglected_columns
from tolalloc.drawings.table_file import TextTable, believed_number, read_text_table
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.files import Record, no_formula, read_toml, shipped_or_path, validated
from tolalloc.reading.units import MICROMETRE, MICRORADIAN
from tolalloc.reducers.cycloid.measured_profile import MeasuredProfile
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.families.known import SOURCES
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.files import PRESETS
from tolalloc.reducers.reducer.form import FlankForm, PartForm, PinForm

_HARMONIC = re.compile(r"(.*)\.(?:cos|sin)(\d+)")

Micrometres = Annotated[float, Field(ge=-200, le=200)]
Magnitude = Annotated[float, Field(ge=0, le=200)]
Microradians = Annotated[float, Field(ge=-20000, le=20000)]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Order = Annotated[int, Field(ge=1, le=100)]
LENGTH_UNITS, ANGLE_UNITS = ("µm", "um"), ("µrad", "urad")
LARGEST_LENGTH, LARGEST_ANGLE = 200.0, 20000.0
"""Largest deviation that is believed, as in a unit file [µm, µrad]."""


class ProfileRecord(Record):
    """Table ``[profiles.disc1]``: the measured profile of a disc in a CSV file beside the unit file."""

    file: str
    datum_deg: Degrees = 0.0
    aligned: StrictBool = False
    from_drawing: StrictBool = False
    spans: Annotated[int, Field(ge=0, le=1000)] | None = None
    across: Literal["mean", "highest"] = "mean"


class UnitRecord(Record):
    """A unit file; see the shipped ``table4.unit.toml``."""

    name: str
    source: str
    neglected: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    lengths: dict[str, Micrometres] = Field(default_factory=dict)
    vectors: dict[str, tuple[Magnitude, Degrees]] = Field(default_factory=dict)
    harmonics: dict[str, tuple[tuple[Order, Magnitude, Degrees], ...]] = Field(default_factory=dict)
    angles: dict[str, Microradians] = Field(default_factory=dict)
    tilts: dict[str, tuple[Microradians, Degrees]] = Field(default_factory=dict)
    profiles: dict[str, ProfileRecord] = Field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class BuiltUnit:
    """Errors of one reducer, by column."""

    # Which reducer, and where its errors were read
    name: str
    source: str
    deviations: dict[str, float]  # Column → deviation [m, angles rad]
    neglected: tuple[str, ...] = ()  # Sources that the unit leaves out, taken as zero; ``*`` stands for anything
    assumptions: tuple[str, ...] = ()  # What the source does not print
    # Form of its parts: disc ``disc1`` → its measured profile, pin ``each_pin.roundness.7`` → waves of its radius
    profiles: Mapping[str, MeasuredProfile] = field(default_factory=dict)
    roundness: Mapping[str, PinForm] = field(default_factory=dict)

    def modification(self, reducer: Reducer) -> Modification:
        """Return the tooth modification of the unit, that of the reducer where it does not state its own."""
        stated = reducer.modification.deviations
        return Modification(**{name.rpartition(".")[2]: self.deviations.get(name, stated[name]) for name in stated})

    def as_built(self, reducer: Reducer) -> Reducer:
        """Return the reducer with the form of the unit's measured discs and pins, itself where none is stated."""
        if not (self.profiles or self.roundness):
            return reducer
        stage, form, assumptions = reducer.cycloid_stage, reducer.form or PartForm(), list(reducer.assumptions)
        drawn = ToothProfile(stage=stage, modification=self.modification(reducer), form=form.designed)
        numbers = {f"disc{disc + 1}": disc for disc in range(reducer.disc_count)}
        discs: dict[int, FlankForm] = {}
        for name, profile in self.profiles.items():
            if name not in numbers:
                raise UnknownNameError.among(f"unit {self.name}", "disc with a profile", name, numbers)
            discs[numbers[name]], moved = profile.form(drawn, numbers[name] + 1)
            assumptions.append(f"{name} as {profile.path.name} states it{moved.sentence if moved else ''}")
        pins = {f"each_pin.roundness.{pin + 1}": pin for pin in range(stage.pin_count)}
        for name in self.roundness:
            if name not in pins:
                raise UnknownNameError.among(f"unit {self.name}", "roundness of a pin", name, pins)
        rounds = {pins[name]: own for name, own in self.roundness.items()}
        form = replace(form, discs=tuple(sorted(discs.items())), pins=tuple(sorted(rounds.items())))
        return replace(reducer, form=form, assumptions=tuple(assumptions))

    def without_measured(self, sources: Iterable[Source]) -> tuple[Source, ...]:
        """Return sources of a drawing without a zone where a measured profile holds what they let vary."""
        held = [_columns_in_profile(disc) for disc in self.profiles]
        return tuple(
            replace(source, zone=0.0, systematic=()) if any(own.match(f"{source.name}.") for own in held) else source
            for source in sources
        )

    def require_no_form(self, place: str) -> None:
        """Raise if the unit states profiles or roundness where units share one model."""
        for name in (*self.profiles, *self.roundness):
            allowed = f"one without the form of single parts, and this one states that of {name}"
            raise InputError.at(place, "unit", self.name, allowed)

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of all its harmonics, ascending [-]."""
        found = (_HARMONIC.fullmatch(column) for column in self.deviations)
        return tuple(sorted({int(match[2]) for match in found if match}))

    def _in_profiles(self, columns: Iterable[str]) -> dict[str, float]:
        """Return the columns that measured profiles hold, as zero beside them."""
        held: dict[str, float] = {}
        for disc in self.profiles:
            teeth = _columns_in_profile(disc)
            for column, value in self.deviations.items():
                if value and teeth.match(column):
                    raise InputError(
                        f"unit {self.name}: {column} is stated beside the profile of {disc}, which has it; allowed "
                        "is one of the two."
                    )
            held |= {column: 0.0 for column in columns if teeth.match(column)}
        return held

    def errors(
        self, columns: Iterable[str], nominal: Mapping[str, float] | None = None
    ) -> Float[np.ndarray, "1 column"]:
        """Return the unit as one row of errors in the order of the model's columns [m].

        Nominal are the values that the reducer's design gives, such as its modification, for a unit that does not state
        its own. All must be the model's columns, of which each is stated or neglected.
        """
        names, deviations = tuple(columns), {**self._in_profiles(columns), **(nominal or {}), **self.deviations}
        for column in self.deviations:
            if column not in names:
                raise UnknownNameError.among(f"unit {self.name}", "error", column, names)
        harmonic = {match[1] for match in map(_HARMONIC.fullmatch, deviations) if match}
        for column in names:
            match = _HARMONIC.fullmatch(column)
            if match and match[1] in harmonic:  # an order that a stated source does not list is not there
                deviations.setdefault(column, 0.0)
        left_out = neglected_columns(self.neglected, names) | SOURCES.silent(names)
        for column in names:
            if column not in deviations and column not in left_out:
                raise InputError(
                    f"unit {self.name}: {column} is not stated; give its value or list its source under neglected, "
                    "where * stands for anything, as in '*.tilt'."
                )
        return np.array([[deviations.get(column, 0.0) for column in names]])


def _columns_in_profile(disc: str) -> re.Pattern[str]:
    """Return what matches the columns that a measured profile of a disc holds: those of its teeth along the ring."""
    return re.compile(rf"{disc}\.(?:each_tooth\.)?(?:pitch|runout)\..*")


def load_unit(name: str | Path) -> BuiltUnit:
    """Return a built unit by shipped name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".unit.toml", "unit")
    record = validated(UnitRecord, read_toml(path), path)
    deviations = {column: value * MICROMETRE for column, value in record.lengths.items()}
    deviations |= {column: value * MICRORADIAN for column, value in record.angles.items()}
    roundness = {}
    for vectors, unit in ((record.vectors, MICROMETRE), (record.tilts, MICRORADIAN)):
        for source, (magnitude, direction) in vectors.items():
            deviations[f"{source}.x"] = magnitude * unit * cos(radians(direction))
            deviations[f"{source}.y"] = magnitude * unit * sin(radians(direction))
    for source, waves in record.harmonics.items():
        sines = [
            (order, amplitude * MICROMETRE * sin(radians(phase)), amplitude * MICROMETRE * cos(radians(phase)))
            for order, amplitude, phase in waves
        ]
        if source.startswith("each_pin.roundness."):
            roundness[source] = PinForm(waves=tuple(sines))
            continue
        for order, cosine, sine in sines:
            deviations |= {f"{source}.cos{order}": cosine, f"{source}.sin{order}": sine}
    return BuiltUnit(
        name=record.name,
        source=record.source,
        deviations=deviations,
        neglected=record.neglected,
        assumptions=record.assumptions,
        profiles={
            name: MeasuredProfile(
                path=path.parent / own.file,
                datum=radians(own.datum_deg),
                **own.model_dump(exclude={"file", "datum_deg"}),
            )
            for name, own in record.profiles.items()
        },
        roundness=roundness,
    )


def unit_names(table: TextTable) -> tuple[str, ...]:
    """Return the column ``unit`` of a table, whose names are unique.

    Raises
    ------
    InputError
        The column is missing, or a row names no unit or one that stands further up.
    """
    if "unit" not in table.headers:
        raise InputError(f"{table.path}: the column 'unit' is missing; it names the unit of each row.")
    position = table.headers.index("unit")
    first_row: dict[str, int] = {}
    for row, cells in zip(table.rows, table.cells, strict=True):
        name = cells[position]
        if not name:
            raise InputError.at(f"{table.path}, row {row}", "unit", name, "a name")
        if name in first_row:
            allowed = f"each name once, and this one stands in row {first_row[name]}"
            raise InputError.at(f"{table.path}, row {row}", "unit", name, allowed)
        first_row[name] = row
    return tuple(first_row)


def _is_angle(column: str) -> bool:
    return is_angular(column.removesuffix(".x").removesuffix(".y"))


def _column(path: Path, header: str) -> tuple[str, float, float]:
    """Return the model's column, the factor to SI and the largest value that is believed."""
    column, unit = split_header(header)
    angle = _is_angle(column)
    allowed = ANGLE_UNITS if angle else LENGTH_UNITS
    if unit not in allowed:
        what = f"{' or '.join(allowed)} in square brackets, as {column!r} is {'an angle' if angle else 'a length'}"
        raise InputError.at(path, f"the unit of column {column!r}", unit, what)
    return (column, MICRORADIAN, LARGEST_ANGLE) if angle else (column, MICROMETRE, LARGEST_LENGTH)


def load_units(path: str | Path, neglected: tuple[str, ...] = ()) -> tuple[BuiltUnit, ...]:
    """Return the units of a CSV file: a column ``unit``, the others are model columns such as ``disc1.tilt.x [µrad]``.

    Sources under neglected are stated by no unit and taken as zero; ``*`` stands for anything. A model's column that is
    neither in the table nor there is refused when the units meet the model.

    Raises
    ------
    InputError
        The file, row, column and value that are not allowed.
    """
    table = read_text_table(Path(path))
    names = unit_names(table)
    columns = {place: _column(table.path, header) for place, header in enumerate(table.headers) if header != "unit"}
    if len({column for column, *_ in columns.values()}) < len(columns) or table.headers.count("unit") > 1:
        raise InputError(f"{table.path}: a column stands there twice; each column of the model has one.")
    units, faults = [], Faults()
    for row, name, cells in zip(table.rows, names, table.cells, strict=True):
        deviations = {}
        for place, (column, factor, largest) in columns.items():
            with faults.kept():
                where = f"{table.path}, row {row} (unit {name})"
                deviations[column] = factor * believed_number(where, table.headers[place], cells[place], largest)
        units.append(BuiltUnit(name=name, source=table.path.name, deviations=deviations, neglected=neglected))
    faults.require_none()
    return tuple(units)


def table_text(headers: Sequence[str], rows: Iterable[Sequence[object]], comments: Sequence[str] = ()) -> str:
    """Return a CSV file with all digits of its numbers; comments are lines above the headers, names with units."""
    text = StringIO(newline="")
    text.writelines(f"# {comment}\n" for comment in comments)
    writer = csv.writer(text, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n")
    writer.writerows(map(no_formula, row) for row in (headers, *rows))
    return text.getvalue()


def units_text(units: Sequence[BuiltUnit], path: str | Path, comments: Sequence[str] = ()) -> str:
    """Return units in the layout that `load_units` reads; what they neglect is not part of it.

    Raises
    ------
    InputError
        There is no unit, or units state different columns.
    """
    if not units:
        raise InputError(f"{path}: there are no units to write.")
    columns = tuple(units[0].deviations)
    for unit in units:
        if set(unit.deviations) != set(columns):
            column = sorted(set(unit.deviations) ^ set(columns))[0]
            raise InputError(
                f"{path}: units {units[0].name} and {unit.name} do not both state {column}; units of one table state "
                "the same columns."
            )
    written = {own: ("µrad", MICRORADIAN) if _is_angle(own) else ("µm", MICROMETRE) for own in columns}
    headers = [f"{column} [{name}]" for column, (name, _) in written.items()]
    rows = (
        [unit.name, *(float(unit.deviations[column]) / factor for column, (_, factor) in written.items())]
        for unit in units
    )
    return table_text(["unit", *headers], rows, comments)
