"""The least cost of every process alone once its zone has a price."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.cost.closed_forms import ClosedForm, Reciprocal, stacked
from tolalloc.allocation.cost.model import CostModel, Process

_FRACTIONS = np.linspace(0.0, 1.0, 33)
_ROUNDS = 4
"""Each narrows a zone to 1/32 of its range, so four leave a ratio of 1 + 1e-5 at most [-]."""


def by_form(processes: Sequence[Process]) -> tuple[LeastPriced, ...]:
    """Return processes with those of one closed form together, the others each for itself."""
    together: dict[object, list[int]] = defaultdict(list)
    for at, process in enumerate(processes):
        together[type(process.cost) if isinstance(process.cost, ClosedForm) else at].append(at)
    return tuple(LeastPriced.of(places, [processes[at] for at in places]) for places in together.values())


@dataclass(frozen=True, kw_only=True)
class LeastPriced:
    """Processes whose costs have one form, each minimised alone with a price on its zone, all at once.

    Parameters
    ----------
    places
        Where they stand among all processes [-].
    cost
        Their convex costs, a row of zones for each.
    change, low, high
        Their fixed costs [cost units], and the ends of their ranges [unit of the zone].
    """

    places: Int[np.ndarray, " process"]
    cost: CostModel
    change: Float[np.ndarray, " process"]
    low: Float[np.ndarray, " process"]
    high: Float[np.ndarray, " process"]

    @classmethod
    def of(cls, places: Sequence[int], processes: Sequence[Process]) -> LeastPriced:
        """Return processes of one closed form, or a single one of any convex cost."""
        costs = [process.cost for process in processes]
        closed = [cost for cost in costs if isinstance(cost, ClosedForm)]
        return cls(
            places=np.array(places),
            cost=stacked(closed) if len(closed) == len(costs) else costs[0],
            change=np.array([process.change for process in processes]),
            low=np.array([process.minimum for process in processes]),
            high=np.array([process.maximum for process in processes]),
        )

    def found(
        self, linear: Float[np.ndarray, " process"], square: Float[np.ndarray, " process"]
    ) -> tuple[Float[np.ndarray, " process"], Float[np.ndarray, " process"]]:
        """Return lower bounds on cost + linear·zone + square·zone² over the range of each, and the zones there.

        Parameters
        ----------
        linear, square
            Price of the zone [cost units per unit of the zone], and of its square, 0 or above [cost units per unit²].

        Notes
        -----
        A convex function lies above its tangents at any two zones, so the crossing of the two bounds it from below
        wherever they stand; that they stand on both sides of the minimum and close together only makes the bound tight.
        For b/t + p·t the minimum is known: it is reached at √(b/p), or at the nearer end of the range.
        """
        if isinstance(self.cost, Reciprocal) and not square.any():
            best = np.sqrt(np.ravel(self.cost.factor) / np.where(linear > 0, linear, np.nan))
            zone = np.clip(np.where(linear > 0, best, self.high), self.low, self.high)
            return self._priced(zone[:, np.newaxis], linear, square)[:, 0], zone
        around = self._around(linear, square)
        values = self._priced(around, linear, square)
        slopes = self._slopes(around, linear, square)
        low, high = around.T
        apart = high > low
        bend = np.where(apart, slopes[:, 0] - slopes[:, 1], 1.0)
        step = np.where(apart, (values[:, 1] - values[:, 0] - slopes[:, 1] * (high - low)) / bend, 0.0)
        step = np.clip(step, 0.0, high - low)
        return values[:, 0] + slopes[:, 0] * step, low + step

    def _around(
        self, linear: Float[np.ndarray, " process"], square: Float[np.ndarray, " process"]
    ) -> Float[np.ndarray, "process 2"]:
        """Return two zones close together, one on each side of the minimum, or the end of the range where it lies."""
        low, high, rows = self.low, self.high, np.arange(self.low.size)
        last = _FRACTIONS.size - 1
        for _ in range(_ROUNDS):
            zones = np.minimum(low[:, np.newaxis] * (high / low)[:, np.newaxis] ** _FRACTIONS, high[:, np.newaxis])
            rising = self._slopes(zones, linear, square) >= 0
            after = np.where(rising[:, -1], rising.argmax(axis=1), last + 1)
            low, high = zones[rows, np.maximum(after - 1, 0)], zones[rows, np.minimum(after, last)]
        return np.stack([low, high], axis=1)

    def _priced(
        self,
        zones: Float[np.ndarray, "process zone"],
        linear: Float[np.ndarray, " process"],
        square: Float[np.ndarray, " process"],
    ) -> Float[np.ndarray, "process zone"]:
        own = self.cost.value(zones) + self.change[:, np.newaxis]
        return np.asarray(own + linear[:, np.newaxis] * zones + square[:, np.newaxis] * zones**2)

    def _slopes(
        self,
        zones: Float[np.ndarray, "process zone"],
        linear: Float[np.ndarray, " process"],
        square: Float[np.ndarray, " process"],
    ) -> Float[np.ndarray, "process zone"]:
        return np.asarray(self.cost.slope(zones) + linear[:, np.newaxis] + 2 * square[:, np.newaxis] * zones)
