"""A nominal clearance of crank bearings: it needs no row in the table, a row lets it vary, and it adds lost motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import seeded_units
from tolalloc.cli.start import new
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.files import PRESETS

DRAWING = Path(ta.__file__).parent / "drawings" / "data" / "rv20e_drawing.tolerances.csv"
NAMES = tuple(f"crank{crank}.journal{journal}.clearance" for crank in (1, 2) for journal in (1, 2))


def reducer_file(folder: Path, clearance: float, preset: str = "") -> Path:
    """Write a reducer whose crank–disc bearings have a clearance [µm]."""
    text = preset or (PRESETS / "rv20e.reducer.toml").read_text(encoding="utf-8")
    path = folder / f"clearance_{clearance:g}.reducer.toml"
    assert "[clearances]" not in text
    path.write_text(text + f"\n[clearances]\ncrank_disc_bearing_um = {clearance:g}\n", encoding="utf-8")
    return path


def bound(path: Path, drawing: ta.Drawing, neglected: tuple[str, ...] = ()) -> ReducerModel:
    return ta.reducer(path, neglected=neglected).set_to(drawing.settings).bound(drawing.errors, "test")


def test_clearance_without_a_row_is_nominal_whatever_is_neglected(tmp_path):
    drawing = ta.drawing("rv20e_drawing")
    model = bound(reducer_file(tmp_path, 2.0), drawing, ("disc*.tilt",))
    assert {*NAMES} <= {*model.kernel.model.columns}
    assert [model.kernel.fixed[name] for name in NAMES] == [0.0] * len(NAMES)
    assert any("*.clearance" in own for own in model.left_out)


def test_clearance_with_a_row_varies_around_the_nominal_one(tmp_path):
    table = tmp_path / "zones.csv"
    text = DRAWING.read_text(encoding="utf-8").rstrip("\n")
    head = next(line for line in text.splitlines() if line.startswith("id,")).split(",")
    row = {"id": NAMES[0], "plus [unit]": "0.5", "minus [unit]": "-0.5", "unit": "µm", "min [unit]": "0.2"}
    row |= {"max [unit]": "2", "locked": "no"} | {name: "1" for name in head if name.startswith("cost")}
    table.write_text(text + "\n" + ",".join(row.get(name, "") for name in head) + "\n", encoding="utf-8")
    model = bound(reducer_file(tmp_path, 2.0), ta.drawing(table), ("disc*.tilt",))
    assert NAMES[0] in model.columns
    assert [model.kernel.fixed[name] for name in NAMES[1:]] == [0.0] * (len(NAMES) - 1)


def test_a_micrometre_of_internal_clearance_adds_about_015_arcmin_of_lost_motion(tmp_path):
    drawing = ta.drawing("rv20e_drawing")
    errors, medians = drawing.errors, []
    x = seeded_units(errors, 24)
    for clearance in (1.0, 2.0):  # half the internal clearance, as the reducer file takes it [µm]
        model = bound(reducer_file(tmp_path, clearance), drawing, ("disc*.tilt",))
        medians.append(float(np.median(model.reading((ta.LOST_MOTION,))(x).values[:, 0])))
    assert (medians[1] - medians[0]) / 2.0 == pytest.approx(0.15, abs=0.02)


def test_own_reducer_of_three_cranks_takes_a_clearance_without_a_row(tmp_path):
    new(tmp_path / "own", cranks=3)
    text = (tmp_path / "own" / "reducer.toml").read_text(encoding="utf-8")
    model = bound(reducer_file(tmp_path, 1.5, text), ta.drawing(tmp_path / "own" / "zones.xlsx"))
    assert model.kernel.fixed["crank3.journal1.clearance"] == 0.0
