"""Functions as parts of compiled ones and as wholes that Python calls."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import numba as nb
import numpy as np
import pytest

import tolalloc
from tolalloc.exceptions import InputError
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


CUTS = {
    "index cut": ("*.nbi", lambda content: content[:20]),
    "index of nothing": ("*.nbi", lambda content: b""),
    "index of something else": ("*.nbi", lambda content: b"no index\n" * 9),
    "code cut": ("*.nbc", lambda content: content[: len(content) // 2]),
    "code of nothing": ("*.nbc", lambda content: b""),
    "all cut": ("*.nb?", lambda content: content[:7]),
}


@pytest.mark.parametrize(("files", "damaged"), CUTS.values(), ids=CUTS)
def test_what_is_kept_and_was_cut_is_compiled_again_by_itself(tmp_path, monkeypatch, files, damaged):
    def answer():
        new = whole(_inner)
        compiled._keep(new, tmp_path / "wholes")
        compiled._keep(new.part, tmp_path / "parts")
        monkeypatch.setitem(globals(), "inner", new)
        return new(VALUES, 1), nb.njit(_outer)(VALUES, 1), sum(new.stats.cache_hits.values())

    assert answer() == (11.0, 121.0, 0)
    cut = [*tmp_path.rglob(files)]
    assert cut
    for path in cut:
        path.write_bytes(damaged(path.read_bytes()))
    assert answer() == (11.0, 121.0, 0)
    assert answer() == (11.0, 121.0, 1)


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


NOBODY = 65534
COMPILE = """
import numpy as np
from tolalloc import {module}
from tolalloc.running import compiled
print({module}.double(np.array([21.0])), compiled._KEPT, compiled.is_kept("{module}"), sep="|")
"""


@pytest.fixture
def bare_place():
    """Return a folder with the package in it that can be written by nobody, and one for temporary files by all."""
    folder = Path(tempfile.mkdtemp(prefix="bare-", dir="/tmp" if sys.platform == "linux" else None))
    package = shutil.copytree(Path(tolalloc.__file__).parent, folder / "tolalloc", ignore=lambda *_: ["__pycache__"])
    text = "from tolalloc.running.compiled import jit\n\n\n@jit\ndef double(values):\n    return values.sum() * 2.0\n"
    (package / "doubling.py").write_text(text, encoding="utf-8")
    (folder / "tmp").mkdir()
    for path in (folder, *package.rglob("*"), package):
        path.chmod(0o555 if path.is_dir() else 0o444)
    (folder / "tmp").chmod(0o777)
    yield folder
    for path in (folder, *folder.rglob("*")):
        if path.is_dir():
            path.chmod(0o755)
    shutil.rmtree(folder)


def as_a_user_without_a_home(place, *words, **variables):
    """Run Python with the package of a place, unprivileged; skipped where root cannot become anybody else."""
    lowered = {"user": NOBODY, "group": NOBODY, "extra_groups": []} if os.getuid() == 0 else {}
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(place), "HOME": "/nonexistent"}
    environment |= {"TMPDIR": str(place / "tmp"), **variables}
    try:
        return subprocess.run(
            [sys.executable, *words], env=environment, cwd="/", capture_output=True, text=True, check=False, **lowered
        )
    except PermissionError:
        pytest.skip("root can neither become another user here nor let one run this interpreter")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "getuid"), reason="users of this system cannot be changed so")
def test_a_user_who_can_write_nowhere_compiles_into_a_temporary_folder(bare_place):
    for _ in range(2):
        done = as_a_user_without_a_home(bare_place, "-c", COMPILE.format(module="doubling"))
        assert done.returncode == 0, done.stderr
        answer, kept, found = done.stdout.strip().split("|")
        assert (float(answer), found) == (42.0, "True")
        said = done.stderr.splitlines()
        assert len(said) == 1 and "NUMBA_CACHE_DIR" in said[0]
        own = Path(kept).parent
        assert own.parent == bare_place / "tmp" and str(own) in said[0]
        assert stat.S_IMODE(own.stat().st_mode) == 0o700
    (bare_place / "tmp/mine").mkdir()
    (bare_place / "tmp/mine").chmod(0o777)
    named = as_a_user_without_a_home(
        bare_place, "-c", COMPILE.format(module="doubling"), NUMBA_CACHE_DIR=str(bare_place / "tmp/mine")
    )
    assert named.returncode == 0 and named.stderr == ""
    assert Path(named.stdout.strip().split("|")[1]).parent == bare_place / "tmp/mine"


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "getuid"), reason="users of this system cannot be changed so")
def test_te_answers_a_user_who_can_write_nowhere(bare_place):
    done = as_a_user_without_a_home(bare_place, "-m", "tolalloc.cli.main", "te", "--reducer", "rv20e", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["peak_to_peak_arcsec"] == pytest.approx(0.150, abs=0.001)
    assert "Traceback" not in done.stderr


def test_a_temporary_folder_that_others_may_write_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    own = compiled._temporary_folder()
    assert own == compiled._temporary_folder()
    own.chmod(0o777)
    other = compiled._temporary_folder()
    assert other != own and stat.S_IMODE(other.stat().st_mode) == 0o700
    own.rmdir()
    own.symlink_to(other)
    assert compiled._temporary_folder() not in (own, other)


def test_a_stated_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setattr(nb.config, "CACHE_DIR", str(tmp_path / "file"))
    with pytest.raises(InputError, match="NUMBA_CACHE_DIR"):
        compiled._place()
