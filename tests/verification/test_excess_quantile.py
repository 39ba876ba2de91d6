"""What a share of the units lies beyond where zones and settings move, by the units of one design."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tolalloc as ta
from tests.builders import verifier_of_sum
from tolalloc.allocation.search.steering import Programs, steering
from tolalloc.allocation.space.tail import tail_units, tail_weights
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

ROW = {"nominal": 0, "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.001, "max": 0.4}


def kinked(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a + 5 * np.maximum(0.0, b)


def two_sums(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return a + 0.2 * b, b - 0.2 * a


def prepared(function: object, outputs: dict[str, ta.Limit]) -> Prepared:
    """Return the study of a function of two sizes of ±20 µm, which cost 1 and 3."""
    drawing = ta.Drawing.of_rows([{"id": "a", "cost": 1, **ROW}, {"id": "b", "cost": 3, **ROW}])
    model = ta.model(function, inputs=("a", "b"), outputs=tuple(outputs))
    return Prepared(study=ta.Study(model, drawing, limits=outputs))


def verified(study: Prepared, scale: float, units: int = 2**14) -> tuple[Verifier, VerifiedDesign]:
    """Return what verifies designs of a study, and the design with all zones times a scale."""
    verifier = Verifier(
        space=study.space,
        model=study.model,
        requirements=study.requirements_with_joint,
        seeds=SeedTree(0),
        units=units,
        confidence=0.5,
    )
    return verifier, verifier.verify(study.space.uniform(scale), "alike")


@pytest.fixture(scope="module")
def kink() -> tuple[Verifier, VerifiedDesign]:
    return verified(prepared(kinked, {"y [mm]": ta.Limit(upper=0.04)}), 0.45)


@pytest.fixture(scope="module")
def two() -> tuple[Verifier, VerifiedDesign]:
    limits = {"u [mm]": ta.Limit(upper=0.012), "v [mm]": ta.Limit(lower=-0.012, upper=0.012)}
    return verified(prepared(two_sums, limits), 0.5)


@pytest.mark.parametrize(("units", "share"), [(2304, 0.0027), (6144, 0.02), (400, 0.1)])
def test_of_normal_values_the_weights_give_the_very_quantile_and_its_slopes(units, share):
    count = tail_units(units, share)
    weights = tail_weights(units, share, count)
    scores = norm.isf((np.arange(count) + 0.5) / units)
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert weights @ (3.0 + 2.0 * scores) == pytest.approx(3.0 + 2.0 * norm.isf(share), abs=1e-12)


def test_a_law_that_decides_alone_leaves_units_nothing_to_say():
    verifier = verifier_of_sum(6.0, 8.0, limit=5.0)
    found = verifier.verify(verifier.space.uniform(1.0), "as drawn")
    assert found.quantiles == ()
    assert found.beside_quantiles == found.constraints


@pytest.mark.parametrize("case", ["kink", "two"])
def test_at_its_own_design_it_stands_where_the_verdict_does(case, request):
    _, found = request.getfixturevalue(case)
    (own,) = found.quantiles
    assert own(found.design)[0] == pytest.approx(own.level, abs=1e-12)
    verdict = found.checks[-1].constraints[0]
    assert np.sign(own.level) == np.sign(verdict.excess)


@pytest.mark.parametrize("level", [-0.03, -1e-6, 0.0, 1e-6, 0.2])
def test_over_the_deviations_what_keeps_the_limits_keeps_them(two, level):
    """The limits of 12 µm are 3.52 and 3.50 deviations of their outputs."""
    (own,) = two[1].quantiles
    found, relative = own.at_level(level, 0.0, 2**14).level, [part.relative for part in own.parts]
    assert np.sign(found) == np.sign(level)
    assert min(relative) * abs(level) <= abs(found) <= max(relative) * abs(level)


@pytest.mark.parametrize("case", ["kink", "two"])
def test_its_derivative_is_that_of_differences(case, request):
    _, found = request.getfixturevalue(case)
    (own,), step = found.quantiles, 1e-6
    slopes = [
        (own(found.design + step * side)[0] - own(found.design - step * side)[0]) / (2 * step) for side in np.eye(2)
    ]
    np.testing.assert_allclose(own(found.design)[1], slopes, rtol=1e-3)


@pytest.mark.parametrize("case", ["kink", "two"])
def test_it_foresees_what_other_units_of_another_design_say(case, request):
    verifier, first = request.getfixturevalue(case)
    other, off, output = first.design * [1.15, 0.9], [], first.checks[0].requirement.output
    for seed in range(12):
        fresh = replace(verifier, seeds=SeedTree(100 + seed), units=2**12)
        found, seen = fresh.verify(first.design, "first"), fresh.verify(other, "other")
        # Both are over the deviation of their own units, which is that of the zones.
        scale = seen.furthest[output][0].deviation / found.furthest[output][0].deviation
        off.append(found.quantiles[0](other)[0] - seen.quantiles[0].level * scale)
    assert abs(np.mean(off)) < 4 * np.std(off, ddof=1) / np.sqrt(12)


def test_the_error_where_planes_are_far_is_that_of_other_units(kink):
    verifier, found = kink
    others = [replace(verifier, seeds=SeedTree(seed)).verify(found.design, "alike") for seed in range(1, 21)]
    values = np.array([own.constraints[0].value for own in others])
    errors = np.array([own.constraints[0].standard_error for own in others])
    # The deviation of twenty values is known within 1/√38 of itself, 16 %; four of these.
    assert 1 / 1.65 < errors.mean() / values.std(ddof=1) < 1.65


@pytest.mark.parametrize("case", ["kink", "two"])
def test_a_step_is_the_cheapest_of_a_grid_in_its_region(case, request):
    _, found = request.getfixturevalue(case)
    goal, space, processes = steering(found, [found], margin=0.0), found.space, np.zeros(2, int)
    programs = Programs(space)
    step = programs.step(goal, processes, found.design, 1.8)
    low, high = programs.box(processes, found.design, 1.8)
    first, second = (np.linspace(*ends, 40) for ends in zip(low, high, strict=True))
    designs = np.stack([own.ravel() for own in np.meshgrid(first, second)], axis=1)
    kept = designs[[goal.excess(own) <= 0.0 for own in designs]]
    assert goal.excess(step) < 0.02
    assert space.cost(step) < 1.001 * space.cost(kept).min()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_the_answer_of_a_kinked_function_is_the_cheapest_of_a_grid(seed):
    drawing = ta.Drawing.of_rows([{"id": "a", "cost": 1, **ROW}, {"id": "b", "cost": 3, **ROW}])
    model = ta.model(kinked, inputs=("a", "b"), outputs=("y [mm]",))
    study = ta.Study(model, drawing, limits={"y [mm]": ta.Limit(upper=0.04)}, seed=seed).with_effort("quick")
    found = study.ask(ta.Allocation(front=False, what_if=False)).result
    x = np.random.default_rng(9).normal(size=(2, 10**6)) * 0.02 / 3
    kept = np.mean(kinked(*(x * found.chosen.scales[:, np.newaxis])) <= 0.04)
    assert found.met
    assert kept > 0.9973 - 4 * np.sqrt(0.0027 / 10**6)
    best = np.inf
    for ratio in np.geomspace(
        1.0, 4.0, 25
    ):  # of every ratio of zones the largest that keeps the limit, y being homogeneous
        scale = 0.04 / np.quantile(kinked(x[0] * ratio, x[1]), 0.9973)
        best = min(best, 1 / (ratio * scale) + 3 / scale)
    assert found.cost < 1.01 * best
