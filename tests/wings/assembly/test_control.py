"""Adjustment of assemblies: the regulator, the estimator, and what they leave, on random chains."""

from __future__ import annotations

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from tests.random_cases import random_plan, seeds
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.chain import ChainPart, DatumFlowChain
from tolalloc.wings.assembly.control import KalmanFilter, Regulator, kalman_filter, limiting_regulator, regulator
from tolalloc.wings.assembly.files import load_plan
from tolalloc.wings.assembly.gains import FinalErrors, final_errors, norms, state_weight_sweep, tuned_gains
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.steps import AssemblyStep, Efforts, StateSpace, steps_in_order
from tolalloc.wings.assembly.trajectory import Trajectory, foreseen, simulated

SEEDS = range(6)
NOISE = 2 * ARCSECOND, 1 * ARCSECOND


def pair(measure: tuple[str, ...], *later: str) -> AssemblyPlan:
    """Return two parts, the second on the first and measured so, the first measured by itself."""
    chain = DatumFlowChain(datum="KC0", parts=(ChainPart(name="KC1", on="KC0"), ChainPart(name="KC2", on="KC1")))
    return replace(
        random_plan(0),
        chain=chain,
        steps=(
            AssemblyStep(mount="KC1", adjust=("KC1",), measure=measure),
            AssemblyStep(mount="KC2", adjust=("KC1", "KC2"), measure=later),
        ),
        tolerances=np.full((2, 3), 30 * ARCSECOND),
        weights=np.ones(2),
    )


def parts_of(plan: AssemblyPlan) -> tuple[StateSpace, np.ndarray, Regulator, KalmanFilter]:
    weight = plan.final_weight()
    return plan.space, weight, regulator(plan.space, weight), kalman_filter(plan.space, plan.variances, *NOISE, "plan")


def errors_of(plan: AssemblyPlan, samples: int) -> np.ndarray:
    normal = np.random.default_rng(samples).standard_normal((samples, plan.variances.size))
    return normal * np.sqrt(plan.variances)


def costs(plan: AssemblyPlan, found: Trajectory) -> np.ndarray:
    final = found.adjusted[:, -1]
    weighted = np.einsum("ni,ij,nj->n", final, plan.final_weight(), final)
    return weighted + (plan.space.effort * found.adjustments**2).sum(axis=(1, 2))


def expected_cost(plan: AssemblyPlan, found: FinalErrors) -> float:
    """Return the expectation of xᵀQx of the final errors plus the effort [rad²]."""
    return float(np.vdot(plan.final_weight(), found.covariance(plan.variances))) + found.expected_effort(plan.variances)


def as_mounted(space: StateSpace, adjustments: Regulator, errors: np.ndarray) -> Trajectory:
    """Return assemblies in which an error is known, exactly, once its part is mounted."""
    steps, adjusted = [], np.zeros((*errors.shape[:-1], space.states))
    for step in range(space.steps):
        mounted = adjusted + errors @ space.entering[step].T
        turned = -mounted @ adjustments.gains[step].T
        adjusted = mounted + turned @ space.adjusting[step].T
        steps.append((mounted, turned, adjusted))
    mounted, turned, adjusted = (np.stack(each, axis=-2) for each in zip(*steps, strict=True))
    return Trajectory(mounted=mounted, adjustments=turned, adjusted=adjusted)


def reach(space: StateSpace, step: int) -> np.ndarray:
    """Return W of a step and all later ones, the sum of BR⁻¹Bᵀ."""
    return sum(b / r @ b.T for b, r in zip(space.adjusting[step:], space.effort[step:], strict=True))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_adjustments_are_those_of_a_quadratic_program(seed):
    plan = random_plan(seed)
    space, weight, adjustments, _ = parts_of(plan)
    errors = errors_of(plan, 1)[0] / ARCSECOND / 10
    found = foreseen(space, adjustments, errors)
    turned = cp.Variable(space.effort.size)
    final = plan.chain.transform @ errors + np.hstack(list(space.adjusting)) @ turned
    cost = cp.sum_squares(np.sqrt(weight) @ final) + cp.sum_squares(cp.multiply(np.sqrt(space.effort.ravel()), turned))
    program = cp.Problem(cp.Minimize(cost))
    program.solve(
        solver="CLARABEL", warm_start=False, tol_gap_abs=1e-14, tol_gap_rel=1e-14, tol_feas=1e-14, max_iter=200
    )
    expected = turned.value.reshape(space.effort.shape)
    assert np.linalg.norm(found.adjustments - expected) <= 1e-8 * np.linalg.norm(expected)
    start = plan.chain.transform @ errors
    np.testing.assert_allclose(program.value, start @ adjustments.cost_to_go[0] @ start, rtol=1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_recursion_is_the_one_of_the_paper_and_its_closed_form(seed):
    plan = random_plan(seed)
    space, weight, adjustments, _ = parts_of(plan)
    ahead, identity = weight, np.eye(space.states)
    for step in reversed(range(space.steps)):
        turning, inverse = space.adjusting[step], np.diag(1 / space.effort[step])
        shrunk = np.linalg.inv(identity + turning @ inverse @ turning.T @ ahead)
        np.testing.assert_allclose(adjustments.gains[step], inverse @ turning.T @ ahead @ shrunk, rtol=0, atol=1e-11)
        ahead = ahead @ shrunk
        closed = np.linalg.inv(np.linalg.inv(weight) + reach(space, step))
        for expected in (ahead, closed):
            np.testing.assert_allclose(adjustments.cost_to_go[step], expected, rtol=0, atol=1e-11 * weight.max())
    errors = errors_of(plan, 7)
    found = foreseen(space, adjustments, errors)
    start = errors @ plan.chain.transform.T
    final = start @ np.linalg.inv(identity + reach(space, 0) @ weight).T
    np.testing.assert_allclose(found.adjusted[:, -1], final, rtol=0, atol=1e-12 * np.abs(start).max())
    np.testing.assert_allclose(
        costs(plan, found), np.einsum("ni,ij,nj->n", start, adjustments.cost_to_go[0], start), rtol=1e-11
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_the_gains_tend_to_their_limit_as_the_inverse_of_the_weight(seed):
    plan = random_plan(seed)
    for weights in (plan.weights, np.where(np.arange(len(plan.weights)) == 1, 0.0, plan.weights)):
        weight = replace(plan, weights=weights).final_weight(1.0)
        limit = limiting_regulator(plan.space, weight)
        away = [np.abs(regulator(plan.space, q * weight).gains - limit.gains).max() for q in (1e4, 1e6, 1e8)]
        assert away[0] < 0.05
        assert away[1] == pytest.approx(away[0] / 100, rel=0.02, abs=1e-12)
        assert away[2] == pytest.approx(away[1] / 100, rel=1e-3, abs=1e-12)


def test_the_limit_knows_no_unit_of_effort():
    space, weight = random_plan(3).space, np.eye(random_plan(3).space.states)
    dear = replace(space, effort=1e14 * space.effort)
    np.testing.assert_allclose(
        limiting_regulator(dear, weight).gains, limiting_regulator(space, 1e-9 * weight).gains, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_the_estimate_is_the_best_linear_one_from_all_readings(seed):
    plan = random_plan(seed)
    space, _, _, kalman = parts_of(plan)
    # Such adjustments show the estimate, and act back on what is measured later.
    shown = np.broadcast_to(0.3 * np.eye(space.states), space.adjusting.shape)
    adjustments = Regulator(gains=shown, cost_to_go=np.zeros((1, space.states, space.states)))
    readings = sum(len(observing) for observing in space.observing)
    sizes = [plan.variances.size, readings, space.effort.size]
    deviations = np.sqrt(
        np.concatenate([plan.variances, np.full(sizes[1], NOISE[0] ** 2), np.full(sizes[2], NOISE[1] ** 2)])
    )
    parts, noise, missed = np.split(np.diag(deviations), np.cumsum(sizes)[:-1], axis=1)
    found = simulated(space, adjustments, kalman, parts, noise, missed.reshape(-1, *space.effort.shape))
    noises = np.split(noise, np.cumsum([len(observing) for observing in space.observing])[:-1], axis=1)
    seen = np.empty((len(deviations), 0))
    for step, observing in enumerate(space.observing):
        state = found.mounted[:, step]
        seen = np.hstack([seen, state @ observing.T + noises[step]])
        best = seen @ np.linalg.lstsq(seen, state, rcond=1e-12)[0]
        np.testing.assert_allclose(-found.adjustments[:, step] / 0.3, best, rtol=0, atol=1e-9 * deviations.max())
        missed = NOISE[1] * space.adjusting[step]
        left = (state - best).T @ (state - best) + missed @ missed.T
        np.testing.assert_allclose(kalman.covariance[step], left, rtol=0, atol=1e-9 * left.max())


def test_the_filter_tends_to_the_solution_of_the_algebraic_riccati_equation():
    plan, steps, identity = random_plan(2), 300, np.eye(random_plan(2).space.states)
    entering, turning = plan.chain.transform, plan.space.adjusting[-1]
    observing = identity - np.eye(len(identity), k=-3)
    walk = StateSpace(
        entering=np.broadcast_to(entering, (steps, *entering.shape)),
        adjusting=np.broadcast_to(turning, (steps, *turning.shape)),
        effort=np.ones((steps, len(identity))),
        observing=(observing,) * steps,
    )
    variances = plan.variances / ARCSECOND**2
    found = kalman_filter(walk, variances, 2.0, 1.0, "walk")
    missed = turning @ turning.T
    added = (entering * variances) @ entering.T + missed
    before = solve_discrete_are(identity, observing.T, added, 4.0 * identity)
    np.testing.assert_allclose(found.covariance[-1] - missed + added, before, rtol=0, atol=1e-9 * before.max())


@pytest.mark.parametrize("seed", SEEDS)
def test_the_expected_cost_is_that_of_regulator_and_estimator_apart(seed):
    plan = random_plan(seed)
    space, _, adjustments, kalman = parts_of(plan)
    expected = 0.0
    for step in range(space.steps):
        here, ahead = adjustments.cost_to_go[step : step + 2]
        entering, turning = space.entering[step], space.adjusting[step]
        missed = NOISE[1] ** 2 * turning @ turning.T
        gain = adjustments.gains[step]
        unknown = kalman.covariance[step] - missed
        expected += np.trace(here @ (entering * plan.variances) @ entering.T) + np.trace(ahead @ missed)
        expected += np.trace(gain.T @ (np.diag(space.effort[step]) + turning.T @ ahead @ turning) @ gain @ unknown)
    found = expected_cost(plan, final_errors(space, adjustments, kalman, *NOISE))
    assert found == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_other_gains_are_cheaper(seed):
    plan, generator = random_plan(seed), np.random.default_rng(seed)
    space, _, adjustments, kalman = parts_of(plan)
    least = expected_cost(plan, final_errors(space, adjustments, kalman, *NOISE))
    for _ in range(20):
        other = replace(adjustments, gains=adjustments.gains * generator.uniform(0.95, 1.05, adjustments.gains.shape))
        worse = replace(kalman, gains=tuple(each * generator.uniform(0.95, 1.05, each.shape) for each in kalman.gains))
        for gains in ((other, kalman), (adjustments, worse)):
            assert expected_cost(plan, final_errors(space, *gains, *NOISE)) > least


@pytest.mark.parametrize("seed", SEEDS)
def test_covariance_and_effort_are_affine_in_the_variances(seed):
    plan, generator = random_plan(seed), np.random.default_rng(seed)
    found = final_errors(plan.space, *parts_of(plan)[2:], *NOISE)
    one, other = plan.variances * generator.uniform(0, 3, (2, plan.variances.size))
    for share in (0.0, 0.3, 1.0, 1.7):
        mixed = share * one + (1 - share) * other
        np.testing.assert_allclose(
            found.covariance(mixed),
            share * found.covariance(one) + (1 - share) * found.covariance(other),
            rtol=0,
            atol=1e-14 * plan.variances.sum(),
        )
        assert found.expected_effort(mixed) == pytest.approx(
            share * found.expected_effort(one) + (1 - share) * found.expected_effort(other), rel=1e-12
        )
    none = np.zeros_like(one)
    np.testing.assert_array_equal(found.covariance(none), found.noise_covariance)
    assert found.expected_effort(none) == found.noise_effort


@pytest.mark.parametrize("seed", SEEDS)
def test_simulated_assemblies_scatter_by_the_covariance_within_sampling_error(seed):
    # Other tolerances than those that the estimator was made for: the covariance must hold for any fixed gains.
    plan, samples = random_plan(seed), 20_000
    space, _, adjustments, kalman = parts_of(plan)
    variances = plan.variances * np.random.default_rng(seed).uniform(0.1, 4, plan.variances.size)
    exact = final_errors(space, adjustments, kalman, *NOISE)
    node = SeedTree(seed).child("assembly")
    errors = node.child("parts").generator().standard_normal((samples, len(variances))) * np.sqrt(variances)
    readings = sum(len(observing) for observing in space.observing)
    found = simulated(
        space,
        adjustments,
        kalman,
        errors,
        NOISE[0] * node.child("readings").generator().standard_normal((samples, readings)),
        NOISE[1] * node.child("adjustments").generator().standard_normal((samples, *space.effort.shape)),
    )
    final, covariance = found.adjusted[:, -1], exact.covariance(variances)
    variance = np.diag(covariance)
    error = np.sqrt((np.outer(variance, variance) + covariance**2) / samples)
    # Up to 171 different entries: five standard errors are passed by chance once in ten thousand runs.
    assert (np.abs(final.T @ final / samples - covariance) <= 5 * error).all()
    # Whitened, the sum of all squares is chi-square distributed.
    squares = np.einsum("ni,ni->", final, np.linalg.solve(covariance, final.T).T)
    assert abs(squares - final.size) <= 4 * np.sqrt(2 * final.size)
    efforts = (space.effort * found.adjustments**2).sum(axis=(1, 2))
    assert abs(efforts.mean() - exact.expected_effort(variances)) <= 4 * efforts.std() / np.sqrt(samples)


@pytest.mark.parametrize("seed", seeds(40))
def test_the_norm_falls_and_is_convex_in_the_precision_for_every_set_of_parts(seed):
    plan = random_plan(seed)
    found = norms(plan, errors_of(plan, 50), np.linspace(0, 20, 41))
    start = found[0]
    assert (np.diff(found, axis=0) <= 1e-13 * start).all()
    assert (np.diff(found, 2, axis=0) >= -1e-13 * start).all()
    assert (found[-1] < start).all()


def test_the_error_of_one_characteristic_may_rise_with_the_precision():
    plan = random_plan(1)
    errors = errors_of(plan, 50)
    final = np.array(
        [
            foreseen(plan.space, regulator(plan.space, plan.final_weight(q)), errors).adjusted[:, -1]
            for q in np.linspace(0, 20, 41).tolist()
        ]
    )
    each = np.linalg.norm(final.reshape(*final.shape[:2], -1, 3), axis=-1)
    assert (np.diff(each, axis=0) > 1e-6 * each[0].max()).any()


@pytest.mark.parametrize("seed", SEEDS)
def test_errors_known_late_never_cost_less(seed):
    plan = random_plan(seed)
    space, _, adjustments, _ = parts_of(plan)
    early, late = (costs(plan, each(space, adjustments, errors_of(plan, 200))) for each in (foreseen, as_mounted))
    assert (late >= early * (1 - 1e-12)).all()
    assert (late > early * 1.01).any()


def test_a_reading_between_parts_without_noise_tells_what_one_against_the_datum_tells():
    errors = np.array([11.0, -23.0, 5.0, 41.0, 7.0, -9.0]) * ARCSECOND
    nothing = np.zeros(6), np.zeros((2, 6))
    final = []
    for measure in ("KC2", "KC2 - KC1"):
        plan = pair(("KC1",), measure)
        kalman = kalman_filter(plan.space, plan.variances, 0.0, 0.0, "pair")
        adjustments = regulator(plan.space, plan.final_weight(5.0))
        final.append(simulated(plan.space, adjustments, kalman, errors, *nothing).adjusted[-1])
        np.testing.assert_allclose(
            final[-1], as_mounted(plan.space, adjustments, errors).adjusted[-1], rtol=0, atol=1e-17
        )
    np.testing.assert_allclose(final[0], final[1], rtol=0, atol=1e-17)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize(
    ("first", "later", "step"),
    [
        (("KC1", "KC1"), ("KC2",), 1),
        (("KC1",), ("KC1", "KC2", "KC2 - KC1"), 2),
        (("KC1",), ("KC1", "KC2"), 2),
        ((), ("KC1", "KC2", "KC2 - KC1"), 2),
    ],
)
def test_readings_that_say_the_same_need_noise(first, later, step, scale):
    plan = pair(first, *later)
    variances = plan.variances * scale**2
    with pytest.raises(InputError, match=f"pair, step {step}: measure is .*; allowed is .* noise above 0"):
        kalman_filter(plan.space, variances, 0.0, 0.0, "pair")
    noise = 1e-3 * float(np.sqrt(variances.max()))
    assert np.isfinite(kalman_filter(plan.space, variances, noise, 0.0, "pair").covariance).all()


def test_an_error_that_cannot_be_tells_nothing_when_it_is_measured():
    plan = pair(("KC1",), "KC2")
    variances = np.where(np.arange(6) == 2, 0.0, plan.variances)
    exact, close = (kalman_filter(plan.space, variances, noise, 0.0, "pair") for noise in (0.0, 1e-12))
    assert not exact.gains[0][:, 2].any()
    for one, other in zip(exact.gains, close.gains, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8)


@pytest.mark.parametrize("later", [("KC2",), ("KC1", "KC2"), ("KC1", "KC2 - KC1"), ()])
@pytest.mark.parametrize(("first", "exact_parts"), [(("KC1",), 0), ((), 3)])
def test_readings_without_noise_that_tell_something_new_are_the_limit_of_little_noise(first, exact_parts, later):
    # A part that has been measured, or has no error, is turned in between and misses by something new.
    plan = pair(first, *later)
    variances = np.where(np.arange(6) < exact_parts, 0.0, plan.variances)
    exact, close = (kalman_filter(plan.space, variances, noise, NOISE[1], "pair") for noise in (0.0, 1e-12))
    for one, other in zip(exact.gains, close.gains, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8)
    np.testing.assert_allclose(exact.covariance, close.covariance, rtol=0, atol=1e-8 * plan.variances.max())


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sweep_falls_to_the_floor_and_says_where_it_stops_paying(seed):
    plan = replace(random_plan(seed), weights=np.ones(len(random_plan(seed).weights)))
    precisions = np.concatenate([np.arange(0.0, 31.0), [1e9]])
    sweep = state_weight_sweep(plan, precisions)
    assert (np.diff(sweep.total) < 0).all()
    assert (np.diff(sweep.effort) > 0).all()
    assert (np.diff(precisions * sweep.total**2 + sweep.effort) > 0).all()
    assert sweep.total[-1] == pytest.approx(sweep.noise_floor, rel=1e-7)
    assert (sweep.total[:-1] > sweep.noise_floor).all()
    np.testing.assert_allclose(sweep.total**2, (sweep.tilt**2 + sweep.rotation**2).sum(axis=1), rtol=1e-12)
    np.testing.assert_allclose(sweep.next_unit[:30], 1 - sweep.total[1:31] / sweep.total[:30], rtol=0, atol=1e-13)
    stop = sweep.diminished(share=0.02)
    assert sweep.next_unit[int(stop)] < 0.02 <= sweep.next_unit[int(stop) - 1]
    assert state_weight_sweep(plan, precisions[:2]).diminished(share=1e-6) is None


def test_a_sweep_is_the_same_in_every_unit_of_angle():
    plan, scale = random_plan(4), 1 / ARCSECOND
    other = replace(
        plan, tolerances=scale * plan.tolerances, measurement_noise=scale * NOISE[0], adjustment_noise=scale * NOISE[1]
    )
    one, same = (state_weight_sweep(each, np.array([0.0, 3.0, 10.0])) for each in (plan, other))
    np.testing.assert_allclose(same.total, scale * one.total, rtol=1e-11)
    np.testing.assert_allclose(same.noise_floor, scale * one.noise_floor, rtol=1e-11)
    np.testing.assert_allclose(same.next_unit, one.next_unit, rtol=0, atol=1e-12)


def test_exact_readings_and_adjustments_leave_nothing_at_the_floor():
    chain = random_plan(5).chain
    plan = replace(
        random_plan(5),
        steps=steps_in_order(chain, "mounted", "current", Efforts()),
        measurement_noise=0.0,
        adjustment_noise=0.0,
    )
    sweep = state_weight_sweep(plan, np.array([0.0, 10.0]))
    assert sweep.noise_floor < 1e-12 * sweep.total[0]


@pytest.mark.parametrize("adjust", ["current", "mounted", "all"])
def test_what_is_not_turned_misses_nothing(adjust):
    plan = load_plan("bx40e")
    steps = steps_in_order(plan.chain, adjust, "current", Efforts())
    found = tuned_gains(replace(plan, steps=steps), 0.0, plan.tolerances).errors
    parts_alone = (plan.chain.transform * plan.variances) @ plan.chain.transform.T
    np.testing.assert_allclose(found.covariance(plan.variances), parts_alone, rtol=1e-12, atol=1e-24)


def test_turning_fewer_parts_may_leave_less():
    """Every further turn misses by itself, which no regulator of the turned angles knows."""
    plan = load_plan("bx40e")
    total, fewer = (
        np.sqrt(np.trace(tuned_gains(one, 10.0, one.tolerances).errors.covariance(one.variances))) / ARCSECOND
        for one in (plan, plan.turning_fewer)
    )
    assert [step.adjust for step in plan.turning_fewer.steps] == [("KC1",), ("KC2",), ("KC3",), ("KC4",)]
    assert (total, fewer) == (pytest.approx(9.7065, abs=1e-4), pytest.approx(8.204, abs=1e-3))
