"""The yield at a limit down to a few parts per million: random units, and rare-failure methods where they see none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from tolalloc.capability.experiment import FEWEST_RUNS
from tolalloc.capability.indices import (
    MILLION,
    Capability,
    Limits,
    ShareInterval,
    capability,
    defects_per_million_opportunities,
)
from tolalloc.capability.monte_carlo import CONFIDENCE, MonteCarlo, Yield, require_few_failures
from tolalloc.capability.rare_failure.agreement import agreement
from tolalloc.capability.rare_failure.limit_state import RareFailure, ResponseLimit
from tolalloc.exceptions import InputError

METHOD = "Monte Carlo"


@dataclass(frozen=True, kw_only=True)
class YieldAtLimit:
    """Yield at a limit, and whether it can be relied on."""

    limit: float  # Largest output allowed [output]
    # Yield with its two-sided 95 % interval: that of `MonteCarlo.within` from random units, or where few of them exceed
    # the limit that of a log-normally distributed estimate [-]
    interval: ShareInterval
    # Probability of a unit beyond the limit: that of the random units, or where few of them lie there what methods for
    # rare failures agree on; with its calls, failed samples and cautions
    estimate: RareFailure
    estimates: tuple[RareFailure, ...]  # What every method said, random units first
    verdict: str  # One sentence that says whether to rely on the estimate, and why
    capability: Capability  # Indices of the random units
    defects_per_million: float  # Random units rejected per million opportunities, one for each unit [-]

    @property
    def parts_per_million(self) -> ShareInterval:
        """Units beyond the limit per million, with the interval [-]."""
        return ShareInterval(
            estimate=MILLION * self.estimate.probability,
            low=MILLION * (1 - self.interval.high),
            high=MILLION * (1 - self.interval.low),
            confidence=self.interval.confidence,
        )

    @property
    def calls(self) -> int:
        """Calls of the response by all methods [-]."""
        return sum(item.calls for item in self.estimates)

    @property
    def failed(self) -> int:
        """Calls by all methods that gave no usable answer [-]."""
        return sum(item.failed for item in self.estimates)


def yield_at_limit(
    limit_state: ResponseLimit,
    sample: MonteCarlo,
    *,
    samples: int = 4000,
    runs: int = 5,
    widened: int = 2000,
) -> YieldAtLimit:
    """Return the yield at a limit.

    Parameters
    ----------
    limit_state
        The limit on the response.
    sample
        Random units whose first output is the limited one; they decide alone if 30 or more exceed the limit, units
        without an answer included.
    samples, widened
        Samples of each level of subset simulation and of each width of widened sampling, multiples of 10 [-].
    runs
        Independent runs of either, two or more [-].

    Raises
    ------
    InputError
        Fewer than two runs.
    SolveError
        More samples than allowed have no usable answer.

    Notes
    -----
    The interval from random units holds for independent ones, those of the Monte Carlo design.
    """
    if runs < FEWEST_RUNS:
        raise InputError.at("yield at a limit", "runs", runs, f"{FEWEST_RUNS} or more")
    experiment, limit = limit_state.experiment, limit_state.limit
    allowed = experiment.largest_failed_share
    require_few_failures(sample, "yield at a limit", allowed)
    within = sample.within(limit)
    plain = _random_units(sample, within)
    found = agreement(
        limit_state,
        plain,
        experiment.seeds,
        samples=samples,
        runs=runs,
        widened=widened,
        largest_failed_share=allowed,
    )
    return YieldAtLimit(
        limit=limit,
        interval=ShareInterval(estimate=within.estimate, low=within.low, high=within.high, confidence=CONFIDENCE)
        if found.estimate.method == METHOD
        else log_normal_interval(found.estimate, runs),
        estimate=found.estimate,
        estimates=found.estimates,
        verdict=found.verdict,
        capability=capability(sample.values, Limits(upper=limit)),
        defects_per_million=defects_per_million_opportunities(within.rejected, within.units),
    )


def log_normal_interval(failure: RareFailure, runs: int, confidence: float = CONFIDENCE) -> ShareInterval:
    """Return the yield with the interval of a log-normally distributed estimate of the share beyond the limit.

    Parameters
    ----------
    failure
        Estimate above zero with its standard error.
    runs
        Independent runs that it is the mean of, two or more [-].
    confidence
        Confidence of the interval [-].

    References
    ----------
    p·exp(±t·√(ln(1 + δ²))) with δ the coefficient of variation and t Student's quantile of one degree of freedom less
    than runs, because few runs know little of their own spread; unlike p ± t·s it cannot fall below zero.
    """
    spread = np.sqrt(np.log1p(failure.coefficient_of_variation**2))
    factor = float(np.exp(student.isf((1 - confidence) / 2, runs - 1) * spread))
    return ShareInterval(
        estimate=1 - failure.probability,
        low=max(0.0, 1 - failure.probability * factor),
        high=1 - failure.probability / factor,
        confidence=confidence,
    )


def _random_units(sample: MonteCarlo, within: Yield) -> RareFailure:
    """Return the share of random units rejected, those without an answer included."""
    share, units = within.rejected / within.units, within.units
    lost = f"{sample.failed} of {units} units have no usable answer and count as rejected"
    return RareFailure(
        probability=share,
        standard_error=float(np.sqrt(share * (1 - share) / units)) if within.rejected else float("inf"),
        calls=units,
        failed=sample.failed,
        method=METHOD,
        cautions=(lost,) * bool(sample.failed),
        effective_samples=float(within.rejected),
    )
