"""The contact solve: against an independent twin, against the energy, and under stress."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from studies.benchmarks.plain_rows import spring_groups
from tests.random_cases import Case, random_case, random_units, seeds, variations
from tests.validation_manual import shown
from tests.verification.dense_twin import dense_equilibrium, dense_model, logarithmic_response
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.solvers import LOGARITHMIC
from tolalloc.reducers.cycloid.solvers.pins import pin_force
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.equivalent.springs import Coordinates
from tolalloc.running.compiled import thread_count, use_threads

CASES = 200


def rotations(case: Case) -> np.ndarray:
    """The kernel's answer [unit, angle]; not a number where it found no equilibrium."""
    model = EquivalentModel(case.reducer, orders=case.orders)
    # The logarithmic law knows no disc tilt; the same case with another law has none.
    errors = np.array([[unit.get(column, 0.0) for column in model.columns] for unit in case.units])
    return model.equilibria(errors, case.torque, case.carrier_angle).transmission_error


@cache
def solved(seed: int) -> tuple[Case, np.ndarray]:
    case = random_case(seed)
    return case, rotations(case)


@pytest.mark.parametrize("seed", seeds(CASES))
def test_agrees_with_the_dense_twin(seed):
    case, found = solved(seed)
    for number, at in np.ndindex(found.shape):
        twin = dense_equilibrium(
            case.reducer, case.units[number], case.torque, float(case.carrier_angle[at]), case.orders
        )
        assert twin.imbalance < 1e-10  # so the twin is right, whatever the kernel says
        apart = abs(found[number, at] - twin.rotation)
        assert apart < 1e-6 * ARCSECOND, f"seed {seed}, unit {number}, angle {at}"
        shown("C1", apart / ARCSECOND)


@pytest.mark.parametrize("bending", [2e7, 5e8])
@pytest.mark.parametrize("law", ["constant", "table2", "logarithmic"])
def test_pins_that_bend_agree_with_the_dense_twin(law, bending):
    """Down to pins a hundred times softer than their contact; rotations differ from those of rigid pins."""
    case = random_case(2)
    stiffness = replace(case.reducer.stiffness, pin_contact_law=law, pin_bending=bending)
    bent = replace(case, reducer=replace(case.reducer, stiffness=stiffness))
    stiff = replace(bent, reducer=replace(bent.reducer, stiffness=replace(stiffness, pin_bending=np.inf)))
    found = rotations(bent)[0, 0]
    twin = dense_equilibrium(bent.reducer, bent.units[0], bent.torque, float(bent.carrier_angle[0]), bent.orders)
    assert twin.imbalance < 1e-10
    assert abs(found - twin.rotation) < 1e-6 * ARCSECOND
    assert abs(found - rotations(stiff)[0, 0]) > 1e-3 * ARCSECOND


@pytest.mark.slow
def test_what_the_twin_is_to_prove_occurs_and_matters():
    """In how many cases each kind occurs, and in what share of them it moves the answer by more than 0.001″."""
    changes: dict[str, list[float]] = defaultdict(list)
    for seed in range(CASES):
        case, found = solved(seed)
        for kind, other in variations(case):
            changes[kind].append(np.abs(rotations(other) - found).max() / ARCSECOND)
    wanted = {
        "play": (80, 0.95),
        "logarithmic": (55, 0.95),
        "table2": (55, 0.95),
        "disc tilt": (80, 0.6),  # some 0.1 µm of depth between middle and end of a tooth
        "single pins and teeth": (120, 0.95),
    }
    for kind, (count, share) in wanted.items():
        assert len(changes[kind]) >= count, kind
        assert np.mean(np.array(changes[kind]) > 1e-3) >= share, kind


@pytest.mark.parametrize("seed", range(10))
def test_the_twin_derives_its_forces_from_its_energy(seed):
    case, generator = random_case(seed), np.random.default_rng(seed)
    model = dense_model(case.reducer, case.units[0], case.torque, float(case.carrier_angle[0]), case.orders)
    q, direction = generator.normal(0, 1e-5, model.load.size), generator.normal(0, 1e-10, model.load.size)
    energy, gradient = ((of(q + direction) - of(q - direction)) / 2 for of in (model.energy, model.gradient))
    assert model.gradient(q) @ direction == pytest.approx(energy, rel=1e-8)
    expected = model.hessian(q) @ direction
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_the_logarithmic_law_is_hertz_line_contact_and_goes_on_straight():
    stiffness, pin, tooth = 1.3e9, 0.002, 0.009
    length, scale = (pin + tooth) * np.exp(2 / 3), 2 * stiffness
    largest = scale * length * np.exp(-2.0)
    forces = largest * np.array([1e-12, 1e-8, 1e-4, 0.1, 0.5, 1.0, 1.5, 3.0])
    curved = np.minimum(forces, largest)
    half_width = np.sqrt(4 * curved / scale * pin * tooth / (pin + tooth))  # Hertz, with scale = π·b·E*
    approach = curved / scale * (2 / 3 + np.log(16 * pin * tooth / (2 * half_width) ** 2))
    compressions = approach + (forces - curved) / scale
    twin = logarithmic_response(np.full(8, stiffness), np.full(8, length), compressions[:, np.newaxis])
    np.testing.assert_allclose(twin[1][:, 0], forces, rtol=1e-12)
    kernel = [pin_force(LOGARITHMIC, stiffness, np.log(length), 0.0, compression) for compression in compressions]
    np.testing.assert_allclose(kernel, np.stack([twin[1][:, 0], twin[2][:, 0, 0]], axis=1), rtol=1e-12)


def test_a_tooth_tilted_by_rounding_alone_carries_its_load(rv20e):
    """At θc = 0 the first pin's normal lies along x but for rounding, so a tilt about x lifts neither end."""
    case = Case(
        reducer=rv20e.reducer,
        orders=rv20e.orders,
        units=(dict.fromkeys(rv20e.columns, 0.0) | {"disc1.tilt.x": 1e-4, "each_pin.diameter.1": 2e-5},),
        torque=-1.0,
        carrier_angle=np.zeros(1),
    )
    twin = dense_equilibrium(case.reducer, case.units[0], case.torque, 0.0)
    assert twin.forces["pin contact"][0, 0] > 100
    assert rotations(case)[0, 0] == pytest.approx(twin.rotation, abs=1e-6 * ARCSECOND, rel=0)


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
    curves = rv20e.equilibria(np.zeros((1, len(rv20e.columns))), -1e-9)
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
    units, threads = random_units(table4, rv20e.columns, generator, 300), thread_count()
    try:
        results = []
        for count in (1, 2, 3, 4):
            use_threads(count)
            results.append(rv20e.extremes(units, -1.0))
    finally:
        use_threads(threads)
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
    """With all pins a third of a millimetre away the torque turns the carrier until pins resist."""
    model = EquivalentModel(rv20e.reducer, AngleSearch(coarse=8))
    errors = np.zeros((1, len(model.columns)))
    errors[0, model.columns.index("modification.equidistant")] = 3e-4
    far = model.equilibria(errors, -1.0)
    assert (far.status == Status.CONVERGED).all()
    assert np.abs(far.transmission_error).min() > 1000 * ARCSECOND


def test_a_torque_that_nothing_resists_is_a_status(rv20e, table4):
    """Carrier pushed against no pin at all: the disc pitch radius is the only lever, and it is taken away."""
    reducer = rv20e.reducer
    loose = EquivalentModel(
        replace(reducer, stiffness=replace(reducer.stiffness, pin_contact=0.0)), AngleSearch(coarse=8)
    )
    curves = loose.equilibria(table4, -1.0)
    assert (curves.status == Status.NOT_RESISTED).all()
    assert np.isnan(curves.transmission_error).all()


def test_what_a_model_of_small_displacements_cannot_mean_is_a_status(rv20e):
    """A journal that stands 2 mm off turns the output by a degree, and the solver finds an equilibrium."""
    errors = np.zeros((2, len(rv20e.columns)))
    errors[:, rv20e.columns.index("crank1.journal1.eccentricity.y")] = [1e-6, 2e-3]
    curve, extremes = rv20e.equilibria(errors, -1.0), rv20e.extremes(errors, -1.0)
    assert list(extremes.status) == [Status.CONVERGED, Status.OUT_OF_RANGE]
    assert np.isnan(extremes.largest[1])
    assert set(curve.status[0]) == {Status.CONVERGED}
    bad = curve.status[1] == Status.OUT_OF_RANGE
    assert bad.any()
    assert np.isnan(curve.transmission_error[1][bad]).all()
    assert np.abs(curve.transmission_error[1][~bad]).max(initial=0.0) <= rv20e.largest_rotation
    _, derivatives = rv20e.peak_to_peak_derivatives(errors, -1.0)
    assert list(derivatives.status) == [Status.CONVERGED, Status.OUT_OF_RANGE]
