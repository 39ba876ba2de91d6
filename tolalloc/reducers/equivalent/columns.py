"""From the error columns, one number each, to the values that the condensed tables take.

Most columns are one value. A deviation along the ring of pins is a value at every pin, whichever column it comes from,
so that an angle needs two products per contact instead of one per column.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.equivalent.interfaces import flank_terms, pin_terms, tooth_columns, wave_columns
from tolalloc.reducers.equivalent.springs import SpringGroup, vector_columns
from tolalloc.reducers.reducer.design import Reducer


def source_name(column: str) -> str:
    """Return the source that a column belongs to: its name without component, order, pin or tooth."""
    return re.sub(r"(\.[xy]|\.(cos|sin)\d+|\.\d+)+$", "", column)


class Layout(NamedTuple):
    """First value of each block; the columns of the spring rows come first, one value each."""

    torque: int  # Torque on the carrier, behind the spring rows' columns [-]
    clearance: int  # Clearance of every element with play [-]
    flank: int  # δ·r_d, by which the flanks of all discs are turned towards the middles of their teeth [-]
    pin: int  # Radial, tangential and radius deviation of every pin [-]
    wave: int  # Of each disc: harmonic amplitudes of pitch, then run-out, then how often its form counts [-]
    tooth: int  # Pitch, then run-out of single teeth [-]
    tilt: int  # Tilt x, y [-]
    end: int  # Number of values [-]
    # Pins, waves and teeth of one disc [-]
    pins: int
    waves: int
    teeth: int


class ColumnMap(NamedTuple):
    """Values as a sparse linear map of the columns: value = nominal + Σ factor·column."""

    # One entry per pair of value and column that it depends on [-]
    value: Int[np.ndarray, " entry"]
    column: Int[np.ndarray, " entry"]
    factor: Float[np.ndarray, " entry"]
    nominal: Float[np.ndarray, " value"]  # Values of the perfect unit: nominal distances and clearances [m]


@dataclass(frozen=True, kw_only=True)
class Columns:
    """All error columns of a reducer, and where they act."""

    names: tuple[str, ...]  # Columns in the order of X
    layout: Layout  # Blocks of the values
    map: ColumnMap  # From columns to values
    # Field of `tolalloc.reducers.reducer.stiffness.Stiffness` → its bilateral rows, or its elements with play behind
    # them [-]
    rows_of_stiffness: dict[str, slice]
    stiffness: dict[str, float]  # The same → stiffness of each of its springs [N/m]

    @cached_property
    def matrix(self) -> Any:
        """The map as a sparse matrix, `scipy.sparse.csr_array` of [value, column]."""
        from scipy.sparse import csr_array

        shape = (self.layout.end, len(self.names))
        return csr_array((self.map.factor, (self.map.value, self.map.column)), shape=shape)


def columns_of(reducer: Reducer, groups: Sequence[SpringGroup], orders: tuple[int, ...]) -> Columns:
    """Return the columns that the spring rows and the pin contact of a reducer declare."""
    values = [name for group in groups for name in group.columns]
    constants = {name: value for group in groups for name, value in group.constants.items()}
    names: dict[str, int] = {name: at for at, name in enumerate(own for own in values if own not in constants)}
    entries = [(at, names[name], 1.0) for at, name in enumerate(values) if name in names]
    played = [group for group in groups if group.contact == "play"]
    discs, pins, teeth = reducer.disc_count, reducer.cycloid_stage.pin_count, reducer.cycloid_stage.disc_teeth
    form = int(reducer.form is not None)
    waves, torque = 4 * len(orders) + form, len(values)
    clearance = torque + 1
    flank = clearance + sum(len(group.clearance_columns) for group in played)
    pin = flank + 1
    wave = pin + 3 * pins
    tooth = wave + discs * waves
    tilt = tooth + discs * 2 * teeth
    layout = Layout(torque, clearance, flank, pin, wave, tooth, tilt, tilt + discs * 2, pins, waves, teeth)

    def add(first: int, terms: Mapping[str, Sequence[tuple[int, float]]]) -> None:
        for name, moved in terms.items():
            column = names.setdefault(name, len(names))
            entries.extend((first + entry, column, factor) for entry, factor in moved)

    def add_each(first: int, own: Sequence[str]) -> None:
        add(first, {name: [(at, 1.0)] for at, name in enumerate(own)})

    add(pin, pin_terms(reducer, orders))
    add(flank, flank_terms(reducer))
    for disc in range(discs):
        add_each(wave + disc * waves, wave_columns(disc, orders))
        add_each(tooth + disc * 2 * teeth, tooth_columns(reducer, disc))
        if LAWS[reducer.stiffness.pin_contact_law] == LINEAR:
            add_each(tilt + disc * 2, vector_columns(f"disc{disc + 1}.tilt"))  # turns with the disc [rad]
    nominal, element = np.zeros(layout.end), clearance
    nominal[:torque] = [constants.get(name, 0.0) for name in values]
    if form:
        nominal[wave + waves - 1 : tooth : waves] = 1.0  # once on every disc, whatever the errors are
    for group in played:
        add_each(element, group.clearance_columns)
        add(element, group.clearance_terms)
        nominal[element : element + len(group.clearance_columns)] = group.clearance
        element += len(group.clearance_columns)
    value, column, factor = zip(*entries, strict=True)
    mapped = ColumnMap(np.array(value), np.array(column), np.array(factor), nominal)
    rows, row = {}, 0
    for group in sorted(groups, key=lambda group: group.contact == "play"):
        count = len(group.clearance_columns) or group.stiffness.shape[1]
        rows[group.stiffness_name] = slice(row, row + count)
        row += count
    stiffness = {group.stiffness_name: float(group.stiffness[0, 0]) for group in groups}
    return Columns(names=tuple(names), layout=layout, map=mapped, rows_of_stiffness=rows, stiffness=stiffness)
