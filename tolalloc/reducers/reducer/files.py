"""Reducers and identified stiffnesses as TOML files: presets by name and the user's own."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import read_text
from tolalloc.reading.files import Record, as_toml, read_toml, shipped_or_path, times, validated, write_new
from tolalloc.reading.units import ARCMINUTE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.design import (
    Catalogue,
    Clearances,
    CycloidStage,
    FirstStage,
    Load,
    Modification,
    Reducer,
)
from tolalloc.reducers.reducer.friction import Friction
from tolalloc.reducers.reducer.rolling_bearing import RollingBearing
from tolalloc.reducers.reducer.series import at_torque
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness, Material, checked_correlation
from tolalloc.reducers.reducer.stiffness_records import IDENTIFIABLE, IdentifiedStiffnessRecord, StiffnessRecord

_SMALLEST_TWIST, _LARGEST_TWIST = 0.3, 30.0
"""Twist under rated torque that a catalogue's rigidity may mean; RV reducers have 2.9 to 4 [arcmin]."""

PRESETS = Path(__file__).parent / "presets"


def _with_spacing(table: Any) -> Any:
    """Return table ``[cycloid_stage]`` with discs that stand side by side unless it says otherwise."""
    if not isinstance(table, dict) or "face_width_mm" not in table:
        return table
    return {"disc_spacing_mm": table["face_width_mm"], **table}


def _is_a_cycloid(stage: CycloidStage) -> CycloidStage:
    if stage.disc_teeth != stage.pin_count - 1:
        raise ValueError(f"disc_teeth must be pin_count − 1 = {stage.pin_count - 1} (one-tooth difference)")
    if not stage.shortening < 1:
        raise ValueError(f"K1 = eccentricity·pin_count/pin_circle_radius must be below 1 and is {stage.shortening:.3g}")
    half_pitch, convex = stage.pin_circle_radius * pi / stage.pin_count, stage.smallest_convex_radius
    for largest, what in ((half_pitch, "neighbouring pins overlap"), (convex, "pins undercut the teeth")):
        if stage.pin_radius >= largest:
            raise ValueError(f"pin_radius_mm must be below {largest / MILLIMETRE:.3g}, where {what}")
    return stage


Micrometres = Annotated[float, Field(ge=-200, le=200), times(MICROMETRE)]


class ModificationRecord(Record):
    """Table ``[modification]``; the convention says whether the shift was written Rp + Δr_p or Rp − Δr_p."""

    equidistant_um: Micrometres
    shift_um: Micrometres
    convention: Literal["plus", "minus"] = "plus"


class ReducerRecord(Record):
    """A whole reducer file."""

    name: str
    source: str
    crank_count: Annotated[int, Field(ge=2, le=6)]
    disc_count: Annotated[int, Field(ge=1, le=3)]
    first_stage: FirstStage
    cycloid_stage: Annotated[CycloidStage, BeforeValidator(_with_spacing), AfterValidator(_is_a_cycloid)]
    material: Material
    pin_material: Material | None = None
    stiffness: StiffnessRecord
    modification: ModificationRecord
    load: Load
    clearances: Clearances = Clearances()
    friction: Friction = Friction()
    catalogue: Catalogue | None = None
    assumptions: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _holds_together(self) -> ReducerRecord:
        self.reducer()
        if self.catalogue:
            rated, stated = self.load.rated_torque, self.catalogue.torsional_rigidity * ARCMINUTE
            least, most = rated / _LARGEST_TWIST, rated / _SMALLEST_TWIST
            if not least <= stated <= most:
                raise ValueError(
                    f"catalogue.torsional_rigidity_nm_per_arcmin is {stated:g}; allowed is {least:.3g} to {most:.3g}, "
                    f"a twist of {_SMALLEST_TWIST:g} to {_LARGEST_TWIST:g} arcmin under the rated {rated:g} N·m"
                )
        return self

    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""
        disc, grinding = self.material, self.modification
        pin = self.pin_material or disc
        reducer = Reducer(
            name=self.name,
            source=self.source,
            crank_count=self.crank_count,
            disc_count=self.disc_count,
            first_stage=self.first_stage,
            cycloid_stage=self.cycloid_stage,
            disc_material=disc,
            pin_material=pin,
            stiffness=self.stiffness.stiffness(disc, pin, self.first_stage, self.cycloid_stage),
            modification=Modification.from_convention(
                grinding.convention, equidistant=grinding.equidistant_um, shift=grinding.shift_um
            ),
            load=self.load,
            clearances=self.clearances,
            friction=self.friction,
            friction_dimensions=self.stiffness.friction_dimensions,
            catalogue=self.catalogue,
            assumptions=self.assumptions,
        )
        reducer = replace(reducer, parts=self.stiffness.parts(reducer), clearances=self._clearances())
        return at_torque(reducer, reducer.load.rated_torque)

    def _clearances(self) -> Clearances:
        """Return the clearances, those of bearings that are given by their dimensions included."""
        own: dict[str, float] = {}
        for name in vars(self.clearances):
            bearing = getattr(self.stiffness, name)
            if isinstance(bearing, RollingBearing) and bearing.play:
                if getattr(self.clearances, name):
                    raise ValueError(f"clearances.{name}_um is given twice: the bearing in [stiffness] has one too")
                own[name] = bearing.play
        return replace(self.clearances, **own)


def load_reducer(name: str | Path) -> Reducer:
    """Return a reducer by preset name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    return validated(ReducerRecord, read_toml(path), path).reducer()


_MODIFICATION = re.compile(r"^\[modification\].*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)


def write_modified(name: str | Path, modification: Modification, path: Path) -> None:
    """Write a reducer's file again with another modification, everything else of it as it was.

    Raises
    ------
    InputError, UnknownNameError
        The new file is there already or cannot be made, or the old one has no table ``[modification]``.
    """
    source = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    table = (
        "[modification] # pin radius + equidistant, pin circle radius + shift, at grinding\n"
        f"equidistant_um = {as_toml(modification.equidistant / MICROMETRE)}\n"
        f"shift_um = {as_toml(modification.shift / MICROMETRE)}\n"
        'convention = "plus"\n\n'
    )
    text, found = _MODIFICATION.subn(table, read_text(source, "a text file in TOML"))
    if found != 1:
        raise InputError(f"{source}: no table [modification] of its own; without it nothing can be put in its place.")
    validated(ReducerRecord, tomllib.loads(text), path)
    write_new(path, text)


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
    others = tuple(part for part in reducer.parts if part.interface not in values)
    return replace(reducer, stiffness=replace(reducer.stiffness, **values), parts=others)
