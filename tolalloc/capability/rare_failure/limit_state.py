"""What a rare failure is: values of points of standard normal space, negative where the product fails; its estimate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Response

_CALLS_TO_JUDGE = 100
"""Below so many calls one failed sample would already exceed the allowed share."""


@runtime_checkable
class LimitState(Protocol):
    """Anything that maps points of standard normal space to the distance from a limit."""

    @property
    def variables(self) -> int:
        """Number of independent standard normal variables."""
        ...

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        """Return the distance of every sample from the limit, not finite where there is no usable answer [output]."""
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
        values = self.limit_state(u)
        good = np.isfinite(values)
        self.calls += good.size
        self.failed += int(np.count_nonzero(~good))
        if self.calls >= _CALLS_TO_JUDGE and self.failed > self.largest_failed_share * self.calls:
            raise SolveError(
                f"Rare failure: {self.failed} of {self.calls} samples have no usable answer; allowed is "
                f"{self.largest_failed_share:.4g} of them, because more would bias the probability."
            )
        return np.where(good, values, np.inf)

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader must know about the failed samples; empty if there were none."""
        return (f"{self.failed} of {self.calls} samples have no usable answer and count as safe",) * bool(self.failed)


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

    @property
    def coefficient_of_variation(self) -> float:
        """Standard error over probability, infinite for a probability of zero [-]."""
        return self.standard_error / self.probability if self.probability > 0 else float("inf")

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

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        """Return the distance of every sample from the limit, NaN where it failed [output]."""
        evaluation = self.experiment.response(self.deviations(u))
        # Another output of a sample may have failed, and then the sample is lost as a whole.
        return np.where(evaluation.good, self.limit - evaluation.values[:, 0], np.nan)
