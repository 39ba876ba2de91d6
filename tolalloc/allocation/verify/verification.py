"""Verified designs: what random units on the real model, a new sample for each design, say of its requirements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.excess_quantile import ExcessQuantile
from tolalloc.allocation.space.joint_yield import JointCheck, divided, limited_by, tightened
from tolalloc.allocation.space.output_sample import DesignSample
from tolalloc.allocation.space.problem import OneSidedConstraint
from tolalloc.allocation.space.requirement import (
    USUAL_YIELD,
    AtYield,
    Check,
    Requirement,
    spread_weights,
    tail_constraints,
)
from tolalloc.allocation.space.tail import FEWEST_OF_TAIL, FurthestUnits
from tolalloc.allocation.verify.independent_sample import IndependentSample
from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.capability.linear_function import LinearLaw, NearPlane
from tolalloc.capability.monte_carlo import (
    ANY_LIMIT,
    CONFIDENCE,
    ProcessUncertainty,
    RedrawnUnits,
    Yield,
    largest_excess,
    proportion,
    require_few_failures,
)
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Model, is_fast

SLOPE_UNITS = 1024
"""Units that differences of an output without derivatives are averaged over [-]."""
DERIVATIVE_UNITS = 6144
"""Units of a fast model whose derivatives are averaged: they cost as much as many values, and err less [-]."""


@dataclass(frozen=True, kw_only=True)
class VerifiedDesign:
    """A design with the Monte Carlo run that verified it."""

    name: str  # Which search made it, and its number there
    space: DesignSpace  # The design variables
    design: Float[np.ndarray, " variable"]  # Scales [-] and settings
    processes: tuple[str, ...]  # Name of the process of every group
    cost: float  # Cost [cost units]
    # The units on the real model with the leading output, which the first requirement limits
    sample: RedrawnUnits
    achieved: Yield  # Yield within its limits
    checks: tuple[Check, ...]  # How the design stands against every requirement, the leading one first
    joint: Yield  # Share of units that keep the limits of all requirements
    # Outputs of all requirements of every unit, NaN where a unit has none
    outputs: dict[str, Float[np.ndarray, " unit"]]
    # Change of the leading output's value with the zone of each active source; none where the model does not know its
    # derivatives exactly [unit of the output per m]
    by_zone: Float[np.ndarray, " source"] | None
    # Change of the leading output with a deviation of each active source, `DesignSample.sensitivity`; none as above
    by_deviation: Float[np.ndarray, " source"] | None
    confidence: float  # With which the units show what is compared with the limits, one-sided [-]
    near: Mapping[str, NearPlane] = field(default_factory=dict)  # Output → plane that was found near it
    # Output → units that tell its tail, those beyond every limit
    furthest: Mapping[str, tuple[FurthestUnits, ...]] = field(default_factory=dict)
    # What is limited → what measured parts leave open of it; all limits at once under `ALL_LIMITS`
    uncertainties: Mapping[str, ProcessUncertainty] = field(default_factory=dict)
    independent: IndependentSample | None = None  # What tested it last, none if it was not tested
    accepted: bool = False  # Whether units that no search has seen showed every requirement, with the stated error
    # Cost before its zones and amounts were rounded to what the drawing states, none if they were not [cost units]
    unrounded_cost: float | None = None

    @property
    def scales(self) -> Float[np.ndarray, " group"]:
        """Scale of every group [-]."""
        return self.design[: len(self.space.groups)]

    @property
    def settings(self) -> Float[np.ndarray, " setting"]:
        """The settings [units of their names]."""
        return self.space.settings_of(self.design)

    @property
    def met(self) -> bool:
        """Whether every requirement is met, as far as these units tell."""
        return all(check.met for check in self.checks)

    def yield_of(self, requirement: Requirement, sign: int | None = None) -> Yield:
        """Return the share of units that keep the limits of a requirement, or one; one without an answer keeps none."""
        limits = requirement.limits.side(sign) if sign else requirement.limits
        outputs = self.independent.outputs if self.independent else self.outputs
        outside = np.logical_not(limits.kept_by(requirement.read(outputs)))
        if self.independent:
            found = self.independent.units.yield_of(outside)
        else:
            found = proportion(outside.size, int(np.count_nonzero(outside)))
        return found.widened_by(self.uncertainties.get(requirement.output), limits)

    @property
    def constraints(self) -> tuple[OneSidedConstraint, ...]:
        """One-sided constraints that a search keeps: of all requirements, tightened where they are kept at once."""
        return tuple(constraint for check in self.checks for constraint in check.steering)

    @cached_property
    def quantiles(self) -> tuple[ExcessQuantile, ...]:
        """What units say of every yield, also of other designs near by; of a yield of all limits that alone decides."""
        found, last = [], self.jointly
        if last:
            (verdict,), joint = last.constraints, self._quantile(last.requirement.output, self.checks_alone, last.joint)
            found.append(joint and joint.at_level(verdict.excess, verdict.standard_error, self.achieved.units))
        for check in self._alone_by_units:
            side = max(check.constraints, key=lambda own: own.excess)
            own = self._quantile(side.stack.name, (check,), check.requirement)
            found.append(own and own.at_excess(side.excess, side.standard_error))
        return tuple(own for own in found if own)

    @property
    def _alone_by_units(self) -> tuple[Check, ...]:
        """Checks of yields that units tell and that a yield of all limits does not keep already.

        A law tells more than units, but where a setting may move an output from one of its limits to the other.
        """
        joint, moves = self.jointly.joint.guarantee.target if self.jointly else 0.0, self.settings.size > 0
        asked = (own for own in self.checks_alone if asked_yield(own.requirement) > joint)
        return tuple(own for own in asked if not own.constraints[0].law or (moves and len(own.constraints) > 1))

    @property
    def beside_quantiles(self) -> tuple[OneSidedConstraint, ...]:
        """Constraints of what no units decide: exact laws, worst cases, moments."""
        if not self.quantiles:
            return self.constraints
        told = () if self.jointly is None else [own for own in self.checks_alone if asked_yield(own.requirement)]
        by_units = (*self._alone_by_units, *told)
        return tuple(side for check in self.checks_alone if check not in by_units for side in check.constraints)

    def _quantile(self, name: str, checks: Sequence[Check], asked: Requirement) -> ExcessQuantile | None:
        """Return the quantile of the largest excess over the limits of some checks, none where no unit moves it."""
        parts = tuple(part for own in checks for part in self.furthest[own.requirement.output])
        enough = len({*np.concatenate([own.rows for own in parts]).tolist()}) >= FEWEST_OF_TAIL
        share = 1 - getattr(asked.guarantee, "target", USUAL_YIELD)
        return ExcessQuantile(name=name, design=self.design, share=share, parts=parts) if enough else None

    @property
    def limited_sides(self) -> tuple[tuple[Check, OneSidedConstraint], ...]:
        """Every limited side as its requirement asks for it, with the requirement's check."""
        return tuple((check, constraint) for check in self.checks for constraint in check.constraints)

    @property
    def checks_alone(self) -> tuple[Check, ...]:
        """Checks of every requirement but that of all limits at once: what keeps all of them keeps each of them."""
        return tuple(check for check in self.checks if not isinstance(check, JointCheck))

    @property
    def alone(self) -> tuple[OneSidedConstraint, ...]:
        """One-sided constraints of every limit as if it were the only one."""
        return tuple(side for check in self.checks_alone for side in check.constraints)

    @property
    def laws(self) -> dict[str, LinearLaw]:
        """Law of every limited output that is linear, at the zones of the design."""
        zones = self.space.zones(self.design)
        found = {check.requirement.output: check.constraints[0].law for check in self.checks}
        return {output: replace(law, zones=zones) for output, law in found.items() if law}

    @property
    def nearest(self) -> dict[str, NearPlane]:
        """Plane near every output that one was found near, with its law at the zones of the design."""
        zones = self.space.zones(self.design)
        return {output: own.at(zones) for output, own in self.near.items()}

    @property
    def blocking(self) -> Check:
        """The limit with the largest relative excess; all limits at once only where each one alone is kept."""
        last = self.jointly
        found = max(self.checks_alone, key=lambda check: check.tightest.relative_excess)
        return last if last and found.tightest.excess <= 0 else found

    @property
    def quantile_bound(self) -> float:
        """What of the leading output is compared with its limit: at a yield, the smallest limit that is kept."""
        return self.checks[0].constraints[0].value

    def shown_at(self, target: float) -> float:
        """Return the smallest upper limit of the leading output that the units show kept at another yield.

        With the same confidence; infinite where they are too few [unit of the output].
        """
        if self.independent is None:
            return self.sample.quantile_bound(target, self.confidence)
        values = self.checks[0].requirement.read(self.independent.outputs)
        finite = np.where(np.isfinite(values), values, np.inf)
        return self.independent.units.kept_excess(finite, target, self.confidence)

    @property
    def spread(self) -> float:
        """Distance of what a search compares with its limit from the mean, over the standard deviation [-]."""
        values = self.sample.values
        return float((self.constraints[0].value - values.mean()) / values.std(ddof=1))

    @property
    def jointly(self) -> JointCheck | None:
        """How the design stands against all limits at once, none where that was not asked."""
        last = self.checks[-1]
        return last if isinstance(last, JointCheck) else None

    @property
    def parts(self) -> tuple[float, ...]:
        """Parts of the failures that a joint yield allows, one for each limited output; none without one [-]."""
        return self.jointly.joint.parts if self.jointly else ()

    def design_in(self, space: DesignSpace) -> Float[np.ndarray, " variable"]:
        """Return the design as a vector of another space of the same groups: its zones over those of that one."""
        return np.concatenate([self.space.first_zones * self.scales / space.first_zones, self.settings])

    def divided(self, parts: tuple[float, ...]) -> VerifiedDesign:
        """Return the design with those failures in other parts, as far as its tails tell."""
        return self if parts == self.parts else replace(self, checks=divided(self.checks, parts))

    def evenly_divided(self) -> VerifiedDesign:
        """Return the design with those failures divided as often as each limit fails."""
        return self.divided(self.jointly.parts_as_failing()) if self.jointly else self


@dataclass(frozen=True, kw_only=True)
class Verifier:
    """Verifies designs, each on random units of its own."""

    space: DesignSpace  # The design variables
    model: Model  # The real model
    requirements: tuple[Requirement, ...]  # What must be kept; the first one limits the leading output
    seeds: SeedTree  # Node of the seed tree; every verification takes its own child
    units: int  # Units per verification [-]
    # How many of them derivatives that the model does not know exactly are averaged over [-]
    slope_units: int = SLOPE_UNITS
    largest_failed_share: float = LARGEST_FAILED_SHARE  # Share of the units that may fail [-]
    confidence: float = CONFIDENCE  # With which guarantees must be shown, one-sided [-]

    def __post_init__(self) -> None:
        for requirement in self.requirements:
            requirement.guarantee.require_enough(self.units, self.confidence)

    @property
    def limit(self) -> float:
        """Limit of the leading output, the upper one of two [unit of the output]."""
        limits = self.requirements[0].limits
        return float(limits.upper if limits.upper is not None else limits.lower or 0.0)

    def dividing_as(self, design: VerifiedDesign) -> Verifier:
        """Return the verifier that divides the failures which a joint yield allows as a design does."""
        return replace(self, requirements=tuple(check.requirement for check in design.checks))

    def verify(self, design: Float[np.ndarray, " variable"], name: str) -> VerifiedDesign:
        """Return the design with what random units of its own say of it."""
        return self.judged(self.sampled(design, name), name)

    def _in_force(self, design: Float[np.ndarray, " variable"]) -> tuple[Requirement, ...]:
        """Return what must be kept as the model has it at the settings of a design."""
        model = self.model.at(self.space.settings_of(design))
        return tuple(own.in_force(model) for own in self.requirements)

    def sampled(self, design: Float[np.ndarray, " variable"], name: str) -> DesignSample:
        """Return random units of a design, others for every name."""
        seeds, errors, requirements = self.seeds.child(name), self.space.errors, self._in_force(design)
        outputs = tuple(dict.fromkeys(name for requirement in requirements for name in requirement.outputs))
        return DesignSample(
            space=self.space,
            model=self.model,
            design=design,
            standard=errors.standard_values(np.concatenate([*seeds.uniform_chunks(self.units, len(errors.columns))])),
            outputs=outputs,
            slope_units=self.slope_units,
            derivative_units=min(self.units, DERIVATIVE_UNITS) if is_fast(self.model) else self.units,
            seeds=seeds,
            tails={own.output: (own.limits, failing_share(own)) for own in requirements},
        )

    def judged(self, sample: DesignSample, name: str) -> VerifiedDesign:
        """Return a design with what random units say of it, also of those of a verifier that asks for other limits."""
        design, outputs, requirements = sample.design, sample.outputs, self._in_force(sample.design)
        for own in sample.samples:
            require_few_failures(own, "of a drawing that was tried", self.largest_failed_share)
        read = tuple(requirement.sample(sample, self.confidence) for requirement in requirements)
        checks = tightened(
            tuple(requirement.check(own) for requirement, own in zip(requirements, read, strict=True)),
            limited_by(sample),
            self.confidence,
            lambda check, bounds, at: tail_constraints(
                read[at], bounds, check.requirement.limits, failing_share(check.requirement)
            ),
        )
        values = {output: sample.values(output) for output in outputs}
        uncertainties = _uncertainties(sample, requirements, values)
        leading, every = requirements[0], uncertainties.get(ALL_LIMITS)
        kept = np.array([requirement.limits.kept_by(requirement.read(values)) for requirement in requirements])
        return VerifiedDesign(
            name=name,
            space=self.space,
            design=design,
            processes=self.space.process_names(design),
            cost=float(self.space.cost(design)),
            sample=RedrawnUnits(
                evaluation=sample.samples[0].evaluation,
                redraw=partial(self.space.units, design, sample.seeds, self.units),
            ),
            achieved=proportion(self.units, int(np.count_nonzero(~kept[0]))).widened_by(
                uncertainties.get(leading.output), leading.limits
            ),
            checks=checks,
            joint=proportion(self.units, int(np.count_nonzero(~kept.all(axis=0)))).widened_by(every, ANY_LIMIT),
            outputs=values,
            by_zone=_by_zone(sample, checks[0].constraints[0].value),
            by_deviation=sample.sensitivity(sample.outputs[0]) if sample.outputs[0] in sample.exact else None,
            confidence=self.confidence,
            near=sample.nearest,
            furthest={
                own.requirement.output: units.furthest(own.requirement.limits, failing_share(own.requirement))
                for own, units in zip(checks, read, strict=True)
                if not isinstance(own, JointCheck)
                and (asked_yield(own.requirement) or isinstance(checks[-1], JointCheck))
            },
            uncertainties=uncertainties,
        )


def failing_share(requirement: Requirement) -> float:
    """Return the share of units that may fail a requirement, the usual one where something else must be shown [-]."""
    return 1 - (asked_yield(requirement) or USUAL_YIELD)


def asked_yield(requirement: Requirement) -> float:
    """Return the share of units that must keep a requirement, zero where something else must be shown [-]."""
    return requirement.guarantee.target if isinstance(requirement.guarantee, AtYield) else 0.0


ALL_LIMITS = ""
"""Key of the process uncertainty of all limits at once."""


def _uncertainties(
    sample: DesignSample, requirements: tuple[Requirement, ...], values: Mapping[str, Float[np.ndarray, " unit"]]
) -> dict[str, ProcessUncertainty]:
    """Return what measured parts leave open of all that is limited, nothing where no part was measured."""
    uncertainty_of = ProcessUncertainty.about(sample.space.errors, sample.x)
    if uncertainty_of is None:
        return {}
    read = {own.output: own.read(values) for own in requirements}
    every = largest_excess(read, {own.output: own.limits for own in requirements})
    found = {name: uncertainty_of(own) for name, own in {**read, ALL_LIMITS: every}.items()}
    return {name: uncertainty for name, uncertainty in found.items() if uncertainty}


def _by_zone(sample: DesignSample, quantile: float) -> Float[np.ndarray, " source"] | None:
    """Return the change of mean + spread·σ of the leading output by the zones, theory page equation (24) [output/m]."""
    leading = sample.outputs[0]
    if leading not in sample.exact:
        return None
    exact, values = sample.exact[leading].evaluation, sample.samples[0].values
    known = exact.values[exact.good, 0]
    weights = spread_weights(values, known, min(quantile, float(values.max())))
    return np.asarray(weights @ sample.by_zone(leading) / known.size)


def cheapest_met(tried: tuple[VerifiedDesign, ...]) -> VerifiedDesign:
    """Return the cheapest met design, or the least violating one where none is met."""
    met = [design for design in tried if design.met]
    if met:
        return min(met, key=lambda design: design.cost)
    return min(tried, key=lambda design: design.blocking.tightest.relative_excess)
