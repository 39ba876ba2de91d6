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
from tolalloc.capability.rare_failure.importance import widened_sampling
from tolalloc.capability.rare_failure.limit_state import RareFailure, ResponseLimit
from tolalloc.capability.rare_failure.subset_simulation import subset_simulation
from tolalloc.exceptions import InputError

METHOD = "Monte Carlo"
RARE = 1e-3
"""Share of random units beyond the limit below which a failure is rare [-]."""
LARGEST_DIFFERENCE = 3.0
"""Difference of two estimates in standard errors beyond which they contradict each other [-]."""


@dataclass(frozen=True, kw_only=True)
class YieldAtLimit:
    """Yield at a limit, by the method that can be relied on."""

    limit: float  # Largest output allowed [output]
    # Yield with its two-sided 95 % interval: that of `MonteCarlo.within` from random units, or where few of them exceed
    # the limit that of a log-normally distributed estimate [-]
    interval: ShareInterval
    # Probability of a unit beyond the limit by the method relied on, with its calls, failed samples and cautions
    estimate: RareFailure
    estimates: tuple[RareFailure, ...]  # The same by every method that ran, random units first
    verdict: str  # One sentence that says which estimate to rely on, and why
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
    weighted: int = 20_000,
) -> YieldAtLimit:
    """Return the yield at a limit.

    Parameters
    ----------
    limit_state
        The limit on the response.
    sample
        Random units whose first output is the limited one; they decide alone if a thousandth of them or more exceed
        the limit, units without an answer included.
    samples, runs
        Samples of each level, and independent runs of the subset simulation, two or more [-].
    weighted
        Samples of the widened distribution [-].

    Raises
    ------
    InputError
        Fewer than two runs.
    SolveError
        More samples than allowed have no usable answer.

    Notes
    -----
    The interval from random units holds for independent ones, those of the Monte Carlo design.
    Subset simulation is relied on, and widened sampling tells whether it may be. Widened sampling takes its directions
    from failures that subset simulation has found, so both are blind to a region that every run has missed.
    """
    if runs < FEWEST_RUNS:
        raise InputError.at("yield at a limit", "runs", runs, f"{FEWEST_RUNS} or more")
    require_few_failures(sample, "yield at a limit", limit_state.experiment.largest_failed_share)
    limit = limit_state.limit
    within = sample.within(limit)
    plain = _random_units(sample, within)
    rare: tuple[RareFailure, ...] = ()
    if plain.probability < RARE:
        rare = _rare_estimates(limit_state, samples, runs, weighted)
    reached = len(rare) == 2
    return YieldAtLimit(
        limit=limit,
        interval=log_normal_interval(rare[0])
        if reached
        else ShareInterval(estimate=within.estimate, low=within.low, high=within.high, confidence=CONFIDENCE),
        estimate=rare[0] if reached else plain,
        estimates=(plain, *rare),
        verdict=_verdict(plain, *rare),
        capability=capability(sample.values, Limits(upper=limit)),
        defects_per_million=defects_per_million_opportunities(within.rejected, within.units),
    )


def log_normal_interval(failure: RareFailure, confidence: float = CONFIDENCE) -> ShareInterval:
    """Return the yield with the interval of a log-normally distributed estimate of the share beyond the limit.

    Parameters
    ----------
    failure
        Estimate above zero of two or more runs of a subset simulation, with its standard error.
    confidence
        Confidence of the interval [-].

    References
    ----------
    p·exp(±t·√(ln(1 + δ²))) with δ the coefficient of variation and t Student's quantile of one degree of freedom less
    than runs, because few runs know little of their own spread; unlike p ± t·s it cannot fall below zero.
    """
    spread = np.sqrt(np.log1p(failure.coefficient_of_variation**2))
    runs = len({level.run for level in failure.levels})
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


def _rare_estimates(limit_state: ResponseLimit, samples: int, runs: int, weighted: int) -> tuple[RareFailure, ...]:
    """Return the estimate of subset simulation and, if two runs reached the limit, that of widened sampling."""
    seeds, allowed = limit_state.experiment.seeds, limit_state.experiment.largest_failed_share
    levels = subset_simulation(limit_state, seeds.child("levels"), samples, runs, allowed)
    if sum(states.size > 0 for states in levels.failing) < FEWEST_RUNS:
        return (levels,)
    return levels, widened_sampling(limit_state, levels.failing, seeds.child("widened"), weighted, allowed)


def _verdict(plain: RareFailure, levels: RareFailure | None = None, widened: RareFailure | None = None) -> str:
    """Return which estimate to rely on, and why."""
    if levels is None:
        return f"Rely on the random units: a share of {plain.probability:.3g} beyond the limit is not rare."
    if widened is None:
        return "Rely on the random units alone: fewer than two runs of the subset simulation reached the limit."
    apart = abs(levels.difference_from(widened))
    found = f"widened sampling differs from it by {apart:.1f} standard errors"
    if apart > LARGEST_DIFFERENCE:
        return f"Do not rely on subset simulation: {found}."
    cautions = (*levels.cautions, *widened.cautions)
    if cautions:
        return f"Rely on subset simulation with caution: {found}, but {'; '.join(cautions)}."
    return f"Rely on subset simulation: {found}."
