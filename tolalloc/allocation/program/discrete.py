"""Zones from ladders: one option of every feature at the least cost, proven, with shared variables on a grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.program.choice_search import ProvenChoice, best_choice
from tolalloc.allocation.program.multiple_choice import MultipleChoice
from tolalloc.allocation.program.problem import AllocationProblem, PricedFeature, Stack
from tolalloc.exceptions import InputError

MOST_NODES = 10_000
"""Nodes of branch and bound for one proof, a limit that is the same on every machine [-]."""

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

    Raises
    ------
    InputError
        No process of the feature can hold a step.
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
    # Budget that every stack has left, below zero where it is broken [unit of the stack]
    slack: Float[np.ndarray, " stack"]
    tightest: str  # The stack with the least slack over its scale; where stacks are broken, the one that blocks most

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
    """An allocation problem in which every feature takes one of its options.

    Raises
    ------
    InputError
        A feature without an option, or a grid without a value inside the bounds.
    """

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
        return self._solution(best_choice(self._program, most_nodes))

    def least_violating(self) -> DiscreteSolution:
        """Return the choice whose largest violation over the stack's scale is least, which names the blocking stack.

        Notes
        -----
        The tightest options of all features load every stack least, whatever the shared variables are, so only the
        points of the grid have to be compared.
        """
        program = self._program
        tightest = [min(options, key=lambda option: (option.zone, option.cost)) for options in self.options]
        ends = [0, *np.cumsum([len(options) for options in self.options])]
        taken = [
            start + options.index(option) for start, options, option in zip(ends, self.options, tightest, strict=False)
        ]
        grid = range(program.starts[-1], program.cost.size)
        best = min(
            (np.array([*taken, at]) for at in grid), key=lambda own: float(program.violation(own).max(initial=-1))
        )
        cost = float(program.cost[best].sum())
        found = self._solution((best, cost, cost if program.allows(best) else np.inf))
        assert found
        return found

    def _solution(self, choice: ProvenChoice | None) -> DiscreteSolution | None:
        if choice is None:
            return None
        taken, cost, bound = choice
        options = tuple(self._flat[at] for at in taken[:-1])
        shared = self._points[taken[-1] - len(self._flat)]
        violation = self.problem.violation(np.array([option.zone for option in options]), shared)
        names = [stack.name for stack in self._stacks]
        return DiscreteSolution(
            options=options,
            shared=shared,
            cost=cost,
            bound=bound,
            slack=-violation,
            tightest=names[int((violation / self._scales).argmax())] if names else "",
        )
