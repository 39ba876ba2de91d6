"""Functions as parts of compiled ones and as wholes that Python calls."""

from __future__ import annotations

import subprocess
import sys

import numba as nb
import numpy as np
import pytest

from tolalloc.running import compiled
from tolalloc.running.compiled_parts import Whole


def _inner(values, at):
    if at >= values.size:
        raise IndexError("beyond the end")
    return 2.0 * values[at] + np.sum(values)


def _outer(values, at):
    return inner(values, at) * inner(values, at)


def whole(function):
    """Return a function without anything kept of it."""
    return Whole(function, {"nogil": True, "error_model": "numpy"}, lambda module: None)


inner = whole(_inner)
VALUES = np.array([1.0, 2.0, 4.0])


@pytest.fixture(autouse=True)
def fresh_inner(monkeypatch):
    """Let every test begin with nothing compiled."""
    monkeypatch.setitem(globals(), "inner", whole(_inner))


def test_what_only_compiled_functions_call_is_no_whole():
    assert whole(_outer)(VALUES, 1) == _outer.__globals__["inner"].py_func(VALUES, 1) ** 2 == 121.0
    assert len(inner.part.overloads) == 1
    assert not inner.overloads


def test_python_calls_a_function_that_is_a_part_already():
    whole(_outer)(VALUES, 1)
    assert inner(VALUES, 1) == 11.0
    assert len(inner.overloads) == 1


def test_a_function_of_the_user_calls_one_of_ours():
    assert nb.njit(_outer)(VALUES, 1) == 121.0


def test_what_a_part_raises_arrives():
    with pytest.raises(IndexError, match="beyond the end"):
        whole(_outer)(VALUES, 3)


def test_what_is_kept_is_not_compiled_again(tmp_path, monkeypatch):
    def kept(function):
        new = whole(function)
        compiled._keep(new, tmp_path / "wholes")
        compiled._keep(new.part, tmp_path / "parts")
        return new

    answers = []
    for _ in range(2):
        monkeypatch.setitem(globals(), "inner", kept(_inner))
        outer = kept(_outer)
        answers.append((outer(VALUES, 1), nb.njit(_outer)(VALUES, 2), inner(VALUES, 0)))
    assert answers[0] == answers[1] == (121.0, 225.0, 9.0)
    assert sum(outer.stats.cache_hits.values()) == sum(inner.part.stats.cache_hits.values()) == 1
    assert not sum(outer.stats.cache_misses.values()) + sum(inner.part.stats.cache_misses.values())


def test_numba_compiles_in_its_own_way_where_parts_cannot_stand(monkeypatch):
    monkeypatch.setitem(sys.modules, "tolalloc.running.compiled_parts", None)
    ordinary = compiled._new(_inner, {"nogil": True, "error_model": "numpy"})
    assert not isinstance(ordinary, Whole)
    assert ordinary(VALUES, 1) == 11.0


def test_what_another_process_compiles_is_waited_for(monkeypatch):
    """The other process imports a module of Python's own and ends."""
    monkeypatch.setattr(compiled, "_elsewhere", {})
    monkeypatch.setattr(compiled, "_threads", 2)
    compiled.compile_elsewhere([__name__], "this")
    process = compiled._elsewhere[__name__]
    assert isinstance(process, subprocess.Popen)
    waiting = Whole(_inner, {}, compiled._wait_for)
    assert waiting(VALUES, 1) == 11.0
    assert process.returncode == 0


def test_one_core_compiles_alone(monkeypatch):
    monkeypatch.setattr(compiled, "_elsewhere", {})
    monkeypatch.setattr(compiled, "_threads", 1)
    compiled.compile_elsewhere([__name__], "this")
    assert not compiled._elsewhere
