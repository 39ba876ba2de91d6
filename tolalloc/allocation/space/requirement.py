"""Requirements: an output, its limits, and what must be shown of them, by random units or by a stack."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, ClassVar, Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.space.excess_quantile import ExcessQuantile
from tolalloc.allocation.space.output_sample import ControlPlane, DesignSample, LimitedSample, OutputSample
from tolalloc.allocation.space.problem import OneSidedConstraint, Stack, root_sum_square_stack, worst_case_stack
from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import LinearLaw, NearPlane
from tolalloc.capability.monte_carlo import CONFIDENCE, allowed_rejections
from tolalloc.capability.near_limit import largest_first
from tolalloc.exceptions import InputError
from tolalloc.models.model import Model
from tolalloc.reading.named_fields import NamedFields, is_number, number

USUAL_YIELD = 0.9973
"""Share of units that must keep a limit unless it says otherwise: ±3σ of a normal output [-]."""
_BATCHES = 16
"""Batches of units whose derivatives tell the error of their mean [-]."""


_EVEN_ODDS = 0.5
_SURROUNDED, _SURROUNDING = 4, 4000
"""Of so many times what lies beyond a rank, and so many more values, the rank of a resample is one, surely [-]."""
_ACCURACY = 1e-6
"""Error of a quantile of a linear law over half the width of the law, tested on sums with closed forms [-]."""


@dataclass(frozen=True, kw_only=True)
class QuantileBound:
    """Confidence bound on the quantile that a guarantee limits, towards one of its limits."""

    sign: Literal[1, -1]  # 1 for an upper limit, −1 for a lower one [-]
    limit: float  # The limit [unit of the output]
    value: float  # What is compared with the limit, infinite where too few units answered [unit of the output]
    standard_error: float  # Standard error of the value [unit of the output]

    def moved_out(self, by: float) -> QuantileBound:
        """Return the bound with a value that lies further out [unit of the output]."""
        return replace(self, value=self.value + self.sign * by)

    @property
    def excess(self) -> float:
        """How far the value lies beyond the limit, negative inside [unit of the output]."""
        return self.sign * (self.value - self.limit)

    def turned(self, values: Float[np.ndarray, " good"]) -> float:
        """Return sign·value, the outermost unit's where the bound is infinite [unit of the output]."""
        return self.sign * self.value if np.isfinite(self.value) else float((self.sign * values).max())


def _order_statistic(sample: LimitedSample, sign: Literal[1, -1], limit: float, beyond: float) -> QuantileBound:
    """Return the outermost value that is no further beyond a limit; beyond every limit where nothing is shown.

    A one-sided confidence bound on a quantile is an order statistic: of n units the k-th largest, with k the most
    rejects for which P(rejects ≤ k | share rejected) is at most one minus the confidence (binomial distribution):
    C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404–413; G. J. Hahn, W. Q. Meeker, Statistical Intervals (1991).
    """
    turned = np.where(np.isfinite(sample.values), sign * sample.values, np.inf)
    rank = min(int(np.count_nonzero(turned - sign * limit > beyond)), turned.size - 1)
    outermost = largest_first(turned, _SURROUNDED * rank + _SURROUNDING)
    return QuantileBound(
        sign=sign,
        limit=limit,
        value=sign * (float(turned[outermost[rank]]) if np.isfinite(beyond) else np.inf),
        standard_error=_order_statistic_error(
            turned[outermost], sample.units.stand_for[outermost], rank, float(sample.units.stand_for.sum())
        ),
    )


def _controlled_bounds(sample: LimitedSample, share: float, confidence: float) -> tuple[QuantileBound, ...]:
    """Return the outermost values that are no further beyond than what units and planes show of a share of failures.

    The side that reaches furthest stands just there, so that the limits are kept exactly where that is shown.
    """
    excess, error = sample.controlled_excess(share, confidence)
    found = [_order_statistic(sample, sign, limit, excess) for sign, limit in sample.limits.turned]
    if not np.isfinite(excess):
        return tuple(found)
    furthest = max(range(len(found)), key=lambda at: found[at].excess)
    own = found[furthest]
    found[furthest] = replace(own, value=own.limit + own.sign * excess)
    return tuple(replace(each, standard_error=error) for each in found)


def bounds_of_law(sample: LimitedSample, law: LinearLaw, beyond: float) -> tuple[QuantileBound, ...]:
    """Return what a law says of every limit if such a share of it may lie beyond the limits [-].

    With two limits both move by the same excess, outwards where it is above zero, until just that share lies beyond.

    The excess e solves P(y > upper + e) + P(y < lower − e) = beyond (own derivation) [unit of the output].
    """
    excess = law.excess(sample.limits, beyond)
    error = _ACCURACY * law.half_width
    return tuple(
        QuantileBound(sign=sign, limit=limit, value=limit + sign * excess, standard_error=error)
        for sign, limit in sample.limits.turned
    )


def _order_statistic_error(
    outermost: Float[np.ndarray, " unit"], stand_for: Float[np.ndarray, " unit"], rank: int, drawn: float
) -> float:
    """Return the standard error of the value that so many of the outermost ones lie further beyond than [unit of it].

    Exact bootstrap: the rank's value of a resample is that of unit i with a probability of the incomplete beta function
    (Maritz & Jarrett 1978). Where units stand for different numbers of others, it is that of as many equal units as
    have the variance of those beyond the rank.
    """
    from scipy.stats import beta

    above = stand_for[:rank] if rank else stand_for[:1]
    equal = drawn * above.sum() / (above @ above)
    places = np.append(0.0, np.cumsum(stand_for)) / drawn
    at = equal * places[rank]
    weights, finite = np.diff(beta.cdf(places, at + 1, equal - at)), np.isfinite(outermost)
    weights, outermost = weights[finite], outermost[finite]
    return float(np.sqrt(weights @ (outermost - weights @ outermost) ** 2))


def _scale_of(sample: OutputSample, limit: float) -> float:
    """Return what an excess is compared with; a limit of zero says nothing of its size [unit of the output]."""
    return max(abs(limit), float(sample.values.std())) or 1.0


def _name_of(sample: OutputSample, sign: int) -> str:
    """Return what the limit of an output is called."""
    return f"{sample.output}, {'upper' if sign > 0 else 'lower'} limit"


@runtime_checkable
class Guarantee(Protocol):
    """What must be shown of an output for its limits to count as kept."""

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        ...

    def constraints(self, sample: OutputSample, limits: Limits) -> tuple[OneSidedConstraint, ...]:
        """Return every one-sided constraint; the requirement is met if no value lies beyond its limit."""
        ...

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Raise unless so many units can show it with a one-sided confidence."""
        ...


@runtime_checkable
class Sampled(Guarantee, Protocol):
    """A guarantee that random units show, with an error."""

    def bounds(self, sample: LimitedSample, confidence: float) -> tuple[QuantileBound, ...]:
        """Return what units show of every limit with one-sided confidence, the upper one first."""
        ...

    def counted_bounds(self, sample: LimitedSample, confidence: float) -> tuple[QuantileBound, ...]:
        """Return the same for processes as their measured parts say; below even odds what it is at least."""
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
    where all units were solved. Where the output is linear in the deviations, its exact law takes their place. Where
    parts were measured, the values lie further out by what keeps the target with 95 % of the processes that these
    leave possible (`tolalloc.capability.monte_carlo.ProcessUncertainty`).

    Two limits are kept by so many units together, one excess beyond either deciding. What is told of a side is its own
    quantile: that of half of the failures, or of as many as lie there where these are more.

    Examples
    --------
    Of 1,000 equally spaced units up to 1, one may be rejected for 99.5 % with 95 % confidence:

    >>> values = np.arange(1, 1001) / 1000
    >>> units = LimitedSample.all_of(values, Limits(upper=1.0))
    >>> [bound.value for bound in AtYield(0.995).bounds(units, 0.95)]
    [0.999]
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
        return f"{100 * self.target:.2f} % of units"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Raise unless so many units can show it."""
        if allowed_rejections(units, self.target, confidence) < 0:
            needed = int(np.ceil(np.log(1 - confidence) / np.log(self.target)))
            raise InputError.at(f"a yield of {self.target:.4%}", "units", units, f"{needed} or more")

    def constraints(self, sample: OutputSample, limits: Limits) -> tuple[OneSidedConstraint, ...]:
        """Return every one-sided constraint, the upper one first."""
        return tail_constraints(sample, self.bounds(sample.limited(limits), sample.confidence), limits, 1 - self.target)

    def bounds(self, sample: LimitedSample, confidence: float) -> tuple[QuantileBound, ...]:
        """Return what units show of every limit, or what its law does where they keep to it."""
        margin = sample.uncertainty.margin(sample.limits, 1 - self.target) if sample.uncertainty else 0.0
        found = tuple(bound.moved_out(margin) for bound in self.counted_bounds(sample, confidence))
        if len(found) == 1:
            return found
        half = AtYield((1 + self.target) / 2)
        alone = tuple(half.bounds(sample.side(own.sign), confidence)[0] for own in found)
        excess, furthest = max(own.excess for own in found), max(own.excess for own in alone)
        return tuple(
            replace(own, value=own.limit + own.sign * excess)
            if other.excess == furthest
            else min(own, other, key=lambda bound: bound.excess)
            for own, other in zip(found, alone, strict=True)
        )

    def counted_bounds(self, sample: LimitedSample, confidence: float) -> tuple[QuantileBound, ...]:
        """Return what units show of every limit, of processes that are as their measured parts say."""
        share, one_sided, units = 1 - self.target, max(confidence, 1 - confidence), sample.units
        if sample.law:
            leaving = sample.most_leaving(one_sided)
            return bounds_of_law(sample, sample.law, share - leaving if confidence >= _EVEN_ODDS else share + leaving)
        if sample.controls:
            return _controlled_bounds(sample, share, confidence)
        read = units.kept_excess if confidence >= _EVEN_ODDS else units.least_excess
        beyond = read(sample.excess, self.target, one_sided)
        return tuple(_order_statistic(sample, sign, limit, beyond) for sign, limit in sample.limits.turned)


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

    Examples
    --------
    Standard normal units have a Cpk of 1 for a limit of 3; 400 of them show it, with 95 % confidence, for 3.17 alone:

    >>> values = np.random.default_rng(0).standard_normal(400)
    >>> units = LimitedSample.all_of(values, Limits(upper=3.0))
    >>> (bound,) = AtCpk(1.0).bounds(units, 0.95)
    >>> round(bound.value, 2), round(bound.standard_error, 2)
    (3.17, 0.13)
    """

    called: ClassVar[str] = "guarantee AtCpk"
    by_position: ClassVar[int] = 1

    target: Annotated[float, number("a Cpk above 0 up to 10", above=0, most=10)]

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return f"Cpk {self.target:g}"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:  # noqa: ARG002
        """Raise unless so many units can show it."""
        if units < 100:
            raise InputError.at(f"a Cpk of {self.target:g}", "units", units, "100 or more")

    def constraints(self, sample: OutputSample, limits: Limits) -> tuple[OneSidedConstraint, ...]:
        """Return every one-sided constraint, the upper one first."""
        bounds = self.bounds(sample.limited(limits), sample.confidence)
        return tuple(_moment_constraint(sample, own) for own in bounds)

    def bounds(self, sample: LimitedSample, confidence: float) -> tuple[QuantileBound, ...]:
        """Return what units show of every limit."""
        found = self.counted_bounds(sample, confidence)
        if sample.uncertainty is None:
            return found
        return tuple(own.moved_out(sample.uncertainty.margin_of_spread(own.sign, 3 * self.target)) for own in found)

    def counted_bounds(self, sample: LimitedSample, confidence: float) -> tuple[QuantileBound, ...]:
        """Return what units show of processes that are as their measured parts say."""
        return tuple(self._bound(sample.plain, sign, limit, confidence) for sign, limit in sample.limits.turned)

    def _bound(
        self, values: Float[np.ndarray, " good"], sign: Literal[1, -1], limit: float, confidence: float
    ) -> QuantileBound:
        turned = sign * values
        needed, error = self._needed(turned, confidence) if np.ptp(turned) > 0 else (self.target, 0.0)
        deviation = float(turned.std(ddof=1))
        value = float(turned.mean()) + 3 * needed * deviation
        return QuantileBound(sign=sign, limit=limit, value=sign * value, standard_error=3 * error * deviation)

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


def tail_constraints(
    sample: OutputSample, bounds: tuple[QuantileBound, ...], limits: Limits, share: float
) -> tuple[OneSidedConstraint, ...]:
    """Return the constraints of a yield at what is compared with the limits, each with its local model.

    The side that decides moves as the excess beyond both limits does, the other one as its own quantile. A share of
    the units may fail [-].
    """
    furthest = max(bounds, key=lambda bound: bound.excess)
    asked = (limits if bound is furthest else limits.side(bound.sign) for bound in bounds)
    return tuple(_tail_constraint(sample, *own, share) for own in zip(bounds, asked, strict=True))


def _tail_constraint(sample: OutputSample, bound: QuantileBound, limits: Limits, share: float) -> OneSidedConstraint:
    excess, parts = bound.turned(sample.values) - bound.sign * bound.limit, sample.furthest(limits, share)
    beyond = float(np.count_nonzero(limits.excess(sample.values).max(axis=0) > excess))
    quantile = ExcessQuantile(
        name=_name_of(sample, bound.sign),
        design=sample.design,
        share=min(max(beyond, 0.5) / parts[0].units, 0.5),
        parts=parts,
    )
    batches = [quantile.batch(first, _BATCHES).gradient for first in range(_BATCHES)]
    by_excess = parts[0].deviation
    return _with_law(sample, bound, limits, quantile.gradient * by_excess, np.stack(batches) * by_excess, sample.law)


def _with_law(
    sample: OutputSample,
    bound: QuantileBound,
    limits: Limits,
    gradient: Float[np.ndarray, " variable"],
    batches: Float[np.ndarray, "batch variable"],
    law: LinearLaw | None,
) -> OneSidedConstraint:
    """Return a constraint with a gradient, that of the scales by the law where the output is linear."""
    excess, groups = bound.turned(sample.values) - bound.sign * bound.limit, sample.groups
    if law:
        gradient[:groups] = sample.units.space.by_scale(law.excess_by_zone(limits, excess))
        batches[:, :groups] = gradient[:groups]
    return OneSidedConstraint(
        sign=bound.sign,
        limit=bound.limit,
        value=bound.value,
        standard_error=bound.standard_error,
        scale=_scale_of(sample, bound.limit),
        stack=root_sum_square_stack(_name_of(sample, bound.sign), sample.design, excess, gradient, groups),
        batches=batches,
        law=law,
    )


def _moment_constraint(sample: OutputSample, bound: QuantileBound) -> OneSidedConstraint:
    """Return the constraint of mean + spread·σ at what is compared with one limit."""
    known, derivative = sample.derived()
    weights = bound.sign * spread_weights(bound.sign * sample.values, bound.sign * known, bound.turned(sample.values))
    split = (np.array_split(each, min(_BATCHES, weights.size)) for each in (weights, derivative))
    batches = np.stack([own @ slopes / own.size for own, slopes in zip(*split, strict=True)])
    limits = Limits(upper=bound.limit) if bound.sign > 0 else Limits(lower=bound.limit)
    # A law says how a quantile moves, and mean + spread·σ is one only where all is normal.
    law = sample.law if sample.law and sample.law.is_normal else None
    return _with_law(sample, bound, limits, weights @ derivative / weights.size, batches, law)


def spread_weights(
    values: Float[np.ndarray, " unit"], known: Float[np.ndarray, " known"], value: float
) -> Float[np.ndarray, " known"]:
    """Return by what the derivatives of known units count in that of mean + spread·σ of all units, a value.

    1 + spread·(y − mean)/σ [-], theory page, equation (24) (own derivation), exact for these units; all alike where
    nothing varies.

    Examples
    --------
    >>> spread_weights(np.array([-1.0, 1.0]), np.array([-2.0, 2.0]), 3.0).tolist()
    [-2.0, 4.0]
    """
    spread = (value - values.mean()) / values.std() if values.std() > 0 else 0.0
    return np.asarray(1.0 + spread * (known - known.mean()) / (known.std() or 1.0))


@dataclass(frozen=True, kw_only=True)
class WorstCase:
    """No unit inside its zones lies beyond a limit, as far as an ascent from many starts can tell."""

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return "worst case found"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Accept every number of units; none is asked."""

    def constraints(self, sample: OutputSample, limits: Limits) -> tuple[OneSidedConstraint, ...]:
        """Return every one-sided constraint, the upper one first."""
        return tuple(self._side(sample, sign, limit) for sign, limit in limits.turned)

    def _side(self, sample: OutputSample, sign: Literal[1, -1], limit: float) -> OneSidedConstraint:
        value, missed, gradient = sample.worst(sign)
        stack = worst_case_stack(
            _name_of(sample, sign), sample.design, sign * (value - limit), sign * gradient, sample.groups
        )
        return OneSidedConstraint(
            sign=sign,
            limit=limit,
            value=value,
            standard_error=missed,
            scale=_scale_of(sample, limit),
            stack=stack,
        )


@dataclass(frozen=True, kw_only=True)
class RootSumSquare:
    """Nominal value and root-sum-square of what every source adds at its limit, to first order, lie inside the limits.

    Notes
    -----
    The classical stack: √Σ(Dᵢtᵢ)² with the derivatives Dᵢ at nominal and tᵢ half the zone. It takes sizes and
    positions, needs no sample and knows neither distributions nor what the model bends, so the report shows the yield
    of random units beside it.
    """

    @property
    def words(self) -> str:
        """What must be shown, in words."""
        return "root-sum-square"

    def require_enough(self, units: int, confidence: float = CONFIDENCE) -> None:
        """Accept every number of units; none is asked."""

    def constraints(self, sample: OutputSample, limits: Limits) -> tuple[OneSidedConstraint, ...]:
        """Return every one-sided constraint, the upper one first."""
        value, locked, added, by_setting = sample.linear()
        spread = float(np.hypot(locked, np.linalg.norm(added)))
        scales, settings = sample.design[: sample.groups], sample.design[sample.groups :]
        return tuple(
            OneSidedConstraint(
                sign=sign,
                limit=limit,
                value=value + sign * spread,
                standard_error=0.0,
                scale=_scale_of(sample, limit),
                stack=Stack(
                    name=_name_of(sample, sign),
                    worst_case=np.zeros(sample.groups),
                    root_sum_square=added / scales,
                    # Locked zones take their part of the quadrature: the free ones may fill what it leaves.
                    budget=_left(sign * (limit - value), locked) + float(sign * by_setting @ settings),
                    slopes=sign * by_setting,
                ),
            )
            for sign, limit in limits.turned
        )


def _left(distance: float, locked: float) -> float:
    """Return what locked zones leave of the distance to a limit, less than nothing beyond it [unit of the output]."""
    return float(np.sqrt(max(distance**2 - locked**2, 0.0))) if distance > locked else distance - locked


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """Limits of an output and what must be shown of them."""

    stated_by: ClassVar[str] = "study"

    output: str  # Name of the output with its unit
    limits: Limits  # One or two limits [unit of the output]
    guarantee: Guarantee  # What must be shown

    @property
    def sentence(self) -> str:
        """The requirement in words."""
        ends = {"at least": self.limits.lower, "at most": self.limits.upper}
        said = " and ".join(f"{word} {self.told(end)}" for word, end in ends.items() if end is not None)
        asked = "must hold for" if isinstance(self.guarantee, AtYield) else "judged by"
        return f"{self.output}: {said}, {asked} {self.guarantee.words}"

    def told(self, limit: float) -> str:
        """Return one of its limits as it was stated [unit of the output]."""
        return f"{limit:g}"

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs of the model that it reads."""
        return (self.output,)

    def read(self, values: Mapping[str, Float[np.ndarray, " unit"]]) -> Float[np.ndarray, " unit"]:
        """Return what is limited, of the units whose outputs are given, NaN where a unit has none."""
        return values[self.output]

    def sample(self, units: DesignSample, confidence: float) -> OutputSample:
        """Return what units say of it."""
        return OutputSample(units=units, output=self.output, confidence=confidence)

    def in_force(self, model: Model) -> Requirement:  # noqa: ARG002
        """Return the requirement as a model has it at its settings; what a study states stays."""
        return self

    def controls(
        self,
        nearest: Mapping[str, NearPlane],
        planes: Mapping[str, Float[np.ndarray, " unit"]],
        *,
        relative: bool = False,
    ) -> tuple[ControlPlane, ...]:
        """Return the planes near what is limited.

        Parameters
        ----------
        nearest
            Output → plane near it.
        planes
            Output → what the plane says of every unit [unit of the output].
        relative
            Whether an excess is one over the limit.
        """
        if self.output not in nearest:
            return ()
        near, values = nearest[self.output], planes[self.output]
        return (ControlPlane(near=near, values=values, limits=self.limits, relative=relative),)

    def check(self, sample: OutputSample) -> Check:
        """Return how a design stands against the requirement."""
        return Check(requirement=self, constraints=self.guarantee.constraints(sample, self.limits))


@dataclass(frozen=True, kw_only=True)
class OwnLimit(Requirement):
    """An upper limit that the model has of its own, such as the pin force of the rated torque, which its settings move.

    Notes
    -----
    Every design is held to the limit at its own settings, solved there. The excess falls with a setting by the
    derivative of the limit, of central differences.
    """

    stated_by: ClassVar[str] = "model"

    def told(self, limit: float) -> str:
        """Return its limit, which nobody stated, as a result is read [unit of the output]."""
        return f"{limit:.4g}"

    def in_force(self, model: Model) -> OwnLimit:
        """Return the requirement with the limit at the settings of a model."""
        return replace(self, limits=Limits(upper=float(model.own_limits[self.output])))

    def sample(self, units: DesignSample, confidence: float) -> OutputSample:
        """Return what units say of the output above its limit."""
        return _OfOwnLimit(units=units, output=self.output, confidence=confidence)


@dataclass(frozen=True, kw_only=True)
class _OfOwnLimit(OutputSample):
    """What units say of an output whose limit moves with the settings."""

    @cached_property
    def _moved(self) -> Float[np.ndarray, " variable"]:
        """Change of the limit with every variable, by central differences [unit of the output]."""

        def limit(design: Float[np.ndarray, " variable"]) -> float:
            return float(self.units.at(design).own_limits[self.output])

        moved = np.zeros(self.design.size)
        for at, size in enumerate(self.units.space.setting_steps.tolist(), start=self.groups):
            step = size * (np.arange(moved.size) == at)
            moved[at] = (limit(self.design + step) - limit(self.design - step)) / (2 * size)
        return moved

    def derived(self) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return the output of some units and the derivative, by every variable, of its distance from the limit."""
        values, slopes = self.units.derived(self.output)
        return values, slopes - self._moved

    def slopes_at(self, rows: Int[np.ndarray, " few"]) -> Float[np.ndarray, "few variable"]:
        """Return the derivative of some units' distance from the limit by every variable, NaN without one."""
        return np.asarray(self.units.slopes_at(self.output, rows) - self._moved)


@dataclass(frozen=True, kw_only=True)
class Check:
    """How a verified design stands against one requirement."""

    requirement: Requirement  # The requirement
    constraints: tuple[OneSidedConstraint, ...]  # One for each of its limits, the upper one first
    # What a search keeps in their place, where more is asked of all requirements at once than of each alone
    tightened: tuple[OneSidedConstraint, ...] | None = None

    @property
    def steering(self) -> tuple[OneSidedConstraint, ...]:
        """The constraints that a search keeps."""
        return self.constraints if self.tightened is None else self.tightened

    @property
    def met(self) -> bool:
        """Whether the guarantee is shown."""
        return all(constraint.excess <= 0 for constraint in self.constraints)

    @property
    def tightest(self) -> OneSidedConstraint:
        """The side with the largest relative excess."""
        return max(self.constraints, key=lambda constraint: constraint.relative_excess)

    @property
    def slack(self) -> float:
        """What is left to the nearer limit, negative beyond it [unit of the output]."""
        return -max(constraint.excess for constraint in self.constraints)
