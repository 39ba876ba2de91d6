"""The mathematics of allocation against finite differences, brute force by scipy, and random designs."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from tests.random_cases import seeds
from tolalloc.allocation.cost.model import Exponential, Process, Reciprocal
from tolalloc.allocation.search.convex_program import ConvexProgram
from tolalloc.allocation.search.lagrange_dual import LagrangeDual, cost_bound
from tolalloc.allocation.search.process_choice import allocate, second_best
from tolalloc.allocation.space.problem import (
    AllocationProblem,
    LeastInfeasible,
    PricedFeature,
    Shared,
    Solution,
    Stack,
    least_infeasible,
)
from tolalloc.exceptions import InputError

KINDS = {
    "root_sum_square": {"stacks": 1},
    "root_sum_square twice": {"stacks": 2},
    "worst_case too": {"stacks": 2, "worst_case": 0.3},
    "shared variables": {"stacks": 2, "worst_case": 0.3, "shared": 2},
}


def overlapping_processes(generator: np.random.Generator, count: int, unit: float) -> tuple[Process, ...]:
    """Return processes whose total costs cross, so that which is best depends on the budget."""
    low, fixed, factor, made = generator.uniform(0.01, 0.06), generator.uniform(5, 12), generator.uniform(0.02, 0.1), []
    for at in range(count):
        cost = (
            Exponential(fixed=float(fixed), factor=float(3 * factor / low), scale=float(low * unit))
            if at == 1
            else Reciprocal(fixed=float(fixed), factor=float(factor * unit))
        )
        high = low * generator.uniform(2, 5)
        made.append(Process(name=f"process {at}", cost=cost, minimum=float(low * unit), maximum=float(high * unit)))
        meeting = low * generator.uniform(1.8, 2.5)
        wider = factor * generator.uniform(2, 6)
        fixed = max(fixed + factor / meeting - wider / meeting * generator.uniform(0.7, 1.1), 0.2)
        factor, low = wider, low * generator.uniform(1.3, 2.2)
    return tuple(made)


def random_problem(
    seed: int,
    features: int = 4,
    processes: int = 3,
    stacks: int = 1,
    worst_case: float = 0.0,
    shared: int = 0,
    unit: float = 1.0,
    tightness: float = 0.35,
) -> AllocationProblem:
    generator = np.random.default_rng(seed)
    made = tuple(
        PricedFeature(
            name=f"feature {at}",
            processes=overlapping_processes(generator, processes, unit),
            loss=float(generator.uniform(0, 5) / unit**2),
        )
        for at in range(features)
    )
    smallest = np.array([feature.processes[0].minimum for feature in made])
    largest = np.array([max(process.maximum for process in feature.processes) for feature in made])
    kept = []
    for at in range(stacks):
        stack = Stack(
            name=f"stack {at}",
            worst_case=worst_case * generator.uniform(0.1, 1, features),
            root_sum_square=generator.uniform(0.1, 2, features),
            budget=1.0,
            slopes=0.01 * unit * generator.normal(size=shared),
        )
        none, low, high = np.zeros(shared), 0.0, 0.0
        low, high = float(stack.load(smallest, none)), float(stack.load(largest, none))
        kept.append(replace(stack, budget=low + tightness * (high - low)))
    box = Shared(names=tuple(f"shared {at}" for at in range(shared)), lower=-np.ones(shared), upper=np.ones(shared))
    return AllocationProblem(features=made, stacks=tuple(kept), shared=box)


def least_by_scipy(problem: AllocationProblem, choice: tuple[int, ...]) -> float:
    """Return the least cost of one choice of processes, infinite where none was found."""
    made = [feature.processes[at] for feature, at in zip(problem.features, choice, strict=True)]
    low, high = (np.array([getattr(process, end) for process in made]) for end in ("minimum", "maximum"))
    count, box = len(made), problem.shared

    def cost(x):
        return problem.cost(x[:count] * high, np.array(choice))

    def slope(x):
        zones = x[:count] * high
        own = [float(process.cost.slope(np.array(zone))) for process, zone in zip(made, zones, strict=True)]
        return np.concatenate([(np.array(own) + 2 * problem.losses * zones) * high, np.zeros(box.lower.size)])

    def left(x):
        return -problem.violation(x[:count] * high, x[count:]) / problem.scales

    run = minimize(
        cost,
        np.concatenate([low / high, np.zeros(box.lower.size)]),
        jac=slope,
        bounds=[*zip(low / high, np.ones(count), strict=True), *zip(box.lower, box.upper, strict=True)],
        constraints={"type": "ineq", "fun": left},
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 500},
    )
    return float(run.fun) if left(run.x).min() >= -1e-9 else np.inf


def solved(problem: AllocationProblem) -> Solution:
    found = allocate(problem)
    assert isinstance(found, Solution)
    return found


def compiled(problem: AllocationProblem, at: int = 0) -> ConvexProgram:
    return ConvexProgram(problem.features, np.full(len(problem.features), at), len(problem.stacks), problem.shared)


def one_process(problem: AllocationProblem) -> AllocationProblem:
    features = tuple(replace(feature, processes=feature.processes[:1]) for feature in problem.features)
    return replace(problem, features=features)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", seeds(3, quick=1))
def test_the_best_and_second_best_are_those_of_a_brute_force(kind, seed):
    problem = random_problem(seed, **KINDS[kind])
    known = sorted((least_by_scipy(problem, choice), choice) for choice in product(range(3), repeat=4))
    best = solved(problem)
    second = second_best(problem, best)
    assert second is not None
    for found, (cost, choice) in zip((best, second), known, strict=False):
        assert found.cost == pytest.approx(cost, rel=1e-8)
        assert tuple(found.processes) == choice
        assert found.bound <= cost * (1 + 1e-10)
        assert found.gap <= 1e-8
        assert (problem.violation(found.zones, found.shared) / problem.scales).max() <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_any_prices_and_directions_bound_the_best_cost(kind, generator):
    problem = random_problem(7, **KINDS[kind])
    least = min(least_by_scipy(problem, choice) for choice in product(range(3), repeat=4))
    dual = LagrangeDual(problem)
    allowed = np.ones(dual.feature.size, dtype=bool)
    bounds = []
    for _ in range(300):
        prices = dual.span / problem.scales * 10.0 ** generator.uniform(-4, 3, len(problem.stacks))
        priced = dual.price(prices, dual.planes(generator.random(4)))
        bounds.append(dual.bound(priced, allowed))
    assert max(bounds) <= least * (1 + 1e-10)
    assert max(bounds) > dual.bound(dual.price(np.zeros(len(problem.stacks)), dual.planes(np.ones(4))), allowed)
    assert cost_bound(problem, np.zeros(len(problem.stacks)), generator.random(4)) <= least * (1 + 1e-10)


def test_a_shared_variable_is_priced_at_its_cheaper_end():
    dual = LagrangeDual(random_problem(4, features=2, shared=3, stacks=2))
    prices, box = np.array([0.7, 1.9]), dual.problem.shared
    found = dual.price(prices, dual.planes(np.ones(2)))
    slope = prices @ np.array([stack.slopes for stack in dual.problem.stacks])
    corners = np.array(list(product(*zip(box.lower, box.upper, strict=True))))
    assert slope @ found.shared == (corners @ slope).min() < (corners @ slope).max()


@pytest.mark.parametrize("kind", KINDS)
def test_no_random_design_is_cheaper_than_the_bound(kind, generator):
    problem = random_problem(3, **KINDS[kind], tightness=0.6)
    best, cheapest = solved(problem), np.inf
    for _ in range(3000):
        choice = generator.integers(0, 3, 4)
        made = [feature.processes[at] for feature, at in zip(problem.features, choice, strict=True)]
        zones = np.array([generator.uniform(process.minimum, process.maximum) for process in made])
        shared = generator.uniform(problem.shared.lower, problem.shared.upper)
        if problem.violation(zones, shared).max() <= 0:
            cheapest = min(cheapest, problem.cost(zones, choice))
    assert best.bound <= cheapest < 1.5 * best.cost


@pytest.mark.parametrize("kind", KINDS)
def test_a_bound_from_poor_prices_is_polished_to_the_cost(kind):
    problem = one_process(random_problem(5, **KINDS[kind]))
    cost = solved(problem).cost
    zones = np.array([feature.processes[0].maximum for feature in problem.features])
    prices = 0.1 * LagrangeDual(problem).span / problem.scales
    assert cost * (1 - 1e-5) <= cost_bound(problem, prices, zones) <= cost * (1 + 1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_prices_are_the_derivatives_of_the_least_cost(kind):
    """Central differences over ±0.01 % of the budget and of each bound; their own error is of the order of 1e-7."""
    problem = random_problem(11, features=6, **KINDS[kind])
    program, made = compiled(problem), [feature.processes[0] for feature in problem.features]
    least = np.array([process.minimum for process in made])
    most = np.array([process.maximum for process in made])
    low, high = 1.05 * least, 0.6 * most + 0.4 * least
    middle = program.solve(problem.stacks, low, high)
    assert middle is not None
    scale = middle.cost / problem.scales

    def cost(stacks, lower, upper):
        found = program.solve(stacks, lower, upper)
        assert found is not None
        return found.cost

    for at, stack in enumerate(problem.stacks):
        step = 1e-4 * stack.budget
        ends = [
            cost(
                [*problem.stacks[:at], replace(stack, budget=stack.budget + way), *problem.stacks[at + 1 :]], low, high
            )
            for way in (-step, step)
        ]
        assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(middle.prices[at], rel=1e-3, abs=1e-5 * scale[at])
    for at in range(6):
        move = 1e-4 * low[at] * np.eye(6)[at]
        by_low = (cost(problem.stacks, low + move, high) - cost(problem.stacks, low - move, high)) / (2 * move[at])
        by_high = (cost(problem.stacks, low, high - move) - cost(problem.stacks, low, high + move)) / (2 * move[at])
        allowance = 1e-4 * middle.cost / low[at]
        np.testing.assert_allclose([by_low, by_high], middle.bound_prices[at], rtol=1e-2, atol=allowance)
    assert middle.bound_prices.max() > 0
    assert middle.prices.max() > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_answer_is_the_same_in_millimetres_micrometres_and_metres(kind):
    first, *others = (random_problem(2, unit=unit, **KINDS[kind]) for unit in (1.0, 1e3, 1e-3))
    known = solved(first)
    for problem, unit in zip(others, (1e3, 1e-3), strict=True):
        again = solved(problem)
        assert again.cost == pytest.approx(known.cost, rel=1e-9)
        assert again.bound == pytest.approx(known.bound, rel=1e-8)
        np.testing.assert_array_equal(again.processes, known.processes)
        np.testing.assert_allclose(again.zones / unit, known.zones, rtol=1e-4)
        np.testing.assert_allclose(again.prices * unit, known.prices, rtol=1e-3, atol=1e-6 * known.prices.max())


@pytest.mark.parametrize("seed", range(4))
def test_the_least_infeasible_design_is_that_of_a_search_over_zones_and_shared_variables(seed):
    problem = random_problem(seed, stacks=3, worst_case=0.3, shared=2, tightness=-0.6)
    found = allocate(problem)
    assert isinstance(found, LeastInfeasible)
    low = np.array([feature.processes[0].minimum for feature in problem.features])
    largest = []
    for start in (0.0, 0.5, -0.5):
        run = minimize(
            lambda x: x[-1],
            np.concatenate([[1.5] * 4, [start, start], [5.0]]),
            bounds=[*[(1.0, 3.0)] * 4, (-1, 1), (-1, 1), (None, None)],
            constraints={
                "type": "ineq",
                "fun": lambda x: x[-1] - problem.violation(x[:4] * low, x[4:6]) / problem.scales,
            },
            method="SLSQP",
            options={"ftol": 1e-12},
        )
        largest.append(run.fun)
    assert found.largest == pytest.approx(min(largest), rel=1e-7)
    assert found.largest > 0
    np.testing.assert_array_equal(found.zones, low)
    worst = problem.stacks[int(np.argmax(found.violations))].name
    assert worst in found.blocking


def test_without_shared_variables_the_tightest_stack_blocks():
    problem = random_problem(1, stacks=2)
    tight = replace(problem.stacks[1], budget=problem.stacks[1].budget / 50)
    found = allocate(replace(problem, stacks=(problem.stacks[0], tight)))
    assert isinstance(found, LeastInfeasible)
    assert found.blocking == ("stack 1",)
    load = float(tight.load(np.array([feature.processes[0].minimum for feature in problem.features]), np.empty(0)))
    assert found.violations[1] == pytest.approx(load / tight.budget - 1, rel=1e-12)
    assert compiled(problem).solve([problem.stacks[0], tight]) is None
    assert compiled(problem).least_infeasible([problem.stacks[0], tight]).blocking == ("stack 1",)


def test_a_room_that_only_the_smallest_zones_keep_has_that_one_design():
    problem = random_problem(4, processes=1)
    zones = np.array([feature.processes[0].minimum for feature in problem.features])
    stack = replace(problem.stacks[0], budget=float(problem.stacks[0].load(zones, np.empty(0))))
    found = solved(replace(problem, stacks=(stack,)))
    np.testing.assert_allclose(found.zones, zones, rtol=1e-4)
    assert found.gap <= 1e-6


def test_the_feasible_shared_variables_of_the_linear_program_are_found():
    """One stack is relieved by what loads the other: feasible only in between."""
    zones = (Process(name="only", cost=Reciprocal(factor=1.0), minimum=1.0, maximum=2.0),)
    one = np.ones(1)
    stacks = tuple(
        Stack(name=name, worst_case=one, root_sum_square=0 * one, budget=1.25, slopes=np.array([slope]))
        for name, slope in (("up", 1.0), ("down", -1.0))
    )
    shared = Shared(names=("offset",), lower=np.array([-1.0]), upper=np.array([3.0]))
    problem = AllocationProblem(features=(PricedFeature(name="one", processes=zones),), stacks=stacks, shared=shared)
    found = solved(problem)
    assert found.shared[0] == pytest.approx(0.0, abs=1e-6)
    assert found.zones[0] == pytest.approx(1.25, rel=1e-9)
    np.testing.assert_allclose(found.prices.sum(), 1 / 1.25**2, rtol=1e-6)
    tight = replace(problem, stacks=tuple(replace(stack, budget=0.9) for stack in stacks))
    known = linprog([0, 1], A_ub=[[1 / 0.9, -1], [-1 / 0.9, -1]], b_ub=[-0.1 / 0.9] * 2, bounds=[(-1, 3), (None, None)])
    assert least_infeasible(tight).largest == pytest.approx(known.fun, rel=1e-9)
    assert least_infeasible(tight).blocking == ("up", "down")


@pytest.mark.slow
def test_many_features_are_allocated_with_a_proof_and_no_neighbour_is_cheaper():
    problem = random_problem(1, features=12, stacks=2, worst_case=0.2)
    best = solved(problem)
    second = second_best(problem, best)
    assert best.gap <= 1e-7
    assert second is not None
    assert second.cost >= best.cost * (1 - 1e-9)
    for at, other in product(range(12), range(3)):
        processes = best.processes.copy()
        processes[at] = other
        if other == best.processes[at]:
            continue
        found = ConvexProgram(problem.features, processes, 2, problem.shared).solve(problem.stacks)
        assert found is None or found.cost >= second.cost * (1 - 1e-9)


@pytest.mark.slow
def test_alike_features_are_not_told_apart():
    """Without that, a thousand permutations of the best would have to be ruled out one by one."""
    model = random_problem(0, features=2).features[0]
    features = tuple(replace(model, name=f"feature {at}", loss=0.0) for at in range(12))
    low = np.sqrt(12) * model.processes[0].minimum
    high = np.sqrt(12) * max(process.maximum for process in model.processes)
    stack = Stack(
        name="sum", worst_case=np.zeros(12), root_sum_square=np.ones(12), budget=float(low + 0.2 * (high - low))
    )
    problem = AllocationProblem(features=features, stacks=(stack,))
    best = solved(problem)
    second = second_best(problem, best)
    counts = [(a, b, 12 - a - b) for a in range(13) for b in range(13 - a)]
    known = []
    for count in counts:
        found = ConvexProgram(features, np.repeat(np.arange(3), count), 1, problem.shared).solve(problem.stacks)
        if found is not None:
            known.append((found.cost, count))
    known.sort()
    assert second is not None
    for found, (cost, count) in zip((best, second), known, strict=False):
        assert found.cost == pytest.approx(cost, rel=1e-9)
        assert tuple(np.bincount(found.processes, minlength=3)) == count
        assert found.gap <= 1e-8


@pytest.mark.slow
def test_a_search_that_ends_early_says_so_in_its_gap():
    problem = random_problem(2, features=12, stacks=2, worst_case=0.2)
    early, whole = allocate(problem, most_nodes=1), solved(problem)
    assert isinstance(early, Solution)
    assert early.bound <= whole.cost <= early.cost
    assert early.gap >= whole.gap


def test_the_front_falls_with_the_room_and_is_proven():
    problem = random_problem(6, features=8, stacks=2)
    program, stack = compiled(problem), problem.stacks[0]
    low = float(stack.load(program.lower, np.empty(0)))
    high = float(stack.load(program.upper, np.empty(0)))
    budgets = np.linspace(0.9 * low, high, 12)
    found = [program.solve((replace(stack, budget=own), *problem.stacks[1:])) for own in budgets.tolist()]
    assert [design is None for design in found] == list(budgets < low)
    costs = np.array([design.cost for design in found if design is not None])
    assert (np.diff(costs) <= 1e-9 * costs[1:]).all()
    assert (np.diff(costs, 2) >= -1e-8 * costs[0]).all()  # convex in the budget
    assert max(design.gap for design in found if design is not None) <= 1e-8


def test_the_program_is_compiled_once(monkeypatch):
    problem = random_problem(6, stacks=2)
    program = compiled(problem)
    program.solve(problem.stacks)
    monkeypatch.setattr("cvxpy.problems.problem.Problem._construct_chain", None)
    again = program.solve([replace(stack, budget=1.1 * stack.budget) for stack in problem.stacks])
    assert again is not None


@dataclass(frozen=True)
class Stepwise:
    is_convex = False

    def value(self, zone):
        return np.asarray(2.0 - np.tanh(zone - 3.0))

    def slope(self, zone):
        return np.asarray(-1 / np.cosh(zone - 3.0) ** 2)

    def expression(self, zone, cvx):
        return cvx.tanh(zone)

    def rescaled(self, unit):
        return self


def test_a_cost_that_is_not_convex_is_refused_by_name():
    stepwise = Process(name="stepwise", cost=Stepwise(), minimum=1.0, maximum=5.0)
    problem = random_problem(0)
    bad = replace(problem, features=(PricedFeature(name="bore", processes=(stepwise,)), *problem.features[1:]))
    for refuse in (lambda: allocate(bad), lambda: compiled(bad), lambda: cost_bound(bad, np.ones(1), np.ones(4))):
        with pytest.raises(InputError, match=r"feature bore: process stepwise.*not convex"):
            refuse()
    with pytest.raises(InputError, match="stack up: worst_case"):
        Stack(name="up", worst_case=np.array([-1.0]), root_sum_square=np.ones(1), budget=1.0)
    with pytest.raises(InputError, match="loss"):
        replace(problem.features[0], loss=-1.0)


def test_program_of_a_reducer_whose_first_solves_end_in_rounding_is_solved():
    """Five limits, one of which hardly leaves room: the interior-point solver broke off with all usual settings."""
    held = json.loads((Path(__file__).parent / "hard_program.json").read_text(encoding="utf-8"))
    features = tuple(
        PricedFeature(
            name=str(at),
            processes=(
                Process(
                    name="as today",
                    cost=Reciprocal(factor=own["cost"][0], fixed=own["cost"][1]),
                    minimum=own["minimum"],
                    maximum=own["maximum"],
                ),
            ),
        )
        for at, own in enumerate(held["features"])
    )
    stacks = tuple(
        Stack(**{name: np.array(value) if isinstance(value, list) else value for name, value in own.items()})
        for own in held["stacks"]
    )
    names, bounds = tuple(held["shared"]["names"]), held["shared"]
    shared = Shared(names=names, lower=np.array(bounds["lower"]), upper=np.array(bounds["upper"]))
    found = ConvexProgram(features, np.zeros(len(features), int), len(stacks), shared).solve(stacks)
    assert found is not None
    assert found.gap < 1e-6
    for stack in stacks:
        assert stack.load(found.zones, found.shared) <= stack.budget + 1e-6 * abs(stack.budget)
