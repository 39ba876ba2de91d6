"""What a rare failure is: values of points of standard normal space, negative where the product fails; its estimate."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8

from tolalloc.capability.experiment import Experiment
from tolalloc.exceptions import SolveError
from tolalloc.models import Response, ResponseWithDerivatives

_CALLS_TO_JUDGE = 100
"""Below so many calls one failed sample would already exceed the allowed share."""


@dataclass(frozen=True, kw_only=True)
class LimitValues:
    """Answers of a limit state."""

    # Distance to the limit, negative where the product fails [unit of the limited output]
    values: Float[np.ndarray, " sample"]
    # 0 for a good sample; anything else is a failed one, whose value must not be used [-]
    status: UInt8[np.ndarray, " sample"]

    @property
    def good(self) -> Bool[np.ndarray, " sample"]:
        """Which samples may be used."""
        return np.asarray((self.status == 0) & np.isfinite(self.values))


@runtime_checkable
class LimitState(Protocol):
    """Anything that maps points of standard normal space to the distance from a limit."""

    @property
    def variables(self) -> int:
        """Number of independent standard normal variables."""
        ...

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> LimitValues:
        """Return the distance of every sample from the limit."""
        ...


@runtime_checkable
class LimitStateWithGradient(LimitState, Protocol):
    """A limit state that knows its own derivatives."""

    def gradient(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the derivatives of every sample's value, not finite where there is no usable answer."""
        ...


class CountedLimitState:
    """A limit state that counts its calls and stops when too many of them fail.

    A failed sample reads as infinitely safe: it can neither count as a failure of the product nor start a chain.

    Parameters
    ----------
    limit_state
        The limit state.
    largest_failed_share
        Share of calls that may fail [-].
    """

    def __init__(self, limit_state: LimitState, largest_failed_share: float = 0.01) -> None:
        self.limit_state = limit_state
        self.largest_failed_share = largest_failed_share
        self.calls = 0
        self.failed = 0

    @property
    def variables(self) -> int:
        """Number of independent standard normal variables."""
        return self.limit_state.variables

    def values(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        """Return the values of the points, infinite where the sample failed.

        Raises
        ------
        SolveError
            Of all calls so far, a hundred at least, more than allowed failed.
        """
        answer = self.limit_state(u)
        self._count(answer.good)
        return np.where(answer.good, answer.values, np.inf)

    def gradient(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the derivatives of a limit state that knows them, not finite where the sample failed.

        Raises
        ------
        SolveError
            As for the values.
        """
        assert isinstance(self.limit_state, LimitStateWithGradient)
        slopes = self.limit_state.gradient(u)
        self._count(np.asarray(np.isfinite(slopes).all(axis=1)))
        return slopes

    def _count(self, good: Bool[np.ndarray, " sample"]) -> None:
        """Add up calls and failures, and stop at too many of them."""
        self.calls += good.size
        self.failed += int(np.count_nonzero(~good))
        if self.calls >= _CALLS_TO_JUDGE and self.failed > self.largest_failed_share * self.calls:
            raise SolveError(
                f"Rare failure: {self.failed} of {self.calls} samples have no usable answer; allowed is "
                f"{self.largest_failed_share:.4g} of them, because more would bias the probability."
            )

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader must know about the failed samples; empty if there were none."""
        return (f"{self.failed} of {self.calls} samples have no usable answer and count as safe",) * bool(self.failed)


@dataclass(frozen=True, kw_only=True)
class Level:
    """One level of a subset simulation."""

    run: int  # Which of the independent runs, from 0 [-]
    # Value of the limit state that bounds the next level, 0 at the last one [unit of the limited output]
    threshold: float
    share: float  # Share of this level's samples beyond the threshold [-]
    correlation: float  # Factor γ by which correlated chains raise the variance of the share to (1 + γ) times [-]
    accepted: float  # Share of accepted chain steps, 1 at the first level, which has no chains [-]
    coefficient_of_variation: float  # Of the share [-]


@dataclass(frozen=True, kw_only=True)
class RareFailure:
    """Probability of failure with its standard error and what it took."""

    probability: float  # Estimate [-]
    # Of the estimate; infinite if no sample failed, because then nothing is known about the spread [-]
    standard_error: float
    # Calls of the limit state, and how many of them gave no usable answer [-]
    calls: int
    failed: int
    method: str  # Name of the method
    cautions: tuple[str, ...]  # Reasons not to rely on the estimate; empty if the method sees none
    effective_samples: float  # Number of equally weighted failures that would know as much; 0 if no sample failed [-]
    # Share of the probability that lies where no design point explains it; 0 for subset simulation [-]
    missed_share: float = 0.0
    levels: tuple[Level, ...] = ()  # Levels of a subset simulation, run by run; empty for other methods
    # Failing states of every run of a subset simulation, not independent of each other; empty for other methods [-]
    failing: tuple[Float[np.ndarray, "_state variable"], ...] = field(default=(), repr=False, compare=False)

    @property
    def coefficient_of_variation(self) -> float:
        """Standard error over probability, infinite for a probability of zero [-]."""
        return self.standard_error / self.probability if self.probability > 0 else float("inf")

    def difference_from(self, other: RareFailure) -> float:
        """Return the difference from an independent estimate in standard errors of that difference [-].

        Notes
        -----
        Beyond 3 the two methods contradict each other, and one of them has missed something. An estimate without a
        failure contradicts nothing, so the difference from it is 0.
        """
        error = float(np.hypot(self.standard_error, other.standard_error))
        return (self.probability - other.probability) / error

    @property
    def trustworthy(self) -> bool:
        """Whether the method sees no reason against its own estimate."""
        return not self.cautions

    @property
    def status(self) -> str:
        """One sentence for a person."""
        text = (
            f"{self.method}: probability {self.probability:.3g} with standard error {self.standard_error:.2g} "
            f"from {self.calls} calls"
        )
        return f"{text}; do not rely on it: {'; '.join(self.cautions)}." if self.cautions else f"{text}."


_STEP = 1e-3
"""Step of the differences in standard normal space; up to 6, rounding and curvature both cost less than 1e-4 [-]."""


@runtime_checkable
class DifferentiableResponse(Response, ResponseWithDerivatives, Protocol):
    """A response that answers with its derivatives or without."""


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

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> LimitValues:
        """Return the distance of every sample from the limit [output]."""
        evaluation = self.experiment.response(self.deviations(u))
        # Another output of a sample may have failed, and then the sample is lost as a whole.
        values = np.where(evaluation.good, self.limit - evaluation.values[:, 0], np.nan)
        return LimitValues(values=values, status=evaluation.status)


@dataclass(frozen=True, kw_only=True)
class ResponseLimitWithGradient(ResponseLimit):
    """The same limit on a response that knows its derivatives."""

    experiment: Experiment[DifferentiableResponse]

    def gradient(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the derivatives of every distance by the standard normal numbers, NaN where a sample failed [output].

        Notes
        -----
        The chain rule takes all deviations by all numbers, because those of one source, or of sources that depend on
        each other, mix: central differences of the distributions, exact derivatives of the response.
        """
        answer = self.experiment.response.with_derivatives(self.deviations(u))
        by_column = np.where(answer.evaluation.good[:, np.newaxis], answer.by_column, np.nan)
        gradient = np.empty_like(u)
        for variable, shift in enumerate(_STEP * np.eye(self.variables)):
            by_number = (self.deviations(u + shift) - self.deviations(u - shift)) / (2 * _STEP)
            gradient[:, variable] = -np.sum(by_column * by_number, axis=1)
        return gradient
