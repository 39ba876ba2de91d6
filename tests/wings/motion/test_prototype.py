"""The virtual prototype of the RV-40E against exact equilibria, the equivalent model and the balance of power.

Masses, inertia and damping are assumptions; a small output inertia keeps the prototype close to its equilibria.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.optimize import brentq

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.cycloid.clearance import exact_clearance
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.motion import prototype as door
from tolalloc.wings.motion.motion import Damping, Inertia
from tolalloc.wings.motion.prototype import (
    RIGID,
    TimeCourse,
    TimeSteps,
    mesh_of,
    part_errors,
    simulate_prototype,
    with_rigid_bearings,
)
from tolalloc.wings.motion.solvers.pin_forces import fill_forces, pin_contacts

pytest.importorskip("exudyn")

SPEED = 525 * 2 * pi / 60
COMPLIANCE = 3.67e7
"""Pin contact that the contact angles of xi2015 imply [N/m]."""
INERTIA = Inertia(
    sun=0.1, planet=0.4, planet_moment=1e-4, disc=0.8, disc_moment=1.6e-3, carrier=5.0, carrier_moment=0.02
)
GIVEN = (INERTIA, Damping(mass_proportional=5000.0, stiffness_proportional=1e-5))


def with_stiffness(reducer: Reducer, **values) -> Reducer:
    return replace(reducer, stiffness=replace(reducer.stiffness, **values))


@pytest.fixture(scope="module")
def rigid() -> Reducer:
    return with_rigid_bearings(load_reducer("rv40e_xi2015"))


def brief_run(reducer: Reducer, torque: float, errors=None):
    """A start and loading within a fifth of a second, then full speed and load; answers of the last part."""
    drive = (TimeCourse.step(SPEED, 0.0, 0.1), TimeCourse.step(torque, 0.1, 0.2))
    answer = simulate_prototype(reducer, *GIVEN, *drive, TimeSteps(duration=0.3), errors)
    return answer, np.flatnonzero(answer.time > 0.22)


@pytest.fixture(scope="module")
def calibrated(rigid):
    """xi2015's simulation with the compliance of its contact angles, and its steady part."""
    drive = (TimeCourse.step(SPEED, 0.0, 1.0), TimeCourse.step(-572.0, 1.0, 1.5))
    reducer, told = with_stiffness(rigid, pin_contact=COMPLIANCE), []
    answer = simulate_prototype(reducer, *GIVEN, *drive, TimeSteps(duration=2.0), progress=told.append)
    assert told[-1] == 1.0
    assert np.all(np.diff(told) >= 0.0)
    return answer, answer.time > 1.6


def carrying(answer) -> np.ndarray:
    return (answer.pin_forces > 0).sum(axis=2)


@pytest.mark.slow
def test_ratio_and_speeds(calibrated):
    answer, steady = calibrated
    assert answer.time[-1] == pytest.approx(2.0)
    # Over angles: speeds once a millisecond alias the pins' passing.
    turned_in, turned_out = np.ptp(answer.input_angle[steady]), np.ptp(answer.output_angle[steady])
    assert turned_in / turned_out == pytest.approx(81.0, abs=1e-3)
    assert answer.output_speed[steady].mean() * 30 / pi == pytest.approx(6.4815, abs=1e-3)
    np.testing.assert_allclose(answer.output_angle, answer.input_angle / 81 + answer.transmission_error, atol=1e-12)
    assert answer.input_angle[-1] == pytest.approx(1.5 * SPEED, rel=1e-9)


@pytest.mark.slow
def test_power_closes(calibrated):
    answer, steady = calibrated
    given = (answer.input_torque * answer.input_speed)[steady].mean()
    taken = -(answer.output_torque * answer.output_speed)[steady].mean()
    assert taken == pytest.approx(572.0 * SPEED / 81.0, rel=1e-3)
    assert given == pytest.approx(taken, rel=1e-3)
    assert np.ptp(answer.kinetic_energy[steady]) < 1e-3 * answer.kinetic_energy[steady].mean()


@pytest.mark.slow
def test_sixteen_teeth_carry_with_the_compliance_of_the_source(calibrated):
    answer, steady = calibrated
    assert set(np.unique(carrying(answer)[steady])) == {16, 17}


def exact_equilibrium(reducer: Reducer, sun_angle: float, torque: float):
    """Rigid bearings leave one coordinate: the carrier's angle, with which cranks and discs turn."""
    profile = ToothProfile(stage=reducer.cycloid_stage, modification=reducer.modification)
    pins, stiffness = 2 * pi * np.arange(40) / 40, reducer.stiffness.pin_contact

    def compression(error: float) -> np.ndarray:
        crank = 1.5 * (sun_angle / 81 + error) - 0.5 * sun_angle
        turned = sun_angle / 81 + error + crank / 39
        return np.stack(
            [np.maximum(-exact_clearance([profile], pins - crank - pi * disc, turned)[0], 0.0) for disc in range(2)]
        )

    def unbalanced(error: float) -> float:
        energy = [stiffness / 2 * (compression(error + step) ** 2).sum() for step in (1e-9, -1e-9)]
        return (energy[0] - energy[1]) / 2e-9 - torque

    error = brentq(unbalanced, -1e-3, 0.0, xtol=1e-13)
    return error, stiffness * compression(error)


@pytest.mark.slow
def test_steady_run_passes_through_exact_equilibria(calibrated, rigid):
    """Bearings of 1e13 N/m add 0.01″ to rigid ones; the rest is vibration."""
    answer, steady = calibrated
    reducer, late = with_stiffness(rigid, pin_contact=COMPLIANCE), np.flatnonzero(steady)[::37]
    found = [exact_equilibrium(reducer, answer.input_angle[at], -572.0) for at in late]
    error, pins = np.array([each[0] for each in found]), np.array([each[1] for each in found])
    off = (answer.transmission_error[late] - error) / ARCSECOND
    assert abs(off.mean()) < 0.02
    assert off.std() < 0.03
    np.testing.assert_allclose(answer.pin_forces[late], pins, rtol=0, atol=0.003 * pins.max())
    np.testing.assert_array_equal(carrying(answer)[late], (pins > 0).sum(axis=2))


def static(reducer: Reducer, carrier_angle: np.ndarray, torque: float, errors=None):
    """Transmission error and pin forces of the equivalent model with a first stage that does not yield."""
    model = EquivalentModel(with_stiffness(reducer, sun_support=RIGID, gear_mesh=RIGID))
    values = dict.fromkeys(model.columns, 0.0) | reducer.modification.deviations
    for name, value in (errors or {}).items():
        values[name] += value
    equilibria = model.equilibria(np.array([list(values.values())]), torque, carrier_angle)
    assert not equilibria.status.any()
    return equilibria.transmission_error[0], forces(equilibria).pins[0]


@pytest.mark.slow
def test_equivalent_model_agrees_where_its_gaps_are_exact(rigid):
    """They are under an equidistant modification and a torque that moves pins by little beside the roots' radius."""
    reducer = replace(rigid, modification=Modification(equidistant=1 * MICROMETRE, shift=0.0))
    answer, late = brief_run(reducer, -100.0)
    error, pins = static(reducer, answer.input_angle[late] / 81, -100.0)
    assert abs((answer.transmission_error[late] - error).mean()) < 0.02 * ARCSECOND
    at = -1
    np.testing.assert_allclose(answer.pin_forces[late[at]], pins[at], rtol=0, atol=0.01 * pins[at].max())
    np.testing.assert_array_equal(carrying(answer)[late[at]], (pins[at] > 0).sum(axis=1))


@pytest.mark.slow
def test_bearings_yield_as_in_the_equivalent_model(rigid):
    """Under the whole load and with the modification of the source, whose linear gaps are off by up to 0.05 µm here.

    An ideal first stage does not feel where the planets stand, so their bearings have to be rigid in both models.
    """
    own = load_reducer("rv40e_xi2015").stiffness
    reducer = with_stiffness(rigid, crank_disc_bearing=own.crank_disc_bearing, carrier_bearing=own.carrier_bearing)
    answer, late = brief_run(reducer, -572.0)
    mean = answer.transmission_error[late].mean() / ARCSECOND
    error, pins = static(reducer, answer.input_angle[late] / 81, -572.0)
    assert mean == pytest.approx(error.mean() / ARCSECOND, abs=0.05)
    stiff, _ = static(rigid, answer.input_angle[late] / 81, -572.0)
    assert abs(error.mean() - stiff.mean()) > 1.0 * ARCSECOND  # the bearings matter
    mean_forces = answer.pin_forces[late].mean(axis=0)
    np.testing.assert_allclose(mean_forces, pins.mean(axis=0), rtol=0, atol=0.01 * pins.max())


@pytest.mark.slow
def test_an_ideal_first_stage_does_not_feel_that_planets_yield(rigid):
    """A planet that yields by u turns its crank in the equivalent model, and the mesh loads its bearing: twice u/r.

    Here r is the planet's pitch radius; the crank's turn reaches the output divided by zc + 1 + Z1/Z2.
    """
    stiffness = load_reducer("rv40e_xi2015").stiffness.crank_carrier_bearing
    reducer = replace(rigid, modification=Modification(equidistant=1 * MICROMETRE, shift=0.0))
    reducer = with_stiffness(reducer, crank_carrier_bearing=stiffness)
    answer, late = brief_run(reducer, -572.0)
    error, _ = static(reducer, answer.input_angle[late] / 81, -572.0)
    yields = 572.0 / 2 / reducer.crank_circle_radius / stiffness
    expected = 2 * yields / 0.021 / (39 + 1 + 21 / 42)
    assert (answer.transmission_error[late] - error).mean() == pytest.approx(expected, rel=0.05)


@pytest.mark.slow
def test_hertzian_line_contact_of_the_preset(rigid):
    answer, late = brief_run(with_stiffness(rigid, pin_contact_law="logarithmic"), -572.0)
    assert set(np.unique(carrying(answer)[late])) == {8, 9}
    error, _ = static(with_stiffness(rigid, pin_contact_law="logarithmic"), answer.input_angle[late] / 81, -572.0)
    assert abs((answer.transmission_error[late] - error).mean()) < 0.1 * ARCSECOND


ALONG = 1e-6 * np.cos(20 * DEGREE)
"""What 1 µm along the pitch circle adds along the line of action [m]."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("errors", "gears"),
    [
        ({"crank1.journal1.eccentricity.x": 3e-6, "crank2.journal1.eccentricity.x": 3e-6}, {}),
        ({"disc1.bore1.position.y": 1e-6, "disc1.bore2.position.y": -1e-6}, {}),
        (
            {"carrier.bore1.position.y": 1e-6, "carrier.bore2.position.y": -1e-6},
            {"mesh1.deviation": ALONG, "mesh2.deviation": ALONG},
        ),
        ({"carrier.assembly.x": 1e-6, "carrier.assembly.y": 2e-6}, {"sun.assembly.x": 1e-6, "sun.assembly.y": 2e-6}),
        ({f"each_pin.position.{pin}.y": 1e-6 for pin in range(1, 41)}, {}),
        ({f"each_pin.position.{pin}.x": -5e-7 for pin in range(1, 21)}, {}),
        ({"pin.diameter": 1e-6, "each_pin.diameter.7": 2e-7, "housing.groove.radius": 5e-7}, {}),
    ],
    ids=lambda errors: next(iter(errors), "alone"),
)
def test_errors_of_parts_act_as_in_the_equivalent_model(rigid, errors, gears):
    """``gears`` keep the equivalent model's first stage from feeling where the planets stand, as the ideal one does."""
    reducer = replace(rigid, modification=Modification(equidistant=1 * MICROMETRE, shift=0.0))
    answer, late = brief_run(reducer, -100.0, errors)
    angle = answer.input_angle[late] / 81
    error, _ = static(reducer, angle, -100.0, errors | gears)
    without, _ = static(reducer, angle, -100.0)
    effect = np.abs(error - without).max()
    assert effect > 0.5 * ARCSECOND
    assert np.abs(answer.transmission_error[late] - error).max() < 0.05 * ARCSECOND


@pytest.mark.slow
def test_contacts_take_exact_distances(rigid):
    mesh, stage = mesh_of(rigid, part_errors(rigid, {})), rigid.cycloid_stage
    profile, contact = ToothProfile(stage=stage, modification=rigid.modification), np.empty((40, 6))
    for carrier, turned in ((0.0, 0.0), (0.3, 2e-5), (-2.0, 5e-4), (1e3, -4e-4)):
        for disc in range(2):
            crank = -39 * carrier + pi * disc
            place = stage.eccentricity * np.array([np.cos(crank), np.sin(crank)])
            pin_contacts(mesh, disc, np.array([*place, carrier + turned]), contact)
            exact = -exact_clearance([profile], mesh.angle - crank, turned)[0]
            np.testing.assert_allclose(contact[:, 2], exact, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("law", "symmetry"), [("constant", 1e-5), ("logarithmic", 3e-3)])
def test_contact_forces_are_the_slope_of_an_energy(rigid, law, symmetry):
    """The logarithmic law changes along the tooth, which its force alone does not know."""
    mesh = mesh_of(with_stiffness(rigid, pin_contact_law=law), part_errors(rigid, {}))
    start = np.array([1.3e-3, 0.0, 0.0, -1.3e-3, 0.0, 0.0])
    start[[2, 5]] += 3e-4
    force, stiffness, numeric = np.empty(6), np.empty((6, 6)), np.empty((6, 6))
    scale = np.array([1.0, 1.0, 0.05, 1.0, 1.0, 0.05])
    for at in range(6):
        ends = []
        for step in (1e-9, -1e-9):
            moved = start.copy()
            moved[at] += step / scale[at]
            fill_forces(mesh, moved, force, stiffness)
            ends.append(force / scale)
        numeric[:, at] = (ends[1] - ends[0]) / 2e-9
    assert np.abs(numeric).max() > 1e8
    np.testing.assert_allclose(numeric, numeric.T, rtol=0, atol=symmetry * np.abs(numeric).max())
    fill_forces(mesh, start, force, stiffness)
    told = stiffness / np.outer(scale, scale)
    np.testing.assert_allclose(told, numeric, rtol=0, atol=0.05 * np.abs(numeric).max())


def test_a_course_over_time_is_smooth_and_integrates():
    course = TimeCourse.step(4.0, 1.0, 3.0)
    assert [course.at(time) for time in (0.0, 1.0, 2.0, 3.0, 9.0)] == pytest.approx([0.0, 0.0, 2.0, 4.0, 4.0])
    assert [course.integral(time) for time in (0.5, 3.0, 5.0)] == pytest.approx([0.0, 4.0, 12.0])
    bent = TimeCourse(time=np.array([0.0, 1.0]), value=np.array([2.0, 6.0]))
    assert [bent.integral(time) for time in (-1.0, 0.5, 2.0)] == pytest.approx([-2.0, 1.5, 10.0])


def test_without_the_extra_one_sentence_says_what_to_install(rigid, monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(door, "import_module", missing)
    with pytest.raises(InputError, match=r"optional extra: pip install -e '\.\[multibody\]'\.$"):
        brief_run(rigid, -1.0)


def test_bad_input_is_refused(rigid):
    with pytest.raises(InputError, match=r"'disc1\.pitch\.cos1'"):
        brief_run(rigid, -1.0, {"disc1.pitch.cos1": 1e-6})
    with pytest.raises(InputError, match=r"'crank3\.journal1\.eccentricity\.x'"):
        brief_run(rigid, -1.0, {"crank3.journal1.eccentricity.x": 1e-6})
    turned = replace(rigid, modification=replace(rigid.modification, rotation=1e-5))
    with pytest.raises(InputError, match=r"rotation modification \[µrad\] is 10\.0"):
        brief_run(turned, -1.0)
    with pytest.raises(InputError, match="in this order"):
        TimeSteps(duration=1.0, step=0.0)
    with pytest.raises(InputError, match="spectral radius is 2"):
        TimeSteps(duration=1.0, spectral_radius=2.0)
    with pytest.raises(InputError, match="rising, finite"):
        TimeCourse(time=np.array([1.0, 0.0]), value=np.zeros(2))


def test_a_step_without_solution_is_no_answer(rigid):
    """No teeth stand where the loosened discs go."""
    drive = (TimeCourse.step(SPEED, 0.0, 1e-3), TimeCourse.step(-1e9, 0.0, 1e-3))
    with pytest.raises(SolveError, match="virtual prototype"):
        simulate_prototype(rigid, *GIVEN, *drive, TimeSteps(duration=0.05))
