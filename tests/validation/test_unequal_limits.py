"""A gap of +10 (+50/−50 µm) −9.8 (+30/−20 µm): what a stack of unequal limits adds up to, and what units do.

Printed are the nominal gap of 0.200 mm, the worst case 0.120…0.270 mm and the root-sum-square 0.142…0.254 mm. How the
sizes are distributed is not printed; the last test takes them as normal in the middle of their zones, 99.73 % inside.
"""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from studies.published.stacks import root_sum_square, stack_limits, worst_case
from tests.builders import units_at_random
from tolalloc.exceptions import InputError
from tolalloc.reading.units import MILLIMETRE

DIRECTIONS, SIZES = np.array([1.0, -1.0]), np.array([10.0, 9.8])
PLUS, MINUS = np.array([0.05, 0.03]), np.array([-0.05, -0.02])  # mm


def test_nominal_worst_case_and_root_sum_square_are_the_printed_ones():
    found = stack_limits(DIRECTIONS, SIZES, PLUS, MINUS)
    assert found.nominal == pytest.approx(0.200, abs=1e-12)
    assert found.worst_case == pytest.approx((0.120, 0.270), abs=1e-12)
    assert np.round(found.root_sum_square, 3) == pytest.approx((0.142, 0.254), abs=1e-12)


def test_equal_limits_are_the_stacks_of_zones():
    half = np.array([0.05, 0.025])
    found, zones = stack_limits(DIRECTIONS, SIZES, half, -half), np.empty(0)
    for made, ends in ((worst_case, found.worst_case), (root_sum_square, found.root_sum_square)):
        load = float(made("gap", DIRECTIONS, 1.0).load(half, zones))
        assert ends == pytest.approx((0.2 - load, 0.2 + load), abs=1e-12)
    assert found.centred == pytest.approx(found.root_sum_square, abs=1e-12)


def test_a_zone_beside_its_nominal_size_is_refused():
    with pytest.raises(InputError, match=r"stack: limit deviations is .* zones that hold their nominal size"):
        stack_limits(DIRECTIONS, SIZES, PLUS, np.array([0.01, -0.02]))


def test_units_keep_to_the_centred_limits_and_not_to_those_from_the_nominal():
    """The mean gap is 0.195 mm: 99.73 % of a million drawn units lie in 0.139…0.251, not in 0.142…0.254."""
    rows = [
        {"id": name, "nominal": size, "plus": plus, "minus": minus, "unit": "mm", "min": 0.01, "max": 0.2, "cost": 1}
        for name, size, plus, minus in zip(("housing", "part"), SIZES, PLUS, MINUS, strict=True)
    ]
    errors = ta.Drawing.of_rows(rows).errors
    gap = 0.2 + units_at_random(errors, 1_000_000, 10) @ DIRECTIONS / MILLIMETRE
    found = stack_limits(DIRECTIONS, SIZES, PLUS, MINUS)
    assert np.round(found.centred, 3) == pytest.approx((0.139, 0.251), abs=1e-12)
    assert gap.mean() == pytest.approx(0.195, abs=1e-4)
    inside = [((low < gap) & (gap < high)).mean() for low, high in (found.centred, found.root_sum_square)]
    assert inside[0] == pytest.approx(0.9973, abs=3 * np.sqrt(0.0027 / 1e6))
    assert inside[1] == pytest.approx(0.9969, abs=2e-4)
    assert ((gap > 0.120) & (gap < 0.270)).mean() > inside[0]
