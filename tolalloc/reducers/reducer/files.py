"""Reducers and identified stiffnesses as TOML files: presets by name and the user's own."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import read_text
from tolalloc.reading.files import Record, as_toml, read_toml, shipped_or_path, validated, write_new
from tolalloc.reading.units import MICROMETRE, MICRORADIAN
from tolalloc.reducers.families.records import SHIPPED, records
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.form import PartForm, load_designed
from tolalloc.reducers.reducer.housing import GIVES, RING
from tolalloc.reducers.reducer.records import AnyReducerRecord, NewtonPerMetre, ReducerRecord
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness, Stiffness, checked_correlation

PRESETS = Path(__file__).parent / "presets"
_MODIFICATION = re.compile(r"^\[modification\].*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)


class IdentifiedValue(Record):
    """One stiffness and its standard uncertainty."""

    value: NewtonPerMetre
    standard_uncertainty: Annotated[float, Field(ge=0)]

    @model_validator(mode="after")
    def _is_known(self) -> IdentifiedValue:
        # It is read as that of ln K; bounds with a factor of a hundred between them leave 1.3 of the value.
        if self.standard_uncertainty > 2 * self.value:
            raise ValueError(
                f"standard_uncertainty is {self.standard_uncertainty:g} N/m; allowed is twice the value, "
                f"{2 * self.value:g} N/m, or less"
            )
        return self


class IdentifiedStiffnessRecord(Record):
    """A file of identified stiffnesses; ``correlation`` is in the order in which they are listed."""

    source: str
    stiffness: dict[str, IdentifiedValue]
    correlation: tuple[tuple[float, ...], ...] | None = None
    notes: tuple[str, ...] = ()


IDENTIFIABLE = tuple(
    name
    for name in dict.fromkeys(
        (*(name for own in SHIPPED for name in own.stiffness_fields()), *(RING + own for own in GIVES))
    )
    if name in Stiffness.__dataclass_fields__ and name != "pin_contact_law"
)
"""Fields of `tolalloc.reducers.reducer.stiffness.Stiffness` that a file of identified stiffnesses may hold."""


def load_reducer(name: str | Path) -> Reducer:
    """Return a reducer by preset name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    content = read_toml(path)
    record = validated(_record_of(content), content, path)
    reducer = record.reducer()
    if not record.modification.profile:
        return reducer
    profile = path.parent / record.modification.profile
    said = f"the flanks stand out of the profile of the amounts as {profile.name} states"
    return replace(reducer, form=PartForm(designed=load_designed(profile)), assumptions=(*reducer.assumptions, said))


def _record_of(content: Mapping[str, Any]) -> type[AnyReducerRecord]:
    """Return what a file must hold: that of the last family whose table is in it, of an RV reducer if there is none."""
    return next((own for own in reversed(records()) if own.table in content), ReducerRecord)


def write_modified(name: str | Path, modification: Modification, path: Path) -> None:
    """Write a reducer's file again with another modification, everything else of it as it was.

    Raises
    ------
    InputError, UnknownNameError
        The new file is there already or cannot be made, or the old one has no table ``[modification]``.
    """
    source = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    profile = read_toml(source).get("modification", {}).get("profile", "")
    free = f"profile = {as_toml(str((source.parent / profile).resolve()))}\n" if profile else ""
    turned = f"rotation_urad = {as_toml(modification.rotation / MICRORADIAN)}\n" if modification.rotation else ""
    table = (
        "[modification] # pin radius + equidistant, pin circle radius + shift, at grinding\n"
        f"equidistant_um = {as_toml(modification.equidistant / MICROMETRE)}\n"
        f"shift_um = {as_toml(modification.shift / MICROMETRE)}\n"
        f"{turned}{free}"
        'convention = "plus"\n\n'
    )
    text, found = _MODIFICATION.subn(table, read_text(source, "a text file in TOML"))
    if found != 1:
        raise InputError(f"{source}: no table [modification] of its own; without it nothing can be put in its place.")
    content = tomllib.loads(text)
    validated(_record_of(content), content, path)
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
    rows = np.eye(len(record.stiffness)) if record.correlation is None else record.correlation
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
