"""The commands as a user meets them: answers, files, and one sentence for every kind of bad input."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import LINEAR_STAGE, page_of, reducer_file, says, summary_of
from tests.studies.command import ROOT, answer_of, refused, require_offline, tolalloc
from tests.studies.scripts import study_script
from tolalloc.drawings.table_file import DATA
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.exceptions import InputError
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.perfect import exact_unit
from tolalloc.reducers.load_case import LoadCase
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.header import Header
from tolalloc.reports.tellers.transmission_error import TransmissionErrorTeller
from tolalloc.wings.bench.lot_orders import load_lot_curves
from tolalloc.wings.bench.posterior import Noise
from tolalloc.wings.bench.readings import clean_curve, load_readings, require_torque
from tolalloc.wings.motion.duty import duty_of

STUDY = ROOT / "studies" / "liu2020_allocation.py"
PEAK = "peak-to-peak transmission error [arcsec]"


EFFORT = """effort=ta.Effort(
    ranking=RankingEffort(
        units=1024, sobol=SobolEffort(start=64, limit=64), derivative_units=64,
        inverse_units=926, surrogate_units=96, level_units=100, level_runs=2, widened_units=200, permutations=10),
    allocation=AllocationEffort(
        verification_units=1152, confirmation_units=2304, shared_units=48, share_blocks=8,
        front_limits=(0.95, 1.1), front_units=1152, front_steps=1, search=SearchEffort(steps=2)),
    is_quick=True), questions=[ta.Ranking(), ta.Allocation(fixed_first=False, what_if=False)]"""
EFFORTS = """from tolalloc.allocation.space.effort import AllocationEffort
from tolalloc.allocation.space.effort import SearchEffort
from tolalloc.sensitivity.effort import RankingEffort
from tolalloc.sensitivity.effort import SobolEffort
"""


def small_study(folder: Path) -> Path:
    """Write the shipped study with less effort: every source, both questions."""
    reducer = {"stiffness": "rv20e_table6", "unit": "table4"}
    return study_script(folder, reducer=reducer, written=EFFORT, imports=EFFORTS, name="rv20e_allocation")


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("run")
    result = tolalloc("run", small_study(path), "--out", path / "quick")
    assert result.returncode == 0, result.stderr
    return path / "quick"


def table_with(tmp_path: Path, change) -> str:
    frame = pd.read_csv(DATA / "rv20e_table4.tolerances.csv", dtype=str, keep_default_na=False)
    path = tmp_path / "table.csv"
    change(frame).to_csv(path, index=False)
    return str(path)


def set_cell(row: int, column: str, value: str):
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        frame.loc[row, column] = value
        return frame

    return change


DRAWN = {"drawing.xlsx", "frames.dxf", "inspection.dfd"}


@pytest.mark.slow
def test_te_of_table_4(tmp_path):
    folder = tmp_path / "report"
    answer = answer_of("te", "--reducer", "rv20e_liu2020", "--unit", "table4", "--torque", "-1", "--out", folder)
    assert summary_of(folder) == answer
    assert {path.stem for path in (folder / "figures").iterdir()} == {"transmission_error", "orders", "forces"}
    assert len(pd.read_csv(folder / "tables" / "one turn.csv")) > 20
    assert answer["peak_to_peak_arcsec"] == pytest.approx(96.58, abs=0.05)
    assert [wave["order"] for wave in answer["main_orders"]][:6] == [1, 78, 80, 79, 39, 2]
    assert answer["angles"]["of_the_orders"] == 6552
    assert answer["statuses"]["equilibrium found"] == 936


def test_the_curve_that_te_writes_is_read_by_diagnose_and_lot_as_it_stands(tmp_path):
    model = EquivalentModel(load_reducer("rv40e_xi2015"))
    found, path = model.equilibria(exact_unit(model), -1.0), tmp_path / "curve.csv"
    TransmissionErrorTeller(
        SimpleNamespace(equilibria=found, torque=-1.0, orders_over_torque=lambda _: []), Header(name="", model="")
    ).add_files(tmp_path)
    curve = clean_curve(load_readings(path, "angle", "transmission error"))
    assert curve.repairs == ()
    np.testing.assert_allclose(curve.along, found.carrier_angle, atol=1e-12)
    shape = found.transmission_error[0] - found.transmission_error[0].mean()
    np.testing.assert_allclose(curve.values, shape, atol=1e-15)
    columns = pd.read_csv(path).to_dict("list")
    assert json.loads((tmp_path / "curve.json").read_text()) == columns
    require_torque(path, -1.0)
    with pytest.raises(InputError, match=r"the mean of 'torque \[N·m\]' is -1\.0; allowed is -572 within 5%"):
        require_torque(path, -572.0)
    (tmp_path / "lot").mkdir()
    for unit in range(5):
        shutil.copy(path, tmp_path / "lot" / f"unit{unit}.csv")
    drawing = ta.drawing("rv40e_drawing")
    curves = load_lot_curves(
        tmp_path / "lot", ta.reducer("rv40e_xi2015").bound(drawing.errors, ""), drawing.errors, Noise()
    )
    assert len(curves.orders) == 10
    assert np.abs(curves.waves).max() < 1e-6  # 1,560 waves alone, of which 936 angles make 312
    asked = {"curve": path, "reducer": "rv40e_xi2015", "tolerances": "rv40e_drawing", "torque": -572.0}
    with pytest.raises(InputError, match="torque"):
        ta.diagnose(**asked)


@pytest.mark.slow
def test_te_calls_exact_parts_one_thing_and_its_orders_what_they_are(tmp_path):
    answer = ta.te(reducer=str(LINEAR_STAGE), attributed=True)
    found = answer.summary
    assert {"curve.csv", "curve.json"} <= {path.name for path in answer.save(tmp_path / "te").iterdir()}
    orders = [wave["order"] for wave in found["main_orders"]]
    assert orders[:5] == [240, 480, 870, 720, 960] == found["attribution"]["orders"][:5]
    assert says(answer.sentences, "transmission_error.strongest", orders="240 (1.49″), 480 (0.351″), 870 (0.276″)")
    for key in ("lost_motion_arcmin", "backlash_arcmin", "torsional_stiffness_nm_per_arcmin"):
        assert found[key]["this_unit"] == pytest.approx(found[key]["exact_parts"], rel=1e-12)
    by_order = np.array([source["share_arcsec"] for source in found["attribution"]["sources"]]).sum(axis=0)
    np.testing.assert_allclose(by_order, found["attribution"]["amplitude_arcsec"], atol=1e-9)
    drawn = answer.figures["orders"].series[0]
    assert set(orders) <= set(drawn.x)
    assert list(drawn.x) == sorted(drawn.x)


@pytest.mark.slow
def test_efficiency_and_no_load_torque_are_one_number_each():
    """By hand: 167/(167 + contacts) and 167/(167 + contacts + seals and grease); the duty cycle says the latter."""
    answer = ta.te(reducer="rv20e")
    friction = answer.summary["friction"]
    contacts = sum(own["rated_nm"] for own in friction["by_contact"])
    beside = friction["seals_nm"] + friction["grease_nm"]
    assert friction["efficiency_at_rated_torque_percent"] == pytest.approx(100 * 167 / (167 + contacts))
    overall = friction["overall_efficiency_at_rated_torque_percent"]
    assert overall == pytest.approx(100 * 167 / (167 + contacts + beside))
    idle = sum(own["no_load_nm"] for own in friction["by_contact"]) + beside
    assert friction["no_load_torque_nm"] == pytest.approx(idle)
    duty = duty_of(load_reducer("rv20e"), [LoadCase("rated", torque=-167.0, speed=15.0, disc_temperature=0.0)])
    assert overall == pytest.approx(100 * duty.loads[0].efficiency, abs=0.02)
    told = " ".join(answer.sentences)
    assert f"{overall:.1f} %" in told
    assert not any("friction torque" in own for own in answer.tables["one turn"]["quantity"])


@pytest.mark.slow
def test_te_for_a_person_names_units():
    result = tolalloc("te", "--unit", "table4")
    assert result.returncode == 0, result.stderr
    assert "N·m/arcmin" in result.stdout


def test_check_says_what_is_read_and_that_the_drawing_cannot_be_built():
    result = tolalloc("check", STUDY)
    assert result.returncode == 0
    assert not says(result.stdout, "check.in_order")
    assert "100.0 %" in result.stdout.splitlines()[-1]
    assert "σ =" in result.stdout
    # Rows that say the same stand in one line, others do not; the zones of the shipped table cost what they add up to.
    (rows,) = (line for line in result.stdout.splitlines() if line.strip().startswith("disc*.pitch"))
    assert "2 rows" in rows and ": 23.3 µm" in rows
    assert any(line.strip().startswith("disc1.bore1.position: 4 µm") for line in result.stdout.splitlines())
    table = load_tolerance_table("rv20e_table4")
    cost = sum(source.cost for source in table if source.zone > 0)
    assert f" {cost:.2f} cost units" in result.stdout
    (flank,) = (line for line in result.stdout.splitlines() if line.strip().startswith("flank clearance: 1.04 µm;"))
    assert " 1…5 µm" in flank


@pytest.mark.slow
def test_run_folder_is_complete(run_folder):
    names = {str(path.relative_to(run_folder)) for path in run_folder.rglob("*") if path.is_file()}
    files = {"manifest.json", "summary.json", "report.html", "results.xlsx", "allocation.csv"} | DRAWN
    assert {name for name in names if "/" not in name} == files
    tables = {
        "ranking",
        "dimensions",
        "allocation dimensions",
        "requirements",
        "allocation requirements",
        "tolerances",
        "front",
        "drawing",
        "shares",
    }
    figures = {
        "ranking",
        "effects",
        "zones",
        "peak_to_peak",
        "front",
        "transmission_error",
        "orders",
        "orders_of_units",
    }
    assert names >= {f"tables/{name}.csv" for name in tables} | {f"figures/{name}.png" for name in figures}


@pytest.mark.slow
def test_report_works_offline(run_folder):
    page = page_of(run_folder)
    require_offline(page)
    assert ">nan<" not in page.lower()
    assert len(page) < 1_000_000


@pytest.mark.slow
def test_manifest_and_summary_say_what_was_done(run_folder):
    manifest = json.loads((run_folder / "manifest.json").read_text(encoding="utf-8"))
    summary = summary_of(run_folder)
    assert manifest["seed"] == 1
    assert manifest["versions"]["numpy"]
    assert manifest["questions"] == list(summary) == ["ranking", "allocation"]
    statuses = [manifest["statuses"][question] for question in summary]
    assert sum(own["equilibrium found"] for own in statuses) > 5000
    assert all(sum(own.values()) == own["equilibrium found"] for own in statuses)
    allocated = summary["allocation"]
    assert allocated["met"] is True
    assert allocated["saving [-]"] > 0
    assert allocated["yield lower bound, one-sided 95 % [-]"] >= 0.9973
    assert allocated["lower bound [cost units]"] <= allocated["cost [cost units]"] * (1 + 1e-9)
    assert {own["study hash"] for own in summary.values()} == {manifest["study hash"]}


@pytest.mark.slow
def test_an_identified_stiffness_is_a_source_of_the_ranking_alone(run_folder):
    name = "stiffness (identified)"
    ranked = pd.read_csv(run_folder / "tables" / "ranking.csv")
    row = ranked[ranked["dimension"] == name].iloc[0]
    summary = summary_of(run_folder)
    found = summary["ranking"]["identified stiffness"]
    assert found["source"] == name
    assert found["total index ST [-]"] == pytest.approx(row["total index ST [-]"])
    assert 0 < found["total index ST [-]"] < 1e-4
    assert 0 < found["sigma of the mean [arcsec]"] <= found["sigma of a unit [arcsec]"] < 0.1
    assert found["first-order error at 2 sigma, rms [arcsec]"] < 0.02
    for table in ("allocation.csv", "tables/tolerances.csv", "tables/shares.csv"):
        assert name not in (run_folder / table).read_text(encoding="utf-8")
    page = page_of(run_folder)
    assert says(page, "ranking.uncertain", names=name)


@pytest.mark.slow
def test_allocation_has_the_layout_of_the_tolerance_table(run_folder):
    before, after = load_tolerance_table("rv20e_table4"), load_tolerance_table(run_folder / "allocation.csv")
    assert [source.name for source in after] == [source.name for source in before]
    for old, new in zip(before, after, strict=True):
        assert new.columns == old.columns
        if old.zone:
            assert new.cost * new.zone == pytest.approx(old.cost * old.zone, rel=1e-3)
            assert old.minimum * 0.999 <= new.zone <= old.maximum * 1.001


@pytest.mark.slow
def test_every_header_states_a_unit_where_there_is_one(run_folder):
    words = {"dimension", "S1 reading"}
    frame = pd.read_csv(run_folder / "tables" / "ranking.csv")
    assert all("[" in header or header in words for header in frame.columns)
    *measured, which = pd.read_csv(run_folder / "tables" / "front.csv").columns
    assert which == "drawing" and all("[" in header for header in measured)


@pytest.mark.slow
def test_same_seed_gives_the_same_bits(run_folder, tmp_path):
    result = tolalloc("run", small_study(tmp_path), "--out", tmp_path / "again")
    assert result.returncode == 0, result.stderr
    for name in ("tables/ranking.csv", "allocation.csv", "tables/front.csv", "summary.json"):
        assert (run_folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_a_run_folder_with_something_in_it_is_refused(tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    refused(tolalloc("run", STUDY, "--quick", "--out", tmp_path), str(tmp_path), "not empty")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            set_cell(3, "id", "disc2.bore9.position"),
            ["unknown source 'disc2.bore9", "disc2.bore2.position"],
        ),
        (set_cell(0, "plus [unit]", "-4"), ["row 2", "disc1.bore1.position", "-4", "must be 0 to 1000000 µm"]),
        (set_cell(4, "plus [unit]", "900000"), ["row 6", "zone 900000, max"]),
        (set_cell(1, "max [unit]", "300"), ["disc1.bore2.position", "up to 200 µm", "zone 3.8, max 300 µm"]),
        (set_cell(2, "Cp [-]", "good"), ["row 4", "Cp", "good", "a number"]),
        (set_cell(5, "distribution", "gausss"), ["row 7", "distribution", "gausss", "normal, uniform"]),
        (set_cell(6, "min [unit]", "7"), ["row 8", "min 7", "between min and max"]),
        (lambda frame: frame.drop(columns="cost [cost units]"), ["'cost'", "missing"]),
        (lambda frame: frame.rename(columns={"Cp [-]": "Cpk [-]"}), ["Cpk", "Cp"]),
        (lambda frame: frame.drop(index=9), ["carrier.bore2.position is not given"]),
        (lambda frame: pd.concat([frame, frame.iloc[[0]]]), ["disc1.bore1.position", "second time"]),
    ],
)
def test_bad_tables_are_refused_in_one_sentence(tmp_path, change, words):
    script = study_script(tmp_path, drawing={"table": table_with(tmp_path, change)})
    refused(tolalloc("check", script), *words)
    out = tmp_path / "run"
    refused(tolalloc("run", script, "--quick", "--out", out), *words)
    assert not out.exists()


def row(**cells: str):
    """Return a change that adds a source with these cells, the others like those of a bore."""

    def change(frame: pd.DataFrame) -> pd.DataFrame:
        added = {**frame.iloc[0].to_dict(), "group": "", **cells}
        return pd.concat([frame, pd.DataFrame([added])], ignore_index=True).fillna("")

    return change


ADDED = {"plus [unit]": "2", "min [unit]": "1", "max [unit]": "4"}


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        ({"id": "each_pin.position", "each": "40"}, []),
        ({"id": "each_pin.position", "each": "20"}, ["each_pin.position", "each", "20", "40"]),
        ({"id": "each_pin.position", "each": "all"}, ["each", "all", "whole number"]),
        ({"id": "crank1.tilt", "over": "30"}, []),
        ({"id": "crank1.tilt"}, ["crank1.tilt", "over", "mm"]),
        ({"id": "sun.pitch", "feature": "pitch", "spectrum [order:amplitude]": "1:1 3:0.5"}, []),
    ],
)
def test_scatter_tilt_and_other_orders_are_sources_too(tmp_path, cells, words):
    script = study_script(tmp_path, drawing={"table": table_with(tmp_path, row(**ADDED, **cells))})
    if words:
        refused(tolalloc("check", script), *words)
    else:
        result = tolalloc("check", script)
        assert result.returncode == 0, result.stderr
        assert cells["id"] in result.stdout


@pytest.mark.slow
def test_a_reducer_with_clearance_is_studied_like_any_other(tmp_path):
    clearances = "\n[clearances]\ncrank_disc_bearing_um = 2\ncarrier_bearing_um = 1\n"
    path = reducer_file(tmp_path / "loose.toml", "rv20e_liu2020", added=clearances)
    assert tolalloc("check", study_script(tmp_path, reducer={"name": str(path), "unit": "table4"})).returncode == 0
    answer = answer_of("te", "--reducer", path, "--unit", "table4", "--torque", "-10")
    tight = answer_of("te", "--reducer", "rv20e_liu2020", "--unit", "table4", "--torque", "-10")
    assert answer["statuses"]["equilibrium found"] == 936
    assert answer["lost_motion_arcmin"]["this_unit"] > 2 * tight["lost_motion_arcmin"]["this_unit"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "reducer", ["rv20e", "rv40e", "rv80e", "rv110e", "rv160e", "rv20e_liu2020", "rv40e_xi2015", "bx40e"]
)
def test_every_preset_turns(reducer):
    answer = answer_of("te", "--reducer", reducer, "--attribute")
    assert answer["statuses"]["equilibrium found"] == 936
    assert 0 < answer["peak_to_peak_arcsec"] < 5  # no errors: the modification and the elastic twist alone
    assert answer["backlash_arcmin"]["this_unit"] == answer["backlash_arcmin"]["exact_parts"] > 0
    shares = sum(abs(source["share_arcsec"][0]) for source in answer["attribution"]["sources"])
    assert shares >= answer["attribution"]["amplitude_arcsec"][0] > 0


def test_a_truncated_workbook_is_refused(tmp_path):
    path = tmp_path / "table.xlsx"
    pd.read_csv(DATA / "rv20e_table4.tolerances.csv").to_excel(path, index=False)
    assert tolalloc("check", study_script(tmp_path, drawing={"table": str(path)})).returncode == 0
    path.write_bytes(path.read_bytes()[:2000])
    refused(tolalloc("check", study_script(tmp_path, drawing={"table": str(path)})), "table.xlsx", "truncated")


def test_a_truncated_table_is_refused(tmp_path):
    text = (DATA / "rv20e_table4.tolerances.csv").read_text(encoding="utf-8")
    (tmp_path / "table.csv").write_text(text[: int(len(text) * 0.7)].rsplit(",", 9)[0], encoding="utf-8")
    refused(
        tolalloc("check", study_script(tmp_path, drawing={"table": str(tmp_path / "table.csv")})),
        "table.csv",
        "truncated",
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("eccentricity_mm = 0.9", "eccentricity_mm = 900", ["cycloid_stage.eccentricity_mm", "900", "10"]),
        ("eccentricity_mm = 0.9", "eccentricity_m = 0.9", ["eccentricity_m", "eccentricity_mm"]),
        ("eccentricity_mm = 0.9", "eccentricity_mm = 1.9", ["K1", "below 1"]),
        ("disc_teeth = 39", "disc_teeth = 38", ["disc_teeth", "39"]),
        ("pin_count = 40\n", "", ["cycloid_stage.pin_count", "missing"]),
        ('name = "RV-20E"', 'name = "RV-20E', ["truncated"]),
    ],
)
def test_bad_reducers_are_refused_in_one_sentence(tmp_path, old, new, words):
    path = reducer_file(tmp_path / "mine.toml", "rv20e_liu2020", (old, new))
    refused(tolalloc("te", "--reducer", path), "mine.toml", *words)


def test_unknown_names_offer_the_nearest(tmp_path):
    refused(tolalloc("te", "--reducer", "rv20"), "rv20", "rv20e")
    refused(tolalloc("te", "--unit", "tabel4"), "tabel4", "table4")
    path = tmp_path / "unit.toml"
    from tolalloc.reducers.reducer.files import PRESETS

    text = (PRESETS / "table4.unit.toml").read_text(encoding="utf-8")
    path.write_text(text.replace('"carrier.bore1.position"', '"carrier.bore3.position"'), encoding="utf-8")
    refused(tolalloc("te", "--unit", path), "carrier.bore3.position", "carrier.bore1.position")


@pytest.mark.parametrize("torque", ["nan", "0", "1e9"])
def test_a_torque_without_meaning_is_refused(torque):
    refused(tolalloc("te", "--torque", torque), "torque", "1670 N·m, but not 0")


def test_te_writes_no_file_about_a_reducer_that_nobody_named(tmp_path):
    refused(tolalloc("te", "--out", tmp_path / "report"), "--reducer is missing", "rv40e, rv40e_xi2015, rv80e")


def test_a_folder_that_cannot_be_made_is_refused_before_the_work(tmp_path):
    (tmp_path / "file").write_text("keep")
    refused(tolalloc("run", STUDY, "--quick", "--out", tmp_path / "file" / "run"), "cannot be made")
    assert (tmp_path / "file").read_text() == "keep"


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"limits": "{ta.PEAK_TO_PEAK: ta.Limit(upper=float('nan'))}"}, ["upper is nan", "a finite number"]),
        ({"limits": "{ta.PEAK_TO_PEAK: ta.Limit()}"}, ["lower side, an upper side or both"]),
        ({"limits": "{ta.PEAK_TO_PEAK: ta.Limit(lower=60.0, upper=50.0)}"}, ["limit: upper is 50", "above the lower"]),
        ({"limits": "{ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=99.73))}"}, ["99.73", "0.5"]),
        ({"limits": "{ta.PEAK_TO_PEAK: 60.0}"}, [f"limits['{PEAK}']", "60.0", "ta.Limit"]),
        (
            {"limits": "{'peak-to-peak [arcsec]': ta.Limit(upper=60.0)}"},
            ["unknown output", "peak-to-peak [arcsec]", PEAK],
        ),
        ({"limits": "{}"}, ["limits is empty"]),
        ({"seed": -1}, ["seed", "-1"]),
        ({"name": "../elsewhere"}, ["name", "../elsewhere", "letters"]),
        ({"largest_failed_share": 0.7}, ["largest_failed_share", "0.7", "0 to 0.5"]),
        ({"questions": []}, ["questions", "ta.Ranking"]),
        ({"reducer": {"torque": 1e9}}, ["torque", "1670 N·m"]),
        ({"reducer": {"flank_clearance": (5.0, 1.0)}}, ["flank_clearance", "smaller one first"]),
        ({"drawing": {"table": "nothing.csv"}}, ["nothing.csv", "no such file"]),
        ({"drawing": {"correlations": "nowhere.csv"}}, ["nowhere.csv", "no such file"]),
        ({"drawing": {"processes": "nowhere"}}, ["nowhere", "generic"]),
    ],
)
def test_bad_studies_are_refused_in_one_sentence(tmp_path, fields, words):
    refused(tolalloc("check", study_script(tmp_path, **fields)), *words)


def test_a_script_without_a_study_is_refused(tmp_path):
    script = tmp_path / "empty.py"
    script.write_text("x = 1\n")
    refused(tolalloc("check", script), "empty.py", "study = Study")
    script.write_text("study = (\n")
    refused(tolalloc("check", script), "empty.py", "truncated")
    refused(tolalloc("check", tmp_path / "none.py"), "none.py", "no such study")


@pytest.mark.slow
def test_the_script_runs_by_itself(tmp_path):
    copy = tmp_path / "liu2020_allocation.py"
    shutil.copy(STUDY, copy)
    (tmp_path / "busy").mkdir()
    (tmp_path / "busy" / "file").write_text("x")
    command = [sys.executable, str(copy), "--quick", "--out", str(tmp_path / "busy")]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    refused(result, "busy", "not empty")
