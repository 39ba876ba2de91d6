"""Table 2 of liu2020: the formulas, and the dimensions that reproduce the values of its Table 5."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.published.liu2020_table2 import mesh_as_printed, pin_contact_as_printed
from tests.builders import reducer_file
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reducers.cycloid.loaded_contact import pin_contact_table2
from tolalloc.reducers.reducer.design import CycloidStage
from tolalloc.reducers.reducer.files import (
    load_identified_stiffness,
    load_reducer,
    with_stiffness,
    write_identified_stiffness,
)
from tolalloc.reducers.reducer.stiffness import (
    TAPER_ANGLE,
    IdentifiedStiffness,
    Material,
    ball_bearing,
    ball_coefficient_as_printed,
    contact_modulus,
    gear_mesh,
    largest_preload,
    line_contact,
    pin_bending,
    roller_bearing,
    shaft_support,
)

RV20E = CycloidStage(
    pin_count=40, disc_teeth=39, pin_circle_radius=0.052, pin_radius=0.002, eccentricity=0.0009, face_width=0.01
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
    stage = RV20E
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
    assert gear_mesh(1.6, 10.0, 26.0, 0.010, 206e9) == pytest.approx(per_width * 10 * 1e6)
    assert mesh_as_printed(1.6, 10.0, 26.0) == pytest.approx(per_width, rel=1e-3)


def test_printed_pin_row_is_the_sound_one_on_the_concave_part_only():
    angles = np.linspace(0.05, 3.1, 400)
    printed = pin_contact_as_printed(RV20E, 206e9, 0.3, angles)
    steel = Material(elastic_modulus=206e9, poisson_ratio=0.3)
    flat = line_contact(0.010, contact_modulus(steel, steel))
    sound = pin_contact_table2(RV20E, flat, angles)
    concave = sound < flat
    np.testing.assert_allclose(printed[concave], sound[concave], rtol=1e-12)
    assert (printed[~concave] > flat).all()
    thick = replace(RV20E, pin_radius=0.003)
    assert pin_contact_as_printed(thick, 206e9, 0.3, angles).min() < 0  # what the model must not take


def test_balls_between_flat_races():
    """The printed coefficient is Hertz's where r_g is half the ball's radius; the sound row is its slope."""
    radius, balls, preload, modulus = 0.003, 19, 1000.0, 206e9 / (2 * (1 - 0.3**2))
    one = (preload / balls / (4 / 3 * modulus * np.sqrt(radius))) ** (2 / 3)  # approach of a ball and one race
    coefficient = preload / (2 * one) ** 1.5
    assert ball_coefficient_as_printed(radius / 2, balls, 206e9, 0.3) == pytest.approx(coefficient)
    slope = 1.5 * coefficient * (2 * one) ** 0.5
    assert ball_bearing(radius, balls, preload, 206e9, 0.3) == pytest.approx(slope)
    contact = (3 * largest_preload(radius, balls, 206e9, 0.3) / balls * radius / (4 * modulus)) ** (1 / 3)
    assert contact == pytest.approx(0.1 * radius)
    assert ball_coefficient_as_printed(radius, balls, 206e9, 0.3) == pytest.approx(7.85e10, rel=0.001)  # Table 5


def test_every_sound_row_is_a_force_over_a_length():
    """Lengths times λ and forces times φ make E times φ/λ² and a stiffness times φ/λ; two printed rows fail."""
    length, force = 1.7, 0.6
    modulus, angle = force / length**2, np.array([0.3, 1.5])

    def scaled(row):
        return row(length, force, 206e9 * modulus) / row(1.0, 1.0, 206e9)

    def stage(s: float) -> CycloidStage:
        lengths = ("pin_circle_radius", "pin_radius", "eccentricity", "face_width")
        return replace(RV20E, **{name: s * getattr(RV20E, name) for name in lengths})

    sound = {
        "K_s": lambda s, f, e: shaft_support(0.02 * s, 0.1 * s, e),
        "K_pd": lambda s, f, e: roller_bearing(0.1226 * s, e, 0.3),
        "K_b": lambda s, f, e: roller_bearing(0.1817 * s, e, 0.3, TAPER_ANGLE),
        "K_sp": lambda s, f, e: gear_mesh(1.6, 10.0, 26.0, 0.01 * s, e),
        "K_ca": lambda s, f, e: ball_bearing(0.003 * s, 19, 1000.0 * f, e, 0.3),
        "C": lambda s, f, e: line_contact(0.01 * s, e / 1.82),
        "K_djk": lambda s, f, e: pin_contact_table2(stage(s), line_contact(0.01 * s, e / 1.82), angle),
        "K_djk printed": lambda s, f, e: pin_contact_as_printed(stage(s), e, 0.3, angle),
        "pin bending": lambda s, f, e: pin_bending(0.004 * s, 0.03 * s, e),
    }
    for name, row in sound.items():
        np.testing.assert_allclose(scaled(row), force / length, rtol=1e-12, err_msg=name)
    printed_balls = scaled(lambda s, f, e: ball_coefficient_as_printed(0.003 * s, 19, e, 0.3))
    assert printed_balls == pytest.approx(force / length**1.5)
    assert scaled(lambda s, f, e: mesh_as_printed(1.6, 10.0, 26.0)) == 1.0
    assert scaled(lambda s, f, e: largest_preload(0.003 * s, 19, e, 0.3)) == pytest.approx(force)


def altered(folder: Path, old: str, new: str) -> Path:
    """Return the file of a reducer with one text changed."""
    return reducer_file(folder / "mine.toml", "rv20e_liu2020", (old, new))


def test_carrier_bearing_from_a_file(tmp_path):
    balls = "{{ ball_radius_mm = 3, balls = 19, preload_n = {} }}"
    path = altered(tmp_path, "carrier_bearing = 7.85e10", "carrier_bearing = " + balls.format(1000))
    assert load_reducer(path).stiffness.carrier_bearing == ball_bearing(0.003, 19, 1000.0, 206e9, 0.3)
    path = altered(tmp_path, "carrier_bearing = 7.85e10", "carrier_bearing = " + balls.format(30000))
    with pytest.raises(InputError, match=r"mine\.toml: stiffness\.carrier_bearing\.preload_n is 30000; .* 2\.581e\+04"):
        load_reducer(path)


def test_a_shaft_too_short_to_bend_is_refused(tmp_path):
    path = altered(tmp_path, "sun_support = 1e8 ", "sun_support = { diameter_mm = 20, length_mm = 15 } ")
    with pytest.raises(InputError, match=r"sun_support: length_mm is 15; allowed is diameter_mm = 20 or more"):
        load_reducer(path)
    path = altered(tmp_path, "sun_support = 1e8 ", "sun_support = { diameter_mm = -2, length_mm = 15 } ")
    with pytest.raises(InputError, match=r"stiffness\.sun_support\.diameter_mm is -2; input should be greater than 0"):
        load_reducer(path)
    path = altered(tmp_path, "sun_support = 1e8 ", "sun_support = { diameter = 20, length_mm = 15 } ")
    with pytest.raises(
        UnknownNameError, match=r"stiffness\.sun_support\.diameter'; .* stiffness\.sun_support\.diameter_mm"
    ):
        load_reducer(path)


def test_formulas_from_a_file(tmp_path):
    bearing = ("crank_disc_bearing = 1.09e10", "crank_disc_bearing = { loaded_length_mm = 122.6 }")
    support = ("sun_support = 1e8 ", "sun_support = { diameter_mm = 20, length_mm = 100 } ")
    stiffness = load_reducer(reducer_file(tmp_path / "mine.toml", "rv20e_liu2020", bearing, support)).stiffness
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
        with_stiffness(load_reducer("rv20e_liu2020"), identified).stiffness.carrier_bearing
        == identified.values["carrier_bearing"]
    )


IDENTIFIED = """source = "mine"
correlation = {correlation}
[stiffness.crank_disc_bearing]
value = 1e10
standard_uncertainty = 2e9
[stiffness.pin_contact]
value = 2e9
standard_uncertainty = 1e8
"""


def test_covariance_of_the_relative_changes(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(IDENTIFIED.format(correlation="[[1, -0.4], [-0.4, 1]]"), encoding="utf-8")
    found = load_identified_stiffness(path).covariance
    np.testing.assert_allclose(found, [[0.04, -0.004], [-0.004, 0.0025]])
    alone = load_identified_stiffness("rv20e_table6")
    np.testing.assert_array_equal(alone.correlation, np.eye(3))


@pytest.mark.parametrize(
    ("correlation", "words"),
    [
        ("[[1.0, 0.1]]", r"numbers per row, is \[2\]; allowed is 2 rows of 2, in the order crank_disc_bearing, pin_c"),
        ("[[1.0, 0.1], [0.1]]", r"numbers per row, is \[2, 1\]; allowed is 2 rows of 2"),
        ("[[1.0, 0.1], [0.2, 1.0]]", r"crank_disc_bearing with pin_contact is 0\.1; allowed is 0\.2, as in the mirr"),
        ("[[1.0, 0.1], [0.1, 0.9]]", r"pin_contact with pin_contact is 0\.9; allowed is 1, that of"),
        ("[[1.0, 1.1], [1.1, 1.0]]", r"crank_disc_bearing with pin_contact is 1\.1; allowed is -1 to 1"),
        ("[[1.0, nan], [0.1, 1.0]]", r"correlation\.0\.1 is nan"),
    ],
)
def test_what_is_no_correlation_is_refused_in_one_sentence(tmp_path, correlation, words):
    path = tmp_path / "mine.toml"
    path.write_text(IDENTIFIED.format(correlation=correlation), encoding="utf-8")
    with pytest.raises(InputError, match=r"mine\.toml: .*" + words):
        load_identified_stiffness(path)


def test_three_stiffnesses_cannot_all_oppose_each_other():
    names = ("crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing")
    with pytest.raises(InputError, match=r"smallest eigenvalue of correlation is -0\.8"):
        IdentifiedStiffness(
            source="mine",
            values=dict.fromkeys(names, 1e10),
            standard_uncertainty=dict.fromkeys(names, 1e9),
            correlation=1.9 * np.eye(3) - 0.9,
        )


def test_written_is_read_back_equal(tmp_path):
    identified = IdentifiedStiffness(
        source='bench "3", 2024\n\\ line \x7f',
        values={"pin_contact": 1.2345678901234567e9, "carrier_bearing": 7.85e10},
        standard_uncertainty={"pin_contact": 1.0 / 3.0, "carrier_bearing": 0.0},
        correlation=np.array([[1.0, -1.0 / 3.0], [-1.0 / 3.0, 1.0]]),
        notes=("first", "zweite: µ"),
    )
    path = tmp_path / "bench.toml"
    write_identified_stiffness(identified, path)
    again = load_identified_stiffness(path)
    assert again == identified
    assert again != replace(identified, correlation=np.eye(2))
    with pytest.raises(InputError, match="the file exists"):
        write_identified_stiffness(identified, path)
    with pytest.raises(InputError, match="cannot be made"):
        write_identified_stiffness(identified, tmp_path / "none" / "bench.toml")
    unreadable = replace(identified, values={"pin_contact": 1.0, "carrier_bearing": 7.85e10})
    with pytest.raises(InputError, match=r"stiffness\.pin_contact\.value is 1\.0"):
        write_identified_stiffness(unreadable, tmp_path / "other.toml")
    assert not (tmp_path / "other.toml").exists()
