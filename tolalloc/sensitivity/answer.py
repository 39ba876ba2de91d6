"""What drives a model's outputs, and how sure that is: the answer to a ranking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import MonteCarlo, OneSided
from tolalloc.capability.yield_at_limit import YieldAtLimit
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SamplingDesign
from tolalloc.models.model import KeepsTables, Model
from tolalloc.reading.units import unit_of
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.wording import sign_of
from tolalloc.running.blas import one_blas_thread
from tolalloc.running.progress import RunRecord
from tolalloc.sensitivity.derivatives import (
    ClassicalEstimate,
    DerivativeMeasures,
    LocalDerivatives,
    classical_estimate,
    derivative_measures,
    local_derivatives,
)
from tolalloc.sensitivity.driver_tables import ranking_table
from tolalloc.sensitivity.inverse import InverseSensitivity
from tolalloc.sensitivity.limit_tables import capability_table, inverse_table, reject_table
from tolalloc.sensitivity.measures import Measures
from tolalloc.sensitivity.ranking import Replication
from tolalloc.sensitivity.screening import ElementaryEffects, MomentIndependent, elementary_effects
from tolalloc.sensitivity.sections import driver_sections, limit_sections, trust_sections
from tolalloc.sensitivity.sentences import assumptions, sentences, summary, warnings
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.sensitivity.sobol import OrderContribution, SobolAnalysis, SobolIndices, order_contribution
from tolalloc.sensitivity.surrogate.validation import Choice
from tolalloc.sensitivity.target import TargetSensitivity
from tolalloc.sensitivity.uncertain import UncertainEffect

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class RankingAnswer(Answer):
    """What drives a model's outputs, and how sure that is."""

    kind: ClassVar[str] = "ranking"
    shown: ClassVar[tuple[str, ...]] = (
        *("source", "contribution [%]", "total index ST [-]", "ST low 5 % [-]", "ST high 95 % [-]"),
    )

    model: Model  # What answered
    errors: ErrorModel  # Sources, their distributions and correlations
    limits: Mapping[str, Limits]  # Output → limits; the first one leads
    target: float  # Share of units that must keep a limit [-]
    outputs: tuple[str, ...]  # Names of all outputs, in the order of the sample's columns, the leading one first
    # Random units with all these outputs, and how they are spread
    sample: MonteCarlo
    design: SamplingDesign
    sobol: SobolAnalysis  # Indices of these outputs and of the waves of the model's spectra
    # Indices of the leading output by the dimensions of the drawing; none where each dimension is one source
    dimensions: SobolIndices | None
    replication: Replication  # How much of the ranking a second seed has shown
    orders: OrderContribution | None  # What each source adds to each order; none for a model without spectra
    # What not knowing the model itself does to the leading output; none where all of it is known
    effect: UncertainEffect | None
    shapley: ShapleyEffects | None  # Effects of correlated sources; none where all are independent
    classical: ClassicalEstimate  # What a hand calculation says
    # Derivatives by each source, and what they bound
    local: LocalDerivatives
    derivatives: DerivativeMeasures
    # Measures beside Sobol's
    effects: ElementaryEffects
    moments: MomentIndependent
    reject: TargetSensitivity  # What drives the units out of the limits
    inverse: InverseSensitivity  # How far each zone may open alone
    beyond: YieldAtLimit  # Probability of a leading output beyond its limits
    choice: Choice  # Stand-ins for the model with their errors

    @property
    def leading(self) -> str:
        """Name of the leading output with its unit."""
        return self.outputs[0]

    @property
    def spoken(self) -> str:
        """What a sentence calls the leading output."""
        return portrait_of(self.model).spoken(self.leading)

    @property
    def unit(self) -> str:
        """Unit of the leading output."""
        return unit_of(self.leading)

    @property
    def sign(self) -> str:
        """What follows a number of the leading output."""
        return sign_of(self.unit)

    @property
    def wave_unit(self) -> str:
        """Unit of the waves of the model's spectra."""
        return unit_of(next(iter(self.model.spectra.values()))[0])

    @cached_property
    def indices(self) -> SobolIndices:
        """Sobol indices of the leading output."""
        return self.sobol.of(self.leading)

    @cached_property
    def one_sided(self) -> OneSided:
        """The leading output against its limits."""
        return OneSided(response=self.model.reading((self.leading,)), limits=self.limits[self.leading])

    @property
    def limit_spoken(self) -> str:
        """What a sentence calls the limits of the leading output."""
        limits = self.limits[self.leading]
        if limits.lower is None:
            return f"{limits.upper:g}{self.sign}"
        if limits.upper is None:
            return f"the lower limit of {limits.lower:g}{self.sign}"
        return f"{limits.lower:g} to {limits.upper:g}{self.sign}"

    @property
    def title(self) -> str:
        """Which model, in which study."""
        return f"What drives {self.header.model}: {self.header.name}"

    @property
    def subtitle(self) -> str:
        """Sources, conditions and seed."""
        conditions = (super().subtitle,) if self.header.conditions else ()
        return ", ".join((f"{len(self.errors.active)} sources", *conditions, f"seed {self.header.seed}"))

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """Who drives the leading output, each order and the units out of the limits."""
        return sentences(self)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on the answer."""
        return warnings(self)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Drivers, limits, and what the answer rests on."""
        return (*driver_sections(self), *limit_sections(self), *trust_sections(self))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        return assumptions(self)

    @cached_property
    def ranking(self) -> pd.DataFrame:
        """The ranking of the leading output."""
        return ranking_table(self)

    @cached_property
    def requirements(self) -> pd.DataFrame:
        """Every output with its distribution, capability and yield."""
        return capability_table(self)

    @cached_property
    def rejects(self) -> pd.DataFrame:
        """What the units outside have in common."""
        return reject_table(self)

    @cached_property
    def alone(self) -> pd.DataFrame:
        """How far each zone may open alone."""
        return inverse_table(self)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        return summary(self)


def rank(asked: Measures, record: RunRecord, header: Header) -> RankingAnswer:
    """Return what drives the outputs of a model at the zones of its drawing.

    Parameters
    ----------
    asked
        What may be measured.
    record
        Keeps statuses and times.
    header
        Name, seed and digest of the study; model, conditions, statuses and stages are filled in here.

    Raises
    ------
    InputError, UnknownNameError
        What is not allowed.
    SolveError
        Too many units failed.
    """
    measures, model, effort = replace(asked, model=asked.model.observed(record.observe)), asked.model, asked.effort
    leading, spectra, own = measures.leading, model.spectra, measures.experiment
    with one_blas_thread():
        with record.stage("random units"):
            sample = measures.sample()
        with record.stage("Sobol indices"):
            effect = measures.uncertain(sample)
            sobol = measures.sobol(tuple(name for names in spectra.values() for name in names))
            dimensions = measures.dimensions(sobol.convergence.history[-1].blocks)
        with record.stage("Sobol, second seed"):
            again = measures.second_seed(sobol.convergence.history[-1].blocks)
        with record.stage("other measures"):
            derived = measures.derived(sample)
            shapley = measures.shapley()
            local = local_derivatives(own("local", derived), effort.derivative_units)
            derivatives = derivative_measures(own("derivatives", derived), effort.derivative_units)
            effects = elementary_effects(own("effects", measures.response), effort.trajectories)
            moments = measures.moments(sample)
            classical = classical_estimate(own("classical", measures.response))
        with record.stage("units out of the limit"):
            reject, beyond = measures.reject(sample), measures.beyond(sample)
        with record.stage("surrogates"):
            choice = measures.choice(sample)
        with record.stage("zones alone"):
            inverse = measures.inverse(choice)
            if isinstance(choice.chosen, KeepsTables):
                choice.chosen.put_away()
    return RankingAnswer(
        header=replace(
            header,
            model=model.name,
            conditions=model.conditions,
            assumptions=(*dict.fromkeys((*portrait_of(model).assumptions, *header.assumptions)),),
            statuses=record.counts,
            stages=record.stages,
        ),
        model=model,
        errors=asked.errors,
        limits=asked.limits,
        target=asked.target,
        outputs=measures.outputs,
        sample=sample,
        design=effort.design,
        sobol=sobol,
        dimensions=dimensions,
        replication=sobol.of(leading).replicated_by(again),
        orders=order_contribution(sobol, spectra) if spectra else None,
        effect=effect,
        shapley=shapley,
        classical=classical,
        local=local,
        derivatives=derivatives,
        effects=effects,
        moments=moments,
        reject=reject,
        inverse=inverse,
        beyond=beyond,
        choice=choice,
    )
