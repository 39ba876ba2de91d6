"""Linear outputs whose limits are kept at once: scaled alike, on ladders, and priced, beside what their law says."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

import tolalloc as ta
from tolalloc.allocation.search.zone_allocation import scale_in_proportion
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.verify.verification import Verifier, cheapest_met
from tolalloc.drawings.ladder import ZONES
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

TARGET = 0.9973
SLOPES = np.array([[1.0, 0.8, 0.0], [0.0, -0.6, 1.0]])
COSTS = np.array([3.0, 5.0, 2.0])
HALF = 0.03  # of every zone of the table [mm]


def study(limits: tuple[float, float], slopes: np.ndarray = SLOPES, **changes) -> ta.Study:
    def outputs(*sizes):
        return tuple(sum(by * size for by, size in zip(own, sizes, strict=True)) for own in slopes)

    names = tuple("abc"[: slopes.shape[1]])
    row = {"nominal": 0.0, "plus": HALF, "minus": -HALF, "unit": "mm", "min": 0.01, "max": 0.3}
    rows = [{"id": name, "cost": cost, **row} for name, cost in zip(names, COSTS.tolist(), strict=False)]
    outputs_named = ("first [mm]", "second [mm]")
    return ta.Study(
        ta.model(outputs, inputs=names, outputs=outputs_named),
        ta.Drawing.of_rows(rows),
        limits={name: ta.Limit(upper=limit) for name, limit in zip(outputs_named, limits, strict=True)},
        effort="quick",
        **changes,
    )


def kept(zones: np.ndarray, limits: np.ndarray) -> float:
    """Return the share of units that keep both limits, by the law of two normal numbers [-]."""
    covariance = (SLOPES * (zones / 6) ** 2) @ SLOPES.T
    return float(multivariate_normal.cdf(limits, cov=covariance))


def test_the_factor_of_all_zones_lies_between_one_that_is_met_and_one_that_is_missed():
    """Of two independent outputs each may be missed by half: at 3 σ both are kept, where each alone is at 2.78 σ."""
    prepared = Prepared(study=study((3.5 * HALF / 3, 3.5 * HALF / 3), np.eye(2)))
    jointly = JointRequirement.of(prepared.requirements, ta.AtYield(TARGET))
    verifier = Verifier(
        space=prepared.space,
        model=prepared.model,
        requirements=(*prepared.requirements, jointly),
        seeds=SeedTree(1),
        units=2**16,
        confidence=0.5,
    )
    best = cheapest_met(scale_in_proportion(verifier, 8))
    known = 3.5 / -norm.ppf(1 - np.sqrt(TARGET))
    assert best.met
    assert known / 1.02 < best.scales[0] < known * 1.01  # 65,536 units tell the failures of both to 8 %


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


@pytest.mark.slow
def test_a_refused_answer_is_drawn_inside_where_outputs_have_kinks():
    """Three limits, the product with a kink, the range of four places and a setting; 20.785 is the best known."""

    def clamp(mandrel, sleeve, bolt1, bolt2, bolt3, bolt4, lever, wedge, preload):
        bolts, fit = np.stack([bolt1, bolt2, bolt3, bolt4]), 1000 * (mandrel - sleeve)
        grip = np.maximum(fit - 12.0, 0.0) * lever / 40.0 * 0.22 + 0.9 * preload
        stress = 0.9 * np.maximum(fit, 0.0) * (1 + 0.05 * (bolts.mean(axis=0) - 30.0)) * (wedge / 5.0) ** 2
        return grip, 1000 * np.ptp(bolts, axis=0), stress + 0.4 * preload

    held = {"min": 4, "max": 60, "unit": "µm"}
    drawing = ta.Drawing.of_rows(
        [
            {"id": "mandrel", "nominal": 25.065, "plus": 10, "minus": -10, "cost": 6.0, **held},
            {"id": "sleeve", "nominal": 25, "plus": 12, "minus": -6, "cost": 7.5, **held},
            {
                "id": "4x bolt*",
                "nominal": 30,
                "plus": 20,
                "minus": -20,
                "unit": "µm",
                "min": 4,
                "max": 120,
                "cost": 1.5,
                "distribution": "uniform",
            },
            {"id": "lever", "nominal": 40, "plus": 1, "minus": -1, "unit": "%", "min": 0.2, "max": 6, "cost": 1.0},
            {
                "id": "wedge",
                "nominal": 5,
                "plus": 30,
                "minus": -30,
                "unit": "µm",
                "min": 10,
                "max": 400,
                "cost": 2.0,
                "locked": "yes",
            },
        ]
    )
    names = ("mandrel", "sleeve", "bolt1", "bolt2", "bolt3", "bolt4", "lever", "wedge")
    preload = ta.Setting(name="preload [N]", value=20, lower=10, upper=40, step=0.5)
    asked = ta.Study(
        ta.model(clamp, inputs=names, outputs=("grip [N]", "tilt [µm]", "stress [MPa]"), settings=(preload,)),
        drawing,
        limits={
            "grip [N]": ta.Limit(lower=26.0),
            "tilt [µm]": ta.Limit(upper=25.0),
            "stress [MPa]": ta.Limit(upper=82.0),
        },
        effort="quick",
    )
    found = asked.ask(ta.Allocation(fixed_first=False, front=False, what_if=False)).result
    assert found.met
    assert found.cost < 1.005 * 20.785
