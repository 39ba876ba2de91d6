"""Subset simulation: a rare failure as a product of shares that are not rare.

The chains of a level stay exactly normal through conditional sampling, so every rejected step means "outside the
level" and none is lost on the density. Its spread is adapted between groups of chains, never within a chain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.rare_failure.limit_state import CountedLimitState, Level, LimitState, RareFailure
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError

METHOD = "Subset simulation"
_LENGTH = 10
"""States of a chain, and the inverse of the share that passes from level to level."""
_TARGET_ACCEPTANCE = 0.44
_FIRST_SCALE = 0.6
_GROUPS = 10
_LARGEST_LEVELS = 10
_FEWEST_SAMPLES = 100


@dataclass(frozen=True, kw_only=True)
class _Chains:
    """Samples of one level: chains in the rows, each with the first level's sample that it descends from."""

    u: Float[np.ndarray, "chain state variable"]
    values: Float[np.ndarray, "chain state"]
    ancestors: Int[np.ndarray, " chain"]
    accepted: float
    scale: float


def subset_simulation(
    limit_state: LimitState, seeds: SeedTree, samples: int = 2000, runs: int = 1, largest_failed_share: float = 0.01
) -> RareFailure:
    """Return the probability of failure from one or several independent subset simulations.

    Parameters
    ----------
    limit_state
        The limit state.
    seeds
        Node of the seed tree.
    samples
        Samples of each level, a multiple of 10 [-].
    runs
        Independent runs, whose mean is the estimate [-].
    largest_failed_share
        Share of the samples that may fail [-].

    Notes
    -----
    The standard error is the larger of two: that of the levels as if independent, with the correlation of their
    chains, and that of the lineages, which also sees how levels depend on each other. Of several runs it is at least
    the spread between them, because a run knows nothing of regions that it has lost.

    Raises
    ------
    SolveError
        More samples than allowed have no usable answer.

    References
    ----------
    Au & Beck 2001, P = P₁·Π Pᵢ and δᵢ² = (1 − Pᵢ) / (Pᵢ·N) · (1 + γᵢ), γ = 2·Σ (1 − k/L)·ρ(k).
    Lee & Whiteley 2018, δ² = Σ fₐ² − m/N with fₐ the share of failures that descend from the first sample a.
    Papaioannou et al. 2015, conditional sampling v = √(1 − σ²)·u + σ·ξ with adapted σ.
    """
    if samples < _FEWEST_SAMPLES or samples % _LENGTH:
        raise InputError.at(METHOD, "samples", samples, f"a multiple of {_LENGTH} from {_FEWEST_SAMPLES}")
    if runs < 1:
        raise InputError.at(METHOD, "runs", runs, "a whole number of at least 1")
    counted = CountedLimitState(limit_state, largest_failed_share)
    found = [_one_run(counted, seeds.child(f"run {run}").generator(), samples, run) for run in range(runs)]
    probabilities = np.array([_probability(levels) for levels, _, _ in found])
    probability = float(probabilities.mean())
    squares = sum(
        _standard_error(levels, chains, samples) ** 2 for levels, chains, _ in found if _probability(levels) > 0
    )
    error = float(np.sqrt(squares)) / runs
    if runs > 1:
        error = max(error, float(probabilities.std(ddof=1) / np.sqrt(runs)))
    stopped = tuple(dict.fromkeys(caution for _, _, caution in found if caution))
    return RareFailure(
        probability=probability,
        standard_error=error if probability > 0 else float("inf"),
        calls=counted.calls,
        failed=counted.failed,
        method=METHOD,
        cautions=stopped + counted.cautions,
        effective_samples=(probability / error) ** 2 if probability > 0 else 0.0,
        levels=tuple(level for levels, _, _ in found for level in levels),
        failing=tuple(chains.u[chains.values < 0] for _, chains, _ in found),
    )


def _probability(levels: list[Level]) -> float:
    """Return the probability that the levels of a run give."""
    return float(np.prod([level.share for level in levels]))


def _one_run(
    counted: CountedLimitState, generator: np.random.Generator, samples: int, run: int
) -> tuple[list[Level], _Chains, str]:
    """Return the levels of one run, the last of which counts the failures, its chains, and why it stopped short."""
    u = generator.standard_normal((samples, counted.variables))
    chains = _Chains(
        u=u[:, np.newaxis],
        values=counted.values(u)[:, np.newaxis],
        ancestors=np.arange(samples),
        accepted=1.0,
        scale=_FIRST_SCALE,
    )
    levels: list[Level] = []
    caution = ""
    seeds = samples // _LENGTH
    while True:
        threshold = float(np.partition(chains.values.ravel(), seeds - 1)[seeds - 1])
        if threshold < 0:
            break
        inside = chains.values <= threshold
        if not np.isfinite(threshold) or inside.all():
            caution = "the limit state is flat, so no level leads on to the failure"
        elif len(levels) + 1 == _LARGEST_LEVELS:
            caution = f"the failure is further than {_LARGEST_LEVELS} levels away"
        if caution:
            break
        levels.append(_level(chains, threshold, inside, run))
        # Repeated states can tie with the threshold, so more than the wanted number may be inside.
        chosen = generator.permutation(np.flatnonzero(inside.ravel()))[:seeds]
        starts = _Chains(
            u=chains.u.reshape(-1, 1, counted.variables)[chosen],
            values=chains.values.reshape(-1, 1)[chosen],
            ancestors=chains.ancestors[chosen // inside.shape[1]],
            accepted=1.0,
            scale=chains.scale,
        )
        chains = _next_chains(counted, generator, starts, threshold)
    levels.append(_level(chains, 0.0, chains.values < 0, run))
    return levels, chains, caution


def _next_chains(
    counted: CountedLimitState,
    generator: np.random.Generator,
    starts: _Chains,
    threshold: float,
) -> _Chains:
    """Return chains that start at chains of one state and stay within the threshold, group by group."""
    first, values, scale = starts.u[:, 0], starts.values[:, 0], starts.scale
    spread = first.std(axis=0)
    states, answers, rates = [], [], []
    for number, group in enumerate(np.array_split(np.arange(values.size), _GROUPS), start=1):
        sigma = np.minimum(1.0, scale * spread)
        u, g, accepted = [first[group]], [values[group]], 0.0
        for _ in range(_LENGTH - 1):
            trial = np.sqrt(1 - sigma**2) * u[-1] + sigma * generator.standard_normal(u[-1].shape)
            found = counted.values(trial)
            inside = found <= threshold
            u.append(np.where(inside[:, np.newaxis], trial, u[-1]))
            g.append(np.where(inside, found, g[-1]))
            accepted += float(inside.mean()) / (_LENGTH - 1)
        states.append(np.stack(u, axis=1))
        answers.append(np.stack(g, axis=1))
        rates.append(accepted)
        scale = float(np.clip(scale * np.exp((accepted - _TARGET_ACCEPTANCE) / np.sqrt(number)), 1e-3, 10.0))
    return _Chains(
        u=np.concatenate(states),
        values=np.concatenate(answers),
        ancestors=starts.ancestors,
        accepted=float(np.mean(rates)),
        scale=scale,
    )


def _standard_error(levels: list[Level], chains: _Chains, samples: int) -> float:
    """Return the standard error of the probability of a run that has reached the limit.

    Notes
    -----
    Failures of few lineages know little, however weakly the states of each chain are correlated.
    """
    failures = np.bincount(chains.ancestors, weights=(chains.values < 0).sum(axis=1))
    lineages = float(np.sum((failures / failures.sum()) ** 2)) - len(levels) / samples
    squares = sum(level.coefficient_of_variation**2 for level in levels)
    return _probability(levels) * float(np.sqrt(max(squares, lineages)))


def _level(chains: _Chains, threshold: float, inside: Bool[np.ndarray, "chain state"], run: int) -> Level:
    """Return the share inside a threshold with the variance that the chains leave it."""
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
        run=run,
        threshold=threshold,
        share=share,
        correlation=correlation,
        accepted=chains.accepted,
        coefficient_of_variation=float(np.sqrt((1 - share) / (share * inside.size) * (1 + correlation)))
        if share
        else float("inf"),
    )
