"""RV-80E of yang2021: which orders are strong, where order 1 comes from, and how far two prototypes are off.

Printed are teeth, module, pin circle, pin, eccentricity, the number of cranks, and of two prototypes the measured
transmission error (−29.68…30.39″, −31.51…33.13″). Assumed is everything else: the preset's dimensions, modification and
1 N·m of torque; as part errors the shipped tolerance table of an RV-20E, its third crank like its first, with zones as
they are or larger with the pin circle by the tolerance factor of ISO 286-1. The contact is taken as constant, 18 times
as fast; the last test compares it with the preset's own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import (
    FIRST_STAGE,
    STANDING,
    at_constant_contact,
    drawn_units,
    only,
    order_spectrum,
    seeded_units,
    table_of_three_cranks,
    with_ovality,
)
from tests.validation_manual import shown
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer

MEASURED = np.array([29.68 + 30.39, 31.51 + 33.13])
"""Peak-to-peak of the two prototypes [arcsec]."""
ANGLES = 2 * np.pi * np.arange(960) / 960
"""A multiple of the waves of 40 pins, so that what lies beyond falls on one of them [rad]."""
UNITS = 64
BORES, ASSEMBLY = "carrier.bore", "carrier.assembly"


@pytest.fixture(scope="module")
def errors() -> ErrorModel:
    """The shipped table; zones of the first stage, which it leaves out, from the shipped table of all sources."""
    table, everything = table_of_three_cranks("rv20e_table4"), table_of_three_cranks("rv20e_all_sources")
    first = {name: source for name, source in everything.items() if name.startswith(FIRST_STAGE)}
    return ErrorModel(tuple({**table, **first}.values()))


@pytest.fixture(scope="module")
def model(errors) -> EquivalentModel:
    return EquivalentModel(at_constant_contact(load_reducer("rv80e")), orders=errors.orders)


@pytest.fixture(scope="module")
def units(errors, model) -> np.ndarray:
    return drawn_units(errors, model, UNITS)


@pytest.fixture(scope="module")
def amplitudes(model, units) -> dict[str, np.ndarray]:
    """Root mean square over the units of the amplitude of orders 0, 1, 2 … by the errors that they have [arcsec]."""
    teeth = ("disc1.pitch", "disc2.pitch", "disc1.runout", "disc2.runout")
    kinds = {
        "all": units,
        "turning": only(units, model, *STANDING, *FIRST_STAGE, without=True),
        "bores": only(units, model, BORES),
        "assembly": only(units, model, ASSEMBLY),
        "bores and assembly": only(units, model, BORES, ASSEMBLY),
        "without bores": only(units, model, BORES, without=True),
        "without teeth": only(units, model, *teeth, without=True),
    }
    curves = model.equilibria(np.concatenate(list(kinds.values())), -1.0, ANGLES).transmission_error
    found = order_spectrum(curves).amplitude.reshape(len(kinds), UNITS, -1) / ARCSECOND
    return dict(zip(kinds, np.pad(np.sqrt((found**2).mean(axis=1)), ((0, 0), (1, 0))), strict=True))


def strongest(amplitude: np.ndarray, count: int) -> list[int]:
    return np.argsort(-amplitude)[:count].tolist()


def test_the_preset_is_what_the_source_prints(model):
    reducer, stage = model.reducer, model.reducer.cycloid_stage
    assert (reducer.first_stage.sun_teeth, reducer.first_stage.planet_teeth) == (10, 38)
    assert (stage.disc_teeth, stage.pin_count, reducer.crank_count) == (39, 40, 3)
    printed = (0.00175, 0.0775, 0.0015, 0.004)
    assert (reducer.first_stage.module, stage.pin_circle_radius, stage.eccentricity, stage.pin_radius) == printed


def test_what_turns_makes_the_four_printed_orders_and_no_others(amplitudes):
    """Journals, bores and teeth of the discs together: 40, 80, 120 and 160 in this order, all else a multiple too."""
    found = amplitudes["turning"]
    assert strongest(found, 4) == [40, 80, 120, 160]
    assert found[[40, 80, 120, 160]] == pytest.approx([8.0, 4.3, 2.2, 1.4], rel=0.15)
    others = np.arange(found.size) % 40 != 0
    assert found[others].max() < 1e-9


def test_what_stands_in_the_housing_brings_others_between_them(amplitudes):
    """Of all errors together 40 is strongest and 80 among five; 120 and 160 fall behind the neighbours of 80."""
    found = amplitudes["all"]
    assert found.argmax() == 40
    assert set(strongest(found, 5)) == {1, 40, 78, 79, 80}
    assert {41, 39} < set(strongest(found, 8))
    assert found[[120, 160]] == pytest.approx([1.2, 0.85], rel=0.2)


def test_order_1_needs_the_bores_of_the_carrier_and_something_that_stands_still(amplitudes):
    """Neither the bores nor the carrier's place in the housing makes it alone; both together make 1.2″."""
    assert amplitudes["bores"][1] < 1e-9
    assert amplitudes["assembly"][1] < 1e-9
    assert amplitudes["bores and assembly"][1] == pytest.approx(1.2, rel=0.15)


def test_among_all_errors_order_1_hardly_comes_from_the_bores_of_the_carrier(amplitudes):
    """The source has it from them; here the teeth of discs and housing make it, and without the bores 1 % goes."""
    whole = amplitudes["all"][1]
    assert amplitudes["without bores"][1] == pytest.approx(whole, rel=0.06)
    assert amplitudes["without teeth"][1] < 0.6 * whole


def test_the_first_stage_contributes_little(model, units):
    alone, without = (only(units, model, *FIRST_STAGE, without=turned) for turned in (False, True))
    spans = [np.ptp(model.equilibria(own, -1.0).transmission_error, axis=1) for own in (units, alone, without)]
    whole, first, second = (np.asarray(span) / ARCSECOND for span in spans)
    assert np.median(first) < 0.05 * np.median(whole)
    assert np.sqrt(((whole - second) ** 2).mean()) < 0.03 * np.median(whole)


def by_size(diameter: float) -> float:
    """Return the tolerance factor i of ISO 286-1 of a diameter [mm], 0.45·D^(1/3) + 0.001·D [µm]."""
    return 0.45 * diameter ** (1 / 3) + 0.001 * diameter


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "band", "probability"),
    [(1.0, (22, 36, 54), (0.008, 0.004)), (by_size(2 * 77.5) / by_size(2 * 52.0), (25, 39, 60), (0.049, 0.022))],
)
def test_both_prototypes_lie_above_the_band_of_95_percent(errors, model, scale, band, probability):
    """Missed: 97.5 % of the units of the table stay below 54″, with zones 16 % larger below 60″.

    Both lie below the largest of 2,048 units. Probabilities are two-sided: twice the share of units beyond.
    """
    found = model.extremes(drawn_units(errors, model, 2048, scale), -1.0).peak_to_peak / ARCSECOND
    assert np.quantile(found, [0.025, 0.5, 0.975]) == pytest.approx(band, abs=1.5)
    share = np.array([2 * min((found > own).mean(), (found < own).mean()) for own in MEASURED])
    uncertain = 3 * 2 * np.sqrt(np.array(probability) / 2 / found.size)
    assert (np.abs(share - probability) < uncertain).all()
    if scale > 1:
        shown("V7", 100 * float(share[0]))
    assert found.max() > MEASURED.max()


@pytest.mark.slow
def test_the_constant_contact_stands_for_the_presets_own_in_the_whole_and_not_unit_by_unit(errors, model):
    own = replace(model, reducer=load_reducer("rv80e"))
    some = drawn_units(errors, model, 128)
    constant, logarithmic = (one.extremes(some, -1.0).peak_to_peak / ARCSECOND for one in (model, own))
    levels = [0.1, 0.5, 0.9]
    assert np.quantile(constant, levels) == pytest.approx(np.quantile(logarithmic, levels), rel=0.08)
    assert np.abs(constant - logarithmic).max() > 15


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "oval", "kelvin", "band", "inside"),
    [
        (1.0, 0.0, 0.0, (17, 26, 37), False),
        (1.0, 5e-6, -5.0, (32, 44, 57), False),
        (1.5, 5e-6, 0.0, (29, 42, 57), False),
        (1.5, 5e-6, -5.0, (36, 51, 69), True),
    ],
)
def test_prototypes_beside_a_drawing_that_can_be_built(scale, oval, kelvin, band, inside):
    """Inside 95 % of what leaves a shop only with zones half as wide again, an oval ring and discs colder than it.

    The drawing has the grinding tolerance of the teeth. How oval the rings and how warm the discs were is not printed.
    """
    drawing = ta.drawing("rv80e_drawing")
    wider = tuple(replace(own, zone=scale * own.zone, maximum=2 * own.maximum) for own in drawing.sources)
    drawing = with_ovality(drawing.with_sources(wider), oval)
    reducer = ta.reducer("rv80e", neglected=("disc*.tilt",), disc_temperature=kelvin)
    model, errors = reducer.set_to(drawing.settings).bound(drawing.errors, "test"), drawing.errors
    values = model.reading((ta.PEAK_TO_PEAK,))(seeded_units(errors, 512)).values
    found = np.quantile(values[:, 0], [0.025, 0.5, 0.975])
    assert found == pytest.approx(band, abs=2.5)  # the ends of 512 units are known to 1.2" (one standard error)
    assert bool((found[2] > MEASURED).all() and (found[0] < MEASURED).all()) is inside
