"""Zones of grades and preferred numbers, and round amounts: proven on the local models, then verified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, product

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.search.lower_bound import COUNTS, division_bounds, least_cost
from tolalloc.allocation.search.multiple_choice import MultipleChoice, best_choice
from tolalloc.allocation.search.zone_allocation import ROUNDING, aimed, kept_stacks
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.joint_yield import JointCheck
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Shared, Stack
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier, cheapest_met
from tolalloc.drawings.ladder import Ladder, group_ladder
from tolalloc.drawings.tolerance_table import with_zones
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.settings import DrawnAmounts

MOST_NODES = 10_000
"""Nodes of branch and bound for one proof, a limit that is the same on every machine [-]."""

_CUTS = 8
"""Cuts of boxes of divisions of the failures, each of which solves two choices [-]."""
_ROUNDING = 1e-9
"""What a zone or a value of a grid may lose between units [-]."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """A zone that a feature may get, made by one of its processes."""

    process: int  # Position of the process [-]
    zone: float  # The zone [unit of the zone]
    label: str  # Its name on the drawing
    cost: float  # Its cost with the fixed part and the quality loss [cost units]


def feature_options(
    feature: PricedFeature, zones: Float[np.ndarray, " step"], labels: Sequence[str]
) -> tuple[Option, ...]:
    """Return every step of a ladder made by every process of a feature that can hold it.

    Notes
    -----
    cost = A + c(t) + loss·t² of every step t within the range of the process (own derivation) [cost units].
    """
    options = tuple(
        Option(
            process=at,
            zone=float(zone),
            label=label,
            cost=float(process.total(np.asarray(zone))) + feature.loss * float(zone) ** 2,
        )
        for at, process in enumerate(feature.processes)
        for zone, label in zip(zones, labels, strict=True)
        if process.minimum * (1 - _ROUNDING) <= zone <= process.maximum * (1 + _ROUNDING)
    )
    if not options:
        ranges = ", ".join(f"{process.minimum:g}–{process.maximum:g}" for process in feature.processes)
        allowed = f"a ladder with a step that a process holds ({ranges})"
        raise InputError.at(f"feature {feature.name}", "zones", zones.tolist(), allowed)
    return options


@dataclass(frozen=True, kw_only=True)
class DiscreteSolution:
    """One option of every feature and values of the shared variables, with what proves how good they are."""

    options: tuple[Option, ...]  # The chosen option of every feature
    shared: Float[np.ndarray, " shared"]  # Values of the shared variables [unit of the variable]
    cost: float  # Cost [cost units]
    bound: float  # Lower bound on the cost of every allowed choice, infinite where none is allowed [cost units]

    @property
    def zones(self) -> Float[np.ndarray, " feature"]:
        """Zone of every feature [unit of the zone]."""
        return np.array([option.zone for option in self.options])

    @property
    def processes(self) -> Int[np.ndarray, " feature"]:
        """Position of the chosen process of every feature [-]."""
        return np.array([option.process for option in self.options])

    @property
    def gap(self) -> float:
        """Cost over its lower bound, minus one [-]."""
        return self.cost / self.bound - 1 if self.cost != self.bound else 0.0


@dataclass(frozen=True, kw_only=True)
class DiscreteProblem:
    """An allocation problem in which every feature takes one of its options."""

    problem: AllocationProblem  # Features, stacks and shared variables
    options: tuple[tuple[Option, ...], ...]  # Options of every feature; a locked one has a single option
    # Values that every shared variable may take; those outside its bounds are left out
    grids: tuple[Float[np.ndarray, " _value"], ...] = ()

    def __post_init__(self) -> None:
        features, names = self.problem.features, self.problem.shared.names
        if len(self.options) != len(features) or len(self.grids) != len(names):
            counts = (len(self.options), len(self.grids))
            allowed = f"one of each for {len(features)} features and {len(names)} shared variables"
            raise InputError.at("discrete allocation", "number of option lists and grids", counts, allowed)
        for feature, options in zip(features, self.options, strict=True):
            if not options:
                raise InputError.at(f"feature {feature.name}", "options", "an empty list", "one option or more")
        for name, grid, inside in zip(names, self.grids, self._inside, strict=True):
            if not inside.size:
                raise InputError.at(f"shared variable {name}", "grid", grid.tolist(), "a value inside its bounds")

    @property
    def _inside(self) -> list[Float[np.ndarray, " _value"]]:
        """The values of every grid that lie inside the bounds."""
        shared = self.problem.shared
        bounds = zip(self.grids, shared.lower, shared.upper, strict=True)
        return [grid[(grid >= lower - _ROUNDING) & (grid <= upper + _ROUNDING)] for grid, lower, upper in bounds]

    @cached_property
    def _points(self) -> Float[np.ndarray, "point shared"]:
        """All combinations of the values of the shared variables."""
        points = [*product(*self._inside)]
        return np.array(points, dtype=float).reshape(len(points), len(self.grids))

    @cached_property
    def _scales(self) -> Float[np.ndarray, " stack"]:
        """What every stack is divided by: its budget and the largest change with the shared variables."""
        scales = [abs(stack.budget) + np.abs(self._points @ stack.slopes).max() for stack in self._stacks]
        return np.where(np.array(scales) > 0, scales, 1.0)

    @property
    def _stacks(self) -> tuple[Stack, ...]:
        return self.problem.stacks

    @cached_property
    def _flat(self) -> tuple[Option, ...]:
        return tuple(option for options in self.options for option in options)

    @cached_property
    def _program(self) -> MultipleChoice:
        """Options of the features, group by group, and the points of the grid as one group more."""
        counts = [len(options) for options in self.options]
        points = self._points.shape[0]
        zones = np.array([option.zone for option in self._flat])
        still = np.zeros(points)
        worst_case, squares = [], []
        for stack, scale in zip(self._stacks, self._scales, strict=True):
            shift = self._points @ stack.slopes
            worst_case.append(np.concatenate([np.repeat(stack.worst_case, counts) * zones, shift]) / scale)
            squares.append(np.concatenate([np.repeat(stack.root_sum_square, counts) * zones, still]) ** 2 / scale**2)
        size = zones.size + points
        return MultipleChoice(
            group=np.repeat(np.arange(len(counts) + 1), [*counts, points]),
            cost=np.concatenate([[option.cost for option in self._flat], still]),
            worst_case=np.array(worst_case).reshape(-1, size),
            squares=np.array(squares).reshape(-1, size),
            budget=np.array([stack.budget for stack in self._stacks]) / self._scales,
        )

    def solve(self, most_nodes: int = MOST_NODES) -> DiscreteSolution | None:
        """Return the cheapest allowed choice, None where none is allowed; see `best_choice` for the nodes [-]."""
        found = best_choice(self._program, most_nodes)
        if found is None:
            return None
        taken, cost, bound = found
        return DiscreteSolution(
            options=tuple(self._flat[at] for at in taken[:-1]),
            shared=self._points[taken[-1] - len(self._flat)],
            cost=cost,
            bound=bound,
        )


_STEPS_AROUND = 4
"""Steps to either side of the free amounts that are tried; the local models are trusted no further [-]."""
_SETTLED = 0.2
"""Distance of a kept from a missed margin that ends the search [standard errors]."""
_FURTHER = (1.0, 2.0, 4.0)
"""Factors of the distance from the limits at which another choice is looked for, one after another [-]."""
_NO_STEP = 1e-9
"""Distance of a setting from its range up to which it is rounding [unit of the setting]."""


@dataclass(frozen=True, kw_only=True)
class GradedAllocation:
    """The cheapest design on the ladders."""

    space: DesignSpace  # Design variables of groups whose members share one zone
    chosen: VerifiedDesign  # The cheapest verified design, or the least violating one
    tried: tuple[VerifiedDesign, ...]  # All verified designs, the free one in this space first
    labels: tuple[str, ...]  # Name of the zone of every group on the drawing
    problem: DiscreteProblem  # Choices that the chosen design's local models let keep the limits; without locked zones
    solution: DiscreteSolution  # The cheapest of these
    least: float  # Lower bound on the cost of every such choice near by, the errors of the units counted [cost units]

    @property
    def bound(self) -> float:
        """`least` with locked zones [cost units]."""
        return self.least + self.space.locked_cost

    def with_chosen(
        self, drawn: DrawnAmounts, chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...]
    ) -> GradedAllocation:
        """Return the allocation with another choice, which was found beside those of the search."""
        return _graded(_Grid(self.space, drawn, chosen.design), chosen, (*self.tried, *tried))


def with_shared_zones(space: DesignSpace) -> DesignSpace:
    """Return the design variables of groups whose members have one zone, as a drawing that gives them one tolerance.

    Parameters
    ----------
    space
        Groups whose members keep the ratios of their zones. The shared zone is the geometric mean.

    Notes
    -----
    zone = exp(mean of ln zoneᵢ) (own derivation), which keeps the product of the zones; for zones above 0.
    """
    active = [source for source in space.errors.active if not source.locked]
    logarithms = {group: [np.log(source.zone) for source in space.members(group)] for group in space.groups}
    shared = {group: float(np.exp(np.mean(own))) for group, own in logarithms.items()}
    sources = space.errors.sources
    zones = [shared[source.dimension] if source in active else source.zone for source in sources]
    return replace(space, errors=replace(space.errors, sources=with_zones(sources, zones)))


def group_options(space: DesignSpace) -> tuple[tuple[Option, ...], ...]:
    """Return the steps of every group's ladder with the processes that hold them, over its scale.

    Parameters
    ----------
    space
        Groups whose members share one zone.
    """
    ladders = zip(space.features, group_ladders(space), space.first_zones, strict=True)
    return tuple(feature_options(feature, ladder.zones / first, ladder.labels) for feature, ladder, first in ladders)


def group_ladders(space: DesignSpace) -> tuple[Ladder, ...]:
    """Return the ladder of every group [m]."""
    return tuple(group_ladder(space.members(group)) for group in space.groups)


class _Grid:
    """The choices of a design space: steps of the ladders, and drawn amounts around those of a design."""

    def __init__(self, space: DesignSpace, drawn: DrawnAmounts, around: Float[np.ndarray, " variable"]) -> None:
        self.space, self.options, self._names = space, group_options(space), drawn.names
        self._to_setting = np.linalg.inv(drawn.by_setting)
        free = drawn.by_setting @ space.settings_of(around)
        steps = np.arange(-_STEPS_AROUND, _STEPS_AROUND + 1)
        self.amounts = tuple(
            step * np.round(amount / step) + step * steps for amount, step in zip(free, drawn.steps, strict=True)
        )
        if not self._settings.size:
            # A setting that is locked, or whose range is narrow, may leave no round amounts: they stay as they are.
            self.amounts = tuple(np.array([amount]) for amount in free)

    @property
    def _settings(self) -> Float[np.ndarray, "choice setting"]:
        """Settings of all combinations of amounts, those outside their range left out."""
        count = len(self.amounts)
        if not count:
            return np.empty((1, 0))  # a model without settings leaves the zones alone to choose
        pairs = np.array(np.meshgrid(*self.amounts)).reshape(count, -1).T @ self._to_setting.T
        low, high = self.space.shared.lower, self.space.shared.upper
        return np.asarray(pairs[np.all((pairs >= low - _NO_STEP) & (pairs <= high + _NO_STEP), axis=1)])

    def problem(self, stacks: tuple[Stack, ...]) -> DiscreteProblem:
        """Return the choice that keeps the stacks and the range of the settings."""
        shared, still = self.space.shared, np.zeros(len(self.options))
        ranges = tuple(
            Stack(
                name=f"{name}, range",
                worst_case=still,
                root_sum_square=still,
                budget=sign * bound + _NO_STEP,
                slopes=sign * row,
            )
            for name, row, low, high in zip(shared.names, self._to_setting, shared.lower, shared.upper, strict=True)
            for sign, bound in ((1.0, float(high)), (-1.0, float(low)))
        )
        by_amount = tuple(replace(stack, slopes=stack.slopes @ self._to_setting) for stack in stacks)
        around = Shared(
            names=self._names,
            lower=np.array([amounts[0] for amounts in self.amounts], float),
            upper=np.array([amounts[-1] for amounts in self.amounts], float),
        )
        problem = AllocationProblem(features=self.space.features, stacks=(*by_amount, *ranges), shared=around)
        return DiscreteProblem(problem=problem, options=self.options, grids=self.amounts)

    def design(self, found: DiscreteSolution) -> Float[np.ndarray, " variable"]:
        """Return the design of a choice."""
        return np.concatenate([found.zones, self._to_setting @ found.shared])

    def least_violating(self, stacks: tuple[Stack, ...]) -> Float[np.ndarray, " variable"]:
        """Return the tightest zones with the settings, inside their range, whose largest violation is least."""
        tightest = np.array([min(own.zone for own in options) for options in self.options])
        problem = self.space.problem(stacks)
        largest = [(problem.violation(tightest, pair) / problem.scales).max() for pair in self._settings]
        return np.append(tightest, self._settings[int(np.argmin(largest))])


def allocate_grades(verifier: Verifier, start: VerifiedDesign, steps: int) -> GradedAllocation:
    """Return the cheapest verified design on the ladders.

    Parameters
    ----------
    verifier
        Verifies designs whose groups keep the ratios of their zones.
    start
        The best of these, around which choices are looked for.
    steps
        Largest number of verified choices, 1 or more [-].

    Notes
    -----
    Every choice is the proven best one of the local models; random units verify it, and the next one is made on the
    models around it. How far inside the limits the models must aim is found by bisection, in standard errors: further
    after a choice that missed a limit, less far after one that kept them all. Where the models let no choice keep the
    limits, the one that violates them least is tried, and where that misses them again, it is the answer. A scale is
    the same factor on the shared zone as on the zones of the members, so the start keeps its scales.

    The margin is halved like any bracket, mₖ₊₁ = (missed + kept)/2 (own derivation); each choice is that of
    `best_choice`.

    Examples
    --------
    Zones a, b of 1/a and 1/b with √(a² + b²)/2 ≤ 50 µm: of R′10 50 and 80 µm are the cheapest.

    >>> from tests.builders import verifier_of_sum
    >>> verifier = verifier_of_sum(0.06, 0.08, limit=0.05)
    >>> found = allocate_grades(verifier, verifier.verify(verifier.space.uniform(1.0), "as drawn"), steps=6).chosen
    >>> (1e6 * found.space.zones(found.design)).round().tolist(), round(found.cost, 6)
    ([50.0, 80.0], 2.2)
    """
    space = with_shared_zones(verifier.space)
    own, design = replace(verifier, space=space), np.clip(start.design, space.lower, space.upper)
    grid = _Grid(space, verifier.model.drawn_amounts, design)
    tried = [own.verify(design, "graded start").evenly_divided()]
    missed, kept = -1.0, np.inf
    while len(tried) <= steps and kept - missed > _SETTLED:
        margin = missed + 1.0 if kept == np.inf else (missed + kept) / 2
        found = _cheapest(grid, tried[-1], tried, margin)
        choice = grid.design(found) if found else grid.least_violating(_inside(tried[-1], tried, margin))
        verified = next((item for item in tried[1:] if np.allclose(choice, item.design, atol=1e-6)), None)
        if verified and not verified.met and found is None:
            break  # no margin makes any other choice
        if verified is None:
            verified = own.verify(choice, f"graded {len(tried)}").evenly_divided()
            tried.append(verified)
        missed, kept = (missed, margin) if verified.met else (margin, kept)
    return _graded(grid, cheapest_met(tuple(tried[1:])), tuple(tried))


def _graded(grid: _Grid, chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...]) -> GradedAllocation:
    """Return a choice with what proves it: the cheapest by its own models of those that keep the limits."""
    problem = grid.problem(kept_stacks(chosen, tried, margin=0.0, room=ROUNDING))
    solution = problem.solve()
    if solution is None:
        raise SolveError("The choice among grades does not reproduce the design that it starts from.")
    steps = zip(grid.options, chosen.scales, strict=True)
    return GradedAllocation(
        space=grid.space,
        chosen=chosen,
        tried=tried,
        labels=tuple(min(own, key=lambda option: abs(option.zone - scale)).label for own, scale in steps),
        problem=problem,
        solution=solution,
        least=_least_cost(grid, chosen),
    )


def choice_beside(
    drawn: DrawnAmounts, verified: VerifiedDesign, tried: tuple[VerifiedDesign, ...], margin: float
) -> Float[np.ndarray, " variable"] | None:
    """Return the best other choice by the models of a tested one: as near to the limits as it may be, none if no other.

    Parameters
    ----------
    drawn
        What the drawing says of the settings.
    verified
        The choice, in a space whose groups share one zone.
    tried
        Choices beside it that correct its models.
    margin
        How far inside each limit the aim is, or further where that makes no other choice [standard errors].
    """
    grid = _Grid(verified.space, drawn, verified.design)
    for factor in _FURTHER:
        found = _cheapest(grid, verified, [*tried, verified], factor * margin)
        choice = None if found is None else grid.design(found)
        if choice is None or not np.allclose(choice, verified.design, atol=1e-6):
            return choice
    return None


def _cheapest(grid: _Grid, last: VerifiedDesign, tried: list[VerifiedDesign], margin: float) -> DiscreteSolution | None:
    """Return the cheapest choice that the models of a design let keep the limits, however they divide the failures.

    Branch and bound over the divisions (`division_bounds`): the choice that a box allows may keep all limits at once.
    """
    best, joint = grid.problem(_inside(last, tried, margin)).solve(), last.jointly
    if joint is None:
        return best
    counting = [at for at, part in enumerate(joint.joint.parts) if part > COUNTS]

    def cost(upper: Float[np.ndarray, " counting"]) -> float:
        nonlocal best
        parts = np.ones(len(joint.tails))
        parts[counting] = np.maximum(upper, np.finfo(float).tiny)
        boxed = last.divided(tuple(parts.tolist()))
        stacks = _inside(boxed, tried, margin)
        found = grid.problem(stacks).solve()
        if found is None:
            return np.inf
        if (best is None or found.cost < best.cost) and _failing(boxed, stacks, grid.design(found)) <= _allowed(joint):
            best = found
        return found.cost

    for bound in islice(division_bounds(cost, len(counting)), _CUTS if len(counting) > 1 else 0):
        if best is not None and bound >= best.cost * (1 - ROUNDING):
            break
    return best


def _allowed(joint: JointCheck) -> float:
    """Return the sum of the shares that may fail the limits [-]."""
    return joint.overlap * joint.joint.failures * (1 + ROUNDING)


def _failing(boxed: VerifiedDesign, stacks: tuple[Stack, ...], design: Float[np.ndarray, " variable"]) -> float:
    """Return the sum of the shares that models let fail the limits at another design [-]."""
    groups, joint, found, at = len(boxed.space.groups), boxed.jointly, 0.0, 0
    assert joint is not None
    for check, tail, share in zip(boxed.checks_alone, joint.tails, joint.shares, strict=True):
        own, at = stacks[at : at + len(check.steering)], at + len(check.steering)
        excess = max(float(each.load(design[:groups], design[groups:])) - each.budget for each in own)
        found += tail.share_at(excess, share)
    return found


def _inside(last: VerifiedDesign, tried: list[VerifiedDesign], margin: float) -> tuple[Stack, ...]:
    """Return the models of a design with a budget that is smaller by so many standard errors."""
    return tuple(
        replace(stack, budget=stack.budget - margin * constraint.standard_error)
        for stack, constraint in zip(aimed(last, tried), last.constraints, strict=True)
    )


def _least_cost(grid: _Grid, chosen: VerifiedDesign) -> float:
    """Return what no choice near by that keeps the limits costs less than [cost units]."""

    def cheapest(stacks: tuple[Stack, ...]) -> tuple[float, Float[np.ndarray, " variable"]] | None:
        found = grid.problem(stacks).solve()
        return (found.bound, grid.design(found)) if found else None

    def near_by(stacks: tuple[Stack, ...]) -> float:
        found = cheapest(stacks)
        return found[0] if found else np.inf

    return least_cost(chosen, cheapest, near_by)
