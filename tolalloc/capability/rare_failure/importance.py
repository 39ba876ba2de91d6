"""Importance sampling around design points, or from a normal distribution widened towards known failures.

The widened one needs no design point, so it suits a limit that is met in many directions alike, as the range of a
periodic curve is: the phase of an error hardly matters to it, and the nearest failures fill a surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import minimize_scalar
from scipy.special import log_ndtr, logsumexp, ndtr

from tolalloc.capability.rare_failure.form import DesignPoint, DesignPoints
from tolalloc.capability.rare_failure.limit_state import CountedLimitState, LimitState, RareFailure
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError

METHOD = "Importance sampling"
WIDE_SHARE = 0.2
LARGEST_MISSED_SHARE = 0.05
FEWEST_EFFECTIVE_SAMPLES = 50.0
FEWEST_EXPECTED_HITS = 10.0
_FEWEST_SAMPLES = 100


@dataclass(frozen=True, kw_only=True)
class _Mixture:
    """Normal densities around the design points, and a wide one around the origin as the last component."""

    centres: Float[np.ndarray, "component variable"]  # Centre of every component [-]
    widths: Float[np.ndarray, " component"]  # Standard deviation of every component [-]
    counts: Int[np.ndarray, " component"]  # Samples of every component [-]

    def draw(self, generator: np.random.Generator) -> Float[np.ndarray, "sample variable"]:
        """Return the samples of all components, one component after the other."""
        normal = generator.standard_normal((int(self.counts.sum()), self.centres.shape[1]))
        component = np.repeat(np.arange(self.counts.size), self.counts)
        return np.asarray(self.centres[component] + self.widths[component, np.newaxis] * normal)

    def log_densities(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample component"]:
        """Return the logarithm of each component's part of the mixture density, without (2π)^(−n/2)."""
        squares = np.stack([np.sum((u - centre) ** 2, axis=1) for centre in self.centres], axis=1)
        share = np.log(self.counts / self.counts.sum())
        return np.asarray(share - self.centres.shape[1] * np.log(self.widths) - squares / (2 * self.widths**2))


def importance_sampling(
    limit_state: LimitState,
    found: DesignPoints,
    seeds: SeedTree,
    samples: int = 5000,
    largest_failed_share: float = 0.01,
) -> RareFailure:
    """Return the probability of failure from samples around the design points.

    Parameters
    ----------
    limit_state
        The limit state.
    found
        Design points; the calls of their search count, and those that failed.
    seeds
        Node of the seed tree.
    samples
        Samples of the mixture, a fifth of them from the wide component [-].
    largest_failed_share
        Share of the samples that may fail [-].

    Notes
    -----
    The wide component bounds the weights, so a region that no design point explains raises the estimate and the
    standard error instead of staying unseen. The estimate is marked if more than 5 % of it lies where the wide
    component is likelier than all others, if less than 50 effective samples carry it, or if the wide component
    would have met an equally near flat region less than 10 times.

    Raises
    ------
    SolveError
        More samples than allowed have no usable answer.

    References
    ----------
    Owen & Zhou 2000, defensive mixture with a fixed number of samples of each component; Veach & Guibas 1995,
    balance heuristic w(u) = φ(u) / Σ (nₖ/n)·qₖ(u).
    """
    if samples < _FEWEST_SAMPLES:
        raise InputError.at(METHOD, "samples", samples, f"a whole number from {_FEWEST_SAMPLES}")
    points = found.points
    if not points:
        raise InputError(f"{METHOD} needs at least one design point; subset simulation needs none.")
    counted = CountedLimitState(limit_state, largest_failed_share)
    nearest = min(abs(point.beta) for point in points)
    mixture = _mixture(points, nearest, samples)
    u = mixture.draw(seeds.generator())
    fails = counted.values(u) < 0
    parts = mixture.log_densities(u)
    terms = np.where(fails, np.exp(-0.5 * np.sum(u**2, axis=1) - logsumexp(parts, axis=1)), 0.0)
    blocks = np.split(terms, np.cumsum(mixture.counts)[:-1])
    probability = float(terms.mean())
    error = float(np.sqrt(sum(block.size * block.var(ddof=1) for block in blocks))) / samples
    unexplained = parts[:, -1] > logsumexp(parts[:, :-1], axis=1)
    missed = float(terms[unexplained].sum() / terms.sum()) if probability > 0 else 0.0
    effective = float(terms.sum() ** 2 / np.sum(terms**2)) if probability > 0 else 0.0
    hits = float(mixture.counts[-1] * ndtr(-nearest / mixture.widths[-1]))
    cautions = [point.status.rstrip(".") for point in points if not point.converged]
    return RareFailure(
        probability=probability,
        standard_error=error if probability > 0 else float("inf"),
        calls=counted.calls + found.calls,
        failed=counted.failed + found.failed,
        method=METHOD,
        cautions=(*cautions, *_weight_cautions(effective, missed, hits), *counted.cautions),
        effective_samples=effective,
        missed_share=missed,
    )


def _mixture(points: tuple[DesignPoint, ...], nearest: float, samples: int) -> _Mixture:
    """Return the mixture with equally many samples around every design point."""
    variables = points[0].u.size
    wide = max(2, round(WIDE_SHARE * samples))
    around, rest = divmod(samples - wide, len(points))
    counts = np.array([around + (at < rest) for at in range(len(points))] + [wide])
    if counts.min() < 2:
        raise InputError.at(METHOD, "samples", samples, f"at least {4 * len(points)} for {len(points)} design points")
    return _Mixture(
        centres=np.stack([*(point.u for point in points), np.zeros(variables)]),
        widths=np.array([1.0] * len(points) + [_wide_width(variables, nearest)]),
        counts=counts,
    )


def _wide_width(variables: int, beta: float) -> float:
    """Return the width that estimates a flat region at distance β in an unknown direction with least variance [-].

    Notes
    -----
    The second moment of the weights under width s is sⁿ·(2 − 1/s²)^(−n/2)·Φ(−β·√(2 − 1/s²)).
    """

    def second_moment(width: float) -> float:
        sharper = 2 - width**-2
        return float(variables * np.log(width) - variables / 2 * np.log(sharper) + log_ndtr(-beta * np.sqrt(sharper)))

    return float(minimize_scalar(second_moment, bounds=(1.0, max(2.0, beta)), method="bounded").x)


def _weight_cautions(effective: float, missed: float, hits: float) -> list[str]:
    """Return what the weights say against the estimate."""
    cautions = []
    if effective == 0:
        cautions.append("no sample failed")
    elif effective < FEWEST_EFFECTIVE_SAMPLES:
        cautions.append(f"the weights degenerate to {effective:.0f} effective samples")
    if missed > LARGEST_MISSED_SHARE:
        cautions.append(f"{missed:.0%} of the probability lies in regions that no design point explains")
    if hits < FEWEST_EXPECTED_HITS:
        cautions.append(f"another region as near as the design point would be met only {hits:.1f} times")
    return cautions


WIDENED = "Widened sampling"
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
