"""What a terminal and a log show: no number is cut, and progress is seen in both."""

from __future__ import annotations

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


def test_a_log_has_a_line_every_few_seconds_and_one_for_each_stage(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(lines.time, "perf_counter", lambda: now[0])
    with lines.shown_progress() as progress:  # what is captured is no terminal
        for stage in ("random units", "front"):
            progress.begin(stage)
            for _ in range(12):
                now[0] += 1.0
                progress.advance(100)
    assert capsys.readouterr().err.splitlines() == [
        "random units: so far, 500 units in 5.0 s, 100 units/s",
        "random units: so far, 1000 units in 10.0 s, 100 units/s",
        "random units: done, 1200 units in 12.0 s, 100 units/s",
        "front: so far, 500 units in 5.0 s, 100 units/s",
        "front: so far, 1000 units in 10.0 s, 100 units/s",
        "front: done, 1200 units in 12.0 s, 100 units/s",
    ]


def test_a_stage_that_was_stopped_is_not_called_done(capsys):
    with pytest.raises(KeyboardInterrupt), lines.shown_progress() as progress:
        progress.begin("front")
        raise KeyboardInterrupt
    assert capsys.readouterr().err.startswith("front: stopped, ")
