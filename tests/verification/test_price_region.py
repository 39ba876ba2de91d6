"""How wrong costs may be: ranges of one price by search, the worst of all prices by every corner."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tolalloc.allocation.cost.model import Exponential, Process, Reciprocal, ReciprocalPower, Weighted
from tolalloc.allocation.front.price_region import SAME, graded_price_ranges, price_ranges, worst_prices
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.discrete import DiscreteProblem, feature_options
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Stack
from tolalloc.exceptions import SolveError


def random_problem(generator: np.random.Generator, features: int = 4, ways: int = 1) -> AllocationProblem:
    """Return features of three cost laws in two stacks, one in quadrature and one that is not always tight."""

    def made(at: int, way: int) -> Process:
        factor = generator.uniform(0.5, 3.0)
        laws = (
            Reciprocal(factor=factor),
            ReciprocalPower(factor=factor, exponent=2.0),
            Exponential(factor=factor, scale=1.0),
        )
        low, high = (0.2, 3.0) if way == 0 else (0.1, 1.0)
        return Process(name=f"way {way}", cost=laws[at % 3], minimum=low, maximum=high, change=0.4 * way)

    weights = generator.uniform(0.5, 2.0, (2, features))
    stacks = (
        Stack(name="quadrature", worst_case=np.zeros(features), root_sum_square=weights[0], budget=2.0),
        Stack(name="sum", worst_case=weights[1], root_sum_square=np.zeros(features), budget=1.3 * features),
    )
    return AllocationProblem(
        features=tuple(
            PricedFeature(name=f"f{at}", processes=tuple(made(at, way) for way in range(ways)))
            for at in range(features)
        ),
        stacks=stacks,
    )


def priced(problem: AllocationProblem, factors: np.ndarray) -> AllocationProblem:
    """Return the problem at other prices."""
    features = tuple(
        replace(
            feature,
            processes=tuple(
                replace(made, cost=Weighted(model=made.cost, weight=float(by)), change=float(by) * made.change)
                for made in feature.processes
            ),
        )
        for feature, by in zip(problem.features, factors, strict=True)
    )
    return replace(problem, features=features)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_at_the_ends_of_its_price_a_zone_has_moved_by_a_tenth(seed):
    """Prices found by solving the whole program at every price that a root finder asks for."""
    problem = random_problem(np.random.default_rng(seed))
    optimum = process_choice.allocate(problem)
    for at, own in enumerate(price_ranges(problem, optimum)):

        def moved(by: float, at: int = at) -> float:
            factors = np.where(np.arange(4) == at, by, 1.0)
            return float(process_choice.allocate(priced(problem, factors)).zones[at] / optimum.zones[at])

        if own.low > 0:
            assert moved(own.low) == pytest.approx(1 / (1 + SAME), rel=2e-4)
        else:
            assert moved(1e-3) > 1 / (1 + SAME) - 1e-4
        if own.high < np.inf:
            assert moved(own.high) == pytest.approx(1 + SAME, rel=2e-4)
        else:
            assert moved(1e3) < 1 + SAME + 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "ways"), [(3, 1), (4, 1), (5, 2)])
def test_no_corner_of_the_prices_loses_more_than_is_proven_and_the_worst_is_found(seed, ways):
    """All 16 corners of ±20 %, each with its own cheapest zones."""
    problem = random_problem(np.random.default_rng(seed), ways=ways)
    optimum, lost = process_choice.allocate(problem), []
    for corner in product((0.8, 1.2), repeat=4):
        changed = priced(problem, np.array(corner))
        lost.append(changed.cost(optimum.zones, optimum.processes) - process_choice.allocate(changed).cost)
    found = worst_prices(problem, optimum, nodes=300)
    assert found.lost == pytest.approx(max(lost), rel=1e-5)
    assert found.most >= max(lost) - 1e-7
    assert found.most == pytest.approx(max(lost), rel=0.02)
    few = worst_prices(problem, optimum, nodes=1)
    assert few.lost <= max(lost) + 1e-7 <= few.most + 2e-7


def graded(problem: AllocationProblem) -> DiscreteProblem:
    """Return the choice of every feature among steps of a quarter."""
    steps = 0.2 * 1.25 ** np.arange(12)
    labels = [f"{step:.3g}" for step in steps]
    options = tuple(feature_options(feature, steps, labels) for feature in problem.features)
    return DiscreteProblem(problem=problem, options=options)


@pytest.mark.parametrize("seed", range(4))
def test_a_zone_keeps_its_step_just_within_the_range_of_its_price(seed):
    """Every set of steps is priced: 12 steps of four zones, half of the problems with a loss that keeps its price."""
    problem = random_problem(np.random.default_rng(seed))
    if seed % 2:
        problem = replace(problem, features=tuple(replace(own, loss=0.05) for own in problem.features))
    choice = graded(problem)
    optimum, every = choice.solve(), list(product(*(range(len(own)) for own in choice.options)))
    zones = np.array([[own[at].zone for own, at in zip(choice.options, taken, strict=True)] for taken in every])
    allowed = np.all([stack.load(zones, np.zeros((len(zones), 0))) <= stack.budget for stack in problem.stacks], axis=0)
    zones = zones[allowed]
    made = np.column_stack(
        [
            [{own.zone: own.cost - feature.loss * own.zone**2 for own in options}[zone] for zone in column]
            for feature, options, column in zip(problem.features, choice.options, zones.T, strict=True)
        ]
    )
    rest = made.sum(axis=1) + zones**2 @ problem.losses
    assert rest.min() == pytest.approx(optimum.cost)
    narrow = 0
    for at, own in enumerate(graded_price_ranges(choice, optimum)):
        for factor, keeps in (
            *((end * by, inside) for end, by, inside in ((own.low, 1.001, True), (own.low, 0.999, False)) if end),
            *((end * by, inside) for end, by, inside in ((own.high, 0.999, True), (own.high, 1.001, False))),
        ):
            if np.isfinite(factor):
                cheapest = zones[np.argmin(rest + (factor - 1) * made[:, at])]
                assert (cheapest[at] == optimum.zones[at]) == keeps
                narrow += 1
        for end, factor in ((own.low, 1e-6), (own.high, 1e6)):
            if end in (0.0, np.inf):
                cheapest = zones[np.argmin(rest + (factor - 1) * made[:, at])]
                assert cheapest[at] == optimum.zones[at]
    assert narrow > 8


def test_a_choice_that_is_not_proven_has_no_ranges():
    choice = graded(random_problem(np.random.default_rng(0)))
    optimum = choice.solve()
    with pytest.raises(SolveError, match="not proven"):
        graded_price_ranges(choice, replace(optimum, bound=0.99 * optimum.cost))
