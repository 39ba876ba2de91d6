"""The adjoint derivatives, against central differences of the whole model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.random_cases import is_angle, random_case, random_units, seeds
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.solvers.records import AngleSearch


@pytest.mark.slow
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


def moved(case, name, change):
    """Return the case with one stiffness times 1 + change."""
    stiffness = replace(case.reducer.stiffness, **{name: (1 + change) * getattr(case.reducer.stiffness, name)})
    return replace(case, reducer=replace(case.reducer, stiffness=stiffness))


def rotation_at_first_angle(case, errors, torque):
    model = EquivalentModel(case.reducer, orders=case.orders)
    return model.equilibria(errors, torque, np.zeros(1)).transmission_error[0, 0]


@pytest.mark.parametrize("seed", seeds(60))
def test_rotation_derivatives_of_any_reducer_agree_with_differences(seed):
    """By every error along a random direction, by the torque and by each stiffness, with any law, play and tilt."""
    case, generator = random_case(seed), np.random.default_rng(seed)
    model = EquivalentModel(case.reducer, AngleSearch(coarse=4, nodes_per_coarse=1), orders=case.orders)
    errors = np.array([[case.units[0][name] for name in model.columns]])
    rotation, derivatives = model.rotation_derivatives(errors, case.torque, np.pi / 2 * np.arange(4))
    assert rotation[0, 0] == pytest.approx(rotation_at_first_angle(case, errors, case.torque), rel=1e-9, abs=1e-12)
    assert derivatives.status[0] == Status.CONVERGED
    direction = generator.normal(size=errors.shape) * np.where([is_angle(name) for name in model.columns], 2e-10, 2e-11)
    step = 1e-6 * case.torque
    found = {
        "errors": (
            rotation_at_first_angle(case, errors + direction, case.torque)
            - rotation_at_first_angle(case, errors - direction, case.torque),
            2 * float(derivatives.by_error[0] @ direction[0]),
        ),
        "torque": (
            rotation_at_first_angle(case, errors, case.torque + step)
            - rotation_at_first_angle(case, errors, case.torque - step),
            2 * step * float(derivatives.by_torque[0]),
        ),
    }
    for name, values in derivatives.by_stiffness.items():
        ahead, behind = (
            rotation_at_first_angle(moved(case, name, change), errors, case.torque) for change in (1e-5, -1e-5)
        )
        found[name] = (ahead - behind, 2e-5 * float(values[0]))
    for name, (change, exact) in found.items():
        assert change == pytest.approx(exact, rel=2e-3, abs=1e-7 * ARCSECOND), name
