"""Discs under torque against balances, energy, the contact laws solved one by one, and the equivalent model.

Levers, curvatures, gaps and laws are written out here from the geometry of the drive; nothing but the answers is taken
from the package.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, log, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from tests.builders import unit_with
from tests.random_cases import LAWS, random_reducer
from tests.verification.test_tooth_profile import modified_points, path_bend
from tolalloc.exceptions import InputError
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.cycloid.loaded_contact import (
    LoadedContact,
    PressedDiscs,
    default_phases,
    pressed,
    pressed_linear,
)
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.reducer.design import Clearances, CycloidStage, Modification, Reducer
from tolalloc.reducers.reducer.files import load_reducer

SEEDS = (0, 1, 4, 7)  # odd and even pin counts, one and two first contacts, 3 to 912 N·m
BILATERAL = ("sun_support", "gear_mesh", "crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing")


@dataclass(frozen=True)
class Case:
    """A random reducer with positive clearances at root, flank and tip, and a torque on its discs."""

    reducer: Reducer
    torque: float

    @property
    def stage(self) -> CycloidStage:
        return self.reducer.cycloid_stage

    @property
    def phases(self) -> np.ndarray:
        return default_phases(self.reducer, 3)


def random_case(seed: int, law: str, bending: bool) -> Case:
    generator = np.random.default_rng([37, seed])
    reducer = random_reducer(generator)
    flank, radial = generator.uniform(0.5, 12, 2) * MICROMETRE
    stiffness = replace(reducer.stiffness, pin_contact_law=law)
    if bending:
        stiffness = replace(stiffness, pin_bending=stiffness.pin_contact * 10 ** generator.uniform(-2, 0.5))
    reducer = replace(
        reducer,
        stiffness=stiffness,
        clearances=Clearances(),
        modification=Modification.from_clearances(flank, radial, reducer.cycloid_stage),
    )
    return Case(reducer, float(10 ** generator.uniform(0, 3)))


def levers(stage: CycloidStage, pin_angle: np.ndarray) -> np.ndarray:
    """Moment about the disc's centre of a unit force from the pitch point to a pin [m]; the crank points along x."""
    pin, pitch_point = stage.pin_circle_radius * np.exp(1j * pin_angle), stage.eccentricity * stage.pin_count
    outward = (pin - pitch_point) / np.abs(pin - pitch_point)
    return ((pin - stage.eccentricity).conj() * outward).imag


def closed_gap(case: Case, pin_angle: np.ndarray) -> np.ndarray:
    """Material removed along the normal, less what the first contact's rotation closes on every pin [m]."""
    stage, amounts, lever = case.stage, case.reducer.modification, case.stage.eccentricity * case.stage.disc_teeth
    k1 = stage.eccentricity * stage.pin_count / stage.pin_circle_radius
    q, share = sqrt(1 - k1**2), amounts.shift / amounts.equidistant if amounts.equidistant > 0 else -inf
    closing = (amounts.equidistant - amounts.shift * q) / lever
    if share > q:  # two other pins touch before
        closing = k1 * sqrt(amounts.equidistant**2 - amounts.shift**2) / lever
    along = (1 - k1 * np.cos(pin_angle)) / np.sqrt(1 + k1**2 - 2 * k1 * np.cos(pin_angle))
    return amounts.equidistant - amounts.shift * along - closing * levers(stage, pin_angle)


def approach(case: Case, pin_angle: float, force: float) -> float:
    """How much a pin gives way under a force: contact and bending are springs in series [m]."""
    stage, stiffness = case.stage, case.reducer.stiffness
    bend, bending = float(path_bend(stage, pin_angle)), force / stiffness.pin_bending
    if stiffness.pin_contact_law == "constant":
        return force / stiffness.pin_contact + bending
    tooth = 1 / bend - stage.pin_radius  # convex positive
    if stiffness.pin_contact_law == "table2":
        radius = -tooth
        factor = (radius - stage.pin_radius) / (radius + stage.pin_radius) if bend < 0 else 1.0
        return force / (stiffness.pin_contact * factor) + bending
    # Roark's approach of cylinders with Hertz's half width a; πbE* is twice the stiffness of liu2020's Table 2.
    line = 2 * stiffness.pin_contact
    if abs(1 / bend) > stage.pin_circle_radius:  # nearly flat; an assumption of the package
        tooth = np.sign(bend) * stage.pin_circle_radius - stage.pin_radius
    relative = abs(stage.pin_radius * tooth / (stage.pin_radius + tooth))
    half_width_squared = 4 * force * relative / line
    return force / line * (2 / 3 + log(16 * stage.pin_radius * abs(tooth) / (4 * half_width_squared))) + bending


def law_force(case: Case, pin_angle: float, compression: float) -> float:
    """The force under which a pin gives way by a compression."""
    if compression <= 0:
        return 0.0
    high = 1e-3
    while approach(case, pin_angle, high) < compression:
        high *= 2
    return float(brentq(lambda force: approach(case, pin_angle, force) - compression, 1e-12, high, rtol=1e-14))


def solved(case: Case, torque: float | None = None, discs: int = 1, phases: np.ndarray | None = None) -> LoadedContact:
    own = PressedDiscs(reducer=case.reducer, torque=torque or case.torque, discs=discs, exact=False)
    return pressed(own, case.phases if phases is None else phases)


cases = pytest.mark.parametrize(
    "case",
    [
        pytest.param(random_case(seed, law, bending), id=f"{seed}-{law}-{'bending' if bending else 'groove'}")
        for law in LAWS
        for bending in (False, True)
        for seed in SEEDS
    ],
)


@cases
def test_torque_balances_and_every_pin_follows_its_law(case):
    """Each compression is the rotation's share of the deflection less the gap, each force its law's, solved alone."""
    found = solved(case)
    lever = levers(case.stage, found.pin_angle)
    np.testing.assert_allclose((lever * found.force).sum(axis=(1, 2)), case.torque, rtol=1e-9)
    np.testing.assert_allclose(found.torque.sum(axis=1), case.torque, rtol=1e-9)
    gap = closed_gap(case, found.pin_angle)
    np.testing.assert_allclose(found.gap, gap, rtol=0, atol=1e-15)
    longest = case.stage.eccentricity * case.stage.disc_teeth
    compression = found.deflection[:, np.newaxis, np.newaxis] * lever / longest - gap
    expected = [law_force(case, *pin) for pin in zip(found.pin_angle.ravel(), compression.ravel(), strict=True)]
    largest = found.force.max()
    np.testing.assert_allclose(found.force.ravel(), expected, rtol=1e-8, atol=1e-8 * largest)
    assert (found.pins_in_contact == (found.force > 0).sum(axis=2)).all()
    assert found.force.ravel()[np.argmin(np.abs(found.pin_angle - found.most_loaded))] == largest


@cases
def test_no_force_falls_as_the_torque_grows(case):
    torques = case.torque * np.array([1e-6, 0.1, 0.999, 1.0, 1.001, 10.0])
    force = np.stack([solved(case, torque).force for torque in torques])
    assert (np.diff(force, axis=0) >= -1e-12 * force[1:]).all()
    assert (force[-1].sum(axis=(1, 2)) > force[0].sum(axis=(1, 2))).all()


def energy(case: Case, pin_angle: np.ndarray, deflection: float) -> float:
    """Strain energy of the pins of one disc: force times compression less the area above the law [N·m]."""
    lever = case.stage.eccentricity * case.stage.disc_teeth
    compression = deflection * levers(case.stage, pin_angle) / lever - closed_gap(case, pin_angle)
    stored = 0.0
    for angle, depth in zip(pin_angle[compression > 0], compression[compression > 0], strict=True):
        force = law_force(case, angle, depth)
        # The approach F·ln(…/F) is integrated over √F, where it has no kink at 0.
        above = quad(lambda root, own=angle: 2 * root * approach(case, own, root**2), 0, sqrt(force), epsrel=1e-12)[0]
        stored += force * depth - above
    return stored


@cases
def test_the_work_of_the_torque_is_the_energy_of_the_pins(case):
    """Between two torques the energy grows by more than the rotation times the smaller, by less than times the larger.

    So the derivative of the energy by the rotation is the torque, whatever pins begin to carry in between.
    """
    torques = case.torque * np.array([1e-3, 0.5, 0.9999, 1.0, 1.0001, 2.0])
    found = [solved(case, float(torque), phases=case.phases[:1] + 0.01) for torque in torques]
    rotation = np.array([one.deflection[0] for one in found]) / (case.stage.eccentricity * case.stage.disc_teeth)
    stored = np.array([energy(case, one.pin_angle[0, 0], one.deflection[0]) for one in found])
    mean_torque, rounding = np.diff(stored) / np.diff(rotation), 1e-9 * case.torque
    assert (torques[:-1] - rounding <= mean_torque).all()
    assert (mean_torque <= torques[1:] + rounding).all()


@cases
def test_discs_of_a_pair_share_the_torque(case):
    """Crank directions are half a turn apart: whole pin pitches of an even count, an odd number of halves else."""
    pair, pitch = solved(case, discs=2), 2 * pi / case.stage.pin_count
    np.testing.assert_allclose(pair.torque.sum(axis=1), case.torque, rtol=1e-9)
    if case.stage.pin_count % 2 == 0:
        one = solved(case, case.torque / 2)
        np.testing.assert_allclose(pair.deflection, one.deflection, rtol=1e-9)
        for disc in (0, 1):
            np.testing.assert_allclose(
                np.sort(pair.force[:, disc]), np.sort(one.force[:, 0]), atol=1e-8 * one.force.max()
            )
        return
    for disc, shift in ((0, 0.0), (1, pitch / 2)):
        for phase, torque, deflection, force in zip(
            case.phases, pair.torque[:, disc], pair.deflection, pair.force[:, disc], strict=True
        ):
            one = solved(case, float(torque), phases=np.array([phase + shift]))
            assert one.deflection[0] == pytest.approx(deflection, rel=1e-9)
            np.testing.assert_allclose(np.sort(one.force[0, 0]), np.sort(force), atol=1e-8 * force.max())
    assert np.abs(np.diff(pair.torque, axis=1)).max() > 0, "the discs stand at different phases"


def test_some_pairs_are_of_odd_and_some_of_even_pin_counts():
    assert {random_case(seed, "constant", False).stage.pin_count % 2 for seed in SEEDS} == {0, 1}


@cases
def test_pressure_is_that_of_hertz(case):
    """From the tooth's curvature by differences of song2019's points, on the concave and on the convex part."""
    found, stage, step = solved(case), case.stage, 2e-3
    loaded = found.force > 0
    angle, force = found.pin_angle[loaded], found.force[loaded]
    around = modified_points(
        stage, Modification(equidistant=0.0, shift=0.0), angle[:, np.newaxis] + step * np.arange(-3, 4)
    )
    first = around @ np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * step)
    second = around @ np.array([2, -27, 270, -490, 270, -27, 2]) / (180 * step**2)
    tooth = -(first.conj() * second).imag / np.abs(first) ** 3  # negative where the tooth is concave
    discs, pins = case.reducer.disc_material, case.reducer.pin_material
    compliance = sum((1 - own.poisson_ratio**2) / own.elastic_modulus for own in (discs, pins))
    half_width = np.sqrt(4 * force / stage.face_width * compliance / (pi * (1 / stage.pin_radius + tooth)))
    pressure = 2 * force / (pi * half_width * stage.face_width)
    np.testing.assert_allclose(found.pressure[loaded], pressure, rtol=1e-5)
    assert (found.pressure[~loaded] == 0).all()
    assert found.most_pressed == found.pin_angle[found.pressure == found.pressure.max()][0]


def test_the_loaded_pins_of_these_cases_stand_on_both_parts_of_the_tooth():
    signs = set()
    for seed in SEEDS:
        case = random_case(seed, "constant", False)
        found = solved(case)
        signs |= set(np.sign(path_bend(case.stage, found.pin_angle[found.force > 0])))
    assert signs == {-1.0, 1.0}


def test_pins_between_two_supports_are_beams():
    """A disc loads one half of the span evenly, its neighbour has the other; the pin gives way in the load's middle."""
    reducer, span = load_reducer("rv40e_xi2015"), 0.031
    rigidity = reducer.pin_material.elastic_modulus * pi * (2 * reducer.cycloid_stage.pin_radius) ** 4 / 64

    def moment(at: float) -> float:  # of the unit load on 0 … l/2; its support carries 3/4 of it
        return 3 / 4 * at - at**2 / span if at < span / 2 else (span - at) / 4

    def virtual(at: float) -> float:  # of a unit force at l/4
        return 3 / 4 * at if at < span / 4 else (span - at) / 4

    breaks = [span / 4, span / 2]
    compliance = quad(lambda at: moment(at) * virtual(at), 0, span, points=breaks, epsrel=1e-12)[0] / rigidity
    assert 1 / reducer.with_pin_span(span).stiffness.pin_bending == pytest.approx(compliance, rel=1e-10)
    assert reducer.stiffness.pin_bending == inf


@cases
def test_li_lixings_forces_are_in_proportion_to_compressions(case):
    """The deflection is the approach under the largest force; with the constant law that is the law's own answer."""
    case = replace(case, torque=2000.0)  # small torques have a test of their own
    found = pressed_linear(PressedDiscs(reducer=case.reducer, torque=case.torque, exact=False), case.phases)
    lever, longest = levers(case.stage, found.pin_angle), case.stage.eccentricity * case.stage.disc_teeth
    np.testing.assert_allclose((lever * found.force).sum(axis=(1, 2)), case.torque, rtol=1e-9)
    depth = found.deflection[:, np.newaxis, np.newaxis]
    compression = np.maximum(depth * lever / longest - closed_gap(case, found.pin_angle), 0.0)
    largest = (found.force / np.where(compression > 0, compression, inf)).max(axis=(1, 2)) * found.deflection
    np.testing.assert_allclose(found.force, compression / depth * largest[:, np.newaxis, np.newaxis], rtol=1e-9)
    # The deflection is the approach under the largest force, where a pin would stand at φ0.
    phi0 = np.arccos(case.stage.eccentricity * case.stage.pin_count / case.stage.pin_circle_radius)
    expected = [approach(case, float(phi0), float(force)) for force in largest]
    np.testing.assert_allclose(found.deflection, expected, rtol=1e-9)
    if case.reducer.stiffness.pin_contact_law == "constant":
        np.testing.assert_allclose(found.force, solved(case).force, rtol=1e-6, atol=1e-8 * found.force.max())


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(8))
def test_pins_of_the_equivalent_model_with_rigid_bearings_are_pressed_alike(law, seed):
    """Discs on rigid cranks do nothing but turn: their phase is the crank's, their torque follows from the forces."""
    case = random_case(seed, law, bending=seed % 2 == 1)
    generator = np.random.default_rng([38, seed])
    discs, sign = int(generator.integers(1, 3)), float(generator.choice([-1, 1]))
    carrier_angle = generator.uniform(0, 2 * pi)
    off = []
    for rigid in (1e14, 1e15):
        stiffness = replace(case.reducer.stiffness, **dict.fromkeys(BILATERAL, rigid))
        reducer = replace(case.reducer, disc_count=discs, stiffness=stiffness)
        model = EquivalentModel(reducer, orders=(1,))
        errors = unit_with(model)
        state = model.equilibria(errors, sign * case.torque, np.array([carrier_angle]))
        assert (state.status == Status.CONVERGED).all()
        ours = forces(state).pins[0, 0]
        directions = -case.stage.disc_teeth * carrier_angle + 2 * pi * np.arange(discs) / discs
        around = 2 * pi * np.arange(case.stage.pin_count) / case.stage.pin_count
        from_crank = around - directions[:, np.newaxis]
        torque = (levers(case.stage, from_crank) * ours).sum()
        side = np.sign(torque)  # under the other torque the picture is its mirror image, pins at −φ
        assert side == sign
        alike = PressedDiscs(reducer=case.reducer, torque=abs(torque), discs=discs, exact=False)
        alike = pressed(alike, np.array([side * from_crank[0, 0]]))
        for disc in range(discs):
            order = np.argsort(np.remainder(side * from_crank[disc] + pi, 2 * pi))
            same = np.argsort(np.remainder(alike.pin_angle[0, disc] + pi, 2 * pi))
            off.append(np.abs(ours[disc][order] - alike.force[0, disc][same]).max() / ours.max())
    soft, rigid = np.reshape(off, (2, discs)).max(axis=1)
    assert soft < 1e-4
    assert rigid == pytest.approx(soft / 10, rel=0.05), "what is left is the give of the bearings"


@pytest.mark.parametrize("torque", [0.01, 0.02, 0.1, 1.0, 2.0, 5.0, 10.0, 50.0])
def test_li_lixings_method_under_a_small_torque(torque):
    """The constant law has an equilibrium for every torque, and with it the proportional method is the same."""
    reducer = load_reducer("rv40e_xi2015")
    assert reducer.stiffness.pin_contact_law == "constant"
    discs = PressedDiscs(reducer=reducer, torque=torque)
    expected = pressed(discs, default_phases(reducer, 9))
    found = pressed_linear(discs, default_phases(reducer, 9))
    np.testing.assert_allclose(found.force, expected.force, rtol=1e-6, atol=1e-8 * expected.force.max())


@pytest.mark.parametrize(("torque", "degrees"), [(0.0751397, 0.75), (0.396055, 6.25)])
def test_li_lixings_iteration_settles(torque, degrees):
    """Where one or two pins carry, the approach falls three times as fast as the deflection grows."""
    discs, phase = PressedDiscs(reducer=load_reducer("rv40e_xi2015"), torque=torque), np.radians([degrees])
    expected = pressed(discs, phase).force
    np.testing.assert_allclose(pressed_linear(discs, phase).force, expected, rtol=1e-6, atol=1e-8 * expected.max())


@cases
def test_the_zone_is_where_a_pin_would_be_compressed(case):
    stage, amounts = case.stage, case.reducer.modification
    q = sqrt(1 - (stage.eccentricity * stage.pin_count / stage.pin_circle_radius) ** 2)
    if amounts.shift > amounts.equidistant * q:  # two zones have a test of their own
        amounts = Modification.from_clearances(amounts.flank_clearance(stage), amounts.radial_clearance * 10, stage)
        case = replace(case, reducer=replace(case.reducer, modification=amounts))
    found, lever = solved(case), stage.eccentricity * stage.disc_teeth
    around = np.linspace(0, pi, 20001)
    for deflection, zone in zip(found.deflection, found.zone, strict=True):
        carries = deflection * levers(stage, around) / lever > closed_gap(case, around)
        np.testing.assert_allclose(zone, around[carries][[0, -1]], rtol=0, atol=1.01 * pi / 20000)


@pytest.mark.parametrize("exact", [False, True])
def test_the_zone_holds_all_pins_that_carry(exact):
    """Where Δr_rp·q < Δr_p two places touch first, near root and tip; a small torque leaves the pins between free."""
    reducer = replace(load_reducer("rv40e_xi2015"), modification=Modification(equidistant=20e-6, shift=18e-6))
    found = pressed(PressedDiscs(reducer=reducer, torque=5.0, exact=exact), default_phases(reducer, 9))
    carrying = found.pin_angle[found.force > 0]
    assert carrying.min() < 0.2 < 1.7 < carrying.max()
    for zone, angle, force in zip(found.zone, found.pin_angle, found.force, strict=True):
        carries = angle[force > 0]
        assert zone[0] <= carries.min()
        assert carries.max() <= zone[1]


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("law", LAWS)
def test_a_torque_beyond_any_contact_is_refused(law, exact):
    reducer = load_reducer("rv40e_xi2015")
    reducer = replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law=law))
    for torque in (1e8, 1e12, inf):
        discs = PressedDiscs(reducer=reducer, torque=torque, exact=exact)
        with pytest.raises(InputError, match=r"^RV-40E: torque .* N·m on the discs is beyond any contact.*\.$"):
            pressed(discs, default_phases(reducer, 2))


@pytest.mark.parametrize("torque", [0.0, -1.0, float("nan")])
def test_no_torque_is_refused(torque):
    with pytest.raises(InputError, match=r"^RV-40E: torque on the discs is .*; allowed is above 0 N·m\.$"):
        PressedDiscs(reducer=load_reducer("rv40e_xi2015"), torque=torque)


def test_a_deflection_that_reaches_no_pin_is_refused():
    reducer = load_reducer("rv40e_xi2015")
    discs = PressedDiscs(reducer=reducer, torque=1.0)
    with pytest.raises(InputError, match=r"^RV-40E: a deflection of .* µm reaches no pin; allowed is .*\.$"):
        pressed_linear(discs, default_phases(reducer, 9), deflection=1e-12)
