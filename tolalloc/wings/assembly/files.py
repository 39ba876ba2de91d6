"""Files of an assembly and what may stand in them: its chain, how it is adjusted, and measured errors of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tolalloc.drawings.heads import split_header
from tolalloc.drawings.table_file import TextTable, believed_number, read_text_table
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.files import Record, read_toml, shipped_or_path, validated
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import ARCSECOND, DEGREE, MILLIMETRE
from tolalloc.reducers.reducer.files import PRESETS
from tolalloc.wings.assembly.chain import ChainPart, DatumFlowChain
from tolalloc.wings.assembly.plan import LARGEST_STATE_WEIGHT, AngularRequirements, AssemblyPlan
from tolalloc.wings.assembly.steps import AssemblyStep, Choice, Efforts, Positive, check_steps, steps_in_order

SMALLEST, LARGEST = 0.1, 3600.0
"""Smallest and largest tolerance and limit that is believed, and largest error; smaller ones are degrees [arcsec]."""
QUIETEST = 0.01
"""Smallest noise that is believed, unless there is none [arcsec]."""

DATA = Path(__file__).parent / "data"

HEADERS = ("part", "x [arcsec]", "y [arcsec]", "z [arcsec]")

IN_DEGREES = 0.05
"""Where no error reaches this, they were written in degrees [arcsec]."""


def _three(values: object) -> object:
    if not (isinstance(values, list) and len(values) == 3 and all(map(is_number, values))):
        raise ValueError("allowed are three numbers, for x, y and z")
    return values


def _believed(value: float) -> float:
    if 0 < value < SMALLEST:
        raise ValueError(f"is that in degrees? allowed are arcseconds from {SMALLEST:g} to {LARGEST:g}")
    if not 0 < value <= LARGEST:
        raise ValueError(f"allowed are arcseconds from {SMALLEST:g} to {LARGEST:g}")
    return value


def _each_believed(values: tuple[float, float, float]) -> tuple[float, float, float]:
    for axis, value in zip("xyz", values, strict=True):
        try:
            _believed(value or SMALLEST)  # 0 is a part without that error
        except ValueError as error:
            raise ValueError(f"about {axis}: {error}") from None
    return values


def _noise(value: float) -> float:
    if value and not QUIETEST <= value <= LARGEST:
        question = "is that in degrees? " if 0 < value < QUIETEST else ""
        raise ValueError(f"{question}allowed are 0 and arcseconds from {QUIETEST:g} to {LARGEST:g}")
    return value


def _name(text: str) -> str:
    if not text or text != text.strip() or " - " in text:
        raise ValueError("allowed is a name without spaces at its ends and without ' - ', which parts two names")
    return text


Name = Annotated[str, AfterValidator(_name)]
Angle = Annotated[float, AfterValidator(_believed)]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Millimetres = Annotated[float, Field(ge=-10000, le=10000)]
Weight = Annotated[float, Field(ge=0, le=1e9)]
Noise = Annotated[float, AfterValidator(_noise)]
Three = BeforeValidator(_three)


class CostRecord(Record):
    """Cost of a part's three tolerances t: fixed + factor/t, or fixed + factor·exp(−t/scale)."""

    form: Literal["reciprocal", "exponential"]
    factor: Annotated[tuple[Positive, Positive, Positive], Three]
    fixed: Annotated[tuple[Weight, Weight, Weight], Three] = (0.0, 0.0, 0.0)
    scale_arcsec: Annotated[tuple[Angle, Angle, Angle], Three] | None = None

    @model_validator(mode="after")
    def _has_its_scale(self) -> CostRecord:
        if (self.form == "exponential") != (self.scale_arcsec is not None):
            raise ValueError(
                f"form is {self.form!r}; allowed is a scale_arcsec with the exponential form and none with the other"
            )
        return self


class PartRecord(Record):
    """One table ``[[part]]``."""

    name: Name
    on: Name
    turned_deg: Annotated[tuple[Degrees, Degrees, Degrees], Three] = (0.0, 0.0, 0.0)
    position_mm: Annotated[tuple[Millimetres, Millimetres, Millimetres], Three] = (0.0, 0.0, 0.0)
    tolerance_arcsec: Annotated[tuple[float, float, float], Three, AfterValidator(_each_believed)]
    weight: Weight = 1.0
    tilts: tuple[str, ...] = ()
    rotates: tuple[str, ...] = ()
    tilt_limit_arcsec: Angle | None = None
    rotation_limit_arcsec: Angle | None = None
    cost: CostRecord | None = None

    def part(self) -> ChainPart:
        """Return the part in SI units."""
        x, y, z = (DEGREE * own for own in self.turned_deg)
        across, up, along = (MILLIMETRE * own for own in self.position_mm)
        own = self.model_dump(include={"name", "on", "tilts", "rotates"})
        return ChainPart(**own, turned=(x, y, z), position=(across, up, along))


class NoiseRecord(Record):
    """Table ``[noise]``, standard deviations."""

    measurement_arcsec: Noise = 0.0
    adjustment_arcsec: Noise = 0.0


class TolerancesRecord(Record):
    """Table ``[tolerances]``."""

    smallest_arcsec: Angle
    largest_arcsec: Angle
    effort_price: Weight = 0.0

    @model_validator(mode="after")
    def _smaller_one_first(self) -> TolerancesRecord:
        if not self.smallest_arcsec < self.largest_arcsec:
            raise ValueError(
                f"smallest_arcsec is {self.smallest_arcsec:g}; allowed is below largest_arcsec = "
                f"{self.largest_arcsec:g}"
            )
        return self


class ChainRecord(Record):
    """A chain file; parts and steps are checked one by one, so that a sentence can name or number them."""

    name: str
    source: str
    assumptions: tuple[str, ...] = ()
    datum: Name
    reducer: str = ""
    precision: Annotated[float, Field(ge=0, le=LARGEST_STATE_WEIGHT)]
    adjust: Choice | None = None
    measure: Literal["current", "mounted"] | None = None
    effort: Efforts | None = None
    noise: NoiseRecord = NoiseRecord()
    part: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]
    step: tuple[dict[str, Any], ...] = ()
    tolerances: TolerancesRecord | None = None

    @model_validator(mode="after")
    def _steps_are_said_once(self) -> ChainRecord:
        for field in ("adjust", "measure", "effort"):
            if self.step and getattr(self, field) is not None:
                raise ValueError(f"{field} stands beside [[step]]; allowed is one of both, as every step says its own")
        return self


def load_plan(name: str | Path) -> AssemblyPlan:
    """Return an assembly by shipped name or from the user's TOML file; a reducer's file stands relative to it.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".chain.toml", "chain")
    record = validated(ChainRecord, read_toml(path), path)
    parts, faults = list[PartRecord](), Faults()
    for number, data in enumerate(record.part, start=1):
        with faults.kept():
            parts.append(validated(PartRecord, data, f"{path}, part {data.get('name', number)}"))
    faults.require_none()
    chain = _chain(record.datum, parts, path)
    return AssemblyPlan(
        name=record.name,
        source=record.source,
        chain=chain,
        steps=_steps(record, chain, path),
        tolerances=ARCSECOND * np.array([part.tolerance_arcsec for part in parts]),
        state_weight=record.precision,
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
    steps = []
    for number, data in enumerate(record.step, start=1):
        place = f"{path}, step {number}"
        steps.append(validated(AssemblyStep, data, place))
        for name in steps[-1].effort:
            if name not in steps[-1].adjust:
                raise InputError(f"{place}: effort names {name}; allowed are parts that the step adjusts.")
    check_steps(chain, steps, str(path))
    return tuple(steps)


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
    table, faults = read_text_table(path), Faults()
    columns = _columns(table)
    names, found = plan.chain.names, dict[str, list[float]]()
    for row, cells in zip(table.rows, table.cells, strict=True):
        name, place = cells[columns[0]], f"{path}, row {row}"
        with faults.kept():
            UnknownNameError.require(place, "part", name, names)
            if name in found:
                raise InputError.at(place, "part", name, "each part once, and this one stands further up too")
            where, allowed = f"{place} (part {name})", f"a number with a decimal point from {-LARGEST:g} to {LARGEST:g}"
            found[name] = [believed_number(where, table.headers[at], cells[at], LARGEST, allowed) for at in columns[1:]]
    faults.require_none()
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
    if sorted(name for name, _ in stated) != sorted(units):
        raise InputError.at(table.path, "the header", ", ".join(table.headers), ", ".join(HEADERS))
    for (name, unit), header in zip(stated, table.headers, strict=True):
        if unit != units[name]:
            allowed = f"{units[name]} in square brackets" if units[name] else "none"
            raise InputError.at(table.path, f"the unit of column {header!r}", unit, allowed)
    return [[name for name, _ in stated].index(name) for name in units]
