"""Table 2 of liu2020: the formulas, and the dimensions that reproduce the values of its Table 5."""

from __future__ import annotations

import numpy as np
import pytest

from tolalloc.cycloid.contact_stiffness import pin_contact_table2
from tolalloc.reducer.design import CycloidStage
from tolalloc.reducer.files import PRESETS, load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.reducer.stiffness import (
    TAPER_ANGLE,
    Material,
    contact_modulus,
    gear_mesh,
    line_contact,
    roller_bearing,
    shaft_support,
)


def test_bearings_of_table_5():
    """l·n of 122.6 and 181.7 mm give the printed 1.09e10 and 1.64e10 N/m to their three digits."""
    assert roller_bearing(0.1226, 206e9, 0.3) == pytest.approx(1.09e10, rel=0.005)
    assert roller_bearing(0.1817, 206e9, 0.3, TAPER_ANGLE) == pytest.approx(1.64e10, rel=0.005)


def test_pin_contact_at_10_mm():
    steel = Material(elastic_modulus=206e9, poisson_ratio=0.3)
    assert line_contact(0.010, contact_modulus(steel, steel)) == pytest.approx(1.78e9, rel=0.002)


def test_concave_part_is_two_curvatures_in_contact():
    """On the concave part K = C(ρ − r)/(ρ + r), with ρ the concave radius of the profile; C elsewhere."""
    stage = CycloidStage(
        pin_count=40,
        disc_teeth=39,
        pin_circle_radius=0.052,
        pin_radius=0.002,
        eccentricity=0.0009,
        face_width=0.01,
    )
    shortening, pins, circle, pin = stage.shortening, 40, 0.052, 0.002
    angles = np.linspace(0.05, 3.0, 200)
    stiffness = pin_contact_table2(stage, 1.0, angles)
    root = 1 + shortening**2 - 2 * shortening * np.cos(angles)
    term = shortening * (1 + pins) * np.cos(angles) - (1 + pins * shortening**2)
    concave = term > 0
    centre_path = circle * root[concave] ** 1.5 / term[concave]  # radius of the trochoid of pin centres
    radius = centre_path + pin
    np.testing.assert_allclose(stiffness[concave], (radius - pin) / (radius + pin), rtol=1e-12)
    assert (stiffness[~concave] == 1.0).all()
    assert concave.any()
    assert not concave.all()


def test_shaft_and_mesh():
    assert shaft_support(0.02, 0.1, 206e9) == pytest.approx(3 * np.pi * 0.02**4 * 206e9 / (64 * 0.1**3))
    per_width = (0.75 * 1.6 + 0.25) / (0.04723 + 0.15551 / 10 + 0.25791 / 26)
    assert gear_mesh(1.6, 10.0, 26.0, 0.010) == pytest.approx(per_width * 10 * 1e6)


def test_formulas_from_a_file(tmp_path):
    text = (PRESETS / "rv20e.reducer.toml").read_text(encoding="utf-8")
    text = text.replace("crank_disc_bearing = 1.09e10", "crank_disc_bearing = { loaded_length_mm = 122.6 }")
    text = text.replace("sun_support = 1e8 ", "sun_support = { diameter_mm = 20, length_mm = 100 } ")
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    stiffness = load_reducer(path).stiffness
    assert stiffness.crank_disc_bearing == roller_bearing(0.1226, 206e9, 0.3)
    assert stiffness.sun_support == shaft_support(0.02, 0.1, 206e9)


def test_table_6_is_the_mean_of_its_ten_rows():
    printed = {
        "crank_disc_bearing": [1.1015] * 7 + [1.1014, 1.1015, 1.1014],
        "crank_carrier_bearing": [1.7993, 1.7991, 1.7595, 1.7582, 1.8, 1.706, 1.8, 1.7821, 1.7290, 1.7989],
        "carrier_bearing": [8.0, 7.9993, 8.0, 8.0, 8.0, 7.9396, 8.0, 8.0, 7.9897, 7.9996],
    }
    identified = load_identified_stiffness("rv20e_table6")
    for field, values in printed.items():
        assert identified.values[field] == pytest.approx(np.mean(values) * 1e10, rel=1e-6)
        assert identified.standard_uncertainty[field] == pytest.approx(np.std(values, ddof=1) * 1e10, rel=0.02)
    assert (
        with_stiffness(load_reducer("rv20e"), identified).stiffness.carrier_bearing
        == identified.values["carrier_bearing"]
    )
