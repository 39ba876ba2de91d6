"""The scene is the model: where parts stand, what pins carry, which gaps are left, and where each source sits."""

from __future__ import annotations

import json
from math import gcd

import numpy as np
import pytest

from studies.benchmarks.plain_rows import spring_groups
from tests.random_cases import random_case
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.exceptions import SolveError, UnknownNameError
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.cycloid.clearance import linear_clearance
from tolalloc.reducers.cycloid.solvers import LAWS
from tolalloc.reducers.cycloid.solvers.pins import pin_forces
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.hysteresis import both_directions
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.scene import Scene, is_placed, place_of, places_of, scene_of
from tolalloc.reports.scene_record import Pose, scene_record, values_of

CASES = range(12)


@pytest.fixture(scope="module")
def scene(rv20e, table4) -> Scene:
    sources = [source.name for source in load_tolerance_table("rv20e_all_sources")]
    return scene_of(rv20e, table4[0], -1.0, unit="table4", sources=sources, per_crank_turn=2)


def of_case(seed: int) -> tuple[EquivalentModel, np.ndarray, float]:
    """Return a random reducer, a random unit of it, and a torque that a picture of it can stand."""
    case = random_case(seed)
    model = EquivalentModel(case.reducer, orders=case.orders)
    return model, np.array([case.units[0][name] for name in model.columns]), case.torque


def drawn(seed: int) -> tuple[Scene, EquivalentModel, np.ndarray]:
    model, errors, torque = of_case(seed)
    try:
        return scene_of(model, errors, torque, per_crank_turn=1), model, errors
    except SolveError as error:
        pytest.skip(str(error))


def apart(angle, other) -> float:
    """Return how far directions are apart [rad]."""
    return float(np.abs(np.angle(np.exp(1j * (np.asarray(angle) - np.asarray(other))))).max())


@pytest.mark.parametrize("seed", CASES)
def test_parts_stand_where_the_kinematics_of_the_model_put_them(seed):
    scene, model, _ = drawn(seed)
    reducer = model.reducer
    angle = np.random.default_rng(seed).uniform(-2 * np.pi, 2 * np.pi, 7)
    at = Positions(reducer, angle)

    def place(part, number, radius):
        return radius * np.exp(1j * np.array([scene.start[part][number] + scene.turns[part] * own for own in angle]))

    outline = scene.outline
    circle, eccentricity = reducer.crank_circle_radius / MILLIMETRE, reducer.cycloid_stage.eccentricity / MILLIMETRE
    for crank in range(reducer.crank_count):
        drawn_at = place("carrier", crank, outline["crank_circle_radius"])
        assert np.abs(drawn_at - circle * np.exp(1j * at.crank_position(crank))).max() < 1e-9
    for disc in range(reducer.disc_count):
        drawn_at = place("crank", disc, outline["eccentricity"])
        assert np.abs(drawn_at - eccentricity * np.exp(1j * at.disc_direction(disc))).max() < 1e-9
        # A tooth of the disc that stands at a root meets the pin in the crank's direction, equation (15).
        turned = place("disc", disc, outline["pin_circle_radius"])
        expected = np.exp(-1j * at.disc_direction(disc) / reducer.cycloid_stage.disc_teeth)
        assert np.abs(turned - outline["pin_circle_radius"] * expected).max() < 1e-9
    sun = outline["module"] * outline["sun_teeth"] / 2
    assert np.abs(place("sun", 0, sun) - sun * np.exp(1j * at.sun_angle)).max() < 1e-9
    pins = outline["pin_circle_radius"] * np.exp(1j * np.array(scene.start["pin"]))
    assert (
        np.abs(pins - reducer.cycloid_stage.pin_circle_radius / MILLIMETRE * np.exp(1j * at.pin_direction)).max() < 1e-9
    )


@pytest.mark.parametrize("seed", CASES)
def test_gears_roll_on_each_other_and_mesh(seed):
    scene, _, _ = drawn(seed)
    turns, outline = scene.turns, scene.outline
    sun, planet = (outline["module"] * outline[f"{name}_teeth"] / 2 for name in ("sun", "planet"))
    assert sun * (turns["sun"] - 1) == pytest.approx(-planet * (turns["planet"] - 1), rel=1e-12)
    assert [turns["carrier"], turns["disc"]] == pytest.approx([1, 1], rel=1e-12)
    assert [turns["crank"], turns["planet"]] == pytest.approx([-outline["disc_teeth"]] * 2, rel=1e-12)
    assert turns["crank"] < 0 < turns["sun"]
    for crank, direction in enumerate(scene.start["carrier"]):
        ahead = (direction - scene.start["sun"][0]) * outline["sun_teeth"] / (2 * np.pi)
        there = (direction + np.pi - scene.start["planet"][crank]) * outline["planet_teeth"] / (2 * np.pi)
        assert apart(2 * np.pi * (ahead + there), np.pi) < 1e-9  # a tooth of the one in a space of the other


@pytest.mark.parametrize("seed", CASES)
def test_the_picture_closes_over_its_period_and_not_before(seed):
    scene, model, errors = drawn(seed)
    for turn in range(1, min(scene.output_turns, 40) + 1):
        away = max(apart(2 * np.pi * turn * own, 0.0) for own in scene.turns.values())
        assert (away < 1e-8) == (turn == scene.output_turns)
    first = model.reducer.first_stage
    product = first.planet_teeth * model.reducer.cycloid_stage.pin_count
    assert scene.output_turns == first.sun_teeth // gcd(first.sun_teeth, product)
    # Where the sun is back after one output turn, so are forces and gaps.
    if scene.output_turns == 1:
        loaded = model.at_torque(scene.forward.torque)
        again = loaded.equilibria(errors[np.newaxis], scene.forward.torque, np.array([2 * np.pi]))
        assert forces(again).pins[0, 0] == pytest.approx(scene.forward.force[0], abs=1e-6 * scene.forward.force.max())


@pytest.mark.parametrize("seed", CASES)
def test_forces_and_gaps_are_those_that_the_model_balances_to_the_last_digit(seed):
    scene, model, errors = drawn(seed)
    law = model.reducer.stiffness.pin_contact_law
    tilted = any(".tilt" in name and errors[at] for at, name in enumerate(model.columns) if "bore" not in name)
    for states in (scene.forward, scene.backward):
        loaded = model.at_torque(states.torque)
        own = loaded.equilibria(errors[np.newaxis], states.torque, scene.carrier_angle)
        assert np.array_equal(states.force, forces(own).pins[0])
        assert np.array_equal(states.transmission_error, own.transmission_error[0])
        if tilted and law != "logarithmic":
            continue  # then the force of a tooth is not that of its middle
        force, _ = pin_forces(LAWS[law], own.tables.contact_stiffness, own.tables.contact_log_length, -states.gap)
        assert np.array_equal(force, states.force)


@pytest.mark.parametrize("seed", CASES)
def test_displacements_and_gaps_are_those_of_the_spring_rows(seed):
    scene, model, errors = drawn(seed)
    states = scene.forward
    loaded = model.at_torque(states.torque)
    groups = spring_groups(loaded.reducer, scene.carrier_angle, loaded.orders)
    for group in groups:
        own = errors[[model.columns.index(name) for name in group.columns]]
        way = np.einsum("arc,ac->ar", group.displacement, states.displacement) + group.error @ own
        if group.contact == "unilateral":
            assert way == pytest.approx(-states.gap.reshape(way.shape), abs=1e-12)
    rotation = scene.coordinates["carrier"][0] + 2
    assert states.displacement[:, rotation] == pytest.approx(states.transmission_error, abs=1e-12)


def test_both_directions_resist(scene, rv20e, table4):
    forward, backward = both_directions(rv20e, table4, -1.0, scene.carrier_angle)
    assert scene.forward.torque == -1.0
    assert scene.backward.torque == 1.0
    assert np.array_equal(scene.forward.transmission_error, forward[0])
    assert np.array_equal(scene.backward.transmission_error, backward[0])
    # Drawn where they act, the pins' forces hold what the torques on carrier and sun leave of each other.
    record = scene_record(scene)
    for name, states in (("forward", scene.forward), ("backward", scene.backward)):
        for at, angle in enumerate(scene.carrier_angle):
            pose, moment = Pose(record, float(angle), name), 0.0
            for disc in range(2):
                point, normal = pose.contact(disc)
                moment += float((states.force[at, disc] * (point.conj() * normal).imag).sum()) * MILLIMETRE
            largest = states.force[at].max() * 0.05
            assert moment == pytest.approx(-states.torque * (1.0 - 1.0 / rv20e.reducer.ratio), abs=1e-6 * largest)


@pytest.mark.parametrize("carrier_angle", [0.0, 0.41, 2.0, 5.5])
def test_the_gap_that_is_drawn_at_a_pin_is_the_magnified_one(scene, carrier_angle):
    """From a pin's centre the drawn outline is as far as its radius and the magnified gap; chords cut a little off."""
    pose = Pose(scene_record(scene), carrier_angle)
    for disc in range(2):
        outline, gap = pose.teeth(disc), 1e3 * scene.magnification * pose.state("gap")[disc]
        start, along = outline, np.roll(outline, -1) - outline
        to_pin = pose.pins[:, np.newaxis] - start
        share = np.clip((to_pin * along.conj()).real / np.abs(along) ** 2, 0.0, 1.0)
        distance = np.abs(to_pin - share * along).min(axis=1) - scene.outline["pin_radius"]
        assert gap.max() > 0.2
        assert distance == pytest.approx(gap, abs=0.012)  # mm in the picture


def test_bearings_are_drawn_open_by_their_magnified_ways(scene, rv20e, table4):
    """A journal is off its bore, and a shaft off the carrier's, by the ways of the model's springs between them."""
    groups = {group.name: group for group in spring_groups(rv20e.reducer, scene.carrier_angle, rv20e.orders)}
    record = scene_record(scene)

    def ways(name):
        group = groups[name]
        own = table4[0, [rv20e.columns.index(column) for column in group.columns]]
        found = np.einsum("arc,ac->ar", group.displacement, scene.forward.displacement) + group.error @ own
        return (found[:, 0::2] + 1j * found[:, 1::2]) / MILLIMETRE

    in_discs, in_carrier = ways("crank–disc bearing"), ways("crank–carrier bearing")
    assert min(np.abs(in_discs).max(), np.abs(in_carrier).max()) > 1e-5
    for at, angle in enumerate(scene.carrier_angle):
        pose = Pose(record, float(angle))
        pairs = [(crank, disc) for disc in range(2) for crank in range(2)]
        drawn_open = np.array([pose.journal(*pair) - pose.bore(*pair) for pair in pairs])
        assert drawn_open / scene.magnification == pytest.approx(in_discs[at], abs=1e-9)
        drawn_open = np.array([pose.crank(crank) - pose.carrier_bore(crank) for crank in range(2)])
        assert drawn_open / scene.magnification == pytest.approx(in_carrier[at], abs=1e-9)


def test_teeth_are_those_of_the_modified_profile(scene, rv20e):
    reducer = rv20e.reducer
    modified = ToothProfile(stage=reducer.cycloid_stage, modification=reducer.modification)
    exact, ground = (np.hypot(*np.array(scene.tooth[name]).T) for name in ("exact", "modified"))
    assert ground.min() == pytest.approx(modified.root_radius / MILLIMETRE, abs=1e-9)
    assert ground.max() == pytest.approx(modified.tip_radius / MILLIMETRE, abs=1e-9)
    assert not np.allclose(exact, ground, atol=1e-3)
    moved = np.array(scene.tooth["modified"]) - np.array(scene.tooth["exact"])
    along = (moved * np.array(scene.tooth["normal"])).sum(axis=1)
    removed = linear_clearance(reducer.cycloid_stage, reducer.modification, np.array([0.0, np.pi]))
    root, tip = exact.argmin(), exact.argmax()
    assert along[[root, tip]] == pytest.approx(removed / MILLIMETRE, abs=1e-9)


@pytest.mark.parametrize("table", ["rv20e_table4", "rv20e_all_sources"])
def test_every_source_of_a_shipped_drawing_has_one_place(table):
    sources = [source.name for source in load_tolerance_table(table)]
    found = places_of(load_reducer("rv20e"), sources)
    assert sorted(name for place in found for name in place.sources) == sorted(sources)
    assert len({place.id for place in found}) == len({place.label for place in found}) == len(found)


@pytest.mark.parametrize("seed", CASES)
def test_every_source_of_a_random_reducer_has_one_place(seed):
    model, _, _ = of_case(seed)
    sources = {source_name(name) for name in model.columns if not name.startswith("modification.")}
    found = places_of(model.reducer, sorted(sources))
    assert sorted(name for place in found for name in place.sources) == sorted(sources)


def test_a_source_of_no_part_is_refused_by_name():
    with pytest.raises(UnknownNameError, match=r"disc3\.pitch"):
        places_of(load_reducer("rv20e"), ["disc3.pitch"])
    with pytest.raises(UnknownNameError, match=r"gearbox\.pitch"):
        place_of("gearbox.pitch")
    assert is_placed("disc3.pitch")
    assert not is_placed("motor.assembly")


def read_back(scene: Scene, coarse: bool = False) -> dict:
    """Return what a program reads that was given the picture as JSON."""
    return json.loads(json.dumps(scene_record(scene, coarse), allow_nan=False))


def test_a_scene_travels_as_json_to_the_last_digit(scene):
    again = read_back(scene)
    assert again["version"] == 1
    assert [tuple(place["sources"]) for place in again["places"]] == [place.sources for place in scene.places]
    for name in ("force", "gap", "displacement", "transmission_error"):
        assert np.array_equal(values_of(again["backward"][name]), getattr(scene.backward, name))


def test_a_coarse_scene_is_small_and_keeps_which_pins_carry(scene):
    coarse = read_back(scene, coarse=True)
    assert len(json.dumps(coarse)) < 0.35 * len(json.dumps(read_back(scene)))
    for states, own in ((coarse["forward"], scene.forward), (coarse["backward"], scene.backward)):
        gap = values_of(states["gap"])
        assert np.array_equal(values_of(states["force"]) > 0.0, own.force > 0.0)
        assert np.abs(gap - own.gap).max() <= np.ptp(own.gap) / 255
        assert np.array_equal(values_of(states["transmission_error"]), own.transmission_error)
