"""Natural frequencies, critical speeds and orders against the speed: against the dense model and what is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.builders import order_spectrum
from tests.verification.dense_twin import dense_model, least_energy
from tests.verification.test_ring import on
from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.springs import Coordinates
from tolalloc.reducers.reducer.design import Clearances
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.housing import Housing
from tolalloc.wings.motion.motion import Damping, SpeedProfile, generalised_alpha, inertia_of, motion_of, newmark
from tolalloc.wings.motion.speeds import Modes, critical_speeds, modes, orders_against_speed
from tolalloc.wings.motion.stepping import simulate

TURN = 2 * np.pi * np.arange(96) / 96


def with_law(model: EquivalentModel, law: str) -> EquivalentModel:
    return EquivalentModel(replace(model.reducer, stiffness=replace(model.reducer.stiffness, pin_contact_law=law)))


def heavy(model: EquivalentModel, output_inertia: float = 100.0):
    return inertia_of(model.reducer, output_inertia=output_inertia)


@pytest.mark.parametrize(
    ("preset", "law", "torque"),
    [
        ("rv20e_liu2020", "constant", -167.0),
        ("rv20e_liu2020", "table2", -3.0),
        ("rv40e_xi2015", "constant", -412.0),
        ("rv80e", "table2", -1.0),
        ("rv20e", "logarithmic", -167.0),
        ("rv160e", "logarithmic", -1000.0),
    ],
)
def test_frequencies_are_those_of_differences_of_the_dense_gradient(preset, law, torque):
    model = with_law(EquivalentModel(load_reducer(preset)), law)
    straight = np.array([not column.endswith((".tilt.x", ".tilt.y")) for column in model.columns])
    errors = straight * np.random.default_rng(5).normal(0.0, 3e-6, straight.size)
    inertia = heavy(model, 0.02)
    unit, angles = dict(zip(model.columns, errors.tolist(), strict=True)), np.array([0.1, 1.7, 4.4])
    found = modes(model, errors, torque, inertia, angles)
    mass = inertia.diagonal(Coordinates(model.reducer.crank_count, model.reducer.disc_count))
    for number, angle in enumerate(angles):
        dense = dense_model(model.reducer, unit, torque, float(angle))
        q = least_energy(dense)
        ahead, back = (np.array([dense.gradient(q + h * axis) for axis in np.eye(q.size)]) for h in (1e-9, -1e-9))
        hessian = (ahead - back) / 2e-9
        squares = eigh((hessian + hessian.T) / 2, np.diag(mass), eigvals_only=True)
        np.testing.assert_allclose(found.frequency[number], np.sqrt(squares) / (2 * np.pi), rtol=1e-6)
        shape = found.shape[number]
        np.testing.assert_allclose(shape * mass @ shape.T, np.eye(q.size), atol=1e-10)
        stiffness = shape @ hessian @ shape.T
        assert np.abs(stiffness - np.diag(squares)).max() < 1e-6 * squares.max()
    np.testing.assert_allclose(found.carrier_share.sum(axis=1), 1.0)


@pytest.mark.slow
def test_a_kicked_unit_rings_at_the_frequency_of_the_carriers_mode(rv20e, table4):
    """The strongest frequency of the record lies within its resolution of the mode that moves the carrier most."""
    angle, duration, steps = 0.3, 0.5, 25000
    torque = SpeedProfile((0.0, 1e-9), (-167.0, -167.1))
    motion = motion_of(rv20e.reducer, SpeedProfile.constant(0.0), torque, duration, steps, angle)
    inertia = heavy(rv20e, 1.0)
    curve = simulate(rv20e, table4, motion, inertia, Damping(), newmark()).transmission_error[0, 1:]
    spectrum = np.abs(np.fft.rfft((curve - curve.mean()) * np.hanning(curve.size)))
    expected = modes(rv20e, table4[0], -167.1, inertia, np.array([angle]))
    frequency = expected.frequency[0, np.argmax(expected.carrier_share[0])]
    assert frequency > 50 / duration
    assert np.argmax(spectrum) / duration == pytest.approx(frequency, abs=1 / duration)


def test_frequencies_fall_as_the_output_grows_heavier(rv20e, table4):
    light, medium, heavier = (modes(rv20e, table4[0], -167.0, heavy(rv20e, own), TURN) for own in (0.0, 0.1, 1.0))
    for one, other in ((light, medium), (medium, heavier)):
        assert (other.frequency <= one.frequency * (1 + 1e-9)).all()
        assert (other.frequency[:, 0] < 0.6 * one.frequency[:, 0]).all()
    assert (heavier.carrier_share[:, 0] > 0.99).all()
    # Almost all of the inertia is at the output: there the reducer is the spring that the static model shows.
    twist = [rv20e.equilibria(table4, torque, TURN).transmission_error[0] for torque in (-167.5, -166.5)]
    spring = np.sqrt(1.0 / (twist[1] - twist[0])) / (2 * np.pi)
    slow = modes(rv20e, table4[0], -167.0, heavy(rv20e, 1e4), TURN).frequency[:, 0] * 100
    np.testing.assert_allclose(np.median(slow / spring), 1.0, rtol=1e-4)


def test_where_no_pin_carries_the_first_frequency_is_zero(rv20e):
    loose = -1e-5 * (np.array(rv20e.columns) == "pin.diameter")
    found = modes(rv20e, loose, 0.0, heavy(rv20e, 0.02), TURN)
    assert (found.frequency[:, 0] < 1e-5 * found.frequency[:, 1]).all()
    held = modes(rv20e, loose, -1.0, heavy(rv20e, 0.02), TURN)
    assert (held.frequency[:, 0] > 100.0).all()


def test_critical_speeds_are_where_an_order_meets_a_band():
    frequency = np.array([[10.0, 50.0], [12.0, 45.0]])
    made = Modes(
        carrier_angle=np.array([0.0, 1.0]),
        frequency=frequency,
        shape=np.zeros((2, 2, 2)),
        carrier_share=np.array([[0.9, 0.1], [0.7, 0.3]]),
    )
    found = critical_speeds(made, (5, 10), (0.0, 2 * np.pi * 4.6))
    met = [(one.order, one.mode, one.slowest / (2 * np.pi), one.fastest / (2 * np.pi)) for one in found]
    np.testing.assert_allclose(met, [(10, 0, 1.0, 1.2), (5, 0, 2.0, 2.4), (10, 1, 4.5, 5.0)])
    np.testing.assert_allclose([one.carrier_share for one in found], [0.8, 0.8, 0.2])


@pytest.mark.slow
def test_as_the_speed_falls_the_orders_become_those_of_the_static_curve(rv20e, table4):
    orders, steps = (1, 2, 39, 78, 80), 2340
    damping = Damping(mass_proportional=20.0, stiffness_proportional=1e-5)
    speeds, light = np.array([0.01, 0.3]), inertia_of(rv20e.reducer)
    given = (damping, generalised_alpha(0.8), speeds, orders, steps)
    found = orders_against_speed(rv20e, table4, -167.0, light, *given)
    static = rv20e.equilibria(table4, -167.0, 2 * np.pi * np.arange(steps) / steps).transmission_error
    expected = order_spectrum(static).amplitude[0, np.array(orders) - 1]
    assert np.abs(found.amplitude[0, 0] - expected).max() < 0.05 * ARCSECOND
    assert abs(found.peak_to_peak[0, 0] - np.ptp(static)) < 0.05 * ARCSECOND
    assert (found.unsettled < 0.05 * ARCSECOND).all()
    assert (found.status == Status.CONVERGED).all()


@pytest.mark.slow
def test_at_resonance_an_order_grows_as_an_oscillator_does(rv20e, table4):
    """Of small errors under full torque no pin lets go: the first mode is one oscillator, 1/(2ζ) at its frequency."""
    errors, inertia, order, steps = 0.01 * table4, heavy(rv20e), 78, 3120
    first = float(modes(rv20e, errors[0], -167.0, inertia, TURN).frequency[:, 0].mean())
    (critical,) = critical_speeds(modes(rv20e, errors[0], -167.0, inertia, TURN), (order,), (0.0, 10.0))
    assert critical.slowest <= 2 * np.pi * first / order <= critical.fastest
    speed, ratio = 2 * np.pi * first / order, 0.05
    damping = Damping(mass_proportional=2 * ratio * 2 * np.pi * first)
    speeds = speed * np.array([0.5, 1.0, 2.0])
    found = orders_against_speed(
        rv20e, errors, -167.0, inertia, damping, generalised_alpha(0.9), speeds, (order,), steps
    )
    static = rv20e.equilibria(errors, -167.0, 2 * np.pi * np.arange(steps) / steps).transmission_error
    grown = found.amplitude[0, :, 0] / order_spectrum(static).amplitude[0, order - 1]
    expected = [1 / abs(1 - r**2 + 2j * ratio * r) for r in (0.5, 1.0, 2.0)]
    np.testing.assert_allclose(grown, expected, rtol=0.03)
    assert (found.unsettled < 0.01 * found.peak_to_peak).all()


@pytest.mark.slow
def test_a_measured_unit_grows_at_its_critical_speed(rv20e, table4):
    """Its stiffness changes with the pins that carry, so its resonance is broad; still every order 78 … 80 grows."""
    inertia, orders, steps = heavy(rv20e), (78, 79, 80), 2340
    given = (Damping(mass_proportional=20.0), generalised_alpha(0.9))
    critical = critical_speeds(modes(rv20e, table4[0], -167.0, inertia, TURN), (78,), (0.0, 5.0))[0]
    speeds = np.linspace(critical.slowest, critical.fastest, 5)
    found = orders_against_speed(rv20e, table4, -167.0, inertia, *given, speeds, orders, steps)
    static = rv20e.equilibria(table4, -167.0, 2 * np.pi * np.arange(steps) / steps).transmission_error
    expected = order_spectrum(static).amplitude[0, np.array(orders) - 1]
    assert (found.amplitude[0].max(axis=0) > 2 * expected).all()


def test_a_failed_sample_is_a_status_and_never_a_number(rv20e, table4):
    errors = np.repeat(table4, 2, axis=0)
    errors[0, 3] = np.nan
    given = (inertia_of(rv20e.reducer), Damping(mass_proportional=100.0), generalised_alpha(0.5))
    found = orders_against_speed(rv20e, errors, -1.0, *given, np.array([0.1]), (1,), 120)
    assert (found.status[:, 0] == [Status.NOT_FINITE, Status.CONVERGED]).all()
    for values in (found.amplitude, found.peak_to_peak, found.unsettled):
        assert np.isnan(values[0]).all()
        assert np.isfinite(values[1]).all()
    with pytest.raises(SolveError, match="not a finite number"):
        modes(rv20e, errors[0], -1.0, given[0], TURN)


def test_what_has_no_modes_is_told_in_one_sentence(rv20e, table4):
    tilted = table4[0] + 1e-4 * (np.array(rv20e.columns) == "disc2.tilt.y")
    loose = EquivalentModel(replace(rv20e.reducer, clearances=Clearances(gear_mesh=5e-6)))
    on_ring = replace(rv20e, reducer=on(rv20e.reducer, Housing(turn=1e7)))
    inertia = inertia_of(rv20e.reducer)
    given = (inertia, Damping(), newmark())
    wrong = [
        lambda: modes(rv20e, tilted, -1.0, inertia, TURN),
        lambda: modes(loose, np.zeros(len(loose.columns)), -1.0, inertia, TURN),
        lambda: modes(on_ring, table4[0], -1.0, inertia, TURN),
        lambda: critical_speeds(modes(rv20e, table4[0], -1.0, inertia, TURN), (0,), (0.0, 1.0)),
        lambda: orders_against_speed(rv20e, table4, -1.0, *given, np.array([0.0]), (1,), 100),
        lambda: orders_against_speed(rv20e, table4, -1.0, *given, np.array([1.0]), (50,), 100),
        # 40 pins on 39 teeth make 1,560 waves, which fold onto 120 at 1,440 steps.
        lambda: orders_against_speed(rv20e, table4, -1.0, *given, np.array([1.0]), (1, 120), 1440),
        lambda: orders_against_speed(rv20e, table4, -1.0, *given, np.array([1.0]), (1,), 100, turns=1),
    ]
    for call in wrong:
        with pytest.raises(InputError, match="allowed is"):
            call()
