"""Measures of importance beside Sobol's, by SALib: elementary effects, PAWN, and delta from a given sample.

SALib's traps and the guards against them: one NaN makes every figure NaN, so only good samples are passed; its own
seeding and delta's resampling set numpy's global state, so resamples are drawn here; ``conf`` is a multiple of a
standard deviation, so intervals here are percentiles.

Delta, and PAWN of the dummies, are computed here in SALib's definitions, units of all classes beside each other and
equal but for rounding: SALib asks a library for every density anew, a second for every column of 4,096 units and every
resample, and for a p-value of every class that is not read.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE, Experiment
from tolalloc.capability.monte_carlo import AnsweredUnits, MonteCarlo, require_few_failures
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Response
from tolalloc.running.compiled import in_threads
from tolalloc.sensitivity.effort import CLASSES, FEWEST_TRAJECTORIES, FEWEST_UNITS_OF_CLASS
from tolalloc.sensitivity.ranking import percentile_interval, share_interval
from tolalloc.sensitivity.saltelli import resample_counts, unseen
from tolalloc.sensitivity.target import limited_measures

_CURVE_POINTS = 100
"""Points at which delta compares two densities, SALib's number."""
_MOST_CLASSES = 48
"""Classes of delta at most, SALib's number [-]."""
_POINTS_AT_ONCE = 10
"""Points whose kernels are in memory at a time, few enough for the processor's own [-]."""
_LEAST_EXPONENT = -700.0
"""Exponent from which a kernel counts as that small: numbers near the smallest cost twenty times as much [-]."""


def pawn_index(column: Float[np.ndarray, " unit"], y: Float[np.ndarray, " unit"]) -> float:
    """Return the median over classes of equal size of the Kolmogorov–Smirnov distance to the whole sample [-].

    The unit with the largest value of the measure is in no class, as in SALib.

    References
    ----------
    Pianosi & Wagener 2018, with the median over the classes. 0 for no effect, up to 1; from some 100 units.

    Examples
    --------
    Of y = x the first and the last of ten classes lie 0.9 away, the middle ones half of that.

    >>> x = np.linspace(0.0, 1.0, 1001)
    >>> round(pawn_index(x, x), 2)
    0.7
    """
    ends = np.quantile(column, np.arange(0, 1 + 1 / CLASSES, 1 / CLASSES))
    order = np.argsort(y)
    column, last = column[order], np.searchsorted(y[order], y[order], side="right")
    found = []
    for low, high in pairwise(ends[: CLASSES + 1]):
        count = np.cumsum((column >= low) & (column < high))
        if count[-1]:
            apart = count[last - 1] / count[-1] - last / y.size
            found.append(max(apart.max(), -apart.min()))
    return float(np.median(found))


@dataclass(frozen=True, kw_only=True)
class OutputDensity:
    """The density of an output over all units, which delta compares that of every class with."""

    y: Float[np.ndarray, " unit"]  # The output [output]
    grid: Float[np.ndarray, " point"]  # Where densities are compared [output]
    density: Float[np.ndarray, "point 1"]  # The density there [1/output]

    @classmethod
    def of(cls, y: Float[np.ndarray, " unit"]) -> OutputDensity:
        """Return the density of the output of units."""
        grid = np.linspace(y.min(), y.max(), _CURVE_POINTS)
        return cls(y=y, grid=grid, density=_densities(y, np.array([0, y.size]), grid))


def delta_index(column: Float[np.ndarray, " unit"], output: OutputDensity) -> float:
    """Return half the mean distance of the density in classes of a measure from that of all units, with its bias [-].

    A class whose units are all alike has no density and adds nothing.

    References
    ----------
    Plischke, Borgonovo & Smith 2013, eq. (26).
    δ = ½·Σ (n_c/n)·∫ |f(y) − f(y | class c)| dy with Gaussian kernels of Silverman's width [-].

    Examples
    --------
    Of y = x the classes hardly overlap, of a measure that y does not know little but the bias is left.

    >>> y = np.random.default_rng(1).normal(size=1000)
    >>> other = np.random.default_rng(2).normal(size=1000)
    >>> [round(delta_index(column, OutputDensity.of(y)), 1) for column in (y, other)]
    [0.8, 0.1]
    """
    units = output.y.size
    bounds = _class_bounds(units)
    of_classes = _densities(output.y[np.argsort(column, kind="stable")], bounds, output.grid)
    distance = np.trapezoid(np.abs(output.density - of_classes), output.grid, axis=0)
    return float(np.nansum(np.diff(bounds) / (2 * units) * distance))


def _class_bounds(units: int) -> Int[np.ndarray, " bound"]:
    """Return where classes of equal size begin among units in order, and where the last one ends [-]."""
    exponent = 2.0 / (7.0 + np.tanh((1500.0 - units) / 500.0))
    return np.linspace(0, units, min(int(np.ceil(units**exponent)), _MOST_CLASSES) + 1).astype(int)


def _densities(
    y: Float[np.ndarray, " unit"], bounds: Int[np.ndarray, " bound"], grid: Float[np.ndarray, " point"]
) -> Float[np.ndarray, "point class"]:
    """Return the kernel densities of classes, units in their order, by Silverman's rule; NaN where all are alike."""
    starts, counts = bounds[:-1], np.diff(bounds)
    means = np.add.reduceat(y, starts) / counts
    squares = np.add.reduceat((y - np.repeat(means, counts)) ** 2, starts)
    alike = np.maximum.reduceat(y, starts) == np.minimum.reduceat(y, starts)
    width = np.sqrt(squares / np.maximum(counts - 1, 1)) * (counts * 0.75) ** -0.2
    width[alike] = np.nan
    per_width, sums = np.repeat(np.sqrt(0.5) / width, counts), np.empty((grid.size, counts.size))
    for first in range(0, grid.size, _POINTS_AT_ONCE):
        points = slice(first, first + _POINTS_AT_ONCE)
        away = (grid[points, np.newaxis] - y) * per_width
        away *= -away
        np.maximum(away, _LEAST_EXPONENT, out=away)
        np.exp(away, out=away)
        sums[points] = np.add.reduceat(away, starts, axis=1)
    return np.asarray(sums / (counts * np.sqrt(2 * np.pi) * width))


_LEVELS = 4
"""Levels of every uniform number, an even number; a step goes over half of them [-]."""
_TRIM = 0.001
"""Share of the distribution left out at either end, where a normal number would be infinite [-]."""
_RESAMPLES = 400
"""Bootstrap resamples of the trajectories [-]."""


@dataclass(frozen=True, kw_only=True)
class ElementaryEffects:
    """What a large step of one source alone does, from many places."""

    sources: tuple[str, ...]  # Names, in the order of all arrays; correlated sources stand together, joined by " + "
    # Change of the output per step over the length of the step in uniform numbers; its sign is that of the change for a
    # rising number, and for a source of several columns, which step in random directions, has no meaning [output]
    effects: Float[np.ndarray, "output trajectory source"]
    mu_star: Float[np.ndarray, "output source"]  # Mean of the effects' magnitudes [output]
    # The same from bootstrap resamples of the trajectories [output]
    mu_star_resamples: Float[np.ndarray, "output resample source"]
    # Standard deviation of the effects, NaN for a source of several columns [output]
    sigma: Float[np.ndarray, "output source"]
    unseen: Float[np.ndarray, "output source"]  # Mean possible where too few show an effect, else 0 [output]
    # Trajectories used, and those dropped because one of their samples failed [-]
    trajectories: int
    dropped: int

    def mu_star_interval(self, output: int) -> Float[np.ndarray, "2 source"]:
        """Return the 90 % percentile interval of the mean magnitudes of one output [output]."""
        return percentile_interval(self.mu_star_resamples[output], unseen=self.unseen[output])


@dataclass(frozen=True, kw_only=True)
class MomentIndependent:
    """How much knowing a source changes the whole distribution of the first output."""

    sources: tuple[str, ...]  # Names, in the order of all arrays
    pawn: Float[np.ndarray, " source"]  # Median over classes of the Kolmogorov–Smirnov distance to the whole sample [-]
    delta: Float[np.ndarray, " source"]  # Half the mean distance between the densities, less its bias [-]
    delta_resamples: Float[np.ndarray, "resample source"]  # The same from bootstrap resamples of the units [-]
    # Largest index among the dummies, vectors that the output does not depend on: a level that means nothing [-]
    pawn_dummy: float
    delta_dummy: float
    # Good units, and those without a usable answer [-]
    units: int
    failed: int

    @property
    def delta_interval(self) -> Float[np.ndarray, "2 source"]:
        """90 % interval of delta [-]."""
        return share_interval(self.delta_resamples)


def elementary_effects(experiment: Experiment[Response], trajectories: int) -> ElementaryEffects:
    """Return the elementary effects of all sources on all outputs.

    Parameters
    ----------
    trajectories
        Trajectories; the response is called (sources + 1) times as often [-].

    Raises
    ------
    InputError
        Fewer than two trajectories.
    SolveError
        More samples failed than allowed, or fewer than two trajectories without a failed one are left.

    References
    ----------
    Morris 1991; Campolongo, Cariboni & Saltelli 2007, mu* and groups; SALib draws the trajectories.
    An effect is (y(u + Δ·e_j) − y(u))/Δ in uniform numbers u, Δ = 2/3; μ* is the mean of its magnitudes [output].

    Examples
    --------
    Effects of a sum are as the zones, here as 1 to 2.

    >>> from tolalloc.capability.experiment import sum_of_sizes
    >>> found = elementary_effects(sum_of_sizes(6.0, 12.0), 64).mu_star[0]
    >>> round(float(found[1] / found[0]), 1)
    2.0
    """
    if trajectories < FEWEST_TRAJECTORIES:
        raise InputError.at("elementary effects", "trajectories", trajectories, f"{FEWEST_TRAJECTORIES} or more")
    errors, seeds = experiment.errors, experiment.seeds
    groups = errors.block_of_column
    names = tuple(dict.fromkeys(groups))
    problem = {
        "num_vars": len(errors.columns),
        "names": list(errors.columns),
        "groups": list(groups),
        "bounds": [[_TRIM, 1.0 - _TRIM]] * len(errors.columns),
    }
    from SALib.sample import morris

    uniform = morris.sample(problem, trajectories, num_levels=_LEVELS, seed=seeds.child("sample").integer())
    evaluation = experiment.response(experiment.deviations(errors.standard_values(uniform)))
    whole = evaluation.good.reshape(trajectories, -1).all(axis=1)
    used = int(np.count_nonzero(whole))
    require_few_failures(AnsweredUnits(evaluation=evaluation), "elementary effects", experiment.largest_failed_share)
    if used < FEWEST_TRAJECTORIES:
        raise SolveError(f"Elementary effects: {used} of {trajectories} trajectories are left; at least 2 are needed.")
    members = np.array(groups)[:, np.newaxis] == names
    x, y = (own.reshape(trajectories, len(names) + 1, -1)[whole] for own in (uniform, evaluation.values))
    effects = _effects(x, y, members, _LEVELS / (2.0 * (_LEVELS - 1)))
    counts = resample_counts(used, _RESAMPLES, seeds.child("resamples"))[1:]
    mu_star, sigma = _morris(problem, x.reshape(-1, x.shape[2]), y.reshape(-1, y.shape[2]))
    return ElementaryEffects(
        sources=names,
        effects=effects,
        mu_star=mu_star,
        mu_star_resamples=counts @ np.abs(effects) / used,
        sigma=sigma,
        unseen=unseen(np.abs(effects).transpose(1, 0, 2)),
        trajectories=used,
        dropped=trajectories - used,
    )


def moment_independent(
    sample: MonteCarlo,
    errors: ErrorModel,
    seeds: SeedTree,
    *,
    resamples: int = 50,
    dummies: int = 20,
    largest_failed_share: float = LARGEST_FAILED_SHARE,
) -> MomentIndependent:
    """Return PAWN and delta from a sample that exists already.

    Parameters
    ----------
    sample, errors, seeds, largest_failed_share
        As of `tolalloc.sensitivity.target.target_sensitivity`.
    resamples
        Bootstrap resamples of the units for delta [-].
    dummies
        Vectors that the output does not depend on, each the source of most measures in a random order of the units.
        A source without an effect passes them all with probability 1/(dummies + 1), or less if it has fewer
        measures [-].

    Raises
    ------
    InputError
        Too few units for the classes of PAWN.
    SolveError
        More units failed, or the output does not vary.

    Notes
    -----
    Each source is known through the measure that its drawing limits and, if that measure is of several columns and of
    one feature, also through each column alone, because a vector can act by its length or along a direction; the
    largest index counts. What only length and direction together tell is left out.

    References
    ----------
    Pianosi & Wagener 2018 (PAWN from given data); Plischke, Borgonovo & Smith 2013, eq. (26) and (30) (delta).

    Examples
    --------
    Both rank the larger part of a sum first.

    >>> from tolalloc.capability.experiment import sum_of_sizes
    >>> from tolalloc.capability.monte_carlo import monte_carlo
    >>> experiment = sum_of_sizes(6.0, 12.0)
    >>> found = moment_independent(monte_carlo(experiment, 512), experiment.errors, SeedTree(2), resamples=4, dummies=2)
    >>> found.pawn.round(1).tolist(), found.delta.round(1).tolist()
    ([0.2, 0.4], [0.1, 0.4])
    """
    require_few_failures(sample, "moment-independent indices", largest_failed_share)
    drawn, needed = sample.x.shape[0], FEWEST_UNITS_OF_CLASS * CLASSES
    if drawn < needed:
        raise InputError.at("moment-independent indices", "units", drawn, f"{needed} or more")
    y, known = sample.values, _known(errors, sample.x[sample.evaluation.good])
    if not np.ptp(y) > 0.0:
        raise SolveError("Moment-independent indices: the output is the same for all units; no source can be ranked.")
    widest, shuffle = max(known, key=lambda own: own.shape[1]), seeds.child("dummies").generator()
    pawns = _pawn(known, y)
    known += [shuffle.permutation(widest) for _ in range(dummies)]
    output, generator = OutputDensity.of(y), seeds.child("resamples").generator()
    strongest = [columns[:, np.argmax([delta_index(column, output) for column in columns.T])] for columns in known]
    deltas = _reduced_deltas(np.column_stack(strongest), y, generator.integers(y.size, size=(resamples, y.size)))
    count = len(known) - dummies
    return MomentIndependent(
        sources=tuple(dict.fromkeys(errors.source_of_column)),
        pawn=np.array(pawns),
        delta=deltas[:, :count].mean(axis=0),
        delta_resamples=deltas[:, :count],
        pawn_dummy=max(pawn_index(column, y) for columns in known[count:] for column in columns.T),
        delta_dummy=float(deltas[:, count:].mean(axis=0).max()),
        units=y.size,
        failed=sample.failed,
    )


def _morris(
    problem: dict[str, Any], x: Float[np.ndarray, "sample column"], y: Float[np.ndarray, "sample output"]
) -> tuple[Float[np.ndarray, "output source"], Float[np.ndarray, "output source"]]:
    """Return mean magnitude and standard deviation of the effects by SALib, NaN for several columns [output]."""
    from SALib.analyze import morris

    found = [morris.analyze(problem, x, own, num_levels=_LEVELS, num_resamples=2, seed=1) for own in y.T.copy()]
    mu_star, sigma = (np.array([np.asarray(own[name], float) for own in found]) for name in ("mu_star", "sigma"))
    return mu_star, sigma


def _pawn(known: list[Float[np.ndarray, "unit measure"]], y: Float[np.ndarray, " unit"]) -> list[float]:
    """Return the largest index of the measures of every source by SALib [-]."""
    from SALib.analyze import pawn

    columns = np.column_stack(known)
    problem = {"num_vars": columns.shape[1], "names": [f"x{at}" for at in range(columns.shape[1])]}
    with warnings.catch_warnings():  # of the p-values of classes, which are not read
        warnings.simplefilter("ignore", RuntimeWarning)
        found = iter(pawn.analyze(problem, columns, y, S=CLASSES)["median"].tolist())
    return [max(next(found) for _ in own.T) for own in known]


def _effects(
    uniform: Float[np.ndarray, "trajectory sample column"],
    values: Float[np.ndarray, "trajectory sample output"],
    members: Bool[np.ndarray, "column source"],
    step: float,
) -> Float[np.ndarray, "output trajectory source"]:
    """Return the change of the outputs over the step, with the direction of the first column of what moved [output]."""
    moves = np.sign(np.diff(uniform, axis=1)) @ (members & (members.cumsum(axis=0) == 1))
    # Every trajectory moves every source once, each in an order of its own.
    return np.asarray(np.einsum("tso,tsg->otg", np.diff(values, axis=1), moves) / step)


def _known(errors: ErrorModel, x: Float[np.ndarray, "unit column"]) -> list[Float[np.ndarray, "unit measure"]]:
    """Return for every source the measures through which it may be known."""
    where, found = np.array(errors.source_of_column), []
    alone = {source.name for source in errors.active if source.each == 1}
    for name, measure in zip(dict.fromkeys(errors.source_of_column), limited_measures(errors, x).T, strict=True):
        own = x[:, where == name]
        several = own.shape[1] > 1 and (name in alone)
        found.append(np.column_stack([measure, own]) if several else measure[:, np.newaxis])
    return found


def _reduced_deltas(
    columns: Float[np.ndarray, "unit source"], y: Float[np.ndarray, " unit"], drawn: Int[np.ndarray, "resample unit"]
) -> Float[np.ndarray, "resample source"]:
    """Return twice the estimates less those of each resample; their mean is the estimate without its bias [-].

    All sources have their units resampled alike, so that the density over all units is made once a resample.
    """

    def deltas(units: Int[np.ndarray, " unit"]) -> list[float]:
        output = OutputDensity.of(y[units])
        return [delta_index(column[units], output) for column in columns.T]

    found = np.empty((len(drawn), columns.shape[1]))

    def resample(part: slice) -> None:
        found[part] = [deltas(units) for units in drawn[part]]

    in_threads(resample, len(drawn), size=1)
    return 2.0 * np.array(deltas(np.arange(y.size))) - found
