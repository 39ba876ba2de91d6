"""The design that violates its stacks least: what blocks an allocation that cannot be kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linprog

from tolalloc.allocation.program.problem import AllocationProblem
from tolalloc.exceptions import SolveError

_KEPT = 1e-10
"""Violation below which a stack counts as kept [-]."""
_TIE = 1e-9
"""Distance from the largest violation within which a stack blocks too [-]."""


@dataclass(frozen=True, kw_only=True)
class LeastInfeasible:
    """The design whose largest violation is smallest.

    Parameters
    ----------
    zones
        Smallest zone of every feature [unit of the zone].
    processes
        Position of the process that holds it [-].
    shared
        Values of the shared variables [unit of the variable].
    violations
        By how much every stack exceeds its budget, over the stack's scale; negative where it is kept [-].
    blocking
        Names of the stacks with the largest violation.
    """

    zones: Float[np.ndarray, " feature"]
    processes: Int[np.ndarray, " feature"]
    shared: Float[np.ndarray, " shared"]
    violations: Float[np.ndarray, " stack"]
    blocking: tuple[str, ...]

    @property
    def largest(self) -> float:
        """Largest violation, negative where budget is left in all stacks [-]."""
        return float(self.violations.max(initial=-np.inf))

    @property
    def feasible(self) -> bool:
        """Whether the design keeps all stacks."""
        return self.largest <= _KEPT


def least_infeasible(problem: AllocationProblem) -> LeastInfeasible:
    """Return the design with the smallest largest violation.

    Parameters
    ----------
    problem
        The allocation; if this design does not keep all stacks, no design does.

    Raises
    ------
    SolveError
        The linear program of the shared variables has not been solved.

    Notes
    -----
    A larger zone never relieves a stack, so the smallest zones are best for all stacks at once and only the shared
    variables are left: a linear program, or nothing.
    """
    processes = np.array([np.argmin([made.minimum for made in feature.processes]) for feature in problem.features])
    zones = np.array([feature.processes[at].minimum for feature, at in zip(problem.features, processes, strict=True)])
    shared = _relief(problem, zones) if problem.shared.names and problem.stacks else problem.shared.lower.copy()
    violations = problem.violation(zones, shared) / problem.scales
    near = np.flatnonzero(violations >= violations.max(initial=-np.inf) - _TIE)
    return LeastInfeasible(
        zones=zones,
        processes=processes,
        shared=shared,
        violations=violations,
        blocking=tuple(problem.stacks[at].name for at in near),
    )


def _relief(problem: AllocationProblem, zones: Float[np.ndarray, " feature"]) -> Float[np.ndarray, " shared"]:
    """Return the shared variables that make the largest violation of given zones smallest."""
    box, scales = problem.shared, problem.scales
    fixed = problem.violation(zones, np.zeros(box.lower.size)) / scales
    slopes = np.stack([stack.slopes for stack in problem.stacks]) / scales[:, None]
    found = linprog(
        np.append(np.zeros(box.lower.size), 1.0),
        A_ub=np.column_stack([slopes, -np.ones(scales.size)]),
        b_ub=-fixed,
        bounds=[*zip(box.lower, box.upper, strict=True), (None, None)],
    )
    if found.status != 0:
        raise SolveError(f"The shared variables that relieve the stacks were not found: {found.message}")
    return np.asarray(np.clip(found.x[:-1], box.lower, box.upper))
