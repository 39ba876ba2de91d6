"""Monte Carlo: many random units, their yield and its confidence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE, Experiment
from tolalloc.drawings.seeds import CHUNK, SamplingDesign, uniform_chunks
from tolalloc.exceptions import SolveError
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
    """Return the yield of a sample with its exact intervals."""
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

    Notes
    -----
    As many as a design just at the target rejects with at most the error that is left: what Clopper–Pearson's bound
    says.
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
    """
    errors, seeds = experiment.errors, experiment.seeds
    x = np.empty((units, len(errors.columns)))
    for index, uniform in enumerate(uniform_chunks(design, seeds, units, len(errors.columns))):
        x[index * CHUNK : (index + 1) * CHUNK] = experiment.deviations(errors.standard_values(uniform))
    result = MonteCarlo(x=x, evaluation=experiment.response(x))
    require_few_failures(result, ".".join(seeds.path), experiment.largest_failed_share)
    return result


def require_few_failures(result: AnsweredUnits, name: str, largest_failed_share: float = LARGEST_FAILED_SHARE) -> None:
    """Raise a `SolveError` if more units failed than a trustworthy figure admits."""
    units = result.evaluation.status.size
    if result.failed > largest_failed_share * units:
        raise SolveError(
            f"Monte Carlo {name}: {result.failed} of {units} units have no usable answer; allowed is "
            f"{largest_failed_share:.4g} of them, because more would bias every figure."
        )
