"""What no drawing that keeps the limits costs less than, by branch and bound on the real model."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.requirement import AtYield, Requirement
from tolalloc.capability.monte_carlo import CONFIDENCE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Model
from tolalloc.models.unit_bounds import BoundedModel, ScaledUnits, Sign, UnitBounds

_CELLS = 128
"""Cells of a range of scales within which a cost is taken at its least [-]."""
_CANDIDATES = 4
"""Units that are bounded, over those of which more failing ones prove a box empty [-]."""
_ROUNDING = 1e-9
"""Relative difference of costs that rounding makes [-]."""
_NARROW = 1e-6
"""Width of a box over its upper end below which it is cut no further [-]."""


@dataclass(frozen=True, kw_only=True)
class ProvenBound:
    """A cost below which no drawing with free zones keeps the limits, whatever a local model says.

    Notes
    -----
    Theory page, equation (104), own derivation. The cheapest drawing is one fixed design, whoever knows it: of N random
    units at most `allowed` fail in it, with the confidence stated, as their number is binomial. So it is among all
    designs in which at most that many of these units fail, and costs at least as much as the cheapest of these.
    """

    cost: float  # [cost units]
    floor: float  # What the loosest zones cost, which needs no proof [cost units]
    confidence: float  # With which it holds, over all draws of the units [-]
    units: int  # Random units, N [-]
    allowed: tuple[int, ...]  # Units that may fail every requirement that is counted [-]
    counted: tuple[str, ...]  # Outputs whose limits are counted
    boxes: int  # Boxes that were looked at [-]
    rests_on: str = ""  # What it takes for true beside the model, in words

    @property
    def says_more(self) -> bool:
        """Whether it lies above what the loosest zones cost."""
        return self.cost > self.floor * (1 + _ROUNDING)


def allowed_failures(units: int, share: float, confidence: float) -> int:
    """Return how many of so many units fail at most in a design that fails a share, with a confidence [-].

    The quantile of the binomial law, theory page equation (104), exact for a design fixed before its units are drawn.

    References
    ----------
    Own derivation; C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404–413.

    Examples
    --------
    >>> allowed_failures(10_000, 0.0027, 0.95)
    36
    """
    from scipy.stats import binom

    return int(binom.ppf(confidence, units, share))


Failed = Sequence[Bool[np.ndarray, " unit"]]
"""Of every limit, which units certainly fail it all over a box."""


@dataclass(frozen=True, kw_only=True)
class BoundedLimit:
    """A limit of an output whose units have bounds."""

    bounds: UnitBounds
    sign: Sign  # 1 for an upper limit, −1 for a lower one [-]
    limit: float  # [unit of the output]
    accuracy: float  # How well the model answers for a unit [unit of the output]


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What a design keeps: of how many units each set of limits may be failed by so many."""

    limits: tuple[BoundedLimit, ...]
    allowed: tuple[tuple[tuple[int, ...], int], ...]  # Positions of limits, and units that may fail any of them [-]

    def failed(
        self, lower: Float[np.ndarray, " variable"], upper: Float[np.ndarray, " variable"], before: Failed
    ) -> tuple[Failed, Float[np.ndarray, " variable"]]:
        """Return which units certainly fail all over a box, and how much every variable may move the others.

        Parameters
        ----------
        lower, upper
            Ends of the box.
        before
            Units that fail all over a box around it, which are not asked again.
        """
        found, moved = [], np.zeros(lower.size)
        for own, known in zip(self.limits, before, strict=True):
            rows, now = np.flatnonzero(~known), known.copy()
            least, reach = own.bounds.least(lower, upper, own.sign, rows)
            now[rows] = least > own.sign * own.limit + own.accuracy
            bounded = reach[np.isfinite(reach).all(axis=1)]
            moved += np.median(bounded, axis=0) if len(bounded) else upper - lower
            found.append(now)
        return found, moved

    def exceeded(self, failed: Failed) -> bool:
        """Return whether more units fail than may."""
        return any(
            int(np.count_nonzero(np.any([failed[at] for at in own], axis=0))) > most for own, most in self.allowed
        )


@dataclass(frozen=True, kw_only=True)
class CostBox:
    """Cost of designs in a box: every zone by its cheapest process at its loosest."""

    space: DesignSpace

    def parts(
        self, lower: Float[np.ndarray, " group"], upper: Float[np.ndarray, " group"]
    ) -> Float[np.ndarray, " group"]:
        """Return the least cost of every group in a range of scales, infinite where no process holds any of it."""
        return np.array([self._least(at, *ends) for at, ends in enumerate(zip(lower, upper, strict=True))])

    def least(self, lower: Float[np.ndarray, " variable"], upper: Float[np.ndarray, " variable"]) -> float:
        """Return what the designs of a box cost at least, locked zones included [cost units]."""
        groups = len(self.space.groups)
        return float(self.parts(lower[:groups], upper[:groups]).sum() + self.space.locked_cost)

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
        parts, least = self.parts(lower[:groups], upper[:groups]), self.least(lower, upper)
        if least >= cost:
            return least, lower
        edges, costs = self._cells
        affordable = costs <= (cost - least + parts)[:, np.newaxis]
        first = edges[np.arange(groups), affordable.argmax(axis=1)]
        tight[:groups] = np.clip(first, lower[:groups], upper[:groups])
        return least, tight


@dataclass(frozen=True, kw_only=True)
class _Box:
    """A box of designs, and what is known all over it."""

    floor: float  # No design in it costs less [cost units]
    lower: Float[np.ndarray, " variable"]
    upper: Float[np.ndarray, " variable"]
    failed: Failed
    cut: int  # Variable across which it is halved [-]

    @property
    def halves(self) -> tuple[tuple[Float[np.ndarray, " variable"], Float[np.ndarray, " variable"]], ...]:
        """Its halves, across ranges above 0 in equal ratios."""
        low, high = self.lower[self.cut], self.upper[self.cut]
        middle = np.sqrt(low * high) if low > 0 else (low + high) / 2
        above, below = self.lower.copy(), self.upper.copy()
        above[self.cut] = below[self.cut] = middle
        return (above, self.upper), (self.lower, below)

    @property
    def narrow(self) -> bool:
        """Whether it is cut no further."""
        return bool(np.all(self.upper - self.lower <= _NARROW * np.maximum(np.abs(self.upper), _NARROW)))


def cheapest_box(space: DesignSpace, conditions: Conditions, units: int, cost: float, boxes: int) -> tuple[float, int]:
    """Return a cost below which no design keeps the conditions, and the number of boxes that were looked at.

    Parameters
    ----------
    conditions
        What a design keeps.
    units
        Units that the conditions know [-].
    cost
        Cost that is not worth exceeding: that of a known design, infinite if there is none [cost units].
    boxes
        Most boxes that are looked at [-].

    Notes
    -----
    Best-first branch and bound: the cheapest box is halved across the variable that may move the outputs most; a half
    in which too many units certainly fail holds no design.

    References
    ----------
    A. H. Land, A. G. Doig, Econometrica 28 (1960) 497–520.
    """
    costs, looked = CostBox(space=space), 0

    def looked_at(box: _Box) -> _Box | None:
        """Return what is known of a box, nothing where it holds no design that matters."""
        least, lower = costs.contracted(box.lower, box.upper, cost)
        if least >= cost:
            return None
        failed, moved = conditions.failed(lower, box.upper, box.failed)
        if conditions.exceeded(failed):
            return None
        cut = int(np.argmax(np.where(box.upper > lower, moved, -1.0)))
        return replace(box, floor=max(least, box.floor), lower=lower, failed=failed, cut=cut)

    none = [np.zeros(units, bool) for _ in conditions.limits]
    whole = _Box(floor=-np.inf, lower=space.lower.astype(float), upper=space.upper.astype(float), failed=none, cut=0)
    heap: list[tuple[float, int, _Box]] = []
    waiting = [whole]
    while waiting:
        for box in waiting:
            looked += 1
            known = looked_at(box)
            if known:
                heapq.heappush(heap, (known.floor, looked, known))
        if not heap or looked >= boxes or heap[0][2].narrow:
            break
        _, _, cheapest = heapq.heappop(heap)
        waiting = [replace(cheapest, lower=low, upper=high) for low, high in cheapest.halves]
    return (heap[0][0] if heap else cost), looked


def _unbounded(model: Model, output: str) -> str:
    """Return why nothing is certain of an output, empty where something is."""
    return model.unbounded(output) if isinstance(model, BoundedModel) else f"{model.name} states no bound of {output}"


def _counted(model: Model, requirements: Sequence[Requirement]) -> tuple[Requirement, ...]:
    """Return the requirements whose failing units can be counted: yields of outputs that have bounds."""
    return tuple(
        own
        for own in requirements
        if isinstance(own.guarantee, AtYield)
        and not isinstance(own, JointRequirement)
        and not _unbounded(model, own.output)
    )


def require_bounded(model: Model, space: DesignSpace, requirements: Sequence[Requirement], place: str) -> None:
    """Raise unless a bound can be proven."""
    called = f"{place}, boxes"
    if space.errors.compensators:
        raise InputError(f"{called}: no bound is proven where parts are chosen at assembly; take 0.")
    if _counted(model, requirements):
        return
    reasons = [_unbounded(model, own.output) for own in requirements if isinstance(own.guarantee, AtYield)]
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
        bounded = self.model
        if not isinstance(bounded, BoundedModel):
            raise ValueError(_unbounded(self.model, "any output"))
        errors, own = self.space.errors, _counted(self.model, self.requirements)
        jointly = [each for each in self.requirements if isinstance(each, JointRequirement)]
        confidence = 1 - (1 - CONFIDENCE) / (len(own) + len(jointly))
        drawn = np.concatenate([*self.seeds.uniform_chunks(self.units, len(errors.columns))])
        middle = errors.deviations(np.zeros((1, drawn.shape[1])), errors.zones)
        group = np.full(drawn.shape[1], -1)  # a column that is on no drawing belongs to none
        drawn_on = np.repeat(self.space.group_of_source, [len(source.columns) for source in errors.active])
        group[: drawn_on.size] = drawn_on
        every = ScaledUnits(
            middle=middle[0],
            standard=errors.deviations(errors.standard_values(drawn), errors.zones) - middle,
            group=group,
            groups=len(self.space.groups),
        )
        shares = [1 - each.guarantee.target for each in (*own, *jointly) if isinstance(each.guarantee, AtYield)]
        allowed = [allowed_failures(self.units, share, confidence) for share in shares]
        near = np.array(designs)
        rows = self._worst(every, own, near, _CANDIDATES * (max(allowed) + 1))
        limits: list[BoundedLimit] = []
        members: list[tuple[int, ...]] = []
        for each in own:
            bounds = bounded.unit_bounds(each.output, every.chosen(rows), near)
            accuracy, first = self.model.accuracy.get(each.output, 0.0), len(limits)
            limits += [
                BoundedLimit(bounds=bounds, sign=sign, limit=limit, accuracy=accuracy)
                for sign, limit in each.limits.turned
            ]
            members.append(tuple(range(first, len(limits))))
        members += [tuple(range(len(limits)))] * len(jointly)
        conditions = Conditions(limits=tuple(limits), allowed=tuple(zip(members, allowed, strict=True)))
        found, looked = cheapest_box(self.space, conditions, len(rows), cost, self.boxes)
        return ProvenBound(
            cost=found,
            floor=CostBox(space=self.space).least(self.space.lower, self.space.upper),
            confidence=CONFIDENCE,
            units=self.units,
            allowed=tuple(allowed),
            counted=tuple(each.output for each in own),
            boxes=looked,
            rests_on=bounded.rests_on,
        )

    def _worst(
        self, units: ScaledUnits, own: Sequence[Requirement], designs: Float[np.ndarray, "design variable"], count: int
    ) -> Int[np.ndarray, " chosen"]:
        """Return the units that lie furthest beyond their limits in some designs; others only leave a bound lower."""
        excess = np.full(len(units.standard), -np.inf)
        for design in designs:
            x = units.deviations(design[np.newaxis, : units.groups])
            for each in own:
                found = self.model.at(self.space.settings_of(design)).reading((each.output,))(x)
                for sign, limit in each.limits.turned:
                    beyond = np.where(found.good, sign * (found.values[:, 0] - limit), -np.inf)
                    known = beyond[np.isfinite(beyond)]
                    scale = float(np.ptp(known)) if known.size else 0.0
                    excess = np.maximum(excess, beyond / (scale or 1.0))
        return np.argsort(-excess, kind="stable")[:count]
