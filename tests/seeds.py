"""Seeds of tests: the first ones in the default run, all of them in the full gate."""

from __future__ import annotations

import pytest

QUICK = 20


def seeds(count: int, quick: int = QUICK) -> list[object]:
    """Return the seeds 0 … count − 1, those from ``quick`` on marked slow."""
    return [seed if seed < quick else pytest.param(seed, marks=pytest.mark.slow) for seed in range(count)]
