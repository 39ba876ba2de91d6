"""Unit files: the actual errors of one built reducer."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.drawings.sources import neglected_columns
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import Record, read_toml, shipped_or_path, validated
from tolalloc.reading.units import MICROMETRE, MICRORADIAN
from tolalloc.reducers.reducer.files import PRESETS

_HARMONIC = re.compile(r"(.*)\.(?:cos|sin)(\d+)")

Micrometres = Annotated[float, Field(ge=-200, le=200)]
Magnitude = Annotated[float, Field(ge=0, le=200)]
Microradians = Annotated[float, Field(ge=-20000, le=20000)]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Order = Annotated[int, Field(ge=1, le=100)]


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


@dataclass(frozen=True, kw_only=True)
class BuiltUnit:
    """Errors of one reducer, by column."""

    # Which reducer, and where its errors were read
    name: str
    source: str
    deviations: dict[str, float]  # Column → deviation [m, angles rad]
    neglected: tuple[str, ...] = ()  # Sources that the unit leaves out, taken as zero; ``*`` stands for anything
    assumptions: tuple[str, ...] = ()  # What the source does not print

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of all its harmonics, ascending [-]."""
        found = (_HARMONIC.fullmatch(column) for column in self.deviations)
        return tuple(sorted({int(match[2]) for match in found if match}))

    def errors(
        self, columns: Iterable[str], nominal: Mapping[str, float] | None = None
    ) -> Float[np.ndarray, "1 column"]:
        """Return the unit as one row of errors in the order of the model's columns [m].

        Nominal are the values that the reducer's design gives, such as its modification, for a unit that does not state
        its own.

        Raises
        ------
        UnknownNameError
            The unit has an error that the model does not know.
        InputError
            The model has a column that the unit neither states nor neglects.
        """
        names, deviations = tuple(columns), {**(nominal or {}), **self.deviations}
        for column in self.deviations:
            if column not in names:
                raise UnknownNameError.among(f"unit {self.name}", "error", column, names)
        harmonic = {match[1] for match in map(_HARMONIC.fullmatch, deviations) if match}
        for column in names:
            match = _HARMONIC.fullmatch(column)
            if match and match[1] in harmonic:  # an order that a stated source does not list is not there
                deviations.setdefault(column, 0.0)
        left_out = neglected_columns(self.neglected, names)
        for column in names:
            if column not in deviations and column not in left_out:
                raise InputError(
                    f"unit {self.name}: {column} is not stated; give its value or list its source under neglected, "
                    "where * stands for anything, as in '*.tilt'."
                )
        return np.array([[deviations.get(column, 0.0) for column in names]])


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
    for source, (magnitude, direction) in record.vectors.items():
        deviations[f"{source}.x"] = magnitude * MICROMETRE * cos(radians(direction))
        deviations[f"{source}.y"] = magnitude * MICROMETRE * sin(radians(direction))
    deviations |= {column: value * MICRORADIAN for column, value in record.angles.items()}
    for source, (magnitude, direction) in record.tilts.items():
        deviations[f"{source}.x"] = magnitude * MICRORADIAN * cos(radians(direction))
        deviations[f"{source}.y"] = magnitude * MICRORADIAN * sin(radians(direction))
    for source, waves in record.harmonics.items():
        for order, amplitude, phase in waves:
            deviations[f"{source}.cos{order}"] = amplitude * MICROMETRE * sin(radians(phase))
            deviations[f"{source}.sin{order}"] = amplitude * MICROMETRE * cos(radians(phase))
    return BuiltUnit(
        name=record.name,
        source=record.source,
        deviations=deviations,
        neglected=record.neglected,
        assumptions=record.assumptions,
    )
