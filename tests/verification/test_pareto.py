"""The Pareto search: exact fronts, certificates, brute force, failed designs, checkpoints that change no bit."""

from __future__ import annotations

import hashlib
import itertools
import pickle
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypervolume import hypervolume_ratio
from stack_front import LOWER, UPPER, StackProblem, stack_problem

from tolalloc.allocation.local_model import Side
from tolalloc.allocation.pareto.answers import Checkpoint
from tolalloc.allocation.pareto.design_problem import RADIAL_CLEARANCE, DesignProblem
from tolalloc.allocation.pareto.front import FrontEffort, pareto_front
from tolalloc.allocation.pareto.genetic import reference_directions, search
from tolalloc.allocation.pareto.indicators import knee, nondominated, spread_over, thinned
from tolalloc.allocation.pareto.problem import Genes, Objective, Objectives
from tolalloc.allocation.pareto.remembered import RememberedResponse
from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.problem import Stack
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.study.definition import Study, prepare
from tolalloc.uncertainty.seeds import SeedTree

POPULATION = 80


@pytest.fixture(scope="module")
def stack() -> StackProblem:
    return stack_problem()


@pytest.fixture(scope="module")
def exact(stack):
    """Genes of 50 designs on the exact front, from end to end."""
    ends = [np.linalg.norm(stack.weights * zone) for zone in (LOWER * 1.0001, UPPER * 0.9999)]
    return np.log([stack.optimum(room) for room in np.geomspace(*ends, 50)])


def cheaper_than_certified(stack, losses) -> float:
    return max(float(stack.cost_bound(room) / cost - 1) for cost, room in losses)


def digest(found) -> str:
    return hashlib.sha256(found.designs.tobytes() + found.answers.values.tobytes()).hexdigest()


# --- against exact fronts ---


def test_the_closed_form_meets_its_dual_bound(stack, exact):
    for cost, room in stack(exact).values:
        assert cost == pytest.approx(stack.cost_bound(room), rel=1e-6)


@pytest.mark.parametrize("room", [10.0, 40.0, 150.0])
def test_the_closed_form_is_what_the_convex_program_proves(stack, room):
    problem = stack.allocation
    proven = process_choice.allocate(replace(problem, stacks=(replace(problem.stacks[0], room=room),)))
    assert proven.cost == pytest.approx(stack.cost_bound(room), rel=1e-6)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_seeded_front_has_the_volume_of_the_exact_one_and_never_beats_its_certificate(stack, exact, seed):
    known = exact[spread_over(50, 8)]
    front = search(stack, known, SeedTree(seed), POPULATION, 60).front(POPULATION)
    assert len(front.designs) == POPULATION
    assert hypervolume_ratio(front.losses, stack(exact).values) > 0.99
    # The eight seeds alone are worth less, so the rest was found.
    assert hypervolume_ratio(stack(known).values, stack(exact).values) < 0.98
    assert cheaper_than_certified(stack, front.losses) < 1e-9


def test_an_unseeded_front_comes_near_the_exact_one_from_above(stack, exact):
    found = search(stack, exact[:0], SeedTree(0), POPULATION, 100)
    assert 0.97 < hypervolume_ratio(found.front(POPULATION).losses, stack(exact).values) < 1.0
    assert cheaper_than_certified(stack, found.front(POPULATION).losses) < 1e-9
    early = replace(
        found,
        designs=found.designs[:2000],
        answers=stack(found.designs[:2000]),
    )
    every = len(found.designs)
    assert hypervolume_ratio(found.front(every).losses, early.front(every).losses) >= 1.0


def test_on_ladders_the_front_is_that_of_all_combinations():
    stack = stack_problem(features=8, on_ladder=8)
    everything = stack(np.array(list(itertools.product(range(4), repeat=8)), dtype=float)).values
    front = everything[nondominated(everything)]
    found = search(stack, np.empty((0, 8)), SeedTree(0), POPULATION, 50)
    assert np.array_equal(found.designs, np.rint(found.designs))
    best = found.front(len(front))
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
    front = found.front(40)
    assert np.isin(stack.zones(front.designs)[:, :4], ladder).all()
    assert cheaper_than_certified(stack, front.losses) < 0


# --- three objectives ---


@dataclass(frozen=True)
class Sphere:
    """Three objectives whose front is an eighth of the unit sphere; the last one is to be made large."""

    failing: bool = False
    room: float = 0.0
    genes = Genes(names=tuple("abcdef"), lower=np.zeros(6), upper=np.ones(6), integer=np.zeros(6, bool))
    objectives = (Objective(name="f [-]"), Objective(name="g [-]"), Objective(name="h [-]", better="large"))
    constraints = ("always short", "kept")

    def __call__(self, designs):
        u, v = designs[:, :2].T * np.pi / 2
        radius = 1 + ((designs[:, 2:] - 0.5) ** 2).sum(axis=1)
        values = radius[:, np.newaxis] * np.column_stack([np.cos(u) * np.cos(v), np.cos(u) * np.sin(v), -np.sin(u)])
        status = ((designs[:, 3] > 0.6) & self.failing).astype(np.uint8)
        values[status > 0] = np.nan
        short = np.full(len(designs), self.room)
        return Objectives(values=values, violation=np.column_stack([short, short - 1]), status=status)


def test_three_objectives_reach_the_sphere_and_cover_it():
    found = search(Sphere(), np.empty((0, 6)), SeedTree(0), 92, 80)
    front = found.front(92)
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
    once, again = (search(Sphere(room=0.5), np.empty((0, 6)), SeedTree(2), 24, 6) for _ in range(2))
    assert digest(once) == digest(again)
    assert digest(once) != digest(search(Sphere(room=0.5), np.empty((0, 6)), SeedTree(3), 24, 6))


# --- failed and violating designs ---


def test_a_failed_design_loses_against_every_good_one():
    found = search(Sphere(failing=True), np.empty((0, 6)), SeedTree(0), 40, 20)
    assert 0 < found.failed < len(found.designs) / 3
    front = found.front(40)
    assert front.failed == 0
    assert (front.designs[:, 3] <= 0.6).all()


def test_without_an_allowed_design_the_least_violating_one_tells_what_blocks(stack):
    least = np.linalg.norm(stack.weights * LOWER)
    found = search(replace(stack, room=0.9 * least), np.empty((0, 12)), SeedTree(0), 40, 80)
    assert not len(found.front(40).designs)
    nearest = found.least_violating()
    assert nearest.blocking == "room"
    assert nearest.violation[0] >= 1 / 0.9 - 1 - 1e-12
    assert nearest.violation[0] == pytest.approx(1 / 0.9 - 1, abs=0.02)
    np.testing.assert_allclose(np.exp(nearest.design), LOWER, rtol=0.2)


def test_the_blocking_constraint_is_the_one_violated_most():
    found = search(Sphere(room=0.5), np.empty((0, 6)), SeedTree(0), 12, 2)
    assert found.least_violating().blocking == "always short"
    allowed = search(Sphere(), np.empty((0, 6)), SeedTree(0), 12, 2)
    assert allowed.least_violating().blocking is None


def test_where_all_designs_fail_there_is_nothing_to_return():
    class Failing(Sphere):
        def __call__(self, designs):
            return replace(super().__call__(designs), status=np.ones(len(designs), np.uint8))

    found = search(Failing(), np.empty((0, 6)), SeedTree(0), 12, 3)
    with pytest.raises(SolveError, match="all of 36 designs failed"):
        found.least_violating()


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


# --- checkpoints ---


class Interrupted(StackProblem):
    """Gives up when it is asked for the eighth generation."""

    calls = 0

    def __call__(self, designs):
        Interrupted.calls += 1
        if Interrupted.calls > 7:
            raise KeyboardInterrupt
        return super().__call__(designs)


SMALL = (24, 15)


def interrupt(stack, path, every=24):
    Interrupted.calls = 0
    broken = Interrupted(**{name: getattr(stack, name) for name in ("allocation", "ladder", "on_ladder", "room")})
    with pytest.raises(KeyboardInterrupt):
        search(broken, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=Checkpoint(path=path, every=every))


@pytest.mark.parametrize("on_ladder", [0, 12])
@pytest.mark.parametrize("every", [7, 24, 72])
def test_a_search_interrupted_at_generation_7_ends_with_the_bits_of_an_uninterrupted_one(tmp_path, on_ladder, every):
    stack = stack_problem(on_ladder=on_ladder)
    whole = search(stack, np.empty((0, 12)), SeedTree(0), *SMALL)
    interrupt(stack, tmp_path / "front.npz", every)
    with np.load(tmp_path / "front.npz") as file:
        assert 0 < len(file["designs"]) <= 7 * 24
        saved = len(file["designs"])
    asked = []

    class Counted(StackProblem):
        def __call__(self, designs):
            asked.append(len(designs))
            return super().__call__(designs)

    counted = Counted(stack.allocation, stack.ladder, stack.on_ladder)
    checkpoint = Checkpoint(path=tmp_path / "front.npz", every=every)
    resumed = search(counted, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=checkpoint)
    assert digest(resumed) == digest(whole)
    distinct = len(np.unique(whole.designs, axis=0))
    assert sum(asked) == distinct - saved + 1  # one of the saved ones is asked for again, to know the problem
    assert [path.name for path in tmp_path.iterdir()] == ["front.npz"]


def test_a_search_resumed_in_another_process_has_the_same_bits(tmp_path, stack):
    whole = search(stack, np.empty((0, 12)), SeedTree(0), *SMALL)
    interrupt(stack, tmp_path / "front.npz")
    script = (
        "import sys, hashlib, numpy as np; from pathlib import Path; sys.path.insert(0, sys.argv[1])\n"
        "from stack_front import stack_problem\n"
        "from tolalloc.allocation.pareto.answers import Checkpoint\n"
        "from tolalloc.allocation.pareto.genetic import search\n"
        "from tolalloc.uncertainty.seeds import SeedTree\n"
        f"found = search(stack_problem(), np.empty((0, 12)), SeedTree(0), *{SMALL}, "
        "checkpoint=Checkpoint(path=Path(sys.argv[2]), every=24))\n"
        "print(hashlib.sha256(found.designs.tobytes() + found.answers.values.tobytes()).hexdigest())"
    )
    here = str(Path(__file__).parent)
    command = [sys.executable, "-c", script, here, str(tmp_path / "front.npz")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == digest(whole)


def test_what_a_longer_search_left_in_the_file_does_not_change_a_shorter_one(tmp_path, stack):
    checkpoint = Checkpoint(path=tmp_path / "front.npz", every=100)
    search(stack, np.empty((0, 12)), SeedTree(0), 24, 20, checkpoint=checkpoint)
    search(stack, np.empty((0, 12)), SeedTree(1), 24, 5, checkpoint=checkpoint)
    again = search(stack, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=checkpoint)
    assert digest(again) == digest(search(stack, np.empty((0, 12)), SeedTree(0), *SMALL))


@pytest.mark.parametrize("kind", ["truncated", "damaged", "text", "pickle", "other answers", "other names"])
def test_a_checkpoint_that_does_not_fit_is_refused_by_one_sentence(tmp_path, stack, kind):
    path, problem = tmp_path / "front.npz", stack
    interrupt(stack, path)
    content = path.read_bytes()
    if kind == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif kind == "damaged":
        with np.load(path) as file:
            arrays = dict(file)
        arrays["numbers"][3, 0] *= 1.5
        np.savez(path, **arrays)
    elif kind == "text":
        path.write_text("x = 1\n")
    elif kind == "pickle":
        path.write_bytes(pickle.dumps({"designs": [1.0]}))
    elif kind == "other answers":
        problem = stack_problem(seed=6)
    else:
        problem = stack_problem(on_ladder=3)
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"checkpoint") as refusal:
        search(problem, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=Checkpoint(path=path, every=24))
    assert str(refusal.value).startswith(f"{path}: ")
    assert str(refusal.value).count(". ") == 0
    assert path.read_bytes() == before


def test_a_write_that_fails_leaves_the_old_checkpoint_whole(tmp_path, stack, monkeypatch):
    path = tmp_path / "front.npz"
    interrupt(stack, path)
    before = path.read_bytes()

    def full(file, **_):
        file.write(b"half")
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="no space"):
        search(stack, np.empty((0, 12)), SeedTree(0), *SMALL, checkpoint=Checkpoint(path=path, every=24))
    assert path.read_bytes() == before
    assert [left.name for left in tmp_path.iterdir()] == ["front.npz"]


def test_a_checkpoint_without_a_folder_is_refused_before_the_search(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        Checkpoint(path=tmp_path / "missing" / "front.npz", every=1)


# --- on the kernel ---


@pytest.fixture(scope="module")
def prepared():
    return prepare(Study(name="test"))


@pytest.fixture(scope="module")
def quantile(prepared) -> QuantileResponse:
    errors = prepared.space.errors
    uniform = SeedTree(8).uniform_chunk(0, len(errors.columns))[:16]
    return QuantileResponse(
        space=prepared.space, kernel=prepared.kernel, standard=errors.standard_values(uniform), spread=2.5
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
    groups, design = len(space.groups), space.uniform(1.0, prepared.reducer.modification)
    stack = Stack(
        name="lost motion", adding=np.zeros(groups), spreading=np.ones(groups), room=2.0, slopes=np.array([0.0, 0.1])
    )
    side = Side(sign=1, limit=0.5, value=0.4, doubt=0.01, scale=0.5, stack=stack)
    problem = DesignProblem(space=space, quantile=quantile, further=(RADIAL_CLEARANCE,), sides=(side,))
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


def kernel_front(prepared, quantile, **options):
    space = prepared.space
    unit = np.random.default_rng(1).random((14, space.lower.size))
    designs = space.lower * (space.upper / space.lower) ** unit
    return pareto_front(quantile, rough, designs[:10], designs[10:], SeedTree(4), EFFORT, **options)


def test_the_front_on_the_kernel_goes_on_from_its_checkpoint_with_the_same_bits(prepared, quantile, tmp_path):
    whole, surrogate = kernel_front(prepared, quantile)
    checked = np.flatnonzero(~np.isnan(whole.on_kernel))
    assert len(checked) == min(EFFORT.points, whole.cost.size)
    np.testing.assert_array_equal(quantile(whole.designs[checked]).values[:, 0], whole.on_kernel[checked])
    assert nondominated(np.column_stack([whole.cost, whole.quantile])).all()
    assert whole.failed == 0
    if not surrogate.earns_its_place:  # then the kernel itself was searched
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
    remembered = RememberedResponse(quantile, checkpoint)
    assert remembered.outputs == quantile.outputs


def test_on_the_kernel_ladders_and_a_third_objective_hold(prepared, quantile):
    space = prepared.space
    ladders = {group: ladder_of(space, group) for group in space.groups[:2]}
    front, _ = kernel_front(prepared, quantile, ladders=ladders, further=(RADIAL_CLEARANCE,))
    np.testing.assert_array_equal(front.further[:, 0], front.designs[:, -1])
    for at, ladder in enumerate(ladders.values()):
        assert np.isclose(front.designs[:, at, np.newaxis], ladder, rtol=1e-12).any(axis=1).all()
    assert nondominated(np.column_stack([front.cost, front.quantile, -front.further])).all()
    assert 0 <= front.knee < front.cost.size


def test_too_many_failed_designs_on_the_kernel_stop_the_search(prepared, quantile, monkeypatch):
    answer = QuantileResponse.__call__

    def failing(self, x):
        evaluation = answer(self, x)
        return replace(evaluation, status=(np.arange(len(x)) % 7 == 0).astype(np.uint8))

    monkeypatch.setattr(QuantileResponse, "__call__", failing)
    with pytest.raises(SolveError, match="2 of 14"):
        kernel_front(prepared, quantile)
