"""The equivalent model in time: against Radau's method, the static limit, the eigenproblem and what is conserved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.random_cases import random_case, random_units, seeds
from tests.verification.dense_twin import dense_model
from tests.verification.moving_twin import MovingTwin, path_derivatives
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.springs import Coordinates, Positions
from tolalloc.reducers.reducer.design import Clearances
from tolalloc.running.compiled import thread_count, use_threads
from tolalloc.wings.motion.motion import (
    Damping,
    Inertia,
    Integrator,
    Motion,
    SpeedProfile,
    generalised_alpha,
    inertia_of,
    motion_of,
    newmark,
    nominal_acceleration,
)
from tolalloc.wings.motion.stepping import Simulated, simulate

UNDAMPED = Damping()


def input_of(reducer, carrier_speed: SpeedProfile) -> SpeedProfile:
    return replace(carrier_speed, values=tuple(value * reducer.ratio for value in carrier_speed.values))


def run(model, errors, motion: Motion, damping=UNDAMPED, integrator=None, observe=None) -> Simulated:
    inertia = inertia_of(model.reducer)
    return simulate(model, errors, motion, inertia, damping, integrator or newmark(), observe)


def rv20e_mass(rv20e) -> np.ndarray:
    return inertia_of(rv20e.reducer).diagonal(Coordinates(2, 2))


@pytest.fixture(scope="module")
def free_vibration(rv20e, table4):
    """At rest at one angle; from the first step on the torque is a little another one, no contact changes."""
    torque, angle, duration, steps = SpeedProfile((0.0, 1e-9), (-500.0, -505.0)), 0.3, 4e-3, 4000
    motion = motion_of(rv20e.reducer, SpeedProfile.constant(0.0), torque, duration, steps, angle)
    found = run(rv20e, table4, motion, observe=np.arange(steps + 1))
    assert (found.pins_in_contact == found.pins_in_contact[:, :1]).all()
    unit = dict(zip(rv20e.columns, table4[0].tolist(), strict=True))
    return found, dense_model(rv20e.reducer, unit, -505.0, angle), motion


@pytest.mark.slow
def test_agrees_with_radau(rv20e, table4):
    reducer, end, steps = rv20e.reducer, 1e-4, 8000
    torque, speed = SpeedProfile((0.0, end), (-167.0, -120.0), "step"), SpeedProfile((0.0, end), (2.0, 12.0), "step")
    unit = dict(zip(rv20e.columns, table4[0].tolist(), strict=True))
    twin = MovingTwin(reducer, unit, inertia_of(reducer), speed, torque, 50.0, 1e-7, angle=0.3)
    expected = twin.integrated(np.linspace(0.0, end, 6))
    motion = motion_of(reducer, input_of(reducer, speed), torque, end, steps, 0.3)
    damping = Damping(mass_proportional=50.0, stiffness_proportional=1e-7)
    for integrator in (newmark(), generalised_alpha(0.8)):
        found = run(rv20e, table4, motion, damping, integrator, np.arange(6) * steps // 5)
        assert len(np.unique(found.pins_in_contact, axis=1)[0]) > 1  # contacts open and close on the way
        for derivative, state in enumerate((found.displacement, found.velocity)):
            largest = np.abs(expected[:, derivative]).max(axis=0)
            assert (np.abs(state[0] - expected[:, derivative]) <= (1e-6, 2e-5)[derivative] * largest).all()


@pytest.mark.slow
def test_approaches_the_static_model_as_the_speed_falls(rv20e, table4):
    apart = []
    for minutes in (1.0, 4.0, 20.0):  # of one output turn
        speed = SpeedProfile.constant(2 * np.pi / (60 * minutes) * rv20e.reducer.ratio)
        motion = motion_of(rv20e.reducer, speed, SpeedProfile.constant(-1.0), 60 * minutes, 1404)
        damping = Damping(mass_proportional=100.0, stiffness_proportional=1e-5)
        found = run(rv20e, table4, motion, damping, generalised_alpha(0.8))
        static = rv20e.equilibria(table4, -1.0, motion.carrier_angle)
        apart.append(np.abs(found.transmission_error - static.transmission_error).max() / ARCSECOND)
        assert found.input_torque.mean() == pytest.approx(1 / rv20e.reducer.ratio, rel=1e-4)
    assert apart[0] > 2 * apart[1] > 4 * apart[2]
    assert apart[2] < 1e-3


def test_the_start_is_the_static_equilibrium(rv20e, table4):
    motion = motion_of(rv20e.reducer, SpeedProfile.constant(0.0), SpeedProfile.constant(-10.0), 1e-3, 100, 0.7)
    found = run(rv20e, table4, motion)
    static = rv20e.equilibria(table4, -10.0, np.array([0.7])).transmission_error
    np.testing.assert_allclose(found.transmission_error, np.broadcast_to(static, (1, 101)), rtol=0, atol=1e-16)
    assert np.abs(found.output_speed).max() < 1e-10


def test_average_acceleration_keeps_the_energy(rv20e, free_vibration):
    found, springs, _ = free_vibration
    state, mass = found, rv20e_mass(rv20e)
    rest = springs.energy(state.displacement[0].mean(axis=0))
    kinetic = (mass * state.velocity[0] ** 2).sum(axis=1) / 2
    energy = np.array([springs.energy(q) - rest for q in state.displacement[0]]) + kinetic
    assert np.ptp(energy[1:]) < 1e-8 * kinetic.max()


def test_frequencies_are_those_of_the_eigenproblem(rv20e, free_vibration):
    """Every mode that moves obeys η(n+1) + η(n−1) = 2cos(ω̃h)·η(n), with tan(ω̃h/2) = ωh/2 for this integrator."""
    found, springs, motion = free_vibration
    mass, state = rv20e_mass(rv20e), found.displacement[0]
    squares, shapes = eigh(springs.hessian(state[0]), np.diag(mass))
    rest = state[0] - np.linalg.solve(springs.hessian(state[0]), springs.gradient(state[0]))
    modes = (state - rest) @ (mass[:, np.newaxis] * shapes)
    seen = 0
    for square, mode in zip(squares, modes[1:].T, strict=True):
        if np.abs(mode).max() > 1e-5 * np.abs(modes).max():
            double = (mode[1:-1] @ (mode[2:] + mode[:-2])) / (mode[1:-1] @ mode[1:-1])
            numerical = np.arccos(double / 2) / motion.step
            frequency = 2 / motion.step * np.tan(numerical * motion.step / 2)
            assert frequency == pytest.approx(np.sqrt(square), rel=1e-6)
            seen += 1
    assert seen >= 6


def energy_drift(model, errors, steps: int, integrator: Integrator) -> float:
    """What is missing in the energy balance of a turning, undamped unit, over the largest kinetic energy."""
    reducer, end = model.reducer, 4e-4
    speed, torque = SpeedProfile((0.0, end), (0.0, 20.0), "step"), SpeedProfile((0.0, end), (-300.0, -250.0), "step")
    unit = dict(zip(model.columns, errors[0].tolist(), strict=True))
    twin = MovingTwin(reducer, unit, inertia_of(reducer), speed, torque, angle=0.3)
    motion = motion_of(reducer, input_of(reducer, speed), torque, end, steps, 0.3)
    found = run(model, errors, motion, integrator=integrator, observe=np.arange(steps + 1))
    q, velocity = found.displacement[0], found.velocity[0]
    kinetic, elastic, power = (np.empty(steps + 1) for _ in range(3))
    for n, time in enumerate(motion.time):
        ahead, here, back = (
            dense_model(reducer, unit, 0.0, twin.carrier_angle(time) + turn).energy(q[n]) for turn in (1e-6, 0.0, -1e-6)
        )
        kinetic[n], elastic[n] = twin.mass @ velocity[n] ** 2 / 2, here
        power[n] = motion.carrier_speed[n] * (ahead - back) / 2e-6 + motion.torque[n] * velocity[n, -1]
        power[n] -= velocity[n] @ (twin.mass * twin.nominal_acceleration(time))
    supplied = np.concatenate([[0.0], np.cumsum(motion.step * (power[1:] + power[:-1]) / 2)])
    return float(np.ptp(kinetic + elastic - supplied) / kinetic.max())


@pytest.mark.slow
def test_energy_is_what_was_supplied(rv20e, table4):
    coarse, fine = (energy_drift(rv20e, table4, steps, newmark()) for steps in (100, 200))
    assert fine < 0.35 * coarse
    assert fine < 0.05


@pytest.mark.parametrize("seed", seeds(24))
def test_forces_balance_at_every_step_whatever_law_tilt_and_play(seed):
    case = random_case(seed)
    model, reducer = EquivalentModel(case.reducer, orders=case.orders), case.reducer
    errors = np.array([[unit.get(column, 0.0) for column in model.columns] for unit in case.units])
    speed = SpeedProfile((0.0, 2e-3), (0.5, 3.0), "step")
    torque = SpeedProfile((0.0, 2e-3), (case.torque, 2 * case.torque))
    motion = motion_of(reducer, input_of(reducer, speed), torque, 2e-3, 200, float(case.carrier_angle[0]))
    chosen, damping = np.array([1, 60, 200]), Damping(mass_proportional=30.0, stiffness_proportional=2e-7)
    found = run(model, errors, motion, damping, generalised_alpha(0.7), chosen)
    assert (found.status == Status.CONVERGED).all()
    inertia, ratio = inertia_of(reducer), reducer.ratio
    for number, unit in enumerate(case.units):
        twin = MovingTwin(reducer, unit, inertia, speed, torque, 30.0, 2e-7, float(case.carrier_angle[0]), case.orders)
        for slot, step in enumerate(chosen):
            time, state = float(motion.time[step]), found
            q, v, a = (part[number, slot] for part in (state.displacement, state.velocity, state.acceleration))
            springs = twin.springs(time)
            forces = springs.forces(q)
            largest = max(np.abs(force).max() for force in forces.values())
            assert np.abs(twin.unbalance(time, q, v, a)).max() < 1e-8 * largest
            np.testing.assert_allclose(
                state.pin_forces[number, slot].ravel(), forces["pin contact"].ravel(), rtol=0, atol=1e-9 * largest
            )
            touching = (forces["pin contact"].reshape(reducer.disc_count, -1) > 0.0).sum(axis=1)
            assert (found.pins_in_contact[number, step] == touching).all()
            # Turned as the ideal gear train turns, the mechanism strains the meshes only.
            train, _ = path_derivatives(reducer, twin.carrier_angle(time))
            inertial = twin.mass * (a + twin.nominal_acceleration(time))
            mesh = next(part for part in springs.interfaces if part.name == "gear mesh")
            others = twin.damping(springs._replace(interfaces=tuple(p for p in springs.interfaces if p is not mesh)))
            supplied = ratio * found.input_torque[number, step] + motion.torque[step]
            scale = abs(motion.torque[step]) + np.abs(train * inertial).sum() + np.abs(train * (others @ v)).sum()
            assert abs(supplied - train @ (inertial + others @ v)) < 1e-6 * scale


def test_bits_depend_neither_on_threads_nor_on_the_batch(rv20e, table4):
    errors = random_units(table4, rv20e.columns, np.random.default_rng(3), 5)
    motion = motion_of(rv20e.reducer, SpeedProfile.constant(100.0), SpeedProfile.constant(-20.0), 0.02, 600)
    damping, some = Damping(stiffness_proportional=1e-6), np.array([0, 600])
    threads = thread_count()
    try:
        use_threads(4)
        before = run(rv20e, errors, motion, damping, observe=some)
        use_threads(1)
        one = run(rv20e, errors, motion, damping, observe=some)
        alone = run(rv20e, errors[3:4], motion, damping, observe=some)
    finally:
        use_threads(threads)
    for name in ("transmission_error", "output_speed", "output_acceleration", "input_torque", "pins_in_contact"):
        np.testing.assert_array_equal(getattr(before, name), getattr(one, name))
        np.testing.assert_array_equal(getattr(before, name)[3:4], getattr(alone, name))
    np.testing.assert_array_equal(before.pin_forces, one.pin_forces)


def test_a_failed_sample_is_a_status_and_never_a_number(rv20e, table4):
    errors = np.repeat(table4, 2, axis=0)
    errors[0, 3] = np.nan
    motion = motion_of(rv20e.reducer, SpeedProfile.constant(10.0), SpeedProfile.constant(-5.0), 1e-3, 10)
    found = run(rv20e, errors, motion, observe=np.array([4]))
    assert (found.status == np.array([[Status.NOT_FINITE], [Status.CONVERGED]])).all()
    for values in (found.transmission_error, found.output_speed, found.input_torque, found.pin_forces):
        assert np.isnan(values[0]).all()
        assert np.isfinite(values[1]).all()
    no_torque = motion_of(rv20e.reducer, SpeedProfile.constant(10.0), SpeedProfile.constant(0.0), 1e-3, 10)
    floating = run(rv20e, 0 * table4 - 1e-5 * (np.array(rv20e.columns) == "pin.diameter"), no_torque)
    assert ((floating.status == Status.CONVERGED) == np.isfinite(floating.transmission_error)).all()


@pytest.mark.slow
def test_damping_of_one_interface_acts_there_alone(rv20e, table4):
    """An oscillation decays under damped meshes; the same factor on all interfaces is that on each of them."""
    torque = SpeedProfile((0.0, 1e-9), (-500.0, -505.0))
    motion = motion_of(rv20e.reducer, SpeedProfile.constant(0.0), torque, 4e-3, 2000, 0.3)
    names = ("sun_support", "gear_mesh", "crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing")
    free = run(rv20e, table4, motion)
    meshes = run(rv20e, table4, motion, Damping(interfaces={"gear_mesh": 1e-5}))
    each = run(rv20e, table4, motion, Damping(interfaces=dict.fromkeys(names, 1e-6)))
    whole = run(rv20e, table4, motion, Damping(stiffness_proportional=1e-6))
    assert np.abs(meshes.output_speed[:, 1500:]).max() < 0.7 * np.abs(free.output_speed[:, 1500:]).max()
    np.testing.assert_allclose(each.transmission_error, whole.transmission_error, rtol=1e-9)


def test_the_nominal_acceleration_is_the_second_derivative_of_the_nominal_motion(rv20e):
    speed = SpeedProfile((0.0, 0.1), (5.0, 60.0), "step")
    motion = motion_of(rv20e.reducer, input_of(rv20e.reducer, speed), SpeedProfile.constant(-1.0), 0.1, 7)
    found = nominal_acceleration(Positions(rv20e.reducer, motion.carrier_angle), motion)
    twin = MovingTwin(rv20e.reducer, {}, inertia_of(rv20e.reducer), speed, SpeedProfile.constant(-1.0))
    expected = np.stack([twin.nominal_acceleration(float(time)) for time in motion.time])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("blend", ["linear", "step"])
def test_a_profile_fits_its_slope_and_its_integral(blend):
    profile, h = SpeedProfile((-0.5, 0.2, 0.5, 1.5), (3.0, -1.0, 4.0, 4.5), blend), 1e-6
    time = np.array([-0.9, -0.3, 0.1, 0.4, 0.9, 2.0])
    np.testing.assert_allclose(profile.slope(time), (profile.at(time + h) - profile.at(time - h)) / (2 * h), atol=1e-7)
    rate = (profile.integral(time + h) - profile.integral(time - h)) / (2 * h)
    np.testing.assert_allclose(rate, profile.at(time), atol=1e-7)
    assert profile.integral(np.zeros(1))[0] == 0.0
    np.testing.assert_allclose(profile.at(np.array([-9.0, -0.5, 0.2, 1.5, 9.0])), [3.0, 3.0, -1.0, 4.5, 4.5])


def test_masses_follow_from_the_geometry(rv20e):
    inertia = inertia_of(rv20e.reducer, output_inertia=0.02)
    stage = rv20e.reducer.cycloid_stage
    assert inertia.disc == pytest.approx(7850.0 * np.pi * 0.05**2 * stage.face_width)
    assert inertia.disc_moment == pytest.approx(inertia.disc * 0.05**2 / 2)
    assert inertia.carrier_moment == pytest.approx(2 * inertia.disc_moment + 0.02)
    diagonal = inertia.diagonal(Coordinates(3, 2))
    assert diagonal.size == Coordinates(3, 2).count
    assert diagonal[Coordinates(3, 2).planet(2) + 2] == inertia.planet_moment
    assert diagonal[-1] == inertia.carrier_moment


def test_wrong_input_is_told_in_one_sentence(rv20e, table4):
    constant = SpeedProfile.constant(1.0)
    wrong = [
        lambda: SpeedProfile((0.0, 0.0), (1.0, 2.0)),
        lambda: SpeedProfile((0.0,), (1.0, 2.0)),
        lambda: motion_of(rv20e.reducer, constant, constant, 0.0, 10),
        lambda: motion_of(rv20e.reducer, constant, constant, 1.0, 0),
        lambda: inertia_of(rv20e.reducer, density=0.0),
        lambda: inertia_of(rv20e.reducer, output_inertia=-1.0),
        lambda: generalised_alpha(1.5),
        lambda: Damping(stiffness_proportional=-1.0),
        lambda: run(
            rv20e,
            table4,
            motion_of(rv20e.reducer, constant, constant, 1.0, 1),
            Damping(interfaces={"pin_contact": 1e-6}),
        ),
    ]
    for call in wrong:
        with pytest.raises(InputError, match="allowed is"):
            call()


def test_interfaces_with_play_cannot_be_damped(rv20e, table4):
    loose = EquivalentModel(replace(rv20e.reducer, clearances=Clearances(gear_mesh=5e-6)))
    errors = np.zeros((1, len(loose.columns)))
    motion = motion_of(loose.reducer, SpeedProfile.constant(10.0), SpeedProfile.constant(-5.0), 1e-3, 10)
    with pytest.raises(InputError, match="without play"):
        run(loose, errors, motion, Damping(interfaces={"gear_mesh": 1e-6}))
    assert (run(loose, errors, motion, Damping(stiffness_proportional=1e-6)).status == Status.CONVERGED).all()


def test_inertia_is_positive():
    given = {"sun": 1.0, "planet": 1.0, "disc": 1.0, "carrier": 1.0}
    with pytest.raises(InputError, match="carrier_moment"):
        Inertia(**given, planet_moment=1.0, disc_moment=1.0, carrier_moment=0.0)
