"""What a terminal and a log show: no number is cut, and progress is seen in both."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from tests.golden.cases import OWN
from tolalloc.cli import console as lines
from tolalloc.cli.console import print_table
from tolalloc.reports.writer import written


@pytest.mark.parametrize("width", ["40", "80", "200"])
def test_no_number_is_cut_however_narrow_the_screen(capsys, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", width)
    names = [f"expected loss of the unit, kind {kind} [arcsec]" for kind in "abcdef"]
    numbers = [[1234.5 + 0.1 * row + column for column in range(len(names))] for row in range(3)]
    label = "a quantity with a name that is much longer than what a terminal of eighty columns has room for [arcsec]"
    frame = pd.DataFrame(numbers, columns=names)
    frame.insert(0, "quantity", [label, "b", "c"])
    frame[""] = ""
    print_table(frame, "wide")
    said = capsys.readouterr().out
    assert all(len(line) <= int(width) for line in said.splitlines())
    for row in numbers:
        for number in row:
            assert f"{number:.4g}" in said
    assert "…" not in said
    assert all(word in said for word in label.split())


def test_a_table_that_just_fits_is_not_cut(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    frame = pd.DataFrame(
        {
            "what": ["cost", "yield, all limits", "99.73% of peak-to-peak"],
            "unit": ["cost units", "%", "arcsec"],
            "before [unit]": [31.8, 80.86, 86.12],
            "after [unit]": [32.13, 80.47, 85.29],
            "change [unit]": [0.3333, -0.3906, -0.8345],
            "low 95 % [unit]": [float("nan"), -2.157, -0.9883],
            "high 95 % [unit]": [float("nan"), 1.421, -0.1123],
        }
    )
    print_table(frame, "What changes")
    said = capsys.readouterr().out
    assert all(len(line) <= 80 for line in said.splitlines())
    assert "−0.1123\n" in said and " 1.421\n" in said


def test_a_share_just_below_all_is_not_all_and_a_report_says_the_same_of_others(capsys):
    shares = (99.9966, 100.0, 99.9566, 98.9583)
    print_table(pd.DataFrame({"limit": list("abcd"), "yield [%]": shares, "cost [EUR]": shares}), "Yields")
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[-4:]]
    assert [row[1] for row in rows] == ["99.99", "100", "99.96", "98.96"]
    assert rows[0][2] == "100"
    assert [written(share, "%") for share in shares] == ["99.99", "100.0", "99.96", "98.96"]


def numbers_of(line: str) -> list[float]:
    return [float(text.replace(",", "")) for text in re.findall(r"\d[\d,]*(?:\.\d+)?", line)]


def test_a_log_has_lines_further_and_further_apart_and_one_for_each_stage(capsys, monkeypatch):
    """Of 8,000 units at 100 a second, 500 are done after 5 s and 75 s are left."""
    now = [0.0]
    monkeypatch.setattr(lines.time, "perf_counter", lambda: now[0])
    with lines.shown_progress() as progress:  # what is captured is no terminal
        for stage, units in (("random units", 8000), ("front", 0), ("nothing", 0), ("searches", 1)):
            progress.begin(stage, units)
            for _ in range(0 if stage == "nothing" else 40):
                now[0] += 1.0
                progress.advance(100)
    said = [line.partition(":") for line in capsys.readouterr().err.splitlines()]
    assert [line[0] for line in said] == [name for name in ("random units", "front", "searches") for _ in range(4)]
    open_end = [[5, 500, 100], [15, 1500, 100], [35, 3500, 100], [40, 4000, 100]]
    assert [numbers_of(line[2]) for line in said] == [
        [5, 500, 8000, 100, 75],
        [15, 1500, 8000, 100, 65],
        [35, 3500, 8000, 100, 45],
        [40, 4000, 100],
        *open_end * 2,  # where all that were expected are done, none are left
    ]


def test_a_log_has_lines_while_nothing_is_solved(capsys, monkeypatch):
    monkeypatch.setattr(lines, "_PAUSE", 0.01)
    with lines.Lines("units") as progress:
        progress.begin("compiling")
        assert any(capsys.readouterr().err or time.sleep(0.05) for _ in range(200))


def test_a_bar_is_full_only_when_its_stage_is_over(capsys):
    with lines.Bars("units") as bars:
        bars.begin("random units", 100)
        (task,) = bars._bar.tasks
        assert not numbers_of(task.fields["solved"])
        for units, share in ((40, 40.0), (60, 0.0), (10, 0.0)):  # beyond what was expected nobody knows the end
            bars.advance(units)
            assert not task.finished and task.percentage == share
        bars.begin("front")
        assert task.finished and not bars._bar.tasks[1].finished
    with pytest.raises(KeyboardInterrupt), lines.Bars("units") as bars:
        bars.begin("front")
        raise KeyboardInterrupt
    assert not bars._bar.tasks[0].finished
    assert "front" in capsys.readouterr().err


def test_a_bar_goes_on_behind_stages_that_were_too_short_to_be_shown(capsys):
    """rich numbers its stages on, and takes away what was too short; a later stage may solve more than expected."""
    with lines.Bars("units") as bars:
        for stage in ("binding", "reading"):
            bars.begin(stage)
        bars.begin("random units", 10)
        bars.advance(20)
        (task,) = [own for own in bars._bar.tasks if own.description == "random units"]
        assert task.completed == 20 and task.total is None


def test_a_stage_that_was_stopped_is_not_called_done(capsys):
    with pytest.raises(KeyboardInterrupt), lines.shown_progress() as progress:
        progress.begin("front")
        raise KeyboardInterrupt
    assert capsys.readouterr().err.startswith("front: stopped, ")


PROGRAM = """
import fcntl, json, os, pty, struct, sys, termios
from tolalloc.cli.main import main

width, said = int(sys.argv[1]), {}
for command in json.loads(sys.argv[2]):
    child, screen = pty.fork()
    if not child:
        fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 50, width, 0, 0))
        sys.argv = ["tolalloc", *command.split()]
        main()
    parts = []
    while True:
        try:
            part = os.read(screen, 65536)
        except OSError:  # the other side is closed
            break
        if not part:
            break
        parts.append(part)
    os.waitpid(child, 0)
    said[command] = b"".join(parts).decode()
print(json.dumps(said))
"""
ON_SCREEN = (
    *("--help", "run --help", "check own.py", "whatif own.py shaft=0.02", "run own.py --out run"),
    *("new mine --cranks 3", "te --reducer rv21e", "te --reducer rv20e"),
)
"""Commands that speak to a person; the study has a small effort of its own."""
ESCAPES = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")
FRAMES = re.compile(r"[\u2500-\u257f]")


WIDTH = 60


def on_screen(width: int, folder: Path) -> dict[str, str]:
    """Return what stays of every command on a screen of so many columns."""
    folder.mkdir()
    (folder / "own.py").write_text(OWN, encoding="utf-8")
    program = [sys.executable, "-c", PROGRAM, str(width), json.dumps(ON_SCREEN)]
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    result = subprocess.run(program, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return {command: kept(text) for command, text in json.loads(result.stdout).items()}


def kept(text: str) -> str:
    """Return the lines that moving bars do not write over."""
    written = (ESCAPES.sub("", line.split("\r")[-1]) for line in text.replace("\r\n", "\n").split("\n"))
    return "\n".join(line for line in written if not re.search(r"\d:\d\d:\d\d", line))


def words_of(text: str) -> set[str]:
    return set(re.sub(r"\d+\.\d+ s\b", "", FRAMES.sub(" ", text)).split())


@pytest.mark.slow
def test_no_command_writes_beyond_the_screen_or_cuts_a_word(tmp_path):
    wide, narrow = (on_screen(width, tmp_path / str(width)) for width in (400, WIDTH))
    for command, text in narrow.items():
        assert "Traceback" not in text, text
        # A word that is wider than the screen, such as a path, stands whole on a line of its own.
        assert not [line for line in text.splitlines() if len(line.rstrip()) > WIDTH and len(line.split()) > 1]
        assert words_of(wide[command]) <= words_of(text), command
