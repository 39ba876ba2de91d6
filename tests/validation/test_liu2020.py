"""RV-20E of liu2020, Table 4, against an independent calculation of the same model.

Frame and signs: angles counter-clockwise, E_ij is crank i in disc j, bores turn with the disc, journals with the
crankshaft, carrier bores with the carrier, the assembly error stands still; torque negative against the rotation.
The curves in ``rv20e_table4_curves.csv`` come from a program that shares nothing with this package; it agrees with a
second one to 8e-7″, so 1e-6″ is the tolerance. Stiffness: the preset's, 1.78e9 N/m at every pin.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.builders import order_spectrum
from tests.printed_tables import number, printed, row
from tests.validation_manual import shown
from tolalloc.reading.units import ARCMINUTE, ARCSECOND
from tolalloc.reducers.equivalent.hysteresis import LOOP_ANGLES, hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel, Status

PUBLISHED = np.loadtxt(Path(__file__).parent / "rv20e_table4_curves.csv", delimiter=",", skiprows=1)
TORQUES = (-1.0, -10.0, -167.0)
PAGE = "validation/liu2020.md"
PEAK_TO_PEAKS = "| torque [N·m] | stated, 6,240 angles [″] | here, the same angles [″] | here, refined extremes [″] |"
ORDERS = "| order of the output turn | stated amplitude [″] | here [″] |"
MAIN_ORDERS = {1: 16.9, 78: 11.8, 80: 11.7, 79: 8.4, 39: 6.3, 2: 4.4}
"""Order → stated amplitude at −10 N·m [arcsec]."""
STATED = {-1.0: 96.582, -10.0: 96.462, -167.0: 93.908}
"""Torque → peak-to-peak that was called converged [arcsec]."""


def group_alone(rv20e, table4, *sources: str) -> np.ndarray:
    """Keep the modification and the named sources' errors; set all others to zero."""
    keep = [name.startswith((*sources, "modification.")) for name in rv20e.columns]
    return np.where(keep, table4, 0.0)


def peak_to_peak(model, errors, torque=-1.0) -> np.ndarray:
    result = model.extremes(errors, torque)
    assert (result.status == Status.CONVERGED).all()
    return result.peak_to_peak / ARCSECOND


@pytest.mark.parametrize("column", [1, 2, 3])
def test_curve_agrees_at_every_angle(rv20e, table4, column):
    curves = rv20e.equilibria(table4, TORQUES[column - 1], PUBLISHED[:, 0])
    np.testing.assert_allclose(curves.transmission_error[0] / ARCSECOND, PUBLISHED[:, column], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("angles", "expected"), [(468, 90.38), (936, 96.03), (1404, 95.31), (1560, 96.23), (1872, 96.39), (6240, 96.58)]
)
def test_equally_spaced_angles_miss_the_extremes(rv20e, table4, angles, expected):
    curves = rv20e.equilibria(table4, -1.0, 2 * np.pi * np.arange(angles) / angles)
    found = float(np.ptp(curves.transmission_error)) / ARCSECOND
    assert found == pytest.approx(expected, abs=0.005)
    if angles == 936:
        shown("S1", found)


@pytest.mark.parametrize(("torque", "expected"), [(-1.0, 96.582), (-10.0, 96.462)])
def test_peak_to_peak_of_6240_angles_is_the_stated_one(rv20e, table4, torque, expected):
    curves = rv20e.equilibria(table4, torque, 2 * np.pi * np.arange(6240) / 6240)
    assert np.ptp(curves.transmission_error) / ARCSECOND == pytest.approx(expected, abs=0.0006)


@pytest.mark.parametrize(("torque", "expected"), STATED.items())
def test_refined_peak_to_peak_is_above_the_equally_spaced_one(rv20e, table4, torque, expected):
    """96.582″ was called converged because 6,240 and 24,960 angles agree; both kinks lie between them.

    See docs/validation/liu2020.md. At −1 N·m the refined value is still within the 0.05″ that was asked for.
    """
    refined = peak_to_peak(rv20e, table4, torque)[0]
    assert expected - 0.001 < refined < expected + 0.15
    if torque == -1.0:
        assert refined == pytest.approx(96.58, abs=0.05)


def test_the_page_prints_the_peak_to_peaks(rv20e, table4):
    rows = []
    for torque, stated in STATED.items():
        curve = rv20e.equilibria(table4, torque, 2 * np.pi * np.arange(6240) / 6240).transmission_error
        found = (float(np.ptp(curve)) / ARCSECOND, peak_to_peak(rv20e, table4, torque)[0])
        rows.append(row(number(torque, "g"), *(f"{own:.3f}" for own in (stated, *found))))
    assert printed(PAGE, PEAK_TO_PEAKS) == rows


def test_the_extremes_lie_between_the_6240_angles(rv20e, table4):
    """Exact tables on 2,001 angles around each extreme, nothing interpolated: 96.629″, 0.047″ above the stated one."""
    result = rv20e.extremes(table4, -1.0)
    truth = []
    for side, extreme in ((0, np.max), (1, np.min)):
        near = result.carrier_angle[0, side] + np.linspace(-1, 1, 2001) * 2 * np.pi / 6240
        truth.append(extreme(rv20e.equilibria(table4, -1.0, near).transmission_error) / ARCSECOND)
    assert truth[0] - truth[1] == pytest.approx(96.629, abs=0.001)
    assert result.peak_to_peak[0] / ARCSECOND == pytest.approx(truth[0] - truth[1], abs=0.005)
    shown("S2", result.peak_to_peak[0] / ARCSECOND)


def test_mean(rv20e, table4):
    curves = rv20e.equilibria(table4, -1.0, 2 * np.pi * np.arange(6240) / 6240)
    assert curves.transmission_error.mean() / ARCSECOND == pytest.approx(-5.669, abs=0.0006)


def test_main_orders(rv20e, table4):
    curves = rv20e.equilibria(table4, -10.0)
    main = order_spectrum(curves.transmission_error).main(6)
    assert [order for order, _, _ in main] == list(MAIN_ORDERS)
    amplitudes = [amplitude / ARCSECOND for _, amplitude, _ in main]
    np.testing.assert_allclose(amplitudes, list(MAIN_ORDERS.values()), atol=0.07)
    rows = [
        row(str(order), str(stated), f"{own:.2f}")
        for (order, stated), own in zip(MAIN_ORDERS.items(), amplitudes, strict=True)
    ]
    assert printed(PAGE, ORDERS) == rows
    shown("V6", amplitudes[0])


def test_contact_set_changes_over_the_turn(rv20e, table4):
    pins = rv20e.equilibria(table4, -1.0, PUBLISHED[:, 0]).pins_in_contact
    assert pins.min() == 1
    assert 28 <= pins.max() <= 31


@pytest.mark.parametrize(
    ("sources", "multiples"),
    [
        (("housing.pitch", "housing.runout"), (39, 78, 117)),
        (("carrier.assembly",), (39, 78, 117)),
        (("disc1.", "disc2."), (40, 80, 120)),
        (("carrier.bore",), (40, 80, 120)),
    ],
)
def test_order_rule(rv20e, table4, sources, multiples):
    """Errors fixed in the housing make multiples of zc = 39, errors turning with disc or carrier of zp = 40.

    With two cranks the bearings' stiffness has a direction that turns with the carrier, so a few percent of each
    wave show at neighbouring even orders; order 1 stays empty.
    """
    curves = rv20e.equilibria(group_alone(rv20e, table4, *sources), -1.0)
    spectrum = order_spectrum(curves.transmission_error)
    own = spectrum.order % multiples[0] == 0
    largest = spectrum.amplitude[0][own].max()
    assert spectrum.amplitude[0][~own].max() < 0.08 * largest
    assert spectrum.amplitude[0, 0] < 1e-9 * largest


def test_order_1_needs_both_kinds(rv20e, table4):
    together = group_alone(rv20e, table4, "housing.pitch", "housing.runout", "disc1.", "disc2.")
    spectrum = order_spectrum(rv20e.equilibria(together, -1.0).transmission_error)
    assert spectrum.amplitude[0, 0] / ARCSECOND > 5


def test_groups_alone_rank_as_stated_and_do_not_add_up(rv20e, table4):
    alone = {
        name: peak_to_peak(rv20e, group_alone(rv20e, table4, *sources))[0]
        for name, sources in {
            "disc pitch": ("disc1.pitch", "disc2.pitch"),
            "housing pitch": ("housing.pitch",),
            "disc run-out": ("disc1.runout", "disc2.runout"),
            "housing run-out": ("housing.runout",),
            "carrier assembly": ("carrier.assembly",),
            "carrier bores": ("carrier.bore",),
            "disc bores": ("disc1.bore", "disc2.bore"),
            "crank eccentricity": ("crank",),
            "pin and groove": ("pin.", "housing.groove"),
        }.items()
    }
    teeth_and_pins = ("disc pitch", "housing pitch", "disc run-out", "housing run-out")
    assert min(alone[name] for name in teeth_and_pins) > alone["carrier assembly"]
    assert alone["carrier assembly"] > alone["crank eccentricity"]
    assert sum(alone.values()) == pytest.approx(112.5, abs=0.05)  # 96.6 together: they do not add up


def test_cranks_turned_alike_change_nothing(rv20e, table4):
    """Journals all displaced alike across their eccentricity only shift the cranks' zero direction."""
    alike = group_alone(rv20e, table4)
    nothing = peak_to_peak(rv20e, alike)[0]
    for name in rv20e.columns:
        if name.startswith("crank") and name.endswith("eccentricity.y"):
            alike[0, rv20e.columns.index(name)] = 2e-6 if "journal1" in name else -2e-6
    assert peak_to_peak(rv20e, alike)[0] == pytest.approx(nothing, abs=1e-5)


def test_superposed_single_curves_are_not_the_joint_curve(rv20e, table4):
    """A linear surrogate is not enough: the contact switches."""
    nothing = rv20e.equilibria(group_alone(rv20e, table4), -1.0).transmission_error[0]
    groups = [("disc1.", "disc2."), ("housing.",), ("carrier.",), ("crank",), ("pin.",)]
    summed = nothing + sum(
        rv20e.equilibria(group_alone(rv20e, table4, *group), -1.0).transmission_error[0] - nothing for group in groups
    )
    joint = rv20e.equilibria(table4, -1.0).transmission_error[0]
    assert np.abs(summed - joint).max() / ARCSECOND > 10


@pytest.mark.parametrize("field", ["crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing"])
@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_bearing_stiffness_hardly_moves_the_peak_to_peak(rv20e, table4, field, factor):
    stiffness = replace(rv20e.reducer.stiffness, **{field: factor * getattr(rv20e.reducer.stiffness, field)})
    changed = EquivalentModel(replace(rv20e.reducer, stiffness=stiffness))
    assert abs(peak_to_peak(changed, table4)[0] - peak_to_peak(rv20e, table4)[0]) <= 0.33


def test_torsional_stiffness_of_the_perfect_reducer(rv20e):
    loop = hysteresis_loop(rv20e, np.zeros((1, len(rv20e.columns))), LOOP_ANGLES)
    assert loop.torsional_stiffness[0] * ARCMINUTE == pytest.approx(2519, abs=1)


def test_modification_gap_on_the_flank_and_at_tip_and_root(rv20e, table4):
    """Table 4's modification opens every pin: 8.0 µm at tip and root, 1.04 µm where cos φ′ = K1."""
    from studies.benchmarks.plain_rows import spring_groups

    contact = spring_groups(rv20e.reducer, np.array([0.0]))[-1]
    columns = [contact.columns.index(f"modification.{name}") for name in ("equidistant", "shift")]
    gap = -contact.error[0][:, columns] @ np.array([-17.0, -25.0])
    assert gap.max() == pytest.approx(8.0, abs=1e-9)
    shortening = rv20e.reducer.cycloid_stage.shortening
    assert gap.min() == pytest.approx(-17 + 25 * np.sqrt(1 - shortening**2), abs=0.02)
    assert gap.min() > 1.0
