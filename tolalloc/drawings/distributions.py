"""Distributions of one number by their quantile function, each in a unit of its own; `zones` puts them into a zone."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from math import log, sqrt
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

Numbers = Float[np.ndarray, "..."]

NUMBER = r"[0-9]+(?:\.[0-9]*)?(?:e-?[0-9]+)?"
"""How a table writes a number inside a cell that holds several."""

INSIDE_AT_CP_1 = 0.9973
ABOVE_ZERO, BELOW_ONE = float(np.finfo(float).tiny), float(np.nextafter(1.0, 0.0))
"""Smallest and largest probability whose quantile is finite [-]."""
LEVELS = np.linspace(-8.2, 8.2, 4097)
"""Standard normal numbers that cover all probabilities between 0 and the float below 1 [-]."""
LEVELS.setflags(write=False)


def ndtr(number: Any) -> Any:
    """Return the standard normal probabilities of not exceeding these numbers; scipy is imported when it is used."""
    from scipy import special

    return special.ndtr(number)


def ndtri(probability: Any) -> Any:
    """Return the standard normal numbers that are not exceeded with these probabilities."""
    from scipy import special

    return special.ndtri(probability)


class Distribution(StrEnum):
    """Shape of the deviation inside its zone."""

    NORMAL = "normal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    LOGNORMAL = "lognormal"
    WEIBULL = "weibull"
    MIXTURE = "mixture"
    EMPIRICAL = "empirical"

    @property
    def is_one_sided(self) -> bool:
        """Whether a size starts at the lower limit of its zone rather than spreading around the middle."""
        return self in SHAPES

    @property
    def is_bounded(self) -> bool:
        """Whether it ends, at Cp = 1 at the limit of the zone."""
        return self in (Distribution.UNIFORM, Distribution.TRIANGULAR)


SHAPES = {Distribution.LOGNORMAL: (0.02, 1.5), Distribution.WEIBULL: (0.3, 20.0)}
"""Smallest and largest shape that is believed, for the distributions that have one [-]."""


def require_shape(distribution: Distribution, shape: float | None) -> None:
    """Raise unless a distribution has the shape that it needs, and no other has one.

    Raises
    ------
    ValueError
        What is wrong, for the record that holds both.
    """
    if distribution not in SHAPES:
        if shape is not None:
            raise ValueError(f"distribution {distribution.value} has no shape; {' and '.join(SHAPES)} have one")
        return
    smallest, largest = SHAPES[distribution]
    if shape is None or not smallest <= shape <= largest:
        stated = "none" if shape is None else f"{shape:g}"
        raise ValueError(f"distribution {distribution.value} needs a shape from {smallest:g} to {largest:g}: {stated}")


@runtime_checkable
class Marginal(Hashable, Protocol):
    """Distribution of one number."""

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1: what 99.73 % of parts keep, or the end of a bounded one."""
        ...

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities in (0, 1) [own unit]."""
        ...

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        ...


@dataclass(frozen=True)
class Family:
    """A distribution of scipy, whose import takes longer than everything else that reads a table."""

    name: str  # As in scipy.stats
    # Its shape, start and width as scipy.stats takes them; without them it is the standard one [-]
    arguments: tuple[float, ...] = ()
    end: float | None = None  # Value at the limit of the zone at Cp = 1; without it the 99.73 % quantile [own unit]

    @property
    def _scipy(self) -> Any:
        from scipy import stats

        return getattr(stats, self.name)

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1 [own unit]."""
        return float(self._scipy.ppf(INSIDE_AT_CP_1, *self.arguments)) if self.end is None else self.end

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities in (0, 1) [own unit]."""
        return np.asarray(self._scipy.ppf(probability, *self.arguments))

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        return np.asarray(self._scipy.cdf(value, *self.arguments))


@dataclass(frozen=True)
class Normal:
    """The standard normal distribution."""

    reach: float = 3.0  # Value at the limit of the zone at Cp = 1 [σ]

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities in (0, 1) [σ]."""
        return np.asarray(ndtri(probability))

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        return np.asarray(ndtr(value))


@dataclass(frozen=True)
class Rayleigh:
    """Length of a vector with two standard normal components."""

    reach: float = sqrt(-2.0 * log(1.0 - INSIDE_AT_CP_1))  # Value at the limit of the zone at Cp = 1 [σ]

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities in (0, 1) [σ]."""
        from scipy import special

        return np.asarray(np.sqrt(-2.0 * special.log1p(np.negative(probability))))

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        from scipy import special

        return np.asarray(np.where(np.greater(value, 0.0), -special.expm1(-0.5 * np.square(value)), 0.0))


NORMAL, RAYLEIGH = Normal(), Rayleigh()


@dataclass(frozen=True)
class Placed:
    """A distribution moved and scaled."""

    # What is moved and scaled, where its 0 comes to lie, and the length of its unit [half zone]
    base: Marginal
    offset: float
    scale: float

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1 [half zone]."""
        return self.offset + self.scale * self.base.reach

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities [half zone]."""
        return np.asarray(self.base.quantile(probability) * self.scale + self.offset)

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        return self.base.probability((value - self.offset) / self.scale)


@dataclass(frozen=True)
class Sorted:
    """What is left of a distribution when everything outside two limits is sorted out."""

    # Distribution before sorting, and the limits [unit of the base]
    base: Marginal
    low: float
    high: float

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1 [unit of the base]."""
        return self.base.reach

    @cached_property
    def kept(self) -> float:
        """Share of parts that is not sorted out [-]."""
        return float(np.subtract(*self._ends[::-1]))

    @cached_property
    def _ends(self) -> Float[np.ndarray, "2"]:
        return self.base.probability(np.array([self.low, self.high]))

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities [unit of the base]."""
        before = self.base.quantile(self._ends[0] + self.kept * probability)
        return np.asarray(np.clip(before, self.low, self.high))

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        return np.asarray(np.clip((self.base.probability(value) - self._ends[0]) / self.kept, 0.0, 1.0))


def moments(marginal: Marginal) -> tuple[float, float]:
    """Return mean and standard deviation [own unit], by the trapezoidal rule over standard normal numbers."""
    weights = np.exp(-(LEVELS**2) / 2.0)
    values, weights = marginal.quantile(ndtr(LEVELS)), weights / weights.sum()
    mean = float(weights @ values)
    return mean, sqrt(float(weights @ (values - mean) ** 2))
