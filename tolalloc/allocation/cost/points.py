"""Points of a cost curve: what a shop asks for a feature at some zones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite

from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class Points:
    """Zones and what they cost, the smallest zone first.

    Parameters
    ----------
    zones
        Zones, ascending; equal ones are the same zone priced more than once [unit of the zone].
    costs
        Their costs [cost units].
    place
        Where the points stand, for messages.

    Raises
    ------
    InputError
        Fewer than two zones, not in order, or a number that is not above 0.
    """

    zones: tuple[float, ...]
    costs: tuple[float, ...]
    place: str = "cost points"

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
        """Return the points in ascending order of their zones.

        Parameters
        ----------
        zones, costs
            Zones [unit of the zone] and their costs [cost units], in any order.
        place
            Where they stand.
        """
        order = sorted(range(len(zones)), key=lambda at: (zones[at], -costs[at]))
        return cls(zones=tuple(zones[at] for at in order), costs=tuple(costs[at] for at in order), place=place)

    def require_falling(self) -> None:
        """Raise unless every point is above the next in cost and below it in zone.

        Raises
        ------
        InputError
            The two points that contradict each other.
        """
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
