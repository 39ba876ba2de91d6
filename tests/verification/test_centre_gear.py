"""The RV reducer with centre gear and hollow shaft: a dense solution from its geometry, closed forms, and limits."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from tests.builders import at_constant_contact, order_spectrum, reducer_file, refusal, unit_with
from tolalloc.exceptions import TolallocError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.tooth_profile import normals
from tolalloc.reducers.equivalent.friction import friction_torques
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved, forces
from tolalloc.reducers.equivalent.perfect import perfect_reducer
from tolalloc.reducers.families.centre_gear.design import CentreGearClearances, CentreGearReducer
from tolalloc.reducers.reducer.bearings import loss_factor
from tolalloc.reducers.reducer.design import Reducer, interface_forces
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.motion.motion import inertia_of

RIGID = 1e13
VECTORS = (
    *("pinion.eccentricity", "centre.eccentricity", "sun.eccentricity", "sun.assembly", "carrier.assembly"),
    *(f"planet{i}.eccentricity" for i in (1, 2)),
    *(f"carrier.bore{i}.position" for i in (1, 2)),
    *(f"crank{i}.journal{j}.eccentricity" for i in (1, 2) for j in (1, 2)),
    *(f"disc{j}.bore{i}.position" for i in (1, 2) for j in (1, 2)),
)
NUMBERS = ("mesh1.deviation", "mesh2.deviation", "pin.diameter", "housing.groove.radius")


@pytest.fixture(scope="module")
def reducer() -> Reducer:
    """Return the preset with springs of one stiffness each, so that a plain sum of forces is its equal."""
    return replace(at_constant_contact(load_reducer("rv27c")), parts=())


@pytest.fixture(scope="module")
def model(reducer) -> EquivalentModel:
    return EquivalentModel(reducer)


def random_unit(model: EquivalentModel, seed: int) -> np.ndarray:
    names = [f"{name}.{axis}" for name in VECTORS for axis in "xy"] + list(NUMBERS)
    return unit_with(
        model, **dict(zip(names, 4e-6 * np.random.default_rng(seed).standard_normal(len(names)), strict=True))
    )


def rigid(reducer: Reducer) -> Reducer:
    """Return the reducer whose centre gear stands in a rigid bearing."""
    return replace(reducer, stiffness=replace(reducer.stiffness, sun_support=RIGID))


class Plain:
    """One unit at one carrier angle: rigid bodies and springs at points of theirs, as complex numbers in the plane."""

    def __init__(self, model: EquivalentModel, errors: np.ndarray, angle: float) -> None:
        self.own, self.angle, self.drive = dict(zip(model.columns, errors[0], strict=True)), angle, model.reducer

    def vector(self, name: str, turned: float = 0.0) -> complex:
        return complex(self.own[f"{name}.x"], self.own[f"{name}.y"]) * np.exp(1j * turned)

    def forces(self, q: np.ndarray, torque: float, glued: float = 0.0) -> np.ndarray:
        """Forces and moments left on centre gear, planets, discs and carrier [N, N·m]; glued pins pull over gaps."""
        drive, spring = self.drive, self.drive.stiffness
        body = q.reshape(-1, 3)
        left = np.zeros_like(body)
        left[-1, 2] = torque
        sun, planets, discs, carrier = 0, (1, 2), (3, 4), 5

        def way(number: int, at: complex) -> complex:
            return complex(body[number, 0], body[number, 1]) + 1j * body[number, 2] * at

        def push(number: int, at: complex, force: complex) -> None:
            left[number] += [force.real, force.imag, (force * (1j * at).conjugate()).real]

        stage, first, gear = drive.cycloid_stage, drive.first_stage, drive.centre_gear
        crank = -stage.disc_teeth * self.angle
        turns = 1 + first.planet_teeth / first.sun_teeth * stage.pin_count
        on_sun, on_pinion = turns * self.angle, -gear.teeth / gear.pinion_teeth * turns * self.angle
        push(sun, 0, -spring.sun_support * (way(sun, 0) - self.vector("sun.assembly")))
        # The pinion's tooth pushes the rim at the right of the centre gear upwards, and away from itself.
        along, rim = np.exp(1j * (np.pi / 2 + gear.pressure_angle)), gear.module * gear.teeth / 2
        ahead = self.vector("pinion.eccentricity", on_pinion) - self.vector("centre.eccentricity", on_sun)
        pressed = spring.centre_mesh * ((ahead - way(sun, rim)) * along.conjugate()).real
        push(sun, rim, pressed * along)
        for number, planet in enumerate(planets, start=1):
            direction = np.exp(1j * (self.angle + np.pi * (number - 1)))
            along = direction * np.exp(1j * (np.pi / 2 - first.pressure_angle))
            rim, other = (
                first.module * first.sun_teeth / 2 * direction,
                -first.module * first.planet_teeth / 2 * direction,
            )
            ahead = way(sun, rim) + self.vector("sun.eccentricity", on_sun) - way(planet, other)
            ahead -= self.vector(f"planet{number}.eccentricity", crank)
            pressed = spring.gear_mesh * ((ahead * along.conjugate()).real + self.own[f"mesh{number}.deviation"])
            push(sun, rim, -pressed * along)
            push(planet, other, pressed * along)
            place = first.module * (first.sun_teeth + first.planet_teeth) / 2 * direction
            held = way(planet, 0) - way(carrier, place) - self.vector(f"carrier.bore{number}.position", self.angle)
            push(planet, 0, -spring.crank_carrier_bearing * held)
            push(carrier, place, spring.crank_carrier_bearing * held)
            for disc in (1, 2):
                journal = stage.eccentricity * np.exp(1j * (crank + np.pi * (disc - 1)))
                held = way(planet, journal) + self.vector(f"crank{number}.journal{disc}.eccentricity", crank)
                held -= way(discs[disc - 1], place) + self.vector(f"disc{disc}.bore{number}.position", self.angle)
                push(planet, journal, -spring.crank_disc_bearing * held)
                push(discs[disc - 1], place, spring.crank_disc_bearing * held)
        push(carrier, 0, -spring.carrier_bearing * (way(carrier, 0) - self.vector("carrier.assembly")))
        larger = self.own["pin.diameter"] - self.own["housing.groove.radius"] - self.own["modification.equidistant"]
        pins = np.exp(2j * np.pi * np.arange(stage.pin_count) / stage.pin_count)
        for disc in (1, 2):
            centre = stage.eccentricity * np.exp(1j * (crank + np.pi * (disc - 1)))
            pole = stage.pin_count * centre
            for pin in pins:
                into = pole - stage.pin_circle_radius * pin
                into /= abs(into)
                at = stage.pin_circle_radius * pin + stage.pin_radius * into - centre
                # All pins of one size on a circle that is ground narrower: outward is away from the disc.
                stands = larger - self.own["modification.shift"] * (pin * into.conjugate()).real
                deep = stands - (way(discs[disc - 1], at) * into.conjugate()).real
                push(discs[disc - 1], at, spring.pin_contact * (deep if deep > 0 else glued * deep) * into)
        return left.ravel()

    def solved(self, torque: float) -> np.ndarray:
        """Return the coordinates in equilibrium by Newton's method on differences, the glue let go step by step."""
        q = np.zeros(18)
        for glued in (*0.1 ** np.arange(0.0, 7.0, 0.5), 0.0):
            for _ in range(30):
                left = self.forces(q, torque, glued)
                slope = np.stack([self.forces(q + 1e-9 * e, torque, glued) - left for e in np.eye(18)], axis=1) / 1e-9
                change = np.linalg.solve(slope, left)
                q = q - change
                if np.abs(change).max() < 1e-14:
                    break
        assert np.abs(self.forces(q, torque)).max() < 1e-6  # [N, N·m]
        return q


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("torque", [-1.0, -265.0, 265.0])
def test_the_error_is_that_of_a_dense_balance_of_forces(model, seed, torque):
    """Bodies, levers and pitch points written anew: no row and no coefficient of the package stands in them."""
    errors, angle = random_unit(model, seed), 0.7 + seed
    found = model.equilibria(errors, torque, np.array([angle]))
    assert found.status.max() == 0
    q = Plain(model, errors, angle).solved(torque)
    assert abs(q[-1] - found.transmission_error[0, 0]) < 1e-6 * ARCSECOND


def test_normals_of_the_pins_are_those_of_the_shared_formula(reducer):
    stage, pin = reducer.cycloid_stage, np.exp(0.4j)
    into = stage.eccentricity * stage.pin_count - stage.pin_circle_radius * pin
    shared = normals(stage.shortening, np.array([0.4]))
    assert np.angle(into) == pytest.approx(float(np.arctan2(shared.towards_tangent, shared.towards_crank)[0]))


@pytest.mark.parametrize(("part", "sign"), [("pinion", 1.0), ("centre", -1.0)])
def test_an_eccentricity_turns_the_output_by_itself_over_base_radius_and_ratio(model, part, sign):
    """θ = ±n·R(θ_gear)·ε/(r_b4·i_s): amplitude e/(r_b4·i_s), as many waves as the gear has turns in the housing."""
    reducer, at, size = model.reducer, np.linspace(0.0, 2 * np.pi, 200), 8e-6
    before = model.equilibria(unit_with(model), -20.0, at).transmission_error[0]
    after = model.equilibria(unit_with(model, **{f"{part}__eccentricity__x": size}), -20.0, at).transmission_error[0]
    sun = 1 + 26 / 38 * 52
    order = sun * -72 / 24 if part == "pinion" else sun
    amplitude = size / (0.045 * np.cos(np.radians(20)) * sun)
    expected = sign * amplitude * np.cos(order * at - np.radians(110))
    np.testing.assert_allclose(after - before, expected, atol=1e-6 * amplitude)
    assert reducer.ratio == pytest.approx(sun * -3)
    if part == "pinion":  # the same over the pinion's base radius and the whole ratio
        assert amplitude == pytest.approx(size / (0.015 * np.cos(np.radians(20)) * abs(reducer.ratio)))


def test_orders_are_turns_of_the_gears_per_turn_of_the_output(reducer):
    own = replace(reducer, first_stage=replace(reducer.first_stage, sun_teeth=26))  # 53 turns of the sun
    model, at = EquivalentModel(own), 2 * np.pi * np.arange(960) / 960
    before = model.equilibria(unit_with(model), -20.0, at).transmission_error
    for part, order in (("centre", 53), ("pinion", 159)):
        after = model.equilibria(unit_with(model, **{f"{part}__eccentricity__y": 8e-6}), -20.0, at).transmission_error
        found = order_spectrum(after - before)
        assert int(found.order[np.argmax(found.amplitude[0])]) == order
        assert found.amplitude[0].max() == pytest.approx(8e-6 / (own.centre_gear.base_radius * 53), rel=1e-9)


def test_a_rigid_centre_gear_leaves_the_reducer_without_one(reducer):
    stiff = rigid(replace(reducer, stiffness=replace(reducer.stiffness, centre_mesh=RIGID)))
    without = Reducer(**{own.name: getattr(stiff, own.name) for own in fields(Reducer)})
    at, found = np.linspace(0.0, 6.0, 7), []
    for own in (stiff, without):
        model = EquivalentModel(own)
        values = {"sun__eccentricity__x": 9e-6, "crank1__journal1__eccentricity__y": 4e-6}
        found.append(model.equilibria(unit_with(model, **values), -50.0, at).transmission_error)
    np.testing.assert_allclose(found[0], found[1], atol=1e-4 * ARCSECOND)


def test_the_mesh_yields_as_statics_say(reducer):
    """T/(K·r_b4²·i_s²) is what the output gives way more where the pair of gears is no more rigid."""
    own, torque, at, found = rigid(reducer), -265.0, np.array([0.3]), []
    for stiffness in (own.stiffness.centre_mesh, RIGID):
        model = EquivalentModel(replace(own, stiffness=replace(own.stiffness, centre_mesh=stiffness)))
        found.append(float(model.equilibria(unit_with(model), torque, at).transmission_error[0, 0]))
    lever = own.centre_gear.base_radius * own.sun_ratio
    expected = torque / lever**2 * (1 / own.stiffness.centre_mesh - 1 / RIGID)
    assert found[0] - found[1] == pytest.approx(expected, rel=1e-6)
    solved = EquivalentModel(own).equilibria(unit_with(EquivalentModel(own)), torque, at)
    assert float(forces(solved).of("centre_mesh")[0, 0, 0]) == pytest.approx(
        interface_forces(own, torque)["centre_mesh"], rel=1e-9
    )


@pytest.mark.parametrize("clearance", [5e-6, 30e-6])
def test_backlash_of_the_mesh_is_lost_motion_over_the_ratio(reducer, clearance):
    own, twist = rigid(reducer), []
    for gap in (0.0, clearance):
        played = replace(own, clearances=CentreGearClearances(centre_mesh=gap))
        model = EquivalentModel(played)
        ends = [model.equilibria(unit_with(model), torque, np.array([0.3])) for torque in (-8.0, 8.0)]
        assert max(end.status.max() for end in ends) == 0
        twist.append(float(ends[1].transmission_error[0, 0] - ends[0].transmission_error[0, 0]))
    free = 2 * clearance / (own.centre_gear.base_radius * own.sun_ratio)
    assert twist[1] - twist[0] == pytest.approx(free, rel=1e-6)


def test_derivatives_are_those_of_differences(reducer):
    model = EquivalentModel(replace(reducer, clearances=CentreGearClearances(centre_mesh=6e-6)))
    errors, at, step = random_unit(model, 3), np.array([0.3, 2.1]), 1e-9
    _, exact = model.rotation_derivatives(errors, -20.0, at)
    for name in ("pinion.eccentricity.x", "centre.eccentricity.y", "centre.mesh.clearance", "sun.assembly.x"):
        moved = np.repeat(errors, 2, axis=0)
        moved[:, model.columns.index(name)] += [-step, step]
        low, high = model.equilibria(moved, -20.0, at).transmission_error
        own = exact.by_error.reshape(1, 2, -1)[0, :, model.columns.index(name)]
        np.testing.assert_allclose(own, (high - low) / (2 * step), rtol=2e-4, atol=2e-4)
        assert np.abs(own).max() > 1e-3


def test_friction_of_the_mesh_is_its_loss_factor_times_the_torque():
    """All power passes the pair once: µ·H_v·T of it at the output, beside the sun's mesh as without a centre gear."""
    reducer = load_reducer("rv27c")
    assert reducer.friction_dimensions.unknown == ()
    solved = perfect_reducer(reducer, -265.0)
    found = friction_torques(solved)["gear_mesh"]
    left = replace(reducer.friction_dimensions, centre_contact_ratio=0.0)
    plain = replace(solved.equilibria, reducer=replace(solved.equilibria.reducer, friction_dimensions=left))
    more = found - friction_torques(Solved(equilibria=plain, forces=solved.forces))["gear_mesh"]
    np.testing.assert_allclose(more, 0.06 * loss_factor(24, 72, 1.6) * 265.0, rtol=1e-6)


def test_a_shaft_of_the_pinion_yields_in_series_with_its_teeth(tmp_path):
    shaft = "pinion_support = { diameter_mm = 15, length_mm = 25 }"
    alone = load_reducer(reducer_file(tmp_path / "own.reducer.toml", "rv27c", (f"{shaft}\n", ""))).stiffness.centre_mesh
    given = load_reducer(
        reducer_file(tmp_path / "own.reducer.toml", "rv27c", (shaft, "pinion_support = 5e7"))
    ).stiffness.centre_mesh
    # ISO 6336-1 of 24 and 72 teeth, contact ratio 1.6, 10 mm wide
    assert alone == pytest.approx(1.45 / (0.04723 + 0.15551 / 24 + 0.25791 / 72) * 1e7, rel=1e-12)
    assert given == pytest.approx(1 / (1 / alone + 1 / 5e7), rel=1e-12)
    bent = 3 * np.pi * 0.015**4 * 206e9 / (64 * 0.025**3)
    assert load_reducer("rv27c").stiffness.centre_mesh == pytest.approx(1 / (1 / alone + 1 / bent), rel=1e-12)


@pytest.mark.parametrize(
    ("line", "wrong", "says"),
    [
        ("pinion_teeth = 24", "pinion_teeth = 4", "centre_gear.pinion_teeth is 4"),
        ("centre_mesh = { contact_ratio = 1.6, face_width_mm = 10 }\n", "", "centre_mesh"),
        ("face_width_mm = 10 }", "face_width_mm = 10, sun_virtual_teeth = 30 }", "sun_virtual_teeth"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path, line, wrong, says):
    assert says in refusal(load_reducer, reducer_file(tmp_path / "own.reducer.toml", "rv27c", (line, wrong)))


def test_what_knows_no_centre_gear_says_so_in_one_sentence(reducer):
    with pytest.raises(TolallocError, match="a centre gear is not moved in time"):
        inertia_of(reducer)
    with pytest.raises(TolallocError, match=r"this needs a table \[centre_gear\]"):
        CentreGearReducer.of(load_reducer("rv20e"))
