"""Ways to make the features of a drawing: from a process cost table, from Python, or as the tolerance table knows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from tolalloc.allocation.cost.model import (
    ClosedForm,
    CostModel,
    Exponential,
    PowerExponential,
    Process,
    Reciprocal,
    ReciprocalPower,
)
from tolalloc.allocation.cost.points import Points, ShopPoints, Spline, Tabulated, best_fit, load_shop_points, points_of
from tolalloc.drawings.drawing import Costs
from tolalloc.drawings.fields import LARGEST_ZONE, SMALLEST_ZONE
from tolalloc.drawings.heads import split_header
from tolalloc.drawings.sources import Source, known_as, meant
from tolalloc.drawings.table_file import DATA, read_rows, read_text_table, stated_currency
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.file_content import is_file
from tolalloc.reading.files import Record, shipped_or_path
from tolalloc.reading.units import COST_UNITS, MICROMETRE, MILLIMETRE

Cost = Annotated[float, Field(ge=0, le=1e9)]
Zone = Annotated[float | None, Field(ge=SMALLEST_ZONE, le=LARGEST_ZONE)]
Positive = Annotated[float | None, Field(ge=1e-12, le=1e12)]

UNITS = {
    **dict.fromkeys(("scale", "min", "max"), "µm"),
    **dict.fromkeys(("fixed", "change", "inspection"), COST_UNITS),
    "factor": f"{COST_UNITS} µm^n",
    "exponent": "-",
}
"""Field → unit that its header may state."""


CostCurve = Literal[
    "reciprocal", "reciprocal power", "reciprocal squared", "exponential", "combined", "tabulated", "spline", "fitted"
]
"""How a cost falls with the zone."""

_NEEDS: Mapping[str, frozenset[str]] = {
    "reciprocal power": frozenset({"exponent"}),
    "exponential": frozenset({"scale"}),
    "combined": frozenset({"exponent", "scale"}),
    **dict.fromkeys(("tabulated", "spline", "fitted"), frozenset({"points"})),
}
"""Curve → columns that must be given."""


class ProcessCostRow(Record):
    """One row; the fields are the column headers without their unit, zones in micrometres."""

    sources: Annotated[str, Field(min_length=1)]
    process: Annotated[str, Field(min_length=1)]
    model: CostCurve
    fixed: Annotated[float | None, Field(ge=0, le=1e9)] = None
    factor: Positive = None
    exponent: Annotated[float | None, Field(ge=0.01, le=10)] = None
    scale: Positive = None
    points: str | None = None
    min: Zone = None
    max: Zone = None
    change: Cost = 0.0
    inspection: Cost = 0.0
    note: Annotated[str, Field(min_length=1)]

    @model_validator(mode="after")
    def _columns_fit_the_model(self) -> ProcessCostRow:
        columns = ("fixed", "factor", "exponent", "scale", "points")
        given = {name for name in columns if getattr(self, name) is not None}
        needs = _NEEDS.get(self.model, frozenset())
        if missing := sorted(needs - given):
            raise ValueError(f"model {self.model} needs {' and '.join(missing)}")
        if excess := sorted(given - (needs if "points" in needs else needs | {"fixed", "factor"})):
            raise ValueError(f"model {self.model} takes no {' and no '.join(excess)}")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min must not be above max: {self.min:g}, {self.max:g} µm")
        return self

    def cost(self, source: Source, points: Points | None, place: str) -> CostModel:
        """Return the cost with the inspection by the zone in micrometres.

        A row without factor, which is that of the tolerance table's process, gives the source its cost in that table at
        its zone; a fixed cost and an inspection above that are an InputError.
        """
        if points is not None:
            return self._through(points)
        fixed = (self.fixed or 0.0) + self.inspection
        if self.factor is not None:
            return self._closed_form(fixed, self.factor)
        falling = source.cost - fixed
        if falling <= 0:
            raise InputError.at(
                place,
                "fixed and inspection without a factor",
                fixed,
                f"less than {source.cost:g}, the cost of {source.name} in the tolerance table",
            )
        unit = self._closed_form(0.0, 1.0).value(np.asarray(source.zone / MICROMETRE))
        return self._closed_form(fixed, falling / float(unit))

    def _through(self, points: Points) -> CostModel:
        if self.model == "fitted":
            model = best_fit(points).model
            return replace(model, fixed=model.fixed + self.inspection)
        inspected = replace(points, costs=tuple(cost + self.inspection for cost in points.costs))
        return Tabulated(inspected) if self.model == "tabulated" else Spline(inspected)

    def _closed_form(self, fixed: float, factor: float) -> ClosedForm:
        if self.model == "reciprocal squared":
            return ReciprocalPower(fixed=fixed, factor=factor, exponent=2.0)
        if self.exponent and self.scale:
            return PowerExponential(fixed=fixed, factor=factor, exponent=self.exponent, scale=self.scale)
        if self.exponent:
            return ReciprocalPower(fixed=fixed, factor=factor, exponent=self.exponent)
        if self.scale:
            return Exponential(fixed=fixed, factor=factor, scale=self.scale)
        return Reciprocal(fixed=fixed, factor=factor)


ProcessesOfSources = Mapping[str, tuple[Process, ...]]
"""Source → ways to make it, zones in metres."""

PricedWay = tuple[str, float | int, float | int, float | int, float | int]
"""Name of a process, its A and B in A + B/t, and the smallest and largest t that it holds."""

PlacedRow = tuple[str, ProcessCostRow]
"""File and row, and what stands there."""


def today(source: Source) -> Process:
    """Return the one way to make a feature that the tolerance table knows: its cost falls as 1/zone.

    c(t) = cost·zone/t [cost units]: the reciprocal form of Chase & Greenwood 1988, Manuf. Rev. 1, 50–59.
    """
    return Process(
        name=source.process or "as today",
        cost=Reciprocal(factor=source.cost * source.zone),
        minimum=source.minimum,
        maximum=source.maximum,
    )


def priced(
    rows: Mapping[str, Iterable[PricedWay]], sources: Sequence[Source], tolerance: Literal["zone", "half zone"] = "zone"
) -> ProcessesOfSources:
    """Return the ways to make features from costs A + B/t, for a user's own model.

    The cost A + B/t, valid within the range of the process: Chase & Greenwood 1988, Manuf. Rev. 1, 50–59.

    A feature without a row keeps the one way of the tolerance table.

    Parameters
    ----------
    rows
        Source → name of a process, A [cost units], B [cost units × mm], and smallest and largest t that it holds [mm].
    tolerance
        Whether t is the whole zone, or half of it as in ± t.

    """
    unit = MILLIMETRE * {"zone": 1.0, "half zone": 2.0}[tolerance]
    free = {source.name: source for source in sources if source.zone > 0 and not source.locked}
    found: dict[str, tuple[Process, ...]] = {name: (today(source),) for name, source in free.items()}
    for name, own in rows.items():
        if name not in free:
            raise UnknownNameError.among("process costs", "source with a free zone", name, free)
        made, source = [*own], free[name]
        if len({row[0] for row in made}) < len(made):
            raise InputError.at(f"process costs of {name}", "processes", [row[0] for row in made], "each name once")
        ranges = [(max(source.minimum, low * unit), min(source.maximum, high * unit)) for *_, low, high in made]
        found[name] = tuple(
            Process(
                name=way, cost=Reciprocal(fixed=float(fixed), factor=factor * unit), minimum=minimum, maximum=maximum
            )
            for (way, fixed, factor, *_), (minimum, maximum) in zip(made, ranges, strict=True)
            if minimum <= maximum
        )
        if not found[name]:
            raise _none_holds(f"process costs of {name}", source)
    return found


def load_process_costs(name: str | Path, sources: Sequence[Source]) -> ProcessesOfSources:
    """Return the ways to make every feature whose zone may change, from a process cost table.

    A feature without a row keeps the one way of the tolerance table.

    Parameters
    ----------
    name
        Shipped name, or path of the user's CSV file; files of points stand beside it.
    """
    path = shipped_or_path(name, DATA, ".process_costs.csv", "process cost table")
    rows = read_rows(path, ProcessCostRow, "sources", UNITS)
    faults = Faults()
    for place, row in rows:
        with faults.kept():
            if not meant(row.sources, sources):
                raise UnknownNameError.among(place, "source", row.sources, known_as(sources))
            if row.points and not is_file(path.parent / row.points):
                folder = path.absolute().parent
                raise InputError(f"{place}: points {row.points}: no such file; allowed is a CSV file in {folder}.")
    faults.require_none()
    shops = {row.points: load_shop_points(path.parent / row.points) for _, row in rows if row.points}
    found = {}
    for source in sources:
        if source.zone > 0 and not source.locked:
            own = [(place, row) for place, row in rows if meant(row.sources, (source,))]
            found[source.name] = _processes(source, own, shops, path) if own else (today(source),)
    return found


def currency_of_costs(costs: Costs) -> str:
    """Return the currency that a process cost table states in its headers, empty where it states none."""
    if isinstance(costs, Mapping) or not costs:
        return ""
    path = shipped_or_path(costs, DATA, ".process_costs.csv", "process cost table")
    return stated_currency(path, [split_header(header) for header in read_text_table(path).headers], UNITS)


def _processes(
    source: Source, rows: Sequence[PlacedRow], shops: Mapping[str, ShopPoints], path: Path
) -> tuple[Process, ...]:
    """Return what remains of the rows of a source between its smallest and its largest zone."""
    names: list[str] = []
    for place, row in rows:
        if row.process in names:
            raise InputError(
                f"{place}: process is {row.process!r} for {source.name} for the second time; each has one row."
            )
        names.append(row.process)
    if source.process and source.process not in names:
        raise UnknownNameError.among(path, f"process of {source.name} in the tolerance table,", source.process, names)
    now = source.process or names[0]
    for place, row in rows:
        if not (row.factor or row.points or row.process == now):
            raise InputError(
                f"{place}: factor is missing: the tolerance table's cost of {source.name} belongs to {now!r}."
            )
    processes = [_process(source, place, row, shops, 0.0 if row.process == now else row.change) for place, row in rows]
    left = tuple(process for process in processes if process is not None)
    if not left:
        raise _none_holds(path, source)
    return left


def _none_holds(place: str | Path, source: Source) -> InputError:
    return InputError(
        f"{place}: no process can hold a zone of {source.minimum / MICROMETRE:g} to "
        f"{source.maximum / MICROMETRE:g} µm for {source.name}; allowed are rows whose min and max reach into it."
    )


def _process(
    source: Source, place: str, row: ProcessCostRow, shops: Mapping[str, ShopPoints], change: float
) -> Process | None:
    """Return the process of a row, or None where it holds no zone that the source may have."""
    points = points_of(shops[row.points], row.process, source.feature, place) if row.points else None
    lowest, highest = (points.zones[0], points.zones[-1]) if points else (0.0, np.inf)  # nothing is known beyond them
    minimum = max(source.minimum, lowest * MICROMETRE, (row.min or 0.0) * MICROMETRE)
    maximum = min(source.maximum, highest * MICROMETRE, (row.max or np.inf) * MICROMETRE)
    if minimum > maximum:
        return None
    return Process(
        name=row.process,
        cost=row.cost(source, points, place).rescaled(1 / MICROMETRE),
        minimum=minimum,
        maximum=maximum,
        change=change,
    )
