"""Allocation: the model's gradient, the program's certificate, and the front."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tolalloc.allocation.convex import ConvexAllocation, cost_bound
from tolalloc.allocation.quantile import LocalQuantile, local_quantile
from tolalloc.allocation.verification import Verifier
from tolalloc.study.definition import Study, prepare
from tolalloc.uncertainty.seeds import SeedTree


@pytest.fixture(scope="module")
def prepared():
    return prepare(Study(name="test"))


@pytest.fixture
def model(prepared, generator) -> LocalQuantile:
    groups = len(prepared.space.groups)
    return LocalQuantile(offset=2.0, slopes=np.array([5.0, 1.0]), weights=generator.uniform(1, 50, groups))


def test_clearances_and_amounts_map_one_to_one(prepared):
    space, modification = prepared.space, prepared.reducer.modification
    again = space.modification(space.uniform(1.0, modification))
    assert again.equidistant == pytest.approx(modification.equidistant, abs=1e-15)
    assert again.shift == pytest.approx(modification.shift, abs=1e-15)
    assert modification.radial_clearance == pytest.approx(8e-6)
    assert modification.flank_clearance(prepared.reducer.cycloid_stage) == pytest.approx(1.04e-6, abs=5e-9)


def test_local_model_has_the_given_value_and_gradient(generator):
    design = np.append(generator.uniform(0.3, 2, 6), [1.0, 8.0])
    gradient = np.append(generator.uniform(0.5, 20, 6), [4.0, 1.0])
    local = local_quantile(design, 60.0, gradient)
    assert local(design) == pytest.approx(60.0)
    step = 1e-6
    differences = (local(design + step * np.eye(8)) - local(design - step * np.eye(8))) / (2 * step)
    np.testing.assert_allclose(differences, gradient, rtol=1e-6)


def test_program_meets_its_bound(prepared, model):
    space, program = prepared.space, ConvexAllocation(prepared.space)
    for limit in (35.0, 60.0, 90.0):
        design = program.solve(model, limit, space.lower, space.upper)
        assert design is not None
        assert model(design) <= limit * (1 + 1e-6)
        bound = cost_bound(space, model, limit, design)
        assert bound <= space.cost(design) * (1 + 1e-6)  # the solver keeps the limit to about 1e-8
        assert space.cost(design) / bound - 1 < 1e-4


def test_bound_holds_for_every_feasible_design_whatever_the_plane(prepared, model, generator):
    space = prepared.space
    designs = space.lower + generator.random((20000, space.lower.size)) * (space.upper - space.lower)
    feasible = model(designs) <= 60.0
    assert feasible.sum() > 20
    for near in designs[:5]:
        assert cost_bound(space, model, 60.0, near) <= space.cost(designs[feasible]).min()


def test_an_unreachable_limit_has_no_design(prepared, model):
    assert ConvexAllocation(prepared.space).solve(model, 3.0, prepared.space.lower, prepared.space.upper) is None


def test_gradient_of_the_quantile_agrees_with_common_random_numbers(prepared):
    """Mean + κσ of the same 1,024 units at zones and clearances moved by 2 %, against the exact gradient.

    Second order and switching contacts leave up to 6 % of the largest component.
    """
    space = prepared.space
    verifier = Verifier(
        space=space, kernel=prepared.kernel, requirement=prepared.requirement, seeds=SeedTree(4), units=1024
    )
    design = space.uniform(0.6, prepared.reducer.modification)
    verifier = replace(verifier, requirement=replace(verifier.requirement, target=0.95))
    here = verifier.verify(design, "gradient")
    gradient = np.append(here.local.weights**2 * design[:-2], here.local.slopes)
    gradient[:-2] /= np.sqrt((here.local.weights**2 * design[:-2] ** 2).sum())
    differences = []
    for at in range(design.size):
        values = []
        for sign in (1, -1):
            moved = design.copy()
            moved[at] *= 1 + 0.02 * sign
            sample = verifier.verify(moved, "gradient").sample.values
            values.append(sample.mean() + here.spread * sample.std(ddof=1))
        differences.append((values[0] - values[1]) / (0.04 * design[at]))
    scale = np.abs(gradient[:-2]).max()
    np.testing.assert_allclose(gradient[:-2], np.maximum(differences[:-2], 0), atol=0.06 * scale)
    np.testing.assert_allclose(gradient[-2:], differences[-2:], atol=0.06 * np.abs(gradient[-2:]).max())
