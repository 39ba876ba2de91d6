"""The design is SALib's in any chunks; blocks are added until the order is stable; dependent sources rank as one."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from SALib.analyze.sobol import analyze
from SALib.sample import sobol as salib

from tests.builders import sizes
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.saltelli import SAMPLES_AT_ONCE, SaltelliDesign, saltelli_indices
from tolalloc.sensitivity.sobol import OTHERS, SobolAnalysis, sobol_indices

FACTOR_GROUPS = ("a", "b", "b", "c", "a", "d")
CORRELATED = Correlation(pairs=(Pair(one="a", other="c", correlation=-0.6),))


@dataclass(frozen=True)
class Linear:
    """Weighted sums of the columns, one per output, which remember how often they were asked."""

    weights: np.ndarray
    columns: tuple[str, ...]
    broken: tuple[int, ...] = ()
    asked: list[int] = field(default_factory=list)

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(f"y{at} [-]" for at in range(len(self.weights)))

    def __call__(self, x: np.ndarray) -> Evaluation:
        # No matrix product: an output must not depend on the others to the last bit.
        values = np.stack([(x * weight).sum(axis=1) for weight in self.weights], axis=1)
        start = sum(self.asked)
        for row in self.broken:
            if start <= row < start + len(x):
                values[row - start, 0] = np.nan
        self.asked.append(len(x))
        return Evaluation(values=values, status=np.zeros(len(x), np.uint8))


def analysis(
    weights: list[list[float]], effort: SobolEffort, seed: int = 1, share: float = 0.01, **options
) -> SobolAnalysis:
    errors = sizes("abcde"[: len(weights[0])])
    response = Linear(np.array(weights), errors.columns, **options)
    return sobol_indices(Experiment.of(response, errors, SeedTree(seed), share), effort)


def fixed(blocks: int, **options: object) -> SobolEffort:
    return SobolEffort(start=blocks, limit=blocks, **options)


def same_indices(one: SobolAnalysis, two: SobolAnalysis) -> None:
    for name in ("first", "total", "first_resamples", "total_resamples", "variance", "variance_left_out"):
        np.testing.assert_array_equal(getattr(one.indices, name), getattr(two.indices, name))


@pytest.mark.parametrize("second_order", [False, True])
@pytest.mark.parametrize("factor_groups", [FACTOR_GROUPS, ("a",), tuple("abcd")])
@pytest.mark.parametrize("blocks", [1, 64, 2048])
def test_the_samples_are_those_of_salib_bit_for_bit(factor_groups, second_order, blocks):
    columns = len(factor_groups)
    names = [f"x{at}" for at in range(columns)]
    problem = {"num_vars": columns, "names": names, "groups": list(factor_groups), "bounds": [[0.0, 1.0]] * columns}
    design = SaltelliDesign(factor_groups=factor_groups, seed=7, second_order=second_order, replicates=1)
    theirs = salib.sample(problem, blocks, calc_second_order=second_order, seed=7)
    ours = list(design.chunks(0, blocks))
    np.testing.assert_array_equal(np.concatenate(ours), theirs)
    assert all(len(chunk) % design.samples_per_block == 0 and len(chunk) <= SAMPLES_AT_ONCE for chunk in ours)
    assert design.names == tuple(dict.fromkeys(factor_groups))


def test_a_larger_design_begins_with_the_smaller_one_wherever_it_is_resumed():
    design = SaltelliDesign(factor_groups=FACTOR_GROUPS, seed=3)
    whole = np.concatenate(list(design.chunks(0, 4096)))
    for stops in ((64, 128, 4096), (2048, 4096), (1, 2, 4, 3000, 4096)):
        parts = [chunk for start, stop in zip((0, *stops), stops, strict=False) for chunk in design.chunks(start, stop)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_replicates_take_turns_and_each_is_salibs_design_with_a_seed_of_its_own():
    design = SaltelliDesign(factor_groups=FACTOR_GROUPS, seed=3, replicates=4)
    blocks = np.concatenate(list(design.chunks(0, 256))).reshape(64, 4, design.samples_per_block, -1)
    alone = replace(design, replicates=1)
    np.testing.assert_array_equal(blocks[:, 0].reshape(-1, 6), np.concatenate(list(alone.chunks(0, 64))))
    for one, other in ((0, 1), (1, 2), (2, 3)):
        assert (blocks[:, one] != blocks[:, other]).all()
    for own in np.moveaxis(blocks, 1, 0):  # each is a net: one point of A in each 64th of every column
        assert (np.sort(np.floor(own[:, 0] * 64), axis=0) == np.arange(64)[:, np.newaxis]).all()
    with pytest.raises(InputError, match="replicates is 0"):
        replace(design, replicates=0)


def test_seed_zero_is_refused_by_the_design_and_fine_for_the_analysis():
    with pytest.raises(InputError, match="seed is 0"):
        SaltelliDesign(factor_groups=("a",), seed=0)
    one, two, other = (analysis([[1.0, 2.0]], fixed(64), seed) for seed in (0, 0, 1))
    same_indices(one, two)
    assert (one.indices.total != other.indices.total).any()


@pytest.mark.slow
def test_a_block_larger_than_a_chunk_is_a_chunk():
    design = SaltelliDesign(factor_groups=tuple(f"x{at}" for at in range(SAMPLES_AT_ONCE)), seed=1)
    chunk = next(design.chunks(0, 4))
    assert chunk.shape == (SAMPLES_AT_ONCE + 2, SAMPLES_AT_ONCE)


def test_blocks_are_added_until_the_order_is_stable_and_none_is_evaluated_twice():
    errors = sizes("abcd")
    response = Linear(np.array([[1.0, 1.05, 0.3, 0.1]]), errors.columns)
    effort = SobolEffort(start=16, limit=4096, places=4, probability=0.95)
    found = sobol_indices(Experiment.of(response, errors, SeedTree(2)), effort)
    steps = found.convergence.history
    assert found.convergence.stable
    assert len(steps) > 1
    assert all(step.probability < 0.95 for step in steps[:-1])
    assert steps[-1].probability >= 0.95
    assert steps[-1].first == (1, 0, 2, 3)
    assert sum(response.asked) == found.samples == steps[-1].blocks * 6
    same_indices(found, analysis([[1.0, 1.05, 0.3, 0.1]], fixed(steps[-1].blocks), seed=2))


def test_outputs_that_do_not_count_are_asked_for_in_the_first_blocks_alone():
    weights, errors = np.array([[0.2, 1.0, 1.0, 1.0], [1.0, 0.99, 0.98, 0.1]]), sizes("abcd")
    both, second = Linear(weights, errors.columns), Renamed(weights[1:], errors.columns)
    effort = SobolEffort(start=16, limit=64, places=4, probability=0.999)
    found = sobol_indices(
        Experiment.of(both, errors, SeedTree(2)), effort, ranked=("y1 [-]",), further=lambda _: second
    )
    assert (sum(both.asked), sum(second.asked)) == (16 * 6, 48 * 6)
    whole = sobol_indices(Experiment.of(both, errors, SeedTree(2)), fixed(64), ranked=("y1 [-]",))
    first = sobol_indices(Experiment.of(both, errors, SeedTree(2)), fixed(16), ranked=("y1 [-]",))
    for output, own in (("y1 [-]", whole), ("y0 [-]", first)):
        np.testing.assert_array_equal(found.of(output).total, own.of(output).total)
        np.testing.assert_array_equal(found.of(output).first_resamples, own.of(output).first_resamples)
        assert found.of(output).blocks == own.of(output).blocks
    np.testing.assert_array_equal(found.overall.total, whole.overall.total)


def test_further_blocks_tell_the_eight_largest_apart_and_take_the_rest_together():
    """Of twelve parts of a sum each has the share of its weight squared, and so have the rest together."""
    weights = np.array([2.0, 0.1, 1.8, 0.2, 1.6, 1.4, 0.1, 1.2, 1.0, 0.8, 0.05, 0.6])
    errors = sizes("abcdefghijkl")
    response = Linear(np.stack([weights, weights[::-1]]), errors.columns)
    asked = Linear(weights[np.newaxis], errors.columns)
    effort = SobolEffort(start=64, limit=512, places=8, probability=0.9999)
    found = sobol_indices(Experiment.of(response, errors, SeedTree(3)), effort, further=lambda _: asked)
    assert found.together is not None
    assert found.small == {1, 3, 6, 10}
    assert found.samples == 64 * 14 + 64 + 448 * 11 == effort.counted(12)
    truth, own = weights**2 / (weights @ weights), found.of(0)
    error = own.total_resamples.std(axis=0)
    assert (np.abs(own.total - truth) <= 4 * error).all()
    rest, at = truth[sorted(found.small)].sum(), found.together.sources.index(OTHERS)
    assert abs(found.together.total[at] - rest) <= 4 * found.together.total_resamples.std(axis=0)[at]
    # What 512 blocks of all twelve say of the eight, they say with fewer samples, to rounding.
    whole = sobol_indices(Experiment.of(asked, errors, SeedTree(3)), fixed(512)).of(0)
    largest = [at for at in range(12) if at not in found.small]
    np.testing.assert_allclose(own.total_resamples[:, largest], whole.total_resamples[:, largest], rtol=1e-12)
    first = sobol_indices(Experiment.of(response, errors, SeedTree(3)), fixed(64))
    np.testing.assert_array_equal(own.total[sorted(found.small)], first.of(0).total[sorted(found.small)])
    np.testing.assert_array_equal(found.of(1).total, first.of(1).total)
    salib = found.to_salib()
    theirs = analyze(**salib.for_sobol, print_to_console=False, seed=1)
    named = dict(zip(dict.fromkeys(salib.problem["groups"]), theirs["ST"], strict=True))
    np.testing.assert_allclose([named[name] for name in found.together.sources], found.together.total, rtol=1e-12)
    (alike,) = [pair for pair in own.neighbours if {pair.before, pair.after} == {1, 6}]
    assert not alike.separated and alike.more_blocks is None  # the first blocks show them, not those that are counted


def test_blocks_go_on_where_the_first_ones_of_a_scrambling_all_failed():
    """Blocks 0 and 8 of 16 are those of the first of eight scramblings."""
    effort = SobolEffort(start=16, limit=64, places=4, probability=0.9999)
    found = analysis([[1.0, 1.05, 0.3, 0.1]], effort, share=0.05, broken=(0, 8 * 6))
    assert (found.blocks, found.dropped, len(found.convergence.history)) == (62, 2, 3)


def test_a_leading_output_that_does_not_vary_leaves_the_next_one_to_settle():
    errors = sizes("abcd")
    response = Linear(np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 1.05, 0.3, 0.1]]), errors.columns)
    found = sobol_indices(Experiment.of(response, errors, SeedTree(2)), SobolEffort(start=16, limit=64, places=4))
    assert found.constant == ("y0 [-]",)
    assert found.convergence.history[-1].first[:2] == (1, 0)
    assert found.overall.drives == ("y1 [-]",) * 4
    many = Linear(np.stack([np.zeros(12), np.arange(1.0, 13.0)]), sizes("abcdefghijkl").columns)
    parted = sobol_indices(
        Experiment.of(many, sizes("abcdefghijkl"), SeedTree(2)), SobolEffort(start=16, limit=32, probability=0.9999)
    )
    assert parted.small == {0, 1, 2, 3} and parted.together is not None


@dataclass(frozen=True)
class Renamed(Linear):
    """The second of two outputs alone."""

    @property
    def outputs(self) -> tuple[str, ...]:
        return ("y1 [-]",)


def test_equal_sources_reach_the_limit_and_the_analysis_says_so():
    found = analysis([[1.0, 1.0, 1.0, 1.0]], SobolEffort(start=16, limit=100, places=4, probability=0.99))
    assert not found.convergence.stable
    assert (found.blocks, len(found.convergence.history)) == (64, 3)


def test_a_fixed_number_of_blocks_is_one_step_and_there_are_never_more_places_than_sources():
    found = analysis([[1.0, 3.0]], fixed(64, places=3))
    assert [(step.blocks, step.first) for step in found.convergence.history] == [(64, (1, 0))]


def test_one_pass_gives_every_output_and_one_ranking_over_all():
    weights = [[3.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 2.0]]
    found = analysis(weights, fixed(512))
    assert found.outputs == ("y0 [-]", "y1 [-]", "y2 [-]")
    assert found.constant == ("y1 [-]",)
    with pytest.raises(SolveError, match=r"y1 \[-\] is the same for all samples"):
        found.of("y1 [-]")
    with pytest.raises(UnknownNameError, match="y3"):
        found.of("y3")
    with pytest.raises(InputError, match="0 to 2"):
        found.of(3)
    for at in (0, 2):
        own, truth = found.of(at), np.square(weights[at]) / np.square(weights[at]).sum()
        # Four standard errors.
        assert (np.abs(own.total - truth) <= 4 * own.total_resamples.std(axis=0) + 1e-12).all()
        assert (np.abs(own.first - truth) <= 4 * own.first_resamples.std(axis=0) + 1e-12).all()
        alone = analysis([weights[at]], fixed(512)).of(0)
        np.testing.assert_array_equal(alone.total_resamples, own.total_resamples)
        assert found.samples == 512 * 5
    overall = found.overall
    assert overall.drives == ("y0 [-]", "y2 [-]", "y2 [-]")
    assert overall.order == [0, 2, 1]
    np.testing.assert_array_equal(overall.total, [found.of(0).total[0], *found.of(2).total[1:]])
    with pytest.raises(SolveError, match="every output is the same"):
        analysis([[0.0, 0.0]], fixed(64))


@dataclass(frozen=True)
class Product:
    """x·y and x·y + z of three normal inputs."""

    columns: tuple[str, ...] = ("a", "b", "c")
    outputs: tuple[str, ...] = ("product [-]", "sum [-]")

    def __call__(self, x: np.ndarray) -> Evaluation:
        product = x[:, 0] * x[:, 1]
        return Evaluation(values=np.stack([product, product + x[:, 2]], axis=1), status=np.zeros(len(x), np.uint8))


def test_pairs_have_an_index_if_asked_for():
    errors = sizes("abc")
    found = sobol_indices(Experiment.of(Product(), errors, SeedTree(5)), fixed(4096, second_order=True)).of("sum [-]")
    assert found.pairs == ((0, 1), (0, 2), (1, 2))
    assert (np.abs(found.second - [0.5, 0.0, 0.0]) <= 4 * found.second_resamples.std(axis=0)).all()
    assert found.second_interval[0, 0] > 0.3
    assert found.first_is_zero.tolist() == [True, True, False]
    without = sobol_indices(Experiment.of(Product(), errors, SeedTree(5)), fixed(64)).of("sum [-]")
    assert (without.pairs, without.second.shape, without.second_interval.shape) == ((), (0,), (2, 0))


@pytest.mark.parametrize("second_order", [False, True])
def test_a_block_of_correlated_sources_has_the_index_of_the_closed_form(second_order):
    """A linear model: the variance of the block is w'Cw, and no block takes part in what another does."""
    weights, errors = np.array([1.0, 0.8, 1.5, 0.4]), sizes("abcd", CORRELATED)
    pair = weights[0] ** 2 + weights[2] ** 2 - 2 * 0.6 * weights[0] * weights[2]
    parts = np.array([pair, weights[1] ** 2, weights[3] ** 2])
    truth = parts / parts.sum()
    effort = fixed(2048, second_order=second_order)
    found = sobol_indices(Experiment.of(Linear(weights[np.newaxis], errors.columns), errors, SeedTree(8)), effort)
    own = found.of(0)
    assert found.sources == ("a + c", "b", "d")
    # Four standard errors.
    assert (np.abs(own.first - truth) <= 4 * own.first_resamples.std(axis=0)).all()
    assert (np.abs(own.total - truth) <= 4 * own.total_resamples.std(axis=0)).all()
    assert (np.abs(own.second) <= 4 * own.second_resamples.std(axis=0)).all()
    assert np.sqrt(found.indices.variance[0]) == pytest.approx(np.sqrt(parts.sum()), rel=0.02)


def test_exchanging_a_block_exchanges_its_columns_and_no_others():
    errors = sizes("abcd", CORRELATED)
    design = SaltelliDesign(factor_groups=("a + c", "b", "a + c", "d"), seed=5)
    x = errors.standard_values(np.concatenate(list(design.chunks(0, 64)))).reshape(64, -1, 4)
    a, exchanged, b = x[:, 0], x[:, 1], x[:, -1]
    np.testing.assert_allclose(exchanged[:, [0, 2]], b[:, [0, 2]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(exchanged[:, [1, 3]], a[:, [1, 3]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("sample", [0, 1, 4, 5 * 77 + 2])
def test_one_failed_sample_drops_its_block_and_nothing_else(sample):
    weights, errors = np.array([[1.0, 2.0, 0.5], [0.5, 0.1, 2.0]]), sizes("abc")
    effort = fixed(128)
    broken = analysis(weights.tolist(), effort, broken=(sample,))
    assert (broken.blocks, broken.dropped, broken.samples) == (127, 1, 128 * 5)
    assert np.isfinite(broken.indices.total_resamples).all()
    design = SaltelliDesign(factor_groups=("a", "b", "c"), seed=SeedTree(1).child("sample").integer())
    x = errors.standard_values(np.concatenate(list(design.chunks(0, 128)))) * 6.0
    without = np.delete(x.reshape(128, 5, 3), sample // 5, axis=0).reshape(-1, 3)
    whole = saltelli_indices(Linear(weights, errors.columns)(without), 3, SeedTree(1).child("resamples"))
    for name in ("first", "total"):
        np.testing.assert_allclose(getattr(broken.indices, name), getattr(whole, name), rtol=0, atol=1e-12)


def test_more_than_one_unit_in_a_hundred_stops_the_analysis_unless_the_caller_allows_it():
    broken, weights = tuple(range(0, 70, 10)), [[1.0, 2.0, 0.5]]
    assert analysis(weights, fixed(128), broken=broken[:6]).dropped == 6
    with pytest.raises(SolveError, match=r"7 of 640 units have no usable answer; allowed is a share of 0\.01"):
        analysis(weights, fixed(128), broken=broken)
    assert analysis(weights, fixed(128), broken=broken, share=0.02).dropped == 7


def test_a_second_seed_reproduces_what_the_first_promises():
    weights = [[1.0, 0.95, 0.5, 0.45, 0.4]]
    first, second = (analysis(weights, fixed(256), seed).overall for seed in (1, 2))
    resamples = first.total_resamples
    promised = (resamples[:, :, np.newaxis] > resamples[:, np.newaxis]).mean(axis=0) >= 0.9
    assert 6 <= promised.sum() <= 10
    assert (promised & (second.total[:, np.newaxis] > second.total)).sum() >= 0.9 * promised.sum()


@pytest.mark.parametrize("start", [0, 1, 48])
def test_a_first_number_of_blocks_that_is_no_power_of_two_is_refused(start):
    with pytest.raises(InputError, match="power of two"):
        SobolEffort(start=start)
    with pytest.raises(InputError, match="1 or more"):
        replace(SobolEffort(), places=0)
