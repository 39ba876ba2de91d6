"""A yield of all limits at once: the failures that it allows are divided among the limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.output_sample import (
    ControlPlane,
    ControlResiduals,
    DesignSample,
    LimitedSample,
    OutputSample,
)
from tolalloc.allocation.space.problem import OneSidedConstraint, Stack
from tolalloc.allocation.space.requirement import AtYield, Check, QuantileBound, Requirement
from tolalloc.capability.halving import halved
from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import LinearLaw, NearPlane
from tolalloc.capability.near_limit import largest_first
from tolalloc.models.model import Model

JOINT = "largest excess over all limits [-]"
"""What a yield of all limits at once limits: the excess over a limit, relative to it, below zero in a good unit."""
_LEAST_PART = 0.02
"""Part of the allowed failures that a limit keeps although nothing is gained by it [-]."""
_WIDER = 16.0
"""The slope of a tail is that of so many times the failures that are allowed, by units [-]."""
_WIDEST = 0.25
"""The same of all units, at most [-]."""
_NARROWER = 8.0
"""The slope of the tail of a law is its own down to the allowed failures over this [-]."""
_COUNTED = 30.0
"""Failing units that tell how many failures coincide; where fewer are allowed the limits are moved inwards [-]."""
_HALVINGS = 24
_EVEN_ODDS = 0.5


@dataclass(frozen=True, kw_only=True)
class JointRequirement(Requirement):
    """The limits of several requirements, which so many units keep all at once.

    Notes
    -----
    What is limited is the largest excess of a unit over any limit, relative to the limit, which is at most zero in a
    good unit. Where units tell it, a search follows these (`tolalloc.allocation.space.excess_quantile`); prices,
    bounds, grades and fronts keep every limit at the yield 1 − fᵢ of its part pᵢ of the failures,

    fᵢ = κ·(1 − target)·pᵢ, Σ pᵢ = 1,

    with κ = 1 where no failures coincide (Bonferroni's inequality); κ is above 1 by what coincides, which counts once,
    and below 1 by what the confidence of few units takes. With 99.73 % of two limits each is kept by 99.865 %.

    References
    ----------
    R. G. Miller, Simultaneous Statistical Inference, 2nd ed., Springer (1981), chapter 1.
    """

    guarantee: AtYield  # What must be shown
    requirements: tuple[Requirement, ...]  # Whose limits must be kept at once
    parts: tuple[float, ...]  # Part of the allowed failures of each of them, the sum is 1 [-]

    @classmethod
    def of(cls, requirements: tuple[Requirement, ...], shown: AtYield) -> JointRequirement:
        """Return the requirement that a share of the units keeps the limits of all others, in equal parts at first."""
        parts = (1 / len(requirements),) * len(requirements)
        return cls(output=JOINT, limits=Limits(upper=0.0), guarantee=shown, requirements=requirements, parts=parts)

    @property
    def failures(self) -> float:
        """Share of units that may fail [-]."""
        return 1 - self.guarantee.target

    @property
    def sentence(self) -> str:
        """The requirement in words."""
        return f"all limits at once, must hold for {self.guarantee.words}"

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs of the model that it reads."""
        return tuple(own.output for own in self.requirements)

    def read(self, values: Mapping[str, Float[np.ndarray, " unit"]]) -> Float[np.ndarray, " unit"]:
        """Return the largest excess of every unit [-]."""
        excesses = [own.limits.excess(values[own.output], relative=True) for own in self.requirements]
        return np.asarray(np.concatenate(excesses).max(axis=0))

    def controls(
        self,
        nearest: Mapping[str, NearPlane],
        planes: Mapping[str, Float[np.ndarray, " unit"]],
        *,
        relative: bool = True,  # noqa: ARG002
    ) -> tuple[ControlPlane, ...]:
        """Return the planes near all that is limited, with an excess over the limit."""
        return tuple(plane for own in self.requirements for plane in own.controls(nearest, planes, relative=True))

    def in_force(self, model: Model) -> JointRequirement:
        """Return the requirement with every limit as a model has it at its settings."""
        return replace(self, requirements=tuple(own.in_force(model) for own in self.requirements))

    def check(self, sample: OutputSample) -> Check:
        """Return whether all limits are kept at once; the search is steered by the limits."""
        values = self.read({own: sample.units.values(own) for own in self.outputs})
        controls = self.controls(sample.units.nearest, sample.units.planes)
        limited = LimitedSample.all_of(values, self.limits, None, controls, sample.units.uncertainty(values))
        (bound,) = self.guarantee.bounds(limited, sample.confidence)
        nothing, settings = np.zeros(sample.groups), np.zeros(sample.design.size - sample.groups)
        verdict = OneSidedConstraint(
            sign=bound.sign,
            limit=bound.limit,
            value=bound.value,
            standard_error=bound.standard_error,
            scale=1.0,
            stack=Stack(
                name=self.output, worst_case=nothing, root_sum_square=nothing, budget=-bound.excess, slopes=settings
            ),
        )
        return Check(requirement=self, constraints=(verdict,), tightened=())

    def share(self, at: int, overlap: float, wider: float = 1.0) -> float:
        """Return the share of units that may fail one limit, no more than it allows on its own [-].

        Parameters
        ----------
        at
            Position of the limit.
        overlap
            What coinciding failures leave, κ [-].
        wider
            Factor of all shares [-].
        """
        own = self.requirements[at].guarantee
        most = min(1 - own.target, self.failures) if isinstance(own, AtYield) else self.failures
        return wider * min(overlap * self.failures * self.parts[at], most)


@dataclass(frozen=True, kw_only=True)
class Tail:
    """Tail of an output: excess over its limit as a function of the failing share.

    Notes
    -----
    Of a linear output it is that of its law. Of any other e(f) = e(f₀) + s·(z(f) − z(f₀)), with z(f) = Φ⁻¹(1 − f) and
    the slope s of the outermost values over their normal scores; exact for a normal output, where s is its standard
    deviation. So the quantile of a smaller share is no less certain than that of f₀ (own derivation).
    """

    share: float  # f₀ [-]
    limits: Limits  # [unit of the output]
    bounds: tuple[QuantileBound, ...]  # What of each limit is left to so many failures, at even odds
    slope: float  # s, per normal score [unit of the output]
    error: float  # Standard error [unit of the output]
    law: LinearLaw | None = None  # Of the output where it is linear, which is then exact at every share
    margin: float = 0.0  # What measured parts leave open, by which a limit is kept further inside [unit of the output]

    @classmethod
    def of(cls, sample: LimitedSample, share: float) -> Tail:
        """Return the tail of units around a share of failures [-]."""
        margin = sample.uncertainty.margin(sample.limits, share) if sample.uncertainty else 0.0
        return replace(cls._counted(replace(sample, uncertainty=None), share), margin=margin)

    @classmethod
    def _counted(cls, sample: LimitedSample, share: float) -> Tail:
        """Return the tail for processes that are as their measured parts say."""
        from scipy.stats import norm

        limits, law = sample.limits, sample.law
        bounds = AtYield(1 - share).bounds(sample, _EVEN_ODDS)
        if law:
            scores = norm.isf(share / _NARROWER) - norm.isf(share)
            slope = max(law.excess(limits, share / _NARROWER) - law.excess(limits, share), 0.0) / float(scores)
            error = bounds[0].standard_error
            return cls(share=share, limits=limits, bounds=bounds, slope=slope, error=error, law=law)
        slope = _slope(sample, min(_WIDER * share, _WIDEST))
        counted = slope * share / norm.pdf(norm.isf(share)) / np.sqrt(share * sample.units.drawn.units)
        error = max(own.standard_error for own in bounds)
        error = error if sample.controls else max(error, float(counted))
        return cls(share=share, limits=limits, bounds=bounds, slope=slope, error=error)

    def extrapolation(self, share: float, before: float | None = None) -> float:
        """Return how much further out another share of failures is than one before it [unit of the output]."""
        from scipy.special import ndtri

        before = self.share if before is None else before
        if self.law:
            return self.law.excess(self.limits, share) - self.law.excess(self.limits, before)
        return self.slope * float(ndtri(before) - ndtri(share))

    def share_at(self, excess: float, before: float) -> float:
        """Return the failing share where another one lies so far beyond the limits [unit of the output] [-]."""
        from scipy.special import ndtr, ndtri

        if self.law:
            return self.law.beyond(self.limits, self.law.excess(self.limits, before) - excess)
        return float(ndtr(ndtri(before) + excess / self.slope)) if self.slope > 0 else float(excess > 0)

    def excess(self, share: float) -> float:
        """Return how far beyond the limits a share of the units lies further out than [unit of the output]."""
        return max(own.excess for own in self.bounds) + self.extrapolation(share)

    @property
    def failing_share(self) -> float:
        """Share of units that fail the limits [-]."""
        from scipy.special import ndtr, ndtri

        if self.law:
            return self.law.beyond(self.limits, 0.0)
        beyond = max(own.excess for own in self.bounds)
        if not (np.isfinite(beyond) and self.slope > 0):
            return float(beyond > 0)
        return float(ndtr(ndtri(self.share) + beyond / self.slope))

    def bounds_at(self, share: float, relative_error: float = 0.0) -> tuple[QuantileBound, ...]:
        """Return what of each limit is left to a share of failures, which has a relative standard error [-]."""
        by = self.extrapolation(share)
        by_share = self.extrapolation(share * max(1 - relative_error, _LEAST_PART), share) if relative_error else 0.0
        error = float(np.hypot(self.error, by_share))
        return tuple(replace(own.moved_out(by + self.margin), standard_error=error) for own in self.bounds)


def _slope(sample: LimitedSample, share: float) -> float:
    """Return the slope of the outermost values, a share of the units, over their normal scores [unit of the output]."""
    from scipy.stats import norm

    excess, stand_for = sample.excess, sample.units.stand_for
    drawn = float(stand_for.sum())
    outermost = largest_first(excess, min(excess.size, int(share * drawn) + 1))
    beyond = (np.cumsum(stand_for[outermost]) - stand_for[outermost] / 2) / drawn
    kept = (beyond <= share) & np.isfinite(excess[outermost])
    if np.count_nonzero(kept) < 3:
        return 0.0
    scores, values, weights = norm.isf(beyond[kept]), excess[outermost][kept], stand_for[outermost][kept]
    scores -= np.average(scores, weights=weights)
    return max(float((weights * scores) @ values / ((weights * scores) @ scores)), 0.0)


def _overlap(
    joint: JointRequirement, tails: Sequence[Tail], samples: Sequence[LimitedSample], confidence: float
) -> float:
    """Return κ: by what the parts of the failures may be larger for no more units than are allowed to fail in all [-].

    Notes
    -----
    The largest κ with no more units beyond any eᵢ(fᵢ) than may be; by halving, in 24 steps.
    """
    units, excesses = samples[0].units, np.stack([own.excess for own in samples])
    allowed, drawn = units.drawn.allowed(joint.guarantee.target, confidence), float(units.drawn.units)
    weights = units.weights if confidence > _EVEN_ODDS else units.stand_for
    wider = max(1.0, min(_COUNTED / drawn, _WIDEST) / joint.failures)
    if wider > 1.0:
        weights = units.stand_for
    room = max(allowed, 0.5) if wider == 1.0 else wider * joint.failures * drawn

    def beyond(overlap: float) -> Bool[np.ndarray, " unit"]:
        limits = [tail.excess(joint.share(at, overlap, wider)) for at, tail in enumerate(tails)]
        return np.asarray((excesses > np.array(limits)[:, np.newaxis]).any(axis=0))

    counted = beyond(_most_overlap(joint))
    excesses, weights = excesses[:, counted], weights[counted]
    found = _largest_overlap(joint, lambda overlap: weights[beyond(overlap)].sum() <= room)
    return found * (1.0 if wider == 1.0 else max(allowed, 0.5) / (joint.failures * drawn))


def _most_overlap(joint: JointRequirement) -> float:
    """Return κ with which a limit may take all failures [-]."""
    return float(np.exp(np.log(1 / min(joint.parts))))


def _largest_overlap(joint: JointRequirement, holds: Callable[[float], bool]) -> float:
    """Return the largest κ for which something holds, by halving its logarithm [-]."""
    if holds(_most_overlap(joint)):
        return _most_overlap(joint)
    low, high = np.log(_LEAST_PART), np.log(1 / min(joint.parts))
    return float(np.exp(halved(lambda by: holds(float(np.exp(by))), low, high, _HALVINGS)))


def _controlled_overlap(
    joint: JointRequirement, tails: Sequence[Tail], samples: Sequence[LimitedSample], confidence: float
) -> tuple[float, float]:
    """Return κ and its relative standard error where planes are known near outputs [-].

    Notes
    -----
    Σ fᵢ of what is linear is exact, and units tell by how much fewer fail, since some fail two limits, and what fails
    beside it (`ControlResiduals`): κ is the largest with which no more than is allowed is shown; by 24 halvings.
    """
    furthest = [tail.excess(joint.share(at, _most_overlap(joint))) for at, tail in enumerate(tails)]
    counted = np.zeros(samples[0].values.size, bool)
    for own, limit in zip(samples, furthest, strict=True):
        counted |= own.excess > limit
        for plane in own.controls:
            counted |= plane.excess > limit
    excesses = [own.excess[counted] for own in samples]
    planes = [[plane.excess[counted] for plane in own.controls] for own in samples]

    def residuals(overlap: float) -> ControlResiduals:
        fails, called, by_law = np.zeros(excesses[0].size, bool), np.zeros(excesses[0].size, int), 0.0
        for at, (tail, own) in enumerate(zip(tails, samples, strict=True)):
            limit = tail.excess(joint.share(at, overlap))
            fails |= excesses[at] > limit
            for plane, of_unit in zip(own.controls, planes[at], strict=True):
                called += of_unit > limit
                by_law += plane.share(limit)
        return ControlResiduals.among(fails, called, by_law, counted.size)

    found = _largest_overlap(joint, lambda overlap: residuals(overlap).share(confidence) <= joint.failures)
    return found, residuals(found).standard_error / joint.failures


Modelled = Callable[[Check, tuple[QuantileBound, ...], int], tuple[OneSidedConstraint, ...]]
"""Makes of a check, what is compared with its limits and its position the constraints with their models."""


@dataclass(frozen=True, kw_only=True)
class JointCheck(Check):
    """How a design stands against all limits at once, and what each limit is left of the failures."""

    tails: tuple[Tail, ...]  # Of every limit
    overlap: float  # κ [-]

    @property
    def joint(self) -> JointRequirement:
        """The requirement."""
        assert isinstance(self.requirement, JointRequirement)
        return self.requirement

    @property
    def shares(self) -> tuple[float, ...]:
        """Share of units that may fail each limit [-]."""
        return tuple(self.joint.share(at, self.overlap) for at in range(len(self.tails)))

    def parts_as_failing(self) -> tuple[float, ...]:
        """Return the parts of the failures at which no limit is tighter than another: as often as each one fails.

        pᵢ ∝ P(eᵢ > 0) by the tail of the output (own derivation): so all limits are reached by one factor of all zones.
        One that hardly fails keeps 2 %.
        """
        failing = np.array([tail.failing_share for tail in self.tails])
        if not failing.sum() > 0:
            return self.joint.parts
        parts = np.maximum(failing / failing.sum(), _LEAST_PART)
        return tuple((parts / parts.sum()).tolist())


def tightened(
    checks: tuple[Check, ...], samples: Callable[[Requirement], LimitedSample], confidence: float, modelled: Modelled
) -> tuple[Check, ...]:
    """Return checks whose limits leave so few failures that all limits are kept at once by as many units as asked.

    Parameters
    ----------
    checks
        How a design stands against its requirements; as they are without a joint one, which is the last.
    samples
        What the units say of a requirement.
    confidence
        With which the joint yield is read, one-sided [-].
    modelled
        Makes the constraints.
    """
    *own, last = checks
    joint = last.requirement
    if not isinstance(joint, JointRequirement):
        return checks
    limited = [samples(check.requirement) for check in own]
    tails = tuple(Tail.of(sample, joint.failures) for sample in limited)
    if any(sample.controls for sample in limited):
        overlap, relative_error = _controlled_overlap(joint, tails, limited, confidence)
    else:
        overlap, relative_error = _overlap(joint, tails, limited, confidence), 0.0
    found = JointCheck(requirement=joint, constraints=last.constraints, tightened=(), tails=tails, overlap=overlap)
    steered = []
    for at, (check, tail, share) in enumerate(zip(own, tails, found.shares, strict=True)):
        steered.append(
            replace(check, tightened=(*_apart(check), *modelled(check, tail.bounds_at(share, relative_error), at)))
        )
    return (*steered, found)


def _apart(check: Check) -> tuple[OneSidedConstraint, ...]:
    """Return what a limit asks for beside a yield."""
    return () if isinstance(check.requirement.guarantee, AtYield) else check.constraints


def divided(checks: tuple[Check, ...], parts: tuple[float, ...]) -> tuple[Check, ...]:
    """Return checks with the failures divided otherwise, each limit moved along the tail of its output."""
    *own, last = checks
    if not isinstance(last, JointCheck):
        return checks
    found = replace(last, requirement=replace(last.joint, parts=parts))
    moved = []
    for check, tail, before, share in zip(own, last.tails, last.shares, found.shares, strict=True):
        by, apart = tail.extrapolation(share, before), len(_apart(check))
        moved.append(
            replace(
                check, tightened=(*check.steering[:apart], *(_moved_out(side, by) for side in check.steering[apart:]))
            )
        )
    return (*moved, found)


def _moved_out(side: OneSidedConstraint, by: float) -> OneSidedConstraint:
    """Return a constraint whose value lies further out."""
    stack = replace(side.stack, budget=side.stack.budget - by)
    return replace(side, value=side.value + side.sign * by, stack=stack)


def limited_by(sample: DesignSample) -> Callable[[Requirement], LimitedSample]:
    """Return a reader that gives, for a requirement, the sample it is judged on."""

    def read(requirement: Requirement) -> LimitedSample:
        values = requirement.read({own: sample.values(own) for own in requirement.outputs})
        controls = requirement.controls(sample.nearest, sample.planes)
        law, uncertainty = sample.laws.get(requirement.output), sample.uncertainty(values)
        return LimitedSample.all_of(values, requirement.limits, law, controls, uncertainty)

    return read
