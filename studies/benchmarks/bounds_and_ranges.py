"""What proofs about the answer take: branch and bound beside equal boxes, ranges of prices beside solved programs.

    python studies/benchmarks/bounds_and_ranges.py

* Bound: random reducers with six pins, four zones and ten units, a limit that some drawing keeps. Equal boxes, six to
  every zone, have a least cost that no drawing goes below; the package looks at boxes until it proves as much. Both ask
  the same bounds of the real model and count the same failures, so that the ratio is that of the searches.
* Ranges: the factors of every zone's cost between which it stays within 10 %, of random programs with eight zones, by
  the package's optimality conditions and by a root finder (brentq) that solves the program at every price it asks for.

A round is one random reducer and one random program.
"""

from __future__ import annotations

import os
import sys
from itertools import product
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from kernel_speed import figures, progress, run_benchmark
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.verification.test_price_region import priced, random_problem
from tests.verification.test_proven_bound import limited, random_question
from tolalloc.allocation.front.price_region import SAME, price_ranges
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.proven_bound import Conditions, CostBox, cheapest_box
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.problem import AllocationProblem, Solution
from tolalloc.running.compiled import processor

UNITS, ZONES, ACCURACY = 10, 8, 0.05
WIDEST = 100.0
"""Factor of a cost up to which the root finder looks, either way."""
ALLOWED_DIFFERENCE = 2e-3
"""Relative difference of two ends of a range."""


def by_equal_boxes(space: DesignSpace, conditions: Conditions, cuts: int) -> float:
    """Return the least cost of equal boxes, in ln of the zones, that may hold a design which keeps the limits."""
    edges, costs = np.geomspace(space.lower, space.upper, cuts + 1, axis=1), CostBox(space=space)
    none = [np.zeros(UNITS, bool) for _ in conditions.limits]
    least = np.inf
    for place in product(range(cuts), repeat=len(space.lower)):
        at = np.array(place)
        lower, upper = (np.take_along_axis(edges, (at + end)[:, np.newaxis], axis=1)[:, 0] for end in (0, 1))
        cost = costs.least(lower, upper)
        if cost < least and not conditions.exceeded(conditions.failed(lower, upper, none)[0]):
            least = cost
    return float(least)


def bound(seed: int, cuts: int) -> dict[str, float]:
    """Return seconds, boxes and bounds of both searches on one random reducer."""
    case, limit, allowed = random_question(seed, UNITS)
    conditions = limited(case.bounds(*(np.full(4, scale) for scale in (0.6, 0.8, 1.1))), limit, allowed, ACCURACY)
    started = process_time()
    plain = by_equal_boxes(case.space, conditions, cuts)
    equal, boxes, found, took = process_time() - started, 2, -np.inf, 0.0
    while found < plain and boxes < 2 * cuts**4:
        boxes *= 2
        started = process_time()
        found, _ = cheapest_box(case.space, conditions, UNITS, np.inf, boxes)
        took = process_time() - started  # of the run that suffices, as equal boxes are cut once
    return {"equal": equal, "package": took, "boxes": boxes, "proven": found, "by_equal": plain}


def by_roots(problem: AllocationProblem, optimum: Solution, at: int, *, coarser: bool) -> float:
    """Return the factor of a zone's cost at which it has moved by `SAME`, the end where it does not."""
    goal = np.log1p(SAME) * (1 if coarser else -1)

    def moved(by: float) -> float:
        factors = np.ones(len(optimum.zones))
        factors[at] = np.exp(by)
        found = process_choice.allocate(priced(problem, factors))
        return float(np.log(found.zones[at] / optimum.zones[at])) - goal

    end = np.log(WIDEST) * (1 if coarser else -1)
    if moved(0.0) * moved(end) > 0:
        return np.inf if coarser else 0.0
    return float(np.exp(brentq(moved, 0.0, end, xtol=1e-4)))


def ranges(seed: int) -> dict[str, float]:
    """Return seconds of both ways to the ranges of one program, and how far they differ."""
    problem = random_problem(np.random.default_rng(seed), ZONES)
    optimum = process_choice.allocate(problem)
    started = process_time()
    own = price_ranges(problem, optimum)
    package, started = process_time() - started, process_time()
    other = [[by_roots(problem, optimum, at, coarser=side) for side in (False, True)] for at in range(ZONES)]
    solved = process_time() - started
    pairs = zip(np.ravel([[one.low, one.high] for one in own]), np.ravel(other), strict=True)
    within = [abs(one / two - 1) for one, two in pairs if 1 / WIDEST < one < WIDEST]
    return {"package": package, "solved": solved, "difference": max(within)}


def answer(cuts: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    bound(0, 2)  # compiles, and makes tables
    boxed, ranged = [], []
    for number in range(rounds):
        boxed.append(bound(number, cuts))
        ranged.append(ranges(number))
        progress(f"round {number + 1} of {rounds}")
    column = {name: np.array([own[name] for own in boxed]) for name in boxed[0]}
    found = {name: np.array([own[name] for own in ranged]) for name in ranged[0]}
    return {
        "processor": {name: processor()[name] for name in ("kind", "name")},
        "cores": os.cpu_count(),
        "rounds": rounds,
        "bound": {
            "equal_boxes": cuts**4,
            "boxes": figures(column["boxes"]),
            "seconds": {name: figures(column[name]) for name in ("package", "equal")},
            "ratio": figures(column["equal"] / column["package"]),
            "proven_over_equal": figures(column["proven"] / column["by_equal"]),
        },
        "ranges": {
            "zones": ZONES,
            "seconds": {name: figures(found[name]) for name in ("package", "solved")},
            "ratio": figures(found["solved"] / found["package"]),
            "largest_difference": float(found["difference"].max()),
        },
        "agrees": bool(
            np.all(column["proven"] >= column["by_equal"]) and found["difference"].max() <= ALLOWED_DIFFERENCE
        ),
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    box, zone = found["bound"], found["ranges"]
    rows = {
        f"bound, {box['equal_boxes']} equal boxes, s": box["seconds"]["equal"],
        "bound, package, s": box["seconds"]["package"],
        "boxes of the package": box["boxes"],
        "ratio": box["ratio"],
        "cost proven over that of equal boxes": box["proven_over_equal"],
        f"ranges of {zone['zones']} prices, solved programs, s": zone["seconds"]["solved"],
        "ranges, package, s": zone["seconds"]["package"],
        "ratio of ranges": zone["ratio"],
    }
    lines = [
        f"{title:48}" + "".join(f"{own[end]:12.3g}" for end in ("median", "least", "most"))
        for title, own in rows.items()
    ]
    return "\n".join(
        [
            f"{found['rounds']} rounds, {found['cores']} cores; {found['processor']}",
            f"{'':48}{'median':>12}{'least':>12}{'most':>12}",
            *lines,
            f"largest difference of two ends of a range: {zone['largest_difference']:.1e}",
        ]
    )


if __name__ == "__main__":
    sys.exit(
        run_benchmark("What proofs about the answer take.", ("cuts", 6, "equal boxes along every zone"), answer, table)
    )
