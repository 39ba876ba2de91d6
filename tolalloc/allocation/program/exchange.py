"""Good choices found by exchanging two at a time; they prove nothing, but let a search leave out what is worse."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.program.multiple_choice import ROUNDING, MultipleChoice

_BATCH = 1 << 15
"""Exchanges that are looked at together."""

_WORTHWHILE = 1e-12
"""Smallest saving of an exchange, over the cost of all choices [-]."""

Pairs = Int[np.ndarray, "2 pair"]
Taken = Int[np.ndarray, " group"]


def exchanged(program: MultipleChoice, values: Float[np.ndarray, " choice"]) -> Taken:
    """Return choices that no exchange of two improves: less violation first, then less cost.

    Parameters
    ----------
    program
        The groups and their choices.
    values
        How much of every choice the relaxation takes; the dearest of those is where the exchanges start [-].
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
