"""zhang2025's allocation: a closed form, a certificate of its own, re-tuned filters, priced effort, its algorithm.

The source's own numbers are lost; the chain file says what is assumed in their place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from studies.published.zhang2025_genetic import genetic_allocation
from tests.validation_manual import shown
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.control import kalman_filter, regulator
from tolalloc.wings.assembly.files import load_plan
from tolalloc.wings.assembly.gains import Gains, final_errors, tuned_gains
from tolalloc.wings.assembly.tolerances import allocate_angles, allocated, best_state_weight, retuned_allocation

PLAN = load_plan("bx40e")
PRICED = replace(PLAN, requirements=replace(PLAN.requirements, effort_price=0.02 / ARCSECOND**2))


def own_certificate(allocation, start: np.ndarray) -> float:
    """Largest found g(λ) = Σ min over s of [c·s^−1/2 + (Aᵀλ)s] − λᵀb with s = t² in arcsec², from the covariance."""
    errors, asked = allocation.gains.errors, PLAN.requirements
    cost, noise = asked.factor.ravel() / ARCSECOND, np.diag(errors.noise_covariance).reshape(4, 3) / ARCSECOND**2
    squares = (errors.by_part**2).reshape(4, 3, 12)
    rows = np.concatenate([squares[:, 0] + squares[:, 1], squares[:, 2]])
    limits = np.concatenate([asked.tilt_limit, asked.rotation_limit]) / ARCSECOND
    budgets = limits**2 - 9 * np.concatenate([noise[:, 0] + noise[:, 1], noise[:, 2]])

    def dual(prices: np.ndarray) -> float:
        each = rows.T @ prices
        s = np.clip((cost / (2 * each)) ** (2 / 3), 3.0**2, 120.0**2)
        return float((cost / np.sqrt(s) + each * s).sum() - prices @ budgets)

    logs, best = np.log(start), -np.inf
    for _ in range(5):
        found = minimize(lambda z: -dual(np.exp(z)), logs, method="L-BFGS-B", options={"ftol": 1e-16, "gtol": 1e-12})
        logs, best = found.x, max(best, -found.fun)
    return best


def missing_though_nothing_is_turned() -> Gains:
    """Return gains that turn nothing and yet miss at every step, as the printed cost without adjustment counts."""
    noise = (PLAN.measurement_noise, PLAN.adjustment_noise)
    still = regulator(PLAN.space, PLAN.final_weight(0.0))
    kalman = kalman_filter(PLAN.space, PLAN.variances, *noise, PLAN.name)
    errors = final_errors(PLAN.space, still, kalman, *noise)
    return Gains(state_weight=0.0, regulator=still, kalman=kalman, adjustment_noise=noise[1], errors=errors)


@pytest.mark.parametrize(
    ("gains", "cost"),
    [
        (missing_though_nothing_is_turned(), 189.482118677),
        (tuned_gains(PLAN, 0.0, PLAN.tolerances), 148.278028090),
        (tuned_gains(PLAN, 10.0, PLAN.tolerances), 19.130564451),
    ],
)
def test_cost_of_the_assumed_instance_is_certified(gains, cost):
    found = allocated(PLAN, gains)
    assert found.cost == pytest.approx(cost, abs=0.51e-9)
    if cost == 19.130564451:
        shown("C7", found.cost)
    assert found.gap <= 1e-9
    start = np.maximum(found.prices * ARCSECOND / (2 * found.limits.values / ARCSECOND), 1e-12)
    bound = own_certificate(found, start)
    assert bound <= found.cost * (1 + 1e-12)
    assert bound == pytest.approx(found.cost, rel=1e-9)


def test_one_limit_has_a_closed_form():
    """t = T·c^{1/3}/√Σc^{2/3} for four tolerances that all count once."""
    chain = replace(PLAN.chain, parts=PLAN.chain.parts[:2])
    asked, limit, kept = PLAN.requirements, 24 * ARCSECOND, np.array([[True, True, False]] * 2)
    plan = replace(
        PLAN,
        chain=chain,
        steps=PLAN.steps[:2],
        tolerances=PLAN.tolerances[:2],
        weights=PLAN.weights[:2],
        adjustment_noise=0.0,
        requirements=replace(
            asked,
            tilt_limit=np.array([np.inf, limit]),
            rotation_limit=np.full(2, np.inf),
            factor=asked.factor[:2],
            fixed=asked.fixed[:2],
            scale=asked.scale[:2],
        ),
    )
    found = allocate_angles(plan, state_weight=0.0)
    cost = (asked.factor[:2] / found.tolerances)[kept].sum()
    # The cost is flat at its least, so a gap of 1e-12 leaves the tolerances known to its root.
    expected = [12.78063689, 12.78063689, 11.16491472, 11.16491472]
    assert found.tolerances[kept] / ARCSECOND == pytest.approx(expected, rel=3e-6)
    assert cost == pytest.approx(33.10901345, abs=5.1e-9)
    assert found.tolerances[~kept] == pytest.approx(asked.largest)
    c = np.array([120.0, 120.0, 80.0, 80.0])
    assert cost == pytest.approx((c ** (2 / 3)).sum() ** 1.5 / 24, rel=1e-10)
    assert found.gap <= 1e-9
    assert found.prices * ARCSECOND == pytest.approx([cost / 24], rel=1e-6)


@pytest.mark.slow
def test_adjusting_makes_the_tolerances_eight_times_cheaper():
    assert allocate_angles(PLAN, 0.0).cost / allocate_angles(PLAN, 10.0).cost == pytest.approx(7.75, abs=0.01)


@pytest.mark.slow
def test_without_adjusting_it_does_not_matter_what_might_be_turned():
    costs = [allocate_angles(plan, 0.0).cost for plan in (PLAN, PLAN.turning_fewer)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)


@pytest.mark.slow
def test_filters_tuned_again_save_another_quarter():
    found = retuned_allocation(PLAN)
    costs = [each.cost for each in found.allocations]
    assert costs[:4] == pytest.approx([19.1306, 15.1417, 14.5483, 14.4692], abs=5.1e-5)
    assert found.settled
    assert found.best.cost == pytest.approx(14.457, abs=5.1e-4)
    assert found.best.gap <= 1e-9


@pytest.mark.slow
def test_priced_effort_has_a_best_precision():
    found = best_state_weight(PRICED)
    assert found.interior
    assert found.best.gains.state_weight == pytest.approx(3.035, abs=5.1e-4)
    assert found.best.total == pytest.approx(49.1616, abs=5.1e-5)
    assert found.best.gap <= 1e-9
    assert allocate_angles(PRICED, 10.0).total == pytest.approx(53.56, abs=5.1e-3)


@pytest.mark.slow
def test_genetic_algorithm_ends_up_to_one_per_cent_above_the_certified_cost():
    """Ten seeds; the smallest, median and largest gap at Q = 10."""
    allocation = allocate_angles(PLAN)
    found = [genetic_allocation(PLAN, allocation, SeedTree(seed)) for seed in range(10)]
    gaps = np.array([each.gap for each in found])
    for each in found:
        spread = allocation.limits.spread(allocation.gains.errors, each.tolerances)
        assert (spread / allocation.limits.values).max() <= 1 + 1e-9
    assert gaps.min() > 0
    assert np.median(gaps) == pytest.approx(0.003, abs=0.002)
    assert gaps.max() < 0.02
