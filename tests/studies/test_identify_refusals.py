"""``tolalloc identify`` with bad input: one sentence before anything long runs, and nothing is written."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.studies.bench_files import NAME, Change, copied, files, identify, lines, text, value
from tests.studies.command import process, refused, tolalloc


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
    asked(
        "unknown parameter",
        "crank_bearing",
        "Error: tolalloc identify: unknown parameter 'crank_bearing'; the nearest known are crank_disc_bearing, "
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
    bad("stiffness file in no folder", f"--parameter {NAME} --write HERE/no/found.toml", "a folder that exists"),
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


def refusal(case: Bad, source: Path, folder: Path) -> tuple[subprocess.CompletedProcess[str], str]:
    """Return what came of a case and its last line, files named relative to the folder, in which nothing changed."""
    copied(source, folder)
    for change in case.changes:
        change(folder)
    options = [option.replace("HERE", str(folder)) for option in case.options]
    for option, name in (("--out", "report"), ("--write", "found.toml")):
        if option not in options:
            options += [option, str(folder / name)]
    if "--reducer" not in options:
        options += ["--reducer", "rv20e_liu2020"]
    before = files(folder)
    result = tolalloc("identify", folder / "measurement.toml", *options)
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


@pytest.mark.parametrize(("option", "name"), [("--out", "report"), ("--write", "found.toml")])
def test_no_file_is_about_a_reducer_that_nobody_named(curves, tmp_path, option, name):
    result = tolalloc("identify", curves / "measurement.toml", option, tmp_path / name)
    refused(result, "--reducer is missing", "rv20e_liu2020")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_refusal_in_a_process_of_its_own(curves, tmp_path):
    options = ("--parameter", NAME, "--seed", "-1", "--out", tmp_path / "report", "--reducer", "rv20e_liu2020")
    refused(process("identify", curves / "measurement.toml", *options), "seed is -1")
    refused(identify(tmp_path, "--write", tmp_path / "found.toml"), "measurement.toml: no such file.")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("parameter twice", "parameter"),
        ("bias alone", "bias"),
        ("negative seed", "seed"),
    ],
)
def test_what_stands_on_the_command_line_is_not_looked_for_in_the_data_file(curves, tmp_path, name, word):
    case = next(case for case in CASES if case.name == name)
    _, sentence = refusal(case, curves, tmp_path / "case")
    assert sentence.startswith("Error: tolalloc identify: ")
    assert word in sentence
