"""Stiffness from dimensions: rolling bearings by their elements, shafts by Timoshenko, interfaces in series."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.builders import unit_with
from tests.validation_manual import shown
from tolalloc.exceptions import TolallocError
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.reducer.bearings import BallBearing, RollerBearing
from tolalloc.reducers.reducer.design import at_torque, compliances, interface_forces
from tolalloc.reducers.reducer.files import PRESETS, load_reducer, with_stiffness
from tolalloc.reducers.reducer.stiffness import (
    Crankshaft,
    IdentifiedStiffness,
    Material,
    bore_flexibility,
    shaft_flexibility,
)

STEEL = Material(elastic_modulus=206e9, poisson_ratio=0.3)
NEEDLES = RollerBearing(rollers=12, roller_diameter=4e-3, roller_length=10e-3, pitch_diameter=20e-3)
TAPERED = replace(NEEDLES, contact_angle=math.radians(15), preload=400.0, rows=2)
LOOSE = replace(NEEDLES, clearance=12e-6)
TIGHT = replace(NEEDLES, clearance=-8e-6)
BALLS = BallBearing(balls=9, ball_diameter=12.7e-3, pitch_diameter=65e-3)


def published_force(bearing: RollerBearing, displacement: float, direction: float) -> float:
    """ISO/TS 16281 roller by roller in millimetres: Q = 35,948·L^(8/9)·δ^(10/9)."""
    approach = 0.0
    if bearing.preload:
        sine = math.sin(bearing.contact_angle)
        load = bearing.preload / bearing.rollers / sine
        approach = (load / 35948.0 / (bearing.roller_length * 1e3) ** (8 / 9)) ** 0.9 / sine
    total = 0.0
    for roller in range(bearing.rollers):
        psi = direction + 2 * math.pi * roller / bearing.rollers
        radial = displacement * 1e3 * math.cos(psi) - bearing.clearance * 1e3 / 2
        pressed = radial * math.cos(bearing.contact_angle) + approach * math.sin(bearing.contact_angle)
        if pressed > 0:
            load = 35948.0 * (bearing.roller_length * 1e3) ** (8 / 9) * pressed ** (10 / 9)
            total += load * math.cos(psi) * math.cos(bearing.contact_angle)
    return bearing.rows * total


@pytest.mark.parametrize("bearing", [NEEDLES, TAPERED, LOOSE, TIGHT], ids=["needles", "tapered", "loose", "tight"])
@pytest.mark.parametrize("direction", [0.0, 0.1, math.pi / 12])
@pytest.mark.parametrize("displacement", [1e-6, 8e-6, 30e-6])
def test_the_force_is_the_sum_over_the_rollers(bearing, direction, displacement):
    wanted = published_force(bearing, displacement, direction)
    assert bearing.radial_force(displacement, direction) == pytest.approx(wanted, rel=1e-12, abs=1e-9)
    if wanted > 0:
        assert bearing.radial_displacement(wanted, direction) == pytest.approx(displacement, rel=1e-9)


@pytest.mark.parametrize("bearing", [NEEDLES, TAPERED, LOOSE, BALLS], ids=["needles", "tapered", "loose", "balls"])
def test_ways_under_many_forces_are_those_under_each(bearing):
    forces = np.geomspace(1.0, 2e4, 37)
    wanted = [bearing.compliance(force) * force for force in forces]
    np.testing.assert_allclose(bearing.ways(forces), wanted, rtol=1e-7)
    assert bearing.ways(np.zeros(1)) == pytest.approx(0.0, abs=1e-18)


def test_many_rollers_and_balls_share_a_load_as_stribeck_says():
    # Without clearance the most loaded element carries 4.08 F/Z with line and 4.37 F/Z with point contact.
    for bearing, factor in (
        (replace(NEEDLES, rollers=180, roller_diameter=0.3e-3), 4.08),
        (replace(BALLS, balls=160, ball_diameter=1.2e-3), 4.37),
    ):
        loads = bearing.element_loads(5e-6)
        found = float(loads.max() * bearing.elements / bearing.radial_force(5e-6))
        assert found == pytest.approx(factor, rel=2e-3)
        if factor == 4.08:
            shown("C3", found)


def test_the_balls_of_a_209_bearing_are_as_stiff_as_harris_finds():
    # Harris, Rolling Bearing Analysis: 9 balls of 12.7 mm, grooves of 0.52; printed curvature sums 0.202 and 0.137/mm
    # with δ* 0.602 and 0.658 give 2.15e5·Σρ^-½·δ*^-1.5 at each race.
    races = [2.15e5 * total**-0.5 * reduced**-1.5 for total, reduced in ((0.202, 0.602), (0.137, 0.658))]
    both = sum(race ** (-2 / 3) for race in races) ** -1.5
    assert BALLS.coefficient * 1e-3**1.5 == pytest.approx(both, rel=0.01)
    shown("C4", BALLS.coefficient * 1e-3**1.5 / both)


def test_preload_takes_the_play_and_stiffens():
    loose = replace(LOOSE, contact_angle=math.radians(15))
    tight = replace(loose, preload=800.0)
    assert LOOSE.play == pytest.approx(6e-6 * (1 + 1 / math.cos(math.pi / 12)) / 2)  # to one roller, and to two
    assert tight.play < loose.play
    assert TAPERED.play == 0.0
    assert tight.compliance(500.0) < loose.compliance(500.0)
    each = 35948.0 * 10 ** (8 / 9) * 0.004 ** (10 / 9)  # 8 µm of interference press every needle by 4
    assert TIGHT.idle_load == pytest.approx(12 * each)
    assert TIGHT.play == 0.0
    # While all needles are pressed, twelve of them have the stiffness 12/2·dQ/dδ in every direction.
    assert 1 / TIGHT.compliance(1.0) == pytest.approx(6 * 10 / 9 * each / 4e-6, rel=1e-3)
    assert TIGHT.compliance(500.0) < NEEDLES.compliance(500.0)
    axial = TAPERED.element_loads(0.0).sum() * math.sin(TAPERED.contact_angle)
    assert axial == pytest.approx(TAPERED.preload)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rollers": 16}, "rollers is 16; allowed is 3 to 15, else they overlap"),
        ({"clearance": 4.1e-3}, "clearance_um is 4100; allowed is below roller_diameter_mm = 4"),
        (
            {"clearance": -3e-6, "contact_angle": 0.2},
            "clearance_um is -3; allowed is 0 or more with a contact_angle_deg",
        ),
        ({"preload": 100.0}, "preload_n is 100; allowed is 0 without a contact_angle_deg"),
    ],
)
def test_impossible_bearings_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        replace(NEEDLES, **given)


def test_a_shaft_bends_as_timoshenko_says():
    # Dense finite differences of M'' and of the shear angle, load by load.
    span, diameter, places = 0.05, 0.012, np.array([0.014, 0.033])
    found = shaft_flexibility(places, span, diameter, STEEL)
    inertia, area = math.pi * diameter**4 / 64, math.pi * diameter**2 / 4
    shear = STEEL.elastic_modulus / 2.6 * area * 6 * 1.3 / (7 + 6 * 0.3)
    x = np.linspace(0.0, span, 200_001)
    for at, load in enumerate(places):
        moment = np.where(x < load, x * (span - load), load * (span - x)) / span
        force = np.where(x < load, (span - load) / span, -load / span)
        slope = np.concatenate([[0.0], np.cumsum((moment[1:] + moment[:-1]) / 2 * np.diff(x))])
        bent = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(x))])
        sheared = np.concatenate([[0.0], np.cumsum(np.diff(x) * force[:-1])])
        way = (bent[-1] / span * x - bent) / (STEEL.elastic_modulus * inertia) + sheared / shear
        assert found[at] == pytest.approx(np.interp(places, x, way), rel=2e-4)
        shown("C5", float(np.abs(found[at] / np.interp(places, x, way) - 1).max()))


def test_own_and_shared_bending_are_the_whole_flexibility_of_two_journals():
    crank, spacing = Crankshaft(diameter=0.012, span=0.034, gear_distance=0.03), 0.012
    own, shared = crank.flexibilities(2, spacing, STEEL)
    places = 0.017 + spacing * np.array([-0.5, 0.5])
    whole = shaft_flexibility(places, 0.034, 0.012, STEEL)
    for loads in ([1.0, 0.0], [300.0, -120.0]):
        assert own * np.array(loads) + shared * sum(loads) == pytest.approx(whole @ loads, rel=1e-12)
    with pytest.raises(ValueError, match=r"span_mm is 34; allowed is above 36"):
        crank.flexibilities(3, 0.018, STEEL)


def test_a_bore_moves_less_the_wider_the_disc():
    thin, wide = (bore_flexibility(0.01, 0.05, width, STEEL) for width in (0.01, 0.02))
    assert thin == pytest.approx(2 * wide)
    assert 1 / thin == pytest.approx(4 * math.pi * 206e9 * 0.01 / (1.3 * 2.7 * math.log(5.0)))


DIMENSIONS = """
sun_support = 1e8
gear_mesh = 2e8
carrier_bearing = { balls = 40, ball_diameter_mm = 6, pitch_diameter_mm = 94, contact_angle_deg = 40, preload_n = 500 }
pin_contact_law = "logarithmic"
crankshaft = { diameter_mm = 11, span_mm = 32, gear_distance_mm = 32 }
pillars = { count = 3, radius_mm = 30, thickness_mm = 15, width_mm = 20, length_mm = 30 }
"""
JOURNAL = "rollers = 13, roller_diameter_mm = 2.7, roller_length_mm = 7, pitch_diameter_mm = 13.6"
BEARINGS = f"crank_disc_bearing = {{ {JOURNAL} }}\ncrank_carrier_bearing = {{ {JOURNAL}, contact_angle_deg = 12 }}\n"


def written(folder, bearings=BEARINGS, clearances=""):
    preset = (PRESETS / "rv20e_liu2020.reducer.toml").read_text(encoding="utf-8")
    before, after = preset.split("[stiffness]")[0], preset.split("[modification]")[1]
    path = folder / "own.reducer.toml"
    path.write_text(f"{before}[stiffness]{DIMENSIONS}{bearings}\n{clearances}\n[modification]{after}", "utf-8")
    return path


def test_a_file_of_dimensions_gives_springs_in_series(tmp_path):
    reducer = load_reducer(written(tmp_path))
    steel, forces = reducer.disc_material, interface_forces(reducer, 167.0)
    journal = RollerBearing(rollers=13, roller_diameter=2.7e-3, roller_length=7e-3, pitch_diameter=13.6e-3)
    own, shared = Crankshaft(diameter=0.011, span=0.032, gear_distance=0.032).flexibilities(2, 0.010, steel)
    ring = bore_flexibility(8.15e-3, 0.052, 0.010, steel)
    assert 1 / reducer.stiffness.crank_disc_bearing == pytest.approx(
        journal.compliance(forces["crank_disc_bearing"]) + own + ring, rel=1e-12
    )
    both = replace(journal, contact_angle=math.radians(12), rows=2).compliance(forces["crank_carrier_bearing"])
    twist = compliances(reducer, 167.0)["crank_carrier_bearing"]["carrier twist"]
    assert 1 / reducer.stiffness.crank_carrier_bearing == pytest.approx(both + shared + twist, rel=1e-12)
    assert 0 < twist < both
    assert at_torque(reducer, -5.0).stiffness.crank_disc_bearing < reducer.stiffness.crank_disc_bearing


def test_forces_by_statics_are_those_of_the_model(tmp_path):
    reducer = load_reducer(written(tmp_path))
    model = EquivalentModel(reducer)
    angles = 2 * np.pi / 40 * np.arange(16) / 16
    errors = unit_with(model)
    found = forces(model.equilibria(errors, -167.0, angles))
    for name, wanted in interface_forces(reducer, -167.0).items():
        if wanted:
            assert found.of(name).mean() == pytest.approx(wanted, rel=0.04), name


def test_an_identified_stiffness_takes_the_place_of_its_parts(tmp_path):
    reducer = load_reducer(written(tmp_path))
    identified = IdentifiedStiffness(
        source="bench", values={"crank_disc_bearing": 2.5e8}, standard_uncertainty={"crank_disc_bearing": 1e7}
    )
    own = with_stiffness(reducer, identified)
    for torque in (-1.0, -167.0):
        assert at_torque(own, torque).stiffness.crank_disc_bearing == 2.5e8
        assert at_torque(own, torque).stiffness.crank_carrier_bearing == pytest.approx(
            at_torque(reducer, torque).stiffness.crank_carrier_bearing
        )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("rollers = 13", "rollers = 16", "rollers is 16; allowed is 3 to 15, else they overlap"),
        ("pitch_diameter_mm = 13.6 }\n", "pitch_diameter_mm = 13.6, clearance_um = -300 }\n", "clearance_um"),
        ("span_mm = 32", "span_mm = 8", "crankshaft.span_mm is 8; allowed is above 10"),
        ("rollers = 13", "roller = 13", "roller"),
    ],
)
def test_impossible_dimensions_are_refused_with_file_and_field(tmp_path, old, new, words):
    path = written(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(TolallocError, match=r"own\.reducer\.toml") as caught:
        load_reducer(path)
    assert words in str(caught.value)


def test_a_clearance_is_given_once(tmp_path):
    loose = BEARINGS.replace("13.6 }\n", "13.6, clearance_um = 8 }\n", 1)
    assert load_reducer(written(tmp_path, loose)).clearances.crank_disc_bearing == pytest.approx(
        4e-6 * (1 + 1 / math.cos(math.pi / 13)) / 2
    )
    twice = written(tmp_path, loose, "[clearances]\ncrank_disc_bearing_um = 3\n")
    with pytest.raises(TolallocError, match=r"clearances.crank_disc_bearing_um is given twice"):
        load_reducer(twice)
