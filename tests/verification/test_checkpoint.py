"""Checkpoints of the Pareto search change no bit and are refused where they do not fit."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stack_front import StackProblem, stack_problem

from tests.builders import digest
from tolalloc.allocation.front.genetic import search
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.checkpoint import Checkpoint

POPULATION = 80


@pytest.fixture(scope="module")
def stack() -> StackProblem:
    return stack_problem()


class Interrupted(StackProblem):
    """Gives up when it is asked for the eighth generation."""

    calls = 0

    def __call__(self, designs):
        Interrupted.calls += 1
        if Interrupted.calls > 7:
            raise KeyboardInterrupt
        return super().__call__(designs)


SMALL = (24, 15)


def interrupt(stack, path, every=24):
    Interrupted.calls = 0
    broken = Interrupted(**{name: getattr(stack, name) for name in ("allocation", "ladder", "on_ladder", "budget")})
    with pytest.raises(KeyboardInterrupt):
        search(broken, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=Checkpoint(path=path, every=every))


@pytest.mark.parametrize("on_ladder", [0, 12])
@pytest.mark.parametrize("every", [7, 24, 72])
def test_a_search_interrupted_at_generation_7_ends_with_the_bits_of_an_uninterrupted_one(tmp_path, on_ladder, every):
    stack = stack_problem(on_ladder=on_ladder)
    whole = search(stack, np.empty((0, 12)), SeedTree(0), *SMALL)
    interrupt(stack, tmp_path / "front.npz", every)
    with np.load(tmp_path / "front.npz") as file:
        assert 0 < len(file["designs"]) <= 7 * 24
        saved = len(file["designs"])
    asked = []

    class Counted(StackProblem):
        def __call__(self, designs):
            asked.append(len(designs))
            return super().__call__(designs)

    counted = Counted(stack.allocation, stack.ladder, stack.on_ladder)
    checkpoint = Checkpoint(path=tmp_path / "front.npz", every=every)
    resumed = search(counted, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=checkpoint)
    assert digest(resumed) == digest(whole)
    distinct = len(np.unique(whole.designs, axis=0))
    assert sum(asked) == distinct - saved + 1  # one of the saved ones is asked for again, to know the problem
    assert [path.name for path in tmp_path.iterdir()] == ["front.npz"]


@pytest.mark.slow
def test_a_search_resumed_in_another_process_has_the_same_bits(tmp_path, stack):
    whole = search(stack, np.empty((0, 12)), SeedTree(0), *SMALL)
    interrupt(stack, tmp_path / "front.npz")
    script = (
        "import sys, hashlib, numpy as np; from pathlib import Path; sys.path.insert(0, sys.argv[1])\n"
        "from stack_front import stack_problem\n"
        "from tolalloc.models.checkpoint import Checkpoint\n"
        "from tolalloc.allocation.front.genetic import search\n"
        "from tolalloc.drawings.seeds import SeedTree\n"
        f"found = search(stack_problem(), np.empty((0, 12)), SeedTree(0), *{SMALL}, "
        "checkpoint=Checkpoint(path=Path(sys.argv[2]), every=24))\n"
        "print(hashlib.sha256(found.designs.tobytes() + found.answers.values.tobytes()).hexdigest())"
    )
    here = str(Path(__file__).parent)
    command = [sys.executable, "-c", script, here, str(tmp_path / "front.npz")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == digest(whole)


def test_what_a_longer_search_left_in_the_file_does_not_change_a_shorter_one(tmp_path, stack):
    checkpoint = Checkpoint(path=tmp_path / "front.npz", every=100)
    search(stack, np.empty((0, 12)), SeedTree(0), 24, 20, checkpoint=checkpoint)
    search(stack, np.empty((0, 12)), SeedTree(1), 24, 5, checkpoint=checkpoint)
    again = search(stack, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=checkpoint)
    assert digest(again) == digest(search(stack, np.empty((0, 12)), SeedTree(0), *SMALL))


@pytest.mark.parametrize("kind", ["truncated", "damaged", "text", "pickle", "other answers", "other names"])
def test_a_checkpoint_that_does_not_fit_is_refused_by_one_sentence(tmp_path, stack, kind):
    path, problem = tmp_path / "front.npz", stack
    interrupt(stack, path)
    content = path.read_bytes()
    if kind == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif kind == "damaged":
        with np.load(path) as file:
            arrays = dict(file)
        arrays["numbers"][3, 0] *= 1.5
        np.savez(path, **arrays)
    elif kind == "text":
        path.write_text("x = 1\n")
    elif kind == "pickle":
        path.write_bytes(pickle.dumps({"designs": [1.0]}))
    elif kind == "other answers":
        problem = stack_problem(seed=6)
    else:
        problem = stack_problem(on_ladder=3)
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"checkpoint") as refusal:
        search(problem, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=Checkpoint(path=path, every=24))
    assert str(refusal.value).startswith(f"{path}: ")
    assert str(refusal.value).count(". ") == 0
    assert path.read_bytes() == before


def test_a_write_that_fails_leaves_the_old_checkpoint_whole(tmp_path, stack, monkeypatch):
    path = tmp_path / "front.npz"
    interrupt(stack, path)
    before = path.read_bytes()

    def full(file, **_):
        file.write(b"half")
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="no space"):
        search(stack, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=Checkpoint(path=path, every=24))
    assert path.read_bytes() == before
    assert [left.name for left in tmp_path.iterdir()] == ["front.npz"]


def test_a_checkpoint_without_a_folder_is_refused_before_the_search(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        Checkpoint(path=tmp_path / "missing" / "front.npz", every=1)
