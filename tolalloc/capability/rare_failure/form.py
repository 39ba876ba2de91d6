"""First-order reliability: the point of the failure region that is nearest to the origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from tolalloc.capability.rare_failure.limit_state import CountedLimitState, LimitState, LimitStateWithGradient
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
        The limit state; if it carries no gradient, central differences stand in for it.
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
    """Return the given gradient at a point, or the one by central differences."""
    if isinstance(counted.limit_state, LimitStateWithGradient):
        return np.asarray(counted.gradient(u[np.newaxis])[0])
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
