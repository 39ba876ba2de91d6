"""The numeric door: what it promises not to move, its names, parameters, defaults and worked numbers."""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.reducers.unit_file import load_unit

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "numeric.md"
ARCSECOND = np.pi / 180 / 3600
PROMISED = {
    "reducer": "design='rv20e', changes=None",
    "columns": "reducer",
    "deviations": "reducer, by_name",
    "transmission_error": "reducer, deviations, carrier_angle, torque=-1.0",
    "extremes": "reducer, deviations, torque=-1.0",
    "peak_to_peak": "reducer, deviations, torque=-1.0",
    "contact": "reducer, deviations, carrier_angle, torque=-1.0",
    "clearance": "reducer",
    "radial_clearance": "reducer, deviations",
    "allocate": "factor, smallest, largest, limits, worst_case=0.0, root_sum_square=0.0, fixed=0.0",
    "regulator": "adjusting, effort, final_weight",
    "adjusted_errors": "gains, adjusting, entering, errors",
    "sobol": "function, inputs, blocks=1024, seed=1, resamples=400",
    "failure_probability": "distance, variables, samples=2000, runs=5, seed=1",
}
FIELDS = {
    "Extremes": ("largest", "smallest", "carrier_angle"),
    "Contact": ("pins", "pins_in_contact"),
    "Clearance": ("pin_angle", "gap", "backlash", "radial"),
    "Zones": ("zones", "cost", "bound", "prices", "kept"),
    "SobolIndices": ("first", "total", "first_interval", "total_interval"),
    "FailureProbability": ("probability", "standard_error", "calls", "cautions"),
}


def test_names_parameters_and_defaults_are_those_that_are_promised():
    assert {*PROMISED, *FIELDS} == {*ta.numeric.__all__}
    for name, said in PROMISED.items():
        parameters = inspect.signature(getattr(ta.numeric, name)).parameters.values()
        plain = [own.replace(annotation=inspect.Parameter.empty) for own in parameters]
        assert ", ".join(map(str, plain)) == said
    for name, fields in FIELDS.items():
        assert getattr(ta.numeric, name)._fields == fields


def test_the_page_says_every_function_with_its_first_line():
    page = PAGE.read_text(encoding="utf-8")
    for name, said in PROMISED.items():
        assert f"`{name}({said})`" in page
        assert inspect.getdoc(getattr(ta.numeric, name)).splitlines()[0] in page
    for name, fields in FIELDS.items():
        assert f"`{name}({', '.join(fields)})`" in page


def test_every_function_has_a_worked_number():
    for name in PROMISED:
        assert ">>> " in inspect.getdoc(getattr(ta.numeric, name)), name


def test_published_unit_has_its_peak_to_peak():
    """Table 4 of liu2020 at −1 N·m: row 3 of the validation page."""
    unit = load_unit("table4").deviations
    assert ta.numeric.peak_to_peak(ta.numeric.reducer("rv20e_liu2020"), unit) / ARCSECOND == pytest.approx(
        96.629, abs=2e-3
    )


def test_deviations_given_by_name_and_as_rows_give_the_same_bits():
    reducer, named = ta.numeric.reducer("rv20e_liu2020"), {"pin.diameter": [1e-6, -2e-6], "housing.pitch.sin1": 3e-6}
    rows = ta.numeric.deviations(reducer, named)
    by_name, by_rows = (ta.numeric.transmission_error(reducer, own, [0.1, 0.2]) for own in (named, rows))
    assert rows.shape == (2, len(ta.numeric.columns(reducer)))
    np.testing.assert_array_equal(by_name, by_rows)


def test_torque_of_pins_without_errors_balances_the_carrier():
    """Of perfect teeth under a load every disc carries the same."""
    reducer = ta.numeric.reducer("rv20e_liu2020", {"modification.equidistant_um": 0, "modification.shift_um": 0})
    found = ta.numeric.contact(reducer, {}, [0.3], -50.0).pins[0, 0].sum(axis=1)
    assert found[0] == pytest.approx(found[1], rel=0.02)


def test_zones_in_quadrature_follow_the_rule_of_their_costs():
    """One root-sum-square stack: B/t² = μ·w²·t, so t is in proportion to (B/w²)^(1/3)."""
    factor, weight = np.array([1.0, 8.0, 2.0]), np.array([1.0, 1.0, 2.0])
    found = ta.numeric.allocate(factor, [1e-3] * 3, [10.0] * 3, [1.0], root_sum_square=[weight])
    shape = (factor / weight**2) ** (1 / 3)
    np.testing.assert_allclose(found.zones, shape / np.linalg.norm(weight * shape), rtol=1e-5)
    assert found.bound <= found.cost <= found.bound * (1 + 1e-6)


def test_zones_that_no_limit_allows_are_the_smallest():
    found = ta.numeric.allocate([1.0], [0.5], [1.0], [0.1], worst_case=[[1.0]])
    assert not found.kept
    assert found.zones.tolist() == [0.5]


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda n: n.deviations(n.reducer(), {"pin.diametre": 1e-6}), "the nearest known"),
        (
            lambda n: n.deviations(n.reducer(), {"pin.diameter": [1, 2], "housing.pitch.sin1": [1, 2, 3]}),
            "one number, or one",
        ),
        (lambda n: n.reducer("rv20e", {"cycloid_stage.eccentricity": 1}), "cycloid_stage.eccentricity_mm"),
        (lambda n: n.peak_to_peak(n.reducer(), np.zeros((1, 3))), "number of columns is 3"),
    ],
)
def test_what_is_not_allowed_is_refused_in_one_sentence(ask, said):
    with pytest.raises(ta.TolallocError, match=said):
        ask(ta.numeric)
