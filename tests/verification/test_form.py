"""Free profiles, measured discs and round pins: held against the amounts, exact geometry and the model's own waves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.builders import prepared, reducer_file, refusal
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers import RADIAL_CLEARANCE
from tolalloc.reducers.cycloid.clearance import clearance_of, linear_clearance
from tolalloc.reducers.cycloid.loaded_contact import assess
from tolalloc.reducers.cycloid.measured_profile import MeasuredProfile, aligned, normal_deviations
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, normals, path_of
from tolalloc.reducers.equivalent.interfaces import pin_contact
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import radial_clearance
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.modification import ModificationRequest, choose
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.files import load_reducer, write_modified
from tolalloc.reducers.reducer.form import FlankForm, PartForm, PinForm, flank_form, load_designed
from tolalloc.reducers.transmission_error import transmission_error
from tolalloc.reducers.unit_file import BuiltUnit, load_unit
from tolalloc.wings.bench.ask.diagnose import Diagnose
from tolalloc.wings.bench.sources import has_half_turn
from tolalloc.wings.motion.prototype import mesh_of, part_errors
from tolalloc.wings.motion.solvers.pin_forces import pin_contacts

AMOUNTS = Modification(equidistant=-8.16e-6, shift=-16.16e-6)
NONE = Modification(equidistant=0.0, shift=0.0)
POINTS = 200  # of a tooth


def folded(angle: np.ndarray) -> np.ndarray:
    """Return φ on the flank from 0 to π."""
    return np.abs(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def sampled(reducer: Reducer, amounts: Modification, points: int = POINTS) -> FlankForm:
    """Return a designed form sampled from amounts."""
    angle = 2 * np.pi * np.arange(points) / points
    return flank_form(angle, -linear_clearance(reducer.cycloid_stage, amounts, folded(angle)), 1, 0, "sampled")


def disc_points(reducer: Reducer, amounts: Modification, points: int = POINTS) -> np.ndarray:
    """Return exact points of a whole disc, x + iy, with no error of its own."""
    stage = reducer.cycloid_stage
    angle = 2 * np.pi * np.arange(points * stage.disc_teeth) / points
    side = np.where(np.remainder(angle + np.pi, 2 * np.pi) < np.pi, -1.0, 1.0)
    space = np.rint((angle - side * folded(angle)) / (2 * np.pi))
    x, y = ToothProfile(stage=stage, modification=amounts).points(folded(angle)).T
    return np.asarray((x + 1j * side * y) * np.exp(-2j * np.pi * space / stage.disc_teeth))


def errors_of(model: EquivalentModel, *known: dict[str, float]) -> np.ndarray:
    """Return one row of errors, later ones before earlier ones."""
    together = {name: value for own in known for name, value in own.items()}
    return np.array([[together.get(name, 0.0) for name in model.columns]])


def curve(model: EquivalentModel, errors: np.ndarray, torque: float, angle: np.ndarray | None = None) -> np.ndarray:
    """Return a transmission error curve, which is found everywhere [arcsec]."""
    found = model.equilibria(errors, torque, angle).transmission_error[0] / ARCSECOND
    assert np.isfinite(found).all()
    return np.asarray(found)


@pytest.fixture(scope="module")
def reducer() -> Reducer:
    return load_reducer("rv20e_liu2020")


@pytest.mark.slow
@pytest.mark.parametrize("torque", [-1.0, -167.0])
def test_a_profile_sampled_from_amounts_has_their_transmission_error(reducer, torque):
    unit = load_unit("table4").deviations
    amounts = EquivalentModel(replace(reducer, modification=AMOUNTS))
    free = EquivalentModel(replace(reducer, modification=NONE, form=PartForm(designed=sampled(reducer, AMOUNTS))))
    known = errors_of(amounts, unit, AMOUNTS.deviations), errors_of(free, unit, NONE.deviations)
    assert amounts.columns == free.columns
    difference = curve(amounts, known[0], torque) - curve(free, known[1], torque)
    assert 0.0 < np.abs(difference).max() < 1e-3
    peaks = [model.exact_extremes(own, torque) for model, own in zip((amounts, free), known, strict=True)]
    assert peaks[0].peak_to_peak[0] / ARCSECOND == pytest.approx(peaks[1].peak_to_peak[0] / ARCSECOND, abs=1e-3)
    left = [radial_clearance(model, own)[0] for model, own in zip((amounts, free), known, strict=True)]
    assert left[0] == pytest.approx(left[1], abs=1e-12)


def test_the_spline_of_a_sampled_profile_converges_with_the_fourth_power(reducer):
    angle = np.linspace(0.4, 2.8, 97)
    exact = -linear_clearance(reducer.cycloid_stage, AMOUNTS, angle)
    coarse, fine = (np.abs(sampled(reducer, AMOUNTS, points).at(angle) - exact).max() for points in (100, 200))
    assert 12 < coarse / fine < 24


def test_clearance_and_contact_take_a_free_profile_like_the_amounts(reducer):
    free = replace(reducer, modification=NONE, form=PartForm(designed=sampled(reducer, AMOUNTS)))
    given = assess(replace(reducer, modification=AMOUNTS), -167.0, phases=6)
    found = assess(free, -167.0, phases=6)
    assert found.clearance.free_rotation == pytest.approx(given.clearance.free_rotation, rel=1e-4)
    assert found.clearance.radial == pytest.approx(AMOUNTS.radial_clearance, abs=1e-12)
    assert found.together.force.max() == pytest.approx(given.together.force.max(), rel=1e-4)
    assert found.profile.flank_clearance == pytest.approx(given.profile.flank_clearance, abs=1e-10)
    assert found.profile.tip_radius == pytest.approx(given.profile.tip_radius, abs=1e-12)


def test_a_free_profile_that_interferes_is_refused(reducer):
    thick = FlankForm(spaces=1, angle=(0.0, 1.5, 3.0, 4.5), deviation=(1e-6,) * 4)
    with pytest.raises(InputError, match="interference of 1 µm with the pin"):
        clearance_of(ToothProfile(stage=reducer.cycloid_stage, form=thick))


def test_normal_deviations_are_those_that_moved_the_points(reducer):
    stage, generator = reducer.cycloid_stage, np.random.default_rng(3)
    angle = generator.uniform(0.0, 2 * np.pi * stage.disc_teeth, 400)
    moved = generator.uniform(-2e-5, 2e-5, angle.size)
    path, slope, _ = path_of(stage, np.zeros((1, 2)), angle[np.newaxis])
    normal = -1j * slope[0] / np.abs(slope[0])
    found, deviation = normal_deviations(stage, path[0] + (stage.pin_radius - moved) * normal, "disc")
    assert found == pytest.approx(angle, abs=1e-9)
    assert deviation == pytest.approx(moved, rel=1e-9, abs=1e-16)


def exact_gap(reducer: Reducer, angle: float, lobes: tuple[int, float], waves: tuple[int, float]) -> np.longdouble:
    """Return the exact signed distance of a lobed pin from a wavy flank, by Newton's method in long numbers [m].

    The pin stands at φ with a lobe a·cos nχ, χ from its direction inward; the flank stands out by b·cos mφ.
    """
    stage, none = reducer.cycloid_stage, np.zeros((1, 2))
    radius = np.longdouble(stage.pin_radius)
    turn = -np.longdouble(angle) / stage.disc_teeth
    centre = path_of(stage, none, np.full((1, 1), angle, np.longdouble))[0][0, 0]
    order, amplitude, wave, height = *lobes, *waves

    def flank(at):
        path, slope, bend = (own[0, 0] for own in path_of(stage, none, np.full((1, 1), at, np.longdouble)))
        along = slope / abs(slope)
        curvature = (slope.conjugate() * bend).imag / abs(slope) ** 3
        left = radius - height * np.cos(wave * at)
        rising = height * wave * np.sin(wave * at)
        return path - 1j * left * along, slope + left * along * curvature * abs(slope) - 1j * rising * along

    def pin(at):
        own, rising = radius + amplitude * np.cos(order * at), -order * amplitude * np.sin(order * at)
        outward = -np.exp(1j * (turn + at))
        return centre + own * outward, (rising + 1j * own) * outward

    def misses(x):
        (place, along), (own, around) = flank(x[0]), pin(x[1])
        return np.array([(along.conjugate() * around).imag, ((place - own) * along.conjugate()).real]) / abs(along)

    into = normals(stage.shortening, np.array([angle]))
    x = np.array([angle, np.arctan2(into.across_radius[0], into.along_radius[0])], np.longdouble)
    step = np.longdouble(1e-6)
    for _ in range(30):
        miss = misses(x)
        a, b = ((misses(x + step * side) - misses(x - step * side)) / (2 * step) for side in np.eye(2))
        whole = a[0] * b[1] - a[1] * b[0]
        x = x - np.array([miss[0] * b[1] - miss[1] * b[0], a[0] * miss[1] - a[1] * miss[0]]) / whole
    (place, along), (own, _) = flank(x[0]), pin(x[1])
    return np.longdouble(((place - own) * (-1j * along / abs(along)).conjugate()).real)


@pytest.mark.parametrize(("lobes", "waves"), [((2, 1.0), (1, 0.0)), ((5, 1.0), (1, 0.0)), ((3, 0.7), (4, 1.0))])
def test_the_gap_of_lobed_pins_and_wavy_flanks_is_exact_to_first_order(reducer, lobes, waves):
    stage, small = reducer.cycloid_stage, 1e-9
    wave = 2 * np.pi * np.arange(4000) / 4000
    flank = FlankForm(
        spaces=1, angle=tuple(wave.tolist()), deviation=tuple((waves[1] * np.cos(waves[0] * wave)).tolist())
    )
    pins = tuple((pin, PinForm(waves=((lobes[0], lobes[1], 0.0),))) for pin in range(stage.pin_count))
    at = Positions(replace(reducer, form=PartForm(designed=flank, pins=pins)), np.array([0.011]))
    found = pin_contact(at).by_form[0, 0, 0]
    for pin in (2, 5, 9, 17, 26):
        angle = float(at.pin_direction[pin] - at.disc_direction(0)[0])
        either = [
            exact_gap(reducer, angle, (lobes[0], sign * small * lobes[1]), (waves[0], sign * small * waves[1]))
            for sign in (1, -1)
        ]
        linear = float((either[0] - either[1]) / (2 * np.longdouble(small)))
        assert -found[pin] == pytest.approx(linear, rel=1e-9, abs=1e-10)
        # What is beyond is slope²·R/2, a hundredth of 1 µm.
        large = exact_gap(reducer, angle, (lobes[0], 1e-6 * lobes[1]), (waves[0], 1e-6 * waves[1]))
        assert abs(float(large) + 1e-6 * found[pin]) < 1.2e-8


@pytest.mark.parametrize("disc", [1, 2])
def test_a_disc_measured_off_its_centre_has_run_out_and_pitch_of_order_one(reducer, disc, tmp_path):
    moved = 6e-6 * np.exp(0.7j)
    path = write(tmp_path / "disc.csv", disc_points(reducer, NONE) + moved)
    plain = replace(reducer, modification=NONE)
    form, _ = MeasuredProfile(path=path, spans=0).form(ToothProfile.of(plain), disc)
    built = EquivalentModel(replace(plain, form=PartForm(discs=((disc - 1, form),))))
    model, known = EquivalentModel(plain), load_unit("table4").deviations
    teeth = (f"disc{disc}.pitch", f"disc{disc}.runout")
    known = {name: 0.0 if name.startswith(teeth) else value for name, value in known.items()} | AMOUNTS.deviations
    waves = {
        f"disc{disc}.runout.cos1": moved.real,
        f"disc{disc}.runout.sin1": moved.imag,
        f"disc{disc}.pitch.cos1": moved.imag,
        f"disc{disc}.pitch.sin1": -moved.real,
    }
    found, asked = curve(built, errors_of(built, known), -1.0), curve(model, errors_of(model, known, waves), -1.0)
    assert np.abs(asked - curve(model, errors_of(model, known), -1.0)).max() > 30.0
    # Points of an exact profile that is moved by 6 µm: their normal deviations differ in second order, by some 0.1 nm.
    assert np.abs(found - asked).max() < 0.1


def write(path: Path, points: np.ndarray, heads: str = "x [mm],y [mm]") -> Path:
    """Write points x + iy or rows of numbers."""
    rows = np.stack([points.real, points.imag], axis=1) * 1e3 if np.iscomplexobj(points) else points
    path.write_text("\n".join([heads, *(",".join(repr(float(own)) for own in row) for row in rows)]) + "\n")
    return path


def test_points_of_amounts_give_them_to_second_order(reducer):
    # A tenth of the amounts leaves a hundredth of what the linear law of the amounts neglects.
    stage, largest = reducer.cycloid_stage, []
    for share in (1.0, 0.1):
        amounts = Modification(equidistant=share * AMOUNTS.equidistant, shift=share * AMOUNTS.shift)
        angle, deviation = normal_deviations(stage, disc_points(reducer, amounts), "disc")
        largest.append(np.abs(deviation + linear_clearance(stage, amounts, folded(angle))).max())
    assert 1.2e-8 < largest[0] < 2.5e-8
    assert largest[0] / largest[1] == pytest.approx(100, rel=0.1)


def test_a_rigid_movement_is_taken_out_and_said(reducer, tmp_path):
    moved, turned = 5e-5 * np.exp(2j), 3e-4
    points = disc_points(reducer, AMOUNTS) * np.exp(1j * turned) + moved
    found, taken = aligned(reducer.cycloid_stage, points, "disc")
    assert abs(taken.place - moved) < 1e-12
    assert taken.turn == pytest.approx(turned, abs=1e-10)
    assert np.abs(found - disc_points(reducer, AMOUNTS)).max() < 1e-11
    path = write(tmp_path / "disc.csv", points)
    drawn = ToothProfile(stage=reducer.cycloid_stage, modification=AMOUNTS)
    form, movement = MeasuredProfile(path=path, aligned=True).form(drawn, 1)
    assert np.abs(form.deviation).max() < 2.5e-8
    assert ", after 50 µm towards 115° and 61.9″ of turn were taken out of its datum" in movement.sentence
    as_it_is, none = MeasuredProfile(path=path).form(drawn, 1)
    assert np.abs(as_it_is.deviation).max() > 4e-5
    assert none is None


def test_the_datum_turns_points_and_polar_ones_are_the_same(reducer, tmp_path):
    points, datum = disc_points(reducer, AMOUNTS) + 3e-6, 0.3
    seen = points * np.exp(-1j * datum)
    rows = np.stack([np.degrees(np.angle(seen)), np.abs(seen) * 1e3], axis=1)
    polar = write(tmp_path / "polar.csv", rows, "direction [deg],radius [mm]")
    drawn = ToothProfile(stage=reducer.cycloid_stage)
    found, _ = MeasuredProfile(path=polar, datum=datum).form(drawn, 1)
    plain, _ = MeasuredProfile(path=write(tmp_path / "plain.csv", points)).form(drawn, 1)
    assert found.deviation == pytest.approx(plain.deviation, abs=1e-15)


@pytest.mark.parametrize(("across", "stands_out"), [("mean", -1e-6), ("highest", 0.0)])
def test_sections_along_the_width_are_taken_as_their_mean_or_the_highest(reducer, tmp_path, across, stands_out):
    rows = [
        (space, angle, deviation, height)
        for height, deviation in ((-5.0, -2.0), (0.0, 0.0), (5.0, -2.0))  # crowned by 2 µm, in straight lines
        for space in range(1, reducer.cycloid_stage.disc_teeth + 1)
        for angle in range(-180, 180, 30)
    ]
    path = write(tmp_path / "disc.csv", np.array(rows), "space,phi [deg],deviation [µm],z [mm]")
    profile = MeasuredProfile(path=path, from_drawing=True, across=across)
    form, _ = profile.form(ToothProfile.of(reducer), 1)
    assert form.deviation == pytest.approx([stands_out] * len(form.deviation), abs=1e-15)


@pytest.mark.parametrize(("spans", "gain"), [(0, 0.874), (40, 0.2)])
def test_noise_of_points_propagates_as_the_theory_page_says(reducer, spans, gain):
    """Equation (85): rms σ·√(g·Σw²) over the turn, w the exact derivatives by single pins."""
    unit, torque, sigma = load_unit("table4").deviations, -167.0, 1e-6
    model, angle = EquivalentModel(reducer), 2 * np.pi * np.sort(np.random.default_rng(5).random(60))
    errors = errors_of(model, unit, reducer.modification.deviations)
    exact, slopes = model.rotation_derivatives(errors, torque, angle)
    pins = [model.columns.index(f"each_pin.diameter.{pin + 1}") for pin in range(40)]
    stated = sigma * np.sqrt(gain * (slopes.by_error[:, pins] ** 2).sum(axis=1).mean()) / ARCSECOND
    teeth, off = reducer.cycloid_stage.disc_teeth, []
    around = 2 * np.pi * np.arange(POINTS * teeth) / POINTS
    for seed in range(8):
        noise = sigma * np.random.default_rng(seed).standard_normal((2, around.size))
        forms = tuple((disc, flank_form(around, noise[disc], teeth, spans, "noisy")) for disc in range(2))
        built = EquivalentModel(replace(reducer, form=PartForm(discs=forms)))
        off.append(curve(built, errors, torque, angle) - exact[0] / ARCSECOND)
    found = float(np.sqrt(np.mean(np.square(off))))
    assert found == pytest.approx(stated, rel=0.15)


def test_the_prototype_feels_the_form_where_its_pins_touch(reducer):
    generator, stage = np.random.default_rng(4), reducer.cycloid_stage
    around = 2 * np.pi * np.arange(24 * stage.disc_teeth) / 24
    discs = tuple(
        (disc, flank_form(around, generator.uniform(-1e-6, 1e-6, around.size), stage.disc_teeth, 0, "disc"))
        for disc in range(2)
    )
    pins = tuple((pin, PinForm(waves=((3, 4e-7, 1e-7 * pin),))) for pin in range(0, stage.pin_count, 3))
    plain = replace(reducer, modification=NONE)  # amounts move where a pin touches
    shaped = replace(plain, form=PartForm(discs=discs, pins=pins))
    carrier = 0.0137
    at = Positions(shaped, np.array([carrier]))
    asked = pin_contact(at).by_form[0, :, 0]
    for disc in range(2):
        direction = float(at.disc_direction(disc)[0])
        centre = stage.eccentricity * np.exp(1j * direction)
        found = np.empty((2, stage.pin_count, 6))
        for own, design in zip(found, (plain, shaped), strict=True):
            pin_contacts(
                mesh_of(design, part_errors(design, {})), disc, np.array([centre.real, centre.imag, carrier]), own
            )
        assert found[1, :, 2] - found[0, :, 2] == pytest.approx(asked[disc], abs=2e-9)
        assert np.abs(asked[disc]).max() > 1e-6


UNIT = """
name = "unit 7"
source = "gear measuring machine"
neglected = ["*"]
[harmonics]
"each_pin.roundness.7" = [[3, 0.5, 90]]
[profiles.disc2]
file = "disc2.csv"
aligned = true
"""


def built_unit(folder: Path, text: str = UNIT) -> BuiltUnit:
    """Write and read a unit file."""
    (folder / "unit7.toml").write_text(text)
    return load_unit(folder / "unit7.toml")


def test_a_unit_file_names_profiles_and_roundness(reducer, tmp_path):
    write(tmp_path / "disc2.csv", disc_points(reducer, reducer.modification) + 2e-6)
    unit = built_unit(tmp_path)
    built = unit.as_built(reducer)
    assert built.form.discs[0][0] == 1
    assert built.form.discs[0][1].spans == 40
    ((pin, roundness),) = built.form.pins
    assert pin == 6
    assert roundness.waves == ((3, pytest.approx(5e-7), pytest.approx(0.0, abs=1e-20)),)
    assert built.assumptions[-1].startswith("disc2 as disc2.csv states it, after 2 µm towards 0°")
    assert EquivalentModel(built).columns == EquivalentModel(reducer).columns
    assert load_unit("exact").as_built(reducer) is reducer


@pytest.mark.parametrize(
    ("text", "heads", "said"),
    [
        (UNIT.replace("disc2]", "disc3]"), None, "unknown disc with a profile 'disc3'"),
        (UNIT.replace("roundness.7", "roundness.41"), None, "unknown roundness of a pin 'each_pin.roundness.41'"),
        (UNIT + "spans = 400\n", None, "spans is 400; allowed is 0, or 1 to 1"),
        (UNIT.replace("true", '"yes"'), None, "aligned"),
        (UNIT + "datum = 3\n", None, "datum"),
        (
            UNIT + "from_drawing = true\n",
            None,
            "from_drawing is 'true'; allowed is it with deviations",
        ),
        (UNIT, "x [in],y [mm]", "the unit of column 'x' is 'in'; allowed is mm"),
        (UNIT, "x [mm],h [mm]", "columns is 'x, h'; allowed is x, y, and z if there is one"),
        (UNIT, "direction [deg],radius [mm]", "distance of point"),
        (
            UNIT + '[lengths]\n"disc2.runout.cos1" = 3.0\n',
            None,
            "disc2.runout.cos1 is stated beside the profile of disc2",
        ),
    ],
)
def test_wrong_profiles_are_refused_in_a_sentence(reducer, tmp_path, text, heads, said):
    points = disc_points(reducer, reducer.modification)
    write(tmp_path / "disc2.csv", points, heads or "x [mm],y [mm]")

    def read(_: Path) -> None:
        unit = built_unit(tmp_path, text)
        design = unit.as_built(reducer)
        unit.errors(EquivalentModel(design).columns, design.modification.deviations)

    assert said in refusal(read, tmp_path)


def test_a_part_of_a_disc_is_refused(reducer, tmp_path):
    write(tmp_path / "disc2.csv", disc_points(reducer, reducer.modification)[:4000])
    with pytest.raises(InputError, match=r"points \[deg\] is 6840\.0; allowed is up to 45 all around"):
        built_unit(tmp_path).as_built(reducer)


def test_a_reducer_file_names_a_free_profile(reducer, tmp_path):
    angle = np.linspace(0.0, 180.0, 101)
    rows = np.stack([angle, -1e6 * linear_clearance(reducer.cycloid_stage, AMOUNTS, np.radians(angle))], axis=1)
    path = write(tmp_path / "flank.csv", rows, "phi [deg],deviation [µm]")
    form = load_designed(path)
    assert form.at(np.array([-1.0, 1.0])) == pytest.approx(
        -linear_clearance(reducer.cycloid_stage, AMOUNTS, np.ones(2)), abs=2e-11
    )
    assert "phi [deg] is -180.0; allowed is 0°" in refusal(
        load_designed, write(tmp_path / "wrong.csv", rows - (180.0, 0.0), "phi [deg],deviation [µm]")
    )
    assert "row 2: deviation is 'nan'; allowed is a number" in refusal(
        load_designed, write(tmp_path / "nan.csv", rows * np.nan, "deviation [µm],phi [deg]")
    )


def test_a_reducer_file_with_a_profile_is_read_written_again_and_not_modified(tmp_path):
    reducer_file(tmp_path / "own.toml", "rv20e", ("\nequidistant_um", '\nprofile = "flank.csv"\nequidistant_um'))
    rows = np.array([(angle, 2.0 * np.sin(np.radians(angle)) ** 2 - 2.0) for angle in range(0, 181, 5)])
    write(tmp_path / "flank.csv", rows, "phi [deg],deviation [µm]")
    design = load_reducer(tmp_path / "own.toml")
    assert design.form.designed.at(np.array([np.pi / 2])) == pytest.approx([0.0], abs=1e-12)
    plain = contact_amounts(load_reducer("rv20e"))
    assert contact_amounts(design) == pytest.approx((plain[0], plain[1] + 2e-6), abs=1e-10)
    (tmp_path / "elsewhere").mkdir()
    write_modified(tmp_path / "own.toml", AMOUNTS, tmp_path / "elsewhere" / "new.toml")
    again = load_reducer(tmp_path / "elsewhere" / "new.toml")
    assert (again.form, again.modification.shift) == (design.form, pytest.approx(AMOUNTS.shift))
    with pytest.raises(InputError, match="profile is 'a free form'; allowed is none"):
        choose(ModificationRequest(), design, -167.0)


def contact_amounts(reducer: Reducer) -> tuple[float, float]:
    """Return the clearances on the flank at 90° and at tip and root [m]."""
    found = clearance_of(ToothProfile.of(reducer))
    return float(found.before[360]), found.radial


@pytest.mark.slow
def test_the_perfect_reducer_beside_a_measured_unit_has_no_form(reducer, tmp_path):
    write(tmp_path / "disc2.csv", disc_points(reducer, reducer.modification))
    found, exact = (
        transmission_error(reducer, unit, -1.0) for unit in (built_unit(tmp_path), replace(load_unit("exact")))
    )
    assert found.loop.lost_motion[1:] == pytest.approx(exact.loop.lost_motion[1:], rel=1e-12)
    assert found.rated_pin_force == exact.rated_pin_force
    assert found.loop.lost_motion[0] != exact.loop.lost_motion[0]


def test_a_diagnosis_takes_a_measured_profile_for_known(reducer, tmp_path):
    write(tmp_path / "disc2.csv", disc_points(reducer, reducer.modification))
    built_unit(tmp_path)
    asked = {"curve": tmp_path / "curve.csv", "reducer": "rv20e_liu2020", "tolerances": "rv20e_table4"}
    plain, known = (Diagnose(**asked, form=form).prepare() for form in ("", str(tmp_path / "unit7.toml")))
    gone = {*(own.name for own in plain.errors.active)} - {*(own.name for own in known.errors.active)}
    assert gone == {"disc2.pitch", "disc2.runout"}
    assert known.reducer.form.discs[0][0] == 1
    assert has_half_turn(plain.reducer, plain.errors.columns)
    assert not has_half_turn(known.reducer, plain.errors.columns)


def test_a_study_is_known_by_its_profile_too(tmp_path):
    profile = ("\nequidistant_um", '\nprofile = "flank.csv"\nequidistant_um')
    reducer_file(tmp_path / "own.toml", "rv20e_liu2020", profile)
    known = []
    for height in (0.0, -1.0):
        rows = np.array([(angle, height) for angle in range(0, 181, 5)])
        write(tmp_path / "flank.csv", rows, "phi [deg],deviation [µm]")
        study = prepared(reducer={"name": str(tmp_path / "own.toml")})
        known.append(study.digest)
        # A study chooses the amounts; the profile comes on top of them.
        left = study.model.reading((RADIAL_CLEARANCE,))(np.zeros((1, len(study.errors.columns)))).values[0, 0]
        known.append(round(left, 6))
    assert known[0] != known[2]
    assert known[3] == pytest.approx(known[1] + 1.0)


@pytest.mark.slow
def test_smoothed_points_let_the_search_find_the_extremes(reducer):
    generator, teeth = np.random.default_rng(2), reducer.cycloid_stage.disc_teeth
    around = 2 * np.pi * np.arange(POINTS * teeth) / POINTS
    forms = tuple(
        (disc, flank_form(around, 1e-6 * generator.standard_normal(around.size), teeth, None, "noisy"))
        for disc in range(2)
    )
    model = EquivalentModel(replace(reducer, form=PartForm(discs=forms)))
    errors = errors_of(model, load_unit("table4").deviations, reducer.modification.deviations)
    found = model.exact_extremes(errors, -1.0)
    dense = curve(model, errors, -1.0, 2 * np.pi * np.arange(3744) / 3744)
    # Equal steps stop short of the kinks at which a pin takes over.
    assert -0.05 < float(found.peak_to_peak[0]) / ARCSECOND - (dense.max() - dense.min()) < 0.5
    assert float(found.remaining[0]) / ARCSECOND < 0.05
