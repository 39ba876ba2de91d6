"""What a search keeps around a verified design, and the cheapest design there by its own units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.convex_program import ConvexProgram
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.excess_quantile import ExcessQuantile
from tolalloc.allocation.space.problem import OneSidedConstraint, Solution, Stack
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.capability.halving import halved
from tolalloc.exceptions import SolveError

SETTLED, _PAYS = 0.01, 0.003
"""Relative gain of cost below which a common factor of all zones, and another process, are not worth a change [-]."""
REACH_OF_MODELS = 1.25
"""Ratio of zones up to which designs share their models [-]."""
LARGEST_LOG = float(np.log(REACH_OF_MODELS)) + 1e-9
REACH_OF_SETTINGS = 1.0
"""Difference of settings, over ten steps of theirs, up to which they do [-]."""
_ROUNDS, _LEAST_REACH, _LONGER = 60, 1.01, 1.5
"""Convex programs of one step at most, the ratio of zones below which no further one is solved, and the power of it by
which a better one lets the next reach further [-]."""
_REFUSED = 4
"""Refused answers, the latest ones, whose models the following programs of a step keep too [-]."""
_KEPT = 0.002
"""Excess up to which a limit counts as kept within a step, over the deviation of its output [-]."""
_MOST_LACKING, _MOST_DRAWN_IN, _HALVINGS = 0.02, 0.1, 12
"""Part of the zones that it may be worth at most, the same of a refused answer, and how often that is halved to find it
[-]."""
_LESS = 0.95
"""Part of the excess that a convex program must leave where a limit is not kept, for its answer to be better [-]."""
_SETTLED_WITHIN = 1e-4
"""Relative gain of cost of a convex program below which a step ends [-]."""

_LEAST_ERROR = 0.01
"""Standard error over the largest of those beside it below which it counts no more [-]."""

Box = tuple[Float[np.ndarray, " variable"], Float[np.ndarray, " variable"]]
"""Smallest and largest value of every variable."""


class Programs:
    """The convex programs of a design space, one for each choice of processes and number of stacks, compiled once."""

    def __init__(self, space: DesignSpace) -> None:
        self.space = space
        self._compiled: dict[tuple[int, ...], ConvexProgram] = {}

    def of(self, processes: Int[np.ndarray, " group"], stacks: int) -> ConvexProgram:
        """Return the program of the processes at the given positions and of so many stacks."""
        key = (stacks, *processes.tolist())
        if key not in self._compiled:
            self._compiled[key] = ConvexProgram(self.space.features, processes, stacks, self.space.shared)
        return self._compiled[key]

    def choose(self, stacks: tuple[Stack, ...], present: Int[np.ndarray, " group"]) -> Int[np.ndarray, " group"]:
        """Return the processes that the models prefer; the present ones stay unless another choice clearly pays.

        Parameters
        ----------
        stacks
            Local models with the budget that is aimed at.
        present
            Position of the present process of every group [-].
        """
        if not self.space.has_choices:
            return present
        best = process_choice.allocate(self.space.problem(stacks))
        kept = self.of(present, len(stacks)).solve(stacks)
        if kept is not None and isinstance(best, Solution) and best.cost > (1 - _PAYS) * kept.cost:
            return present
        return best.processes

    def box(self, processes: Int[np.ndarray, " group"], around: Float[np.ndarray, " variable"], reach: float) -> Box:
        """Return how far variables may change by a factor from a design, as far as their ranges go.

        Near zero the reach of a setting is that of a tenth of its range.
        """
        groups, shared, features = len(self.space.groups), self.space.shared, self.space.features
        made = [feature.processes[at] for feature, at in zip(features, processes, strict=True)]
        least, most = (np.array(ends) for ends in zip(*((own.minimum, own.maximum) for own in made), strict=True))
        low, high = (np.clip(around[:groups] * by, least, most) for by in (1 / reach, reach))
        centre = np.clip(around[groups:], shared.lower, shared.upper)
        size = np.maximum(np.abs(centre), 0.1 * (shared.upper - shared.lower))
        return (
            np.append(low, np.maximum(shared.lower, centre - size * (1 - 1 / reach))),
            np.append(high, np.minimum(shared.upper, centre + size * (reach - 1))),
        )

    def cheapest(
        self, stacks: tuple[Stack, ...], processes: Int[np.ndarray, " group"], box: Box
    ) -> Float[np.ndarray, " variable"]:
        """Return the cheapest design in a box, or the one there that violates the stacks least."""
        program, groups = self.of(processes, len(stacks)), len(self.space.groups)
        near = replace(self.space.shared, lower=box[0][groups:], upper=box[1][groups:])
        asked = (stacks, box[0][:groups], box[1][:groups], near)
        found = program.solve(*asked) or program.least_infeasible(*asked)
        return np.asarray(np.concatenate([found.zones, found.shared]))

    def step(
        self,
        steering: Steering,
        processes: Int[np.ndarray, " group"],
        around: Float[np.ndarray, " variable"],
        reach: float,
    ) -> Float[np.ndarray, " variable"]:
        """Return the cheapest design near another one that what steers the search lets keep the limits.

        Parameters
        ----------
        steering
            What the limits are there.
        processes
            Position of the process of every group [-].
        around
            A design.
        reach
            Factor by which variables may change, as far as their ranges go [-].

        Notes
        -----
        Convex programs one after another, each around the best design so far. Where the units say of an answer that it
        is not better, cheaper where all limits are kept, less beyond them where one is not, the next one reaches half
        as far, in logarithms, and keeps the models around the refused one too, as a cutting plane; after a better one
        half as far again. Where all of them are refused, one may still be cheaper with its zones smaller by what it
        lacks.
        """
        low, high = self.box(processes, around, reach)
        start = np.clip(around, low, high)
        centre, within, refused, beside = start, reach, list[Stack](), [start]
        excess, cost = steering.excess(centre), float(self.space.cost(centre))
        for _ in range(_ROUNDS):
            own_low, own_high = self.box(processes, centre, within)
            box = np.maximum(low, own_low), np.minimum(high, own_high)
            kept = steering.around(centre)
            # As many stacks in every round, so that the program is compiled once.
            count = _REFUSED * len(steering.quantiles)
            others = [*refused, *(count * kept[:1])][:count]
            try:
                found = self.cheapest((*kept, *others), processes, box)
            except SolveError:  # refused answers that are nearly one may leave a solver no way
                refused, within = [], float(np.sqrt(within))
                if within < _LEAST_REACH:
                    break
                continue
            beyond, price = steering.excess(found), float(self.space.cost(found))
            cheaper = excess > _KEPT or price < (1 - _SETTLED_WITHIN) * cost
            if beyond <= max(_KEPT, _LESS * excess) and cheaper:
                centre, excess, cost, within = found, beyond, price, min(reach, within**_LONGER)
                continue
            refused = [*steering.of_units(found), *refused]
            beside.append(found)
            within = float(np.sqrt(within))
            if within < _LEAST_REACH or not steering.quantiles:
                break
        if centre is not start or excess > _KEPT:
            return self._inside(centre, steering, _MOST_LACKING) if excess <= _KEPT else centre
        drawn_in = (self._inside(own, steering, _MOST_DRAWN_IN) for own in beside)
        return min((own for own in drawn_in if steering.excess(own) <= 0.0), key=self.space.cost, default=start)

    def _inside(
        self, design: Float[np.ndarray, " variable"], steering: Steering, most: float
    ) -> Float[np.ndarray, " variable"]:
        """Return a design with its zones smaller by what it lacks of what it must keep, by a part at most."""
        groups = len(self.space.groups)
        if steering.excess(design) <= 0.0:
            return design

        def smaller(by: float) -> Float[np.ndarray, " variable"]:
            return np.append(np.maximum(design[:groups] * (1 - by), self.space.lower[:groups]), design[groups:])

        return smaller(float(halved(lambda by: steering.excess(smaller(by)) <= 0.0, most, 0.0, _HALVINGS)))


@dataclass(frozen=True, kw_only=True)
class Steering:
    """What a search keeps around a verified design: quantiles of units, and stacks of what no units decide."""

    groups: int  # Number of scales [-]
    quantiles: tuple[ExcessQuantile, ...]  # 0 or below where limits are kept
    stacks: tuple[Stack, ...]
    scales: tuple[float, ...]  # What an excess of a stack is compared with [unit of the stack]

    def around(self, design: Float[np.ndarray, " variable"]) -> tuple[Stack, ...]:
        """Return convex models around a design."""
        return (*(stack for own in self.quantiles for stack in own.stacks(design, self.groups)), *self.stacks)

    def moved_out(self, most: float) -> Steering:
        """Return the same with quantiles as far out again as they lie beyond their limits, up to so much [-]."""
        return replace(self, quantiles=tuple(own.moved_out(min(max(own.level, 0.0), most)) for own in self.quantiles))

    def of_units(self, design: Float[np.ndarray, " variable"]) -> tuple[Stack, ...]:
        """Return convex models around a design of what units decide."""
        return tuple(own.stacks(design, self.groups)[0] for own in self.quantiles)

    def excess(self, design: Float[np.ndarray, " variable"]) -> float:
        """Return how far a design lies beyond what it must keep, over the deviation or the scale of an output [-]."""
        zones, settings = design[: self.groups], design[self.groups :]
        stacks = [
            (float(own.load(zones, settings)) - own.budget) / scale
            for own, scale in zip(self.stacks, self.scales, strict=True)
        ]
        return max([own(design)[0] for own in self.quantiles] + stacks, default=-np.inf)


def steering(last: VerifiedDesign, tried: Sequence[VerifiedDesign], margin: float = 1.0) -> Steering:
    """Return what a search keeps around a verified design.

    Parameters
    ----------
    tried
        It and all designs before it.
    margin
        How far inside each limit the aim is [standard errors].

    Notes
    -----
    The values of a few thousand units are uncertain by a percent or two, so a search aims one standard error inside
    each limit. Where the units of the last design also explain other ones near by, their mean deviation from them
    corrects them, each with the weight of its standard error, so the noise averages out.

    level′ = level + margin·standard error + mean deviation (own derivation) [-].
    """
    similar = explained_by(last, tried)
    beside, quantiles = last.beside_quantiles, []
    for at, own in enumerate(last.quantiles):
        told = [(*item.quantiles[at].counted_as(own), own(item.design)[0]) for item in similar]
        off = [level - foreseen for level, _, foreseen in told]
        quantiles.append(own.moved_out(margin * own.error + _mean(off, [error for _, error, _ in told])))
    return Steering(
        groups=len(last.space.groups),
        quantiles=tuple(quantiles),
        stacks=aimed_stacks(beside, [(item.design, item.beside_quantiles) for item in similar], margin),
        scales=tuple(side.scale for side in beside),
    )


def explained_by(last: VerifiedDesign, tried: Iterable[VerifiedDesign]) -> list[VerifiedDesign]:
    """Return the designs near by that the units of a verified one explain too."""
    return [item for item in tried if is_similar(item, last) and _is_alike(item, last)]


def aimed_stacks(
    sides: Sequence[OneSidedConstraint],
    similar: Sequence[tuple[Float[np.ndarray, " variable"], Sequence[OneSidedConstraint]]],
    margin: float,
) -> tuple[Stack, ...]:
    """Return local models of constraints with the budget to aim at.

    Parameters
    ----------
    sides
        Constraints of a verified design.
    similar
        Designs near by, itself among them, and the same constraints there.
    margin
        How far inside each limit the aim is [standard errors].

    Notes
    -----
    budget′ = budget − margin·standard error − mean deviation (own derivation) [unit of the output]; the law of a linear
    output has no deviation.
    """
    stacks = []
    for at, side in enumerate(sides):
        off = [float(found[at].predicted(design) - side.predicted(design)) for design, found in similar]
        deviation = 0.0 if side.law else _mean(off, [found[at].standard_error for _, found in similar])
        stacks.append(replace(side.stack, budget=side.stack.budget - margin * side.standard_error - deviation))
    return tuple(stacks)


def _mean(off: Sequence[float], errors: Sequence[float]) -> float:
    """Return the mean of what designs say, each with the weight of its standard error; zero without one."""
    if not off:
        return 0.0
    least = (max(errors) or 1.0) * _LEAST_ERROR  # none errs where no units are asked
    return float(np.average(off, weights=1 / np.maximum(errors, least) ** 2))


def is_similar(first: VerifiedDesign, second: VerifiedDesign) -> bool:
    """Return whether the models of one verified design are believed of another one."""
    scales = np.abs(np.log(first.scales / second.scales)).max(initial=0.0)
    moved = np.abs(first.settings - second.settings) / (10 * first.space.setting_steps)
    return bool(scales <= LARGEST_LOG and moved.max(initial=0.0) <= REACH_OF_SETTINGS)


def explains(last: VerifiedDesign, new: VerifiedDesign, errors: float) -> bool:
    """Return whether the units of a design predicted what those of the next one said, within so many errors of both."""
    if not _is_alike(last, new):
        return False
    told = ((before, *now.counted_as(before)) for before, now in zip(last.quantiles, new.quantiles, strict=True))
    quantiles = (
        abs(level - before(new.design)[0]) <= errors * np.hypot(before.error, error) for before, level, error in told
    )
    sides = (
        abs(now.excess - before.predicted(new.design)) <= errors * np.hypot(before.standard_error, now.standard_error)
        for before, now in zip(last.beside_quantiles, new.beside_quantiles, strict=True)
    )
    return all(quantiles) and all(sides)


def _is_alike(first: VerifiedDesign, second: VerifiedDesign) -> bool:
    """Return whether two designs are steered alike: where zones are small, an output may be linear that is not one."""
    return len(first.quantiles) == len(second.quantiles) and len(first.beside_quantiles) == len(second.beside_quantiles)
