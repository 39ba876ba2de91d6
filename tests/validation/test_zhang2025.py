"""Adjustment of the BX40E of zhang2025: final errors of one set of parts, and what is to be expected of all.

The source prints no table that can be checked: reference numbers are from a calculation of the same equations that
shares nothing with this package. Phases of the discs, efforts of turning and all noise are assumed; part errors are
`default_rng(20250711).uniform(-60, 60, 12)` arcseconds, to two digits.
"""

from __future__ import annotations

import numpy as np
import pytest

from tolalloc.reading.units import ARCSECOND
from tolalloc.wings.assembly.chain import ChainPart, DatumFlowChain
from tolalloc.wings.assembly.control import kalman_filter, regulator
from tolalloc.wings.assembly.gains import final_errors, norms, state_weight_sweep
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.steps import Choice, Efforts, state_space, steps_in_order
from tolalloc.wings.assembly.trajectory import foreseen

OPPOSITE = (0.0, 0.0, np.pi)
BX40E = DatumFlowChain(
    datum="KC0",
    parts=(
        ChainPart(name="KC1", on="KC0"),
        ChainPart(name="KC2", on="KC1", position=(0.0, 0.045, 0.012)),
        ChainPart(name="KC3", on="KC0", turned=OPPOSITE, position=(0.0, 0.0, 0.02)),
        ChainPart(name="KC4", on="KC3", turned=OPPOSITE, position=(0.0, -0.045, 0.032)),
    ),
)
ERRORS = ARCSECOND * np.round(np.random.default_rng(20250711).uniform(-60, 60, 12), 2)
PRECISIONS = np.array([0.0, 1.0, 5.0, 10.0])


def bx40e(adjust: Choice) -> AssemblyPlan:
    return AssemblyPlan(
        name="BX40E",
        source="zhang2025",
        chain=BX40E,
        steps=steps_in_order(BX40E, adjust, "current", Efforts()),
        tolerances=np.full((4, 3), 30 * ARCSECOND),
        state_weight=10.0,
        weights=np.ones(4),
        measurement_noise=2 * ARCSECOND,
        adjustment_noise=1 * ARCSECOND,
    )


@pytest.mark.parametrize(
    ("adjust", "expected"),
    [
        ("all", (86.030677, 36.539776, 14.610015, 8.491389)),
        ("mounted", (86.030677, 36.554334, 14.616681, 8.495668)),
        ("current", (86.030677, 39.313044, 16.884205, 10.069678)),
    ],
)
def test_the_norm_of_the_final_errors_over_the_precision_weight(adjust, expected):
    found = norms(bx40e(adjust), ERRORS, PRECISIONS) / ARCSECOND
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("precision", [0.0, 0.3, 1.0, 10.0, 2500.0])
def test_one_planar_chain_of_two_parts_ends_at_the_exact_fractions(precision):
    pair = DatumFlowChain(datum="KC0", parts=(ChainPart(name="KC1", on="KC0"), ChainPart(name="KC2", on="KC1")))
    space = state_space(pair, steps_in_order(pair, "current", "current", Efforts()))
    first, second = errors = np.array([[37.0, -11.0, 4.0], [5.0, 23.0, -60.0]]) * ARCSECOND
    final = foreseen(space, regulator(space, precision * np.eye(6)), errors.ravel()).adjusted[-1]
    whole = 1 + 3 * precision + precision**2
    expected = [(1 + precision) * first - precision * second, first + (1 + precision) * second]
    np.testing.assert_allclose(final, np.ravel(expected) / whole, rtol=1e-12)
    if precision == 10:
        np.testing.assert_allclose(final[0], (11 * 37 + 10 * -5) / 131 * ARCSECOND, rtol=1e-12)
        np.testing.assert_allclose(final[3], (37 + 11 * 5) / 131 * ARCSECOND, rtol=1e-12)


def test_effort_alone_still_turns_parts_that_are_not_there_and_the_mask_does_not():
    absent = np.triu(np.ones((4, 4), dtype=bool), k=1).repeat(3, axis=1)
    for adjust, expected in (("all", 0.034236), ("mounted", 0.0)):
        plan = bx40e(adjust)
        turned = foreseen(plan.space, regulator(plan.space, plan.final_weight()), ERRORS).adjustments / ARCSECOND
        assert np.abs(turned[absent]).max() == pytest.approx(expected, abs=1e-6)


def test_expected_cost_total_and_what_noise_leaves_of_it():
    plan, arcsec2 = bx40e("mounted"), ARCSECOND**2
    noise = plan.measurement_noise, plan.adjustment_noise
    kalman = kalman_filter(plan.space, plan.variances, *noise, "BX40E")
    found = final_errors(plan.space, regulator(plan.space, plan.final_weight()), kalman, *noise)
    squares = float(np.vdot(plan.final_weight(), found.covariance(plan.variances)))
    assert (squares + found.expected_effort(plan.variances)) / arcsec2 == pytest.approx(1779.784224, abs=5e-7)
    sweep = state_weight_sweep(plan, np.array([0.0, 1.0, 5.0, 10.0]))
    assert sweep.total[-1] / ARCSECOND == pytest.approx(9.7064918, abs=5e-8)
    assert (10.0 * sweep.total[-1] ** 2 + sweep.effort[-1]) / arcsec2 == pytest.approx(1779.784224, abs=5e-7)
    assert sweep.noise_floor / ARCSECOND == pytest.approx(9.3220359, abs=5e-8)


def test_six_coordinates_a_part_give_the_same_angles():
    steps = steps_in_order(BX40E, "mounted", "current", Efforts())
    angles, twists = state_space(BX40E, steps), state_space(BX40E, steps, BX40E.twist_transform)
    turning = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], 4)
    errors = np.zeros((4, 6))
    errors[:, :3] = ERRORS.reshape(4, 3)
    errors[:, 3:] = 1e-5 * np.arange(12).reshape(4, 3)
    of_angles = foreseen(angles, regulator(angles, 10 * np.eye(12)), ERRORS).adjusted
    of_twists = foreseen(twists, regulator(twists, 10 * np.diag(turning)), errors.ravel()).adjusted
    assert twists.states == 24
    np.testing.assert_allclose(of_twists[:, turning > 0], of_angles, rtol=1e-12, atol=1e-12 * np.abs(of_angles).max())
