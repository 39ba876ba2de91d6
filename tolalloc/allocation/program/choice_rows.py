"""Linear rows that hold for every allowed choice: the relaxation of a multiple-choice program.

Notes
-----
The relaxation of the zeros and ones to 0 ≤ z ≤ 1 is made of linear rows, all of which hold for every allowed choice:

* where only one group adds, such as the values of the modification, the budget is known once it is chosen:
  Σ squares·z ≤ Σ (budget − worst_case)²·z over that group. The row is exact for whole z;
* where several groups add and some add in quadrature, √(Σ squares·z) lies above its chord over a section of its range.
  The range follows from the other rows and from the cost of an allowed choice; which section holds is one group more;
* with the vector of groups v(z) = Σ √squares·z, u·v ≤ ‖v‖ for every unit vector u: rows Σ worst_case·z + u·v(z) ≤
  budget at the points that the linear program wants, until it keeps all stacks;
* a choice that breaks a stack still breaks it where every group takes something that adds no less: one choice of this
  cover must be left out. Such rows have whole coefficients, so that no tolerance of a solver gets around them.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_matrix

from tolalloc.allocation.program.multiple_choice import ROUNDING, MultipleChoice

COSTS = 1e4
"""Largest cost that a solver sees, far above its own tolerances, which are absolute."""

RELAXED = 1e-9
"""How far linear rows are moved outwards, so that a choice that just keeps its budget is not lost [-]."""


class ChoiceRows:
    """Rows and their limits; costs are scaled for the solvers."""

    def __init__(self, program: MultipleChoice) -> None:
        spent = np.maximum.reduceat(np.abs(program.cost), program.starts).sum()
        self.scale = COSTS / spent if spent else 1.0
        self._rows: list[Float[np.ndarray, " choice"]] = []
        self._limits: list[float] = []
        self._set_up(program)
        self.mixed = [stack for stack in range(program.budget.size) if not self._add_exact(stack)]

    def _set_up(self, program: MultipleChoice) -> None:
        """Take what follows from the program alone."""
        self.program = program
        self.cost = program.cost * self.scale
        choices = np.arange(self.cost.size)
        self.one_each = csr_matrix((np.ones(choices.size), (program.group, choices)))

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

    def _add(self, row: Float[np.ndarray, " choice"], limit: float) -> None:
        self._rows.append(row)
        self._limits.append(limit)

    def _add_exact(self, stack: int) -> bool:
        """Add the row that is exact for whole numbers, if the stack has one."""
        program = self.program
        worst_case, squares, budget = program.worst_case[stack], program.squares[stack], program.budget[stack]
        worst_case_groups = np.unique(program.group[worst_case != 0])
        if not squares.any():
            self._add(worst_case, float(budget))
        elif worst_case_groups.size == 0:
            self._add(squares, float(budget**2))
        elif worst_case_groups.size == 1:
            own = program.group == worst_case_groups[0]
            largest = np.max((budget - worst_case[own]) ** 2) or 1.0  # the row is of order one, like all others
            self._add((squares - np.where(own, (budget - worst_case) ** 2, 0.0)) / largest, 0.0)
        else:
            return False
        return True

    def add_tangents(self, values: Float[np.ndarray, " choice"], allowed: float) -> bool:
        """Add a tangent for every stack that a point of the relaxation breaks by more than allowed [-], if any."""
        program, before = self.program, len(self._rows)
        for worst_case, squares, budget in zip(program.worst_case, program.squares, program.budget, strict=True):
            roots = np.sqrt(squares)
            vector = np.add.reduceat(roots * values, program.starts)
            length = float(np.linalg.norm(vector))
            if length and worst_case @ values + length > budget + allowed:
                self._add(worst_case + (vector / length)[program.group] * roots, float(budget))
        return len(self._rows) > before

    def add_covers(self, taken: Int[np.ndarray, " group"]) -> None:
        """Exclude a choice that is not allowed, and all that add no less to a stack that it breaks."""
        program = self.program
        for stack in np.flatnonzero(program.violation(taken) > ROUNDING):
            worst_case, squares = program.worst_case[stack], program.squares[stack]
            own = taken[program.group]
            cover = ((worst_case >= worst_case[own]) & (squares >= squares[own])).astype(float)
            free = np.minimum.reduceat(cover, program.starts) > 0  # whatever such a group takes, the stack is broken
            self._add(np.where(free[program.group], 0.0, cover), float(np.count_nonzero(~free)) - 1.0)

    def exclude(self, taken: Int[np.ndarray, " group"]) -> None:
        """Add all rows that a choice breaks."""
        self.add_covers(taken)
        self.add_tangents((taken[self.program.group] == np.arange(self.cost.size)).astype(float), ROUNDING)

    def add_chord(self, stack: int, start: float, end: float) -> None:
        """Add the chord of a stack's root sum of squares between two of its values [-]."""
        self._add(*self._chord(stack, start, end))

    def _chord(self, stack: int, start: float, end: float) -> tuple[Float[np.ndarray, " choice"], float]:
        """Return the row of a stack with the chord of its root between two values."""
        slope = 1.0 / (start + end)
        row = self.program.worst_case[stack] + slope * self.program.squares[stack]
        return row, float(self.program.budget[stack] - start + slope * start**2)

    def add_sections(self, stack: int, ends: Float[np.ndarray, " end"]) -> None:
        """Add a group whose choice says between which ends a stack's root sum of squares lies, and the chords there."""
        program, sections = self.program, ends.size - 1
        chords = [self._chord(stack, *pair) for pair in pairwise(ends.tolist())]
        none, nothing = np.zeros(sections), np.zeros((program.budget.size, sections))
        larger = replace(
            program,
            group=np.append(program.group, np.full(sections, program.starts.size)),
            cost=np.append(program.cost, none),
            worst_case=np.hstack([program.worst_case, nothing]),
            squares=np.hstack([program.squares, nothing]),
        )
        self._set_up(larger)
        self._rows = [np.append(row, none) for row in self._rows]
        self._add(np.append(program.squares[stack], -(ends[1:] ** 2)), 0.0)
        self._add(np.append(-program.squares[stack], ends[:-1] ** 2), 0.0)
        for at, (row, limit) in enumerate(chords):
            # Beside its section a chord may lie above the root by as much as it does at the ends of the range.
            slope = 1.0 / (ends[at] + ends[at + 1])
            above = float(np.max((ends[[0, -1]] - ends[at]) * (slope * (ends[[0, -1]] + ends[at]) - 1.0)))
            self._add(np.append(row, np.where(np.arange(sections) == at, above, 0.0)), limit + above)
