"""Radial clearance of built units against the exact distance and all rows, and the stresses read off the pin forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studies.benchmarks.plain_rows import spring_groups
from tests.builders import unit_with
from tolalloc.reading.units import MEGAPASCAL, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.clearance import exact_clearance
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.equivalent.model import Status
from tolalloc.reducers.equivalent.outputs import forces, radial_clearance
from tolalloc.reducers.reducer.design import Modification
from tolalloc.reducers.response.outputs import OutputsResponse, requirements_of

CLEARANCE = "radial clearance at tip and root [µm]"


@pytest.mark.parametrize(("equidistant", "shift"), [(-17e-6, -25e-6), (8e-6, 0.0), (3e-6, 5e-6)])
def test_an_exact_unit_has_the_clearance_of_its_modification(rv20e, equidistant, shift):
    amounts = Modification(equidistant=equidistant, shift=shift)
    errors = unit_with(rv20e, **{name.replace(".", "__"): value for name, value in amounts.deviations.items()})
    assert radial_clearance(rv20e, errors)[0] == pytest.approx(amounts.radial_clearance, abs=1e-18)


@pytest.mark.parametrize(("diameter", "groove"), [(4e-6, 0.0), (0.0, 3e-6), (-3e-6, 2e-6)])
def test_changed_radii_change_it_as_they_change_the_exact_distance(rv20e, diameter, groove):
    stage, ground = rv20e.reducer.cycloid_stage, rv20e.reducer.modification
    # A thicker pin rests on the far side of its groove: its centre comes inward by as much as its radius grows.
    outward = groove - diameter / 2
    built = replace(
        stage, pin_radius=stage.pin_radius + diameter / 2, pin_circle_radius=stage.pin_circle_radius + outward
    )
    same_teeth = Modification(equidistant=ground.equidistant - diameter / 2, shift=ground.shift - outward)
    exact = exact_clearance([ToothProfile(stage=built, modification=same_teeth)], np.array([0.0, np.pi]))
    found = radial_clearance(rv20e, unit_with(rv20e, pin__diameter=diameter, housing__groove__radius=groove))[0]
    np.testing.assert_allclose(exact[0], found, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_it_is_the_smallest_gap_of_all_rows_at_tips_and_roots(rv20e, generator):
    stage, count = rv20e.reducer.cycloid_stage, rv20e.reducer.cycloid_stage.pin_count
    errors = generator.normal(0.0, 1e-6, (5, len(rv20e.columns)))
    smallest = np.full(5, np.inf)
    for disc in range(rv20e.reducer.disc_count):
        for pin in range(count):
            crank = np.pi * (np.arange(2 * stage.disc_teeth) + disc) - 2 * np.pi * pin / count
            group = spring_groups(rv20e.reducer, crank / stage.disc_teeth)[-1]
            rows = group.error[:, disc * count + pin]
            own = errors[:, [rv20e.columns.index(name) for name in group.columns]]
            smallest = np.minimum(smallest, -(own @ rows.T).max(axis=1))
    np.testing.assert_allclose(radial_clearance(rv20e, errors), smallest, rtol=0, atol=1e-18)


def test_errors_that_are_tangential_or_move_a_disc_do_not_count(rv20e):
    exact = radial_clearance(rv20e, unit_with(rv20e))
    for name in (
        "housing.pitch.cos1",
        "disc1.pitch.sin2",
        "each_pin.position.3.y",
        "carrier.assembly.x",
        "disc1.tilt.x",
    ):
        named = unit_with(rv20e, **{name.replace(".", "__"): 5e-6})
        np.testing.assert_allclose(radial_clearance(rv20e, named), exact, rtol=0, atol=1e-18, err_msg=name)
    for name in ("housing.runout.cos1", "disc2.runout.sin2", "each_pin.diameter.3", "disc1.each_tooth.runout.7"):
        named = unit_with(rv20e, **{name.replace(".", "__"): 5e-6})
        assert radial_clearance(rv20e, named) == pytest.approx(exact - 5e-6, abs=0.02e-6), name


def test_an_error_that_is_no_number_is_a_status(prepared):
    reading = requirements_of(prepared.model.reducer)[-1]
    errors = prepared.model.kernel.errors(np.zeros((2, len(prepared.model.kernel.columns))))
    errors[1, prepared.model.kernel.model.columns.index("pin.diameter")] = np.nan
    values, status = reading.read(prepared.model.kernel, errors)
    assert status.tolist() == [Status.CONVERGED, Status.NOT_FINITE]
    assert values[0, 0] == pytest.approx(prepared.model.reducer.modification.radial_clearance / MICROMETRE)


@pytest.mark.slow
def test_line_load_and_pressure_are_those_of_the_most_loaded_pin(prepared, generator):
    kernel, stage = prepared.model.kernel, prepared.model.reducer.cycloid_stage
    x = generator.normal(0.0, 0.5e-6, (3, len(kernel.columns)))
    response = OutputsResponse(kernel=kernel, readings=requirements_of(kernel.model.reducer))
    values = dict(zip(response.outputs, response(x).values.T, strict=True))
    force = values["largest pin force, rated torque [N]"]
    line_load = values["largest line load, rated torque [N/mm]"]
    np.testing.assert_allclose(line_load * stage.face_width / MILLIMETRE, force, rtol=1e-12)
    torque = -abs(prepared.model.reducer.load.rated_torque)
    solved = kernel.model.equilibria(kernel.errors(x), torque, TURN_ANGLES)
    pins = forces(solved).pins
    pressure = np.zeros(3)
    for angle, disc, pin in np.ndindex(pins.shape[1:]):
        crank = -stage.disc_teeth * solved.carrier_angle[angle] + np.pi * disc
        cosine = np.cos(2 * np.pi * pin / stage.pin_count - crank)
        square = 1 + stage.shortening**2 - 2 * stage.shortening * cosine
        # The radius of the path of the pin's centre, by its own formula; concave is positive.
        path = stage.pin_circle_radius * square**1.5
        path /= stage.shortening * (1 + stage.pin_count) * cosine - (1 + stage.pin_count * stage.shortening**2)
        tooth = -(path + stage.pin_radius)
        curvature = 1 / stage.pin_radius + 1 / tooth
        modulus = prepared.model.reducer.contact_modulus
        own = np.sqrt(pins[:, angle, disc, pin] * modulus * curvature / (np.pi * stage.face_width))
        pressure = np.maximum(pressure, own)
    np.testing.assert_allclose(values["peak pressure, rated torque [MPa]"], pressure / MEGAPASCAL, rtol=1e-9)
