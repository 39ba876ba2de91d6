"""What engineers read off an equilibrium: forces, orders, lost motion, both directions, attribution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import unit_with
from tests.random_cases import random_case, seeds
from tests.verification.dense_twin import dense_equilibrium
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.condensation import spring_groups
from tolalloc.reducers.equivalent.hysteresis import BACKLASH, DRAWN, both_directions, hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved, attribute, forces, load_share, order_spectrum, outputs_of
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.equivalent.springs import Coordinates
from tolalloc.reducers.reducer.design import Clearances
from tolalloc.reducers.reducer.files import load_reducer

INTERFACES = {
    "gear mesh": "gear_mesh",
    "sun support": "sun_support",
    "crank–disc bearing": "crank_disc_bearing",
    "crank–carrier bearing": "crank_carrier_bearing",
    "carrier bearing": "carrier_bearing",
}


@pytest.mark.parametrize("seed", seeds(40))
def test_forces_are_those_of_the_dense_twin(seed):
    case = random_case(seed)
    model = EquivalentModel(case.reducer, orders=case.orders)
    errors = np.array([[case.units[0][name] for name in model.columns]])
    found = forces(model.equilibria(errors, case.torque, case.carrier_angle[:1]))
    twin = dense_equilibrium(case.reducer, case.units[0], case.torque, float(case.carrier_angle[0]), case.orders).forces
    largest = max(np.abs(force).max() for force in twin.values())
    np.testing.assert_allclose(found.pins.ravel(), twin["pin contact"].ravel(), rtol=0, atol=1e-8 * largest)
    for name, interface in INTERFACES.items():
        expected = np.linalg.norm(twin[name], axis=1) if interface != "gear_mesh" else np.abs(twin[name].ravel())
        if name in ("sun support", "carrier bearing"):
            expected = np.atleast_1d(np.linalg.norm(twin[name]))
        elif "bearing" in name:
            expected = np.linalg.norm(twin[name].reshape(-1, 2), axis=1)
        np.testing.assert_allclose(found.of(interface)[0, 0], expected, rtol=0, atol=1e-8 * largest)


def test_every_output_of_a_solve_is_one_number_per_sample(rv20e, table4):
    solved = Solved.of(rv20e.equilibria(np.repeat(table4, 3, axis=0), -10.0, np.linspace(0, 1, 7)))
    for name, (_, value) in outputs_of(rv20e.reducer).items():
        assert value(solved).shape == (3,), name
        assert np.isfinite(value(solved)).all(), name
    np.testing.assert_allclose(load_share(solved.forces.pins).sum(axis=1), 1.0, rtol=1e-12)


def test_an_angle_without_equilibrium_has_no_forces(rv20e, table4):
    units = np.repeat(table4, 2, axis=0)
    units[1, 3] = np.nan
    found = forces(rv20e.equilibria(units, -1.0, np.linspace(0, 1, 5)))
    assert np.isfinite(found.pins[0]).all()
    assert np.isnan(found.pins[1]).all()


def test_orders_have_amplitude_and_phase():
    angle = 2 * np.pi * np.arange(200) / 200
    orders = order_spectrum((3.0 * np.cos(5 * angle + 0.7) + 1.5 * np.cos(39 * angle - 2.0))[np.newaxis])
    (first, amplitude, phase), (second, other, lag) = orders.main(2)
    assert (first, second) == (5, 39)
    np.testing.assert_allclose([amplitude, phase, other, lag], [3.0, 0.7, 1.5, -2.0], atol=1e-12)


@pytest.mark.parametrize("preset", ["rv20e_liu2020", "rv40e_xi2015", "rv80e", "bx40e"])
def test_backlash_is_the_first_gap_that_closes_over_its_lever(preset):
    """Sun held and no load: a pin's gap closes by e·zp·i/(i−1)·|sin a| per radian of the carrier, on either side.

    All with the printed stiffness of liu2020, as a believable one yields by 0.07″ at the torque of backlash.
    """
    reducer = replace(load_reducer(preset), parts=(), stiffness=load_reducer("rv20e_liu2020").stiffness)
    model, stage = EquivalentModel(reducer), reducer.cycloid_stage
    errors = unit_with(model)
    angles = np.array([0.1, 0.11, 1.0, 4.0])
    contact = spring_groups(reducer, angles)[-1]
    gap = -contact.error @ np.array([reducer.modification.deviations.get(name, 0.0) for name in contact.columns])
    coordinates = Coordinates(reducer.crank_count, reducer.disc_count)
    turn = [coordinates.disc(disc) + 2 for disc in range(reducer.disc_count)]
    lever = contact.displacement[:, :, turn].sum(axis=2) / stage.disc_pitch_radius  # −sin a
    lever = lever * stage.eccentricity * stage.pin_count * reducer.ratio / (reducer.ratio - 1)
    free = sum(np.where(side * lever > 1e-9, gap / np.abs(lever), np.inf).min(axis=1) for side in (1, -1))
    loop = hysteresis_loop(model, errors, angles, DRAWN)
    np.testing.assert_allclose(loop.width(BACKLASH)[0], free, rtol=0, atol=0.01 * ARCSECOND)
    assert loop.lost_motion[0] > loop.backlash[0] > 0
    assert (np.diff(loop.twist, axis=1) > 0).all()  # more torque, more twist


def test_both_directions_differ_by_the_width_of_the_loop(rv20e, table4):
    angles = np.array([0.3, 2.0])
    loop = hysteresis_loop(rv20e, table4, angles)
    torque = rv20e.reducer.load.rated_torque
    forward, backward = both_directions(rv20e, table4, torque, angles)
    np.testing.assert_allclose(backward - forward, loop.width(1.0), atol=1e-15)


@pytest.mark.parametrize("play", [0.0, 2e-6])
def test_contributions_sum_to_the_transmission_error(rv20e, table4, play):
    reducer = replace(rv20e.reducer, clearances=Clearances(crank_disc_bearing=play, gear_mesh=2 * play))
    model = EquivalentModel(reducer, AngleSearch(coarse=117))
    unit = dict(zip(rv20e.columns, table4[0], strict=True)) | {"disc1.tilt.x": 1e-4, "mesh1.deviation": 3e-6}
    errors = np.array([[unit.get(name, 0.0) for name in model.columns]])
    attribution, whole = attribute(model, errors, -10.0), model.equilibria(errors, -10.0).transmission_error[0]
    np.testing.assert_allclose(attribution.contribution.sum(axis=0), whole, rtol=0, atol=1e-6 * ARCSECOND)
    np.testing.assert_allclose(attribution.share.sum(axis=0), attribution.amplitude, rtol=0, atol=1e-15)
    assert ("nominal clearance" in attribution.sources) == (play > 0)
    assert {"torque", "modification.shift", "disc1.tilt", "mesh1.deviation"} <= set(attribution.sources)


def test_what_is_not_proportional_is_listed_by_itself(rv20e, table4):
    reducer = replace(rv20e.reducer, stiffness=replace(rv20e.reducer.stiffness, pin_contact_law="logarithmic"))
    model = EquivalentModel(reducer, AngleSearch(coarse=36))
    errors = np.array([[dict(zip(rv20e.columns, table4[0], strict=True))[name] for name in model.columns]])
    attribution, whole = attribute(model, errors, -10.0), model.equilibria(errors, -10.0).transmission_error[0]
    np.testing.assert_allclose(attribution.contribution.sum(axis=0), whole, rtol=0, atol=1e-6 * ARCSECOND)
    curvature = attribution.contribution[attribution.sources.index("curvature of the contact law")]
    assert 0 < np.abs(curvature).max() < 0.2 * np.abs(whole).max()
