"""What a limit state is: values of many points of standard normal space, negative where the product fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8

from tolalloc.exceptions import SolveError

LARGEST_FAILED_SHARE = 0.01
_CALLS_TO_JUDGE = 100
"""Below so many calls one failed sample would already exceed the allowed share."""


@dataclass(frozen=True, kw_only=True)
class LimitValues:
    """Answers of a limit state.

    Parameters
    ----------
    values
        Distance to the limit, negative where the product fails [unit of the limited output].
    status
        0 for a good sample; anything else is a failed one, whose value must not be used [-].
    """

    values: Float[np.ndarray, " sample"]
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
        """Return the derivatives of every sample's value."""
        ...


class CountedLimitState:
    """A limit state that counts its calls and stops when too many of them fail.

    A failed sample reads as infinitely safe: it can neither count as a failure of the product nor start a chain.
    """

    def __init__(self, limit_state: LimitState) -> None:
        self.limit_state = limit_state
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
            More than 1 % of all calls so far failed.
        """
        answer = self.limit_state(u)
        good = answer.good
        self.calls += good.size
        self.failed += int(np.count_nonzero(~good))
        if self.calls >= _CALLS_TO_JUDGE and self.failed > LARGEST_FAILED_SHARE * self.calls:
            raise SolveError(
                f"Rare failure: {self.failed} of {self.calls} samples have no usable answer; allowed is "
                f"{LARGEST_FAILED_SHARE:.0%}, because more would bias the probability."
            )
        return np.where(good, answer.values, np.inf)

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader must know about the failed samples; empty if there were none."""
        return (f"{self.failed} of {self.calls} samples have no usable answer and count as safe",) * bool(self.failed)
