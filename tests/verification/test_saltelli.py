"""Many outputs at once against SALib's own estimators on the same resamples, and what a failed sample may change."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from SALib.analyze import sobol as salib
from scipy.stats import t

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.reports.tellers.ranking import converged
from tolalloc.sensitivity.ranking import (
    SourceRanking,
    before,
    indistinguishable_from_zero,
    percentile_interval,
    rank_interval,
    ranks,
    until_converged,
)
from tolalloc.sensitivity.saltelli import (
    SaltelliIndices,
    drawn,
    one_pass,
    saltelli_indices,
    t_weights,
    without_each,
)

SOURCES, BLOCKS, RESAMPLES, OUTPUTS, REPLICATES = 5, 96, 60, 7, 8
FIELDS = (
    *("first", "total", "second", "first_resamples", "total_resamples", "second_resamples"),
    *("variance", "first_left_out", "total_left_out", "variance_left_out"),
)


def answers(blocks: int = BLOCKS, second_order: bool = True, seed: int = 1) -> np.ndarray:
    """Return outputs of different size and offset of a Saltelli design, in SALib's order [block·sample, output]."""
    generator = SeedTree(seed).child("answers").generator()
    a, b, weight = (generator.normal(size=shape) for shape in ((blocks, 5), (blocks, 5), (SOURCES, OUTPUTS)))
    rows = [a]
    for outer, inner in ((a, b), (b, a))[: 1 + second_order]:
        rows += [np.where(np.arange(SOURCES) == source, inner, outer) for source in range(SOURCES)]
    x = np.stack([*rows, b], axis=1).reshape(-1, SOURCES)
    return 10.0 ** np.arange(-9, -9 + OUTPUTS) * (x @ weight + x[:, :1] * x[:, 1:2] + np.arange(OUTPUTS))


def evaluation(values: np.ndarray) -> Evaluation:
    return Evaluation(values=values, status=np.zeros(values.shape[0], np.uint8))


def indices(values: np.ndarray, second_order: bool = True, seed: int = 4, **options: object) -> SaltelliIndices:
    found = saltelli_indices(
        evaluation(values),
        SOURCES,
        SeedTree(seed),
        replicates=REPLICATES,
        second_order=second_order,
        resamples=RESAMPLES,
        **options,
    )
    assert found.pairs == (tuple(combinations(range(SOURCES), 2)) if second_order else ())
    return found


def same_bits(one: SaltelliIndices, two: SaltelliIndices, outputs: object = slice(None)) -> None:
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name)[outputs], getattr(two, name)[outputs])


def close(ours: np.ndarray, theirs: np.ndarray) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


@pytest.mark.parametrize("second_order", [False, True])
def test_estimates_are_those_of_salib(second_order):
    values = answers(second_order=second_order)
    found = indices(values, second_order)
    problem = {"num_vars": SOURCES, "names": list("abcde"), "bounds": [[0.0, 1.0]] * SOURCES}
    for output in range(OUTPUTS):
        theirs = salib.analyze(problem, values[:, output], calc_second_order=second_order, num_resamples=2, seed=1)
        close(found.first[output], theirs["S1"])
        close(found.total[output], theirs["ST"])
        if second_order:
            close(found.second[output], [theirs["S2"][pair] for pair in found.pairs])


def test_indices_without_a_replicate_are_those_of_salib_from_the_other_blocks():
    values = answers()
    found, replicate = indices(values), np.arange(BLOCKS) % REPLICATES
    for output in range(OUTPUTS):
        y = values[:, output]
        a, b, ab, ba = salib.separate_output_values((y - y.mean()) / y.std(), SOURCES, BLOCKS, True)
        rows = one_pass(
            np.ascontiguousarray(y.reshape(BLOCKS, -1).T[np.newaxis]), without_each(replicate, REPLICATES), SOURCES
        )[4]
        for left in range(REPLICATES):
            rest = replicate != left
            for j in range(SOURCES):
                own = (a[rest], ab[rest, j], b[rest])
                close(found.first_left_out[output, left, j], salib.first_order(*own))
                close(found.total_left_out[output, left, j], salib.total_order(*own))
            for at, (j, k) in enumerate(found.pairs):
                close(
                    rows[0, left + 1, at],
                    salib.second_order(a[rest], ab[rest, j], ab[rest, k], ba[rest, j], b[rest]),
                )


def test_draws_from_the_errors_of_means_are_students_interval():
    """Means of normal numbers: the ends of 90 % are the mean ∓ t₁₅·s/√16, within what 40,000 draws tell."""
    numbers = SeedTree(3).generator().normal(5.0, 1.0, size=16)
    rows = np.array([numbers.mean(), *(np.delete(numbers, at).mean() for at in range(16))])[np.newaxis, :, np.newaxis]
    ends = percentile_interval(drawn(rows, t_weights(16, 40_000, SeedTree(1)))[0])[:, 0]
    np.testing.assert_allclose(ends, t.interval(0.9, 15, numbers.mean(), numbers.std(ddof=1) / 4), atol=0.01)
    positive = drawn(rows, t_weights(16, 40_000, SeedTree(1)), positive=True)[0]
    logarithms = np.log(percentile_interval(positive)[:, 0] / numbers.mean())
    np.testing.assert_allclose(logarithms, ends / numbers.mean() - 1, atol=1e-3)
    assert drawn(-rows * 0.0, t_weights(16, 10, SeedTree(1)), positive=True).max() == 0.0


@pytest.mark.parametrize("blocks", [6, 7, 96])
def test_blocks_without_the_only_different_one_have_no_index(blocks):
    """Their answers are equal, so the difference of their moments is rounding, as large as an index."""
    y = np.zeros((blocks, SOURCES + 2))
    y[3, 0] = y[4, 2] = 1.0
    found = saltelli_indices(evaluation(y.reshape(-1, 1)), SOURCES, SeedTree(4), replicates=6, resamples=RESAMPLES)
    assert (found.first_left_out[0, 3] == 0).all()
    assert (found.total_left_out[0, 3] == 0).all()
    assert (np.delete(found.total_left_out[0], 3, axis=0).max(axis=1) > 0).all()
    assert np.isfinite(found.total_resamples).all()
    assert (found.total_resamples >= 0).all()


def test_blocks_of_one_scrambling_alone_have_no_error():
    status = np.ones((16, SOURCES + 2), np.uint8)
    status[[3, 11]] = 0  # both of the fourth of eight scramblings
    broken = Evaluation(values=np.zeros((status.size, 1)), status=status.ravel())
    with pytest.raises(SolveError, match="the 2 blocks that are left are all of one scrambling; 2 are needed"):
        saltelli_indices(broken, SOURCES, SeedTree(1), largest_failed_share=0.9)


def test_a_single_source_has_no_pairs():
    values = SeedTree(2).generator().normal(size=(64 * 4, 2))
    found = saltelli_indices(evaluation(values), 1, SeedTree(4), second_order=True)
    assert found.second is not None
    assert (found.second.shape, found.pairs) == ((2, 0), ())


def test_no_bit_of_an_output_depends_on_the_others():
    values = answers()
    alone = indices(values[:, [3]])
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(alone, name)[0], getattr(indices(values), name)[3])


def test_one_failed_sample_drops_its_block_and_nothing_else():
    values, size = answers(), 2 * SOURCES + 2
    broken = values.copy()
    broken[17 * size + 3, 2] = np.nan
    found = indices(broken, largest_failed_share=0.02)
    assert (found.blocks, found.dropped) == (BLOCKS - 1, 1)
    rest, own = indices(np.delete(values, np.arange(17 * size, 18 * size), axis=0)), 17 % REPLICATES
    for name in ("first", "total", "second", "variance"):
        np.testing.assert_array_equal(getattr(found, name), getattr(rest, name))
    # Without the replicate of that block nothing is missing.
    close(found.total_left_out[:, own], indices(values).total_left_out[:, own])
    assert (found.total_left_out[:, own - 1] != indices(values).total_left_out[:, own - 1]).all()
    status = np.zeros(values.shape[0], np.uint8)
    status[17 * size] = 1
    by_status = saltelli_indices(
        Evaluation(values=values, status=status),
        SOURCES,
        SeedTree(4),
        replicates=REPLICATES,
        second_order=True,
        resamples=RESAMPLES,
        largest_failed_share=0.02,
    )
    same_bits(found, by_status)


def test_too_many_failed_samples_stop_the_analysis():
    values, size = answers(), 2 * SOURCES + 2
    values[5] = np.inf
    with pytest.raises(SolveError, match=r"1 of 96 blocks hold a failed sample; allowed is 0\.01"):
        indices(values)
    values[::size] = np.nan
    with pytest.raises(SolveError, match="0 of 96 blocks are left"):
        indices(values, largest_failed_share=1.0)


def test_an_output_that_does_not_vary_concerns_itself_alone():
    values = answers()
    flat = values.copy()
    flat[:, 2] = 0.1
    flat[:, 5] = 1e3 * (1 + np.finfo(float).eps * (np.arange(values.shape[0]) % 2))
    found, others = indices(flat), np.array([0, 1, 3, 4, 6])
    assert found.varies.tolist() == [True, True, False, True, True, False, True]
    for name in FIELDS[:6]:
        assert np.isnan(getattr(found, name)[[2, 5]]).all()
    same_bits(found, indices(values), others)
    assert (found.variance[[2, 5]] == 0).all()
    assert (found.variance_left_out[[2, 5]] == 0).all()


def test_the_variance_is_that_of_a_and_b_in_the_units_of_the_output():
    values = answers()
    found, replicate = indices(values), np.arange(BLOCKS) % REPLICATES
    base = values.reshape(BLOCKS, -1, OUTPUTS)[:, [0, -1]]
    for output in range(OUTPUTS):
        without = [base[replicate != left, :, output].var() for left in range(REPLICATES)]
        np.testing.assert_allclose(found.variance[output], base[:, :, output].var(), rtol=1e-10)
        np.testing.assert_allclose(found.variance_left_out[output], without, rtol=1e-10)


def test_seed_zero_is_a_seed_like_every_other():
    values = answers()
    same_bits(indices(values, seed=0), indices(values, seed=0))
    assert (indices(values, seed=0).first_resamples != indices(values, seed=1).first_resamples).any()


def test_wrong_sizes_are_refused():
    with pytest.raises(InputError, match="a multiple of 12"):
        indices(answers()[:-1])


def ranking(
    total: list[float] | np.ndarray, resamples: np.ndarray, sources: str = "abc", blocks: int = 64
) -> SourceRanking:
    return SourceRanking(sources=tuple(sources), total=np.array(total), total_resamples=resamples, blocks=blocks)


RESAMPLED = np.array([[0.5, 0.3, 0.2], [0.5, 0.2, 0.3], [0.6, 0.2, 0.1], [0.4, 0.3, -0.1]])


def test_ranks_and_orders_of_a_ranking_made_by_hand():
    assert ranks(RESAMPLED).tolist() == [[1, 2, 3], [1, 3, 2], [1, 2, 3], [1, 2, 3]]
    assert rank_interval(RESAMPLED).tolist() == [[1, 2, 2], [1, 3, 3]]
    made = ranking([0.5, 0.3, 0.2], RESAMPLED)
    np.testing.assert_array_equal(made.among_first(2), [1.0, 0.75, 0.25])
    np.testing.assert_array_equal(before(RESAMPLED), [[0.5, 1, 1], [0, 0.5, 0.75], [0, 0.25, 0.5]])
    assert indistinguishable_from_zero(RESAMPLED).tolist() == [False, False, True]
    np.testing.assert_allclose(percentile_interval(RESAMPLED, 0.5)[:, 0], [0.475, 0.525])
    with pytest.raises(InputError, match="confidence is 1"):
        percentile_interval(RESAMPLED, 1.0)
    with pytest.raises(InputError, match="1 to 3"):
        made.among_first(4)


def gaps(blocks: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return indices whose estimates are exact and whose resamples spread with one over the root of the blocks."""
    values = np.array([0.2, 0.5, 0.22, 0.05])
    return values, values + SeedTree(seed).generator().normal(size=(4000, 4)) * 0.5 / np.sqrt(blocks)


def test_the_blocks_asked_for_tell_neighbours_apart():
    found = ranking(*gaps(512), "abcd", 512).neighbours
    assert [(pair.before, pair.after) for pair in found] == [(1, 2), (2, 0), (0, 3)]
    assert [pair.separated for pair in found] == [True, False, True]
    more = found[1].more_blocks
    assert more == pytest.approx(512 * ((1.2816 * 0.5 * np.sqrt(2 / 512) / 0.02) ** 2 - 1), rel=0.05)
    assert found[0].more_blocks == 0
    enough = ranking(*gaps(512 + more, seed=7), "abcd", 512 + more).neighbours
    assert enough[1].probability == pytest.approx(0.9, abs=0.02)
    equal = ranking([0.3, 0.3], np.array([[0.3, 0.3], [0.2, 0.4], [0.4, 0.2]]), "ab").neighbours
    assert (equal[0].more_blocks, equal[0].separated) == (None, False)


def test_blocks_double_until_the_order_is_stable_or_the_limit_is_reached():
    found = until_converged(gaps, "abcd", 3, start=64, limit=1 << 14)
    assert found.stable
    assert [step.blocks for step in found.history] == [64 << at for at in range(len(found.history))]
    assert found.history[-1].first == (1, 2, 0)
    assert found.history[-1].probability >= 0.9 > found.history[-2].probability
    stopped = until_converged(gaps, "abcd", 3, start=64, limit=200)
    assert (stopped.stable, [step.blocks for step in stopped.history]) == (False, [64, 128])
    assert converged(found) != converged(stopped)
    with pytest.raises(InputError, match="first number of blocks"):
        until_converged(gaps, "abcd", 3, start=64, limit=32)


def test_twins_of_one_group_may_change_places():
    def twins(blocks):
        values = np.array([0.4, 0.4, 0.1])
        return values, values + SeedTree(1).generator().normal(size=(400, 3)) * 0.02

    assert not until_converged(twins, "abc", 2, start=64, limit=64).stable
    assert until_converged(twins, "aac", 2, start=64, limit=64).stable
