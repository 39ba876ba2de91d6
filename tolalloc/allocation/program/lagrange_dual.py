"""The Lagrange dual of an allocation: the least cost of every process once budget has a price."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.allocation.cost.closed_forms import Expression
from tolalloc.allocation.cost.model import Process
from tolalloc.allocation.program.least_priced import by_form
from tolalloc.allocation.program.problem import AllocationProblem
from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class PricedProcesses:
    """The dual at one set of multipliers, for all processes of all features at once."""

    # Lower bound on the cost of every process plus the price of its zone, over its whole range [cost units]
    least: Float[np.ndarray, " process"]
    zones: Float[np.ndarray, " process"]  # Zone where that is reached [unit of the zone]
    shared: Float[np.ndarray, " shared"]  # Shared variables where their price is least [unit of the variable]
    constant: float  # What no process changes [cost units]
    prices: Float[np.ndarray, " stack"]  # Price of every stack's budget [cost units per unit of the stack]
    # Direction whose supporting plane stands for the norm of every stack [-]
    planes: Float[np.ndarray, "stack feature"]


class LagrangeDual:
    """Dual function of an allocation, over all processes of every feature.

    Parameters
    ----------
    problem
        The allocation; every feature may be made by any of its processes.

    Raises
    ------
    InputError
        A cost is not convex.

    Notes
    -----
    Every price λ ≥ 0 of the stacks gives a lower bound: a design that keeps a stack is not made dearer by
    λ·(load − budget) ≤ 0, and without the stacks every feature is minimised alone over its whole range, the smallest of
    its processes counting. A norm is replaced by its supporting plane u·(root_sum_square∘zones) with ‖u‖ = 1, which
    lies below it for every u. A stack that only spreads is squared first,
    λ/(2·budget)·(‖root_sum_square∘zones‖² − budget²) ≤ 0, which needs no u and stays as tight as a dual can be when
    processes compete.

    The minimum over one zone does not hang on a converged iteration either (`LeastPriced`), so all that may
    lift the bound is the rounding of a sum of as many terms as there are features and stacks.
    """

    def __init__(self, problem: AllocationProblem) -> None:
        import cvxpy as cp

        self.problem = problem
        counts = [len(feature.processes) for feature in problem.features]
        self.feature = np.repeat(np.arange(len(counts)), counts)
        self.starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)
        self._processes = tuple(process for feature in problem.features for process in feature.processes)
        for at, process in zip(self.feature, self._processes, strict=True):
            convex_cost(f"feature {problem.features[at].name}", process, cp.Variable(pos=True))
        self._alone = by_form(self._processes)
        self._worst_case = np.array([stack.worst_case for stack in problem.stacks]).reshape(-1, len(counts))
        self._root_sum_square = np.array([stack.root_sum_square for stack in problem.stacks]).reshape(-1, len(counts))
        self._slopes = np.array([stack.slopes for stack in problem.stacks]).reshape(
            len(problem.stacks), problem.shared.lower.size
        )
        self._budget = np.array([stack.budget for stack in problem.stacks])
        self._squared = ~self._worst_case.any(axis=1) & ~self._slopes.any(axis=1) & (self._budget > 0)
        self.planar = self._root_sum_square.any(axis=1) & ~self._squared
        ends = [
            [
                (float(made.total(np.array(made.minimum))), float(made.total(np.array(made.maximum))))
                for made in feature.processes
            ]
            for feature in problem.features
        ]
        self.span = sum(max(first for first, _ in own) - min(last for _, last in own) for own in ends) or 1.0

    def planes(self, zones: Float[np.ndarray, " feature"]) -> Float[np.ndarray, "stack feature"]:
        """Return the directions whose planes touch the norms at the given zones."""
        return unit_rows(self._root_sum_square * zones)

    def price(self, prices: Float[np.ndarray, " stack"], planes: Float[np.ndarray, "stack feature"]) -> PricedProcesses:
        """Return the least priced cost of every process, for prices of 0 or above and planes of unit length."""
        half = np.where(self._squared, prices / 2, 0.0)
        plane = np.where(self._squared, 0.0, prices)
        budget = np.where(self._squared, self._budget, 1.0)
        linear = prices @ self._worst_case + plane @ (planes * self._root_sum_square)
        square = (half / budget) @ self._root_sum_square**2 + self.problem.losses
        slope, box = prices @ self._slopes, self.problem.shared
        shared = np.where(slope > 0, box.lower, box.upper)
        least, zones = np.empty((2, self.feature.size))
        for alike in self._alone:
            own = self.feature[alike.places]
            least[alike.places], zones[alike.places] = alike.found(linear[own], square[own])
        return PricedProcesses(
            least=least,
            zones=zones,
            shared=shared,
            constant=float(slope @ shared - (plane + half) @ self._budget),
            prices=prices,
            planes=planes,
        )

    def choice(self, priced: PricedProcesses, allowed: Bool[np.ndarray, " process"]) -> Int[np.ndarray, " feature"]:
        """Return the place of the least allowed process of every feature among all processes."""
        parts = np.split(np.where(allowed, priced.least, np.inf), self.starts[1:])
        return np.asarray(self.starts + [np.argmin(part) for part in parts])

    def slopes(
        self, priced: PricedProcesses, choice: Int[np.ndarray, " feature"]
    ) -> tuple[Float[np.ndarray, " stack"], Float[np.ndarray, "stack feature"]]:
        """Return the derivatives of the bound by the prices and by the directions, for one choice of processes."""
        zones = priced.zones[choice]
        spread = self._root_sum_square * zones
        planar = (
            self._worst_case @ zones
            + (priced.planes * spread).sum(axis=1)
            + self._slopes @ priced.shared
            - self._budget
        )
        budget = np.where(self._squared, self._budget, 1.0)
        squared = ((spread**2).sum(axis=1) - budget**2) / (2 * budget)
        by_plane = np.where(self._squared, 0.0, priced.prices)[:, None] * spread
        return np.where(self._squared, squared, planar), by_plane

    def bound(self, priced: PricedProcesses, allowed: Bool[np.ndarray, " process"]) -> float:
        """Return the lower bound on the cost of the allowed processes [cost units]."""
        least = np.minimum.reduceat(np.where(allowed, priced.least, np.inf), self.starts)
        return float(least.sum()) + priced.constant


def unit_rows(rows: Float[np.ndarray, "row column"]) -> Float[np.ndarray, "row column"]:
    """Return rows of length one; a row of zeros stays one."""
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(length > 0, length, 1.0)


def convex_cost(place: str, process: Process, zone: Expression) -> Expression:
    """Return the cost of a process as a convex expression [cost units]; one that is not convex is an InputError."""
    expression = process.cost.expression(zone)
    if expression is None:
        raise InputError.at(place, f"process {process.name}", "a cost that is not convex", "a convex cost")
    return expression
