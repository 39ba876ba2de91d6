"""``tolalloc identify`` as a user meets it: answers, files, repairs; refusals have a file of their own."""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import log, sqrt
from pathlib import Path

import pandas as pd
import pytest

from tests.builders import page_of, says, summary_of, wording
from tests.studies.bench_files import (
    NAME,
    NOISE,
    READINGS,
    START,
    TRUTH,
    answered,
    copied,
    files,
    identify,
    lines,
    value,
)
from tests.studies.command import answer_of, refused, require_offline
from tolalloc.reducers.reducer.files import load_identified_stiffness
from tolalloc.reports.wording import number


@dataclass(frozen=True)
class Run:
    """An answer with everything that the command wrote."""

    answer: dict
    report: Path
    stiffness: Path


@pytest.fixture(scope="module")
def run(curves, tmp_path_factory) -> Run:
    place = tmp_path_factory.mktemp("run")
    report, stiffness = place / "report", place / "bench.toml"
    result = identify(curves, "--out", report, "--write", stiffness, "--json")
    assert f"Report: {report / 'report.html'}" in result.stderr
    assert f"Stiffness file: {stiffness}" in result.stderr
    return Run(answered(result), report, stiffness)


@pytest.mark.slow
def test_the_answer_for_a_program(run):
    answer = run.answer
    assert set(answer) == {
        "reducer",
        "data",
        "units [-]",
        "readings [-]",
        "method",
        "objective [-]",
        "evaluations [-]",
        "status",
        "parameters",
        "directions",
        "reduced chi square [-]",
        "rms before [arcsec]",
        "rms after [arcsec]",
        "rms as written [arcsec]",
        "choices",
        "chosen",
        "warnings",
        "assumptions",
    }
    (found,) = answer["parameters"]
    assert set(found) == {
        "name",
        "unit",
        "start",
        "value",
        "relative standard uncertainty [-]",
        "interval",
        "identified",
        "on bound",
    }
    assert (answer["reducer"], answer["data"], answer["units [-]"]) == ("RV-20E", "6 simulated units", 6)
    assert answer["readings [-]"] == sum(READINGS.values())
    assert (answer["method"], answer["status"]) == ("Gauss–Newton", "converged")
    assert (found["name"], found["unit"], found["start"]) == (NAME, "N/m", START)
    assert answer["warnings"] == []
    assert "units and readings are simulated" in answer["assumptions"]


@pytest.mark.slow
def test_the_truth_is_found(run):
    (found,) = run.answer["parameters"]
    uncertainty = found["relative standard uncertainty [-]"]
    assert abs(log(found["value"] / TRUTH)) <= 3 * uncertainty
    assert 0 < uncertainty < 0.02
    low, high = found["interval"]
    assert low < found["value"] < high
    assert log(high / low) == pytest.approx(2 * 1.96 * uncertainty, rel=0.1)
    assert found["identified"] is True
    assert found["on bound"] is False
    assert run.answer["reduced chi square [-]"] == pytest.approx(1.0, abs=0.3)
    for kind, noise in NOISE.items():
        before, after = (run.answer[f"rms {when} [arcsec]"][kind] for when in ("before", "after"))
        freedom = READINGS[kind] - 6  # each curve and each loop has lost its mean
        assert READINGS[kind] * (after / noise) ** 2 / freedom == pytest.approx(1.0, abs=3 * sqrt(2 / freedom))
        assert before > after


@pytest.mark.slow
def test_choices_are_judged_by_units_left_out(run):
    choices = {item["fitted"]: item["left out [noise]"] for item in run.answer["choices"]}
    given = wording("identification.nothing_fitted")
    assert list(choices) == [given, "K_pd"]
    assert run.answer["chosen"] == "K_pd"
    assert choices["K_pd"] < choices[given]


@pytest.mark.slow
def test_the_stiffness_file_is_read_back_and_taken_by_te(run):
    (found,) = run.answer["parameters"]
    identified = load_identified_stiffness(run.stiffness)
    assert identified.values == {NAME: found["value"]}
    relative = found["relative standard uncertainty [-]"]
    assert identified.standard_uncertainty == {NAME: pytest.approx(found["value"] * relative)}
    assert identified.source == "simulated on the equivalent model"
    assert "identified by Gauss–Newton from 6 units of RV-20E" in identified.notes[0]
    taken, own = (
        answer_of("te", "--reducer", "rv20e_liu2020", *more)["torsional_stiffness_nm_per_arcmin"]["exact_parts"]
        for more in (("--stiffness", run.stiffness), ())
    )
    assert taken > own


@pytest.mark.slow
def test_the_report_folder_is_complete(run):
    names = {"report.html", "results.xlsx", "summary.json", "manifest.json", "identified.stiffness.toml"}
    of_curves = ("measured_curve", "curve_left", "curve_residuals")
    drawn = ("profiles", *of_curves, "measured_loop", "loop_left", "loop_residuals")
    tables = {f"tables/{name}.csv" for name in ("parameters", "directions", "choices", "units")}
    assert set(files(run.report)) == names | tables | {f"figures/{name}.png" for name in drawn}
    assert all(files(run.report).values())
    assert summary_of(run.report) == run.answer
    manifest = json.loads((run.report / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seed"] == 1
    assert manifest["versions"]["pymoo"]
    assert (run.report / "identified.stiffness.toml").read_bytes() == run.stiffness.read_bytes()
    assert load_identified_stiffness(run.report / "identified.stiffness.toml").values
    sheets = pd.read_excel(run.report / "results.xlsx", sheet_name=None)
    assert list(sheets)[:2] == ["answer", "contents"]
    assert set(sheets) == {
        "charts",
        "data of charts",
        "answer",
        "contents",
        "assumptions",
        *(Path(name).stem for name in tables),
    }
    assert len(sheets["units"]) == 6


@pytest.mark.slow
def test_the_page_works_offline_and_has_no_holes(run):
    page = page_of(run.report)
    require_offline(page)
    assert 'class="moving"' not in page
    assert "NaN" not in (run.report / "summary.json").read_text(encoding="utf-8")
    for key in ("parameters", "fixed", "choices", "readings"):
        assert f">{wording(f'identification.{key}_heading')}</h2>" in page


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bits_with_and_without_files(curves, run):
    assert answered(identify(curves, "--json")) == run.answer


@pytest.mark.slow
def test_bounds_and_prior_are_taken(curves, run):
    answer = answered(identify(curves, "--prior", f"{NAME}=0.005", "--json", name=f"{NAME}=8e9:2e10"))
    (found,), (without,) = answer["parameters"], run.answer["parameters"]
    assert START < found["value"] < without["value"]
    own, alone = (item["relative standard uncertainty [-]"] for item in (found, without))
    assert own == pytest.approx((0.005**-2 + alone**-2) ** -0.5, rel=0.1)
    alone = answered(identify(curves, "--json", name=f"{NAME}=8e9:1.2e10"))
    assert alone["parameters"][0]["on bound"] is True
    assert any("K_pd" in sentence for sentence in alone["warnings"])


@pytest.mark.slow
def test_wide_bounds_keep_the_value_inside_its_interval(curves, run):
    """The value is the model's own, the interval its polynomial's; they must not contradict each other."""
    (found,) = answered(identify(curves, "--json", name=f"{NAME}=1e9:1e11"))["parameters"]
    low, high = found["interval"]
    assert low <= found["value"] <= high
    if found["identified"]:
        assert found["value"] == pytest.approx(run.answer["parameters"][0]["value"], rel=1e-3)
        assert low < high


@pytest.mark.slow
def test_bounds_beyond_what_polynomials_follow_are_refused(curves):
    refused(
        identify(curves, name=f"{NAME}=1e4:1e13"), "are too wide, in a part of them the model has no answer", "narrower"
    )
    refused(identify(curves, name=f"{NAME}=5e7:1e13"), "are too wide, polynomials of the model are off by", "narrower")


@pytest.mark.slow
def test_weak_data_leave_the_stiffness_open_and_say_so(peak_to_peaks, tmp_path):
    report, file = tmp_path / "report", tmp_path / "weak.toml"
    result = identify(peak_to_peaks, "--out", report, "--write", file)
    assert result.returncode == 0, result.stderr
    low, high = START / 2, START * 2
    assert f"{number(low, '.4g')} to {number(high, '.4g')} N/m" in result.stdout
    answer = summary_of(report)
    (found,) = answer["parameters"]
    assert found["identified"] is False
    (warning,) = (own for own in answer["warnings"] if "K_pd" in own)
    assert warning in result.stdout
    assert (answer["choices"], answer["chosen"]) == ([], None)
    (found,) = answer["parameters"]
    assert found["identified"] is False
    assert found["interval"] == pytest.approx([low, high])
    assert set(files(report)) == {
        *("report.html", "results.xlsx", "summary.json", "manifest.json", "identified.stiffness.toml"),
        *("figures/profiles.png", "figures/peak_to_peak_residuals.png"),
        *("tables/parameters.csv", "tables/directions.csv", "tables/units.csv"),
    }
    assert warning in page_of(report)
    identified = load_identified_stiffness(file)
    assert low < identified.values[NAME] < high
    even = log(4) / sqrt(12)
    assert 0.5 * even < identified.standard_uncertainty[NAME] / identified.values[NAME] <= even
    assert says(identified.notes, "identification.not_identified", symbol="K_pd")


@pytest.mark.slow
def test_repairs_are_counted_in_answer_and_report(curves, tmp_path):
    folder, report = copied(curves, tmp_path / "data"), tmp_path / "report"
    lines("curve1.csv", lambda rows: (rows.insert(9, rows[9]), rows.insert(30, rows[30])))(folder)
    for line, shown in ((5, "nan"), (40, ""), (41, "NaN")):
        lines("curve2.csv", value(line, shown))(folder)
    answer = answered(identify(folder, "--out", report, "--json"))
    repaired = [
        "Repaired: curve1.csv: 2 readings with a repeated angle averaged.",
        "Repaired: curve2.csv: 3 readings without a number left out.",
    ]
    assert answer["warnings"] == repaired
    page = page_of(report)
    assert all(sentence in page for sentence in repaired)
    assert answer["readings [-]"] == sum(READINGS.values()) - 3
    (found,) = answer["parameters"]
    assert abs(log(found["value"] / TRUTH)) <= 3 * found["relative standard uncertainty [-]"]


@pytest.mark.slow
def test_noise_that_nobody_states_is_estimated(curves, tmp_path):
    folder = copied(curves, tmp_path / "data")
    content = (folder / "measurement.toml").read_text(encoding="utf-8").split("[[loops]]")[0]
    kept = [line for line in content.splitlines() if not line.startswith("noise_arcsec")]
    (folder / "measurement.toml").write_text("\n".join(kept), encoding="utf-8")
    result = identify(folder)
    assert result.returncode == 0, result.stderr
    assert "noise" in result.stdout and "identified" in result.stdout
    assert "K_pd = " in result.stdout


def test_a_stiffness_file_without_a_stiffness_is_not_passed_over(curves, tmp_path):
    """Who asks for the torque alone and for a stiffness file is told that there will be none."""
    result = identify(curves, "--write", tmp_path / "none.toml", name="torque=0.9:1.1")
    assert not (tmp_path / "none.toml").exists()
    assert result.returncode in (0, 2)
    assert "Traceback" not in result.stderr
    assert "stiffness" in result.stdout + result.stderr


def test_a_torque_that_loops_alone_cannot_show_is_said_without_infinities(curves, tmp_path):
    """Loops measure the torque themselves; as with a bias, no number can come of it."""
    folder = copied(curves, tmp_path / "data")
    content = (folder / "measurement.toml").read_text(encoding="utf-8")
    head, loops = content.split("[[curves]]")[0], content.split("[[loops]]")[1:]
    (folder / "measurement.toml").write_text(head + "".join("[[loops]]" + loop for loop in loops), encoding="utf-8")
    result = identify(folder, "--parameter", "torque")
    assert "Traceback" not in result.stderr
    assert "inf%" not in result.stdout
    assert "torque" in result.stdout + result.stderr
