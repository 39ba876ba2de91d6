"""First-order, total and second-order indices of many outputs by SALib, and how far they are off, from replicates.

SALib draws the points and estimates the indices. What it has not is done here: blocks in chunks, because it holds a
design whole and exchanges columns number by number; failed samples, because one NaN makes all its indices 0 or NaN; and
the error, because it resamples blocks as if they were independent, which those of one Sobol' sequence are not.

A design consists of replicates, each a Sobol' sequence with a scrambling of its own. They are independent, and the
indices without one of them at a time, the jackknife, say how far the index of all of them is off. Sums without a
replicate are a row of counts, so those of all rows are one matrix product of the counts with what every block adds to
each sum. The indices follow from the sums: mean and variance enter them non-linearly, which is why the product carries
moments and not indices.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import gammaincinv

from tolalloc.capability.monte_carlo import AnsweredUnits, require_few_failures
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation, Samples
from tolalloc.running.chunks import one_blas_thread
from tolalloc.sensitivity.surrogate.control_variate import CheapAnswers, optimal_weights

InBlocks = Float[np.ndarray, "block sample"]
"""One output of the samples of every block."""
Stacked = Float[np.ndarray, "output sample block"]
"""Outputs of the samples of every block, block by block last."""
Counts = Float[np.ndarray, "row block"]
"""How often each row counts each block [-]."""
OfIndices = Float[np.ndarray, "output row index"]
"""Indices of every output, row by row [-]."""
SAMPLES_AT_ONCE = 8192
"""Samples of a chunk at most, unless one block has more [-]."""
REPLICATES = 8
"""Scramblings of a design [-]. Fewer leave the error itself uncertain: 90 % of Student's t with 7 degrees of freedom
are 15 % wider than of a normal law, with 3 of them 43 %. More leave each sequence fewer points, and smooth functions a
larger error."""


@dataclass(frozen=True, kw_only=True)
class SaltelliDesign:
    """Scrambled Sobol' points A and B, and the samples between them: A, AB₁ … AB_D, if asked for BA₁ … BA_D, and B.

    Notes
    -----
    Blocks go round the replicates, one of each in turn, and the sequences are the same for any number of blocks: a
    larger design begins with the smaller one. The blocks of a replicate are those of `SALib.sample.sobol` with its
    seed, bit for bit; that of the first replicate is the seed of the design.

    References
    ----------
    Saltelli 2002 and Saltelli et al. 2010; Sobol' points scrambled by a random matrix and a digital shift (Matoušek
    1998); independent scramblings for the error: Owen 1998, J. Complexity 14.

    Examples
    --------
    A block of two inputs is A, AB₁, AB₂ and B.

    >>> block = next(SaltelliDesign(factor_groups=("a", "b"), seed=1).chunks(0, 1))
    >>> block.shape, bool((block[1] == [block[3, 0], block[0, 1]]).all())
    ((4, 2), True)
    """

    # Name of the factor group of each column; the columns of a factor group are exchanged together
    factor_groups: tuple[str, ...]
    seed: int  # Seed of the scrambling, positive: 0 would be no seed at all for other libraries [-]
    second_order: bool = False  # Whether the design has the BA samples
    columns: tuple[str, ...] = ()  # Name of each column, x1, x2 … unless given
    replicates: int = REPLICATES  # Independent scramblings among which the blocks are divided [-]

    def __post_init__(self) -> None:
        for name, value in (("seed", self.seed), ("replicates", self.replicates)):
            if value < 1:
                raise InputError.at("Saltelli design", name, value, "1 or more")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Players in the order of their first columns."""
        return tuple(dict.fromkeys(self.factor_groups))

    @property
    def columns_of_names(self) -> tuple[tuple[int, ...], ...]:
        """Positions of each player's columns."""
        return tuple(tuple(np.flatnonzero(own).tolist()) for own in self._own)

    @property
    def samples_per_block(self) -> int:
        """Samples of a block [-]."""
        return (1 + self.second_order) * len(self.names) + 2

    def chunks(self, start: int, stop: int, only: str = "") -> Iterator[Samples]:
        """Yield the samples of the blocks from ``start`` up to but not ``stop``, uniform numbers in [0, 1).

        If a group is named, of every block only the sample AB of it.
        """
        at_once = 1 << max(0, (SAMPLES_AT_ONCE // (1 if only else self.samples_per_block)).bit_length() - 1)
        points = self._points(start, stop)
        for first in range(0, stop - start, at_once):
            a, b = points[:, first : first + at_once]
            if only:
                yield np.where(self._own[self.names.index(only)], b, a).reshape(-1, a.shape[-1])
            else:  # in SALib's order
                pairs = [(a, b), (b, a)][: 1 + self.second_order]
                between = [np.where(self._own, inner, outer) for outer, inner in pairs]
                yield np.concatenate([a, *between, b], axis=1).reshape(-1, a.shape[-1])

    @property
    def problem(self) -> dict[str, Any]:
        """SALib's specification of the problem: uniform numbers in [0, 1], in groups that are exchanged together."""
        return _problem(self.columns or _numbered(len(self.factor_groups)), self.factor_groups)

    def _points(self, start: int, stop: int) -> Float[np.ndarray, "2 block 1 column"]:
        """Return A and B of the blocks from ``start`` up to but not ``stop``."""
        first, last = start // self.replicates, -(-stop // self.replicates)
        drawn = np.stack([self._sequence(at, first, last) for at in range(self.replicates)], axis=1)
        own = drawn.reshape(-1, 2, 1, len(self.factor_groups))[start - first * self.replicates :][: stop - start]
        return np.moveaxis(own, 1, 0)

    def _sequence(self, replicate: int, first: int, last: int) -> Float[np.ndarray, "point number"]:
        """Return some points of a replicate, A beside B, as SALib draws them.

        Two groups, of which SALib exchanges neither many times, give four samples of a block whatever the sources.
        """
        from SALib.sample import sobol

        seed = SeedTree(self.seed).child("replicate", str(replicate)).integer() if replicate else self.seed
        names = _numbered(len(self.factor_groups))
        problem = _problem(names, ("first", *["others"] * (len(names) - 1)))
        with warnings.catch_warnings():  # a replicate has a power of two of points in the end, not with every call
            warnings.simplefilter("ignore", UserWarning)
            drawn = sobol.sample(problem, last - first, calc_second_order=False, skip_values=first, seed=seed)
        return np.asarray(drawn.reshape(last - first, -1, len(names))[:, [0, -1]].reshape(last - first, -1))

    @cached_property
    def _own(self) -> Bool[np.ndarray, "group column"]:
        """Which columns belong to each factor group."""
        return np.asarray(np.array(self.factor_groups) == np.array(self.names)[:, np.newaxis])


def _problem(names: Sequence[str], groups: Sequence[str]) -> dict[str, Any]:
    """Return SALib's specification of uniform numbers in [0, 1]."""
    bounds = [[0.0, 1.0] for _ in names]
    return {"num_vars": len(names), "names": list(names), "groups": list(groups), "bounds": bounds}


def _numbered(count: int) -> tuple[str, ...]:
    return tuple(f"x{at + 1}" for at in range(count))


_LEAST_RANGE = 8 * np.finfo(float).eps
"""Range of an output over its largest magnitude below which it is rounding and not an effect."""
_ROUNDING = 64 * np.finfo(float).eps
"""Variance of a resample over its mean square below which it is rounding."""


_OF_SOURCES = frozenset(
    ("first", "total", "first_resamples", "total_resamples", "narrowed", "first_left_out", "total_left_out", "unseen")
)
"""Arrays of indices whose last axis is that of the sources."""


@dataclass(frozen=True, kw_only=True)
class SaltelliIndices:
    """Indices of every output; those of an output that does not vary are NaN."""

    # First-order and total index [-]
    first: Float[np.ndarray, "output source"]
    total: Float[np.ndarray, "output source"]
    # Second-order index of the pairs in the order of ``pairs``, no pairs if the design has no BA samples [-]
    second: Float[np.ndarray, "output pair"]
    # The same as they might have come out, drawn from their errors, the same draws for all outputs [-]
    first_resamples: Float[np.ndarray, "output resample source"]
    total_resamples: Float[np.ndarray, "output resample source"]
    second_resamples: Float[np.ndarray, "output resample pair"]
    # Variance of A and B together, of which the indices are shares [output²]
    variance: Float[np.ndarray, " output"]
    # Interval of each total index over that which these blocks alone would have given, 1 without a control [-]
    narrowed: Float[np.ndarray, "output source"]
    # Indices and variance without one replicate at a time, and by how much each draw counts what that changes [-]
    first_left_out: Float[np.ndarray, "output replicate source"]
    total_left_out: Float[np.ndarray, "output replicate source"]
    variance_left_out: Float[np.ndarray, "output replicate"]
    weights: Float[np.ndarray, "resample replicate"]
    varies: Bool[np.ndarray, " output"]  # Whether the output varies; only then do its indices exist
    unseen: Float[np.ndarray, "output source"]  # Index that a source may have where too few blocks show it, else 0 [-]
    # Blocks used, and blocks dropped because one of their samples failed [-]
    blocks: int
    dropped: int

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Positions of the two sources of every pair."""
        return tuple(combinations(range(self.first.shape[1]), 2)) if self.second.size else ()

    def with_part(self, other: SaltelliIndices, outputs: list[int], sources: Mapping[int, int]) -> SaltelliIndices:
        """Return these indices, but at some places among the outputs those of other blocks.

        Of those sources alone that the other blocks tell apart: position here → position there.
        """
        joined: dict[str, Any] = {"blocks": other.blocks, "dropped": other.dropped}
        here, there = list(sources), list(sources.values())
        for name, theirs in vars(other).items():
            if not isinstance(theirs, np.ndarray) or name == "weights":
                continue
            # Failed blocks may leave another number of scramblings; these arrays serve waves, which are not replaced.
            if name.endswith("left_out") and theirs.shape[1] != getattr(self, name).shape[1]:
                continue
            joined[name] = getattr(self, name).copy()
            for own, place in enumerate(outputs):
                if name in _OF_SOURCES:
                    joined[name][place][..., here] = theirs[own][..., there]
                else:
                    joined[name][place] = theirs[own]
        return replace(self, **joined)


def saltelli_indices(
    evaluation: Evaluation,
    sources: int,
    seeds: SeedTree,
    *,
    replicates: int = REPLICATES,
    second_order: bool = False,
    resamples: int = 400,
    largest_failed_share: float = 0.01,
    control: CheapAnswers | None = None,
) -> SaltelliIndices:
    """Return the indices of all outputs of a Saltelli design.

    Parameters
    ----------
    evaluation
        Answers of A, AB₁ … AB_D, if asked for BA₁ … BA_D, and B, block by block, as SALib orders them.
    sources
        Groups of columns that were exchanged, D [-].
    replicates
        Replicates of the design, round which its blocks go; random blocks may be divided among any number [-].
    resamples
        Draws from the errors of the indices [-].
    largest_failed_share
        Share of samples that may fail [-].
    control
        Answers of a cheap model, with which first-order and total indices are corrected.

    Notes
    -----
    Indices [-] without a replicate whose rest does not vary are 0, as in SALib. With a control first-order and total
    ones are those of theory page equation (79), unbiased whatever the cheap model is worth.

    References
    ----------
    Indices: `salib_estimates`. V is the variance of A and B together, and all answers of an output are centred and
    divided by their standard deviation first, as SALib does: the first and the second order depend on it. Error: the
    jackknife, Efron & Tibshirani 1993, ch. 11, over independent scramblings, Owen 1998.

    Examples
    --------
    >>> x = next(SaltelliDesign(factor_groups=("a", "b"), seed=1).chunks(0, 2048))
    >>> answers = Evaluation(values=(x @ [1.0, 2.0])[:, np.newaxis], status=np.zeros(len(x), np.uint8))
    >>> found = saltelli_indices(answers, 2, SeedTree(1))
    >>> found.total[0].round(2).tolist(), found.blocks
    ([0.2, 0.8], 2048)
    """
    size = (2 * sources if second_order else sources) + 2
    if evaluation.status.size % size:
        raise InputError.at("Sobol indices", "samples", evaluation.status.size, f"a multiple of {size}")
    whole = evaluation.good.reshape(-1, size).all(axis=1)
    blocks = int(np.count_nonzero(whole))
    require_few_failures(AnsweredUnits(evaluation=evaluation), "Sobol indices", largest_failed_share)
    if blocks < 2:
        raise SolveError(f"Sobol indices: {blocks} of {whole.size} blocks are left; at least 2 are needed.")
    values = evaluation.values.reshape(whole.size, size, -1)
    present, replicate = np.unique(np.flatnonzero(whole) % min(replicates, whole.size), return_inverse=True)
    if present.size < 2:  # without two scramblings there is no error
        raise SolveError(f"Sobol indices: the {blocks} blocks that are left are all of one scrambling; 2 are needed.")
    counts = without_each(replicate, present.size)
    weights = t_weights(present.size, resamples, seeds)
    with one_blas_thread():
        found, shown = [], []
        for at in range(values.shape[2]):  # one copy in memory at a time
            answers = values[:, :, at][whole]
            shown.append(_shown(answers, sources))
            found.append(one_pass(np.ascontiguousarray(answers.T[np.newaxis]), counts, sources))
            if found[-1][0][0]:  # SALib's estimates in the first row, which leaves out no replicate
                for own, estimate in zip(
                    found[-1][2:], salib_estimates(answers.ravel(), sources, second_order), strict=True
                ):
                    own[0, 0] = estimate
        varies, variance, first, total, second = (np.concatenate(parts) for parts in zip(*found, strict=True))
        plain = total
        if control is not None:
            own, many = (answers.reshape(-1, size, values.shape[2]) for answers in (control.own, control.many))
            first, total = first.copy(), total.copy()
            for at in np.flatnonzero(varies).tolist():
                both, mine = (values[:, :, at][whole], own[:, :, at][whole]), (first[at], total[at], shown[at])
                first[at], total[at], shown[at] = _controlled(*both, many[:, :, at], mine, counts, sources)
    return SaltelliIndices(
        unseen=np.stack([unseen(np.abs(own)) for own in shown]),
        first=first[:, 0],
        total=total[:, 0],
        second=second[:, 0],
        first_resamples=drawn(first, weights),
        total_resamples=drawn(total, weights, positive=True),
        second_resamples=drawn(second, weights),
        variance=variance[:, 0],
        narrowed=np.divide(_spread(total), _spread(plain), out=np.ones_like(plain[:, 0]), where=_spread(plain) > 0),
        first_left_out=first[:, 1:],
        total_left_out=total[:, 1:],
        variance_left_out=variance[:, 1:],
        weights=weights,
        varies=varies,
        blocks=blocks,
        dropped=whole.size - blocks,
    )


_Rows = tuple[
    Bool[np.ndarray, " output"],
    Float[np.ndarray, "output row"],
    Float[np.ndarray, "output row source"],
    Float[np.ndarray, "output row source"],
    Float[np.ndarray, "output row pair"],
]
"""Which outputs vary, and their variance, first-order, total and second-order indices; the first row is no resample."""


def _controlled(
    answers: InBlocks,
    cheap: InBlocks,
    many: Float[np.ndarray, "cheap_block sample"],
    plain: tuple[Float[np.ndarray, "row source"], Float[np.ndarray, "row source"], Float[np.ndarray, "block source"]],
    counts: Counts,
    sources: int,
) -> tuple[Float[np.ndarray, "row source"], Float[np.ndarray, "row source"], Float[np.ndarray, "block source"]]:
    """Return first-order and total indices of one output, and what blocks show, less what a cheap model tells of it.

    That is the difference between its indices from the same blocks and from many others. Each row leaves out a
    replicate of both, so that the error of the cheap indices counts too.
    """
    rows = without_each(np.arange(len(many)) % (len(counts) - 1), len(counts) - 1)
    same, other = (one_pass(y.T[np.newaxis], own, sources) for y, own in ((cheap, counts), (many, rows)))
    if not (same[0][0] and other[0][0]):
        return plain
    indices, cheap_indices, known = (
        np.concatenate(both, axis=1) for both in (plain[:2], *((own[2][0], own[3][0]) for own in (same, other)))
    )
    weights = optimal_weights(
        _influences(answers, indices[0], sources), _influences(cheap, cheap_indices[0], sources), counts
    )
    found = indices - weights.T * (cheap_indices - known)
    left = plain[2] - weights[sources:, 0] * _shown(cheap, sources)
    return found[:, :sources], np.maximum(found[:, sources:], 0.0), left


def _shown(answers: InBlocks, sources: int) -> Float[np.ndarray, "block source"]:
    """Return what every block shows of the total index of each source, 0 of an output that does not vary [-]."""
    changes, variance = (answers[:, :1] - answers[:, 1 : sources + 1]) ** 2 / 2, answers[:, [0, -1]].var()
    return np.asarray(changes / (variance or np.inf))


def _contributions(y: Stacked, sources: int) -> Float[np.ndarray, "output contribution block"]:
    """Return what every block adds to mean, mean square, first-order and total part of every source."""
    a, ab, b = y[:, :1], y[:, 1 : sources + 1], y[:, -1:]
    return np.concatenate([(a + b) / 2, (a**2 + b**2) / 2, b * (ab - a), (a - ab) ** 2 / 2], axis=1)


def _influences(
    answers: InBlocks, indices: Float[np.ndarray, " index"], sources: int
) -> Float[np.ndarray, "index block"]:
    """Return what each block adds to the error of every index, to first order and but for a constant [-].

    Of the quotient P/V: (p_b − P/V·v_b)/V, of the variance V: the square about the mean (Efron & Tibshirani 1993, ch.
    22, the influence function).
    """
    mean, square, *parts = _contributions(_standardised(answers.T[np.newaxis])[0], sources)[0]
    about = square - 2.0 * mean.mean() * mean
    return np.asarray((np.array(parts) - indices[:, np.newaxis] * about) / (square.mean() - mean.mean() ** 2))


def _spread(rows: Float[np.ndarray, "output row source"]) -> Float[np.ndarray, "output source"]:
    """Return the standard deviation of estimates that each leave out one replicate."""
    return np.asarray(rows[:, 1:].std(axis=1))


def without_each(replicate: Int[np.ndarray, " block"], replicates: int) -> Counts:
    """Return how often each row counts each block: all in the first one, then those of all replicates but one [-].

    Examples
    --------
    >>> without_each(np.array([0, 1, 0]), 2).tolist()
    [[1.0, 1.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]]
    """
    rest = replicate != np.arange(replicates)[:, np.newaxis]
    return np.concatenate([np.ones((1, replicate.size)), rest])


def t_weights(replicates: int, resamples: int, seeds: SeedTree) -> Float[np.ndarray, "resample replicate"]:
    """Return by how much each resample counts what each replicate moves [-].

    Normal weights, over the root of χ²/(R − 1), so that a sum of independent normal deviations, weighted, is to its
    estimated standard error as Student's t with R − 1 degrees of freedom; times √((R − 1)/R) of the jackknife.

    References
    ----------
    Student 1908; Efron & Tibshirani 1993, eq. (11.5).
    """
    generator, freedom = seeds.generator(), replicates - 1
    normal = generator.standard_normal((resamples, replicates))
    inverse = np.sqrt(freedom / generator.chisquare(freedom, size=(resamples, 1)))
    return np.asarray(normal * inverse * np.sqrt(freedom / replicates))


_MOST = 5.0
"""Logarithm of the most that a draw from a very uncertain number is of the estimate, so that none is infinite [-]."""


def drawn(
    rows: OfIndices, weights: Float[np.ndarray, "resample replicate"], *, positive: bool = False
) -> Float[np.ndarray, "output resample index"]:
    """Return draws from the errors of estimates.

    Parameters
    ----------
    rows
        Estimates from all replicates, then from all but one at a time.
    weights
        Those of `t_weights`.
    positive
        Whether they are means of squares, whose logarithm is spread more evenly than they are.

    References
    ----------
    Estimate + Σ w_r·(mean − estimate without r): t interval from the jackknife, Efron & Tibshirani 1993, ch. 11 and
    12; for a positive number of its logarithm, to first order, as ibid. ch. 12.6.

    Examples
    --------
    The draws from three estimates have the width of their standard error √(2/3·Σ(θ₋ᵣ − θ̄)²).

    >>> rows = np.array([[[5.0], [4.0], [5.0], [6.0]]])
    >>> drawn(rows, np.eye(3) * (2 / 3) ** 0.5).round(2).ravel().tolist()
    [5.82, 5.0, 4.18]
    """
    estimate, left_out = rows[:, :1], rows[:, 1:]
    moves = weights @ (left_out.mean(axis=1, keepdims=True) - left_out)
    if not positive:
        return np.asarray(estimate + moves)
    relative = np.divide(moves, estimate, out=np.zeros_like(moves), where=estimate > 0)
    return np.asarray(estimate * np.exp(np.minimum(relative, _MOST)))


def salib_estimates(
    answers: Float[np.ndarray, " sample"], sources: int, second_order: bool = False
) -> tuple[Float[np.ndarray, " source"], Float[np.ndarray, " source"], Float[np.ndarray, " pair"]]:
    """Return the first-order, total and second-order indices that SALib estimates from good answers [-].

    The answers stand as those of `saltelli_indices`, for D sources with or without BA samples.

    References
    ----------
    Iwanaga, Usher & Herman 2022 (Toward SALib 2.0): first order mean B·(AB_j − A)/V (Saltelli et al. 2010), total
    mean (A − AB_j)²/2V (Jansen 1999), second order mean (BA_j·AB_k − A·B)/V − S_j − S_k (Saltelli 2002).

    Examples
    --------
    y = x₁ + 2·x₂ of uniform numbers has the total indices 1/5 and 4/5.

    >>> x = next(SaltelliDesign(factor_groups=("a", "b"), seed=1, replicates=1).chunks(0, 1024))
    >>> _, total, _ = salib_estimates(x @ [1.0, 2.0], 2)
    >>> total.round(3).tolist()
    [0.2, 0.8]
    """
    from SALib.analyze import sobol

    problem = _problem(_numbered(sources), _numbered(sources))
    with warnings.catch_warnings():  # of the two resamples that SALib wants, which are not read
        warnings.simplefilter("ignore", UserWarning)
        found = sobol.analyze(problem, answers, calc_second_order=second_order, num_resamples=2, seed=1)
    pairs = combinations(range(sources), 2) if second_order else ()
    return found["S1"], found["ST"], np.array([found["S2"][pair] for pair in pairs])


FEWEST_SHOWING = 5
"""Blocks that show a source, at most, below which draws hold its index too rarely: 79 % of max |i·xᵢ|, none 0 % [-]."""


def unseen(parts: Float[np.ndarray, "block *output source"]) -> Float[np.ndarray, "*output source"]:
    """Return the mean that a part may have which too few blocks show, and 0 for all others [unit of the parts].

    Blocks count as n = (Σp)²/Σp² of the size Σp²/Σp. Where n < 5, and less than a third of all, one more of the largest
    size of any source is taken into the mean size, and the 95 % end of Poisson's law for n into their number.

    References
    ----------
    Bohm & Zech 2014, Nucl. Instrum. Methods A 748 (weighted events as Poisson's); Garwood 1936 (ends of that law).

    Examples
    --------
    Sources that no block of 100 shows, and one that all show; 3.0 in 100 of its size are possible, at 95 %.

    >>> unseen(np.array([[0.0, 1.0]] * 100)).round(3).tolist()
    [0.03, 0.0]
    """
    whole, squares = parts.sum(axis=0), (parts**2).sum(axis=0)
    size = np.divide(squares, whole, out=np.zeros_like(whole), where=whole > 0)
    showing = np.divide(whole, size, out=np.zeros_like(whole), where=size > 0)
    mean_size = (whole + size.max(axis=-1, keepdims=True)) / (showing + 1)
    few = showing < min(FEWEST_SHOWING, len(parts) / 3)
    return np.asarray(np.where(few, gammaincinv(showing + 1, 0.95) * mean_size / len(parts), 0.0))


def resample_counts(blocks: int, resamples: int, seeds: SeedTree) -> Counts:
    """Return how often each bootstrap resample holds each block [-]; the first row holds each once.

    Efron & Tibshirani 1993, ch. 6.
    """
    generator = seeds.generator()
    counts = np.ones((resamples + 1, blocks))
    for row in counts[1:]:
        row[:] = np.bincount(generator.integers(blocks, size=blocks), minlength=blocks)
    return counts


def one_pass(answers: Stacked, counts: Counts, sources: int) -> _Rows:
    """Return which outputs vary, and variance [output²], first-order, total and second-order indices for every row [-].

    Answers are good ones in the order of the design's samples [output]; without BA samples there are no pairs.

    References
    ----------
    S_j, T_j and S_jk as of `salib_estimates` (Saltelli et al. 2010, Jansen 1999, Saltelli 2002).

    Examples
    --------
    y = x₁ + 2·x₂ of uniform numbers has the total indices 1/5 and 4/5, and the variance 5/12.

    >>> x = next(SaltelliDesign(factor_groups=("a", "b"), seed=1, replicates=1).chunks(0, 1024))
    >>> answers = (x @ [1.0, 2.0]).reshape(1, 1024, 4).transpose(0, 2, 1)
    >>> _, variance, _, total, _ = one_pass(answers, np.ones((1, 1024)), 2)
    >>> variance.round(3).tolist(), total[0, 0].round(3).tolist()
    ([[0.417]], [0.2, 0.8])
    """
    y, deviation, varies = _standardised(answers)
    ab, ba = y[:, 1 : sources + 1], y[:, sources + 1 : -1]
    own = np.concatenate([_contributions(y, sources), y[:, :1] * y[:, -1:]], axis=1)
    # The product of one output has the same shape whatever else is in memory, so its bits are the same too.
    blocks = counts.sum(axis=1)[:, np.newaxis]
    means = (own @ counts.T).transpose(0, 2, 1) / blocks
    mean, square, closed = means[:, :, :1], means[:, :, 1:2], means[:, :, -1:]
    # A resample of equal answers has no variance; what the difference of its moments leaves is rounding.
    variance = np.where(square - mean**2 > _ROUNDING * square, square - mean**2, 0.0)
    first = _over_variance(means[:, :, 2 : sources + 2], variance)
    total = _over_variance(means[:, :, sources + 2 : -1], variance)
    second = [
        _over_variance((ba[:, j : j + 1] * ab[:, j + 1 :] @ counts.T).transpose(0, 2, 1) / blocks - closed, variance)
        - first[:, :, j : j + 1]
        - first[:, :, j + 1 :]
        for j in range(ba.shape[1])
    ]
    for values in (first, total, *second):
        values[~varies] = np.nan
    in_units = variance[:, :, 0] * deviation[:, np.newaxis] ** 2
    return varies, in_units, first, total, np.concatenate([first[:, :, :0], *second], axis=2)


def _standardised(answers: Stacked) -> tuple[Stacked, Float[np.ndarray, " output"], Bool[np.ndarray, " output"]]:
    """Return answers of mean 0 and deviation 1 [-], their deviation [output], and which vary; others are all 0."""
    flat = answers.reshape(answers.shape[0], -1)
    base = answers[:, [0, -1]].reshape(answers.shape[0], -1)
    varies = np.asarray(np.ptp(base, axis=1) > _LEAST_RANGE * np.abs(base).max(axis=1))
    deviation = flat.std(axis=1)
    divisor = np.where(varies, deviation, np.inf)[:, np.newaxis]
    return ((flat - flat.mean(axis=1, keepdims=True)) / divisor).reshape(answers.shape), deviation, varies


def _over_variance(part: OfIndices, variance: Float[np.ndarray, "output row 1"]) -> OfIndices:
    """Return parts of the variance over it, 0 where there is none [-]."""
    return np.asarray(np.divide(part, variance, out=np.zeros_like(part), where=variance > np.finfo(float).eps))
