"""One row of a process cost table: what makes sense together, and the cost model that it becomes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from tolalloc.allocation.cost.closed_forms import (
    ClosedForm,
    Combined,
    Exponential,
    Reciprocal,
    ReciprocalPower,
    reciprocal_squared,
)
from tolalloc.allocation.cost.fit import best_fit
from tolalloc.allocation.cost.model import CostModel
from tolalloc.allocation.cost.points import Points
from tolalloc.allocation.cost.sampled import Spline, Tabulated
from tolalloc.drawing.fields import LARGEST_ZONE
from tolalloc.drawing.sources import Source
from tolalloc.drawing.table_file import TableRow
from tolalloc.exceptions import InputError
from tolalloc.units import MICROMETRE

Cost = Annotated[float, Field(ge=0, le=1e9)]
Zone = Annotated[float | None, Field(gt=0, le=LARGEST_ZONE)]
Positive = Annotated[float | None, Field(gt=0, le=1e12)]


class CostCurve(StrEnum):
    """How a cost falls with the zone."""

    RECIPROCAL = "reciprocal"
    RECIPROCAL_POWER = "reciprocal power"
    RECIPROCAL_SQUARED = "reciprocal squared"
    EXPONENTIAL = "exponential"
    COMBINED = "combined"
    TABULATED = "tabulated"
    SPLINE = "spline"
    FITTED = "fitted"

    @property
    def is_through_points(self) -> bool:
        """Whether it is made from shop data."""
        return self in (CostCurve.TABULATED, CostCurve.SPLINE, CostCurve.FITTED)

    @property
    def needs(self) -> frozenset[str]:
        """Columns that must be given."""
        if self.is_through_points:
            return frozenset({"points"})
        needed = {
            CostCurve.RECIPROCAL_POWER: {"exponent"},
            CostCurve.EXPONENTIAL: {"scale"},
            CostCurve.COMBINED: {"exponent", "scale"},
        }
        return frozenset(needed.get(self, ()))

    @property
    def takes(self) -> frozenset[str]:
        """Columns that may be given."""
        return self.needs if self.is_through_points else self.needs | {"fixed", "factor"}


class ProcessCostRow(TableRow):
    """One row; the fields are the column headers without their unit, zones in micrometres."""

    units: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("scale", "min", "max"), "µm"),
        **dict.fromkeys(("fixed", "change", "inspection"), "cost units"),
    }

    sources: Annotated[str, Field(min_length=1)]
    process: Annotated[str, Field(min_length=1)]
    model: CostCurve
    fixed: Annotated[float | None, Field(ge=0, le=1e9)] = None
    factor: Positive = None
    exponent: Annotated[float | None, Field(gt=0, le=10)] = None
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
        if missing := sorted(self.model.needs - given):
            raise ValueError(f"model {self.model.value} needs {' and '.join(missing)}")
        if excess := sorted(given - self.model.takes):
            raise ValueError(f"model {self.model.value} takes no {' and no '.join(excess)}")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min must not be above max: {self.min:g}, {self.max:g} µm")
        return self

    def cost(self, source: Source, points: Points | None, place: str) -> CostModel:
        """Return the cost with the inspection by the zone in micrometres.

        Parameters
        ----------
        source
            The feature; a row without factor, which is that of the tolerance table's process, gives it the cost of that
            table at its zone.
        points
            Points of the row's process, where the model is made from them [µm].
        place
            File and row, for messages.

        Raises
        ------
        InputError
            The fixed cost and the inspection are more than the cost of the tolerance table, or points rise.
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
        if self.model is CostCurve.FITTED:
            model = best_fit(points).model
            return replace(model, fixed=model.fixed + self.inspection)
        inspected = replace(points, costs=tuple(cost + self.inspection for cost in points.costs))
        return Tabulated(inspected) if self.model is CostCurve.TABULATED else Spline(inspected)

    def _closed_form(self, fixed: float, factor: float) -> ClosedForm:
        if self.model is CostCurve.RECIPROCAL_SQUARED:
            return reciprocal_squared(fixed=fixed, factor=factor)
        if self.exponent and self.scale:
            return Combined(fixed=fixed, factor=factor, exponent=self.exponent, scale=self.scale)
        if self.exponent:
            return ReciprocalPower(fixed=fixed, factor=factor, exponent=self.exponent)
        if self.scale:
            return Exponential(fixed=fixed, factor=factor, scale=self.scale)
        return Reciprocal(fixed=fixed, factor=factor)
