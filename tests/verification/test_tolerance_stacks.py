"""Tolerance stacks: what each method adds up to, and what it guarantees."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

import tolalloc as ta
from studies.published.stacks import (
    inertial,
    inflated,
    mean_shift,
    modified_root_sum_square,
    root_sum_square,
    worst_case,
    yield_root_sum_square,
)
from tolalloc.capability.indices import Limits
from tolalloc.exceptions import InputError

SLOPES, ZONES, NONE = np.array([1.0, -2.0, 0.5, 0.0]), np.array([0.1, 0.2, 0.3, 0.4]), np.empty(0)
WORST, SQUARES = 0.65, np.sqrt(0.01 + 0.16 + 0.0225)


def test_every_method_adds_up_as_its_formula_says():
    shares = np.array([0.1, 0.2, 0.3, 0.4])
    used = np.abs(SLOPES) * ZONES
    modified = SQUARES * (0.5 * (WORST - SQUARES) / (SQUARES * (np.sqrt(3) - 1)) + 1)
    for stack, expected in (
        (worst_case("gap", SLOPES, 1.0), WORST),
        (root_sum_square("gap", SLOPES, 1.0), SQUARES),
        (inflated("gap", SLOPES, 1.0, factor=1.5), 1.5 * SQUARES),
        (modified_root_sum_square("gap", SLOPES, 1.0), modified),
        (mean_shift("gap", SLOPES, 1.0, shift=shares), shares @ used + np.sqrt((((1 - shares) * used) ** 2).sum())),
        (inertial("gap", SLOPES, 1.0, capability=1.0), np.sqrt(3 + 9) * SQUARES),
    ):
        assert stack.load(ZONES, NONE) == pytest.approx(expected, rel=1e-14)
        assert stack.budget == 1.0


def capability(inertias: np.ndarray, angles: np.ndarray, half_width: float) -> np.ndarray:
    """Return the Cpk of a centred requirement for splits δ = I·cos, σ = I·sin, all off to the bad side."""
    used = np.abs(SLOPES) * inertias
    off, sigma = (used * np.cos(angles)).sum(axis=-1), np.sqrt(((used * np.sin(angles)) ** 2).sum(axis=-1))
    return (half_width - off) / (3 * sigma)


def test_the_inertial_stack_guarantees_its_capability_for_every_split(generator):
    for wanted in (0.5, 1.0, 1.67):
        for _ in range(20):
            inertias = generator.uniform(0.01, 1, 4)
            half_width = float(inertial("gap", SLOPES, 1.0, wanted).load(inertias, NONE))
            assert capability(inertias, generator.uniform(0, np.pi / 2, (5000, 4)), half_width).min() >= wanted


def test_the_inertial_stack_is_attained_by_equal_inertias():
    """Every |D|·I of 0.1 with δ = V/√(n + 9C²), where V = 0.1·√3."""
    inertias = 0.1 / np.abs(np.where(SLOPES, SLOPES, 1.0))
    half_width = float(inertial("gap", SLOPES, 1.0, 1.33).load(inertias, NONE))
    angle = np.arccos(np.sqrt(3) / np.sqrt(3 + 9 * 1.33**2))
    assert capability(inertias, np.full(4, angle), half_width) == pytest.approx(1.33, rel=1e-12)
    centred = float(root_sum_square("gap", 3 * 1.33 * SLOPES, 1.0).load(inertias, NONE))
    assert capability(inertias, np.full(4, angle), centred) < 1.33


@pytest.mark.parametrize(
    ("limits", "mean"),
    [
        (Limits(lower=-1.0, upper=1.0), 0.0),
        (Limits(lower=-1.0, upper=1.0), 0.7),
        (Limits(upper=2.0), -1.0),
        (Limits(lower=0.3), 0.8),
    ],
)
@pytest.mark.parametrize("share", [0.6, 0.9973, 1 - 1e-9])
def test_the_budget_of_a_yield_is_the_deviation_that_just_keeps_it(limits, mean, share):
    stack = yield_root_sum_square("gap", SLOPES, limits, mean=mean, share=share, deviations=4.0)
    low = -np.inf if limits.lower is None else limits.lower
    high = np.inf if limits.upper is None else limits.upper
    outside = norm.sf((high - mean) / stack.budget) + norm.cdf((low - mean) / stack.budget)
    assert outside == pytest.approx(1 - share, rel=1e-6)
    assert stack.load(ZONES, NONE) == pytest.approx(SQUARES / 4, rel=1e-14)


def test_what_no_stack_can_mean_is_refused():
    limits = Limits(lower=-1.0, upper=1.0)
    for refuse, words in (
        (lambda: inflated("gap", SLOPES, 1.0, factor=0.9), "factor"),
        (lambda: mean_shift("gap", SLOPES, 1.0, shift=1.1), "shift"),
        (lambda: inertial("gap", SLOPES, 1.0, capability=-1.0), "capability"),
        (lambda: modified_root_sum_square("gap", SLOPES[:2], 1.0), "number of features"),
        (lambda: yield_root_sum_square("gap", SLOPES, limits, mean=1.0, share=0.9), "mean"),
        (lambda: yield_root_sum_square("gap", SLOPES, limits, mean=0.0, share=0.5), "share"),
    ):
        with pytest.raises(InputError, match=f"stack gap: {words}"):
            refuse()


@pytest.mark.slow
@pytest.mark.parametrize("nominal", [0.0, 10.0])
def test_a_worst_case_with_bought_parts_costs_what_lagrange_says(nominal):
    """Seven sizes, three bought: of 15 µm these take 6.5, and the least of Σ cᵢ/tᵢ within 8.5 is (Σ√cᵢ)²/8.5."""
    row = {"nominal": nominal, "unit": "mm"}
    halves, costs = {"shaft": 8, "housing": 8, "cover": 2, "spacer": 2}, (16, 20, 10, 7)
    made = [
        {"id": name, **row, "plus": half / 1e3, "minus": -half / 1e3, "min": 2e-4, "max": 0.04, "cost": cost}
        for (name, half), cost in zip(halves.items(), costs, strict=True)
    ]
    bought = [
        {"id": name, **row, "plus": half, "minus": -half, "min": half, "max": half, "cost": 1, "locked": "yes"}
        for name, half in (("one", 0.0025), ("two", 0.0025), ("ring", 0.0015))
    ]
    study = ta.Study(
        ta.model(
            lambda a, b, c, d, *e: a - b + c - d + sum(e), inputs=(*halves, "one", "two", "ring"), outputs=("y [mm]",)
        ),
        ta.Drawing.of_rows(made + bought),
        limits={"y [mm]": ta.Limit(lower=3 * nominal - 0.015, upper=3 * nominal + 0.015, show=ta.WorstCase())},
        effort="quick",
    )
    answer = study.ask(ta.Allocation(front=False, what_if=False))
    found, said = answer.result, answer.sentences[0]
    least = sum(np.sqrt(cost * half) for cost, half in zip(costs, halves.values(), strict=True)) ** 2 / 8.5 + 3
    assert found.met
    assert found.cost == pytest.approx(least, rel=2e-3)  # whole steps of the zones cost some of it
    assert said.startswith("Met: the y of the worst units found inside the zones is ")
    assert "%" not in said
