"""Importance sampling around design points, with a wide component that looks for what they miss."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import minimize_scalar
from scipy.special import log_ndtr, logsumexp, ndtr

from tolalloc.capability.rare_failure.form import DesignPoint, DesignPoints
from tolalloc.capability.rare_failure.limit_state import CountedLimitState, LimitState
from tolalloc.capability.rare_failure.result import RareFailure
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
    """Normal densities around the design points, and a wide one around the origin as the last component.

    Parameters
    ----------
    centres
        Centre of every component [-].
    widths
        Standard deviation of every component [-].
    counts
        Samples of every component [-].
    """

    centres: Float[np.ndarray, "component variable"]
    widths: Float[np.ndarray, " component"]
    counts: Int[np.ndarray, " component"]

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
