"""Units solved by the workers of a scheduler: the same bits, workers killed or not, and clear refusals."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import prepared, seeded_units
from tests.studies.command import refused, tolalloc
from tests.studies.scripts import study_script
from tolalloc.exceptions import InputError
from tolalloc.running.result_cache import ResultCache
from tolalloc.running.workers import workers_at

UNITS = 12 * 1024


@pytest.fixture(autouse=True)
def two_workers(monkeypatch):
    """Have two workers where the tests themselves share the cores, too."""
    monkeypatch.setattr("tolalloc.running.workers.thread_count", lambda: 2)


@pytest.fixture(scope="module")
def study():
    return prepared()


@pytest.fixture(scope="module")
def units(study):
    return seeded_units(study.errors, UNITS, 5)


@pytest.fixture(scope="module")
def in_this_process(study, units):
    return study.model.reading((ta.PEAK_TO_PEAK,))(units).values


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_workers_that_are_killed_leave_the_same_bits(study, units, in_this_process, seed):
    generator = np.random.default_rng(seed)
    with workers_at("local") as workers:
        pids = list(workers.client.run(os.getpid).values())
        assert len(pids) == 2

        def kill():
            for pid in generator.permutation(pids):
                time.sleep(generator.uniform(0.2, 1.5))
                os.kill(int(pid), signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        found = study.model.mapped(workers).reading((ta.PEAK_TO_PEAK,))(units).values
        killer.join()
        assert not set(workers.client.run(os.getpid).values()) & set(pids)
    np.testing.assert_array_equal(found, in_this_process)


@pytest.mark.slow
def test_what_workers_solved_is_kept_for_this_process(study, units, in_this_process, tmp_path):
    """However quickly it was there: it may have lain ready."""
    with workers_at("local") as workers:
        kept = ResultCache(folder=tmp_path, solved_by=workers)
        study.model.mapped(kept).reading((ta.PEAK_TO_PEAK,))(units[:4096])
    known = len(list(tmp_path.iterdir()))
    assert known == 4

    def solves_nothing(solve, chunks):
        assert not list(chunks)
        return iter(())

    mine = study.model.mapped(ResultCache(folder=tmp_path, solved_by=solves_nothing)).reading((ta.PEAK_TO_PEAK,))
    np.testing.assert_array_equal(mine(units[:4096]).values, in_this_process[:4096])


@pytest.mark.slow
def test_nobody_at_the_address_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr("tolalloc.running.workers._PATIENCE", 1)
    script = study_script(tmp_path)
    result = tolalloc("rank", script, "--out", tmp_path / "run", "--scheduler", "tcp://127.0.0.1:9")
    refused(result, "--scheduler is 'tcp://127.0.0.1:9'")
    assert not (tmp_path / "run").exists()


def test_without_dask_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'tolalloc\[distributed\]'"), workers_at("local"):
        pass
