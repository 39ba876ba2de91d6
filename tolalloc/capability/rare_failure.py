"""Rare failures: subset simulation and scaled-sigma sampling in standard normal space.

Subset simulation writes a rare failure as a product of shares that are not rare. Scaled-sigma sampling leads from a
normal distribution wide enough to fail often back to the standard one, width by width. It asks of a sample only whether
it fails, never by how much, so no slope of the limit state can lead it to one region and away from another, as it can
lead subset simulation. It is led by distance alone, and loses regions that end further out: a sample that fails is
expected to fail at a larger width too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from tolalloc.capability.limit_state import (
    LENGTH,
    ChainedEstimate,
    ChainedRun,
    Chains,
    CountedLimitState,
    InChains,
    Level,
    LimitState,
    Values,
    level,
    require_samples,
    run_of,
)
from tolalloc.drawings.seeds import SeedTree

_SUBSET = "Subset simulation"
_LARGEST_LEVELS = 10


def subset_simulation(
    limit_state: LimitState, seeds: SeedTree, samples: int = 2000, runs: int = 1, largest_failed_share: float = 0.01
) -> ChainedEstimate:
    """Return the probability of failure from one or several independent subset simulations.

    Samples of each level are a multiple of 10, and a share of them may fail [-].

    References
    ----------
    Au & Beck 2001, P = P₁·Π Pᵢ; Papaioannou et al. 2015, conditional sampling v = √(1 − σ²)·u + σ·ξ with adapted σ.

    Examples
    --------
    A plane at a distance of 3 has the probability Φ(−3) = 1.35e-3.

    >>> plane = lambda u: 3.0 - u.sum(axis=1) / np.sqrt(2.0)
    >>> plane.variables = 2
    >>> found = subset_simulation(plane, SeedTree(1), samples=1000)
    >>> abs(found.probability - 1.35e-3) < 3 * found.standard_error
    True
    """
    require_samples(_SUBSET, samples, runs)
    counted = CountedLimitState(limit_state, largest_failed_share)
    found = tuple(_subset_run(counted, seeds.child(f"run {run}").generator(), samples) for run in range(runs))
    return ChainedEstimate.of(_SUBSET, found, counted)


def _subset_run(counted: CountedLimitState, generator: np.random.Generator, samples: int) -> ChainedRun:
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


_SCALED = "Scaled-sigma sampling"
_WIDER = 1.25
_LARGEST_WIDTH = 8.0
_SOUGHT_SHARE = 0.15
_HALVINGS = 5
_MOST_WIDTHS = 12
_MOST_AT_FIRST = 5.0
"""Times the samples that the first width may have, where few of them fail [-]."""
MOST_KNOWN = 200
"""Known failing states that are asked at every width."""
_FAILING = float(np.nextafter(0.0, -1.0))
"""Largest value of a failing sample."""


@dataclass(frozen=True, kw_only=True)
class ScaledSigmaEstimate(ChainedEstimate):
    """What scaled-sigma sampling found, and what it can see of known failures."""

    # Share of the known failing states that fail at every width of the runs too, 1 if none is known [-]
    seen_share: float


def scaled_sigma_sampling(
    limit_state: LimitState,
    seeds: SeedTree,
    samples: int = 2000,
    runs: int = 1,
    largest_failed_share: float = 0.01,
    known: Float[np.ndarray, "state variable"] | None = None,
) -> ScaledSigmaEstimate:
    """Return the probability of failure from one or several independent runs of scaled-sigma sampling.

    Parameters
    ----------
    samples, runs, largest_failed_share
        As of `subset_simulation`, of each width.
    known
        Failing states that another method has met; they change nothing but the share that is seen of them [-].

    Notes
    -----
    With u standard normal, P = P(λ₁·u fails)·Π P(λᵢ₊₁·u fails | λᵢ·u fails), λ from the first width down to 1. A search
    of its own fixes the widths before the runs, so the runs differ by chance alone.

    References
    ----------
    Bucher 2009, Probabilistic Engineering Mechanics 24 (asymptotic sampling), and Sun et al. 2015, IEEE Trans. CAD 34
    (scaled-sigma sampling), extrapolate from failures at larger widths; here chains lead back to width 1, as in subset
    simulation.

    Examples
    --------
    A plane at a distance of 3 has the probability Φ(−3) = 1.35e-3.

    >>> plane = lambda u: 3.0 - u.sum(axis=1) / np.sqrt(2.0)
    >>> plane.variables = 2
    >>> found = scaled_sigma_sampling(plane, SeedTree(1), samples=1000)
    >>> abs(found.probability - 1.35e-3) < 3 * found.standard_error
    True
    """
    require_samples(_SCALED, samples, runs)
    search, counted = CountedLimitState(limit_state, 1.0), CountedLimitState(limit_state, largest_failed_share)
    widths, more = _widths(search, seeds.child("widths").generator(), samples // 4, largest_failed_share)
    found = tuple(
        _scaled_run(counted, seeds.child(f"run {run}").generator(), samples, round(more * samples), widths)
        for run in range(runs)
    )
    seen = 1.0 if known is None or not known.size else _seen_share(counted, known, widths)
    counted.calls, counted.failed = counted.calls + search.calls, counted.failed + search.failed
    return ScaledSigmaEstimate(**vars(ChainedEstimate.of(_SCALED, found, counted)), seen_share=seen)


def _seen_share(counted: CountedLimitState, known: Float[np.ndarray, "state variable"], widths: list[float]) -> float:
    """Return the share of evenly chosen states that fail at every width."""
    states = known[:: -(-len(known) // MOST_KNOWN)]
    seen = np.ones(len(states), bool)
    for width in widths[-2::-1]:
        if not seen.any():
            break
        seen[seen] = counted.values(width * states[seen]) < 0
    return float(seen.mean())


def _widths(
    counted: CountedLimitState, generator: np.random.Generator, samples: int, largest_failed_share: float
) -> tuple[list[float], float]:
    """Return the widths from that at which most fail, or enough, down to 1, and how many times the samples it needs.

    No width is used at which more samples than allowed have no usable answer.
    """
    width, widths = 1.0, [1.0]
    chains = Chains.independent(counted.values, generator, samples, counted.variables)
    failing = chains.values < 0
    while failing.mean() < _SOUGHT_SHARE and width < _LARGEST_WIDTH:
        width, before = width * _WIDER, counted.failed
        trial = Chains.independent(_scaled(counted, width), generator, samples, counted.variables)
        found = trial.values < 0
        if counted.failed - before > largest_failed_share * samples:
            break
        if found.mean() >= failing.mean():
            chains, failing, widths = trial, found, [width]
    first = float(failing.mean())
    while failing.any() and widths[-1] > 1.0 and len(widths) < _MOST_WIDTHS:
        chosen = _starts(generator, failing, samples)
        chains = chains.continued(_scaled(counted, widths[-1]), generator, chosen, _FAILING)
        width, failing = _narrower(counted, chains, widths[-1])
        widths.append(width)
    more = min(_MOST_AT_FIRST, _SOUGHT_SHARE / first) if first else 1.0
    return (widths if widths[-1] == 1.0 else [*widths, 1.0]), max(1.0, more)


def _narrower(counted: CountedLimitState, chains: Chains, width: float) -> tuple[float, InChains]:
    """Return the smallest width at which enough of the samples still fail, and which do; 1 if the search is stuck."""
    low, high, kept = 1.0, width, None
    failing = _failing(counted, chains, 1.0)
    if failing.mean() >= _SOUGHT_SHARE:
        return 1.0, failing
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        found = _failing(counted, chains, middle)
        if found.mean() >= _SOUGHT_SHARE:
            high, kept = middle, found
        else:
            low = middle
    return (1.0, failing) if kept is None else (high, kept)


def _scaled_run(
    counted: CountedLimitState, generator: np.random.Generator, samples: int, first: int, widths: list[float]
) -> ChainedRun:
    """Return one run, whose last level counts the failures at width 1."""
    chains = Chains.independent(_scaled(counted, widths[0]), generator, first, counted.variables)
    failing = chains.values < 0
    levels = [level(chains, failing, widths[0])]
    for wider, narrower in pairwise(widths):
        if not failing.any():
            break
        chosen = _starts(generator, failing, samples)
        chains = chains.continued(_scaled(counted, wider), generator, chosen, _FAILING)
        failing = _failing(counted, chains, narrower)
        levels.append(level(chains, failing, narrower))
    return run_of(levels, chains, failing, first)


def _scaled(counted: CountedLimitState, width: float) -> Values:
    """Return the limit state of samples that are so many times as wide."""
    return lambda u: counted.values(width * u)


def _failing(counted: CountedLimitState, chains: Chains, width: float) -> InChains:
    """Return which states fail at another width; a state that repeats the one before it is not asked again."""
    moved = np.ones(chains.values.shape, bool)
    moved[:, 1:] = (chains.u[:, 1:] != chains.u[:, :-1]).any(axis=2)
    answers = counted.values(width * chains.u[moved]) < 0
    return np.asarray(answers[np.cumsum(moved.ravel()) - 1].reshape(moved.shape))


def _starts(generator: np.random.Generator, failing: InChains, samples: int) -> Int[np.ndarray, " start"]:
    """Return failing states to start chains from, some more than once if there are few."""
    found, wanted = np.flatnonzero(failing.ravel()), samples // LENGTH
    return generator.choice(found, wanted, replace=found.size < wanted)
