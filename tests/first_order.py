"""First-order reliability and importance sampling around design points, for limit states in standard normal space.

They check subset simulation on published problems; on the limits of a reducer no search for a design point converges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import minimize_scalar
from scipy.special import log_ndtr, logsumexp, ndtr

from tolalloc.capability.limit_state import CountedLimitState, LimitState, RareFailure
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError

_STEP = 1e-4
_VALUE_TOLERANCE = 1e-6
_ANGLE_TOLERANCE = 1e-3
_HALVINGS = 12
_START_RADIUS = 2.0
_SAME_POINT = 0.1


@dataclass(frozen=True, kw_only=True)
class DesignPoint:
    """Where a search for the nearest failing point ended."""

    u: Float[np.ndarray, " variable"]  # The point [-]
    beta: float  # Reliability index, negative if the origin itself fails [-]
    converged: bool  # Whether the point lies on the limit and its gradient points back to the origin
    # Calls of the limit state, those of its gradient included, how many of them gave no usable answer, and steps of the
    # search [-]
    calls: int
    failed: int
    steps: int
    status: str  # One sentence for a person

    @property
    def probability(self) -> float:
        """Probability of failure if the limit were flat, Φ(−β) [-]."""
        return float(ndtr(-self.beta))


@dataclass(frozen=True, kw_only=True)
class DesignPoints:
    """What several searches found."""

    # Distinct converged points, the nearest first; if no search converged, where the first one ended
    points: tuple[DesignPoint, ...]
    # Calls of the limit state by all searches, those that found nothing new included, and how many of them gave no
    # usable answer [-]
    calls: int
    failed: int

    @classmethod
    def only(cls, point: DesignPoint) -> DesignPoints:
        """Return the outcome of a single search."""
        return cls(points=(point,), calls=point.calls, failed=point.failed)


def design_point(
    limit_state: LimitState,
    start: Float[np.ndarray, " variable"] | None = None,
    largest_steps: int = 100,
    largest_failed_share: float = 0.01,
) -> DesignPoint:
    """Return the design point that the improved Hasofer–Lind–Rackwitz–Fiessler search reaches from a start.

    Parameters
    ----------
    limit_state
        The limit state, whose gradient is taken by central differences.
    start
        First point, the origin if none is given [-].
    largest_steps
        Steps before the search gives up [-].
    largest_failed_share
        Share of calls that may fail [-].

    Notes
    -----
    The search is local: a limit state with several nearest points gives the one that the start leads to. A step to
    a sample without a usable answer is shortened.

    Raises
    ------
    SolveError
        After 100 calls, more of them failed than allowed.

    References
    ----------
    Zhang & Der Kiureghian 1995, merit m(u) = ½‖u‖² + c·|g(u)| with c > ‖u‖ / ‖∇g(u)‖.
    """
    counted = CountedLimitState(limit_state, largest_failed_share)
    u = np.zeros(counted.variables) if start is None else np.asarray(start, float)
    at_origin, value = counted.values(np.stack([np.zeros_like(u), u]))
    scale = abs(float(at_origin)) if np.isfinite(at_origin) and at_origin else 1.0
    reason = f"not converged after {largest_steps} steps"
    steps, converged, normal = 0, False, np.zeros_like(u)
    while np.isfinite(value) and steps < largest_steps:
        slope = _gradient(counted, u)
        length = float(np.linalg.norm(slope))
        if not np.isfinite(length) or length <= 1e-12 * scale:
            reason = "the gradient vanishes or has no usable answer, so another start is needed"
            break
        normal = -slope / length
        sideways = float(np.linalg.norm(u - (u @ normal) * normal))
        if abs(value) <= _VALUE_TOLERANCE * scale and sideways <= _ANGLE_TOLERANCE * max(1.0, float(np.linalg.norm(u))):
            converged, reason = True, f"converged after {steps} steps"
            break
        step = _shortened(counted, u, float(value), slope)
        if step is None:
            reason = f"no shorter step improves the point after {steps} steps"
            break
        (u, value), steps = step, steps + 1
    if not np.isfinite(value):
        reason = "the start has no usable answer"
    distance = float(np.linalg.norm(u))
    beta = -distance if at_origin < 0 else distance
    return DesignPoint(
        u=u,
        beta=beta,
        converged=converged,
        calls=counted.calls,
        failed=counted.failed,
        steps=steps,
        status=f"Design point: β = {beta:.4g}, {reason}.",
    )


def design_points(
    limit_state: LimitState, seeds: SeedTree, starts: int = 12, largest_failed_share: float = 0.01
) -> DesignPoints:
    """Return the distinct converged design points of several starts, the nearest first.

    Parameters
    ----------
    limit_state
        The limit state.
    seeds
        Node of the seed tree for the starts.
    starts
        Number of searches; the first begins at the origin, the others in random directions [-].
    largest_failed_share
        Share of the calls of a search that may fail [-].

    Notes
    -----
    A point whose region no start leads to stays unknown; importance sampling tests for such regions.
    """
    if starts < 1:
        raise InputError.at("design points", "starts", starts, "a whole number of at least 1")
    drawn = seeds.generator().standard_normal((starts, limit_state.variables))
    directions = _START_RADIUS * drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    directions[0] = 0.0
    ends = [design_point(limit_state, start, largest_failed_share=largest_failed_share) for start in directions]
    found: list[DesignPoint] = []
    for point in sorted(ends, key=lambda item: abs(item.beta)):
        if point.converged and all(np.linalg.norm(point.u - other.u) > _SAME_POINT for other in found):
            found.append(point)
    return DesignPoints(
        points=tuple(found) or (ends[0],),
        calls=sum(point.calls for point in ends),
        failed=sum(point.failed for point in ends),
    )


def _gradient(counted: CountedLimitState, u: Float[np.ndarray, " variable"]) -> Float[np.ndarray, " variable"]:
    """Return the gradient at a point by central differences."""
    shifts = _STEP * np.eye(u.size)
    values = counted.values(np.concatenate([u + shifts, u - shifts]))
    if not np.isfinite(values).all():
        return np.full(u.size, np.nan)
    return np.asarray((values[: u.size] - values[u.size :]) / (2 * _STEP))


def _shortened(
    counted: CountedLimitState, u: Float[np.ndarray, " variable"], value: float, slope: Float[np.ndarray, " variable"]
) -> tuple[Float[np.ndarray, " variable"], float] | None:
    """Return the next point and its value, with the longest step whose merit falls enough; none if all rise."""
    squared = float(slope @ slope)
    direction = (slope @ u - value) / squared * slope - u
    penalty = 2 * float(np.linalg.norm(u)) / np.sqrt(squared)
    if value:
        penalty = max(penalty, 0.5 * float(np.sum((u + direction) ** 2)) / abs(value))
    merit = 0.5 * float(u @ u) + penalty * abs(value)
    descent = float(u @ direction) - penalty * abs(value)
    for halving in range(_HALVINGS):
        length = 0.5**halving
        trial = u + length * direction
        found = float(counted.values(trial[np.newaxis])[0])
        if 0.5 * float(trial @ trial) + penalty * abs(found) <= merit + 1e-4 * length * descent + 1e-14 * merit:
            return trial, found
    return None


METHOD = "Importance sampling"
WIDE_SHARE = 0.2
LARGEST_MISSED_SHARE = 0.05
FEWEST_EXPECTED_HITS = 10.0
FEWEST_EFFECTIVE_SAMPLES = 50.0
_FEWEST_SAMPLES = 100


@dataclass(frozen=True, kw_only=True)
class WeightedEstimate(RareFailure):
    """An estimate from weighted samples, and its share where no design point explains it [-]."""

    missed_share: float


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
) -> WeightedEstimate:
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
    return WeightedEstimate(
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
