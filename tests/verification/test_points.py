"""Cost models: slopes, convex forms, units, points, and fits."""

from __future__ import annotations

import cvxpy as cp
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from tolalloc.allocation.cost.model import (
    CostModel,
    Exponential,
    PowerExponential,
    Process,
    Reciprocal,
    ReciprocalPower,
    SumOfCosts,
)
from tolalloc.allocation.cost.points import OUTER_ERROR, Points, Spline, Tabulated, best_fit, fits
from tolalloc.exceptions import InputError

ZONES = np.geomspace(2.0, 30.0, 10)
CLOSED = [
    Reciprocal(fixed=1.0, factor=8.0),
    ReciprocalPower(fixed=0.5, factor=20.0, exponent=1.37),
    ReciprocalPower(factor=9.0, exponent=2.0),
    Exponential(fixed=2.0, factor=9.0, scale=7.0),
    PowerExponential(fixed=0.7, factor=12.0, exponent=0.6, scale=9.0),
]
CURVE = Points(zones=tuple(ZONES.tolist()), costs=tuple((1 + 8 / ZONES).tolist()))
MODELS = [
    *CLOSED,
    Tabulated(CURVE),
    Spline(CURVE),
    SumOfCosts(models=(CLOSED[0], CLOSED[3], Spline(CURVE)), ratios=(1.0, 0.7, 1.9)),
]
NOT_CONVEX = Points(zones=(2.0, 5.0, 8.0, 12.0), costs=(9.0, 8.5, 3.0, 2.0))


def named(model):
    return type(model).__name__


def points(zones, costs):
    return Points.sorted(list(zones), list(costs), "shop.csv (hob)")


@pytest.mark.parametrize("model", MODELS, ids=named)
def test_the_slope_is_that_of_the_value_inside_and_beyond_the_points(model):
    assert isinstance(model, CostModel)
    zones, step = np.append(np.linspace(1.03, 29.7, 77), 47.0), 1e-6
    differences = (model.value(zones + step) - model.value(zones - step)) / (2 * step)
    np.testing.assert_allclose(model.slope(zones), differences, rtol=1e-6, atol=1e-8)
    assert (model.slope(zones) <= 0).all()


@pytest.mark.parametrize("model", MODELS, ids=named)
def test_a_zone_alone_costs_what_it_costs_among_others(model):
    one = np.asarray(4.4)
    assert model.value(one).shape == model.slope(one).shape == ()
    assert model.value(one) == model.value(np.array([4.4, 9.0]))[0]
    assert model.value(np.ones((2, 3))).shape == (2, 3)


@pytest.mark.parametrize("model", MODELS, ids=named)
@pytest.mark.parametrize("unit", [1e-6, 0.3, 1e6])
def test_another_unit_of_the_zone_changes_no_cost(model, unit):
    again = model.rescaled(unit)
    np.testing.assert_allclose(again.value(ZONES / unit), model.value(ZONES), rtol=1e-12)
    np.testing.assert_allclose(again.slope(ZONES / unit), model.slope(ZONES) * unit, rtol=1e-9)
    np.testing.assert_allclose(again.rescaled(1 / unit).value(ZONES), model.value(ZONES), rtol=1e-12)


@pytest.mark.parametrize("model", MODELS, ids=named)
def test_the_convex_form_is_the_value_and_a_lower_bound(model):
    zones = np.linspace(2.0, 34.0, 997)
    expression = model.expression(cp.Variable(3, pos=True), cp)
    assert expression.is_convex() and expression.is_dcp() and expression.shape == (3,)
    value = model.expression(cp.Constant(zones), cp).value
    exact = isinstance(model, Tabulated) or model in CLOSED
    np.testing.assert_allclose(value, model.value(zones), rtol=1e-12 if exact else OUTER_ERROR)
    assert (value <= model.value(zones) * (1 + 1e-12)).all()
    alone = model.expression(cp.Constant(4.4), cp)
    assert alone.shape == () and alone.value == pytest.approx(float(model.value(np.asarray(4.4))), rel=OUTER_ERROR)


@pytest.mark.parametrize("model", MODELS, ids=named)
def test_a_solver_takes_the_convex_form(model):
    """The stationary point of the cost plus a price per unit of zone, against a fine grid."""
    zone = cp.Variable(pos=True)
    program = cp.Problem(cp.Minimize(model.expression(zone, cp) + 0.11 * zone), [zone >= 2.0, zone <= 30.0])
    grid = np.linspace(2.0, 30.0, 200001)
    assert program.solve(solver="CLARABEL") == pytest.approx((model.value(grid) + 0.11 * grid).min(), rel=3e-6)


def test_shapes_that_are_not_convex_have_no_convex_form():
    assert not Tabulated(NOT_CONVEX).is_convex
    assert not Spline(NOT_CONVEX).is_convex
    assert not SumOfCosts(models=(CLOSED[0], Spline(NOT_CONVEX)), ratios=(1.0, 1.0)).is_convex
    straight = Points(zones=(1.0, 2.1, 3.7, 4.0), costs=(9.0, 9.0 - 1.1, 9.0 - 2.7, 6.0))
    for kind in (Tabulated, Spline):
        assert kind(straight).expression(cp.Constant(3.0), cp).value == pytest.approx(7.0, rel=OUTER_ERROR)


def test_points_of_a_convex_curve_nearly_always_give_a_convex_spline(generator):
    """A cubic spline is not always possible; the slopes of Fritsch and Butland make a quarter of these convex."""
    missing = 0
    for _ in range(200):
        zones = np.sort(generator.uniform(2.0, 30.0, 6))
        costs = generator.uniform(0, 3) + 20 * zones ** -generator.uniform(0.5, 2.5)
        missing += not Spline(points(zones.tolist(), costs.tolist())).is_convex
    assert missing <= 5
    partly_straight = Points(zones=(1.0, 2.1, 3.7, 5.0, 9.0), costs=(9.0, 7.9, 6.3, 5.0, 3.0))
    assert Spline(partly_straight).is_convex


def test_where_the_points_are_not_convex_the_spline_is_that_of_fritsch_and_butland():
    zones = np.linspace(2.0, 12.0, 301)
    expected = PchipInterpolator(NOT_CONVEX.zones, NOT_CONVEX.costs)(zones)
    np.testing.assert_allclose(Spline(NOT_CONVEX).value(zones), expected, rtol=1e-12)


def test_sampled_costs_go_through_their_points_and_never_rise():
    for curve in (CURVE, NOT_CONVEX):
        for kind in (Tabulated, Spline):
            np.testing.assert_allclose(kind(curve).value(np.array(curve.zones)), curve.costs, rtol=1e-12)
            assert (np.diff(kind(curve).value(np.linspace(1.0, 40.0, 5001))) <= 1e-12).all()


def test_a_sum_counts_every_callout_at_its_own_zone():
    together = SumOfCosts(models=(CLOSED[0], CLOSED[3]), ratios=(4.0, 3.8))
    expected = CLOSED[0].value(np.asarray(4.0 * 1.3)) + CLOSED[3].value(np.asarray(3.8 * 1.3))
    assert together.value(np.asarray(1.3)) == pytest.approx(float(expected), rel=1e-14)
    Process(name="together", cost=together, minimum=0.2, maximum=2.0)


@pytest.mark.parametrize(
    ("form", "field", "value"),
    [
        (Reciprocal, "factor", -1.0),
        (Reciprocal, "factor", float("inf")),
        (Reciprocal, "fixed", -0.1),
        (ReciprocalPower, "exponent", 0.0),
        (Exponential, "scale", -2.0),
        (PowerExponential, "scale", float("nan")),
    ],
)
def test_costs_that_would_not_fall_are_refused(form, field, value):
    allowed = {"fixed": 1.0, "factor": 1.0, "exponent": 1.0, "scale": 1.0}
    arguments = {name: allowed[name] for name in form.__dataclass_fields__} | {field: value}
    with pytest.raises(InputError, match=f"cost model: {field} is {value!r}; allowed is a finite number"):
        form(**arguments)


@pytest.mark.parametrize(
    ("zones", "costs", "sentence"),
    [
        ((2, 4, 6), (9, 3, 3.5), r"shop.csv \(hob\): a zone of 4 costs 3 and a zone of 6 costs 3.5; allowed"),
        ((2, 4, 4), (9, 3, 2), "a zone of 4 costs 3 and 2; allowed is one cost per zone"),
        ((2, 2), (9, 3), "zones and costs is .* allowed is two zones or more"),
        ((2, 0), (9, 3), "zones is 0.0; allowed is a finite number above 0"),
        ((2, 4), (9, float("nan")), "costs is nan; allowed is a finite number above 0"),
    ],
)
def test_points_that_make_no_falling_cost_are_refused(zones, costs, sentence):
    for kind in (Tabulated, Spline):
        with pytest.raises(InputError, match=sentence):
            kind(points(map(float, zones), map(float, costs)))


def test_points_out_of_order_are_refused():
    with pytest.raises(InputError, match="allowed is zones in ascending order"):
        Points(zones=(4.0, 2.0), costs=(1.0, 2.0))


@pytest.mark.parametrize("unit", [1.0, 1e-6])
@pytest.mark.parametrize("model", CLOSED, ids=named)
def test_a_fit_to_exact_points_returns_the_parameters_and_is_chosen(model, unit):
    true = model.rescaled(1 / unit)
    curve = points((ZONES * unit).tolist(), model.value(ZONES).tolist())
    best = best_fit(curve)
    assert type(best.model) is type(true)
    for name, value in vars(true).items():
        assert getattr(best.model, name) == pytest.approx(value, rel=1e-6, abs=1e-9)
    assert best.rms <= best.largest_error < 1e-9
    assert best.leave_one_out < 1e-6
    assert (best.smallest, best.largest) == (curve.zones[0], curve.zones[-1])


@pytest.mark.slow
@pytest.mark.parametrize("model", [CLOSED[0], CLOSED[1], CLOSED[3]], ids=named)
def test_fitted_parameters_lie_within_four_standard_errors(model, generator):
    zones, noise = np.repeat(np.geomspace(2.0, 30.0, 30), 2), 0.02
    costs = model.value(zones) * (1 + noise * generator.standard_normal(zones.size))
    (fit,) = [fit for fit in fits(points(zones.tolist(), costs.tolist())) if type(fit.model) is type(model)]
    names, step = list(vars(model)), 1e-6
    changed = [
        [type(model)(**(vars(model) | {name: getattr(model, name) * (1 + sign * step)})) for sign in (1, -1)]
        for name in names
    ]
    relative = np.stack([(up.value(zones) - down.value(zones)) / (2 * step) for up, down in changed], axis=1)
    relative /= model.value(zones)[:, np.newaxis]
    errors = noise * np.sqrt(np.diag(np.linalg.inv(relative.T @ relative)))
    found = np.array([getattr(fit.model, name) / getattr(model, name) - 1 for name in names])
    assert (np.abs(found) < 4 * errors).all()
    assert 0.8 * noise < fit.rms < fit.leave_one_out < 1.3 * noise


def test_the_error_left_out_is_that_of_a_fit_without_the_point(generator):
    costs = CLOSED[0].value(ZONES) * (1 + 0.05 * generator.standard_normal(ZONES.size))
    fit = fits(points(ZONES.tolist(), costs.tolist()))[0]
    assert type(fit.model) is Reciprocal
    for left_out in (0, 4):
        kept = np.arange(ZONES.size) != left_out
        columns = np.stack([1 / costs, 1 / ZONES / costs], axis=1)
        fixed, factor = np.linalg.lstsq(columns[kept], np.ones(kept.sum()))[0]
        unseen = (fixed + factor / ZONES[left_out]) / costs[left_out] - 1
        assert fit.unseen[left_out] == pytest.approx(unseen, rel=1e-8)


@pytest.mark.slow
def test_noise_seldom_makes_the_choice_more_complicated(generator):
    """The rule keeps the form in about 95 of 100 samples; fewer than 12 of 15 has a probability of 0.005."""
    chosen = []
    for _ in range(15):
        costs = CLOSED[0].value(ZONES) * (1 + 0.02 * generator.standard_normal(ZONES.size))
        chosen.append(type(best_fit(points(ZONES.tolist(), costs.tolist())).model))
    assert chosen.count(Reciprocal) >= 12


def test_forms_with_too_many_parameters_for_the_points_are_left_out():
    zones = ZONES[::3]
    found = fits(points(zones.tolist(), CLOSED[0].value(zones).tolist()))
    assert [type(fit.model) for fit in found] == [Reciprocal, ReciprocalPower, Exponential]
    assert len(fits(points(zones[:3].tolist(), CLOSED[0].value(zones[:3]).tolist()))) == 1
    with pytest.raises(InputError, match="number of points for a fit is 2; allowed is 3 or more"):
        fits(points([2.0, 4.0], [3.0, 2.0]))


@pytest.mark.parametrize("costs", [ZONES, np.full(10, 3.0), 5 - 4 / ZONES])
def test_costs_that_no_falling_curve_follows_are_refused(costs):
    with pytest.raises(InputError, match="the costs do not fall between zones of 2 and 30; allowed are"):
        best_fit(points(ZONES.tolist(), costs.tolist()))
