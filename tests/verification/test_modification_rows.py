"""Rows of a tolerance table for the grinding of the teeth: deviations around the amounts in force."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import deviations_at
from tests.studies.command import ROOT
from tolalloc.reducers.model import ReducerModel
from tolalloc.study.prepared import Prepared

STUDIES = ROOT / "studies"
ROW = {"part": "discs", "feature": "size", "unit": "µm", "distribution": "normal", "Cp": 1.0, "group": "grinding"}
BUILDABLE = {"bore": 4.0, "journal": 4.0, "carrier.bore": 8.0, "carrier.assembly": 10.0, "pin.diameter": 2.0}
BUILDABLE |= {"groove": 2.0, "pitch": 8.0, "runout": 6.0}
"""Part of the name of a source → zone of a drawing that can be built, the last part that fits [µm]."""
FEW = ("disc1.pitch", "housing.pitch", "carrier.assembly", "pin.diameter")
OUTPUTS = (ta.PEAK_TO_PEAK, ta.LOST_MOTION, ta.RADIAL_CLEARANCE)
CLEARANCES = [(1.04, 8.0), (3.5, 12.0), (8.0, 20.0)]


def prepared(*rows: dict, only: tuple[str, ...] = FEW, stiffness: str = "") -> Prepared:
    """Return a study of an RV-20E with some sources at zones that can be built, and these rows of the modification."""
    found = []
    for own in ta.drawing("rv20e_table4").errors.sources:
        fitting = [size for part, size in BUILDABLE.items() if part in own.name]
        if not fitting or (only and own.name not in only):
            continue
        zone = fitting[-1]
        sides = {"plus": zone / 2, "minus": -zone / 2} if own.feature == "size" else {"plus": zone, "minus": 0.0}
        spectrum = " ".join(f"{order}:{size}" for order, size in own.spectrum)
        extra = {"spectrum": spectrum} if spectrum else {}
        row = {"id": own.name, "feature": own.feature.value, "min": 0.1, "max": 100.0, "cost": 1}
        found.append({**ROW, **row, **sides, **extra})
    ranges = {"flank_clearance": (1.0, 8.0), "radial_clearance": (3.0, 30.0)}
    return Prepared(
        study=ta.Study(
            ta.reducer("rv20e", stiffness=stiffness, neglected=("*",), **ranges),
            ta.Drawing.of_rows([*found, *rows]),
            limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
            seed=1,
        )
    )


def grinding(name: str, plus: float, minus: float, **changed) -> dict:
    locked = {"locked": "yes"} if plus == minus else {"locked": "no"}
    return {
        **ROW,
        "id": f"modification.{name}",
        "plus": plus,
        "minus": minus,
        "min": 0.1,
        "max": 20,
        "cost": 1,
        **locked,
        **changed,
    }


def model_of(study: Prepared, clearances: tuple[float, float]) -> ReducerModel:
    return study.model.at(np.array(clearances))


def units_of(study: Prepared, count: int) -> np.ndarray:
    """Return random units: rows that come last draw numbers of their own."""
    generators = [np.random.default_rng([7, at]) for at in range(len(study.errors.columns))]
    return deviations_at(study.errors, np.stack([own.random(count) for own in generators], axis=1))


@pytest.mark.parametrize("clearances", CLEARANCES)
def test_rows_with_zone_zero_change_no_bit(clearances):
    rows = [grinding("equidistant", 0, 0), grinding("shift", 0, 0), grinding("rotation", 0, 0, over=35.1)]
    without, still = prepared(), prepared(*rows)
    found = [model_of(own, clearances).reading(OUTPUTS)(units_of(own, 12)) for own in (without, still)]
    np.testing.assert_array_equal(found[0].values, found[1].values)


@pytest.mark.parametrize("clearances", CLEARANCES)
def test_a_row_deviates_from_the_amounts_in_force(clearances):
    """A deviation of both amounts is the same reducer at the clearances that the sums leave."""
    varied = prepared(grinding("equidistant", 2, -2), grinding("shift", 2, -2))
    model, plain = model_of(varied, clearances), prepared()
    deviation = np.array([1.5e-6, -0.8e-6])
    x = np.append(np.zeros(len(varied.errors.columns) - 2), deviation)[np.newaxis]
    own = model.modification(np.array(clearances))
    stage = model.reducer.cycloid_stage
    equidistant, shift = own.equidistant + deviation[0], own.shift + deviation[1]
    moved = np.array([equidistant - shift * stage.flank_ratio, equidistant - shift]) / 1e-6
    other = model_of(plain, tuple(moved)).reading(OUTPUTS)(x[:, :-2])
    np.testing.assert_allclose(model.reading(OUTPUTS)(x).values, other.values, rtol=1e-9)


def test_the_middle_of_a_locked_row_moves_every_unit_at_every_clearance():
    """Amounts that are all 1 µm off, zone 0: radial clearance Δr_rp − Δr_p is 1 µm wider, whatever was chosen."""
    off = prepared(grinding("equidistant", 1.0, 1.0))
    for clearances in CLEARANCES:
        x = np.zeros((1, len(off.errors.columns)))
        (radial,) = model_of(off, clearances).reading((ta.RADIAL_CLEARANCE,))(x).values[0]
        (plain,) = model_of(prepared(), clearances).reading((ta.RADIAL_CLEARANCE,))(x).values[0]
        assert radial - plain == pytest.approx(1.0, abs=1e-6)
        assert plain == pytest.approx(clearances[1], abs=1e-6)


def test_the_middle_of_an_asymmetric_zone_counts_too():
    study = prepared(grinding("shift", 0.0, -6.0))
    x = units_of(study, 2000)
    assert x[:, -1].mean() == pytest.approx(-3e-6, abs=4 * 1e-6 / np.sqrt(2000))


@pytest.mark.parametrize("output", [ta.PEAK_TO_PEAK, ta.LOST_MOTION])
def test_derivatives_by_the_rows_are_those_of_differences_and_of_the_settings(output):
    study = prepared(grinding("equidistant", 2, -2), grinding("shift", 2, -2))
    model, x = model_of(study, (3.5, 12.0)), units_of(study, 40)
    found = model.derivatives(output, x)
    for at in (-2, -1):
        step = 1e-7 * np.eye(x.shape[1])[at]
        ends = [model.reading((output,))(x + side * step).values[:, 0] for side in (1, -1)]
        ratio = found.by_column[:, at] / ((ends[0] - ends[1]) / 2e-7)
        assert np.median(ratio) == pytest.approx(1.0, abs=0.03)  # a step crosses a kink of some units
    by_setting = found.by_column[:, -2:] @ model.drawn_amounts.by_setting * 1e-6
    np.testing.assert_allclose(found.by_setting, by_setting, rtol=1e-9, atol=1e-12)


def test_a_nominal_amount_that_is_not_in_force_is_remarked():
    present = ta.reducer("rv20e").reducer.modification.equidistant * 1e3  # mm
    right, wrong, unstated = (
        prepared(grinding("equidistant", 2, -2, **nominal)).model.mismatches
        for nominal in ({"nominal": present}, {"nominal": 0.02}, {})
    )
    assert right == unstated == ()
    assert "nominal of modification.equidistant is 0.02 mm" in wrong[0]
    assert f"its equidistant amount is {present:g} mm" in wrong[0]


@pytest.mark.slow
def test_a_micrometre_of_the_amounts_is_three_arcseconds_and_a_fifth_of_an_arcminute():
    """The believable RV-20E around 3.5 and 8 µm, zones as a drawing that can be built has them; 1,500 like units."""
    catalogue = str(STUDIES / "rv20e_catalogue.stiffness.toml")
    study = prepared(grinding("equidistant", 2, -2), grinding("shift", 2, -2), only=(), stiffness=catalogue)
    x, model = units_of(study, 1500), model_of(study, (3.5, 8.0))
    found = []
    for offset in (-1e-6, 1e-6):
        moved = x.copy()
        moved[:, -2:] = [offset, 0.0]
        found.append(model.reading((ta.PEAK_TO_PEAK, ta.LOST_MOTION))(moved).values)
    change = (found[1] - found[0]) / 2
    peak, lost = np.sqrt((change**2).mean(axis=0))
    assert peak == pytest.approx(3.0, abs=0.5)
    assert lost == pytest.approx(0.19, abs=0.02)
