"""Monte Carlo: random units, their yield and its confidence, limits of any side, and changes on the same units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE, Experiment
from tolalloc.capability.indices import Limits
from tolalloc.drawings.seeds import CHUNK, SamplingDesign, uniform_chunks
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.model import Evaluation, Response

CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class Yield:
    """Share of units within the limit, with an exact two-sided interval (Clopper–Pearson).

    The interval and the bound hold for independent units alone, those of the Monte Carlo design; for a Latin hypercube
    or a Sobol' sequence only the estimate may be used.
    """

    # Yield and its 95 % interval [-]
    estimate: float
    low: float
    high: float
    bound: float  # One-sided 95 % lower bound, the one that decides whether a target is met [-]
    # Numbers of units [-]
    units: int
    rejected: int


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

        Notes
        -----
        An order statistic: so many of the largest values are left out as the sample may reject. Infinite if the
        sample is too small to show the target at all. Like the bound of `Yield`, it holds for independent units alone.
        """
        units = self.evaluation.status.size
        allowed = allowed_rejections(units, target, confidence) - self.failed
        return float(np.sort(self.values)[-1 - allowed]) if allowed >= 0 else float("inf")


@dataclass(frozen=True, kw_only=True)
class MonteCarlo(AnsweredUnits):
    """Random units and what the response said of them."""

    x: Float[np.ndarray, "sample column"]  # The units' deviations, in the order of the response's columns [m]

    def unit_at(self, share: float) -> Float[np.ndarray, "1 column"]:
        """Return the good unit whose first output is nearest to a quantile [m]."""
        return self.x[[self.nearest(share)]]


@dataclass(frozen=True, kw_only=True)
class RedrawnUnits(AnsweredUnits):
    """Random units whose deviations are not kept: a search has tens of samples, and asks for the deviations of few."""

    redraw: Callable[[], Float[np.ndarray, "sample column"]]  # Draws the same deviations again [m]

    def unit_at(self, share: float) -> Float[np.ndarray, "1 column"]:
        """Return the good unit whose first output is nearest to a quantile [m]."""
        return self.redraw()[[self.nearest(share)]]


def proportion(units: int, rejected: int) -> Yield:
    """Return the yield of a sample with its exact intervals.

    Parameters
    ----------
    units, rejected
        Numbers of units, 1 or more, and of those that are not good [-].

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


def allowed_rejections(units: int, target: float, confidence: float = CONFIDENCE) -> int:
    """Return how many rejected units still show the target yield with one-sided confidence; −1 if none do.

    The largest k with P(rejects ≤ k) ≤ 1 − confidence, rejects ~ B(units, 1 − target): Clopper & Pearson 1934.

    Notes
    -----
    As many as a design just at the target rejects with at most the error that is left: what Clopper–Pearson's bound
    says.

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
    """Return random units of an experiment.

    Parameters
    ----------
    units
        Number of units [-].
    design
        How the units are spread; all intervals assume the first one.

    Raises
    ------
    SolveError
        More units failed.

    Notes
    -----
    The deviations are kept, the uniform numbers behind them only for one chunk at a time. The response takes all units
    at once and solves them in chunks of its own, so that an executor has many chunks to spread.

    References
    ----------
    Quantiles x = F⁻¹(u) of uniform numbers u: Devroye 1986, Non-Uniform Random Variate Generation, ch. 2.

    Examples
    --------
    A sum with σ of 1 and 2 has √(1 + 4) = 2.24.

    >>> from tolalloc.capability.experiment import sum_of_sizes
    >>> round(float(monte_carlo(sum_of_sizes(6.0, 12.0), 10_000).values.std()), 1)
    2.2
    """
    errors, seeds = experiment.errors, experiment.seeds
    x = np.empty((units, len(errors.columns)))
    for index, uniform in enumerate(uniform_chunks(design, seeds, units, len(errors.columns))):
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
            f"share of {largest_failed_share:.4g}, because more would bias every figure."
        )


@dataclass(frozen=True, kw_only=True)
class OneSided:
    """The first output of a response, turned so that only its large values are bad.

    Notes
    -----
    An upper limit leaves the output as it is, a lower one turns its sign. Two limits take the larger of the distances
    beyond either, to which the distance between them is added, so that a tolerance relative to the limit has a scale.
    """

    response: Response  # What answers
    limits: Limits  # Limits of its first output

    @property
    def columns(self) -> tuple[str, ...]:
        """The response's columns."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The response's outputs."""
        return self.response.outputs

    @property
    def limit(self) -> float:
        """Largest turned output allowed [output]."""
        if self.limits.width is not None:
            return self.limits.width
        return -self.limits.lower if self.limits.upper is None and self.limits.lower is not None else self._upper

    @property
    def _upper(self) -> float:
        assert self.limits.upper is not None
        return self.limits.upper

    def turned(self, values: Float[np.ndarray, "sample output"]) -> Float[np.ndarray, "sample output"]:
        """Return the outputs with the first one turned."""
        lower, width = self.limits.lower, self.limits.width
        if lower is None:
            return values
        first = (
            -values[:, :1] if width is None else width + np.maximum(lower - values[:, :1], values[:, :1] - self._upper)
        )
        return np.concatenate([first, values[:, 1:]], axis=1)

    def read(self, turned: float) -> float:
        """Return a turned output as a reader knows it: the output itself, or for two limits the distance beyond."""
        if self.limits.width is not None:
            return turned - self.limits.width
        return turned if self.limits.lower is None else -turned

    def facing(self, response: Response) -> Response:
        """Return another response of the same output, turned alike; itself for an upper limit."""
        return response if self.limits.lower is None else replace(self, response=response)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
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


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change with its two-sided 95 % interval."""

    estimate: float
    low: float
    high: float


def share_change(before: Bool[np.ndarray, " unit"], after: Bool[np.ndarray, " unit"]) -> Change:
    """Return how the share of good units changes [-].

    Only units that are good once and bad once count. The interval takes the exact one of either kind at half the error
    each, so it holds its 95 % at least, with no unit between the two as well.

    References
    ----------
    McNemar 1947: only discordant pairs tell; Clopper–Pearson for either kind, joined by Bonferroni.

    Examples
    --------
    >>> before, after = np.array([True, False, True, False]), np.array([True, True, True, False])
    >>> share_change(before, after).estimate
    0.25
    """
    units = before.size
    gained, lost = int(np.count_nonzero(after & ~before)), int(np.count_nonzero(before & ~after))
    up, down = proportion(units, units - gained), proportion(units, units - lost)
    return Change(estimate=(gained - lost) / units, low=up.low - down.high, high=up.high - down.low)


def quantile_change(
    before: Float[np.ndarray, " unit"],
    after: Float[np.ndarray, " unit"],
    share: float,
    generator: np.random.Generator,
) -> Change:
    """Return how a quantile of the units with both answers changes [unit of the output].

    The interval is that of the bootstrap over units, each with both its values; with fewer than some ten units beyond
    the quantile it is too narrow.

    References
    ----------
    Efron & Tibshirani 1993, ch. 13: percentile interval of a paired bootstrap.

    Examples
    --------
    >>> x = np.linspace(0.0, 1.0, 101)
    >>> change = quantile_change(x, x + 0.5, 0.9, np.random.default_rng(1))
    >>> round(change.estimate, 12), round(change.low, 12), round(change.high, 12)
    (0.5, 0.5, 0.5)
    """
    from scipy.stats import bootstrap

    def change(first: np.ndarray, second: np.ndarray, axis: int = -1) -> np.ndarray:
        return np.asarray(np.quantile(second, share, axis=axis) - np.quantile(first, share, axis=axis))

    both = np.isfinite(before) & np.isfinite(after)
    pair = (before[both], after[both])
    estimate = float(change(*pair))
    if np.array_equal(*pair):
        return Change(estimate=estimate, low=estimate, high=estimate)
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
    return Change(estimate=estimate, low=float(found.low), high=float(found.high))


def kept_at_once(evaluation: Evaluation, outputs: Sequence[str], limits: Mapping[str, Limits]) -> Yield:
    """Return the share of units that keep all limits at once; one without an answer keeps none.

    Parameters
    ----------
    evaluation
        What a response said of random units.
    outputs
        Names of its outputs, in their order.
    limits
        Output → limits.

    References
    ----------
    The interval is that of `proportion`, Clopper & Pearson 1934.

    Examples
    --------
    Two units of four keep the first limit and two the second one, one of them both:

    >>> values = np.array([[1.0, 1.0], [1.0, 3.0], [3.0, 1.0], [3.0, 3.0]])
    >>> own = Evaluation(values=values, status=np.zeros(4, np.uint8))
    >>> kept_at_once(own, ("a [mm]", "b [mm]"), {"a [mm]": Limits(upper=2.0), "b [mm]": Limits(upper=2.0)}).estimate
    0.25
    """
    kept = [own.kept_by(evaluation.values[:, outputs.index(name)]) for name, own in limits.items()]
    good = evaluation.good & np.all(kept, axis=0)
    return proportion(good.size, good.size - int(np.count_nonzero(good)))


@dataclass(frozen=True, kw_only=True)
class KeptLimits:
    """Which share of random units keeps each limit, and all of them at once."""

    each: Mapping[str, Yield]  # Limited output → share of the units that keep its limits, the leading one first
    joint: Yield  # Share of the units that keep all limits at once

    @classmethod
    def of(cls, evaluation: Evaluation, outputs: Sequence[str], limits: Mapping[str, Limits]) -> KeptLimits:
        """Return what units say, as `kept_at_once` reads them."""
        each = {name: kept_at_once(evaluation, outputs, {name: own}) for name, own in limits.items()}
        return cls(each=each, joint=kept_at_once(evaluation, outputs, limits))
