"""Zones of grades and preferred numbers, and round modification amounts: proven on the local models, then verified."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.grade.ladder import Ladder, group_ladder
from tolalloc.allocation.program.discrete import DiscreteProblem, DiscreteSolution, feature_options
from tolalloc.allocation.program.problem import AllocationProblem, Shared, Stack
from tolalloc.allocation.trust_region import aimed, kept_stacks
from tolalloc.allocation.verification import VerifiedDesign, Verifier, answer
from tolalloc.uncertainty.tolerance_table import with_zones

AMOUNT_STEP = 0.5
"""Step of the modification amounts on a drawing [µm]."""
_STEPS_AROUND = 4
"""Steps to either side of the free amounts that are tried; the local models are trusted no further [-]."""
_AMOUNTS = ("equidistant Δr_rp [µm]", "shift Δr_p [µm]")
_SECONDS = 20.0
"""Longest time for one proof [s]."""
_SETTLED = 0.2
"""Distance of a kept from a missed margin that ends the search [standard errors]."""


@dataclass(frozen=True, kw_only=True)
class GradedAllocation:
    """The cheapest design on the ladders.

    Parameters
    ----------
    space
        Design variables of groups whose members share one zone.
    chosen
        The cheapest verified design, or the least violating one.
    tried
        All verified designs, the free one in this space first.
    labels
        Name of the zone of every group on the drawing.
    solution
        Cheapest choice that the chosen design's local models let keep the limits as the chosen one does, with its
        proven bound; without locked zones.
    """

    space: DesignSpace
    chosen: VerifiedDesign
    tried: tuple[VerifiedDesign, ...]
    labels: tuple[str, ...]
    solution: DiscreteSolution

    @property
    def bound(self) -> float:
        """Lower bound on the cost of every such choice [cost units]."""
        return self.solution.bound + self.space.locked_cost


def with_shared_zones(space: DesignSpace) -> DesignSpace:
    """Return the design variables of groups whose members have one zone, as a drawing that gives them one tolerance.

    Parameters
    ----------
    space
        Groups whose members keep the ratios of their zones. The shared zone is the geometric mean.
    """
    active = [source for source in space.errors.active if not source.locked]
    shared = {
        group: float(np.exp(np.mean([np.log(source.zone) for source in active if source.group == group])))
        for group in space.groups
    }
    sources = space.errors.sources
    zones = [shared[source.group] if source in active else source.zone for source in sources]
    return replace(space, errors=replace(space.errors, sources=with_zones(sources, zones)))


def group_ladders(space: DesignSpace) -> tuple[Ladder, ...]:
    """Return the ladder of every group [m].

    Raises
    ------
    InputError
        No step lies in the range of every member.
    """
    active = [source for source in space.errors.active if not source.locked]
    return tuple(group_ladder([source for source in active if source.group == group]) for group in space.groups)


class _Grid:
    """The choices of a design space: steps of the ladders, and modification amounts around those of a design."""

    def __init__(self, space: DesignSpace, ladders: tuple[Ladder, ...], around: Float[np.ndarray, " variable"]) -> None:
        self.space = space
        first = {group: next(s.zone for s in space.errors.active if s.group == group) for group in space.groups}
        self.options = tuple(
            feature_options(feature, ladder.zones / first[feature.name], ladder.labels)
            for feature, ladder in zip(space.features, ladders, strict=True)
        )
        self._by_clearance = space.modification_by_clearance
        free = self._amounts(around[-2:])
        # A locked modification stays as the reducer has it, however round it is.
        held = np.all(space.shared.lower == space.shared.upper)
        steps = np.zeros(1) if held else AMOUNT_STEP * np.arange(-_STEPS_AROUND, _STEPS_AROUND + 1)
        round_free = free if held else AMOUNT_STEP * np.round(free / AMOUNT_STEP)
        self.amounts = tuple(amount + steps for amount in round_free)

    def _amounts(self, clearances: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 2"]:
        """Return the modification amounts of clearances, both in micrometres."""
        return np.asarray(self._by_clearance @ clearances)

    def problem(self, stacks: tuple[Stack, ...]) -> DiscreteProblem:
        """Return the choice that keeps the stacks and the range of the clearances."""
        to_clearance = np.linalg.inv(self._by_clearance)
        shared, still = self.space.shared, np.zeros(len(self.options))
        ranges = [
            Stack(name=f"{name}, range", adding=still, spreading=still, room=sign * bound, slopes=sign * row)
            for name, row, low, high in zip(shared.names, to_clearance, shared.lower, shared.upper, strict=True)
            for sign, bound in ((1.0, float(high)), (-1.0, float(low)))
        ]
        held = [replace(stack, room=stack.room + 1e-9) for stack in ranges]
        by_amount = [replace(stack, slopes=stack.slopes @ to_clearance) for stack in stacks]
        around = Shared(
            names=_AMOUNTS,
            lower=np.array([amounts[0] for amounts in self.amounts]),
            upper=np.array([amounts[-1] for amounts in self.amounts]),
        )
        problem = AllocationProblem(features=self.space.features, stacks=(*by_amount, *held), shared=around)
        return DiscreteProblem(problem=problem, options=self.options, grids=self.amounts)

    def design(self, found: DiscreteSolution) -> Float[np.ndarray, " variable"]:
        """Return the design of a choice."""
        return np.concatenate([found.zones, np.linalg.inv(self._by_clearance) @ found.shared])


def allocate_grades(verifier: Verifier, start: VerifiedDesign, steps: int) -> GradedAllocation:
    """Return the cheapest verified design on the ladders.

    Parameters
    ----------
    verifier
        Judges designs whose groups keep the ratios of their zones.
    start
        The best of these, around which choices are looked for.
    steps
        Largest number of verified choices [-].

    Raises
    ------
    InputError
        A zone that has no step of its ladder between min and max.

    Notes
    -----
    Every choice is the proven best one of the local models; fresh units judge it, and the next one is made on the
    models around it. How far inside the limits the models must aim is found by bisection, in standard errors: further
    after a choice that missed a limit, less far after one that kept them all.
    """
    space = with_shared_zones(verifier.space)
    own, ladders = replace(verifier, space=space), group_ladders(space)
    design = np.append(np.clip(start.design[:-2], space.lower[:-2], space.upper[:-2]), start.design[-2:])
    grid, tried = _Grid(space, ladders, design), [own.verify(design, "graded start")]
    missed, kept = -1.0, np.inf
    while len(tried) <= steps and kept - missed > _SETTLED:
        margin = missed + 1.0 if kept == np.inf else (missed + kept) / 2
        problem = grid.problem(_inside(tried[-1], tried, margin))
        found = problem.solve(_SECONDS) or problem.least_overloaded()
        choice = grid.design(found)
        judged = next((item for item in tried[1:] if np.allclose(choice, item.design, atol=1e-6)), None)
        if judged is None:
            judged = own.verify(choice, f"graded {len(tried)}")
            tried.append(judged)
        missed, kept = (missed, margin) if judged.met else (margin, kept)
    chosen = answer(tuple(tried[1:]))
    return GradedAllocation(
        space=space,
        chosen=chosen,
        tried=tuple(tried),
        labels=_labels(grid, chosen),
        solution=_proof(grid, chosen, tuple(tried)),
    )


def _inside(last: VerifiedDesign, tried: list[VerifiedDesign], margin: float) -> tuple[Stack, ...]:
    """Return the models of a design with a room that is smaller by so many standard errors."""
    return tuple(
        replace(stack, room=stack.room - margin * side.doubt)
        for stack, side in zip(aimed(last, tried), last.sides, strict=True)
    )


def _labels(grid: _Grid, chosen: VerifiedDesign) -> tuple[str, ...]:
    """Return the name of every zone of a choice."""
    return tuple(
        min(options, key=lambda option: abs(option.zone - scale)).label
        for options, scale in zip(grid.options, chosen.design, strict=False)
    )


def _proof(grid: _Grid, chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...]) -> DiscreteSolution:
    """Return the cheapest choice that keeps the limits as the chosen one does, by its own models."""
    problem = grid.problem(
        tuple(replace(stack, room=stack.room + 1e-9 * abs(stack.room)) for stack in kept_stacks(chosen, tried))
    )
    return problem.solve(_SECONDS) or problem.least_overloaded()
