"""The best choice out of every group, proven.

Notes
-----
The multipliers of the rows of `choice_rows` give a bound that no solver has to be trusted for: the sum over the groups
of the least of cost + multipliers·rows, less multipliers·limits. What would lift that bound above the cost of an
allowed choice cannot be part of a better one and is left out. The mixed-integer program decides the rest, again with
the rows that its answer breaks; no row excludes what is allowed, so the first allowed answer is the best, and there are
finitely many others.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_matrix

from tolalloc.allocation.program.choice_rows import COSTS, RELAXED, ChoiceRows
from tolalloc.allocation.program.multiple_choice import MultipleChoice, exchanged
from tolalloc.exceptions import SolveError

_SLACK = 1e-6
"""What the smallest and largest sums of squares are widened by, above the linear program's own tolerance [-]."""

_SETTLED = 1e-4
"""Violation up to which the linear program's answer keeps a stack [-]."""

_CUTS = 30
"""Largest number of linear programs."""

_SECTIONS = 4
"""Sections of the range of a root sum of squares."""


@dataclass(frozen=True, kw_only=True)
class ProvenChoice:
    """What is taken out of every group, with the proof.

    Parameters
    ----------
    taken
        Position of the choice of every group [-].
    cost
        Its cost [cost units].
    bound
        Lower bound on the cost of every allowed choice [cost units].
    """

    taken: Int[np.ndarray, " group"]
    cost: float
    bound: float


def best_choice(program: MultipleChoice, most_nodes: int) -> ProvenChoice | None:
    """Return the best choice, None where no choice is allowed.

    After so many nodes of the mixed-integer programs together [-] it is the best allowed one so far with its bound.

    Raises
    ------
    SolveError
        No allowed choice was found within these nodes, or the solver gave up.
    """
    kept = program.undominated & program.possible
    if np.unique(program.group[kept]).size < program.starts.size:
        return None
    found = _ChoiceSearch(program.restricted(kept), most_nodes).run()
    return found and replace(found, taken=np.flatnonzero(kept)[found.taken])


class _ChoiceSearch:
    """What is known of the best choice of a program."""

    def __init__(self, program: MultipleChoice, most_nodes: int) -> None:
        self.program, self.rows, self.nodes_left = program, ChoiceRows(program), most_nodes
        self.best: Int[np.ndarray, " group"] | None = None
        self.cost, self.bound = np.inf, -np.inf

    def run(self) -> ProvenChoice | None:
        """Return the best choice, None where no choice is allowed."""
        import cvxpy as cp

        values, multipliers = self._relaxation()
        lift = self._lift(multipliers)
        self._offer(exchanged(self.program, values))
        kept = self._divide(self.bound + lift <= self.cost + RELAXED * COSTS)
        status = cp.USER_LIMIT
        while self.nodes_left > 0:
            taken, proven, status = self._decide(kept)
            self.bound = max(self.bound, min(proven, self.cost))
            if status == cp.INFEASIBLE:
                self.bound = self.cost
                break
            if taken is None or self._offer(taken) or status != cp.OPTIMAL:
                break
            self.rows.exclude(taken)
        if self.best is None and status != cp.INFEASIBLE:
            raise SolveError("No choice that keeps every stack was found within the nodes allowed; allow more of them.")
        if self.best is None:
            return None
        cost = float(self.program.cost[self.best].sum())
        return ProvenChoice(taken=self.best, cost=cost, bound=min(self.bound / self.rows.scale, cost))

    def _offer(self, taken: Int[np.ndarray, " any_group"]) -> bool:
        """Keep a choice if it is allowed and the cheapest so far; return whether it is allowed."""
        own = taken[: self.program.starts.size]
        allowed, cost = self.program.allows(own), float(self.rows.cost[own].sum())
        if allowed and cost < self.cost:
            self.best, self.cost = own, cost
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

    def _divide(self, kept: Bool[np.ndarray, " choice"]) -> Bool[np.ndarray, " more"]:
        """Add the chords of every stack that several groups add to; return what is kept, with the sections.

        Notes
        -----
        The range that is divided starts from the chord over a first one.
        """
        for stack in self.rows.mixed:
            first = self._range(stack, kept)
            if first is None:
                continue
            self.rows.add_chord(stack, *first)
            second = self._range(stack, kept) or first
            self.rows.add_sections(stack, np.linspace(*second, _SECTIONS + 1))
            kept = np.append(kept, np.ones(_SECTIONS, dtype=bool))
        return kept

    def _range(self, stack: int, kept: Bool[np.ndarray, " more"]) -> tuple[float, float] | None:
        """Return the least and largest root sum of squares of what may be cheaper, None where nothing is to divide."""
        from scipy.optimize import linprog

        rows, limits = self.rows.matrix, self.rows.relaxed_limits
        if self.cost < np.inf:
            rows = np.vstack([rows, self.rows.cost / COSTS])
            limits = np.append(limits, self.cost / COSTS + RELAXED)
        ends = []
        for sign in (1.0, -1.0):
            found = linprog(
                sign * self.rows.program.squares[stack],
                rows,
                limits,
                self.rows.one_each,
                np.ones(self.rows.program.starts.size),
                np.stack([np.zeros(kept.size), kept], axis=1),
            )
            if found.status != 0:
                return None
            ends.append(float(np.sqrt(max(sign * (found.fun - _SLACK), 0.0))))
        return ends[0], ends[1]

    def _decide(self, kept: Bool[np.ndarray, " more"]) -> tuple[Int[np.ndarray, " any_group"] | None, float, str]:
        """Return the answer of the mixed-integer program, its bound and its status."""
        import cvxpy as cp

        rows, columns = self.rows, np.flatnonzero(kept)
        z = cp.Variable(columns.size, boolean=True)
        keep = csr_matrix(rows.matrix[:, columns]) @ z <= rows.relaxed_limits
        program = cp.Problem(cp.Minimize(rows.cost[columns] @ z), [keep, rows.one_each[:, columns] @ z == 1])
        options = {
            "mip_rel_gap": 0.0,
            "mip_abs_gap": 0.0,
            "presolve": "off",  # the rows are few and tight already
            "mip_max_nodes": self.nodes_left,
        }
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Solution may be inaccurate")  # out of nodes, which the status says
            try:
                program.solve(solver=cp.HIGHS, highs_options=options)
            except cp.SolverError as error:
                raise SolveError(f"The mixed-integer program of the allocation was given up: {error}") from error
        stats = program.solver_stats.extra_stats
        self.nodes_left -= max(int(stats.mip_node_count), 1)
        if z.value is None:
            return None, -np.inf, program.status
        starts = np.searchsorted(columns, rows.program.starts)
        parts = np.split(z.value, starts[1:])
        taken = columns[starts + np.array([part.argmax() for part in parts])]
        return taken, float(stats.mip_dual_bound), program.status
