"""What every cost model can do, and a process: a cost model with the zones that it can hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import cvxpy as cp
import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError


@runtime_checkable
class CostModel(Protocol):
    """Cost of a feature as a decreasing function of its zone.

    Zones are in the unit of the model's parameters; `rescaled` changes that unit, so that programs see numbers of
    order one.
    """

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        ...

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        ...

    def expression(self, zone: cp.Expression) -> cp.Expression | None:
        """Return the cost as a convex expression of scalar or vector zones, or None where it is not convex."""
        ...

    def rescaled(self, unit: float) -> CostModel:
        """Return the same cost as a function of zone / unit."""
        ...


@dataclass(frozen=True, kw_only=True)
class Process:
    """One way to make a feature.

    Parameters
    ----------
    name
        Name of the process.
    cost
        Cost of the feature made in this way.
    minimum, maximum
        Smallest and largest zone that it can hold [unit of the zone].
    change
        Fixed cost of making the feature in this way, such as that of leaving today's process [cost units].

    Raises
    ------
    InputError
        Contradictory bounds, or a cost that grows with the zone.
    """

    name: str
    cost: CostModel
    minimum: float
    maximum: float
    change: float = 0.0

    def __post_init__(self) -> None:
        place = f"process {self.name}"
        if not 0 < self.minimum <= self.maximum < np.inf:
            raise InputError.at(
                place, "min and max", (self.minimum, self.maximum), "two numbers above 0, the smaller one first"
            )
        slopes = self.cost.slope(np.linspace(self.minimum, self.maximum, 33))
        if not np.all(slopes <= 0):
            raise InputError.at(
                place, "cost", f"growing with the zone between {self.minimum:g} and {self.maximum:g}", "a falling cost"
            )

    def total(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost with the fixed part [cost units]."""
        return np.asarray(self.cost.value(zone) + self.change)

    def rescaled(self, unit: float) -> Process:
        """Return the same process with zones counted in another unit.

        Parameters
        ----------
        unit
            The new unit [old unit].
        """
        return Process(
            name=self.name,
            cost=self.cost.rescaled(unit),
            minimum=self.minimum / unit,
            maximum=self.maximum / unit,
            change=self.change,
        )


@dataclass(frozen=True, kw_only=True)
class Weighted:
    """A cost model times a number, such as a price that may be off by a fifth.

    Parameters
    ----------
    model
        The cost model.
    weight
        The number, above 0 [-].
    """

    model: CostModel
    weight: float

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.weight * self.model.value(zone))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(self.weight * self.model.slope(zone))

    def expression(self, zone: cp.Expression) -> cp.Expression | None:
        """Return the cost as a convex expression, or None where the model is not convex."""
        found = self.model.expression(zone)
        return None if found is None else self.weight * found

    def rescaled(self, unit: float) -> Weighted:
        """Return the same cost as a function of zone / unit."""
        return Weighted(model=self.model.rescaled(unit), weight=self.weight)
