"""How wrong what is uncertain of a model may be before other zones are cheapest, or these keep the limits no more."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.front.price_region import SAME
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.convex_program import ConvexProgram
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.problem import Solution, Stack
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.capability.halving import halved
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Model

SPAN = float(np.log(2.0))
"""Change of one column, either way, up to which zones are followed at least, half to twice: ln of a factor [-]."""
COVERED = 2.0
"""Standard uncertainties within which the least favourable change is looked for [-]."""
_SHARES = (0.25, 0.5, 0.75, 1.0)
"""Shares of the span at which zones are looked at before the place where one leaves is halved [-]."""
_FOUND, _HALVINGS = 1e-3, 8
"""Error of that place as a share of the span [-], and halvings of a quarter of it that leave no more."""
_LEFT = 1.0
"""What stands for a change of zones where no zones keep the limits: ln of a ratio above any that counts [-]."""


@runtime_checkable
class AssumingModel(Protocol):
    """A model that rests on numbers which nobody may have measured."""

    @property
    def with_assumed(self) -> Model:
        """The model with these among what is uncertain, by no stated amount unless something is known of it."""


def doubted(model: Model) -> Model:
    """Return a model with all that may be wrong with it among what is uncertain."""
    return model.with_assumed if isinstance(model, AssumingModel) else model


@dataclass(frozen=True, kw_only=True)
class Variant:
    """The answer under one changed assumption."""

    name: str  # What was changed
    scales: Float[np.ndarray, " group"]  # Scale of every group [-]
    cost: float  # Its cost under the changed assumption, with the locked zones at their own [cost units]
    # What the undisturbed answer costs more than this one under the changed assumption, as a share of its cost; not a
    # number where the chosen design no longer keeps a requirement [-]
    regret: float
    kept: bool  # Whether the chosen design still keeps every requirement, told by the change that the same units show


@dataclass(frozen=True, kw_only=True)
class UncertainRange:
    """Between which changes of one uncertain column, all others as assumed, the answer holds."""

    column: str  # The column
    # Smallest and largest change at which it was looked at, 0 where too many units have no answer: ln of a factor [-]
    tried: tuple[float, float]
    same: tuple[float, float]  # Changes between which every zone stays within `SAME` [-]
    first: tuple[str, str]  # The zone that leaves first below and above, empty where none does within what was tried
    kept: tuple[float, float]  # Changes between which the chosen design keeps every requirement [-]

    @property
    def moves_a_zone(self) -> bool:
        """Whether a zone leaves within what was tried."""
        return any(self.first)

    @property
    def breaks_a_limit(self) -> bool:
        """Whether the chosen design no longer keeps a requirement within what was tried."""
        return self.kept != self.tried


@dataclass(frozen=True, kw_only=True)
class UncertainRegion:
    """The region of what is uncertain of a model in which an answer holds."""

    name: str  # What is uncertain
    ranges: tuple[UncertainRange, ...]  # Of every column alone
    ratios: Float[np.ndarray, "end group"]  # Zones at the ends of what was tried over the undisturbed ones [-]
    # The answer at the least favourable change within `COVERED` standard uncertainties, all columns together as they
    # are correlated; none where nothing is uncertain by any amount
    least_favourable: Variant | None


@dataclass(frozen=True)
class _ChangedModels:
    """Local models of the chosen design under a change, and by how much its excess over every limit rises."""

    stacks: tuple[Stack, ...]
    rises: Float[np.ndarray, " stack"]  # Not finite where so many units fail that none shows it [unit of the output]


@dataclass(frozen=True)
class _Undisturbed:
    """The chosen design on the units on which every change is seen."""

    verifier: Verifier
    allocation: ZoneAllocation

    @cached_property
    def verified(self) -> VerifiedDesign:
        return self.verifier.verify(self.allocation.chosen.design, "robustness")

    def moved(self, change: Float[np.ndarray, " column"]) -> _ChangedModels:
        """Return the local models of another model, on units of the same name and so the same units."""
        design = self.allocation.chosen.design
        other, before = replace(self.verifier, model=self.verifier.model.changed(change)), self.verified.constraints
        try:
            now = other.verify(design, self.verified.name).constraints
        except SolveError:  # too many units have no answer under such a change, so nothing is known beyond none of it
            return _ChangedModels(stacks=self.allocation.stacks, rises=np.full(len(before), np.nan))
        pairs = zip(now, before, strict=True)
        rises = np.array([float(after.predicted(design) - own.predicted(design)) for after, own in pairs])
        together = zip(self.allocation.stacks, now, before, rises.tolist(), strict=True)
        chosen = self.allocation.chosen
        stacks = tuple(
            changed_stack(aimed, own.stack, after.stack, chosen.scales, chosen.settings, rise)
            for aimed, after, own, rise in together
        )
        return _ChangedModels(stacks=stacks, rises=np.where(np.isfinite([own.value for own in now]), rises, np.nan))


def uncertain_region(verifier: Verifier, allocation: ZoneAllocation) -> UncertainRegion | None:
    """Return the region of what is uncertain of the model in which the chosen design stays the cheapest.

    Parameters
    ----------
    verifier
        Verifies the chosen design again with every changed model.

    Returns
    -------
    UncertainRegion or None
        None of a model of which nothing is uncertain.

    Notes
    -----
    A parametric program: the local models at either end of a column's span come from the changed model itself, on the
    units of the undisturbed one, so that their difference is free of the luck of a second sample, and is added to what
    the verification of the chosen design found. Between, weights are powers of the factor and budgets straight lines;
    along them the program is solved until the first zone has moved by `SAME`, processes as they are.

    With r the rise of the excess per change of every column and C their covariance, the least favourable change is
    COVERED·C·r/√(rᵀ·C·r), of the requirement that it brings furthest beyond its limit; there the real model is asked.

    References
    ----------
    Own derivation; A. V. Fiacco, Introduction to sensitivity and stability analysis in nonlinear programming (1983);
    A. Ben-Tal, A. Nemirovski, Math. Oper. Res. 23 (1998) 769–805, for the least favourable point of an ellipsoid.
    """
    verifier = replace(verifier, model=doubted(verifier.model))
    if not verifier.model.uncertain:
        return None
    (source, *_), here = verifier.model.uncertain, _Undisturbed(verifier, allocation)
    name = source.name.split(" (")[0]
    spans = np.maximum(SPAN, COVERED * np.sqrt(np.diag(source.covariance)))
    ends = [(here.moved(-step), here.moved(step)) for step in np.diag(spans)]
    path = _Path(verifier, allocation)
    ranges = tuple(
        _range(path, column, float(span), own) for column, span, own in zip(source.columns, spans, ends, strict=True)
    )
    slopes = np.array([(high.rises - low.rises) / (2 * span) for (low, high), span in zip(ends, spans, strict=True)])
    change = _least_favourable(slopes, source.covariance, allocation)
    variant = None if change is None else _variant(verifier, allocation, here.moved(change), name)
    return UncertainRegion(
        name=name,
        ranges=ranges,
        ratios=np.array([path.ratios(side, 1.0) for own in ends for side in own]),
        least_favourable=variant,
    )


def changed_stack(
    aimed: Stack,
    before: Stack,
    after: Stack,
    zones: Float[np.ndarray, " feature"],
    settings: Float[np.ndarray, " shared"],
    rise: float,
) -> Stack:
    """Return a stack changed as two models of the same units tell.

    Parameters
    ----------
    aimed
        The stack of the undisturbed model.
    before, after
        That of the units on which the change was seen, without and with it.
    zones, settings
        The design at which the load less the budget rises.
    rise
        By how much it does [unit of the stack].

    Notes
    -----
    w + (w₊ − w₋) and q² + (q₊² − q₋²), not below 0; load − budget at the design is that of `aimed` + rise (own
    derivation).
    """
    squares = aimed.root_sum_square**2 + after.root_sum_square**2 - before.root_sum_square**2
    moved = replace(
        aimed,
        worst_case=np.maximum(aimed.worst_case + after.worst_case - before.worst_case, 0.0),
        root_sum_square=np.sqrt(np.maximum(squares, 0.0)),
        slopes=aimed.slopes + after.slopes - before.slopes,
    )
    loads = [float(stack.load(zones, settings)) for stack in (moved, aimed)]
    return replace(moved, budget=loads[0] - (loads[1] - aimed.budget) - rise)


class _Path:
    """The cheapest zones along a change, processes as they are."""

    def __init__(self, verifier: Verifier, allocation: ZoneAllocation) -> None:
        self.problem, self.allocation = verifier.space.problem(allocation.stacks), allocation
        self.groups = verifier.space.groups
        made = allocation.inside.processes
        self._program = ConvexProgram(self.problem.features, made, len(allocation.stacks), self.problem.shared)

    def ratios(self, end: _ChangedModels, share: float) -> Float[np.ndarray, " group"]:
        """Return zones at a share of the way to an end over the undisturbed ones, not numbers where none keep all."""
        nothing = np.full(len(self.groups), np.nan)
        if not np.isfinite(end.rises).all():
            return nothing
        pairs = zip(self.allocation.stacks, end.stacks, strict=True)
        found = self._program.solve([_between(here, there, share) for here, there in pairs])
        return nothing if found is None else found.zones / self.allocation.inside.zones

    def beyond(self, end: _ChangedModels, share: float) -> float:
        """Return by how much the zone that moves most has moved beyond `SAME`, ln of a ratio [-]."""
        ratios = self.ratios(end, share)
        moved = _LEFT if np.isnan(ratios).any() else float(np.abs(np.log(ratios)).max())
        return moved - float(np.log1p(SAME))

    def place(self, end: _ChangedModels) -> tuple[float, str]:
        """Return the share of the way at which the first zone leaves, and its name; one and nothing where none does."""
        inside, outside = 0.0, 0.0
        for share in _SHARES if np.isfinite(end.rises).all() else ():
            if self.beyond(end, share) > 0:
                outside = share
                break
            inside = share
        if not outside:
            return 1.0, ""
        inside = float(halved(lambda share: self.beyond(end, share) <= 0, inside, outside, _HALVINGS))
        ratios = self.ratios(end, inside)
        first = 0 if np.isnan(ratios).any() else int(np.abs(np.log(ratios)).argmax())
        return inside, self.groups[first]


def _between(here: Stack, there: Stack, share: float) -> Stack:
    """Return the stack between two: weights geometric, as powers of a factor are, budgets and slopes linear."""

    def line(start: Float[np.ndarray, "..."], end: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        return (1 - share) * start + share * end

    def power(start: Float[np.ndarray, "..."], end: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        return np.where((start > 0) & (end > 0), start ** (1 - share) * end**share, line(start, end))

    return replace(
        here,
        worst_case=power(here.worst_case, there.worst_case),
        root_sum_square=power(here.root_sum_square, there.root_sum_square),
        budget=(1 - share) * here.budget + share * there.budget,
        slopes=line(here.slopes, there.slopes),
    )


def _range(path: _Path, column: str, span: float, ends: tuple[_ChangedModels, _ChangedModels]) -> UncertainRange:
    """Return the range of one column between the ends of its span."""
    tried = tuple(span * np.isfinite(end.rises).all() for end in ends)
    (low, first_low), (high, first_high) = (path.place(end) for end in ends)
    kept = [_kept_share(path.allocation, end) for end in ends]
    return UncertainRange(
        column=column,
        tried=(-tried[0], tried[1]),
        same=(-tried[0] * low, tried[1] * high),
        first=(first_low, first_high),
        kept=(-tried[0] * kept[0], tried[1] * kept[1]),
    )


def _kept_share(allocation: ZoneAllocation, end: _ChangedModels) -> float:
    """Return up to which share of the way to an end the chosen design keeps every requirement [-]."""
    if not np.isfinite(end.rises).all():
        return 0.0
    chosen = allocation.chosen

    def beyond(stack: Stack) -> float:
        return float(stack.load(chosen.scales, chosen.settings)) - stack.budget

    # At the start what was verified, at the end what the real model adds.
    missed = [side.excess - beyond(own) for side, own in zip(chosen.constraints, allocation.stacks, strict=True)]

    def excess(share: float) -> float:
        sides = zip(missed, allocation.stacks, end.stacks, strict=True)
        return max(start + beyond(_between(here, there, share)) for start, here, there in sides)

    from scipy.optimize import bisect

    if excess(0.0) > 0:
        return 0.0
    return 1.0 if excess(1.0) <= 0 else float(bisect(excess, 0.0, 1.0, xtol=_FOUND))


def _least_favourable(
    slopes: Float[np.ndarray, "column stack"],
    covariance: Float[np.ndarray, "column column"],
    allocation: ZoneAllocation,
) -> Float[np.ndarray, " column"] | None:
    """Return the change that brings a requirement furthest beyond its limit, none where nothing moves any."""
    spreads = np.sqrt(np.maximum(np.einsum("is,ij,js->s", slopes, covariance, slopes), 0.0))
    if not np.isfinite(spreads).all() or not spreads.any():
        return None
    pairs = zip(allocation.chosen.constraints, spreads.tolist(), strict=True)
    reached = [(own.excess + COVERED * by) / own.scale for own, by in pairs]
    at = int(np.argmax(np.where(spreads > 0, reached, -np.inf)))
    return np.asarray(COVERED * covariance @ slopes[:, at] / spreads[at])


def _variant(verifier: Verifier, allocation: ZoneAllocation, moved: _ChangedModels, name: str) -> Variant:
    """Return the answer of a changed model."""
    named = f"{name}, least favourable within {COVERED:g} standard uncertainties"
    problem, optimum = verifier.space.problem(moved.stacks), allocation.inside
    found = process_choice.allocate(problem) if np.isfinite(moved.rises).all() else None
    if not isinstance(found, Solution):  # no units answer, or no zones keep the limits
        return Variant(name=named, scales=np.full(optimum.zones.size, np.nan), cost=np.nan, regret=np.nan, kept=False)
    cost = problem.cost(found.zones, found.processes) + allocation.locked_cost
    kept = _kept_share(allocation, moved) == 1.0
    regret = (optimum.cost + allocation.locked_cost) / cost - 1 if kept else np.nan
    return Variant(name=named, scales=found.zones, cost=cost, regret=regret, kept=kept)
