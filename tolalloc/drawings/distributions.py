"""Distributions of one number by their quantile function, each in a unit of its own; `zones` puts them into a zone."""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
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
_RAREST = 1e-50
"""Smallest probability whose quantile is searched, as the search of a beta distribution ends without one below [-]."""
LEVELS = np.linspace(-8.2, 8.2, 4097)
"""Standard normal numbers that cover all probabilities between 0 and the float below 1 [-]."""
LEVELS.setflags(write=False)
_MOST_BATCHES = 20
"""Most batches of a mixture that are believed [-]."""


def ndtr(number: Any) -> Any:
    """Return the standard normal probabilities of not exceeding these numbers; scipy is imported when it is used."""
    from scipy import special

    return special.ndtr(number)


def ndtri(probability: Any) -> Any:
    """Return the standard normal numbers that are not exceeded with these probabilities."""
    from scipy import special

    return special.ndtri(probability)


class Distribution(StrEnum):
    """Shape of the deviation inside its zone; what is known of each stands in `FORMS`."""

    NORMAL = "normal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    TRAPEZOID = "trapezoid"
    BETA = "beta"
    LOGNORMAL = "lognormal"
    WEIBULL = "weibull"
    RAYLEIGH = "rayleigh"
    MIXTURE = "mixture"
    EMPIRICAL = "empirical"

    @property
    def form(self) -> Form:
        """What is known of it."""
        return FORMS[self]


@dataclass(frozen=True)
class Shapes:
    """How many shapes a distribution has, and between which each is believed [-]."""

    count: int
    smallest: float
    largest: float

    @property
    def needed(self) -> str:
        """What a row must state, in words."""
        what = "a shape" if self.count == 1 else f"{self.count} shapes such as '2 5', each"
        return f"{what} from {self.smallest:g} to {self.largest:g}"


@dataclass(frozen=True, kw_only=True)
class Form:
    """What is known of a distribution, in one place: a new one is a member of `Distribution` and its form."""

    scipy: str = ""  # Its name in scipy.stats; none of what has a class of its own here, or is made of others
    is_bounded: bool = False  # Whether it has an end on either side, as the standard one of scipy has at 0 and 1
    shapes: Shapes | None = None  # The shapes that a row states, if any
    # Returns, of these shapes, those that scipy takes
    to_scipy: Callable[[tuple[float, ...]], tuple[float, ...]] = tuple
    # Whether a size starts at the lower limit of its zone rather than spreading around the middle
    is_one_sided: bool = False
    # Returns whether its density is symmetric and the logarithm of that concave
    is_symmetric: Callable[[tuple[float, ...]], bool] = lambda _: False

    def of(self, shapes: tuple[float, ...], start: float) -> Marginal:
        """Return the distribution of these shapes; a bounded one from a start to 1."""
        shapes = self.to_scipy(shapes)
        return Family(self.scipy, (*shapes, start, 1.0 - start), 1.0) if self.is_bounded else Family(self.scipy, shapes)


FORMS = {
    Distribution.NORMAL: Form(is_symmetric=lambda _: True),
    Distribution.UNIFORM: Form(scipy="uniform", is_bounded=True, is_symmetric=lambda _: True),
    Distribution.TRIANGULAR: Form(
        scipy="triang", is_bounded=True, to_scipy=lambda _: (0.5,), is_symmetric=lambda _: True
    ),
    # Without a plateau a trapezoid is triangular, without sides uniform.
    Distribution.TRAPEZOID: Form(
        scipy="trapezoid",
        is_bounded=True,
        shapes=Shapes(1, 0.01, 0.99),
        to_scipy=lambda shapes: tuple((1.0 + sign * own) / 2.0 for own in shapes for sign in (-1, 1)),
        is_symmetric=lambda _: True,
    ),
    # With a shape below 1 a beta density has no end at a limit.
    Distribution.BETA: Form(
        scipy="beta", is_bounded=True, shapes=Shapes(2, 1.0, 50.0), is_symmetric=lambda shapes: len({*shapes}) == 1
    ),
    Distribution.LOGNORMAL: Form(scipy="lognorm", shapes=Shapes(1, 0.02, 1.5), is_one_sided=True),
    Distribution.WEIBULL: Form(scipy="weibull_min", shapes=Shapes(1, 0.3, 20.0), is_one_sided=True),
    Distribution.RAYLEIGH: Form(is_one_sided=True),
    Distribution.MIXTURE: Form(),
    Distribution.EMPIRICAL: Form(),
}


def parsed_shapes(text: str) -> tuple[float, ...]:
    """Return the shapes that a cell states, separated by blanks."""
    if not all(re.fullmatch(NUMBER, item) for item in text.split()):
        raise ValueError("allowed is a number with a decimal point, or for beta two such as '2 5'")
    return tuple(map(float, text.split()))


def require_shapes(distribution: Distribution, stated: tuple[float, ...]) -> None:
    """Raise unless a distribution has the shapes that it needs, and no other has any."""
    own = distribution.form.shapes
    if own is None:
        if stated:
            *others, last = (kind.value for kind, form in FORMS.items() if form.shapes)
            raise ValueError(f"distribution {distribution.value} has no shape; {', '.join(others)} and {last} have one")
        return
    if len(stated) != own.count or not all(own.smallest <= shape <= own.largest for shape in stated):
        said = " ".join(f"{shape:g}" for shape in stated) or "none"
        raise ValueError(f"distribution {distribution.value} needs {own.needed}: {said}")


@runtime_checkable
class Marginal(Hashable, Protocol):
    """Distribution of one number."""

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1: what 99.73 % of parts keep, or the end of a bounded one."""

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities in (0, 1) [own unit]."""

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""


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
        return np.asarray(self._scipy.ppf(np.maximum(probability, _RAREST), *self.arguments))

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


@dataclass(frozen=True, kw_only=True)
class Batch:
    """One batch of a mixture."""

    weight: float  # Share of all parts; the weights are taken relative to their sum [-]
    shift: float  # Mean off the middle of the zone, 0 for a position [half zone]
    spread: float  # σ over that of Cp = 1 [-]


def parsed_batches(text: str) -> tuple[Batch, ...]:
    """Return batches such as ``0.7:-0.3:0.8 0.3:0.5:0.6``: weight, shift and spread."""
    batches = []
    for item in text.split():
        match = re.fullmatch(rf"({NUMBER}):(-?{NUMBER}):({NUMBER})", item)
        if match is None:
            raise ValueError("the batches must read like '0.7:-0.3:0.8 0.3:0.5:0.6' (weight:shift:spread)")
        batch = Batch(weight=float(match[1]), shift=float(match[2]), spread=float(match[3]))
        if not 1e-6 <= batch.weight <= 1e6 or abs(batch.shift) > 2 or not 0.01 <= batch.spread <= 10:
            raise ValueError(f"the batch {item} must have a weight from 1e-6 to 1e6, shift -2 to 2, spread 0.01 to 10")
        batches.append(batch)
    if len(batches) > _MOST_BATCHES:
        raise ValueError(f"a mixture must have {_MOST_BATCHES} batches or less: {len(batches)}")
    return tuple(batches)


def batches_text(batches: tuple[Batch, ...]) -> str:
    """Return batches as a tolerance table writes them."""
    return " ".join(f"{batch.weight!r}:{batch.shift!r}:{batch.spread!r}" for batch in batches)


@dataclass(frozen=True)
class Mixture:
    """Parts from several batches, each with a mean and a spread of its own, of one common distribution.

    The base is normal for sizes, Rayleigh for the radius of a position. The quantile is interpolated between the
    probabilities of fixed values: quantiles of the batches, so that a narrow one is resolved too, and a grid over all.
    """

    base: Marginal
    batches: tuple[Batch, ...]
    reach: float = 1.0

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        values, levels = self._table
        return np.asarray(ndtr(np.interp(value, values, levels, left=-np.inf, right=np.inf)))

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities [half zone]."""
        values, levels = self._table
        return np.asarray(np.interp(ndtri(probability), levels, values))

    @cached_property
    def _table(self) -> tuple[Float[np.ndarray, " value"], Float[np.ndarray, " value"]]:
        """Values [half zone] and, for the probability of each, the standard normal number [-]."""
        own = self.base.quantile(ndtr(LEVELS[:: max(1, len(self.batches) // 2)])) / self.base.reach
        spans = np.concatenate([batch.shift + batch.spread * own for batch in self.batches])
        values = np.unique(np.concatenate([spans, np.linspace(spans.min(), spans.max(), LEVELS.size)]))
        total, below = sum(batch.weight for batch in self.batches), np.zeros(values.size)
        for batch in self.batches:
            reached = self.base.probability((values - batch.shift) * (self.base.reach / batch.spread))
            below += batch.weight / total * reached
        # Rounding near 0 and 1 leaves values of equal probability, which no quantile can tell apart.
        below, first = np.unique(np.maximum.accumulate(below), return_index=True)
        inside = (below > 0.0) & (below < 1.0)
        return values[first][inside], ndtri(below[inside])


@dataclass(frozen=True)
class Folded:
    """Magnitude of a number that is distributed symmetrically around 0."""

    symmetric: Marginal

    @property
    def reach(self) -> float:
        """Value at the limit of the zone at Cp = 1 [own unit]."""
        return self.symmetric.reach

    def quantile(self, probability: Numbers) -> Numbers:
        """Return the values that are not exceeded with these probabilities [own unit]."""
        from_zero = np.minimum(0.5 + 0.5 * probability, BELOW_ONE)
        return np.asarray(np.maximum(self.symmetric.quantile(from_zero), 0.0))

    def probability(self, value: Numbers) -> Numbers:
        """Return the probabilities of not exceeding these values [-]."""
        return np.asarray(np.maximum(2.0 * self.symmetric.probability(value) - 1.0, 0.0))


def smoothed(values: Float[np.ndarray, " part"]) -> Mixture:
    """Return the distribution of measured values, each widened to a normal one [half zone].

    The values are drawn together around their mean by as much, so that mean and standard deviation stay as measured.

    References
    ----------
    Silverman, Density estimation for statistics and data analysis, 1986, section 6.4.1.
    """
    width = _smoothing_width(values)
    shrink = 1.0 / sqrt(1.0 + (width / float(values.std())) ** 2)
    places = values.mean() + shrink * (values - values.mean())
    spread = shrink * width * NORMAL.reach
    return Mixture(NORMAL, tuple(Batch(weight=1.0, shift=float(place), spread=spread) for place in places))


def _smoothing_width(values: Float[np.ndarray, " part"]) -> float:
    """Return Silverman's width for the smoothing of measured values [unit of the values].

    References
    ----------
    Silverman, Density estimation for statistics and data analysis, 1986, equation 3.31.
    """
    deviation, middle_half = float(values.std()), float(np.subtract(*np.quantile(values, [0.75, 0.25]))) / 1.349
    return float(0.9 * (min(deviation, middle_half) or deviation) * values.size**-0.2)


def smoothed_magnitude(values: Float[np.ndarray, " part"]) -> Folded:
    """Return the distribution of measured radii, smoothed as deviations are and then mirrored at 0 [largest radius].

    The mean square stays the measured one; mean and standard deviation do as far as no part lies within the smoothing
    width of 0.
    """
    batches = smoothed(values).batches
    return Folded(Mixture(NORMAL, batches + tuple(replace(batch, shift=-batch.shift) for batch in batches)))
