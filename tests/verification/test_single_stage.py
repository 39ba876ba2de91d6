"""The single-stage drive: holes and output pins against exact geometry, a dense solution, and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from tests.builders import LINEAR_STAGE, reducer_file, refusal, unit_with
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.tooth_profile import normals
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import attribute, forces
from tolalloc.reducers.families.single_stage.design import SingleStageReducer
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer

RIGID = 1e11


@pytest.fixture(scope="module")
def drive() -> Reducer:
    return load_reducer(LINEAR_STAGE)


@pytest.fixture(scope="module")
def model(drive) -> EquivalentModel:
    return EquivalentModel(drive)


def random_unit(model: EquivalentModel, seed: int, size: float = 3e-6) -> np.ndarray:
    errors = size * np.random.default_rng(seed).standard_normal((1, len(model.columns)))
    errors[0, [name.endswith((".tilt.x", ".tilt.y", "rotation")) for name in model.columns]] = 0.0
    return errors + unit_with(model)


def rigid(drive: Reducer, gap: float = 0.0, count: int = 8) -> Reducer:
    """Return the drive with stiff bearings, so that discs and carrier turn about their centres alone."""
    stiff = replace(drive.stiffness, shaft_support=RIGID, eccentric_bearing=RIGID, carrier_bearing=RIGID)
    radius = drive.output_pins.pin_radius + drive.cycloid_stage.eccentricity + gap
    return replace(drive, stiffness=stiff, output_pins=replace(drive.output_pins, hole_radius=radius, count=count))


class Plain:
    """One unit at one carrier angle from its geometry alone, all parts as complex numbers in the housing's plane."""

    def __init__(self, model: EquivalentModel, errors: np.ndarray, angle: float) -> None:
        self.own, self.angle = dict(zip(model.columns, errors[0], strict=True)), angle
        self.drive, self.stage, self.pins = model.reducer, model.reducer.cycloid_stage, model.reducer.output_pins
        self.orders = model.orders

    def vector(self, name: str) -> complex:
        return complex(self.own[f"{name}.x"], self.own[f"{name}.y"])

    def wave(self, name: str, at: np.ndarray) -> np.ndarray:
        cosine, sine = (np.array([self.own[f"{name}.{own}{order}"] for order in self.orders]) for own in ("cos", "sin"))
        turned = np.multiply.outer(at, np.array(self.orders))
        return np.cos(turned) @ cosine + np.sin(turned) @ sine

    def pin_compressions(self, disc: int, x: complex, turn: float) -> np.ndarray:
        """Theory page (13) to (18) in complex numbers: what pin and tooth stand out along the common normal."""
        drive, stage, count = self.drive, self.stage, self.stage.pin_count
        place = 2 * np.pi * np.arange(count) / count
        direction = -stage.disc_teeth * self.angle + 2 * np.pi * disc / self.drive.disc_count
        pole = stage.eccentricity * count * np.exp(1j * direction)
        pin = stage.pin_circle_radius * np.exp(1j * place)
        into = (pole - pin) / np.abs(pole - pin)
        contact = pin + stage.pin_radius * into - stage.eccentricity * np.exp(1j * direction)
        along, across = np.exp(1j * place), 1j * np.exp(1j * place)
        single = np.array([self.vector(f"each_pin.position.{k + 1}") for k in range(count)])  # radial and tangential
        radial = self.wave("housing.runout", place) + single.real - self.own["modification.shift"]
        tangential = self.wave("housing.pitch", place) + single.imag
        size = self.own["pin.diameter"] - self.own["housing.groove.radius"] - self.own["modification.equidistant"]
        size += np.array(
            [self.own[f"each_pin.diameter.{k + 1}"] - self.own[f"each_pin.groove.{k + 1}"] for k in range(count)]
        )
        stands = ((radial * along + tangential * across) * into.conj()).real + size
        # Disc 2 stands as disc 1 does, turned by its phase and rolled back on the pins.
        polar = np.angle(contact) - self.angle + 2 * np.pi * disc / drive.disc_count / stage.disc_teeth
        name, number = (
            f"disc{disc + 1}",
            np.floor((polar % (2 * np.pi)) * stage.disc_teeth / (2 * np.pi) + 1e-9).astype(int),
        )
        number %= stage.disc_teeth
        single_pitch = np.array([self.own[f"{name}.each_tooth.pitch.{t + 1}"] for t in number])
        single_runout = np.array([self.own[f"{name}.each_tooth.runout.{t + 1}"] for t in number])
        out = contact / np.abs(contact)
        tooth = (self.wave(f"{name}.runout", polar) + single_runout) * out
        tooth = tooth + (self.wave(f"{name}.pitch", polar) + single_pitch) * 1j * out
        moved = x + 1j * turn * contact
        return stands - ((tooth + moved) * into.conj()).real

    def forces(self, q: np.ndarray, torque: float) -> np.ndarray:
        """Forces and moments that are left on shaft, discs and carrier [N, N·m]."""
        drive, spring, angle = self.drive, self.drive.stiffness, self.angle
        shaft, discs, carrier, output = complex(*q[:2]), q[2:-3].reshape(-1, 3), complex(*q[-3:-1]), q[-1]
        left_shaft = -spring.shaft_support * (shaft - self.vector("shaft.assembly"))
        left_carrier, moment = -spring.carrier_bearing * (carrier - self.vector("carrier.assembly")), torque
        left = []
        with_carrier = np.exp(1j * angle)
        places = self.pins.circle_radius * np.exp(
            1j * (angle + 2 * np.pi * np.arange(self.pins.count) / self.pins.count)
        )
        for disc, (x, y, turn) in enumerate(discs):
            centre, name = complex(x, y), f"disc{disc + 1}"
            direction = np.exp(1j * (-self.stage.disc_teeth * angle + 2 * np.pi * disc / drive.disc_count))
            journal = self.vector(f"shaft.journal{disc + 1}.eccentricity") * np.exp(-1j * self.stage.disc_teeth * angle)
            way = shaft + journal - centre - self.vector(f"{name}.bore.position") * with_carrier
            force, own_moment = spring.eccentric_bearing * way, 0.0
            left_shaft -= spring.eccentric_bearing * way
            for pin, place in enumerate(places):
                stands = self.vector(f"output.pin.position.{pin + 1}") - self.vector(f"{name}.hole.position.{pin + 1}")
                # The pin seen from the middle of its hole, and how far it lies inside the wall.
                seen = carrier + 1j * output * place - centre - 1j * turn * place
                seen = seen + stands * with_carrier - self.stage.eccentricity * direction
                room = self.pins.hole_radius - self.pins.pin_radius
                room += self.own[f"{name}.hole.radius.{pin + 1}"] - self.own[f"output.pin.radius.{pin + 1}"]
                pressed = max(abs(seen) - room, 0.0) * spring.output_pin * seen / abs(seen)
                force, own_moment = force + pressed, own_moment + (pressed * (1j * place).conjugate()).real
                left_carrier, moment = left_carrier - pressed, moment - (pressed * (1j * place).conjugate()).real
            compression = np.maximum(self.pin_compressions(disc, centre, turn), 0.0) * spring.pin_contact
            into, contact = self.normals(disc)
            force += (compression * into).sum()
            own_moment += (compression * (into * (1j * contact).conj()).real).sum()
            left += [force.real, force.imag, own_moment]
        return np.array([left_shaft.real, left_shaft.imag, *left, left_carrier.real, left_carrier.imag, moment])

    def normals(self, disc: int) -> tuple[np.ndarray, np.ndarray]:
        stage, count = self.stage, self.stage.pin_count
        direction = np.exp(1j * (-stage.disc_teeth * self.angle + 2 * np.pi * disc / self.drive.disc_count))
        pin = stage.pin_circle_radius * np.exp(2j * np.pi * np.arange(count) / count)
        pole = stage.eccentricity * count * direction
        into = (pole - pin) / np.abs(pole - pin)
        return into, pin + stage.pin_radius * into - stage.eccentricity * direction


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("torque", [-1.0, -60.0, 60.0])
def test_equilibria_balance_all_forces_of_the_plain_geometry(model, seed, torque):
    """Independent forces vanish where the model says, and a root finder that starts nearby ends within 1e-6″ of it."""
    errors, angle = random_unit(model, seed), 0.7 + seed
    found = model.equilibria(errors, torque, np.array([angle]))
    assert found.status.max() == 0
    own, retained = Plain(model, errors, angle), found.retained[0, 0]
    lever = np.ones(retained.size)
    lever[2:-3:3], lever[-1] = model.reducer.cycloid_stage.disc_pitch_radius, model.reducer.output_pins.circle_radius
    q = retained / lever
    spring = model.reducer.stiffness
    journals = sum(
        complex(*q[3 * disc : 3 * disc + 2])
        + own.vector(f"disc{disc + 1}.bore.position") * np.exp(1j * angle)
        - own.vector(f"shaft.journal{disc + 1}.eccentricity") * np.exp(-29j * angle)
        for disc in range(2)
    )
    shaft = spring.eccentric_bearing * journals + spring.shaft_support * own.vector("shaft.assembly")
    shaft /= 2 * spring.eccentric_bearing + spring.shaft_support
    start = np.array([shaft.real, shaft.imag, *q])
    scale = np.array([*[1.0] * 2, *[1.0, 1.0, 0.03] * 2, 1.0, 1.0, 0.03])
    assert np.abs(own.forces(start, torque) / scale).max() < 1e-6 * abs(torque) / 0.024
    again = root(lambda x: own.forces(x * 1e-6, torque) / scale, start * 1e6, tol=1e-13).x * 1e-6
    assert abs(again[-1] - found.transmission_error[0, 0]) < 1e-6 * ARCSECOND


def test_pins_of_the_housing_are_those_of_the_shared_formula(model):
    """The complex numbers above and the package's normals say one thing."""
    own = Plain(model, unit_with(model), 0.3)
    into, contact = own.normals(0)
    stage = model.reducer.cycloid_stage
    direction = -stage.disc_teeth * 0.3
    shared = normals(stage.shortening, 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count - direction)
    lever = (into * (1j * contact).conj()).real
    np.testing.assert_allclose(-stage.disc_pitch_radius * shared.lever, lever, atol=1e-15)


def test_a_pattern_of_pins_or_holes_that_is_turned_turns_the_output(drive):
    """Tangential errors t of all pins turn the output back by t/a, those of all holes forward."""
    model = EquivalentModel(drive)
    around = 2 * np.pi * np.arange(8) / 8
    tangent = {"x": -np.sin(around), "y": np.cos(around)}
    at, before = np.array([0.4]), model.equilibria(unit_with(model), -20.0, np.array([0.4])).transmission_error
    for names, sign in ((["output.pin"], -1.0), (["disc1.hole", "disc2.hole"], 1.0)):
        moved = {
            f"{name}.position.{pin + 1}.{axis}": 4e-6 * float(way[pin])
            for name in names
            for pin in range(8)
            for axis, way in tangent.items()
        }
        after = model.equilibria(unit_with(model, **moved), -20.0, at).transmission_error
        assert (after - before)[0, 0] == pytest.approx(sign * 4e-6 / drive.output_pins.circle_radius, rel=1e-9)


def test_holes_without_room_share_the_torque_as_sines(drive):
    """F = 4T/(n·a) of the pin across the eccentric and sines beside it, T the torque of one disc (Malhotra)."""
    own = rigid(drive)
    own = replace(own, stiffness=replace(own.stiffness, pin_contact=RIGID))
    model = EquivalentModel(own)
    angle = 0.0  # disc 1's eccentric points at pin 1
    found = forces(model.equilibria(np.zeros((1, len(model.columns))), -40.0, np.array([angle])))
    pins = found.of("output_pin")[0, 0, :8]
    across = np.sin(2 * np.pi * np.arange(8) / 8)
    expected = 4 * 20.0 / (8 * own.output_pins.circle_radius) * np.maximum(-across, 0.0)
    np.testing.assert_allclose(np.sort(pins), np.sort(expected), atol=0.02 * expected.max())


@pytest.mark.parametrize("gap", [2e-6, 10e-6])
def test_room_in_the_holes_is_lost_motion(drive, gap):
    """Of n pins, the best placed one of either disc touches after gap/(a·|sin|) of rotation, either way."""
    around = 2 * np.pi * np.arange(8) / 8
    for angle in (0.0, 0.011):
        twist = []
        for room in (0.0, gap):
            model = EquivalentModel(rigid(drive, room))
            found = [model.equilibria(unit_with(model), torque, np.array([angle])) for torque in (-0.05, 0.05)]
            twist.append(float(np.diff([own.transmission_error[0, 0] for own in found])[0]))
        direction = [-29 * angle, -29 * angle + np.pi]
        best = [max(np.sin(side * (around + angle - own)).max() for own in direction) for side in (1, -1)]
        free = sum(gap / (drive.output_pins.circle_radius * own) for own in best)
        assert abs(twist[1] - twist[0]) == pytest.approx(free, rel=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_are_those_of_differences(model, seed):
    errors, at, step = random_unit(model, seed), np.array([0.3, 2.1]), 1e-9
    _, exact = model.rotation_derivatives(errors, -20.0, at)
    slopes = exact.by_error.reshape(1, 2, -1)
    names = ["output.pin.position.3.x", "disc1.hole.position.5.y", "disc2.hole.radius.2", "output.pin.radius.6"]
    for name in (*names, "shaft.journal1.eccentricity.x", "disc2.bore.position.y", "shaft.assembly.x", "pin.diameter"):
        column = model.columns.index(name)
        moved = np.repeat(errors, 2, axis=0)
        moved[:, column] += [-step, step]
        low, high = model.equilibria(moved, -20.0, at).transmission_error
        difference = (high - low) / (2 * step)
        np.testing.assert_allclose(slopes[0, :, column], difference, rtol=2e-4, atol=2e-4)


def test_what_every_source_adds_sums_to_the_curve(model):
    errors = random_unit(model, 5)
    found = attribute(model, errors, -20.0)
    curve = model.equilibria(errors, -20.0).transmission_error[0]
    np.testing.assert_allclose(found.contribution.sum(axis=0), curve, atol=1e-3 * ARCSECOND)


@pytest.mark.parametrize(
    ("line", "wrong", "says"),
    [
        ("hole_radius_mm = 5.0005", "hole_radius_mm = 4.9", "hole_radius_mm is 4.9; allowed is pin_radius_mm plus"),
        ("hole_radius_mm = 5.0005", "hole_radius_mm = 6", "hole_radius_mm is 6; allowed is pin_radius_mm plus"),
        ("count = 8", "count = 16", "where holes meet each other or the teeth"),
        ("count = 8", "count = 2", "count"),
        ("shaft_support = 5e7", "sun_support = 5e7", "sun_support"),
        ("disc_count = 2", "disc_count = 2\ncrank_count = 2", "crank_count"),
        ("[load]", "[clearances]\ngear_mesh_um = 3\n[load]", "gear_mesh_um"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path, line, wrong, says):
    assert says in refusal(load_reducer, reducer_file(tmp_path / "own.reducer.toml", "cd29", (line, wrong)))


def test_what_only_an_rv_reducer_has_is_refused_in_one_sentence(drive):
    with pytest.raises(InputError, match="a single stage has neither sun nor planets"):
        _ = drive.gears
    with pytest.raises(InputError, match="has no output pins"):
        SingleStageReducer.of(load_reducer("rv20e"))
