"""Units that were solved are found again, damaged or foreign files are solved again, and bits stay the same."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.builders import baseline_errors, kernel_of, units_at_random
from tests.studies.command import ROOT
from tolalloc.models.model import Evaluation
from tolalloc.reducers import LOST_MOTION, RADIAL_CLEARANCE
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.running import result_cache as kept_units
from tolalloc.running.result_cache import ResultCache

ERRORS = baseline_errors()
UNITS = 24


class Solved:
    """Counts the chunks that are truly solved."""

    def __init__(self, monkeypatch) -> None:
        self.chunks = 0
        for name in ("extremes", "peak_to_peak_derivatives"):
            monkeypatch.setattr(EquivalentModel, name, self._counting(getattr(EquivalentModel, name)))

    def _counting(self, solve):
        def counting(model, errors, torque):
            self.chunks += 1
            return solve(model, errors, torque)

        return counting


@pytest.fixture
def solved(monkeypatch) -> Solved:
    monkeypatch.setattr(kept_units, "_WORTH", 0.0)
    return Solved(monkeypatch)


@pytest.fixture
def model() -> ReducerModel:
    equivalent = EquivalentModel(load_reducer("rv20e_liu2020"), AngleSearch(coarse=24))
    return ReducerModel(kernel=kernel_of(equivalent, ERRORS, -1.0))


@pytest.fixture
def x() -> np.ndarray:
    return units_at_random(ERRORS, UNITS, 20261123)


def test_what_was_solved_is_not_solved_again(model, x, solved, tmp_path):
    alone = model.kernel(x)
    kept = model.mapped(ResultCache(folder=tmp_path)).kernel
    assert solved.chunks == 1
    for _ in range(3):
        found = kept(x)
        np.testing.assert_array_equal(found.values, alone.values)
        np.testing.assert_array_equal(found.status, alone.status)
    assert solved.chunks == 2


def test_derivatives_and_other_outputs_are_kept_too(model, x, solved, tmp_path):
    kept = model.mapped(ResultCache(folder=tmp_path))
    first, before = kept.kernel.with_derivatives(x), solved.chunks
    again = kept.kernel.with_derivatives(x)
    assert solved.chunks == before
    np.testing.assert_array_equal(first.by_column, again.by_column)
    for name, own in first.by_stiffness.items():
        np.testing.assert_array_equal(own, again.by_stiffness[name])
    outputs = kept.reading((LOST_MOTION, RADIAL_CLEARANCE))
    np.testing.assert_array_equal(outputs(x).values, outputs(x).values)
    assert len(list(tmp_path.glob("*.units"))) == 2


def test_another_question_has_another_answer(model, x, solved, tmp_path):
    kept = model.mapped(ResultCache(folder=tmp_path)).kernel
    other = replace(model.reducer, stiffness=replace(model.reducer.stiffness, pin_contact=1e8))
    questions = (
        (kept, x),
        (replace(kept, torque=-2.0), x),
        (kept, x[:-1]),
        (kept, -x),
        (replace(kept, fixed={**kept.fixed, "modification.shift": 1e-6}), x),
        (replace(kept, model=EquivalentModel(other, kept.model.search)), x),
    )
    for response, deviations in questions:
        response(deviations)
    assert solved.chunks == len(questions) == len(list(tmp_path.glob("*.units")))


@pytest.mark.parametrize("damage", ["cut", "bits", "empty", "foreign", "nothing"])
def test_a_damaged_or_foreign_file_is_solved_again(model, x, solved, tmp_path, damage):
    kept = model.mapped(ResultCache(folder=tmp_path)).kernel
    right = kept(x)
    (path,) = tmp_path.glob("*.units")
    content = path.read_bytes()
    if damage == "cut":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "bits":
        at = len(content) // 3
        path.write_bytes(content[:at] + bytes(byte ^ 0xFF for byte in content[at : at + 64]) + content[at + 64 :])
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "foreign":
        kept(2 * x)
        (other,) = set(tmp_path.glob("*.units")) - {path}
        path.write_bytes(other.read_bytes())
    before = solved.chunks
    np.testing.assert_array_equal(kept(x).values, right.values)
    assert solved.chunks - before == (damage != "nothing")


def test_the_oldest_files_go_where_there_are_too_many(model, x, solved, tmp_path):
    kept = model.mapped(ResultCache(folder=tmp_path)).kernel
    for age, factor in enumerate((1.0, 2.0, 3.0)):
        known = set(tmp_path.glob("*.units"))
        kept(factor * x)
        (new,) = set(tmp_path.glob("*.units")) - known
        os.utime(new, (1000.0 + age, 1000.0 + age))
    size = new.stat().st_size
    ResultCache(folder=tmp_path, largest=2 * size + size // 2).pruned()
    assert len(list(tmp_path.glob("*.units"))) == 2
    kept(3.0 * x), kept(2.0 * x)
    assert solved.chunks == 3
    kept(1.0 * x)
    assert solved.chunks == 4


def test_a_full_disk_leaves_no_half_file(model, x, solved, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fdopen", full)
    with pytest.raises(OSError, match="No space left"):
        model.mapped(ResultCache(folder=tmp_path)).kernel(x)
    assert not list(tmp_path.iterdir())
    assert solved.chunks == 1


WRITTEN = """
import numpy as np
import tolalloc as ta
from tolalloc.running.result_cache import _digest
from tolalloc.reducers import LOST_MOTION

drawing = ta.drawing("rv20e_table4")
model = ta.reducer("rv20e", neglected=("*",)).bound(drawing.errors, "digest")
alone, chunk = model.kernel.alone, np.zeros((2, 3))
for solve in (alone._peak_to_peak, alone._derivatives, model.reading((LOST_MOTION,)).alone.read):
    print(_digest(solve, chunk))
"""


@pytest.mark.slow
def test_every_process_looks_for_the_same_files():
    """Sets of names come in another order in each process."""
    said = [
        subprocess.run(
            [sys.executable, "-c", WRITTEN],
            capture_output=True,
            text=True,
            check=True,
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    ]
    assert said[0] == said[1]
    assert len(set(said[0].split())) == 3


def test_what_a_user_wrote_is_never_kept(tmp_path, monkeypatch):
    """Its text may change while its name stays."""
    monkeypatch.setattr(kept_units, "_WORTH", 0.0)
    answers = ResultCache(folder=tmp_path)(own_function, [np.ones((2, 1)), np.zeros((2, 1))])
    assert [float(answer.values[0, 0]) for answer in answers] == [2.0, 0.0]
    assert not list(tmp_path.iterdir())


def own_function(x: np.ndarray) -> Evaluation:
    return Evaluation(values=2.0 * x, status=np.zeros(len(x), np.uint8))
