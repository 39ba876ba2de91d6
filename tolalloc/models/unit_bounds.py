"""Rigorous lower bounds of an output, of random units over boxes of zones and settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

Sign = Literal[1, -1]
"""1 where a large output is bad, −1 where a small one is."""

Variables = Float[np.ndarray, " variable"]
"""An end of a box of scales [-] and settings [units of their names]."""

Pair = tuple[Float[np.ndarray, "unit variable"], Float[np.ndarray, "unit variable"]]
"""Two numbers of every unit by every variable."""

Least = tuple[Float[np.ndarray, " unit"], Float[np.ndarray, "unit variable"]]
"""Lower bound of sign·output of every unit, −∞ where none is known, and how much every variable may move it."""


@dataclass(frozen=True, kw_only=True)
class ScaledUnits:
    """Random units as a function of the scales of the zones: x = middle + standard·scale of the column's group."""

    middle: Float[np.ndarray, " column"]  # Deviations without what is random [m, angles rad]
    standard: Float[np.ndarray, "unit column"]  # Random deviations at a scale of 1 [m, angles rad]
    group: Int[np.ndarray, " column"]  # Position of every column's group, −1 where its zone is locked [-]
    groups: int  # Number of groups [-]

    @cached_property
    def members(self) -> Float[np.ndarray, "column group"]:
        """1 where a column belongs to a group [-]."""
        return np.asarray(self.group[:, np.newaxis] == np.arange(self.groups), float)

    def deviations(self, scales: Float[np.ndarray, "#unit group"]) -> Float[np.ndarray, "unit column"]:
        """Return the deviations of every unit, each at scales of its own [m, angles rad]."""
        own = np.concatenate([scales, np.ones((scales.shape[0], 1))], axis=1)[:, self.group]
        return np.asarray(self.middle + self.standard * own)

    def chosen(self, rows: Int[np.ndarray, " chosen"]) -> ScaledUnits:
        """Return some of the units."""
        return ScaledUnits(middle=self.middle, standard=self.standard[rows], group=self.group, groups=self.groups)


@runtime_checkable
class UnitBounds(Protocol):
    """What is certain of one output of some random units."""

    def least(self, lower: Variables, upper: Variables, sign: Sign, rows: Int[np.ndarray, " unit"]) -> Least:
        """Return what sign·output of some of the units is at least anywhere in a box of scales [-] and settings."""


@runtime_checkable
class BoundedModel(Protocol):
    """A model that knows something certain of its outputs over boxes of zones and settings."""

    rests_on: str
    """What that takes for true beside the model, in words; nothing of most."""

    def unbounded(self, output: str) -> str:
        """Return why nothing is certain of an output, empty where `unit_bounds` has its bounds."""

    def unit_bounds(self, output: str, units: ScaledUnits, designs: Float[np.ndarray, "design variable"]) -> UnitBounds:
        """Return what is certain of an output of random units, sharpest near some designs."""


def least_by_slopes(slopes: Pair, lower: Variables, upper: Variables) -> Pair:
    """Return from where every unit is best bounded in a box, and by how much every variable may lower it from there.

    The slopes are the least and largest derivative by every variable, valid all over the box.

    Notes
    -----
    Theory page, equation (103), own derivation: with a ≤ ∂y/∂r ≤ b, a⁻ = min(a, 0) and b⁺ = max(b, 0),
    y ≥ y(p) + Σ a⁻·b⁺/(b⁺ − a⁻)·(upper − lower) [unit of the output] at p = (b⁺·lower − a⁻·upper)/(b⁺ − a⁻), the best
    point to start from.
    """
    falling, rising = np.minimum(slopes[0], 0.0), np.maximum(slopes[1], 0.0)
    span = np.where(rising > falling, rising - falling, 1.0)
    # Where a variable moves nothing the span is 1 and the start is its lower end.
    start = lower + (-falling / span) * (upper - lower)
    return start, falling * rising / span * (upper - lower)


@dataclass(frozen=True, kw_only=True)
class SlopeBounds:
    """Bounds of an output whose derivatives lie between stated ones wherever it is asked."""

    units: ScaledUnits
    # From deviations [m, angles rad] and settings, the output of every unit [unit of the output]
    respond: Callable[[Float[np.ndarray, "unit column"], Float[np.ndarray, " setting"]], Float[np.ndarray, " unit"]]
    # Least and largest derivative by every column [unit of the output per m], then by every setting
    low: Float[np.ndarray, " slope"]
    high: Float[np.ndarray, " slope"]

    @cached_property
    def _slopes(self) -> Pair:
        """Least and largest derivative of every unit by every variable."""
        columns, standard = self.units.standard.shape[1], self.units.standard
        one, other = standard * self.low[:columns], standard * self.high[:columns]
        return tuple(  # type: ignore[return-value]
            np.concatenate(
                [side(one, other) @ self.units.members, np.tile(own[columns:], (standard.shape[0], 1))], axis=1
            )
            for side, own in ((np.minimum, self.low), (np.maximum, self.high))
        )

    def least(self, lower: Variables, upper: Variables, sign: Sign, rows: Int[np.ndarray, " unit"]) -> Least:
        """Return what sign·output is at least anywhere in a box; settings start from their middles."""
        slopes = [own[rows] for own in self._slopes]
        low, high = slopes if sign > 0 else (-slopes[1], -slopes[0])
        start, fall = least_by_slopes((low, high), lower, upper)
        reach, groups = np.maximum(np.abs(low), np.abs(high)) * (upper - lower), self.units.groups
        fall[:, groups:] = -reach[:, groups:] / 2
        units = self.units.chosen(rows)
        found = self.respond(units.deviations(start[:, :groups]), (lower + upper)[groups:] / 2)
        values = sign * found + fall.sum(axis=1)
        return np.where(np.isfinite(values), values, -np.inf), reach
