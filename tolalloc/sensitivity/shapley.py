"""Shapley effects: shares of the variance that add up to one, whether the sources depend on each other or not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import AnsweredUnits, require_few_failures
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation, Response, Samples
from tolalloc.sensitivity.ranking import rank_interval, share_interval
from tolalloc.sensitivity.saltelli import resample_counts, unseen

Positions = Int[np.ndarray, "order source"]
"""Position of each source in each order."""
_RESAMPLES = 400
_AT_ONCE = 128
"""Permutations whose samples are in memory at a time [-]."""
_PIVOT = 1e-10
"""Variance that the sources before leave of a source, below which they fix it [-]."""


@dataclass(frozen=True, kw_only=True)
class ShapleyEffects:
    """Shapley effects of every source on every output."""

    sources: tuple[str, ...]  # Names, in the order of all arrays
    # Share of the output's variance; the shares of one output add up to 1. Not a number for an output that is the same
    # for all samples [-].
    effects: Float[np.ndarray, "output source"]
    resamples: Float[np.ndarray, "output resample source"]  # The same from bootstrap resamples of the permutations [-]
    unseen: Float[np.ndarray, "output source"]  # Share possible where too few permutations show a source, else 0 [-]
    dropped: int  # Permutations dropped because one of their samples failed [-]

    def interval(self, output: int) -> Float[np.ndarray, "2 source"]:
        """Return the 90 % interval of the effects on an output [-]."""
        return share_interval(self.resamples[output], self.unseen[output])

    def rank_interval(self, output: int) -> Int[np.ndarray, "2 source"]:
        """Return the 90 % percentile interval of each source's rank, 1 for the largest effect on an output [-]."""
        return rank_interval(self.resamples[output])


def shapley_effects(experiment: Experiment[Response], permutations: int) -> ShapleyEffects:
    """Return the Shapley effects of all varying sources on all outputs, from the same samples.

    All columns of a source go together; the response is asked for (sources + 1) samples of every permutation.

    Notes
    -----
    Theory page equation (45) [-], for correlated sources too. The worth of a set of sources is the variance that they
    leave when all others are known, E[Var(Y | others)], which has the effects of the variance that they explain; the
    effect is what it adds to the set of those before it, averaged over random orders. In each order every source is
    written as a function of its own independent normal numbers and of the sources behind it, the Gaussian copula's
    conditional distribution. Two samples then become d + 1: the sources get the numbers of the second sample one after
    the other, and half the squared change since the first sample has the worth as its expectation. Since neighbouring
    sets share their numbers, a source that hardly matters also hardly adds noise.

    References
    ----------
    Song, Nelson & Staum 2016, SIAM/ASA J. Uncertainty Quantification 4 (worth, random orders, conditional samples);
    Goda 2021, Reliability Engineering & System Safety 213 (one chain of samples per order); Owen & Prieur 2017,
    SIAM/ASA J. Uncertainty Quantification 5 (dependent inputs).

    Examples
    --------
    Independent parts of a sum with σ of 1 and 2 have the shares 1/5 and 4/5.

    >>> from tolalloc.drawings.seeds import SeedTree
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "min": 1, "max": 60, "cost": 1}
    >>> rows = [{"id": "a", "plus": 3, "minus": -3, **row}, {"id": "b", "plus": 6, "minus": -6, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> y = ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("y [mm]",)).bound(errors, "")
    >>> experiment = Experiment.of(y, errors, SeedTree(1))
    >>> shapley_effects(experiment, 4000).effects[0].round(1).tolist()
    [0.2, 0.8]
    """
    if permutations < 2:
        raise InputError.at("Shapley effects", "permutations", permutations, "2 or more")
    response, names = experiment.response, tuple(dict.fromkeys(experiment.errors.source_of_column))
    answered = [(response(x), position) for position, x in _samples(experiment, permutations)]
    evaluation = Evaluation.joined([own for own, _ in answered])
    require_few_failures(AnsweredUnits(evaluation=evaluation), "Shapley effects", experiment.largest_failed_share)
    added = np.concatenate([_added(*own) for own in answered])
    used = added.shape[0]
    if used < 2:
        raise SolveError(f"Shapley effects: {used} of {permutations} permutations are left; at least 2 are needed.")
    counts = resample_counts(used, _RESAMPLES, experiment.seeds.child("resamples"))
    effects, possible = _shares(added, counts), unseen(np.abs(added))
    whole = added.mean(axis=0).sum(axis=1, keepdims=True)
    return ShapleyEffects(
        sources=names,
        effects=effects[:, 0],
        resamples=effects[:, 1:],
        unseen=np.divide(possible, whole, out=np.zeros_like(possible), where=whole > 0.0),
        dropped=permutations - used,
    )


def _samples(experiment: Experiment[Response], permutations: int) -> Iterator[tuple[Positions, Samples]]:
    """Yield some orders as the position of each source, and their chains of samples [m], order by order."""
    errors, seeds = experiment.errors, experiment.seeds
    sources, columns = len(errors.columns_of_source), len(errors.columns)
    of_column = np.repeat(np.arange(sources), [own.stop - own.start for own in errors.columns_of_source])
    orders = seeds.child("orders").uniform_chunks(permutations, sources)
    numbers = seeds.child("samples").uniform_chunks(permutations, 2 * columns)
    for order_numbers, own in zip(orders, numbers, strict=True):
        for start in range(0, own.shape[0], _AT_ONCE):
            position = np.argsort(order_numbers[start : start + _AT_ONCE], axis=1)
            first, second = np.split(own[start : start + _AT_ONCE, np.newaxis], 2, axis=2)
            exchanged = position[:, np.newaxis] < np.arange(sources + 1)[:, np.newaxis]
            uniform = np.where(exchanged[:, :, of_column], second, first)
            mixed = errors.mixed(uniform, _conditional_factor(errors.source_correlation, position)[:, np.newaxis])
            yield position, experiment.deviations(errors.marginal_values(mixed.reshape(-1, columns)))


def _conditional_factor(
    correlation: Float[np.ndarray, "source source"], position: Positions
) -> Float[np.ndarray, "order source source"]:
    """Return roots of the correlation in which a source takes numbers of its own and of the sources behind it [-].

    Cholesky's factor in the reverse of each order. Where the sources behind fix a source, it has no number of its own.
    """
    left = np.repeat(correlation[np.newaxis], position.shape[0], axis=0)
    factor, order = np.zeros_like(left), np.argsort(-position, axis=1)
    rows = np.arange(position.shape[0])
    for source in order.T:
        column = left[rows, :, source]
        pivot = column[rows, source, np.newaxis]
        column = np.where(pivot > _PIVOT, column / np.sqrt(np.maximum(pivot, _PIVOT)), 0.0)
        factor[rows, :, source] = column
        left -= column[:, :, np.newaxis] * column[:, np.newaxis]
    return factor


def _added(evaluation: Evaluation, position: Positions) -> Float[np.ndarray, "good_order output source"]:
    """Return what each source adds to the worth of those before it, for orders without a failed sample [output²]."""
    orders, samples = position.shape[0], position.shape[1] + 1
    good = evaluation.good.reshape(orders, samples).all(axis=1)
    y = evaluation.values.reshape(orders, samples, -1)[good]
    steps = np.diff(0.5 * (y - y[:, :1]) ** 2, axis=1)
    return np.take_along_axis(steps, position[good, :, np.newaxis], axis=1).transpose(0, 2, 1)


def _shares(
    added: Float[np.ndarray, "order output source"], counts: Float[np.ndarray, "row order"]
) -> Float[np.ndarray, "output row source"]:
    """Return each source's share of what all add, for every row of counts [-]."""
    worth = (counts @ added.reshape(added.shape[0], -1)).reshape(counts.shape[0], *added.shape[1:]).transpose(1, 0, 2)
    whole = worth.sum(axis=2, keepdims=True)
    return np.asarray(np.divide(worth, whole, out=np.full_like(worth, np.nan), where=whole > 0.0))
