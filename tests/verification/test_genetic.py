"""The Pareto search: exact fronts, certificates, brute force, failed designs, checkpoints that change no bit."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypervolume import hypervolume_ratio
from stack_front import LOWER, UPPER, StackProblem, stack_problem

from tests.builders import digest
from tolalloc.allocation.front.genetic import best_front, nondominated, reference_directions, search, thinned
from tolalloc.allocation.front.pareto_problem import (
    Genes,
    Objective,
    Objectives,
    knee,
    spread_over,
)
from tolalloc.allocation.search import process_choice
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError

POPULATION = 80


@pytest.fixture(scope="module")
def stack() -> StackProblem:
    return stack_problem()


@pytest.fixture(scope="module")
def exact(stack):
    """Genes of 50 designs on the exact front, from end to end."""
    ends = [np.linalg.norm(stack.weights * zone) for zone in (LOWER * 1.0001, UPPER * 0.9999)]
    return np.log([stack.optimum(budget) for budget in np.geomspace(*ends, 50)])


def cheaper_than_certified(stack, losses) -> float:
    return max(float(stack.cost_bound(budget) / cost - 1) for cost, budget in losses)


# --- against exact fronts ---


def test_the_closed_form_meets_its_dual_bound(stack, exact):
    for cost, budget in stack(exact).values:
        assert cost == pytest.approx(stack.cost_bound(budget), rel=1e-6)


@pytest.mark.parametrize("budget", [10.0, 40.0, 150.0])
def test_the_closed_form_is_what_the_convex_program_proves(stack, budget):
    problem = stack.allocation
    proven = process_choice.allocate(replace(problem, stacks=(replace(problem.stacks[0], budget=budget),)))
    assert proven.cost == pytest.approx(stack.cost_bound(budget), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_seeded_front_has_the_volume_of_the_exact_one_and_never_beats_its_certificate(stack, exact, seed):
    known = exact[spread_over(50, 8)]
    front = best_front(search(stack, known, SeedTree(seed), POPULATION, 60), POPULATION)
    assert len(front.designs) == POPULATION
    assert hypervolume_ratio(front.losses, stack(exact).values) > 0.99
    # The eight seeds alone are worth less, so the rest was found.
    assert hypervolume_ratio(stack(known).values, stack(exact).values) < 0.98
    assert cheaper_than_certified(stack, front.losses) < 1e-9


@pytest.mark.slow
def test_an_unseeded_front_comes_near_the_exact_one_from_above(stack, exact):
    found = search(stack, exact[:0], SeedTree(0), POPULATION, 100)
    assert 0.97 < hypervolume_ratio(best_front(found, POPULATION).losses, stack(exact).values) < 1.0
    assert cheaper_than_certified(stack, best_front(found, POPULATION).losses) < 1e-9
    early = replace(
        found,
        designs=found.designs[:2000],
        answers=stack(found.designs[:2000]),
    )
    every = len(found.designs)
    assert hypervolume_ratio(best_front(found, every).losses, best_front(early, every).losses) >= 1.0


@pytest.mark.slow
def test_on_ladders_the_front_is_that_of_all_combinations():
    stack = stack_problem(features=8, on_ladder=8)
    everything = stack(np.array(list(itertools.product(range(4), repeat=8)), dtype=float)).values
    front = everything[nondominated(everything)]
    found = search(stack, np.empty((0, 8)), SeedTree(0), POPULATION, 50)
    assert np.array_equal(found.designs, np.rint(found.designs))
    best = best_front(found, len(front))
    assert hypervolume_ratio(best.losses, front) > 0.99
    missing = [losses for losses in best.losses if not np.isclose(front, losses, rtol=1e-12).all(axis=1).any()]
    assert len(missing) <= 0.15 * len(best.losses)
    # Nothing that was found beats the complete enumeration.
    assert hypervolume_ratio(np.concatenate([front, best.losses]), front) == pytest.approx(1.0, abs=1e-12)


def test_mixed_genes_stay_on_their_ladders_and_above_the_certificate_of_free_zones():
    stack = stack_problem(on_ladder=4)
    found = search(stack, np.empty((0, 12)), SeedTree(3), 40, 40)
    positions, ladder = found.designs[:, :4], stack.ladder
    assert set(np.unique(positions)) == set(range(ladder.size))
    front = best_front(found, 40)
    assert np.isin(stack.zones(front.designs)[:, :4], ladder).all()
    assert cheaper_than_certified(stack, front.losses) < 0


# --- three objectives ---


@dataclass(frozen=True)
class Sphere:
    """Three objectives whose front is an eighth of the unit sphere; the last one is to be made large."""

    failing: bool = False
    budget: float = 0.0
    genes = Genes(names=tuple("abcdef"), lower=np.zeros(6), upper=np.ones(6), integer=np.zeros(6, bool))
    objectives = (Objective(name="f [-]"), Objective(name="g [-]"), Objective(name="h [-]", better="large"))
    constraints = ("always short", "kept")

    def __call__(self, designs):
        u, v = designs[:, :2].T * np.pi / 2
        radius = 1 + ((designs[:, 2:] - 0.5) ** 2).sum(axis=1)
        values = radius[:, np.newaxis] * np.column_stack([np.cos(u) * np.cos(v), np.cos(u) * np.sin(v), -np.sin(u)])
        status = ((designs[:, 3] > 0.6) & self.failing).astype(np.uint8)
        values[status > 0] = np.nan
        short = np.full(len(designs), self.budget)
        return Objectives(values=values, violation=np.column_stack([short, short - 1]), status=status)


@pytest.mark.slow
def test_three_objectives_reach_the_sphere_and_cover_it():
    found = search(Sphere(), np.empty((0, 6)), SeedTree(0), 92, 80)
    front = best_front(found, 92)
    assert (front.answers.values[:, 2] <= 0).all()
    assert (front.losses[:, 2] >= 0).all()
    assert np.linalg.norm(front.losses, axis=1).max() < 1.05
    assert np.linalg.norm(front.losses, axis=1).min() >= 1 - 1e-12
    directions = reference_directions(3, 92)
    assert len(directions) == 91
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    apart = np.arccos(np.clip(unit @ (front.losses / np.linalg.norm(front.losses, axis=1, keepdims=True)).T, -1, 1))
    assert np.median(apart.min(axis=1)) < np.radians(4)  # neighbouring directions are about 8 degrees apart


def test_searches_of_three_objectives_have_the_same_bits_while_every_design_is_violating():
    once, again = (search(Sphere(budget=0.5), np.empty((0, 6)), SeedTree(2), 24, 6) for _ in range(2))
    assert digest(once) == digest(again)
    assert digest(once) != digest(search(Sphere(budget=0.5), np.empty((0, 6)), SeedTree(3), 24, 6))


# --- failed and violating designs ---


def test_a_failed_design_loses_against_every_good_one():
    found = search(Sphere(failing=True), np.empty((0, 6)), SeedTree(0), 40, 20)
    assert 0 < found.failed < len(found.designs) / 3
    front = best_front(found, 40)
    assert front.failed == 0
    assert (front.designs[:, 3] <= 0.6).all()


def test_without_an_allowed_design_there_is_a_least_violating_one(stack):
    least = np.linalg.norm(stack.weights * LOWER)
    found = search(replace(stack, budget=0.9 * least), np.empty((0, 12)), SeedTree(0), 40, 80)
    assert not len(best_front(found, 40).designs)
    violation = found.answers.violation[found.least_violating]
    assert violation[0] >= 1 / 0.9 - 1 - 1e-12
    assert violation[0] == pytest.approx(1 / 0.9 - 1, abs=0.02)
    np.testing.assert_allclose(np.exp(found.designs[found.least_violating]), LOWER, rtol=0.2)


def test_the_blocking_constraint_is_the_one_violated_most():
    found = search(Sphere(budget=0.5), np.empty((0, 6)), SeedTree(0), 12, 2)
    violation = found.answers.violation[found.least_violating]
    assert Sphere(budget=0.5).constraints[int(violation.argmax())] == "always short"
    allowed = search(Sphere(), np.empty((0, 6)), SeedTree(0), 12, 2)
    assert (allowed.answers.violation[allowed.least_violating] <= 0).all()


def test_where_all_designs_fail_there_is_nothing_to_return():
    class Failing(Sphere):
        def __call__(self, designs):
            return replace(super().__call__(designs), status=np.ones(len(designs), np.uint8))

    found = search(Failing(), np.empty((0, 6)), SeedTree(0), 12, 3)
    with pytest.raises(SolveError, match="all of 36 designs failed"):
        _ = found.least_violating


def test_integer_genes_are_whole_and_have_one_zero():
    genes = Genes(names=("a", "b"), lower=np.zeros(2), upper=np.array([3.0, 3.0]), integer=np.array([True, False]))
    rounded = genes.rounded(np.array([[-0.3, -0.3], [3.4, 2.4], [1.6, 1.6]]))
    assert rounded.tobytes() == np.array([[0.0, 0.0], [3.0, 2.4], [2.0, 1.6]]).tobytes()
    with pytest.raises(InputError, match="range of a"):
        Genes(names=("a",), lower=np.ones(1), upper=np.zeros(1), integer=np.ones(1, bool))


def test_too_small_a_search_is_refused(stack):
    with pytest.raises(InputError, match="population and generations"):
        search(stack, np.empty((0, 12)), SeedTree(0), 2, 10)


# --- indicators ---


def test_the_knee_is_where_the_front_is_farthest_from_the_line_between_its_ends():
    angle = np.linspace(0, np.pi / 2, 101)
    circle = np.column_stack([1 - np.sin(angle), 1 - np.cos(angle)])
    assert knee(circle) == 50
    assert knee(circle * [1e3, 1e-3] + 7) == 50
    broken = np.array([[0.0, 1.0], [0.1, 0.5], [0.2, 0.1], [0.6, 0.05], [1.0, 0.0]])
    assert knee(broken) == 2


def test_volume_and_dominance_of_fronts_drawn_by_hand():
    losses = np.array([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0], [0.6, 0.6], [0.5, 0.5]])
    assert nondominated(losses).tolist() == [True, True, True, False, True]
    # Reference 1.1: ends alone 0.1·1.1 + 1.0·0.1 = 0.21, with the middle 0.21 + 0.5·0.5 = 0.46.
    assert hypervolume_ratio(losses[[0, 2]], losses) == pytest.approx(0.21 / 0.46)


def test_thinning_keeps_the_ends_and_evens_the_spacing(generator):
    at = np.sort(np.concatenate([generator.uniform(0, 0.2, 80), np.linspace(0, 1, 20)]))
    losses = np.column_stack([at, 1 - at])
    kept = thinned(losses, 15)
    assert len(kept) == 15
    assert {0, len(at) - 1} <= set(kept.tolist())
    assert np.diff(at[kept]).max() < 0.15
    assert np.array_equal(thinned(losses, 200), np.arange(100))
