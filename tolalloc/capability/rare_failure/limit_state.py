"""What a limit state is: values of many points of standard normal space, negative where the product fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8

from tolalloc.exceptions import SolveError

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
