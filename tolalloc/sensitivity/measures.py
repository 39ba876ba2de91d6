"""What drives the outputs of any model: every measure on the same zones, with random numbers of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from tolalloc.capability.experiment import Experiment, Given
from tolalloc.capability.indices import Limits
from tolalloc.capability.limit_state import ResponseLimit
from tolalloc.capability.monte_carlo import MonteCarlo, OneSided, deciding, monte_carlo
from tolalloc.capability.yield_at_limit import YieldAtLimit, yield_at_limit
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import KeepsTables, Model, Response, derived
from tolalloc.running.chunks import one_blas_thread
from tolalloc.running.progress import RunRecord
from tolalloc.sensitivity.centring import centring
from tolalloc.sensitivity.derivatives import classical_estimate, local_derivatives
from tolalloc.sensitivity.effort import BY_DIMENSION, BY_SOURCE, RankingEffort
from tolalloc.sensitivity.inverse import InverseSensitivity, fewest_units, inverse_sensitivity
from tolalloc.sensitivity.result import RankingResult
from tolalloc.sensitivity.shapley import ShapleyEffects, shapley_effects
from tolalloc.sensitivity.sobol import SobolAnalysis, order_contribution, sobol_indices
from tolalloc.sensitivity.surrogate.control_variate import MOST_CONTROLLED, cheap_model
from tolalloc.sensitivity.surrogate.regression import (
    Regression,
    RegressionCandidate,
    linear_regression,
    quadratic_regression,
    sparse_quadratic_regression,
)
from tolalloc.sensitivity.surrogate.validation import Candidate, Choice, choose
from tolalloc.sensitivity.target import TargetSensitivity, target_sensitivity
from tolalloc.sensitivity.uncertain import UncertainEffect, uncertain_effect

_MOST_COLUMNS = 100
"""Columns beyond which all products of two are more than the samples can tell apart [-]."""


@dataclass(frozen=True, kw_only=True)
class Measures:
    """What may be measured of a model at the zones of its drawing."""

    model: Model  # What answers, observed
    errors: ErrorModel  # Sources of the drawing
    # Output → limits; measures of one output are of the first one, unless most units miss another
    limits: Mapping[str, Limits]
    target: float  # Share of units that must keep the limits [-]
    effort: RankingEffort  # How much may be computed
    seeds: SeedTree  # Node of the seed tree
    largest_failed_share: float  # Share of units that may fail [-]
    by: str = BY_DIMENSION  # What is ranked: dimensions of the drawing, or each source alone

    @property
    def leading(self) -> str:
        """Name of the leading output with its unit."""
        return next(iter(self.limits))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs of the model that are ranked or limited, the leading one first."""
        asked = {*self.model.ranked, *self.limits} - {self.leading}
        return (self.leading, *(name for name in self.model.outputs if name in asked))

    @cached_property
    def response(self) -> Response:
        """The leading output."""
        return self.model.reading((self.leading,))

    @cached_property
    def one_sided(self) -> OneSided:
        """The leading output against its limits."""
        return OneSided(response=self.response, limits=self.limits[self.leading])

    def experiment(self, name: str, response: Given, errors: ErrorModel | None = None) -> Experiment[Given]:
        """Return the experiment of one measure."""
        return Experiment.of(response, errors or self.errors, self.seeds.child(name), self.largest_failed_share)

    def sample(self) -> MonteCarlo:
        """Return random units with all outputs."""
        units = self.experiment("units", self.model.reading(self.outputs))
        return monte_carlo(units, self.effort.units, self.effort.design)

    def led_by(self, sample: MonteCarlo) -> tuple[Measures, MonteCarlo]:
        """Return the same with the limit first that decides, and a sample with its output first.

        A limit that the model has of its own never leads.
        """
        values, own = sample.evaluation.values, self.model.own_limits
        beyond = {
            output: limits.outside(values[:, self.outputs.index(output)]) / len(values)
            for output, limits in self.limits.items()
            if output == self.leading or output not in own
        }
        if (worst := deciding(beyond)) == self.leading:
            return self, sample
        led = replace(self, limits={worst: self.limits[worst], **self.limits})
        order = [self.outputs.index(name) for name in led.outputs]
        return led, replace(sample, evaluation=replace(sample.evaluation, values=values[:, order]))

    def cheap(self, sample: MonteCarlo) -> Regression | None:
        """Return what carries most of a Sobol analysis, learnt from random units; none where the model is as cheap."""
        if self.effort.sobol.start > MOST_CONTROLLED:
            return None
        return cheap_model(sample, self.model.columns, self.outputs)

    def sobol(self, waves: tuple[str, ...], cheap: Regression | None = None) -> SobolAnalysis:
        """Return the indices of all outputs and of waves of the model's spectra, with as many blocks as are needed.

        What is uncertain of the model is among what is ranked. Blocks are added for the order of what drives the
        leading output, so that alone is asked for in those after the first number.
        """
        joint = replace(self.errors, joint=self.model.uncertain) if self.model.uncertain else self.errors
        return sobol_indices(
            self.experiment("sobol", self._with_uncertain((*self.outputs, *waves)), joint),
            self.effort.sobol,
            ranked=tuple(self.limits),
            factor_groups=joint.block_of_column if self.by == BY_SOURCE else joint.dimension_of_column,
            further=self._with_uncertain,
            cheap=cheap,
        )

    def _with_uncertain(self, outputs: tuple[str, ...]) -> Response:
        return self.model.with_uncertain(outputs) if self.model.uncertain else self.model.reading(outputs)

    def uncertain(self, sample: MonteCarlo) -> UncertainEffect | None:
        """Return what not knowing the model itself does to the leading output; none where all of it is known."""
        if not self.model.uncertain:
            return None
        return uncertain_effect(
            self.model, self.leading, sample.x[sample.evaluation.good], self.seeds.child("uncertain")
        )

    def shapley(self) -> ShapleyEffects | None:
        """Return the shares of correlated sources; none where all are independent, or some are sorted together."""
        if not self.errors.is_correlated or self.errors.compensators:
            return None
        return shapley_effects(self.experiment("shapley", self.response), self.effort.permutations)

    def reject(self, sample: MonteCarlo) -> TargetSensitivity:
        """Return what the units of a sample beyond the limits share."""
        return target_sensitivity(
            self.one_sided.of_sample(sample),
            self.errors,
            self.one_sided.limit,
            self.seeds.child("reject"),
            largest_failed_share=self.largest_failed_share,
        )

    def beyond(self, sample: MonteCarlo) -> YieldAtLimit:
        """Return the probability of a unit beyond the limits, from a sample and where it is rare from more units."""
        return yield_at_limit(
            ResponseLimit(
                experiment=self.experiment("beyond", self.one_sided.facing(self.response)), limit=self.one_sided.limit
            ),
            self.one_sided.of_sample(sample),
            samples=self.effort.level_units,
            runs=self.effort.level_runs,
            scaled=self.effort.widened_units,
            rare=self.effort.rare,
        )

    def inverse(self, choice: Choice) -> InverseSensitivity:
        """Return how far each zone may open alone, on the surrogate if one has earned its place."""
        return inverse_sensitivity(
            self.experiment("inverse", self.one_sided.facing(choice.chosen or self.response)),
            limit=self.one_sided.limit,
            target=self.target,
            units=max(self.effort.inverse_units, fewest_units(self.target)),
        )

    def choice(self, sample: MonteCarlo) -> Choice:
        """Return which surrogate has earned its place on the first units of a sample."""
        columns, outputs = self.response.columns, self.response.outputs
        candidates: list[Candidate] = list(self.model.stand_ins()) if self.leading == self.model.outputs[0] else []
        regressions: dict[str, Callable[[], Any]] = {}
        if len(columns) <= _MOST_COLUMNS:
            quadratic = {"quadratic regression": quadratic_regression}
            regressions = quadratic | {"sparse quadratic regression": sparse_quadratic_regression}
        elif not candidates:  # the products of so many columns would take minutes, and say no more
            regressions = {"linear regression": linear_regression}
        candidates += [
            RegressionCandidate(name=name, columns=columns, outputs=outputs, estimator=estimator)
            for name, estimator in regressions.items()
        ]
        few, evaluation = self.effort.surrogate_units, sample.evaluation
        return choose(
            self.response,
            candidates,
            sample.x[:few],
            self.seeds.child("surrogates"),
            quantile=self.target,
            largest_failed_share=self.largest_failed_share,
            evaluation=replace(evaluation, values=evaluation.values[:few], status=evaluation.status[:few]),
        )


def rank(asked: Measures, record: RunRecord) -> RankingResult:
    """Return what drives the outputs of a model at the zones of its drawing."""
    measures, model, effort = replace(asked, model=asked.model.observed(record.observe)), asked.model, asked.effort
    spectra, own = model.spectra, measures.experiment
    with one_blas_thread():
        with record.stage("random units", effort.units):
            measures, sample = measures.led_by(measures.sample())
        with record.stage("Sobol indices"):
            effect, cheap = measures.uncertain(sample), measures.cheap(sample)
            sobol = measures.sobol(tuple(name for names in spectra.values() for name in names), cheap)
        with record.stage("other measures"):
            shapley = measures.shapley()
            slopes = derived(measures.model, measures.leading, sample.x[sample.evaluation.good].std(axis=0))
            local = local_derivatives(own("local", slopes), effort.derivative_units)
            leading = own("centring", measures.response)
            centre = centring(leading, sample, measures.limits[measures.leading], local)
            classical = classical_estimate(own("classical", measures.response))
        with record.stage("units out of the limit"):
            reject, beyond = measures.reject(sample), measures.beyond(sample)
        with record.stage("surrogates"):
            choice = measures.choice(sample)
        with record.stage("zones alone"):
            inverse = measures.inverse(choice)
            if isinstance(choice.chosen, KeepsTables):
                choice.chosen.release()
    return RankingResult(
        model=model,
        errors=asked.errors,
        limits=measures.limits,
        first_limited=asked.leading,
        target=asked.target,
        outputs=measures.outputs,
        sample=sample,
        design=effort.design,
        sobol=sobol,
        by=asked.by,
        orders=order_contribution(sobol, spectra) if spectra else None,
        effect=effect,
        shapley=shapley,
        classical=classical,
        local=local,
        centring=centre,
        reject=reject,
        inverse=inverse,
        beyond=beyond,
        choice=choice,
    )
