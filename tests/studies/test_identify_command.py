"""``tolalloc identify`` as a user meets it: answers, files, and one sentence for every kind of bad input."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
import traceback
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from math import log, pi, sqrt
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.studies.test_commands import ROOT, refused, tolalloc
from tolalloc.cli.main import main
from tolalloc.identification.simulation import Bench, random_units, simulated_bench
from tolalloc.measurement.folder import write_measurements
from tolalloc.reducer.files import load_identified_stiffness, load_reducer
from tolalloc.uncertainty.seeds import SeedTree
from tolalloc.uncertainty.sources import ErrorModel
from tolalloc.uncertainty.tolerance_table import load_tolerance_table
from tolalloc.units import ARCSECOND

NAME, TRUTH, START = "crank_disc_bearing", 1.4e10, 1.09e10
NOISE = {"curve": 0.2, "loop": 0.1}
"""Standard deviation of one reading [arcsec]."""

TORQUES = 167.0 * np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])
READINGS = {"curve": 6 * 72, "loop": 6 * TORQUES.size}
NOTHING = np.empty(0)
METHODS = {
    "gauss_newton": "Gauss–Newton",
    "improved_pso": "improved particle swarm",
    "pso": "particle swarm",
    "ga": "genetic algorithm",
}
CURVES_AND_LOOPS = Bench(
    curve_torques=(-167.0,),
    curve_angles=2 * pi * np.arange(72) / 72,
    curve_noise=NOISE["curve"] * ARCSECOND,
    loop_angles=(0.5,),
    loop_torques=TORQUES,
    loop_noise=NOISE["loop"] * ARCSECOND,
)
PEAK_TO_PEAKS = Bench(
    peak_to_peak_torque=-1.0, peak_to_peak_noise=ARCSECOND, curve_angles=NOTHING, loop_torques=NOTHING
)

Change = Callable[[Path], None]


def simulated(bench: Bench, count: int, folder: Path) -> Path:
    """Write what a bench reads of a few units whose crank–disc bearings are stiffer than the preset says."""
    given, seeds = load_reducer("rv20e"), SeedTree(7)
    true = replace(given, stiffness=replace(given.stiffness, **{NAME: TRUTH}))
    units = random_units(ErrorModel(load_tolerance_table("rv20e_baseline")), count, seeds.child("units"))
    write_measurements(simulated_bench(true, units, bench).measured(seeds.child("noise")), folder)
    return folder


@pytest.fixture(scope="module")
def curves(tmp_path_factory) -> Path:
    """Six units, a curve and a loop of each."""
    return simulated(CURVES_AND_LOOPS, 6, tmp_path_factory.mktemp("data") / "curves")


@pytest.fixture(scope="module")
def peak_to_peaks(tmp_path_factory) -> Path:
    """Three units, nothing but a peak-to-peak of each."""
    return simulated(PEAK_TO_PEAKS, 3, tmp_path_factory.mktemp("data") / "peak_to_peaks")


def identify(folder: Path, *options: object, name: str = NAME) -> subprocess.CompletedProcess[str]:
    return tolalloc("identify", folder / "measurement.toml", "--parameter", name, *options)


def answered(result: subprocess.CompletedProcess[str]) -> dict:
    assert result.returncode == 0, result.stderr
    assert "Warning" not in result.stderr
    return json.loads(result.stdout)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


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
    result = identify(curves, "--out", report, "--stiffness", stiffness, "--json")
    assert f"Report: {report / 'report.html'}" in result.stderr
    assert f"Stiffness file: {stiffness}" in result.stderr
    return Run(answered(result), report, stiffness)


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
        "methods",
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
    assert answer["methods"] == []
    assert answer["warnings"] == []
    assert "units and readings are simulated" in answer["assumptions"]


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


def test_choices_are_judged_by_units_left_out(run):
    choices = {item["fitted"]: item["left out [noise]"] for item in run.answer["choices"]}
    assert list(choices) == ["nothing (the reducer as given)", "K_pd"]
    assert run.answer["chosen"] == "K_pd"
    assert choices["K_pd"] < choices["nothing (the reducer as given)"]


def test_the_stiffness_file_is_read_back_and_taken_by_te(run):
    (found,) = run.answer["parameters"]
    identified = load_identified_stiffness(run.stiffness)
    assert identified.values == {NAME: found["value"]}
    relative = found["relative standard uncertainty [-]"]
    assert identified.standard_uncertainty == {NAME: pytest.approx(found["value"] * relative)}
    assert identified.source == "simulated on the equivalent model"
    assert "identified by Gauss–Newton from 6 units of RV-20E" in identified.notes[0]
    result = tolalloc("te", "--stiffness", run.stiffness, "--json")
    assert result.returncode == 0, result.stderr
    perfect = json.loads(result.stdout)["torsional_stiffness_nm_per_arcmin"]["perfect_reducer"]
    assert perfect > 2530  # 2519 with the preset's own bearing


def test_the_report_folder_is_complete(run):
    names = {"report.html", "results.xlsx", "summary.json", "manifest.json", "identified.stiffness.toml"}
    of_curves = ("measured_curve", "curve_left", "curve_residuals")
    drawn = ("profiles", *of_curves, "measured_loop", "loop_left", "loop_residuals")
    assert set(files(run.report)) == names | {f"figures/{name}.png" for name in drawn}
    assert all(files(run.report).values())
    assert json.loads((run.report / "summary.json").read_text(encoding="utf-8")) == run.answer
    manifest = json.loads((run.report / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seed"] == 1
    assert manifest["versions"]["pymoo"]
    assert (run.report / "identified.stiffness.toml").read_bytes() == run.stiffness.read_bytes()
    assert load_identified_stiffness(run.report / "identified.stiffness.toml").values
    sheets = pd.read_excel(run.report / "results.xlsx", sheet_name=None)
    assert set(sheets) == {"parameters", "directions", "choices", "units", "assumptions"}
    assert len(sheets["units"]) == 6


def test_the_page_works_offline_and_has_no_holes(run):
    page = (run.report / "report.html").read_text(encoding="utf-8")
    assert page.count("plotly.js v") == 1
    body = page.split("</script>", 1)[1]
    for outside in ('src="http', "src='http", 'href="http', "cdn."):
        assert outside not in body
    assert "NaN" not in (run.report / "summary.json").read_text(encoding="utf-8")
    for heading in ("Parameters", "What the data fix", "Simpler explanations", "Measured against modelled"):
        assert f">{heading}</h2>" in page


@pytest.mark.parametrize("method", METHODS)
def test_every_method_ends_at_the_same_objective(curves, run, method):
    answer = answered(identify(curves, "--method", method, "--json"))
    assert answer["method"] == METHODS[method]
    if method == "gauss_newton":
        assert answer == run.answer  # the same seed gives the same bits, with and without files
        return
    own, other = objective(answer), objective(run.answer)
    assert own == pytest.approx(other, rel=1e-4)
    (found,), (reference,) = answer["parameters"], run.answer["parameters"]
    assert abs(log(found["value"] / reference["value"])) < 0.1 * reference["relative standard uncertainty [-]"]
    assert found["interval"] == pytest.approx(reference["interval"], rel=1e-3)


def objective(answer: dict) -> float:
    """Return half the sum of squared residuals over their noise."""
    rms = answer["rms after [arcsec]"]
    return 0.5 * sum(count * (rms[kind] / NOISE[kind]) ** 2 for kind, count in READINGS.items())


def test_methods_are_compared_over_seeds(curves, run, tmp_path):
    answer = answered(identify(curves, "--compare", "2", "--seed", "5", "--out", tmp_path / "report", "--json"))
    assert [item["method"] for item in answer["methods"]] == list(METHODS.values())
    for item in answer["methods"]:
        assert len(item["objectives [-]"]) == len(item["evaluations [-]"]) == 2
        assert item["objective of the best on the model [-]"] == pytest.approx(objective(run.answer), rel=1e-4)
    assert "figures/convergence.png" in files(tmp_path / "report")
    assert len(pd.read_excel(tmp_path / "report" / "results.xlsx", sheet_name="methods")) == 4


def test_bounds_and_prior_are_taken(curves, run):
    answer = answered(identify(curves, "--prior", f"{NAME}=0.005", "--json", name=f"{NAME}=8e9:2e10"))
    (found,), (without,) = answer["parameters"], run.answer["parameters"]
    assert START < found["value"] < without["value"]
    own, alone = (item["relative standard uncertainty [-]"] for item in (found, without))
    assert own == pytest.approx((0.005**-2 + alone**-2) ** -0.5, rel=0.1)
    alone = answered(identify(curves, "--json", name=f"{NAME}=8e9:1.2e10"))
    assert alone["parameters"][0]["on bound"] is True
    assert any("K_pd has its least objective on a bound" in sentence for sentence in alone["warnings"])


def test_wide_bounds_keep_the_value_inside_its_interval(curves, run):
    """The value is the model's own, the interval its polynomial's; they must not contradict each other."""
    (found,) = answered(identify(curves, "--json", name=f"{NAME}=1e9:1e11"))["parameters"]
    low, high = found["interval"]
    assert low <= found["value"] <= high
    if found["identified"]:
        assert found["value"] == pytest.approx(run.answer["parameters"][0]["value"], rel=1e-3)
        assert low < high


def test_bounds_beyond_what_polynomials_follow_are_refused(curves):
    refused(identify(curves, name=f"{NAME}=1e4:1e13"), "are too wide, polynomials of the model are off by", "narrower")


def test_weak_data_leave_the_stiffness_open_and_say_so(peak_to_peaks, tmp_path):
    report, file = tmp_path / "report", tmp_path / "weak.toml"
    result = identify(peak_to_peaks, "--out", report, "--stiffness", file)
    assert result.returncode == 0, result.stderr
    low, high = START / 2, START * 2
    assert f"K_pd is not identified by these data: its 95 % interval spans the bounds, {low:.4g}…{high:.4g} N/m." in (
        result.stdout
    )
    warning = (
        "Not identified: K_pd. What the data leave open the stiffness file takes from the bounds: towards their "
        "middle, with the standard uncertainty of an even distribution."
    )
    assert warning in result.stdout
    assert "3 units: too few to judge a fit by units that it has not seen, or to resample." in result.stdout
    answer = json.loads((report / "summary.json").read_text(encoding="utf-8"))
    assert warning in answer["warnings"]
    assert (answer["choices"], answer["chosen"]) == ([], None)
    (found,) = answer["parameters"]
    assert found["identified"] is False
    assert found["interval"] == pytest.approx([low, high])
    assert set(files(report)) == {
        *("report.html", "results.xlsx", "summary.json", "manifest.json", "identified.stiffness.toml"),
        *("figures/profiles.png", "figures/peak_to_peak_residuals.png"),
    }
    assert warning in (report / "report.html").read_text(encoding="utf-8")
    identified = load_identified_stiffness(file)
    assert low < identified.values[NAME] < high
    even = log(4) / sqrt(12)
    assert 0.5 * even < identified.standard_uncertainty[NAME] / identified.values[NAME] <= even
    assert any("not identified" in note for note in identified.notes)


# What is repaired is counted.


def copied(folder: Path, target: Path) -> Path:
    shutil.copytree(folder, target)
    return target


def lines(name: str, change: Callable[[list[str]], object]) -> Change:
    """Return a change of the lines of a file, in place."""

    def apply(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8").splitlines()
        change(text)
        (folder / name).write_text("\n".join(text) + "\n", encoding="utf-8")

    return apply


def text(name: str, old: str, new: str) -> Change:
    """Return a change of the first place where a text stands in a file."""

    def apply(folder: Path) -> None:
        content = (folder / name).read_text(encoding="utf-8")
        assert old in content
        (folder / name).write_text(content.replace(old, new, 1), encoding="utf-8")

    return apply


def value(line: int, shown: str) -> Callable[[list[str]], object]:
    """Return a change of the second cell of a line."""
    return lambda rows: rows.__setitem__(line, f"{rows[line].split(',')[0]},{shown}")


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
    page = (report / "report.html").read_text(encoding="utf-8")
    assert all(sentence in page for sentence in repaired)
    assert answer["readings [-]"] == sum(READINGS.values()) - 3
    (found,) = answer["parameters"]
    assert abs(log(found["value"] / TRUTH)) <= 3 * found["relative standard uncertainty [-]"]


def test_noise_that_nobody_states_is_estimated(curves, tmp_path):
    folder = copied(curves, tmp_path / "data")
    content = (folder / "measurement.toml").read_text(encoding="utf-8").split("[[loops]]")[0]
    kept = [line for line in content.splitlines() if not line.startswith("noise_arcsec")]
    (folder / "measurement.toml").write_text("\n".join(kept), encoding="utf-8")
    result = identify(folder)
    assert result.returncode == 0, result.stderr
    assert "No noise was stated, so it is estimated from what the fit leaves." in result.stdout
    assert "identified" in result.stdout
    assert "K_pd = " in result.stdout


def test_a_stiffness_file_without_a_stiffness_is_not_passed_over(curves, tmp_path):
    """Who asks for the torque alone and for a stiffness file is told that there will be none."""
    result = identify(curves, "--stiffness", tmp_path / "none.toml", name="torque=0.9:1.1")
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


# What is refused, is refused in one sentence before anything long runs, and nothing is written.


@dataclass(frozen=True)
class Bad:
    """One kind of bad input.

    ``options`` come behind the data file; HERE stands for the folder of the case.
    """

    name: str
    options: tuple[str, ...]
    words: tuple[str, ...]
    changes: tuple[Change, ...] = ()
    weak: bool = False


def bad(name: str, options: str, *words: str, change: Change | tuple[Change, ...] = (), weak: bool = False) -> Bad:
    changes = change if isinstance(change, tuple) else (change,)
    return Bad(name, tuple(options.split()), words, changes, weak)


def data(name: str, change: Change | tuple[Change, ...], *words: str) -> Bad:
    """Return a case of bad data, asked in the ordinary way."""
    return bad(name, f"--parameter {NAME}", *words, change=change)


def asked(name: str, parameter: str, *words: str) -> Bad:
    """Return a case of a bad parameter, asked of good data."""
    return bad(name, f"--parameter {parameter}", *words)


def occupied(folder: Path) -> None:
    (folder / "report").mkdir()
    (folder / "report" / "mine.txt").write_text("keep", encoding="utf-8")


def constant(rows: list[str]) -> None:
    rows[1:] = [f"{row.split(',')[0]},1.5" for row in rows[1:]]


STIFFNESSES = "two stiffnesses from 1e4 to 1e13 N/m, the smaller one first."
CASES = (
    bad("unknown method", f"--parameter {NAME} --method annealing", "method 'annealing' is not known", "improved_pso"),
    asked(
        "unknown parameter",
        "crank_bearing",
        "Error: tolalloc identify: parameter 'crank_bearing' is not known; the nearest known are crank_disc_bearing, "
        "crank_carrier_bearing, carrier_bearing.",
    ),
    asked("empty parameter", "=", "parameter", "=", "NAME=LOW:HIGH"),
    asked("parameter twice", f"{NAME} --parameter {NAME}=8e9:2e10", NAME, "each parameter once"),
    asked(
        "bounds in the wrong order",
        f"{NAME}=2e10:8e9",
        f"Error: tolalloc identify: {NAME} is '2e+10:8e+09'; allowed is {STIFFNESSES}",
    ),
    asked("bounds that are equal", f"{NAME}=1.09e10:1.09e10", NAME, STIFFNESSES),
    asked("bounds below any stiffness", f"{NAME}=0:2e10", "'0:2e+10'", STIFFNESSES),
    asked("a bound that is nan", f"{NAME}=nan:2e10", "'nan:2e+10'", STIFFNESSES),
    asked("a bound that is infinite", f"{NAME}=8e9:inf", "'8e+09:inf'", STIFFNESSES),
    asked("bounds that are words", f"{NAME}=half:double", "half", "numbers", "is none"),
    asked(
        "one bound",
        f"{NAME}=2e10",
        f"Error: tolalloc identify: --parameter is '{NAME}=2e10'; allowed is NAME or NAME=LOW:HIGH, such as bias=-5:5.",
    ),
    asked("half of the bounds", f"{NAME}=:2e10", f"{NAME}=:2e10", "numbers", "is none"),
    asked("three bounds", f"{NAME}=8e9:1e10:2e10", "1e10:2e10", "numbers", "is none"),
    asked("bounds of a bias in N/m", f"{NAME} --parameter bias=8e9:2e10", "bias", "-3600 to 3600 arcsec"),
    asked("bounds of a torque below 0", f"{NAME} --parameter torque=-1:1", "torque", "two positive factors"),
    asked(
        "start outside of the bounds",
        f"{NAME}=1.2e10:2e10",
        f"Error: tolalloc identify: {NAME} is '1.2e+10:2e+10'; allowed is bounds around the start, which is 1.09e+10.",
    ),
    asked(
        "prior of a parameter that is not asked for",
        f"{NAME} --prior gear_mesh=0.1",
        "--prior",
        "gear_mesh",
        "a prior of a parameter that is asked for",
    ),
    asked("prior of nothing known", f"{NAME} --prior bearing=0.1", "--prior", "bearing"),
    asked("prior twice", f"{NAME} --prior {NAME}=0.1 --prior {NAME}=0.2", "prior", NAME, "once"),
    asked(
        "negative prior",
        f"{NAME} --prior {NAME}=-0.1",
        f"Error: tolalloc identify: prior of {NAME} is -0.1; allowed is 0.0001 or more.",
    ),
    asked("prior of 0", f"{NAME} --prior {NAME}=0", f"prior of {NAME} is 0.0", "0.0001 or more"),
    asked("prior that is nan", f"{NAME} --prior {NAME}=nan", f"prior of {NAME} is nan", "0.0001 or more"),
    asked("prior too small to divide by", f"{NAME} --prior {NAME}=1e-320", "prior", NAME),
    asked("prior that is a word", f"{NAME} --prior {NAME}=good", "--prior", f"{NAME}=good", "'good' is none"),
    asked("prior without a number", f"{NAME} --prior {NAME}", "--prior", "NAME=NUMBER, such as carrier_bearing=0.1"),
    asked("bias alone", "bias", "bias", "one or more besides the bias, which is the baseline"),
    bad(
        "bias without peak-to-peaks",
        f"--parameter {NAME} --parameter bias",
        "Error: measurement.toml: parameter 'bias' needs peak-to-peaks; the mean of curves and loops is removed.",
    ),
    bad(
        "fewer units than parameters",
        "",  # liu2020's three
        "Error: measurement.toml: peak-to-peaks of 3 units cannot fix 3 parameters (K_pd, K_b, K_ca); allowed is one "
        "parameter fewer than units, or measured curves and loops.",
        weak=True,
    ),
    bad("unknown reducer", "--reducer rv21e", "rv21e", "rv20e"),
    bad("negative seed", "--seed -1", "seed", "-1", "positive"),
    bad("negative number of seeds", "--compare -1", "-1", "0 to 1000"),
    data(
        "noise missing beside noise",
        lines("measurement.toml", lambda rows: rows.pop(next(at for at, row in enumerate(rows) if "noise" in row))),
        "Error: measurement.toml: noise_arcsec of curve 1 is missing; readings of several kinds, or with and without "
        "it, cannot be weighed against each other.",
    ),
    data(
        "no noise of two kinds",
        lines("measurement.toml", lambda rows: rows.__setitem__(slice(None), [r for r in rows if "noise" not in r])),
        "noise_arcsec of curve 1 is missing",
        "cannot be weighed against each other",
    ),
    data("no data file", lambda folder: (folder / "measurement.toml").unlink(), "measurement.toml: no such file."),
    data(
        "a folder for a data file",
        lambda folder: ((folder / "measurement.toml").unlink(), (folder / "measurement.toml").mkdir()),
        "measurement.toml: cannot be read as a text file",
    ),
    data(
        "not TOML",
        lambda folder: (folder / "measurement.toml").write_text("unit,angle\n1,2\n", encoding="utf-8"),
        "measurement.toml: not complete TOML",
    ),
    data("a curve's file missing", lambda folder: (folder / "curve3.csv").unlink(), "curve3.csv: no such file."),
    data(
        "sources that nothing states",
        text("measurement.toml", 'neglected = ["*"]', 'neglected = ["sun.*"]'),
        "is not stated",
        "neglected",
    ),
    data(
        "stiffness file that exists",
        lambda folder: (folder / "found.toml").write_text("mine", encoding="utf-8"),
        "Error: found.toml: the file exists; name a new one, nothing is overwritten.",
    ),
    bad("stiffness file in no folder", f"--parameter {NAME} --stiffness HERE/no/found.toml", "a folder that exists"),
    data("out folder not empty", occupied, "report: the run folder is not empty; allowed is a new or empty one"),
    bad("out is a file", f"--parameter {NAME} --out HERE/units.csv", "units.csv: is a file"),
    bad("out below a file", f"--parameter {NAME} --out HERE/units.csv/report", "units.csv/report"),
    data(
        "columns of unequal length",
        lines("curve2.csv", lambda rows: rows.__setitem__(72, rows[72].split(",")[0])),
        "Error: curve2.csv, row 73: 1 of 2 cells are there; the columns must be of equal length, and a cell without a "
        "number is left empty between its separators.",
    ),
    data(
        "degrees under rad",
        text("curve1.csv", "[deg]", "[rad]"),
        "Error: curve1.csv: the 72 angles under 'angle [rad]' span 355 rad, which looks like degrees; state the unit "
        "they were written in.",
    ),
    data(
        "radians under deg",
        lines(
            "curve1.csv",
            lambda rows: rows.__setitem__(
                slice(1, None), [f"{np.deg2rad(float(row.split(',')[0]))},{row.split(',')[1]}" for row in rows[1:]]
            ),
        ),
        "curve1.csv: the 72 angles under 'angle [deg]' span 6.196 deg, which looks like radians",
    ),
    data(
        "angles that turn back",
        lines("curve4.csv", lambda rows: rows.extend(rows[-2:20:-1])),
        "curve4.csv, row 74: angle [deg] is 350.0; allowed is one direction of rotation",
        "give each direction a file of its own.",
    ),
    data(
        "an angle out of place",
        lines("curve4.csv", lambda rows: rows.insert(10, rows.pop(30))),
        "curve4.csv, row",
        "one direction of rotation",
    ),
    data(
        "an instrument that does not move",
        lines("curve5.csv", constant),
        "Error: curve5.csv: all 72 values of column 'transmission error [arcsec]' are 1.5; an instrument that does not "
        "move is no measurement.",
    ),
    data("a loop that does not move", lines("loop2.csv", constant), "loop2.csv: all 6 values of column 'twist"),
    data(
        "too many readings without a number",
        tuple(lines("curve1.csv", value(line, "nan")) for line in (4, 5, 6, 7)),
        "curve1.csv: 4 of 72 readings have no number, the first in row 5; allowed is up to 5%.",
    ),
    data("a word among the readings", lines("curve1.csv", value(7, "overload")), "curve1.csv, row 8", "overload"),
)


def in_this_process(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run the command line as `tolalloc` does, without the two seconds that a process of its own spends on imports."""
    command, code = ["tolalloc", *map(str, arguments)], 0
    stdout, stderr = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(stdout), redirect_stderr(stderr):
        patch.setattr(sys, "argv", command)
        try:
            main()
        except SystemExit as ended:
            code = int(ended.code or 0)
        except Exception:
            code = 1
            stderr.write(traceback.format_exc())
    return subprocess.CompletedProcess(command, code, stdout.getvalue(), stderr.getvalue())


def refusal(case: Bad, source: Path, folder: Path) -> tuple[subprocess.CompletedProcess[str], str]:
    """Return what came of a case and its last line, files named relative to the folder, in which nothing changed."""
    copied(source, folder)
    for change in case.changes:
        change(folder)
    options = [option.replace("HERE", str(folder)) for option in case.options]
    for option, name in (("--out", "report"), ("--stiffness", "found.toml")):
        if option not in options:
            options += [option, str(folder / name)]
    before = files(folder)
    result = in_this_process("identify", folder / "measurement.toml", *options)
    refused(result)
    assert result.stdout == ""
    assert files(folder) == before
    return result, result.stderr.strip().rsplit("\n", 1)[-1].replace(f"{folder}/", "")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_bad_input_is_refused_in_one_sentence(curves, peak_to_peaks, tmp_path, case):
    result, sentence = refusal(case, peak_to_peaks if case.weak else curves, tmp_path / "case")
    assert sentence.endswith(".")
    for word in case.words:
        assert word in sentence
        if word.startswith("Error: "):
            assert word == sentence
    assert "Gauss–Newton  " not in result.stderr, "refused only after the long part"


def test_a_refusal_in_a_process_of_its_own(curves, tmp_path):
    refused(identify(curves, "--method", "annealing", "--out", tmp_path / "report"), "'annealing' is not known")
    refused(identify(tmp_path, "--stiffness", tmp_path / "found.toml"), "measurement.toml: no such file.")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("unknown method", "method"),
        ("parameter twice", "parameter"),
        ("bias alone", "bias"),
        ("negative seed", "seed"),
        ("negative number of seeds", "compare"),
    ],
)
def test_what_stands_on_the_command_line_is_not_looked_for_in_the_data_file(curves, tmp_path, name, word):
    case = next(case for case in CASES if case.name == name)
    _, sentence = refusal(case, curves, tmp_path / "case")
    assert sentence.startswith("Error: tolalloc identify: ")
    assert word in sentence


def test_the_study_of_liu2020(tmp_path):
    """In quick mode, about a minute: printed pairs, three seeds of every method, ten repetitions."""
    folder = tmp_path / "run"
    command = [sys.executable, str(ROOT / "studies" / "liu2020_identification.py"), "--quick", "--out", str(folder)]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert result.returncode == 0, result.stderr
    assert "A constant explains the printed residual better than any stiffness" in " ".join(result.stdout.split())
    assert "K_b is not identified by these data" in result.stdout
    answer = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert answer["within three standard errors [-]"] >= 9
    methods = {item["method"]: item for item in answer["peak-to-peaks"]["methods"]}
    best = {name: min(item["objectives [-]"]) for name, item in methods.items()}
    assert max(best.values()) <= (1 + 1e-4) ** 2 * min(best.values())
    swarm, exact = (methods[name]["evaluations [-]"] for name in ("improved particle swarm", "Gauss–Newton"))
    assert max(exact) <= min(swarm) / 20
    assert "NaN" not in (folder / "summary.json").read_text(encoding="utf-8")
