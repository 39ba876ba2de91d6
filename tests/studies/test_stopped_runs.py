"""Runs that are stopped: nothing half is left, what was solved is kept, and the same command ends in the same bits."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.studies.command import ROOT, command, process, tolalloc
from tests.studies.test_allocate_command import script_with
from tolalloc.cli.console import Lines
from tolalloc.reports import writer
from tolalloc.reports.folder import claimed, numbered
from tolalloc.running import result_cache as kept_units

COMPARED = ("summary.json", "allocation.csv", "tables/drawing.csv", "tables/front.csv")
KEPT = ".tolalloc-units"


def left(folder: Path) -> set[str]:
    """Return what stands beside a run folder."""
    return {path.name for path in folder.iterdir()}


def stopped_after(monkeypatch, units: int) -> None:
    """Press Ctrl-C once so many units are done."""
    done, advance = [0], Lines.advance

    def advanced(progress: Lines, count: int) -> None:
        done[0] += count
        if done[0] >= units:
            raise KeyboardInterrupt
        advance(progress, count)

    monkeypatch.setattr(Lines, "advance", advanced)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("worth", "words"), [(0.0, "the same command continues from there."), (np.inf, "Nothing was kept.")]
)
def test_ctrl_c_is_a_sentence_that_says_what_is_kept(tmp_path, monkeypatch, worth, words):
    script, runs = script_with(tmp_path, asked="fixed_first=False, front=False, what_if=False"), tmp_path / "runs"
    monkeypatch.setattr(kept_units, "_WORTH", worth)
    stopped_after(monkeypatch, 100)
    result = tolalloc("allocate", script, "--out", runs / "one")
    assert result.returncode == 130
    assert "Traceback" not in result.stderr
    said = " ".join(result.stderr.split())
    assert "Stopped: no report was written." in said
    assert said.endswith(words)
    assert left(runs) == ({KEPT} if worth == 0.0 else set())


@pytest.mark.slow
@pytest.mark.parametrize("existing", [False, True])
def test_a_report_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch, existing):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "results.xlsx")

    folder = tmp_path / "runs" / "report"
    if existing:
        folder.mkdir(parents=True)
    monkeypatch.setattr(writer, "write_sheets", full)
    result = tolalloc("te", "--reducer", "rv20e_liu2020", "--out", folder)
    assert result.returncode == 2
    assert "results.xlsx: cannot be read or written (No space left on device)." in result.stderr
    assert left(tmp_path / "runs") == ({"report"} if existing else set())
    assert not existing or not left(folder)


@pytest.mark.slow
def test_a_report_fills_an_empty_folder_that_stands_there(tmp_path):
    (tmp_path / "mine").mkdir()
    result = tolalloc("te", "--reducer", "rv20e_liu2020", "--out", tmp_path / "mine")
    assert result.returncode == 0, result.stderr
    assert {"report.html", "manifest.json"} <= left(tmp_path / "mine")
    assert left(tmp_path) == {"mine"}


def test_a_run_folder_stays_where_it_was_asked_for_when_work_goes_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with claimed(Path("mine")) as folder:
        (folder / "report.html").touch()
        monkeypatch.chdir("/")
    assert left(tmp_path) == {"mine"}
    assert left(tmp_path / "mine") == {"report.html"}


def test_a_run_whose_empty_folder_is_cleared_away_is_not_lost(tmp_path):
    with claimed(tmp_path / "mine") as folder:
        (folder / "report.html").touch()
        (tmp_path / "mine").rmdir()
    assert left(tmp_path / "mine") == {"report.html"}


def test_a_disk_that_fills_while_a_folder_is_moved_to_it_holds_no_half_of_it(tmp_path, monkeypatch):
    def filled(source: Path, target: Path) -> None:
        if source.name == "tables":
            target.mkdir()
            (target / "half.csv").touch()
            raise shutil.Error([(str(source), str(target), "[Errno 28] No space left on device")])
        shutil.move(source, target)

    (tmp_path / "disk").mkdir()
    monkeypatch.setattr("tolalloc.reports.folder.move", filled)
    with pytest.raises(OSError, match="No space left on device") as caught, claimed(tmp_path / "disk") as folder:
        (folder / "tables").mkdir()
        (folder / "report.html").touch()
    assert caught.value.filename == str(tmp_path / "disk")
    assert left(tmp_path) == {"disk"}
    assert left(tmp_path / "disk") == set()


def test_a_writer_keeps_its_folder_and_what_a_killed_one_left_is_cleared_by_the_next_one(tmp_path):
    writing = f"""
from pathlib import Path
from tolalloc.reports.folder import claimed, numbered
with claimed(Path({str(tmp_path / "mine")!r})) as folder:
    (folder / "report.html").write_text("half")
    print("writing", flush=True)
    input()
"""
    words = [sys.executable, "-c", writing]
    with subprocess.Popen(words, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout.readline() == "writing\n"
        assert numbered(tmp_path / "mine")[-1] == tmp_path / "mine-2"  # who names no folder gets another one
        with claimed(tmp_path / "mine") as other:  # the first writer lives, so what it has stays
            (other / "whole").touch()
            assert len(left(tmp_path)) == 3
        running.kill()
    (tmp_path / "mine" / "whole").unlink()
    assert numbered(tmp_path / "mine") == [tmp_path / "mine"]
    assert len(left(tmp_path)) == 2
    with claimed(tmp_path / "mine"):
        assert len(left(tmp_path)) == 2
    assert left(tmp_path) == {"mine"}


@pytest.mark.slow
@pytest.mark.parametrize(("words", "kills"), [(("allocate",), 3), (("rank", "--quick"), 1)])
def test_a_run_killed_at_any_moment_goes_on_to_the_same_bits(tmp_path, words, kills):
    """Kills in one run, the last of them anywhere, then an end; against a run of one piece."""
    asked = "fixed_first=False, what_if=False), ta.Ranking("
    script, runs = script_with(tmp_path, asked=asked), tmp_path / "runs"
    start = time.monotonic()
    whole = process(*words, script, "--fresh", "--out", tmp_path / "elsewhere" / "whole")
    lasts = time.monotonic() - start
    assert whole.returncode == 0, whole.stderr
    for share in np.sort(np.random.default_rng(20261123).uniform(0.2, 1.0, kills)):
        killed(command(*words, script, "--out", runs / "one"), after=share * lasts)
        assert not (runs / "one" / "manifest.json").exists() or (runs / "one" / "report.html").exists()
        if (runs / "one" / "manifest.json").exists():
            break
    else:
        again = process(*words, script, "--out", runs / "one")
        assert again.returncode == 0, again.stderr
    for name in COMPARED:
        expected = tmp_path / "elsewhere" / "whole" / name
        assert not expected.exists() or (runs / "one" / name).read_bytes() == expected.read_bytes()


def killed(words: list[str], *, after: float) -> None:
    """Run a command in a process and kill it after a time [s], unless it has ended by then."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(words, cwd=ROOT, env=dict(os.environ), **quiet) as running:
        try:
            running.wait(after)
        except subprocess.TimeoutExpired:
            running.send_signal(signal.SIGKILL)
