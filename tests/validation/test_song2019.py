"""Table 2 of song2019: radii, coefficients and radial clearance of its two modifications.

Two of its rows were computed with the two amounts swapped; the rows of the tip and root circles were not. Beside those,
one radial clearance was computed with the shift's sign lost.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin

import numpy as np
import pytest

from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.cycloid.clearance import exact_clearance
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.reducer.design import CycloidStage, Modification

STAGE = CycloidStage(
    pin_count=40, disc_teeth=39, pin_circle_radius=0.082, pin_radius=0.005, eccentricity=1.5e-3, face_width=0.01
)


@dataclass(frozen=True)
class Column:
    """One column of the table, as printed [mm]; the coefficients are those of the labelled amounts."""

    equidistant: float
    shift: float
    tip: float
    root: float
    printed_circle: float
    printed_pin: float
    printed_k1: float
    printed_k2: float
    k1: float
    k2: float
    printed_clearance: float
    clearance: float

    @property
    def profile(self) -> ToothProfile:
        return self.ground_with(self.equidistant, self.shift)

    @property
    def swapped(self) -> ToothProfile:
        return self.ground_with(self.shift, self.equidistant)

    @staticmethod
    def ground_with(equidistant: float, shift: float) -> ToothProfile:
        amounts = Modification(equidistant=equidistant * MILLIMETRE, shift=shift * MILLIMETRE)
        return ToothProfile(stage=STAGE, modification=amounts)


STANDARD = Column(0, 0, 78.5, 75.5, 82, 5, 0.7317, 1.2867, 60 / 82, sin(pi / 40) * 82 / 5, 0, 0)
POSITIVE = Column(0.3205, 0.0742, 78.2537, 75.2537, 82.3205, 5.0742, 0.7289, 1.2729, 0.731046, 1.210312, 0.2463, 0.2463)
NEGATIVE = Column(
    0.3205, -0.2929, 77.8866, 74.8866, 82.3205, 4.7071, 0.7289, 1.3721, 0.734330, 1.204899, 0.0276, 0.6134
)
columns = pytest.mark.parametrize(
    "column",
    [pytest.param(STANDARD, id="standard"), pytest.param(POSITIVE, id="plus"), pytest.param(NEGATIVE, id="minus")],
)


def pin_coefficient(profile: ToothProfile) -> float:
    """K2 = (r_p/r_rp)·sin(π/zp), half the distance of two pins over the radius of one; below 1 they overlap."""
    return profile.ground.pin_circle_radius / profile.ground.pin_radius * sin(pi / profile.ground.pin_count)


@columns
def test_tip_and_root_circles(column):
    assert column.profile.tip_radius / MILLIMETRE == pytest.approx(column.tip, abs=1e-9)
    assert column.profile.root_radius / MILLIMETRE == pytest.approx(column.root, abs=1e-9)
    tip, root = np.hypot(*column.profile.points(np.array([pi, 0.0])).T)
    assert (tip / MILLIMETRE, root / MILLIMETRE) == pytest.approx((column.tip, column.root), abs=1e-9)


@columns
def test_coefficients_follow_from_the_labelled_amounts(column):
    assert column.profile.ground.shortening == pytest.approx(column.k1, abs=5e-7)
    assert pin_coefficient(column.profile) == pytest.approx(column.k2, abs=5e-7)


@pytest.mark.parametrize("column", [POSITIVE, NEGATIVE])
def test_coefficients_are_printed_for_swapped_amounts(column):
    swapped = column.swapped
    assert swapped.ground.pin_circle_radius / MILLIMETRE == pytest.approx(column.printed_circle, abs=1e-9)
    assert swapped.ground.pin_radius / MILLIMETRE == pytest.approx(column.printed_pin, abs=1e-9)
    assert swapped.ground.shortening == pytest.approx(column.printed_k1, abs=5e-5)
    assert pin_coefficient(swapped) == pytest.approx(column.printed_k2, abs=5e-5)
    assert column.profile.ground.shortening != pytest.approx(column.printed_k1, abs=1e-3)
    assert pin_coefficient(column.profile) != pytest.approx(column.printed_k2, abs=0.05)
    # Swapped, the tip would not be where the same column prints it.
    assert swapped.tip_radius / MILLIMETRE != pytest.approx(column.tip, abs=0.1)


def test_coefficients_of_the_standard_teeth_are_the_printed_ones():
    assert STANDARD.profile.ground.shortening == pytest.approx(STANDARD.printed_k1, abs=5e-5)
    assert pin_coefficient(STANDARD.profile) == pytest.approx(STANDARD.printed_k2, abs=5e-5)
    assert pin_coefficient(STANDARD.profile) != pytest.approx(1.2874, abs=5e-5)  # Table 1 has this


@columns
def test_radial_clearance(column):
    """r_ac of the standard teeth less the column's own; the package's formula and the exact distance agree with it."""
    by_rows = STANDARD.tip - column.tip
    assert by_rows == pytest.approx(column.clearance, abs=1e-9)
    assert column.profile.modification.radial_clearance / MILLIMETRE == pytest.approx(column.clearance, abs=1e-9)
    exact = exact_clearance([column.profile], np.array([pi]))[0, 0]
    assert exact / MILLIMETRE == pytest.approx(column.clearance, abs=1e-9)


def test_one_radial_clearance_is_printed_with_the_sign_lost():
    assert POSITIVE.printed_clearance == pytest.approx(POSITIVE.clearance, abs=1e-9)
    assert NEGATIVE.printed_clearance == pytest.approx(NEGATIVE.equidistant - abs(NEGATIVE.shift), abs=1e-9)
    assert NEGATIVE.clearance == pytest.approx(NEGATIVE.equidistant - NEGATIVE.shift, abs=1e-9)
