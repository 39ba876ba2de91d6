"""The Lagrange dual of an allocation: lower bounds on its cost that take no solver's word."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.allocation.cost.model import CostModel, Process, Reciprocal, by_form
from tolalloc.allocation.space.problem import AllocationProblem
from tolalloc.exceptions import InputError

_FRACTIONS = np.linspace(0.0, 1.0, 33)
_ROUNDS = 4
"""Each narrows a zone to 1/32 of its range, so four leave a ratio of 1 + 1e-5 at most [-]."""


@dataclass(frozen=True, kw_only=True)
class LeastPriced:
    """Processes whose costs have one form, each minimised alone with a price on its zone, all at once."""

    places: Int[np.ndarray, " process"]  # Where they stand among all processes [-]
    cost: CostModel  # Their convex costs, a row of zones for each
    # Their fixed costs [cost units], and the ends of their ranges [unit of the zone]
    change: Float[np.ndarray, " process"]
    low: Float[np.ndarray, " process"]
    high: Float[np.ndarray, " process"]

    @classmethod
    def by_form(cls, processes: Sequence[Process]) -> tuple[LeastPriced, ...]:
        """Return processes with those of one closed form together, the others each for itself."""
        found = []
        for places, cost in by_form([process.cost for process in processes]):
            made = [processes[at] for at in places]
            change, low, high = np.array([(own.change, own.minimum, own.maximum) for own in made]).T
            found.append(cls(places=np.array(places), cost=cost, change=change, low=low, high=high))
        return tuple(found)

    def found(
        self, linear: Float[np.ndarray, " process"], square: Float[np.ndarray, " process"]
    ) -> tuple[Float[np.ndarray, " process"], Float[np.ndarray, " process"]]:
        """Return lower bounds on cost + linear·zone + square·zone² over the range of each, and the zones there.

        Parameters
        ----------
        linear, square
            Price of the zone [cost units per unit of the zone], and of its square, 0 or above [cost units per unit²].

        Notes
        -----
        A convex function lies above its tangents at any two zones, so the crossing of the two bounds it from below
        wherever they stand; that they stand on both sides of the minimum and close together only makes the bound tight.
        For b/t + p·t the minimum is known: it is reached at √(b/p), or at the nearer end of the range.
        """
        if isinstance(self.cost, Reciprocal) and not square.any():
            best = np.sqrt(np.ravel(self.cost.factor) / np.where(linear > 0, linear, np.nan))
            zone = np.clip(np.where(linear > 0, best, self.high), self.low, self.high)
            return self._priced(zone[:, np.newaxis], linear, square)[:, 0], zone
        around = self._around(linear, square)
        values = self._priced(around, linear, square)
        slopes = self._slopes(around, linear, square)
        low, high = around.T
        apart = high > low
        bend = np.where(apart, slopes[:, 0] - slopes[:, 1], 1.0)
        step = np.where(apart, (values[:, 1] - values[:, 0] - slopes[:, 1] * (high - low)) / bend, 0.0)
        step = np.clip(step, 0.0, high - low)
        return values[:, 0] + slopes[:, 0] * step, low + step

    def _around(
        self, linear: Float[np.ndarray, " process"], square: Float[np.ndarray, " process"]
    ) -> Float[np.ndarray, "process 2"]:
        """Return two zones close together, one on each side of the minimum, or the end of the range where it lies."""
        low, high, rows = self.low, self.high, np.arange(self.low.size)
        last = _FRACTIONS.size - 1
        for _ in range(_ROUNDS):
            zones = np.minimum(low[:, np.newaxis] * (high / low)[:, np.newaxis] ** _FRACTIONS, high[:, np.newaxis])
            rising = self._slopes(zones, linear, square) >= 0
            after = np.where(rising[:, -1], rising.argmax(axis=1), last + 1)
            low, high = zones[rows, np.maximum(after - 1, 0)], zones[rows, np.minimum(after, last)]
        return np.stack([low, high], axis=1)

    def _priced(
        self,
        zones: Float[np.ndarray, "process zone"],
        linear: Float[np.ndarray, " process"],
        square: Float[np.ndarray, " process"],
    ) -> Float[np.ndarray, "process zone"]:
        own = self.cost.value(zones) + self.change[:, np.newaxis]
        return np.asarray(own + linear[:, np.newaxis] * zones + square[:, np.newaxis] * zones**2)

    def _slopes(
        self,
        zones: Float[np.ndarray, "process zone"],
        linear: Float[np.ndarray, " process"],
        square: Float[np.ndarray, " process"],
    ) -> Float[np.ndarray, "process zone"]:
        return np.asarray(self.cost.slope(zones) + linear[:, np.newaxis] + 2 * square[:, np.newaxis] * zones)


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

    Notes
    -----
    Theory page equation (27): every price λ ≥ 0 of the stacks gives a lower bound: a design that keeps a stack is not
    made dearer by λ·(load − budget) ≤ 0, and without the stacks every feature is minimised alone over its whole range,
    the smallest of its processes counting. A norm is replaced by its supporting plane u·(root_sum_square∘zones) with
    ‖u‖ = 1, which lies below it for every u. A stack that only spreads is squared first,
    λ/(2·budget)·(‖root_sum_square∘zones‖² − budget²) ≤ 0, which needs no u and stays as tight as a dual can be when
    processes compete.

    The minimum over one zone does not hang on a converged iteration either (`LeastPriced`), so all that may
    lift the bound is the rounding of a sum of as many terms as there are features and stacks.

    References
    ----------
    S. Boyd, L. Vandenberghe, Convex Optimization, Cambridge University Press (2004), chapter 5.
    """

    def __init__(self, problem: AllocationProblem) -> None:
        self.problem = problem
        counts = [len(feature.processes) for feature in problem.features]
        self.feature = np.repeat(np.arange(len(counts)), counts)
        self.starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)
        self._processes = tuple(process for feature in problem.features for process in feature.processes)
        for at, process in zip(self.feature, self._processes, strict=True):
            require_convex(f"feature {problem.features[at].name}", process)
        self._alone = LeastPriced.by_form(self._processes)
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
        return _unit_rows(self._root_sum_square * zones)

    def price(self, prices: Float[np.ndarray, " stack"], planes: Float[np.ndarray, "stack feature"]) -> PricedProcesses:
        """Return the least priced cost of every process, for prices of 0 or above and planes of unit length."""
        half, plane = np.where(self._squared, prices / 2, 0.0), np.where(self._squared, 0.0, prices)
        linear, square = self.zone_prices(prices, planes)
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

    def zone_prices(
        self, prices: Float[np.ndarray, " stack"], planes: Float[np.ndarray, "stack feature"]
    ) -> tuple[Float[np.ndarray, " feature"], Float[np.ndarray, " feature"]]:
        """Return the price of every zone [cost units per unit of the zone], and of its square [cost units per unit²].

        What stacks take of them, and the loss; the arguments are those of `price`.
        """
        plane, budget = np.where(self._squared, 0.0, prices), np.where(self._squared, self._budget, 1.0)
        linear = prices @ self._worst_case + plane @ (planes * self._root_sum_square)
        square = ((prices - plane) / (2 * budget)) @ self._root_sum_square**2 + self.problem.losses
        return np.asarray(linear), np.asarray(square)

    def held(self, at: int, zone: float) -> LagrangeDual:
        """Return the dual of the same allocation with the zone of a feature held."""
        found, here = copy(self), [self.feature[own.places] == at for own in self._alone]
        found._alone = tuple(
            replace(own, low=np.where(its, zone, own.low), high=np.where(its, zone, own.high))
            for own, its in zip(self._alone, here, strict=True)
        )
        return found

    def choice(self, priced: PricedProcesses, allowed: Bool[np.ndarray, " process"]) -> Int[np.ndarray, " feature"]:
        """Return the place of the least allowed process of every feature among all processes."""
        if self.starts.size == self.feature.size:  # one process each
            return self.starts
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
        """Return the lower bound on the cost of the allowed processes, the sum of the least ones [cost units]."""
        least = np.minimum.reduceat(np.where(allowed, priced.least, np.inf), self.starts)
        return float(least.sum()) + priced.constant


def _unit_rows(rows: Float[np.ndarray, "row column"]) -> Float[np.ndarray, "row column"]:
    """Return rows of length one; a row of zeros stays one."""
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(length > 0, length, 1.0)


def require_convex(place: str, process: Process) -> None:
    """Raise an InputError unless the cost of a process is convex in its zone."""
    if not process.cost.is_convex:
        raise InputError.at(place, f"process {process.name}", "a cost that is not convex", "a convex cost")


_SMALLEST_SHARE = 1e-9
"""Smallest worth of a stack's budget that the ascent tries, over the range of the cost [-]."""
_ENDS = {"maxiter": 60, "ftol": 1e-14, "gtol": 1e-6}
"""Steps of the ascent, of which a handful are usual, and gain and slope of the bound, over the range of the cost, that
end it: at a slope of 1e-5 a price is still half a thousandth off [-]."""


def ascend(
    dual: LagrangeDual, start: PricedProcesses, allowed: Bool[np.ndarray, " process"], enough: float = np.inf
) -> list[PricedProcesses]:
    """Return the multipliers tried on the way to the largest lower bound, the start first.

    Notes
    -----
    Nothing more is asked for once a bound is enough [cost units]. The logarithms of the prices and the directions of
    the norms move together. Where processes tie the dual has a kink, and the ascent may stop short of its top; every
    multiplier on the way gives a valid bound all the same.

    References
    ----------
    max over λ ≥ 0 of the dual, Boyd & Vandenberghe 2004, ch. 5; by L-BFGS-B, Byrd, Lu, Nocedal & Zhu 1995.
    """
    from scipy.optimize import minimize

    tried = [start]
    if dual.bound(start, allowed) >= enough or not start.prices.size:
        return tried
    span = dual.span
    floor = _SMALLEST_SHARE * span / dual.problem.scales
    stacks, moving = start.prices.size, dual.planar

    def falling(free: Float[np.ndarray, " free"]) -> tuple[float, Float[np.ndarray, " free"]]:
        prices, rows = np.exp(free[:stacks]), free[stacks:].reshape(-1, start.planes.shape[1])
        planes = start.planes.copy()
        planes[moving] = _unit_rows(rows)
        priced = dual.price(prices, planes)
        tried.append(priced)
        bound = dual.bound(priced, allowed)
        if bound >= enough:
            raise StopIteration
        by_price, by_plane = dual.slopes(priced, dual.choice(priced, allowed))
        across = by_plane[moving] - planes[moving] * (planes[moving] * by_plane[moving]).sum(axis=1, keepdims=True)
        length = np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
        return -bound / span, -np.concatenate([by_price * prices, (across / length).ravel()]) / span

    free = np.concatenate([np.log(np.maximum(start.prices, floor)), start.planes[moving].ravel()])
    ends = np.concatenate(
        [np.log(np.stack([floor, floor * 1e18], axis=1)), np.tile([-2.0, 2.0], (free.size - stacks, 1))]
    )
    with suppress(StopIteration):
        minimize(falling, free, jac=True, method="L-BFGS-B", bounds=ends, options=_ENDS)
    return tried


def cost_bound(
    problem: AllocationProblem,
    prices: Float[np.ndarray, " stack"],
    zones: Float[np.ndarray, " feature"],
    enough: float = np.inf,
) -> float:
    """Return a lower bound on the cost of every design, made by whatever processes, that keeps all stacks.

    Theory page equation (27), Boyd & Vandenberghe 2004, ch. 5: max over λ ≥ 0 of min over zones of
    cost + Σ λ·(load − budget) ≤ cost of any design [cost units]. It bounds the model that the stacks are.

    Parameters
    ----------
    prices
        Price of every stack's budget to start from, 0 or above; any give a valid bound, the shadow prices a tight one
        [cost units per unit of the stack].
    zones
        Zones whose directions make the norms' planes tight; any give a valid bound [unit of the zone].
    enough
        Bound at which nothing more is asked for [cost units].

    Notes
    -----
    See `LagrangeDual` for why the value is a bound.

    Examples
    --------
    Two zones that cost 1/t and add up to 2 or less cost 2 at least; a wrong price still gives a bound:

    >>> from tolalloc.allocation.space.problem import PricedFeature, Stack
    >>> made = Process(name="turned", cost=Reciprocal(factor=1.0), minimum=0.5, maximum=9.0)
    >>> features = tuple(PricedFeature(name=name, processes=(made,)) for name in ("bore", "pin"))
    >>> stack = Stack(name="play", worst_case=np.ones(2), root_sum_square=np.zeros(2), budget=2.0)
    >>> problem = AllocationProblem(features=features, stacks=(stack,))
    >>> cost_bound(problem, np.ones(1), np.ones(2)), round(cost_bound(problem, np.array([0.5]), np.ones(2)), 6)
    (2.0, 2.0)
    """
    dual = LagrangeDual(problem)
    allowed = np.ones(dual.feature.size, dtype=bool)
    tried = ascend(dual, dual.price(np.maximum(prices, 0.0), dual.planes(zones)), allowed, enough)
    return max(dual.bound(priced, allowed) for priced in tried)
