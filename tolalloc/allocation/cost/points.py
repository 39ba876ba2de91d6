"""Points of a cost curve: what a shop asks for features at some tolerances, and the file with one row per price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from tolalloc.drawings.fields import LARGEST_ZONE, SMALLEST_COST, SMALLEST_ZONE, UNITS
from tolalloc.drawings.table_file import read_rows, read_text_table, split_header, stated_currency
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import Record
from tolalloc.reading.units import COST_UNITS

MOST_POINTS = 200
"""Most prices of one process; a fit leaves out each of them in turn, and a workbook's formula names all [-]."""


@dataclass(frozen=True, kw_only=True)
class Points:
    """Zones and what they cost, the smallest zone first.

    Raises
    ------
    InputError
        Fewer than two zones, not in order, or a number that is not above 0.
    """

    zones: tuple[float, ...]  # Zones, ascending; equal ones are the same zone priced more than once [unit of the zone]
    costs: tuple[float, ...]  # Their costs [cost units]
    place: str = "cost points"  # Where the points stand, for messages

    def __post_init__(self) -> None:
        if len(self.zones) != len(self.costs) or len(set(self.zones)) < 2:
            raise InputError.at(
                self.place, "zones and costs", (self.zones, self.costs), "two zones or more, each with its cost"
            )
        for name in ("zones", "costs"):
            wrong = [value for value in getattr(self, name) if not (isfinite(value) and value > 0)]
            if wrong:
                raise InputError.at(self.place, name, wrong[0], "a finite number above 0")
        if list(self.zones) != sorted(self.zones):
            raise InputError.at(self.place, "zones", self.zones, "zones in ascending order")

    @classmethod
    def sorted(cls, zones: Sequence[float], costs: Sequence[float], place: str) -> Points:
        """Return points that are given in any order."""
        order = sorted(range(len(zones)), key=lambda at: (zones[at], -costs[at]))
        return cls(zones=tuple(zones[at] for at in order), costs=tuple(costs[at] for at in order), place=place)

    def require_falling(self) -> None:
        """Raise an InputError of two points that contradict each other unless the cost falls with the zone."""
        for (zone, cost), (wider, dearer) in pairwise(zip(self.zones, self.costs, strict=True)):
            if zone == wider:
                raise InputError(
                    f"{self.place}: a zone of {zone:g} costs {cost:g} and {dearer:g}; allowed is one cost per zone."
                )
            if dearer > cost:
                raise InputError(
                    f"{self.place}: a zone of {zone:g} costs {cost:g} and a zone of {wider:g} costs {dearer:g}; "
                    "allowed are costs that fall with the zone."
                )

    def rescaled(self, unit: float) -> Points:
        """Return the same points with zones counted in another unit [old unit]."""
        return Points(zones=tuple(zone / unit for zone in self.zones), costs=self.costs, place=self.place)


class ShopPrice(Record):
    """One row; the fields are the column headers without their unit."""

    process: Annotated[str, Field(min_length=1)]
    feature: Feature | None = None
    tolerance: Annotated[float, Field(ge=SMALLEST_ZONE)]
    unit: Literal["µm", "um", "mm"]
    cost: Annotated[float, Field(ge=SMALLEST_COST, le=1e9)]
    note: str = ""


ShopPoints = Mapping[tuple[str, Feature | None], Points]
"""Process and feature, or None for every feature → points in micrometres."""


_UNITS = {"cost": COST_UNITS, "tolerance": "unit"}


def currency_of_prices(path: Path) -> str:
    """Return the currency that the header of a shop's prices states, empty where it states none."""
    return stated_currency(path, [split_header(header) for header in read_text_table(path).headers], _UNITS)


def load_shop_points(path: Path) -> ShopPoints:
    """Return the points of a CSV file with the columns process, tolerance [unit], unit and cost [cost units].

    A column ``feature`` may say for which kind of callout a price is; without it the price is for every kind.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed, or a process with less than two tolerances.
    """
    prices: dict[tuple[str, Feature | None], list[tuple[float, float]]] = {}
    for place, row in read_rows(path, ShopPrice, "process", _UNITS):
        zone = row.tolerance * UNITS[row.unit]
        if zone > LARGEST_ZONE:
            raise InputError.at(place, "tolerance", f"{row.tolerance:g} {row.unit}", f"{LARGEST_ZONE:g} µm or less")
        prices.setdefault((row.process, row.feature), []).append((zone, row.cost))
    found = {}
    for (process, feature), pairs in prices.items():
        if len(pairs) > MOST_POINTS:
            raise InputError.at(path, f"number of prices of process {process}", len(pairs), f"{MOST_POINTS} or less")
        zones, costs = zip(*pairs, strict=True)
        found[process, feature] = Points.sorted(zones, costs, f"{path} ({process}, zones in µm)")
    return found


def points_of(points: ShopPoints, process: str, feature: Feature, place: str) -> Points:
    """Return the points of a process for a kind of callout [µm], those for every kind where it has none of its own."""
    found = points.get((process, feature)) or points.get((process, None))
    if found is None:
        known = [name for name, kind in points if kind in (feature, None)]
        raise UnknownNameError.among(place, f"process for feature {feature}", process, known)
    return found
