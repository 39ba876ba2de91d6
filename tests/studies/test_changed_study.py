"""A study at another drawing and other settings: the model that a search tries, to the last bit."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import deviations_at, prepared, says
from tests.studies.command import command
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.tolerance_table import with_zones
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reports.finished_run import read_run
from tolalloc.study.prepared import Prepared

FLANK, RADIAL = "flank clearance [µm]", "radial clearance [µm]"


@pytest.mark.slow
def test_a_changed_study_is_the_model_at_other_settings_and_zones_to_the_last_bit(tmp_path):
    before = prepared()
    zones = [0.7 * own.zone for own in before.errors.active]
    drawing = before.study.drawing.with_sources(with_zones(before.errors.active, zones))
    drawing.to_csv(tmp_path / "tighter.csv")
    after = Prepared(study=before.study.changed(tmp_path / "tighter.csv", {FLANK: 2.5, RADIAL: 9.25}, name="tighter"))
    assert after.study.name == "tighter"
    uniform = next(SeedTree(3).uniform_chunks(32, len(before.errors.columns)))
    x = before.errors.deviations(before.errors.standard_values(uniform), np.array(zones))
    same = deviations_at(after.errors, uniform)
    np.testing.assert_allclose(same, x, rtol=1e-14)  # a table says its zones in µm
    outputs = (ta.PEAK_TO_PEAK, ta.PRELOAD)
    found = after.model.reading(outputs)(x).values
    np.testing.assert_array_equal(found, before.model.at(np.array([2.5, 9.25])).reading(outputs)(x).values)


def test_settings_of_an_own_model_are_set_by_name():
    def preload(size, spring):
        return spring * size

    setting = ta.Setting(name="spring [N/mm]", value=50.0, lower=20.0, upper=90.0, step=0.5)
    model = ta.model(preload, inputs=("size",), outputs=("preload [N]",), settings=(setting,))
    assert model.set_to({"spring [N/mm]": 30.0}).settings[0].value == 30.0
    with pytest.raises(InputError, match="20 to 90, the bounds"):
        model.set_to({"spring [N/mm]": 91.0})


@pytest.mark.parametrize(
    ("settings", "error", "said"),
    [
        ({"flank clearence [µm]": 2.0}, UnknownNameError, FLANK),
        ({FLANK: 9.0}, InputError, "1 to 5"),
        ({FLANK: "2"}, InputError, "1 to 5"),
    ],
)
def test_a_setting_that_is_not_there_or_out_of_bounds_is_a_sentence(settings, error, said):
    study = prepared().study
    with pytest.raises(error) as raised:
        study.changed(study.drawing, settings)
    assert said in str(raised.value)


WEIGHT = """import tolalloc as ta
row = {"plus": 3.0, "minus": -3.0, "unit": "µm", "min": 1.0, "max": 9.0, "cost": 1.0}
study = ta.Study(
    ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("sum [mm]",)),
    ta.Drawing.of_rows([{"id": name, **row} for name in "ab"]),
    limits={"sum [mm]": ta.Limit(upper=UPPER)},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="edited",
)
"""


@pytest.mark.slow
def test_a_study_runs_again_after_an_edit_and_says_what_changed(tmp_path):
    def run(upper, *words):
        (tmp_path / "edited.py").write_text(WEIGHT.replace("UPPER", str(upper)), encoding="utf-8")
        asked = command("run", "edited.py", "--quick", *words)
        found = subprocess.run(asked, cwd=tmp_path, capture_output=True, text=True, check=True, encoding="utf-8")
        return found.stdout.splitlines()

    compared = command("compare")
    none = subprocess.run(compared, cwd=tmp_path, capture_output=True, text=True, check=False, encoding="utf-8")
    assert none.returncode == 2 and "0 finished runs" in none.stderr
    assert not says(run(0.003), "comparison.both")
    again = run(0.002)
    first, second = (read_run(tmp_path / "runs" / name) for name in ("edited", "edited-2"))
    costs = [own.summary["cost [cost units]"] for own in (first, second)]
    assert costs[0] < costs[1]
    assert says(again, "comparison.since_cost", before="runs/edited", first=costs[0], second=costs[1])
    assert says(again, "comparison.other_question")
    assert says(again, "comparison.changed", count=2, rows=2)
    assert says(run(0.002), "comparison.unchanged")
    assert not says(run(0.002, "--out", "named"), "comparison.both")  # a named folder follows none
    last = subprocess.run(compared, cwd=tmp_path, capture_output=True, text=True, check=True, encoding="utf-8")
    assert "runs/edited-2" in last.stdout and "runs/edited-3" in last.stdout
