"""The answers of a processor with fewer features: what is promised beyond one kind of processor."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

SOLVED = """
import sys
import numpy as np
import tolalloc as ta
from tolalloc.running.compiled import processor
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

found = {}
for name in ("rv20e_liu2020", "rv20e"):
    reducer = ta.reducer(name, flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0))
    limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}
    known = Prepared(study=ta.Study(reducer, ta.drawing("rv20e_table4"), limits=limits, questions=[ta.Ranking()]))
    uniform = next(SeedTree(5).uniform_chunks(64, len(known.errors.columns)))
    deviations = known.errors.deviations(known.errors.standard_values(uniform), known.errors.zones)
    values = known.model.reading((ta.PEAK_TO_PEAK, ta.LOST_MOTION))(deviations).values
    assert np.isfinite(values).all()
    found |= {f"{name} deviations": deviations, f"{name} values": values}
np.savez(sys.argv[1], processor=list(processor().values())[1:], **found)
"""
FEWER = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "+sse2"}
NUMPY = np.show_config(mode="dicts")["SIMD Extensions"]
FEWER_OF_NUMPY = {"NPY_DISABLE_CPU_FEATURES": " ".join(NUMPY.get("found", []))}


def solved(file: Path, **features: str) -> Mapping[str, np.ndarray]:
    """Return what a fresh process draws and solves."""
    subprocess.run([sys.executable, "-c", SOLVED, file], check=True, env={**os.environ, **features})
    return np.load(file)


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names features of one kind of processor")
def test_a_processor_without_wide_registers_draws_the_same_units_and_answers_alike(tmp_path):
    """128 random units. The kernel itself keeps its bits; NumPy's sin, cos and exp, which prepare it, do not."""
    native = solved(tmp_path / "native.npz")
    narrow = solved(tmp_path / "narrow.npz", **FEWER)
    oldest = solved(tmp_path / "oldest.npz", **FEWER, **FEWER_OF_NUMPY)
    assert len({tuple(own["processor"]) for own in (native, narrow, oldest)}) == 3
    for name in native.keys() - {"processor"}:
        np.testing.assert_array_equal(narrow[name], native[name])
        np.testing.assert_allclose(oldest[name], native[name], rtol=0 if "deviations" in name else 1e-12)
