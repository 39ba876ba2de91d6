"""What engineers read off an equilibrium: forces, orders, lost motion, both directions, attribution."""

from __future__ import annotations

from dataclasses import replace
from math import cos

import numpy as np
import pytest

from studies.benchmarks.plain_rows import spring_groups
from tests.builders import LINEAR_STAGE, order_spectrum, reducer_file, unit_with
from tests.random_cases import random_case, seeds
from tests.verification.dense_twin import dense_equilibrium
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.hysteresis import BACKLASH, DRAWN, both_directions, hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import (
    Solved,
    attribute,
    fitted_waves,
    forces,
    load_share,
    outputs_of,
    turn_orders,
)
from tolalloc.reducers.equivalent.perfect import exact_unit
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


def amplitudes(model: EquivalentModel, orders, angles: int) -> np.ndarray:
    """Return amplitudes of an exact unit's orders by Fourier's sum over another number of angles [arcsec]."""
    turn = 2 * np.pi * np.arange(angles) / angles
    curve = model.equilibria(exact_unit(model), -1.0, turn).transmission_error[0] / ARCSECOND
    return np.abs(np.exp(-1j * np.outer(orders, turn)) @ curve * 2 / angles)


def named(model: EquivalentModel, errors: np.ndarray, angles: int | None = None) -> dict[float, float]:
    """Return the main orders with their amplitudes [arcsec]."""
    return {order: size / ARCSECOND for order, size, _ in turn_orders(model, errors, -1.0, angles).main(8)}


@pytest.mark.slow
def test_orders_of_a_single_stage_are_those_of_its_pins_and_output_pins():
    """8 output pins meet 30 pins 240 times, 29 teeth 870 times: all else are sums of both, multiples of 30."""
    model = EquivalentModel(load_reducer(LINEAR_STAGE))
    found = named(model, exact_unit(model))
    assert list(found)[:5] == [240, 480, 870, 720, 960]
    assert list(found.values())[:2] == pytest.approx([1.485, 0.351], abs=5e-4)
    assert [found[720], found[960]] == pytest.approx([0.127, 0.050], abs=5e-4)
    assert not any(order % 30 for order in found)
    np.testing.assert_allclose(amplitudes(model, list(found), 5003)[:5], list(found.values())[:5], rtol=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["rv20e", "rv40e_xi2015", pytest.param("rv80e", marks=pytest.mark.slow)])
def test_exact_rv_reducers_make_no_order_below_that_of_pins_and_teeth(preset):
    """At 936 angles 1,560 folds back onto 312 = 2·936 − 1,560, 4,680 at 6,552 angles onto 1,872."""
    model = EquivalentModel(load_reducer(preset))
    assert list(named(model, exact_unit(model))) == [1560]
    coarse = turn_orders(model, exact_unit(model), -1.0, 936)
    assert coarse.main(8) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (("count = 8", "count = 7"), (870, 420)),
        (("count = 8", "count = 9"), (870, 540)),
        (("disc_count = 2", "disc_count = 1"), (870, 240)),
        (("disc_count = 2", "disc_count = 3"), (870, 720)),
    ],
)
def test_every_order_of_exact_parts_is_made_of_what_their_contacts_make(tmp_path, line, expected):
    design = load_reducer(reducer_file(tmp_path / "own.reducer.toml", "cd29", line))
    assert design.contact_orders == expected
    model = EquivalentModel(design)
    found = named(model, exact_unit(model))
    assert found
    assert not any(order % np.gcd(*expected) for order in found)


@pytest.mark.parametrize("angles", [936, pytest.param(None, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("column", "error", "order"),
    [
        ("pinion.eccentricity.x", 10e-6, 2085 / 19),
        ("centre.eccentricity.y", 10e-6, 695 / 19),
        ("sun.pitch.cos2", 5e-6, 2 * 676 / 19),
    ],
)
def test_errors_of_gears_that_one_turn_cuts_are_one_wave_of_the_size_that_the_lever_says(column, error, order, angles):
    """10 µm of the pinion turn the output by E/(r_b4·i), 5 µm of the sun's second pitch wave by A/(r_1·i)."""
    design = load_reducer("rv27c")
    model = EquivalentModel(design)
    pitch_radius = design.sun_base_radius / cos(design.gears.pressure_angle)
    radius = pitch_radius if column.startswith("sun") else design.centre_gear.base_radius
    size = error / (radius * design.sun_ratio) / ARCSECOND
    (first, amplitude), *others = named(
        model, exact_unit(model) + error * (np.array(model.columns) == column), angles
    ).items()
    assert first == pytest.approx(order, abs=1e-12)
    assert amplitude == pytest.approx(size, rel=1e-3)
    assert size == pytest.approx(1.3335, abs=5e-4) or column.startswith("sun")
    assert [other for other, _ in others] == ([] if angles else [2652])  # 52 pins, 51 teeth


def test_what_a_source_adds_to_an_order_of_an_open_turn_is_all_of_it():
    model = EquivalentModel(load_reducer("rv27c"))
    errors = exact_unit(model) + 10e-6 * (np.array(model.columns) == "pinion.eccentricity.x")
    orders = turn_orders(model, errors, -1.0, 936)
    found = attribute(model, errors, -1.0, orders)
    at = int(np.argmax(found.amplitude))
    assert found.order[at] == pytest.approx(109.737, abs=5e-4)
    assert found.share[found.sources.index("pinion.eccentricity"), at] == pytest.approx(found.amplitude[at], rel=1e-3)


@pytest.mark.parametrize("orders", [(1.0, 2.0, 39.0), (35.579, 36.579, 109.737), (3.5, 4.0)])
def test_fitted_waves_are_those_that_made_the_curve(orders, generator):
    angle = np.sort(generator.uniform(0.0, 2 * np.pi, 700))
    waves = generator.normal(size=(2, len(orders))) + 1j * generator.normal(size=(2, len(orders)))
    curve = 7.0 + np.real(waves @ np.exp(1j * np.outer(orders, angle)))
    np.testing.assert_allclose(fitted_waves(angle, curve, np.array(orders)), waves, atol=1e-9)


@pytest.mark.parametrize(
    ("preset", "order", "angles", "held"),
    [
        ("rv20e", 312, 936, False),  # 2·936 − 1,560
        ("rv20e", 120, 720, False),  # 1,560 − 2·720
        ("rv20e", 120, 936, True),
        ("rv20e", 500, 936, False),  # beyond a half
        ("rv27c", 156, 936, False),  # 3·936 − 2,652
        ("cd29", 66, 936, False),  # 936 − 870
        ("cd29", 24, 936, False),  # 4·240 − 936
        ("cd29", 870, 3744, True),
    ],
)
def test_angles_hold_orders_onto_which_no_contact_folds(preset, order, angles, held):
    assert load_reducer(preset).resolves(order, angles) == held


def test_pins_in_contact_are_counted_disc_by_disc(rv20e, table4):
    solved = Solved.of(rv20e.equilibria(table4, -167.0))
    found = {name: value(solved)[0] for name, (_, value) in outputs_of(rv20e.reducer).items()}
    assert found["pins in contact on a disc, most"] <= rv20e.reducer.cycloid_stage.pin_count
    both = solved.equilibria.pins_in_contact[0]
    assert found["pins in contact on a disc, least"] <= both.min() / 2
    assert both.max() / 2 <= found["pins in contact on a disc, most"] < both.max()
