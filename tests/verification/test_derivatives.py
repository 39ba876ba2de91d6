"""The adjoint derivative of the peak-to-peak, against central differences of the whole model."""

from __future__ import annotations

import numpy as np

from tests.random_units import random_units
from tolalloc.equivalent.angle_search import AngleSearch
from tolalloc.equivalent.model import EquivalentModel
from tolalloc.equivalent.status import Status


def test_derivative_agrees_with_differences(rv20e, table4, generator):
    """Central differences of the peak-to-peak over ±0.5 nm along random directions, extremes found to 1e-6 of a turn.

    Within the step another pin may take over in a few units; they are why not all directions agree.
    """
    model = EquivalentModel(rv20e.reducer, AngleSearch(levels=20))
    units = random_units(table4, model.columns, generator, 200)
    extremes, derivatives = model.peak_to_peak_derivatives(units, -5.0)
    assert (extremes.status == Status.CONVERGED).all()
    derivative = derivatives.by_error
    direction = generator.normal(0, 1, units.shape)
    step = 5e-10
    ahead, behind = (model.extremes(units + sign * step * direction, -5.0).peak_to_peak for sign in (1, -1))
    difference = (ahead - behind) / (2 * step)
    exact = (derivative * direction).sum(axis=1)
    relative = np.abs(difference - exact) / np.sqrt((derivative**2).sum(axis=1))
    assert np.median(relative) < 1e-3
    assert (relative < 0.01).mean() > 0.95


def test_derivative_predicts_small_changes(rv20e, table4, generator):
    """First-order prediction of the refined peak-to-peak under random changes of 5 nm in each of the 430 columns."""
    units = random_units(table4, rv20e.columns, generator, 40)
    change = generator.normal(0, 5e-9, units.shape)
    extremes, derivatives = rv20e.peak_to_peak_derivatives(units, -5.0)
    derivative = derivatives.by_error
    moved = rv20e.extremes(units + change, -5.0)
    actual = moved.peak_to_peak - extremes.peak_to_peak
    predicted = (derivative * change).sum(axis=1)
    assert np.corrcoef(actual, predicted)[0, 1] > 0.99
