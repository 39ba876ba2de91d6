"""The Pareto search on the kernel: genes of designs, other requirements, checkpoints, failed designs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tolalloc import PEAK_TO_PEAK
from tolalloc.allocation.front.genetic import nondominated
from tolalloc.allocation.front.pareto_front import pareto_front
from tolalloc.allocation.front.pareto_problem import DesignProblem
from tolalloc.allocation.front.what_if import QuantileResponse
from tolalloc.allocation.space.effort import FrontEffort
from tolalloc.allocation.space.problem import OneSidedConstraint, Stack
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.models.checkpoint import CachedResponse, Checkpoint
from tolalloc.reducers.settings import RADIAL
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2

POPULATION = 80


@pytest.fixture(scope="module")
def quantile(prepared) -> QuantileResponse:
    errors = prepared.space.errors
    uniform = SeedTree(8).uniform_chunk(0, len(errors.columns))[:16]
    return QuantileResponse(
        space=prepared.space,
        model=prepared.model,
        output=PEAK_TO_PEAK,
        standard=errors.standard_values(uniform),
        spread=2.5,
    )


def ladder_of(space, group) -> np.ndarray:
    at = space.groups.index(group)
    return np.geomspace(space.lower[at], space.upper[at], 5)


def test_genes_of_designs_and_back_are_the_designs_up_to_their_ladders(prepared, quantile, generator):
    space = prepared.space
    first = space.groups[0]
    problem = DesignProblem(space=space, quantile=quantile, ladders={first: ladder_of(space, first)})
    designs = space.lower + generator.random((50, space.lower.size)) * (space.upper - space.lower)
    again = problem.designs_of(problem.genes_of(designs))
    np.testing.assert_allclose(again[:, 1:], designs[:, 1:], rtol=1e-12)
    assert np.isin(np.round(again[:, 0], 12), np.round(ladder_of(space, first), 12)).all()
    assert np.abs(np.log(again[:, 0] / designs[:, 0])).max() <= np.log(ladder_of(space, first)[1] / space.lower[0])
    np.testing.assert_allclose(problem.genes_of(again), problem.genes_of(designs), atol=1e-12)


def test_wrong_ladders_are_refused(prepared, quantile):
    space = prepared.space
    with pytest.raises(UnknownNameError, match="ladders"):
        DesignProblem(space=space, quantile=quantile, ladders={"nobody": np.ones(1)})
    with pytest.raises(InputError, match="rising numbers"):
        DesignProblem(space=space, quantile=quantile, ladders={space.groups[0]: np.array([0.9, 0.8])})


def test_other_requirements_are_violated_by_what_their_models_say(prepared, quantile):
    space = prepared.space
    groups, design = len(space.groups), space.uniform(1.0)
    stack = Stack(
        name="lost motion",
        worst_case=np.zeros(groups),
        root_sum_square=np.ones(groups),
        budget=2.0,
        slopes=np.array([0.0, 0.1]),
    )
    side = OneSidedConstraint(sign=1, limit=0.5, value=0.4, standard_error=0.01, scale=0.5, stack=stack)
    problem = DesignProblem(space=space, quantile=quantile, large=(RADIAL,), others=(side,))
    answers = problem(problem.genes_of(design[np.newaxis]))
    assert problem.constraints == ("lost motion",)
    assert answers.values[0, 0] == pytest.approx(space.cost(design[np.newaxis])[0])
    assert answers.values[0, 2] == pytest.approx(8.0)
    np.testing.assert_allclose(answers.violation, [[(groups**0.5 + 0.8 - 2.0) / 0.5]], rtol=1e-6)


def rough(designs):
    """Rises with every zone and the flank clearance, as a convex model of the quantile does."""
    return 20 + 5 * designs[:, -2] + 12 * np.linalg.norm(designs[:, :-2], axis=1)


EFFORT = FrontEffort(
    population=16, generations=8, population_on_kernel=8, generations_on_kernel=2, designs=10, rounds=2, points=4
)


def kernel_front(prepared, quantile, checkpoint=None, **options):
    space, kernel = prepared.space, CachedResponse(quantile, checkpoint)
    unit = np.random.default_rng(1).random((14, space.lower.size))
    designs = space.lower * (space.upper / space.lower) ** unit
    return pareto_front(space, kernel, rough, 1.0, designs[:10], designs[10:], SeedTree(4), EFFORT, **options)


@pytest.mark.slow
def test_the_front_on_the_kernel_goes_on_from_its_checkpoint_with_the_same_bits(prepared, quantile, tmp_path):
    whole, score = kernel_front(prepared, quantile)
    checked = np.flatnonzero(~np.isnan(whole.on_kernel))
    assert len(checked) == min(EFFORT.points, whole.cost.size)
    np.testing.assert_array_equal(quantile(whole.designs[checked]).values[:, 0], whole.on_kernel[checked])
    assert nondominated(np.column_stack([whole.cost, whole.quantile])).all()
    assert whole.failed == 0
    if score.q2 < NEEDED_Q2:  # then the kernel itself was searched
        assert whole.rms_error == 0.0
    checkpoint = Checkpoint(path=tmp_path / "front.npz", every=5)
    given = []

    def interrupted(self, x):
        given.append(len(x))
        if sum(given) > 20:
            raise KeyboardInterrupt
        return answer(self, x)

    answer = QuantileResponse.__call__
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(QuantileResponse, "__call__", interrupted)
        with pytest.raises(KeyboardInterrupt):
            kernel_front(prepared, quantile, checkpoint=checkpoint)
    resumed, _ = kernel_front(prepared, quantile, checkpoint=checkpoint)
    for name in ("designs", "cost", "quantile", "on_kernel"):
        np.testing.assert_array_equal(getattr(resumed, name), getattr(whole, name))
    cached = CachedResponse(quantile, checkpoint)
    assert cached.outputs == quantile.outputs


@pytest.mark.slow
def test_on_the_kernel_ladders_and_a_third_objective_hold(prepared, quantile):
    space = prepared.space
    ladders = {group: ladder_of(space, group) for group in space.groups[:2]}
    front, _ = kernel_front(prepared, quantile, ladders=ladders, large=(RADIAL,))
    np.testing.assert_array_equal(front.further[:, 0], front.designs[:, -1])
    for at, ladder in enumerate(ladders.values()):
        assert np.isclose(front.designs[:, at, np.newaxis], ladder, rtol=1e-12).any(axis=1).all()
    assert nondominated(np.column_stack([front.cost, front.quantile, -front.further])).all()
    assert 0 <= front.knee < front.cost.size


@pytest.mark.slow
def test_too_many_failed_designs_on_the_kernel_stop_the_search(prepared, quantile, monkeypatch):
    answer = QuantileResponse.__call__

    def failing(self, x):
        evaluation = answer(self, x)
        return replace(evaluation, status=(np.arange(len(x)) % 7 == 0).astype(np.uint8))

    monkeypatch.setattr(QuantileResponse, "__call__", failing)
    with pytest.raises(SolveError, match="2 of 14"):
        kernel_front(prepared, quantile)
