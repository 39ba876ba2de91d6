"""Groups of choices: one is taken out of every group, and sums and root sums of squares stay within their budgets.

Good choices are found by exchanging two at a time; they prove nothing, but let a search leave out what is worse.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

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
        """Return by how much every stack exceeds its budget, over its scale [-]."""
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
