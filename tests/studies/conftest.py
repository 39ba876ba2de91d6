"""Simulated benches that several test files read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.studies.bench_files import CURVES_AND_LOOPS, PEAK_TO_PEAKS, simulated


@pytest.fixture(scope="session")
def curves(tmp_path_factory) -> Path:
    """Six units, a curve and a loop of each."""
    return simulated(CURVES_AND_LOOPS, 6, tmp_path_factory.mktemp("data") / "curves")


@pytest.fixture(scope="session")
def peak_to_peaks(tmp_path_factory) -> Path:
    """Three units, nothing but a peak-to-peak of each."""
    return simulated(PEAK_TO_PEAKS, 3, tmp_path_factory.mktemp("data") / "peak_to_peaks")
