"""What is not known of the stiffness as a source: first order, share of the variance, correlation."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from tests.builders import Sum, baseline_errors, prepared, seeded_units
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_identified_stiffness, load_reducer, write_identified_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.response.kernel import (
    NAME,
    SEEN,
    KernelResponse,
    StiffnessResponse,
    stiffness_source,
)
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.sobol import sobol_indices
from tolalloc.sensitivity.uncertain import FirstOrderError

FIELDS = ("crank_disc_bearing", "pin_contact")


def few_sources() -> ErrorModel:
    return baseline_errors("disc1.bore1.position", "pin.diameter")


@pytest.fixture(scope="module")
def response(rv20e: EquivalentModel) -> StiffnessResponse:
    errors = few_sources()
    fixed = {name: 0.0 for name in rv20e.columns if name not in errors.columns}
    fixed |= {"modification.equidistant": -17e-6, "modification.shift": -25e-6}
    kernel = KernelResponse(model=rv20e, torque=-167.0, columns=errors.columns, fixed=fixed)
    return StiffnessResponse(kernel=kernel, stiffnesses=FIELDS)


def source(sigma: float, correlation: float) -> CorrelatedSource:
    return CorrelatedSource(
        name=NAME,
        columns=tuple(f"stiffness.{name}" for name in FIELDS),
        covariance=sigma**2 * np.array([[1.0, correlation], [correlation, 1.0]]),
    )


def units(count: int, seed: int) -> np.ndarray:
    return seeded_units(few_sources(), count, seed)


def first_order_error(response: StiffnessResponse, x: np.ndarray, changes: np.ndarray) -> FirstOrderError:
    """Return how far the first order is from the kernel whose reducer has the changed stiffnesses."""
    answers = response.kernel.with_derivatives(x)
    before = answers.evaluation.values[:, 0]
    effect = np.stack([response.changed(change)(x).values[:, 0] - before for change in changes], axis=1)
    error = response.gradient(answers) @ changes.T - effect
    good = np.isfinite(error)
    return FirstOrderError(
        root_mean_square=float(np.sqrt((error[good] ** 2).mean())),
        largest=float(np.abs(error[good]).max()),
        effect=float(np.sqrt((effect[good] ** 2).mean())),
        units=x.shape[0],
        changes=changes.shape[0],
        accuracy=SEEN,
    )


@pytest.mark.slow
def test_first_order_against_the_kernel(response):
    """At a small torque the error falls faster than the change; at a large one contacts change, and it is seen."""
    x, direction = units(16, 1), np.array([[-1.0, 0.0], [0.7, -0.7]])
    light = replace(response, kernel=replace(response.kernel, torque=-1.0))
    small, large = (first_order_error(light, x, size * direction) for size in (0.02, 0.2))
    assert small.root_mean_square < 0.05 * small.effect
    assert large.root_mean_square < 0.25 * large.effect
    assert large.root_mean_square > 20 * small.root_mean_square
    assert small.largest >= small.root_mean_square
    loaded = first_order_error(response, x, 0.2 * direction)
    assert loaded.root_mean_square > large.root_mean_square
    assert not large.fails
    assert first_order_error(response, x, 5 * direction[:1]).fails


def test_a_change_is_that_of_the_reducer(response):
    changed = response.changed(np.array([0.1, -0.2])).model.reducer.stiffness
    old = response.kernel.model.reducer.stiffness
    assert changed == replace(
        old, crank_disc_bearing=old.crank_disc_bearing * exp(0.1), pin_contact=old.pin_contact * exp(-0.2)
    )
    x = units(3, 2)
    extended = np.concatenate([x, np.zeros((3, 2))], axis=1)
    np.testing.assert_array_equal(response(extended).values, response.kernel(x).values)


@pytest.mark.slow
def test_share_of_the_variance_against_direct_monte_carlo(response):
    """Pairs of the same unit with two draws of the stiffness give the total index without Sobol's scheme."""
    stiffness = source(0.6, -0.5)
    errors = replace(few_sources(), joint=(stiffness,))
    found = sobol_indices(Experiment.of(response, errors, SeedTree(3)), SobolEffort(start=64, limit=64)).of(0)
    at = found.sources.index(NAME)
    x, draws = units(400, 4), np.random.default_rng(5).multivariate_normal(np.zeros(2), stiffness.covariance, (2, 400))
    first, second = (response(np.concatenate([x, draw], axis=1)).values[:, 0] for draw in draws)
    own, total = (first - second) ** 2 / 2, np.concatenate([first, second]).var()
    direct, error = own.mean() / total, own.std() / np.sqrt(own.size) / total
    assert found.total[at] > 0.01
    assert found.total[at] == pytest.approx(direct, abs=3 * np.hypot(error, found.total_resamples[:, at].std()))
    answers = response.kernel.with_derivatives(x[:200])
    effect = response.gradient(answers)[answers.evaluation.good] @ stiffness.factor
    assert (effect**2).sum(axis=1).mean() / total == pytest.approx(direct, abs=4 * error)


@pytest.mark.parametrize(("correlation", "variance"), [(1.0, 4.0), (0.0, 2.0), (-0.5, 1.0), (-1.0, 0.0)])
def test_correlation_inside_the_group_counts(correlation, variance):
    """Equal effects of two columns add up or cancel; the other sources have a variance of 2 on this scale."""
    errors = few_sources()
    rest = float(units(100_000, 1).sum(axis=1).var())
    errors = replace(errors, joint=(source(float(np.sqrt(rest / 2)), correlation),))
    found = sobol_indices(
        Experiment.of(Sum(errors.columns), errors, SeedTree(1)), SobolEffort(start=2048, limit=2048)
    ).of(0)
    assert found.total[-1] == pytest.approx(variance / (variance + 2), abs=0.04)
    assert found.first[-1] == pytest.approx(variance / (variance + 2), abs=0.06)


def test_a_stiffness_without_uncertainty_has_no_share(response):
    errors = replace(few_sources(), joint=(source(0.0, 0.3),))
    found = sobol_indices(Experiment.of(response, errors, SeedTree(3)), SobolEffort(start=16, limit=16)).of(0)
    assert found.total[-1] == 0.0
    assert found.sources == ("disc1.bore1.position", "pin.diameter", NAME)


def test_source_of_the_shipped_file():
    identified, reducer = load_identified_stiffness("rv20e_table6"), load_reducer("rv20e_liu2020")
    found = stiffness_source(identified, reducer)
    assert found.columns == tuple(f"stiffness.{name}" for name in identified.values)
    np.testing.assert_allclose(found.factor @ found.factor.T, identified.covariance, rtol=1e-12, atol=1e-20)
    assert "0.019 (stiffness.crank_carrier_bearing)" in found.mapping
    bending = replace(reducer, stiffness=replace(reducer.stiffness, pin_bending=1e9))
    contact = IdentifiedStiffness(source="mine", values={"pin_contact": 1e9}, standard_uncertainty={"pin_contact": 1e8})
    with pytest.raises(InputError, match=r"pin_contact.*0 where pins bend"):
        stiffness_source(contact, bending)


def test_the_study_knows_the_uncertainty_and_the_allocation_does_not(tmp_path):
    shipped = load_identified_stiffness("rv20e_table6")
    doubled = {name: 2 * value for name, value in shipped.standard_uncertainty.items()}
    studies = []
    for name, identified in (("one", shipped), ("two", replace(shipped, standard_uncertainty=doubled))):
        (tmp_path / name).mkdir()
        write_identified_stiffness(identified, tmp_path / name / "bench.toml")
        studies.append(prepared(name="same", reducer={"stiffness": tmp_path / name / "bench.toml"}))
    assert studies[0].digest != studies[1].digest
    for study in studies:
        assert study.space.errors.joint == ()
        (known,) = study.model.uncertain
        assert known.name == NAME
    assert prepared(name="none").model.uncertain == ()
