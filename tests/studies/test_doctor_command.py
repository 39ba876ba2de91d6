"""``tolalloc doctor``: what it runs on, and a self-test that would notice wrong numbers."""

from __future__ import annotations

from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.cli import doctor


def test_the_doctor_tells_what_it_runs_on_and_solves_a_published_unit():
    found = answer_of("doctor")
    assert abs(found["self-test [arcsec]"] - 96.629) < 1e-3
    assert {"tolalloc", "numpy", "python"} <= set(found["versions"])
    assert found["threads"] >= 1
    assert found["BLAS"].startswith(("openblas ", "mkl ", "blis ", "none"))
    said = tolalloc("doctor")
    assert said.returncode == 0
    assert said.stdout.splitlines()[-1].startswith("All is well")


def test_wrong_numbers_are_noticed(monkeypatch):
    monkeypatch.setattr(doctor, "_KNOWN", 96.7)
    refused(tolalloc("doctor"), "do not trust this installation")
