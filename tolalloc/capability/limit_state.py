"""What a rare failure is, and Markov chains in standard normal space that carry samples from one level to the next.

A limit state gives values of points of standard normal space, negative where the product fails.
The chains stay exactly normal through conditional sampling, so every rejected step means "outside" and none is lost on
the density. Their spread is adapted between groups of chains, never within a chain, and follows that of the starts
coarsely: otherwise a variable whose starts are wide by chance takes larger steps back, and in 100 variables the
probability comes out a fifth too low.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.experiment import Experiment
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Response

InChains = Bool[np.ndarray, "chain state"]
"""Whether each state of each chain is inside a bound."""
_CALLS_TO_JUDGE = 100
"""Below so many calls one failed sample would already exceed the allowed share."""


@runtime_checkable
class LimitState(Protocol):
    """Anything that maps points of standard normal space to the distance from a limit."""

    @property
    def variables(self) -> int:
        """Number of independent standard normal variables."""
        ...

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        """Return the distance of every sample from the limit, not finite where there is no usable answer [output]."""
        ...


class CountedLimitState:
    """A limit state that counts its calls and stops when more than a share of them fails.

    A failed sample reads as infinitely safe: it can neither count as a failure of the product nor start a chain.
    """

    def __init__(self, limit_state: LimitState, largest_failed_share: float = 0.01) -> None:
        self.limit_state, self.variables = limit_state, limit_state.variables
        self.largest_failed_share = largest_failed_share
        self.calls = self.failed = 0

    def values(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        """Return the values of the points, infinite where the sample failed."""
        values = self.limit_state(u)
        good = np.isfinite(values)
        self.calls += good.size
        self.failed += int(np.count_nonzero(~good))
        if self.calls >= _CALLS_TO_JUDGE and self.failed > self.largest_failed_share * self.calls:
            raise SolveError(
                f"Rare failure: {self.failed} of {self.calls} samples have no usable answer; allowed is "
                f"{self.largest_failed_share:.4g} of them, because more would bias the probability."
            )
        return np.where(good, values, np.inf)

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader must know about the failed samples; empty if there were none."""
        said = (
            f"{self.failed:,} of {self.calls:,} samples behind this share have no usable answer and count as kept; "
            "the yields of random units count them as missed"
        )
        return (said,) * bool(self.failed)


@dataclass(frozen=True, kw_only=True)
class RareFailure:
    """Probability of failure with its standard error and what it took."""

    probability: float  # Estimate [-]
    # Of the estimate; infinite if no sample failed, because then nothing is known about the spread [-]
    standard_error: float
    # Calls of the limit state, and how many of them gave no usable answer [-]
    calls: int
    failed: int = 0
    method: str  # Name of the method
    cautions: tuple[str, ...] = ()  # Reasons not to rely on the estimate; empty if the method sees none
    effective_samples: float = 0.0  # Equally weighted failures that would know as much; 0 if no sample failed [-]

    @property
    def coefficient_of_variation(self) -> float:
        """Standard error over probability, infinite for a probability of zero [-]."""
        return self.standard_error / self.probability if self.probability > 0 else float("inf")


@dataclass(frozen=True, kw_only=True)
class ResponseLimit:
    """Distance of a response's first output from its upper limit, negative where a unit exceeds it."""

    # Every column of its sources has a standard normal variable of its own, whatever its distribution
    experiment: Experiment[Response]
    limit: float  # Largest output allowed [output]

    @property
    def variables(self) -> int:
        """Number of columns."""
        return len(self.experiment.errors.columns)

    def deviations(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the deviations that are as probable as the standard normal numbers [m, angles rad]."""
        return self.experiment.errors.deviations_of_normal(u, self.experiment.zones)

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        """Return the distance of every sample from the limit, NaN where it failed [output]."""
        # Another output of a sample may have failed, and then the sample is lost as a whole.
        return np.asarray(self.limit - self.experiment.response(self.deviations(u)).known[:, 0])


LENGTH = 10
"""States of a chain, and the inverse of the share of samples that start the chains of the next level."""
_TARGET_ACCEPTANCE = 0.44
_FIRST_SCALE = 0.6
_GROUPS, _FEWEST_CHAINS = 5, 10
"""Largest number of groups of chains, and chains in a group whose accepted share says something [-]."""
_FEWEST_SAMPLES = 100

Values = Callable[[Float[np.ndarray, "sample variable"]], Float[np.ndarray, " sample"]]
"""Values of the limit state at points of standard normal space."""


@dataclass(frozen=True, kw_only=True)
class Chains:
    """Samples of one level: chains in the rows, each with the first level's sample that it descends from."""

    u: Float[np.ndarray, "chain state variable"]
    values: Float[np.ndarray, "chain state"]
    ancestors: Int[np.ndarray, " chain"]
    accepted: float  # Share of accepted steps, 1 for independent samples [-]
    scale: float  # Spread of a step over that of the population [-]

    @staticmethod
    def independent(values: Values, generator: np.random.Generator, samples: int, variables: int) -> Chains:
        """Return independent samples of the standard normal distribution, as chains of one state."""
        u = generator.standard_normal((samples, variables))
        return Chains(
            u=u[:, np.newaxis],
            values=values(u)[:, np.newaxis],
            ancestors=np.arange(samples),
            accepted=1.0,
            scale=_FIRST_SCALE,
        )

    def continued(
        self, limit: Values, generator: np.random.Generator, chosen: Int[np.ndarray, " start"], largest: float
    ) -> Chains:
        """Return chains from chosen states, numbered row by row, that keep values up to the largest, group by group."""
        first = self.u.reshape(-1, self.u.shape[2])[chosen]
        values, scale = self.values.ravel()[chosen], self.scale
        # Whole powers of two, 1 at most, follow a narrow failure, but hardly the chance in the starts.
        spread = np.exp2(np.round(np.log2(np.clip(first.std(axis=0), 1e-3, 1.0))))
        states, answers, rates = [], [], []
        groups = int(np.clip(chosen.size // _FEWEST_CHAINS, 1, _GROUPS))
        for number, group in enumerate(np.array_split(np.arange(chosen.size), groups), start=1):
            sigma = np.minimum(1.0, scale * spread)
            u, g, accepted = [first[group]], [values[group]], 0.0
            for _ in range(LENGTH - 1):
                trial = np.sqrt(1 - sigma**2) * u[-1] + sigma * generator.standard_normal(u[-1].shape)
                found = limit(trial)
                inside = found <= largest
                u.append(np.where(inside[:, np.newaxis], trial, u[-1]))
                g.append(np.where(inside, found, g[-1]))
                accepted += float(inside.mean()) / (LENGTH - 1)
            states.append(np.stack(u, axis=1))
            answers.append(np.stack(g, axis=1))
            rates.append(accepted)
            scale = float(np.clip(scale * np.exp((accepted - _TARGET_ACCEPTANCE) / np.sqrt(number)), 1e-3, 10.0))
        return Chains(
            u=np.concatenate(states),
            values=np.concatenate(answers),
            ancestors=self.ancestors[chosen // self.values.shape[1]],
            accepted=float(np.mean(rates)),
            scale=scale,
        )


@dataclass(frozen=True, kw_only=True)
class Level:
    """One level of a run."""

    # What bounds the next level: value of the limit state, 0 at the last one [unit of the limited output], or width of
    # the normal distribution, 1 at the last one [-]
    bound: float
    share: float  # Share of this level's samples inside the bound [-]
    correlation: float  # Factor γ by which correlated chains raise the variance of the share to (1 + γ) times [-]
    accepted: float  # Share of accepted chain steps, 1 at the first level, which has no chains [-]
    coefficient_of_variation: float  # Of the share [-]


@dataclass(frozen=True, kw_only=True)
class ChainedRun:
    """One run from independent samples to the failure."""

    levels: tuple[Level, ...]  # Levels, the first from independent samples
    lineages: Float[np.ndarray, " ancestor"]  # Share of failures from each sample of the first level [-]
    failing: Float[np.ndarray, "_state variable"]  # One failing state of each chain that has one [-]
    caution: str = ""  # Why the run stopped short

    @property
    def probability(self) -> float:
        """Product of the shares [-]."""
        return float(np.prod([level.share for level in self.levels]))

    @property
    def coefficient_of_variation(self) -> float:
        """Coefficient of variation of the probability above zero [-].

        The larger of that of the levels as if independent, with the correlation of their chains, and that of the
        lineages, which also sees how levels depend on each other.

        References
        ----------
        Lee & Whiteley 2018, δ² = Σ fₐ² − m/N with fₐ the share that descends from the first sample a.
        """
        lineages = float(np.sum(self.lineages**2)) - len(self.levels) / self.lineages.size
        return float(np.sqrt(max(sum(level.coefficient_of_variation**2 for level in self.levels), lineages)))


def run_of(levels: list[Level], chains: Chains, failing: InChains, samples: int, caution: str = "") -> ChainedRun:
    """Return the run that ends with chains of which some states fail, from so many first samples."""
    found = np.bincount(chains.ancestors, weights=failing.sum(axis=1), minlength=samples)
    some = failing.any(axis=1)
    return ChainedRun(
        levels=tuple(levels),
        lineages=found / max(found.sum(), 1.0),
        failing=chains.u[some, np.argmax(failing[some], axis=1)],
        caution=caution,
    )


def level(chains: Chains, inside: InChains, bound: float) -> Level:
    """Return the share of a level's samples inside the next one, with the variance that the chains leave it.

    References
    ----------
    Au & Beck 2001, δ² = (1 − P) / (P·N) · (1 + γ), γ = 2·Σ (1 − k/L)·ρ(k).
    """
    share, length = float(inside.mean()), inside.shape[1]
    correlation = 0.0
    variance = share * (1 - share)
    if variance > 0:
        for lag in range(1, length):
            together = float((inside[:, lag:] & inside[:, :-lag]).mean())
            correlation += 2 * (1 - lag / length) * (together - share**2) / variance
    # Estimated correlations may sum to less than nothing; chains never do better than independent samples here.
    correlation = max(correlation, 0.0)
    return Level(
        bound=bound,
        share=share,
        correlation=correlation,
        accepted=chains.accepted,
        coefficient_of_variation=float(np.sqrt((1 - share) / (share * inside.size) * (1 + correlation)))
        if share
        else float("inf"),
    )


@dataclass(frozen=True, kw_only=True)
class ChainedEstimate(RareFailure):
    """The mean of independent runs."""

    runs: tuple[ChainedRun, ...] = field(repr=False, compare=False)

    @property
    def failing(self) -> Float[np.ndarray, "state variable"]:
        """Failing states of all runs, no two of one chain [-]."""
        return np.concatenate([run.failing for run in self.runs])

    @staticmethod
    def of(method: str, runs: tuple[ChainedRun, ...], counted: CountedLimitState) -> ChainedEstimate:
        """Return the mean of runs; its standard error is at least their spread, a run knows no region it has lost."""
        probabilities = np.array([run.probability for run in runs])
        probability = float(probabilities.mean())
        errors = [run.probability * run.coefficient_of_variation for run in runs if run.probability > 0]
        error = float(np.linalg.norm(errors)) / len(runs)
        if len(runs) > 1:
            error = max(error, float(probabilities.std(ddof=1) / np.sqrt(len(runs))))
        return ChainedEstimate(
            probability=probability,
            standard_error=error if probability > 0 else float("inf"),
            calls=counted.calls,
            failed=counted.failed,
            method=method,
            cautions=tuple(dict.fromkeys(run.caution for run in runs if run.caution)) + counted.cautions,
            effective_samples=(probability / error) ** 2 if probability > 0 else 0.0,
            runs=runs,
        )


def require_samples(method: str, samples: int, runs: int) -> None:
    """Raise an `InputError` unless samples form whole chains and there is a run."""
    if samples < _FEWEST_SAMPLES or samples % LENGTH:
        raise InputError.at(method, "samples", samples, f"a multiple of {LENGTH} from {_FEWEST_SAMPLES}")
    if runs < 1:
        raise InputError.at(method, "runs", runs, "a whole number of at least 1")
