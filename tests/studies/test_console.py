"""What a terminal and a log show: no number is cut, and progress is seen in both."""

from __future__ import annotations

import re
import time

import pandas as pd
import pytest

from tolalloc.cli import console as lines
from tolalloc.cli.console import print_table


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
    assert all(
        len(line) <= int(width) and (line.rstrip()[-1] in "┓┃┩│┘" or "wide" in line) for line in said.splitlines()
    )
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
    assert "−0.1123 │" in said and "1.421 │" in said


def numbers_of(line: str) -> list[float]:
    return [float(text.replace(",", "")) for text in re.findall(r"\d[\d,]*(?:\.\d+)?", line)]


def test_a_log_has_a_line_every_few_seconds_and_one_for_each_stage(capsys, monkeypatch):
    """Of 4,000 units at 100 a second, 500 are done after 5 s and 35 s are left."""
    now = [0.0]
    monkeypatch.setattr(lines.time, "perf_counter", lambda: now[0])
    with lines.shown_progress() as progress:  # what is captured is no terminal
        for stage, units in (("random units", 4000), ("front", 0), ("nothing", 0), ("searches", 1)):
            progress.begin(stage, units)
            for _ in range(0 if stage == "nothing" else 12):
                now[0] += 1.0
                progress.advance(100)
    said = [line.partition(":") for line in capsys.readouterr().err.splitlines()]
    assert [line[0] for line in said] == [name for name in ("random units", "front", "searches") for _ in range(3)]
    assert [numbers_of(line[2]) for line in said] == [
        [5, 500, 4000, 100, 35],
        [10, 1000, 4000, 100, 30],
        [12, 1200, 100],
        *[[5, 500, 100], [10, 1000, 100], [12, 1200, 100]] * 2,  # where all that were expected are done, none are left
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


def test_a_stage_that_was_stopped_is_not_called_done(capsys):
    with pytest.raises(KeyboardInterrupt), lines.shown_progress() as progress:
        progress.begin("front")
        raise KeyboardInterrupt
    assert capsys.readouterr().err.startswith("front: stopped, ")
