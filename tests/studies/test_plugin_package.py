"""A package beside this one, with a family, an output, a question, a model and an export, changes no line here."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.studies.command import ROOT, WIDTH

PACKAGE = ROOT / "tests" / "plugins" / "arm_joint"
STUDY = """
import tolalloc as ta

RMS = "rms transmission error [arcsec]"
study = ta.Study(
    ta.reducer("reducer.toml", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
    ta.drawing("zones.csv"),
    limits={
        ta.PEAK_TO_PEAK: ta.Limit(upper=110.0, show=ta.AtYield(0.9)),
        RMS: ta.Limit(upper=40.0, show=ta.AtYield(0.9)),
    },
    questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False, fixed_first=False)],
    name="arm",
    effort=ta.Effort(
        ranking=ta.RankingEffort(
            units=1000, sobol=ta.SobolEffort(start=16, limit=16, resamples=50),
            derivative_units=10, inverse_units=1, surrogate_units=96, level_units=100, level_runs=2, widened_units=100,
            permutations=2),
        allocation=ta.AllocationEffort(
            verification_units=2**8, confirmation_units=2**9, share_blocks=8, search=ta.SearchEffort(steps=2)),
        is_quick=True,
    ),
)
"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """Install the package into a folder of its own, and return what runs Python with it in another folder."""
    site, place = tmp_path_factory.mktemp("site"), tmp_path_factory.mktemp("place")
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-index", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--disable-pip-version-check", "--target", str(site), str(PACKAGE)], check=True)

    def run(*words: str, folder: str = "") -> subprocess.CompletedProcess[str]:
        paths = os.pathsep.join(map(str, (ROOT, site)))
        return subprocess.run(
            [sys.executable, "-m", *words],
            cwd=place / folder,
            env={**os.environ, "PYTHONPATH": paths, "COLUMNS": WIDTH},
            capture_output=True,
            text=True,
        )

    run.place = place
    return run


def said(done: subprocess.CompletedProcess[str]) -> str:
    """Return what a command says that is not refused."""
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_its_family_is_checked_ranked_and_allocated(arm):
    assert "rv-in-arm: arm20." in said(arm("tolalloc.cli.main", "new", "--help"))
    assert "like arm20; 26 sources" in said(arm("tolalloc.cli.main", "new", "mine", "--family", "rv-in-arm"))
    (arm.place / "mine" / "study.py").write_text(STUDY, "utf-8")
    assert "arm.assembly: 12 µm" in said(arm("tolalloc.cli.main", "check", "study.py", folder="mine"))
    ran = arm("tolalloc.cli.main", "run", "study.py", "--out", "run", folder="mine")
    said(ran)
    assert "left out" not in ran.stderr
    folder = arm.place / "mine" / "run"
    summary, manifest = (json.loads((folder / f"{name}.json").read_text("utf-8")) for name in ("summary", "manifest"))
    assert summary["allocation"]["met"]
    assert "arm assembly" in (folder / "tables" / "dimensions.csv").read_text("utf-8")
    assert manifest["versions"]["arm-joint"] == "0.1"
    assert "arm.assembly" in (folder / "arm.zones").read_text("utf-8")
    assert not [*(arm.place / "mine").glob(".tolalloc-units/*")]
    spread = said(arm("tolalloc.cli.main", "run", "study.py", "--only", "spread", "--out", "spread", folder="mine"))
    assert "rms transmission error [arcsec]: " in spread


@pytest.mark.slow
def test_it_passes_the_tests_that_it_inherits(arm):
    assert "[100%]" in said(arm("pytest", "-q", "-p", "no:cacheprovider", str(PACKAGE / "conformance.py")))
