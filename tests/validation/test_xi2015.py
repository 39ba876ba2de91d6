"""RV-40E of xi2015: zone, pins in contact and forces under 572 N·m, with what the source does not print.

The source prints the zone 3.18° … 150.02° and 16 teeth in mesh, neither its deflection nor the face width. Its contact
angles follow from a deflection of 17.603 µm, which this file finds from the upper one. A disc carries 0.55 of the
torque, Li Lixing's assumption. Reference forces and the table over face widths are from a calculation that shares
nothing with this package.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.builders import reducer_file
from tests.printed_tables import printed, row
from tests.validation_manual import shown
from tolalloc.exceptions import InputError
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.clearance import formula_gap
from tolalloc.reducers.cycloid.loaded_contact import (
    PAIR_SHARE,
    LoadedContact,
    PressedDiscs,
    default_phases,
    pressed,
    pressed_linear,
)
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer

DEFLECTION = 17.603 * MICROMETRE
PIN_0 = np.zeros(1)
FORCES = np.array(
    [352.4, 607.6, 690.1, 707.2, 694.4, 664.9, 624.5, 576.3, 522.0, 462.8, 399.8, 333.5, 264.7, 194.0, 121.9, 49.0]
)
"""Of the pins at 9, 18 … 144° [N]."""


@pytest.fixture(scope="module")
def rv40e() -> Reducer:
    """The preset with Hertzian line contact."""
    reducer = load_reducer("rv40e_xi2015")
    return replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law="logarithmic"))


def disc(reducer: Reducer) -> PressedDiscs:
    assert PAIR_SHARE == 0.55
    return PressedDiscs(reducer=reducer, torque=PAIR_SHARE * 572.0, exact=False)


def given(reducer: Reducer, phase: np.ndarray = PIN_0) -> LoadedContact:
    return pressed_linear(disc(reducer), phase, DEFLECTION)


def test_the_preset_is_what_the_source_prints(rv40e):
    stage, amounts = rv40e.cycloid_stage, rv40e.modification
    assert (stage.pin_count, stage.disc_teeth) == (40, 39)
    assert (stage.pin_circle_radius, stage.pin_radius, stage.eccentricity) == pytest.approx((0.064, 0.003, 0.0013))
    # −2 µm equidistant and +8 µm shift leave clearance only as Rp − Δr_p.
    assert amounts.radial_clearance == pytest.approx(6e-6)
    assert amounts.flank_clearance(stage) == pytest.approx(-2e-6 + 8e-6 * np.sqrt(1 - 0.8125**2))
    assert (rv40e.first_stage.sun_teeth, rv40e.first_stage.planet_teeth) == (21, 42)
    assert rv40e.load.rated_torque == 572.0


def test_zone_by_the_sources_own_interpolation(rv40e):
    """Gap and displacement at every degree and straight lines between them: 3.177° and 150.020°."""
    degrees = np.arange(181.0)
    k1, cosine, sine = 1.3 * 40 / 64, np.cos(degrees * DEGREE), np.sin(degrees * DEGREE)
    s = 1 + k1**2 - 2 * k1 * cosine
    # Li Lixing's gap as the source writes it, with r_p − Δr_p; in micrometres.
    gap = -2 * (1 - sine / np.sqrt(s)) + 8 * (1 - k1 * cosine - np.sqrt(1 - k1**2) * sine) / np.sqrt(s)
    np.testing.assert_allclose(
        formula_gap(rv40e.cycloid_stage, rv40e.modification, degrees * DEGREE), gap * MICROMETRE, rtol=0, atol=1e-18
    )
    surplus = DEFLECTION / MICROMETRE * sine / np.sqrt(s) - gap
    before = np.flatnonzero(np.diff(np.sign(surplus)))
    crossings = before + surplus[before] / (surplus[before] - surplus[before + 1])
    assert crossings == pytest.approx([3.177, 150.020], abs=0.0005)
    assert np.round(crossings, 2) == pytest.approx([3.18, 150.02])  # as the source prints them


def test_zone(rv40e):
    assert given(rv40e).zone[0] / DEGREE == pytest.approx([3.173, 150.020], abs=0.0005)
    shown("V9", float(given(rv40e).zone[0, 0]) / DEGREE)


@pytest.mark.slow
def test_deflection_from_the_printed_upper_angle(rv40e):
    """The upper angle tells the deflection to 0.004 µm: half of its last digit, at 0.7 µm per degree."""

    def upper(deflection: float) -> float:
        return float(pressed_linear(disc(rv40e), PIN_0, deflection).zone[0, 1]) / DEGREE

    found = brentq(lambda deflection: upper(deflection) - 150.02, 10e-6, 30e-6, xtol=1e-12)
    assert found / MICROMETRE == pytest.approx(17.603, abs=0.001)
    digit = [brentq(lambda depth, at=at: upper(depth) - at, 10e-6, 30e-6) for at in (150.015, 150.025)]
    assert np.ptp(digit) / MICROMETRE < 0.008


def test_forces(rv40e):
    found = given(rv40e)
    degrees = found.pin_angle[0, 0] / DEGREE
    for angle, force in zip(9.0 * np.arange(1, 17), FORCES, strict=True):
        at = np.argmin(np.abs(degrees - angle))
        assert degrees[at] == pytest.approx(angle, abs=1e-9)
        assert found.force[0, 0, at] == pytest.approx(force, abs=0.05)
    assert found.pins_in_contact[0, 0] == 16
    # They are so whatever the width: only the torque and the deflection enter.
    wider = given(rv40e.with_face_width(0.02))
    np.testing.assert_allclose(wider.force, found.force, rtol=1e-12)


def test_sixteen_pins_in_two_phases_of_three_and_seventeen_else(rv40e):
    """The zone holds 16.316 pin pitches, so 17 pins in 31.6 % of the phases and 16 in the others."""
    phases = 500
    found = given(rv40e, default_phases(rv40e, phases))
    count, pitch = found.pins_in_contact.ravel(), 2 * np.pi / rv40e.cycloid_stage.pin_count
    assert set(count) == {16, 17}
    share = np.ptp(found.zone[0]) / pitch - 16
    assert share * 100 == pytest.approx(31.6, abs=0.05)
    # Each end of the zone falls between two of the phases.
    assert (count == 17).mean() == pytest.approx(share, abs=1.01 / phases)


STEEL = (
    "| face width [mm] | method | deflection, independent [µm] | here [µm] | largest force, independent [N] | here [N] "
    "| pins in contact |"
)
BY_WIDTH = [
    (10, 3.683, (10.07, 99.17), 10, 1049, 3.255, 9, 1100),
    (12, 3.237, (10.84, 94.96), 9, 1094, 2.882, 9, 1144),
    (16, 2.659, (12.04, 88.89), 8, 1179, 2.379, 8, 1215),
]


@pytest.mark.parametrize(
    ("width", "linear", "zone", "linear_teeth", "linear_force", "local", "teeth", "force"), BY_WIDTH
)
def test_steel_line_contact_alone(rv40e, width, linear, zone, linear_teeth, linear_force, local, teeth, force):
    """About five times as stiff as what 16 teeth need, by Li Lixing's method and by the law at every pin."""
    own = disc(rv40e.with_face_width(width * MILLIMETRE))
    by_li, by_pin = pressed_linear(own, PIN_0), pressed(own, PIN_0)
    assert by_li.deflection[0] / MICROMETRE == pytest.approx(linear, rel=0.01)
    assert by_li.zone[0] / DEGREE == pytest.approx(zone, rel=0.01)
    assert by_li.pins_in_contact[0, 0] == linear_teeth
    assert by_li.force.max() == pytest.approx(linear_force, rel=0.01)
    assert by_pin.deflection[0] / MICROMETRE == pytest.approx(local, rel=0.01)
    assert by_pin.pins_in_contact[0, 0] == teeth
    assert by_pin.force.max() == pytest.approx(force, rel=0.01)
    assert 4.5 < DEFLECTION / by_li.deflection[0] < 7


def test_the_page_prints_both_methods_over_the_face_width(rv40e):
    rows = []
    for width, *stated in BY_WIDTH:
        own = disc(rv40e.with_face_width(width * MILLIMETRE))
        for name, method, depth, force in (
            ("linear", pressed_linear, stated[0], stated[3]),
            ("law at every pin", pressed, stated[4], stated[6]),
        ):
            found = method(own, PIN_0)
            depths, forces = (depth, found.deflection[0] / MICROMETRE), (force, found.force.max())
            pins = int(found.pins_in_contact[0, 0])
            rows.append(row(str(width), name, *map("{:.3f}".format, depths), *map("{:,.0f}".format, forces), str(pins)))
    assert printed("validation/xi2015.md", STEEL) == rows


def test_largest_pressure_is_not_under_the_largest_force(rv40e):
    assert rv40e.cycloid_stage.face_width == pytest.approx(0.012)
    found = pressed(disc(rv40e), PIN_0)
    assert found.pressure.max() / 1e6 == pytest.approx(1569, rel=0.001)
    assert found.most_pressed / DEGREE == pytest.approx(54, abs=1e-9)
    assert found.most_loaded / DEGREE == pytest.approx(27, abs=1e-9)


@pytest.mark.parametrize(
    ("method", "width", "span", "share"),
    [
        (pressed_linear, 10, 30.325, 0.854),
        (pressed_linear, 12, 30.589, 0.877),
        (pressed_linear, 16, 30.919, 0.906),
        (pressed, 10, 30.586, 0.862),
        (pressed, 12, 30.803, 0.881),
        (pressed, 16, 31.077, 0.909),
    ],
)
def test_sixteen_teeth_need_pins_that_bend_between_supports_31_mm_apart(rv40e, method, width, span, share):
    """Widths of 10 to 16 mm take 30.3 to 31.1 mm, and bending is 85 to 92 % of the deflection."""
    own = rv40e.with_face_width(width * MILLIMETRE)

    def found(span: float) -> LoadedContact:
        return method(disc(own.with_pin_span(span)), PIN_0)

    needed = brentq(lambda span: float(found(span).deflection[0]) - DEFLECTION, 0.025, 0.035, xtol=1e-9)
    bent = found(needed)
    bending = bent.force.max() / own.with_pin_span(needed).stiffness.pin_bending / DEFLECTION
    assert needed / MILLIMETRE == pytest.approx(span, abs=0.001)
    assert 30.3 <= needed / MILLIMETRE <= 31.1
    assert bending == pytest.approx(share, abs=0.0006)
    assert 0.85 <= bending <= 0.92
    assert bent.pins_in_contact[0, 0] == 16
    assert bent.zone[0] / DEGREE == pytest.approx([3.173, 150.020], abs=0.0005)
    # Li Lixing's forces follow from the deflection alone; those of the law at every pin are a little more even.
    assert bent.force.max() == pytest.approx(707.2, rel=1e-4 if method is pressed_linear else 0.02)


def test_forty_disc_teeth_as_printed_are_refused(tmp_path):
    path = reducer_file(tmp_path / "printed.toml", "rv40e_xi2015", ("disc_teeth = 39", "disc_teeth = 40"))
    with pytest.raises(InputError, match="disc_teeth must be pin_count − 1 = 39"):
        load_reducer(path)


def test_the_printed_module_puts_the_cranks_outside_the_discs(rv40e):
    stage = rv40e.cycloid_stage
    printed = replace(rv40e, first_stage=replace(rv40e.first_stage, module=0.002))
    assert printed.crank_circle_radius == pytest.approx(0.063)
    root = stage.pin_circle_radius - stage.eccentricity - stage.pin_radius
    assert printed.crank_circle_radius > root
    assert rv40e.crank_circle_radius < root
