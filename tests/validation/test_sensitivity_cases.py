"""Published sensitivity problems: the closed-form indices against the intervals of this package.

The indices are those of ``sensitivity.json``. Bootstrap intervals are a statement about independent blocks, so blocks
are random here. Those of a scrambled Sobol' sequence are not independent: most errors are far smaller than the interval
says, but a few scramblings in a hundred put a tiny index many deviations off, which no resample of theirs shows.

Shares are measured over 1000 repetitions. Of 410 times 100 of them (41 indices), 18 have fewer than 97 inside the 99 %
interval; about 8 would if it covered in exactly 99 %. Its true share is near 98.6 %: percentile intervals are somewhat
narrow for few blocks. The first hundred is asked for by itself, and the share over all of them besides.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, norm

from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.ranking import percentile_interval
from tolalloc.sensitivity.saltelli import saltelli_indices

PROBLEMS = {
    item["id"]: item
    for item in json.loads(Path(__file__).with_name("sensitivity.json").read_text(encoding="utf-8"))["problems"]
}
BLOCKS, RESAMPLES = 1024, 1000
BATCHES, REPETITIONS = 20, 50
"""Batches of repetitions; the repetitions of a batch share their resamples, not their samples."""
G_CONSTANTS = np.array(PROBLEMS["sobol_g_saltelli8"]["params"]["a"], float)

FUNCTIONS = {
    "ishigami_a7_b0.1": lambda x: np.sin(x[..., 0]) * (1 + 0.1 * x[..., 2] ** 4) + 7 * np.sin(x[..., 1]) ** 2,
    "sobol_g_saltelli8": lambda x: ((np.abs(4 * x - 2) + G_CONSTANTS) / (1 + G_CONSTANTS)).prod(axis=-1),
    "borgonovo3": lambda x: x[..., 0] * x[..., 1] + x[..., 2],
    "gaussian_product_2d": lambda x: x.prod(axis=-1),
    "portfolio3_saltelli2004_1": lambda x: x @ np.array([100.0, 500.0, 1000.0]),
}

TOLD = 0.9
"""Confidence of the intervals that the package tells [-]."""


def inputs(name: str, uniform: np.ndarray) -> np.ndarray:
    values = np.empty_like(uniform)
    for at, (_, kind, first, second) in enumerate(PROBLEMS[name]["inputs"]):
        own = uniform[..., at]
        values[..., at] = first + (second - first) * own if kind == "uniform" else first + second * norm.ppf(own)
    return values


def answers(name: str, seeds: SeedTree, repetitions: int, second_order: bool) -> Evaluation:
    """Return a Saltelli design's answers; every repetition has samples of its own and is one output."""
    sources = len(PROBLEMS[name]["inputs"])
    uniform = next(seeds.uniform_chunks(BLOCKS, repetitions * 2 * sources)).reshape(BLOCKS, repetitions, 2 * sources)
    a, b = inputs(name, uniform[..., :sources]), inputs(name, uniform[..., sources:])
    samples = [a]
    for outer, inner in ((a, b), (b, a))[: 1 + second_order]:
        samples += [np.where(np.arange(sources) == source, inner, outer) for source in range(sources)]
    y = np.stack([FUNCTIONS[name](x) for x in (*samples, b)], axis=1).reshape(-1, repetitions)
    return Evaluation(values=y, status=np.zeros(y.shape[0], np.uint8))


def references(name: str) -> dict[str, np.ndarray]:
    known = PROBLEMS[name]["reference"]
    found = {"first": np.array(known["S1"]), "total": np.array(known["ST"])}
    if "S2" in known:
        found["second"] = np.array([known["S2"][pair] for pair in ("1-2", "1-3", "2-3")], float)
    return found


@cache
def resamples(name: str) -> dict[str, np.ndarray]:
    """Return the resampled indices of all repetitions [repetition, resample, index]."""
    known, found = references(name), {}
    for batch in range(BATCHES):
        seeds = SeedTree(batch).child("validation", name)
        indices = saltelli_indices(
            answers(name, seeds.child("samples"), REPETITIONS, "second" in known),
            len(known["first"]),
            seeds.child("resamples"),
            second_order="second" in known,
            resamples=RESAMPLES,
        )
        for kind in known:
            found.setdefault(kind, []).append(getattr(indices, f"{kind}_resamples"))
    return {kind: np.concatenate(parts) for kind, parts in found.items()}


def _interval(resampled: np.ndarray, confidence: float) -> np.ndarray:
    """Return the interval that the package tells, of 90 %, or one of another confidence of the same resamples."""
    tails = (1 - confidence) / 2, (1 + confidence) / 2
    return percentile_interval(resampled) if confidence == TOLD else np.quantile(resampled, tails, axis=0)


@cache
def inside(name: str, confidence: float) -> dict[str, np.ndarray]:
    """Return whether the interval holds the reference [repetition, index]."""
    found = {}
    for kind, known in references(name).items():
        ends = np.stack([_interval(own, confidence) for own in resamples(name)[kind]])
        found[kind] = (ends[:, 0] <= known) & (known <= ends[:, 1])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_the_reference_lies_in_the_99_percent_interval(name):
    """All of 41 indices in the stated share of 100 repetitions, but for one such look in a thousand."""
    fewest = binom.ppf(1e-3 / 41, 100, 0.99)
    for kind, held in inside(name, 0.99).items():
        assert held[:100].sum(axis=0).min() >= fewest, f"{kind}: {held[:100].sum(axis=0)}"
        assert held.mean(axis=0).min() >= 0.97, f"{kind}: {held.mean(axis=0)}"


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_90_percent_intervals_cover_as_they_say(name):
    """The standard error of a share of 90 % over 1000 repetitions is 0.95 %, so the limits are five of them away."""
    for kind, held in inside(name, TOLD).items():
        shares = held.mean(axis=0)
        assert ((shares >= 0.85) & (shares <= 0.95)).all(), f"{kind}: {shares}"


def test_every_problem_has_a_function_and_every_function_a_problem():
    assert PROBLEMS.keys() == FUNCTIONS.keys()


@pytest.mark.parametrize("name", PROBLEMS)
def test_mean_and_variance_are_the_stated_ones(name):
    """The functions are those of the file: a wrong constant would show here first."""
    known = PROBLEMS[name]["reference"]
    y = answers(name, SeedTree(0).child("moments"), 200, False).values.reshape(BLOCKS, -1, 200)[:, [0, -1]].ravel()
    error = y.std() / np.sqrt(y.size)
    assert abs(y.mean() - known["mean"]) <= 4 * error
    assert abs(y.var() - known["variance"]) <= 4 * ((y - y.mean()) ** 2).std() / np.sqrt(y.size)
