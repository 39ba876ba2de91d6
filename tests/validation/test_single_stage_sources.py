"""Single-stage drives of three sources with geometry and a force or a backlash.

Król et al. 2019 (Optimization of the one stage cycloidal gearbox as a non-linear least squares problem; their program,
DOI 10.5281/zenodo.2166718): 15 teeth, 16 pins of 3.3 mm, e = 3 mm, shortening 0.56, width 10 mm, eight output pins of
5 mm in holes of 8 mm on 40 mm, 1.55 N·m at the input, steel of 200 GPa; forces and stresses by closed forms.
Vijayanathan 2025 (a drive of printed parts, 29:1, its program and readings public): 30 pins of 2.5 mm on 40 mm,
e = 1 mm, eight output pins, and ten pairs of landings from either side. JelmerV 2024 (files of a master's thesis): 14
pins of 3.5 mm on 34 mm, e = 1.5 mm, discs 0.05 mm too small all round, and a play test.
Not printed by the last two: what their holes leave free, and on which shaft the play of the third was read.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import LINEAR_STAGE
from tolalloc.reading.units import ARCMINUTE, DEGREE
from tolalloc.reducers.cycloid.loaded_contact import peak_pressure
from tolalloc.reducers.equivalent.hysteresis import hysteresis_loop
from tolalloc.reducers.equivalent.model import Equilibria, EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces, unit_pressure
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.stiffness import Material

RIGID = 1e11
TEETH, PINS, ECCENTRICITY, PIN_RADIUS, SHORTENING, WIDTH = 15, 16, 3.0e-3, 3.3e-3, 0.56, 0.010
TORQUE = TEETH * 1.55
"""At the output, as the source has it [N·m]."""
FORCE = 4 * TORQUE / (ECCENTRICITY * TEETH * PINS)
"""On the most loaded pin, printed as 4·Mc/(e·zs·zk): 129.17 [N]."""
HOLE_FORCE = 2 * TORQUE * np.cos(2 * np.pi / 8) / (np.pi * 0.040)
"""On the most loaded output pin, printed as 2·Mc·cos(2π/zi)/(π·Rw): 261.65 [N]."""


def with_stage(**stage: float) -> Reducer:
    """Return the preset's drive with another stage, bearings and output pins that do not yield, and exact teeth."""
    drive = load_reducer(LINEAR_STAGE)
    stiff = dict.fromkeys(("shaft_support", "eccentric_bearing", "carrier_bearing"), RIGID)
    return replace(
        drive,
        cycloid_stage=replace(drive.cycloid_stage, **stage),
        stiffness=replace(drive.stiffness, **stiff, output_pin=1e9, pin_contact=1e7),
        modification=replace(drive.modification, equidistant=0.0, shift=0.0),
    )


@pytest.fixture(scope="module")
def krol() -> Reducer:
    drive = with_stage(
        pin_count=PINS,
        disc_teeth=TEETH,
        pin_circle_radius=ECCENTRICITY * PINS / SHORTENING,
        pin_radius=PIN_RADIUS,
        eccentricity=ECCENTRICITY,
        face_width=WIDTH,
    )
    steel = Material(elastic_modulus=200e9, poisson_ratio=0.3)
    holes = replace(drive.output_pins, count=8, circle_radius=0.040, pin_radius=0.005, hole_radius=0.008)
    return replace(drive, disc_count=1, output_pins=holes, disc_material=steel, pin_material=steel)


@pytest.fixture(scope="module")
def solved(krol) -> Equilibria:
    model = EquivalentModel(krol)
    return model.equilibria(np.zeros((1, len(model.columns))), -TORQUE, 2 * np.pi / TEETH * np.arange(96) / 96)


def test_the_largest_pin_force_is_the_printed_one(solved):
    """129.17 N is the limit of many pins; sixteen give 126.9 to 129.3 N as the pins go by, eight of them carrying."""
    assert solved.status.max() == 0
    pins = forces(solved).pins[0, :, 0]
    largest = pins.max(axis=1)
    assert (largest.min(), largest.max()) == pytest.approx((0.982 * FORCE, 1.001 * FORCE), rel=2e-3)
    assert ((pins > 0).sum(axis=1) == PINS / 2).all()


def test_the_largest_force_on_an_output_pin_is_above_the_printed_one(solved):
    """261.7 N against 273 to 294 N: the printed form has no number of pins; 4T/(n·a) for pins that share is 290.6 N."""
    largest = forces(solved).of("output_pin")[0].max(axis=1)
    assert largest.min() > 1.03 * HOLE_FORCE
    assert (largest.min(), largest.max()) == pytest.approx((1.043 * HOLE_FORCE, 1.126 * HOLE_FORCE), rel=3e-3)
    assert largest.mean() == pytest.approx(4 * TORQUE / (8 * 0.040), rel=0.03)


def test_the_largest_stress_is_below_the_printed_form_which_takes_the_sharpest_lobe(krol, solved):
    """0.5642·√(F/h·(ρ + q)/(η·ρ·q)) with ρ of the printed outline: 404 MPa, 4 % above the 390 MPa here."""
    at = np.linspace(0, 2 * np.pi / TEETH, 20001)
    turned = np.arctan2(np.sin(TEETH * at), 1 / SHORTENING + np.cos(TEETH * at))
    outline = ECCENTRICITY * PINS / SHORTENING * np.exp(1j * at) + ECCENTRICITY * np.exp(1j * PINS * at)
    outline = outline - PIN_RADIUS * np.exp(1j * (at + turned))
    step = at[1] - at[0]
    first = np.gradient(outline, step)[2:-2]
    second = np.gradient(np.gradient(outline, step), step)[2:-2]
    curvature = (first.conj() * second).imag / np.abs(first) ** 3
    sharpest = 1 / curvature.max()
    yielding = 2 * (1 - 0.3**2) / 200e9
    printed = 0.5642 * np.sqrt(FORCE / WIDTH * (sharpest + PIN_RADIUS) / (yielding * sharpest * PIN_RADIUS))
    around = np.linspace(0, 2 * np.pi, 7200)
    even = peak_pressure(krol.cycloid_stage, krol.contact_modulus, around, np.full(around.size, FORCE))
    assert even.max() == pytest.approx(printed, rel=1e-3)
    pins = forces(solved).pins[0, :, 0]
    found = unit_pressure(solved)[:, 0] * np.sqrt(pins / WIDTH)
    assert printed / found.max() == pytest.approx(1.037, abs=0.003)


def test_readings_of_a_printed_drive_are_what_one_micrometre_on_the_flank_leaves():
    """0.25′ in the mean, a step of its dial; the stage with 5 µm on flank and in holes has 2.66′.

    One micrometre all round is 0.24′, so readings under friction without a torque are no measure of clearance.
    """
    landed = -1e-2 * np.array([[5, 6, 6, 5, 5, 5, 5, 6, 6, 6], [4, 5, 4, 4, 4, 4, 4, 5, 5, 5]])  # mm on 150 mm
    measured = np.abs(np.diff(landed, axis=0)).mean() / 150 / ARCMINUTE
    drive = load_reducer(LINEAR_STAGE)
    stage = drive.cycloid_stage
    assert (stage.pin_count, stage.pin_circle_radius, stage.pin_radius, stage.eccentricity) == (30, 0.04, 0.0025, 0.001)
    exact = with_stage()
    tight = replace(
        exact, output_pins=replace(drive.output_pins, hole_radius=drive.output_pins.pin_radius + stage.eccentricity)
    )
    one = replace(tight, modification=replace(tight.modification, equidistant=1e-6))
    assert measured == pytest.approx(0.252, abs=1e-3)
    assert backlash(one) == pytest.approx(0.238, abs=2e-3)
    assert backlash(drive) == pytest.approx(2.66, abs=0.02)


def test_play_of_discs_that_are_too_small_all_round():
    """2·0.05 mm over e·zc of 19.5 mm is 17.6′, here 17.8′; read were 1.36°: 81.6′, or 6.3′ if it was at the motor."""
    loose = with_stage(pin_count=14, disc_teeth=13, pin_circle_radius=0.034, pin_radius=0.0035, eccentricity=0.0015)
    holes = replace(
        loose.output_pins, circle_radius=0.018, pin_radius=0.003, hole_radius=0.0045
    )  # assumed, without room
    loose = replace(loose, disc_count=1, output_pins=holes)
    loose = replace(loose, modification=replace(loose.modification, equidistant=50e-6))
    found = backlash(loose)
    assert found == pytest.approx(2 * 0.05 / 19.5 / ARCMINUTE, rel=0.02)
    read = 1.36 * DEGREE / ARCMINUTE
    assert (read / found, read / 13 / found) == pytest.approx((4.59, 0.353), rel=0.01)


def backlash(drive: Reducer) -> float:
    """Return the width of the loop without torque [arcmin]."""
    model = EquivalentModel(drive)
    errors = np.zeros((1, len(model.columns)))
    for name, amount in drive.modification.deviations.items():
        errors[0, model.columns.index(name)] = amount
    angles = 2 * np.pi / drive.cycloid_stage.disc_teeth * np.arange(12) / 12
    return float(hysteresis_loop(model, errors, angles).backlash[0]) / ARCMINUTE
