"""Programs that cvxpy solves: the convex one of a choice of processes, compiled once, and choices of whole numbers."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.cost.model import Expression, by_form
from tolalloc.allocation.search.lagrange_dual import cost_bound, require_convex
from tolalloc.allocation.space.problem import (
    AllocationProblem,
    LeastInfeasible,
    PricedFeature,
    Shared,
    Solution,
    Stack,
    least_infeasible,
)
from tolalloc.exceptions import SolveError

_REFINED = {"iterative_refinement_max_iter": 50, "iterative_refinement_reltol": 1e-14}
_SHORTER = {"equilibrate_enable": False, "max_step_fraction": 0.8, "max_iter": 1000}
_ATTEMPTS: tuple[tuple[float, float, float, dict[str, float]], ...] = (
    # Gap, violation, both where it may stop if it must [-]; what else is set: rows unscaled, every linear system solved
    # more exactly, shorter steps
    (1e-12, 1e-10, 1e-8, {}),
    (1e-9, 1e-9, 1e-8, {}),
    (1e-9, 1e-9, 1e-8, {"equilibrate_enable": False}),
    (1e-8, 1e-8, 1e-8, {}),
    (1e-9, 1e-9, 1e-8, _REFINED),
    (1e-9, 1e-9, 1e-8, _SHORTER),
    (1e-8, 1e-8, 1e-6, {}),
)
"""What the solver aims at first, on the scaled program, and then where rounding keeps it from that."""
_NEGLIGIBLE = 1e-6
"""Part of a stack's largest root-sum-square term below which a term is left out: only its square counts [-]."""
_ENOUGH = 1e-10
"""Gap below which the certificate is not polished further [-]."""


_StackParameters = tuple[Any, Any, Any, Any]
"""Worst case, root sum square, slopes and budget of a stack over its scale, zones over their units, as cvxpy has them.
"""


class ConvexProgram:
    """Least cost [cost units] of given processes with every stack in its budget, theory page equation (26).

    Parameters
    ----------
    processes
        Position of the process of every feature.
    stacks
        Number of stacks that every solve brings.
    shared
        Variables that belong to no feature.

    Notes
    -----
    Convex where all costs are; stacks are as good as their local model. Zones are counted in the geometric middle of
    their process's range, stacks in their budget, costs in what they change there, so the solver sees numbers of order
    one whatever the unit. The stacks and all bounds are parameters: cvxpy compiles once.
    """

    def __init__(
        self, features: Sequence[PricedFeature], processes: Int[np.ndarray, " feature"], stacks: int, shared: Shared
    ) -> None:
        import cvxpy as cp

        self.features, self.shared, self.processes = tuple(features), shared, processes
        self._made = tuple(feature.processes[at] for feature, at in zip(features, processes, strict=True))
        self.lower = np.array([process.minimum for process in self._made])
        self.upper = np.array([process.maximum for process in self._made])
        self._units = np.sqrt(self.lower * self.upper)
        losses = np.array([feature.loss for feature in features]) * self._units**2
        slopes = [float(made.cost.slope(np.array(unit))) for made, unit in zip(self._made, self._units, strict=True)]
        self._cost_scale = float(np.abs(slopes) @ self._units + losses.sum()) or 1.0
        count, shares = len(self.features), len(shared.names)
        self._zones, self._shared = cp.Variable(count, pos=True), cp.Variable(shares)
        self._bounds = [cp.Parameter(count) for _ in range(2)] + [cp.Parameter(shares) for _ in range(2)]
        self._stacks: list[_StackParameters] = [
            (cp.Parameter(count, nonneg=True), cp.Parameter(count, nonneg=True), cp.Parameter(shares), cp.Parameter())
            for _ in range(stacks)
        ]
        for feature, process in zip(features, self._made, strict=True):
            require_convex(f"feature {feature.name}", process)
        rescaled = [made.rescaled(unit).cost for made, unit in zip(self._made, self._units, strict=True)]
        # Costs of one form as one column: an expression for every zone takes cvxpy a second for fifty.
        made = [
            cp.sum(
                own.expression(
                    cp.reshape(self._zones[at], (len(at), 1), order="F") if at[1:] else self._zones[at[0]], cp
                )
            )
            for at, own in by_form(rescaled)
        ]
        cost = sum(made) / self._cost_scale + (losses / self._cost_scale) @ cp.square(self._zones)
        self._keeping = [self._zones >= self._bounds[0], self._zones <= self._bounds[1]]
        self._kept = [self._load(stack) <= stack[-1] for stack in self._stacks]
        around = [self._shared >= self._bounds[2], self._shared <= self._bounds[3]]
        self._problem = cp.Problem(cp.Minimize(cost), [*self._keeping, *self._kept, *around])

    def _load(self, stack: _StackParameters) -> Expression:
        import cvxpy as cp

        worst_case, root_sum_square, slopes, _ = stack
        return worst_case @ self._zones + cp.norm2(cp.multiply(root_sum_square, self._zones)) + slopes @ self._shared

    def solve(
        self,
        stacks: Sequence[Stack],
        lower: Float[np.ndarray, " feature"] | None = None,
        upper: Float[np.ndarray, " feature"] | None = None,
        shared: Shared | None = None,
    ) -> Solution | None:
        """Return the cheapest design within the bounds, or None where no design keeps all stacks.

        Parameters
        ----------
        lower, upper
            Bounds of the zones, inside those of the processes unless they are given [unit of the zone].
        shared
            The shared variables with other bounds.
        """
        problem = self._restricted(stacks, lower, upper, shared)
        if not least_infeasible(problem).feasible:
            return None
        units, scales, made = self._units, problem.scales, [feature.processes[0] for feature in problem.features]
        low, high = np.array([each.minimum for each in made]), np.array([each.maximum for each in made])
        # A shared variable that cannot move has no interior, and interior-point solvers stumble over it.
        still = problem.shared.lower == problem.shared.upper
        held = np.where(still, problem.shared.lower, 0.0)
        around = (np.where(still, -1.0, problem.shared.lower), np.where(still, 1.0, problem.shared.upper))
        for parameter, value in zip(self._bounds, (low / units, high / units, *around), strict=True):
            parameter.value = value
        for parameters, stack, scale in zip(self._stacks, stacks, scales, strict=True):
            terms = stack.root_sum_square * high
            values = (
                stack.worst_case * units / scale,
                np.where(terms < _NEGLIGIBLE * terms.max(initial=0.0), 0.0, stack.root_sum_square) * units / scale,
                np.where(still, 0.0, stack.slopes) / scale,
                (stack.budget - stack.slopes @ held) / scale,
            )
            for parameter, value in zip(parameters, values, strict=True):
                parameter.value = value
        self._run()
        return self._solution(problem, low, high)

    def least_infeasible(
        self,
        stacks: Sequence[Stack],
        lower: Float[np.ndarray, " feature"] | None = None,
        upper: Float[np.ndarray, " feature"] | None = None,
        shared: Shared | None = None,
    ) -> LeastInfeasible:
        """Return the design with the smallest largest violation; the arguments are those of `solve`."""
        found = least_infeasible(self._restricted(stacks, lower, upper, shared))
        return replace(found, processes=self.processes)

    def _restricted(
        self,
        stacks: Sequence[Stack],
        lower: Float[np.ndarray, " feature"] | None,
        upper: Float[np.ndarray, " feature"] | None,
        shared: Shared | None,
    ) -> AllocationProblem:
        """Return the allocation whose only processes are the chosen ones, within the bounds."""
        low = self.lower if lower is None else np.maximum(lower, self.lower)
        high = self.upper if upper is None else np.minimum(upper, self.upper)
        features = tuple(
            replace(feature, processes=(replace(made, minimum=float(least), maximum=float(most)),))
            for feature, made, least, most in zip(self.features, self._made, low, high, strict=True)
        )
        return AllocationProblem(features=features, stacks=tuple(stacks), shared=shared or self.shared)

    def _run(self) -> None:
        """Solve the compiled program, less precisely where it must be; how precisely shows in the gap."""
        import cvxpy as cp

        said = ""
        for gap, violation, reduced, more in _ATTEMPTS:
            settings = {
                "tol_gap_abs": gap,
                "tol_gap_rel": gap,
                "tol_feas": violation,
                "reduced_tol_gap_abs": reduced,
                "reduced_tol_gap_rel": reduced,
                "reduced_tol_feas": reduced,
                "equilibrate_enable": True,
                **more,
            }
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    # Warm, the solver would keep state of earlier solves, and an answer would depend on them.
                    self._problem.solve(solver=cp.CLARABEL, warm_start=False, **settings)
            except cp.SolverError as error:
                said = str(error).split(".")[0]
                continue
            if self._problem.status in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
                return
            said = f"it ended as {self._problem.status}"
        raise SolveError(f"The convex program of the allocation was not solved: {said}.")

    def _solution(
        self, problem: AllocationProblem, low: Float[np.ndarray, " feature"], high: Float[np.ndarray, " feature"]
    ) -> Solution:
        zones = np.clip(self._zones.value * self._units, low, high)
        cost = problem.cost(zones, np.zeros(zones.size, dtype=int))
        prices = np.array([max(float(kept.dual_value), 0.0) for kept in self._kept]) * self._cost_scale / problem.scales
        return Solution(
            zones=zones,
            processes=self.processes,
            shared=np.clip(self._shared.value, problem.shared.lower, problem.shared.upper),
            cost=cost,
            bound=cost_bound(problem, prices, zones, enough=cost - _ENOUGH * abs(cost)),
            prices=prices,
            bound_prices=np.maximum(np.stack([constraint.dual_value for constraint in self._keeping], axis=1), 0.0)
            * (self._cost_scale / self._units)[:, None],
        )


@dataclass(frozen=True, kw_only=True)
class WholeNumbers:
    """What a mixed-integer program says of choices of zeros and ones."""

    values: Float[np.ndarray, " column"] | None  # Zero or one of every column, none where nothing was found [-]
    bound: float  # Lower bound on the cost, as far as the solver is right [unit of the cost]
    nodes: int  # Nodes that it took [-]
    is_optimal: bool  # Whether the values were proven to be the best
    is_infeasible: bool  # Whether it was proven that no values keep the rows


def choose_whole_numbers(
    cost: Float[np.ndarray, " column"], rows: Any, limits: Float[np.ndarray, " row"], one_each: Any, most_nodes: int
) -> WholeNumbers:
    """Return the zeros and ones z of least cost·z with rows·z ≤ limits and one_each·z = 1.

    Parameters
    ----------
    cost
        Cost of every column [any unit].
    rows, one_each
        Sparse matrices with as many columns.
    limits
        Largest value of every row.
    most_nodes
        Nodes of branch and bound, after which it ends with what it has [-].

    References
    ----------
    Branch and bound on the relaxation 0 ≤ z ≤ 1: Land & Doig 1960, Econometrica 28, 497–520; solved by HiGHS.
    """
    import cvxpy as cp

    z = cp.Variable(cost.size, boolean=True)
    program = cp.Problem(cp.Minimize(cost @ z), [rows @ z <= limits, one_each @ z == 1])
    options = {
        "mip_rel_gap": 0.0,
        "mip_abs_gap": 0.0,
        "presolve": "off",  # the rows are few and tight already
        "mip_max_nodes": most_nodes,
    }
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Solution may be inaccurate")  # out of nodes, which the status says
        try:
            program.solve(solver=cp.HIGHS, highs_options=options)
        except cp.SolverError as error:
            raise SolveError(f"The mixed-integer program of the allocation was given up: {error}") from error
    stats = program.solver_stats.extra_stats
    return WholeNumbers(
        values=z.value,
        bound=-np.inf if z.value is None else float(stats.mip_dual_bound),
        nodes=int(stats.mip_node_count),
        is_optimal=program.status == cp.OPTIMAL,
        is_infeasible=program.status == cp.INFEASIBLE,
    )
