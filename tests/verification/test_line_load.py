"""Line load along tilted teeth: the closed forms against the kernel's force law and against plain integration."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from tests.random_cases import random_reducer
from tolalloc.exceptions import InputError
from tolalloc.numeric import reducer as design_of
from tolalloc.reading.units import ARCSECOND, MEGAPASCAL, MICROMETRE, MILLIMETRE
from tolalloc.reducers import TORSIONAL_STIFFNESS
from tolalloc.reducers.cycloid.line_contact import LineContact
from tolalloc.reducers.cycloid.loaded_contact import assess, crowned_contact, peak_pressure
from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.cycloid.solvers.pins import pin_force
from tolalloc.reducers.cycloid.tooth_profile import normals, path_curvature
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved, contact_pattern, line_contact, unit_pressure
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reducers.response.outputs import OutputsResponse, requirements_of

TORQUE = -100.0


def whole_width(contact):
    """Positions at the middle of 20 000 slices of the width, and the width of a slice [m]."""
    count = 20_000
    return (np.arange(count) + 0.5) / count * contact.face_width - contact.face_width / 2, contact.face_width / count


def test_the_closed_forms_are_those_of_slices_pressed_to_their_own_depth(generator):
    stiffness, width = 2e9, 12e-3
    for _ in range(200):
        slope, compression = generator.normal(0, 1e-3), generator.normal(0, 5e-6)
        force, _ = pin_force(LINEAR, stiffness, 0.0, 0.5 * width * abs(slope), compression)
        contact = LineContact(
            force=np.array([force]), stiffness=np.array([stiffness]), slope=np.array([slope]), face_width=width
        )
        position, slice_width = whole_width(contact)
        load = stiffness / width * np.maximum(compression + slope * position, 0.0)
        np.testing.assert_allclose(contact.line_load(position)[0], load, rtol=1e-9, atol=1e-9 * load.max() + 1e-6)
        kink = stiffness / width * abs(slope) * slice_width**2  # of the slice in which the contact ends
        assert force == pytest.approx(load.sum() * slice_width, rel=1e-9, abs=kink)
        deepest = max(compression + 0.5 * width * abs(slope), 0.0)
        assert contact.peak[0] == pytest.approx(stiffness / width * deepest, rel=1e-9, abs=1e-6)
        assert contact.deformation[0] == pytest.approx(deepest, rel=1e-9, abs=1e-15)


def test_both_forms_of_the_peak_meet_where_one_end_just_lifts():
    stiffness, width, slope = 2e9, 12e-3, 1e-4
    lifting = stiffness * width * slope / 2
    forces = lifting * np.array([1 - 1e-12, 1.0, 1 + 1e-12])
    contact = LineContact(force=forces, stiffness=np.full(3, stiffness), slope=np.full(3, slope), face_width=width)
    np.testing.assert_allclose(contact.peak, np.sqrt(2 * stiffness * slope * lifting / width), rtol=1e-11)
    np.testing.assert_allclose(contact.peak, lifting / width + stiffness * slope / 2, rtol=1e-11)


def tilted(model, generator, samples=4):
    """Errors of units with tilted discs, one of them with no tilt at all."""
    errors = np.zeros((samples, len(model.columns)))
    discs = range(1, model.reducer.disc_count + 1)
    tilts = [model.columns.index(f"disc{disc}.tilt.{axis}") for disc in discs for axis in "xy"]
    errors[1:, tilts] = generator.normal(0, 300 * ARCSECOND, (samples - 1, len(tilts)))
    return errors


def linear(reducer, law, bending):
    return replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law=law, pin_bending=bending))


@pytest.mark.parametrize(("law", "bending"), [("constant", np.inf), ("table2", 3e8)])
def test_the_load_along_the_width_adds_up_to_the_force_of_the_kernel(law, bending, generator):
    model = EquivalentModel(linear(random_reducer(generator), law, bending))
    errors, angles = tilted(model, generator), np.array([0.0, 0.3, 2.0])
    solved = Solved.of(model.equilibria(errors, TORQUE, angles))
    assert not solved.equilibria.status.any()
    contact = line_contact(solved.equilibria, solved.forces)
    lifted = 0
    for place in np.ndindex(contact.force.shape[:-1]):
        own = contact.of(place)
        position, slice_width = whole_width(own)
        load = own.line_load(position)
        np.testing.assert_allclose(load.sum(axis=1) * slice_width, own.force, rtol=1e-5, atol=1e-3)
        assert load.max() <= own.peak.max()
        lifted += np.count_nonzero((load.min(axis=1) == 0) & (own.force > 0))
    assert lifted > 10


def test_a_tooth_presses_deepest_on_the_side_to_which_its_tilt_moves_it(rv20e):
    """The depth along the width is that of the pin rows when the disc is displaced as the tilt displaces its slices."""
    errors, angles = np.zeros((1, len(rv20e.columns))), np.array([0.4])
    gamma = {"x": 70 * ARCSECOND, "y": -40 * ARCSECOND}
    for axis, value in gamma.items():
        errors[0, rv20e.columns.index(f"disc2.tilt.{axis}")] = value
    solved = Solved.of(rv20e.equilibria(errors, TORQUE, angles))
    contact, stage = line_contact(solved.equilibria, solved.forces), rv20e.reducer.cycloid_stage
    assert not contact.slope[0, 0, 0].any()
    # A turn (γx, γy) moves a point at height z by z·(γy, −γx); a disc moved along n goes out of the pin.
    turn = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    moved_x, moved_y = turn @ [gamma["y"], -gamma["x"]]
    crank = -stage.disc_teeth * 0.4 + np.pi
    pin_angle = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count - crank
    into = normals(stage.shortening, pin_angle)
    normal = crank + np.arctan2(into.towards_tangent, into.towards_crank)
    expected = -(moved_x * np.cos(normal) + moved_y * np.sin(normal))
    np.testing.assert_allclose(contact.slope[0, 0, 1], expected, atol=1e-15)


def test_pressure_of_an_even_load_is_hertz_s(rv20e):
    solved = Solved.of(rv20e.equilibria(np.zeros((1, len(rv20e.columns))), TORQUE, np.array([0.1])))
    stage = rv20e.reducer.cycloid_stage
    pins = solved.forces.pins[0, 0, 0]
    found = unit_pressure(solved.equilibria)[0, 0] * np.sqrt(solved.line_load[0, 0, 0])
    pin_angle = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count + stage.disc_teeth * 0.1
    expected = peak_pressure(stage, rv20e.reducer.contact_modulus, pin_angle, pins)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def stress(model, errors):
    fixed = dict(zip(model.columns, errors, strict=True))
    response = OutputsResponse(
        kernel=KernelResponse(model=model, torque=TORQUE, columns=(), fixed=fixed),
        readings=requirements_of(model.reducer),
    )
    return dict(zip(response.outputs, response(np.empty((1, 0))).values[0], strict=True))


def test_a_tilted_disc_loads_one_end_more_and_a_level_one_evenly(rv20e, table4):
    width, level = rv20e.reducer.cycloid_stage.face_width / MILLIMETRE, stress(rv20e, table4[0])
    force, load = "largest pin force, rated torque [N]", "largest line load, rated torque [N/mm]"
    assert level[load] == pytest.approx(level[force] / width, rel=1e-14)
    errors = table4[0].copy()
    errors[rv20e.columns.index("disc1.tilt.x")] = 100 * ARCSECOND
    tilted = stress(rv20e, errors)
    assert tilted[load] > 1.1 * tilted[force] / width
    rated = -abs(rv20e.reducer.load.rated_torque)
    solved = Solved.of(rv20e.equilibria(errors[np.newaxis], rated, TURN_ANGLES))
    own = solved.line_load
    assert tilted[load] == pytest.approx(own.max() * MILLIMETRE, rel=1e-12)
    pressure, even = (unit_pressure(solved.equilibria) * np.sqrt(q) for q in (own, solved.forces.pins / width * 1e3))
    assert tilted["peak pressure, rated torque [MPa]"] == pytest.approx(pressure.max() / MEGAPASCAL, rel=1e-12)
    assert (pressure[0, :, 0] >= even[0, :, 0]).all()
    np.testing.assert_allclose(pressure[0, :, 1], even[0, :, 1], rtol=1e-12)


def test_the_logarithmic_law_spreads_every_force_evenly(rv20e):
    model = EquivalentModel(linear(rv20e.reducer, "logarithmic", np.inf))
    solved = Solved.of(model.equilibria(np.zeros((1, len(model.columns))), TORQUE, np.array([0.1, 0.2])))
    width = rv20e.reducer.cycloid_stage.face_width
    np.testing.assert_array_equal(solved.line_load, solved.forces.pins / width)


def test_a_contact_pattern_lies_where_the_line_load_is_largest(rv20e, generator):
    errors = tilted(rv20e, generator)[1]
    pattern = contact_pattern(rv20e, errors, TORQUE, disc=2)
    solved = Solved.of(rv20e.equilibria(errors[np.newaxis], TORQUE))
    peak = solved.line_load[0, :, 1].max()
    assert pattern.line_load.max() == pytest.approx(peak, rel=1e-12)
    again = contact_pattern(rv20e, errors, TORQUE, disc=2, carrier_angle=pattern.carrier_angle, positions=401)
    np.testing.assert_allclose(again.force, pattern.force, rtol=1e-6, atol=1e-6)
    added = np.trapezoid(again.line_load, again.position, axis=1)
    np.testing.assert_allclose(added, again.force, rtol=1e-3, atol=1.0)
    assert (pattern.deformation > 0).tolist() == (pattern.force > 0).tolist()
    assert pattern.pressure.max() / MEGAPASCAL > 100


@pytest.mark.parametrize("disc", [0, 3])
def test_a_contact_pattern_knows_the_discs_of_its_reducer(rv20e, table4, disc):
    with pytest.raises(InputError, match="allowed is 1 to 2"):
        contact_pattern(rv20e, table4[0], TORQUE, disc=disc)


def test_a_contact_pattern_needs_a_law_that_knows_the_load_along_the_width(rv20e, table4):
    model = EquivalentModel(linear(rv20e.reducer, "logarithmic", np.inf))
    with pytest.raises(InputError, match="allowed is constant or table2"):
        contact_pattern(model, np.zeros(len(model.columns)), TORQUE)


def crowned_slices(force, slope, crowning, stiffness=2e9, width=12e-3):
    force, slope = np.atleast_1d(force).astype(float), np.atleast_1d(slope).astype(float)
    even = np.full_like(force, stiffness)
    return LineContact(force=force, stiffness=even, slope=slope, face_width=width, crowning=crowning)


def test_crowned_and_tilted_teeth_carry_what_quadrature_gives(generator):
    stiffness, width, kinds = 2e9, 12e-3, set()
    for _ in range(300):
        crowning = 10.0 ** generator.uniform(-8, -4)
        slope = generator.choice([0.0, 1.0, -1.0]) * 10.0 ** generator.uniform(-6, -2.5)
        bend, end = 4 * crowning / width**2, width / 2
        deepest = float(np.clip(slope / (2 * bend), -end, end))
        middle = 10.0 ** generator.uniform(-8, -5) - slope * deepest + bend * deepest**2

        def load(z, middle=middle, slope=slope, bend=bend):
            return stiffness / width * max(middle + slope * z - bend * z**2, 0.0)

        root = np.sqrt(complex(slope**2 + 4 * bend * middle)).real
        lifts = [2 * middle / (root - slope) if slope < 0 else (slope + root) / (2 * bend)]
        lifts += [-2 * middle / (root + slope) if slope >= 0 else (slope - root) / (2 * bend)]
        inside = sorted(z for z in lifts if -end < z < end)
        edges = [-end, *inside, end]
        force = sum(quad(load, *piece, epsrel=1e-12, epsabs=0)[0] for piece in pairwise(edges))
        kinds.add((len(inside), abs(deepest) < end))
        own = crowned_slices(force, slope, crowning)
        assert own.peak[0] == pytest.approx(load(deepest), rel=1e-9)
        assert own.deformation[0] == pytest.approx(load(deepest) * width / stiffness, rel=1e-9)
        places = np.linspace(-end, end, 41)
        found = own.line_load(places)[0]
        np.testing.assert_allclose(found, [load(z) for z in places], rtol=1e-9, atol=1e-9 * own.peak[0])
    assert kinds == {(0, True), (1, True), (2, True), (0, False), (1, False)}


def test_crowned_teeth_that_are_not_tilted_have_closed_forms():
    stiffness, crowning = 2e9, 6e-6
    touching = 2 / 3 * stiffness * crowning
    force = touching * np.array([1e-12, 1e-4, 0.5, 1.0, 3.0])
    free = (1.5 * force / stiffness) ** (2 / 3) * crowning ** (1 / 3)
    depth = np.where(force <= touching, free, force / stiffness + crowning / 3)
    np.testing.assert_allclose(crowned_slices(force, np.zeros(5), crowning).deformation, depth, rtol=1e-12)
    # However much is taken off, the load stands on the middle and grows with the third root of it.
    more = [crowned_slices(force[1], 0.0, scale * 1e-4).peak[0] for scale in (1.0, 8.0)]
    assert more[1] == pytest.approx(2 * more[0], rel=1e-12)


@pytest.mark.parametrize("slope", [0.0, 1e-5, -3e-4])
def test_without_crowning_the_line_load_is_the_tilted_one_s(slope):
    force, places = np.array([0.0, 50.0, 900.0, np.nan]), np.linspace(-6e-3, 6e-3, 7)
    tilted, nearly = (crowned_slices(force, np.full(4, slope), crowning) for crowning in (0.0, 1e-18))
    np.testing.assert_allclose(nearly.peak, tilted.peak, rtol=1e-9)
    np.testing.assert_allclose(nearly.line_load(places), tilted.line_load(places), rtol=1e-9, atol=1e-5)
    assert crowned_slices(force, np.full(4, slope), 5e-6).peak[0] == 0.0


def hertz_ellipse(force, modulus, across, along):
    """Peak pressure of bodies of two relative radii, Johnson (1985), section 4.2; along the longer."""
    small, large = 0.5 / along, 0.5 / across

    def integrals(ratio):
        return ellipkm1(ratio**-2), ellipe(1 - ratio**-2)

    def missed(ratio):
        first, second = integrals(ratio)
        return (ratio**2 * second - first) / (first - second) - large / small

    ratio = brentq(missed, 1.001, 1e4, xtol=1e-10)
    first, second = integrals(ratio)
    shape = np.sqrt((ratio**2 * second - first) * (first - second)) / (ratio**2 - 1)
    half = (1.5 * force * shape / (np.pi * ratio * modulus * np.sqrt(small * large))) ** (1 / 3)
    return 1.5 * force / (np.pi * ratio * half**2)


@pytest.mark.parametrize(("law", "low", "high"), [("logarithmic", 0.93, 0.99), ("constant", 1.25, 1.34)])
def test_pressure_of_crowned_teeth_beside_hertz_s_ellipse(rv20e, law, low, high):
    reducer, angle = linear(rv20e.reducer, law, 1e7), np.full(3, np.pi)
    stage, forces = reducer.cycloid_stage, np.array([100.0, 200.0, 400.0])
    bend = path_curvature(stage, angle)[0]
    across = 1 / (1 / stage.pin_radius - bend / (1 + stage.pin_radius * bend))
    for crowning in (5e-6, 10e-6, 20e-6):
        own = replace(reducer, cycloid_stage=replace(stage, crowning=crowning))
        peak = crowned_contact(own, angle, forces, np.zeros(3)).peak
        found = peak_pressure(stage, reducer.contact_modulus, angle, peak * stage.face_width)
        along = stage.face_width**2 / (8 * crowning)
        expected = [hertz_ellipse(force, reducer.contact_modulus, across, along) for force in forces]
        assert low < (found / expected).min() <= (found / expected).max() < high
        if law == "constant":  # as the ellipse, with the third root of the force
            np.testing.assert_allclose(found[1:] / found[:-1], 2 ** (1 / 3), rtol=1e-12)


def crowned(reducer, micrometres):
    return replace(reducer, cycloid_stage=replace(reducer.cycloid_stage, crowning=micrometres * MICROMETRE))


@pytest.mark.parametrize(("law", "bending"), [("table2", 3e8), ("logarithmic", 3e8)])
def test_a_crowned_model_keeps_its_forces_and_balances_them_along_the_width(law, bending, generator):
    reducer = linear(random_reducer(generator), law, bending)
    angles, plain, own = np.array([0.0, 0.3]), EquivalentModel(reducer), EquivalentModel(crowned(reducer, 4))
    errors = tilted(plain, generator) if law == "table2" else np.zeros((1, len(plain.columns)))
    even, solved = (Solved.of(model.equilibria(errors, TORQUE, angles)) for model in (plain, own))
    np.testing.assert_array_equal(solved.forces.pins, even.forces.pins)
    contact = line_contact(solved.equilibria, solved.forces)
    for place in np.ndindex(contact.force.shape[:-1]):
        position, slice_width = whole_width(contact.of(place))
        load = contact.of(place).line_load(position)
        np.testing.assert_allclose(load.sum(axis=1) * slice_width, contact.force[place], rtol=1e-5, atol=1e-3)
    peak = solved.line_load
    np.testing.assert_array_equal(peak, contact.peak)
    carries = contact.force > 0
    assert (peak[carries] > contact.force[carries] / contact.face_width).all() and not peak[~carries].any()


def test_crowning_raises_the_pressure_of_a_loaded_contact_and_nothing_else():
    design = load_reducer("rv40e_xi2015")
    even, none, five = (assess(crowned(design, at), 572.0, phases=2) for at in (0, 1e-9, 5))
    for name in ("linear", "single", "together"):
        own = getattr(five, name)
        np.testing.assert_array_equal(own.force, getattr(even, name).force)
        np.testing.assert_allclose(getattr(none, name).pressure, getattr(even, name).pressure, rtol=1e-6)
        carries = own.force > 0
        assert 1.1 < own.pressure.max() / getattr(even, name).pressure.max() < 1.5
        assert (own.pressure[carries] > getattr(even, name).pressure[carries]).all()


@pytest.mark.slow
def test_what_crowning_would_change_as_a_spring_in_series():
    """The figures that theory and assumptions state for what the equilibrium does not feel."""
    design = crowned(load_reducer("rv20e"), 5)
    pins = assess(design, design.load.rated_torque, phases=8).together.force
    force = np.array([(pins**2).sum() / pins.sum()])
    contact = crowned_contact(design, np.array([1.0]), force, np.zeros(1))
    more = contact.deformation - force / contact.stiffness
    softer = replace(design, stiffness=replace(design.stiffness, pin_bending=float((force / more)[0])))
    models = [EquivalentModel(reducer) for reducer in (design, softer)]
    errors = np.array([design.modification.deviations.get(column, 0.0) for column in models[0].columns])
    even, own = (stress(model, errors) for model in models)
    names = TORSIONAL_STIFFNESS, "largest pin force, rated torque [N]", "peak pressure, rated torque [MPa]"
    assert [own[name] / even[name] for name in names] == pytest.approx([0.973, 0.818, 0.955], abs=0.005)
    assert even[names[2]] == pytest.approx(1571, abs=1)


@pytest.mark.parametrize(
    ("micrometres", "allowed"), [(-1, "greater than or equal to 0"), (101, "less than or equal to 100")]
)
def test_a_crowning_beyond_what_is_believed_is_refused(micrometres, allowed):
    with pytest.raises(InputError) as refused:
        design_of("rv20e", {"cycloid_stage.crowning_um": micrometres})
    assert str(refused.value).endswith(f"cycloid_stage.crowning_um is {micrometres}; input should be {allowed}.")
