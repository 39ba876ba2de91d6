"""What a response is: the kernel, a surrogate and a test function all look like this from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Answers of a response.

    Parameters
    ----------
    values
        Outputs [as the response's output names state].
    status
        0 for a good sample; anything else is a failed one, whose values must not be used [-].
    """

    values: Float[np.ndarray, "sample output"]
    status: UInt8[np.ndarray, " sample"]

    @property
    def good(self) -> Bool[np.ndarray, " sample"]:
        """Which samples may be used."""
        return np.asarray((self.status == 0) & np.isfinite(self.values).all(axis=1))


@runtime_checkable
class Response(Protocol):
    """Anything that maps named columns to named outputs, sample by sample."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs, in the order of X."""
        ...

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs with their units, in the order of Y."""
        ...

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the outputs of every sample."""
        ...


@runtime_checkable
class Derived(Protocol):
    """Answers with the derivative of the first output by every column."""

    @property
    def evaluation(self) -> Evaluation:
        """Outputs and status of every sample."""
        ...

    @property
    def by_column(self) -> Float[np.ndarray, "sample column"]:
        """Derivatives [output per unit of the column]."""
        ...


@runtime_checkable
class ResponseWithDerivatives(Protocol):
    """A response that knows its derivatives."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs, in the order of X."""
        ...

    def with_derivatives(self, x: Float[np.ndarray, "sample column"]) -> Derived:
        """Return the outputs of every sample and their derivatives."""
        ...
