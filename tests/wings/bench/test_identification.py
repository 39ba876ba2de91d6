"""Identification: derivatives, closed forms of a linear problem, liu2020's swarm, and finding the truth again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, log

import numpy as np
import pytest
from scipy.stats import binom, norm
from scipy.stats import t as student

from studies.published.liu2020_searches import ALGORITHMS, search
from studies.published.liu2020_swarm import best_neighbours, velocity, weights
from studies.published.liu2020_tables import BiasOnly, improvement
from studies.published.recovery import recovery
from studies.published.simulated_bench import Bench, random_units, simulated_bench
from tests.builders import baseline_errors, says
from tests.verification.test_ring import on
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.hysteresis import hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.springs import HARMONICS
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.housing import Housing
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.sensitivity.surrogate.regression import fit_box_polynomial, total_degrees
from tolalloc.wings.bench.information import information
from tolalloc.wings.bench.least_squares import IdentificationProblem, gauss_newton, require_enough, starts
from tolalloc.wings.bench.parameters import Parameter, parameter
from tolalloc.wings.bench.prediction import (
    AllReadings,
    KernelPredictor,
    Prediction,
    ReadingBlock,
    Surrogate,
    data_of,
    fit_surrogate,
)
from tolalloc.wings.bench.profile import as_stiffness, bootstrap, estimates, judged, profile, simplest
from tolalloc.wings.bench.telling.identification import estimate_sentence

NONE = np.empty(0)
RV20E = load_reducer("rv20e_liu2020")
ERRORS = baseline_errors()


def bench(**changes) -> Bench:
    angles = 2 * np.pi * np.arange(24) / 24
    whole = Bench(
        peak_to_peak_torque=-1.0,
        peak_to_peak_noise=ARCSECOND,
        curve_torques=(-1.0, 40.0),
        curve_angles=angles,
        curve_noise=0.5 * ARCSECOND,
        loop_angles=(0.3,),
        loop_torques=np.array([-160.0, -40.0, 5.0, 60.0, 160.0]),
        loop_noise=0.1 * ARCSECOND,
    )
    return replace(whole, **changes)


@pytest.mark.slow
def test_derivatives_of_every_kind_of_reading_agree_with_differences():
    """Peak-to-peaks are as accurate as the angles of their kinks, so they need a longer step than curves and loops."""
    names = ("crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing", "gear_mesh", "pin_contact")
    parameters = tuple(parameter(name, RV20E) for name in (*names, "torque", "bias"))
    measured = simulated_bench(RV20E, random_units(ERRORS, 4, SeedTree(3)), bench()).measurements
    data = data_of(measured, "test")
    predict = KernelPredictor(RV20E, parameters, measured, data)
    at = np.array([0.05, -0.1, 0.2, 0.1, -0.15, 0.3, 1.5])
    slopes = predict(at).by_coordinate
    for place, item in enumerate(parameters):
        difference = {}
        for step in (2e-4, 0.02):
            move = step * np.eye(at.size)[place]
            difference[step] = (predict(at + move).values - predict(at - move).values) / (2 * step)
        for block in data.blocks:
            expected = difference[2e-4 if block.centred else 0.02][block.rows] / ARCSECOND
            own = slopes[block.rows, place] / ARCSECOND
            finest = 0.0 if block.centred else 0.01  # what 0.0004″ of a peak-to-peak make over this step
            allowed = 0.02 * max(np.abs(expected).max(), 1e-3) + finest
            assert np.median(np.abs(own - expected)) < allowed, (item.name, block)


@pytest.mark.slow
def test_parts_have_the_stiffness_of_every_torque_and_parameters_keep_theirs():
    """Of the RV-20E from parts: its loop is that of `hysteresis_loop`, until the bearings themselves are parameters."""
    reducer = load_reducer("rv20e")
    loops = np.array([-167.0, -5.01, -0.0167, 0.0167, 5.01, 167.0])
    given = bench(peak_to_peak_torque=0.0, loop_torques=loops)
    measured = simulated_bench(reducer, random_units(ERRORS, 2, SeedTree(3)), given).measurements
    data = data_of(measured, "test")
    own, fixed = (
        KernelPredictor(reducer, tuple(parameter(name, reducer) for name in names), measured, data)
        for names in (("gear_mesh", "torque"), ("crank_disc_bearing", "crank_carrier_bearing"))
    )
    values, constant = own(np.zeros(2)).values, fixed(np.zeros(2)).values
    for block in (block for block in data.blocks if block.kind == "loop"):
        found = measured.loops[block.number]
        model = EquivalentModel(reducer, orders=measured.units[found.unit].orders or HARMONICS)
        errors = measured.units[found.unit].errors(model.columns, reducer.modification.deviations)
        twist = hysteresis_loop(model, errors, np.array([found.carrier_angle])).twist[0, :, 0]
        np.testing.assert_allclose(values[block.rows], twist - twist.mean(), rtol=0, atol=1e-9 * np.ptp(twist))
        small = slice(block.rows.start + 1, block.rows.stop - 1)  # where bearings under rated torque are too stiff
        assert np.ptp(constant[small]) < 0.98 * np.ptp(values[small])
    for step in np.eye(2) * 2e-4:
        expected = (own(step).values - own(-step).values) / 4e-4
        allowed = 1e-3 * np.abs(expected).max()
        slopes = own(np.zeros(2)).by_coordinate @ (step / 2e-4)
        np.testing.assert_allclose(slopes, expected, rtol=0, atol=allowed)


@pytest.mark.slow
def test_curves_and_loops_lose_their_mean_and_peak_to_peaks_do_not():
    measured = simulated_bench(RV20E, random_units(ERRORS, 2, SeedTree(3)), bench()).measurements
    data = data_of(measured, "test")
    prediction = KernelPredictor(RV20E, (parameter("bias", RV20E, (-5.0, 5.0)),), measured, data)(np.array([2.0]))
    for block in data.blocks:
        mean = prediction.values[block.rows].mean() / ARCSECOND
        assert abs(mean) < 1e-9 if block.centred else mean > 10
    np.testing.assert_allclose(prediction.values[:2] - data.measured[:2], 2.0 * ARCSECOND, rtol=1e-9)
    problem = IdentificationProblem(
        parameters=(), data=data, predictor=Straight(np.zeros((data.measured.size, 0))), weight=np.ones(2)
    )
    assert problem.readings == data.measured.size - 6  # two units with two curves and a loop each


@dataclass(frozen=True)
class Straight:
    """Readings that are linear in the coordinates: everything about them has a closed form."""

    slopes: np.ndarray

    def __call__(self, coordinates: np.ndarray) -> Prediction:
        return Prediction(values=self.slopes @ coordinates, by_coordinate=self.slopes)

    def values(self, coordinates: np.ndarray) -> np.ndarray:
        return coordinates @ self.slopes.T


def straight_problem(readings: int, noise_stated: bool = True, prior: float = inf) -> IdentificationProblem:
    generator = np.random.default_rng(7)
    slopes = generator.normal(size=(readings, 2))
    truth = np.array([0.1, -0.2])
    data = AllReadings(
        measured=slopes @ truth + generator.normal(0, 0.3, readings),
        noise=np.full(readings, 0.3),
        unit=np.arange(readings),
        blocks=(ReadingBlock(kind="peak-to-peak", number=0, rows=slice(0, readings), centred=False),),
        noise_stated=noise_stated,
    )
    parameters = tuple(
        Parameter(name=name, low=1e9, high=1e11, start=1e10, prior=prior)
        for name in ("crank_disc_bearing", "crank_carrier_bearing")
    )
    return IdentificationProblem(parameters=parameters, data=data, predictor=Straight(slopes), weight=np.ones(readings))


@pytest.mark.parametrize("prior", [inf, 0.05])
def test_linear_readings_give_the_closed_form_of_least_squares(prior):
    problem = straight_problem(40, prior=prior)
    slopes, weight = problem.predictor.slopes / 0.3, 0.0 if prior == inf else 1 / prior**2
    normal = slopes.T @ slopes + weight * np.eye(2)
    expected = np.linalg.solve(normal, slopes.T @ problem.data.measured / 0.3)
    found = gauss_newton(problem, problem.start[np.newaxis])
    np.testing.assert_allclose(found.coordinates, expected, atol=1e-6)
    own = information(problem, problem.predictor(expected), expected)
    widened = slopes.T @ slopes / own.variance_factor + weight * np.eye(2)
    np.testing.assert_allclose(own.matrix, widened, rtol=1e-12)
    np.testing.assert_allclose(own.standard_errors, np.sqrt(np.diag(np.linalg.inv(own.matrix))), rtol=1e-9)
    bounds = np.diag(12 / (problem.upper - problem.lower) ** 2)
    np.testing.assert_allclose(own.covariance, np.linalg.inv(widened + bounds), rtol=1e-9)


@pytest.mark.parametrize("noise_stated", [True, False])
def test_the_profile_of_linear_readings_is_the_interval_of_least_squares(noise_stated):
    """Normal where the noise is known, Student's where it is estimated from what the fit leaves."""
    problem = straight_problem(12, noise_stated)
    found = gauss_newton(problem, problem.start[np.newaxis])
    own = information(problem, problem.predictor(found.coordinates), found.coordinates)
    assert own.variance_factor == pytest.approx(1.0 if noise_stated else 2 * found.objective / 10, rel=1e-6)
    half = (norm.ppf(0.975) if noise_stated else student.ppf(0.975, 10)) * own.standard_errors
    for place in range(2):
        low, high = profile(problem.widened(own.variance_factor), found.coordinates, place, own).interval
        assert low == pytest.approx(found.coordinates[place] - half[place], abs=1e-3 * half[place])
        assert high == pytest.approx(found.coordinates[place] + half[place], abs=1e-3 * half[place])


def test_stated_noise_is_doubted_only_when_the_residuals_are_next_to_impossible():
    problem = straight_problem(12)
    found = gauss_newton(problem, problem.start[np.newaxis]).coordinates
    much = problem.widened(1 / 16.0)  # as if the noise had been stated four times too small
    assert not information(problem, problem.predictor(found), found).estimated
    assert information(much, much.predictor(found), found).estimated


@pytest.mark.parametrize("share", [0.1, 0.01])
def test_a_profile_is_sharp_along_one_parameter_though_another_is_open(share):
    """Readings a + share·b with b open between its bounds: a's interval is widened by what b may do."""
    problem = straight_problem(40)
    one = problem.predictor.slopes[:, :1]
    slanted = replace(problem, predictor=Straight(one * [1.0, share]))
    found = gauss_newton(slanted, slanted.start[np.newaxis]).coordinates
    own = information(slanted, slanted.predictor(found), found)
    sharp = profile(slanted, found, 0, own)
    middle = float(found[0] + share * found[1])
    half = norm.ppf(0.975) / np.linalg.norm(one / 0.3)
    assert sharp.interval[0] == pytest.approx(middle - share * slanted.upper[1] - half, abs=0.02 * half)
    assert sharp.interval[1] == pytest.approx(middle - share * slanted.lower[1] + half, abs=0.02 * half)


def test_a_profile_that_is_doubted_holds_the_first_order_interval_cut_at_the_bounds():
    problem = straight_problem(40)
    found = gauss_newton(problem, problem.start[np.newaxis]).coordinates
    sharp = profile(problem, found, 0, information(problem, problem.predictor(found), found))
    wider = sharp.widened(np.array([-100.0, sharp.interval[0]]))
    assert wider.interval == (problem.lower[0], sharp.interval[1])
    assert wider.interval[0] == wider.coordinate[0]
    assert wider.interval[1] < wider.coordinate[-1]


def written_of(problem: IdentificationProblem) -> tuple[np.ndarray, IdentifiedStiffness]:
    found = gauss_newton(problem, problem.start[np.newaxis]).coordinates
    own = information(problem, problem.predictor(found), found)
    profiles = [profile(problem, found, place, own) for place in range(2)]
    both = gauss_newton(replace(problem, evenly=True), found[np.newaxis]).coordinates
    spread = information(problem, problem.predictor(both), both)
    found_of = estimates(problem.parameters, own, spread, profiles)
    stiffness = as_stiffness(found_of, spread, "test", [estimate_sentence(item) for item in found_of])
    assert stiffness
    return found, stiffness


def test_a_parameter_without_effect_is_not_identified_and_said_so():
    problem = straight_problem(40)
    blind = replace(problem, predictor=Straight(problem.predictor.slopes * [1.0, 0.0]))
    found = gauss_newton(blind, blind.start[np.newaxis])
    own = information(blind, blind.predictor(found.coordinates), found.coordinates)
    profiles = [profile(blind, found.coordinates, place, own) for place in range(2)]
    assert [item.is_identified for item in profiles] == [True, False]
    assert profiles[1].interval == pytest.approx((blind.lower[1], blind.upper[1]))
    assert own.standard_errors[1] == inf
    assert [item.is_fixed for item in own.directions] == [True, False]
    _, written = written_of(blind)
    assert says(written.notes, "identification.not_identified", symbol="K_b")
    assert written.values["crank_carrier_bearing"] == pytest.approx(1e10)  # the middle of 1e9 and 1e11
    even = (log(1e11) - log(1e9)) / np.sqrt(12)
    assert written.standard_uncertainty["crank_carrier_bearing"] == pytest.approx(1e10 * even)
    assert written.correlation[0, 1] == pytest.approx(0.0, abs=1e-12)


def test_a_combination_that_the_data_fix_stays_fixed_in_the_stiffness_file():
    problem = straight_problem(40)
    together = replace(problem, predictor=Straight(problem.predictor.slopes[:, :1] * [0.8, 0.6]))
    found, written = written_of(together)
    values = np.log(np.array([*written.values.values()]) / 1e10)
    weights_ = np.array([0.8, 0.6])
    fixed = float(np.sqrt(weights_ @ written.covariance @ weights_))
    assert fixed == pytest.approx(0.3 / np.linalg.norm(problem.predictor.slopes[:, 0]), rel=0.02)
    assert weights_ @ values == pytest.approx(weights_ @ found, abs=0.1 * fixed)
    assert (np.sqrt(np.diag(written.covariance)) > 0.5).all()  # each alone is open


def test_directions_leave_a_bias_out_and_do_not_depend_on_its_unit():
    problem = straight_problem(40)
    slopes = np.column_stack([problem.predictor.slopes, np.ones(40)])
    bias = Parameter(name="bias", low=-60.0, high=60.0, start=0.0)
    found = np.array([0.1, -0.2, 0.0])
    rows = []
    for unit in (1.0, 1000.0):
        scaled = replace(problem, parameters=(*problem.parameters, bias), predictor=Straight(slopes * [1.0, 1.0, unit]))
        own = information(scaled, scaled.predictor(found), found)
        assert all(item.loading.size == 2 for item in own.directions)
        rows.append([item.deviation for item in own.directions])
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-9)


def test_a_surrogate_is_moved_onto_the_model():
    problem = straight_problem(10)
    surrogate = fitted_straight(problem)
    at = np.array([0.2, 0.3])
    model = Prediction(values=surrogate.values(at[np.newaxis])[0] + 7.0, by_coordinate=np.zeros((10, 2)))
    moved = surrogate.anchored(at, model)
    np.testing.assert_allclose(moved(at).values, model.values)
    np.testing.assert_allclose(moved.values(at[np.newaxis])[0], model.values)


@pytest.mark.slow
def test_bootstrap_spreads_as_least_squares_says():
    """With 40 units the bootstrap's standard deviation is within 40 % of the first-order one."""
    problem = straight_problem(40)
    found = gauss_newton(problem, problem.start[np.newaxis])
    own = information(problem, problem.predictor(found.coordinates), found.coordinates)
    drawn = bootstrap(problem, found.coordinates, SeedTree(1))
    np.testing.assert_allclose(drawn.std(axis=0), own.standard_errors, rtol=0.4)


def fitted_straight(problem: IdentificationProblem) -> Surrogate:
    polynomial = fit_box_polynomial(problem.predictor.values, problem.lower, problem.upper, 2, SeedTree(1))
    assert polynomial.largest_error < 1e-9
    return Surrogate(problem.parameters, problem.parameters, polynomial, problem.data)


def test_leaving_units_out_has_the_closed_form_of_the_hat_matrix():
    problem = straight_problem(15)
    slopes = problem.predictor.slopes
    hat = slopes @ np.linalg.solve(slopes.T @ slopes, slopes.T)
    left = hat @ problem.data.measured - problem.data.measured
    found = judged(problem, fitted_straight(problem), problem.parameters)
    np.testing.assert_allclose(found.left, left, atol=1e-5)
    np.testing.assert_allclose(found.unseen, left / (1 - np.diag(hat)), atol=1e-5)


def test_a_bias_alone_left_out_is_the_formula_of_the_baseline():
    problem = straight_problem(15)
    bias = Parameter(name="bias", low=-3600.0, high=3600.0, start=0.0)
    scaled = replace(
        problem,
        data=replace(problem.data, measured=problem.data.measured * ARCSECOND, noise=problem.data.noise * ARCSECOND),
        predictor=Straight(problem.predictor.slopes * ARCSECOND),
    )
    found = judged(scaled, fitted_straight(scaled), (bias,))
    expected = BiasOnly(difference=-scaled.data.measured)
    assert np.sqrt((found.left**2).mean()) == pytest.approx(expected.rms, rel=1e-6)
    assert np.sqrt((found.unseen**2).mean()) == pytest.approx(expected.leave_one_out, rel=1e-6)


def test_the_simplest_choice_is_taken_when_more_explains_no_more():
    problem = straight_problem(30)
    surrogate = fitted_straight(problem)
    choices = [judged(problem, surrogate, chosen) for chosen in ((), problem.parameters[:1], problem.parameters)]
    assert simplest(choices).parameters == problem.parameters  # both have an effect of several standard errors
    blind = replace(problem, predictor=Straight(problem.predictor.slopes * [1.0, 0.0]))
    surrogate = fitted_straight(blind)
    choices = [judged(blind, surrogate, chosen) for chosen in (blind.parameters[1:], blind.parameters)]
    assert simplest(choices).parameters == blind.parameters[1:]


def test_too_few_units_are_refused():
    problem = straight_problem(2)
    with pytest.raises(InputError, match="peak-to-peaks of 2 units cannot fix 2 parameters"):
        require_enough(problem)


def test_polynomials_know_their_derivatives_and_their_error():
    lower, upper = np.array([-1.0, 0.5]), np.array([2.0, 0.8])
    found = fit_box_polynomial(
        lambda x: np.stack([np.exp(0.3 * x[:, 0]) * x[:, 1], np.sin(x[:, 0])], axis=1), lower, upper, 6, SeedTree(1)
    )
    assert len(total_degrees(2, 6)) == 28
    assert 0 < found.rms_error <= found.largest_error < 2e-4
    at = np.array([0.7, 0.61])
    expected = [
        [0.3 * np.exp(0.21) * 0.61, np.exp(0.21)],
        [np.cos(0.7), 0.0],
    ]
    np.testing.assert_allclose(found.derivatives(at), expected, atol=1e-3)
    coarse = fit_box_polynomial(lambda x: np.abs(x[:, :1]), lower, upper, 3, SeedTree(1))
    assert coarse.largest_error > 0.01  # a kink is no polynomial, and the held-out runs say so


def test_the_weight_of_the_improved_swarm_stays_between_0_and_1():
    """Equation (17) with the factor d that is printed inside its sum would leave that range."""
    lower, upper = np.array([0.0, 0.0, 0.0]), np.array([1.0, 2.0, 4.0])
    corners = np.array([lower, upper, 0.5 * upper])
    np.testing.assert_allclose(weights(corners, upper, lower, upper)[:, 0], [0.0, 1.0, 0.5])
    printed = 1 - (np.arange(1, 4) * np.abs(upper - lower) / (upper - lower)).sum() / 3
    assert printed < 0


def test_the_velocity_is_equation_18():
    one = np.ones((1, 1))
    random = np.array([0.5, 0.25, 0.75]).reshape(3, 1, 1)
    alpha = np.array([[0.6]])
    found = velocity(0.0 * one, 2.0 * one, 1.0 * one, np.array([10.0]), 100.0 * one, alpha, random)
    expected = 0.9 * 2 + 0.6 * 2 * 0.5 * 1 + 0.4 * (0.4 * 2 * 0.25 * 10 + 0.6 * 2 * 0.75 * 100)
    assert found[0, 0] == pytest.approx(expected)
    assert list(best_neighbours(np.array([3.0, 1.0, 2.0, 0.0, 5.0]))) == [1, 1, 3, 3, 3]


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_every_search_ends_where_gauss_newton_does(algorithm):
    """Within 1e-4 of S, and the same bits from the same seed."""
    problem = straight_problem(40)
    least = gauss_newton(problem, starts(problem, 3, SeedTree(1)))
    found = search(problem, algorithm, 0)
    assert np.sqrt(found.objective) <= (1 + 1e-4) * np.sqrt(least.objective)
    assert least.evaluations <= found.evaluations / 20
    np.testing.assert_array_equal(found.coordinates, search(problem, algorithm, 0).coordinates)
    assert (np.diff(found.least) <= 0).all()
    assert ((found.coordinates >= problem.lower) & (found.coordinates <= problem.upper)).all()


@pytest.mark.slow
def test_peak_to_peaks_at_one_newton_metre_leave_two_stiffnesses_open():
    """As Table 6 of liu2020 hints: one and the same S with K_b and K_ca anywhere between their bounds."""
    limits = {"crank_disc_bearing": (0.8e10, 1.3e10), "crank_carrier_bearing": (1.4e10, 1.8e10)}
    limits["carrier_bearing"] = (7.4e10, 8.0e10)
    units = random_units(ERRORS, 20, SeedTree(4))
    only = bench(curve_torques=(), loop_angles=())
    measured = simulated_bench(RV20E, units, only).measured(SeedTree(5))
    data = data_of(measured, "test")
    parameters = tuple(parameter(name, RV20E, limits[name]) for name in RV.identified)
    kernel = KernelPredictor(RV20E, parameters, measured, data)
    surrogate = fit_surrogate(kernel, SeedTree(6))
    assert surrogate.polynomial.rms_error < 0.02 * ARCSECOND
    problem = IdentificationProblem(parameters=parameters, data=data, predictor=surrogate, weight=np.ones(20))
    found = gauss_newton(problem, starts(problem, 3, SeedTree(7)))
    own = information(problem, surrogate(found.coordinates), found.coordinates)
    for place in (1, 2):
        assert not profile(problem, found.coordinates, place, own).is_identified


@pytest.mark.slow
def test_curves_and_loops_find_the_truth_again():
    """Twelve repetitions; all of them within three standard errors, and intervals that cover as 95 % intervals do."""
    true = {"crank_disc_bearing": 1.15e10, "crank_carrier_bearing": 1.5e10, "carrier_bearing": 7.0e10}
    truth = replace(RV20E, stiffness=replace(RV20E.stiffness, **true))
    plan = bench(
        peak_to_peak_torque=0.0,
        curve_angles=2 * np.pi * np.arange(180) / 180,
        loop_angles=(0.0, 1.5),
        loop_torques=167 * np.array([-1, -0.6, -0.2, 0.2, 0.6, 1]),
        curve_torques=(-1.0, 1.0),
    )
    exact = simulated_bench(truth, random_units(ERRORS, 3, SeedTree(8)), plan)
    parameters = tuple(parameter(name, RV20E) for name in RV.identified)
    at = np.array([item.coordinate(true[item.name]) for item in parameters])
    found = recovery(RV20E, parameters, at, exact, 12, SeedTree(9))
    assert found.recovered == 12
    held = int(found.covered.sum())
    assert held >= binom.ppf(0.001, 36, 0.95)
    assert np.abs(found.error.mean(axis=0) / found.error.std(axis=0, ddof=1) * np.sqrt(12)).max() < 4


def test_the_gain_of_table_7_is_a_share_of_the_difference():
    np.testing.assert_allclose(improvement(np.array([2.0, 4.0]), np.array([1.0, 3.0])), [0.5, 0.25])


@pytest.mark.slow
def test_curves_at_several_torques_tell_how_a_ring_tilts_and_not_how_it_shifts():
    """Two discs in balance tilt the ring and do not shift it; a turn is the same at every angle, so a curve without
    its mean does not show it, and a loop does."""
    preset = load_reducer("rv160e")
    housing = Housing(along=2e10, turn=3e7, tilt_along=5e5, tilt_across=1.5e6, direction=0.4)
    names = ("ring_tilt_along", "ring_tilt_across", "ring_turn", "ring_along")
    true = on(preset, housing)
    start = replace(
        true,
        stiffness=replace(true.stiffness, **{name: 1.4 * getattr(true.stiffness, name) for name in names}),
    )
    plan = bench(
        peak_to_peak_torque=0.0,
        curve_torques=(-400.0, -1000.0, -1600.0, 1600.0),
        curve_angles=2 * np.pi * np.arange(156) / 156,
        loop_torques=np.array([-1568.0, -784.0, 784.0, 1568.0]),
    )
    units = random_units(ERRORS, 2, SeedTree(8))
    measured = simulated_bench(true, units, plan).measured(SeedTree(5))
    data = data_of(measured, "test")
    parameters = tuple(parameter(name, start) for name in names)
    problem = IdentificationProblem(
        parameters=parameters,
        data=data,
        predictor=KernelPredictor(start, parameters, measured, data),
        weight=np.ones(2),
    )
    found = gauss_newton(problem, np.zeros((1, len(names)))).coordinates
    own = information(problem, problem.predictor(found), found)
    error = np.sqrt(np.diag(own.covariance))
    true_at = np.array([item.coordinate(getattr(true.stiffness, item.name)) for item in parameters])
    told = np.abs(found - true_at)[:3]
    assert (told < 4 * error[:3]).all()
    assert (error[:3] < (0.1, 0.3, 0.1)).all()  # of ln K
    assert error[3] > 5 * error[0]
    with pytest.raises(UnknownNameError, match="ring_across"):
        parameter("ring_across", start)  # does not give
