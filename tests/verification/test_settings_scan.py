"""Where a search of the settings begins: another basin than that of today."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.allocation.search.settings_scan import other_settings
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

GAP = "gap [mm]"
NARROW, WIDE = 2.0, 8.0
"""Settings at which a gap is in its middle; at the second one its spread is half as large."""


def gap(size, shift):
    """A gap whose middle is kept at two settings, far apart."""
    spread = np.where(shift > 5, 0.5, 1.0)
    return spread * size + 1e-3 * (shift - NARROW) * (shift - WIDE)


def study(lower: float, upper: float) -> ta.Study:
    setting = ta.Setting(name="shift", value=2.0, lower=lower, upper=upper, step=0.1)
    row = {"nominal": 0.0, "plus": 9, "minus": -9, "unit": "µm", "min": 0.5, "max": 60, "cost": 1}
    return ta.Study(
        ta.model(gap, inputs=("size",), outputs=(GAP,), settings=(setting,)),
        ta.Drawing.of_rows([{"id": "size", **row}]),
        limits={GAP: ta.Limit(lower=-0.006, upper=0.006)},
        effort="quick",
    )


def verifier_over(space: DesignSpace, own: Prepared) -> Verifier:
    return Verifier(space=space, model=own.model, requirements=own.requirements, seeds=SeedTree(4), units=1152)


def test_the_place_where_limits_are_kept_best_is_found_far_from_the_present_one():
    prepared = Prepared(study=study(0.0, 10.0))
    found = other_settings(verifier_over(prepared.space, prepared), np.array([1.0, 2.0]))
    assert found[0] == 1.0
    assert found[1] == pytest.approx(WIDE, abs=0.6)


@pytest.mark.slow
def test_the_zones_of_an_allocation_are_those_of_the_better_place():
    cost = study(0.0, 10.0).ask(ta.Allocation(front=False)).result.cost
    stuck = study(0.0, 4.0).ask(ta.Allocation(front=False)).result.cost
    assert cost == pytest.approx(stuck / 2, rel=0.03)


def test_without_settings_the_design_stays():
    prepared = Prepared(study=study(2.0, 2.0))
    verifier = verifier_over(prepared.space.fixed, prepared)
    design = np.array([1.0, 2.0])
    np.testing.assert_array_equal(other_settings(verifier, design), design)
