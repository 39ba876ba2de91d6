"""The yield at a limit, also where a rejected unit is rare: what methods that fail differently agree on.

Random units see every region, but only if it is not rare. Subset simulation is led by the slope of the limit state,
which may lead away from the likelier of two regions. Scaled-sigma sampling is led by distance alone, and sees no region
that ends further out. Whatever misses a region gives too little, never too much. A caution stands where a factor of two
is open.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.stats import binom
from scipy.stats import t as student

from tolalloc.capability.experiment import FEWEST_RUNS
from tolalloc.capability.indices import MILLION, Interval, Limits
from tolalloc.capability.limit_state import ChainedEstimate, LimitState, RareFailure, ResponseLimit
from tolalloc.capability.monte_carlo import CONFIDENCE, MonteCarlo, ProcessUncertainty, Yield, require_few_failures
from tolalloc.capability.rare_failure import MOST_KNOWN, ScaledSigmaEstimate, scaled_sigma_sampling, subset_simulation
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError

METHOD = "Subset simulation and scaled-sigma sampling"
FEWEST_BEYOND = 30
"""Random units beyond the limit from which they decide alone: chance does not halve or double so many [-]."""
RARE = 1e-3
"""Share of random units without an answer above which they decide alone [-]."""
LARGEST_DIFFERENCE = 3.0
"""Difference of two estimates in standard errors beyond which they contradict each other [-]."""
FACTOR_IN_DOUBT = 2.0
"""Factor by which an estimate without a caution may not change within three standard errors [-]."""
_SMALLEST_CHANCE = 0.005
"""Chance of the count of random units below which it contradicts an estimate [-]."""
_VAGUE = 0.5
"""Coefficient of variation from which too small an estimate of scaled-sigma sampling says nothing [-]."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """What methods that fail differently say of one rare failure."""

    estimate: RareFailure  # What to rely on, with its cautions
    estimates: tuple[RareFailure, ...]  # What every method said, random units first
    verdict: str  # One sentence that says what to rely on, and why


def agreement(
    limit_state: LimitState,
    plain: RareFailure,
    seeds: SeedTree,
    *,
    samples: int = 4000,
    runs: int = 5,
    scaled: int = 2000,
    largest_failed_share: float = 0.01,
) -> Agreement:
    """Return the probability of failure by random units, and where they see few failures by methods for rare ones.

    Parameters
    ----------
    plain
        Share of random units beyond the limit, those without an answer included; they decide alone if 30 or more of
        them lie there, or if more than a thousandth has no answer.
    samples, scaled
        Samples of each level of subset simulation and of each width of scaled-sigma sampling, multiples of 10 [-].
    runs
        Independent runs of either method [-].
    largest_failed_share
        Share of the samples that may fail [-].

    References
    ----------
    Subset simulation: Au & Beck 2001; widened sampling: Bucher 2009; how they are joined: `judged`, Birge 1932.

    Examples
    --------
    A limit 4σ away is exceeded with Φ(−4) = 3.17e-5.

    >>> state = lambda u: 4.0 - u.sum(axis=1) / np.sqrt(2.0)
    >>> state.variables = 2
    >>> plain = RareFailure(probability=0.0, standard_error=np.inf, calls=1000, method="Monte Carlo")
    >>> found = agreement(state, plain, SeedTree(1), samples=1000, runs=2, scaled=500).estimate
    >>> abs(found.probability - 3.17e-5) < 3.0 * found.standard_error
    True
    """
    # A unit without an answer is a rejected one, which the methods for rare failures cannot know.
    if plain.effective_samples >= FEWEST_BEYOND or plain.failed > RARE * plain.calls:
        verdict = f"Rely on the random units: a share of {plain.probability:.3g} beyond the limit is not rare."
        return Agreement(estimate=plain, estimates=(plain,), verdict=verdict)
    levels = subset_simulation(limit_state, seeds.child("levels"), samples, runs, largest_failed_share)
    try:
        found: ScaledSigmaEstimate | SolveError = scaled_sigma_sampling(
            limit_state, seeds.child("widened"), scaled, runs, largest_failed_share, known=levels.failing
        )
    except SolveError as error:
        # Far out a model may have no answers. The check is lost then, not what is checked.
        found = error
    return judged(plain, levels, found)


def judged(plain: RareFailure, levels: ChainedEstimate, scaled: ScaledSigmaEstimate | SolveError) -> Agreement:
    """Return what three independent estimates agree on; scaled-sigma sampling may have stopped with an error.

    Notes
    -----
    Scaled-sigma sampling sees a share q of subset simulation's failures. Where it found less, P_w/q up to P_s is
    compared; half of that correction, in its logarithm, counts as its standard error. The mean is weighted by the
    inverse squares of the coefficients of variation, and its error grows with the difference, as is usual for measured
    constants.
    Beyond three standard errors of the difference the larger estimate stands, because what misses a region gives too
    little.

    References
    ----------
    Birge 1932, Phys. Rev. 40: the error of a weighted mean times the ratio √(χ²/(n − 1)) where that is above 1.
    """
    methods = (levels,) if isinstance(scaled, SolveError) else (levels, scaled)
    if not any(item.probability for item in methods):
        few = f"{plain.effective_samples:.0f} of them lie beyond the limit, but other methods found none"
        plain = replace(plain, cautions=plain.cautions + (few,) * bool(plain.probability))
        reliance = "Do not rely on the random units" if plain.cautions else "Rely on the random units alone"
        said = "; ".join(("neither subset simulation nor scaled-sigma sampling found a failure", *plain.cautions))
        return Agreement(estimate=plain, estimates=(plain, *methods), verdict=f"{reliance}: {said}.")
    common = _common(levels, scaled)
    doubts = common.doubts
    if np.exp(LARGEST_DIFFERENCE * np.sqrt(np.log1p((common.error / common.probability) ** 2))) > FACTOR_IN_DOUBT:
        doubts += ("within three standard errors it may change by more than a factor of two",)
    doubts += _against(plain, common)
    lost = f"{plain.failed} of {plain.calls} random units have no usable answer and are not part of it"
    cautions = (
        doubts
        + (lost,) * bool(plain.failed)
        + tuple(dict.fromkeys(caution for item in methods for caution in item.cautions))
    )
    reliance = "Do not rely on this estimate" if doubts else "Rely on it with caution" if cautions else "Rely on it"
    return Agreement(
        estimate=RareFailure(
            probability=common.probability,
            standard_error=common.error,
            calls=sum(item.calls for item in (plain, *methods)),
            failed=sum(item.failed for item in (plain, *methods)),
            method=METHOD,
            cautions=cautions,
            effective_samples=(common.probability / common.error) ** 2,
        ),
        estimates=(plain, *methods),
        verdict=f"{reliance}: {'; '.join((common.found, *cautions))}.",
    )


@dataclass(frozen=True, kw_only=True)
class _Common:
    """What two methods say together."""

    probability: float
    error: float
    found: str
    doubts: tuple[str, ...] = ()


def _common(levels: ChainedEstimate, scaled: ScaledSigmaEstimate | SolveError) -> _Common:
    """Return what subset simulation and scaled-sigma sampling say together, unless neither met a failure."""
    alone = partial(_Common, probability=levels.probability, error=levels.standard_error)
    if isinstance(scaled, SolveError):
        return alone(
            found="subset simulation is not checked", doubts=(f"scaled-sigma sampling stopped: {scaled}"[:-1],)
        )
    seen = scaled.seen_share
    if not levels.probability:
        return _Common(
            probability=scaled.probability,
            error=scaled.standard_error,
            found="only scaled-sigma sampling found failures",
            doubts=("subset simulation found none",),
        )
    if scaled.probability < levels.probability and scaled.coefficient_of_variation > _VAGUE:
        if not any(run.levels[0].share for run in scaled.runs):
            return alone(found="scaled-sigma sampling found no failure at any width, so no other broad region")
        found = f"scaled-sigma sampling can see {100 * seen:.0f} % of the failures and says nothing definite"
        return alone(found=found, doubts=("scaled-sigma sampling found too few failures to confirm it",) * (seen > 0.5))
    # What scaled-sigma sampling cannot see explains at most that it found less.
    explained = scaled.probability / seen if seen else np.inf
    corrected = max(scaled.probability, min(explained, levels.probability))
    own, chance = levels.coefficient_of_variation, (1 - seen) / max(seen * MOST_KNOWN, 1.0)
    halved = float(np.log(corrected / scaled.probability)) / 2
    other = float(np.sqrt(scaled.coefficient_of_variation**2 + chance + halved**2))
    apart = abs(float(np.log(levels.probability / corrected))) / float(np.hypot(own, other))
    found = f"subset simulation and scaled-sigma sampling differ by {apart:.1f} standard errors"
    if apart > LARGEST_DIFFERENCE:
        larger = max(levels, scaled, key=lambda item: item.probability)
        half = abs(levels.probability - scaled.probability) / 2
        said = f"two methods contradict each other with {levels.probability:.2g} and {scaled.probability:.2g}"
        error = max(larger.standard_error, half)
        return _Common(probability=larger.probability, error=error, found=found, doubts=(said,))
    weights = np.array([own, other]) ** -2
    mean = float(weights @ [levels.probability, corrected] / weights.sum())
    return _Common(probability=mean, error=mean * max(1.0, apart) / float(np.sqrt(weights.sum())), found=found)


def _against(plain: RareFailure, common: _Common) -> tuple[str, ...]:
    """Return what the random units say against an estimate: more or fewer beyond the limit than chance explains."""
    beyond = round(plain.effective_samples) - plain.failed
    low, high = (
        float(np.clip(common.probability + way * LARGEST_DIFFERENCE * common.error, 0.0, 1.0)) for way in (-1.0, 1.0)
    )
    more, fewer = binom.sf(beyond - 1, plain.calls, high), binom.cdf(beyond, plain.calls, low)
    expected = common.probability * plain.calls
    said = f"of {plain.calls} random units {beyond} lie beyond the limit, {expected:.2g} are expected"
    return (said,) * bool(min(more, fewer) < _SMALLEST_CHANCE)


_RANDOM_UNITS = "Monte Carlo"


@dataclass(frozen=True, kw_only=True)
class YieldAtLimit(Agreement):
    """Yield at a limit, and whether it can be relied on."""

    # Yield with its two-sided 95 % interval: that of `MonteCarlo.within` from random units, or where few of them exceed
    # the limit that of a log-normally distributed estimate [-]
    interval: Interval

    @property
    def parts_per_million(self) -> Interval:
        """Units beyond the limit per million, with the interval [-]."""
        return Interval(
            estimate=MILLION * self.estimate.probability,
            low=MILLION * (1 - self.interval.high),
            high=MILLION * (1 - self.interval.low),
        )


def yield_at_limit(
    limit_state: ResponseLimit,
    sample: MonteCarlo,
    *,
    samples: int = 4000,
    runs: int = 5,
    scaled: int = 2000,
    rare: bool = True,
) -> YieldAtLimit:
    """Return the yield at a limit.

    Parameters
    ----------
    sample
        Random units whose first output is the limited one; they decide alone if 30 or more exceed the limit, units
        without an answer included.
    samples, scaled, runs
        As those of `agreement`; two runs or more.
    rare
        Whether methods for rare failures are asked at all; else the random units say what they can.

    Notes
    -----
    The interval from random units holds for independent ones, those of the Monte Carlo design.

    References
    ----------
    1 − P(y > limit), by Clopper & Pearson 1934 from random units and by `log_normal_interval` where they are rare.

    Examples
    --------
    A limit 2σ away is kept by Φ(2) = 97.7 % of the units.

    >>> from tolalloc.capability.experiment import Experiment
    >>> from tolalloc.capability.monte_carlo import monte_carlo
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "plus": 3, "minus": -3, "min": 1, "max": 60, "cost": 1}
    >>> errors = ta.Drawing.of_rows([{"id": "a", **row}]).errors
    >>> y = ta.model(lambda a: a, inputs=("a",), outputs=("y [mm]",)).bound(errors, "")
    >>> state = ResponseLimit(experiment=Experiment.of(y, errors, SeedTree(1)), limit=2.0)
    >>> round(yield_at_limit(state, monte_carlo(state.experiment, 10_000)).interval.estimate, 2)
    0.98
    """
    if runs < FEWEST_RUNS:
        raise InputError.at("yield at a limit", "runs", runs, f"{FEWEST_RUNS} or more")
    experiment, limit = limit_state.experiment, limit_state.limit
    allowed = experiment.largest_failed_share
    require_few_failures(sample, "yield at a limit", allowed)
    within = sample.within(limit)
    plain = _random_units(sample, within)
    effort = {"samples": samples, "runs": runs, "scaled": scaled}
    if rare or plain.effective_samples >= FEWEST_BEYOND:
        found = agreement(limit_state, plain, experiment.seeds, largest_failed_share=allowed, **effort)
    else:
        verdict = f"{within.rejected:,} of {within.units:,} random units lie there; rarer ones need a full run."
        found = Agreement(estimate=plain, estimates=(plain,), verdict=verdict)
    interval = within if found.estimate.method == _RANDOM_UNITS else log_normal_interval(found.estimate, runs)
    return YieldAtLimit(**vars(found), interval=_widened_by(interval, limit_state, sample))


def _widened_by(interval: Interval, limit_state: ResponseLimit, sample: MonteCarlo) -> Interval:
    """Return the interval of a yield that also holds what measured parts leave open of their processes."""
    uncertainty = ProcessUncertainty.of(limit_state.experiment.errors, sample.x, sample.evaluation.known[:, 0])
    if uncertainty is None:
        return interval
    limits, tail = Limits(upper=limit_state.limit), (1 - CONFIDENCE) / 2
    # The worst process at the worse end of the counted interval, and the best one at its better end.
    least, most = (
        1.0 - float(np.quantile(uncertainty.shares(limits, 1.0 - end), at))
        for end, at in ((interval.low, 1.0 - tail), (interval.high, tail))
    )
    return replace(interval, low=min(interval.low, least), high=max(interval.high, most))


def log_normal_interval(failure: RareFailure, runs: int) -> Interval:
    """Return the yield with the interval of a log-normally distributed estimate of the share beyond the limit.

    The estimate is above zero and the mean of two independent runs or more.

    References
    ----------
    p·exp(±t·√(ln(1 + δ²))) with δ the coefficient of variation and t Student's quantile of one degree of freedom less
    than runs, because few runs know little of their own spread; unlike p ± t·s it cannot fall below zero (own
    derivation).
    """
    spread = np.sqrt(np.log1p(failure.coefficient_of_variation**2))
    factor = float(np.exp(student.isf((1 - CONFIDENCE) / 2, runs - 1) * spread))
    return Interval(
        estimate=1 - failure.probability,
        low=max(0.0, 1 - failure.probability * factor),
        high=1 - failure.probability / factor,
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
        method=_RANDOM_UNITS,
        cautions=(lost,) * bool(sample.failed),
        effective_samples=float(within.rejected),
    )
