"""Fields of a study of the wrong kind, and terminals, disks and environments that are not as usual: one sentence."""

from __future__ import annotations

import errno
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pandas as pd
import pytest
from openpyxl import load_workbook

import tolalloc as ta
from tests.builders import wording
from tests.studies.command import refused, tolalloc
from tests.studies.scripts import study_script
from tolalloc.cli.console import Bars, Lines, print_table
from tolalloc.cli.main import main
from tolalloc.drawings.drawing import Drawing
from tolalloc.reports.excel import Formula, write_sheets
from tolalloc.reports.writer import write_csv
from tolalloc.study.script import load_study


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"reducer": {"neglected": "disc*"}}, "neglected is 'disc*'; allowed is a list of names"),
        ({"reducer": {"neglected": (1,)}}, "neglected is (1,)"),
        ({"reducer": {"flank_clearance": ("1", "2")}}, "flank_clearance is ('1', '2')"),
        ({"limits": "{5: ta.Limit(upper=60.0)}"}, "limits is {5:"),
        ({"name": 5}, "study: name is 5"),
        ({"name": "x" * 101}, "study: name is 'x"),
        ({"seed": 1.5}, "seed is 1.5"),
        ({"limits": "{ta.PEAK_TO_PEAK: ta.Limit(upper=10**400)}"}, "limit: upper is 1000"),
        ({"written": "effort=ta.Effort(is_quick='no')"}, "effort: is_quick is 'no'"),
        ({"written": "effort=ta.Effort(ranking=5)"}, "effort: ranking is 5"),
        ({"written": "questions=[ta.Difference(zones={'pin.diameter': '3'})]"}, "question difference: zones is"),
        ({"written": "questions=[ta.Allocation(unit_price=0)]"}, "unit_price is 0"),
    ],
)
def test_fields_of_the_wrong_kind_are_refused(fields, words, tmp_path):
    refused(tolalloc("check", study_script(tmp_path, **fields)), words)


@pytest.fixture
def calculation(tmp_path):
    script = tmp_path / "s.py"
    script.write_text("import tolalloc as ta\nstudy = ta.Study(questions=[ta.Calculation(print)], name='µ')\n")
    return script


def test_check_says_that_a_study_is_a_program_that_it_runs(calculation):
    result = tolalloc("check", calculation)
    assert result.returncode == 0
    assert wording("check.program", script=calculation) in result.stdout


def test_names_are_shown_as_they_are_and_never_as_markup(capsys):
    print_table(pd.DataFrame({"[/a]": ["[/b]" * 8]}), "[red]s[bold].csv")
    shown = capsys.readouterr().out
    assert all(text in shown for text in ("[/a]", "[/b]", "[red]s[bold].csv"))
    for shown in (Bars("units"), Lines("units")):
        with shown as progress:
            progress.begin("[/c]")
            progress.advance(1)
        assert "[/c]" in capsys.readouterr().err


def test_output_that_is_not_utf_8_shows_a_question_mark(calculation):
    stdout = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    with (
        mock.patch.object(sys, "stdout", stdout),
        mock.patch.object(sys, "argv", ["tolalloc", "check", str(calculation), "--json"]),
        pytest.raises(SystemExit) as stop,
    ):
        main()
    assert not stop.value.code
    assert b'"study": "?"' in stdout.buffer.getvalue()


@pytest.mark.slow
def test_a_command_ends_well_where_all_its_streams_are_closed(tmp_path):
    words = [sys.executable, "-c", "from tolalloc.cli.main import main; main()", "new", str(tmp_path / "mine")]
    shell = ["sh", "-c", '"$@" <&- >&- 2>&-', "sh", *words]
    assert subprocess.run(shell, check=False).returncode == 0
    assert (tmp_path / "mine" / "study.py").is_file()
    assert subprocess.run(shell, check=False).returncode == 2  # the folder is there now


def test_what_numpy_does_at_a_rounding_stays_as_a_study_found_it(tmp_path):
    script = study_script(tmp_path)
    script.write_text(f"import numpy\nnumpy.seterr(all='raise')\n{script.read_text()}")
    before = np.geterr()
    load_study(script)
    assert np.geterr() == before != dict.fromkeys(before, "raise")


@pytest.mark.slow
def test_what_a_script_prints_is_no_part_of_an_answer_to_a_program(tmp_path):
    script = study_script(tmp_path)
    script.write_text(f"print('mine')\n{script.read_text()}")
    found = tolalloc("check", script, "--json")
    assert found.returncode == 0
    assert json.loads(found.stdout)["study"]
    assert "mine" in found.stderr
    assert tolalloc("check", script).stdout.startswith("mine\n")


@pytest.mark.parametrize("other", [Path.mkdir, os.mkfifo], ids=("folder", "pipe"))
def test_what_is_no_file_is_said_to_be_there(tmp_path, other):
    other(tmp_path / "mine.toml")
    refused(tolalloc("te", "--reducer", tmp_path / "mine.toml"), "mine.toml: is a folder, a device or a pipe; allowed")
    refused(tolalloc("te", "--reducer", tmp_path / "other.toml"), "other.toml: no such file; shipped reducer files are")


def test_a_full_disk_is_one_sentence(calculation):
    full = OSError(errno.ENOSPC, "No space left on device", "out.csv")
    with mock.patch("tolalloc.cli.studies.say", side_effect=full):
        refused(tolalloc("check", calculation), "out.csv: cannot be read or written (No space left on device).")


@pytest.mark.parametrize("threads", ["0", "x", "-1", "1_0"])
def test_a_number_of_threads_that_numba_cannot_use_is_refused(threads):
    refused(tolalloc("--version", NUMBA_NUM_THREADS=threads), f"NUMBA_NUM_THREADS is {threads!r}; allowed is a whole")


def test_a_clock_before_the_first_day_of_a_workbook_is_refused():
    with mock.patch("tolalloc.cli.main.time.strftime", return_value="1970-01-01"):
        refused(tolalloc("--version"), "clock is '1970-01-01'; allowed is 1980-01-01 or later")


TEXTS = ("=1+1", "+cmd", "-cmd", "@sum", "plain", "-1.5")


def test_text_never_becomes_a_formula_of_a_workbook(tmp_path):
    frame = pd.DataFrame({"=header": [*TEXTS, "\x01x"], "ours": [Formula("=1+1")] * 7})
    write_sheets({"s": frame}, tmp_path / "w.xlsx")
    sheet = load_workbook(tmp_path / "w.xlsx")["s"]
    assert [cell.data_type for cell in sheet["A"]] == ["s"] * 8
    assert [cell.value for cell in sheet["A"]] == ["=header", *TEXTS, "\ufffdx"]
    assert {cell.data_type for cell in sheet["B"][1:]} == {"f"}


def test_text_never_becomes_a_formula_of_a_csv_and_is_read_back(tmp_path):
    write_csv(pd.DataFrame({"a": TEXTS, "b": -1.5}), tmp_path / "t.csv")
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines == ["a,b", "'=1+1,-1.5", "'+cmd,-1.5", "'-cmd,-1.5", "'@sum,-1.5", "plain,-1.5", "-1.5,-1.5"]
    zone = {"plus": 1, "minus": -1, "unit": "µm", "min": 1, "max": 5, "cost": 1}
    drawing = Drawing.of_rows([{"id": "=1+1", "note": "@x", **zone}])
    assert ",@x" not in drawing.to_csv(tmp_path / "d.csv").read_text()
    assert ta.drawing(tmp_path / "d.csv").sources == drawing.sources
