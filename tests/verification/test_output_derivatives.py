"""Exact derivatives of all outputs that have them, against central differences of these outputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import baseline_errors, kernel_of, table_of_three_cranks, units_at_random
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.design import Clearances, Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.response.outputs import DIFFERENTIABLE

UNITS = 12
STEP = 1e-10
"""Step of a difference by a column [m]."""


def bound(reducer: Reducer, errors: ErrorModel) -> tuple[ReducerModel, np.ndarray]:
    return ReducerModel(kernel=kernel_of(EquivalentModel(reducer), errors, -1.0)), deviations(errors)


def two_cranks() -> tuple[ReducerModel, np.ndarray]:
    return bound(load_reducer("rv20e"), baseline_errors())


def three_cranks() -> tuple[ReducerModel, np.ndarray]:
    """Another number of cranks, constant stiffness of the pins."""
    errors = ErrorModel(tuple(table_of_three_cranks("rv20e_table4").values()))
    return bound(replace(load_reducer("rv20e_liu2020"), crank_count=3), errors)


def with_play() -> tuple[ReducerModel, np.ndarray]:
    """Bearings and meshes that yield where they touch alone."""
    loose = Clearances(gear_mesh=3e-6, crank_disc_bearing=1e-6)
    return bound(replace(load_reducer("rv20e"), clearances=loose), baseline_errors())


def deviations(errors: ErrorModel) -> np.ndarray:
    return units_at_random(errors, UNITS, 20261123)


@pytest.mark.parametrize("output", DIFFERENTIABLE)
@pytest.mark.parametrize("case", [two_cranks, three_cranks, with_play])
def test_they_are_the_differences_of_the_output(case, output):
    """Pins that just take over within a step make a few units differ: the median is compared."""
    model, x = case()
    found, direction = model.derivatives(output, x), np.random.default_rng(1).normal(size=x.shape) * STEP
    np.testing.assert_allclose(found.evaluation.values, model.reading((output,))(x).values, rtol=1e-9)
    ahead, behind = (model.reading((output,))(x + side * direction).values[:, 0] for side in (1, -1))
    exact = (found.by_column * direction).sum(axis=1)
    assert np.median(np.abs((ahead - behind) / 2 - exact)) < 1e-4 * np.abs(exact).mean()
    settings = np.array([setting.value for setting in model.settings])
    for at, step in enumerate(np.diag([1e-3, 1e-3])):
        ahead, behind = (model.at(settings + side * step).reading((output,))(x).values[:, 0] for side in (1, -1))
        slope = found.by_setting[:, at]
        # The gap at tip and root does not feel the flank clearance.
        assert np.median(np.abs((ahead - behind) / 2e-3 - slope)) < 1e-4 * np.abs(slope).mean() + 1e-12
