"""What drives a model's outputs, and how sure that is: the numbers behind a ranking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tolalloc.capability.indices import Capability, Interval, Limits, capability, quantile_interval
from tolalloc.capability.monte_carlo import MonteCarlo, OneSided, ProcessUncertainty, UncertaintyOf, Yield, kept_at_once
from tolalloc.capability.yield_at_limit import YieldAtLimit
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SamplingDesign
from tolalloc.drawings.sources import Source
from tolalloc.models.model import Model
from tolalloc.sensitivity.centring import Centring
from tolalloc.sensitivity.derivatives import ClassicalEstimate, LocalDerivatives
from tolalloc.sensitivity.effort import BY_SOURCE
from tolalloc.sensitivity.inverse import InverseSensitivity
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.sensitivity.sobol import OrderContribution, SalibArrays, SobolAnalysis, SourceIndices
from tolalloc.sensitivity.surrogate.validation import Choice
from tolalloc.sensitivity.target import TargetSensitivity
from tolalloc.sensitivity.uncertain import UncertainEffect


@dataclass(frozen=True, kw_only=True)
class OutputCapability:
    """One output of the random units: its distribution, and where it is limited its capability and yield."""

    output: str  # Its name with its unit
    # Mean, standard deviation, smallest and largest value of the good units [output]
    mean: float
    deviation: float
    least: float
    most: float
    quantile: Interval  # Quantile at the target yield with its 95 % interval [output]
    limits: Limits | None  # Its limits, if it has any [output]
    inside: Yield | None  # Share that keeps them; units without an answer count as outside
    capability: Capability | None  # Indices; none without limits, or where the output does not vary


@dataclass(frozen=True, kw_only=True)
class RankingResult:
    """What drives a model's outputs, and how sure that is."""

    model: Model  # What answered
    errors: ErrorModel  # Sources, their distributions and correlations
    limits: Mapping[str, Limits]  # Output → limits; the first one leads
    first_limited: str  # Output that the study limits first
    target: float  # Share of units that must keep a limit [-]
    outputs: tuple[str, ...]  # Names of all outputs, in the order of the sample's columns, the leading one first
    # Random units with all these outputs, and how they are spread
    sample: MonteCarlo
    design: SamplingDesign
    sobol: SobolAnalysis  # Indices of these outputs and of the waves of the model's spectra
    by: str  # What is ranked: dimensions of the drawing, or each source alone
    orders: OrderContribution | None  # What each source adds to each order; none for a model without spectra
    # What not knowing the model itself does to the leading output; none where all of it is known
    effect: UncertainEffect | None
    shapley: ShapleyEffects | None  # Effects of correlated sources; none where all are independent
    classical: ClassicalEstimate  # What a hand calculation says
    local: LocalDerivatives  # Derivatives by each source
    centring: Centring | None  # Nominal that would put the leading output into the middle of its limits
    reject: TargetSensitivity  # What drives the units out of the limits
    inverse: InverseSensitivity  # How far each zone may open alone
    beyond: YieldAtLimit  # Probability of a leading output beyond its limits
    choice: Choice  # Surrogates of the model with their errors

    @property
    def leading(self) -> str:
        """Name of the leading output with its unit."""
        return self.outputs[0]

    @cached_property
    def indices(self) -> SourceIndices:
        """Sobol indices of the leading output."""
        return self.sobol.of(self.leading)

    @cached_property
    def members(self) -> dict[str, tuple[Source, ...]]:
        """What is ranked → the sources of the drawing in it; none of what is uncertain of the model."""
        found = dict[str, tuple[Source, ...]]()
        for own in self.errors.active:
            name = own.name if self.by == BY_SOURCE else own.dimension
            found[name] = (*found.get(name, ()), own)
        return {
            joined: tuple(own for name in joined.split(" + ") for own in found.get(name, ()))
            for joined in self.sobol.sources
        }

    @cached_property
    def share_of_source(self) -> dict[str, float]:
        """Source → its part of the sum of the leading output's total indices, a dimension's in equal parts [-]."""
        shares = self.indices.total / self.indices.total.sum()
        found = zip(self.indices.sources, shares.tolist(), strict=True)
        return {own.name: share / len(self.members[name]) for name, share in found for own in self.members[name]}

    @cached_property
    def one_sided(self) -> OneSided:
        """The leading output against its limits."""
        return OneSided(response=self.model.reading((self.leading,)), limits=self.limits[self.leading])

    def to_salib(self) -> SalibArrays:
        """Return problem, samples and leading output of the Sobol indices for SALib's own analysis and plots.

        That analysis gives the indices before a control variate corrects them.
        """
        return self.sobol.to_salib()

    @cached_property
    def capabilities(self) -> tuple[OutputCapability, ...]:
        """Every output with its distribution, capability and yield."""
        return tuple(self._capability(at, output) for at, output in enumerate(self.outputs))

    @cached_property
    def yields(self) -> dict[str, Yield]:
        """Limited output → share of the random units that keep its limits, the leading one first."""
        return {own.output: own.inside for own in self.capabilities if own.inside}

    @cached_property
    def joint(self) -> Yield:
        """Share of the random units that keep all limits at once; one without an answer keeps none."""
        return kept_at_once(self.sample.evaluation, self.outputs, self.limits, self._uncertainty_of)

    @property
    def _uncertainty_of(self) -> UncertaintyOf | None:
        return ProcessUncertainty.about(self.errors, self.sample.x)

    def _capability(self, at: int, output: str) -> OutputCapability:
        evaluation, limits = self.sample.evaluation, self.limits.get(output)
        values = evaluation.values[evaluation.good, at]
        return OutputCapability(
            output=output,
            mean=float(values.mean()),
            deviation=float(values.std(ddof=1)),
            least=float(values.min()),
            most=float(values.max()),
            quantile=quantile_interval(values, self.target),
            limits=limits,
            inside=kept_at_once(evaluation, self.outputs, {output: limits}, self._uncertainty_of) if limits else None,
            capability=capability(values, limits) if limits and np.ptp(values) > 0 else None,
        )
