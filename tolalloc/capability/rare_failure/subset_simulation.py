"""Subset simulation: a rare failure as a product of shares that are not rare."""

from __future__ import annotations

import numpy as np

from tolalloc.capability.rare_failure.chains import (
    LENGTH,
    ChainedEstimate,
    Chains,
    Level,
    Run,
    level,
    require_samples,
    run_of,
)
from tolalloc.capability.rare_failure.limit_state import CountedLimitState, LimitState
from tolalloc.drawings.seeds import SeedTree

METHOD = "Subset simulation"
_LARGEST_LEVELS = 10


def subset_simulation(
    limit_state: LimitState, seeds: SeedTree, samples: int = 2000, runs: int = 1, largest_failed_share: float = 0.01
) -> ChainedEstimate:
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

    Raises
    ------
    SolveError
        More samples than allowed have no usable answer.

    References
    ----------
    Au & Beck 2001, P = P₁·Π Pᵢ; Papaioannou et al. 2015, conditional sampling v = √(1 − σ²)·u + σ·ξ with adapted σ.
    """
    require_samples(METHOD, samples, runs)
    counted = CountedLimitState(limit_state, largest_failed_share)
    found = tuple(_one_run(counted, seeds.child(f"run {run}").generator(), samples) for run in range(runs))
    return ChainedEstimate.of(METHOD, found, counted)


def _one_run(counted: CountedLimitState, generator: np.random.Generator, samples: int) -> Run:
    """Return one run, whose last level counts the failures."""
    chains = Chains.independent(counted.values, generator, samples, counted.variables)
    levels: list[Level] = []
    caution = ""
    starts = samples // LENGTH
    while True:
        threshold = float(np.partition(chains.values.ravel(), starts - 1)[starts - 1])
        if threshold < 0:
            break
        inside = chains.values <= threshold
        stuck = not np.isfinite(threshold) or inside.all()
        if stuck or len(levels) + 1 == _LARGEST_LEVELS:
            if not (chains.values < 0).any():
                caution = (
                    "the limit state is flat, so no level leads on to the failure"
                    if stuck
                    else f"the failure is further than {_LARGEST_LEVELS} levels away"
                )
            break
        levels.append(level(chains, inside, threshold))
        # Repeated states can tie with the threshold, so more than the wanted number may be inside.
        chosen = generator.permutation(np.flatnonzero(inside.ravel()))[:starts]
        chains = chains.continued(counted.values, generator, chosen, threshold)
    levels.append(level(chains, chains.values < 0, 0.0))
    return run_of(levels, chains, chains.values < 0, samples, caution)
