"""A ring of pins that gives: against an independent twin, closed forms, and the ring that does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studies.benchmarks.plain_rows import spring_groups
from tests.random_cases import Case, random_case
from tests.verification.dense_twin import DenseModel, Interface, interface, least_energy, play_response
from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reading.units import ARCMINUTE, ARCSECOND
from tolalloc.reducers.equivalent.condensation import condense
from tolalloc.reducers.equivalent.interfaces import pin_contact
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.equivalent.perfect import exact_unit, perfect_reducer, twist_shares
from tolalloc.reducers.equivalent.ring import ring_motion
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.reducer.housing import GIVES, Bolts, Housing, ways_of
from tolalloc.reducers.scene import scene_of
from tolalloc.reports.scene_record import Pose, scene_record
from tolalloc.wings.motion.motion import SpeedProfile, motion_of


def on(reducer: Reducer, housing: Housing) -> Reducer:
    """The reducer on a ring that gives as a file would state it."""
    springs = housing.springs(reducer.disc_material, reducer.cycloid_stage.pin_circle_radius)
    held = dict.fromkeys((f"ring_{way}" for way in GIVES), np.inf)
    return replace(reducer, housing=housing, stiffness=replace(reducer.stiffness, **(held | springs)))


def soft_housing(seed: int, reducer: Reducer) -> Housing:
    """A ring that gives in every way, as much as the other parts do."""
    random = np.random.default_rng(seed)
    radius = reducer.cycloid_stage.pin_circle_radius
    along, across, turn, tilt, beside = 10 ** random.uniform(7.5, 9.0, 5)
    return Housing(
        along=along,
        across=across,
        turn=turn * radius**2,
        tilt_along=tilt * radius**2,
        tilt_across=beside * radius**2,
        direction=random.uniform(0, 2 * np.pi),
        turn_per_tilt_along=random.uniform(-1, 1),
        turn_per_tilt_across=random.uniform(-1, 1),
    )


def twin_of(case: Case, angle: float) -> DenseModel:
    """The dense model with every pin on a rigid body that five springs hold; discs and all else stand in the housing.

    The ring's x, y, turn and tilts x, y come last. A pin's centre goes by u + θ·ẑ×R_k + z·τ, and the turn's spring
    feels θ − t·τ.
    """
    reducer, housing = case.reducer, case.reducer.housing
    rigid = on(reducer, Housing())
    at = Positions(rigid, np.array([angle]))
    turned = np.exp(1j * housing.direction)
    pins = reducer.cycloid_stage.pin_circle_radius * np.exp(1j * at.pin_direction)
    found = list[Interface]()
    for group in spring_groups(rigid, at.carrier_angle, case.orders):
        own = interface(rigid, case.units[0], angle, group)
        more = np.zeros((*own.displacement.shape[:2], 5))
        if group.contact == "unilateral":
            rows = own.displacement.reshape(reducer.disc_count, pins.size, -1)
            for disc in range(reducer.disc_count):
                first = at.coordinates.disc(disc)
                into = -(rows[disc, :, first] + 1j * rows[disc, :, first + 1])
                moved = [1.0, 1j, 1j * pins, at.plane(disc), 1j * at.plane(disc)]
                columns = [(into.conj() * way).real for way in moved]
                more.reshape(reducer.disc_count, pins.size, 5)[disc] = np.stack(columns, axis=-1)
        found.append(own._replace(displacement=np.concatenate([own.displacement, more], axis=2)))
    size = found[0].displacement.shape[2]
    along = np.array([turned.real, turned.imag])
    across = np.array([-turned.imag, turned.real])
    for number, (way, stiffness) in enumerate((way, getattr(housing, way)) for way in GIVES):
        row = np.zeros((1, 1, size))
        if way == "turn":
            row[0, 0, -3] = 1.0
            row[0, 0, -2:] = -housing.turn_per_tilt_along * along - housing.turn_per_tilt_across * across
        else:
            pair = slice(size - 5, size - 3) if number < 2 else slice(size - 2, size)
            row[0, 0, pair] = across if way.endswith("across") else along
        found.append(Interface(way, row, np.zeros((1, 1)), np.array([stiffness]), play_response, np.zeros(1)))
    load = np.zeros(size)
    load[-6] = case.torque
    return DenseModel(tuple(found), load)


@pytest.mark.parametrize("seed", range(12))
def test_a_ring_agrees_with_the_dense_twin(seed):
    case = random_case(seed)
    case = replace(case, reducer=on(case.reducer, soft_housing(seed, case.reducer)))
    model = EquivalentModel(case.reducer, orders=case.orders)
    errors = np.array([[case.units[0].get(column, 0.0) for column in model.columns]])
    angle = float(case.carrier_angle[0])
    found = float(model.equilibria(errors, case.torque, case.carrier_angle[:1]).transmission_error[0, 0])
    twin = twin_of(case, angle)
    least = least_energy(twin)
    assert twin.imbalance(least) < 1e-9
    assert abs(found - least[-6]) < 1e-6 * ARCSECOND
    stiff = EquivalentModel(on(case.reducer, Housing()), orders=case.orders)
    rigid = float(stiff.equilibria(errors, case.torque, case.carrier_angle[:1]).transmission_error[0, 0])
    assert abs(found - rigid) > 1e-3 * ARCSECOND


@pytest.mark.parametrize("name", ["rv20e", "rv80e", "cd29"])
def test_pins_of_a_ring_are_felt_as_a_disc_that_moves_the_other_way(name):
    """Every pin's own way along its normal, rigid body, is that of its disc's pole to rounding."""
    reducer = load_reducer(name)
    stage = reducer.cycloid_stage
    housing = replace(soft_housing(3, reducer), direction=0.0, turn_per_tilt_along=0.3, turn_per_tilt_across=-0.7)
    at = Positions(on(reducer, housing), np.linspace(0.1, 6.0, 7))
    moved, contact = ring_motion(at), pin_contact(at)
    pins = stage.pin_circle_radius * np.stack([np.cos(at.pin_direction), np.sin(at.pin_direction)])
    for disc in range(reducer.disc_count):
        height = at.plane(disc)
        along, across, turn = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]]), np.stack([-pins[1], pins[0]])
        ways = (along, across, turn, height * along + 0.3 * turn, height * across - 0.7 * turn)
        for number, way in enumerate(ways):
            exact = -(contact.by_disc[:, disc, :2] * way).sum(axis=1)
            rows = -np.einsum("axp,ax->ap", contact.by_disc[:, disc, :2], moved[:, disc, :, number])
            assert np.allclose(exact, rows, atol=1e-12)


def test_a_ring_that_does_not_give_is_not_there():
    reducer = load_reducer("rv20e")
    bare = condense(reducer, (1, 2, 4), np.linspace(0.0, 1.0, 5))
    same = condense(on(reducer, Housing(direction=1.0)), (1, 2, 4), np.linspace(0.0, 1.0, 5))
    assert all(np.array_equal(one, other) for one, other in zip(bare, same, strict=True))
    softer = condense(on(reducer, Housing(turn=1e6)), (1, 2, 4), np.linspace(0.0, 1.0, 5))
    assert softer.stiffness.shape == bare.stiffness.shape  # so a unit takes no longer


@pytest.mark.parametrize("torque", [-20.0, -80.0])
def test_one_disc_on_two_unequal_springs(torque):
    """Order 2·zc: by Castigliano θ = F·C·dF/dT with the force F of the disc on the ring, which turns with the crank."""
    reducer = replace(load_reducer("cd29"), disc_count=1)
    stage, model = reducer.cycloid_stage, EquivalentModel(reducer)
    along, across, direction = 2e11, 5e11, 0.4  # so stiff that they do not change the force
    soft = EquivalentModel(on(reducer, Housing(along=along, across=across, direction=direction)))
    count = 8 * stage.pin_count
    angle = 2 * np.pi * np.arange(count) / count
    by_disc = pin_contact(Positions(reducer, angle)).by_disc[:, 0, :2]
    to_axes = np.array([[np.cos(direction), -np.sin(direction)], [np.sin(direction), np.cos(direction)]])

    def force(load: float) -> np.ndarray:
        return np.einsum("axp,ap->ax", by_disc, forces(model.equilibria(exact_unit(model), load, angle)).pins[0, :, 0])

    beta, own = -stage.disc_teeth * angle, force(torque)
    moment = stage.disc_pitch_radius * (np.cos(beta) * own[:, 1] - np.sin(beta) * own[:, 0])
    assert np.allclose(moment, torque, rtol=1e-6)
    slope = (force(1.001 * torque) - force(0.999 * torque)) / (0.002 * torque)
    expected = ((own @ to_axes) * (slope @ to_axes) / [along, across]).sum(axis=1)
    rigid = model.equilibria(exact_unit(model), torque, angle).transmission_error[0]
    added = soft.equilibria(exact_unit(model), torque, angle).transmission_error[0] - rigid
    assert np.allclose(added, expected, rtol=0.01)
    order = 1 + np.abs(np.fft.rfft(added))[1:].argmax()
    assert order == 2 * stage.disc_teeth
    # A force that turns with the crank meets both springs twice a turn: |F|·|dF/dT|·(1/k − 1/k')/2.
    size, grows = np.hypot(*own.T).mean(), np.hypot(*slope.T).mean()
    closed_form = size * grows * (1 / along - 1 / across) / 2
    assert abs(np.fft.rfft(added)[order]) * 2 / count == pytest.approx(closed_form, rel=0.02)


def test_what_a_ring_adds_grows_with_the_torque():
    reducer = on(load_reducer("rv160e"), Housing(turn=2e7, tilt_along=5e5, turn_per_tilt_along=0.03))
    count = 4 * 39 * 40
    at = 2 * np.pi * np.arange(count) / count
    found = []
    for torque in (-400.0, -1600.0):
        model = EquivalentModel(reducer).at_torque(torque)
        curve = model.equilibria(exact_unit(model), torque, at).transmission_error[0]
        spectrum = np.abs(np.fft.rfft(curve)) * 2 / count
        found.append(spectrum)
        strongest = np.argsort(spectrum[1:])[::-1][:2] + 1
        assert sorted(strongest.tolist()) == [39, 78]
    assert found[1][39] == pytest.approx(4 * found[0][39], rel=0.05)
    assert found[1][78] == pytest.approx(4 * found[0][78], rel=0.05)


def test_bolts_give_alike_all_around_and_numbers_stand_before_them():
    reducer = load_reducer("rv20e")
    bolts = Bolts(count=12, size=0.006, circle=0.13, grip=0.012)
    filled = on(reducer, Housing(bolts=bolts, turn=1e7)).stiffness
    assert filled.ring_turn == pytest.approx(1e7 / reducer.cycloid_stage.pin_circle_radius**2)
    assert filled.ring_along == filled.ring_across
    assert filled.ring_tilt_along == filled.ring_tilt_across
    assert list(ways_of(filled)) == list(GIVES)
    twice = on(reducer, Housing(bolts=replace(bolts, count=24))).stiffness
    assert twice.ring_along == pytest.approx(2 * filled.ring_along)


def test_a_picture_shows_discs_in_the_housing_and_the_ring_where_it_is():
    reducer = load_reducer("rv20e")
    soft = on(reducer, soft_housing(5, reducer))
    model = EquivalentModel(soft)
    scene = scene_of(model, exact_unit(model)[0], -100.0, per_crank_turn=4)
    ring, states = scene.coordinates["ring"], scene.forward
    at = Positions(model.at_torque(-100.0).reducer, scene.carrier_angle)
    contact, amounts = pin_contact(at), reducer.modification
    rows, undisturbed = contact.by_disc, -amounts.equidistant - amounts.shift * contact.by_pin[:, :, 0]
    for disc in range(reducer.disc_count):
        first = scene.coordinates["disc"][disc]
        away = states.displacement[:, first : first + 2] - states.displacement[:, ring[disc] : ring[disc] + 2]
        compression = np.einsum("axp,ax->ap", rows[:, disc, :2], away) + undisturbed[:, disc]
        compression += rows[:, disc, 2] * states.displacement[:, first + 2, np.newaxis]
        assert np.allclose(compression, -states.gap[:, disc], atol=1e-12)
        assert np.abs(states.displacement[:, ring[disc]]).max() > 1e-7
    record = scene_record(scene)
    assert abs(Pose(record, 0.3).ring(0)) > 0.0
    still = scene_of(EquivalentModel(reducer), exact_unit(model)[0], -1.0, per_crank_turn=2)
    assert Pose(scene_record(still), 0.3).ring(0) == 0


def test_forces_in_the_ring_do_the_work_that_its_way_takes():
    reducer = on(load_reducer("rv20e"), Housing(turn=3e6, tilt_along=1e5, direction=0.3))
    shares = {own.part: own.share for own in twist_shares(reducer)}
    assert shares["ring turn"] > 0.01
    assert shares["ring tilt along"] > 0.001
    turned = reducer.load.rated_torque / reducer.housing.turn
    perfect = perfect_reducer(reducer, -reducer.load.rated_torque).equilibria
    whole = abs(float(perfect.transmission_error.mean()))
    assert shares["ring turn"] == pytest.approx(turned / whole, rel=0.05)  # the sun holds a share of 1/i of the torque


def test_a_ring_that_gives_is_not_moved_in_time():
    reducer = on(load_reducer("rv40e_xi2015"), Housing(turn=1e7))
    speed, torque = SpeedProfile.constant(1.0), SpeedProfile.constant(-572.0)
    with pytest.raises(InputError, match="a ring that gives is not moved in time"):
        motion_of(reducer, speed, torque, duration=0.1, steps=1)


TABLE = """
[housing]
turn_nm_per_arcmin = 4000
tilt_along_nm_per_arcmin = 150.0
direction_deg = 30
turn_per_tilt_along = 0.02

[housing.bolts]
count = 16
size_mm = 6
circle_diameter_mm = 120
grip_mm = 15
"""


def test_a_file_states_the_ring_in_its_units(tmp_path):
    path = tmp_path / "own.reducer.toml"
    path.write_text((PRESETS / "rv20e.reducer.toml").read_text() + TABLE)
    found = load_reducer(path)
    assert found.housing.turn == pytest.approx(4000 / ARCMINUTE)
    assert found.housing.direction == pytest.approx(np.pi / 6)
    assert found.housing.tilt_along == pytest.approx(150.0 / ARCMINUTE)
    assert found.stiffness.ring_along == found.stiffness.ring_across > 1e9
    assert found.stiffness.ring_turn == pytest.approx(found.housing.turn / 0.052**2)
    assert any("bolts" in said for said in found.assumptions)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("turn_nm_per_arcmin = -1", "housing.turn_nm_per_arcmin"),
        ("turn = 5", "housing.turn"),
        ("turn_per_tilt_along = 3", "housing.turn_per_tilt_along"),
        ("[housing.bolts]\ncount = 2\nsize_mm = 6\ncircle_diameter_mm = 120\ngrip_mm = 15", "housing.bolts.count"),
        ("direction_deg = 'up'", "housing.direction_deg"),
    ],
)
def test_a_file_that_states_it_wrongly_is_refused_by_name(tmp_path, line, said):
    path = tmp_path / "own.reducer.toml"
    path.write_text((PRESETS / "rv20e.reducer.toml").read_text() + "\n[housing]\n" + line)
    with pytest.raises(TolallocError, match=said.replace(".", r"\.")):
        load_reducer(path)
