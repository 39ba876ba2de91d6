"""Friction by contact and the loop that it makes, against numbers by hand and a stick-slip integration."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import prepared, reducer_file, seeded_units, unit_with
from tests.printed_tables import printed, row
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.friction import (
    FrictionAtTorque,
    PlayOperator,
    friction_loop,
    friction_torques,
    sliding_ways,
    twist_of_friction,
)
from tolalloc.reducers.equivalent.hysteresis import DRAWN, TURN_ANGLES, hysteresis_loop, loop_torques
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved
from tolalloc.reducers.equivalent.perfect import preload
from tolalloc.reducers.reducer.bearings import CONTACTS, CRANK_BEARINGS, Friction, loss_factor
from tolalloc.reducers.reducer.design import Clearances
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.idle_torque import IdleTorque

ANGLES = TURN_ANGLES[::3]
NONE = Friction(**dict.fromkeys(CONTACTS, 0.0), seals=0.0, grease=0.0)


def ground(reducer):
    """The model and its one unit without part errors, teeth modified as designed."""
    model = EquivalentModel(reducer)
    return model, unit_with(model)


def drawn_units(count):
    bound = prepared(reducer={"name": "rv20e"}, name="friction")
    kernel = bound.model.kernel
    return kernel.model, kernel.errors(seeded_units(bound.errors, count))


@pytest.mark.parametrize("contact_ratio", [1.0, 1.3, 1.5, 1.9, 2.0])
def test_the_loss_of_a_mesh_is_that_of_its_path_of_contact(contact_ratio):
    """Pairs slide by their way from the pitch point times the sum of both speeds, and share the force alike."""
    first, second, module, angle = 10, 38, 1.75e-3, np.deg2rad(20)
    pitch = np.pi * module * np.cos(angle)
    way = np.linspace(-contact_ratio / 2, contact_ratio / 2, 200001)[1:-1] * pitch
    pairs = sum(np.abs(way + pitch * other) < contact_ratio / 2 * pitch for other in (-2, -1, 0, 1, 2))
    radii = [module * teeth * np.cos(angle) / 2 for teeth in (first, second)]
    slid = np.trapezoid(np.abs(way) / pairs, way) * sum(1 / radius for radius in radii)
    assert slid / pitch == pytest.approx(loss_factor(first, second, contact_ratio), rel=1e-4)


def test_one_bearing_and_one_mesh_by_hand():
    """RV-20E: two cranks at 27 mm, bearings on 13.4 mm that turn 40 times as fast as the output, 167 N·m."""
    model, errors = ground(load_reducer("rv20e"))
    found = FrictionAtTorque.of(Solved.of(model.equilibria(errors, -167.0, ANGLES)))
    assert found.by_contact["crank_carrier_bearing"][0] == pytest.approx(
        2 * 0.0018 * 167.0 / (2 * 0.027) * 0.0134 / 2 * 40, rel=0.02
    )
    assert found.by_contact["gear_mesh"][0] == pytest.approx(
        0.06 * np.pi * (1 / 10 + 1 / 26) * 0.625 * 167.0 * 104 / 105, rel=1e-6
    )
    assert found.by_contact["carrier_bearing"][0] > 0.002 * 520 * 0.0936 / 2
    total = sum(torque[0] for torque in found.by_contact.values())
    assert found.efficiency[0] == pytest.approx(167.0 / (167.0 + total), rel=1e-12)


def test_needles_under_interference_rub_without_a_force():
    reducer = load_reducer("rv20e")
    model, errors = ground(reducer)
    solved = Solved.of(model.equilibria(errors, -167.0, ANGLES[:2]))
    tight = replace(reducer.friction_dimensions.crank_disc_bearing, clearance=-4e-6)
    dimensions = replace(reducer.friction_dimensions, crank_disc_bearing=tight)
    pressed = replace(solved.equilibria, reducer=replace(reducer, friction_dimensions=dimensions))
    more = friction_torques(replace(solved, equilibria=pressed))["crank_disc_bearing"]
    needle = 35948.0 * 7.0 ** (8 / 9) * 0.002 ** (10 / 9)  # 13 of 7 mm, each pressed by 2 µm, in four bearings
    np.testing.assert_allclose(
        more - friction_torques(solved)["crank_disc_bearing"], 0.0025 * 4 * 13 * needle * 0.0134 / 2 * 40, rtol=1e-9
    )


def test_friction_at_pins_is_that_of_the_preload():
    model, units = drawn_units(3)
    torque = -1e-4 * model.reducer.load.rated_torque
    found = friction_torques(Solved.of(model.at_torque(torque).equilibria(units, torque, TURN_ANGLES)))
    np.testing.assert_allclose(found["pins"].max(axis=1), preload(model, units).friction_torque, rtol=1e-12)


def test_a_disc_that_rolls_about_its_pole_slides_by_the_way_of_every_pin():
    reducer = load_reducer("rv80e")
    angle, turned = np.array([0.3]), 1e-7
    way, stage = sliding_ways(reducer, angle)[0, 0], reducer.cycloid_stage
    crank = -stage.disc_teeth * angle[0]
    pole = stage.eccentricity * stage.pin_count * np.exp(1j * crank)
    pin = stage.pin_circle_radius * np.exp(2j * np.pi * np.arange(stage.pin_count) / stage.pin_count)
    contact = pin + stage.pin_radius * (pole - pin) / np.abs(pole - pin)
    moved = pole + (contact - pole) * np.exp(1j * turned) - contact
    np.testing.assert_allclose(np.abs(moved) / turned, way, rtol=1e-6)


def stick_slip(path, friction):
    """What the spring feels by steps: it yields as fast as the torque exceeds what friction holds."""
    felt, found = 0.0, []
    for torque in path:
        for _ in range(12):
            excess, held = torque - felt, friction(felt)
            felt += 0.5 * (max(excess - held, 0.0) + min(excess + held, 0.0))
        found.append(felt)
    return np.array(found)


def test_the_play_operator_is_a_slow_stick_slip_motion():
    inside = np.linspace(-1.0, 1.0, 41)

    def friction(torque):
        return np.interp(torque, inside, 0.05 + 0.1 * np.abs(inside))

    corners = [0.0, 0.9, 0.3, 0.6, -0.9, -0.85, 0.5, 0.45, 0.9]
    path = np.concatenate([np.linspace(*ends, 400) for ends in pairwise(corners)])
    play = PlayOperator.of(inside, np.stack([friction(inside), 0.0 * inside]))
    found = play.follow(np.broadcast_to(path, (2, path.size)))
    np.testing.assert_allclose(found[0, 400:], stick_slip(path, friction)[400:], atol=1e-4)
    np.testing.assert_allclose(found[1], path, atol=1e-12)
    # Few steps are as good as many where the torque only rises or falls between them.
    few = play.follow(np.broadcast_to(np.array(corners), (2, len(corners))))
    np.testing.assert_allclose(few[0, 1:], found[0, 399::400], atol=1e-12)


def test_the_area_of_a_loop_is_the_work_of_friction():
    inside = np.linspace(-1.0, 1.0, 201)
    friction = 0.02 + 0.1 * np.abs(inside)
    down = np.linspace(0.9, -0.9, 20001)
    felt = PlayOperator.of(inside, friction[np.newaxis]).follow(np.concatenate([down, down[::-1]])[np.newaxis])[0]
    work = np.trapezoid(np.concatenate([down, down[::-1]]), felt**3)  # a spring whose twist is the cube of its torque
    lost = np.trapezoid(np.interp(felt, inside, friction) * np.sign(np.gradient(felt)), felt**3)
    assert work == pytest.approx(lost, rel=1e-3)
    assert work > 0.05


@pytest.mark.parametrize("play", [0.0, 2e-6])
def test_shares_of_the_twist_are_exact(play):
    """With all else rigid the discs' and the meshes' shares are the whole twist; no share ever falls."""
    stiff = 1e13
    reducer = replace(load_reducer("rv20e"), parts=(), clearances=Clearances(gear_mesh=play))
    rigid = ("crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing", "sun_support")
    held = dict.fromkeys(rigid, stiff)
    reducer = replace(reducer, stiffness=replace(reducer.stiffness, **held))
    model, errors = ground(reducer)
    solved = [
        Solved.of(model.equilibria(errors, torque, ANGLES[:4])) for torque in loop_torques(reducer, DRAWN).tolist()
    ]
    shares = twist_of_friction(solved)
    whole = np.array([each.equilibria.transmission_error.mean() for each in solved])
    np.testing.assert_allclose((shares.discs + shares.cranks)[0], whole - whole[0], rtol=0, atol=1e-3 * np.ptp(whole))
    assert (np.diff(shares.discs) > 0).all()
    assert (np.diff(shares.cranks) > 0).all()


def test_without_friction_the_branches_are_the_loop_without():
    model, errors = ground(replace(load_reducer("rv20e"), friction=NONE))
    loop, plain = friction_loop(model, errors, ANGLES), hysteresis_loop(model, errors, ANGLES, DRAWN)
    np.testing.assert_array_equal(loop.plain.twist, plain.twist)
    levels = np.isin(loop.torque, plain.torque)
    for branch in (loop.rising, loop.falling):
        np.testing.assert_allclose(branch[:, levels], plain.twist.mean(axis=2), rtol=0, atol=1e-15)
    np.testing.assert_allclose(loop.lost_motion, plain.lost_motion, atol=1e-15)
    np.testing.assert_allclose(loop.hysteresis_loss, 0.0, atol=1e-15)
    assert loop.rated.efficiency[0] == 1.0
    assert loop.no_load.friction_torque[0] == 0.0


def test_what_holds_the_output_is_the_gap_of_a_reversal_without_load():
    """A seal of 5 N·m alone: the loop without torque is as wide as the one without friction at ±5 N·m."""
    held = replace(NONE, seals=5.01)  # 3 % of the rated 167 N·m, at which the loop is solved
    model, errors = ground(replace(load_reducer("rv20e"), friction=held))
    loop = friction_loop(model, errors, ANGLES)
    assert loop.hysteresis_loss[0] == pytest.approx(loop.plain.lost_motion[0], rel=1e-9)
    still = friction_loop(ground(replace(load_reducer("rv20e"), friction=NONE))[0], errors, ANGLES)
    assert still.hysteresis_loss[0] == pytest.approx(0.0, abs=1e-15)
    # Little friction leaves the middles of the width, and with them the lost motion of a maker.
    assert friction_loop(
        ground(replace(load_reducer("rv20e"), friction=replace(NONE, seals=0.5)))[0], errors, ANGLES
    ).lost_motion[0] == pytest.approx(loop.plain.lost_motion[0], rel=0.01)


def test_grease_of_the_cranks_holds_what_the_meshes_yield():
    idle = IdleTorque.of(load_reducer("rv160e"))
    assert idle.at_output + idle.at_cranks == pytest.approx(idle.turning)
    assert idle.at_cranks > 4 * idle.grease_of_carrier
    slower = IdleTorque.of(load_reducer("rv160e"), 1.0)
    assert slower.grease < 0.5 * idle.grease
    assert slower.seals == idle.seals


@pytest.mark.parametrize("size", ["rv20e", "rv40e", "rv80e", "rv110e", "rv160e"])
def test_the_efficiency_at_rated_torque_is_that_of_rv_reducers(size):
    model, errors = ground(load_reducer(size))
    loop = friction_loop(model, errors, ANGLES)
    assert 0.80 < loop.rated.efficiency[0] < 0.92
    assert 0.1 < loop.lost_motion[0] / ARCMINUTE < 1.0
    assert (loop.falling >= loop.rising - 1e-15).all()
    assert loop.falling[0, -1] == pytest.approx(loop.rising[0, -1], abs=1e-15)
    assert loop.falling[0, 0] == pytest.approx(loop.rising[0, 0], abs=1e-15)
    # Inside the backlash nothing holds the carrier but friction, so it stays where the torque has left it.
    assert loop.hysteresis_loss[0] >= loop.plain.backlash[0]


def test_the_page_prints_what_friction_takes():
    head = (
        "| size | efficiency at rated torque [%] | torque without load: contacts, seals, grease [N·m] "
        "| lost motion with friction [′] | hysteresis loss [′] |"
    )
    rows = []
    for size in ("20", "40", "80", "110", "160"):
        reducer = load_reducer(f"rv{size}e")
        loop, idle = friction_loop(*ground(reducer), TURN_ANGLES), IdleTorque.of(reducer)
        torques = (loop.no_load.friction_torque[0], idle.seals, idle.grease)
        widths = (f"{own[0] / ARCMINUTE:.3f}" for own in (loop.lost_motion, loop.hysteresis_loss))
        efficiency = f"{100 * loop.rated.efficiency[0]:.1f}"
        rows.append(row(f"RV-{size}E", efficiency, ", ".join(f"{own:.2f}" for own in torques), *widths))
    assert printed("validation/catalogues.md", head) == rows


@pytest.mark.slow
def test_lost_motion_of_units_of_the_baseline_drawing():
    model, units = drawn_units(50)
    loop = friction_loop(model, units, ANGLES)
    assert (loop.lost_motion > 0.1 * ARCMINUTE).all()
    assert (loop.lost_motion < 1.0 * ARCMINUTE).all()
    assert (loop.falling >= loop.rising - 1e-15).all()
    # Units that press themselves turn heavily: their efficiency falls below what a sound one has.
    efficiency, idle = loop.rated.efficiency, loop.no_load.friction_torque
    assert np.corrcoef(efficiency, idle)[0, 1] < -0.8
    assert 0.88 < efficiency.max() < 0.92


@pytest.mark.slow
def test_outputs_with_friction_can_be_limited_where_dimensions_are_known():
    limits = {name: ta.Limit(upper=90.0) for name in (ta.EFFICIENCY, ta.LOST_MOTION_WITH_FRICTION, ta.HYSTERESIS_LOSS)}
    names = tuple(limits)
    model = prepared(reducer={"name": "rv20e"}, limits=limits).model
    assert model.outputs[-3:] == names
    response = model.reading((*names, ta.LOST_MOTION))
    found = response(np.zeros((1, len(model.columns))))
    kernel = model.kernel
    loop = friction_loop(kernel.model, kernel.errors(np.zeros((1, len(model.columns)))), TURN_ANGLES)
    values = (100 * loop.rated.efficiency, *(own / ARCMINUTE for own in (loop.lost_motion, loop.hysteresis_loss)))
    np.testing.assert_array_equal(found.values[0, :3], np.concatenate(values))
    assert found.values[0, 3] == model.reading((ta.LOST_MOTION,))(np.zeros((1, len(model.columns)))).values[0, 0]
    assert found.good.all()
    with pytest.raises(UnknownNameError, match="efficiency at rated torque"):
        _ = prepared(limits=limits).requirements
    with pytest.raises(ValueError, match=r"RV-20E: no dimensions of crank_disc_bearing, .*gear_mesh"):
        friction_loop(*ground(load_reducer("rv20e_liu2020")), ANGLES)


def test_a_file_states_its_own_coefficients(tmp_path):
    path = reducer_file(tmp_path / "mine.toml", "rv20e", added="\n[friction]\npins = 0.1\n")
    assert load_reducer(path).friction == Friction(pins=0.1)
    reducer_file(path, "rv20e", added="\n[friction]\npins = 0.6\n")
    with pytest.raises(InputError, match=r"friction\.pins is 0\.6"):
        load_reducer(path)


def test_seals_grease_and_preload_by_hand():
    """RV-20E: an output bearing of 93.6 mm; needles on 13.4 mm turn at 600/min, where ν·n is 60,000 mm²/s/min."""
    reducer = load_reducer("rv20e")
    found, cranks = IdleTorque.of(reducer), 1e-10 * 60_000 ** (2 / 3) * 13.4**3 * 40
    assert found.seals == pytest.approx(0.4 * 100 * np.pi * 0.0936 * 0.0936 / 2)
    assert found.grease == pytest.approx((4 * 12 + 4 * 6) * cranks + 2 * 160e-10 * 93.6**3)
    model, errors = ground(reducer)
    pressed = friction_torques(Solved.of(model.equilibria(errors, -1e-6, ANGLES[:1])))
    bearings = sum(float(pressed[name][0, 0]) for name in (*CRANK_BEARINGS, "carrier_bearing"))
    assert found.preload == pytest.approx(bearings, rel=1e-4)


def test_a_file_states_what_seals_and_grease_take_and_a_catalogue_leaves_room_for_them(tmp_path):
    path = tmp_path / "mine.toml"
    reducer_file(path, "rv20e", added="\n[friction]\nseals_nm = 4.5\ngrease_nm = 0\n")
    found = IdleTorque.of(load_reducer(path))
    assert (found.seals, found.grease, found.turning) == (4.5, 0.0, 4.5)
    stated = ("[catalogue]", "[catalogue]\nno_load_torque_nm = 1.5")
    reducer_file(path, "rv20e", stated)
    with pytest.raises(InputError, match=r"no_load_torque_nm is 1\.5; allowed is more than 1\.6.*friction\.seals_nm"):
        load_reducer(path)
    reducer_file(path, "rv20e", stated, added="\n[friction]\nseals_nm = 0.1\n")
    assert load_reducer(path).catalogue.no_load_torque == 1.5


def test_a_seal_whose_size_no_bearing_tells_is_left_open():
    found = IdleTorque.of(load_reducer("rv20e_liu2020"))
    assert (found.seals, found.grease, found.together) == (None, 0.0, 0.0)
