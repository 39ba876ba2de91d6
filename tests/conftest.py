from __future__ import annotations

import gc
import os

import numpy as np
import pytest

import tests.shapes  # noqa: F401  # the full gate looks it up by its name
from tests import builders
from tests.compiled_first import compile_in_two_processes
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.running.compiled import use_threads
from tolalloc.study.prepared import Prepared

if "PYTEST_XDIST_WORKER" in os.environ:
    use_threads(1)  # every core has a worker already


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernel before workers start."""
    if "PYTEST_XDIST_WORKER" not in os.environ and getattr(session.config.option, "numprocesses", None):
        compile_in_two_processes()


def pytest_collection_finish() -> None:
    """Leave what was collected out of every later search for rubbish, which would walk through all of it each time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def rv20e() -> EquivalentModel:
    """The RV-20E preset; its tables are made once for all tests."""
    return EquivalentModel(load_reducer("rv20e_liu2020"))


@pytest.fixture(scope="session")
def table4(rv20e: EquivalentModel) -> np.ndarray:
    """The measured unit of liu2020, one row of errors [m]."""
    return load_unit("table4").errors(rv20e.columns)


@pytest.fixture
def generator() -> np.random.Generator:
    return np.random.default_rng(20201121)


@pytest.fixture(scope="session")
def prepared() -> Prepared:
    """The study of the baseline; its model and sources are made once for all tests."""
    return builders.prepared()
