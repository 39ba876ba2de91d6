"""The contact solve: against an independent twin, against the energy, and under stress."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.random_units import random_units
from tests.verification.dense_twin import dense_rotation
from tolalloc.equivalent.condensation import spring_groups
from tolalloc.equivalent.kinematics import Coordinates
from tolalloc.equivalent.status import Status
from tolalloc.equivalent.transmission_error import AngleSearch, EquivalentModel
from tolalloc.units import ARCSECOND


@pytest.mark.parametrize(("cranks", "discs"), [(2, 2), (3, 2), (2, 1), (3, 3)])
def test_agrees_with_the_dense_twin(rv20e, generator, cranks, discs):
    reducer = replace(rv20e.reducer, crank_count=cranks, disc_count=discs)
    model = EquivalentModel(reducer)
    errors = generator.normal(0.0, 2e-6, (8, len(model.columns)))
    angles = generator.uniform(0, 2 * np.pi, 3)
    for torque in (-1.0, -100.0):
        curves = model.curves(errors, torque, angles)
        assert (curves.status == Status.CONVERGED).all()
        for sample, row in enumerate(errors):
            named = dict(zip(model.columns, row, strict=True))
            twin = [dense_rotation(reducer, named, torque, angle) for angle in angles]
            np.testing.assert_allclose(curves.transmission_error[sample], twin, atol=1e-6 * ARCSECOND, rtol=0)


def test_stiffness_is_symmetric_and_turns_freely(rv20e):
    groups = spring_groups(rv20e.reducer, np.array([0.3, 2.0]))
    for group in groups:
        assert group.displacement.shape[2] == Coordinates(2, 2).count == 17
    bilateral = [group for group in groups if group.contact == "bilateral"]
    for angle in range(2):
        a = np.concatenate([group.displacement[angle] for group in bilateral])
        k = np.concatenate([group.stiffness[angle] for group in bilateral])
        stiffness = (a.T * k) @ a
        np.testing.assert_allclose(stiffness, stiffness.T, rtol=0, atol=1e-15 * np.abs(stiffness).max())
        values = np.linalg.eigvalsh(stiffness)
        assert values[0] == pytest.approx(0.0, abs=1e-9 * values[-1])
        assert values[1] > 1e-9 * values[-1]


def test_rigid_turn_of_the_whole_mechanism_strains_nothing(rv20e):
    """Carrier, discs and planets turned as the ideal gear train turns leave every spring at rest."""
    reducer, coordinates = rv20e.reducer, Coordinates(2, 2)
    angle = np.array([0.7])
    turn, cycloid = 1e-6, reducer.cycloid_stage
    q = np.zeros(coordinates.count)
    q[coordinates.carrier + 2] = turn
    crank_turn = -cycloid.disc_teeth * turn
    for disc in range(2):
        direction = -cycloid.disc_teeth * angle[0] + np.pi * disc
        first = coordinates.disc(disc)
        q[first : first + 2] = cycloid.eccentricity * crank_turn * np.array([-np.sin(direction), np.cos(direction)])
        q[first + 2] = turn
    for crank in range(2):
        position = angle[0] + np.pi * crank
        first = coordinates.planet(crank)
        q[first : first + 2] = reducer.crank_circle_radius * turn * np.array([-np.sin(position), np.cos(position)])
        q[first + 2] = crank_turn
    for group in spring_groups(reducer, angle):
        if group.name == "gear mesh":
            continue  # the sun would have to turn along, and it is held
        np.testing.assert_allclose(group.displacement[0] @ q, 0.0, atol=1e-13)


def test_perfect_reducer_has_no_error(rv20e):
    """With no errors and a torque that goes to zero, every pin touches and the transmission error vanishes."""
    curves = rv20e.curves(np.zeros((1, len(rv20e.columns))), -1e-9)
    assert np.ptp(curves.transmission_error) < 1e-9 * ARCSECOND
    groups = spring_groups(rv20e.reducer, curves.carrier_angle)
    assert np.abs(groups[-1].error @ np.zeros(len(groups[-1].columns))).max() == 0.0


def test_nominal_geometry_leaves_no_gap(rv20e):
    """Every pin centre stands one pin radius off the equidistant trochoid of every disc, exactly."""
    cycloid = rv20e.reducer.cycloid_stage
    angle = 0.4321
    for disc in range(2):
        direction = -cycloid.disc_teeth * angle + np.pi * disc
        centre = cycloid.eccentricity * np.array([np.cos(direction), np.sin(direction)])
        pins = 2 * np.pi * np.arange(cycloid.pin_count) / cycloid.pin_count
        pole = cycloid.pin_count * centre
        pin = cycloid.pin_circle_radius * np.stack([np.cos(pins), np.sin(pins)], axis=1)
        normal = (pole - pin) / np.linalg.norm(pole - pin, axis=1)[:, np.newaxis]
        # The trochoid traced in the disc by a pin: roll the housing's frame back by the disc's rotation.
        for k in range(cycloid.pin_count):
            crank = direction + np.linspace(-1e-4, 1e-4, 3)
            turned = angle - (crank - direction) / cycloid.disc_teeth
            moved = cycloid.eccentricity * np.stack([np.cos(crank), np.sin(crank)], axis=1)
            relative = pin[k] - moved
            back = turned - angle
            trace = np.stack(
                [
                    np.cos(back) * relative[:, 0] + np.sin(back) * relative[:, 1],
                    -np.sin(back) * relative[:, 0] + np.cos(back) * relative[:, 1],
                ],
                axis=1,
            )
            tangent = (trace[2] - trace[0]) / np.linalg.norm(trace[2] - trace[0])
            assert abs(tangent @ normal[k]) < 1e-6
        assert centre.shape == (2,)


def test_random_units_all_converge_with_the_same_bits_on_any_number_of_threads(rv20e, table4, generator):
    import numba

    units = random_units(table4, rv20e.columns, generator, 300)
    threads = numba.get_num_threads()
    try:
        results = []
        for count in {1, min(2, threads), threads}:
            numba.set_num_threads(count)
            results.append(rv20e.extremes(units, -1.0))
    finally:
        numba.set_num_threads(threads)
    for result in results:
        assert (result.status == Status.CONVERGED).all()
        assert result.residual.max() <= 1e-9
        np.testing.assert_array_equal(result.peak_to_peak, results[0].peak_to_peak)
    alone = [rv20e.extremes(units[i : i + 1], -1.0).peak_to_peak[0] for i in (0, 57, 299)]
    np.testing.assert_array_equal(alone, results[0].peak_to_peak[[0, 57, 299]])


def test_a_bad_sample_is_a_status_and_leaves_its_neighbours_alone(rv20e, table4):
    units = np.repeat(table4, 3, axis=0)
    for column in (4, len(rv20e.columns) - 1):
        units[1, :] = table4
        units[1, column] = np.nan
        result = rv20e.extremes(units, -1.0)
        assert list(result.status) == [Status.CONVERGED, Status.NOT_FINITE, Status.CONVERGED]
        assert np.isnan(result.peak_to_peak[1])
        assert result.peak_to_peak[0] == result.peak_to_peak[2]


def test_far_pins_are_reached_from_a_cold_start(rv20e):
    """With all pins a millimetre away the torque turns the carrier until pins resist, and the solve finds that."""
    model = EquivalentModel(rv20e.reducer, AngleSearch(coarse=8))
    errors = np.zeros((1, len(model.columns)))
    errors[0, model.columns.index("modification.equidistant")] = 1e-3
    far = model.curves(errors, -1.0)
    assert (far.status == Status.CONVERGED).all()
    assert np.abs(far.transmission_error).min() > 1000 * ARCSECOND


def test_a_torque_that_nothing_resists_is_a_status(rv20e, table4):
    """Carrier pushed against no pin at all: the disc pitch radius is the only lever, and it is taken away."""
    reducer = rv20e.reducer
    loose = EquivalentModel(
        replace(reducer, stiffness=replace(reducer.stiffness, pin_contact=0.0)), AngleSearch(coarse=8)
    )
    curves = loose.curves(table4, -1.0)
    assert (curves.status == Status.NOT_RESISTED).all()
    assert np.isnan(curves.transmission_error).all()
