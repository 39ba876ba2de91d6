"""Files of an assembly: its chain, how it is adjusted, and measured errors of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.chain import DatumFlowChain
from tolalloc.assembly.chain_records import LARGEST, AssemblyStepRecord, ChainRecord, CostRecord, PartRecord
from tolalloc.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.assembly.steps import AssemblyStep, Efforts, check_steps, steps_in_order
from tolalloc.drawings.table_file import TextTable, read_text_table, split_header
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import read_toml, shipped_or_path, validated
from tolalloc.rv.reducer.files import PRESETS
from tolalloc.units import ARCSECOND

DATA = Path(__file__).parent / "data"
HEADERS = ("part", "x [arcsec]", "y [arcsec]", "z [arcsec]")
IN_DEGREES = 0.05
"""Where no error reaches this, they were written in degrees [arcsec]."""


def load_plan(name: str | Path) -> AssemblyPlan:
    """Return an assembly by shipped name or from the user's TOML file; a reducer's file stands relative to it.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".chain.toml", "chain")
    record = validated(ChainRecord, read_toml(path), path)
    parts = [
        validated(PartRecord, data, f"{path}, part {data.get('name', number)}")
        for number, data in enumerate(record.part, start=1)
    ]
    chain = _chain(record.datum, parts, path)
    return AssemblyPlan(
        name=record.name,
        source=record.source,
        chain=chain,
        steps=_steps(record, chain, path),
        tolerances=ARCSECOND * np.array([part.tolerance_arcsec for part in parts]),
        precision=record.precision,
        weights=np.array([part.weight for part in parts]),
        measurement_noise=record.noise.measurement_arcsec * ARCSECOND,
        adjustment_noise=record.noise.adjustment_arcsec * ARCSECOND,
        requirements=_requirements(record, parts, path),
        reducer=_reducer(record.reducer, path),
        assumptions=record.assumptions,
    )


def _chain(datum: str, parts: Sequence[PartRecord], path: Path) -> DatumFlowChain:
    """Return the parts as a chain, or say in which file they are none."""
    try:
        return DatumFlowChain(datum=datum, parts=tuple(part.part() for part in parts))
    except (InputError, UnknownNameError) as error:
        raise type(error)(f"{path}, {error}") from None


def _steps(record: ChainRecord, chain: DatumFlowChain, path: Path) -> tuple[AssemblyStep, ...]:
    """Return the steps as listed, or one per part."""
    if not record.step:
        efforts = record.effort or Efforts()
        return steps_in_order(chain, record.adjust or "mounted", record.measure or "current", efforts)
    steps = tuple(
        validated(AssemblyStepRecord, data, f"{path}, step {number}").step()
        for number, data in enumerate(record.step, start=1)
    )
    check_steps(chain, steps, str(path))
    return steps


def _requirements(record: ChainRecord, parts: Sequence[PartRecord], path: Path) -> AngularRequirements | None:
    """Return limits and costs, if any part has a cost."""
    costs = _costs(parts, path)
    if not costs:
        limits = ("tilt_limit_arcsec", "rotation_limit_arcsec")
        stated = [field for part in parts for field in limits if getattr(part, field) is not None]
        stated += ["tolerances"] if record.tolerances else []
        if stated:
            raise InputError(
                f"{path}: {stated[0]} is stated but no part has a cost; allowed is with a cost of every part."
            )
        return None
    if record.tolerances is None:
        raise InputError(f"{path}: tolerances is missing; parts with a cost need smallest_arcsec and largest_arcsec.")
    form = costs[0].form
    unit = {"reciprocal": ARCSECOND, "exponential": 1.0}[form]
    return AngularRequirements(
        tilt_limit=ARCSECOND * np.array([part.tilt_limit_arcsec or inf for part in parts]),
        rotation_limit=ARCSECOND * np.array([part.rotation_limit_arcsec or inf for part in parts]),
        smallest=record.tolerances.smallest_arcsec * ARCSECOND,
        largest=record.tolerances.largest_arcsec * ARCSECOND,
        form=form,
        factor=unit * np.array([cost.factor for cost in costs]),
        fixed=np.array([cost.fixed for cost in costs]),
        scale=ARCSECOND * np.array([cost.scale_arcsec or (inf, inf, inf) for cost in costs]),
        effort_price=record.tolerances.effort_price / ARCSECOND**2,
    )


def _costs(parts: Sequence[PartRecord], path: Path) -> list[CostRecord]:
    """Return the cost of every part, all of one form, or none at all."""
    costs = [part.cost for part in parts if part.cost is not None]
    for part in parts:
        if costs and part.cost is None:
            raise InputError(f"{path}, part {part.name}: cost is missing; allowed is a cost of every part or of none.")
        if part.cost is not None and part.cost.form != costs[0].form:
            allowed = f"{costs[0].form!r}, the same of every part"
            raise InputError.at(f"{path}, part {part.name}", "cost.form", part.cost.form, allowed)
    return costs


def _reducer(name: str, path: Path) -> str:
    """Return a preset's name, or a file's path seen from the chain file; empty if there is none."""
    if not name:
        return ""
    found = path.parent / name if Path(name).suffix else name
    shipped_or_path(found, PRESETS, ".reducer.toml", "reducer")
    return str(found)


def load_errors(path: Path, plan: AssemblyPlan) -> Float[np.ndarray, "part 3"]:
    """Return measured errors of the parts in their own axes, in the order of the chain [rad].

    The columns ``part``, ``x [arcsec]``, ``y [arcsec]``, ``z [arcsec]`` and one row per part stand in any order; lines
    that start with # are comments.

    Raises
    ------
    InputError
        A column, unit or number that is not allowed, or a part that has no row or two.
    UnknownNameError
        A part that the chain does not have.
    """
    table = read_text_table(path)
    columns = _columns(table)
    names, found = plan.chain.names, dict[str, list[float]]()
    for row, cells in zip(table.rows, table.cells, strict=True):
        name, place = cells[columns[0]], f"{path}, row {row}"
        if name not in names:
            raise UnknownNameError.among(place, "part", name, names)
        if name in found:
            raise InputError.at(place, "part", name, "each part once, and this one stands further up too")
        found[name] = [_arcseconds(cells[at], table.headers[at], f"{place} (part {name})") for at in columns[1:]]
    for name in names:
        if name not in found:
            raise InputError(f"{path}: part {name} is missing; allowed is one row for each of {', '.join(names)}.")
    errors = np.array([found[name] for name in names])
    largest = float(np.abs(errors).max())
    if 0 < largest < IN_DEGREES:
        raise InputError(
            f"{path}: the largest error is {largest:g} arcsec; are these degrees? allowed are arcseconds, some of "
            f"{IN_DEGREES:g} or more."
        )
    return errors * ARCSECOND


def _columns(table: TextTable) -> list[int]:
    """Return where part, x, y and z stand."""
    units = dict(map(split_header, HEADERS))
    stated = [split_header(header.lower()) for header in table.headers]
    # Programs that close every row with a separator leave an empty header behind the last.
    if sorted(name for name, _ in stated if name) != sorted(units):
        raise InputError.at(table.path, "the header", ", ".join(table.headers), ", ".join(HEADERS))
    for (name, unit), header in zip(stated, table.headers, strict=True):
        if name and unit != units[name]:
            allowed = f"{units[name]} in square brackets" if units[name] else "none"
            raise InputError.at(table.path, f"the unit of column {header!r}", unit, allowed)
    return [[name for name, _ in stated].index(name) for name in units]


def _arcseconds(cell: str, header: str, place: str) -> float:
    """Return the number in a cell."""
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not (isfinite(value) and abs(value) <= LARGEST):
        allowed = f"a number with a decimal point from {-LARGEST:g} to {LARGEST:g}"
        raise InputError.at(place, header, cell, allowed)
    return value
