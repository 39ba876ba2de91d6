"""Lower bounds on the cost of an allocation that take no solver's word."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.program.lagrange_dual import LagrangeDual, PricedProcesses, unit_rows
from tolalloc.allocation.program.problem import AllocationProblem

_SMALLEST_SHARE = 1e-9
"""Smallest worth of a stack's budget that the ascent tries, over the range of the cost [-]."""
_STEPS = 60
"""Steps of the ascent; a handful are usual [-]."""


def ascend(
    dual: LagrangeDual,
    start: PricedProcesses,
    allowed: Bool[np.ndarray, " process"],
    enough: float = np.inf,
) -> list[PricedProcesses]:
    """Return the multipliers tried on the way to the largest lower bound, the start first.

    Notes
    -----
    Nothing more is asked for once a bound is enough [cost units]. The logarithms of the prices and the directions of
    the norms move together. Where processes tie the dual has a kink, and the ascent may stop short of its top; every
    multiplier on the way gives a valid bound all the same.
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
        planes[moving] = unit_rows(rows)
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
        minimize(falling, free, jac=True, method="L-BFGS-B", bounds=ends, options={"maxiter": _STEPS, "ftol": 1e-14})
    return tried


def cost_bound(
    problem: AllocationProblem,
    prices: Float[np.ndarray, " stack"],
    zones: Float[np.ndarray, " feature"],
    enough: float = np.inf,
) -> float:
    """Return a lower bound on the cost of every design, made by whatever processes, that keeps all stacks.

    Parameters
    ----------
    problem
        The allocation.
    prices
        Price of every stack's budget to start from, 0 or above; any give a valid bound, the shadow prices a tight one
        [cost units per unit of the stack].
    zones
        Zones whose directions make the norms' planes tight; any give a valid bound [unit of the zone].
    enough
        Bound at which nothing more is asked for [cost units].

    Raises
    ------
    InputError
        A cost is not convex.

    Notes
    -----
    See `LagrangeDual` for why the value is a bound.
    """
    dual = LagrangeDual(problem)
    allowed = np.ones(dual.feature.size, dtype=bool)
    tried = ascend(dual, dual.price(np.maximum(prices, 0.0), dual.planes(zones)), allowed, enough)
    return max(dual.bound(priced, allowed) for priced in tried)
