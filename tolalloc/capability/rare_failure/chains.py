"""Markov chains in standard normal space that carry a population of samples from one level of an estimate to the next.

The chains stay exactly normal through conditional sampling, so every rejected step means "outside" and none is lost on
the density. Their spread is adapted between groups of chains, never within a chain, and follows that of the starts
coarsely: otherwise a variable whose starts are wide by chance takes larger steps back, and in 100 variables the
probability comes out a fifth too low.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.rare_failure.limit_state import CountedLimitState, RareFailure
from tolalloc.exceptions import InputError

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
class Run:
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

        Notes
        -----
        It is the larger of two: that of the levels as if independent, with the correlation of their chains, and that of
        the lineages, which also sees how levels depend on each other. Failures of few lineages know little, however
        weakly the states of each chain are correlated.

        References
        ----------
        Lee & Whiteley 2018, δ² = Σ fₐ² − m/N with fₐ the share that descends from the first sample a.
        """
        lineages = float(np.sum(self.lineages**2)) - len(self.levels) / self.lineages.size
        return float(np.sqrt(max(sum(level.coefficient_of_variation**2 for level in self.levels), lineages)))


def run_of(
    levels: list[Level], chains: Chains, failing: Bool[np.ndarray, "chain state"], samples: int, caution: str = ""
) -> Run:
    """Return the run that ends with chains of which some states fail, from so many first samples."""
    found = np.bincount(chains.ancestors, weights=failing.sum(axis=1), minlength=samples)
    some = failing.any(axis=1)
    return Run(
        levels=tuple(levels),
        lineages=found / max(found.sum(), 1.0),
        failing=chains.u[some, np.argmax(failing[some], axis=1)],
        caution=caution,
    )


def level(chains: Chains, inside: Bool[np.ndarray, "chain state"], bound: float) -> Level:
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

    runs: tuple[Run, ...] = field(repr=False, compare=False)

    @property
    def failing(self) -> Float[np.ndarray, "state variable"]:
        """Failing states of all runs, no two of one chain [-]."""
        return np.concatenate([run.failing for run in self.runs])

    @staticmethod
    def of(method: str, runs: tuple[Run, ...], counted: CountedLimitState) -> ChainedEstimate:
        """Return the mean of runs.

        Notes
        -----
        The standard error is at least the spread between runs, because a run knows nothing of regions that it has lost.
        """
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
