"""What must be shown of a limited output by random units: a yield, or a capability index."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.level import Level, levels_of_law, order_statistic, reached, side_name, side_scale
from tolalloc.allocation.limited_sample import LimitedSample
from tolalloc.allocation.local_model import Side, root_sum_square_stack
from tolalloc.allocation.trial import OutputTrial
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import CONFIDENCE, allowed_rejections
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields, is_number

USUAL_YIELD = 0.9973
"""Share of units that must keep a limit unless it says otherwise: ±3σ of a normal output [-]."""
_BATCHES = 16
"""Batches of units whose derivatives tell the error of their mean [-]."""


@runtime_checkable
class Guarantee(Protocol):
    """What must be shown of an output for its limits to count as kept."""

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        ...

    def judge(self, trial: OutputTrial, limits: Limits) -> tuple[Side, ...]:
        """Return every limited side; the requirement is met if no value lies beyond its limit."""
        ...

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Raise unless so many units can show it with a one-sided confidence."""
        ...


@runtime_checkable
class Sampled(Guarantee, Protocol):
    """A guarantee that random units show, with an error."""

    def levels(self, sample: LimitedSample, confidence: float) -> tuple[Level, ...]:
        """Return what units show of every limited side with one-sided confidence, the upper one first."""
        ...

    def least_levels(self, sample: LimitedSample, confidence: float) -> tuple[Level, ...]:
        """Return what every limited side is at least, with one-sided confidence: the other end of `levels`."""
        ...


@dataclass(frozen=True)
class AtYield(NamedFields):
    """So many units lie within all limits of the output, shown with an overall error of at most 5 % in a full run.

    Parameters
    ----------
    target
        Share of units that must keep the limits [-].

    Notes
    -----
    The values are order statistics: of the units furthest beyond a limit, either one, so many are left out as the
    sample may reject. So they are inside exactly where the bound of the yield reaches the target, Clopper–Pearson's
    where all units were solved.
    """

    called: ClassVar[str] = "guarantee AtYield"
    by_position: ClassVar[int] = 1

    target: float

    def __post_init__(self) -> None:
        if not (is_number(self.target) and 0.5 <= self.target < 1):
            share = self.target / 100 if is_number(self.target) and 50 <= self.target < 100 else USUAL_YIELD
            raise InputError.at(self.called, "target", self.target, f"a share from 0.5 to below 1, such as {share:g}")

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return f"{self.target:.2%} of units"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Raise unless so many units can show it.

        Raises
        ------
        InputError
            Too few units for the target, even if none is rejected.
        """
        if allowed_rejections(units, self.target, confidence) < 0:
            needed = int(np.ceil(np.log(1 - confidence) / np.log(self.target)))
            raise InputError.at(f"a yield of {self.target:.4%}", "units", units, f"{needed} or more")

    def judge(self, trial: OutputTrial, limits: Limits) -> tuple[Side, ...]:
        """Return every limited side."""
        return _spread_sides(trial, self.levels(trial.sample(limits), trial.confidence), limits)

    def levels(self, sample: LimitedSample, confidence: float) -> tuple[Level, ...]:
        """Return what units show of every limited side, or what its law does where they keep to it."""
        if sample.law:
            return levels_of_law(sample, sample.law, 1 - self.target - sample.most_leaving(confidence))
        beyond = sample.units.kept_excess(sample.excess, self.target, confidence)
        return tuple(order_statistic(sample, sign, limit, beyond) for sign, limit in sample.limits.turned)

    def least_levels(self, sample: LimitedSample, confidence: float) -> tuple[Level, ...]:
        """Return what every limited side is at least."""
        if sample.law:
            return levels_of_law(sample, sample.law, 1 - self.target + sample.most_leaving(confidence))
        beyond = sample.units.least_excess(sample.excess, self.target, confidence)
        return tuple(order_statistic(sample, sign, limit, beyond) for sign, limit in sample.limits.turned)


@dataclass(frozen=True)
class AtCpk(NamedFields):
    """The capability index of the output reaches a target, shown with an overall error of about 5 % in a full run.

    Parameters
    ----------
    target
        Smallest Cpk [-].

    Notes
    -----
    The estimate is normal around Cpk with n·var = 1/9 + Cpk·γ/3 + Cpk²·(κ − 1)/4, skewness γ (towards the limit) and
    kurtosis κ those of the sample: Bissell's interval where both are normal. The value is mean + 3·c·σ, with c the
    estimate at which the lower bound is the target. Cpk is that of the whole sample; read as a yield, it still
    assumes a normal output. Units without a usable answer are left out.

    References
    ----------
    Bissell 1990, Appl. Statist. 39, 331–340; the delta method for other distributions.
    """

    called: ClassVar[str] = "guarantee AtCpk"
    by_position: ClassVar[int] = 1

    target: float

    def __post_init__(self) -> None:
        if not (is_number(self.target) and 0 < self.target <= 10):
            raise InputError.at(self.called, "target", self.target, "a Cpk above 0 up to 10")

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return f"Cpk {self.target:g}"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:  # noqa: ARG002
        """Raise unless so many units can show it.

        Raises
        ------
        InputError
            Too few units for the normal approximation.
        """
        if units < 100:
            raise InputError.at(f"a Cpk of {self.target:g}", "units", units, "100 or more")

    def judge(self, trial: OutputTrial, limits: Limits) -> tuple[Side, ...]:
        """Return every limited side."""
        return _spread_sides(trial, self.levels(trial.sample(limits), trial.confidence), limits)

    def levels(self, sample: LimitedSample, confidence: float) -> tuple[Level, ...]:
        """Return what units show of every limited side."""
        return tuple(self._level(sample.plain, sign, limit, confidence) for sign, limit in sample.limits.turned)

    def least_levels(self, sample: LimitedSample, confidence: float) -> tuple[Level, ...]:
        """Return what every limited side is at least."""
        return self.levels(sample, 1 - confidence)

    def _level(
        self, values: Float[np.ndarray, " good"], sign: Literal[1, -1], limit: float, confidence: float
    ) -> Level:
        turned = sign * values
        needed, error = self._needed(turned, confidence)
        deviation = float(turned.std(ddof=1))
        value = float(turned.mean()) + 3 * needed * deviation
        return Level(sign=sign, limit=limit, value=sign * value, standard_error=3 * error * deviation)

    def _needed(self, turned: Float[np.ndarray, " unit"], confidence: float) -> tuple[float, float]:
        """Return the estimate whose lower bound is the target, and its standard error [-].

        Below even odds the target is its upper bound.
        """
        from scipy.stats import kurtosis, norm, skew

        z, units = float(norm.ppf(confidence)), turned.size
        lean, tails = float(skew(turned)), float(kurtosis(turned, fisher=False)) - 1
        # (c − target)²·n = z²·(1/9 + c·γ/3 + c²·(κ − 1)/4), the larger root; the smaller one below even odds.
        square, half = units - z**2 * tails / 4, units * self.target + z**2 * lean / 6
        # At even odds both roots are the target, up to rounding.
        root = np.sqrt(max(half**2 - square * (units * self.target**2 - z**2 / 9), 0.0))
        needed = (half + np.copysign(root, z)) / square
        variance = (1 / 9 + needed * lean / 3 + needed**2 * tails / 4) / units
        return float(needed), float(np.sqrt(variance))


def _spread_sides(trial: OutputTrial, levels: tuple[Level, ...], limits: Limits) -> tuple[Side, ...]:
    """Return the sides of what spreads, each with its local model."""
    return tuple(_spread_side(trial, level, limits) for level in levels)


def _spread_side(trial: OutputTrial, level: Level, limits: Limits) -> Side:
    value, groups = reached(level, trial.values), trial.groups
    excess, weights, derivative = value - level.sign * level.limit, *_weights(trial, level.sign, value)
    gradient, batches = weights @ derivative / weights.size, _batches(weights, derivative)
    if trial.law:
        gradient[:groups] = trial.units.space.by_scale(trial.law.excess_by_zone(limits, excess))
        batches[:, :groups] = gradient[:groups]
    return Side(
        sign=level.sign,
        limit=level.limit,
        value=level.value,
        standard_error=level.standard_error,
        scale=side_scale(trial, level.limit),
        stack=root_sum_square_stack(side_name(trial, level.sign), trial.design, excess, gradient, groups),
        batches=batches,
        law=trial.law,
    )


def _weights(
    trial: OutputTrial, sign: int, value: float
) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
    """Return derivatives of units, and by what each counts in that of mean + spread·σ, the turned value.

    Theory page, equation (24).
    """
    turned, (known, derivative) = sign * trial.values, trial.derived()
    spread = (value - turned.mean()) / turned.std() if turned.std() > 0 else 0.0
    standard = (sign * known - (sign * known).mean()) / known.std() if known.std() > 0 else np.zeros(known.size)
    return sign * (1.0 + spread * standard), derivative


def _batches(
    weights: Float[np.ndarray, " known"], derivative: Float[np.ndarray, "known variable"]
) -> Float[np.ndarray, "batch variable"]:
    """Return the same derivative by batches of units."""
    parts = min(_BATCHES, weights.size)
    split = (np.array_split(each, parts) for each in (weights, derivative))
    return np.stack([own @ slopes / own.size for own, slopes in zip(*split, strict=True)])
