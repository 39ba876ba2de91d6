"""Groups of choices, one taken out of every group within budgets: the best choice, proven.

Good choices are found by exchanging two at a time; they prove nothing, but let a search leave out what is worse.

Notes
-----
The multipliers of the rows give a bound that no solver has to be trusted for: the sum over the groups
of the least of cost + multipliers·rows, less multipliers·limits. What would lift that bound above the cost of an
allowed choice cannot be part of a better one and is left out. The mixed-integer program decides the rest, again with
the rows that its answer breaks; no row excludes what is allowed, so the first allowed answer is the best, and there are
finitely many others.

The relaxation of the zeros and ones to 0 ≤ z ≤ 1 is made of linear rows, all of which hold for every allowed choice:

* where only one group adds, such as the values of the modification, the budget is known once it is chosen:
  Σ squares·z ≤ Σ (budget − worst_case)²·z over that group. The row is exact for whole z;
* with the vector of groups v(z) = Σ √squares·z, u·v ≤ ‖v‖ for every unit vector u: rows Σ worst_case·z + u·v(z) ≤
  budget at the points that the linear program wants, until it keeps all stacks;
* a choice that breaks a stack still breaks it where every group takes something that adds no less: one choice of this
  cover must be left out. Such rows have whole coefficients, so that no tolerance of a solver gets around them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_matrix

from tolalloc.allocation.search.convex_program import WholeNumbers, choose_whole_numbers
from tolalloc.exceptions import SolveError

ROUNDING = 5e-13
"""What rounding may add to a stack over its budget [-]."""

_BATCH = 1 << 15
"""Exchanges that are looked at together."""

_WORTHWHILE = 1e-12
"""Smallest saving of an exchange, over the cost of all choices [-]."""

Pairs = Int[np.ndarray, "2 pair"]
Taken = Int[np.ndarray, " group"]


@dataclass(frozen=True, kw_only=True)
class MultipleChoice:
    """Groups of choices, and what each adds to the stacks.

    With z one where a choice is taken and zero elsewhere, a stack reads Σ worst_case·z + √(Σ squares·z) ≤ budget.
    """

    group: Int[np.ndarray, " choice"]  # Group of every choice, ascending from 0 [-]
    cost: Float[np.ndarray, " choice"]  # Cost of every choice [cost units]
    worst_case: Float[np.ndarray, "stack choice"]  # What it adds to a stack, over the stack's scale [-]
    # Square of what it adds in quadrature, 0 or above, over the square of that scale [-]
    squares: Float[np.ndarray, "stack choice"]
    # Budget of every stack over its scale, which makes budgets and what is added of order one [-]
    budget: Float[np.ndarray, " stack"]

    @cached_property
    def starts(self) -> Int[np.ndarray, " group"]:
        """Position of the first choice of every group."""
        return np.flatnonzero(np.diff(self.group, prepend=-1))

    @cached_property
    def undominated(self) -> Bool[np.ndarray, " choice"]:
        """Choices beside which no other of their group costs no more and adds no more to any stack."""
        burden = np.concatenate([self.cost[np.newaxis], self.worst_case, self.squares])
        kept = np.ones(self.cost.size, dtype=bool)
        for at in range(self.cost.size):
            rivals = np.flatnonzero((self.group == self.group[at]) & kept)
            rivals = rivals[rivals != at]
            kept[at] = not np.all(burden[:, rivals] <= burden[:, [at]], axis=0).any()
        return kept

    def restricted(self, kept: Bool[np.ndarray, " choice"]) -> MultipleChoice:
        """Return the program with some of the choices, at least one of every group."""
        return replace(
            self,
            group=self.group[kept],
            cost=self.cost[kept],
            worst_case=self.worst_case[:, kept],
            squares=self.squares[:, kept],
        )

    def violation(self, taken: Int[np.ndarray, " group"]) -> Float[np.ndarray, " stack"]:
        """Return by how much every stack exceeds its budget, Σ worst_case + √Σ squares − budget, over its scale [-]."""
        spread = np.sqrt(self.squares[:, taken].sum(axis=1))
        return np.asarray(self.worst_case[:, taken].sum(axis=1) + spread - self.budget)

    def allows(self, taken: Int[np.ndarray, " group"]) -> bool:
        """Return whether every stack stays within its budget."""
        return bool(np.all(self.violation(taken) <= ROUNDING))

    @cached_property
    def possible(self) -> Bool[np.ndarray, " choice"]:
        """Choices that keep every stack beside the least that all other groups may add to it."""
        worst_case = np.minimum.reduceat(self.worst_case, self.starts, axis=1)
        squares = np.minimum.reduceat(self.squares, self.starts, axis=1)
        least_worst_case = worst_case.sum(axis=1, keepdims=True) + self.worst_case - worst_case[:, self.group]
        least_squares = squares.sum(axis=1, keepdims=True) + self.squares - squares[:, self.group]
        violation = least_worst_case + np.sqrt(np.maximum(least_squares, 0.0)) - self.budget[:, np.newaxis]
        return np.asarray(np.all(violation <= 2 * ROUNDING, axis=0))


def exchanged(program: MultipleChoice, values: Float[np.ndarray, " choice"]) -> Taken:
    """Return choices that no exchange of two improves: less violation first, then less cost.

    The exchanges start from the dearest of the choices of which the relaxation takes some value [-].

    An exchange of two of groups a and b changes the cost by Δa + Δb < 0 (own derivation); it need not end at the best.
    """
    liking = np.where(values > 1e-9, program.cost + 1e-9 * (1.0 + np.ptp(program.cost)) * values, -np.inf)
    parts = np.split(liking, program.starts[1:])
    taken: Taken = program.starts + np.array([part.argmax() for part in parts])
    pairs = np.stack(np.nonzero(program.group[:, np.newaxis] < program.group))
    while True:
        better = (_cheaper if program.allows(taken) else _repaired)(program, taken, pairs)
        if better is None:
            return taken
        taken = better


def _violations(program: MultipleChoice, taken: Taken, pairs: Pairs) -> Iterator[Float[np.ndarray, "stack some"]]:
    """Give the violations after every exchange, batch by batch [-]."""
    own = taken[program.group]
    tables = [
        (table[:, taken].sum(axis=1)[:, np.newaxis], table - table[:, own])
        for table in (program.worst_case, program.squares)
    ]
    for one, other in (pairs[:, start : start + _BATCH] for start in range(0, pairs.shape[1], _BATCH)):
        worst_case, squares = (total + change[:, one] + change[:, other] for total, change in tables)
        yield worst_case + np.sqrt(np.maximum(squares, 0.0)) - program.budget[:, np.newaxis]


def _after(program: MultipleChoice, taken: Taken, pair: Int[np.ndarray, " 2"]) -> Taken:
    """Return the choices after an exchange."""
    better = taken.copy()
    better[program.group[pair]] = pair
    return better


def _cheaper(program: MultipleChoice, taken: Taken, pairs: Pairs) -> Taken | None:
    """Return the allowed exchange that saves most."""
    change = (program.cost - program.cost[taken[program.group]])[pairs].sum(axis=0)
    saving = np.flatnonzero(change < -_WORTHWHILE * np.abs(program.cost).sum())
    pairs = pairs[:, saving[np.argsort(change[saving], kind="stable")]]
    first = 0
    for violation in _violations(program, taken, pairs):
        allowed = np.flatnonzero(np.all(violation <= ROUNDING / 2, axis=0))  # sums of changes round otherwise
        if allowed.size:
            return _after(program, taken, pairs[:, first + allowed[0]])
        first += violation.shape[1]
    return None


def _repaired(program: MultipleChoice, taken: Taken, pairs: Pairs) -> Taken | None:
    """Return the exchange that leaves the least violation, if that is less than now."""
    left = [np.maximum(violation, 0.0).sum(axis=0) for violation in _violations(program, taken, pairs)]
    excess = np.concatenate(left) if left else np.array([np.inf])
    least = int(excess.argmin())
    if excess[least] >= np.maximum(program.violation(taken), 0.0).sum() * (1 - 1e-9):
        return None
    return _after(program, taken, pairs[:, least])


COSTS = 1e4
"""Largest cost that a solver sees, far above its own tolerances, which are absolute."""

RELAXED = 1e-9
"""How far linear rows are moved outwards, so that a choice that just keeps its budget is not lost [-]."""


class ChoiceRows:
    """Rows and their limits; costs are scaled for the solvers."""

    def __init__(self, program: MultipleChoice) -> None:
        spent = np.maximum.reduceat(np.abs(program.cost), program.starts).sum()
        self.program, self.scale = program, COSTS / spent if spent else 1.0
        self.cost = program.cost * self.scale
        choices = np.arange(self.cost.size)
        self.one_each = csr_matrix((np.ones(choices.size), (program.group, choices)))
        self._rows: list[Float[np.ndarray, " choice"]] = []
        self._limits: list[float] = []
        for stack in range(program.budget.size):
            self._add_exact(stack)

    @property
    def matrix(self) -> Float[np.ndarray, "row choice"]:
        """All rows."""
        return np.array(self._rows).reshape(len(self._rows), self.cost.size)

    @property
    def limits(self) -> Float[np.ndarray, " row"]:
        """Limits of all rows."""
        return np.array(self._limits)

    @property
    def relaxed_limits(self) -> Float[np.ndarray, " row"]:
        """Limits moved outwards."""
        return np.asarray(self.limits + RELAXED * np.maximum(np.abs(self.limits), 1.0))

    def add(self, row: Float[np.ndarray, " choice"], limit: float) -> None:
        """Add a row with its limit."""
        self._rows.append(row)
        self._limits.append(limit)

    def _add_exact(self, stack: int) -> None:
        """Add the row that is exact for whole numbers, if the stack has one."""
        program = self.program
        worst_case, squares, budget = program.worst_case[stack], program.squares[stack], program.budget[stack]
        worst_case_groups = np.unique(program.group[worst_case != 0])
        if not squares.any():
            self.add(worst_case, float(budget))
        elif worst_case_groups.size == 0:
            self.add(squares, float(budget**2))
        elif worst_case_groups.size == 1:
            own = program.group == worst_case_groups[0]
            largest = np.max((budget - worst_case[own]) ** 2) or 1.0  # the row is of order one, like all others
            self.add((squares - np.where(own, (budget - worst_case) ** 2, 0.0)) / largest, 0.0)

    def add_tangents(self, values: Float[np.ndarray, " choice"], allowed: float) -> bool:
        """Add a tangent for every stack that a point of the relaxation breaks by more than allowed [-], if any."""
        program, before = self.program, len(self._rows)
        for worst_case, squares, budget in zip(program.worst_case, program.squares, program.budget, strict=True):
            roots = np.sqrt(squares)
            vector = np.add.reduceat(roots * values, program.starts)
            length = float(np.linalg.norm(vector))
            if length and worst_case @ values + length > budget + allowed:
                self.add(worst_case + (vector / length)[program.group] * roots, float(budget))
        return len(self._rows) > before

    def add_covers(self, taken: Int[np.ndarray, " group"]) -> None:
        """Exclude a choice that is not allowed, and all that add no less to a stack that it breaks."""
        program = self.program
        for stack in np.flatnonzero(program.violation(taken) > ROUNDING):
            worst_case, squares = program.worst_case[stack], program.squares[stack]
            own = taken[program.group]
            cover = ((worst_case >= worst_case[own]) & (squares >= squares[own])).astype(float)
            free = np.minimum.reduceat(cover, program.starts) > 0  # whatever such a group takes, the stack is broken
            self.add(np.where(free[program.group], 0.0, cover), float(np.count_nonzero(~free)) - 1.0)

    def exclude(self, taken: Int[np.ndarray, " group"]) -> None:
        """Add all rows that a choice breaks."""
        self.add_covers(taken)
        self.add_tangents((taken[self.program.group] == np.arange(self.cost.size)).astype(float), ROUNDING)


_SETTLED = 1e-4
"""Violation up to which the linear program's answer keeps a stack [-]."""

_CUTS = 30
"""Largest number of linear programs."""

ProvenChoice = tuple[Int[np.ndarray, " group"], float, float]
"""What is taken out of every group, its cost, and a lower bound on the cost of every allowed choice [cost units]."""


def best_choice(program: MultipleChoice, most_nodes: int) -> ProvenChoice | None:
    """Return the best choice, None where no choice is allowed.

    min Σ cost·z with Σ worst_case·z + √(Σ squares·z) ≤ budget and one z = 1 in every group: the module's notes. Branch
    and bound: Land & Doig 1960, Econometrica 28, 497–520.

    After so many nodes of the mixed-integer programs together [-] it is the best allowed one so far with its bound.

    """
    kept = program.undominated & program.possible
    if np.unique(program.group[kept]).size < program.starts.size:
        return None
    found = _ChoiceSearch(program.restricted(kept), most_nodes).run()
    return found and (np.flatnonzero(kept)[found[0]], *found[1:])


class _ChoiceSearch:
    """What is known of the best choice of a program."""

    def __init__(self, program: MultipleChoice, most_nodes: int) -> None:
        self.program, self.rows, self.nodes_left = program, ChoiceRows(program), most_nodes
        self.best: Int[np.ndarray, " group"] | None = None
        self.cost, self.bound = np.inf, -np.inf

    def run(self) -> ProvenChoice | None:
        """Return the best choice, None where no choice is allowed."""
        values, multipliers = self._relaxation()
        lift = self._lift(multipliers)
        self._offer(exchanged(self.program, values))
        kept = self.bound + lift <= self.cost + RELAXED * COSTS
        is_infeasible = False
        while self.nodes_left > 0 and not is_infeasible:
            found, taken = self._decided(kept)
            self.bound = max(self.bound, min(found.bound, self.cost))
            is_infeasible = found.is_infeasible
            if is_infeasible:
                self.bound = self.cost
            elif taken is None or self._offer(taken) or not found.is_optimal:
                break
            else:
                self.rows.exclude(taken)
        if self.best is None:
            if is_infeasible:
                return None
            raise SolveError("No choice that keeps every stack was found within the nodes allowed; allow more of them.")
        cost = float(self.program.cost[self.best].sum())
        return self.best, cost, min(self.bound / self.rows.scale, cost)

    def _offer(self, taken: Int[np.ndarray, " group"]) -> bool:
        """Keep a choice if it is allowed and the cheapest so far; return whether it is allowed."""
        allowed, cost = self.program.allows(taken), float(self.rows.cost[taken].sum())
        if allowed and cost < self.cost:
            self.best, self.cost = taken, cost
        return allowed

    def _relaxation(self) -> tuple[Float[np.ndarray, " choice"], Float[np.ndarray, " row"]]:
        """Return the answer and the multipliers of the linear program with tangents, which keeps all stacks."""
        from scipy.optimize import linprog

        rows = self.rows
        for _ in range(_CUTS):
            found = linprog(
                rows.cost, rows.matrix, rows.limits, rows.one_each, np.ones(self.program.starts.size), method="highs-ds"
            )
            if found.status != 0:
                return np.zeros_like(rows.cost), np.zeros(rows.limits.size)
            if not rows.add_tangents(found.x, _SETTLED):
                break
        return found.x, np.maximum(-found.ineqlin.marginals, 0.0)

    def _lift(self, multipliers: Float[np.ndarray, " row"]) -> Float[np.ndarray, " choice"]:
        """Take the bound of the multipliers, and return by how much every choice would lift it [scaled cost units]."""
        count = multipliers.size
        value = self.rows.cost + multipliers @ self.rows.matrix[:count]
        least = np.minimum.reduceat(value, self.program.starts)
        self.bound = float(least.sum() - multipliers @ self.rows.limits[:count])
        return np.asarray(value - least[self.program.group])

    def _decided(self, kept: Bool[np.ndarray, " choice"]) -> tuple[WholeNumbers, Int[np.ndarray, " group"] | None]:
        """Return what the mixed-integer program of the choices that are left says, and which choices it takes."""
        rows, columns = self.rows, np.flatnonzero(kept)
        found = choose_whole_numbers(
            rows.cost[columns],
            csr_matrix(rows.matrix[:, columns]),
            rows.relaxed_limits,
            rows.one_each[:, columns],
            self.nodes_left,
        )
        self.nodes_left -= max(found.nodes, 1)
        if found.values is None:
            return found, None
        starts = np.searchsorted(columns, rows.program.starts)
        parts = np.split(found.values, starts[1:])
        return found, columns[starts + np.array([part.argmax() for part in parts])]
