"""Angular tolerances: proof of the optimum, prices, sentences, and assemblies built at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from studies.published.zhang2025_genetic import genetic_allocation
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.files import load_plan
from tolalloc.wings.assembly.tolerances import allocate_angles, best_state_weight, retuned_allocation, verify_angles

PLAN = load_plan("bx40e")
FREE = np.full(4, np.inf)


def asking(plan=PLAN, **changes):
    return replace(plan, requirements=replace(plan.requirements, **changes))


PRICED = asking(effort_price=0.02 / ARCSECOND**2)
EXPONENTIAL = asking(
    form="exponential",
    factor=np.array([[9.0, 8.0, 5.0], [6.0, 7.0, 8.0]] * 2),
    fixed=np.full((4, 3), 0.5),
    scale=np.array([[20.0, 30.0, 25.0], [40.0, 35.0, 15.0]] * 2) * ARCSECOND,
)


def numbers(plan, allocation):
    """Rows, budget² and priced effort of an allocation over tolerances² in arcsec², from the covariance itself."""
    errors = allocation.gains.errors
    states = [np.array(own) for own in ([0, 1], [3, 4], [6, 7], [9, 10], [2], [5], [8], [11])]
    limits = np.concatenate([plan.requirements.tilt_limit, plan.requirements.rotation_limit]) / ARCSECOND
    at_zero = errors.covariance(np.zeros(12))
    by_variance = [errors.covariance(one) - at_zero for one in np.eye(12)]
    rows = np.array([[np.trace(each[np.ix_(own, own)]) for each in by_variance] for own in states])
    noise = np.array([np.trace(at_zero[np.ix_(own, own)]) for own in states]) / ARCSECOND**2
    price = plan.requirements.effort_price * ARCSECOND**2
    return rows, limits**2 - 9 * noise, price * errors.effort_by_variance / 9


@pytest.mark.parametrize("plan", [PLAN, PRICED, EXPONENTIAL], ids=["reciprocal", "priced", "exponential"])
@pytest.mark.parametrize("precision", [0.0, 1.0, 10.0])
def test_optimum_is_proven_and_keeps_the_limits(plan, precision):
    found = allocate_angles(plan, precision)
    assert -1e-12 <= found.gap <= 1e-9
    assert (found.spread / found.limits.values).max() <= 1 + 1e-9
    variance = np.diag(found.gains.errors.covariance((found.tolerances / 3).ravel() ** 2)).reshape(4, 3)
    spread = 3 * np.sqrt(np.concatenate([variance[:, 0] + variance[:, 1], variance[:, 2]]))
    assert found.spread == pytest.approx(spread, rel=1e-12)
    effort = found.gains.errors.expected_effort((found.tolerances / 3).ravel() ** 2)
    assert found.effort_cost == pytest.approx(plan.requirements.effort_price * effort, rel=1e-12)


@pytest.mark.parametrize("plan", [PLAN, PRICED, EXPONENTIAL], ids=["reciprocal", "priced", "exponential"])
def test_sequential_quadratic_programming_finds_the_same(plan):
    found, asked = allocate_angles(plan), plan.requirements
    rows, budgets, losses = numbers(plan, found)

    def cost(t):
        if asked.form == "reciprocal":
            made = asked.factor.ravel() / ARCSECOND / t
        else:
            made = asked.factor.ravel() * np.exp(-t * ARCSECOND / asked.scale.ravel())
        return (made + asked.fixed.ravel()).sum() + losses @ t**2

    runs = [
        minimize(
            cost,
            start,
            method="SLSQP",
            bounds=[(3, 120)] * 12,
            constraints={"type": "ineq", "fun": lambda t: 1 - rows @ t**2 / budgets},
            options={"maxiter": 500, "ftol": 1e-13},
        )
        for start in SeedTree(3).generator().uniform(3, 30, (4, 12))
    ]
    constant = asked.effort_price * found.gains.errors.noise_effort
    assert min(run.fun for run in runs if run.success) + constant == pytest.approx(found.total, rel=1e-7)


def test_no_allowed_tolerances_are_cheaper_than_the_bound():
    found = allocate_angles(PRICED)
    rows, budgets, losses = numbers(PRICED, found)
    t = SeedTree(1).generator().uniform(3, 120, (2000, 12))
    # The largest multiple of each draw that keeps all limits.
    t = np.clip(t / np.sqrt((t**2 @ rows.T / budgets).max(axis=1, keepdims=True)), 3, 120)
    t = t[(t**2 @ rows.T <= budgets).all(axis=1)]
    assert len(t) > 1000
    factor = PRICED.requirements.factor.ravel() / ARCSECOND
    constant = PRICED.requirements.effort_price * found.gains.errors.noise_effort
    assert ((factor / t).sum(axis=1) + t**2 @ losses + constant).min() >= found.bound


@pytest.mark.slow
@pytest.mark.parametrize("plan", [PLAN, PRICED], ids=["free effort", "priced effort"])
def test_prices_are_what_a_wider_limit_saves(plan):
    found, step = allocate_angles(plan), 1e-3 * ARCSECOND
    for at, price in enumerate(found.prices):
        field, part = ("tilt_limit", at) if at < 4 else ("rotation_limit", at - 4)
        limit = getattr(plan.requirements, field)
        wider, tighter = (
            allocate_angles(asking(plan, **{field: limit + sign * step * np.eye(4)[part]})).total for sign in (1, -1)
        )
        saved = (tighter - wider) / (2 * step)
        assert price * ARCSECOND == pytest.approx(saved * ARCSECOND, rel=1e-4, abs=1e-6)


def test_without_limits_everything_is_as_wide_as_allowed():
    found = allocate_angles(asking(tilt_limit=FREE, rotation_limit=FREE))
    assert found.tolerances == pytest.approx(np.full((4, 3), 120 * ARCSECOND), rel=1e-9)
    assert found.limits.names == ()
    assert found.gap <= 1e-9


def test_a_limit_below_the_noise_is_refused_by_name():
    with pytest.raises(
        InputError, match=r"of the tilt of KC4 may be 14 arcsec, but .* the noise alone makes 23\.6\d arcsec; measure"
    ):
        allocate_angles(replace(PLAN, measurement_noise=8 * ARCSECOND))
    allocate_angles(replace(PLAN, measurement_noise=8 * ARCSECOND), state_weight=0.0)


def test_a_limit_below_the_smallest_tolerances_is_refused_by_name():
    with pytest.raises(InputError, match=r"tilt of KC4 .* smallest tolerances of 20 arcsec make .* allow smaller"):
        allocate_angles(asking(smallest=20 * ARCSECOND), state_weight=0.0)


@pytest.mark.parametrize("precision", [-1.0, np.inf, np.nan])
def test_a_precision_that_is_none_is_refused(precision):
    with pytest.raises(InputError, match="precision"):
        allocate_angles(PLAN, precision)


def test_a_plan_without_requirements_is_refused():
    with pytest.raises(InputError, match="requirements"):
        allocate_angles(replace(PLAN, requirements=None))


def test_an_unknown_form_of_cost_is_refused():
    with pytest.raises(InputError, match="reciprocal or exponential"):
        allocate_angles(asking(form="linear"))


@pytest.mark.slow
def test_filters_are_tuned_again_until_they_expect_what_is_allocated():
    found = retuned_allocation(PLAN)
    assert found.settled
    last = found.allocations[-1]
    again = allocate_angles(replace(PLAN, tolerances=last.tolerances))
    assert again.tolerances == pytest.approx(last.tolerances, rel=1e-7)
    assert found.best.total == min(each.total for each in found.allocations)
    for each in found.allocations:
        assert each.gap <= 1e-9
        assert (each.spread <= each.limits.values * (1 + 1e-9)).all()


@pytest.mark.slow
def test_an_iteration_cut_short_says_so():
    found = retuned_allocation(PLAN, most_filters=3)
    assert len(found.allocations) == 3
    assert not found.settled


@pytest.mark.slow
def test_a_filter_for_the_allocated_tolerances_need_not_be_the_cheapest():
    """The effort is priced, and the filter knows nothing of prices."""
    found = retuned_allocation(PRICED)
    assert found.settled
    assert found.best is found.allocations[0]
    assert found.allocations[-1].total > 1.001 * found.best.total


@pytest.mark.slow
def test_best_precision_beats_the_curve_and_its_own_neighbours():
    found = best_state_weight(PRICED, lowest=0.5, highest=20.0, points=12)
    assert found.interior
    assert found.best.total <= found.total.min()
    assert found.best.gap <= 1e-9
    for factor in (0.999, 1.001):
        assert allocate_angles(PRICED, factor * found.best.gains.state_weight).total > found.best.total


@pytest.mark.slow
def test_precisions_at_which_no_tolerances_keep_the_limits_have_no_cost():
    noisy = replace(PRICED, measurement_noise=4.5 * ARCSECOND)
    found = best_state_weight(noisy, lowest=0.1, highest=100.0, points=9)
    assert np.isnan(found.total[-1])
    assert np.isfinite(found.total[0])
    assert found.best.total <= np.nanmin(found.total)
    assert not found.interior
    with pytest.raises(InputError, match="keep the limits"):
        best_state_weight(noisy, lowest=50.0, highest=100.0, points=3)


@pytest.mark.parametrize("arguments", [(0.0, 1.0, 5), (2.0, 1.0, 5), (1.0, 2.0, 2)])
def test_a_range_that_is_none_is_refused(arguments):
    with pytest.raises(InputError, match="range and points"):
        best_state_weight(PLAN, *arguments)


@pytest.mark.slow
def test_effort_without_a_price_asks_for_the_end_of_a_range_of_low_precisions():
    found = best_state_weight(PLAN, lowest=0.1, highest=2.0, points=6)
    assert not found.interior
    assert found.best.gains.state_weight == pytest.approx(2, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_genetic_algorithm_keeps_the_limits_and_stays_above_the_bound(seed):
    allocation = allocate_angles(PRICED)
    found = genetic_allocation(PRICED, allocation, SeedTree(seed), generations=60)
    spread = allocation.limits.spread(allocation.gains.errors, found.tolerances)
    assert (spread / allocation.limits.values).max() <= 1 + 1e-9
    assert 0 < found.gap < 0.1
    again = genetic_allocation(PRICED, allocation, SeedTree(seed), generations=60)
    assert np.array_equal(found.tolerances, again.tolerances)


def test_genetic_algorithm_that_finds_nothing_says_so():
    with pytest.raises(SolveError, match="keeps all limits"):
        genetic_allocation(PLAN, allocate_angles(PLAN, 0.0), SeedTree(0), population=4, generations=1)


@pytest.mark.slow
@pytest.mark.parametrize("precision", [0.0, 10.0])
def test_assemblies_built_at_random_have_the_exact_spread(precision):
    """Eight spreads within 4 standard errors."""
    allocation = allocate_angles(PLAN, precision)
    found = verify_angles(PLAN, allocation, SeedTree(0), assemblies=100_000)
    assert (found.standard_error / found.spread).max() < 0.003
    assert np.abs(found.spread - allocation.spread).max() > 0
    assert (np.abs(found.spread - allocation.spread) <= 4 * found.standard_error).all()


@pytest.mark.parametrize("precision", [0.0, 10.0])
def test_share_within_each_limit_is_that_of_a_normal_angle_or_a_round_tilt(precision):
    """Eight shares within 4.5 standard errors; the tilts of this chain have equal variances in x and y."""
    allocation, units = allocate_angles(PLAN, precision), 100_000
    found = verify_angles(PLAN, allocation, SeedTree(0), units)
    reach = 3 * allocation.limits.values / allocation.spread
    outside = np.concatenate([np.exp(-(reach[:4] ** 2)), 2 * norm.sf(reach[4:])])
    counted = units * (1 - np.array([share.estimate for share in found.shares]))
    assert (np.abs(counted - units * outside) <= 4.5 * np.sqrt(units * outside + 1)).all()
    assert found.share.estimate <= min(share.estimate for share in found.shares)


@pytest.mark.slow
def test_eight_limits_at_three_standard_deviations_keep_fewer_assemblies_than_one():
    found = verify_angles(PLAN, allocate_angles(PLAN), SeedTree(0))
    assert found.share.high < 0.9973
    assert found.share.low > 0.985


def test_the_first_assemblies_do_not_depend_on_how_many_follow():
    allocation = allocate_angles(PLAN)
    few, more = (verify_angles(PLAN, allocation, SeedTree(0), count) for count in (1500, 1501))
    difference = 1501 * (more.spread / 3) ** 2 - 1500 * (few.spread / 3) ** 2
    assert (difference >= -1e-12 * few.spread**2).all()
    assert (difference < 40 * few.spread**2).all()
