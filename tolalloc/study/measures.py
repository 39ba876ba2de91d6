"""The measures of a study's sources: each on the same reducer and zones, with a node of the seed tree of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from tolalloc.capability.experiment import Experiment, Given
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import MonteCarlo, monte_carlo
from tolalloc.capability.rare_failure.response_limit import ResponseLimit
from tolalloc.capability.yield_at_limit import YieldAtLimit, yield_at_limit
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.drawing.seeds import SeedTree
from tolalloc.rv.response.kernel import PEAK_TO_PEAK, KernelResponse
from tolalloc.rv.response.outputs import REQUIREMENTS, OutputsResponse, orders_reading
from tolalloc.rv.stand_ins import ContactCandidate, CurveCandidate
from tolalloc.sensitivity.classical import ClassicalEstimate, classical_estimate
from tolalloc.sensitivity.derivatives import (
    DerivativeMeasures,
    LocalDerivatives,
    derivative_measures,
    local_derivatives,
)
from tolalloc.sensitivity.inverse import InverseSensitivity, fewest_units, inverse_sensitivity
from tolalloc.sensitivity.screening import (
    ElementaryEffects,
    MomentIndependent,
    elementary_effects,
    moment_independent,
)
from tolalloc.sensitivity.shapley import ShapleyEffects, shapley_effects
from tolalloc.sensitivity.sobol import Player, sobol_indices
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis
from tolalloc.sensitivity.target import TargetSensitivity, target_sensitivity
from tolalloc.study.definition import Prepared
from tolalloc.study.effort import RankingEffort
from tolalloc.surrogate.choice import Choice, choose
from tolalloc.surrogate.regression import RegressionCandidate, quadratic_regression, sparse_quadratic_regression
from tolalloc.surrogate.validation import Candidate

_ANGLES = (468, 936)
"""Angles at which the contact is solved without a search between them [-]."""
_MOST_COLUMNS = 100
"""Columns beyond which all products of two are more than the samples can tell apart [-]."""
_MULTIPLES = 4
"""Multiples of pins and teeth whose waves are ranked [-]."""


@dataclass(frozen=True, kw_only=True)
class Measures:
    """What may be measured of a prepared study.

    Parameters
    ----------
    prepared
        The checked study.
    kernel
        Its real model, observed.
    """

    prepared: Prepared
    kernel: KernelResponse

    @property
    def errors(self) -> ErrorModel:
        """Sources at the zones of the tolerance table."""
        return self.prepared.space.errors

    @cached_property
    def requirements(self) -> OutputsResponse:
        """All outputs that a requirement may limit, the peak-to-peak first."""
        return OutputsResponse(kernel=self.kernel)

    @cached_property
    def orders(self) -> tuple[int, ...]:
        """Orders of the output turn whose waves are ranked: 1, 2, and the multiples of teeth and pins."""
        stage = self.prepared.reducer.cycloid_stage
        multiples = {number * own for number in range(1, _MULTIPLES + 1) for own in (stage.disc_teeth, stage.pin_count)}
        return tuple(sorted({1, 2, *multiples}))

    @cached_property
    def limits(self) -> dict[str, Limits]:
        """Limits by output, the peak-to-peak first."""
        study = self.prepared.study
        return {PEAK_TO_PEAK: Limits(upper=study.limit_arcsec), **study.other_limits}

    @property
    def _effort(self) -> RankingEffort:
        return self.prepared.study.effort.ranking

    @property
    def _failed_share(self) -> float:
        return self.prepared.study.largest_failed_share

    def _seeds(self, name: str) -> SeedTree:
        return SeedTree(self.prepared.study.seed).child("rank", name)

    def _experiment(self, name: str, response: Given) -> Experiment[Given]:
        return Experiment.of(response, self.errors, self._seeds(name), self._failed_share)

    def sample(self) -> MonteCarlo:
        """Return random units with all outputs."""
        effort = self._effort
        return monte_carlo(
            self._experiment("units", self.requirements),
            effort.units,
            effort.design,
        )

    def sobol(self, name: str, orders: tuple[int, ...], blocks: int = 0) -> SobolAnalysis:
        """Return the indices of all requirements and of the waves of the orders.

        Parameters
        ----------
        name
            Node of the seed tree.
        orders
            Orders of the output turn [-].
        blocks
            Number of blocks, without pairs; as many as the ranking needs if 0 [-].
        """
        errors, effort = self.errors, self._effort.sobol
        readings = (*REQUIREMENTS, orders_reading(orders)) if orders else REQUIREMENTS
        return sobol_indices(
            self._experiment(name, replace(self.requirements, readings=readings)),
            replace(effort, start=blocks, limit=blocks, second_order=False) if blocks else effort,
            Player.BLOCK if errors.is_correlated else Player.SOURCE,
            ranked=tuple(self.limits),
        )

    def shapley(self) -> ShapleyEffects | None:
        """Return the shares of correlated sources; none where all are independent."""
        if not self.errors.is_correlated:
            return None
        return shapley_effects(self._experiment("shapley", self.kernel), self._effort.permutations)

    def classical(self) -> ClassicalEstimate:
        """Return what a hand calculation says."""
        return classical_estimate(self._experiment("classical", self.kernel))

    def local(self) -> LocalDerivatives:
        """Return the derivatives by every source."""
        return local_derivatives(self._experiment("local", self.kernel), self._effort.derivative_units)

    def derivatives(self) -> DerivativeMeasures:
        """Return what the derivatives bound."""
        return derivative_measures(self._experiment("derivatives", self.kernel), self._effort.derivative_units)

    def effects(self) -> ElementaryEffects:
        """Return Morris' elementary effects."""
        return elementary_effects(self._experiment("effects", self.kernel), self._effort.trajectories)

    def moments(self, sample: MonteCarlo) -> MomentIndependent:
        """Return PAWN and delta of the first units of a sample."""
        first, seeds = _first(sample, self._effort.moment_units), self._seeds("moments")
        return moment_independent(first, self.errors, seeds, largest_failed_share=self._failed_share)

    def reject(self, sample: MonteCarlo) -> TargetSensitivity:
        """Return what the units of a sample beyond the limit share."""
        limit, seeds = self.prepared.study.limit_arcsec, self._seeds("reject")
        return target_sensitivity(sample, self.errors, limit, seeds, largest_failed_share=self._failed_share)

    def beyond(self, sample: MonteCarlo) -> YieldAtLimit:
        """Return the probability of a unit beyond the limit, from a sample and where it is rare from more units."""
        effort, limit = self._effort, self.prepared.study.limit_arcsec
        return yield_at_limit(
            ResponseLimit(experiment=self._experiment("beyond", self.kernel), limit=limit),
            sample,
            samples=effort.level_units,
            runs=effort.level_runs,
            weighted=effort.widened_units,
        )

    def inverse(self, choice: Choice) -> InverseSensitivity:
        """Return how far each zone may open alone, on the surrogate if one has earned its place."""
        asked = self.prepared.study
        return inverse_sensitivity(
            self._experiment("inverse", choice.chosen or self.kernel),
            limit=asked.limit_arcsec,
            target=asked.yield_target,
            units=max(self._effort.inverse_units, fewest_units(asked.yield_target)),
        )

    def choice(self, sample: MonteCarlo) -> Choice:
        """Return which stand-in for the kernel has earned its place on the first units of a sample."""
        columns, outputs = self.kernel.columns, self.kernel.outputs
        candidates: list[Candidate] = [ContactCandidate(kernel=self.kernel, angles=angles) for angles in _ANGLES]
        if len(columns) <= _MOST_COLUMNS:
            candidates.append(CurveCandidate(kernel=self.kernel))
            candidates += [
                RegressionCandidate(name=name, columns=columns, outputs=outputs, estimator=estimator)
                for name, estimator in (
                    ("quadratic regression", quadratic_regression),
                    ("sparse quadratic regression", sparse_quadratic_regression),
                )
            ]
        x = sample.x[: self._effort.surrogate_units]
        return choose(
            self.kernel,
            candidates,
            x,
            self._seeds("surrogates"),
            quantile=self.prepared.study.yield_target,
            largest_failed_share=self._failed_share,
        )


def _first(sample: MonteCarlo, units: int) -> MonteCarlo:
    """Return the first units of a sample."""
    evaluation = sample.evaluation
    return MonteCarlo(
        x=sample.x[:units],
        evaluation=replace(evaluation, values=evaluation.values[:units], status=evaluation.status[:units]),
    )
