"""The same bits in any number of chunks and processes."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from tests.random_cases import random_units
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running import chunks


@pytest.mark.slow
def test_same_bits_for_any_chunk_and_any_process(rv20e, table4, generator, monkeypatch):
    units = random_units(table4, rv20e.columns, generator, 150)
    model = EquivalentModel(rv20e.reducer, AngleSearch(coarse=312))
    here = KernelResponse(model=model, torque=-1.0, columns=model.columns, fixed={})
    whole = here(units).values
    monkeypatch.setattr(chunks, "SAMPLES_AT_ONCE", 37)
    np.testing.assert_array_equal(here(units).values, whole)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context, initializer=chunks.one_thread) as pool:
        elsewhere = replace(here, mapper=pool.map)(units[:80]).values
    np.testing.assert_array_equal(elsewhere, whole[:80])
