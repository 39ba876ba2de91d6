"""Every study that is shipped runs, quickly, from its script to its report."""

from __future__ import annotations

import json

import pytest

from tests.studies.command import ROOT, process

STUDIES = sorted((ROOT / "studies").glob("*.py"))


def _no_number(constant):
    raise AssertionError(f"{constant} is no number")


@pytest.mark.slow
@pytest.mark.parametrize("script", STUDIES, ids=lambda path: path.stem)
def test_a_study_runs_and_writes_its_report(script, tmp_path):
    folder = tmp_path / "run"
    result = process("run", script, "--quick", "--out", folder)
    assert result.returncode == 0, result.stderr
    assert (folder / "report.html").stat().st_size > 0
    json.loads((folder / "summary.json").read_text(encoding="utf-8"), parse_constant=_no_number)
