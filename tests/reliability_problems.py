"""Published reliability problems of ``validation/reliability.json``, written in standard normal variables."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from tests.marginals import LargestValue, LimitOfInputs, LogNormal, Normal, Uniform

PROBLEMS = {
    item["id"]: item
    for item in json.loads(
        Path(__file__).with_name("validation").joinpath("reliability.json").read_text(encoding="utf-8")
    )["problems"]
}
FOUR_BRANCHES = "FourBranch_p=7/sqrt2"
MARGINALS = {
    "normal": lambda first, second: Normal(mean=first, deviation=second),
    "uniform": lambda first, second: Uniform(low=first, high=second),
    "lognormal(mean,std)": lambda first, second: LogNormal(mean=first, deviation=second),
    "gumbel_max(mean,std)": lambda first, second: LargestValue(mean=first, deviation=second),
}


def four_branches(x: np.ndarray) -> np.ndarray:
    along, across = (x[:, 0] + x[:, 1]) / np.sqrt(2), x[:, 0] - x[:, 1]
    bent, straight = 3 + 0.1 * across**2, 7 / np.sqrt(2)
    return np.min([bent - along, bent + along, straight + across, straight - across], axis=0)


MARGINS = {
    "RP8": lambda x: x @ np.array([1.0, 2.0, 2.0, 1.0, -5.0, -5.0]),
    "RP14": lambda x: x[:, 0] - 32 / (np.pi * x[:, 1] ** 3) * np.sqrt(x[:, 2] ** 2 * x[:, 3] ** 2 / 16 + x[:, 4] ** 2),
    "RP22": lambda x: 2.5 - (x[:, 0] + x[:, 1]) / np.sqrt(2) + 0.1 * (x[:, 0] - x[:, 1]) ** 2,
    "RP31": lambda x: 2 - x[:, 1] + 256 * x[:, 0] ** 4,
    "RP75": lambda x: 3 - x[:, 0] * x[:, 1],
    "R-S": lambda x: x[:, 0] - x[:, 1],
    FOUR_BRANCHES: four_branches,
}


def problem(name: str) -> LimitOfInputs:
    inputs = PROBLEMS[name]["inputs"]
    return LimitOfInputs(
        marginals=tuple(MARGINALS[kind](float(first), float(second)) for _, kind, first, second in inputs),
        margin=MARGINS[name],
    )


def exact(name: str) -> float:
    return float(PROBLEMS[name]["computed"]["pf"])
