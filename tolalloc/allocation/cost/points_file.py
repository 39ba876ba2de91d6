"""Shop data: what a shop asks for features at some tolerances, one row per price."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from tolalloc.allocation.cost.points import Points
from tolalloc.drawing.fields import LARGEST_ZONE, UNITS
from tolalloc.drawing.table_file import TableRow, read_rows
from tolalloc.drawing.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError


class LengthUnit(StrEnum):
    """Unit of a tolerance."""

    MICROMETRE = "µm"
    MICROMETRE_TYPED = "um"
    MILLIMETRE = "mm"


class ShopPrice(TableRow):
    """One row; the fields are the column headers without their unit."""

    units: ClassVar[Mapping[str, str]] = {"cost": "cost units"}

    process: Annotated[str, Field(min_length=1)]
    feature: Feature | None = None
    tolerance: Annotated[float, Field(gt=0)]
    unit: LengthUnit
    cost: Annotated[float, Field(gt=0, le=1e9)]
    note: str = ""


ShopPoints = Mapping[tuple[str, Feature | None], Points]
"""Process and feature, or None for every feature → points in micrometres."""


def load_shop_points(path: Path) -> ShopPoints:
    """Return the points of a CSV file with the columns process, tolerance [unit], unit and cost [cost units].

    A column ``feature`` may say for which kind of callout a price is; without it the price is for every kind.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed, or a process with less than two tolerances.
    """
    prices: dict[tuple[str, Feature | None], list[tuple[float, float]]] = {}
    for place, row in read_rows(path, ShopPrice, "process"):
        zone = row.tolerance * UNITS[row.unit]
        if zone > LARGEST_ZONE:
            raise InputError.at(place, "tolerance", f"{row.tolerance:g} {row.unit}", f"{LARGEST_ZONE:g} µm or less")
        prices.setdefault((row.process, row.feature), []).append((zone, row.cost))
    found = {}
    for (process, feature), pairs in prices.items():
        zones, costs = zip(*pairs, strict=True)
        found[process, feature] = Points.sorted(zones, costs, f"{path} ({process}, zones in µm)")
    return found


def points_of(points: ShopPoints, process: str, feature: Feature, place: str) -> Points:
    """Return the points of a process for a kind of callout [µm], those for every kind where it has none of its own.

    Raises
    ------
    UnknownNameError
        There are no points for them.
    """
    found = points.get((process, feature)) or points.get((process, None))
    if found is None:
        known = [name for name, kind in points if kind in (feature, None)]
        raise UnknownNameError.among(place, f"process for feature {feature}", process, known)
    return found
