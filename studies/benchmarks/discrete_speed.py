"""Speed of a proven allocation over ladders against the same problem stated plainly in cvxpy.

    python studies/benchmarks/discrete_speed.py

Random problems of 30 features with 8 grades from each of 3 processes and 4 stacks (two in quadrature, one worst case,
one of both) are solved in interleaved rounds by

* (a) the package, `tolalloc.allocation.search.discrete`;
* (b) cvxpy with HiGHS: one boolean per option, a row in squares or in zones per stack, and for the stack of both the
  tangents at every answer that breaks it, until an answer keeps it.

Both prove their answer, so their costs are compared. (b) gives up after a minute per problem: its time is then what it
has taken so far, to its advantage, and its cost is left out.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from importlib.metadata import version
from typing import Any

import cvxpy as cp
import numpy as np
from jaxtyping import Float
from kernel_speed import SEED, figures, progress, run_benchmark
from numpy_cores import CORES, timed

from tolalloc.allocation.cost.model import Process, ReciprocalPower
from tolalloc.allocation.search.discrete import DiscreteProblem, feature_options
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Stack

FEATURES, GRADES, PROCESSES = 30, 8, 3
STACKS = {"rss 1": (0.0, 1.0), "rss 2": (0.0, 1.0), "worst case": (1.0, 0.0), "both": (0.3, 1.0)}
TARGET_SECONDS = 5.0
ALLOWED_DIFFERENCE = 1e-9
PATIENCE = 60.0  # s


def random_problem(random: np.random.Generator) -> DiscreteProblem:
    """Return a problem whose budgets are filled near the middle of the ladders."""
    ladders = random.choice([1.0, 1.5, 2.0, 2.5, 3.0, 4.0], FEATURES)[:, np.newaxis] * 1.6 ** np.arange(GRADES)
    features = []
    for number, ladder in enumerate(ladders):
        processes = tuple(
            Process(
                name=f"process {at}",
                cost=ReciprocalPower(factor=random.uniform(2, 10), exponent=random.uniform(0.5, 1.2)),
                minimum=float(ladder[0]),
                maximum=float(ladder[-1]),
                change=float(random.uniform(0.0, 0.5)) * at,
            )
            for at in range(PROCESSES)
        )
        features.append(PricedFeature(name=f"feature {number}", processes=processes))
    stacks = []
    for name, kinds in STACKS.items():
        weights = np.exp(random.normal(0.0, 0.7, (2, FEATURES))) * (random.random((2, FEATURES)) < 0.6)
        worst_case, root_sum_square = weights * np.array(kinds)[:, np.newaxis]
        middle = ladders[:, 3]
        budget = float(worst_case @ middle + np.linalg.norm(root_sum_square * middle)) * random.uniform(0.8, 1.2)
        stacks.append(Stack(name=name, worst_case=worst_case, root_sum_square=root_sum_square, budget=budget))
    labels = [f"grade {at}" for at in range(GRADES)]
    options = tuple(feature_options(own, ladder, labels) for own, ladder in zip(features, ladders, strict=True))
    return DiscreteProblem(problem=AllocationProblem(features=tuple(features), stacks=tuple(stacks)), options=options)


def plainly(case: DiscreteProblem) -> float:
    """Return the least cost by cvxpy and HiGHS, NaN if that takes too long."""
    flat = [option for options in case.options for option in options]
    counts = [len(options) for options in case.options]
    zones, cost = np.array([own.zone for own in flat]), np.array([own.cost for own in flat])
    member = np.repeat(np.eye(FEATURES), counts, axis=1)
    z, until = cp.Variable(cost.size, boolean=True), time.monotonic() + PATIENCE
    rows = [member @ z == 1]
    for stack in case.problem.stacks:
        if not stack.worst_case.any():
            rows.append(((stack.root_sum_square @ member * zones) / stack.budget) ** 2 @ z <= 1)
        elif not stack.root_sum_square.any():
            rows.append((stack.worst_case @ member * zones) / stack.budget @ z <= 1)
    while True:
        program = cp.Problem(cp.Minimize(cost @ z), rows)
        options = {"mip_rel_gap": 0.0, "time_limit": max(until - time.monotonic(), 0.01)}
        program.solve(solver=cp.HIGHS, highs_options=options)
        if program.status != cp.OPTIMAL:
            return float("nan")
        chosen: Float[np.ndarray, " feature"] = member @ (zones * np.round(z.value))
        broken = [stack for stack in case.problem.stacks if stack.load(chosen, np.empty(0)) > stack.budget * (1 + 1e-9)]
        if not broken:
            return float(cost @ np.round(z.value))
        for stack in broken:
            length = np.linalg.norm(stack.root_sum_square * chosen) or 1.0
            slope = stack.worst_case + stack.root_sum_square**2 * chosen / length
            rows.append((slope @ member * zones) / stack.budget @ z <= 1)


def answer(instances: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")  # what others take away
    random = np.random.default_rng(SEED)
    cases = [random_problem(random) for _ in range(instances)]
    seconds: dict[str, list[float]] = {"package": [], "cvxpy": []}
    difference, given_up, gap = 0.0, 0, 0.0
    for number in range(rounds):
        for at, case in enumerate(cases):
            spent, solution = timed(case.solve)
            seconds["package"].append(spent)
            spent, cost = timed(lambda case=case: plainly(case))
            seconds["cvxpy"].append(spent)
            gap = max(gap, solution.gap)
            if np.isnan(cost):
                given_up += 1
            else:
                difference = max(difference, abs(cost / solution.cost - 1))
            here = ", ".join(f"{name} {values[-1]:.2f} s" for name, values in seconds.items())
            progress(f"round {number + 1} of {rounds}, problem {at + 1} of {instances}: {here}")
    package, other = np.array(seconds["package"]), np.array(seconds["cvxpy"])
    return {
        "versions": {"python": platform.python_version(), "cvxpy": cp.__version__, "highspy": version("highspy")},
        "cores": CORES,
        "load_average_before": load,
        "instances": instances,
        "rounds": rounds,
        "seconds": {"package": figures(package), "cvxpy": figures(other)},
        "seconds_of_every_solve": seconds,
        "ratio": figures(other / package),
        "ratio_of_sums": float(other.sum() / package.sum()),
        "largest_gap": gap,
        "given_up": given_up,
        "targets": {"seconds": {"asked": TARGET_SECONDS, "met": bool(package.max() < TARGET_SECONDS)}},
        "difference": difference,
        "difference_allowed": ALLOWED_DIFFERENCE,
        "agrees": difference <= ALLOWED_DIFFERENCE,
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    lines = [
        f"{FEATURES} features × {GRADES} grades × {PROCESSES} processes, {len(STACKS)} stacks; {found['instances']} "
        f"problems, {found['rounds']} rounds, {CORES} cores, load before {found['load_average_before']:.1f}",
        versions,
        "",
        f"{'':24}{'median':>12}{'least':>12}{'most':>12}",
    ]
    for title, name in {"(a) package, s": "package", "(b) cvxpy, HiGHS, s": "cvxpy"}.items():
        own = found["seconds"][name]
        lines.append(f"{title:24}" + "".join(f"{own[which]:12.3f}" for which in ("median", "least", "most")))
    numbers = "".join(f"{found['ratio'][which]:12.1f}" for which in ("median", "least", "most"))
    target = found["targets"]["seconds"]
    return "\n".join(
        [
            *lines,
            f"{'(b)/(a)':24}{numbers}",
            "",
            f"sum of (b) over sum of (a): {found['ratio_of_sums']:.1f}; (b) gave up {found['given_up']} times",
            f"slowest of (a): asked below {target['asked']:g} s, {'met' if target['met'] else 'missed'}",
            f"largest gap of (a): {found['largest_gap']:.1e}",
            f"largest difference of (a) and (b): {found['difference']:.1e}, allowed {ALLOWED_DIFFERENCE:.0e}",
        ]
    )


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Speed of a proven allocation over ladders against cvxpy.",
            ("instances", 10, "random problems"),
            answer,
            table,
        )
    )
