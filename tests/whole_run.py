"""The last whole run of the gate: its commit, what its slow tests took and which of them failed.

As a plugin of pytest, ``-p tests.whole_run``, it writes that down when all of them have run. What failed stands there
by its id, and every push runs it until the next whole run: a fault that is mended does not ask for the whole run again.
"""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import asdict, dataclass, field
from datetime import date
from pathlib import Path

import pytest

from tests.import_graph import ROOT

FILE = ROOT / ".ci" / "whole_run.json"
LONG = 10.0
"""What a test takes that is written down by its own id and not with the mean of its function [s]."""


@dataclass(frozen=True, kw_only=True)
class WholeRun:
    """One whole run of the gate.

    Parameters
    ----------
    commit
        What was tested.
    date
        On which day, YYYY-MM-DD.
    minutes
        How long all of it took [min].
    processor
        On what, and how many cores it had.
    tests
        Slow tests that ran [-].
    seconds
        Test, or function of tests that take less than ten seconds → what one takes [s].
    setups
        File → what its fixtures take, whichever of its tests is first [s].
    failed
        Ids of the tests that failed.
    """

    commit: str
    date: str
    minutes: float
    processor: str
    tests: int
    seconds: dict[str, float]
    setups: dict[str, float] = field(default_factory=dict)
    failed: tuple[str, ...] = ()

    def taken_by(self, test: str) -> float | None:
        """Return what a test takes [s], or None where it is new."""
        return self.seconds.get(test, self.seconds.get(function_of(test)))


def function_of(test: str) -> str:
    """Return the id of a test without its parameters."""
    return test.partition("[")[0]


def git(*words: str) -> str | None:
    """Return what git says, or None where it refuses."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    return None if done.returncode else done.stdout.strip()


def last_whole_run() -> WholeRun | None:
    """Return the last whole run that was written down."""
    return WholeRun(**json.loads(FILE.read_text(encoding="utf-8"))) if FILE.is_file() else None


def summed_up(taken: dict[str, float]) -> dict[str, float]:
    """Return what long tests took by their ids, and the mean of the others by their functions [s]."""
    short = defaultdict(list)
    for test, seconds in taken.items():
        if seconds <= LONG:
            short[function_of(test)].append(seconds)
    means = {name: round(sum(own) / len(own), 1) for name, own in short.items()}
    return dict(sorted({**means, **{test: round(own, 1) for test, own in taken.items() if own > LONG}}.items()))


def processor() -> str:
    """Return the processor's name and the number of its cores."""
    facts = Path("/proc/cpuinfo")
    said = re.search(r"model name\s*: (.+)", facts.read_text(encoding="utf-8")) if facts.is_file() else None
    return f"{said[1] if said else platform.processor()}, {os.cpu_count()} cores"


_taken: dict[str, float] = defaultdict(float)
_setups: dict[str, float] = defaultdict(float)
_failed: set[str] = set()
_began = time.time()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add what calling or clearing away took, keep the longest setting up of a file, and what failed."""
    if report.failed:
        _failed.add(report.nodeid)
    if report.when == "setup":
        file = report.nodeid.partition("::")[0]
        _setups[file] = max(_setups[file], round(report.duration, 1))
    else:
        _taken[report.nodeid] += report.duration


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Write the run down if it came to its end and the commit is what was tested."""
    ended = exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)
    if "PYTEST_XDIST_WORKER" in os.environ or not ended:
        return
    if git("status", "--porcelain"):
        sys.stderr.write("\nThis whole run is not written down: the tree differs from its commit.\n")
        return
    began = float(os.environ.get("TOLALLOC_GATE_BEGAN") or _began)
    run = WholeRun(
        commit=git("rev-parse", "HEAD") or "",
        date=date.today().isoformat(),
        minutes=round((time.time() - began) / 60, 1),
        processor=processor(),
        tests=len(_taken),
        seconds=summed_up(_taken),
        setups=dict(sorted(_setups.items())),
        failed=tuple(sorted(_failed)),
    )
    FILE.write_text(json.dumps(asdict(run), indent=1) + "\n", encoding="utf-8")
    sys.stderr.write(f"\nThis whole run is written down in {FILE.relative_to(ROOT)}: commit it.\n")
