"""“Sens” is one number: the mean slope over the units of a drawing, in the ranking, the drawing, workbook and CSV."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from openpyxl import load_workbook

import tolalloc as ta
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import derived
from tolalloc.sensitivity.derivatives import local_derivatives
from tolalloc.study.prepared import Prepared

OUT = "y [mm]"
NORMAL = {"nominal": 1.0, "unit": "mm", "distribution": "normal", "Cp": 1.0, "cost": 1.0}


def row(name: str, half: float, **own) -> dict[str, object]:
    """Return a row of a size of ±half mm, 3σ, that may change by a tenth either way."""
    return {"id": name, "plus": half, "minus": -half, "min": 1.8 * half, "max": 2.2 * half, **NORMAL, **own}


def study(function, rows, limits=None, **changed) -> ta.Study:
    """Return a study of own sizes."""
    names = tuple(own["id"] for own in rows)
    return ta.Study(
        ta.model(function, inputs=names, outputs=(OUT,)),
        ta.Drawing.of_rows(rows),
        limits={OUT: limits or ta.Limit(upper=50.0)},
        **{"questions": [ta.Ranking(), ta.Allocation(front=False, what_if=False)], "name": "slopes", **changed},
    )


def slopes(made: ta.Study, units: int = 4096) -> tuple[np.ndarray, np.ndarray]:
    """Return what the ranking and the drawing tell of the same drawing, each of units of its own [mm/mm]."""
    own = Prepared(study=made)
    errors = own.space.errors
    response = derived(own.model, OUT, np.full(len(errors.columns), 1e-5))
    ranked = local_derivatives(Experiment.of(response, errors, SeedTree(1)), units).slope * 1e3
    verifier = Verifier(space=own.space, model=own.model, requirements=own.requirements, seeds=SeedTree(2), units=units)
    drawn = verifier.verify(own.space.uniform(1.0), "table").by_deviation
    assert drawn is not None
    return ranked, drawn * 1e-3


def test_a_kink_at_the_nominal_has_the_mean_slope_of_units():
    """y = 3·max(a, 1) has the slope 0 or 3 at its nominal, 3/2 on average."""
    for found in slopes(study(lambda a: 3 * np.maximum(a, 1.0), [row("a", 0.1)])):
        assert found == pytest.approx([1.5], abs=0.15)


def test_a_slope_that_grows_is_that_of_the_mean_not_of_the_nominal():
    """y = a³ about 1 with σ = 0.2: 3·(1 + σ²) = 3.12."""
    for found in slopes(study(lambda a: a**3, [row("a", 0.6)])):
        assert found == pytest.approx([3.12], abs=0.06)


def test_slopes_whose_signs_cancel_are_told_as_root_mean_square():
    """y = (a − 1)² with σ = 0.2: 2σ = 0.4, beside the 0 of the nominal."""
    for found in slopes(study(lambda a: (a - 1.0) ** 2, [row("a", 0.6)])):
        assert found == pytest.approx([0.4], rel=0.05)


def test_a_minus_sign_stays_though_some_units_have_another():
    """y = (a − 1)² − 0.3·a: the mean is −0.3 though every fourth unit has a slope above zero."""
    for found in slopes(study(lambda a: (a - 1.0) ** 2 - 0.3 * a, [row("a", 0.6)])):
        assert found == pytest.approx([-0.3], abs=0.03)


def test_the_largest_of_several_like_sizes_has_its_share_of_units():
    """y = max(a, b, c), all alike: each is the largest of every third unit."""
    rows = [row(name, 0.1) for name in "abc"]
    for found in slopes(study(lambda a, b, c: np.maximum(np.maximum(a, b), c), rows)):
        assert found == pytest.approx([1 / 3] * 3, abs=0.04)


def test_a_lower_limit_turns_no_sign():
    for found in slopes(study(lambda a: -2.0 * a, [row("a", 0.1)], ta.Limit(lower=-3.0))):
        assert found == pytest.approx([-2.0])


@pytest.mark.slow
def test_ranking_drawing_workbook_and_csv_tell_one_slope(tmp_path):
    """y = a³ + (b − 1)² + c: 3·(1 + σ²), 2σ where signs cancel, 1; as drawn the zones are hardly others."""
    rows = [row("a", 0.3, locked="yes"), row("b", 0.6, locked="yes"), row("c", 0.1)]
    made = study(lambda a, b, c: a**3 + (b - 1.0) ** 2 + c, rows)
    made.run(tmp_path / "run", effort="quick")
    tables = {path.name: pd.read_csv(path) for path in (tmp_path / "run" / "tables").glob("*.csv")}
    found = {
        name: own.set_index("source" if "source" in own else "dimension")["Sens [mm/µm]"]
        for name, own in tables.items()
        if "Sens [mm/µm]" in own
    }
    assert {"ranking.csv", "measures.csv", "drawing.csv"} <= {*found}
    for own in found.values():
        assert own[["a", "b", "c"]].to_list() == pytest.approx([3.03e-3, 0.4e-3, 1e-3], rel=0.05)
    heads = [
        str(cell.value)
        for sheet in load_workbook(tmp_path / "run" / "results.xlsx")
        for cell in sheet[1]
        if str(cell.value).startswith("Sens")
    ]
    assert heads and {*heads} == {"Sens [mm/µm]"}
