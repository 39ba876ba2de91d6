"""What no drawing that keeps the limits costs less than, by branch and bound on the real model."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.requirement import AtYield, Requirement
from tolalloc.capability.monte_carlo import CONFIDENCE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Model
from tolalloc.models.unit_bounds import ScaledUnits, Sign, UnitBounds

_CELLS = 128
"""Cells of a range of scales within which a cost is taken at its least [-]."""
_CANDIDATES = 4
"""Units that are bounded, over those of which more failing ones prove a box empty [-]."""
_NARROW = 1e-6
"""Width of a box over its upper end below which it is cut no further [-]."""


@dataclass(frozen=True, kw_only=True)
class ProvenBound:
    """A cost below which no drawing with free zones keeps the limits, whatever a local model says.

    Notes
    -----
    Theory page, equation (93), own derivation. The cheapest drawing is one fixed design, whoever knows it: of N random
    units at most `allowed` fail in it, with the confidence stated, as their number is binomial. So it is among all
    designs in which at most that many of these units fail, and costs at least as much as the cheapest of these.
    """

    cost: float  # [cost units]
    confidence: float  # With which it holds, over all draws of the units [-]
    units: int  # Random units, N [-]
    allowed: tuple[int, ...]  # Units that may fail every requirement that is counted [-]
    counted: tuple[str, ...]  # Outputs whose limits are counted
    boxes: int  # Boxes that were looked at [-]


def allowed_failures(units: int, share: float, confidence: float) -> int:
    """Return how many of so many units fail at most in a design that fails a share, with a confidence [-].

    The quantile of the binomial law.

    Examples
    --------
    >>> allowed_failures(10_000, 0.0027, 0.95)
    36
    """
    from scipy.stats import binom

    return int(binom.ppf(confidence, units, share))


@dataclass(frozen=True, kw_only=True)
class Count:
    """How many units may fail some limits: one condition that a design keeps."""

    # Bounds of an output, its limits with the sign that makes larger worse, and how well its model answers for it
    sides: tuple[tuple[UnitBounds, tuple[tuple[Sign, float], ...], float], ...]
    allowed: int  # [-]

    def look(
        self, lower: Float[np.ndarray, " variable"], upper: Float[np.ndarray, " variable"]
    ) -> tuple[bool, Float[np.ndarray, " variable"]]:
        """Return whether too many units certainly fail all over a box, and how much every variable may move them."""
        failed: Bool[np.ndarray, " unit"] | bool = False
        moved = np.zeros(lower.size)
        for bounds, limits, accuracy in self.sides:
            for sign, limit in limits:
                least, reach = bounds.least(lower, upper, sign)
                failed = failed | (least > sign * limit + accuracy)
                known = reach[np.isfinite(reach).all(axis=1)]
                moved += np.median(known, axis=0) if len(known) else upper - lower
        return int(np.count_nonzero(failed)) > self.allowed, moved


@dataclass(frozen=True, kw_only=True)
class CostBox:
    """Cost of designs in a box: every zone by its cheapest process at its loosest."""

    space: DesignSpace

    def parts(
        self, lower: Float[np.ndarray, " group"], upper: Float[np.ndarray, " group"]
    ) -> Float[np.ndarray, " group"]:
        """Return the least cost of every group in a range of scales, infinite where no process holds any of it."""
        return np.array([self._least(at, *ends) for at, ends in enumerate(zip(lower, upper, strict=True))])

    def _least(self, group: int, low: float, high: float) -> float:
        """Return the least cost of a group, as the cost of every process falls."""
        found = [
            float(made.total(np.array(min(high, made.maximum))))
            for made in self.space.features[group].processes
            if max(low, made.minimum) <= min(high, made.maximum)
        ]
        return min(found, default=np.inf)

    @cached_property
    def _cells(self) -> tuple[Float[np.ndarray, "group edge"], Float[np.ndarray, "group cell"]]:
        """Edges of cells over the range of every group, and the least cost in each."""
        groups = len(self.space.groups)
        edges = np.geomspace(self.space.lower[:groups], self.space.upper[:groups], _CELLS + 1, axis=1)
        costs = [[self._least(at, *ends) for ends in pairwise(own)] for at, own in enumerate(edges)]
        return edges, np.array(costs)

    def contracted(
        self, lower: Float[np.ndarray, " variable"], upper: Float[np.ndarray, " variable"], cost: float
    ) -> tuple[float, Float[np.ndarray, " variable"]]:
        """Return the least cost in a box, and its lower end without what costs more than so much [cost units].

        A zone may cost no more than the cost leaves when all others are at their loosest (own derivation).
        """
        groups, tight = len(self.space.groups), lower.copy()
        parts = self.parts(lower[:groups], upper[:groups])
        least = float(parts.sum() + self.space.locked_cost)
        if least >= cost:
            return least, lower
        edges, costs = self._cells
        affordable = costs <= (cost - least + parts)[:, np.newaxis]
        first = edges[np.arange(groups), affordable.argmax(axis=1)]
        tight[:groups] = np.clip(first, lower[:groups], upper[:groups])
        return least, tight


def cheapest_box(space: DesignSpace, counts: Sequence[Count], cost: float, boxes: int) -> tuple[float, int]:
    """Return a cost below which no design keeps the counts, and the number of boxes that were looked at.

    Parameters
    ----------
    space
        The design variables.
    counts
        What a design keeps.
    cost
        Cost that is not worth exceeding: that of a known design, infinite if there is none [cost units].
    boxes
        Most boxes that are looked at [-].

    Notes
    -----
    Best-first branch and bound (Land & Doig 1960): the cheapest box is halved across the variable that may move the
    output most; a half in which too many units certainly fail holds no design.
    """
    own, whole = CostBox(space=space), (space.lower.astype(float), space.upper.astype(float))
    heap: list[tuple[float, int, Float[np.ndarray, " variable"], Float[np.ndarray, " variable"], int]] = []
    looked = 0

    def push(lower: Float[np.ndarray, " variable"], upper: Float[np.ndarray, " variable"], floor: float) -> None:
        nonlocal looked
        least, lower = own.contracted(lower, upper, cost)
        if least >= cost:
            return
        looked, moved = looked + 1, np.zeros(lower.size)
        for count in counts:
            empty, by = count.look(lower, upper)
            if empty:
                return
            moved += by
        at = int(np.argmax(np.where(upper > lower, moved, -1.0)))
        heapq.heappush(heap, (max(least, floor), looked, lower, upper, at))

    push(*whole, -np.inf)
    while heap and looked < boxes:
        floor, _, lower, upper, at = heap[0]
        if np.all(upper - lower <= _NARROW * np.maximum(np.abs(upper), _NARROW)):
            break
        heapq.heappop(heap)
        zone = at < len(space.groups)
        middle = float(np.sqrt(lower[at] * upper[at]) if zone else (lower[at] + upper[at]) / 2)
        for low, high in ((middle, upper[at]), (lower[at], middle)):
            below, above = lower.copy(), upper.copy()
            below[at], above[at] = low, high
            push(below, above, floor)
    return (heap[0][0] if heap else cost), looked


def counted(model: Model, requirements: Sequence[Requirement]) -> tuple[Requirement, ...]:
    """Return the requirements whose failing units can be counted: yields of outputs that have bounds."""
    return tuple(
        own
        for own in requirements
        if isinstance(own.guarantee, AtYield)
        and not isinstance(own, JointRequirement)
        and not model.unbounded(own.output)
    )


def require_bounded(model: Model, space: DesignSpace, requirements: Sequence[Requirement], place: str) -> None:
    """Raise unless a bound can be proven.

    Raises
    ------
    InputError
        Parts are chosen at assembly, or no limited output has bounds.
    """
    called = f"{place}, boxes"
    if space.errors.compensators:
        raise InputError(f"{called}: no bound is proven where parts are chosen at assembly; take 0.")
    if counted(model, requirements):
        return
    reasons = [model.unbounded(own.output) for own in requirements if isinstance(own.guarantee, AtYield)]
    said = next((own for own in reasons if own), "no limit is one that a share of the units must keep, AtYield")
    raise InputError(f"{called}: no bound can be proven, as {said}; take 0.")


@dataclass(frozen=True, kw_only=True)
class BoundSearch:
    """What a bound is proven from."""

    space: DesignSpace  # Design variables with every setting free
    model: Model  # The real model
    requirements: tuple[Requirement, ...]  # What must be kept
    seeds: SeedTree  # Node of the seed tree
    units: int  # Random units [-]
    boxes: int  # Most boxes that are looked at [-]

    def prove(self, designs: Sequence[Float[np.ndarray, " variable"]], cost: float) -> ProvenBound:
        """Return the bound.

        Parameters
        ----------
        designs
            Designs near which it should be sharpest.
        cost
            Cost of a drawing that keeps the limits, infinite if there is none [cost units].
        """
        errors, own = self.space.errors, counted(self.model, self.requirements)
        jointly = [each for each in self.requirements if isinstance(each, JointRequirement)]
        confidence = 1 - (1 - CONFIDENCE) / (len(own) + len(jointly))
        drawn = np.concatenate([*self.seeds.uniform_chunks(self.units, len(errors.columns))])
        counts = [len(source.columns) for source in errors.active]
        middle = errors.deviations(np.zeros((1, drawn.shape[1])), errors.zones)[0]
        every = ScaledUnits(
            middle=middle,
            standard=errors.standard_values(drawn) * np.repeat(errors.zones, counts),
            group=np.repeat(self.space.group_of_source, counts),
            groups=len(self.space.groups),
        )
        shares = [1 - each.guarantee.target for each in (*own, *jointly) if isinstance(each.guarantee, AtYield)]
        allowed = [allowed_failures(self.units, share, confidence) for share in shares]
        near = np.array(designs)
        rows = self._worst(every, own, near, _CANDIDATES * (max(allowed) + 1))
        sides = [
            (
                self.model.unit_bounds(each.output, every.chosen(rows), near),
                each.limits.turned,
                self.model.accuracy.get(each.output, 0.0),
            )
            for each in own
        ]
        of_each = [Count(sides=(side,), allowed=most) for side, most in zip(sides, allowed, strict=False)]
        of_all = [Count(sides=tuple(sides), allowed=most) for most in allowed[len(own) :]]
        found, looked = cheapest_box(self.space, (*of_each, *of_all), cost, self.boxes)
        return ProvenBound(
            cost=found,
            confidence=CONFIDENCE,
            units=self.units,
            allowed=tuple(allowed),
            counted=tuple(each.output for each in own),
            boxes=looked,
        )

    def _worst(
        self, units: ScaledUnits, own: Sequence[Requirement], designs: Float[np.ndarray, "design variable"], count: int
    ) -> Float[np.ndarray, " chosen"]:
        """Return the units that lie furthest beyond their limits in some designs; others only leave a bound lower."""
        excess = np.full(len(units.standard), -np.inf)
        for design in designs:
            x = units.deviations(design[np.newaxis, : units.groups])
            for each in own:
                found = self.model.at(self.space.settings_of(design)).reading((each.output,))(x)
                for sign, limit in each.limits.turned:
                    beyond = np.where(found.good, sign * (found.values[:, 0] - limit), -np.inf)
                    scale = float(np.ptp(beyond[np.isfinite(beyond)])) or 1.0
                    excess = np.maximum(excess, beyond / scale)
        return np.argsort(-excess, kind="stable")[:count]
