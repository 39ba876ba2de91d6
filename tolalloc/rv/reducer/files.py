"""Reducers and identified stiffnesses as TOML files: presets by name and the user's own."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from tolalloc.exceptions import InputError
from tolalloc.files import Record, as_toml, read_toml, shipped_or_path, validated, write_new
from tolalloc.rv.reducer.design import Clearances, CycloidStage, FirstStage, Load, Modification, Reducer
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness, Material, checked_correlation
from tolalloc.rv.reducer.stiffness_records import (
    IDENTIFIABLE,
    BallRecord,
    IdentifiedStiffnessRecord,
    StiffnessRecord,
)
from tolalloc.units import DEGREE, GIGAPASCAL, MICROMETRE, MILLIMETRE

PRESETS = Path(__file__).parent / "presets"

Teeth = Annotated[int, Field(ge=5, le=1000)]

_SI = {"mm": MILLIMETRE, "um": MICROMETRE, "deg": DEGREE, "gpa": GIGAPASCAL, "nm": 1.0}
"""Unit of measurement at the end of a field's name → what it is in SI units; ``nm`` is N·m."""


def _in_si(record: Record) -> dict[str, Any]:
    """Return the fields of a record in SI units, named without their units of measurement."""
    fields: dict[str, Any] = {}
    for name, value in record:
        quantity, _, unit = name.rpartition("_")
        fields |= {quantity: value * _SI[unit]} if unit in _SI and value is not None else {name: value}
    return fields


class FirstStageRecord(Record):
    """Table ``[first_stage]``."""

    sun_teeth: Teeth
    planet_teeth: Teeth
    module_mm: Annotated[float, Field(ge=0.1, le=20)]
    pressure_angle_deg: Annotated[float, Field(ge=5, le=45)]


class CycloidStageRecord(Record):
    """Table ``[cycloid_stage]``."""

    pin_count: Teeth
    disc_teeth: Teeth
    pin_circle_radius_mm: Annotated[float, Field(ge=5, le=1000)]
    pin_radius_mm: Annotated[float, Field(ge=0.1, le=50)]
    eccentricity_mm: Annotated[float, Field(ge=0.05, le=10)]
    face_width_mm: Annotated[float, Field(ge=0.5, le=200)]
    disc_spacing_mm: Annotated[float, Field(ge=0, le=500)] | None = None

    @model_validator(mode="after")
    def _is_a_cycloid(self) -> CycloidStageRecord:
        if self.disc_teeth != self.pin_count - 1:
            raise ValueError(f"disc_teeth must be pin_count − 1 = {self.pin_count - 1} (one-tooth difference)")
        shortening = self.eccentricity_mm * self.pin_count / self.pin_circle_radius_mm
        if not shortening < 1:
            raise ValueError(f"K1 = eccentricity·pin_count/pin_circle_radius must be below 1 and is {shortening:.3g}")
        half_pitch, convex = self.pin_circle_radius_mm * pi / self.pin_count, self.stage().smallest_convex_radius
        if self.pin_radius_mm >= half_pitch:
            raise ValueError(f"pin_radius_mm must be below {half_pitch:.3g}, where neighbouring pins overlap")
        if self.pin_radius_mm * MILLIMETRE >= convex:
            raise ValueError(f"pin_radius_mm must be below {convex / MILLIMETRE:.3g}, where pins undercut the teeth")
        return self

    def stage(self) -> CycloidStage:
        """Return the cycloid stage in SI units."""
        spacing = self.face_width_mm if self.disc_spacing_mm is None else self.disc_spacing_mm
        return CycloidStage(**_in_si(self.model_copy(update={"disc_spacing_mm": spacing})))


class MaterialRecord(Record):
    """Table ``[material]``, and ``[pin_material]`` where the pins are of another one."""

    elastic_modulus_gpa: Annotated[float, Field(ge=10, le=1000)]
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)]


class ClearancesRecord(Record):
    """Table ``[clearances]``, half the play; an interface that is not named has none."""

    gear_mesh_um: Annotated[float, Field(ge=0, le=200)] = 0.0
    crank_disc_bearing_um: Annotated[float, Field(ge=0, le=200)] = 0.0
    crank_carrier_bearing_um: Annotated[float, Field(ge=0, le=200)] = 0.0
    carrier_bearing_um: Annotated[float, Field(ge=0, le=200)] = 0.0


class ModificationRecord(Record):
    """Table ``[modification]``; the convention says whether the shift was written Rp + Δr_p or Rp − Δr_p."""

    equidistant_um: Annotated[float, Field(ge=-200, le=200)]
    shift_um: Annotated[float, Field(ge=-200, le=200)]
    convention: Literal["plus", "minus"] = "plus"

    def modification(self) -> Modification:
        """Return the modification in SI units and in the program's convention."""
        return Modification.from_convention(**_in_si(self))


class LoadRecord(Record):
    """Table ``[load]``; torques resist the positive direction of rotation when negative."""

    test_torque_nm: Annotated[float, Field(ge=-1e5, le=1e5)]
    rated_torque_nm: Annotated[float, Field(gt=0, le=1e5)]


class ReducerRecord(Record):
    """A whole reducer file."""

    name: str
    source: str
    crank_count: Annotated[int, Field(ge=2, le=6)]
    disc_count: Annotated[int, Field(ge=1, le=3)]
    first_stage: FirstStageRecord
    cycloid_stage: CycloidStageRecord
    material: MaterialRecord
    pin_material: MaterialRecord | None = None
    stiffness: StiffnessRecord
    modification: ModificationRecord
    load: LoadRecord
    clearances: ClearancesRecord = ClearancesRecord()
    assumptions: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _preload_is_carried(self) -> ReducerRecord:
        if isinstance(self.stiffness.carrier_bearing, BallRecord):
            self.stiffness.carrier_bearing.stiffness(Material(**_in_si(self.material)))
        return self

    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""
        stage, disc = self.cycloid_stage.stage(), Material(**_in_si(self.material))
        pin = Material(**_in_si(self.pin_material)) if self.pin_material else disc
        return Reducer(
            name=self.name,
            source=self.source,
            crank_count=self.crank_count,
            disc_count=self.disc_count,
            first_stage=FirstStage(**_in_si(self.first_stage)),
            cycloid_stage=stage,
            disc_material=disc,
            pin_material=pin,
            stiffness=self.stiffness.stiffness(disc, pin, stage),
            modification=self.modification.modification(),
            load=Load(**_in_si(self.load)),
            clearances=Clearances(**_in_si(self.clearances)),
            assumptions=self.assumptions,
        )


def load_reducer(name: str | Path) -> Reducer:
    """Return a reducer by preset name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    return validated(ReducerRecord, read_toml(path), path).reducer()


def load_identified_stiffness(name: str | Path) -> IdentifiedStiffness:
    """Return identified stiffnesses by shipped name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".stiffness.toml", "stiffness")
    return _identified(read_toml(path), path)


def _identified(data: dict[str, Any], path: Path) -> IdentifiedStiffness:
    """Return the identified stiffnesses of a file's content."""
    record = validated(IdentifiedStiffnessRecord, data, path)
    for field in record.stiffness:
        if field not in IDENTIFIABLE:
            raise InputError.at(path, "stiffness", field, "one of " + ", ".join(IDENTIFIABLE))
    rows = np.eye(len(record.stiffness)).tolist() if record.correlation is None else record.correlation
    return IdentifiedStiffness(
        source=record.source,
        values={field: item.value for field, item in record.stiffness.items()},
        standard_uncertainty={field: item.standard_uncertainty for field, item in record.stiffness.items()},
        correlation=checked_correlation(rows, tuple(record.stiffness), path),
        notes=record.notes,
    )


def write_identified_stiffness(identified: IdentifiedStiffness, path: Path) -> None:
    """Write a file that `load_identified_stiffness` reads back equal.

    Raises
    ------
    InputError
        The file is there already or cannot be made, or a value could not be read back.
    """
    lines = [f"source = {as_toml(identified.source)}", "notes = ["]
    lines += [f"  {as_toml(note)}," for note in identified.notes]
    lines += ["]", "correlation = ["]
    lines += [f"  {row}," for row in identified.correlation.tolist()]
    lines += ["]"]
    for field, value in identified.values.items():
        uncertainty = identified.standard_uncertainty[field]
        lines += ["", f"[stiffness.{field}]", f"value = {as_toml(value)}"]
        lines += [f"standard_uncertainty = {as_toml(uncertainty)}"]
    text = "\n".join(lines) + "\n"
    _identified(tomllib.loads(text), path)
    write_new(path, text)


def with_stiffness(reducer: Reducer, identified: IdentifiedStiffness) -> Reducer:
    """Return the reducer with the identified stiffnesses in place of its own."""
    values: dict[str, Any] = dict(identified.values)
    return replace(reducer, stiffness=replace(reducer.stiffness, **values))
