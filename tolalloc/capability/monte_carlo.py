"""Monte Carlo: random units, their yield and its confidence, limits of any side, and changes on the same units.

What few measured parts leave open of their processes widens the interval of a yield (`ProcessUncertainty`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE, Experiment
from tolalloc.capability.halving import halved
from tolalloc.capability.indices import Interval, Limits
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.seeds import CHUNK, SamplingDesign
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.model import Evaluation, Passing, Response, Samples

AtUnits = Float[np.ndarray, " unit"]
"""A number of every unit."""
AtProcesses = Float[np.ndarray, " process"]
"""A number of every process that measured parts leave possible."""
Moments = tuple[np.ndarray, np.ndarray]
"""By how much processes move the mean [output], and their standard deviations over that of the units [-]."""
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class Yield(Interval):
    """Share of units within the limit, with an exact two-sided interval (Clopper–Pearson).

    The interval and the bound hold for independent units alone, those of the Monte Carlo design; for a Latin hypercube
    or a Sobol' sequence only the estimate may be used.
    """

    bound: float  # One-sided 95 % lower bound, the one that decides whether a target is met [-]
    # Numbers of units [-]
    units: int
    rejected: int
    widening: Widening | None = None  # Why the interval is wider than these units alone make it, if it is

    def widened_by(self, uncertainty: ProcessUncertainty | None, limits: Limits) -> Yield:
        """Return the yield with an interval that also holds what measured parts leave open, if any do."""
        return Widening(uncertainty=uncertainty, limits=limits, counted=self).found if uncertainty else self


@dataclass(frozen=True, kw_only=True)
class Widening:
    """What an interval of a yield holds beside the error of counted units."""

    uncertainty: ProcessUncertainty  # What measured parts leave open
    limits: Limits  # Limits that the yield is of [output]
    counted: Yield  # Yield of the units alone

    @property
    def found(self) -> Yield:
        """The yield with both."""
        return replace(self.uncertainty.widened(self.counted, self.limits), widening=self)

    def with_parts(self, least: int) -> Yield:
        """Return the yield that so many measured parts of every source would leave, were they like these."""
        return replace(self, uncertainty=self.uncertainty.with_parts(least)).found


@dataclass(frozen=True, kw_only=True)
class AnsweredUnits:
    """What a response said of random units."""

    evaluation: Evaluation  # The answers; a failed unit counts as rejected

    @property
    def values(self) -> Float[np.ndarray, " sample"]:
        """First output of the good units."""
        return np.asarray(self.evaluation.values[self.evaluation.good, 0])

    @property
    def failed(self) -> int:
        """Number of units without a usable answer."""
        return int(np.count_nonzero(~self.evaluation.good))

    def within(self, limit: float) -> Yield:
        """Return the yield for an upper limit on the first output."""
        units = self.evaluation.status.size
        return proportion(units, int(np.count_nonzero(self.values > limit)) + self.failed)

    def nearest(self, share: float) -> int:
        """Return the position of the good unit whose first output is nearest to a quantile."""
        distance = np.where(self.evaluation.good, np.abs(self.evaluation.values[:, 0] - self.quantile(share)), np.inf)
        return int(distance.argmin())

    def quantile(self, share: float) -> float:
        """Return the empirical quantile of the good units."""
        return float(np.quantile(self.values, share))

    def quantile_bound(self, target: float, confidence: float = CONFIDENCE) -> float:
        """Return the smallest limit at which this sample shows the target yield with one-sided confidence.

        An order statistic: so many of the largest values are left out as the sample may reject. Infinite if the
        sample is too small to show the target at all. It holds for independent units alone.
        """
        units = self.evaluation.status.size
        allowed = allowed_rejections(units, target, confidence) - self.failed
        return float(np.sort(self.values)[-1 - allowed]) if allowed >= 0 else float("inf")


@dataclass(frozen=True, kw_only=True)
class MonteCarlo(AnsweredUnits):
    """Random units and what the response said of them."""

    x: Samples  # The units' deviations, in the order of the response's columns [m]

    def unit_at(self, share: float) -> Float[np.ndarray, "1 column"]:
        """Return the good unit whose first output is nearest to a quantile [m]."""
        return self.x[[self.nearest(share)]]


@dataclass(frozen=True, kw_only=True)
class RedrawnUnits(AnsweredUnits):
    """Random units whose deviations are not kept: a search has tens of samples, and asks for the deviations of few."""

    redraw: Callable[[], Samples]  # Draws the same deviations again [m]

    def unit_at(self, share: float) -> Float[np.ndarray, "1 column"]:
        """Return the good unit whose first output is nearest to a quantile [m]."""
        return self.redraw()[[self.nearest(share)]]


def proportion(units: int, rejected: int) -> Yield:
    """Return the yield of a sample with its exact intervals, of one unit or more.

    References
    ----------
    Clopper & Pearson 1934: quantiles of a beta distribution, low B(α/2; k, n − k + 1) and high B(1 − α/2; k + 1, n − k)
    of k good units of n. Exact: the interval covers with 95 % or more at every yield.

    Examples
    --------
    >>> found = proportion(100, 5)
    >>> round(found.low, 4), round(found.high, 4), round(found.bound, 4)
    (0.8872, 0.9836, 0.8977)
    """
    from scipy.stats import beta

    accepted, tail = units - rejected, (1 - CONFIDENCE) / 2
    return Yield(
        estimate=accepted / units,
        low=float(beta.ppf(tail, accepted, rejected + 1)) if accepted else 0.0,
        high=float(beta.ppf(1 - tail, accepted + 1, rejected)) if rejected else 1.0,
        bound=float(beta.ppf(1 - CONFIDENCE, accepted, rejected + 1)) if accepted else 0.0,
        units=units,
        rejected=rejected,
    )


_PROCESSES = 12
"""Logarithm to base 2 of the processes that are drawn of those that measured parts leave possible [-]."""
_LEAST_VARIANCE = 0.01
"""Least variance of an output over that of the units: its parts are estimates, which may fall below zero [-]."""
_COUNTED = 30
"""Units beyond the limits from which shares are counted; of fewer the output is taken for normal [-]."""
_HALVINGS = 40


@dataclass(frozen=True, kw_only=True)
class ProcessUncertainty:
    """What measured parts leave open of their processes, and what that does to one output.

    Notes
    -----
    Mean and standard deviation of a process behind n parts are drawn from their posterior under the prior 1/σ²: σ = s·r
    with r² = ν/χ²_ν, and μ = x̄ + σ·z/√n, where ν = n − 1; radii about a known centre have ν = 2n and no μ. Units are
    drawn with x̄ and s. With the processes the output has

    mean M + Σ aᵢ·rᵢ·zᵢ/√nᵢ + Σ dᵢ·(rᵢ² − 1) and variance V + Σ vᵢ·(rᵢ² − 1),

    and the shape that the units show. The effects a, d and v of all columns of a source are regressed on these units:
    the output and its squared deviation on Σx̃ and Σ(x̃² − 1), x̃ the standardised deviations. For an output that is
    linear in the deviations this is exact; the second order of μ is left out (own derivation).

    Valid for normal processes. Parts that refute that keep their shape.

    References
    ----------
    Gelman et al., Bayesian Data Analysis, 3rd ed. (2014), section 3.2: the posterior.
    """

    values: Float[np.ndarray, " good"]  # The output of the units that have one, ascending [output]
    measured: tuple[MeasuredParts, ...]  # Parts behind each source
    parts: tuple[int, ...]  # Their numbers, or what others there might be [-]
    by_mean: Float[np.ndarray, " source"]  # Effect of a mean off by a standard deviation, a [output]
    # Effect of a squared ratio of standard deviations on mean and variance, d [output] and v [output²]
    mean_by_spread: Float[np.ndarray, " source"]
    variance_by_spread: Float[np.ndarray, " source"]

    @classmethod
    def of(cls, errors: ErrorModel, x: Samples, values: Float[np.ndarray, " sample"]) -> ProcessUncertainty | None:
        """Return the process uncertainty of an output, none where no part was measured or the output does not vary.

        Deviations of random units [m, angles rad], and their output, not a number where one has none.
        """
        pairs = zip(errors.active, errors.columns_of_source, strict=False)
        sources = [(source, own) for source, own in pairs if source.measured]
        good = np.isfinite(values)
        if not sources or np.count_nonzero(good) <= 4 * len(sources) or not np.ptp(values[good]) > 0.0:
            return None
        known, squares, means, counts = values[good], list[np.ndarray](), list[np.ndarray](), list[int]()
        for source, own in sources:
            standard = x[good][:, own]
            standard = (standard - standard.mean(axis=0)) / standard.std(axis=0)
            squares.append((standard**2 - 1.0).sum(axis=1))
            means.append(standard.sum(axis=1) if source.feature is Feature.SIZE else np.zeros(known.size))
            counts.append(standard.shape[1])
        features = np.stack([*means, *squares], axis=1)
        centred = features - features.mean(axis=0)
        off = known - known.mean()
        both = np.stack([off, off**2 - (off**2).mean()], axis=1)
        effects = np.linalg.lstsq(centred.T @ centred, centred.T @ both, rcond=None)[0]
        effects *= np.tile(counts, 2)[:, np.newaxis]
        parts = tuple(source.measured for source, _ in sources if source.measured)
        return cls(
            values=np.sort(known),
            measured=parts,
            parts=tuple(own.parts for own in parts),
            by_mean=effects[: len(sources), 0],
            mean_by_spread=effects[len(sources) :, 0],
            variance_by_spread=np.maximum(effects[len(sources) :, 1], 0.0),
        )

    @classmethod
    def about(cls, errors: ErrorModel, x: Samples) -> UncertaintyOf | None:
        """Return what tells of an output of random units what is left open of it, none where no part was measured."""
        return partial(cls.of, errors, x) if any(source.measured for source in errors.active) else None

    def with_parts(self, least: int) -> ProcessUncertainty:
        """Return the uncertainty that so many parts of every source would leave, or more where more were measured."""
        return replace(self, parts=tuple(max(own, least) for own in self.parts))

    @cached_property
    def _moments(self) -> tuple[AtProcesses, AtProcesses]:
        """By how much the mean is off that of the units [output], and standard deviations over theirs [-]."""
        wider, shift = _possible_processes(self.parts, tuple(own.are_radii for own in self.measured))
        mean = shift @ self.by_mean + (wider**2 - 1.0) @ self.mean_by_spread
        variance = 1.0 + (wider**2 - 1.0) @ self.variance_by_spread / self.values.var()
        return mean, np.sqrt(np.maximum(variance, _LEAST_VARIANCE))

    def _beyond(self, limits: Limits, excess: AtProcesses, moments: Moments) -> AtProcesses:
        """Return the share of units that lie further beyond the limits than so far, process by process [-]."""
        (moved, wider), centre, beyond = moments, self.values.mean(), np.zeros(moments[0].size)
        for sign, limit in limits.turned:
            at = centre + (limit + sign * excess - centre - moved) / wider
            below = np.searchsorted(self.values, at, side="right" if sign > 0 else "left")
            beyond += self.values.size - below if sign > 0 else below
        return beyond / self.values.size

    def _excess(self, limits: Limits, share: float, moments: Moments) -> AtProcesses:
        """Return how far beyond the limits a share of the units lies, process by process; by halving [output]."""
        (moved, wider), centre = moments, self.values.mean()
        ends = limits.excess(centre + moved)
        reach = wider * np.abs(self.values[[0, -1]] - centre).max()
        low, high = np.min(ends, axis=0) - reach, np.max(ends, axis=0) + reach
        return np.asarray(halved(lambda by: self._beyond(limits, by, moments) <= share, high, low, _HALVINGS))

    def margin(self, limits: Limits, share: float) -> float:
        """Return how much further inside the limits units must lie so that the share beyond is kept [output].

        With 95 % of the processes that the parts leave possible.
        """
        own = self._excess(limits, share, (np.zeros(1), np.ones(1)))[0]
        return max(float(np.quantile(self._excess(limits, share, self._moments), CONFIDENCE) - own), 0.0)

    def margin_of_spread(self, sign: int, spread: float) -> float:
        """Return by how much mean + spread·σ may lie further out, with 95 % of the possible processes [output]."""
        moved, wider = self._moments
        further = sign * moved + spread * self.values.std() * (wider - 1.0)
        return max(float(np.quantile(further, CONFIDENCE)), 0.0)

    def shares(self, limits: Limits, share: float) -> AtProcesses:
        """Return the share of units beyond the limits for every possible process, where it is so much of all [-].

        Normal scores of the shares that the units show are moved by the same, so that the units give the share asked
        for; of few units beyond the limits the scores are those of a normal output.
        """
        from scipy.special import ndtr, ndtri

        scores, units = list[AtProcesses](), self.values.size
        still = (np.zeros(1), np.ones(1))
        counted = self._beyond(limits, np.zeros(1), still)[0] * units
        for moments in (still, self._moments):
            if min(counted, units - counted) >= _COUNTED:
                beyond = (self._beyond(limits, np.zeros(moments[0].size), moments) * units + 0.5) / (units + 1.0)
            else:
                (moved, wider), centre, deviation = moments, self.values.mean(), self.values.std()
                turned = [sign * (limit - centre - moved) / (wider * deviation) for sign, limit in limits.turned]
                beyond = np.sum([ndtr(-own) for own in turned], axis=0)
            scores.append(ndtri(np.clip(beyond, np.finfo(float).tiny, 1.0 - np.finfo(float).eps)))
        own = ndtri(np.clip(share, np.finfo(float).tiny, 1.0 - np.finfo(float).eps))
        return np.asarray(ndtr(own + scores[1] - scores[0]))

    def widened(self, found: Yield, limits: Limits) -> Yield:
        """Return a yield whose interval and bound also hold what is not known of the processes.

        The error of counted units beside it is drawn from Jeffreys' posterior of a share (Brown, Cai & DasGupta 2001).
        """
        rejected = 1.0 - found.estimate
        # Of none that are beyond the limits, half of one: so much the middle of what is possible.
        shares = self.shares(limits, max(rejected, 0.5 / found.units))
        drawn = np.random.default_rng(2).beta(found.units * shares + 0.5, found.units * (1.0 - shares) + 0.5)
        tail = (1.0 - CONFIDENCE) / 2.0
        least, most, bound = np.quantile(1.0 - drawn, [tail, 1.0 - tail, 1.0 - CONFIDENCE]).tolist()
        return replace(found, low=min(found.low, least), high=max(found.high, most), bound=min(found.bound, bound))


@lru_cache(maxsize=64)
def _possible_processes(
    parts: tuple[int, ...], are_radii: tuple[bool, ...]
) -> tuple[Float[np.ndarray, "process source"], Float[np.ndarray, "process source"]]:
    """Return σ/s and (μ − x̄)/s of processes that so many parts leave possible, the same for the same numbers [-]."""
    from scipy.special import gammaincinv, ndtri
    from scipy.stats import qmc

    points = qmc.Sobol(2 * len(parts), rng=np.random.default_rng(1)).random_base2(_PROCESSES)
    uniform = np.clip(points, np.finfo(float).eps, None).reshape(-1, 2, len(parts)).swapaxes(0, 1)
    counts = np.array(parts, float)
    freedom = np.where(are_radii, 2.0 * counts, counts - 1.0)
    wider = np.sqrt(freedom / (2.0 * gammaincinv(freedom / 2.0, uniform[0])))
    return wider, np.where(are_radii, 0.0, wider * ndtri(uniform[1]) / np.sqrt(counts))


def allowed_rejections(units: int, target: float, confidence: float = CONFIDENCE) -> int:
    """Return how many rejected units still show the target yield with one-sided confidence; −1 if none do.

    The largest k with P(rejects ≤ k) ≤ 1 − confidence, rejects ~ B(units, 1 − target): Clopper & Pearson 1934.

    Examples
    --------
    The fewest units that show 99.73 % with 95 % confidence are 1,109, and none of them may be rejected.

    >>> allowed_rejections(1109, 0.9973), allowed_rejections(1108, 0.9973), allowed_rejections(184_006, 0.9973)
    (0, -1, 459)
    """
    from scipy.stats import binom

    least = int(binom.ppf(1 - confidence, units, 1 - target))  # the fewest that are rejected with that error or more
    return least if binom.cdf(least, units, 1 - target) <= 1 - confidence else least - 1


def monte_carlo(
    experiment: Experiment[Response], units: int, design: SamplingDesign = SamplingDesign.MONTE_CARLO
) -> MonteCarlo:
    """Return random units of an experiment; all intervals assume the design of Monte Carlo.

    The response takes all units at once and solves them in chunks of its own, so that an executor has many to spread.

    References
    ----------
    Quantiles x = F⁻¹(u) of uniform numbers u: Devroye 1986, Non-Uniform Random Variate Generation, ch. 2.
    """
    errors, seeds = experiment.errors, experiment.seeds
    x = np.empty((units, len(errors.columns)))
    for index, uniform in enumerate(seeds.uniform_chunks(units, len(errors.columns), design)):
        x[index * CHUNK : (index + 1) * CHUNK] = experiment.deviations(errors.standard_values(uniform))
    result = MonteCarlo(x=x, evaluation=experiment.response(x))
    require_few_failures(result, "random units", experiment.largest_failed_share)
    return result


def require_few_failures(result: AnsweredUnits, name: str, largest_failed_share: float = LARGEST_FAILED_SHARE) -> None:
    """Raise a `FailedUnitsError` if more units failed than a trustworthy figure admits."""
    units = result.evaluation.status.size
    if result.failed > largest_failed_share * units:
        raise FailedUnitsError(
            f"{name[0].upper()}{name[1:]}: {result.failed:,} of {units:,} units have no usable answer; allowed is a "
            f"share of {largest_failed_share:.4g} (`largest_failed_share`), because more would bias every figure."
        )


@dataclass(frozen=True, kw_only=True)
class OneSided(Passing):
    """The first output of a response, turned so that only its large values are bad.

    Notes
    -----
    An upper limit leaves the output as it is, a lower one turns its sign. Two limits take the larger of the distances
    beyond either, to which the distance between them is added, so that a tolerance relative to the limit has a scale.
    """

    limits: Limits  # Limits of the response's first output

    @property
    def limit(self) -> float:
        """Largest turned output allowed [output]."""
        (sign, limit), *_ = self.limits.turned
        return self.limits.width or sign * limit

    def turned(self, values: Float[np.ndarray, "sample output"]) -> Float[np.ndarray, "sample output"]:
        """Return the outputs with the first one turned."""
        (sign, _), *_ = self.limits.turned
        width, own = self.limits.width, values[:, :1]
        first = width + self.limits.excess(own).max(axis=0) if width else sign * own
        return np.concatenate([first, values[:, 1:]], axis=1)

    def read(self, turned: float) -> float:
        """Return a turned output as a reader knows it: the output itself, or for two limits the distance beyond."""
        (sign, _), *_ = self.limits.turned
        return turned - self.limits.width if self.limits.width else sign * turned

    def facing(self, response: Response) -> Response:
        """Return another response of the same output, turned alike; itself for an upper limit."""
        return response if self.limits.lower is None else replace(self, response=response)

    def __call__(self, x: Samples) -> Evaluation:
        """Return the turned output of every sample."""
        found = self.response(x)
        return replace(found, values=self.turned(found.values))

    def of_sample(self, sample: MonteCarlo) -> MonteCarlo:
        """Return the same units with their first output turned."""
        evaluation = replace(sample.evaluation, values=self.turned(sample.evaluation.values))
        return sample if self.limits.lower is None else replace(sample, evaluation=evaluation)


_RESAMPLES = 1000
"""Resamples of the units behind the interval of a quantile's change [-]."""
_BATCH, _UNITS_AT_ONCE = 50, 2**20
"""Resamples at a time, and units of all of them unless one alone has more, for the sake of memory [-]."""


def share_change(before: Bool[np.ndarray, " unit"], after: Bool[np.ndarray, " unit"]) -> Interval:
    """Return how the share of good units changes [-].

    Only units that are good once and bad once count. The interval takes the exact one of either kind at half the error
    each, so it holds its 95 % at least, with no unit between the two as well.

    References
    ----------
    McNemar 1947: only discordant pairs tell; Clopper–Pearson for either kind, joined by Bonferroni.
    """
    units = before.size
    gained, lost = int(np.count_nonzero(after & ~before)), int(np.count_nonzero(before & ~after))
    up, down = proportion(units, units - gained), proportion(units, units - lost)
    return Interval(estimate=(gained - lost) / units, low=up.low - down.high, high=up.high - down.low)


def quantile_change(before: AtUnits, after: AtUnits, share: float, generator: np.random.Generator) -> Interval:
    """Return how a quantile of the units with both answers changes [unit of the output].

    The interval is that of the bootstrap over units, each with both its values; with fewer than some ten units beyond
    the quantile it is too narrow.

    References
    ----------
    Efron & Tibshirani 1993, ch. 13: percentile interval of a paired bootstrap.
    """
    from scipy.stats import bootstrap

    def change(first: np.ndarray, second: np.ndarray, axis: int = -1) -> np.ndarray:
        return np.asarray(np.quantile(second, share, axis=axis) - np.quantile(first, share, axis=axis))

    both = np.isfinite(before) & np.isfinite(after)
    pair = (before[both], after[both])
    estimate = float(change(*pair))
    if np.array_equal(*pair):
        return Interval(estimate=estimate, low=estimate, high=estimate)
    found = bootstrap(
        pair,
        change,
        paired=True,
        vectorized=True,
        n_resamples=_RESAMPLES,
        batch=max(1, min(_BATCH, _UNITS_AT_ONCE // both.size)),
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=generator,
    ).confidence_interval
    return Interval(estimate=estimate, low=float(found.low), high=float(found.high))


UncertaintyOf = Callable[[Float[np.ndarray, " sample"]], ProcessUncertainty | None]
"""Returns what measured parts leave open of an output of random units, as `ProcessUncertainty.of` does."""

ANY_LIMIT = Limits(upper=0.0)
"""Limits of `largest_excess` [-]."""


def largest_excess(values: Mapping[str, AtUnits], limits: Mapping[str, Limits]) -> AtUnits:
    """Return how far every unit lies beyond any of its limits at most, over the standard deviation of the output [-].

    max over outputs and sides of sign·(y − limit)/σ, own derivation; it is above 0 where a unit fails.
    """
    found = [
        own.excess(values[name]) / (float(values[name][np.isfinite(values[name])].std()) or 1.0)
        for name, own in limits.items()
    ]
    return np.asarray(np.concatenate(found).max(axis=0))


def kept_at_once(
    evaluation: Evaluation, outputs: Sequence[str], limits: Mapping[str, Limits], uncertain: UncertaintyOf | None = None
) -> Yield:
    """Return the share of units that keep all limits at once; one without an answer keeps none.

    The interval is that of `proportion`, and holds what measured parts of these units leave open, where that is told.
    """
    kept = [own.kept_by(evaluation.values[:, outputs.index(name)]) for name, own in limits.items()]
    good = evaluation.good & np.all(kept, axis=0)
    found = proportion(good.size, good.size - int(np.count_nonzero(good)))
    if uncertain is None:
        return found
    values = evaluation.known
    known = {name: values[:, outputs.index(name)] for name in limits}
    return found.widened_by(uncertain(largest_excess(known, limits)), ANY_LIMIT)


_DECIDES = 0.01
"""Share of the units that more must miss a limit than miss the first one, for it to decide [-]."""


def deciding(beyond: Mapping[str, float]) -> str:
    """Return the output whose limits decide, from the share of the units beyond those of each, the first one first.

    The first, unless beyond another lie more than twice as many units, and more than a hundredth of them all: two that
    are missed alike must not change places with the seed.

    Examples
    --------
    >>> deciding({"error": 0.10, "lost motion": 0.19}), deciding({"error": 0.10, "lost motion": 0.21})
    ('error', 'lost motion')
    """
    leading = next(iter(beyond))
    worst, first = max(beyond, key=lambda output: beyond[output]), beyond[leading]
    return worst if beyond[worst] > 2 * first and beyond[worst] - first > _DECIDES else leading


@dataclass(frozen=True, kw_only=True)
class KeptLimits:
    """Which share of random units keeps each limit, and all of them at once."""

    each: Mapping[str, Yield]  # Limited output → share of the units that keep its limits, the leading one first
    joint: Yield  # Share of the units that keep all limits at once

    @classmethod
    def of(
        cls,
        evaluation: Evaluation,
        outputs: Sequence[str],
        limits: Mapping[str, Limits],
        uncertain: UncertaintyOf | None = None,
    ) -> KeptLimits:
        """Return what units say, as `kept_at_once` reads them."""
        each = {name: kept_at_once(evaluation, outputs, {name: own}, uncertain) for name, own in limits.items()}
        return cls(each=each, joint=kept_at_once(evaluation, outputs, limits, uncertain))
