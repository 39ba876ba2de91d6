"""Elastic part of the transmission error of Hu et al. 2020: 25.28 % of the total of an RV reducer in Adams.

Printed where it can be read (Appl. Sci. 10(2), 481, abstract) are this share and that a modified reducer measures
47.22 % less; not the size, the torque, the part errors or how the share is taken. Assumed are three presets, 48 random
units of the shipped drawing of each with constant contact, and as elastic part what a torque changes of the curve at
1 N·m, less its mean: the mean is the wind-up, which no compensation by teeth takes away.
"""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import at_constant_contact, drawn_units
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer

PRINTED = 0.2528
ANGLES = 2 * np.pi * np.arange(780) / 780


@pytest.mark.parametrize(
    ("size", "reached", "at_rated", "growth"),
    [
        ("rv20e", (0.02, 0.03), 0.79, 0.83),
        ("rv40e", (0.01, 0.02), 1.16, 0.70),
        ("rv80e", (0.01, 0.02), 1.18, 0.67),
    ],
)
def test_the_printed_share_is_that_of_a_few_percent_of_the_rated_torque(size, reached, at_rated, growth):
    """Reached between 1 and 3 % of rated torque; there the elastic wave is as large as the total, which has fallen.

    Load brings more pins to carry, which evens their errors out: the whole peak-to-peak is smaller than at 1 N·m.
    """
    reducer = at_constant_contact(load_reducer(size))
    errors = ta.drawing(f"{size}_drawing").errors
    model = EquivalentModel(reducer, orders=errors.orders)
    units = drawn_units(errors, model, 48)
    unloaded = model.equilibria(units, -1.0, ANGLES).transmission_error
    share, width = [], []
    for part in (*reached, 1.0):
        loaded = model.equilibria(units, -part * reducer.load.rated_torque, ANGLES).transmission_error
        share.append(float(np.median(np.ptp(loaded - unloaded, axis=1) / np.ptp(loaded, axis=1))))
        width.append(float(np.median(np.ptp(loaded, axis=1) / np.ptp(unloaded, axis=1))))
    assert share[0] < PRINTED < share[1]
    assert share[2] == pytest.approx(at_rated, abs=0.1)
    assert width[2] == pytest.approx(growth, abs=0.05)
