"""Importance sampling from a normal distribution widened towards known failures.

It needs no design point, so it suits a limit that is met in many directions alike, as the range of a periodic curve is:
the phase of an error hardly matters to it, and the nearest failures fill a surface.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.capability.rare_failure.limit_state import CountedLimitState, LimitState, RareFailure
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError

WIDENED = "Widened sampling"
FEWEST_EFFECTIVE_SAMPLES = 50.0
_FEWEST_WIDENED = 100


def widened_sampling(
    limit_state: LimitState,
    failing: tuple[Float[np.ndarray, "_state variable"], ...],
    seeds: SeedTree,
    samples: int = 10_000,
    largest_failed_share: float = 0.01,
) -> RareFailure:
    """Return the probability of failure from samples of a widened normal distribution.

    Parameters
    ----------
    limit_state
        The limit state.
    failing
        Failing states of independent runs of `subset_simulation`, two or more; a run may have none [-].
    seeds
        Node of the seed tree.
    samples
        Samples of the widened distribution [-].
    largest_failed_share
        Share of the samples that may fail [-].

    Raises
    ------
    InputError
        Fewer than two runs have failing states.
    SolveError
        More samples than allowed have no usable answer.

    Notes
    -----
    The density is centred at the origin and nowhere narrower than the normal one, so no weight exceeds the product of
    the widths. The directions come from one half of the runs and the widths along them from the other half: what is
    chance in the few lineages of one run then does not widen anything. The samples are new, so the estimate differs
    from that of the runs by chance alone, but a region that all runs have missed it will hardly meet either.

    References
    ----------
    Rubinstein & Kroese, The Cross-Entropy Method, ch. 3: the normal density nearest to that of the failures has their
    second moment; Au & Beck 1999, densities from states of a Markov chain.
    """
    if samples < _FEWEST_WIDENED:
        raise InputError.at(WIDENED, "samples", samples, f"a whole number from {_FEWEST_WIDENED}")
    moments = [np.einsum("si,sj->ij", states, states) / states.shape[0] for states in failing if states.size]
    if len(moments) < 2:
        raise InputError.at(WIDENED, "runs with failing states", len(moments), "2 or more")
    directions = np.linalg.eigh(np.mean(moments[::2], axis=0))[1]
    squares = np.einsum("iv,ij,jv->v", directions, np.mean(moments[1::2], axis=0), directions)
    widths = np.sqrt(np.maximum(squares, 1.0))
    counted = CountedLimitState(limit_state, largest_failed_share)
    normal = seeds.generator().standard_normal((samples, counted.variables))
    # Sums without a library's product of matrices, whose last bits depend on its threads.
    u = np.einsum("sv,iv->si", normal * widths, directions)
    log_weights = np.log(widths).sum() + 0.5 * np.sum(normal**2 * (1 - widths**2), axis=1)
    weights = np.where(counted.values(u) < 0, np.exp(log_weights), 0.0)
    probability = float(weights.mean())
    effective = float(weights.sum() ** 2 / np.sum(weights**2)) if probability > 0 else 0.0
    degenerate = (f"the weights degenerate to {effective:.0f} effective samples",)
    return RareFailure(
        probability=probability,
        standard_error=float(weights.std(ddof=1) / np.sqrt(samples)) if probability > 0 else float("inf"),
        calls=counted.calls,
        failed=counted.failed,
        method=WIDENED,
        cautions=degenerate * (effective < FEWEST_EFFECTIVE_SAMPLES) + counted.cautions,
        effective_samples=effective,
    )
