"""Distributions of independent inputs, and limit states written in those inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from scipy.special import log_ndtr, ndtr

from tolalloc.exceptions import InputError


@runtime_checkable
class Marginal(Protocol):
    """Distribution of one input."""

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones."""
        ...


@dataclass(frozen=True, kw_only=True)
class Normal:
    """Normal distribution.

    Parameters
    ----------
    mean, deviation
        Mean and standard deviation [unit of the input].
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _require_positive(self, "deviation", self.deviation)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        return self.mean + self.deviation * u


@dataclass(frozen=True, kw_only=True)
class Uniform:
    """Uniform distribution.

    Parameters
    ----------
    low, high
        Ends [unit of the input].
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        _require_positive(self, "high − low", self.high - self.low)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        width = self.high - self.low
        # Each end is reached from its own side, where the small probability still has all its digits.
        return np.asarray(np.where(u < 0, self.low + width * ndtr(u), self.high - width * ndtr(-u)))


@dataclass(frozen=True, kw_only=True)
class LogNormal:
    """Lognormal distribution, given by the moments of the input itself.

    Parameters
    ----------
    mean, deviation
        Mean and standard deviation of the input, not of its logarithm [unit of the input].
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _require_positive(self, "mean", self.mean)
        _require_positive(self, "deviation", self.deviation)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        variance = np.log1p((self.deviation / self.mean) ** 2)
        # A search may overshoot to where the value is infinite, which then reads as a failed sample.
        with np.errstate(over="ignore"):
            return np.asarray(self.mean * np.exp(np.sqrt(variance) * u - variance / 2))


@dataclass(frozen=True, kw_only=True)
class LargestValue:
    """Gumbel distribution of largest values, given by its moments.

    Parameters
    ----------
    mean, deviation
        Mean and standard deviation [unit of the input].
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _require_positive(self, "deviation", self.deviation)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        scale = self.deviation * np.sqrt(6) / np.pi
        # The logarithm of Φ, not Φ itself, keeps the far upper tail finite.
        exponent = np.maximum(-log_ndtr(u), np.finfo(float).tiny)
        return np.asarray(self.mean - scale * (np.euler_gamma + np.log(exponent)))


@dataclass(frozen=True, kw_only=True)
class LimitOfInputs:
    """A limit state that is written in independent inputs instead of standard normal variables.

    Parameters
    ----------
    marginals
        Distributions of the inputs, in the order of the columns.
    margin
        Returns the distance of every sample from the limit, negative where the product fails.

    References
    ----------
    Transformation x = F⁻¹(Φ(u)) of independent inputs: Ditlevsen & Madsen, Structural Reliability Methods, ch. 7.
    """

    marginals: tuple[Marginal, ...]
    margin: Callable[[Float[np.ndarray, "sample variable"]], Float[np.ndarray, " sample"]]

    @property
    def variables(self) -> int:
        """Number of inputs."""
        return len(self.marginals)

    def inputs(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the inputs of points of standard normal space [units of the inputs]."""
        return np.column_stack([item.value(column) for item, column in zip(self.marginals, u.T, strict=True)])

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> np.ndarray:
        """Return the distance of every sample from the limit."""
        return self.margin(self.inputs(u))


def _require_positive(owner: object, field: str, value: float) -> None:
    """Raise unless a parameter of a distribution is positive."""
    if not value > 0:
        raise InputError.at(type(owner).__name__, field, value, "a number above 0")
