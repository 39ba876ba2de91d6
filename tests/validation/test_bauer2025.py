"""RH380-N of bauer2025, 45 teeth and 46 pins: which orders of the output turn opposed discs leave.

The source prints the orders that its fit to measured curves keeps: 46·{1, 2, 3, 4, 6}, 45·{2, 3, 4} and not 45·1,
4·{1, 3}, 24, and 1, 3, 6, 9, 13, 14, 18, 19, 27. It prints no dimensions: they are assumed, those of the RV-160E with
an eccentricity that leaves its shortening, its contact taken as constant. Part errors are assumed too, those of random
units from the shipped table of all sources of an RV-20E.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import (
    FIRST_STAGE,
    STANDING,
    at_constant_contact,
    drawn_units,
    only,
    order_spectrum,
    table_of_three_cranks,
)
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer

TEETH, PINS = 45, 46
TORQUE = -10.0
MICROMETRES = {
    "housing": {
        "housing.pitch.cos1": 4,
        "housing.pitch.sin2": 3,
        "housing.runout.cos1": 3,
        "each_pin.position.7.x": 2,
        "carrier.assembly.x": 5,
    },
    "turning": {
        "disc1.pitch.cos1": 4,
        "disc2.pitch.sin1": 3,
        "disc1.runout.sin2": 3,
        "disc1.bore1.position.x": 2,
        "crank1.journal1.eccentricity.y": 2,
    },
    "thin disc": {f"disc1.each_tooth.runout.{tooth}": -2 for tooth in range(1, TEETH + 1)},
    "alike": {f"disc{disc}.pitch.cos1": 4 for disc in (1, 2)},
}


@pytest.fixture(scope="module")
def model() -> EquivalentModel:
    reducer = at_constant_contact(load_reducer("rv160e"))
    stage = reducer.cycloid_stage
    eccentricity = stage.shortening * stage.pin_circle_radius / PINS
    stage = replace(stage, pin_count=PINS, disc_teeth=TEETH, eccentricity=eccentricity)
    return EquivalentModel(replace(reducer, cycloid_stage=stage))


CASES = {
    ("housing",): 12 * TEETH,
    ("thin disc",): 12 * TEETH,
    ("housing", "thin disc"): 12 * TEETH,
    ("housing", "turning"): 12 * TEETH,
    ("turning",): 12 * PINS,
    ("alike",): 12 * PINS,
}
"""Errors of one unit and number of angles: a multiple of the waves, so that what lies beyond falls on one of them."""


def turn(angles: int) -> np.ndarray:
    return 2 * np.pi * np.arange(angles) / angles


@pytest.fixture(scope="module")
def amplitude(model) -> dict[tuple[str, ...], np.ndarray]:
    """Amplitude of orders 0, 1, 2 … of one unit with the errors of each case [arcsec]."""
    found = {}
    for angles in sorted(set(CASES.values())):
        cases = [kinds for kinds, own in CASES.items() if own == angles]
        units = np.zeros((len(cases), len(model.columns)))
        for unit, kinds in zip(units, cases, strict=True):
            deviations = {name: 1e-6 * size for kind in kinds for name, size in MICROMETRES[kind].items()}
            for name, size in (deviations | model.reducer.modification.deviations).items():
                unit[model.columns.index(name)] = size
        waves = order_spectrum(model.equilibria(units, TORQUE, turn(angles)).transmission_error).amplitude
        found |= dict(zip(cases, np.pad(waves / ARCSECOND, ((0, 0), (1, 0))), strict=True))
    return found


def multiples(amplitude: np.ndarray, of: int) -> np.ndarray:
    return np.asarray(np.arange(amplitude.size) % of == 0)


def test_with_equal_discs_the_odd_multiples_of_the_teeth_cancel_exactly(amplitude):
    """What stands in the housing meets the second disc half a crank turn later: 45 and 135 vanish, 90 does not."""
    found = amplitude[("housing",)]
    assert found[~multiples(found, 2 * TEETH)].max() < 1e-9
    assert found[2 * TEETH] > 5
    assert found[4 * TEETH] > 1


def test_one_disc_thinner_by_2_micrometres_shows_the_first_multiple(amplitude):
    found = amplitude[("housing", "thin disc")]
    assert found[TEETH] == pytest.approx(2.0, rel=0.1)
    assert found[3 * TEETH] > 1
    assert found[~multiples(found, TEETH)].max() < 1e-9
    assert amplitude[("thin disc",)][TEETH] < 1e-9  # nothing in the housing, no wave


def test_multiples_of_the_pins_stay_because_each_disc_has_errors_of_its_own(amplitude):
    found = amplitude[("turning",)]
    assert found[PINS] > 5
    assert (found[PINS * np.array([1, 2, 3, 4])] > 0.3).all()
    assert found[~multiples(found, PINS)].max() < 1e-9
    alike = amplitude[("alike",)]
    assert alike[PINS] < 0.1 * alike[2 * PINS]  # discs with one and the same error nearly lose 46·1 too


def test_an_order_between_them_needs_both(amplitude):
    found = amplitude[("housing", "turning")]
    assert found[[1, 3, TEETH]] == pytest.approx([2.5, 0.3, 1.2], rel=0.15)
    assert found[6:31].max() < 0.1


FOUND = {
    46: 6.4,
    92: 1.9,
    138: 1.0,
    184: 0.7,
    276: 0.2,
    45: 2.1,
    90: 2.8,
    135: 0.5,
    180: 0.6,
    1: 2.7,
    3: 0.3,
    4: 0.2,
}
"""Order → root mean square of its amplitude over random units [arcsec]."""
LOST = (6, 9, 12, 13, 14, 18, 19, 24, 27)
"""Printed orders at which the model has no more than at their neighbours."""


@pytest.mark.slow
def test_what_random_units_make_of_the_printed_orders(model):
    errors = ErrorModel(tuple(table_of_three_cranks("rv20e_all_sources", PINS).values()))
    own = replace(model, orders=errors.orders)
    units, each = drawn_units(errors, own, 32), ("each_pin.", "disc1.each_tooth.", "disc2.each_tooth.")
    standing = only(units, own, *STANDING)
    kinds = {
        "all": units,
        "all round": only(units, own, *each, without=True),
        "standing": standing,
        "upright": only(standing, own, "carrier.tilt", without=True),
        "turning": only(units, own, *STANDING, *FIRST_STAGE, without=True),
    }
    curves = own.equilibria(np.concatenate(list(kinds.values())), TORQUE, turn(TEETH * PINS)).transmission_error
    squares = (order_spectrum(curves).amplitude / ARCSECOND).reshape(len(kinds), 32, -1) ** 2
    found = dict(zip(kinds, np.pad(np.sqrt(squares.mean(axis=1)), ((0, 0), (1, 0))), strict=True))
    assert found["all"][list(FOUND)] == pytest.approx(list(FOUND.values()), rel=0.1, abs=0.06)
    # From order 5 to 30 there is a level that the errors of single pins and teeth make, and no peak.
    level = np.median(found["all"][5:31])
    assert level == pytest.approx(0.075, rel=0.1)
    assert (found["all"][list(LOST)] < 1.25 * level).all()
    assert np.median(found["all round"][5:31]) < 0.25 * level
    assert found["standing"][~multiples(found["standing"], TEETH)].max() < 1e-9
    assert found["turning"][~multiples(found["turning"], PINS)].max() < 1e-9
    # A tilted carrier moves both discs to opposite sides, which makes 45 with equal discs too.
    assert found["standing"][TEETH] > 0.5
    assert found["upright"][TEETH] < 1e-9
