"""A front with competing processes, each search going on from its neighbour, against searches that each begin anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.verification.test_process_choice import random_problem
from tolalloc.allocation.cost.model import Exponential, PowerExponential, Process, Reciprocal, ReciprocalPower
from tolalloc.allocation.cost.points import Points, Tabulated
from tolalloc.allocation.search.lagrange_dual import LeastPriced
from tolalloc.allocation.search.process_choice import BudgetSeries, allocate
from tolalloc.allocation.space.problem import LeastInfeasible, Solution


@pytest.mark.slow
@pytest.mark.parametrize("stacks", [1, 2])
def test_it_is_that_of_single_searches(stacks):
    problem = random_problem(11, features=5, processes=3, stacks=stacks, worst_case=0.3 * (stacks - 1), tightness=0.5)
    first, *others = problem.stacks
    budgets = first.budget * np.array([0.01, 0.5, 0.6, 0.8, 1.0])
    rows, series = np.tile([own.budget for own in problem.stacks], (budgets.size, 1)), BudgetSeries(problem)
    rows[:, 0] = budgets
    found = [series.allocate(row) for row in rows]
    for budget, own in zip(budgets.tolist(), found, strict=True):
        alone = allocate(replace(problem, stacks=(replace(first, budget=budget), *others)))
        assert type(own) is type(alone)
        if isinstance(own, Solution) and isinstance(alone, Solution):
            assert own.cost == pytest.approx(alone.cost, rel=2e-9)
            assert max(own.bound, alone.bound) <= min(own.cost, alone.cost) * (1 + 1e-12)
    assert isinstance(found[0], LeastInfeasible)
    assert len({tuple(own.processes) for own in found[1:]}) > 1


@pytest.mark.parametrize("square", [0.0, 0.4])
def test_the_least_priced_cost_of_every_form_is_that_of_a_fine_grid_and_never_above(square, generator):
    points = Points(zones=(1.0, 2.0, 5.0, 9.0), costs=(9.0, 5.0, 3.0, 2.5))
    costs = [
        *(Reciprocal(factor=factor) for factor in (2.0, 7.0)),
        *(ReciprocalPower(factor=3.0, exponent=exponent) for exponent in (0.6, 1.4)),
        *(Exponential(factor=8.0, scale=2.0), PowerExponential(factor=4.0, exponent=0.5, scale=3.0), Tabulated(points)),
    ]
    made = [
        Process(name="p", cost=cost, minimum=1.0, maximum=8.0 - at, change=0.1 * at) for at, cost in enumerate(costs)
    ]
    linear = generator.uniform(0, 2, len(made)) * (np.arange(len(made)) != 1)  # one zone has no price
    forms = LeastPriced.by_form(made)
    assert len(forms) == 5
    for alike in forms:
        squares = np.full(alike.places.size, square)
        least, zones = alike.found(linear[alike.places], squares)
        for at, value, zone in zip(alike.places, least, zones, strict=True):
            grid = np.linspace(made[at].minimum, made[at].maximum, 200_001)
            best = (made[at].total(grid) + linear[at] * grid + square * grid**2).min()
            assert best * (1 - 1e-7) <= value <= best * (1 + 1e-12)
            assert made[at].minimum <= zone <= made[at].maximum
