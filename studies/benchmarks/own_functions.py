"""How near a quick allocation of an own function comes to its optimum, and how long it takes, over many seeds.

    python studies/benchmarks/own_functions.py --seeds 30

The linear chain a − b + 2c and a one-way clutch (Choi, Park & Salisbury 2000), each with one limited output and with
two of which 99.73 % must keep all limits at once, as functions of arrays and of single numbers. All sizes are normal,
costs fall as 1/zone. Every limit is a half space of the sizes: the clutch's angle lies beyond α where hub + (1 + cos
α)·roller − cos α·cage lies beyond 0, with the mean roller. So the share of failures has a closed form: the two sides of
an output fail never both, sides of two outputs do as two correlated normal numbers. The optimum is that of another
program on these shares.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from known_optima import both_above
from scipy.optimize import minimize
from scipy.stats import norm

import tolalloc as ta

TARGET = 0.9973
Vector = np.ndarray


@dataclass(frozen=True)
class HalfSpace:
    """Where a side of an output fails: slopes·deviations > room."""

    output: int
    slopes: Vector  # of the deviations [1]
    room: float  # [mm]


@dataclass(frozen=True)
class Case:
    """An own function with its sizes and limits."""

    name: str
    function: Callable[..., object]
    rows: dict[str, tuple[float, float, float]]  # nominal, first tolerance to either side [mm], cost
    limits: dict[str, tuple[float | None, float | None]]  # of every output
    sides: tuple[HalfSpace, ...]

    @property
    def deviations(self) -> Vector:
        """Standard deviations at the first zones, Cp 1 [mm]."""
        return np.array([tolerance / 3 for _, tolerance, _ in self.rows.values()])

    def failing(self, scales: Vector) -> float:
        """Return the share of units beyond a limit at scales of all zones [-]."""
        loads = np.array([side.slopes * self.deviations * scales for side in self.sides])
        lengths = np.linalg.norm(loads, axis=1)
        scores = np.array([side.room for side in self.sides]) / lengths
        share = float(norm.sf(scores).sum())
        for one, other in combinations(range(len(self.sides)), 2):
            if self.sides[one].output != self.sides[other].output:
                alike = float(loads[one] @ loads[other] / lengths[one] / lengths[other])
                share -= both_above(float(scores[one]), float(scores[other]), alike)
        return share

    @cached_property
    def optimum(self) -> float:
        """Least cost."""
        costs = np.array([cost for *_, cost in self.rows.values()])

        def keeps(logs: Vector) -> float:
            return math.log(1 - TARGET) - math.log(max(self.failing(np.exp(logs)), 1e-300))

        found = minimize(
            lambda logs: float((costs * np.exp(-logs)).sum()),
            np.log(0.5) * np.ones(costs.size),
            constraints=[{"type": "ineq", "fun": keeps}],
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 500},
        )
        assert found.success, found.message
        return float(found.fun)

    def study(self, seed: int) -> ta.Study:
        """Return the study."""
        own = {"unit": "mm", "distribution": "normal", "Cp": 1.0, "min": 1e-3, "max": 2.0}
        rows = [
            {"id": name, "nominal": nominal, "plus": zone, "minus": -zone, "cost": cost, **own}
            for name, (nominal, zone, cost) in self.rows.items()
        ]
        return ta.Study(
            ta.model(self.function, inputs=tuple(self.rows), outputs=tuple(self.limits)),
            ta.Drawing.of_rows(rows),
            limits={
                output: ta.Limit(lower=low, upper=high, show=ta.AtYield(TARGET))
                for output, (low, high) in self.limits.items()
            },
            questions=[ta.Allocation(front=False, what_if=False)],
            seed=seed,
        )


def two_sided(output: int, slopes: list[float], room: float) -> tuple[HalfSpace, HalfSpace]:
    """Return both sides of a linear output in the middle of its limits."""
    return tuple(HalfSpace(output, sign * np.array(slopes), room) for sign in (1, -1))


def chain() -> Case:
    """Return the linear chain with one limit."""
    rows = {"a": (10.0, 0.1, 1.0), "b": (4.0, 0.1, 3.0), "c": (4.0, 0.1, 0.5)}
    sides = two_sided(0, [1.0, -1.0, 2.0], 0.2)
    return Case("chain", lambda a, b, c: a - b + 2 * c, rows, {"gap [mm]": (13.8, 14.2)}, sides)


def chains() -> Case:
    """Return the chain with a second limit of the same sizes."""
    own = chain()
    sides = (*own.sides, HalfSpace(1, np.array([1.0, 1.0, 0.0]), 0.1))
    limits = {**own.limits, "height [mm]": (None, 14.1)}
    return replace(
        own, name="chain, two limits", function=lambda a, b, c: (a - b + 2 * c, a + b), limits=limits, sides=sides
    )


def contact_angle(hub, roller, other, cage):
    """Return the angle at which the rollers touch hub and cage [rad], from dimensions [mm]."""
    rollers = (roller + other) / 2
    return np.arccos((hub + rollers) / (cage - rollers))


def clutch() -> Case:
    """Return the clutch with its contact angle."""
    rows = {
        "hub": (55.29, 0.15, 1.0),
        "roller": (22.86, 0.15, 0.6),
        "other": (22.86, 0.15, 0.4),
        "cage": (101.6, 0.15, 1.5),
    }
    nominal = np.array([size for size, *_ in rows.values()])
    angle = float(contact_angle(*nominal))
    sides = []
    for sign, limit in ((1, angle + 0.035), (-1, angle - 0.035)):
        k = math.cos(limit)
        slopes = sign * np.array([-1.0, -(1 + k) / 2, -(1 + k) / 2, k])
        sides.append(HalfSpace(0, slopes, -float(slopes @ nominal)))
    limits = {"contact angle [rad]": (angle - 0.035, angle + 0.035)}
    return Case("clutch", contact_angle, rows, limits, tuple(sides))


def clutches() -> Case:
    """Return the clutch with a limit of the room between hub and cage too."""
    own = clutch()
    height = 101.6 - 55.29
    return replace(
        own,
        name="clutch, two limits",
        function=lambda hub, roller, other, cage: (contact_angle(hub, roller, other, cage), cage - hub),
        limits={**own.limits, "room [mm]": (height - 0.16, height + 0.16)},
        sides=(*own.sides, *two_sided(1, [-1.0, 0.0, 0.0, 1.0], 0.16)),
    )


def of_single_numbers(own: Case) -> Case:
    """Return the case with a function that takes no arrays."""

    def single(*sizes):
        found = own.function(*(float(size) for size in sizes))
        return tuple(map(float, found)) if isinstance(found, tuple) else float(found)

    return replace(own, name=f"{own.name}, single numbers", function=single)


CASES = (chain, chains, clutch, clutches)


def main() -> None:
    """Print cost over the optimum, the share of failures over the allowed one, and processor seconds, over seeds."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--seeds", type=int, default=30)
    asked.add_argument("--first", type=int, default=1)
    asked.add_argument("--effort", choices=("quick", "full"), default="quick")
    asked.add_argument("--only", default="")
    given = asked.parse_args()
    every = [made() for made in CASES]
    for own in (*every, *map(of_single_numbers, every)):
        if given.only and given.only != own.name:
            continue
        gaps, shares, seconds, met = [], [], [], 0
        for seed in range(given.first, given.first + given.seeds):
            start = time.process_time()
            answer = own.study(seed).allocate(effort=given.effort).result
            seconds.append(time.process_time() - start)
            scales = np.array([source.zone * 1e3 for source in answer.drawn_sources]) / (6 * own.deviations)
            gaps.append(100 * (answer.cost / own.optimum - 1))
            shares.append(own.failing(scales) / (1 - TARGET))
            met += answer.met
        print(
            f"{own.name}, optimum {own.optimum:.4f}: met {met} of {given.seeds}, cost above it {np.median(gaps):.2f} % "
            f"in the median, {min(gaps):.2f}…{max(gaps):.2f} %, within 0.5 % in "
            f"{sum(abs(gap) <= 0.5 for gap in gaps)}; failures over those allowed {min(shares):.3f}…{max(shares):.3f}; "
            f"{np.median(seconds):.2f} s, "
            f"{max(seconds):.2f} s at most",
            flush=True,
        )


if __name__ == "__main__":
    main()
