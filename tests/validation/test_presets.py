"""The presets against what catalogues state of their sizes, and the printed reducers against them."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests.builders import numbers_of, order_spectrum, says
from tests.printed_tables import SUMMARY, number, printed, row
from tests.studies.command import answer_of, refused, tolalloc
from tests.validation_manual import shown
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.equivalent.perfect import exact_loop, preload, rated_pin_force
from tolalloc.reducers.reducer.bearings import SLIDING_FRICTION
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.portraits.reducer import FACTOR, against_catalogue, twist_table

SIZES = ("rv20e", "rv40e", "rv80e", "rv110e", "rv160e")
RIGIDITIES = "| size | calculated [N·m/arcmin] | catalogue [N·m/arcmin] | difference | lost motion [arcmin] |"


@pytest.mark.parametrize("size", SIZES)
def test_the_rigidity_is_the_catalogues_within_a_fifth(size):
    reducer = load_reducer(size)
    loop = exact_loop(reducer)
    assert loop.torsional_stiffness[0] == pytest.approx(reducer.catalogue.torsional_rigidity, rel=0.2)
    assert 0.1 < loop.lost_motion[0] / ARCMINUTE < reducer.catalogue.lost_motion / ARCMINUTE
    shown(f"V{1 + SIZES.index(size)}", loop.torsional_stiffness[0] * ARCMINUTE)
    sentence, warnings = against_catalogue(reducer, loop)
    assert f"{reducer.catalogue.torsional_rigidity * ARCMINUTE:.3g} (" in sentence
    assert not warnings


@pytest.mark.parametrize("page", ["validation/catalogues.md", SUMMARY])
def test_both_pages_print_the_rigidities(page):
    rows = []
    for size in SIZES:
        reducer = load_reducer(size)
        loop = exact_loop(reducer)
        found, stated = loop.torsional_stiffness[0] * ARCMINUTE, reducer.catalogue.torsional_rigidity * ARCMINUTE
        off = f"{number(100 * (found / stated - 1), '+.0f')} %"
        name, lost = f"RV-{size[2:].upper()}", f"{loop.lost_motion[0] / ARCMINUTE:.2f}"
        rows.append(row(name, f"{found:.1f}", f"{stated:.0f}", off, lost))
    assert printed(page, RIGIDITIES) == rows


def test_one_rule_gives_the_dimensions_of_all_sizes():
    for size in SIZES:
        table = tomllib.loads((PRESETS / f"{size}.reducer.toml").read_text(encoding="utf-8"))
        stage, shaft = table["cycloid_stage"], table["stiffness"]["crankshaft"]
        reducer, width = load_reducer(size), stage["face_width_mm"]
        assert width == round(0.2 * stage["pin_circle_radius_mm"])
        force = reducer.load.rated_torque / reducer.crank_count / reducer.crank_circle_radius
        stress = (
            32 * force / 2 * (shaft["span_mm"] - stage["disc_spacing_mm"]) / 2e3 / np.pi / shaft["diameter_mm"] ** 3
        )
        assert stress * 1e3 == pytest.approx(130, rel=0.02)  # MPa; the diameter is rounded to 0.1 mm
        for name in ("crank_disc_bearing", "crank_carrier_bearing"):
            bearing = table["stiffness"][name]
            assert bearing["roller_diameter_mm"] == pytest.approx(shaft["diameter_mm"] / 4, abs=0.051)
            assert bearing["roller_length_mm"] == pytest.approx(0.7 * width, abs=0.051)


def test_the_printed_stiffness_is_said_to_be_far_from_any_catalogue():
    printed = replace(load_reducer("rv20e_liu2020"), catalogue=load_reducer("rv20e").catalogue)
    loop = exact_loop(printed)
    assert loop.torsional_stiffness[0] * ARCMINUTE == pytest.approx(1577, rel=1e-3)
    sentence, warnings = against_catalogue(printed, loop)
    assert "1.58e+03 N·m/arcmin" in sentence
    assert "32.2 times" in warnings[0]
    assert printed.catalogue.torsional_rigidity * FACTOR < loop.torsional_stiffness[0]


def test_without_a_catalogue_the_twist_under_rated_torque_is_judged():
    for size, off in (("rv20e", False), ("rv20e_liu2020", True)):
        reducer = replace(load_reducer(size), catalogue=None)
        sentence, warnings = against_catalogue(reducer, exact_loop(reducer))
        assert sentence == ""
        assert any("twist" in warning for warning in warnings) is off


def test_orders_that_are_rounding_are_no_main_orders():
    angle = 2 * np.pi * np.arange(360) / 360
    assert [order for order, *_ in order_spectrum(np.cos(5 * angle)[np.newaxis]).main(4)] == [5]
    assert order_spectrum(np.zeros((1, 360))).main(4) == []


@pytest.mark.parametrize("size", ["rv20e", "rv80e", "rv20e_liu2020"])
def test_the_shares_of_the_twist_are_the_whole(size):
    shares = twist_table(load_reducer(size)).set_index("part")["share of the twist [%]"]
    assert shares.sum() == pytest.approx(100.0, abs=0.06)  # eleven rounded numbers
    assert (shares > -0.5).all()
    if size == "rv20e":
        assert shares["crank–disc bearing"] > 10
        assert shares["crank bending, all journals"] > 10


def test_preload_is_what_presses_at_the_torque_of_backlash():
    reducer, unit = load_reducer("rv20e"), load_unit("table4")
    model = EquivalentModel(reducer, orders=unit.orders)
    errors = unit.errors(model.columns, reducer.modification.deviations)
    both = np.concatenate(
        [errors, np.where(np.array(model.columns) == "modification.equidistant", 8e-6, 0.0)[np.newaxis]]
    )
    found = preload(model, both)
    angles = TURN_ANGLES
    torque = -1e-4 * reducer.load.rated_torque
    pins = forces(model.at_torque(torque).equilibria(both, torque, angles)).pins
    assert found.pin_force == pytest.approx(pins.max(axis=(1, 2, 3)))
    # A disc turns about its pole at e·zp from the housing's centre: slower sliding, longer way, pin by pin.
    stage, worst = reducer.cycloid_stage, np.zeros((2, TURN_ANGLES.size))
    for at, angle in enumerate(angles):
        for disc in range(2):
            crank = -stage.disc_teeth * angle + np.pi * disc
            pole = stage.eccentricity * stage.pin_count * np.array([np.cos(crank), np.sin(crank)])
            for pin in range(stage.pin_count):
                direction = 2 * np.pi * pin / stage.pin_count
                centre = stage.pin_circle_radius * np.array([np.cos(direction), np.sin(direction)])
                lever = np.hypot(*(centre - pole)) - stage.pin_radius
                worst[:, at] += SLIDING_FRICTION * pins[:, at, disc, pin] * lever
    assert found.friction_torque == pytest.approx(worst.max(axis=1), rel=1e-9)
    assert found.pin_force[0] > rated_pin_force(reducer) > 100 * found.pin_force[1]


@pytest.mark.slow
def test_te_says_that_the_unit_of_table_4_is_preloaded():
    answer = answer_of("te", "--reducer", "rv20e", "--unit", "table4")
    assert says(answer["warnings"][0], "transmission_error.preloaded", force=answer["pin_force_without_torque_n"])
    assert answer["pin_force_without_torque_n"] > 1000
    exact = answer_of("te", "--reducer", "rv20e", "--unit", "exact")
    assert not any("preloaded" in warning for warning in exact["warnings"])
    friction = exact["friction"]
    assert 80 < friction["efficiency_at_rated_torque_percent"] < 92
    assert friction["no_load_torque_nm"] < 2 < 10 < answer["friction"]["no_load_torque_nm"]
    assert friction["by_contact"][0]["contact"] == "pins"


@pytest.mark.parametrize("method", ["li2018", "song2019"])
@pytest.mark.parametrize("preset", [pytest.param(name, marks=pytest.mark.slow) for name in SIZES] + ["rv40e_xi2015"])
def test_written_amounts_give_what_modify_promises(tmp_path, preset, method):
    written = tmp_path / "new.reducer.toml"
    given = ("--reducer", preset, "--rotation", "0.0005", "--radial", "12", "--json")
    promised = json.loads(tolalloc("modify", method, *given, "--write", written).stdout)
    found = answer_of("contact", "--reducer", written)
    assert numbers_of(found) == pytest.approx(numbers_of(promised["contact"]), rel=1e-6, abs=1e-6)
    old, new = load_reducer(preset), load_reducer(written)
    assert new.modification.equidistant * 1e6 == pytest.approx(promised["equidistant amount [µm]"], rel=1e-12)
    assert new.modification.shift * 1e6 == pytest.approx(promised["shift amount [µm]"], rel=1e-12)
    assert (new.stiffness, new.load, new.parts) == (old.stiffness, old.load, old.parts)
    refused(tolalloc("modify", method, *given, "--write", written), "the file exists", "nothing is overwritten")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("arcmin = 49", "arcmin = 2.81", "is 2.81; allowed is 5.57 to 557, a twist of 0.3 to 30 arcmin"),  # per degree
        ("arcmin = 49", "rad = 168000", "torsional_rigidity_nm_per_rad"),
        ("arcmin = 49", "arcmin = 168000", "torsional_rigidity_nm_per_arcmin"),  # per radian
        ("lost_motion_arcmin = 1.0", "lost_motion_arcmin = 60", "lost_motion_arcmin"),  # arcseconds
        ("arcsec = 70", "arcsec = 1.17", "transmission_error_arcsec"),  # arcminutes
    ],
)
def test_a_catalogue_in_wrong_units_is_refused(tmp_path, old, new, words):
    path, text = tmp_path / "own.reducer.toml", (PRESETS / "rv20e.reducer.toml").read_text(encoding="utf-8")
    before, table = text.split("[catalogue]")
    assert old in table
    path.write_text(before + "[catalogue]" + table.replace(old, new), encoding="utf-8")
    result = tolalloc("te", "--reducer", path)
    refused(result, "own.reducer.toml", words)


def test_spur_gears_take_their_teeth_from_the_first_stage_and_no_gear_has_fewer_virtual_ones(tmp_path):
    path, text = tmp_path / "own.reducer.toml", (PRESETS / "rv20e.reducer.toml").read_text(encoding="utf-8")
    assert "virtual_teeth" not in text

    def mesh(teeth: int, virtual: str = "") -> float:
        changed = text.replace("sun_teeth = 10", f"sun_teeth = {teeth}")
        path.write_text(changed.replace("contact_ratio", f"{virtual}contact_ratio"), encoding="utf-8")
        parts = load_reducer(path).parts  # the mesh itself yields in series with the twist of the crank
        return 1.0 / next(part.compliance(0.0) for part in parts if part.name == "gear mesh")

    # ISO 6336-1 with 26 planet teeth and its printed coefficients, 10 mm wide.
    for teeth in (10, 12):
        expected = 1.375 / (0.04723 + 0.15551 / teeth + 0.25791 / 26) * 1e7
        assert mesh(teeth) == pytest.approx(expected, rel=1e-12)
        assert mesh(10, f"sun_virtual_teeth = {teeth}.0, ") == pytest.approx(expected, rel=1e-12)
    words = (
        r"stiffness.gear_mesh.sun_virtual_teeth is 10; allowed is sun_teeth = 12 or more, and nothing for spur gears"
    )
    with pytest.raises(InputError, match=words):
        mesh(12, "sun_virtual_teeth = 10, ")
