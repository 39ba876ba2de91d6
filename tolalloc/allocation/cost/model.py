"""What every cost model can do, a process with the zones that it can hold, and costs made of other costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.closed_forms import Expression, Reciprocal
from tolalloc.exceptions import InputError


@runtime_checkable
class CostModel(Protocol):
    """Cost of a feature as a decreasing function of its zone, in the unit of its parameters until it is `rescaled`."""

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        ...

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        ...

    def expression(self, zone: Expression) -> Expression | None:
        """Return the cost as a convex expression of scalar or vector zones, or None where it is not convex."""
        ...

    def rescaled(self, unit: float) -> CostModel:
        """Return the same cost as a function of zone / unit."""
        ...


@dataclass(frozen=True, kw_only=True)
class Process:
    """One way to make a feature.

    Raises
    ------
    InputError
        Contradictory bounds, or a cost that grows with the zone.
    """

    name: str  # Name of the process
    cost: CostModel  # Cost of the feature made in this way
    # Smallest and largest zone that it can hold [unit of the zone]
    minimum: float
    maximum: float
    # Fixed cost of making the feature in this way, such as that of leaving today's process [cost units]
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
        """Return the same process with zones counted in another unit [old unit]."""
        return replace(self, cost=self.cost.rescaled(unit), minimum=self.minimum / unit, maximum=self.maximum / unit)


@dataclass(frozen=True, kw_only=True)
class Weighted:
    """A cost model times a number, such as a price that may be off by a fifth."""

    model: CostModel  # The cost model
    weight: float  # The number, above 0 [-]

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(self.weight * self.model.value(zone))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the zone [cost units per unit of the zone]."""
        return np.asarray(self.weight * self.model.slope(zone))

    def expression(self, zone: Expression) -> Expression | None:
        """Return the cost as a convex expression, or None where the model is not convex."""
        found = self.model.expression(zone)
        return None if found is None else self.weight * found

    def rescaled(self, unit: float) -> Weighted:
        """Return the same cost as a function of zone / unit."""
        return Weighted(model=self.model.rescaled(unit), weight=self.weight)


def made_together(models: Sequence[CostModel], ratios: Sequence[float]) -> CostModel:
    """Return the cost of several callouts that change together, as simple as it can be said; see `SumOfCosts`."""
    own = [model.rescaled(ratio) for model, ratio in zip(models, ratios, strict=True)]
    reciprocal = [model for model in own if isinstance(model, Reciprocal)]
    if len(reciprocal) == len(own):
        return Reciprocal(
            fixed=sum(model.fixed for model in reciprocal), factor=sum(model.factor for model in reciprocal)
        )
    return SumOfCosts(models=tuple(models), ratios=tuple(ratios))


@dataclass(frozen=True, kw_only=True)
class SumOfCosts:
    """Cost of several callouts that are made in the same way and change together."""

    models: tuple[CostModel, ...]  # Cost of each callout as a function of its own zone
    # Zone of each callout over the common variable [unit of the zone per unit of the variable]
    ratios: tuple[float, ...]

    @cached_property
    def _parts(self) -> tuple[CostModel, ...]:
        """Costs as functions of the common variable."""
        return tuple(model.rescaled(ratio) for model, ratio in zip(self.models, self.ratios, strict=True))

    def value(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the cost [cost units]."""
        return np.asarray(np.sum([part.value(zone) for part in self._parts], axis=0))

    def slope(self, zone: Float[np.ndarray, "*zones"]) -> Float[np.ndarray, "*zones"]:
        """Return the derivative of the cost by the common variable [cost units per unit of the variable]."""
        return np.asarray(np.sum([part.slope(zone) for part in self._parts], axis=0))

    def expression(self, zone: Expression) -> Expression | None:
        """Return the cost as a convex expression, or None where a part is not convex."""
        parts = [part.expression(zone) for part in self._parts]
        convex = [part for part in parts if part is not None]
        return sum(convex) if len(convex) == len(parts) else None

    def rescaled(self, unit: float) -> SumOfCosts:
        """Return the same cost as a function of variable / unit."""
        return replace(self, ratios=tuple(ratio * unit for ratio in self.ratios))
