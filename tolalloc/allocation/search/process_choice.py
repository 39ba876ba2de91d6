"""Which process makes every feature: branch and bound over all choices, proven by the Lagrange dual."""

from __future__ import annotations

import heapq
import pickle
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.allocation.search.convex_program import ConvexProgram
from tolalloc.allocation.search.lagrange_dual import LagrangeDual, PricedProcesses, ascend
from tolalloc.allocation.space.problem import AllocationProblem, LeastInfeasible, Solution, least_infeasible
from tolalloc.exceptions import SolveError

_GAP = 1e-9
"""Share of the cost by which a choice that is left out could be cheaper at most [-]."""

Allowed = Bool[np.ndarray, " process"]


def allocate(problem: AllocationProblem, most_nodes: int = 500) -> Solution | LeastInfeasible:
    """Return the cheapest choice of processes and zones with a bound over all choices, or what violates stacks least.

    After so many nodes [-] the search ends with what it has; the gap of the solution says what is left.

    References
    ----------
    K. W. Chase, W. H. Greenwood, B. G. Loosli, L. F. Hauglund, Least cost tolerance allocation for mechanical
    assemblies with automated process selection, Manuf. Rev. 3 (1990) 49–59, for the problem; A. H. Land, A. G. Doig,
    Econometrica 28 (1960) 497–520, for branch and bound.

    Examples
    --------
    A bore that is bored down to 5 or ground down to 1, at most 4 wide:

    >>> from tolalloc.allocation.cost.model import Process, Reciprocal
    >>> from tolalloc.allocation.space.problem import PricedFeature, Stack
    >>> bored = Process(name="bored", cost=Reciprocal(factor=8.0), minimum=5.0, maximum=20.0)
    >>> ground = Process(name="ground", cost=Reciprocal(fixed=1.0, factor=12.0), minimum=1.0, maximum=9.0)
    >>> stack = Stack(name="play", worst_case=np.ones(1), root_sum_square=np.zeros(1), budget=4.0)
    >>> bore = PricedFeature(name="bore", processes=(bored, ground))
    >>> found = allocate(AllocationProblem(features=(bore,), stacks=(stack,)))
    >>> found.processes, round(found.cost, 6), round(found.bound, 6)
    (array([1]), 4.0, 4.0)
    """
    return _BranchAndBound(problem).answer(most_nodes)


class BudgetSeries:
    """Allocations of one problem at other budgets of its stacks.

    Each begins with the processes and the prices of the one before: neighbours are mostly made alike, and a program
    that is compiled takes other budgets.

    Parameters
    ----------
    problem
        The allocation; its own budgets are not used.
    """

    def __init__(self, problem: AllocationProblem) -> None:
        self.problem = problem
        self._before: _BranchAndBound | None = None

    def allocate(self, budgets: Float[np.ndarray, " stack"], most_nodes: int = 500) -> Solution | LeastInfeasible:
        """Return what `allocate` finds for other budgets [unit of each stack].

        Examples
        --------
        A bore that costs 12/zone, at most 4 and at most 2 wide:

        >>> from tolalloc.allocation.cost.model import Process, Reciprocal
        >>> from tolalloc.allocation.space.problem import PricedFeature, Stack
        >>> ground = Process(name="ground", cost=Reciprocal(factor=12.0), minimum=1.0, maximum=9.0)
        >>> stack = Stack(name="play", worst_case=np.ones(1), root_sum_square=np.zeros(1), budget=0.0)
        >>> bore = PricedFeature(name="bore", processes=(ground,))
        >>> series = BudgetSeries(AllocationProblem(features=(bore,), stacks=(stack,)))
        >>> [round(series.allocate(np.array([budget])).cost, 6) for budget in (4.0, 2.0)]
        [3.0, 6.0]
        """
        pairs = zip(self.problem.stacks, budgets.tolist(), strict=True)
        stacks = tuple(replace(stack, budget=budget) for stack, budget in pairs)
        self._before = _BranchAndBound(replace(self.problem, stacks=stacks), self._before)
        return self._before.answer(most_nodes)


def second_best(problem: AllocationProblem, best: Solution, most_nodes: int = 500) -> Solution | None:
    """Return the cheapest design made by another set of processes than the best, or None if no other keeps the stacks.

    Sets that differ only in which of several alike features takes which process count as one. The search ends with what
    it has after so many nodes [-].

    Branch and bound over all sets but one: Lawler 1972, Management Science 18, 401–405.
    """
    search = _BranchAndBound(problem)
    others, free = [], np.ones(search.dual.feature.size, dtype=bool)
    for at, chosen in enumerate(search.dual.starts + best.processes):
        differently = free.copy()
        differently[chosen] = False
        others.append(differently)
        free[search.dual.feature == at] = False
        free[chosen] = True
    return search.cheapest(others, most_nodes)


class _BranchAndBound:
    """Best-first branch and bound; every multiplier ever tried bounds every node.

    A search of the same features and stacks at another budget hands over what it compiled and what it found.
    """

    def __init__(self, problem: AllocationProblem, before: _BranchAndBound | None = None) -> None:
        self.problem, self.dual, self._alike = problem, LagrangeDual(problem), _alike_features(problem)
        self._tried: list[PricedProcesses] = []
        self._solved: dict[tuple[int, ...], Solution | None] = {}
        self._programs: dict[tuple[int, ...], ConvexProgram] = before._programs if before else {}
        self._best: Solution | None = None
        zones = np.array([feature.processes[0].maximum for feature in problem.features])
        self._add([self.dual.price(self.dual.span / problem.scales, self.dual.planes(zones))])
        if before and before._best:
            top, _ = before._best_tried(np.ones(self.dual.feature.size, dtype=bool))
            self._add([self.dual.price(top.prices, top.planes)])
            self._try(before._best.processes)

    @property
    def _enough(self) -> float:
        """Bound from which on a node cannot hold anything cheaper [cost units]."""
        return np.inf if self._best is None else self._best.cost - _GAP * abs(self._best.cost)

    def answer(self, most_nodes: int) -> Solution | LeastInfeasible:
        """Return the cheapest design of all, or what violates the stacks least."""
        best = self.cheapest([np.ones(self.dual.feature.size, dtype=bool)], most_nodes)
        if best is not None:
            return best
        closest = least_infeasible(self.problem)
        if closest.feasible:
            raise SolveError(f"No design was found within {most_nodes} nodes, though there are some.")
        return closest

    def cheapest(self, nodes: Iterable[Allowed], most_nodes: int) -> Solution | None:
        """Return the cheapest design within the nodes, None if there is none."""
        open_nodes = [(-np.inf, at, allowed) for at, allowed in enumerate(nodes)]
        count, closed = len(open_nodes), [np.inf]
        while open_nodes and open_nodes[0][0] < self._enough and most_nodes > 0:
            most_nodes -= 1
            allowed = _ordered(self._alike, heapq.heappop(open_nodes)[2])
            if not self._possible(allowed):
                continue
            bound, children = self._opened(allowed)
            if not children:
                closed.append(bound)
            for child in children:
                count += 1
                heapq.heappush(open_nodes, (bound, count, child))
        if self._best is None:
            return None
        return replace(self._best, bound=min(*closed, *(bound for bound, _, _ in open_nodes), self._best.cost))

    def _opened(self, allowed: Allowed) -> tuple[float, list[Allowed]]:
        """Return the bound of a node, and its children unless it is done with."""
        top, bound = self._top(allowed)
        if bound >= self._enough:
            return bound, []
        choice = self.dual.choice(top, allowed)
        alone = np.zeros_like(allowed)
        alone[choice] = True
        solution = self._try(choice - self.dual.starts) if np.array_equal(_ordered(self._alike, alone), alone) else None
        if np.array_equal(alone, allowed):
            return (np.inf if solution is None else max(bound, solution.bound)), []
        return bound, self._children(top, allowed)

    def _top(self, allowed: Allowed) -> tuple[PricedProcesses, float]:
        """Return the best multipliers of a node and their bound, tried until the node is seen to be too dear."""
        start, bound = self._best_tried(allowed)
        if bound >= self._enough:
            return start, bound
        self._add(ascend(self.dual, start, allowed, self._enough)[1:])
        return self._best_tried(allowed)

    def _best_tried(self, allowed: Allowed) -> tuple[PricedProcesses, float]:
        """Return the multipliers that bound a node best among all that were ever tried, and their bound."""
        least = np.minimum.reduceat(np.where(allowed, self._least, np.inf), self.dual.starts, axis=1)
        bounds = least.sum(axis=1) + [priced.constant for priced in self._tried]
        at = int(np.argmax(bounds))
        return self._tried[at], float(bounds[at])

    def _add(self, tried: list[PricedProcesses]) -> None:
        """Remember multipliers."""
        self._tried += tried
        self._least = np.stack([priced.least for priced in self._tried])

    def _try(self, processes: Int[np.ndarray, " feature"]) -> Solution | None:
        """Solve for one choice of processes, unless that is done already, and keep the cheapest design."""
        key = tuple(processes.tolist())
        if key not in self._solved:
            if key not in self._programs:
                made = ConvexProgram(self.problem.features, processes, len(self.problem.stacks), self.problem.shared)
                self._programs[key] = made
            found = self._solved[key] = self._programs[key].solve(self.problem.stacks)
            if found is not None:
                self._add([self.dual.price(found.prices, self.dual.planes(found.zones))])
                if self._best is None or found.cost < self._best.cost:
                    self._best = found
        return self._solved[key]

    def _children(self, top: PricedProcesses, allowed: Allowed) -> list[Allowed]:
        """Return one node per process of the feature whose processes are hardest to tell apart."""
        least = [np.sort(part) for part in np.split(np.where(allowed, top.least, np.inf), self.dual.starts[1:])]
        regret = [part[1] - part[0] if part.size > 1 else np.inf for part in least]
        own = self.dual.feature == int(np.argmin(regret))
        children = []
        for process in np.flatnonzero(own & allowed):
            child = allowed & ~own
            child[process] = True
            children.append(child)
        return children

    def _possible(self, allowed: Allowed) -> bool:
        """Return whether a design made by allowed processes keeps all stacks."""
        parts = np.split(allowed, self.dual.starts[1:])
        if not all(part.any() for part in parts):
            return False
        features = tuple(
            replace(feature, processes=tuple(made for made, free in zip(feature.processes, part, strict=True) if free))
            for feature, part in zip(self.problem.features, parts, strict=True)
        )
        return least_infeasible(replace(self.problem, features=features)).feasible


def _alike_features(problem: AllocationProblem) -> list[list[slice]]:
    """Return where the processes of features stand that have the same processes, loss and loads, bit by bit.

    Who of them takes which process makes no difference.
    """
    groups: dict[bytes, list[slice]] = defaultdict(list)
    start = 0
    for at, feature in enumerate(problem.features):
        made = [(own.cost, own.minimum, own.maximum, own.change) for own in feature.processes]
        loads = [(float(stack.worst_case[at]), float(stack.root_sum_square[at])) for stack in problem.stacks]
        groups[pickle.dumps((made, loads, feature.loss))].append(slice(start, start + len(made)))
        start += len(made)
    return [group for group in groups.values() if len(group) > 1]


def _ordered(groups: list[list[slice]], allowed: Allowed) -> Allowed:
    """Return the allowed processes less those that no choice in ascending order within the groups contains."""
    left = allowed.copy()
    for group in groups:
        first = 0
        for own in group:
            left[own][:first] = False
            first = int(np.argmax(left[own]))
        last = left[group[-1]].size
        for own in reversed(group):
            left[own][last:] = False
            last = left[own].size - int(np.argmax(left[own][::-1]))
    return left
