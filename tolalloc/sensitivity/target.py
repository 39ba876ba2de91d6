"""What drives units beyond the limit, from a Monte Carlo sample that exists already."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.capability.monte_carlo import MonteCarlo, require_few_failures
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import limited_measure
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Samples
from tolalloc.sensitivity.effort import FEWEST_OUTSIDE, FEWEST_UNITS, WORST_SHARE
from tolalloc.sensitivity.ranking import AtSources, Ends, Resamples, percentile_interval, share_interval

Squares = Float[np.ndarray, "unit source"]
"""Mean squares of the standardised columns of each source [-]."""
IsOutside = Bool[np.ndarray, " unit"]
"""Which units are outside."""
_CLASSES_PER_ROOT = 2
"""Classes of a measure over √units: fewer would hide how steeply the chance rises, more would scatter [-]."""


@dataclass(frozen=True, kw_only=True)
class TargetSensitivity:
    """How each source takes part in the units beyond a threshold of the first output."""

    sources: tuple[str, ...]  # Names, in the order of all arrays
    threshold: float  # Output beyond which a unit counts as outside [output]
    is_limit: bool  # Whether the threshold is the limit; if not, it cuts off the worst 5 % of the units
    # Good units, and how many of them are outside [-]
    units: int
    outside: int
    # First-order index of "is outside" given the measure that the drawing limits [-]
    first: AtSources
    first_resamples: Resamples  # The same from resamples [-]
    # Mean square of the standardised columns among the units outside over that of all units; 1 means no part [-]
    lift: AtSources
    lift_resamples: Resamples  # The same from bootstrap resamples of the units [-]
    columns: Int[np.ndarray, " source"]  # Columns of each source that vary [-]
    # Share of random choices of as many units whose lift is as far from 1 or farther, two-sided [-]
    p_value: AtSources
    # Median of the measure that the drawing limits, of all units and of those outside [m]
    median: AtSources
    median_outside: AtSources

    @property
    def first_interval(self) -> Ends:
        """90 % interval of the first-order target indices [-]."""
        return share_interval(self.first_resamples)

    @property
    def lift_interval(self) -> Ends:
        """90 % percentile interval of the lifts [-]."""
        return percentile_interval(self.lift_resamples)

    @property
    def excess(self) -> AtSources:
        """Sum over a source's columns of their mean squares beyond 1, which many columns do not dilute [-]."""
        return np.asarray(self.columns * (self.lift - 1.0))

    @property
    def excess_interval(self) -> Ends:
        """90 % percentile interval of the excesses [-]."""
        return np.asarray(self.columns * (self.lift_interval - 1.0))


def target_sensitivity(
    sample: MonteCarlo,
    errors: ErrorModel,
    limit: float,
    seeds: SeedTree,
    *,
    resamples: int = 400,
    permutations: int = 1999,
    largest_failed_share: float = LARGEST_FAILED_SHARE,
) -> TargetSensitivity:
    """Return what the units beyond the limit have in common.

    Parameters
    ----------
    limit
        Largest first output allowed; unless enough units stand on either side, the worst 5 % are taken instead.
    resamples, permutations
        Bootstrap resamples, and random choices of units for the test of no effect [-].

    Notes
    -----
    Lift and excess [-] by theory page equation (47). The index of a vector is that given its length, so it leaves out
    what the vector's direction adds. The lift of a vector is the mean over all its columns, so it compares sources of
    as many columns; the excess is the sum and compares all: for a sum of normal columns the excesses are to each other
    as the shares of the variance. In a correlated error model all of them also show what a source only goes along with,
    so a block's excesses do not add up to what the block does. Classes hide a part of a large index far out (measured:
    6 % of it with 85 of 6,144 units outside); its interval is too wide near 0, where the p-value says more.

    References
    ----------
    Target sensitivity, indices of the indicator of a critical domain: Marrel & Chabridon 2021. Given-data estimate by
    classes of equal size: Plischke, Borgonovo & Smith 2013, with ω² of the analysis of variance against its bias.

    Examples
    --------
    Of the 5 % largest sums with σ of 1 and 2, excess mean squares are as the variances, 1 to 4 but for chance.

    >>> from tolalloc.capability.experiment import Experiment
    >>> from tolalloc.capability.monte_carlo import monte_carlo
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "min": 1, "max": 60, "cost": 1}
    >>> rows = [{"id": "a", "plus": 3, "minus": -3, **row}, {"id": "b", "plus": 6, "minus": -6, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> y = ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("y [mm]",)).bound(errors, "")
    >>> experiment = Experiment.of(y, errors, SeedTree(1))
    >>> sample = monte_carlo(experiment, 8192)
    >>> found = target_sensitivity(sample, errors, np.inf, SeedTree(2), resamples=10, permutations=19)
    >>> round(float(found.excess[1] / found.excess[0]))
    4
    """
    require_few_failures(sample, "target sensitivity", largest_failed_share)
    good = sample.evaluation.good
    x, values = sample.x[good], sample.values
    threshold, is_limit = _threshold(values, limit, units=good.size)
    outside = values > threshold
    if outside.all():
        raise SolveError("Target sensitivity: the output is the same for all units, so none is set apart.")
    measures, squares = limited_measures(errors, x), _mean_squares(errors, x)
    sources, where = tuple(dict.fromkeys(errors.source_of_column)), np.array(errors.source_of_column)
    varies = x.std(axis=0) > 0.0
    tables = np.stack([_table(measure, outside) for measure in measures.T])
    return TargetSensitivity(
        sources=sources,
        threshold=threshold,
        is_limit=is_limit,
        units=values.size,
        outside=int(np.count_nonzero(outside)),
        first=_first(tables),
        first_resamples=_first_resamples(tables, seeds.child("first"), resamples),
        lift=squares[outside].mean(axis=0) / squares.mean(axis=0),
        lift_resamples=_lift_resamples(squares, outside, seeds.child("lift"), resamples),
        columns=np.array([np.count_nonzero(varies[where == name]) for name in sources]),
        p_value=_p_value(squares, outside, seeds.child("permutations"), permutations),
        median=np.median(measures, axis=0),
        median_outside=np.median(measures[outside], axis=0),
    )


def limited_measures(errors: ErrorModel, x: Samples) -> Float[np.ndarray, "sample source"]:
    """Return what the drawing limits, for every source, in such a way that it compares with the zone [m].

    A size: its deviation from the middle. A position: twice the distance from the true one. Pitch and run-out: the
    range over a turn. Of like features the largest one counts. No drawing limits a joint source: for it, the root mean
    square of its standardised columns stands [-].

    Position 2·√(x² + y²) and run-out max − min: ISO 1101:2017; pitch max − min, its total cumulative deviation: ISO
    1328-1:2013.
    """
    where = np.array(errors.source_of_column)
    zoned = [limited_measure(source, x[:, where == source.name]) for source in errors.active]
    return np.column_stack([*zoned, np.sqrt(_mean_squares(errors, x)[:, len(zoned) :])])


def _mean_squares(errors: ErrorModel, x: Samples) -> Float[np.ndarray, "sample source"]:
    """Return the mean square over each source's columns, each less its mean and over its deviation [-]."""
    deviation = x.std(axis=0)
    squares = ((x - x.mean(axis=0)) / np.where(deviation > 0.0, deviation, np.inf)) ** 2
    where = np.array(errors.source_of_column)
    return np.column_stack([squares[:, where == name].mean(axis=1) for name in dict.fromkeys(errors.source_of_column)])


def _threshold(values: Float[np.ndarray, " good_unit"], limit: float, *, units: int) -> tuple[float, bool]:
    """Return the limit, or what cuts off the worst units if it divides them too unevenly, and which it is."""
    outside = int(np.count_nonzero(values > limit))
    if FEWEST_OUTSIDE <= outside <= values.size - FEWEST_OUTSIDE:
        return limit, True
    if units < FEWEST_UNITS:
        raise InputError.at("target sensitivity", "units", units, f"{FEWEST_UNITS} or more for {outside} outside")
    cut, most = float(np.quantile(values, 1.0 - WORST_SHARE)), values.max()
    # Of an output with steps the worst units may all be alike: then they are those on the highest step.
    return cut if cut < most else float(values[values < most].max(initial=-np.inf)), False


def _table(measure: Float[np.ndarray, " unit"], outside: IsOutside) -> Int[np.ndarray, "class 2"]:
    """Return how many units of each class are inside and outside, classes of equal size by rank [-]."""
    classes = _CLASSES_PER_ROOT * int(np.sqrt(measure.size))
    own = np.argsort(np.argsort(measure, kind="stable"), kind="stable") * classes // measure.size
    return np.asarray(np.bincount(2 * own + outside, minlength=2 * classes).reshape(classes, 2))


def _between(tables: Int[np.ndarray, "*any class 2"]) -> Float[np.ndarray, "*any"]:
    """Return the share of the variance that lies between the classes, biased upwards [-]."""
    inside, outside = np.moveaxis(tables, -1, 0)
    count = inside + outside
    share = outside.sum(axis=-1, keepdims=True) / count.sum(axis=-1, keepdims=True)
    total = (count.sum(axis=-1, keepdims=True) * share * (1.0 - share))[..., 0]
    # A resample may leave a class empty; it then weighs nothing.
    return np.asarray((count * (outside / np.maximum(count, 1) - share) ** 2).sum(axis=-1) / total)


def _first(tables: Int[np.ndarray, "*any class 2"]) -> Float[np.ndarray, "*any"]:
    """Return the first-order index, without the share that chance alone puts between the classes [-]."""
    classes, units = tables.shape[-2], tables.sum(axis=(-2, -1))
    between = _between(tables)
    return np.asarray(between - (classes - 1) * (1.0 - between) / (units - classes))


def _first_resamples(tables: Int[np.ndarray, "source class 2"], seeds: SeedTree, resamples: int) -> Resamples:
    """Return first-order indices of resampled units [-].

    The units of a resample fall on the table as a multinomial sample. It scatters about the biased share of the
    table, because it takes the table's own scatter for an effect; the difference is taken off.
    """
    generator, found = seeds.generator(), []
    for table in tables:
        drawn = generator.multinomial(int(table.sum()), (table / table.sum()).ravel(), resamples)
        found.append(_first(drawn.reshape(resamples, *table.shape)) - _between(table) + _first(table))
    return np.column_stack(found)


def _lift_resamples(squares: Squares, outside: IsOutside, seeds: SeedTree, resamples: int) -> Resamples:
    """Return the lifts of bootstrap resamples of the units [-]."""
    generator, found, units = seeds.generator(), [], outside.size
    own = squares[outside]
    for _ in range(resamples):
        counts = np.bincount(generator.integers(units, size=units), minlength=units).astype(float)
        beyond = counts[outside]
        found.append((beyond @ own / beyond.sum()) / (counts @ squares / units))
    return np.stack(found)


def _p_value(squares: Squares, outside: IsOutside, seeds: SeedTree, permutations: int) -> AtSources:
    """Return the two-sided permutation test of no effect, the observed choice among the random ones [-]."""
    generator, count = seeds.generator(), int(np.count_nonzero(outside))
    middle = squares.mean(axis=0)
    observed = np.abs(squares[outside].mean(axis=0) - middle)
    as_far = np.ones(squares.shape[1])
    for _ in range(permutations):
        chosen = generator.choice(outside.size, count, replace=False, shuffle=False)
        as_far += np.abs(squares[chosen].mean(axis=0) - middle) >= observed
    return as_far / (permutations + 1)
