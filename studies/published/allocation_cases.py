"""Published allocation problems as this package states them, read from the file that the tests read too."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.model import CostModel, Exponential, Process, Reciprocal
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Stack
from tolalloc.capability.indices import Limits

from .stacks import modified_root_sum_square, root_sum_square, worst_case, yield_root_sum_square

_FILE = Path(__file__).parents[2] / "tests" / "validation" / "allocation.json"
CASES: dict[str, Any] = {item["id"]: item for item in json.loads(_FILE.read_text(encoding="utf-8"))["problems"]}


def clutch_sensitivities(cage: float) -> Float[np.ndarray, " 4"]:
    """Return the change of the clutch's angle with its four dimensions, for a nominal size of the cage [rad/mm]."""
    size = CASES["clutch_choi2000"]["nominal"]
    radius = (size["X2"] + size["X3"]) / 2
    above, below = size["X1"] + radius, cage - radius
    of_cosine = np.array([1, 0.5 + 0.5 * above / below, 0.5 + 0.5 * above / below, -above / below]) / below
    return -of_cosine / sqrt(1 - (above / below) ** 2)


def clutch(loss: float, cage: float = 101.6, method: str = "root sum square") -> AllocationProblem:
    """Return the overrunning clutch.

    Parameters
    ----------
    loss
        Quality loss of a clutch at the limit of its angle [cost units].
    cage
        Nominal size of the cage [mm].
    method
        Root sum square or worst case.
    """
    case, sensitivities = CASES["clutch_choi2000"], clutch_sensitivities(cage)
    budget = case["requirement"]["half_width"]
    features = tuple(
        PricedFeature(
            name=name,
            processes=tuple(
                Process(
                    name=f"{name} by process {at}",
                    cost=Reciprocal(fixed=float(own["a"]), factor=float(own["b"])),
                    minimum=own["t_min"],
                    maximum=own["t_max"],
                )
                for at, own in enumerate(processes, start=1)
            ),
            loss=float(loss * (slope / 3 / budget) ** 2),
        )
        for (name, processes), slope in zip(case["processes"].items(), sensitivities, strict=True)
    )
    made = {"root sum square": root_sum_square, "worst case": worst_case}[method]
    return AllocationProblem(features=features, stacks=(made("angle", sensitivities, budget),))


def gap_chain(variant: str) -> AllocationProblem:
    """Return one of the variants of the three-part gap whose yield is kept."""
    case = CASES["gap_chain"]
    cost, limits = case["cost"], case["requirement"]["limits"]
    lower, upper = [cost["t_min"]] * 3, [cost["t_max"]] * 3
    costs: Sequence[CostModel] = [Reciprocal(fixed=float(cost["fixed"]), factor=factor) for factor in cost["b"]]
    if variant == "t_min of x1 is 0.25":
        lower[0] = 0.25
    elif variant == "t_max of x3 is 0.30":
        upper[2] = 0.30
    elif variant == "exponential":
        own = case["computed"][variant]
        costs = [Exponential(fixed=1.0, factor=float(factor), scale=own["scale"]) for factor in own["b"]]
    features = tuple(
        PricedFeature(
            name=f"x{at + 1}", processes=(Process(name="only", cost=costs[at], minimum=lower[at], maximum=upper[at]),)
        )
        for at in range(3)
    )
    stack = yield_root_sum_square(
        "gap",
        np.array(case["sensitivities"], float),
        Limits(lower=limits[0], upper=limits[1]),
        mean=float(np.dot(case["sensitivities"], case["nominal"])),
        share=case["requirement"]["yield"],
        deviations=float(case["requirement"]["deviations"]),
    )
    return AllocationProblem(features=features, stacks=(stack,))


def bearing_moments(zones: dict[str, float] | None = None) -> tuple[float, Float[np.ndarray, " contributor"]]:
    """Return mean and standard deviations of the contributors of the bearing stack.

    Parameters
    ----------
    zones
        ± tolerances of normal contributors that replace those of the drawing [mm].
    """
    mean, deviations = 0.0, []
    for own in CASES["bearing_stack"]["contributors"]:
        half = (zones or {}).get(own["name"], (own["plus"] - own["minus"]) / 2)
        middle, deviation = (own["plus"] + own["minus"]) / 2, half / 3
        if own["distribution"] == "uniform":
            deviation = half / sqrt(3)
        elif own["distribution"] == "two points":
            middle = float(np.dot(own["shares"], own["points"]))
            deviation = sqrt(np.dot(own["shares"], (np.array(own["points"]) - middle) ** 2))
        mean += own["sign"] * (own["nominal"] + middle)
        deviations.append(deviation)
    return mean, np.array(deviations)


def limit_stack(
    rows: Sequence[Sequence[float]],
) -> tuple[float, Float[np.ndarray, " dimension"], Float[np.ndarray, " dimension"]]:
    """Return nominal in the middle of the zones, signs and ± tolerances of rows of size, plus and minus.

    The sign of a size is its direction in the stack; plus and minus are those of the size without its sign.
    """
    sizes, plus, minus = np.array(rows, float).T
    signs = np.sign(sizes)
    return float(signs @ (np.abs(sizes) + (plus + minus) / 2)), signs, (plus - minus) / 2


def figures(sensitivities: Float[np.ndarray, " feature"], zones: Float[np.ndarray, " feature"]) -> dict[str, float]:
    """Return the zone of a requirement by the usual methods."""
    methods = {"WC": worst_case, "RSS": root_sum_square, "MRSS": modified_root_sum_square}
    return {key: _load(made("figure", sensitivities, 1.0), zones) for key, made in methods.items()}


def _load(stack: Stack, zones: Float[np.ndarray, " feature"]) -> float:
    return float(stack.load(zones, np.empty(0)))
