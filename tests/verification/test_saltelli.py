"""Many outputs at once against SALib's own estimators on the same resamples, and what a failed sample may change."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from SALib.analyze import sobol as salib
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.stats import norm, t

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.reports.tellers.ranking import converged
from tolalloc.sensitivity.ranking import (
    SourceRanking,
    indistinguishable_from_zero,
    percentile_interval,
    rank_interval,
    share_interval,
    until_converged,
)
from tolalloc.sensitivity.saltelli import (
    SaltelliDesign,
    SaltelliIndices,
    drawn,
    one_pass,
    saltelli_indices,
    t_weights,
    unseen,
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
    values[:11] = np.inf
    assert indices(values).dropped == 1
    values[5 * size] = np.inf
    with pytest.raises(SolveError, match=r"12 of 1,152 units have no usable answer; allowed is a share of 0\.01"):
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


def normal_blocks(function: Callable[[np.ndarray], np.ndarray], sources: int, blocks: int, seed: int) -> np.ndarray:
    """Return what a function says of normal numbers of a design [block·sample, 1]."""
    design = SaltelliDesign(factor_groups=tuple(f"x{at}" for at in range(sources)), seed=seed)
    return function(norm.ppf(np.maximum(np.concatenate(list(design.chunks(0, blocks))), 2.0**-31)))[:, np.newaxis]


def intervals(found: SaltelliIndices) -> np.ndarray:
    """Return the 90 % intervals of first-order and total indices of one output [kind, end, source]."""
    return np.stack([share_interval(own[0], found.unseen[0]) for own in (found.first_resamples, found.total_resamples)])


def of_the_largest(scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first-order and total indices of max |sᵢ·xᵢ|, from E[max(a, R)] = a + ∫ₐ (1 − F_R) by trapezoids."""
    m = np.linspace(0.0, 8.0 * scales.max(), 100_001)
    below = 2.0 * norm.cdf(m / scales[:, np.newaxis]) - 1.0

    def spread(of: np.ndarray, against: np.ndarray) -> float:
        beyond = trapezoid(1.0 - against, m) - cumulative_trapezoid(1.0 - against, m, initial=0.0)
        density, mean = np.gradient(of, m), m + beyond
        return float(trapezoid(mean**2 * density, m) - trapezoid(mean * density, m) ** 2)

    whole = spread(below.prod(axis=0), np.ones_like(m))
    rest = [np.delete(below, at, axis=0).prod(axis=0) for at in range(scales.size)]
    first = [spread(own, other) / whole for own, other in zip(below, rest, strict=True)]
    total = [1.0 - spread(other, own) / whole for own, other in zip(below, rest, strict=True)]
    return np.array(first), np.maximum(total, 1e-9)


SCALES = np.arange(1.0, 13.0)


@pytest.mark.slow
@pytest.mark.parametrize(("blocks", "seeds", "alone"), [(16, 300, 0.9), (64, 300, 0.8), (256, 150, 0.75)])
def test_intervals_of_sources_that_few_blocks_show_hold_as_often_as_they_say(blocks, seeds, alone):
    """max |i·xᵢ|: of 12 sources a quarter is hardly ever the largest. A share over seeds errs by some 0.7 %."""
    truth, held = np.array(of_the_largest(SCALES)), []
    for seed in range(1, seeds + 1):
        values = normal_blocks(lambda x: np.abs(x * SCALES).max(axis=1), 12, blocks, seed)
        low, high = np.moveaxis(intervals(saltelli_indices(evaluation(values), 12, SeedTree(seed))), 1, 0)
        assert low.min() >= 0.0 and high.max() <= 1.0
        held.append((low <= truth) & (truth <= high))
    by_kind = np.mean(held, axis=2)  # [seed, kind]
    error = by_kind.std(axis=0) / np.sqrt(seeds)
    assert error.max() < 0.01
    assert (by_kind.mean(axis=0) + 2.0 * error > 0.9).all()
    assert np.mean(held, axis=0).min() > alone


@pytest.mark.parametrize(
    ("function", "sources", "nothing"),
    [
        (lambda x: np.abs(x * SCALES).max(axis=1), 12, [0, 1, 2]),
        (lambda x: x[:, 0] + 3.0 * (x[:, 1] > 3.0) * x[:, 2], 3, [1, 2]),  # one unit of 740 knows of them
        (lambda x: x[:, 0] + np.maximum(x[:, 1] - 3.5, 0.0), 2, [1]),
        (lambda x: np.minimum(x[:, 0], 4.0 + x[:, 1]), 2, [1]),
        (lambda x: x @ np.array([3.0, 1.0, 0.0]), 3, [2]),
        (lambda x: np.where(np.abs(x[:, 0]) < 3.2, x[:, 1], 9.0), 2, [0]),
    ],
)
def test_what_no_block_shows_may_still_be_a_share(function, sources, nothing):
    """Draws from blocks that show nothing are all 0, and an interval of them would be [0, 0]."""
    found = saltelli_indices(evaluation(normal_blocks(function, sources, 64, 2)), sources, SeedTree(2))
    known = [at for at in range(sources) if at not in nothing]
    assert (found.unseen[0, nothing] > 0.01).all()
    assert (intervals(found)[:, 0, nothing] == 0.0).all()
    assert (intervals(found)[1, 1, nothing] == np.minimum(found.unseen[0, nothing], 1.0)).all()
    assert (found.unseen[0, known[-1]] == 0.0).all()
    more = saltelli_indices(evaluation(normal_blocks(function, sources, 4096, 2)), sources, SeedTree(2))
    assert (more.unseen[0] < 0.05).all()


def test_what_is_unseen_is_poissons_end_by_hand():
    """None of 50 blocks: −ln 0.05/50 of a size of 4; two of them of one size: λ with e^−λ·(1 + λ + λ²/2) = 5 %."""
    parts = np.zeros((50, 4))
    parts[:, 0], parts[:2, 1], parts[:5, 3] = 4.0, 1.0, 1.0
    found = unseen(parts)
    assert found[0] == found[3] == 0.0
    assert found[2] == pytest.approx(-np.log(0.05) / 50 * 4.0)
    events = 50 * found[1] / ((1.0 + 1.0 + 4.0) / 3.0)
    assert np.exp(-events) * (1.0 + events + events**2 / 2) == pytest.approx(0.05)
    np.testing.assert_array_equal(unseen(np.stack([parts, 2 * parts], axis=1)), [found, 2 * found])
    assert (
        unseen(np.abs(SeedTree(1).generator().normal(size=(8, 100)))) == 0.0
    ).all()  # a third of few blocks is enough


def ranking(
    total: list[float] | np.ndarray, resamples: np.ndarray, sources: str = "abc", blocks: int = 64
) -> SourceRanking:
    return SourceRanking(sources=tuple(sources), total=np.array(total), total_resamples=resamples, blocks=blocks)


RESAMPLED = np.array([[0.5, 0.3, 0.2], [0.5, 0.2, 0.3], [0.6, 0.2, 0.1], [0.4, 0.3, -0.1]])


def test_ranks_and_orders_of_a_ranking_made_by_hand():
    assert rank_interval(RESAMPLED).tolist() == [[1, 2, 2], [1, 3, 3]]
    assert rank_interval(RESAMPLED * [1.0, 0.0, 0.0]).tolist() == [[1, 2, 2], [1, 3, 3]]  # equals share their ranks
    made = ranking([0.5, 0.3, 0.2], RESAMPLED)
    np.testing.assert_array_equal(made.among_first(1), [1.0, 0.0, 0.0])
    np.testing.assert_array_equal(made.among_first(2), [1.0, 0.75, 0.25])
    assert [pair.probability for pair in made.neighbours] == [1.0, 0.75]
    assert ranking([0.5, 0.5], np.full((4, 2), 0.5), "ab").neighbours[0].probability == 0.5  # equals count half
    assert indistinguishable_from_zero(RESAMPLED).tolist() == [False, False, True]
    np.testing.assert_allclose(percentile_interval(RESAMPLED)[:, 0], [0.415, 0.585])
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
    assert converged(found, "y") != converged(stopped, "y")
    with pytest.raises(InputError, match="first number of blocks"):
        until_converged(gaps, "abcd", 3, start=64, limit=32)


def test_twins_of_one_group_may_change_places():
    def twins(blocks):
        values = np.array([0.4, 0.4, 0.1])
        return values, values + SeedTree(1).generator().normal(size=(400, 3)) * 0.02

    assert not until_converged(twins, "abc", 2, start=64, limit=64).stable
    assert until_converged(twins, "aac", 2, start=64, limit=64).stable
