"""Linear outputs whose limits are kept at once: on ladders and priced, beside what their law says."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.stats import multivariate_normal

import tolalloc as ta
from tolalloc.drawings.ladder import ZONES

TARGET = 0.9973
SLOPES = np.array([[1.0, 0.8, 0.0], [0.0, -0.6, 1.0]])
COSTS = np.array([3.0, 5.0, 2.0])
HALF = 0.03  # of every zone of the table [mm]


def study(limits: tuple[float, float]) -> ta.Study:
    def outputs(*sizes):
        return tuple(sum(by * size for by, size in zip(own, sizes, strict=True)) for own in SLOPES)

    names = tuple("abc")
    row = {"nominal": 0.0, "plus": HALF, "minus": -HALF, "unit": "mm", "min": 0.01, "max": 0.3}
    rows = [{"id": name, "cost": cost, **row} for name, cost in zip(names, COSTS.tolist(), strict=True)]
    outputs_named = ("first [mm]", "second [mm]")
    return ta.Study(
        ta.model(outputs, inputs=names, outputs=outputs_named),
        ta.Drawing.of_rows(rows),
        limits={name: ta.Limit(upper=limit) for name, limit in zip(outputs_named, limits, strict=True)},
        effort="quick",
    )


def kept(zones: np.ndarray, limits: np.ndarray) -> float:
    """Return the share of units that keep both limits, by the law of two normal numbers [-]."""
    covariance = (SLOPES * (zones / 6) ** 2) @ SLOPES.T
    return float(multivariate_normal.cdf(limits, cov=covariance))


@pytest.mark.slow
@pytest.mark.parametrize("limits", [(0.040, 0.033), (0.05, 0.026), (0.036, 0.05)])
def test_no_choice_of_steps_is_cheaper_that_keeps_both_limits(limits):
    found = study(limits).ask(ta.Allocation(grades=True, front=False, what_if=False)).result
    steps = 1e3 * ZONES[(ZONES >= 1e-5) & (ZONES <= 3e-4)]
    cheapest = min(
        float((COSTS * 2 * HALF / zones).sum())
        for zones in map(np.array, product(steps, repeat=3))
        if kept(zones, np.array(limits)) >= TARGET
    )
    assert found.met
    assert found.cost == pytest.approx(cheapest, rel=1e-6)


@pytest.mark.slow
def test_a_limit_that_ends_where_its_deviations_end_has_its_price():
    """A uniform size may be as wide as its limit lets it: then no unit misses that, and a wider one costs less."""
    row = {"nominal": 0.0, "unit": "mm", "min": 0.01, "max": 0.3}
    drawing = ta.Drawing.of_rows(
        [
            {"id": "a", "plus": 0.05, "minus": -0.05, "cost": 6.0, "distribution": "uniform", **row},
            {"id": "b", "plus": 0.05, "minus": -0.05, "cost": 2.0, **row},
        ]
    )
    asked = ta.Study(
        ta.model(lambda a, b: (a, b), inputs=("a", "b"), outputs=("first [mm]", "second [mm]")),
        drawing,
        limits={"second [mm]": ta.Limit(upper=0.03), "first [mm]": ta.Limit(upper=0.03)},
        effort="quick",
    )
    found = asked.ask(ta.Allocation(front=False, what_if=False)).result
    prices = {check.requirement.output: found.price_of(check, side) for check, side in found.chosen.limited_sides}
    assert found.chosen.space.zones(found.chosen.design)[0] == pytest.approx(6e-5, rel=0.02)
    # the cost 0.6/zone falls by 0.6/zone² a millimetre of zone, which is two of the limit
    assert prices["first [mm]"] == pytest.approx(2 * 0.6 / 0.06**2, rel=0.1)
    assert found.asked_by == {"a": "first [mm]", "b": "second [mm]"}
