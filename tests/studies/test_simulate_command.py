"""The command ``tolalloc simulate``."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec

import numpy as np
import pandas as pd
import pytest

from tests.builders import says, summary_of
from tests.studies.command import answer_of, process, refused, tolalloc
from tolalloc.exceptions import TolallocError
from tolalloc.wings.motion.simulation import SimulationRequest, prepare_simulation

# Ten times the speed of xi2015: a crank turn takes 24 ms. One pin pass takes 0.6 ms.
SHORT = ("--speed", "5250", "--ramp", "0.02", "--duration", "0.06", "--step", "1e-5")
INSTALLED = pytest.mark.skipif(find_spec("exudyn") is None, reason="the optional extra is not installed")


@pytest.mark.slow
def test_a_run_is_reported_with_its_series(tmp_path):
    folder = tmp_path / "report"
    said = tolalloc("simulate", "--reducer", "rv40e_xi2015", *SHORT, "--torque", "-572", "--out", folder)
    assert said.returncode == 0, said.stderr
    assert says(" ".join(said.stdout.split()), "simulation.turns", ratio=81.0, output_speed=5250 / 81)
    summary = summary_of(folder)
    assert summary["crank turns of the steady part [-]"] == 1
    series = pd.read_csv(folder / "series.csv")
    assert len(series) == 6001
    last = series.iloc[-1]
    assert last["input speed [rpm]"] == pytest.approx(5250)
    assert last["output torque [N·m]"] == pytest.approx(-572)
    assert last["carrier angle [deg]"] == pytest.approx(5250 * 6 / 81 * 0.05)  # half of the ramp is lost
    steady = series[series["time [s]"] > 0.06 - 81 / 87.5 / 39 + 1e-9]
    moving = summary["in motion"]
    assert steady["output speed [rpm]"].mean() == pytest.approx(moving["output speed [rpm]"], rel=1e-6)
    counts = moving["pins in contact, disc 1 [-]"].split("…")
    found = steady["pins in contact, disc 1 [-]"]
    assert [int(counts[0]), int(counts[-1])] == [found.min(), found.max()]
    power = (steady["input torque [N·m]"] * steady["input speed [rpm]"]).mean() * 2 * np.pi / 60
    assert power == pytest.approx(summary["input power [W]"], rel=1e-5)
    assert {path.stem for path in (folder / "figures").iterdir()} == {
        "transmission_error",
        "input_speed",
        "output_speed",
        "input_acceleration",
        "output_acceleration",
        "contacts",
    }


@pytest.mark.slow
def test_the_compliance_decides_how_many_pins_carry():
    options = ("--pin-stiffness", "3.67e7", "--json")
    answer = json.loads(tolalloc("simulate", "--reducer", "rv40e_xi2015", *SHORT, *options).stdout)
    assert answer["at rest"]["pins in contact, disc 1 [-]"] == "16…17"
    assert answer["torque on the carrier [N·m]"] == -572
    assert answer["lowest natural frequency [Hz]"] > 0


@pytest.mark.slow
@INSTALLED
def test_the_prototype_turns_with_the_same_ratio():
    answer = answer_of("simulate", "--reducer", "rv40e_xi2015", *SHORT, "--engine", "exudyn")
    assert answer["in motion"]["ratio [-]"] == pytest.approx(81, rel=1e-5)
    assert answer["in motion"]["mean transmission error [arcsec]"] == pytest.approx(
        answer["at rest"]["mean transmission error [arcsec]"], abs=1.5
    )


UNIT = """
name = "bored"
source = "own"
neglected = ["*"]

[lengths] # µm
"modification.equidistant" = 10
"modification.shift" = -10

[vectors] # magnitude in µm, direction in degrees
"carrier.bore1.position" = [4.0, 90]
"""


@pytest.mark.slow
@INSTALLED
def test_the_prototype_takes_a_units_errors_and_modification(tmp_path):
    path = tmp_path / "bored.toml"
    path.write_text(UNIT, encoding="utf-8")
    run = ("simulate", "--reducer", "rv40e_xi2015", *SHORT, "--unit", path, "--engine", "exudyn", "--json")
    answer = json.loads(tolalloc(*run).stdout)
    assert answer["at rest"]["mean transmission error [arcsec]"] < -40  # the wider gap
    assert answer["in motion"]["mean transmission error [arcsec]"] == pytest.approx(
        answer["at rest"]["mean transmission error [arcsec]"], rel=0.05
    )
    refused(tolalloc("simulate", "--unit", "table4", "--engine", "exudyn"), "error column", "pitch")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--engine", "newmrk"), ("unknown engine 'newmrk'", "newmark")),
        (("--duration", "1.6"), ("duration is 1.6; allowed is 1.737 s or more",)),
        (("--torque", "0"), ("--torque is 0.0; allowed is -5720 N·m to below 0",)),
        (("--torque", "572"), ("--torque is 572.0", "a load that drives it is not simulated")),
        (("--out", "report"), ("--reducer is missing", "rv40e, rv40e_xi2015, rv80e")),
    ],
)
def test_a_wrong_option_is_refused(options, words):
    named = () if "--out" in options else ("--reducer", "rv40e_xi2015")
    refused(tolalloc("simulate", *named, *options), *words)


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"speed_rpm": 0.0}, "speed_rpm is 0.0; allowed is a number above 0"),
        ({"duration": -1.0}, "duration is -1.0"),
        ({"step": 3.0}, "step is 3.0; allowed is 1e-05 s to the duration of 2 s"),
        ({"step": 0.45}, "step is 0.45; allowed is up to 0.00148 s, 4 steps per pin pass"),
        ({"step": 1e-7}, "step is 1e-07"),
        ({"torque_nm": -6000.0}, "torque_nm is -6000.0"),
        ({"damping": -1.0}, "damping is -1.0; allowed is 0 or a positive number"),
        ({"pin_stiffness": float("nan")}, "pin_stiffness is nan"),
        ({"reducer": "rv41e"}, "unknown name 'rv41e'"),
        ({"unit": "tabel4"}, "unknown name 'tabel4'; the nearest known is table4"),
    ],
)
def test_a_number_or_name_out_of_range_is_refused(option, words):
    with pytest.raises(TolallocError, match=re.escape(words)):
        prepare_simulation(SimulationRequest(**option))


@pytest.mark.slow
def test_a_missing_engine_is_said_in_one_sentence(tmp_path):
    (tmp_path / "exudyn.py").write_text("raise ImportError\n", encoding="utf-8")
    refused(process("simulate", "--engine", "exudyn", PYTHONPATH=str(tmp_path)), "pip install -e '.[multibody]'")
